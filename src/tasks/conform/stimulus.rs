//! The input of the device, which is changed from outside.

use super::finding::WhyNot;
use super::session::Session;
use crate::node::Error;
use std::time::Duration;

/// The input of the first analogue channel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Input {
    /// As before the check.
    Normal,
    /// Inside of the measuring range, and far from the normal value.
    Step,
    /// Above the measuring range.
    OverloadHigh,
    /// Below the measuring range.
    OverloadLow,
}

impl Input {
    /// The word for the command of the user.
    pub fn name(self) -> &'static str {
        match self {
            Input::Normal => "normal",
            Input::Step => "step",
            Input::OverloadHigh => "overload-high",
            Input::OverloadLow => "overload-low",
        }
    }
}

/// Changes the input of the device.
pub trait Stimulus {
    /// Sets the input. Returns when the input is set.
    ///
    /// # Errors
    /// The input is then unknown.
    fn set(&mut self, input: Input) -> Result<(), StimulusFailure>;
}

/// Why the input was not set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StimulusFailure {
    /// The command could not be started. The reason is a text of the system.
    NotStarted(String),
    /// The command ended with this exit code; `None` if a signal ended it.
    Exit(Option<i32>),
    /// The command did not end within this time.
    TimedOut(Duration),
    /// Ctrl-C while the command was running.
    Interrupted,
}

/// How long the device may take to leave the overload.
const RECOVERY: Duration = Duration::from_millis(200);

impl Session<'_, '_> {
    /// Sets the input. Returns the reason if that is not possible. The normal input is set again after the case.
    pub(super) fn set_input(&mut self, input: Input) -> Result<Option<WhyNot>, Error> {
        let Some(stimulus) = &mut self.stimulus else { return Ok(Some(WhyNot::NoStimulus)) };
        self.is_input_changed = true;
        match stimulus.set(input) {
            Ok(()) => Ok(None),
            Err(StimulusFailure::Interrupted) => Err(Error::Interrupted),
            Err(failure) => Ok(Some(WhyNot::Stimulus(input, failure))),
        }
    }

    /// Sets the normal input, if it was changed. After a failure, the next call tries again.
    pub(super) fn restore_input(&mut self) -> Result<(), Error> {
        let Some(stimulus) = self.stimulus.as_mut().filter(|_| self.is_input_changed) else { return Ok(()) };
        self.input_failure = stimulus.set(Input::Normal).err();
        if self.input_failure == Some(StimulusFailure::Interrupted) {
            return Err(Error::Interrupted);
        }
        self.is_input_changed = self.input_failure.is_some();
        self.pause(RECOVERY)
    }
}
