//! Reads TOML tables into checked types and collects every mistake with its place.

use super::DescriptionError;
use crate::canopen::id::{NodeId, parse_u32};
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::config_file::Place;
use crate::device::nearest::distance;
use crate::device::scalar::{NumberRange, Scalar};
use crate::device::scale::Decimal;
use crate::device::unit::Unit;
use std::cell::RefCell;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Display;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// The text of a description and the mistakes found in it.
pub(super) struct Source<'a> {
    text: &'a str,
    mistakes: RefCell<Vec<DescriptionError>>,
    notes: RefCell<Vec<DescriptionError>>,
    /// The places of values with a mistake. Only one mistake per value is reported.
    wrong: RefCell<BTreeSet<usize>>,
}

impl<'a> Source<'a> {
    pub(super) fn new(text: &'a str) -> Source<'a> {
        Source { text, mistakes: RefCell::default(), notes: RefCell::default(), wrong: RefCell::default() }
    }

    /// Adds a mistake at a byte offset of the text.
    pub(super) fn mistake(&self, offset: usize, message: impl Into<String>) {
        self.mistakes.borrow_mut().push(self.at(offset, message));
    }

    /// Adds a mistake of a value, unless the value already has one.
    fn mistake_of_value(&self, offset: usize, message: impl Into<String>) {
        if self.wrong.borrow_mut().insert(offset) {
            self.mistake(offset, message);
        }
    }

    /// Adds a possible mistake. The description can still be used.
    fn note(&self, offset: usize, message: impl Into<String>) {
        self.notes.borrow_mut().push(self.at(offset, message));
    }

    fn at(&self, offset: usize, message: impl Into<String>) -> DescriptionError {
        DescriptionError { place: Place::of(self.text, offset), message: message.into() }
    }

    /// Every mistake and every note, in the order of the lines.
    pub(super) fn into_findings(self) -> [Vec<DescriptionError>; 2] {
        [self.mistakes, self.notes].map(|findings| {
            let mut findings = findings.into_inner();
            findings.sort_by_key(|finding| finding.place);
            findings
        })
    }
}

/// One table. It records the keys that were read; all other keys are mistakes.
pub(super) struct Table<'t> {
    table: &'t DeTable<'t>,
    offset: usize,
    source: &'t Source<'t>,
    known: Vec<&'static str>,
    /// The missing required keys.
    missing: Vec<&'static str>,
}

