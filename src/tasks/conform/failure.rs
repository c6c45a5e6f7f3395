//! Why a check of a device was refused or ended early.

use super::history::HistoryChange;
use super::lss::LssSetting;
use super::stimulus::StimulusFailure;
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::tasks::Kind;
use crate::tasks::failure::Cause;
use crate::tasks::note::Effect;

/// The check was refused before any change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ConformFailure {
    /// Other nodes or their traffic were seen.
    NotAlone {
        /// The other nodes.
        nodes: Vec<NodeId>,
        /// The first frame that is not from the node.
        frame: Option<Frame>,
    },
    /// An earlier change of the settings was not completed. Its old settings would be lost.
    Unfinished,
}

impl ConformFailure {
    pub(in crate::tasks) fn kind(&self) -> Kind {
        match self {
            ConformFailure::NotAlone { .. } | ConformFailure::Unfinished => Kind::CheckFailed,
        }
    }
}

/// What remains after a check that ended early.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ConformEffect {
    /// These settings do not have the values from before.
    NotRestored(Vec<ObjectId>),
    /// The settings could not be read back.
    Unknown,
    /// The error history could not be read at the end.
    HistoryUnknown,
    /// The error history is not as before.
    HistoryChanged(HistoryChange),
    /// LSS has changed these settings, and could not set the old values again.
    LssNotRestored(Vec<LssSetting>),
    /// The input of the device may not be as before.
    InputNotNormal(StimulusFailure),
}

impl From<ConformFailure> for Cause {
    fn from(failure: ConformFailure) -> Cause {
        Cause::Conform(failure)
    }
}

impl From<ConformEffect> for Effect {
    fn from(effect: ConformEffect) -> Effect {
        Effect::Conform(effect)
    }
}
