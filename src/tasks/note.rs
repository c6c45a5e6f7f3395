//! What a task reports besides its result: effects of a failure, notes and warnings.
//!
//! These types contain no text for people. [`crate::output::notes`] turns them into text.

use super::autozero::{AutozeroEffect, AutozeroFact};
use super::config::{ConfigEffect, ConfigFact};
use super::lss::{LssEffect, LssFact};
use super::pdo::{PdoEffect, PdoFact};
use super::settings::{SettingsEffect, SettingsFact};
use super::store::{StoreEffect, StoreFact};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::measure::layout::NarrowValue;

/// What a task that failed had changed before, or what state it left behind.
#[derive(Clone, Debug, PartialEq)]
pub enum Effect {
    /// The task had changed nothing.
    NothingChanged,
    /// An interface could not be set back to its previous state.
    InterfaceNotRestored {
        /// Its name.
        interface: String,
        /// Its previous bit rate in bit/s, if it is known.
        bit_rate: Option<u32>,
        /// The reason.
        reason: String,
    },
    /// The node was operational and may not be operational any more.
    WasOperational,
    /// An autozero failed.
    Autozero(AutozeroEffect),
    /// A change of node-ID or bit rate failed.
    Lss(Box<LssEffect>),
    /// Settings were applied in part.
    Config(Box<ConfigEffect>),
    /// A change of a TPDO failed.
    Pdo(PdoEffect),
    /// A change of a setting failed.
    Settings(SettingsEffect),
    /// The NMT state is not the previous state.
    State(StateEffect),
    /// A store or restore failed.
    Store(StoreEffect),
}

/// The NMT state after a change, if it is not the previous state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateEffect {
    /// The previous state is unknown: the node stays in PRE-OPERATIONAL.
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

/// Something to report that is not the result.
#[derive(Clone, Debug, PartialEq)]
pub struct Note {
    /// The node that it concerns.
    pub node: Option<NodeId>,
    /// The fact.
    pub fact: Fact,
}

/// A fact about a success that is not its result.
#[derive(Clone, Debug, PartialEq)]
pub enum Fact {
    /// The node keeps the new values only until it loses power or is reset, unless they are stored.
    KeptUntilPowerOff,
    /// The node was operational before a reset, was started again, and is operational.
    OperationalAgain,
    /// The node was started, its previous state is unknown, and it stays operational.
    LeftOperational,
    /// A signal is sent as an integer that is too narrow for its measuring range.
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
    /// The state of the node before a reset is unknown; it is in the state in which it boots.
    StateAsBooted,
}

impl Fact {
    /// Whether the user should act on it: printed as a warning.
    pub fn is_warning(&self) -> bool {
        match self {
            Fact::Lss(fact) => fact.event.is_warning(),
            Fact::Config(fact) => fact.is_warning(),
            Fact::Pdo(fact) => fact.is_warning(),
            Fact::Settings(fact) => fact.is_warning(),
            Fact::State(_) | Fact::MayClip(_) => true,
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
    /// Warnings that signals of a node may be clipped.
    pub fn may_clip(node: NodeId, values: Vec<NarrowValue>) -> impl Iterator<Item = Note> {
        values.into_iter().map(move |value| Note { node: Some(node), fact: Fact::MayClip(value) })
    }

    /// A note about one node.
    pub fn of_node(node: NodeId, fact: impl Into<Fact>) -> Note {
        Note { node: Some(node), fact: fact.into() }
    }

    /// A note about no single node.
    pub fn general(fact: impl Into<Fact>) -> Note {
        Note { node: None, fact: fact.into() }
    }
}

/// The effect and the fact of an area as an [`Effect`] and a [`Fact`].
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
