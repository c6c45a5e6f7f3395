//! Holds the arrows of `src/lib.rs`: who may use whom, and what only some rooms may do.
//!
//! Reads the code of `src` as a stream of tokens. Comments, literals and `#[cfg(test)]` items do not count.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// What a layer may use of a layer that it may not use whole. A name stands for everything below it, too.
const ONLY: &[(&str, &str, &[&str])] = &[
    ("bus", "canopen", &["frame", "id", "wire_length"]),
    ("master", "bus", THE_TRAIT),
    ("tasks", "bus", THE_TRAIT),
    ("node", "bus", THE_TRAIT),
    ("measure", "bus", STAMPS),
    ("output", "bus", TOLD),
    ("output", "canopen", &["id", "lss", "value"]),
    ("sim", "canopen", &["frame", "id", "object", "value", "wire_length"]),
    ("cli", "canopen", &["emcy", "id", "lss", "nmt", "object", "pdo", "value"]),
];

/// The trait and what it speaks of; no transport.
const THE_TRAIT: &[&str] = &[
    "Bus",
    "BusError",
    "Event",
    "Fault",
    "Filters",
    "Mode",
    "Mono",
    "ReceiveBuffer",
    "Received",
    "Stamp",
    "TimestampSource",
    "time",
];

/// Moments, and what a bus tells of itself on the way.
const TOLD: &[&str] = &["Fault", "Mono", "ReceiveBuffer", "Received", "Stamp", "time"];

/// Moments, and a frame with the moment it was received.
const STAMPS: &[&str] = &["Mono", "Received", "Stamp", "time"];

/// Parts of the standard library and crates that belong to some layers only.
const RESERVED: &[(&str, &[&str])] = &[
    ("anstream", &["cli", "output"]),
    ("anstyle", &["output"]),
    ("anyhow", &["cli"]),
    ("clap", &["cli", "main"]),
    ("clap_complete", &["cli"]),
    ("csv", &["cli", "output"]),
    ("indicatif", &["output"]),
    ("libc", &["bus"]),
    ("serde_json", &["output"]),
    ("signal_hook", &["bus"]),
    ("socket2", &["bus"]),
    ("socketcan", &["bus"]),
    ("std::env", &["main"]),
    ("std::fs", &["bus", "cli", "output", "sim"]),
    ("std::io", &["bus", "cli", "output", "sim"]),
    ("std::net", &["bus"]),
    ("std::os", &["bus"]),
    ("std::process", &["main"]),
    // A thread in output: writing must not keep the program from receiving.
    ("std::thread", &["bus", "output"]),
    ("std::time::Instant", &["bus"]),
    ("toml", &["device", "sim"]),
];

/// Functions that read a clock or wait, wherever they are called from.
const CLOCKS: [[&str; 2]; 4] = [["Instant", "now"], ["SystemTime", "now"], ["Wall", "now"], ["thread", "sleep"]];

/// A path in the code and its line.
type Use = (usize, Vec<String>);

/// Where `unsafe` stands, how often, and why nothing else does.
const UNSAFE: &[(&str, usize, &str)] = &[
    ("bus/claim.rs", 1, "SO_PEERCRED: std does not tell the credentials of a peer (peer_cred is unstable)"),
    ("bus/poll.rs", 2, "ppoll and poll: std cannot wait for a descriptor"),
    ("bus/socketcan/receive.rs", 3, "recvmmsg, and zeroed headers for it: nothing safe delivers the drop counter"),
    ("bus/socketcan/socket.rs", 1, "SO_MEMINFO: neither socket2 nor the socketcan crate reads it"),
];

/// The most lines of a file.
const LINES: usize = 600;

#[derive(Clone, Debug, PartialEq, Eq)]
enum Kind {
    Name(String),
    Text(String),
    Sign(char),
    /// `::`
    Path,
}

#[derive(Clone, Debug)]
struct Token {
    line: usize,
    kind: Kind,
}

