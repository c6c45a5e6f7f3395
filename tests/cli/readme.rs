//! The README: its terminal picture shows real output, and its commands work as printed.

use super::examples::{readme, words};
use super::{ALL, Bench};
use std::fs;
use std::io::ErrorKind as IoError;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The commands of the terminal picture.
const PICTURE: [&str; 4] = [
    "cangauge -b sim scan",
    "cangauge -b sim read 1,127",
    "cangauge -b sim log 1,127 pressure --sync 100ms --duration 6s -o run.csv",
    "cangauge -b sim check 1 'pressure in 0.5..2 bar' 'temperature < 20 degC'",
];

/// The lines around the terminal picture.
const START: &str = "<!-- terminal: UPDATE_GENERATED=1 cargo test --test cli readme -->\n";
const END: &str = "<!-- end -->\n";

fn path() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")
}

/// The fenced blocks of a language.
fn blocks(language: &str) -> Vec<String> {
    let start = format!("```{language}\n");
    readme().split(&start).skip(1).filter_map(|rest| rest.split("```").next()).map(str::to_owned).collect()
}

/// Runs the commands on the devices of `-b sim`, with the virtual clock: the output is always the same.
fn picture() -> String {
    let bench = Bench::of(ALL);
    let session = PICTURE.map(|command| {
        let words = words(command);
        let words: Vec<&str> = words.iter().skip(3).map(String::as_str).collect();
        let done = bench.run_words(&words);
        format!("$ {command}\n{}{}", done.stdout, done.stderr)
    });
    format!("```text\n{}```\n", session.join("\n"))
}

#[test]
fn the_terminal_picture_is_up_to_date() {
    let readme = readme();
    let (before, rest) = readme.split_once(START).expect("the start of the picture");
    let (_, after) = rest.split_once(END).expect("the end of the picture");
    let wanted = format!("{before}{START}{}{END}{after}", picture());
    if std::env::var_os("UPDATE_GENERATED").is_some_and(|value| value == "1") {
        fs::write(path(), wanted).expect("written");
    } else {
        assert!(
            readme == wanted,
            "the picture is stale: UPDATE_GENERATED=1 cargo test --test cli readme\n{}",
            picture()
        );
    }
}

/// The path of a shell that finds the program.
fn search_path() -> String {
    let folder = Path::new(env!("CARGO_BIN_EXE_cangauge")).parent().expect("a folder");
    format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default())
}

#[test]
#[cfg(unix)]
fn commands_of_the_picture_work_in_a_shell() {
    let folder = tempfile::tempdir().expect("a folder");
    for (at, command) in PICTURE.iter().enumerate() {
        let mut shell = Command::new("sh");
        shell.env("PATH", search_path()).current_dir(folder.path()).args(["-c", command]);
        let done = shell.output().expect("sh");
        let is_check = at == PICTURE.len() - 1;
        assert_eq!(done.status.code(), Some(i32::from(is_check)), "{command}: {done:?}");
    }
    assert!(folder.path().join("run.csv").exists());
}

/// The install commands name files that exist.
#[test]
fn installed_files_exist() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
    let install = blocks("sh").into_iter().find(|block| block.contains("cargo install")).expect("a block");
    assert!(install.contains("cangauge completions install"));
    for section in ["1", "5", "7"] {
        let pages = fs::read_dir(folder.join("man")).expect("the folder").filter_map(Result::ok);
        assert!(pages.into_iter().any(|page| page.path().extension().is_some_and(|found| found == section)));
    }
}

/// Every device is named, and the rows of the table have the defaults of the descriptions.
#[test]
fn every_built_in_device_is_listed() {
    let text = readme();
    for model in cangauge::device::catalog::built_in() {
        let (name, factory) = (&model.description.name, &model.description.factory);
        assert!(text.contains(&format!("`{name}`")) || text.contains(&format!("`--device {name}`")), "{name}");
        let unknown = || "unknown".to_owned();
        let node = factory.node_id.map_or_else(unknown, |node| node.to_string());
        let rate = factory.bit_rate.map_or_else(unknown, |rate| format!("{} kbit/s", rate / 1000));
        let row = format!("| `{name}` | {node} | {rate} |");
        assert!(text.contains(&row) || !text.contains(&format!("| `{name}` |")), "{row}");
    }
}

#[test]
#[cfg(unix)]
fn the_python_example_works() {
    let [example] = blocks("python").try_into().expect("one example");
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/python");
    let mut python = Command::new("python3");
    python.env("CANGAUGE", env!("CARGO_BIN_EXE_cangauge")).env("PYTHONPATH", package).args(["-B", "-c", &example]);
    let done = match python.output() {
        Err(error) if error.kind() == IoError::NotFound => {
            return writeln!(std::io::stderr(), "SKIPPED: there is no python3").expect("stderr");
        }
        done => done.expect("python3"),
    };
    let stdout = String::from_utf8_lossy(&done.stdout);
    assert!(done.status.success(), "{}", String::from_utf8_lossy(&done.stderr));
    assert_eq!(stdout.lines().count(), 3, "{stdout}");
    assert!(stdout.starts_with("1 pressure 1.") && stdout.contains(" psi None\n"), "{stdout}");
}
