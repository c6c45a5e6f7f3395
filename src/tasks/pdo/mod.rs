//! TPDOs: how they are set up, changing that as a transaction, and watching what they carry.
//!
//! A mapping is changed in the order that CiA 301 prescribes (7.5.2.37, 7.5.2.38): the PDO off, the number of
//! entries 0, the entries, their number, the other parameters, the PDO on. What was asked for is read back, or
//! the old settings are put back: nobody is left with half a mapping without being told.

mod change;
mod device;
mod failure;
mod identifiers;
mod map;
mod mend;
mod nmt;
mod plan;
mod report;
mod settings;
mod show;
mod watch;
mod wish;

pub use failure::PdoFailure;

pub use map::{Mapped, map};
pub use settings::Settings;
pub use show::{Carried, Shown, show};
pub use watch::{Line, watch};
pub use wish::{Item, Send, Wish};
