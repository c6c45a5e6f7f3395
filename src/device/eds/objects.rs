//! Turns the sections of objects into entries of the object dictionary.

use super::content::{Content, number};
use super::ini::{Ini, Section};
use super::names::{Described, Kind};
use super::sections::{self, Parts};
use super::text::{quoted, shown};
use super::{ObjectFlags, Warning, value};
use crate::canopen::object::ObjectId;
use crate::device::dictionary::Entry;
use crate::device::scalar::Scalar;
use std::collections::{BTreeMap, BTreeSet};

/// The object dictionary before its entries have names.
#[derive(Default)]
pub(super) struct Objects {
    /// The name of each object in the file; empty if it has none.
    pub(super) names: BTreeMap<u16, String>,
    /// The entries.
    pub(super) described: Vec<Described>,
    /// `ParameterValue` and `[…Value]`.
    pub(super) parameter_values: BTreeMap<ObjectId, Scalar>,
    /// The lines of these values.
    pub(super) value_lines: BTreeMap<ObjectId, usize>,
    /// `ParameterValue` and `[…Value]` of writable objects that cannot be read.
    pub(super) unread_values: Vec<Warning>,
    /// `ObjFlags`.
    pub(super) flags: BTreeMap<ObjectId, ObjectFlags>,
    /// The entries whose data type is unknown.
    pub(super) untyped: BTreeSet<ObjectId>,
}

/// Object types (CiA 301, table 42).
const NULL: i128 = 0;
const DEFTYPE: i128 = 5;
const DEFSTRUCT: i128 = 6;
const VAR: i128 = 7;
const ARRAY: i128 = 8;
const RECORD: i128 = 9;

/// Limit for the memory of the entries in bytes, enough for 100,000 entries. A limit is needed, because a file can
/// describe 254 entries in three lines.
const MAX_BYTES: usize = 32 << 20;

/// The highest number of PDOs in each direction (CiA 301).
const MAX_PDOS: i128 = 512;

/// The communication parameters of a PDO: name, bytes. Bit 0 of `CompactPDO` is sub-index 1.
const PDO_PARAMETERS: [(&str, u8); 6] = [
    ("COB-ID", 4),
    ("Transmission type", 1),
    ("Inhibit time", 2),
    ("Compatibility entry", 1),
    ("Event timer", 2),
    ("SYNC start value", 1),
];

/// Reads every object.
pub(super) fn read(ini: &Ini, warnings: &mut Vec<Warning>) -> Objects {
    let parts = sections::objects(ini, warnings);
    let mut reader = Reader { ini, warnings, objects: Objects::default(), free_bytes: MAX_BYTES };
    for (index, parts) in &parts {
        reader.object(*index, parts);
    }
    reader.compact_pdos(&parts);
    reader.objects
}

/// Reads the objects one by one.
pub(super) struct Reader<'a> {
    pub(super) ini: &'a Ini,
    warnings: &'a mut Vec<Warning>,
    pub(super) objects: Objects,
    free_bytes: usize,
}

