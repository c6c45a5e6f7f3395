//! Lets a device keep its settings beyond power off: "save" written to 1010h.

mod failure;

pub use failure::StoreFailure;

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::DataType;
use crate::device::description::StoreGroup;
use crate::device::quirk::Quirk;
use crate::master::{Master, SdoError, SdoFailure};
use crate::node::Node;
use crate::node::Overrides;
use crate::node::read::read_values;
use crate::node::survey::identify;
use crate::tasks::kept::{self, Held};
use crate::tasks::signature::{STORE_TIMEOUT, may_have_acted, sign};
use crate::tasks::{Failure, Kind};

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
    /// As it stands in the output and on the command line.
    pub fn as_str(self) -> &'static str {
        match self {
            Group::All => "all",
            Group::Communication => "comm",
            Group::Application => "app",
        }
    }

    /// The sub-index of 1010h and 1011h.
    pub(super) fn sub(self) -> u8 {
        match self {
            Group::All => 1,
            Group::Communication => 2,
            Group::Application => 3,
        }
    }

    /// Whether it reaches an object that a description has as kept by `stored`.
    pub(super) fn reaches(self, stored: &str) -> bool {
        self == Group::All || self.as_str() == stored
    }
}

/// What proves that a command was carried out.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Verified {
    /// The device acknowledged it.
    Ack,
    /// The device was reset and read again.
    Reset,
}

impl Verified {
    /// As it stands in the output.
    pub fn as_str(self) -> &'static str {
        match self {
            Verified::Ack => "ack",
            Verified::Reset => "reset",
        }
    }
}

/// What was done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Done {
    /// The groups, in the order in which they went out.
    pub groups: Vec<Group>,
    /// What proves it.
    pub verified: Verified,
    /// What else is worth knowing, in whole sentences without the node.
    pub notes: Vec<String>,
}

impl Done {
    /// The groups as they stand in the output: `all`, `comm+app`.
    pub fn groups(&self) -> String {
        self.groups.iter().map(|group| group.as_str()).collect::<Vec<_>>().join("+")
    }
}

/// What a node is: its identity and, where one is recognised or given, its description.
///
/// # Errors
/// Silence, and what stops everything.
pub fn device(master: &mut Master<'_>, node: NodeId, overrides: &Overrides) -> Result<Node, Failure> {
    Ok(identify(master, &[node], overrides)?.pop().unwrap_or_else(|| Node::new(node)))
}

/// What would be stored, and what is to be said of it. Nothing has been changed yet.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Plan {
    groups: Vec<Group>,
    notes: Vec<String>,
}

/// Finds out what a store of `group` comes to: whether the device can, which identifiers it would lose and what
/// it does not keep. Only reads.
///
/// # Errors
/// A device that does not store this group on command, its silence, and what stops everything.
pub fn plan(master: &mut Master<'_>, device: &Node, group: Group) -> Result<Plan, Failure> {
    let resets_cob_ids =
        device.model.as_ref().is_some_and(|model| model.description.quirks.contains(&Quirk::SaveAllResetsCobIds));
    let custom = if resets_cob_ids && group == Group::All { custom_cob_ids(master, device)? } else { Vec::new() };
    let mut notes = Vec::new();
    let groups = if custom.is_empty() {
        vec![group]
    } else {
        notes.push(format!(
            "comm and app are stored instead of all, which puts these back to their defaults: {}",
            custom.join(", ")
        ));
        let only_all = device.model.iter().flat_map(|model| &model.description.objects);
        let only_all: Vec<&str> =
            only_all.filter(|entry| entry.stored == Some(StoreGroup::All)).map(|entry| entry.name.as_str()).collect();
        if !only_all.is_empty() {
            notes.push(format!("all alone keeps these, they were not stored: {}", only_all.join(", ")));
        }
        vec![Group::Communication, Group::Application]
    };
    for &group in &groups {
        check_capability(master, device, STORE, group)?;
    }
    if group == Group::All {
        let lost = kept::not_kept(master, device)?;
        if !lost.is_empty() {
            notes.push(format!("it does not keep these, they are as delivered after power off: {}", lost.join(", ")));
        }
    }
    Ok(Plan { groups, notes })
}

/// Stores a group of settings. With `verify` the device is then reset, read again, and put back into the NMT
/// state that it was in; everything that it is said to keep must be as it was.
///
/// # Errors
/// Refusals, silence, settings that the device did not keep, and what stops everything. Each says what was stored
/// by then, so far as it is known.
pub fn store(master: &mut Master<'_>, device: &Node, group: Group, verify: bool) -> Result<Done, Failure> {
    let plan = plan(master, device, group)?;
    carry_out(master, device, plan, verify)
}

/// Does what was planned; see [`store`].
///
/// # Errors
/// As [`store`].
pub fn carry_out(master: &mut Master<'_>, device: &Node, plan: Plan, verify: bool) -> Result<Done, Failure> {
    let node = device.id;
    let before = if verify {
        let objects = kept::objects(device, &plan.groups);
        Some((kept::hold(master, device, &objects)?, kept::state(master, node)?))
    } else {
        None
    };
    let mut stored: Vec<&str> = Vec::new();
    for &group in &plan.groups {
        let done = |failure: Failure| match stored.as_slice() {
            [] => failure,
            stored => failure.knowing(node, format!("{} is stored", stored.join(" and "))),
        };
        save(master, device, group).map_err(done)?;
        stored.push(group.as_str());
    }
    let mut done = Done { groups: plan.groups, verified: Verified::Ack, notes: plan.notes };
    let Some((before, state)) = before else { return Ok(done) };
    let look = |master: &mut Master<'_>| compare(master, device, &before);
    let ((), note) = kept::reset(master, node, state, look)
        .map_err(|failure| failure.knowing(node, "the store was acknowledged, and is not proven"))?;
    done.notes.extend(note);
    if before.is_empty() {
        done.notes.push("it was reset, and there is nothing known to compare".to_owned());
    } else {
        done.verified = Verified::Reset;
    }
    Ok(done)
}

