//! One node that the program talks to: what is known of it, and the only ways to read it, write it and wait for it.

mod facts;
pub mod read;
pub mod survey;

pub use facts::{Identity, Node};
pub use survey::Overrides;
