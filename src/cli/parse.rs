//! Parses the command line quickly.
//!
//! Scripts start the program once for each value, so its start-up time matters. Building the arguments of all commands
//! would take most of this time. So only the requested command is built.

use super::{ARGUMENTS, Cli, Global, program};
use clap::error::ErrorKind;
use clap::{Args, Command, FromArgMatches};
use std::ffi::OsString;

/// Parses a command line. The first word is the name of the program.
///
/// # Errors
/// Wrong arguments. Requests for help or version are also errors.
pub fn parse(words: Vec<OsString>) -> Result<Cli, clap::Error> {
    if let Some(mut program) = version_only(&words).or_else(|| single_command(&words)) {
        let matches = program.try_get_matches_from_mut(&words);
        // The process ends soon, so freeing the memory would only take time.
        std::mem::forget(program);
        match matches {
            Ok(mut matches) => {
                let cli = Cli::from_arg_matches_mut(&mut matches);
                std::mem::forget(matches);
                return cli;
            }
            Err(version) if version.kind() == ErrorKind::DisplayVersion => return Err(version),
            Err(_) => {}
        }
    }
    // Errors come from the complete program, because it knows similar commands and their usage.
    program().try_get_matches_from(words).and_then(|mut matches| Cli::from_arg_matches_mut(&mut matches))
}

/// The program without commands, if only its version is requested.
fn version_only(words: &[OsString]) -> Option<Command> {
    let is_version = |word: &OsString| ["-V", "--version"].iter().any(|name| word == name);
    let program = || Command::new("cangauge").version(env!("CARGO_PKG_VERSION"));
    matches!(words, [_, word] if is_version(word)).then(program)
}

/// The program with only one command. Its name is the first word that is the name of any command. If this word is the
/// value of an option, parsing fails, and the complete program parses the words again.
fn single_command(words: &[OsString]) -> Option<Command> {
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
    fn program_with_one_command_parses_the_same() {
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
            let fast = parse(words(line)).unwrap();
            assert_eq!(format!("{fast:?}"), format!("{whole:?}"), "{line}");
        }
    }

    #[test]
    fn every_command_can_be_built_alone() {
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
    fn errors_and_help_come_from_the_complete_program() {
        for line in [
            "cangauge",
            "cangauge scna",
            "cangauge --help",
            "cangauge scan --help",
            "cangauge help nmt start",
            "cangauge sdo read 200 0x1000",
            "cangauge -V",
            "cangauge --version",
            "cangauge --version scna",
        ] {
            let whole = program().try_get_matches_from(words(line)).unwrap_err();
            let error = parse(words(line)).unwrap_err();
            assert_eq!(error.to_string(), whole.to_string(), "{line}");
        }
    }
}