impl<'t> Table<'t> {
    /// Creates the table; `offset` is its byte offset in the text.
    pub(super) fn new(table: &'t DeTable<'t>, offset: usize, source: &'t Source<'t>) -> Table<'t> {
        Table { table, offset, source, known: Vec::new(), missing: Vec::new() }
    }

    /// Whether the table has a key.
    pub(super) fn has(&self, key: &str) -> bool {
        self.table.get(key).is_some()
    }

    fn value(&mut self, key: &'static str) -> Option<&'t Spanned<DeValue<'t>>> {
        self.known.push(key);
        self.table.get(key)
    }

    fn read<T: FromToml>(&self, key: &str, value: &Spanned<DeValue<'_>>) -> Option<T> {
        match T::from_toml(value.get_ref()) {
            Ok(value) => Some(value),
            Err(error) => {
                self.source.mistake_of_value(value.span().start, format!("{key}: {error}"));
                None
            }
        }
    }

    /// Adds a mistake at the value of a key, or at the table if it has no such key.
    pub(super) fn mistake(&self, key: &str, message: impl Into<String>) {
        match self.table.get(key) {
            Some(value) => self.source.mistake_of_value(value.span().start, message),
            None => self.source.mistake(self.offset, message),
        }
    }

    /// Adds a note at the value of a key, or at the table if it has no such key.
    pub(super) fn note(&self, key: &str, message: impl Into<String>) {
        let offset = self.table.get(key).map_or(self.offset, |value| value.span().start);
        self.source.note(offset, message);
    }

    /// Reads the value of a key; `None` if it is missing or wrong.
    pub(super) fn optional<T: FromToml>(&mut self, key: &'static str) -> Option<T> {
        let value = self.value(key)?;
        self.read(key, value)
    }

    /// Reads the value of a required key.
    pub(super) fn required<T: FromToml>(&mut self, key: &'static str) -> Option<T> {
        let Some(value) = self.value(key) else {
            self.missing.push(key);
            return None;
        };
        self.read(key, value)
    }

    /// Reads the value of a key, or returns the default of its type.
    pub(super) fn or_default<T: FromToml + Default>(&mut self, key: &'static str) -> T {
        self.optional(key).unwrap_or_default()
    }

    /// Reads the values of an array. Each value that cannot be read is a mistake.
    pub(super) fn list<T: FromToml>(&mut self, key: &'static str) -> Vec<T> {
        match self.value(key).map(|value| (value, value.get_ref())) {
            Some((_, DeValue::Array(array))) => array.iter().filter_map(|value| self.read(key, value)).collect(),
            Some((value, other)) => {
                self.source.mistake(value.span().start, format!("{key}: {} instead of an array", kind(other)));
                Vec::new()
            }
            None => Vec::new(),
        }
    }

    /// Reads a table whose keys are data. `what` is the name of the table in messages.
    pub(super) fn entries<K: FromToml + Ord, V: FromToml>(&self, what: &str) -> BTreeMap<K, V> {
        let mut entries = BTreeMap::new();
        for (key, value) in self.table {
            let text = Spanned::new(key.span(), DeValue::String(key.get_ref().clone()));
            let (Some(key), Some(value)) = (self.read(what, &text), self.read(what, value)) else { continue };
            if entries.insert(key, value).is_some() {
                self.source.mistake(text.span().start, format!("{what}: a key twice"));
            }
        }
        entries
    }

    /// Reads a table below this one.
    pub(super) fn table(&mut self, key: &'static str) -> Option<Table<'t>> {
        let value = self.value(key)?;
        self.as_table(key, value)
    }

    /// Reads an array of tables below this one.
    pub(super) fn tables(&mut self, key: &'static str) -> Vec<Table<'t>> {
        let Some(value) = self.value(key) else { return Vec::new() };
        match value.get_ref() {
            DeValue::Array(array) => array.iter().filter_map(|value| self.as_table(key, value)).collect(),
            other => {
                let message = format!("{key}: {} instead of tables [[{key}]]", kind(other));
                self.source.mistake(value.span().start, message);
                Vec::new()
            }
        }
    }

    fn as_table(&self, key: &str, value: &'t Spanned<DeValue<'t>>) -> Option<Table<'t>> {
        match value.get_ref() {
            DeValue::Table(table) => Some(Table::new(table, value.span().start, self.source)),
            other => {
                self.source.mistake(value.span().start, format!("{key}: {} instead of a table", kind(other)));
                None
            }
        }
    }

    /// Reports each unknown key with the known keys, the most similar first. Then reports each missing key, unless an
    /// unknown key is a misspelling of it.
    pub(super) fn finish(&mut self) {
        for (name, _) in self.table {
            if !self.known.contains(&name.get_ref().as_ref()) {
                let mut known = self.known.clone();
                known.sort_by_key(|key| distance(key, name.get_ref()).min(3));
                let message = format!("unknown key \"{}\" (known: {})", name.get_ref(), known.join(", "));
                self.source.mistake(name.span().start, message);
                self.missing.retain(|key| distance(key, name.get_ref()) > 2);
            }
        }
        for key in self.missing.drain(..) {
            self.source.mistake(self.offset, format!("missing key \"{key}\""));
        }
    }
}

