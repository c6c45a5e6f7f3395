//! Sets the mapping and the parameters of a TPDO as a transaction.

use super::change::Change;
use super::failure::{PdoEffect, PdoFact, PdoFailure, StepWrite, read_failure};
use super::identifiers;
use super::plan;
use super::request::PdoRequest;
use super::session::Session;
use super::settings::Settings;
use super::show::{TpdoReport, may_have_inhibit_time, tpdo_numbers};
use super::state_switch::StateSwitch;
use crate::canopen::pdo::TpdoNumber;
use crate::device::catalog::Model;
use crate::device::description::Access;
use crate::master::Master;
use crate::measure::layout::Tpdo;
use crate::node::survey::narrow_values;
use crate::node::{Node, Overrides};
use crate::tasks::journal::{Journal, NoJournal};
use crate::tasks::settings::open;
use crate::tasks::store::{self, Group};
use crate::tasks::{Failure, Kind, Note};

/// The result of [`map`].
#[derive(Clone, Debug)]
pub struct MapReport {
    /// The settings of the TPDO now.
    pub shown: TpdoReport,
    /// The number of writes.
    pub writes: u32,
    /// Whether the device acknowledged that it stored the settings.
    pub stored: bool,
    /// Notes to report.
    pub notes: Vec<Note>,
}

/// Sets a TPDO as requested. With `store` the device then stores the settings. All checks are made before the first
/// write. The journal records that the TPDO is off while its parameters change.
///
/// # Errors
/// If a step failed, the old settings are restored. If this also failed, the failure contains the last confirmed step
/// and the old settings.
pub fn map(
    master: &mut Master<'_>,
    request: &PdoRequest,
    store: bool,
    overrides: &Overrides,
    journal: &mut dyn Journal,
) -> Result<MapReport, Failure> {
    request.check()?;
    let (number, node) = (request.number, open(master, request.node, overrides)?);
    let plan = if store { Some(store_plan(master, &node, number)?) } else { None };
    let mut session = Session::new(master, &node);
    let (mapping, mut notes) = request.mapping(&mut session)?;
    let has_inhibit = request.inhibit_100us.is_some() || may_have_inhibit_time(&node, number);
    let old = Settings::read(&mut session, number, has_inhibit);
    let old = old.map_err(|error| read_failure(node.id, tpdo_numbers(&node), error))?;
    if old.multiplexed && mapping.is_some() {
        return Err(Failure::at(node.id, PdoFailure::Multiplexed { number }));
    }
    let wanted = request.settings(&old, mapping, &node)?;
    if wanted.mapping != old.mapping {
        let tpdo = Tpdo {
            number,
            cob_id: wanted.cob_id,
            transmission: None,
            event_timer_ms: None,
            mapping: wanted.mapping.clone(),
        };
        let mut planned = Node { tpdos: vec![tpdo], ..node.clone() };
        notes.extend(Note::may_clip(node.id, narrow_values(session.master, &mut planned)?));
    }
    let Changed { writes, wanted, notes: change_notes } = change_settings(session, old, wanted, journal)?;
    let note = |fact: PdoFact| Note::of_node(node.id, fact);
    if writes == 0 {
        notes.insert(0, note(PdoFact::AlreadySet { number }));
    }
    let stored = plan.map(|plan| store::carry_out(master, &node, plan, false)).transpose();
    let stored = stored.map_err(|failure| failure.with(node.id, PdoEffect::SetNotStored { number }))?;
    if let Some(done) = &stored {
        notes.push(note(PdoFact::Stored { groups: done.groups.clone() }));
        notes.extend(done.notes.iter().cloned());
    }
    notes.extend(change_notes);
    if writes > 0 && node.model.as_deref().is_some_and(|model| !is_stored(model, number)) {
        notes.push(note(PdoFact::LostAtPowerOff { number }));
    }
    Ok(MapReport { shown: TpdoReport::new(&node, wanted), writes, stored: stored.is_some(), notes })
}

/// A completed change of a TPDO.
pub(in crate::tasks) struct Changed {
    /// The number of writes.
    pub writes: u32,
    /// The settings now.
    pub wanted: Settings,
    /// Notes to report.
    pub notes: Vec<Note>,
}

