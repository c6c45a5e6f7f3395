//! Wrong arguments are reported before the bus is opened.

use super::{ALL, Bench};
use serde_json::json;

#[test]
fn nodes_are_never_clamped() {
    let bench = Bench::of(ALL);
    for command in ["read", "log", "scan", "nmt state", "nmt reset"] {
        for node in ["0", "128", "200", "-1", "a", "1-200", "1,0", "0x80", "1-"] {
            let line = format!("{command} {node}");
            let done = bench.run(&line).exit(2);
            assert_eq!((done.stdout.as_str(), done.frames.len()), ("", 0), "{line}");
        }
    }
    bench.run("read 200").refuses("\"200\" is not a valid node-ID (1 to 127; examples: 5, 0x7f, 1-16, 1,5, all)");
    bench.run("read 0").refuses("\"0\" is not a valid node-ID (1 to 127; examples: 5, 0x7f, 1-16, 1,5, all)");
    bench.run("read 5-1").refuses("\"5-1\" is in the wrong order: 1-5");
    bench.run("sdo read 200 0x1018:1").refuses("\"200\" is not a node-ID (1 to 127)");
    let done = bench.run("read 1,0x7f pressure -f csv").exit(0);
    assert_eq!(done.stdout.lines().count(), 3, "{}", done.stdout);
}

#[test]
fn hint_names_the_help_of_the_command() {
    let done = Bench::of(ALL).run("--retries 0 nmt start 200").exit(2);
    assert_eq!(done.stderr.lines().nth(1), Some("hint: cangauge nmt start --help"));
    let done = Bench::of(ALL).run("log 1 --retries many").exit(2);
    assert_eq!(done.stderr, "cangauge: \"many\" for --retries <N>: not a whole number\nhint: cangauge log --help\n");
}

#[test]
fn wrong_arguments_are_explained() {
    let bench = Bench::of(ALL);
    let first = |line: &str| {
        let done = bench.run(line).exit(2);
        assert_eq!(done.stderr.lines().count(), 2, "a cause and a hint: {}", done.stderr);
        done.stderr.lines().next().unwrap_or("").to_owned()
    };
    assert_eq!(first("scam"), "cangauge: unrecognized subcommand 'scam'");
    for load in ["50", "0%", "101%", "half"] {
        let expected = format!("cangauge: \"{load}\" for --max-load <SHARE>: not a bus load (5% to 100%)");
        assert_eq!(first(&format!("scan --max-load {load}")), expected);
    }
    assert_eq!(first("nmt jump 1"), "cangauge: unrecognized subcommand 'jump'");
    assert_eq!(first("read"), "cangauge: the following required arguments were not provided: <NODES>");
    assert_eq!(first("read 1 --sync 1s"), "cangauge: unexpected argument '--sync' found");
    assert_eq!(first("read 1 -t 5"), "cangauge: \"5\" has no unit (500ms, 10s, 1h30m)");
    assert_eq!(first("read 1 -t 0s"), "cangauge: \"0s\" for --timeout <DUR>: a duration must be longer than 0");
    assert_eq!(first("log 1 --count 0"), "cangauge: \"0\" is not a number of rows (1 or more)");
    assert_eq!(first("log 1 --sync 10us"), "cangauge: \"10us\" is too short for SYNC (1ms or more)");
    assert_eq!(
        first("read 1 --format xml"),
        "cangauge: invalid value 'xml' for '--format <FORM>' [possible values: text, json, csv, influx]"
    );
    assert_eq!(
        first("log 1 --sync 1s --poll 1s"),
        "cangauge: the argument '--sync <DUR>' cannot be used with '--poll <DUR>'"
    );
    assert!(first("log 1 --sync 1s --passive").contains("cannot be used with"));
    assert!(first("log 1 --poll 1s --passive").contains("cannot be used with"));
    assert!(first("-q -v scan").contains("cannot be used with"));
    assert!(first("nmt start 1 --confirm --no-wait").contains("cannot be used with"));
}

#[test]
fn usage_errors_are_json_with_format_json() {
    for line in ["read 200 --format json", "read 200 -f json", "--format=json read 200"] {
        let done = Bench::of(ALL).run(line).exit(2);
        assert_eq!(
            done.error(),
            json!({"error": {"kind": "usage", "exit": 2, "node": null, "object": null, "abort": null,
                "message": "\"200\" is not a valid node-ID (1 to 127; examples: 5, 0x7f, 1-16, 1,5, all)",
                "hint": "cangauge read --help"}})
        );
    }
}

