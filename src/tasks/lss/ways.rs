//! Which way to take, and which index stands for the bit rate: decided before anything is changed.

use super::subject::Subject;
use super::{Note, Tell, Via};
use crate::canopen::object::ObjectId;
use crate::device::assign::{AssignEntry, AssignKind, AssignObject, RateSource, RateTable, short_bit_rate};
use crate::device::description::Description;
use crate::device::quirk::Quirk;
use crate::tasks::{Failure, Kind};
use std::fmt;

/// A bit rate as the user names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rate {
    /// In bit/s.
    Bits(u32),
    /// The device finds it out.
    Auto,
    /// What stands at this index in the device's own table, and what the user says that is.
    Index(u8, Option<u32>),
}

/// A bit rate as the device takes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedRate {
    /// The index in the device's table.
    pub index: u8,
    /// In bit/s, where it is known.
    pub bits: Option<u32>,
    /// The device finds it out.
    pub is_auto: bool,
}

impl PlannedRate {
    /// In bit/s or, where that is not known, the index; `auto`.
    pub fn bare(self) -> String {
        self.bits.map_or_else(|| self.to_string(), |bits| bits.to_string())
    }
}

/// `500k`, `auto`, `index 9`.
impl fmt::Display for PlannedRate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.bits {
            Some(bits) => f.write_str(&short_bit_rate(bits)),
            None if self.is_auto => f.write_str("auto"),
            None => write!(f, "index {}", self.index),
        }
    }
}

const STORE_IT: &str = "leave --no-store out, or by LSS where it has it: --via lss";

const STORE_ALL: ObjectId = ObjectId::new(0x1010, 1);

/// The way to take. `store` is whether what is set is to last.
///
/// # Errors
/// A device without the objects that were asked for, or where they cannot be reached; objects that cannot be set
/// without being stored.
pub(super) fn way(subject: &Subject, via: Via, store: bool, tell: Tell<'_>) -> Result<AssignEntry, Failure> {
    let description = subject.model.as_ref().map(|model| &model.description);
    let entry = match via {
        Via::Auto => description.and_then(Description::preferred_assign).cloned(),
        Via::Lss => description.and_then(|description| description.assign_of_kind(AssignKind::Lss)).cloned(),
        Via::Sdo => {
            let entry = description.and_then(|description| description.assign_of_kind(AssignKind::Objects)).cloned();
            Some(entry.ok_or_else(|| {
                let message = "no source at hand says which objects of this device take node-ID and bit rate";
                subject
                    .failure(Kind::CheckFailed, format!("{message}: nothing was changed"))
                    .hint("by LSS: --via lss; with another description: --device NAME")
            })?)
        }
    };
    let entry = entry.unwrap_or_else(AssignEntry::lss);
    if entry.way == AssignKind::Objects && (subject.node.is_none() || !subject.alone) {
        let message =
            "its objects cannot be reached: SDO under its node-ID does not reach it alone; nothing was changed";
        return Err(subject.failure(Kind::CheckFailed, message).hint("connect it alone, or by LSS: --via lss"));
    }
    check_lasts(&entry, store).map_err(|message| subject.failure(Kind::Usage, message).hint(STORE_IT))?;
    if entry.unverified {
        let message = format!("{}: no source prints this way: {}", subject.name(), entry.doubt);
        tell(Note::Warning(message));
    }
    let wipes = description.is_some_and(|description| description.quirks.contains(&Quirk::SaveAllResetsCobIds));
    if entry.store == Some(STORE_ALL) && wipes {
        let message = format!(
            "{}: 1010h:1 keeps every value as it is now, and puts the COB-IDs of 1014h and 180xh:1 to their defaults",
            subject.name()
        );
        tell(Note::Warning(message));
    }
    Ok(entry)
}

/// The index of a bit rate in a device's table.
///
/// # Errors
/// [`Kind::Usage`] with the list of what the device offers.
pub(super) fn plan_rate(
    description: Option<&Description>,
    rate: Rate,
    way: AssignKind,
) -> Result<PlannedRate, Failure> {
    let table = RateTable::of(description);
    let title = description.map_or("CiA 305", |description| &description.title);
    let refuse = |what: String| {
        let mut list: Vec<String> = table.rates().into_iter().map(short_bit_rate).collect();
        list.extend(table.auto().map(|_| "auto".to_owned()));
        let list = list.join(", ");
        let source = if table.source == RateSource::Standard { "the table of CiA 305" } else { "its table" };
        Failure::new(Kind::Usage, format!("{title} has no bit rate {what}: nothing was changed"))
            .hint(format!("{source} has {list}; another by its index: --table-index N"))
    };
    if way == AssignKind::Objects && table.source == RateSource::Standard && !matches!(rate, Rate::Index(..)) {
        let message = format!("the codes that {title} has for bit rates are not known: nothing was changed");
        return Err(Failure::new(Kind::Usage, message).hint("look it up in its manual: --table-index N"));
    }
    match rate {
        Rate::Index(index, bits) => {
            Ok(PlannedRate { index, bits: bits.or_else(|| table.rate_of(index)), is_auto: false })
        }
        Rate::Auto => table
            .auto()
            .map(|index| PlannedRate { index, bits: None, is_auto: true })
            .ok_or_else(|| refuse("auto".to_owned())),
        Rate::Bits(bits) => table
            .index_of(bits)
            .map(|index| PlannedRate { index, bits: Some(bits), is_auto: false })
            .ok_or_else(|| refuse(short_bit_rate(bits))),
    }
}

/// Refuses a bit rate that a device of this description does not offer; to be asked before the bus is opened.
///
/// # Errors
/// [`Kind::Usage`] with the list of what the device offers.
pub fn check_rate(description: &Description, rate: Rate, via: Via) -> Result<(), Failure> {
    let way = match via {
        Via::Auto => description.preferred_assign().map_or(AssignKind::Lss, |entry| entry.way),
        Via::Lss => AssignKind::Lss,
        Via::Sdo => AssignKind::Objects,
    };
    plan_rate(Some(description), rate, way).map(|_| ())
}

/// Refuses to set objects of a device of this description without storing them; to be asked before the bus is opened.
///
/// # Errors
/// [`Kind::Usage`] where only what is stored comes into force, or where it lasts as soon as it is written.
pub fn check_store(description: &Description, store: bool, via: Via) -> Result<(), Failure> {
    let entry = match via {
        Via::Auto => description.preferred_assign(),
        Via::Lss => None,
        Via::Sdo => description.assign_of_kind(AssignKind::Objects),
    };
    let checked = entry.map_or(Ok(()), |entry| check_lasts(entry, store));
    checked.map_err(|message| Failure::new(Kind::Usage, message).hint(STORE_IT))
}

fn check_lasts(entry: &AssignEntry, store: bool) -> Result<(), String> {
    if store || entry.way != AssignKind::Objects {
        return Ok(());
    }
    let why = match entry.store {
        Some(object) => format!("what stands in its objects comes into force once it is stored ({object}) and reset"),
        None => "what is written to its objects lasts".to_owned(),
    };
    Err(format!("{why}, so that --no-store cannot be: nothing was changed"))
}

/// The object that takes a number by this way.
///
/// # Errors
/// A device that has none for it.
pub(super) fn place(subject: &Subject, place: Option<AssignObject>, what: &str) -> Result<AssignObject, Failure> {
    place.ok_or_else(|| {
        let message = format!("no source at hand says which object takes its {what}: nothing was changed");
        subject.failure(Kind::CheckFailed, message).hint("by LSS: --via lss")
    })
}
