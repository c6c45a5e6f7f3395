//! Lines typed on the terminal while the program works on a bus.

use std::io::stdin;
use std::sync::mpsc::{Receiver, TryRecvError, channel};
use std::thread;

/// The lines of stdin, read by a separate thread that ends with the program.
pub struct TypedLines(Receiver<String>);

impl TypedLines {
    /// Starts to read.
    pub fn open() -> TypedLines {
        let (lines, typed) = channel();
        thread::spawn(move || stdin().lines().map_while(Result::ok).try_for_each(|line| lines.send(line)));
        TypedLines(typed)
    }

    /// Returns the next typed line; `Ok(None)` if there is none. Does not wait.
    ///
    /// # Errors
    /// The input has ended.
    pub fn take(&self) -> Result<Option<String>, EndOfInput> {
        match self.0.try_recv() {
            Ok(line) => Ok(Some(line)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(EndOfInput),
        }
    }
}

/// The input has ended (Ctrl-D).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct EndOfInput;
