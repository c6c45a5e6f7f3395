//! The channels of a recording.

/// The number of channels listed in messages.
pub(super) const MAX_CHANNELS: usize = 16;

/// A channel of a recording.
#[derive(Debug)]
pub(super) struct Channel {
    pub(super) name: String,
    /// Whether its events are delivered.
    pub(super) is_wanted: bool,
}
