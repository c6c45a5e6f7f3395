//! Plans the writes that change the settings of a TPDO, in the order of CiA 301.

use super::failure::StepWrite;
use super::settings::Settings;
use crate::device::description::Remap;

/// Returns the writes that change the settings from `now` to `wanted`; empty if the settings are equal.
///
/// The mapping is changed while the PDO is off ([`Remap::Invalidate`]) or has no entries ([`Remap::CountOnly`]).
/// Identifier and inhibit time are changed while the PDO is off. To switch the PDO off, bit 31 of the COB-ID is set.
/// The other bits are kept, because some devices reject a COB-ID without bit 30. With `never_off` bit 31 is never set.
pub(super) fn writes(now: &Settings, wanted: &Settings, remap: Remap, never_off: bool) -> Vec<StepWrite> {
    let number = now.number;
    let mapping_changes = now.mapping != wanted.mapping;
    let id_changes = now.cob_id.can_id() != wanted.cob_id.can_id();
    let inhibit_time_changes = now.inhibit_100us != wanted.inhibit_100us;
    let must_switch_off = (mapping_changes && remap == Remap::Invalidate || id_changes || inhibit_time_changes)
        && now.cob_id.is_valid()
        && !never_off;
    let mut writes = Vec::new();
    let mut cob_id = now.cob_id;
    if must_switch_off {
        cob_id = cob_id.switched_off();
        writes.push(StepWrite::new(number.communication(1), cob_id.0, 4));
    }
    if mapping_changes {
        let count = u32::try_from(wanted.mapping.len()).unwrap_or(u32::MAX);
        if !now.mapping.is_empty() {
            writes.push(StepWrite::new(number.mapping(0), 0, 1));
        }
        let entries = (1..=u8::MAX).zip(&wanted.mapping);
        writes.extend(entries.map(|(sub, entry)| StepWrite::new(number.mapping(sub), entry.word(), 4)));
        if count > 0 {
            writes.push(StepWrite::new(number.mapping(0), count, 1));
        }
    }
    if now.transmission != wanted.transmission {
        writes.push(StepWrite::new(number.communication(2), wanted.transmission.into(), 1));
    }
    if let Some(timer) = wanted.event_timer_ms.filter(|_| now.event_timer_ms != wanted.event_timer_ms) {
        writes.push(StepWrite::new(number.communication(5), timer.into(), 2));
    }
    if let Some(inhibit) = wanted.inhibit_100us.filter(|_| inhibit_time_changes) {
        writes.push(StepWrite::new(number.communication(3), inhibit.into(), 2));
    }
    if cob_id.without_rtr() != wanted.cob_id.without_rtr() {
        writes.push(StepWrite::new(number.communication(1), wanted.cob_id.0, 4));
    }
    writes
}
