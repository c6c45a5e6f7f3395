//! The order of writes within a stage, and the COB-ID words that several settings share.

use super::check::Wanted;
use super::setting::{Form, Stage};
use super::snapshot::Snapshot;
use super::value::Content;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::tasks::pdo;

/// Sorts the settings of one stage in the order of writing. Guarding is switched off before heartbeat is switched on,
/// and a lower limit never exceeds the upper limit.
pub(super) fn sorted(mut group: Vec<Wanted>, now: &Snapshot) -> Vec<Wanted> {
    let number = |wanted: &Wanted, content: &Content| match content {
        Content::Bytes(bytes) => wanted.setting.data_type.decode(bytes).as_ref().ok().and_then(Value::as_f64),
        _ => None,
    };
    group.sort_by_key(|wanted| {
        let own = number(wanted, &wanted.content);
        let present = now.content(&wanted.setting).and_then(|content| number(wanted, &content));
        let name = wanted.setting.key.rsplit('.').next().unwrap_or_default();
        match (wanted.setting.stage, name) {
            (Stage::Limits, "upper" | "span-end") if own > present => 0,
            (Stage::Limits, "upper" | "span-end") => 2,
            (Stage::Node, _) if own == Some(0.0) => 0,
            _ => 1,
        }
    });
    group
}

/// Returns the settings of a TPDO after the values of a file are applied.
pub(super) fn tpdo_settings(old: &pdo::Settings, group: &[Wanted]) -> pdo::Settings {
    let mut new = old.clone();
    for wanted in group {
        match (&wanted.setting.form, &wanted.content) {
            (Form::CobId(_), Content::Number(id)) => {
                new.cob_id = new.cob_id.with_standard(*id).unwrap_or(new.cob_id);
            }
            (Form::Bit(..), Content::Number(1)) => new.cob_id = new.cob_id.switched_on(),
            (Form::Bit(..), _) => new.cob_id = new.cob_id.switched_off(),
            (Form::Signals(_), Content::Mapping(entries)) => new.mapping.clone_from(entries),
            (Form::Transmission(_), Content::Bytes(bytes)) => {
                new.transmission = bytes.first().copied().unwrap_or(new.transmission);
            }
            (Form::Duration(tick), Content::Bytes(bytes)) => {
                let count = <[u8; 2]>::try_from(bytes.as_slice()).ok().map(u16::from_le_bytes);
                if *tick == 100 {
                    new.inhibit_100us = count;
                } else {
                    new.event_timer_ms = count;
                }
            }
            _ => {}
        }
    }
    new
}

/// Services must be off while their identifier changes: index, bit, and the value of the bit that means "off".
const OFF_BITS: [(u16, u32, bool); 2] = [(0x1014, 1 << 31, true), (0x1005, 1 << 30, false)];

/// Returns the COB-ID objects that change, each with the words to write one after the other.
pub(super) fn service_words(group: &[Wanted], now: &Snapshot) -> Vec<(ObjectId, Vec<u32>)> {
    let mut words: Vec<(ObjectId, Vec<u32>)> = Vec::new();
    for wanted in group {
        let object = wanted.setting.object;
        if words.iter().any(|(known, _)| *known == object) {
            continue;
        }
        let Some(old) = now.bytes(object).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes) else {
            continue;
        };
        let mut new = old;
        for part in group.iter().filter(|part| part.setting.object == object) {
            match (&part.setting.form, &part.content) {
                (Form::CobId(_), Content::Number(id)) => new = new & !0x1fff_ffff | id,
                (Form::Bit(bit, set), Content::Number(flag)) => {
                    new = if (*flag == 1) == *set { new | 1 << bit } else { new & !(1 << bit) };
                }
                (_, Content::Bytes(bytes)) => {
                    new = bytes.as_slice().try_into().map_or(new, u32::from_le_bytes);
                }
                _ => {}
            }
        }
        if new == old {
            continue;
        }
        let id_changes = (new ^ old) & 0x1fff_ffff != 0;
        let off_bit = OFF_BITS.iter().find(|(index, ..)| *index == object.index && id_changes);
        let first =
            off_bit.map(|(_, bit, set)| if *set { old | bit } else { old & !bit }).filter(|first| *first != old);
        words.push((object, first.into_iter().chain([new]).collect()));
    }
    words
}
