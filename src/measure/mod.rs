//! Decodes TPDOs and SDO answers to samples with unit and status.
//!
//! This layer does not read a clock: every sample has the time stamp of its frame.

pub mod decode;
pub mod expression;
pub mod histogram;
pub mod interval;
pub mod layout;
pub mod reading;
pub mod sample;
pub mod statistics;
