//! `cangauge`: find, configure, check and record CANopen measuring devices (CiA 404).
//!
//! This crate is a library and a command line program. A program that uses only the library sets `default-features =
//! false`, because the feature `cli` contains the output of the program, and the dependencies of its command line.
//!
//! # Layers
//!
//! Each layer uses only the layers after its arrow. `tests/layers.rs` checks this.
//!
//! - [`canopen`] → nothing. The protocols of CiA 301 and CiA 305 as state machines and codecs. Decoding is total:
//!   each frame of 0 to 8 bytes gives a result or an error. No I/O, no clock, no device names.
//! - [`device`] → canopen. Facts about devices: descriptions, units, channels of CiA 404, EDS files.
//! - [`bus`] → canopen (frames). The trait [`bus::Bus`] and its transports: SocketCAN, recordings, memory. The only
//!   layer with sockets, clocks, signals and `unsafe`.
//! - [`master`] → bus (the trait), device, canopen. Drives the state machines: deadlines, retries, matching of answers,
//!   many transfers in parallel.
//! - [`measure`] → device, canopen, bus (time types). Converts frames and answers to samples: decoding, status,
//!   statistics, expressions. It sends and receives nothing.
//! - [`node`] → master, measure, device, canopen, bus (the trait). One node: its identity, signals and TPDOs, and the
//!   ways to read it, write it and wait for it.
//! - [`sim`] → bus, device, canopen (values). Simulated devices. They follow the standard and the manuals, and do not
//!   use the encoders of the client.
//! - [`tasks`] → node, measure, master, device, canopen, bus (the trait). The procedures of the commands: set a
//!   node-ID, map a TPDO, record, check. They return typed reports and typed failures, and print nothing.
//! - [`publish`] → bus (files, time types). Sends recordings to databases and brokers, in its own threads. The names
//!   and cells of recordings and line protocol are always built; the rest needs the feature `publish`.
//! - [`output`] → tasks (reports), publish (reports), node, measure, device, canopen (values), bus (time types,
//!   faults). All sentences, tables and file formats. Part of the feature `cli`.
//!
//! The program (`src/main.rs`) adds one layer. It is not part of the library, so a change in it is built faster:
//!
//! - `cli` → tasks, output, publish, node, measure, master, sim, bus, device, canopen (values). Arguments and help
//!   texts, one file for each command.
//!
//! # Read a sensor
//!
//! The simulated bus needs no hardware. On Linux, `cangauge::bus::socketcan` opens a real interface.
//!
//! ```
//! use cangauge::canopen::id::NodeId;
//! use cangauge::master::{Master, Timing};
//! use cangauge::measure::sample::Number;
//! use cangauge::node::{Overrides, survey::survey_nodes};
//! use cangauge::sim::Bench;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let mut bus = Bench::parse("mh4@1,dps@127")?.open()?;
//! let mut master = Master::new(&mut bus, Timing::default());
//! let ids = [NodeId::new(1)?, NodeId::new(127)?];
//! master.listen_to(&ids)?;
//! for node in survey_nodes(&mut master, &ids, &Overrides::new())? {
//!     for signal in &node.signals {
//!         let (object, Some(data_type)) = signal.value_object else { continue };
//!         let value = master.read(node.id, object, data_type)??;
//!         let number = Number::from_value(&value, signal.digits.unwrap_or(0)).ok_or("not a number")?;
//!         let unit = signal.unit.map(|unit| unit.to_string()).unwrap_or_default();
//!         println!("node {}: {} = {number} {unit}", node.id, signal.name);
//!     }
//! }
//! # Ok(())
//! # }
//! ```
//!
//! # Decode a TPDO
//!
//! Each mapping entry is a word of 1A00h: index, sub-index and number of bits.
//!
//! ```
//! use cangauge::canopen::frame::Frame;
//! use cangauge::canopen::pdo::{MappingEntry, field_layout};
//! use cangauge::canopen::value::{DataType, Value};
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! // TPDO1 of an MH-4: pressure (6130h:1, REAL32) and its status (6150h:1, UNSIGNED8).
//! let fields = field_layout(&[0x6130_0120, 0x6150_0108].map(MappingEntry::from_word));
//! let frame: Frame = "181#2ED5A43F00".parse()?;
//! let (bytes, length) = fields[0].bytes(frame.data()).ok_or("the frame is too short")?;
//! assert_eq!(DataType::Real32.decode(&bytes[..length])?, Value::Real32(1.2877557));
//! let (bytes, length) = fields[1].bytes(frame.data()).ok_or("the frame is too short")?;
//! assert_eq!(DataType::Unsigned(1).decode(&bytes[..length])?, Value::Unsigned(0));
//! # Ok(())
//! # }
//! ```
//!
//! # Simulate a device
//!
//! A bench file describes devices (`man cangauge-bench`). With the virtual clock, waiting takes no time.
//!
//! ```
//! use cangauge::bus::{Bus, Event, Filters};
//! use cangauge::sim::Bench;
//! use std::path::Path;
//! use std::time::Duration;
//!
//! # fn main() -> Result<(), Box<dyn std::error::Error>> {
//! let bench = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\n";
//! let mut bus = Bench::from_toml(bench, Path::new(""))?.open()?;
//! bus.listen(&Filters::All)?;
//! let end = bus.now().mono + Duration::from_secs(1);
//! let mut ids = Vec::new();
//! bus.send(&"080#".parse()?)?; // SYNC
//! while let Event::Frame(received) = bus.receive(end)? {
//!     ids.push(received.frame.id().to_string());
//! }
//! assert_eq!(ids, ["705", "185"]); // boot-up, then TPDO1
//! # Ok(())
//! # }
//! ```

pub mod bus;
pub mod canopen;
pub mod device;
pub mod master;
pub mod measure;
pub mod node;
#[cfg(feature = "cli")]
#[doc(hidden)]
pub mod output;
pub mod publish;
pub mod sim;
pub mod tasks;
