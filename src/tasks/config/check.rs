//! Compares a file with a device before anything is written: keys, types, units, ranges, and values that exclude each
//! other.

use super::dump::path;
use super::problem::{Mistake, Problem};
use super::setting::{Form, Setting, Stage};
use super::snapshot::Snapshot;
use super::value::{Content, Scales, SignalScale};
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::config_file::{Document, Entry, Item};
use crate::device::dictionary;
use crate::device::nearest::distance;
use crate::device::scalar::Scalar;
use crate::device::unit::Unit;
use crate::measure::sample::Number;
use crate::node::Node;
use crate::node::names::nearest;

/// A setting with its value in a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Wanted {
    /// The setting.
    pub setting: Setting,
    /// The value in the form of the device.
    pub content: Content,
    /// The value in the file, with its place for messages.
    pub entry: Entry,
}

/// The settings and conditions of a file, for one device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FileSettings {
    /// The settings.
    pub wanted: Vec<Wanted>,
    /// The conditions of `[device]`, and the serial number of `[calibration]`.
    pub conditions: Vec<Entry>,
    /// The units and digits after the change.
    pub scales: Scales,
}

/// The sections of a file that are used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Sections {
    /// Whether `[address]` is used.
    pub address: bool,
    /// Whether `[calibration]` is used.
    pub calibration: bool,
}

impl Sections {
    /// Whether a key is in a section that is used.
    pub fn include(self, key: &str) -> bool {
        match key.split('.').next() {
            Some("address") => self.address,
            Some("calibration") => self.calibration,
            _ => true,
        }
    }
}

/// The conditions that `[device]` can contain, besides `device.range.SIGNAL`.
const CONDITIONS: [&str; 5] =
    ["device.kind", "device.vendor", "device.product", "device.reference", "calibration.serial"];

/// Checks a file against a node. `present` contains the present settings of the device. Without them, only the facts of
/// the description are checked.
///
/// # Errors
/// All mistakes, in the order of their places in the file.
pub fn check(
    document: &Document,
    node: &Node,
    settings: &[Setting],
    present: Option<&Snapshot>,
) -> Result<FileSettings, Vec<Mistake>> {
    let mut check = Check { node, settings, present, scales: Scales::of(node), mistakes: Vec::new() };
    check.update_scales(document);
    let mut file = FileSettings::default();
    for entry in &document.entries {
        if CONDITIONS.contains(&entry.key.as_str()) || entry.key.starts_with("device.range.") {
            match check_condition(entry) {
                Ok(()) => file.conditions.push(entry.clone()),
                Err(problem) => check.add_mistake(entry, problem),
            }
        } else if let Some(wanted) = check.check_entry(entry, &file) {
            file.wanted.push(wanted);
        }
    }
    if check.mistakes.is_empty() {
        check.check_combinations(&file);
    }
    let mut mistakes = check.mistakes;
    mistakes.sort_by_key(|mistake| mistake.place);
    file.scales = check.scales;
    if mistakes.is_empty() { Ok(file) } else { Err(mistakes) }
}

/// Checks the form of a condition.
fn check_condition(entry: &Entry) -> Result<(), Problem> {
    let is_number = matches!(entry.key.as_str(), "device.vendor" | "device.product" | "calibration.serial");
    match &entry.value {
        Item::Text(text) if entry.key.starts_with("device.range.") => match parse_range(text) {
            Some(_) => Ok(()),
            None => Err(Problem::NotAQuantity { text: text.clone() }),
        },
        item if is_number => match parse_number(item) {
            Some(_) => Ok(()),
            None => Err(Problem::Type { expected: "a number (0x47)", found: item.kind() }),
        },
        Item::Text(_) => Ok(()),
        item => Err(Problem::Type { expected: "text in quotes", found: item.kind() }),
    }
}

