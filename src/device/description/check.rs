//! Checks the references between the parts of a description.

use super::table::Table;
use super::*;
use crate::canopen::value::DataType;
use crate::device::assign::AssignKind;
use std::collections::BTreeSet;

/// The tables of the file, which give the lines for messages. Each list has the same order as in [`Description`].
pub(super) struct Tables<'a, 't> {
    pub(super) file: &'a Table<'t>,
    pub(super) identify: Option<&'a Table<'t>>,
    pub(super) bit_rates: Option<&'a Table<'t>>,
    pub(super) startup: Option<&'a Table<'t>>,
    pub(super) assign: Vec<Table<'t>>,
    pub(super) autozero: Vec<Table<'t>>,
    pub(super) signals: Vec<Table<'t>>,
    pub(super) objects: Vec<Table<'t>>,
    pub(super) emergencies: Vec<Table<'t>>,
}

/// Highest CiA 404 channel: 6130h has sub-indices 1 to 199.
const LAST_CHANNEL: u8 = 199;

/// The first channel number for signals without a CiA 404 channel.
pub(super) const FIRST_WITHOUT_CHANNEL: u8 = 200;

/// Placeholder for a missing channel, until the signals are numbered.
pub(super) const NO_CHANNEL: u8 = u8::MAX;

/// Reports every contradiction.
pub(super) fn check(description: &Description, tables: &Tables<'_, '_>) {
    let known = KnownObjects::of(description);
    characters(tables.file, &description.name);
    objects(description, &known, tables);
    signals(description, &known, tables);
    emergencies(description, tables);
    identify(description, &known, tables);
    bit_rates(description, tables);
    assign(description, &known, tables);
    autozero(description, &known, tables);
    pdos(description, tables);
    for &object in &description.error_counters {
        known.require(tables.file, "error_counters", object);
    }
    if let Some((startup, table)) = description.startup.as_ref().zip(tables.startup) {
        known.require(table, "object", startup.object);
    }
}

/// The objects of the description.
struct KnownObjects<'a> {
    description: &'a Description,
}

impl KnownObjects<'_> {
    fn of(description: &Description) -> KnownObjects<'_> {
        KnownObjects { description }
    }

    /// Reports an object that is used but not described. A description without objects is not checked.
    fn require(&self, table: &Table<'_>, key: &str, object: ObjectId) {
        if !self.description.objects.is_empty() && self.description.object(object).is_none() {
            table.mistake(key, format!("{key}: there is no [[object]] {object}"));
        }
    }
}

/// Reports a name with characters other than a to z, 0 to 9 and hyphens. Returns whether all are allowed.
fn characters(table: &Table<'_>, name: &str) -> bool {
    let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    let is_plain = !name.is_empty() && name.chars().all(plain);
    if !is_plain {
        table.mistake("name", format!("name: \"{name}\" has other characters than a to z, 0 to 9 and -"));
    } else if name.starts_with('-') || name.ends_with('-') {
        table.mistake("name", format!("name: \"{name}\" begins or ends with a hyphen"));
    }
    is_plain
}

/// Reports a name of a signal or object that can be confused with an address.
fn name(table: &Table<'_>, name: &str) {
    if characters(table, name) && ObjectId::looks_like_address(name) {
        table.mistake("name", format!("name: \"{name}\" would be read as an address"));
    }
}

fn objects(description: &Description, known: &KnownObjects<'_>, tables: &Tables<'_, '_>) {
    let mut names = BTreeMap::new();
    let mut addresses = BTreeSet::new();
    for (entry, table) in description.objects.iter().zip(&tables.objects) {
        name(table, &entry.name);
        for object in entry.objects() {
            if !addresses.insert(object) {
                table.mistake("at", format!("at: {object} is described twice"));
                break;
            }
        }
        let subs = (entry.at.is_run, entry.at.first.index);
        // Two ranges may share a name only at the same index. The sub-index makes the names different: `ai-input-pv:1`.
        if names.insert(&entry.name, subs).is_some_and(|other| other != subs || !entry.at.is_run) {
            table.mistake("name", format!("name: two objects have the name \"{}\"", entry.name));
        }
        values(entry, table);
        if entry.signature.is_some() && (entry.data_type != DataType::Unsigned(4) || !entry.access.is_writable()) {
            table.mistake("signature", "signature: the object is not a writable u32");
        }
        for object in &entry.only_if_zero {
            known.require(table, "only_if_zero", *object);
        }
        if let Some(object) = entry.unit_at {
            known.require(table, "unit_at", object);
        }
    }
}