impl Token {
    fn is(&self, sign: char) -> bool {
        self.kind == Kind::Sign(sign)
    }

    fn name(&self) -> Option<&str> {
        match &self.kind {
            Kind::Name(name) => Some(name),
            _ => None,
        }
    }
}

fn tokens(source: &str) -> Vec<Token> {
    let text: Vec<char> = source.chars().collect();
    let (mut tokens, mut at, mut line) = (Vec::new(), 0, 1);
    let starts = |at: usize, what: &str| what.chars().enumerate().all(|(index, c)| text.get(at + index) == Some(&c));
    while let Some(&c) = text.get(at) {
        let begin = at;
        let kind = if c.is_whitespace() {
            at += 1;
            None
        } else if starts(at, "//") {
            while text.get(at).is_some_and(|&c| c != '\n') {
                at += 1;
            }
            None
        } else if starts(at, "/*") {
            let mut depth = 0;
            loop {
                if starts(at, "/*") {
                    (depth, at) = (depth + 1, at + 2);
                } else if starts(at, "*/") {
                    (depth, at) = (depth - 1, at + 2);
                } else {
                    at += 1;
                }
                if depth == 0 || at >= text.len() {
                    break;
                }
            }
            None
        } else if let Some(end) = literal(&text, at) {
            at = end;
            Some(Kind::Text(text[begin..end].iter().collect()))
        } else if c.is_alphanumeric() || c == '_' {
            while text.get(at).is_some_and(|c| c.is_alphanumeric() || *c == '_') {
                at += 1;
            }
            Some(Kind::Name(text[begin..at].iter().collect()))
        } else if starts(at, "::") {
            at += 2;
            Some(Kind::Path)
        } else {
            at += 1;
            Some(Kind::Sign(c))
        };
        tokens.extend(kind.map(|kind| Token { line, kind }));
        line += text[begin..at.min(text.len())].iter().filter(|&&c| c == '\n').count();
    }
    tokens
}

/// The end of the string or character that begins at `at`, if one does.
fn literal(text: &[char], at: usize) -> Option<usize> {
    let mut start = at;
    while start < at + 2 && matches!(text.get(start), Some('b' | 'c' | 'r')) {
        start += 1;
    }
    let raw = start > at && text[start - 1] == 'r';
    let hashes = text[start..].iter().take_while(|&&c| c == '#').count();
    if raw && text.get(start + hashes) == Some(&'"') {
        let end: Vec<char> = std::iter::once('"').chain(std::iter::repeat_n('#', hashes)).collect();
        let from = start + hashes + 1;
        let found = (from..text.len()).find(|&at| text[at..].starts_with(&end));
        return Some(found.map_or(text.len(), |found| found + end.len()));
    }
    let quote = *text.get(start)?;
    // 'a is a lifetime, 'a' and '\'' are characters.
    let is_character = quote == '\'' && (text.get(start + 1) == Some(&'\\') || text.get(start + 2) == Some(&'\''));
    if quote != '"' && !is_character {
        return None;
    }
    let mut end = start + 1;
    while end < text.len() && text[end] != quote {
        end += if text[end] == '\\' { 2 } else { 1 };
    }
    Some((end + 1).min(text.len()))
}