/// Parses a 32-bit number, given as an integer or as text.
pub(super) fn parse_number(item: &Item) -> Option<u32> {
    match item {
        Item::Integer(number) => u32::try_from(*number).ok(),
        Item::Text(text) => crate::canopen::id::parse_u32(text),
        _ => None,
    }
}

/// Parses a measuring range. Returns the start (if it is given), the end and the unit.
pub(super) fn parse_range(text: &str) -> Option<(Option<f64>, f64, Unit)> {
    let quantity = |text: &str| -> Option<(f64, Unit)> {
        let (number, unit) = text.trim().split_once(' ').unwrap_or((text.trim(), ""));
        let unit = if unit.is_empty() { Unit::NONE } else { Unit::from_symbol(unit)? };
        Some((number.parse::<f64>().ok().filter(|number| number.is_finite())?, unit))
    };
    match text.split_once(" to ") {
        None => quantity(text).map(|(end, unit)| (None, end, unit)),
        Some((start, end)) => {
            let ((start, from), (end, to)) = (quantity(start)?, quantity(end)?);
            (from == to).then_some((Some(start), end, to))
        }
    }
}

struct Check<'a> {
    node: &'a Node,
    settings: &'a [Setting],
    present: Option<&'a Snapshot>,
    scales: Scales,
    mistakes: Vec<Mistake>,
}

