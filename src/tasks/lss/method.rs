//! Chooses the method to set node-ID and bit rate, and the index of the bit rate, before the first change.

use super::device::LssDevice;
use super::event::LssEvent;
use super::failure::{LssCause, LssFailure, Setting};
use super::{Notify, Via};
use crate::canopen::object::ObjectId;
use crate::device::assign::{AssignEntry, AssignKind, AssignObject, RateSource, RateTable};
use crate::device::description::Description;
use crate::device::quirk::Quirk;
use crate::tasks::Failure;

/// A bit rate as requested by the user.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RequestedRate {
    /// In bit/s.
    Bits(u32),
    /// The device detects the bit rate.
    Auto,
    /// An index in the table of the device, and its bit rate in bit/s if the user stated it.
    Index(u8, Option<u32>),
}

/// A bit rate in the form of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PlannedRate {
    /// The index in the table of the device.
    pub index: u8,
    /// In bit/s; `None` if it is unknown.
    pub bits: Option<u32>,
    /// Whether the device detects the bit rate.
    pub is_auto: bool,
}

/// The object "store all parameters".
const STORE_ALL: ObjectId = ObjectId::new(0x1010, 1);

/// Chooses the method. `store` is `true` if the new values are stored.
///
/// # Errors
/// The device has no known objects, they cannot be reached, or they cannot be set without storing.
pub(super) fn choose_method(
    device: &LssDevice,
    via: Via,
    store: bool,
    notify: Notify<'_>,
) -> Result<AssignEntry, Failure> {
    let description = device.description();
    let of_kind = |kind| description.and_then(|description| description.assign_of_kind(kind)).cloned();
    let entry = match via {
        Via::Auto => description.and_then(Description::preferred_assign).cloned(),
        Via::Lss => of_kind(AssignKind::Lss),
        Via::Sdo => {
            let objects = of_kind(AssignKind::Objects);
            Some(objects.ok_or_else(|| device.failure(LssCause::ObjectsUnknown))?)
        }
    };
    let mut entry = entry.unwrap_or_else(AssignEntry::lss);
    // An unknown device may answer LSS only in STOPPED.
    entry.retry_stopped |= description.is_none_or(|description| description.assign.is_empty());
    if entry.kind == AssignKind::Objects {
        check_objects(device, &entry, store, notify)?;
    }
    Ok(entry)
}

/// Returns the objects to use if the device does not answer LSS. They must be confirmed by a document, reachable, and
/// stored.
pub(super) fn objects_instead(device: &LssDevice, store: bool) -> Option<AssignEntry> {
    let entry = device.description()?.assign_of_kind(AssignKind::Objects)?;
    let is_usable = !entry.unverified && device.own_node().is_some() && refuse_without_store(entry, store).is_ok();
    is_usable.then(|| entry.clone())
}

/// Checks that the objects of a method can be used, and warns about their doubts in the description.
///
/// # Errors
/// The objects cannot be reached, or cannot be set without storing.
pub(super) fn check_objects(
    device: &LssDevice,
    entry: &AssignEntry,
    store: bool,
    notify: Notify<'_>,
) -> Result<(), Failure> {
    if device.own_node().is_none() {
        return Err(device.failure(LssCause::ObjectsOutOfReach));
    }
    refuse_without_store(entry, store).map_err(|cause| device.failure(cause))?;
    if entry.unverified {
        notify(device.note(LssEvent::UnverifiedMethod { doubt: entry.doubt.clone() }));
    }
    let resets_cob_ids =
        device.description().is_some_and(|description| description.quirks.contains(&Quirk::SaveAllResetsCobIds));
    if entry.store == Some(STORE_ALL) && resets_cob_ids {
        notify(device.note(LssEvent::StoreResetsCobIds));
    }
    Ok(())
}

/// Looks up a bit rate in the table of the device.
///
/// # Errors
/// [`LssCause::NoSuchRate`] with the rates of the table.
pub(super) fn plan_rate(
    description: Option<&Description>,
    rate: RequestedRate,
    method: AssignKind,
) -> Result<PlannedRate, LssCause> {
    let table = RateTable::of(description, method);
    let title = description.map(|description| description.title.clone());
    let is_standard = table.source == RateSource::Standard;
    if method == AssignKind::Objects && is_standard && !matches!(rate, RequestedRate::Index(..)) {
        return Err(LssCause::RateCodesUnknown(title));
    }
    let planned = match rate {
        RequestedRate::Index(index, bits) => {
            // The table of this device may differ from the standard table.
            let of_table = || table.rate_of(index).filter(|_| !is_standard);
            Some(PlannedRate { index, bits: bits.or_else(of_table), is_auto: false })
        }
        RequestedRate::Auto => table.auto().map(|index| PlannedRate { index, bits: None, is_auto: true }),
        RequestedRate::Bits(bits) => {
            table.index_of(bits).map(|index| PlannedRate { index, bits: Some(bits), is_auto: false })
        }
    };
    planned.ok_or_else(|| LssCause::NoSuchRate {
        title,
        rate,
        rates: table.rates(),
        has_auto: table.auto().is_some(),
        is_standard,
    })
}

/// Checks that a device with this description has a bit rate, before the bus is opened.
///
/// # Errors
/// [`LssCause::NoSuchRate`] with the rates of the table.
pub fn check_rate(description: &Description, rate: RequestedRate, via: Via) -> Result<(), Failure> {
    let method = match via {
        Via::Auto => description.preferred_assign().map_or(AssignKind::Lss, |entry| entry.kind),
        Via::Lss => AssignKind::Lss,
        Via::Sdo => AssignKind::Objects,
    };
    plan_rate(Some(description), rate, method).map_err(general_failure).map(|_| ())
}

/// Checks that a device with this description can be set without storing, before the bus is opened.
///
/// # Errors
/// [`LssCause::NeedsStore`].
pub fn check_store(description: &Description, store: bool, via: Via) -> Result<(), Failure> {
    let entry = match via {
        Via::Auto => description.preferred_assign(),
        Via::Lss => None,
        Via::Sdo => description.assign_of_kind(AssignKind::Objects),
    };
    entry.map_or(Ok(()), |entry| refuse_without_store(entry, store)).map_err(general_failure)
}

fn general_failure(cause: LssCause) -> Failure {
    Failure::general(LssFailure::general(cause))
}

fn refuse_without_store(entry: &AssignEntry, store: bool) -> Result<(), LssCause> {
    match entry.kind {
        AssignKind::Objects if !store => Err(LssCause::NeedsStore(entry.store)),
        AssignKind::Objects | AssignKind::Lss => Ok(()),
    }
}

/// Returns the object of a method for a setting.
///
/// # Errors
/// [`LssCause::NoObject`].
pub(super) fn object_for(
    device: &LssDevice,
    object: Option<AssignObject>,
    setting: Setting,
) -> Result<AssignObject, Failure> {
    object.ok_or_else(|| device.failure(LssCause::NoObject(setting)))
}
