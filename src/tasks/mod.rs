//! The procedures that users think in. They return reports and print nothing.

pub mod detect;
pub mod failure;
pub mod host;
pub mod log;
pub mod nmt;
pub mod read;
pub mod scan;
pub mod sdo;

pub use failure::{Failure, Kind};