/// Takes out every `#[cfg(test)]` item; the names of such modules that have a file of their own go to `files`.
fn without_tests(tokens: &[Token], files: &mut Vec<String>) -> Vec<Token> {
    let mut kept = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let words: Vec<&Kind> = tokens[at..].iter().take(7).map(|token| &token.kind).collect();
        let attribute = [Kind::Sign('#'), Kind::Sign('['), Kind::Name("cfg".into()), Kind::Sign('(')];
        let is_test = words.len() == 7
            && words.iter().zip(&attribute).all(|(word, wanted)| *word == wanted)
            && *words[4] == Kind::Name("test".into());
        if !is_test {
            kept.push(tokens[at].clone());
            at += 1;
            continue;
        }
        at += 7;
        if let [module, name, end, ..] = &tokens[at..]
            && (module.name(), end.is(';')) == (Some("mod"), true)
        {
            files.extend(name.name().map(str::to_owned));
        }
        let mut depth = 0usize;
        while let Some(token) = tokens.get(at) {
            at += 1;
            match token.kind {
                Kind::Sign('{' | '(' | '[') => depth += 1,
                Kind::Sign(')' | ']') => depth -= 1,
                Kind::Sign('}') => {
                    depth -= 1;
                    if depth == 0 && !tokens.get(at).is_some_and(|next| next.is(';')) {
                        break;
                    }
                }
                Kind::Sign(';') if depth == 0 => break,
                _ => {}
            }
        }
    }
    kept
}

/// Every path in the code, the trees of `use` taken apart: `crate::{a, b::c}` is `crate::a` and `crate::b::c`.
fn paths(tokens: &[Token]) -> Vec<Use> {
    let mut found = Vec::new();
    let mut at = 0;
    while at < tokens.len() {
        let begins = tokens[at].name().is_some() && (at == 0 || tokens[at - 1].kind != Kind::Path);
        let is_use = at > 0 && tokens[at - 1].name() == Some("use");
        if begins && (is_use || tokens.get(at + 1).is_some_and(|next| next.kind == Kind::Path)) {
            at = tree(tokens, at, &[], &mut found).max(at + 1);
        } else {
            at += 1;
        }
    }
    found
}

fn tree(tokens: &[Token], mut at: usize, before: &[String], found: &mut Vec<Use>) -> usize {
    let mut path = before.to_vec();
    let mut line = 0;
    while let Some(token) = tokens.get(at) {
        if let Some(name) = token.name() {
            line = token.line;
            path.push(name.to_owned());
            at += 1;
        } else if token.is('*') {
            path.push("*".to_owned());
            found.push((token.line, path));
            return at + 1;
        } else if token.is('{') {
            at += 1;
            while let Some(token) = tokens.get(at) {
                at = match token.kind {
                    Kind::Sign('}') => return at + 1,
                    Kind::Sign(',') => at + 1,
                    _ => tree(tokens, at, &path, found).max(at + 1),
                };
            }
            return at;
        } else {
            break;
        }
        match tokens.get(at) {
            Some(token) if token.kind == Kind::Path => at += 1,
            _ => break,
        }
    }
    // `use a::b as c`: the new name is no path.
    if tokens.get(at).is_some_and(|token| token.name() == Some("as")) && !before.is_empty() {
        at += 2;
    }
    found.push((line, path));
    at
}

/// A file of `src`.
struct Source {
    /// Relative to `src`.
    file: String,
    /// `cli::args`; `main` and nothing for the two at the top.
    module: Vec<String>,
    tokens: Vec<Token>,
}

impl Source {
    fn new(file: &str, text: &str, files: &mut Vec<String>) -> Source {
        let stem = file.trim_end_matches(".rs");
        let stem = stem.strip_suffix("/mod").unwrap_or(stem);
        let module = stem.split('/').filter(|part| *part != "lib").map(str::to_owned).collect();
        Source { file: file.to_owned(), module, tokens: without_tests(&tokens(text), files) }
    }

    fn layer(&self) -> &str {
        self.module.first().map_or("lib", String::as_str)
    }

    /// Paths from the root of the crate (`crate` left out), and those that lead out of it.
    fn paths(&self) -> (Vec<Use>, Vec<Use>) {
        let (mut inner, mut outer) = (Vec::new(), Vec::new());
        for (line, path) in paths(&self.tokens) {
            let supers = path.iter().take_while(|part| *part == "super").count();
            match path[0].as_str() {
                "crate" | "cangauge" => inner.push((line, path[1..].to_vec())),
                "super" => {
                    let kept = self.module.len().saturating_sub(supers);
                    let whole = self.module[..kept].iter().chain(&path[supers..]).cloned().collect();
                    inner.push((line, whole));
                }
                _ => outer.push((line, path)),
            }
        }
        (inner, outer)
    }
}

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("src")
}