impl Check<'_> {
    fn add_mistake(&mut self, entry: &Entry, problem: Problem) {
        let is_key = matches!(problem, Problem::UnknownKey { .. } | Problem::Twice { .. });
        let place = if is_key { entry.key_at } else { entry.value_at };
        self.mistakes.push(Mistake { place, key: entry.key.clone(), problem });
    }

    /// Updates the units and digits to those after the change.
    fn update_scales(&mut self, document: &Document) {
        let is_offline = self.present.is_none();
        for (scale, signal) in self.scales.signals.iter_mut().zip(&self.node.signals) {
            if is_offline {
                *scale = SignalScale::default();
            }
            let value = |name: &str| document.get(&format!("signal.{}.{name}", signal.name)).map(|entry| &entry.value);
            if let Some(Item::Text(text)) = value("unit") {
                let unit = Unit::from_symbol(text).map(|unit| signal.unit.map_or(unit, |present| unit.beside(present)));
                (scale.unit, scale.is_in_file) = (unit.or(scale.unit), true);
            }
            if let Some(Item::Integer(digits)) = value("digits") {
                scale.digits = u8::try_from(*digits).ok().filter(|digits| *digits <= 9).or(scale.digits);
            }
        }
    }

    /// Returns the setting for a key. The key can also name an explicit COB-ID (`address.`) or an object (`object.`).
    fn find(&self, key: &str) -> Option<&Setting> {
        let own = self.settings.iter().find(|setting| setting.key == key);
        let explicit = || {
            let key = key.strip_prefix("address.")?;
            self.settings.iter().find(|setting| setting.key == key && matches!(setting.form, Form::CobId(_)))
        };
        let by_object = || {
            let object = object_of(self.node, key)?;
            self.settings.iter().find(|setting| setting.object == object && setting.key.starts_with("object."))
        };
        own.or_else(explicit).or_else(by_object)
    }

    fn check_entry(&mut self, entry: &Entry, before: &FileSettings) -> Option<Wanted> {
        let Some(setting) = self.find(&entry.key).cloned() else {
            let problem = self.unknown_key(&entry.key);
            self.add_mistake(entry, problem);
            return None;
        };
        if let Some(other) = before.wanted.iter().find(|wanted| wanted.setting.key == setting.key) {
            self.add_mistake(entry, Problem::Twice { other: other.entry.key.clone() });
            return None;
        }
        let read = setting.read(self.node, &self.scales, &entry.value);
        match read.and_then(|content| self.check_allowed(&setting, content, &entry.value)) {
            Ok(content) => content.map(|content| {
                // An explicit COB-ID always belongs to [address].
                let key = path(&setting, &content);
                Wanted { entry: Entry { key, ..entry.clone() }, content, setting }
            }),
            Err(problem) => {
                self.add_mistake(entry, problem);
                None
            }
        }
    }

    /// Returns the problem of an unknown key. It suggests the key of the same object, or similar keys.
    fn unknown_key(&self, key: &str) -> Problem {
        let object = object_of(self.node, key);
        let owner = object.and_then(|object| {
            self.settings
                .iter()
                .find(|setting| setting.object == object && object.index != 0)
                .map(|found| found.key.clone())
        });
        let known = self.settings.iter().map(|setting| setting.key.clone());
        let known = known.chain(CONDITIONS.map(str::to_owned));
        let last = key.rsplit('.').next().map_or(0, str::len);
        let is_near = |other: &String| distance(key, other) <= 1 + last / 2;
        let nearest =
            owner.map_or_else(|| nearest(key, known).into_iter().filter(is_near).collect(), |owner| vec![owner]);
        let title = self.node.model.as_ref().map(|model| model.description.title.clone());
        Problem::UnknownKey { device: title, nearest }
    }

    /// Checks the limits in the description.
    fn check_allowed(
        &self,
        setting: &Setting,
        content: Option<Content>,
        item: &Item,
    ) -> Result<Option<Content>, Problem> {
        let Some(content) = content else { return Ok(None) };
        if !setting.is_writable {
            let present = self.present.and_then(|present| Some((present.content(setting)?, present.show(setting))));
            return match present {
                None if self.present.is_none() => Ok(Some(content)),
                Some((found, _)) if found == content => Ok(Some(content)),
                present => Err(Problem::Fixed { present: present.and_then(|(_, item)| item) }),
            };
        }
        match (&content, &setting.form) {
            (Content::Mapping(entries), Form::Signals(number)) => {
                let count = self.node.model.as_ref().and_then(|model| model.dictionary.get(number.mapping(0)));
                let high = count.and_then(|entry| entry.high.as_ref()).and_then(Scalar::as_f64);
                if high.is_some_and(|high| entries.len() as f64 > high) {
                    let high = high.unwrap_or_default().to_string();
                    return Err(Problem::Entries { high });
                }
                self.check_mappable(*number, entries, item)?;
            }
            (Content::Bytes(bytes), form) if !matches!(form, Form::Quantity(..)) => self.check_range(setting, bytes)?,
            _ => {}
        }
        Ok(Some(content))
    }

    fn check_mappable(
        &self,
        number: crate::canopen::pdo::TpdoNumber,
        entries: &[crate::canopen::pdo::MappingEntry],
        item: &Item,
    ) -> Result<(), Problem> {
        let Some(model) = self.node.model.as_ref() else { return Ok(()) };
        let texts: &[String] = if let Item::List(list) = item { list } else { &[] };
        let mapped = self.present.into_iter().flat_map(|present| &present.tpdos).flat_map(|tpdo| &tpdo.mapping);
        let mapped: Vec<ObjectId> = mapped.map(|entry| entry.object).collect();
        for (at, entry) in (1..=u8::MAX).zip(entries) {
            let known = model.dictionary.get(entry.object);
            let is_allowed = self
                .node
                .described(number.mapping(at))
                .is_none_or(|described| described.allow.is_empty() || described.allows(f64::from(entry.word())));
            let is_mappable = known.is_none_or(|known| known.pdo) || mapped.contains(&entry.object);
            if !is_allowed || !is_mappable {
                let text = texts.get(usize::from(at) - 1).cloned().unwrap_or_else(|| item.to_string());
                return Err(Problem::NotMappable { object: entry.object, text });
            }
        }
        Ok(())
    }

    fn check_range(&self, setting: &Setting, bytes: &[u8]) -> Result<(), Problem> {
        let value = setting.data_type.decode(bytes).ok();
        let Some(number) = value.as_ref().and_then(Value::as_f64) else { return Ok(()) };
        let shown = |number: f64| {
            let text = format!("{number}");
            let bytes = setting.data_type.encode_text(&text).ok();
            let item = bytes.map(|bytes| setting.show(self.node, &self.scales, &Content::Bytes(bytes)));
            item.map_or(text, |item| item.to_string())
        };
        let entry = self.node.model.as_ref().and_then(|model| model.dictionary.get(setting.object));
        let limit = |scalar: Option<&Scalar>| scalar.and_then(Scalar::as_f64);
        let low = limit(entry.and_then(|entry| entry.low.as_ref()));
        let high = limit(entry.and_then(|entry| entry.high.as_ref()));
        if low.is_some_and(|low| number < low) || high.is_some_and(|high| number > high) {
            let text = |limit: Option<f64>| limit.map_or_else(String::new, shown);
            return Err(Problem::Range { low: text(low), high: text(high) });
        }
        let described = self.node.described(setting.object);
        match described.filter(|described| !described.allows(number)) {
            Some(described) => {
                let range = |range: &crate::device::scalar::NumberRange| match (range.low, range.high) {
                    (low, high) if low == high => shown(low.into()),
                    (low, high) => format!("{} to {}", shown(low.into()), shown(high.into())),
                };
                Err(Problem::Allowed { values: described.allow.iter().map(range).collect() })
            }
            None => Ok(()),
        }
    }

    /// Checks values that depend on each other, with the values after the change.
    fn check_combinations(&mut self, file: &FileSettings) {
        let mut found = Vec::new();
        for wanted in &file.wanted {
            found.extend(self.crossed_limits(wanted, file).map(|problem| (wanted.entry.clone(), problem)));
            found.extend(self.excluded_service(wanted, file).map(|problem| (wanted.entry.clone(), problem)));
            found.extend(self.id_conflict(wanted, file).map(|problem| (wanted.entry.clone(), problem)));
        }
        found.into_iter().for_each(|(entry, problem)| self.add_mistake(&entry, problem));
    }

    /// Returns the value of a setting after the change.
    fn content_after(&self, setting: &Setting, file: &FileSettings) -> Option<Content> {
        let wanted = file.wanted.iter().find(|wanted| wanted.setting.key == setting.key);
        wanted.map(|wanted| wanted.content.clone()).or_else(|| self.present?.content(setting))
    }

    fn crossed_limits(&self, wanted: &Wanted, file: &FileSettings) -> Option<Problem> {
        let (base, name) = wanted.setting.key.rsplit_once('.')?;
        let (other, is_lower) = match name {
            "lower" => ("upper", true),
            "upper" => ("lower", false),
            "span-start" => ("span-end", true),
            "span-end" => ("span-start", false),
            _ => return None,
        };
        let other = self.find(&format!("{base}.{other}"))?;
        let is_in_file = file.wanted.iter().any(|wanted| wanted.setting.key == other.key);
        let rescales = self.present.is_some_and(|present| present.scales != self.scales);
        // The mistake is reported once, at the lower end.
        if is_in_file && !is_lower || !is_in_file && (rescales || self.present.is_none()) {
            return None;
        }
        let number = |setting: &Setting, content: &Content| match content {
            Content::Bytes(bytes) => Number::from_value(&setting.data_type.decode(bytes).ok()?, 0).map(Number::as_f64),
            _ => None,
        };
        let content = self.content_after(other, file)?;
        let (own, other_value) = (number(&wanted.setting, &wanted.content)?, number(other, &content)?);
        let is_crossed = if is_lower { own > other_value } else { other_value > own };
        let value = other.show(self.node, &self.scales, &content);
        is_crossed.then(|| Problem::Crossed { other: other.key.clone(), value })
    }

    /// Reports heartbeat and guarding if both are on, for devices that accept only one of them.
    fn excluded_service(&self, wanted: &Wanted, file: &FileSettings) -> Option<Problem> {
        let is_on = |content: &Content| matches!(content, Content::Bytes(bytes) if bytes.iter().any(|byte| *byte != 0));
        if !is_on(&wanted.content) {
            return None;
        }
        let others = &self.node.described(wanted.setting.object)?.only_if_zero;
        let mut others = self.settings.iter().filter(|setting| others.contains(&setting.object));
        others.find_map(|other| {
            let content = self.content_after(other, file).filter(is_on)?;
            let value = other.show(self.node, &self.scales, &content);
            Some(Problem::Excluded { other: other.key.clone(), value })
        })
    }

    /// Reports an identifier that two senders would share, or a TPDO without an identifier.
    fn id_conflict(&self, wanted: &Wanted, file: &FileSettings) -> Option<Problem> {
        // Without the device, the node-ID and the identifiers that depend on it are unknown.
        self.present?;
        let is_id = |setting: &&Setting| matches!(setting.form, Form::CobId(_));
        let is_on = |setting: &Setting| match setting.stage {
            Stage::Tpdo(number) => {
                let enabled = self.find(&format!("tpdo.{}.enabled", number.get()));
                let content = enabled.and_then(|enabled| self.content_after(enabled, file));
                content.is_none_or(|content| content == Content::Number(1))
            }
            _ => true,
        };
        let id = |setting: &Setting| match self.content_after(setting, file) {
            Some(Content::Number(id)) => Some(id),
            _ => None,
        };
        let own = match wanted.setting.form {
            Form::CobId(_) => &wanted.setting,
            Form::Bit(31, false) => self.find(&wanted.setting.key.replace("enabled", "cob-id"))?,
            _ => return None,
        };
        let number = id(own).filter(|_| is_on(own))?;
        if number == 0 && matches!(own.stage, Stage::Tpdo(_)) {
            return Some(Problem::NoId);
        }
        let mut others = self.settings.iter().filter(is_id).filter(|other| other.key != own.key && is_on(other));
        let other = others.find(|other| id(other) == Some(number))?;
        Some(Problem::SameId { id: number, other: other.key.clone() })
    }
}

