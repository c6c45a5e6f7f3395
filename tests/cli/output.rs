//! Data goes to stdout, everything else to stderr; closed pipes, full disks, colour, and `--trace`.

use super::{ALL, Bench, closed_pipe};
use std::fs;
#[cfg(target_os = "linux")]
use std::process::Command;
use std::process::Stdio;

/// Commands that print to stdout.
const PRINTING: [&str; 7] = [
    "scan",
    "read 1,127",
    "sdo read 1 0x1018:1",
    "nmt state 1",
    "log 127 --count 5",
    "log 127 --count 5 --format json",
    "completions bash",
];

#[test]
fn closed_stdout_is_a_silent_success() {
    let bench = Bench::of(ALL);
    for line in PRINTING {
        let words: Vec<&str> = line.split(' ').collect();
        let child = bench.traced(&words).stdout(closed_pipe()).stderr(Stdio::piped()).spawn().expect("the binary");
        // A recording that has not reached its --count is not complete.
        if line.contains("--count") {
            let done = bench.end(child).exit(8);
            assert!(done.stderr.contains("the output was closed before the end: "), "{line}: {}", done.stderr);
            continue;
        }
        let done = bench.end(child).exit(0);
        assert!(!done.stderr.contains("cangauge:") && !done.stderr.contains("warning"), "{line}: {}", done.stderr);
    }
    for words in [["--help"], ["--version"], ["help"]] {
        let child = bench.command(&words).stdout(closed_pipe()).stderr(Stdio::piped()).spawn().expect("the binary");
        assert_eq!(bench.end(child).exit(0).stderr, "", "{words:?}");
    }
}

#[test]
#[cfg(target_os = "linux")]
fn full_disk_is_an_error() {
    let bench = Bench::of(ALL);
    for line in PRINTING {
        let words: Vec<&str> = line.split(' ').collect();
        let child = bench.traced(&words).stdout(super::full_disk()).stderr(Stdio::piped()).spawn().expect("the binary");
        let done = bench.end(child).exit(8);
        let said = done.stderr.lines().any(|line| line.contains("No space left on device"));
        assert!(said, "{line}: {}", done.stderr);
    }
}

/// A closed descriptor is not a closed pipe: the data is lost, so it is an error.
#[test]
#[cfg(target_os = "linux")]
fn closed_descriptor_of_stdout_is_an_error() {
    let bench = Bench::of(ALL);
    let run = |line: &str| {
        let mut command = std::process::Command::new("sh");
        command.env_clear().current_dir(bench.path("")).args(["-c", "exec \"$@\" >&-", "sh"]);
        command.args([env!("CARGO_BIN_EXE_cangauge"), "-b", &bench.bus]).args(line.split(' '));
        bench.finish(&mut command)
    };
    let others =
        ["--help", "check 1 temperature<99", "log 1 --sync 10ms --count 1 -o /dev/stdout", "devices", "export dbc 1"];
    for line in PRINTING.into_iter().chain(others) {
        let done = run(line).exit(8);
        let says = done.stderr.lines().any(|line| line.contains("write to stdout: it is closed"));
        assert!(says, "{line}: {}", done.stderr);
    }
    run("log 127 --sync 10ms --count 1 -o run.csv").exit(0);
}

#[test]
fn quiet_prints_only_errors() {
    let bench = Bench::of(ALL);
    for line in ["scan -q", "nmt start 1 -q", "log 1 --sync 10ms --count 3 -q", "log 1,127 --sync 10ms --count 30 -q"] {
        let done = bench.run(line).exit(0);
        assert_eq!(done.stderr, "", "{line}");
        assert!(!done.stdout.is_empty());
    }
    let done = bench.run("read 9 -q").exit(3);
    assert!(done.stderr.starts_with("cangauge: node 9: "), "{}", done.stderr);
}

