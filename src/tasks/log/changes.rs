//! Changes in the setup of a node.

use crate::canopen::id::CanId;
use crate::canopen::pdo::{TpdoNumber, Transmission};
use crate::device::unit::Unit;
use crate::measure::layout::{Signal, Tpdo};
use crate::node::Node;

/// A change of the setup of a node that affects its measurements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Change {
    /// Another device has this node-ID: its serial number (1018h:4) before and after.
    Device(Option<u32>, Option<u32>),
    /// The node no longer has this TPDO.
    TpdoRemoved(TpdoNumber),
    /// Bit 31 of the COB-ID was set.
    TpdoDisabled(TpdoNumber),
    /// Parameters of a TPDO changed.
    Tpdo(TpdoNumber, Vec<TpdoChange>),
    /// The unit of a signal (6131h), before and after.
    Unit(String, Option<Unit>, Option<Unit>),
    /// The decimal digits of a signal (6132h), before and after.
    Digits(String, Option<u8>, Option<u8>),
    /// The data type of a signal.
    Type(String),
}

/// A changed parameter of a TPDO, with its new value.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TpdoChange {
    /// The mapped signals and objects.
    Mapping(Vec<String>),
    /// The CAN identifier.
    CanId(CanId),
    /// The transmission type.
    Transmission(Transmission),
    /// The event timer in ms.
    EventTimer(u16),
    /// Other bits of the COB-ID.
    CobIdFlags,
}

/// Returns the differences between two surveys of a node; empty if there are none.
pub(in crate::tasks) fn changes(before: &Node, now: &Node) -> Vec<Change> {
    let mut changes = Vec::new();
    let (old, new) = (&before.identity, &now.identity);
    let parts = [(old.vendor, new.vendor), (old.product, new.product), (old.serial, new.serial)];
    // A part that could not be read does not show another device.
    if parts.into_iter().any(|(old, new)| old.zip(new).is_some_and(|(old, new)| old != new)) {
        changes.push(Change::Device(old.serial, new.serial));
    }
    for tpdo in &now.tpdos {
        let old = before.tpdos.iter().find(|other| other.number == tpdo.number);
        if old != Some(tpdo) {
            changes.push(tpdo_change(tpdo, old, now));
        }
    }
    let is_gone = |old: &&Tpdo| now.tpdos.iter().all(|tpdo| tpdo.number != old.number);
    changes.extend(before.tpdos.iter().filter(is_gone).map(|old| Change::TpdoRemoved(old.number)));
    for signal in &now.signals {
        if let Some(old) = before.signals.iter().find(|other| other.name == signal.name) {
            changes.extend(signal_change(signal, old));
        }
    }
    changes
}

fn tpdo_change(tpdo: &Tpdo, old: Option<&Tpdo>, now: &Node) -> Change {
    if !tpdo.cob_id.is_valid() {
        return Change::TpdoDisabled(tpdo.number);
    }
    let mut parts = Vec::new();
    if old.is_none_or(|old| old.mapping != tpdo.mapping || !old.cob_id.is_valid()) {
        let names = tpdo.mapping.iter().map(|entry| {
            let signal = now.signals.iter().find(|signal| signal.is_value(entry.object));
            signal.map_or_else(|| entry.object.to_string(), |signal| signal.name.clone())
        });
        parts.push(TpdoChange::Mapping(names.collect()));
    }
    if old.is_none_or(|old| old.cob_id.can_id() != tpdo.cob_id.can_id()) {
        parts.push(TpdoChange::CanId(tpdo.cob_id.can_id()));
    }
    if old.is_none_or(|old| old.transmission != tpdo.transmission) {
        parts.extend(tpdo.transmission.map(TpdoChange::Transmission));
    }
    if old.is_none_or(|old| old.event_timer_ms != tpdo.event_timer_ms) {
        parts.extend(tpdo.event_timer_ms.map(TpdoChange::EventTimer));
    }
    if parts.is_empty() {
        parts.push(TpdoChange::CobIdFlags);
    }
    Change::Tpdo(tpdo.number, parts)
}

fn signal_change(signal: &Signal, old: &Signal) -> Option<Change> {
    let name = signal.name.clone();
    if signal.unit != old.unit {
        return Some(Change::Unit(name, old.unit, signal.unit));
    }
    if signal.digits != old.digits {
        return Some(Change::Digits(name, old.digits, signal.digits));
    }
    (signal.value_object != old.value_object).then_some(Change::Type(name))
}