/// Every file as `(path below src, text)`.
fn files() -> Vec<(String, String)> {
    fn walk(folder: &Path, files: &mut Vec<PathBuf>) {
        for entry in fs::read_dir(folder).expect("src") {
            let path = entry.expect("an entry").path();
            if path.is_dir() {
                walk(&path, files);
            } else if path.extension().is_some_and(|extension| extension == "rs") {
                files.push(path);
            }
        }
    }
    let mut paths = Vec::new();
    walk(&folder(), &mut paths);
    paths.sort();
    let named = paths.into_iter().map(|path| {
        let text = fs::read_to_string(&path).expect("a source");
        (path.strip_prefix(folder()).expect("below src").display().to_string(), text)
    });
    named.collect()
}

/// The code, files that are tests left out.
fn sources() -> Vec<Source> {
    let (mut sources, mut tests) = (Vec::new(), BTreeSet::new());
    for (file, text) in files() {
        let mut modules = Vec::new();
        let source = Source::new(&file, &text, &mut modules);
        let above = source.module.join("/");
        tests.extend(modules.into_iter().map(|module| format!("{above}/{module}")));
        sources.push(source);
    }
    sources.retain(|source| !tests.iter().any(|test| Path::new(&source.file.replace(".rs", "")).starts_with(test)));
    sources
}

/// The arrows as the map in `lib.rs` draws them: "- [`bus`] → canopen (frames). …".
fn arrows(map: &str) -> BTreeMap<String, BTreeSet<String>> {
    let text: String =
        map.lines().filter_map(|line| line.strip_prefix("//!")).map(|line| format!("{} ", line.trim())).collect();
    let mut arrows = BTreeMap::new();
    for item in text.split("- [`").skip(1) {
        let (layer, rest) = item.split_once("`] → ").expect("a layer and its arrow");
        let (targets, _) = rest.split_once('.').expect("the end of the arrow");
        let plain: String = targets.split('(').map(|part| part.rsplit(')').next().unwrap_or("")).collect();
        let names = plain.split(',').map(|name| name.trim().to_owned());
        arrows.insert(layer.to_owned(), names.filter(|name| name != "nothing").collect());
    }
    arrows
}

fn breaches(sources: &[Source], arrows: &BTreeMap<String, BTreeSet<String>>) -> Vec<String> {
    let mut breaches = Vec::new();
    for source in sources {
        let layer = source.layer();
        if layer == "lib" {
            continue;
        }
        let (inner, outer) = source.paths();
        let mut breach = |line: usize, path: &[String], why: &str| {
            breaches.push(format!("src/{}:{line}: {} {why}", source.file, path.join("::")));
        };
        for (line, path) in inner {
            let Some(target) = path.first().filter(|target| *target != layer && *target != "self") else { continue };
            let allowed = match layer {
                "main" => target == "cli",
                _ => arrows.get(layer).is_some_and(|targets| targets.contains(target)),
            };
            let part = path.get(1).map_or("", String::as_str);
            let only = ONLY.iter().find(|(from, to, _)| *from == layer && to == target);
            if !allowed {
                breach(line, &path, &format!("is not for {layer}"));
            } else if only.is_some_and(|(_, _, parts)| !parts.contains(&part)) {
                breach(line, &path, &format!("is a part that is not for {layer}"));
            }
        }
        for (line, path) in outer {
            let whole = path.join("::");
            for (what, layers) in RESERVED {
                let named = whole.strip_prefix(what).is_some_and(|rest| rest.is_empty() || rest.starts_with("::"));
                if named && !layers.contains(&layer) {
                    breach(line, &path, &format!("is not for {layer}"));
                }
            }
            if layer != "bus" && path.windows(2).any(|pair| CLOCKS.iter().any(|clock| pair == clock)) {
                breach(line, &path, "is for bus alone: time comes from the bus");
            }
        }
        for pair in source.tokens.windows(2) {
            let Some(name) = pair[0].name() else { continue };
            if name == "unsafe" && layer != "bus" {
                breach(pair[0].line, &[name.to_owned()], "is for bus alone");
            }
            let prints = ["print", "println", "eprint", "eprintln", "dbg"].contains(&name) && pair[1].is('!');
            if prints && !["main", "output"].contains(&layer) {
                breach(pair[0].line, &[format!("{name}!")], "is for main and output");
            }
        }
    }
    breaches
}

