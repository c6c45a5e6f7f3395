//! A device whose texts contain control sequences for terminals. No output passes them on.

use super::Bench;
use std::fs;

/// ESC, BEL, the one-character form of ESC [, and a character that changes the writing direction.
const NAME: &str = r#""MH4\u001b[2J\u0007\u009b31m\u001b]0;owned\u0007""#;

fn bench() -> Bench {
    Bench::described(&format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\n\
         set = {{ \"0x1008\" = {NAME}, \"0x1009\" = {NAME}, \"0x100A\" = {NAME} }}\n"
    ))
}

/// The first character that controls a terminal, except line ends.
fn control_character(text: &str) -> Option<char> {
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
fn output_contains_no_control_characters() {
    let bench = bench();
    for line in COMMANDS {
        for format in ["text", "json", "csv"] {
            let done = bench.run(&format!("{line} --format {format} -v --color never"));
            for (what, text) in [("stdout", &done.stdout), ("stderr", &done.stderr)] {
                assert_eq!(control_character(text), None, "{line} --format {format}, {what}: {text:?}");
            }
        }
    }
    // The text is shown with escapes, and JSON keeps its value.
    let shown = bench.run("scan").exit(0).stdout;
    assert!(shown.contains("MH4\\x1B[2J\\x07\\x9B31m"), "{shown}");
    let value = bench.run("sdo read 5 0x1008 --format json").exit(0).json();
    assert_eq!(value[0]["value"], "MH4\u{1b}[2J\u{7}\u{9b}31m\u{1b}]0;owned\u{7}");
}

#[test]
fn coloured_output_contains_no_control_characters_of_devices() {
    let bench = bench();
    for line in ["log 5 -o no\u{1b}[2J/such", "read 5 --device \u{1b}[2Jx"] {
        let done = bench.run(&format!("{line} --color always"));
        assert!(done.stderr.contains("\u{1b}["), "it is coloured: {:?}", done.stderr);
        assert!(done.stderr.contains("\\x1B[2J") && !done.stderr.contains("\u{1b}[2J"), "{:?}", done.stderr);
    }
}

#[test]
fn texts_of_files_are_escaped_too() {
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
            assert_eq!(
                (control_character(&done.stdout), control_character(&done.stderr)),
                (None, None),
                "{line:?}: {done:?}"
            );
            assert!(!done.stderr.is_empty(), "{line:?}");
        }
    }
}

/// `-o` may name a link, a FIFO or a device.
#[test]
#[cfg(unix)]
fn links_fifos_and_standard_output_can_be_written() {
    use std::os::unix::fs::{PermissionsExt, symlink};
    use std::process::{Command, Stdio};
    let bench = bench();
    let rows = "log 5 pressure --count 2 --sync 50ms --device mh4";
    let lines = |text: String| text.lines().count();

    // A dangling link: its target is created. A link to an existing file: the file is refused, and the link stays.
    symlink("target.csv", bench.path("link.csv")).expect("a link");
    bench.run(&format!("{rows} -o link.csv")).exit(0);
    assert_eq!(lines(bench.text("target.csv")), 3);
    bench.run(&format!("{rows} -o link.csv")).exit(2);
    bench.run(&format!("{rows} -o link.csv --force")).exit(0);
    assert!(bench.path("link.csv").symlink_metadata().expect("a link").is_symlink());
    assert_eq!(lines(bench.text("target.csv")), 3);

    // A FIFO.
    assert!(Command::new("mkfifo").arg(bench.path("fifo")).status().expect("mkfifo").success());
    let path = bench.path("fifo");
    let reader = std::thread::spawn(move || fs::read_to_string(path));
    bench.run(&format!("{rows} -o fifo")).exit(0);
    assert_eq!(lines(reader.join().expect("a thread").expect("text")), 3);

    // Standard output: first a pipe, then a file with content.
    let done = bench.run(&format!("{rows} -o /dev/stdout")).exit(0);
    assert_eq!(lines(done.stdout), 3);
    fs::write(bench.path("all.txt"), "before\n").expect("a file");
    let file = fs::OpenOptions::new().append(true).open(bench.path("all.txt")).expect("the file");
    let words: Vec<&str> = rows.split(' ').chain(["-o", "/dev/stdout"]).collect();
    let child = bench.traced(&words).stdout(file).stderr(Stdio::piped()).spawn().expect("the binary");
    bench.end(child).exit(0);
    let text = bench.text("all.txt");
    assert!(text.starts_with("before\ntime,") && lines(text.clone()) == 4, "{text}");

    // The umask alone decides who can read a new file.
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
