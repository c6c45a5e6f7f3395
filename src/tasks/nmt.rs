//! NMT commands and states.

mod failure;
mod probe;
mod startup;
mod watch;

pub use crate::node::state::{Proof, StateReport, command, states};
pub use failure::NmtFailure;
pub use probe::{Probe, UnrestoredHeartbeat, probe};
pub use startup::{Starts, StartupReport, startup};
pub use watch::{Change, StateEvent, watch};