#[test]
fn colour_only_on_a_terminal_or_on_request() {
    let bench = Bench::of(ALL);
    let run = |words: &[&str], environment: &[(&str, &str)]| {
        let mut command = bench.traced(words);
        bench.finish(command.envs(environment.iter().copied())).stderr
    };
    let coloured = |text: &str| text.contains('\u{1b}');
    assert!(!coloured(&run(&["read", "9"], &[])), "no terminal");
    assert!(coloured(&run(&["read", "9", "--color", "always"], &[])));
    assert!(!coloured(&run(&["read", "9", "--color", "never"], &[("CLICOLOR_FORCE", "1")])));
    assert!(coloured(&run(&["read", "9"], &[("CLICOLOR_FORCE", "1")])));
    assert!(!coloured(&run(&["read", "9"], &[("CLICOLOR_FORCE", "1"), ("NO_COLOR", "1")])));
    assert!(!coloured(&run(&["read", "200"], &[])));
}

#[test]
fn trace_has_the_format_of_candump() {
    let bench = Bench::of("mh4@5");
    bench.run("sdo read 5 0x1018:1").prints("71\n");
    let trace = bench.text("trace");
    let lines: Vec<&str> = trace.lines().collect();
    assert_eq!(lines.len(), 3, "{trace}");
    assert_eq!(lines[0], "(1767225600.000000) sim 605#4018100100000000");
    assert!(lines[2].starts_with("(1767225600.00") && lines[2].ends_with(") sim 585#4318100147000000"), "{trace}");
    let done = bench.finish(&mut bench.command(&["-b", &bench.bus, "--trace", "-", "sdo", "read", "5", "0x1018:1"]));
    assert_eq!(done.exit(0).stderr, trace);
    // A wrong value is found before the trace is opened, and a trace that cannot be written before the bus is opened.
    fs::remove_file(bench.path("trace")).expect("removed");
    bench.run("sdo write 5 0x1017 70000").exit(2);
    assert!(!bench.path("trace").exists());
    let words = ["-b", &bench.bus, "--trace", "no/such/folder", "scan"];
    bench
        .finish(&mut bench.command(&words))
        .fails(8, "cangauge: write trace no/such/folder: No such file or directory (os error 2)\n");
}

#[test]
#[cfg(target_os = "linux")]
fn trace_on_a_full_disk_is_an_error() {
    let bench = Bench::of("mh4@5");
    let words = ["-b", &bench.bus, "--trace", "/dev/full", "sdo", "read", "5", "0x1018:1"];
    let done = bench.finish(&mut bench.command(&words)).exit(8);
    assert!(done.stderr.contains("No space left on device"), "{}", done.stderr);
}

/// What a terminal receives from a command on the simulated bus.
#[cfg(target_os = "linux")]
fn on_terminal(line: &str) -> String {
    let command = format!("{} -b sim {line}", env!("CARGO_BIN_EXE_cangauge"));
    let mut script = Command::new("script");
    script.env_remove("NO_COLOR").env("TERM", "xterm").args(["-qec", &command, "/dev/null"]).stdin(Stdio::null());
    String::from_utf8(script.output().expect("script, of util-linux").stdout).expect("text")
}

#[cfg(target_os = "linux")]
#[test]
fn a_terminal_shows_colours_and_progress() {
    let check = "check 1 'pressure > 0 bar' 'temperature < 1 degC'";
    let colored = on_terminal(check);
    assert!(colored.contains("\u{1b}[32mok\u{1b}[0m    pressure > 0 bar"), "{colored:?}");
    assert!(colored.contains("\u{1b}[1m\u{1b}[31mFAIL\u{1b}[0m  temperature < 1 degC"), "{colored:?}");
    for plain in [format!("--color never {check}"), format!("{check} --format json")] {
        assert!(!on_terminal(&plain).lines().next().unwrap_or_default().contains('\u{1b}'), "{plain}");
    }
    assert!(on_terminal("scan 1,2").contains("asking the nodes"));
    let quiet = on_terminal("scan 1,2 --progress never --color never");
    assert!(!quiet.contains("asking") && !quiet.contains('\u{1b}'), "{quiet:?}");
}
