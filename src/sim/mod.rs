//! Simulated devices, built from the device descriptions: object dictionary, SDO server, NMT, heartbeat, TPDOs,
//! emergencies, LSS and measured values that change.
//!
//! The code is written from CiA 301, CiA 404 and the manuals, and does not use the encoders of the client. So tests
//! find mistakes in both. No code depends on the name of a device: the descriptions and the files in `models/` contain
//! the differences.
//!
//! A device is a [`Station`](crate::bus::memory::Station) on a [`MemoryBus`](crate::bus::memory::MemoryBus) or, through
//! [`host`], on a real bus.

mod abort;
mod bench;
mod channels;
mod data;
mod device;
mod emergency;
mod filter;
pub mod host;
mod lss;
mod memory;
mod model;
mod nmt;
mod number;
mod objects;
mod record;
mod sdo_block;
mod sdo_server;
mod settings;
mod setup;
mod state;
mod tpdo;

pub use abort::Abort;
pub use bench::{Bench, BenchError};
pub use data::{Form, SimChannel, SimData, SimLss, SimState};
pub use device::Device;
pub use model::{Direction, Overload};
pub use nmt::State;
pub use record::{HEADER, Recorder};
pub use setup::{OfflineAfter, Setup, SimulatedFaults};
