//! The command line as a whole, and the commands in the documents.

mod examples;
mod generated;

use super::{Cli, program};
use clap::Parser;
use clap::error::ErrorKind;
use examples::{examples, readme, without_redirection, words};

#[test]
fn the_command_line_is_sound() {
    program().debug_assert();
}

#[test]
fn every_example_is_valid() {
    let examples = examples();
    assert!(examples.len() >= 100, "{examples:?}");
    for example in examples {
        if let Err(error) = Cli::try_parse_from(words(without_redirection(&example))) {
            panic!("{example}: {error}");
        }
    }
}

#[test]
fn commands_in_the_text_of_the_readme_are_valid() {
    let text = readme();
    let commands = text.split('`').skip(1).step_by(2).filter(|code| code.starts_with("cangauge "));
    let commands: Vec<&str> = commands.filter(|code| !code.contains("COMMAND")).collect();
    assert!(commands.len() > 3, "{commands:?}");
    for command in commands {
        match Cli::try_parse_from(words(command)) {
            Err(error) if error.kind() != ErrorKind::DisplayHelp => panic!("{command}: {error}"),
            _ => {}
        }
    }
}