/// Returns the object that a key of `[object]` names.
fn object_of(node: &Node, key: &str) -> Option<ObjectId> {
    let name = key.strip_prefix("object.")?;
    name.parse().ok().or_else(|| node.entry_by_name(name).map(|entry| entry.object))
}

/// Returns settings for objects that the file names and the device may have, but the table of settings lacks.
pub(super) fn named_objects(document: &Document, node: &Node, settings: &[Setting]) -> Vec<Setting> {
    let mut extra: Vec<Setting> = Vec::new();
    for entry in &document.entries {
        let Some(object) = object_of(node, &entry.key) else { continue };
        let Some(known) = node.entry(object) else { continue };
        let is_known = settings.iter().chain(&extra).any(|setting| setting.object == object);
        extra.extend(named_object(node, &known).filter(|_| !is_known));
    }
    extra
}

/// Returns an object as a setting, if it is readable, writable, and neither a command nor a PDO parameter.
pub(super) fn named_object(node: &Node, known: &dictionary::Entry) -> Option<Setting> {
    let object = known.object;
    let is_plain = known.access.is_readable() && known.access.is_writable() && known.data_type != DataType::Domain;
    let is_command = matches!(object.index, 0x1003 | 0x1010 | 0x1011 | 0x1400..=0x1bff);
    let has_signature = node.described(object).is_some_and(|described| described.signature.is_some());
    if !is_plain || is_command || has_signature {
        return None;
    }
    let name = Some(known.full_name()).filter(|name| !dictionary::spellings(name).is_empty());
    Some(Setting {
        key: format!("object.{}", name.unwrap_or_else(|| object.to_string())),
        object,
        data_type: node.known_type(object).unwrap_or(DataType::OctetString),
        form: Form::Plain,
        stage: Stage::Object,
        is_writable: true,
    })
}