fn kind(value: &DeValue<'_>) -> &'static str {
    match value {
        DeValue::String(_) => "text",
        DeValue::Integer(_) => "an integer",
        DeValue::Float(_) => "a number with a fraction",
        DeValue::Boolean(_) => "true or false",
        DeValue::Datetime(_) => "a date",
        DeValue::Array(_) => "an array",
        DeValue::Table(_) => "a table",
    }
}

/// A type that can be read from one TOML value. The error states why the value does not fit.
pub(super) trait FromToml: Sized {
    fn from_toml(value: &DeValue<'_>) -> Result<Self, String>;
}

fn text<'v>(value: &'v DeValue<'_>) -> Result<&'v str, String> {
    value.as_str().ok_or_else(|| format!("{} instead of text in quotes", kind(value)))
}

/// Parses the text of a value.
pub(super) fn parsed<T: std::str::FromStr>(value: &DeValue<'_>) -> Result<T, String>
where
    T::Err: Display,
{
    text(value)?.parse().map_err(|error: T::Err| error.to_string())
}

fn integer(value: &DeValue<'_>) -> Result<i64, String> {
    let number = value.as_integer().ok_or_else(|| format!("{} instead of an integer", kind(value)))?;
    i64::from_str_radix(number.as_str(), number.radix()).map_err(|_| format!("{number} is too large"))
}

impl FromToml for String {
    fn from_toml(value: &DeValue<'_>) -> Result<String, String> {
        text(value).map(str::to_owned)
    }
}

impl FromToml for bool {
    fn from_toml(value: &DeValue<'_>) -> Result<bool, String> {
        value.as_bool().ok_or_else(|| format!("{} instead of true or false", kind(value)))
    }
}

/// Reads unsigned integers. Text is accepted because the keys of a table are text: decimal or hexadecimal.
macro_rules! unsigned {
    ($($name:ident),*) => {
        $(impl FromToml for $name {
            fn from_toml(value: &DeValue<'_>) -> Result<$name, String> {
                let number = match value.as_str() {
                    Some(text) => parse_u32(text).map(i64::from).ok_or_else(|| format!("\"{text}\" is not a number"))?,
                    None => integer(value)?,
                };
                $name::try_from(number).map_err(|_| format!("{number} is not in the range 0 to {}", $name::MAX))
            }
        })*
    };
}

unsigned!(u8, u16, u32, u64);

impl FromToml for NodeId {
    fn from_toml(value: &DeValue<'_>) -> Result<NodeId, String> {
        NodeId::new(u8::from_toml(value)?).map_err(|error| error.to_string())
    }
}

impl FromToml for Scalar {
    fn from_toml(value: &DeValue<'_>) -> Result<Scalar, String> {
        match value {
            DeValue::Float(number) => {
                let real = number.as_str().parse().map_err(|_| format!("{number} is not a number"))?;
                Ok(Scalar::Real(real))
            }
            DeValue::Integer(_) => integer(value).map(Scalar::Integer),
            other => text(other).map(Scalar::from),
        }
    }
}

impl FromToml for ObjectId {
    fn from_toml(value: &DeValue<'_>) -> Result<ObjectId, String> {
        parsed(value)
    }
}

impl FromToml for DataType {
    fn from_toml(value: &DeValue<'_>) -> Result<DataType, String> {
        parsed(value)
    }
}

impl FromToml for i64 {
    fn from_toml(value: &DeValue<'_>) -> Result<i64, String> {
        integer(value)
    }
}

impl FromToml for Decimal {
    fn from_toml(value: &DeValue<'_>) -> Result<Decimal, String> {
        match value {
            DeValue::Float(number) => number.as_str().parse(),
            DeValue::Integer(_) => integer(value).map(|number| Decimal::new(number, 0)),
            other => Err(format!("{} instead of a number", kind(other))),
        }
    }
}

/// The unit of a signal: the object that contains its code, or a fixed unit.
#[derive(Clone, Copy, Debug)]
pub(super) enum UnitEntry {
    At(ObjectId),
    Fixed(Unit),
}

impl UnitEntry {
    pub(super) fn object(self) -> Option<ObjectId> {
        if let UnitEntry::At(object) = self { Some(object) } else { None }
    }

    pub(super) fn fixed(self) -> Option<Unit> {
        if let UnitEntry::Fixed(unit) = self { Some(unit) } else { None }
    }
}

impl FromToml for UnitEntry {
    fn from_toml(value: &DeValue<'_>) -> Result<UnitEntry, String> {
        let text = text(value)?;
        // `0x2131` is an object. `0x004E0000` is too long for an object, so it is a unit code.
        let object = text.parse().ok().filter(|_| text.starts_with(|first: char| first.is_ascii_digit()));
        let fixed = || Unit::from_symbol(text).map(UnitEntry::Fixed);
        let unknown = || format!("\"{text}\" is neither a known unit (bar, degC, l/h, %) nor an object (0x6131:1)");
        object.map(UnitEntry::At).or_else(fixed).ok_or_else(unknown)
    }
}

impl FromToml for NumberRange {
    fn from_toml(value: &DeValue<'_>) -> Result<NumberRange, String> {
        parsed(value)
    }
}

impl FromToml for super::ObjectRun {
    fn from_toml(value: &DeValue<'_>) -> Result<super::ObjectRun, String> {
        parsed(value)
    }
}

/// Reads an enum from its words. For any other word, the error lists the known ones.
macro_rules! enum_words {
    ($name:path { $($word:literal => $variant:ident),* $(,)? }) => {
        impl FromToml for $name {
            fn from_toml(value: &DeValue<'_>) -> Result<$name, String> {
                match text(value)? {
                    $($word => Ok(<$name>::$variant),)*
                    other => Err(format!("\"{other}\" is not one of: {}", [$($word),*].join(", "))),
                }
            }
        }
    };
}

enum_words!(super::Access { "ro" => Ro, "wo" => Wo, "rw" => Rw, "const" => Const });
enum_words!(super::Signature { "save" => Save, "load" => Load, "zero" => Zero, "tara" => Tare, "set" => Set });
enum_words!(super::StoreGroup { "all" => All, "comm" => Communication, "app" => Application });
enum_words!(super::SizeIndication { "indicated" => Indicated, "omitted" => Omitted });
enum_words!(super::Remap { "invalidate" => Invalidate, "count-only" => CountOnly });
enum_words!(super::ErrorHistory {
    "code-low" => CodeLow,
    "code-low-bytes-swapped" => CodeLowBytesSwapped,
    "code-high" => CodeHigh,
});
enum_words!(crate::device::assign::AssignKind { "lss" => Lss, "objects" => Objects });
enum_words!(crate::device::assign::AssignState { "pre-operational" => PreOperational, "stopped" => Stopped });
enum_words!(crate::device::assign::Applies { "reset" => Reset, "power" => Power });
enum_words!(crate::device::quirk::Quirk {
    "upload-answered60" => UploadAnswered60,
    "save-all-resets-cob-ids" => SaveAllResetsCobIds,
    "cob-id-zero-is-default" => CobIdZeroIsDefault,
    "emergency-repeats" => EmergencyRepeats,
});
