//! Sends recordings to other programs: time-series databases and brokers.
//!
//! The recorded file is the spool. `log` never uses the network.

pub mod cells;
pub mod line_protocol;
