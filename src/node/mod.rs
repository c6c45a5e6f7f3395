//! A node: its known facts, and the only functions to read it, write it and wait for it.
//!
//! A task gets a [`Node`] from [`survey`] (identity only, or everything that decoding needs), and passes it to
//! - [`read`]: reads values, several nodes in parallel;
//! - [`mod@write`]: writes an object in the form that the node accepts, and returns how it was confirmed;
//! - [`wait`]: receives frames until a deadline, with one policy for Ctrl-C, link down and the end of a recording;
//! - [`state`]: NMT states, commands, reset and the restart;
//! - [`scan`] and [`targets`]: the nodes on the bus, and the nodes that `all` selects;
//! - [`transfers`]: the SDO transfers of other masters, assembled from their frames;
//! - [`overheard`]: the objects that other masters read and write;
//! - [`mod@offline`]: a node from its description, without a bus;
//! - [`names`]: finds the objects, types and signals for names.
//!
//! Errors are types ([`Error`]); their texts are in `output`.

mod error;
mod facts;
pub mod names;
pub mod offline;
pub mod overheard;
pub mod read;
pub mod scan;
pub(crate) mod signals;
pub mod state;
pub mod survey;
pub mod targets;
pub mod transfers;
pub mod wait;
pub mod write;

pub use error::{Error, NameError};
pub use facts::{Identity, Node};
pub use survey::Overrides;
pub use write::{Form, Repeat, WriteOptions, Written};
