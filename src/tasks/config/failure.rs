//! Causes of failures and effects: settings were not applied.

use super::apply::Row;
use super::problem::Mistake;
use crate::canopen::id::NodeId;
use crate::device::config_file::{Item, Place};
use crate::tasks::failure::Cause;
use crate::tasks::note::{Effect, Fact};
use crate::tasks::{Failure, Kind};

/// Settings were not applied.
#[derive(Clone, Debug)]
pub enum ConfigFailure {
    /// A mistake in a file.
    Mistake {
        /// The file.
        file: String,
        /// The mistake.
        mistake: Box<Mistake>,
    },
    /// The device does not meet the conditions of `[device]`.
    Condition {
        /// The place of the condition in the file.
        place: Place,
        /// Its key.
        key: String,
        /// The value in the file.
        wanted: Item,
        /// The value of the device; `None` if it is unknown.
        found: Option<Item>,
    },
    /// Calibration values without a serial number.
    NoSerial {
        /// The place of the first value.
        place: Place,
    },
    /// Settings do not have the written values.
    ReadBackDiffers {
        /// Key, value of the file, value of the device.
        settings: Vec<(String, Item, Option<Item>)>,
        /// Whether the values were read back after a reset.
        is_after_reset: bool,
    },
    /// Another node uses the new node-ID, or other nodes prevent a change of the bit rate.
    OthersOnBus {
        /// The other nodes.
        nodes: Vec<NodeId>,
    },
    /// No device or several devices have the identity in a row of a table.
    NotOneDevice {
        /// The serial number.
        serial: u32,
        /// The nodes with this identity.
        nodes: Vec<NodeId>,
    },
    /// Devices of a table were not plugged in.
    NotPluggedIn {
        /// The serial numbers.
        serials: Vec<u32>,
    },
    /// A device has no node-ID, and the table contains none for it.
    NoNodeId {
        /// The serial number.
        serial: u32,
    },
    /// The journal could not be written.
    Journal {
        /// The reason.
        reason: String,
    },
    /// The journal contains nothing to roll back.
    NoJournal,
}

/// The changes that remain if settings could not be applied completely.
#[derive(Clone, Debug, PartialEq)]
pub struct ConfigEffect {
    /// The settings that were written.
    pub written: Vec<Row>,
    /// The keys of the settings that were not written.
    pub missing: Vec<String>,
    /// The words that the user typed after the node.
    pub arguments: String,
}

/// A fact about settings that were applied.
#[derive(Clone, Debug, PartialEq)]
pub enum ConfigFact {
    /// Keys of sections that were ignored.
    Ignored {
        /// `address` or `calibration`.
        section: &'static str,
        /// The keys.
        keys: Vec<String>,
    },
    /// Settings that differ from the factory defaults and are not in the file.
    NotInFile {
        /// The keys.
        keys: Vec<String>,
    },
    /// Objects of a DCF that the device does not have.
    NotOnDevice {
        /// The addresses and names.
        objects: Vec<String>,
    },
    /// Objects of a DCF that are not settings: read-only, commands, received PDOs.
    NotSettings {
        /// The addresses and names.
        objects: Vec<String>,
    },
    /// A new bit rate takes effect at the next start of the device.
    RateAfterRestart {
        /// The bit rate in bit/s.
        rate: u32,
    },
}

impl ConfigFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            ConfigFailure::Mistake { .. } | ConfigFailure::NoSerial { .. } => Kind::Usage,
            ConfigFailure::Condition { .. } | ConfigFailure::OthersOnBus { .. } | ConfigFailure::NoJournal => {
                Kind::CheckFailed
            }
            ConfigFailure::NotOneDevice { nodes, .. } if nodes.is_empty() => Kind::NoAnswer,
            ConfigFailure::NotPluggedIn { .. } => Kind::NoAnswer,
            ConfigFailure::NotOneDevice { .. } | ConfigFailure::NoNodeId { .. } => Kind::CheckFailed,
            ConfigFailure::ReadBackDiffers { .. } => Kind::Unexpected,
            ConfigFailure::Journal { .. } => Kind::Io,
        }
    }

    /// Converts the mistakes of a file to failures.
    pub fn of_mistakes(file: &str, node: Option<NodeId>, mistakes: Vec<Mistake>) -> Vec<Failure> {
        let failure = |mistake: Mistake| {
            let cause = ConfigFailure::Mistake { file: file.to_owned(), mistake: Box::new(mistake) };
            Failure { node, ..Failure::general(cause) }
        };
        mistakes.into_iter().map(failure).collect()
    }
}

impl ConfigFact {
    /// Whether the user should react to the fact.
    pub fn is_warning(&self) -> bool {
        !matches!(self, ConfigFact::Ignored { .. } | ConfigFact::NotSettings { .. })
    }
}

impl From<ConfigFailure> for Cause {
    fn from(cause: ConfigFailure) -> Cause {
        Cause::Config(Box::new(cause))
    }
}

impl From<ConfigEffect> for Effect {
    fn from(effect: ConfigEffect) -> Effect {
        Effect::Config(Box::new(effect))
    }
}

impl From<ConfigFact> for Fact {
    fn from(fact: ConfigFact) -> Fact {
        Fact::Config(fact)
    }
}