#[test]
fn help_and_version_go_to_stdout() {
    let bench = Bench::of(ALL);
    for words in [vec!["--help"], vec!["-h"], vec!["help"], vec!["log", "--help"], vec!["help", "sdo", "read"]] {
        let done = bench.finish(&mut bench.command(&words)).exit(0);
        assert!(done.stdout.contains("Usage: cangauge") && done.stderr.is_empty(), "{words:?}");
        let long = done.stdout.lines().find(|line| line.chars().count() > 100);
        assert_eq!(long, None, "{words:?}");
    }
    let done = bench.finish(&mut bench.command(&["--version"]));
    assert_eq!(done.exit(0).stdout, format!("cangauge {}\n", env!("CARGO_PKG_VERSION")));
    // Without a command, the help goes to stderr.
    for words in [vec![], vec!["sdo"], vec!["nmt"]] {
        let done = bench.finish(&mut bench.command(&words)).exit(2);
        assert!(done.stderr.contains("Usage: cangauge") && done.stdout.is_empty(), "{words:?}");
    }
}

#[test]
fn global_options_work_before_and_after_the_command() {
    let bench = Bench::of("mh4@5");
    let bus = bench.bus.as_str();
    for words in [
        vec!["-b", bus, "-f", "csv", "-q", "scan", "5"],
        vec!["scan", "5", "-b", bus, "-f", "csv", "-q"],
        vec!["scan", "-q", "5", "--format=csv", "--bus", bus],
    ] {
        let done = bench.finish(&mut bench.command(&words)).exit(0);
        assert_eq!(done.stdout.lines().count(), 2, "{words:?}");
    }
    let done = bench.finish(bench.command(&["sdo", "read", "5", "1018:1"]).env("CANGAUGE_BUS", bus));
    done.prints("71\n");
}

#[test]
fn invalid_bus_names_are_refused() {
    let bench = Bench::of(ALL);
    let run = |bus: &str| bench.finish(&mut bench.command(&["-b", bus, "scan"]));
    run("foo:bar")
        .refuses("\"foo:bar\" is not a bus (can0, socketcan:can0, socketcand://HOST/can0, slcan:/dev/ttyACM0@250k, sim, sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE)");
    run("").refuses("\"\" is not the name of an interface");
    run("a-name-that-is-too-long").refuses("\"a-name-that-is-too-long\" is not the name of an interface");
    run("sim:mh4").refuses("\"mh4\" is neither DEVICE@NODE (mh4@1,d20@2,mc1609@3,dps@127) nor a file (FILE.toml)");
    run("sim:mh5@5").refuses(&no_device());
    run("sim:mh4@128").refuses("mh4@128: \"128\" is not a node-ID (1 to 127)");
    run("sim:none.toml").fails(8, "cangauge: none.toml: No such file or directory (os error 2)\n");
    std::fs::write(bench.path("bad.toml"), "clock = \"virtual\"\nsped = 1\n").expect("written");
    let done = run("sim:bad.toml").exit(2);
    assert!(done.stderr.starts_with("cangauge: bad.toml:2:1: unknown field `sped`"), "{}", done.stderr);
}

#[test]
fn mistakes_in_files_are_one_line_with_their_place() {
    let bench = Bench::of(ALL);
    let long = format!("x = [{}@ ]\n", "1, ".repeat(400));
    let key = format!("{} = 1\n", "k".repeat(500));
    for (text, place) in
        [("[[x]\n", ":1:"), (long.as_str(), ":1:1206: "), (key.as_str(), ":1:1: "), ("\n\n x = \n", ":3:")]
    {
        std::fs::write(bench.path("bad.toml"), text).expect("written");
        let device = ["--device", "bad.toml", "read", "1"];
        let apply = ["config", "apply", "1", "bad.toml"];
        let used = bench.finish(&mut bench.command(&["-b", "sim:bad.toml", "scan"]));
        let others = [&device[..], &apply].map(|words| bench.run_words(words));
        for done in others.into_iter().chain([used]) {
            let done = done.exit(2);
            let first = done.stderr.lines().find(|line| line.contains("bad.toml")).unwrap_or_default();
            assert!(first.contains(&format!("bad.toml{place}")), "{}", done.stderr);
            assert!(first.chars().count() <= 200 + "cangauge: ".len(), "{}", done.stderr);
        }
        let done = bench.run_words(&["devices", "check", "bad.toml"]).exit(2);
        assert!(done.stdout.lines().all(|line| line.chars().count() <= 200), "{}", done.stdout);
        assert!(done.stdout.contains(&format!("bad.toml{place}")), "{}", done.stdout);
    }
}

