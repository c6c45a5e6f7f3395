//! Checks the structure of `src`: the allowed uses between layers, the functions that only some layers may call, and
//! the size of files and functions.
//!
//! The tests parse the code with `syn`. Comments and items under `#[cfg(test)]` do not count.

#[path = "layers/code.rs"]
mod code;

use code::{Source, folder, sources};
use std::collections::{BTreeMap, BTreeSet};
use std::fs;

/// The layers and the layers that each may use. The list in `src/lib.rs` must be equal.
const ARROWS: &[(&str, &[&str])] = &[
    ("bus", &["canopen"]),
    ("canopen", &[]),
    ("cli", &["bus", "canopen", "device", "master", "measure", "node", "output", "publish", "sim", "tasks"]),
    ("device", &["canopen"]),
    ("main", &["cli"]),
    ("master", &["bus", "canopen", "device"]),
    ("measure", &["bus", "canopen", "device"]),
    ("node", &["bus", "canopen", "device", "master", "measure"]),
    ("output", &["bus", "canopen", "device", "measure", "node", "publish", "tasks"]),
    ("publish", &["bus"]),
    ("sim", &["bus", "canopen", "device"]),
    ("tasks", &["bus", "canopen", "device", "master", "measure", "node"]),
];

/// The parts of a layer that another layer may use. A name includes everything below it.
/// A pair that is not listed may use the whole layer.
const PARTS: &[(&str, &str, &[&str])] = &[
    ("bus", "canopen", &["frame", "id", "wire_length"]),
    ("master", "bus", BUS_TRAIT),
    ("node", "bus", BUS_TRAIT),
    ("tasks", "bus", BUS_TRAIT),
    ("measure", "bus", &["Mono", "Received", "Stamp", "time"]),
    ("output", "bus", &["Fault", "Mono", "ReceiveBuffer", "Received", "Stamp", "Wall", "file", "replay", "time"]),
    ("output", "canopen", &["emcy", "id", "lss", "nmt", "object", "pdo", "sdo", "value"]),
    ("sim", "canopen", &["frame", "id", "object", "value", "wire_length"]),
    ("cli", "canopen", &["emcy", "id", "lss", "nmt", "object", "pdo", "value"]),
];

/// The trait `Bus` and the types in its signatures, without any transport.
const BUS_TRAIT: &[&str] = &[
    "Adapter",
    "Admin",
    "BitRate",
    "BitRates",
    "Bus",
    "BusError",
    "Event",
    "Fault",
    "Filters",
    "Interface",
    "Mode",
    "Mono",
    "ReceiveBuffer",
    "Received",
    "Stamp",
    "TimestampSource",
    "Wall",
    "parallel",
    "time",
];

/// Crates and modules of the standard library that only some layers may use.
const RESERVED: &[(&str, &[&str])] = &[
    ("anstream", &["cli", "output"]),
    ("anstyle", &["output"]),
    ("anyhow", &["cli"]),
    ("clap", &["cli", "main"]),
    ("clap_complete", &["cli"]),
    ("csv", &["cli", "output"]),
    // output: the pixels of a PNG are compressed.
    ("flate2", &["bus", "output"]),
    ("indicatif", &["output"]),
    ("noto_sans_mono_bitmap", &["output"]),
    ("libc", &["bus"]),
    ("rustls", &["publish"]),
    ("rustls_native_certs", &["publish"]),
    ("ryu", &["output"]),
    ("serde_json", &["output", "publish"]),
    ("signal_hook", &["bus"]),
    ("socket2", &["bus"]),
    ("socketcan", &["bus"]),
    ("terminal_size", &["output"]),
    ("std::env", &["cli", "main"]),
    ("std::fs", &["bus", "cli", "output", "publish", "sim"]),
    ("std::io", &["bus", "cli", "output", "publish", "sim"]),
    ("std::net", &["bus", "publish"]),
    ("std::os", &["bus"]),
    ("std::process", &["bus", "main"]),
    // output: a slow disk must not keep the program from receiving. publish: a slow server must not delay Ctrl-C, nor
    // other recordings.
    ("std::thread", &["bus", "output", "publish"]),
    ("std::time::Instant", &["bus"]),
    ("toml", &["device", "sim"]),
    ("ureq", &["publish"]),
];

