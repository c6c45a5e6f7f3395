//! `cangauge`: find, configure and log CANopen measuring devices (CiA 404).
//!
//! The layers, from the wire up. Each uses only those named after its arrow; `tests/layers.rs` holds that.
//!
//! - [`canopen`] → nothing. CiA 301 as pure state machines and codecs. Decoding is total; never does I/O,
//!   reads a clock, prints, or knows a device by name.
//! - [`device`] → canopen. What is known of measuring devices: descriptions, units, CiA 404. Data first.
//! - [`bus`] → canopen (frames). The trait [`bus::Bus`] and its transports. The only place with sockets,
//!   clocks, signals and `unsafe`.

// Here and not in Cargo.toml: integration tests may panic, that is how they fail.
#![warn(clippy::unwrap_used, clippy::expect_used, clippy::panic)]

pub mod bus;
pub mod canopen;
pub mod device;
pub mod master;
pub mod measure;
pub mod sim;
