//! The command line that puts a TPDO back to what it was set to.

use super::settings::Settings;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::pdo::{MappingEntry, Transmission};
use std::time::Duration;

/// The command for `old`. A TPDO that was off, or empty, takes plain writes, in PRE-OPERATIONAL where `preop` says
/// so: `map` switches on what it maps.
pub(super) fn command(node: NodeId, old: &Settings, preop: bool) -> String {
    let number = old.number.get();
    if !old.cob_id.is_valid() || old.mapping.is_empty() {
        let first = if preop { format!("cangauge nmt preop {node} && ") } else { String::new() };
        return first + &writes(node, old);
    }
    let mut line = format!("cangauge pdo map {node} {number}");
    for entry in &old.mapping {
        line += &format!(" {}", entry_text(*entry));
    }
    let transmission = match old.transmission() {
        kind @ (Transmission::AcyclicSync | Transmission::Sync(_)) => kind.to_string(),
        _ => old.transmission.to_string(),
    };
    line += &format!(" --transmission {transmission}");
    if let Some(timer) = old.event_timer_ms {
        line += &format!(" --event-timer {timer}ms");
    }
    if let Some(inhibit) = old.inhibit_100us {
        line += &format!(" --inhibit {}us", inhibit_time(inhibit).as_micros());
    }
    if let CanId::Standard(id) = old.cob_id.can_id() {
        line += &format!(" --cob-id 0x{id:03X}");
    }
    line
}

fn writes(node: NodeId, old: &Settings) -> String {
    let number = old.number;
    let mut line = format!("cangauge sdo write {node}");
    let mut add = |object, value: u32| line += &format!(" {object}=0x{value:X}");
    add(number.communication(1), old.cob_id.switched_off().0);
    add(number.mapping(0), 0);
    for (sub, entry) in (1..=u8::MAX).zip(&old.mapping) {
        add(number.mapping(sub), entry.word());
    }
    add(number.mapping(0), u32::try_from(old.mapping.len()).unwrap_or(0));
    add(number.communication(2), old.transmission.into());
    if let Some(timer) = old.event_timer_ms {
        add(number.communication(5), timer.into());
    }
    if let Some(inhibit) = old.inhibit_100us {
        add(number.communication(3), inhibit.into());
    }
    if old.cob_id.is_valid() {
        add(number.communication(1), old.cob_id.0);
    }
    line
}

/// `0x6130:1/32`.
pub(super) fn entry_text(entry: MappingEntry) -> String {
    format!("{}/{}", entry.object, entry.bits)
}

/// An inhibit time of 180xh:3.
pub(super) fn inhibit_time(inhibit_100us: u16) -> Duration {
    Duration::from_micros(100) * u32::from(inhibit_100us)
}