/// Functions that read a clock or sleep. Only `bus` may call them: all other layers get the time as an argument.
const CLOCKS: [[&str; 2]; 4] = [["Instant", "now"], ["SystemTime", "now"], ["Wall", "now"], ["thread", "sleep"]];

/// Macros that print. Only `main` and `output` may call them.
const PRINTING: [&str; 5] = ["print", "println", "eprint", "eprintln", "dbg"];

/// The files with `unsafe`: how often it occurs, and why.
const UNSAFE: &[(&str, usize, &str)] = &[
    ("bus/claim/holder.rs", 1, "SO_PEERCRED: std has no stable call for the credentials of a peer"),
    ("bus/host.rs", 1, "gethostname: std does not know the host name"),
    ("bus/interrupt.rs", 2, "sigaction and signal: std can neither read nor set the action of a signal"),
    ("bus/poll.rs", 2, "ppoll and poll: std cannot wait for a descriptor"),
    ("bus/program.rs", 1, "kill: std can end a child only by SIGKILL"),
    ("bus/replay/text.rs", 2, "mktime and its zeroed argument: std knows no time zones"),
    ("bus/socketcan/receive.rs", 3, "recvmmsg and its zeroed headers: no safe crate returns the drop counter"),
    ("bus/time.rs", 2, "localtime_r and its zeroed argument: std knows no time zones"),
    ("bus/stdout.rs", 1, "fcntl before main: std opens /dev/null in place of a closed stdout"),
    ("bus/socketcan/socket.rs", 1, "SO_MEMINFO: neither socket2 nor the socketcan crate reads it"),
];

/// The only file that starts another program: the command of `conform --stimulus`, without text from a device.
const STARTS_PROGRAMS: &str = "bus/program.rs";

/// The longest file in lines.
const FILE_LINES: usize = 500;

/// The longest function in lines.
const FUNCTION_LINES: usize = 60;

/// Longer files and functions: file, function (empty for the file), and how long it may be. Remove an entry once it is
/// split; a new one needs a reason.
const LONG: &[(&str, &str, usize)] =
    &[("canopen/value.rs", "encode_text", 65), ("sim/sdo_server/tests.rs", "block_download", 62)];

/// Every line that violates one of the four rules below (CONTRIBUTING.md, Rules).
fn rule_violations(source: &Source) -> Vec<(&'static str, usize)> {
    let mut found = Vec::new();
    let is_in = |layers: &[&str]| layers.contains(&source.layer());
    if is_in(&["cli"]) {
        let formats = source.paths_ending(&["Text", "Json", "Csv"], "Format");
        found.extend(formats.map(|line| (FORMATS, line)));
    }
    if is_in(&["node", "tasks"]) {
        let commands = source.texts.iter().filter(|(_, text)| text.contains("cangauge "));
        found.extend(commands.map(|(line, _)| (COMMANDS, *line)));
    }
    if source.file != "node/write.rs" && !is_in(&["master"]) {
        found.extend(source.paths_ending(&["write"], "Request").map(|line| (WRITES, line)));
    }
    if is_in(&["cli", "node", "output", "tasks"]) && source.file != "node/wait.rs" {
        let waits = source.calls.iter().filter(|(_, on, method)| on == "master" && method == "next");
        found.extend(waits.map(|(line, ..)| (WAITS, *line)));
    }
    found
}

const FORMATS: &str = "only output knows the formats";
const COMMANDS: &str = "only output writes commands to type";
const WRITES: &str = "only node/write.rs writes objects";
const WAITS: &str = "only node/wait.rs waits for frames";

