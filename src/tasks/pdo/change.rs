//! Writes the requested settings, and restores the old settings if a step fails.

use super::failure::{Incomplete, PdoEffect, PdoFact, PdoFailure, StepError, StepWrite};
use super::plan;
use super::session::Session;
use super::settings::Settings;
use super::state_switch::StateSwitch;
use crate::canopen::pdo::MappingEntry;
use crate::canopen::sdo::AbortCode;
use crate::device::description::Remap;
use crate::master::{SdoError, SdoFailure};
use crate::tasks::journal::{Journal, TemporaryWrite};
use crate::tasks::note::StateEffect;
use crate::tasks::{Effect, Fact, Failure, Note};
use std::time::Duration;

/// The longest wait for a device that restarts.
const BOOT_TIMEOUT: Duration = Duration::from_secs(3);

/// The number of Ctrl-C that are ignored while the old settings are restored. Each Ctrl-C interrupts one SDO transfer.
const MAX_INTERRUPTS: u32 = 5;

/// A change in progress.
pub(super) struct Change<'m, 'bus> {
    pub(super) session: Session<'m, 'bus>,
    pub(super) old: Settings,
    pub(super) wanted: Settings,
    pub(super) remap: Remap,
    /// Whether a description lists the objects of the device.
    pub(super) is_described: bool,
    /// Whether the device rejects bit 31 of the COB-ID.
    pub(super) never_off: bool,
    pub(super) state: StateSwitch,
    /// The current write.
    pub(super) current: Option<StepWrite>,
    /// The write at which the change failed.
    pub(super) failed_at: Option<StepWrite>,
    /// The last write that was confirmed.
    pub(super) confirmed: Option<StepWrite>,
    pub(super) notes: Vec<Note>,
    pub(super) journal: &'m mut dyn Journal,
    /// The write that switched the PDO off, while it is in the journal.
    pub(super) recorded: Option<TemporaryWrite>,
}

/// The settings of the TPDO after an attempt to restore them.
enum Restored {
    Old,
    New,
}

impl Change<'_, '_> {
    /// Carries out the change, or restores the old settings.
    ///
    /// # Errors
    /// The failed step, with the present settings and state.
    pub(super) fn run(&mut self) -> Result<(), Failure> {
        if let Err(error) = self.attempt() {
            self.undo(&error)?;
        }
        self.remove_record();
        if let Some(state) = self.restore_state() {
            self.note(Fact::State(state));
        }
        self.note_consequences();
        Ok(())
    }

    fn note(&mut self, fact: impl Into<Fact>) {
        self.notes.push(Note::of_node(self.session.node.id, fact));
    }

    fn writes(&self, now: &Settings, wanted: &Settings) -> Vec<StepWrite> {
        plan::writes(now, wanted, self.remap, self.never_off)
    }

    /// Writes the requested settings and reads them back.
    fn attempt(&mut self) -> Result<(), StepError> {
        let (old, wanted) = (self.old.clone(), self.wanted.clone());
        if self.writes(&old, &wanted).is_empty() {
            return Ok(());
        }
        if self.remap == Remap::CountOnly && old.mapping != wanted.mapping {
            self.state.enter(&mut self.session)?;
        }
        let mut writes = self.writes(&old, &wanted);
        let off = writes.first().filter(|write| **write == self.off_write()).cloned();
        if let Some(off) = off {
            writes.remove(0);
            if old.mapping == wanted.mapping {
                self.record(&off)?;
            }
            match self.step(&off) {
                Err(StepError::Rejected(error)) if self.may_stay_on(&error) => {
                    self.note(PdoFact::ChangedWhileOn { number: old.number, error });
                    self.never_off = true;
                    self.remap = Remap::CountOnly;
                    if old.mapping != wanted.mapping {
                        self.state.enter(&mut self.session)?;
                    }
                    writes = self.writes(&old, &wanted);
                }
                result => result?,
            }
        }
        for write in &writes {
            self.step(write)?;
        }
        self.read_back(&wanted)
    }