impl Reader<'_> {
    pub(super) fn warn(&mut self, line: usize, text: String) {
        self.warnings.push(Warning::new(line, text));
    }

    fn object(&mut self, index: u16, parts: &Parts) {
        let Some(first) = parts.first() else { return };
        let object_type = parts.main.and_then(|main| number(main, "objecttype"));
        if matches!(object_type, Some(NULL | DEFTYPE | DEFSTRUCT)) {
            return;
        }
        if parts.main.is_none() && parts.subs.is_empty() {
            return self.warn(first.line, format!("[{}] belongs to no object", first.shown));
        }
        self.name(index, first, parts.main);
        let start = self.objects.described.len();
        let elements = parts.main.and_then(|main| self.elements(main));
        let kind = match object_type {
            _ if elements.is_some() => Kind::Array,
            Some(ARRAY) => Kind::Array,
            Some(RECORD) => Kind::Record,
            _ if !parts.subs.is_empty() => Kind::Record,
            _ => Kind::Variable,
        };
        match (kind, parts.main, elements) {
            (Kind::Variable, Some(main), _) => self.section(ObjectId::new(index, 0), kind, main),
            (_, Some(main), Some(last)) => self.elements_of(index, main, last, parts),
            (_, Some(main), None) => self.check_subs(index, kind, main, object_type, parts),
            _ => {}
        }
        for (sub, section) in &parts.subs {
            self.section(ObjectId::new(index, *sub), kind, section);
        }
        self.lists(start, parts);
    }

    fn name(&mut self, index: u16, first: &Section, main: Option<&Section>) {
        let name = main.and_then(|main| main.get("parametername"));
        if name.is_none() {
            let what = if main.is_some() { "has no ParameterName" } else { "has no section of its object" };
            self.warn(first.line, format!("[{}] {what}; the object gets the name object-{index:04x}", first.shown));
        }
        self.objects.names.insert(index, name.map_or_else(String::new, |item| item.value.clone()));
    }

    /// Reads the number of elements from `CompactSubObj`, if it is given.
    fn elements(&mut self, main: &Section) -> Option<u8> {
        let item = main.get("compactsubobj")?;
        match self.integer(main, "CompactSubObj").and_then(|number| u8::try_from(number).ok()) {
            Some(0) => None,
            Some(last @ 1..=254) => Some(last),
            _ => {
                let text =
                    format!("[{}] CompactSubObj: {} is not in the range 1 to 254", main.shown, quoted(&item.value));
                self.warn(item.line, text);
                None
            }
        }
    }

    /// Adds the elements of an array that one section describes, except elements with their own section.
    fn elements_of(&mut self, index: u16, main: &Section, last: u8, parts: &Parts) {
        if !parts.subs.contains_key(&0) {
            self.push(ObjectId::new(index, 0), Kind::Array, main, "", &Content::count(Some(last)));
        }
        let content = self.content(main);
        let title = main.get("parametername").map_or("", |item| item.value.as_str());
        let names = list(parts.names);
        for sub in (1..=last).filter(|sub| !parts.subs.contains_key(sub)) {
            // CiA 306: an element without its own name has the name of the array with its number appended.
            let name = names.get(&sub).map_or_else(|| format!("{title}{sub}"), |item| item.value.clone());
            self.push(ObjectId::new(index, sub), Kind::Array, main, &name, &content);
        }
    }

    /// Adds the PDO parameters without a section, if the file describes its PDOs by `CompactPDO` (CiA 306).
    fn compact_pdos(&mut self, parts: &BTreeMap<u16, Parts>) {
        let Some(section) = self.ini.section("deviceinfo") else { return };
        let Some(mask) = number(section, "compactpdo").filter(|mask| *mask > 0) else { return };
        let directions = [("NrOfRXPDO", "RPDO", 0x1400, 0x200), ("NrOfTXPDO", "TPDO", 0x1800, 0x180)];
        for (key, title, first, cob_id) in directions {
            let count = number(section, &key.to_ascii_lowercase()).unwrap_or_default().clamp(0, MAX_PDOS);
            for pdo in 0..u16::try_from(count).unwrap_or_default() {
                let described = |index| parts.contains_key(&index);
                let object = ObjectId::new(first + pdo, 0);
                if !described(object.index) {
                    self.objects.names.insert(object.index, format!("{title} {} communication parameter", pdo + 1));
                    let default = Scalar::NodeIdPlus(cob_id + 0x100 * u32::from(pdo));
                    // Only the first four PDOs have a default COB-ID; the others are disabled.
                    let default = if pdo < 4 { default } else { Scalar::Integer(1 << 31) };
                    let is_in_mask = |sub: u8| sub <= 2 || mask >> (sub - 1) & 1 == 1;
                    let last = (1..=6).rev().find(|sub| is_in_mask(*sub));
                    self.push(object, Kind::Record, section, "", &Content::count(last));
                    for (sub, (name, bytes)) in (1..).zip(PDO_PARAMETERS).filter(|(sub, _)| is_in_mask(*sub)) {
                        let content = Content::setting(bytes, Some(default.clone()).filter(|_| sub == 1));
                        self.push(object.with_sub(sub), Kind::Record, section, name, &content);
                    }
                }
                let object = ObjectId::new(object.index + 0x200, 0);
                if !described(object.index) {
                    self.objects.names.insert(object.index, format!("{title} {} mapping parameter", pdo + 1));
                    self.push(object, Kind::Array, section, "", &Content::setting(1, None));
                    for sub in 1..=8 {
                        self.push(object.with_sub(sub), Kind::Array, section, "", &Content::setting(4, None));
                    }
                }
            }
        }
    }

    /// Warns if an object and its sub-objects contradict each other.
    fn check_subs(&mut self, index: u16, kind: Kind, main: &Section, object_type: Option<i128>, parts: &Parts) {
        if object_type == Some(VAR) {
            self.warn(main.line, format!("[{}] is a variable, but has sub-objects; they are used", main.shown));
        }
        let described = parts.subs.len();
        if described == 0 {
            let text = format!("[{}] has no sub-objects; only the count at sub-index 0 is known", main.shown);
            self.warn(main.line, text);
            self.push(ObjectId::new(index, 0), kind, main, "", &Content::count(None));
        } else if let Some(item) = main.get("subnumber") {
            let announced = value::integer(&item.value).and_then(|number| usize::try_from(number.value).ok());
            if announced.is_none_or(|announced| announced > described) {
                let text =
                    format!("[{}] SubNumber is {}, but the file describes {described}", main.shown, shown(&item.value));
                self.warn(item.line, text);
            }
        }
    }

    /// Adds the entry that a section describes.
    fn section(&mut self, object: ObjectId, kind: Kind, section: &Section) {
        let content = self.content(section);
        let name = section.get("parametername").map_or("", |item| item.value.as_str());
        self.push(object, kind, section, name, &content);
        if let (Some(item), Some(last)) = (section.get("denotation"), self.objects.described.last_mut())
            && last.entry.object == object
        {
            last.denotation = Some(item.value.clone());
        }
    }

    fn push(&mut self, object: ObjectId, kind: Kind, section: &Section, name: &str, content: &Content) {
        let parent = self.objects.names.get(&object.index).map_or(0, String::len);
        let Some(free_bytes) = self.free_bytes.checked_sub(content.bytes() + 2 * name.len() + 2 * parent) else {
            if self.free_bytes > 0 {
                let text =
                    format!("[{}]: all further objects are skipped: they would take too much memory", section.shown);
                self.warn(section.line, text);
            }
            self.free_bytes = 0;
            return;
        };
        self.free_bytes = free_bytes;
        if let Some(value) = &content.parameter_value {
            self.objects.parameter_values.insert(object, value.clone());
            let line = section.get("parametervalue").map_or(section.line, |item| item.line);
            self.objects.value_lines.insert(object, line);
        }
        if content.flags != ObjectFlags::default() {
            self.objects.flags.insert(object, content.flags);
        }
        if !content.is_typed {
            self.objects.untyped.insert(object);
        }
        let entry = Entry {
            object,
            name: name.to_owned(),
            numbered: false,
            data_type: content.data_type,
            access: content.access,
            default: content.default.clone(),
            low: content.low.clone(),
            high: content.high.clone(),
            pdo: content.pdo,
        };
        self.objects.described.push(Described { entry, kind, denotation: None });
    }

    /// Reads `[…Value]` and `[…Denotation]` for the entries from `start` on.
    fn lists(&mut self, start: usize, parts: &Parts) {
        let mut values = list(parts.values);
        let mut denotations = list(parts.denotations);
        let mut found = Vec::new();
        for described in self.objects.described.iter_mut().skip(start) {
            let object = described.entry.object;
            if let Some(item) = denotations.remove(&object.sub) {
                described.denotation = Some(item.value.clone());
            }
            if let Some(item) = values.remove(&object.sub) {
                found.push((object, described.entry.data_type, described.entry.access.is_writable(), item));
            }
        }
        for (object, data_type, is_writable, item) in found {
            let place = format!("[{:04X}Value] {}", object.index, object.sub);
            if let Some(value) = self.scalar(&place, item.line, &item.value, data_type) {
                self.objects.parameter_values.insert(object, value);
                self.objects.value_lines.insert(object, item.line);
            } else if is_writable {
                self.unread(&place, item, data_type, true);
            }
        }
        for (sub, item) in &values {
            let text =
                format!("[{}] {sub}: there is no such sub-index", parts.values.map_or("", |it| it.shown.as_str()));
            self.objects.unread_values.push(Warning::new(item.line, text));
        }
        let lists = [(parts.values, values), (parts.denotations, denotations)];
        for (section, (sub, item)) in
            lists.into_iter().flat_map(|(section, rest)| rest.into_iter().map(move |one| (section, one)))
        {
            let name = section.map_or("", |section| section.shown.as_str());
            self.warn(item.line, format!("[{name}] {sub}: there is no such sub-index"));
        }
    }
}

/// Returns the items of a list by sub-index. If a number occurs twice, the first item is used.
fn list(section: Option<&Section>) -> BTreeMap<u8, &super::ini::Item> {
    let mut list = BTreeMap::new();
    for (sub, item) in section.map(Section::numbered).unwrap_or_default() {
        if let Ok(sub) = u8::try_from(sub) {
            list.entry(sub).or_insert(item);
        }
    }
    list
}
