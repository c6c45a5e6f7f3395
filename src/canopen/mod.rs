//! CiA 301 and 305 as pure state machines and codecs: frames in, frames and results out.
//!
//! No I/O, no clock, no printing, no device names. Decoding any frame of 0 to 8 bytes is total.

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
