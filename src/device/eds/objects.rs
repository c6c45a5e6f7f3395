//! From the sections of objects to entries of the object dictionary.

use super::ini::{Ini, Section};
use super::names::{Described, Kind};
use super::sections::{self, Parts};
use super::text::quoted;
use super::{ObjectFlags, Warning, value};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::description::{Access, Scalar};
use crate::device::dictionary::Entry;
use std::collections::{BTreeMap, BTreeSet};

/// The object dictionary before its entries have names.
#[derive(Default)]
pub(super) struct Objects {
    /// What the file calls each object; empty when it does not say.
    pub(super) names: BTreeMap<u16, String>,
    /// The entries.
    pub(super) described: Vec<Described>,
    /// `ParameterValue` and `[…Value]`.
    pub(super) parameter_values: BTreeMap<ObjectId, Scalar>,
    /// `ObjFlags`.
    pub(super) flags: BTreeMap<ObjectId, ObjectFlags>,
    /// The entries whose data type is not known.
    pub(super) untyped: BTreeSet<ObjectId>,
}

/// Object types (CiA 301, table 42).
const NULL: i128 = 0;
const DOMAIN: i128 = 2;
const DEFTYPE: i128 = 5;
const DEFSTRUCT: i128 = 6;
const VAR: i128 = 7;
const ARRAY: i128 = 8;
const RECORD: i128 = 9;

/// How much the entries may take together, in bytes. Three lines of a file can ask for 254 entries; the
/// largest dictionaries of real devices need some 5 MB.
const MOST_BYTES: usize = 64 << 20;

/// Reads every object.
pub(super) fn read(ini: &Ini, warnings: &mut Vec<Warning>) -> Objects {
    let parts = sections::objects(ini, warnings);
    let mut reader = Reader { ini, warnings, objects: Objects::default(), room: MOST_BYTES };
    for (index, parts) in &parts {
        reader.object(*index, parts);
    }
    reader.objects
}

/// Reads one object after the other.
struct Reader<'a> {
    ini: &'a Ini,
    warnings: &'a mut Vec<Warning>,
    objects: Objects,
    room: usize,
}

/// What a section says of an entry, or of all elements of an array.
struct Content {
    data_type: DataType,
    is_typed: bool,
    access: Access,
    default: Option<Scalar>,
    low: Option<Scalar>,
    high: Option<Scalar>,
    pdo: bool,
    parameter_value: Option<Scalar>,
    flags: ObjectFlags,
}

impl Content {
    /// Sub-index 0 of an array or record, which no section describes: CiA 301 does (7.4.5).
    fn count(of: Option<u8>) -> Content {
        Content {
            data_type: DataType::Unsigned(1),
            is_typed: true,
            access: Access::Ro,
            default: of.map(|count| Scalar::Integer(i64::from(count))),
            low: None,
            high: None,
            pdo: false,
            parameter_value: None,
            flags: ObjectFlags::default(),
        }
    }

    /// An estimate of what an entry takes beside its names.
    fn bytes(&self) -> usize {
        let texts = [&self.default, &self.low, &self.high, &self.parameter_value];
        let length = |scalar: &Option<Scalar>| match scalar {
            Some(Scalar::Text(text)) => text.len(),
            _ => 0,
        };
        size_of::<Described>() + texts.into_iter().map(length).sum::<usize>()
    }
}

