//! A shell command of the user. It receives no text from a device.

use super::interrupt::Interrupts;
use std::io;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

/// The time between two checks whether the command has ended.
const STEP: Duration = Duration::from_millis(20);

/// How long a command may take to end after SIGTERM.
const GRACE: Duration = Duration::from_secs(1);

/// Why a command did not end with exit code 0.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ProgramError {
    /// It could not be started. The reason is a text of the system.
    NotStarted(String),
    /// It ended with this exit code; `None` if a signal ended it.
    Exit(Option<i32>),
    /// It did not end within the time.
    TimedOut,
    /// Ctrl-C while it was running.
    Interrupted,
}

/// A shell command.
pub struct ShellCommand<'a> {
    command: &'a str,
    timeout: Duration,
    interrupts: Interrupts,
}

impl ShellCommand<'_> {
    /// A command that may run for `timeout`.
    ///
    /// # Errors
    /// As [`Interrupts::new`].
    pub fn new(command: &str, timeout: Duration) -> io::Result<ShellCommand<'_>> {
        Ok(ShellCommand { command, timeout, interrupts: Interrupts::new()? })
    }

    /// Runs the command with an argument, and waits for its end. Its standard output is written to standard error.
    ///
    /// # Errors
    /// The command did not end with exit code 0. After a time-out or Ctrl-C, the command gets SIGTERM, so that it can
    /// end its children. A command that is still running 1 s later is killed.
    pub fn run(&mut self, argument: &str) -> Result<(), ProgramError> {
        // The bus reports earlier signals.
        while self.interrupts.take() {}
        let mut child = Command::new("sh")
            .args(["-c", &format!("{} \"$@\"", self.command), "sh", argument])
            .stdout(Stdio::from(io::stderr()))
            .spawn()
            .map_err(|error| ProgramError::NotStarted(error.to_string()))?;
        let result = self.wait(&mut child);
        if result.is_err() {
            end(&mut child);
        }
        result
    }

    fn wait(&mut self, child: &mut Child) -> Result<(), ProgramError> {
        for _ in 0..self.timeout.as_millis() / STEP.as_millis() {
            match child.try_wait() {
                Ok(Some(status)) if status.success() => return Ok(()),
                // The terminal sends Ctrl-C to the command, too.
                Ok(Some(_)) if self.interrupts.take() => return Err(ProgramError::Interrupted),
                Ok(Some(status)) => return Err(ProgramError::Exit(status.code())),
                Ok(None) => {}
                Err(error) => return Err(ProgramError::NotStarted(error.to_string())),
            }
            if self.interrupts.wait_for(STEP) {
                return Err(ProgramError::Interrupted);
            }
        }
        Err(ProgramError::TimedOut)
    }
}

/// Ends a command, if it has not ended already.
fn end(child: &mut Child) {
    // After the command has ended, another process may have its process ID.
    if !matches!(child.try_wait(), Ok(None)) {
        return;
    }
    terminate(child);
    for _ in 0..GRACE.as_millis() / STEP.as_millis() {
        if !matches!(child.try_wait(), Ok(None)) {
            return;
        }
        std::thread::sleep(STEP);
    }
    let _ = child.kill();
    let _ = child.wait();
}

/// Sends SIGTERM to the command.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library can only kill")]
fn terminate(child: &Child) {
    if let Ok(id) = libc::pid_t::try_from(child.id()) {
        // SAFETY: the call accesses no memory. The child keeps its process ID, because it was not waited for yet.
        unsafe { libc::kill(id, libc::SIGTERM) };
    }
}

#[cfg(not(unix))]
fn terminate(_: &Child) {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn failure_and_time_out_are_distinguished() {
        let run = |command: &str, argument: &str| {
            ShellCommand::new(command, Duration::from_millis(500)).expect("signals").run(argument)
        };
        assert_eq!(run("exec sleep 60; ", "low"), Err(ProgramError::TimedOut));
        assert_eq!(run("test low =", "low"), Ok(()));
        assert_eq!(run("test low =", "normal"), Err(ProgramError::Exit(Some(1))));
    }

    #[test]
    fn command_can_end_its_children_after_a_time_out() {
        let folder = tempfile::tempdir().expect("a folder");
        let ended = folder.path().join("ended").display().to_string();
        let command = format!("trap 'kill $!; echo ended >{ended}; exit' TERM; sleep 60 & wait; ");
        let result = ShellCommand::new(&command, Duration::from_millis(500)).expect("signals").run("step");
        assert_eq!(result, Err(ProgramError::TimedOut));
        assert_eq!(std::fs::read_to_string(ended).expect("the file"), "ended\n");
    }
}
