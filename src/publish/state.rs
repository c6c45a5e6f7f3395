//! The options of a publisher, and its reports: events, failures and progress.

use super::position::PositionError;
use super::row::Tags;
use super::sink::Trouble;
use super::spool::{SpoolEvent, Start};
use std::io;
use std::path::PathBuf;
use std::time::Duration;

/// The options of a publisher.
#[derive(Clone, Debug)]
pub struct Options {
    /// Whether to wait for further rows at the end of the recording.
    pub follow: bool,
    /// Where a recording without a position is read from.
    pub start: Start,
    /// Without `follow`: how long to wait for a server that acknowledges nothing.
    pub give_up: Duration,
    /// The tags of all rows. They replace tags of the recording with the same name.
    pub tags: Tags,
    /// Whether serial number and name of the nodes are tags.
    pub identity: bool,
    /// The bench of a recording without the file of its run.
    pub bench: String,
}

/// An event of a publisher.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PublishEvent {
    /// A file was changed by another program.
    Spool(SpoolEvent),
    /// The position file is damaged. The recording is sent from its start.
    PositionDamaged,
    /// The server does not accept rows at present.
    Trouble(Trouble),
    /// The server accepts rows again.
    Recovered,
    /// Rows that are never accepted: how many, the file and the line of the first one, and the words of the server
    /// (`None` for lines that are not rows).
    Rejected(usize, String, u64, Option<String>),
}

/// Why a publisher ends.
#[derive(Debug)]
pub enum PublishError {
    /// The recording does not exist.
    NoRecording,
    /// The position file cannot be used.
    Position(PathBuf, PositionError),
    /// A file of the recording cannot be read.
    Read(io::Error),
    /// Rejected rows cannot be saved.
    Rejects(PathBuf, io::Error),
    /// The server acknowledged nothing in the time.
    Server(Trouble),
    /// The thread of the publisher has panicked.
    Panicked,
}

/// The state of a publisher.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The recording.
    pub file: String,
    /// The server, without credentials.
    pub url: String,
    /// Rows that were acknowledged, also by earlier runs of the publisher.
    pub sent: u64,
    /// Rows that were acknowledged by this publisher.
    pub sent_now: u64,
    /// Rows that were rejected by this publisher.
    pub rejected_now: u64,
    /// Rows that were rejected, also in earlier runs of the publisher.
    pub rejected: u64,
    /// The bytes that are not acknowledged yet.
    pub behind: u64,
    /// The time of the last acknowledged row, in RFC 3339.
    pub last_row: Option<String>,
    /// Why the server does not accept rows.
    pub trouble: Option<Trouble>,
}
