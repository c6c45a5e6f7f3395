//! Decodes TPDOs and SDO answers to samples with unit and status.
//!
//! Nothing here reads a clock: every sample has the stamp of the frame it came with.

pub mod decode;
pub mod expression;
pub mod histogram;
pub mod layout;
pub mod reading;
pub mod sample;
pub mod statistics;
