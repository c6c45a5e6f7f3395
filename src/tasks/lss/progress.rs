//! What has been done and what not, for whoever has to go on from there.

use super::subject::Subject;
use super::ways::PlannedRate;
use crate::canopen::id::NodeId;
use crate::tasks::{Failure, Kind};

/// How far one step has come.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Stage {
    /// Not begun, or refused.
    #[default]
    No,
    /// Sent; whether it was taken is not known.
    Sent,
    /// Acknowledged.
    Done,
    /// Put back to what it was.
    Undone,
}

/// What has been done so far.
#[derive(Clone, Debug, Default)]
pub(super) struct Done {
    /// The node-ID that is set, and how far that has come.
    pub id: Option<(NodeId, Stage)>,
    /// The bit rate that is set.
    pub rate: Option<(PlannedRate, Stage)>,
    /// Whether it lasts.
    pub stored: Stage,
    /// The host went to the new bit rate together with the device.
    pub retimed: bool,
}

impl Done {
    /// Nothing yet of what is to be set.
    pub(super) fn of(id: Option<NodeId>, rate: Option<PlannedRate>) -> Done {
        Done { id: id.map(|id| (id, Stage::No)), rate: rate.map(|rate| (rate, Stage::No)), ..Done::default() }
    }

    fn stages(&self) -> impl Iterator<Item = Stage> {
        self.id.iter().map(|(_, stage)| *stage).chain(self.rate.iter().map(|(_, stage)| *stage))
    }

    /// Whether the device may hold something new that does not last.
    pub(super) fn is_pending(&self) -> bool {
        self.stored == Stage::No && self.stages().any(|stage| matches!(stage, Stage::Sent | Stage::Done))
    }

    /// Whether the device certainly is as it was.
    pub(super) fn is_untouched(&self) -> bool {
        self.stored == Stage::No
            && !self.retimed
            && self.stages().all(|stage| matches!(stage, Stage::No | Stage::Undone))
    }

    /// What has been done, in words: `node-ID 12 configured, not stored`.
    pub(super) fn spoken(&self) -> String {
        let word = |what: String, stage: Stage| match stage {
            Stage::No => format!("{what} not configured"),
            Stage::Sent => format!("whether {what} was taken is not known"),
            Stage::Done => format!("{what} configured"),
            Stage::Undone => format!("{what} put back"),
        };
        let id = self.id.map(|(id, stage)| word(format!("node-ID {id}"), stage));
        let rate = self.rate.map(|(rate, stage)| word(format!("bit rate {rate}"), stage));
        let stored = match self.stored {
            Stage::No | Stage::Undone => "not stored",
            Stage::Sent => "whether it is stored is not known",
            Stage::Done => "stored",
        };
        id.into_iter().chain(rate).chain([stored.to_owned()]).collect::<Vec<_>>().join(", ")
    }

    /// The failure together with what has been done, and how to go on.
    pub(super) fn explain(&self, failure: Failure, subject: &Subject) -> Failure {
        if self.is_untouched() {
            let is_told = failure.to_string().ends_with("nothing was changed");
            return if is_told { failure } else { failure.and("nothing was changed") };
        }
        let way_on = match (self.stored, failure.kind()) {
            (Stage::Done, _) => "power it off and on, and see what it has become: cangauge scan".to_owned(),
            (Stage::Sent, _) => format!(
                "whether it lasts shows only after power off and on: cangauge scan; or do it again: cangauge lss store {}",
                subject.argument()
            ),
            (_, Kind::Interrupted) => {
                "until it is reset it works as before; power off and on undoes the rest".to_owned()
            }
            _ => "power off and on undoes what is not stored; then do it again".to_owned(),
        };
        let has_hint = self.stored == Stage::No && failure.kind() == Kind::Refused;
        let failure = failure.and(self.spoken());
        if has_hint { failure } else { failure.hint(way_on) }
    }
}
