//! A device whose texts are made for steering a terminal, and what becomes of them in every output.

use super::Bench;
use std::fs;

/// ESC and BEL, the one-character form of ESC [, an override of the direction of writing.
const NAME: &str = r#""MH4\u001b[2J\u0007\u009b31m\u001b]0;owned\u0007""#;

fn bench() -> Bench {
    Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\n\
         set = {{ \"0x1008\" = {NAME}, \"0x1009\" = {NAME}, \"0x100A\" = {NAME} }}\n"
    ))
}

/// What a terminal takes for a command: control characters but the ends of lines.
fn steering(text: &str) -> Option<char> {
    text.chars().find(|&c| c.is_control() && c != '\n')
}

const COMMANDS: [&str; 13] = [
    "scan",
    "scan --passive",
    "info 5",
    "info 5 --device mh4",
    "read 5",
    "sdo read 5 0x1008",
    "sdo read 5 0x1008 0x1009 0x100A",
    "sdo write 5 0x1008 x",
    "nmt state 5",
    "errors 5",
    "pdo show 5",
    "lss scan",
    "log 5 --count 3 --sync 50ms --device mh4",
];

#[test]
fn no_output_steers_a_terminal() {
    let bench = bench();
    for line in COMMANDS {
        for format in ["text", "json", "csv"] {
            let done = bench.run(&format!("{line} --format {format} -v --color never"));
            for (what, text) in [("stdout", &done.stdout), ("stderr", &done.stderr)] {
                assert_eq!(steering(text), None, "{line} --format {format}, {what}: {text:?}");
            }
        }
    }
    // It was there to be seen, and its value is not lost in JSON.
    let shown = bench.run("scan").exit(0).stdout;
    assert!(shown.contains("MH4\\x1B[2J\\x07\\x9B31m"), "{shown}");
    let value = bench.run("sdo read 5 0x1008 --format json").exit(0).json();
    assert_eq!(value[0]["value"], "MH4\u{1b}[2J\u{7}\u{9b}31m\u{1b}]0;owned\u{7}");
}

#[test]
fn neither_does_it_in_colour() {
    let bench = bench();
    for line in ["log 5 -o no\u{1b}[2J/such", "read 5 --device \u{1b}[2Jx"] {
        let done = bench.run(&format!("{line} --color always"));
        assert!(done.stderr.contains("\u{1b}["), "it is coloured: {:?}", done.stderr);
        assert!(done.stderr.contains("\\x1B[2J") && !done.stderr.contains("\u{1b}[2J"), "{:?}", done.stderr);
    }
}

#[test]
fn neither_does_what_files_say() {
    let bench = bench();
    fs::write(bench.path("own.toml"), "name = \"a\u{9b}31m\\u001b[2J\"\nvendor = 5\n").expect("a file");
    fs::write(bench.path("own.eds"), "[FileInfo]\n\u{1b}[2J\u{9b}=3\n[1000]\nParameterName=\u{1b}[31m\n")
        .expect("a file");
    for line in [
        "read 5 --device own.toml",
        "read 5 --eds own.eds",
        "scan --eds own.eds -v",
        "read 5 \u{1b}[2Jx",
        "check 5 pres\u{1b}[2Jsure<1",
        "log 5 -o no\u{1b}[2J/such",
        "-b sim:\u{1b}[2J@5 scan",
    ] {
        for format in ["text", "json"] {
            let done = bench.run(&format!("{line} --format {format}"));
            assert_eq!((steering(&done.stdout), steering(&done.stderr)), (None, None), "{line:?}: {done:?}");
            assert!(!done.stderr.is_empty(), "{line:?}");
        }
    }
}

/// Where `-o` and the like lead is the user's business.
#[test]
#[cfg(unix)]
fn links_fifos_and_standard_output_are_written_as_they_are() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::{Command, Stdio};
    let bench = bench();
    let rows = "log 5 pressure --count 2 --sync 50ms --device mh4";
    let lines = |text: String| text.lines().count();

    // A link to nothing makes what it points at; one to a file guards that file, and stays a link.
    symlink("target.csv", bench.path("link.csv")).expect("a link");
    bench.run(&format!("{rows} -o link.csv")).exit(0);
    assert_eq!(lines(bench.text("target.csv")), 3);
    bench.run(&format!("{rows} -o link.csv")).exit(2);
    bench.run(&format!("{rows} -o link.csv --force")).exit(0);
    assert!(bench.path("link.csv").symlink_metadata().expect("a link").is_symlink());
    assert_eq!(lines(bench.text("target.csv")), 3);

    // A FIFO is written to whoever reads it.
    assert!(Command::new("mkfifo").arg(bench.path("fifo")).status().expect("mkfifo").success());
    let path = bench.path("fifo");
    let reader = std::thread::spawn(move || fs::read_to_string(path));
    bench.run(&format!("{rows} -o fifo")).exit(0);
    assert_eq!(lines(reader.join().expect("a thread").expect("text")), 3);

    // Standard output is a pipe here, and in the next lines a file with something in it.
    let done = bench.run(&format!("{rows} -o /dev/stdout")).exit(0);
    assert_eq!(lines(done.stdout), 3);
    fs::write(bench.path("all.txt"), "before\n").expect("a file");
    let file = fs::OpenOptions::new().append(true).open(bench.path("all.txt")).expect("the file");
    let words: Vec<&str> = rows.split(' ').chain(["-o", "/dev/stdout"]).collect();
    let child = bench.traced(&words).stdout(file).stderr(Stdio::piped()).spawn().expect("the binary");
    bench.end(child).exit(0);
    let text = bench.text("all.txt");
    assert!(text.starts_with("before\ntime,") && lines(text.clone()) == 4, "{text}");

    // Who else may read it is said by the umask alone.
    let program = env!("CARGO_BIN_EXE_cangauge");
    for (umask, mode) in [("077", 0o600), ("022", 0o644), ("000", 0o666)] {
        let script = format!(
            "umask {umask}; {program} -b sim:bench.toml {rows} -o out-{umask}.csv --summary sum-{umask}.json \
             --trace trace-{umask}"
        );
        let mut shell = Command::new("sh");
        shell.env_clear().current_dir(bench.folder.path()).args(["-c", &script]).stderr(Stdio::null());
        assert!(shell.status().expect("sh").success());
        for name in ["out", "sum", "trace"] {
            let files = bench.files();
            let file = files.iter().find(|file| file.starts_with(&format!("{name}-{umask}"))).expect("a file");
            let metadata = bench.path(file).metadata().expect("its mode");
            assert_eq!(metadata.permissions().mode() & 0o777, mode, "{file}");
        }
    }
}