/// Devices are data: below the tasks nothing asks for one by its name.
fn device_names(sources: &[Source]) -> Vec<String> {
    let names: Vec<String> = fs::read_dir(folder().join("device/devices"))
        .expect("the descriptions")
        .filter_map(|entry| Some(format!("\"{}\"", entry.ok()?.path().file_stem()?.to_str()?)))
        .collect();
    assert!(names.len() >= 4, "{names:?}");
    let mut found = Vec::new();
    for source in sources.iter().filter(|source| !["cli", "device", "sim"].contains(&source.layer())) {
        for token in &source.tokens {
            if let Kind::Text(text) = &token.kind
                && names.contains(text)
            {
                found.push(format!("src/{}:{}: {text} is the name of a device", source.file, token.line));
            }
        }
    }
    found
}

fn assert_none(breaches: &[String]) {
    assert!(breaches.is_empty(), "\n{}", breaches.join("\n"));
}

#[test]
fn every_use_follows_an_arrow() {
    let arrows = arrows(&fs::read_to_string(folder().join("lib.rs")).expect("lib.rs"));
    let sources = sources();
    let layers: BTreeSet<&str> =
        sources.iter().map(Source::layer).filter(|layer| !["lib", "main"].contains(layer)).collect();
    let drawn: BTreeSet<&str> = arrows.keys().map(String::as_str).collect();
    assert_eq!(layers, drawn, "the map in lib.rs names every layer");
    assert_none(&breaches(&sources, &arrows));
}

#[test]
fn the_map_is_the_plan() {
    let arrows = arrows(&fs::read_to_string(folder().join("lib.rs")).expect("lib.rs"));
    let drawn: Vec<String> = arrows
        .iter()
        .map(|(layer, targets)| {
            format!("{layer}: {}", targets.iter().map(String::as_str).collect::<Vec<_>>().join(" "))
        })
        .collect();
    assert_eq!(
        drawn,
        [
            "bus: canopen",
            "canopen: ",
            "cli: bus canopen device master measure node output sim tasks",
            "device: canopen",
            "master: bus canopen device",
            "measure: bus canopen device",
            "node: bus canopen device master measure",
            "output: bus canopen device measure node tasks",
            "sim: bus canopen device",
            "tasks: bus canopen device master measure node",
        ]
    );
}

#[test]
fn unsafe_is_counted_and_reasoned() {
    let mut found: BTreeMap<String, usize> = BTreeMap::new();
    for source in sources() {
        for _ in source.tokens.iter().filter(|token| token.name() == Some("unsafe")) {
            *found.entry(source.file.clone()).or_default() += 1;
        }
    }
    let expected = UNSAFE.iter().map(|(file, count, _)| ((*file).to_owned(), *count)).collect();
    assert_eq!(found, expected, "say in UNSAFE why, or do without");
}

