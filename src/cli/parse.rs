//! From the words of the command line to [`Cli`], at little cost.
//!
//! A script starts the program for every single value, so its start counts. Most of it was the tree of all
//! commands with all their arguments and the global options copied to each. Hence the arguments of a command
//! are made up when it is chosen (`defer`), and only the one that is named is made up at all.

use super::{ARGUMENTS, Cli, Global, program};
use clap::{Args, Command, FromArgMatches};
use std::ffi::OsString;

/// Parses the words of a command line; the first is the program's name.
///
/// # Errors
/// What is wrong with them, or help or version that were asked for.
pub fn parse(words: Vec<OsString>) -> Result<Cli, clap::Error> {
    if let Some(mut narrowed) = narrowed(&words) {
        let matches = narrowed.try_get_matches_from_mut(&words);
        // The program ends soon: taking the tree to pieces would cost as much as some of its building.
        std::mem::forget(narrowed);
        if let Ok(mut matches) = matches {
            let cli = Cli::from_arg_matches_mut(&mut matches);
            std::mem::forget(matches);
            return cli;
        }
    }
    // What is not well is told by the whole tree: it knows the nearest command, and the usage of all.
    program().try_get_matches_from(words).and_then(|mut matches| Cli::from_arg_matches_mut(&mut matches))
}

/// The same program with only the command that the first word names that names any. What it accepts, the whole
/// program accepts alike: where that word is the value of an option, the true command is not known here, and
/// the whole tree is asked.
fn narrowed(words: &[OsString]) -> Option<Command> {
    let named = |word: &OsString| ARGUMENTS.iter().find(|(names, _)| names.iter().any(|name| word == name));
    let (names, arguments) = words.iter().skip(1).find_map(named)?;
    let (name, aliases) = names.split_first()?;
    let program = Command::new("cangauge")
        .subcommand_required(true)
        .disable_help_subcommand(true)
        .disable_version_flag(true)
        .disable_help_flag(true);
    Some(Global::augment_args(program).subcommand(arguments(Command::new(*name)).aliases(aliases.iter().copied())))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn words(line: &str) -> Vec<OsString> {
        line.split_whitespace().map(OsString::from).collect()
    }

    #[test]
    fn the_narrowed_program_understands_the_same() {
        for line in [
            "cangauge -b sim scan",
            "cangauge scan -b sim -f json",
            "cangauge --bus log log 1 --count 3",
            "cangauge sdo read 5 0x1000 -t 1s",
            "cangauge nmt --trace scan state 1 --probe",
            "cangauge ls -b sim",
            "cangauge zero 1 --dry-run",
        ] {
            let whole = program().try_get_matches_from(words(line)).unwrap();
            let whole = Cli::from_arg_matches(&whole).unwrap();
            let narrowed = parse(words(line)).unwrap();
            assert_eq!(format!("{narrowed:?}"), format!("{whole:?}"), "{line}");
        }
    }

    #[test]
    fn every_command_can_be_made_up_without_the_others() {
        let mut root = program();
        root.build();
        let named: Vec<&str> = root.get_subcommands().map(Command::get_name).filter(|&name| name != "help").collect();
        assert_eq!(ARGUMENTS.iter().map(|(names, _)| names[0]).collect::<Vec<_>>(), named);
        for (names, arguments) in ARGUMENTS {
            let name = names[0];
            let alone = arguments(Command::new(name));
            let whole = root.find_subcommand(name).unwrap();
            let about = |command: &Command| command.get_about().map(ToString::to_string);
            assert_eq!(about(&alone), about(whole), "{name}");
        }
    }

    #[test]
    fn errors_and_help_come_from_the_whole_program() {
        for line in [
            "cangauge",
            "cangauge scna",
            "cangauge --help",
            "cangauge scan --help",
            "cangauge help nmt start",
            "cangauge sdo read 200 0x1000",
            "cangauge -V",
        ] {
            let whole = program().try_get_matches_from(words(line)).unwrap_err();
            let told = parse(words(line)).unwrap_err();
            assert_eq!(told.to_string(), whole.to_string(), "{line}");
        }
    }
}