/// 1010h.
const STORE: u16 = 0x1010;

/// Whether 1010h or 1011h obeys a command for a group: bit 0 of what it reads as. Bit 1 means that the device
/// stores by itself (CiA 301, 7.5.2.13).
pub(super) fn check_capability(
    master: &mut Master<'_>,
    device: &Node,
    index: u16,
    group: Group,
) -> Result<(), Failure> {
    let (verb, undone) =
        if index == STORE { ("store", "nothing was stored") } else { ("restore", "nothing was restored") };
    let node = device.id;
    let object = ObjectId::new(index, group.sub());
    let refused = |message: String| Failure {
        object: Some(object),
        ..Failure::of_node(Kind::Refused, node, format!("{message}: {undone}"))
    };
    match master.read(node, object, DataType::Unsigned(4))? {
        Ok(bits) => {
            let bits = bits.as_u64().unwrap_or(0);
            let by_itself = if bits & 2 != 0 && index == STORE { "it stores by itself, and " } else { "" };
            match bits & 1 {
                1 => Ok(()),
                _ => Err(refused(format!("{by_itself}it does not {verb} on command ({object} reads 0x{bits:08X})"))),
            }
        }
        // It tells nothing and may still obey.
        Err(SdoError { failure: SdoFailure::Refused(AbortCode::WRITE_ONLY), .. }) => Ok(()),
        Err(SdoError { failure: SdoFailure::Refused(code), .. }) => {
            let what = match (code, group) {
                (AbortCode::NO_SUB_INDEX | AbortCode::NO_OBJECT, Group::Communication | Group::Application) => {
                    format!("it does not {verb} {} by itself (it has no {object})", group.as_str())
                }
                (AbortCode::NO_SUB_INDEX | AbortCode::NO_OBJECT, Group::All) => {
                    format!("it has no way to {verb} (no {object})")
                }
                _ => format!("what it can {verb} cannot be read ({object}: {code})"),
            };
            let failure = refused(what).with_abort(Some(code));
            Err(match group {
                Group::All => failure,
                _ => failure.hint(format!("everything together: cangauge {verb} {node}")),
            })
        }
        Err(error) => Err(error.into()),
    }
}

/// The identifiers that differ from those as delivered, with what they are. One that cannot be read counts.
fn custom_cob_ids(master: &mut Master<'_>, device: &Node) -> Result<Vec<String>, Failure> {
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
        let default = kept::default(device, object);
        let default = default.and_then(|bytes| DataType::Unsigned(4).decode(&bytes).ok()?.as_u64());
        if found.is_none() || found != default {
            let found = found.map_or_else(|| "not readable".to_owned(), |found| format!("0x{found:08X}"));
            custom.push(format!("{object} ({found})"));
        }
    }
    Ok(custom)
}

/// Sends "save" once.
fn save(master: &mut Master<'_>, device: &Node, group: Group) -> Result<(), Failure> {
    let node = device.id;
    let object = ObjectId::new(STORE, group.sub());
    let unknown = format!("\"save\" went to {object} once and is not repeated; whether it was stored is not known");
    let result = sign(master, device, object, b"save", STORE_TIMEOUT);
    let error = match result.map_err(|error| Failure::from(error).knowing(node, &unknown))? {
        Ok(()) => return Ok(()),
        Err(error) => error,
    };
    if !may_have_acted(&error) {
        let hint = match error.failure {
            SdoFailure::Refused(AbortCode(0x0606_0000)) => "its memory fails: it may be worn out or broken".to_owned(),
            SdoFailure::Refused(AbortCode(0x0800_0021 | 0x0800_0022)) => {
                format!("it may want to be stopped in its work first: cangauge nmt preop {node}")
            }
            _ => return Err(error.into()),
        };
        return Err(Failure::from(error).hint(hint));
    }
    let silent = matches!(error.failure, SdoFailure::NoAnswer { .. });
    let failure = Failure::from(error).knowing(node, unknown);
    let failure = if silent { failure.knowing(node, answers(master, device)?) } else { failure };
    Err(failure.hint(format!("once more, and proven: cangauge store {node} --group {} --verify", group.as_str())))
}

/// Whether a device that did not answer a signature answers at all.
pub(super) fn answers(master: &mut Master<'_>, device: &Node) -> Result<&'static str, Failure> {
    let answer = master.read(device.id, ObjectId::new(0x1000, 0), DataType::Unsigned(4))?;
    Ok(match answer {
        Err(SdoError { failure: SdoFailure::NoAnswer { .. }, .. }) => "it does not answer any more",
        Ok(_) | Err(_) => "it answers other requests",
    })
}

/// That everything is as it was before the reset.
fn compare(master: &mut Master<'_>, device: &Node, before: &[Held]) -> Result<(), Failure> {
    let objects: Vec<ObjectId> = before.iter().map(|held| held.object).collect();
    let after = kept::hold(master, device, &objects)?;
    let differs = |held: &&Held| !after.contains(held);
    let lost: Vec<String> = before
        .iter()
        .filter(differs)
        .map(|held| {
            let now = after.iter().find(|other| other.object == held.object);
            let now = now.map_or_else(|| "not readable".to_owned(), |now| held.show(&now.bytes));
            format!("{} was {} and is {now}", held.name(), held.show(&held.bytes))
        })
        .collect();
    if lost.is_empty() {
        return Ok(());
    }
    let message = format!("not everything was kept over the reset: {}", lost.join(", "));
    Err(Failure::of_node(Kind::Unexpected, device.id, message))
}