#[test]
fn no_command_runs_another_program() {
    let running: Vec<String> = sources()
        .iter()
        .flat_map(|source| {
            let (_, outer) = source.paths();
            let runs = |path: &[String]| path.windows(2).any(|pair| pair == ["process", "Command"]);
            let lines: Vec<usize> = outer.iter().filter(|(_, path)| runs(path)).map(|(line, _)| *line).collect();
            lines.into_iter().map(|line| format!("src/{}:{line}", source.file))
        })
        .collect();
    assert_none(&running);
}

#[test]
fn nothing_but_descriptions_knows_a_device_by_name() {
    assert_none(&device_names(&sources()));
}

#[test]
fn files_stay_readable() {
    let long: Vec<String> = files()
        .iter()
        .map(|(file, text)| (file, text.lines().count()))
        .filter(|(_, lines)| *lines > LINES)
        .map(|(file, lines)| format!("src/{file} has {lines} lines, more than {LINES}"))
        .collect();
    assert_none(&long);
}

/// The tests above see what they are there to see.
#[test]
fn breaches_are_found() {
    let arrows =
        arrows("//! - [`canopen`] → nothing. Pure.\n//! - [`master`] → bus (the trait),\n//!   canopen. Drives.");
    let found = |file: &str, text: &str| -> Vec<String> {
        let source = Source::new(file, text, &mut Vec::new());
        breaches(&[source], &arrows).iter().map(|line| line.trim_start_matches("src/").to_owned()).collect()
    };
    assert_eq!(found("canopen/a.rs", "use crate::bus::Bus;"), ["canopen/a.rs:1: bus::Bus is not for canopen"]);
    assert_eq!(found("canopen/a/b.rs", "use super::super::super::bus::Bus;").len(), 1);
    assert_eq!(found("canopen/a/b.rs", "use super::super::c;\nuse self::d;\nuse crate::canopen::e;"), [""; 0]);
    assert_eq!(
        found(
            "master/a.rs",
            "\nuse crate::{\n  bus::{Bus, memory as b},\n  cli::{self, x},\n};\nfn f() -> crate::sim::S {}"
        ),
        [
            "master/a.rs:3: bus::memory is a part that is not for master",
            "master/a.rs:4: cli::self is not for master",
            "master/a.rs:4: cli::x is not for master",
            "master/a.rs:6: sim::S is not for master",
        ]
    );
    assert_eq!(found("master/a.rs", "use crate::bus::*;").len(), 1);
    assert_eq!(found("main.rs", "use cangauge::tasks::x; use cangauge::cli::run;").len(), 1);
    assert_eq!(found("master/a.rs", "use std::time; fn f() { time::Instant::now(); }").len(), 1);
    assert_eq!(found("canopen/a.rs", "use std::{fs, fmt, io::Write};").len(), 2);
    assert_eq!(found("canopen/a.rs", "fn f() { libc::close(1); unsafe { g() }; println!(\"x\"); }").len(), 3);
    let hidden = "// crate::bus\n/* crate::bus /* unsafe */ */ /// crate::bus\nconst A: &str = \"crate::bus \\\" unsafe\";\n\
        const B: &str = r#\"crate::bus \" unsafe\"#; fn f<'a>(c: char) -> bool { c == '\"' || c == '\\'' }\n\
        #[cfg(test)] mod tests { use crate::bus::Bus; fn f() { [1; 2]; } }\n#[cfg(test)] use crate::bus::Bus;\n";
    assert_eq!(found("canopen/a.rs", hidden), [""; 0]);
    assert_eq!(found("canopen/a.rs", &format!("{hidden}use crate::bus::Bus;\n")).len(), 1, "and the code goes on");
    let mut files = Vec::new();
    Source::new("canopen/mod.rs", "#[cfg(test)]\nmod script;\nmod frame;", &mut files);
    assert_eq!(files, ["script"]);
    let named = Source::new("measure/a.rs", "if name == \"mh4\" || name == \"mh40\" {}", &mut Vec::new());
    assert_eq!(device_names(&[named]), ["src/measure/a.rs:1: \"mh4\" is the name of a device"]);
}
