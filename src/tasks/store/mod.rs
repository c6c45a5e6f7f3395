//! Stores the settings of a device in its non-volatile memory: "save" written to 1010h.

mod failure;
pub(super) mod snapshot;

pub use failure::{Difference, StoreEffect, StoreFact, StoreFailure};
pub use snapshot::Snapshot;

use crate::bus::Received;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::DataType;
use crate::device::description::StoreGroup;
use crate::device::quirk::Quirk;
use crate::master::{Master, SdoError, SdoFailure};
use crate::node::read::read_values;
use crate::node::survey::identify;
use crate::node::write::write_with;
use crate::node::{self, Node, Overrides, WriteOptions};
use crate::tasks::failure::check_confirmed;
use crate::tasks::{Failure, Note};
use std::time::Duration;

/// The shortest time-out: writing to non-volatile memory takes longer than other requests.
const STORE_TIMEOUT: Duration = Duration::from_secs(3);

/// A command for the settings of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreCommand {
    /// Store the settings.
    Store,
    /// Restore the factory defaults.
    Restore,
}

impl StoreCommand {
    /// Returns the object for the command of a group: 1010h or 1011h.
    pub fn object(self, group: Group) -> ObjectId {
        let index = match self {
            StoreCommand::Store => 0x1010,
            StoreCommand::Restore => 0x1011,
        };
        ObjectId::new(index, group.sub())
    }

    /// Returns the signature that is written to the object.
    pub fn signature(self) -> &'static str {
        match self {
            StoreCommand::Store => "save",
            StoreCommand::Restore => "load",
        }
    }
}

/// Settings that are stored and restored together; each is a sub-index of 1010h and 1011h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Group {
    /// Everything.
    All,
    /// The communication settings, 1000h to 1FFFh.
    Communication,
    /// The application settings, 6000h to 9FFFh.
    Application,
}

impl Group {
    /// Its name in the output and on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            Group::All => "all",
            Group::Communication => "comm",
            Group::Application => "app",
        }
    }

    /// Returns the names of groups: `all`, `comm+app`.
    pub fn names(groups: &[Group]) -> String {
        groups.iter().map(|group| group.as_str()).collect::<Vec<_>>().join("+")
    }

    /// Returns the sub-index of 1010h and 1011h.
    fn sub(self) -> u8 {
        match self {
            Group::All => 1,
            Group::Communication => 2,
            Group::Application => 3,
        }
    }

    /// Whether the group contains settings with this value of `stored` in a description.
    fn contains(self, stored: &str) -> bool {
        self == Group::All || self.as_str() == stored
    }
}

/// The proof that a command was carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verified {
    /// The device acknowledged the command.
    Ack,
    /// The device was reset and read again.
    Reset,
}

impl Verified {
    /// Its name in the output.
    pub fn as_str(self) -> &'static str {
        match self {
            Verified::Ack => "ack",
            Verified::Reset => "reset",
        }
    }
}

/// The result of a store or restore.
#[derive(Clone, Debug, PartialEq)]
pub struct StoreReport {
    /// The node.
    pub node: NodeId,
    /// The groups, in the order in which they were sent.
    pub groups: Vec<Group>,
    /// The proof.
    pub verified: Verified,
    /// Notes to report.
    pub notes: Vec<Note>,
}

/// Reads the identity of a node.
///
/// # Errors
/// No answer, protocol errors, bus errors and Ctrl-C.
pub fn device(master: &mut Master<'_>, node: NodeId, overrides: &Overrides) -> Result<Node, Failure> {
    Ok(identify(master, &[node], overrides)?.pop().unwrap_or_else(|| Node::new(node)))
}

/// A planned store. Nothing has been changed yet.
#[derive(Clone, Debug, PartialEq)]
pub struct StorePlan {
    groups: Vec<Group>,
    notes: Vec<Note>,
}

