//! Shows the settings of TPDOs, changes them as a transaction, and receives their values.
//!
//! A mapping is changed in the order of CiA 301 (7.5.2.37, 7.5.2.38): switch the PDO off, set the number of entries to
//! 0, write the entries, their number and the other parameters, switch the PDO on. Then the new settings are read back.
//! If a step fails, the old settings are restored. If this also fails, the failure describes the present state.

mod change;
mod failure;
mod identifiers;
mod map;
mod plan;
mod request;
mod session;
mod settings;
mod show;
mod state_switch;
mod watch;

pub use failure::{CobIdUser, Incomplete, Parameter, PdoEffect, PdoFact, PdoFailure, StepError, StepWrite};

pub use map::{MapReport, map};
pub(super) use map::{change, read, steps};
pub use request::{Item, PdoRequest, Trigger};
pub(super) use request::{entry_of, text_of};
pub use settings::Settings;
pub use show::{MappedItem, TpdoReport, show};
pub use watch::{WatchEvent, watch};
