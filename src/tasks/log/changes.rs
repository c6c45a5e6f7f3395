//! What has changed of an instrument, in words.

use crate::measure::layout::{Signal, Tpdo};
use crate::node::Node;

/// What is different now, as far as measurements go; empty where nothing is.
pub(super) fn changes(before: &Node, now: &Node) -> Vec<String> {
    let mut changes = Vec::new();
    let (old, new) = (&before.identity, &now.identity);
    if (old.vendor, old.product, old.serial) != (new.vendor, new.product, new.serial) {
        let serial = |serial: Option<u32>| serial.map_or_else(|| "none".to_owned(), |serial| serial.to_string());
        let (was, is) = (serial(old.serial), serial(new.serial));
        changes.push(if was == is {
            "it is another device".to_owned()
        } else {
            format!("it is another device, serial {is} and not {was}")
        });
    }
    for tpdo in &now.tpdos {
        let was = before.tpdos.iter().find(|other| other.number == tpdo.number);
        if was != Some(tpdo) {
            changes.push(tpdo_now(tpdo, was, now));
        }
    }
    for gone in before.tpdos.iter().filter(|was| now.tpdos.iter().all(|tpdo| tpdo.number != was.number)) {
        changes.push(format!("it has no {}", gone.number));
    }
    for signal in &now.signals {
        if let Some(was) = before.signals.iter().find(|other| other.name == signal.name) {
            changes.extend(signal_now(signal, was));
        }
    }
    changes
}

fn tpdo_now(tpdo: &Tpdo, was: Option<&Tpdo>, now: &Node) -> String {
    let number = tpdo.number;
    if !tpdo.cob_id.is_valid() {
        return format!("{number} is switched off");
    }
    let mut parts = Vec::new();
    if was.is_none_or(|was| was.mapping != tpdo.mapping || !was.cob_id.is_valid()) {
        let named = tpdo.mapping.iter().map(|entry| {
            let signal = now.signals.iter().find(|signal| signal.is_value(entry.object));
            signal.map_or_else(|| entry.object.to_string(), |signal| signal.name.clone())
        });
        let named: Vec<String> = named.collect();
        parts.push(if named.is_empty() {
            "carries nothing".to_owned()
        } else {
            format!("carries {}", named.join(", "))
        });
    }
    if was.is_none_or(|was| was.cob_id.can_id() != tpdo.cob_id.can_id()) {
        parts.push(format!("comes as {}", tpdo.cob_id.can_id()));
    }
    match tpdo.transmission {
        Some(transmission) if was.is_none_or(|was| was.transmission != tpdo.transmission) => {
            parts.push(format!("is sent {transmission}"));
        }
        _ => {}
    }
    if let Some(timer) = tpdo.event_timer_ms.filter(|_| was.is_none_or(|was| was.event_timer_ms != tpdo.event_timer_ms))
    {
        parts.push(format!("has an event timer of {timer} ms"));
    }
    if parts.is_empty() {
        // Bits of the COB-ID that concern nobody here.
        parts.push("has another COB-ID word".to_owned());
    }
    format!("{number} {}", parts.join(" and "))
}

fn signal_now(signal: &Signal, was: &Signal) -> Option<String> {
    let name = &signal.name;
    let unit = |signal: &Signal| signal.unit.map_or_else(|| "no unit".to_owned(), |unit| unit.to_string());
    if signal.unit != was.unit {
        return Some(format!("{name} is in {} and not in {}", unit(signal), unit(was)));
    }
    let digits = |signal: &Signal| signal.digits.map_or_else(|| "no".to_owned(), |digits| digits.to_string());
    if signal.digits != was.digits {
        return Some(format!("{name} has {} decimal digits and not {}", digits(signal), digits(was)));
    }
    (signal.value != was.value).then(|| format!("{name} is read as another type"))
}
