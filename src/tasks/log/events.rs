//! What happened on the way, counted.

/// Events of a recording, beside emergencies, gaps and dropped frames.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Events {
    /// Boot-ups of recorded nodes.
    pub restarts: u64,
    /// Times that a recorded node became silent.
    pub silences: u64,
    /// Times that a heartbeat stopped.
    pub heartbeat_losses: u64,
    /// Times that a node's mapping, unit or digits turned out to be others than before.
    pub changes: u64,
    /// TPDOs and polled values that came while it was not known what they mean: no row was made of them.
    pub not_recorded: u64,
    /// TPDOs that had not the length of their mapping.
    pub wrong_lengths: u64,
    /// Times that the interface went down.
    pub link_losses: u64,
    /// Times that the controller switched itself off.
    pub bus_offs: u64,
}