    /// Records that the PDO is switched off, so that it is switched on again if the program is killed. A PDO with an
    /// incomplete mapping stays off.
    fn record(&mut self, off: &StepWrite) -> Result<(), StepError> {
        let before = self.old.cob_id.0.to_le_bytes();
        let write = TemporaryWrite::to(self.session.node, off.object, &before, &off.bytes());
        self.journal.record(&write).map_err(StepError::NotRecorded)?;
        self.recorded = Some(write);
        Ok(())
    }

    fn remove_record(&mut self) {
        self.recorded.take().iter().for_each(|write| self.journal.remove(write));
    }

    /// Returns the write that switches the PDO off.
    fn off_write(&self) -> StepWrite {
        StepWrite::new(self.old.number.communication(1), self.old.cob_id.switched_off().0, 4)
    }

    /// Whether the change can continue although the device rejected bit 31. Some devices do not support bit 31 and
    /// accept a new mapping without it. This is not allowed if the description requires bit 31.
    fn may_stay_on(&self, error: &SdoError) -> bool {
        let is_unknown_bit = matches!(
            error.failure,
            SdoFailure::Refused(AbortCode::VALUE | AbortCode::READ_ONLY | AbortCode::DEVICE_STATE)
        );
        is_unknown_bit && (!self.is_described || self.remap == Remap::CountOnly)
    }

    /// Carries out one write. If the device rejects the write because of its NMT state, the node is set to
    /// PRE-OPERATIONAL once.
    fn step(&mut self, write: &StepWrite) -> Result<(), StepError> {
        self.current = Some(write.clone());
        match self.session.write(write) {
            Err(StepError::Rejected(SdoError { failure: SdoFailure::Refused(AbortCode::DEVICE_STATE), .. }))
                if !self.state.is_switched() && *write != self.off_write() =>
            {
                self.state.enter(&mut self.session)?;
                self.session.write(write)?;
            }
            result => result?,
        }
        self.confirmed = Some(write.clone());
        Ok(())
    }

    /// Checks that the device has these settings.
    fn read_back(&mut self, wanted: &Settings) -> Result<(), StepError> {
        let found = Settings::read(&mut self.session, wanted.number, wanted.inhibit_100us.is_some())?;
        match found.difference(wanted) {
            Some((object, found, written)) => Err(StepError::ReadBackDiffers { object, found, written }),
            None if self.session.has_restarted => Err(StepError::Restarted),
            None => Ok(()),
        }
    }

    /// Restores the old settings after an error. If the device has all requested settings in spite of the error, this
    /// is a success.
    fn undo(&mut self, error: &StepError) -> Result<(), Failure> {
        self.failed_at = self.current.take();
        let (mut interrupts_left, mut has_waited) = (MAX_INTERRUPTS, false);
        let last = loop {
            match self.restore(error) {
                Ok(Restored::New) => {
                    // No note is needed for a lost answer, or for Ctrl-C after the last step.
                    if matches!(
                        error,
                        StepError::Rejected(_) | StepError::Restarted | StepError::ReadBackDiffers { .. }
                    ) {
                        let (error, write) = (error.clone(), self.failed_at.clone());
                        self.note(PdoFact::SetDespite { number: self.old.number, error, write });
                    }
                    return Ok(());
                }
                Ok(Restored::Old) => {
                    self.remove_record();
                    let (node, number) = (self.session.node.id, self.old.number);
                    let state = self.restore_state();
                    let failure = self.failure(error).with(node, PdoEffect::Restored { number });
                    return Err(match state {
                        Some(state) => failure.with(node, Effect::State(state)),
                        None => failure,
                    });
                }
                Err(StepError::Interrupted) if interrupts_left > 0 => interrupts_left -= 1,
                Err(last @ (StepError::Lost(_) | StepError::Restarted)) if !has_waited => {
                    has_waited = true;
                    // Tries again even if the node sends nothing: a device without heartbeat also needs this time to
                    // boot.
                    if !self.session.has_restarted && self.session.wait_for_life(BOOT_TIMEOUT).is_err() {
                        break last;
                    }
                }
                Err(last) => break last,
            }
        };
        Err(self.incomplete(error, last))
    }