/// Checks that each mapping has a TPDO with communication parameters, and that each mapped object is described with the
/// mapped width.
fn pdos(description: &Description, tables: &Tables<'_, '_>) {
    let has = |index: u16| description.objects.iter().any(|object| object.at.first.index == index);
    let numbers: BTreeSet<u16> =
        description.objects.iter().filter_map(|object| tpdo_number(object.at.first.index)).collect();
    if let Some(signal) = tables.signals.first().filter(|_| numbers.is_empty()) {
        signal.note("name", "no TPDO is described (objects 18xxh and 1Axxh): they are read from the device");
    }
    let mut reported = BTreeSet::new();
    for (entry, table) in description.objects.iter().zip(&tables.objects) {
        let index = entry.at.first.index;
        let Some(number) = tpdo_number(index) else { continue };
        let missing = Some(0x1800 + number).filter(|missing| !has(*missing));
        if let Some(missing) = missing.filter(|missing| reported.insert(*missing)) {
            table.mistake("at", format!("at: there is no [[object]] 0x{missing:04X} of the same TPDO"));
        }
        if let Some(Scalar::Integer(word)) = entry.default
            && (0x1a00..0x1c00).contains(&index)
            && entry.at.first.sub > 0
            && word != 0
        {
            check_mapping_entry(description, table, word);
        }
    }
}

/// Returns the number of the TPDO to which an index belongs, counted from 0.
fn tpdo_number(index: u16) -> Option<u16> {
    (0x1800..0x1c00).contains(&index).then_some(index & 0x1ff)
}

/// Checks an entry of a default mapping.
fn check_mapping_entry(description: &Description, table: &Table<'_>, word: i64) {
    let [bits, sub, low, high, ..] = word.to_le_bytes();
    let object = ObjectId::new(u16::from_le_bytes([low, high]), sub);
    let Some(entry) = description.object(object) else {
        return table.mistake("default", format!("default: it maps {object}, and there is no such [[object]]"));
    };
    let width = entry.data_type.width().map(|width| 8 * width);
    if width != Some(usize::from(bits)) && entry.data_type != DataType::Boolean {
        let message = format!("default: it maps {bits} bits of {object}, which has the type {}", entry.data_type);
        table.mistake("default", message);
    }
    if !entry.pdo {
        table.mistake("default", format!("default: it maps {object}, and [[object]] {} has no pdo = true", entry.at));
    }
}

/// Checks that default, limits, ranges and meanings fit the type, and that the default and the meanings are allowed
/// values.
fn values(entry: &ObjectEntry, table: &Table<'_>) {
    let [low, high] = [&entry.low, &entry.high].map(|limit| limit.as_ref().and_then(Scalar::as_f64));
    if low.zip(high).is_some_and(|(low, high)| low > high) {
        return table.mistake("low", "low: it is greater than high");
    }
    for (key, scalar) in [("low", &entry.low), ("high", &entry.high), ("default", &entry.default)] {
        let Some(scalar) = scalar else { continue };
        match scalar.encode(entry.data_type, NodeId::MIN) {
            Err(error) => table.mistake(key, format!("{key}: {error}")),
            Ok(_) if scalar.as_f64().is_some_and(|number| !entry.allows(number)) => {
                table.mistake(key, format!("{key}: {scalar} is not allowed by low, high and allow"));
            }
            Ok(_) => {}
        }
    }
    let fits = |number: i64| Scalar::Integer(number).encode(entry.data_type, NodeId::MIN).is_ok();
    for range in &entry.allow {
        if let Some(number) = [range.low, range.high].into_iter().find(|number| !fits(i64::from(*number))) {
            table.mistake("allow", format!("allow: {number} does not fit {}", entry.data_type));
        }
    }
    for number in entry.values.keys() {
        let number = i64::try_from(*number).unwrap_or(i64::MAX);
        if !fits(number) || !entry.allows(number as f64) {
            table.mistake("values", format!("values: {number} is not a value of the object"));
        }
    }
}

