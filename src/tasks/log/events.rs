//! Counts of the events of a recording.

/// Events of a recording, except emergencies, gaps and dropped frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct EventCounts {
    /// Boot-ups of recorded nodes.
    pub restarts: u64,
    /// The number of times a node stopped sending samples.
    pub silences: u64,
    /// The number of times a heartbeat stopped.
    pub heartbeat_losses: u64,
    /// The number of changes of the mapping, unit or decimal digits of a node.
    pub changes: u64,
    /// TPDOs and polled values that were ignored, because the setup of the node was unknown at that time.
    pub not_recorded: u64,
    /// TPDOs whose length differs from their mapping.
    pub wrong_lengths: u64,
    /// Values that were due after a SYNC of this program but did not arrive.
    pub missing: u64,
    /// The number of times the interface went down.
    pub link_losses: u64,
    /// The number of times the controller went bus-off.
    pub bus_offs: u64,
}
