//! Why a file cannot be replayed.

use super::format::{FileFormat, RecordingFormat};

/// A file that is not a usable recording.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordingError {
    /// The file is empty.
    #[error("the file is empty")]
    Empty,
    /// The file has another format.
    #[error("this is {}, which cannot be replayed", .0.name())]
    OtherFormat(FileFormat),
    /// No line shows a known format.
    #[error("not a recording in a known format (candump, Vector ASC, PEAK TRC, CSV of python-can)")]
    UnknownFormat,
    /// The format is known, but no line contains a frame.
    #[error("this is {} without classic CAN frames", .0.name())]
    NoFrames(RecordingFormat),
    /// The format is known, but none of its lines is a frame that the format allows.
    #[error("this looks like {}, but none of its lines could be read", .0.name())]
    NoneUnderstood(RecordingFormat),
    /// The compressed data ends before its first line.
    #[error("the file is cut off: its first line is incomplete")]
    CutOff,
    /// The screen form of candump without times.
    #[error("the frames have no times")]
    NoTimes,
    /// The times count from the previous frame (`candump -td`), or their resolution is too low.
    #[error("the times do not increase: they seem to be intervals from frame to frame (candump -td)")]
    Intervals,
    /// The recording has frames of two channels, but none is chosen.
    #[error("frames of {0} and of {1}: choose one of them")]
    SeveralChannels(String, String),
    /// No frame of the chosen channel.
    #[error("no frames of channel {chosen} ({})", found(.channels))]
    NoChannel {
        /// The chosen channel.
        chosen: String,
        /// The channels of the recording.
        channels: Vec<String>,
    },
}

fn found(channels: &[String]) -> String {
    if channels.is_empty() {
        "the file names no channels".to_owned()
    } else {
        format!("found: {}", channels.join(", "))
    }
}
