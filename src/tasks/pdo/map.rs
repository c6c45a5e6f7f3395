//! The mapping of a TPDO as a transaction: the settings asked for, read back, or the old ones.

use super::change::Change;
use super::device::Device;
use super::nmt::Switched;
use super::settings::Settings;
use super::show::{Shown, may_inhibit, unread};
use super::wish::Wish;
use super::{identifiers, mend};
use crate::canopen::pdo::TpdoNumber;
use crate::device::catalog::Model;
use crate::device::description::Access;
use crate::master::Master;
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::survey_nodes;
use crate::tasks::store::{self, Done, Group};
use crate::tasks::{Failure, Kind};

/// A TPDO that is set as was asked for.
#[derive(Clone, Debug)]
pub struct Mapped {
    /// What it is set to.
    pub shown: Shown,
    /// How many writes that took.
    pub writes: u32,
    /// What the device acknowledged to have stored, where that was asked for.
    pub stored: Option<Done>,
    /// What is worth knowing.
    pub remarks: Vec<String>,
    /// What is not as one would expect.
    pub warnings: Vec<String>,
}

/// Sets a TPDO as `wish` wants it. With `keep` the device is then told to store it; whether it can, and whether it
/// keeps such settings, is found out before anything is changed.
///
/// # Errors
/// With the old settings in place again, if any were touched; a device that cannot be reached any more is
/// reported with the step that it was left at and the command that mends it.
pub fn map(master: &mut Master<'_>, wish: &Wish, keep: bool, overrides: &Overrides) -> Result<Mapped, Failure> {
    wish.check()?;
    let node = wish.node;
    master.listen_to(&[node])?;
    let found = survey_nodes(master, &[node], overrides)?.pop();
    let instrument = found.ok_or_else(|| Failure::of_node(Kind::NoAnswer, node, "it is not there"))?;
    let model = instrument.model.as_deref();
    let storing = if keep { Some(storing(master, &instrument, wish.number)?) } else { None };
    let mut device = Device::new(master, &instrument);
    let (mapping, remarks) = wish.mapping(&mut device, &instrument)?;
    let inhibit = wish.inhibit_100us.is_some() || may_inhibit(&instrument, wish.number);
    let old = Settings::read(&mut device, wish.number, inhibit).map_err(|trouble| unread(&instrument, trouble))?;
    if old.multiplexed && mapping.is_some() {
        let message = format!("{} is a multiplexed PDO, whose mapping is no list", old.number);
        return Err(Failure::of_node(Kind::Unexpected, node, message));
    }
    let wanted = wish.settings(&old, mapping, &instrument)?;
    check(&mut device, &instrument, &old, &wanted)?;
    let known = model.is_some_and(|model| !model.description.objects.is_empty());
    let remap = model.map(|model| model.description.pdo.remap).unwrap_or_default();
    let mut change = Change {
        device,
        instrument: &instrument,
        old,
        wanted,
        remap,
        known,
        never_off: false,
        state: Switched::default(),
        at: None,
        failed_at: None,
        done: None,
        remarks,
        warnings: Vec::new(),
    };
    change.run()?;
    let Change { device, wanted, remarks, warnings, .. } = change;
    let (writes, master) = (device.writes, device.master);
    let stored = storing.map(|plan| store::carry_out(master, &instrument, plan, false)).transpose();
    let stored = stored.map_err(|failure| {
        failure.knowing(node, format!("{} is set as wanted, and keeps it until power off at the least", wish.number))
    })?;
    Ok(Mapped { shown: Shown::new(&instrument, wanted), writes, stored, remarks, warnings })
}

/// What has to be stored to keep the settings of a TPDO. The communication settings alone where they are a group
/// of their own: a store of everything puts custom COB-IDs back on some devices.
fn storing(master: &mut Master<'_>, instrument: &Node, number: TpdoNumber) -> Result<store::Plan, Failure> {
    let model = instrument.model.as_deref();
    if model.is_some_and(|model| !keeps(model, number)) {
        let message = format!("it does not keep the settings of {number} when it stores: nothing was changed");
        let failure = Failure::of_node(Kind::CheckFailed, instrument.id, message);
        return Err(failure.hint("leave --store out, and set it after every power on"));
    }
    match store::plan(master, instrument, Group::Communication) {
        Err(failure) if failure.kind() == Kind::Refused => store::plan(master, instrument, Group::All),
        plan => plan,
    }
}

/// Whether a device stores the settings of a TPDO, as far as its description tells.
fn keeps(model: &Model, number: TpdoNumber) -> bool {
    let objects = &model.description.objects;
    let tells = objects.iter().any(|entry| entry.stored.is_some());
    let (communication, mapping) = (number.communication(1), number.mapping(1));
    let mut own = objects.iter().filter(|entry| entry.at.contains(communication) || entry.at.contains(mapping));
    !tells || own.all(|entry| entry.stored.is_some() || !entry.access.is_writable())
}

/// What can be known to be wrong before anything is written.
fn check(device: &mut Device<'_, '_>, instrument: &Node, old: &Settings, wanted: &Settings) -> Result<(), Failure> {
    let number = old.number;
    if old.mapping != wanted.mapping && is_fixed(instrument, number) {
        let entries: Vec<String> = old.mapping.iter().map(|&entry| mend::entry_text(entry)).collect();
        let message = format!("the mapping of {number} is fixed ({}): nothing was changed", entries.join(" "));
        return Err(Failure::of_node(Kind::Refused, instrument.id, message));
    }
    let (before, after) = (old.cob_id, wanted.cob_id);
    let moves = before.can_id() != after.can_id();
    if after.is_valid() && (moves || !before.is_valid()) {
        identifiers::free_of_own(instrument, number, after.can_id())?;
    }
    if after.is_valid() && moves {
        identifiers::free_of_others(device, after.can_id())?;
    }
    Ok(())
}

/// Whether the description says that the mapping cannot be written. An EDS file is not believed that much.
fn is_fixed(instrument: &Node, number: TpdoNumber) -> bool {
    let described = instrument.model.as_ref().filter(|model| !model.description.objects.is_empty());
    described.is_some_and(|model| {
        let access = |sub| model.dictionary.get(number.mapping(sub)).map(|entry| entry.access);
        let fixed = |access: Access| !access.is_writable();
        access(0).is_some_and(fixed) || access(1).is_some_and(fixed)
    })
}
