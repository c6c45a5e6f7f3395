//! CiA 301 and CiA 305 as state machines and codecs: they take frames, and return frames and results.
//!
//! This layer has no I/O, clock, output or device names. Decoding never panics, for any frame of 0 to 8 bytes.

pub mod emcy;
pub mod frame;
pub mod id;
pub mod lss;
pub mod nmt;
pub mod object;
pub mod pdo;
pub mod sdo;
pub mod value;
pub mod wire_length;
