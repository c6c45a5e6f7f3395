//! Every example of the help and of the README is a command that works.

use super::Bench;
use cangauge::cli::Cli;
use clap::{Command, CommandFactory, Parser};
use std::collections::BTreeSet;
use std::path::Path;
use std::thread;

/// Examples that take too long, by name.
const TOO_LONG: [&str; 1] = ["cangauge -b sim log 1-3,127 --sync 10ms --duration 1h -o run.csv"];

/// The lines of the help and the README that start with the name of the program, without the explanation beside them.
/// A command that must fail (`||`) is tested with the README.
fn examples() -> BTreeSet<String> {
    let mut texts =
        vec![std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("README.md")).expect("the README")];
    let mut root = Cli::command();
    root.build();
    let mut commands: Vec<Command> = vec![root];
    while let Some(mut command) = commands.pop() {
        texts.push(command.render_long_help().to_string());
        commands.extend(command.get_subcommands().cloned());
    }
    let lines = texts.iter().flat_map(|text| text.lines()).map(str::trim);
    let lines = lines.map(|line| line.trim_start_matches("- ").to_owned());
    // The second line of a usage: "cangauge conform <COMMAND>".
    let has_placeholder = |line: &str| line.contains("CHANNEL") || line.contains('<');
    let is_example = |line: &String| line.starts_with("cangauge ") && !has_placeholder(line) && !line.contains(" || ");
    let examples = lines.filter(is_example);
    examples.map(|line| line.split("  ").next().unwrap_or_default().trim_end_matches(" &").to_owned()).collect()
}

/// Splits a line into words as a shell does, as far as examples need it: at blanks, except in single quotes.
pub(super) fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for (at, part) in line.split('\'').enumerate() {
        let mut pieces = if at % 2 == 1 { vec![part] } else { part.split(' ').collect() }.into_iter();
        if let Some(last) = words.last_mut() {
            last.push_str(pieces.next().unwrap_or_default());
        }
        words.extend(pieces.map(str::to_owned));
    }
    words.retain(|word| !word.is_empty());
    words
}

fn without_redirection(example: &str) -> &str {
    if example.contains('\'') { example } else { example.split(" > ").next().unwrap_or_default() }
}

#[test]
fn every_example_is_valid() {
    let examples = examples();
    assert!(examples.len() >= 15, "{examples:?}");
    for example in examples {
        let words = words(without_redirection(&example));
        if let Err(error) = Cli::try_parse_from(words) {
            panic!("{example}: {error}");
        }
    }
}

#[test]
fn every_example_on_the_simulated_bus_works() {
    let examples: BTreeSet<String> =
        examples().into_iter().filter(|example| example.starts_with("cangauge -b sim ")).collect();
    for example in TOO_LONG {
        assert!(examples.contains(example), "{example} is not an example");
    }
    let run = |example: &str| {
        let bench = Bench::real("mh4@1");
        let words = words(without_redirection(example));
        let words: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
        let done = bench.finish(&mut bench.command(&words)).exit(0);
        assert!(!done.stdout.is_empty() || !bench.files().is_empty() || example.contains(" sdo write "), "{example}");
    };
    // On the real clock, as for users. Not all at once: on a busy machine, the simulated devices would answer too late.
    let left: Vec<&String> = examples.iter().filter(|example| !TOO_LONG.contains(&example.as_str())).collect();
    for some in left.chunks(6) {
        thread::scope(|scope| some.iter().for_each(|example| drop(scope.spawn(|| run(example)))));
    }
}
