//! Objects that have the same type on every device (CiA 301, CiA 404).
//!
//! This is a table and not a description file, because each `sdo read` uses it. Parsing a file with thousands of
//! entries would take most of the run time.
//!
//! Objects whose type differs between devices (6130h is INTEGER32 on the DPS) are missing: their type comes from a
//! description.

use super::description::Access;
use super::dictionary::Entry;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;

struct Row {
    index: u16,
    first: u8,
    last: u8,
    name: &'static str,
    data_type: DataType,
    access: Access,
}

const fn row(index: u16, first: u8, last: u8, name: &'static str, data_type: DataType, access: Access) -> Row {
    Row { index, first, last, name, data_type, access }
}

const U8: DataType = DataType::Unsigned(1);
const U16: DataType = DataType::Unsigned(2);
const U32: DataType = DataType::Unsigned(4);
const TEXT: DataType = DataType::VisibleString;

/// Sources: CiA 301 V4.2.0, 7.5; CiA 302-2 (1F80h); CiA 404-1 V2.1.0.
const ROWS: &[Row] = &[
    row(0x1000, 0, 0, "device-type", U32, Access::Ro),
    row(0x1001, 0, 0, "error-register", U8, Access::Ro),
    row(0x1002, 0, 0, "manufacturer-status-register", U32, Access::Ro),
    row(0x1003, 0, 0, "error-count", U8, Access::Rw),
    row(0x1003, 1, 254, "error-history", U32, Access::Ro),
    row(0x1005, 0, 0, "cob-id-sync", U32, Access::Rw),
    row(0x1006, 0, 0, "communication-cycle-period", U32, Access::Rw),
    row(0x1007, 0, 0, "synchronous-window-length", U32, Access::Rw),
    row(0x1008, 0, 0, "device-name", TEXT, Access::Const),
    row(0x1009, 0, 0, "hardware-version", TEXT, Access::Const),
    row(0x100a, 0, 0, "software-version", TEXT, Access::Const),
    row(0x100c, 0, 0, "guard-time", U16, Access::Rw),
    row(0x100d, 0, 0, "life-time-factor", U8, Access::Rw),
    row(0x1010, 0, 0, "store-entries", U8, Access::Ro),
    row(0x1010, 1, 1, "store-all", U32, Access::Rw),
    row(0x1010, 2, 2, "store-communication", U32, Access::Rw),
    row(0x1010, 3, 3, "store-application", U32, Access::Rw),
    row(0x1010, 4, 127, "store-manufacturer", U32, Access::Rw),
    row(0x1011, 0, 0, "restore-entries", U8, Access::Ro),
    row(0x1011, 1, 1, "restore-all", U32, Access::Rw),
    row(0x1011, 2, 2, "restore-communication", U32, Access::Rw),
    row(0x1011, 3, 3, "restore-application", U32, Access::Rw),
    row(0x1011, 4, 127, "restore-manufacturer", U32, Access::Rw),
    row(0x1012, 0, 0, "cob-id-time", U32, Access::Rw),
    row(0x1013, 0, 0, "high-resolution-time-stamp", U32, Access::Rw),
    row(0x1014, 0, 0, "cob-id-emcy", U32, Access::Rw),
    row(0x1015, 0, 0, "emcy-inhibit-time", U16, Access::Rw),
    row(0x1016, 0, 0, "consumer-heartbeat-entries", U8, Access::Ro),
    row(0x1016, 1, 127, "consumer-heartbeat-time", U32, Access::Rw),
    row(0x1017, 0, 0, "producer-heartbeat-time", U16, Access::Rw),
    row(0x1018, 0, 0, "identity-entries", U8, Access::Ro),
    row(0x1018, 1, 1, "vendor-id", U32, Access::Ro),
    row(0x1018, 2, 2, "product-code", U32, Access::Ro),
    row(0x1018, 3, 3, "revision-number", U32, Access::Ro),
    row(0x1018, 4, 4, "serial-number", U32, Access::Ro),
    row(0x1019, 0, 0, "synchronous-counter-overflow", U8, Access::Rw),
    row(0x1029, 0, 0, "error-behaviour-entries", U8, Access::Ro),
    row(0x1029, 1, 254, "error-behaviour", U8, Access::Rw),
    row(0x1f80, 0, 0, "nmt-startup", U32, Access::Rw),
    row(0x6110, 1, 199, "ai-sensor-type", U16, Access::Rw),
    row(0x6111, 1, 199, "ai-autocalibration", U32, Access::Wo),
    row(0x6112, 1, 199, "ai-operating-mode", U8, Access::Rw),
    row(0x6114, 1, 199, "ai-adc-sample-rate", U32, Access::Rw),
    row(0x6125, 1, 199, "ai-autozero", U32, Access::Wo),
    row(0x6131, 1, 199, "ai-physical-unit-pv", U32, Access::Rw),
    row(0x6132, 1, 199, "ai-decimal-digits-pv", U8, Access::Rw),
    row(0x6139, 1, 199, "ai-autotare", U32, Access::Wo),
    row(0x6150, 1, 199, "ai-status", U8, Access::Ro),
    row(0x61a0, 1, 199, "ai-filter-type", U8, Access::Rw),
    row(0x61a1, 1, 199, "ai-filter-constant", U16, Access::Rw),
];

