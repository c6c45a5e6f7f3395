//! Applies a file to a device. The differing settings are written in an order that works on all devices, and read back.

use super::check::{FileSettings, Sections, Wanted};
use super::conditions::check_device;
use super::dump::path;
use super::failure::{ConfigEffect, ConfigFact, ConfigFailure};
use super::order::{service_words, sorted, tpdo_settings};
use super::setting::{Form, Stage, settings};
use super::snapshot::Snapshot;
use super::value::Content;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::TpdoNumber;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::DataType;
use crate::device::config_file::{Entry, Item, Place};
use crate::master::Master;
use crate::node::Overrides;
use crate::node::state::{command, state};
use crate::node::write::write_and_verify;
use crate::tasks::failure::check_confirmed;
use crate::tasks::lss::{Descriptions, Job, RequestedRate, Target, Via, assign};
use crate::tasks::pdo;
use crate::tasks::settings::open;
use crate::tasks::store::{self, Group};
use crate::tasks::{Failure, Note};
use std::collections::BTreeSet;
use std::time::Duration;

/// How a file is applied.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The sections that are used.
    pub sections: Sections,
    /// Whether settings missing in the file are set to their factory defaults.
    pub exact: bool,
    /// Whether the device stores the settings.
    pub store: bool,
    /// Whether the device is reset and read again after the store.
    pub reset: bool,
    /// The words that the user typed after the node: the file and the options.
    pub arguments: String,
}

/// A setting that was changed.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The path in a file.
    pub key: String,
    /// The value before the change.
    pub before: Option<Item>,
    /// The present value; after a failure, the written value.
    pub after: Option<Item>,
}

/// The result for one device.
#[derive(Clone, Debug)]
pub struct ApplyReport {
    /// The node-ID before the change.
    pub node: NodeId,
    /// The settings before the change.
    pub before: Snapshot,
    /// The settings now, read back.
    pub after: Snapshot,
    /// The settings that changed.
    pub rows: Vec<Row>,
    /// Whether the device acknowledged that it stored the settings.
    pub stored: bool,
    /// Whether the settings were read again after a reset.
    pub is_reset: bool,
    /// Notes to report.
    pub notes: Vec<Note>,
}

/// Keeps the old settings of a device until the change is complete.
pub trait Journal {
    /// Called before the first write.
    ///
    /// # Errors
    /// The journal cannot be written. Nothing is changed then.
    fn begin(&mut self, before: &Snapshot) -> Result<(), Failure>;

    /// Called after the last value was read back.
    fn finish(&mut self);
}

/// Returns the settings to apply, and notes about ignored settings. With `exact`, settings that are missing in the file
/// get their factory defaults.
pub fn targets(file: &FileSettings, before: &Snapshot, options: &Options) -> (Vec<Wanted>, Vec<Note>) {
    let id = before.node.id;
    let (mut used, ignored): (Vec<Wanted>, Vec<Wanted>) =
        file.wanted.iter().cloned().partition(|wanted| options.sections.include(&wanted.entry.key));
    let mut notes = Vec::new();
    for section in ["address", "calibration"] {
        let is_other = |wanted: &&Wanted| {
            let differs = before.content(&wanted.setting).as_ref() != Some(&wanted.content);
            wanted.entry.key.starts_with(section) && differs
        };
        let keys: Vec<String> = ignored.iter().filter(is_other).map(|wanted| wanted.entry.key.clone()).collect();
        if !keys.is_empty() {
            notes.push(Note::of_node(id, ConfigFact::Ignored { section, keys }));
        }
    }
    let is_named = |key: &str| file.wanted.iter().any(|wanted| wanted.setting.key == key);
    let rest = before.settings.iter().filter(|setting| !is_named(&setting.key) && setting.is_writable);
    let rest = rest.filter(|setting| setting.stage != Stage::Address && setting.stage != Stage::Calibration);
    let rest: Vec<_> = rest.filter(|setting| before.is_default(setting) == Some(false)).collect();
    if options.exact {
        used.extend(rest.iter().filter_map(|setting| {
            let content = before.default(setting)?;
            let value = setting.show(&before.node, &before.scales, &content);
            let (key, at) = (setting.key.clone(), Place::default());
            Some(Wanted { setting: (*setting).clone(), content, entry: Entry { key, value, key_at: at, value_at: at } })
        }));
    } else if !rest.is_empty() {
        let keys = rest.iter().map(|setting| setting.key.clone()).collect();
        notes.push(Note::of_node(id, ConfigFact::NotInFile { keys }));
    }
    used.retain(|wanted| wanted.setting.is_writable);
    (used, notes)
}