/// Reads the settings of a TPDO.
///
/// # Errors
/// The node rejects a read or does not answer; bus errors and Ctrl-C.
pub(in crate::tasks) fn read(master: &mut Master<'_>, node: &Node, number: TpdoNumber) -> Result<Settings, Failure> {
    let settings = Settings::read(&mut Session::new(master, node), number, may_have_inhibit_time(node, number));
    settings.map_err(|error| read_failure(node.id, tpdo_numbers(node), error))
}

/// Changes the settings of a TPDO of a known node as a transaction: see [`map()`].
///
/// # Errors
/// The errors of [`map()`].
pub(in crate::tasks) fn change(
    master: &mut Master<'_>,
    node: &Node,
    old: Settings,
    wanted: Settings,
) -> Result<Changed, Failure> {
    change_settings(Session::new(master, node), old, wanted, &mut NoJournal)
}

/// Returns the writes of [`change`] for a device that rejects none of them.
pub(in crate::tasks) fn steps(node: &Node, old: &Settings, wanted: &Settings) -> Vec<StepWrite> {
    let remap = node.model.as_ref().map(|model| model.description.pdo.remap).unwrap_or_default();
    plan::writes(old, wanted, remap, false)
}

fn change_settings<'m>(
    mut session: Session<'m, '_>,
    old: Settings,
    wanted: Settings,
    journal: &'m mut dyn Journal,
) -> Result<Changed, Failure> {
    check(&mut session, &old, &wanted)?;
    let model = session.node.model.as_deref();
    let mut change = Change {
        remap: model.map(|model| model.description.pdo.remap).unwrap_or_default(),
        is_described: model.is_some_and(|model| !model.description.objects.is_empty()),
        session,
        old,
        wanted,
        never_off: false,
        state: StateSwitch::default(),
        current: None,
        failed_at: None,
        confirmed: None,
        notes: Vec::new(),
        journal,
        recorded: None,
    };
    change.run()?;
    Ok(Changed { writes: change.session.writes, wanted: change.wanted, notes: change.notes })
}

/// Plans how to store the settings of a TPDO: as communication settings, if the device has this group. Some devices
/// reset custom COB-IDs if all settings are stored.
fn store_plan(master: &mut Master<'_>, node: &Node, number: TpdoNumber) -> Result<store::StorePlan, Failure> {
    if node.model.as_deref().is_some_and(|model| !is_stored(model, number)) {
        return Err(Failure::at(node.id, PdoFailure::NotStored { number }));
    }
    match store::plan(master, node, Group::Communication) {
        Err(failure) if failure.kind() == Kind::Refused => store::plan(master, node, Group::All),
        plan => plan,
    }
}

/// Whether a device stores the settings of a TPDO. True if its description does not mark stored objects.
fn is_stored(model: &Model, number: TpdoNumber) -> bool {
    let objects = &model.description.objects;
    let is_known = objects.iter().any(|entry| entry.stored.is_some());
    let (communication, mapping) = (number.communication(1), number.mapping(1));
    let mut own = objects.iter().filter(|entry| entry.at.contains(communication) || entry.at.contains(mapping));
    !is_known || own.all(|entry| entry.stored.is_some() || !entry.access.is_writable())
}

/// Runs the checks that are possible before the first write.
fn check(session: &mut Session<'_, '_>, old: &Settings, wanted: &Settings) -> Result<(), Failure> {
    let (number, node) = (old.number, session.node);
    if old.mapping != wanted.mapping && has_fixed_mapping(node, number) {
        return Err(Failure::at(node.id, PdoFailure::FixedMapping { number, mapping: old.mapping.clone() }));
    }
    let (before, after) = (old.cob_id, wanted.cob_id);
    let id_changes = before.can_id() != after.can_id();
    if after.is_valid() && (id_changes || !before.is_valid()) {
        identifiers::check_own(node, number, after.can_id())?;
    }
    if after.is_valid() && id_changes {
        identifiers::check_others(session, after.can_id())?;
    }
    Ok(())
}

/// Whether the mapping is read-only according to the description. The access types of EDS files are not reliable, so
/// they are not used.
fn has_fixed_mapping(node: &Node, number: TpdoNumber) -> bool {
    let described = node.model.as_ref().filter(|model| !model.description.objects.is_empty());
    described.is_some_and(|model| {
        let access = |sub| model.dictionary.get(number.mapping(sub)).map(|entry| entry.access);
        let is_fixed = |access: Access| !access.is_writable();
        access(0).is_some_and(is_fixed) || access(1).is_some_and(is_fixed)
    })
}