/// The objects at 1800h + n-1 and 1A00h + n-1; their names begin with `tpdo<n>-`.
const COMMUNICATION: &[Row] = &[
    row(0, 0, 0, "entries", U8, Access::Ro),
    row(0, 1, 1, "cob-id", U32, Access::Rw),
    row(0, 2, 2, "transmission-type", U8, Access::Rw),
    row(0, 3, 3, "inhibit-time", U16, Access::Rw),
    row(0, 5, 5, "event-timer", U16, Access::Rw),
    row(0, 6, 6, "sync-start-value", U8, Access::Rw),
];

const MAPPING: &[Row] = &[row(0, 0, 0, "mapping-entries", U8, Access::Rw), row(0, 1, 64, "mapping", U32, Access::Rw)];

impl Row {
    fn entry(&self, object: ObjectId, prefix: &str) -> Option<Entry> {
        (self.first..=self.last).contains(&object.sub).then(|| Entry {
            object,
            name: format!("{prefix}{}", self.name),
            numbered: self.first != self.last,
            data_type: self.data_type,
            access: self.access,
            default: None,
            low: None,
            high: None,
            pdo: false,
        })
    }
}

/// Returns the entry at `object`.
pub fn entry(object: ObjectId) -> Option<Entry> {
    let (rows, prefix) = match object.index {
        0x1800..=0x19ff => (COMMUNICATION, format!("tpdo{}-", object.index - 0x17ff)),
        0x1a00..=0x1bff => (MAPPING, format!("tpdo{}-", object.index - 0x19ff)),
        _ => return ROWS.iter().filter(|row| row.index == object.index).find_map(|row| row.entry(object, "")),
    };
    rows.iter().find_map(|row| row.entry(object, &prefix))
}

/// Returns the fixed unit of the number in an object of CiA 301, as written in descriptions: `ms`, `100us`.
pub fn unit(object: ObjectId) -> Option<&'static str> {
    match (object.index, object.sub) {
        (0x1006 | 0x1007, 0) => Some("us"),
        (0x100c | 0x1017, 0) | (0x1800..=0x19ff, 5) => Some("ms"),
        (0x1015, 0) | (0x1800..=0x19ff, 3) => Some("100us"),
        _ => None,
    }
}

/// Returns the entry with a name: `vendor-id`, `error-history:1`, `tpdo1-mapping:2`. Letter case is ignored.
pub fn find(name: &str) -> Option<Entry> {
    let name = name.to_ascii_lowercase();
    let (bare, sub) = match name.split_once(':') {
        Some((bare, sub)) => (bare, Some(sub.parse::<u8>().ok()?)),
        None => (name.as_str(), None),
    };
    let found = |row: &Row, index: u16| {
        let object = ObjectId::new(index, sub.unwrap_or(row.first));
        entry(object).filter(|entry| entry.full_name() == name)
    };
    if let Some((number, rest)) = bare.strip_prefix("tpdo").and_then(|rest| rest.split_once('-')) {
        let offset = number.parse::<u16>().ok().filter(|number| (1..=512).contains(number))? - 1;
        let in_rows = |rows: &[Row], start: u16| {
            rows.iter().filter(|row| row.name == rest).find_map(|row| found(row, start + offset))
        };
        return in_rows(COMMUNICATION, 0x1800).or_else(|| in_rows(MAPPING, 0x1a00));
    }
    ROWS.iter().filter(|row| row.name == bare).find_map(|row| found(row, row.index))
}

/// The objects of 1000h to 1FFFh that are not part of a run, without the PDO parameters.
pub fn single_objects() -> impl Iterator<Item = ObjectId> {
    let single = ROWS.iter().filter(|row| row.first == row.last && row.index < 0x2000);
    single.map(|row| ObjectId::new(row.index, row.first))
}

/// Every name, for suggestions. A run is listed once, with its first sub-index.
pub fn names() -> impl Iterator<Item = String> {
    let plain = ROWS.iter().filter_map(|row| entry(ObjectId::new(row.index, row.first)));
    let pdos = [(COMMUNICATION, 0x1800), (MAPPING, 0x1a00)];
    let pdos = pdos
        .into_iter()
        .flat_map(|(rows, index)| rows.iter().filter_map(move |row| entry(ObjectId::new(index, row.first))));
    plain.chain(pdos).map(|entry| entry.full_name())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_name_finds_exactly_its_object() {
        let mut names: Vec<String> = names().collect();
        let count = names.len();
        for name in &names {
            let entry = find(name).unwrap_or_else(|| panic!("{name}"));
            assert_eq!(entry.full_name(), *name);
            assert_eq!(super::entry(entry.object), Some(entry));
        }
        names.sort();
        names.dedup();
        assert_eq!(names.len(), count);
        assert!(count > 50, "{count}");
    }

    #[test]
    fn runs_and_tpdos_by_name() {
        let object = |name: &str| find(name).map(|entry| entry.object.to_string());
        assert_eq!(object("Error-History:254").as_deref(), Some("0x1003:254"));
        assert_eq!(object("error-history:255"), None);
        assert_eq!(object("error-history"), None);
        assert_eq!(object("vendor-id").as_deref(), Some("0x1018:1"));
        assert_eq!(object("vendor-id:1"), None);
        assert_eq!(object("tpdo5-event-timer").as_deref(), Some("0x1804:5"));
        assert_eq!(object("tpdo512-mapping:64").as_deref(), Some("0x1BFF:64"));
        assert_eq!(object("tpdo513-cob-id"), None);
        assert_eq!(object("tpdo0-cob-id"), None);
        assert_eq!(entry(ObjectId::new(0x1800, 4)), None);
        assert_eq!(entry(ObjectId::new(0x6130, 1)), None, "its type differs between devices");
    }
}