fn is_part_of(path: &str, whole: &str) -> bool {
    path.strip_prefix(whole).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"))
}

/// Uses inside the crate that no arrow allows.
fn forbidden_uses(source: &Source) -> Vec<String> {
    let layer = source.layer();
    let allowed = ARROWS.iter().find(|(name, _)| *name == layer).map_or(&[][..], |(_, targets)| targets);
    let mut found = Vec::new();
    for (line, path) in source.inner_paths() {
        let Some(target) = path.first().filter(|target| *target != layer && *target != "self") else { continue };
        let part = path.get(1).map_or("", String::as_str);
        let parts = PARTS.iter().find(|(from, to, _)| *from == layer && to == target);
        let place = format!("src/{}:{line}: {}", source.file, path.join("::"));
        if !allowed.contains(&target.as_str()) {
            found.push(format!("{place}: {layer} must not use {target}"));
        } else if parts.is_some_and(|(_, _, parts)| !parts.contains(&part)) {
            found.push(format!("{place}: {layer} must not use this part of {target}"));
        }
    }
    found
}

/// Uses of other crates, clocks, `unsafe` and printing macros that are not for this layer.
fn forbidden_calls(source: &Source) -> Vec<String> {
    let layer = source.layer();
    let mut found = Vec::new();
    let mut add = |line: usize, what: &str, why: &str| found.push(format!("src/{}:{line}: {what}: {why}", source.file));
    for (line, path) in source.outer_paths() {
        let whole = path.join("::");
        let reserved = RESERVED.iter().filter(|(what, layers)| is_part_of(&whole, what) && !layers.contains(&layer));
        reserved.for_each(|(_, layers)| add(*line, &whole, &format!("only for {}", layers.join(" and "))));
        if layer != "bus" && path.windows(2).any(|pair| CLOCKS.iter().any(|clock| pair == clock)) {
            add(*line, &whole, "only bus reads clocks and sleeps");
        }
        if path.windows(2).any(|pair| pair == ["process", "Command"]) && source.file != STARTS_PROGRAMS {
            add(*line, &whole, "only bus/program.rs starts another program");
        }
    }
    for (line, name) in &source.macros {
        if PRINTING.contains(&name.as_str()) && !["main", "output"].contains(&layer) {
            add(*line, &format!("{name}!"), "only main and output print");
        }
    }
    if layer != "bus" {
        source.unsafes.iter().for_each(|line| add(*line, "unsafe", "only for bus"));
    }
    found
}

/// Outside `device`, `sim` and the command line no code depends on the name of a device (CONTRIBUTING.md, Rules).
fn device_names<'a>(sources: impl Iterator<Item = &'a Source>) -> Vec<String> {
    let names: Vec<String> = fs::read_dir(folder().join("device/devices"))
        .expect("the descriptions")
        .filter_map(|entry| Some(entry.ok()?.path().file_stem()?.to_str()?.to_owned()))
        .collect();
    assert!(names.len() >= 4, "{names:?}");
    let checked = sources.filter(|source| !["cli", "device", "sim"].contains(&source.layer()));
    checked
        .flat_map(|source| {
            let named = source.texts.iter().filter(|(_, text)| names.contains(text));
            named.map(|(line, text)| format!("src/{}:{line}: \"{text}\" is the name of a device", source.file))
        })
        .collect()
}

/// The layers and arrows that the lists in `lib.rs` draw: "- [`bus`] → canopen (frames). …". The layer of the program
/// has no brackets, because the library cannot link to it.
fn documented_arrows(text: &str) -> BTreeMap<String, BTreeSet<String>> {
    let text: String =
        text.lines().filter_map(|line| line.strip_prefix("//!")).map(|line| format!("{} ", line.trim())).collect();
    let text = text.replace("- [`", "- `").replace("`] → ", "` → ");
    let mut arrows = BTreeMap::new();
    for item in text.split("- `").skip(1) {
        let Some((layer, rest)) = item.split_once("` → ") else { continue };
        let (targets, _) = rest.split_once('.').expect("an arrow ends with a full stop");
        let plain: String = targets.split('(').map(|part| part.rsplit(')').next().unwrap_or("")).collect();
        let names = plain.split(',').map(|name| name.trim().to_owned());
        arrows.insert(layer.to_owned(), names.filter(|name| name != "nothing").collect());
    }
    arrows
}