/// Determines which groups must be stored for `group`, and which settings the device does not store. Only reads.
///
/// # Errors
/// The device does not store this group on command; no answer, protocol errors, bus errors and Ctrl-C.
pub fn plan(master: &mut Master<'_>, device: &Node, group: Group) -> Result<StorePlan, Failure> {
    check_confirmed(Some(device.id), device.model.as_deref())?;
    let objects = || device.model.iter().flat_map(|model| &model.description.objects);
    let note = |fact| Note::of_node(device.id, fact);
    let resets_cob_ids =
        device.model.as_ref().is_some_and(|model| model.description.quirks.contains(&Quirk::SaveAllResetsCobIds));
    let custom = if resets_cob_ids && group == Group::All { custom_cob_ids(master, device)? } else { Vec::new() };
    let mut notes = Vec::new();
    let groups = if custom.is_empty() {
        vec![group]
    } else {
        notes.push(note(StoreFact::InsteadOfAll(custom)));
        let only_all = objects().filter(|entry| entry.stored == Some(StoreGroup::All));
        let only_all: Vec<String> = only_all.map(|entry| entry.name.clone()).collect();
        notes.extend((!only_all.is_empty()).then(|| note(StoreFact::OnlyInAll(only_all))));
        vec![Group::Communication, Group::Application]
    };
    for &group in &groups {
        check_capability(master, device, StoreCommand::Store, group)?;
    }
    if group == Group::All {
        let lost = snapshot::not_stored(master, device)?;
        notes.extend((!lost.is_empty()).then(|| note(StoreFact::NotStored(lost))));
    }
    Ok(StorePlan { groups, notes })
}

/// Stores a group of settings. With `verify`, the device is then reset and set to its previous NMT state. All settings
/// that it stores are read again and must be unchanged.
///
/// # Errors
/// - The device does not store on command, rejects the command or does not answer.
/// - Settings were not kept.
/// - Bus errors and Ctrl-C.
pub fn store(master: &mut Master<'_>, device: &Node, group: Group, verify: bool) -> Result<StoreReport, Failure> {
    let plan = plan(master, device, group)?;
    carry_out(master, device, plan, verify)
}

/// Carries out a plan; see [`store`].
///
/// # Errors
/// The errors of [`store`].
pub fn carry_out(
    master: &mut Master<'_>,
    device: &Node,
    plan: StorePlan,
    verify: bool,
) -> Result<StoreReport, Failure> {
    let node = device.id;
    let before = if verify {
        let objects = snapshot::objects(device, &plan.groups);
        Some((snapshot::read_settings(master, device, &objects)?, node::state::state(master, node)?))
    } else {
        None
    };
    for (done, &group) in plan.groups.iter().enumerate() {
        send(master, device, StoreCommand::Store, group).map_err(|failure| match &plan.groups[..done] {
            [] => failure,
            stored => failure.with(node, StoreEffect::Stored(stored.to_vec())),
        })?;
    }
    let mut report = StoreReport { node, groups: plan.groups, verified: Verified::Ack, notes: plan.notes };
    let Some((before, state)) = before else { return Ok(report) };
    let compare = |master: &mut Master<'_>| compare(master, device, &before);
    let ((), note) = snapshot::reset(master, node, state, compare)
        .map_err(|failure| failure.with(node, StoreEffect::NotVerified(StoreCommand::Store)))?;
    report.notes.extend(note);
    if before.is_empty() {
        report.notes.push(Note::of_node(node, StoreFact::NothingCompared));
    } else {
        report.verified = Verified::Reset;
    }
    Ok(report)
}

/// Checks that 1010h or 1011h accepts a command for a group: bit 0 of its value. Bit 1 means that the device stores
/// automatically (CiA 301, 7.5.2.13).
pub(super) fn check_capability(
    master: &mut Master<'_>,
    device: &Node,
    command: StoreCommand,
    group: Group,
) -> Result<(), Failure> {
    let object = command.object(group);
    let cause = match master.read(device.id, object, DataType::Unsigned(4))? {
        Ok(bits) => {
            let bits = bits.as_u64().unwrap_or(0);
            match bits & 1 {
                1 => return Ok(()),
                _ => StoreFailure::NotOnCommand { command, bits },
            }
        }
        // The capability is unknown, and the device may accept the command.
        Err(SdoError { failure: SdoFailure::Refused(AbortCode::WRITE_ONLY), .. }) => return Ok(()),
        Err(SdoError { failure: SdoFailure::Refused(code), .. }) => match code {
            AbortCode::NO_SUB_INDEX | AbortCode::NO_OBJECT => StoreFailure::NoGroup { command, group, code },
            _ => StoreFailure::CapabilityUnreadable { command, code },
        },
        Err(error) => return Err(error.into()),
    };
    Err(Failure::at(device.id, cause).of_object(object))
}

