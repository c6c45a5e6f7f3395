//! LSS: node-ID and bit rate over the bus (CiA 305). The master side, as pure state machines.
//!
//! A state machine returns the frames to send. The caller passes received frames and time-outs. A state machine never
//! waits.

mod address;
mod answer;
mod error_code;
mod exchange;
mod fastscan;
mod service;

pub use address::{LssAddress, LssAddressError, LssRange};
pub use answer::{Answer, Violation};
pub use error_code::ErrorCode;
pub use exchange::{Exchange, ExchangeError};
pub use fastscan::{Fastscan, FastscanError, Progress, Step, Wait};
pub use service::{Limit, Mode, Part, Request, Service, UNCONFIGURED};