#[track_caller]
fn assert_none(found: &[String]) {
    assert!(found.is_empty(), "\n{}", found.join("\n"));
}

#[test]
fn every_use_follows_an_arrow() {
    assert_none(&sources().flat_map(forbidden_uses).collect::<Vec<_>>());
}

#[test]
fn every_layer_calls_only_allowed_functions() {
    assert_none(&sources().flat_map(forbidden_calls).collect::<Vec<_>>());
}

#[test]
fn documented_arrows_are_the_checked_ones() {
    let documented = documented_arrows(&fs::read_to_string(folder().join("lib.rs")).expect("lib.rs"));
    let layers: BTreeSet<&str> =
        sources().map(Source::layer).filter(|layer| !["lib", "main"].contains(layer)).collect();
    assert_eq!(layers, documented.keys().map(String::as_str).collect(), "src/lib.rs lists every layer");
    for (layer, targets) in documented {
        let (_, allowed) = ARROWS.iter().find(|(name, _)| *name == layer).expect("a layer of ARROWS");
        let allowed: BTreeSet<String> = allowed.iter().map(|target| (*target).to_owned()).collect();
        assert_eq!(targets, allowed, "the arrows of {layer} in src/lib.rs");
    }
}

#[test]
fn unsafe_is_counted_and_justified() {
    let found: BTreeMap<&str, usize> = sources()
        .filter(|source| !source.unsafes.is_empty())
        .map(|source| (source.file.as_str(), source.unsafes.len()))
        .collect();
    assert_eq!(found, UNSAFE.iter().map(|(file, count, _)| (*file, *count)).collect(), "UNSAFE gives the reasons");
}

#[test]
fn only_descriptions_know_devices_by_name() {
    assert_none(&device_names(sources()));
}

#[test]
fn files_and_functions_are_short() {
    let limit = |file: &str, function: &str, usual: usize| {
        LONG.iter().find(|(of, long, _)| *of == file && *long == function).map_or(usual, |(_, _, lines)| *lines)
    };
    let mut found = Vec::new();
    for source in code::all_sources().iter() {
        let file = &source.file;
        let most = limit(file, "", FILE_LINES);
        if source.lines > most {
            found.push(format!("src/{file}: {} lines, more than {most}", source.lines));
        }
        for (line, name, lines) in &source.functions {
            let most = limit(file, name, FUNCTION_LINES);
            if *lines > most {
                found.push(format!("src/{file}:{line}: fn {name} has {lines} lines, more than {most}"));
            }
        }
    }
    assert_none(&found);
}

#[test]
fn texts_waits_and_writes_are_in_one_module_each() {
    let places = sources().flat_map(|source| {
        let file = &source.file;
        rule_violations(source).into_iter().map(move |(rule, line)| format!("src/{file}:{line}: {rule}"))
    });
    assert_none(&places.collect::<Vec<_>>());
}