fn signals(description: &Description, known: &KnownObjects<'_>, tables: &Tables<'_, '_>) {
    let (mut names, mut channels) = (BTreeSet::new(), BTreeSet::new());
    for (signal, table) in description.signals.iter().zip(&tables.signals) {
        name(table, &signal.name);
        if !names.insert(&signal.name) {
            table.mistake("name", format!("name: two signals have the name \"{}\"", signal.name));
        }
        let number = signal.name.strip_prefix("ch").and_then(|number| number.parse::<u8>().ok());
        if let Some(number) = number.filter(|number| *number != signal.channel && table.has("channel")) {
            let message =
                format!("name: \"{}\" is channel {number}, and this is channel {}", signal.name, signal.channel);
            table.mistake("name", message);
        }
        let has_channel = table.has("channel");
        if signal.channel == NO_CHANNEL && !has_channel {
            table.mistake("name", "name: more than 55 signals have no channel");
        }
        if signal.scale.is_some_and(|scale| scale.factor.mantissa == 0) {
            table.mistake("factor", "factor: it is 0");
        }
        if signal.scale.is_some() && signal.digits.is_some() {
            table.mistake("digits", "digits: not together with factor or offset");
        }
        if signal.status_bits.is_some() && signal.status.is_none() {
            table.mistake("status_bits", "status_bits: there is no status object");
        }
        let type_of = |object: ObjectId| description.object(object).map(|entry| entry.data_type);
        if let Some(data_type) = type_of(signal.value).filter(|data_type| data_type.width().is_none()) {
            table.mistake("value", format!("value: [[object]] {} is not a number, but {data_type}", signal.value));
        }
        if let (Some(bits), Some(status)) = (&signal.status_bits, signal.status) {
            status_bits(bits, type_of(status), table);
        }
        markers(&signal.markers, signal.data_type.or(type_of(signal.value)), table);
        if let Some((stated, object)) = signal.data_type.zip(description.object(signal.value))
            && stated != object.data_type
        {
            table.mistake("type", format!("type: [[object]] {} has the type {}", object.at, object.data_type));
        }
        if has_channel && !(1..=LAST_CHANNEL).contains(&signal.channel) {
            table.mistake("channel", format!("channel: {} is not in the range 1 to {LAST_CHANNEL}", signal.channel));
        } else if !channels.insert(signal.channel) {
            table.mistake("channel", format!("channel: two signals have the channel {}", signal.channel));
        }
        for (key, object) in signal.objects() {
            known.require(table, key, object);
        }
    }
}

/// Checks that each bit has one meaning and exists in the status object.
fn status_bits(bits: &StatusBits, data_type: Option<DataType>, table: &Table<'_>) {
    let all = bits.invalid | bits.high | bits.low;
    let count = [bits.invalid, bits.high, bits.low].map(u64::count_ones).iter().sum::<u32>();
    if count > all.count_ones() {
        table.mistake("status_bits", "status_bits: a bit has two meanings");
    }
    let width = data_type.and_then(DataType::width).and_then(|width| u32::try_from(8 * width).ok());
    if let Some(width) = width.filter(|&width| all.checked_shr(width).is_some_and(|beyond| beyond != 0)) {
        table.mistake("status_bits", format!("status_bits: the status object has bits 0 to {}", width - 1));
    }
}

/// Checks that each number has one meaning and fits the type of the value.
fn markers(markers: &Markers, data_type: Option<DataType>, table: &Table<'_>) {
    let mut known = BTreeSet::new();
    for number in markers.invalid.iter().chain(&markers.high).chain(&markers.low) {
        if !known.insert(number) {
            table.mistake("markers", format!("markers: {number} has two meanings"));
        }
        let fits = |data_type| Scalar::Integer(*number).encode(data_type, NodeId::MIN).is_ok();
        if let Some(data_type) = data_type.filter(|&data_type| !fits(data_type)) {
            table.mistake("markers", format!("markers: {number} does not fit {data_type}"));
        }
    }
}

fn emergencies(description: &Description, tables: &Tables<'_, '_>) {
    let mut codes = BTreeSet::new();
    for (emergency, table) in description.emergencies.iter().zip(&tables.emergencies) {
        if !codes.insert(emergency.code) {
            table.mistake("code", format!("code: {:04X}h is described twice", emergency.code));
        }
        if emergency.register_bit.is_some_and(|bit| bit > 7) {
            table.mistake("register_bit", "register_bit: the error register has bits 0 to 7");
        }
        if emergency.bytes.len() > 5 {
            table.mistake("bytes", "bytes: an emergency has bytes 3 to 7, five at most");
        }
    }
}