/// Applies the contents of a file to a device.
///
/// # Errors
/// - A condition is not met.
/// - A write failed (with the written and the missing settings).
/// - A value differs when read back.
pub fn apply(
    master: &mut Master<'_>,
    before: Snapshot,
    file: &FileSettings,
    options: &Options,
    overrides: &Overrides,
    journal: &mut dyn Journal,
) -> Result<ApplyReport, Failure> {
    if options.store || options.sections.address {
        check_confirmed(Some(before.node.id), before.node.model.as_deref())?;
    }
    check_device(file, &before, options.sections.calibration)?;
    let (targets, notes) = targets(file, &before, options);
    let mut work = Work {
        master,
        now: before.clone(),
        before,
        targets,
        options,
        overrides,
        written: Vec::new(),
        switched_from: None,
        notes,
        stored: false,
        is_reset: false,
    };
    work.check_bus()?;
    if !work.differing_targets().is_empty() {
        journal.begin(&work.before)?;
    }
    let result = work.carry_out();
    let restored = work.restore_state();
    if let Err(failure) = result.and(restored) {
        return Err(work.explain(failure));
    }
    journal.finish();
    let rows = work.rows();
    let Work { before, now, notes, stored, is_reset, .. } = work;
    Ok(ApplyReport { node: before.node.id, before, after: now, rows, stored, is_reset, notes })
}

struct Work<'m, 'bus> {
    master: &'m mut Master<'bus>,
    before: Snapshot,
    now: Snapshot,
    targets: Vec<Wanted>,
    options: &'m Options,
    overrides: &'m Overrides,
    written: Vec<Row>,
    /// The state from which the node was set to PRE-OPERATIONAL.
    switched_from: Option<NmtState>,
    notes: Vec<Note>,
    stored: bool,
    is_reset: bool,
}

impl Work<'_, '_> {
    /// Returns the settings whose present value on the device differs from the requested value.
    fn differing_targets(&self) -> Vec<&Wanted> {
        let differs = |wanted: &&Wanted| self.now.content(&wanted.setting).as_ref() != Some(&wanted.content);
        self.targets.iter().filter(differs).collect()
    }

    fn address(&self) -> (Option<NodeId>, Option<u32>) {
        let number = |form: Form| {
            let wanted = self.differing_targets().into_iter().find(|wanted| wanted.setting.form == form)?;
            if let Content::Number(number) = wanted.content { Some(number) } else { None }
        };
        let id = number(Form::NodeId).and_then(|id| u8::try_from(id).ok()).and_then(|id| NodeId::new(id).ok());
        (id, number(Form::BitRate))
    }

    /// Checks that a new node-ID is free, and that a device with a new bit rate is the only device on the bus.
    fn check_bus(&mut self) -> Result<(), Failure> {
        let own = self.before.node.id;
        let (id, rate) = self.address();
        let asked: Vec<NodeId> = match (id, rate) {
            (_, Some(_)) => NodeId::all().filter(|node| *node != own).collect(),
            (Some(id), None) => vec![id],
            (None, None) => return Ok(()),
        };
        self.master.listen_to(&asked)?;
        let presence = crate::node::scan::find(self.master, &asked, Duration::from_millis(200), 2)?;
        let nodes: Vec<NodeId> = presence.nodes().into_iter().filter(|node| asked.contains(node)).collect();
        self.master.listen_to(&[own])?;
        if nodes.is_empty() { Ok(()) } else { Err(Failure::at(own, ConfigFailure::OthersOnBus { nodes })) }
    }

    fn carry_out(&mut self) -> Result<(), Failure> {
        self.write_settings()?;
        self.check_kept(false)?;
        if self.options.store {
            self.store(self.options.reset)?;
        }
        let (id, rate) = self.address();
        if id.is_some() || rate.is_some() {
            self.assign(id, rate)?;
        }
        Ok(())
    }

