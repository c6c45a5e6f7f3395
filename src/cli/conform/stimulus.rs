//! The command of `--stimulus`, which sets the input of the device.

use cangauge::bus::program::{ProgramError, ShellCommand};
use cangauge::tasks::conform::{Input, Stimulus, StimulusFailure};
use std::io;
use std::time::Duration;

/// The longest time that the command may take.
const TIMEOUT: Duration = Duration::from_secs(60);

/// A shell command whose argument is the input.
pub(super) struct StimulusCommand<'a>(ShellCommand<'a>);

impl StimulusCommand<'_> {
    pub(super) fn new(command: &str) -> io::Result<StimulusCommand<'_>> {
        Ok(StimulusCommand(ShellCommand::new(command, TIMEOUT)?))
    }
}

impl Stimulus for StimulusCommand<'_> {
    fn set(&mut self, input: Input) -> Result<(), StimulusFailure> {
        self.0.run(input.name()).map_err(|error| match error {
            ProgramError::NotStarted(reason) => StimulusFailure::NotStarted(reason),
            ProgramError::Exit(code) => StimulusFailure::Exit(code),
            ProgramError::TimedOut => StimulusFailure::TimedOut(TIMEOUT),
            ProgramError::Interrupted => StimulusFailure::Interrupted,
        })
    }
}
