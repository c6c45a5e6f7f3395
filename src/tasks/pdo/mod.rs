//! TPDOs: their settings, a change of the settings as a transaction, and the values that they carry.
//!
//! A mapping is changed in the order of CiA 301 (7.5.2.37, 7.5.2.38): switch the PDO off, set the number of entries to 0,
//! write the entries, their number and the other parameters, switch the PDO on. Then either the new settings are read
//! back, or the old ones are restored. If neither is possible, the failure describes the present state.

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

pub use failure::{Incomplete, Occupant, Parameter, PdoEffect, PdoFact, PdoFailure, StepError, StepWrite};

pub use map::{MapReport, map};
pub(super) use map::{change, read, steps};
pub use request::{Item, PdoRequest, Trigger};
pub(super) use request::{entry_of, text_of};
pub use settings::Settings;
pub use show::{MappedItem, TpdoReport, show};
pub use watch::{WatchEvent, watch};
