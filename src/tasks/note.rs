//! Further reports of a task: effects of a failure, notes and warnings.
//!
//! These types contain no text. [`crate::output::notes`] converts them to text.

use super::autozero::{AutozeroEffect, AutozeroFact};
use super::config::{ConfigEffect, ConfigFact};
use super::conform::ConformEffect;
use super::lss::{LssEffect, LssFact};
use super::pdo::{PdoEffect, PdoFact};
use super::settings::{SettingsEffect, SettingsFact};
use super::store::{StoreEffect, StoreFact};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::description::ObjectEntry;
use crate::measure::layout::NarrowValue;
use crate::measure::sample::Number;
use crate::node::Node;

/// A change before a failure, or the state after a failed task.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// The task changed nothing.
    NothingChanged,
    /// An interface could not be restored to its previous state.
    InterfaceNotRestored {
        /// Its name.
        interface: String,
        /// Its previous bit rate in bit/s, if it is known.
        bit_rate: Option<u32>,
        /// The reason.
        reason: String,
    },
    /// The node was operational, but may not be operational now.
    WasOperational,
    /// The rejected number breaks a rule of the device.
    Rule(Box<Rule>),
    /// An autozero failed.
    Autozero(AutozeroEffect),
    /// A change of node-ID or bit rate failed.
    Lss(Box<LssEffect>),
    /// Settings were applied partly.
    Config(Box<ConfigEffect>),
    /// A change of a TPDO failed.
    Pdo(PdoEffect),
    /// A change of a setting failed.
    Settings(SettingsEffect),
    /// The NMT state is not the previous state.
    State(StateEffect),
    /// These nodes were started and stay operational: their previous state is unknown.
    LeftOperational(Vec<NodeId>),
    /// A store or restore failed.
    Store(StoreEffect),
    /// A check against the standard ended early.
    Conform(ConformEffect),
}

/// A rule of a description that a number violates.
#[derive(Clone, Debug, PartialEq)]
pub struct Rule {
    /// The object.
    pub object: ObjectId,
    /// The entry of the object in the description.
    pub entry: ObjectEntry,
    /// Whether the number is not allowed. Otherwise, other objects must be 0 first.
    pub is_out_of_range: bool,
}

impl Rule {
    /// Returns the rule of the description that these bytes violate, if any.
    pub fn broken(node: &Node, object: ObjectId, data: &[u8]) -> Option<Rule> {
        let entry = node.described(object)?;
        let is_number = matches!(entry.data_type, DataType::Unsigned(_) | DataType::Integer(_) | DataType::Real32);
        let value = entry.data_type.decode(data).ok().filter(|_| is_number && entry.signature.is_none())?;
        let number = Number::from_value(&value, 0)?.as_f64();
        let is_out_of_range = !entry.allows(number);
        let is_broken = is_out_of_range || number != 0.0 && !entry.only_if_zero.is_empty();
        is_broken.then(|| Rule { object, entry: entry.clone(), is_out_of_range })
    }
}

/// The NMT state after a change, if it is not the previous state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateEffect {
    /// The previous state is unknown, so the node stays in PRE-OPERATIONAL.
    Unknown,
    /// The node did not return to its previous state.
    Differs {
        /// The previous state.
        before: NmtState,
        /// The present state.
        now: NmtState,
    },
    /// The node was set to its previous state, without confirmation.
    Unconfirmed {
        /// The previous state.
        before: NmtState,
    },
    /// The command could not be sent.
    NotRestored,
}

/// A note that is not part of the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// The node of the note.
    pub node: Option<NodeId>,
    /// The fact.
    pub fact: Fact,
}

/// A fact about a successful task.
#[derive(Clone, Debug, PartialEq)]
pub enum Fact {
    /// The new values are lost at power off or reset, unless they are stored.
    KeptUntilPowerOff,
    /// The node was operational before a reset, and was set to OPERATIONAL again.
    OperationalAgain,
    /// The node was started and stays operational, because its previous state is unknown.
    LeftOperational,
    /// The device accepted a number that its description does not allow.
    Rule(Box<Rule>),
    /// A signal is sent as an integer whose limits are smaller than the measuring range.
    MayClip(NarrowValue),
    /// An autozero succeeded.
    Autozero(AutozeroFact),
    /// An LSS task reports a step or a warning.
    Lss(Box<LssFact>),
    /// Settings were applied.
    Config(ConfigFact),
    /// A TPDO was changed.
    Pdo(PdoFact),
    /// A setting was changed or shown.
    Settings(SettingsFact),
    /// The NMT state is not the previous state.
    State(StateEffect),
    /// Settings were stored or restored.
    Store(StoreFact),
    /// The state of the node before a reset is unknown. The node is in its state after boot-up.
    StateAsBooted,
}

impl Fact {
    /// Whether the fact is printed as a warning.
    pub fn is_warning(&self) -> bool {
        match self {
            Fact::Lss(fact) => fact.event.is_warning(),
            Fact::Config(fact) => fact.is_warning(),
            Fact::Pdo(fact) => fact.is_warning(),
            Fact::Settings(fact) => fact.is_warning(),
            Fact::State(_) | Fact::MayClip(_) | Fact::Rule(_) => true,
            Fact::KeptUntilPowerOff
            | Fact::OperationalAgain
            | Fact::LeftOperational
            | Fact::StateAsBooted
            | Fact::Autozero(_)
            | Fact::Store(_) => false,
        }
    }
}

impl Note {
    /// Creates warnings that signals of a node may be clipped.
    pub fn may_clip(node: NodeId, values: Vec<NarrowValue>) -> impl Iterator<Item = Note> {
        values.into_iter().map(move |value| Note { node: Some(node), fact: Fact::MayClip(value) })
    }

    /// Creates a warning if a node accepted a number that its description does not allow.
    pub fn out_of_range(node: &Node, object: ObjectId, data: &[u8]) -> Option<Note> {
        let rule = Rule::broken(node, object, data).filter(|rule| rule.is_out_of_range)?;
        Some(Note::of_node(node.id, Fact::Rule(Box::new(rule))))
    }

    /// Creates a note about one node.
    pub fn of_node(node: NodeId, fact: impl Into<Fact>) -> Note {
        Note { node: Some(node), fact: fact.into() }
    }

    /// Creates a note that does not belong to a single node.
    pub fn general(fact: impl Into<Fact>) -> Note {
        Note { node: None, fact: fact.into() }
    }
}

/// Converts the effect and the fact of an area to an [`Effect`] and a [`Fact`].
macro_rules! areas {
    ($($area:ident($effect:ty, $fact:ty);)+) => {
        $(impl From<$effect> for Effect {
            fn from(effect: $effect) -> Effect {
                Effect::$area(effect.into())
            }
        }

        impl From<$fact> for Fact {
            fn from(fact: $fact) -> Fact {
                Fact::$area(fact.into())
            }
        })+
    };
}

areas! {
    Autozero(AutozeroEffect, AutozeroFact);
    Lss(LssEffect, LssFact);
    Pdo(PdoEffect, PdoFact);
    Settings(SettingsEffect, SettingsFact);
    Store(StoreEffect, StoreFact);
}