/// The checks find violations.
#[test]
fn violations_are_found() {
    let found = |file: &str, text: &str| -> Vec<String> {
        let source = Source::parse(file, text);
        let all = forbidden_uses(&source).into_iter().chain(forbidden_calls(&source));
        all.map(|line| line.trim_start_matches("src/").to_owned()).collect()
    };
    assert_eq!(found("canopen/a.rs", "use crate::bus::Bus;"), ["canopen/a.rs:1: bus::Bus: canopen must not use bus"]);
    assert_eq!(found("canopen/a/b.rs", "use super::super::super::bus::Bus;").len(), 1);
    assert_eq!(found("canopen/a/b.rs", "use super::super::c;\nuse self::d;\nuse crate::canopen::e;"), [""; 0]);
    assert_eq!(
        found(
            "master/a.rs",
            "\nuse crate::{\n  bus::{Bus, memory as b},\n  cli::{self, x},\n};\nfn f() -> crate::sim::S {}"
        ),
        [
            "master/a.rs:3: bus::memory: master must not use this part of bus",
            "master/a.rs:4: cli::self: master must not use cli",
            "master/a.rs:4: cli::x: master must not use cli",
            "master/a.rs:6: sim::S: master must not use sim",
        ]
    );
    assert_eq!(found("master/a.rs", "use crate::bus::*;").len(), 1);
    assert_eq!(found("main.rs", "use cangauge::tasks::x; use crate::cli::run;").len(), 1);
    assert_eq!(found("cli/a.rs", "use cangauge::canopen::sdo::x; use cangauge::tasks::y; use super::b;").len(), 1);
    assert_eq!(found("master/a.rs", "use std::time; fn f() { time::Instant::now(); }").len(), 1);
    assert_eq!(found("canopen/a.rs", "use std::{fs, fmt, io::Write};").len(), 2);
    assert_eq!(found("canopen/a.rs", "fn f() { libc::close(1); unsafe { g() }; println!(\"x\"); }").len(), 3);
    assert_eq!(found("canopen/a.rs", "fn f() { assert!(crate::bus::f(&x), \"{}\", println!()); }").len(), 2);
    assert_eq!(found("canopen/a.rs", "#[serde(with = \"a\", other = crate::bus::x)] struct A;").len(), 1);
    let hidden = "// crate::bus\n/* crate::bus /* unsafe */ */ /** crate::bus */\nconst A: &str = \"crate::bus \\\" unsafe\";\n\
        const B: &str = r#\"crate::bus \" unsafe\"#; fn f<'a>(c: char) -> bool { c == '\"' || c == '\\'' }\n\
        #[cfg(test)] mod tests { use crate::bus::Bus; fn f() { [1; 2]; } }\n#[cfg(test)] use crate::bus::Bus;\n\
        impl C { #[cfg(test)] fn f(a: crate::bus::Bus) {} }\n";
    assert_eq!(found("canopen/a.rs", hidden), [""; 0]);
    assert_eq!(found("canopen/a.rs", &format!("{hidden}use crate::bus::Bus;\n")).len(), 1, "the code after it counts");
    let source = Source::parse("canopen/mod.rs", "#[cfg(test)]\nmod script;\nmod frame;\nfn f() {\n\n}\n");
    assert_eq!(source.test_files, ["canopen/script"]);
    assert_eq!(source.functions, [(4, "f".to_owned(), 3)]);
    let second = Source::parse("tasks/a.rs", "fn f() { master.next(t); Request::write(a); g(\"cangauge scan\"); }");
    assert_eq!(rule_violations(&second).iter().map(|(rule, _)| *rule).collect::<Vec<_>>(), [COMMANDS, WRITES, WAITS]);
    let named = Source::parse("measure/a.rs", "fn f() { if name == \"mh4\" || matches!(name, \"mh40\" | \"dps\") {} }");
    let [first, second] = &device_names([named].iter())[..] else { panic!("two names") };
    assert_eq!(first, "src/measure/a.rs:1: \"mh4\" is the name of a device");
    assert_eq!(second, "src/measure/a.rs:1: \"dps\" is the name of a device");
    let arrows = documented_arrows(
        "//! - [`canopen`] → nothing. Pure.\n//! - [`master`] → bus (the trait),\n//!   canopen. X.\n//! - `cli` → bus.",
    );
    assert_eq!((arrows["canopen"].len(), arrows["master"].len(), arrows["cli"].len()), (0, 2, 1));
}
