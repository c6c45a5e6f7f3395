//! The progress of a change.

use super::method::PlannedRate;
use crate::canopen::id::NodeId;
use crate::master::LssError;

/// The state of one step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Stage {
    /// Not sent, or rejected.
    #[default]
    NotDone,
    /// Sent; it is unknown whether the device accepted it.
    Sent,
    /// Acknowledged.
    Done,
    /// Restored to the previous value.
    Reverted,
}

impl Stage {
    /// Returns the stage after an LSS service with this result.
    pub(super) fn after(result: &Result<(), LssError>) -> Stage {
        match result {
            Ok(()) => Stage::Done,
            Err(LssError::Refused { .. }) => Stage::NotDone,
            Err(_) => Stage::Sent,
        }
    }

    /// Whether the device may have the new value.
    pub(super) fn may_be_set(self) -> bool {
        matches!(self, Stage::Sent | Stage::Done)
    }
}

/// The progress of a change of node-ID and bit rate.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Progress {
    /// The new node-ID, if requested.
    pub id: Option<(NodeId, Stage)>,
    /// The new bit rate, if requested.
    pub rate: Option<(PlannedRate, Stage)>,
    /// The progress of storing the new values.
    pub stored: Stage,
    /// Whether the host works at the new bit rate.
    pub is_retimed: bool,
}

impl Progress {
    /// Creates the progress before the first step.
    pub(super) fn new(id: Option<NodeId>, rate: Option<PlannedRate>) -> Progress {
        Progress {
            id: id.map(|id| (id, Stage::NotDone)),
            rate: rate.map(|rate| (rate, Stage::NotDone)),
            ..Progress::default()
        }
    }

    fn stages(&self) -> impl Iterator<Item = Stage> {
        self.id.iter().map(|(_, stage)| *stage).chain(self.rate.iter().map(|(_, stage)| *stage))
    }

    /// Whether the device may have a new value that is not stored.
    pub(super) fn is_pending(&self) -> bool {
        self.stored == Stage::NotDone && self.stages().any(Stage::may_be_set)
    }

    /// Whether the device is certainly unchanged.
    pub(super) fn is_unchanged(&self) -> bool {
        self.stored == Stage::NotDone && !self.is_retimed && !self.stages().any(Stage::may_be_set)
    }

    /// Records a step of the bit rate.
    pub(super) fn set_rate(&mut self, stage: Stage) {
        if let Some((_, rate_stage)) = &mut self.rate {
            *rate_stage = stage;
        }
    }
}