fn identify(description: &Description, known: &KnownObjects<'_>, tables: &Tables<'_, '_>) {
    let Some(table) = tables.identify.filter(|_| !description.identify.is_empty()) else {
        let text = "no [identify]: the device is not recognised, the description is used only with --device";
        return tables.file.note("name", text);
    };
    let Identify { device_type, vendor_id, product_code, .. } = description.identify;
    let numbers = [
        ("device_type", device_type, ObjectId::DEVICE_TYPE),
        ("vendor_id", vendor_id, ObjectId::new(0x1018, 1)),
        ("product_code", product_code, ObjectId::new(0x1018, 2)),
    ];
    for (key, number, object) in numbers {
        let default = description.object(object).and_then(|entry| entry.default.as_ref());
        if let (Some(number), Some(&Scalar::Integer(default))) = (number, default)
            && i64::from(number) != default
        {
            table.mistake(key, format!("{key}: [[object]] {object} has the default 0x{default:08X}"));
        }
    }
    for (object, value) in &description.identify.confirm {
        match description.object(*object) {
            None => known.require(table, "confirm", *object),
            Some(entry) => {
                if let Err(error) = value.encode(entry.data_type, NodeId::MIN) {
                    table.mistake("confirm", format!("confirm: {object}: {error}"));
                }
            }
        }
    }
}

fn bit_rates(description: &Description, tables: &Tables<'_, '_>) {
    let check = |rates: &BTreeMap<u8, u32>, table: &Table<'_>, key: Option<&str>| {
        let mut seen = BTreeSet::new();
        for (index, rate) in rates {
            let index = index.to_string();
            let key = key.unwrap_or(&index);
            if !(1..=1_000_000).contains(rate) {
                table.mistake(key, format!("bit_rates: {rate} bit/s is not in the range 1 to 1000000"));
            } else if !seen.insert(rate) {
                table.mistake(key, format!("bit_rates: two indices have {rate} bit/s"));
            }
        }
    };
    if let Some(table) = tables.bit_rates {
        check(&description.bit_rates, table, None);
    }
    for (entry, table) in description.assign.iter().zip(&tables.assign) {
        check(&entry.bit_rates, table, Some("bit_rates"));
    }
}

fn assign(description: &Description, known: &KnownObjects<'_>, tables: &Tables<'_, '_>) {
    for (entry, table) in description.assign.iter().zip(&tables.assign) {
        let places = [("node_id", entry.node_id), ("bit_rate", entry.bit_rate)];
        let places = places.into_iter().filter_map(|(key, place)| Some((key, place?)));
        let has_place = entry.node_id.is_some() || entry.bit_rate.is_some();
        if has_place == (entry.kind == AssignKind::Lss) {
            table.mistake("way", "way: \"objects\" needs node_id or bit_rate, and \"lss\" has neither");
        }
        // An unverified method may use objects that the description does not contain.
        for (key, place) in places.filter(|_| !entry.unverified) {
            known.require(table, key, place.object);
            if let Some(object) = description.object(place.object).filter(|it| it.data_type != place.data_type) {
                table.mistake(key, format!("{key}: [[object]] {} has the type {}", object.at, object.data_type));
            }
        }
        if let Some(object) = entry.store {
            known.require(table, "store", object);
        }
    }
}

fn autozero(description: &Description, known: &KnownObjects<'_>, tables: &Tables<'_, '_>) {
    for (entry, table) in description.autozero.iter().zip(&tables.autozero) {
        known.require(table, "object", entry.object);
        if let Some(object) = entry.offset {
            known.require(table, "offset", object);
        }
        if let Some(absolute) = &entry.absolute {
            known.require(table, "absolute", absolute.object);
        }
        for object in entry.range.iter().flat_map(|range| [range.start, range.end, range.unit]) {
            known.require(table, "range", object);
        }
        if entry.signature.is_empty() || entry.signature.len() > 4 {
            table.mistake("signature", "signature: it has 1 to 4 bytes");
        }
    }
}
