//! The procedures of the commands. They return reports and print nothing.

pub mod autozero;
pub mod check;
pub mod config;
pub mod conform;
pub mod describe;
pub mod detect;
pub mod diagnosis;
pub mod doctor;
pub mod export;
pub mod failure;
pub mod health;
pub mod host;
pub mod journal;
pub mod log;
pub mod lss;
pub mod monitor;
pub mod nmt;
pub mod note;
pub mod pdo;
pub mod read;
pub mod restore;
pub mod scan;
pub mod sdo;
pub mod settings;
pub mod store;
mod synced;

pub use failure::{Failure, Kind};
pub use note::{Effect, Fact, Note};