    fn restore(&mut self, error: &StepError) -> Result<Restored, StepError> {
        self.session.has_restarted = false;
        self.session.discard_late_answers()?;
        let (old, wanted) = (self.old.clone(), self.wanted.clone());
        let now = Settings::read(&mut self.session, old.number, old.inhibit_100us.is_some())?;
        if now.difference(&wanted).is_none() {
            return Ok(Restored::New);
        }
        let has_restarted = matches!(error, StepError::Restarted);
        if has_restarted && self.remap == Remap::CountOnly && now.mapping != old.mapping {
            self.state.enter(&mut self.session)?;
        }
        for write in self.writes(&now, &old) {
            self.step(&write)?;
        }
        self.read_back(&old)?;
        Ok(Restored::Old)
    }

    /// Restores the NMT state, if it was known.
    fn restore_state(&mut self) -> Option<StateEffect> {
        let before = self.state.clone();
        for _ in 0..=MAX_INTERRUPTS {
            match self.state.restore(&mut self.session) {
                Err(StepError::Interrupted) => self.state = before.clone(),
                Ok(effect) => return effect,
                Err(_) => break,
            }
        }
        Some(StateEffect::NotRestored)
    }

    /// Returns the failure of the change.
    fn failure(&self, error: &StepError) -> Failure {
        let mappable = match error.abort() {
            Some(AbortCode::NOT_MAPPABLE) => self.mappable(),
            _ => Vec::new(),
        };
        let cause = PdoFailure::Change { error: error.clone(), write: self.failed_at.clone(), mappable };
        let failure = Failure { object: error.object(), ..Failure::at(self.session.node.id, cause) };
        let write =
            self.failed_at.as_ref().filter(|write| Some(write.object) == failure.object && write.object.index < 0x1a00);
        match write {
            Some(write) => failure.explained(self.session.node, write.object, &write.bytes()),
            None => failure,
        }
    }

    /// Returns the entries that the device can map, from its description.
    fn mappable(&self) -> Vec<MappingEntry> {
        let model = self.session.node.model.iter();
        let entries = model.flat_map(|model| model.dictionary.iter()).filter(|entry| entry.pdo);
        let entry = |object, width: usize| Some(MappingEntry { object, bits: u8::try_from(8 * width).ok()? });
        entries.filter_map(|known| entry(known.object, known.data_type.width()?)).collect()
    }

    /// Returns the failure of a change that could not be undone.
    fn incomplete(&self, error: &StepError, last: StepError) -> Failure {
        let is_same_reason = matches!((error, &last), (StepError::Lost(_), StepError::Lost(_)));
        let incomplete = Incomplete {
            last: self.confirmed.clone(),
            restore: (!is_same_reason).then(|| (last, self.current.clone())),
            previous: self.old.clone(),
            needs_preop: self.remap == Remap::CountOnly,
            was_operational: self.state.was_operational(),
        };
        self.failure(error).with(self.session.node.id, PdoEffect::Incomplete(Box::new(incomplete)))
    }

    /// Adds notes about effects that the user may not expect: when the TPDO is sent with the new settings.
    fn note_consequences(&mut self) {
        let Settings { number, event_timer_ms, .. } = self.wanted;
        let transmission = self.wanted.transmission();
        if !self.wanted.cob_id.is_valid() {
            self.note(PdoFact::Off { number });
        } else if transmission.needs_sync() {
            self.note(PdoFact::WaitsForSync { number });
        } else if event_timer_ms == Some(0) {
            self.note(PdoFact::OnlyOnChange { number });
        }
        let node = self.session.node;
        let changed = self.writes(&self.old, &self.wanted).into_iter().filter(|write| write.object.index < 0x1a00);
        self.notes.extend(changed.filter_map(|write| Note::out_of_range(node, write.object, &write.bytes())));
        let is_changed = event_timer_ms != self.old.event_timer_ms || transmission != self.old.transmission();
        let is_unused =
            event_timer_ms != Some(0) && self.session.node.event_timer(Some(transmission), event_timer_ms).is_none();
        if transmission.needs_sync() && event_timer_ms != self.old.event_timer_ms || is_changed && is_unused {
            self.note(PdoFact::TimerUnused { transmission });
        }
    }
}
