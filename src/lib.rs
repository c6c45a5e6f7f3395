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
//! - [`measure`] → device, canopen, bus (moments). From TPDOs and SDO answers to samples, and their
//!   statistics. Drives no bus. When something came is an argument.
//! - [`node`] → master, measure, device, canopen, bus (the trait). One node that the program talks to: what is known
//!   of it, the only way to read and write it, the only wait loop.
//! - [`tasks`] → node, measure, master, device, canopen, bus (the trait). The procedures that users think in.
//!   They return reports and print nothing.
//! - [`output`] → tasks (reports), node, measure, device, canopen (values), bus (moments, faults). Rows and text; knows no
//!   transport and no command line.
//! - [`cli`] → tasks, output, node, measure, master, sim, bus, device, canopen (values). Holds no protocol bytes and
//!   no sockets. One file a subcommand.

pub mod bus;
pub mod canopen;
pub mod cli;
pub mod device;
pub mod master;
pub mod measure;
pub mod node;
pub mod output;
pub mod sim;
pub mod tasks;