    /// Writes the settings that differ, stage by stage.
    fn write_settings(&mut self) -> Result<(), Failure> {
        let stages: BTreeSet<Stage> = self.targets.iter().map(|wanted| wanted.setting.stage).collect();
        let mut is_stale = false;
        for stage in stages.into_iter().filter(|stage| *stage != Stage::Address) {
            // The device may have converted other settings.
            if is_stale && stage > Stage::Digits {
                self.refresh()?;
                is_stale = false;
            }
            let group = self.targets.iter().filter(|wanted| wanted.setting.stage == stage).cloned().collect();
            let group: Vec<Wanted> = sorted(group, &self.now);
            let wrote = match stage {
                Stage::Tpdo(number) => self.write_tpdo(number, &group)?,
                Stage::Service => self.write_services(&group)?,
                _ => self.write_objects(&group)?,
            };
            is_stale |= wrote && stage <= Stage::Digits;
        }
        if !self.written.is_empty() { self.refresh() } else { Ok(()) }
    }

    fn write_objects(&mut self, group: &[Wanted]) -> Result<bool, Failure> {
        let mut wrote = false;
        for wanted in group {
            let Content::Bytes(bytes) = &wanted.content else { continue };
            if self.now.content(&wanted.setting).as_ref() != Some(&wanted.content) {
                self.write(wanted.setting.object, bytes, wanted.setting.data_type)?;
                self.record(wanted);
                wrote = true;
            }
        }
        Ok(wrote)
    }

    fn write_tpdo(&mut self, number: TpdoNumber, group: &[Wanted]) -> Result<bool, Failure> {
        let Some(old) = self.now.tpdo(number).cloned() else { return Ok(false) };
        let new = tpdo_settings(&old, group);
        if new == old {
            return Ok(false);
        }
        let changed = pdo::change(self.master, &self.now.node, old, new)?;
        self.notes.extend(changed.notes);
        let differing: Vec<Wanted> = self.differing_targets().into_iter().cloned().collect();
        let own = differing.iter().filter(|wanted| wanted.setting.stage == Stage::Tpdo(number));
        own.for_each(|wanted| self.record(wanted));
        // The next TPDO may use an identifier that has just become free.
        self.now.set_tpdo(changed.wanted);
        Ok(true)
    }

    fn write_services(&mut self, group: &[Wanted]) -> Result<bool, Failure> {
        let mut wrote = false;
        for (object, steps) in service_words(group, &self.now) {
            for (at, word) in steps.iter().enumerate() {
                let result = self.write(object, &word.to_le_bytes(), DataType::Unsigned(4));
                // A device without bit 31 rejects the first step, and accepts a new identifier at once.
                if at + 1 == steps.len() || result.as_ref().is_err_and(|failure| failure.abort().is_none()) {
                    result?;
                }
            }
            group.iter().filter(|wanted| wanted.setting.object == object).for_each(|wanted| self.record(wanted));
            wrote = true;
        }
        Ok(wrote)
    }

    /// Writes an object and reads it back. If the device rejects the write because of its NMT state, the node is set to
    /// PRE-OPERATIONAL once.
    fn write(&mut self, object: ObjectId, bytes: &[u8], data_type: DataType) -> Result<(), Failure> {
        let node = &self.now.node;
        let result = write_and_verify(self.master, node, object, bytes, data_type).map_err(Failure::from);
        match result {
            Err(failure) if failure.abort() == Some(AbortCode::DEVICE_STATE) && self.switched_from.is_none() => {
                let id = self.now.node.id;
                if state(self.master, id)? != Some(NmtState::Operational) {
                    return Err(failure.of_object(object));
                }
                self.switched_from = Some(NmtState::Operational);
                command(self.master, NmtCommand::EnterPreOperational, &[id], false)?;
                write_and_verify(self.master, &self.now.node, object, bytes, data_type)?;
                Ok(())
            }
            Err(failure) => Err(failure.of_object(object)),
            Ok(_) => Ok(()),
        }
    }

    fn restore_state(&mut self) -> Result<(), Failure> {
        if self.switched_from.take().is_some() {
            command(self.master, NmtCommand::Start, &[self.now.node.id], false)?;
        }
        Ok(())
    }

