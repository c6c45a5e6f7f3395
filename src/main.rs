//! The program: parses the arguments, runs the command, and returns the exit code.

// Public, so that the compiler checks its documentation.
pub mod cli;

use crate::cli::{exit, parse, run};
use std::process::ExitCode;

fn main() -> ExitCode {
    let cli = match parse::parse(std::env::args_os().collect()) {
        Ok(cli) => cli,
        Err(error) => return ExitCode::from(exit::usage(&error, std::env::args_os())),
    };
    match run(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => ExitCode::from(exit::report(&cli, &error)),
    }
}