impl Reader<'_> {
    fn warn(&mut self, line: usize, text: String) {
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
            let what = if main.is_some() { "has no ParameterName" } else { "stands without a section of its object" };
            self.warn(first.line, format!("[{}] {what}; the object is called object-{index:04x}", first.shown));
        }
        self.objects.names.insert(index, name.map_or_else(String::new, |item| item.value.clone()));
    }

    /// How many elements `CompactSubObj` says that there are, if it is given.
    fn elements(&mut self, main: &Section) -> Option<u8> {
        let item = main.get("compactsubobj")?;
        match self.integer(main, "CompactSubObj").and_then(|number| u8::try_from(number).ok()) {
            Some(0) => None,
            Some(last @ 1..=254) => Some(last),
            _ => {
                let text = format!("[{}] CompactSubObj: {} is none of 1 to 254", main.shown, quoted(&item.value));
                self.warn(item.line, text);
                None
            }
        }
    }

    /// The elements of an array that its one section describes, but for those with a section of their own.
    fn elements_of(&mut self, index: u16, main: &Section, last: u8, parts: &Parts) {
        if !parts.subs.contains_key(&0) {
            self.push(ObjectId::new(index, 0), Kind::Array, main, "", &Content::count(Some(last)));
        }
        let content = self.content(main);
        let title = main.get("parametername").map_or("", |item| item.value.as_str());
        let names = list(parts.names);
        for sub in (1..=last).filter(|sub| !parts.subs.contains_key(sub)) {
            // CiA 306: without a name of its own, an element is called like the array with its number behind.
            let name = names.get(&sub).map_or_else(|| format!("{title}{sub}"), |item| item.value.clone());
            self.push(ObjectId::new(index, sub), Kind::Array, main, &name, &content);
        }
    }

    /// Says where an object and its sub-objects contradict each other.
    fn check_subs(&mut self, index: u16, kind: Kind, main: &Section, object_type: Option<i128>, parts: &Parts) {
        if object_type == Some(VAR) {
            self.warn(main.line, format!("[{}] is a variable, but has sub-objects; they are used", main.shown));
        }
        if let Some(item) = main.get("subnumber") {
            let described = parts.subs.len();
            let announced = value::integer(&item.value).and_then(|number| usize::try_from(number.value).ok());
            if announced.is_none_or(|announced| announced > described) {
                let text =
                    format!("[{}] SubNumber is {}, but {described} are described", main.shown, quoted(&item.value));
                self.warn(item.line, text);
            }
        }
        if parts.subs.is_empty() {
            let text = format!("[{}] has no sub-objects; only the count at sub-index 0 is known", main.shown);
            self.warn(main.line, text);
            self.push(ObjectId::new(index, 0), kind, main, "", &Content::count(None));
        }
    }

    /// The entry that a section of its own describes.
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
        let Some(room) = self.room.checked_sub(content.bytes() + 2 * name.len() + 2 * parent) else {
            if self.room > 0 {
                let text =
                    format!("[{}]: from here on, objects are left out: they would take too much memory", section.shown);
                self.warn(section.line, text);
            }
            self.room = 0;
            return;
        };
        self.room = room;
        if let Some(value) = &content.parameter_value {
            self.objects.parameter_values.insert(object, value.clone());
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

    /// `[…Value]` and `[…Denotation]`, for the entries from `start` on.
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
                found.push((object, described.entry.data_type, item));
            }
        }
        for (object, data_type, item) in found {
            let place = format!("[{:04X}Value] {}", object.index, object.sub);
            if let Some(value) = self.scalar(&place, item.line, &item.value, data_type) {
                self.objects.parameter_values.insert(object, value);
            }
        }
        for (sub, item) in values.into_iter().chain(denotations) {
            self.warn(item.line, format!("sub-index {sub} is not described"));
        }
    }

    fn content(&mut self, section: &Section) -> Content {
        let (data_type, is_typed) = self.data_type(section);
        let mut scalar = |key: &str| {
            let item = section.get(&key.to_ascii_lowercase())?;
            self.scalar(&format!("[{}] {key}", section.shown), item.line, &item.value, data_type)
        };
        // What an unknown type makes of a value is unknown too, and text and bytes have no limits.
        let has_limits = data_type.width().is_some();
        let default = if is_typed { scalar("DefaultValue") } else { None };
        let parameter_value = if is_typed { scalar("ParameterValue") } else { None };
        let low = if has_limits { scalar("LowLimit") } else { None };
        let high = if has_limits { scalar("HighLimit") } else { None };
        let flags = number(section, "objflags").unwrap_or_default();
        Content {
            data_type,
            is_typed,
            access: self.access(section),
            default,
            low,
            high,
            pdo: self.pdo(section),
            parameter_value,
            flags: ObjectFlags { skip_write: flags & 1 != 0, skip_read: flags & 2 != 0 },
        }
    }

    fn scalar(&mut self, place: &str, line: usize, text: &str, data_type: DataType) -> Option<Scalar> {
        match value::scalar(text, data_type) {
            Ok(reading) => {
                let reading = reading?;
                if let Some(doubt) = reading.doubt {
                    self.warn(line, format!("{place}: {doubt}"));
                }
                Some(reading.value)
            }
            Err(error) => {
                self.warn(line, format!("{place}: {error}; left out"));
                None
            }
        }
    }

    /// The data type, and whether the file gives one that we know. Without, the entry has DOMAIN: its
    /// object can still be read by its name, as bytes.
    fn data_type(&mut self, section: &Section) -> (DataType, bool) {
        let Some(item) = section.get("datatype") else {
            if number(section, "objecttype") != Some(DOMAIN) {
                self.warn(section.line, format!("[{}] has no DataType; its value is taken for bytes", section.shown));
                return (DataType::Domain, false);
            }
            return (DataType::Domain, true);
        };
        let code = self.integer(section, "DataType").and_then(|code| u16::try_from(code).ok());
        let known = code.and_then(|code| DataType::from_code(code).or_else(|| self.defined_type(code)));
        match known {
            Some(data_type) => (data_type, true),
            None => {
                let text = format!(
                    "[{}] DataType: {} is unknown; its value is taken for bytes",
                    section.shown,
                    quoted(&item.value)
                );
                self.warn(item.line, text);
                (DataType::Domain, false)
            }
        }
    }

    /// A type that the file itself defines: CANFestival's editor writes [A0] and, as the default of
    /// [A0sub1], the type that it is made of.
    fn defined_type(&self, code: u16) -> Option<DataType> {
        let section =
            self.ini.section(&format!("{code:x}sub1")).or_else(|| self.ini.section(&format!("{code:04x}sub1")))?;
        DataType::from_code(u16::try_from(number(section, "defaultvalue")?).ok()?)
    }

    /// The access type. Where the file has none that we know, the device decides.
    fn access(&mut self, section: &Section) -> Access {
        let item = section.get("accesstype");
        if let Some(access) = item.and_then(|item| value::access(&item.value)) {
            return access;
        }
        let (line, what) = match item {
            Some(item) => (item.line, format!("AccessType: {} is unknown", quoted(&item.value))),
            None => (section.line, "has no AccessType".to_owned()),
        };
        self.warn(line, format!("[{}] {what}; taken for rw", section.shown));
        Access::Rw
    }

    /// An integer, with a warning where it is doubtful.
    fn integer(&mut self, section: &Section, key: &str) -> Option<i128> {
        let item = section.get(&key.to_ascii_lowercase())?;
        let reading = value::integer(&item.value)?;
        if let Some(doubt) = reading.doubt {
            self.warn(item.line, format!("[{}] {key}: {doubt}", section.shown));
        }
        Some(reading.value)
    }

    fn pdo(&mut self, section: &Section) -> bool {
        let Some(item) = section.get("pdomapping") else { return false };
        value::switch(&item.value).unwrap_or_else(|| {
            let text = format!("[{}] PDOMapping: {} is neither 0 nor 1", section.shown, quoted(&item.value));
            self.warn(item.line, text);
            false
        })
    }
}

fn number(section: &Section, key: &str) -> Option<i128> {
    value::integer(&section.get(key)?.value).map(|number| number.value)
}

/// A list by sub-index; the first of two with the same number counts.
fn list(section: Option<&Section>) -> BTreeMap<u8, &super::ini::Item> {
    let mut list = BTreeMap::new();
    for (sub, item) in section.map(Section::numbered).unwrap_or_default() {
        if let Ok(sub) = u8::try_from(sub) {
            list.entry(sub).or_insert(item);
        }
    }
    list
}