    fn record(&mut self, wanted: &Wanted) {
        let before = self.before.show(&wanted.setting);
        let after = Some(wanted.entry.value.clone());
        self.written.push(Row { key: wanted.entry.key.clone(), before, after });
    }

    fn refresh(&mut self) -> Result<(), Failure> {
        let settings = self.now.settings.clone();
        self.now = Snapshot::read(self.master, self.now.node.clone(), settings)?;
        Ok(())
    }

    /// Checks in the last snapshot that the device kept all values.
    fn check_kept(&self, is_after_reset: bool) -> Result<(), Failure> {
        let wrong = self.differing_targets().into_iter().filter(|wanted| wanted.setting.stage != Stage::Address);
        let settings: Vec<_> = wrong
            .map(|wanted| (wanted.entry.key.clone(), wanted.entry.value.clone(), self.now.show(&wanted.setting)))
            .collect();
        match settings.is_empty() {
            true => Ok(()),
            false => Err(Failure::at(self.now.node.id, ConfigFailure::ReadBackDiffers { settings, is_after_reset })),
        }
    }

    fn store(&mut self, reset: bool) -> Result<(), Failure> {
        let plan = store::plan(self.master, &self.now.node, Group::All)?;
        let done = store::carry_out(self.master, &self.now.node, plan, reset)?;
        self.stored = true;
        self.notes.extend(done.notes);
        if reset {
            self.is_reset = true;
            self.refresh()?;
            self.check_kept(true)?;
        }
        Ok(())
    }

    /// Sets node-ID and bit rate, and updates the settings that depend on the node-ID.
    fn assign(&mut self, id: Option<NodeId>, rate: Option<u32>) -> Result<(), Failure> {
        let own = self.now.node.id;
        let job = Job {
            target: Target::Node(own),
            id,
            rate: rate.map(RequestedRate::Bits),
            store: true,
            retime: false,
            via: Via::Auto,
            force: false,
            descriptions: Descriptions { overrides: self.overrides, given: self.overrides.get(&own) },
        };
        let notes = &mut self.notes;
        assign(self.master, &job, &mut |note| notes.push(note))?;
        if let Some(rate) = rate {
            self.notes.push(Note::of_node(own, ConfigFact::RateAfterRestart { rate }));
            return Ok(());
        }
        let Some(id) = id else { return Ok(()) };
        let model = self.overrides.get(&own).cloned();
        let overrides: Overrides = model.into_iter().map(|model| (id, model)).collect();
        let node = open(self.master, id, &overrides)?;
        let catalog = settings(&node);
        for wanted in &mut self.targets {
            let Some(setting) = catalog.iter().find(|setting| setting.key == wanted.setting.key) else { continue };
            if let (Form::CobId(old), Form::CobId(new)) = (&wanted.setting.form, &setting.form)
                && wanted.content == Content::Number((*old).into())
            {
                wanted.content = Content::Number((*new).into());
            }
            wanted.setting = setting.clone();
        }
        self.now = Snapshot::read(self.master, node, catalog)?;
        let count = self.written.len();
        self.write_settings()?;
        self.check_kept(true)?;
        if self.options.store && self.written.len() > count { self.store(false) } else { Ok(()) }
    }

    /// Returns all changes, including conversions by the device after a change of the unit.
    fn rows(&self) -> Vec<Row> {
        let row = |setting: &super::setting::Setting| {
            let old = self.before.settings.iter().find(|old| old.key == setting.key)?;
            let content = self.now.content(setting)?;
            let (before, after) = (self.before.show(old), self.now.show(setting));
            (before != after).then(|| Row { key: path(setting, &content), before, after })
        };
        self.now.settings.iter().filter_map(row).collect()
    }

    /// Adds the written and the missing settings to a failure.
    fn explain(&self, failure: Failure) -> Failure {
        let is_written = |key: &String| self.written.iter().any(|row| row.key == *key);
        let differed = |wanted: &&Wanted| self.before.content(&wanted.setting).as_ref() != Some(&wanted.content);
        let keys = self.targets.iter().filter(differed).map(|wanted| wanted.entry.key.clone());
        let missing = keys.filter(|key| !is_written(key)).collect();
        let effect = ConfigEffect { written: self.written.clone(), missing, arguments: self.options.arguments.clone() };
        failure.with(self.now.node.id, effect)
    }
}