#[test]
fn sim_requires_a_shared_bus() {
    Bench::of(ALL).run("sim mh4@5").refuses("no other program can reach the simulated bus: it is inside this program");
    Bench::of(ALL).run("sim mh5@5").refuses(&no_device());
}

#[test]
fn printed_completions_equal_the_shipped_files() {
    for (shell, file) in [("bash", "cangauge.bash"), ("zsh", "_cangauge"), ("fish", "cangauge.fish")] {
        let shipped = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("completions").join(file);
        Bench::of(ALL).run_words(&["completions", shell]).prints(&std::fs::read_to_string(shipped).expect(file));
    }
    assert_eq!(Bench::of(ALL).run("completions tcsh").exit(2).stdout, "");
}

#[test]
fn completions_are_installed_in_the_folder_of_the_shell() {
    let bench = Bench::of(ALL);
    let home = bench.path("home").display().to_string();
    let install = |words: &[&str], variables: &[(&str, &str)]| {
        let words = [&["completions", "install"], words].concat();
        let mut command = bench.command(&words);
        command.env("HOME", &home).envs(variables.iter().copied()).output().expect("it runs")
    };
    let other = format!("{home}/other");
    for (words, variables, file, shell) in [
        (&[][..], &[("SHELL", "/bin/bash")][..], "/.local/share/bash-completion/completions/cangauge", "bash"),
        (&["fish"], &[("SHELL", "/bin/bash")], "/.config/fish/completions/cangauge.fish", "fish"),
        (&["fish"], &[("XDG_CONFIG_HOME", &other)], "/other/fish/completions/cangauge.fish", "fish"),
        (&[], &[("SHELL", "/usr/bin/zsh")], "/.zfunc/_cangauge", "zsh"),
        // An installed script is replaced.
        (&["zsh"], &[], "/.zfunc/_cangauge", "zsh"),
    ] {
        let done = install(words, variables);
        assert_eq!(String::from_utf8_lossy(&done.stdout), format!("{home}{file}\n"), "{done:?}");
        let script = std::fs::read_to_string(format!("{home}{file}")).expect("the script");
        assert_eq!(script, bench.run_words(&["completions", shell]).exit(0).stdout);
        assert_eq!(String::from_utf8_lossy(&done.stderr).contains("fpath=("), shell == "zsh", "{done:?}");
    }
    for (words, variables) in [(&[][..], &[("SHELL", "/bin/tcsh")][..]), (&["elvish"], &[]), (&[], &[("SHELL", "")])] {
        assert_eq!(install(words, variables).status.code(), Some(2), "{words:?}");
    }
    assert_eq!(install(&["bash"], &[("HOME", "")]).status.code(), Some(2));
    bench.run("completions bash zsh").exit(2);
}

/// An interface that does not exist. The message depends on the kernel, the exit code does not.
#[test]
#[cfg(target_os = "linux")]
fn an_interface_that_does_not_exist() {
    let bench = Bench::of(ALL);
    for bus in ["nosuchcan0", "socketcan:nosuchcan0"] {
        let done = bench.finish(&mut bench.command(&["-b", bus, "scan"])).exit(5);
        assert_eq!(done.stdout, "");
        let known = ["cangauge: there is no CAN interface \"nosuchcan0\"", "cangauge: this kernel has no CAN support"];
        assert!(known.contains(&done.stderr.lines().next().unwrap_or("")), "{}", done.stderr);
        assert!(done.stderr.lines().nth(1).is_some_and(|hint| hint.ends_with("--bus sim")), "{}", done.stderr);
    }
    let error = bench.finish(&mut bench.command(&["-b", "nosuchcan0", "scan", "-f", "json"])).exit(5).error();
    assert_eq!((&error["error"]["kind"], &error["error"]["exit"]), (&json!("bus"), &json!(5)));
}

#[test]
#[cfg(target_os = "linux")]
fn arguments_that_are_not_unicode_are_refused() {
    use std::ffi::OsStr;
    use std::os::unix::ffi::OsStrExt;
    let bench = Bench::of(ALL);
    let done = bench.finish(bench.traced(&["read"]).arg(OsStr::from_bytes(b"\xff")));
    done.refuses("invalid UTF-8 was detected in one or more arguments");
}

/// The message for a device that does not exist; it lists every description.
fn no_device() -> String {
    let names: Vec<&str> = cangauge::device::catalog::names().collect();
    format!("no device \"mh5\" ({}, FILE.toml or FILE.eds)", names.join(", "))
}