/// Returns the COB-IDs that differ from their defaults or cannot be read.
fn custom_cob_ids(master: &mut Master<'_>, device: &Node) -> Result<Vec<(ObjectId, Option<u64>)>, Failure> {
    let is_cob_id = |object: ObjectId| {
        object == ObjectId::new(0x1014, 0) || (0x1800..0x1a00).contains(&object.index) && object.sub == 1
    };
    let entries = device.model.iter().flat_map(|model| model.dictionary.iter());
    let objects: Vec<ObjectId> = entries.map(|entry| entry.object).filter(|&object| is_cob_id(object)).collect();
    let items: Vec<_> = objects.iter().map(|&object| (device.id, object, DataType::Unsigned(4))).collect();
    let mut custom = Vec::new();
    for (object, value) in objects.into_iter().zip(read_values(master, &items)?) {
        let found = match value {
            Ok(value) => value.as_u64(),
            Err(SdoError { failure: SdoFailure::Refused(_), .. }) => None,
            Err(error) => return Err(error.into()),
        };
        let default = snapshot::default(device, object);
        let default = default.and_then(|bytes| DataType::Unsigned(4).decode(&bytes).ok()?.as_u64());
        if found.is_none() || found != default {
            custom.push((object, found));
        }
    }
    Ok(custom)
}

/// Sends the signature of a command once.
pub(super) fn send(master: &mut Master<'_>, device: &Node, command: StoreCommand, group: Group) -> Result<(), Failure> {
    use node::Error as NodeError;
    let (progress, watch) = (&mut |_| {}, &mut |_: &Received| {});
    let mut options = WriteOptions { min_timeout: STORE_TIMEOUT, ..WriteOptions::new(progress, watch) };
    let object = command.object(group);
    let error = match write_with(master, device, object, command.signature().as_bytes(), &mut options) {
        Ok(_) => return Ok(()),
        Err(error) => error,
    };
    let may_have_acted = matches!(error, NodeError::Unknown(_) | NodeError::Bus(_) | NodeError::Interrupted);
    let is_silent = matches!(&error, NodeError::Unknown(SdoError { failure: SdoFailure::NoAnswer { .. }, .. }));
    let failure = Failure::from(error);
    if !may_have_acted {
        return Err(failure);
    }
    let failure = failure.with(device.id, StoreEffect::SignatureSent { command, group });
    match is_silent.then(|| answers(master, device)).flatten() {
        Some(answers) => Err(failure.with(device.id, StoreEffect::Answers(answers))),
        None => Err(failure),
    }
}

/// Whether the device answers another request; `None` if this cannot be determined.
fn answers(master: &mut Master<'_>, device: &Node) -> Option<bool> {
    let answer = master.read(device.id, ObjectId::DEVICE_TYPE, DataType::Unsigned(4)).ok()?;
    Some(!matches!(answer, Err(SdoError { failure: SdoFailure::NoAnswer { .. }, .. })))
}

/// Checks that all settings are as before the reset.
fn compare(master: &mut Master<'_>, device: &Node, before: &[Snapshot]) -> Result<(), Failure> {
    let objects: Vec<ObjectId> = before.iter().map(|setting| setting.object).collect();
    let after = snapshot::read_settings(master, device, &objects)?;
    let differs = |setting: &&Snapshot| !after.contains(setting);
    let difference = |setting: &Snapshot| Difference {
        expected: setting.clone(),
        found: after.iter().find(|other| other.object == setting.object).cloned(),
    };
    let changed: Vec<Difference> = before.iter().filter(differs).map(difference).collect();
    if changed.is_empty() { Ok(()) } else { Err(Failure::at(device.id, StoreFailure::ChangedAtReset(changed))) }
}
