//! `cangauge`: find, configure and log CANopen measuring devices (CiA 404).
//!
//! The layers, from the wire up. Each uses only those named after its arrow; `tests/layers.rs` holds that.
//!
//! - [`canopen`] → nothing. CiA 301 as pure state machines and codecs. Decoding is total; never does I/O,
//!   reads a clock, prints, or knows a device by name.
//! - [`device`] → canopen. What is known of measuring devices: descriptions, units, CiA 404. Data first.
//! - [`bus`] → canopen (frames). The trait [`bus::Bus`] and its transports. The only place with sockets,
//!   clocks, signals and `unsafe`.
//! - [`master`] → bus (the trait), device, canopen. Drives the machines over a bus: deadlines, retries,
//!   matching. Never prints; time is told by what is received.
//! - [`sim`] → bus, device, canopen (frames, ids, values only). Simulated devices, written from the
//!   standard and the manuals and not with the client's encoders.
//! - [`measure`] → master, device, canopen. From TPDOs and SDO answers to samples, and their statistics.
//! - [`tasks`] → measure, master, device, canopen, bus (the trait). The procedures that users think in.
//!   They return reports and print nothing.
//! - [`output`] → tasks (reports), measure, device, canopen (values). Rows and text; knows no bus and no
//!   command line.

pub mod bus;
pub mod canopen;
pub mod device;
pub mod master;
pub mod measure;
pub mod output;
pub mod sim;
pub mod tasks;
