//! Every object of every built-in description on a simulated device: each readable object is read, each writable one is
//! written inside and outside of its limits, and each refusal has the abort code in the device's manual.

use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{AbortCode, DownloadSize};
use cangauge::canopen::value::{DataType, Value};
use cangauge::device::catalog::{Model, built_in};
use cangauge::device::description::{Access, ObjectEntry, Remap, Signature, SizeIndication};
use cangauge::device::dictionary::Entry;
use cangauge::master::{Master, MasterEvent, Request, SdoFailure, Timing};
use cangauge::sim::{Device, Setup};
use std::sync::Arc;
use std::time::Duration;

const LENGTH: u32 = 0x0607_0010;
const VALUE: u32 = 0x0609_0030;
const TOO_HIGH: u32 = 0x0609_0031;
const TOO_LOW: u32 = 0x0609_0032;
const NOT_STORED: u32 = 0x0800_0020;
const WRITE_ONLY: u32 = 0x0601_0001;
const READ_ONLY: u32 = 0x0601_0002;
const NO_OBJECT: u32 = 0x0602_0000;
const NO_SUB_INDEX: u32 = 0x0609_0011;
const GENERAL: u32 = 0x0800_0000;

/// Objects outside of CiA 404 whose values change.
const MEASURED: [&str; 4] = ["minimum-pv", "maximum-pv", "process-value-integer", "rest-lifetime"];

/// Incomplete descriptions. A comment at the top of each file states this.
const INCOMPLETE: [&str; 6] = ["hydac-old", "baumer", "danfoss-p92c", "epson-a552", "epson-g552", "hydronautics"];

fn complete() -> impl Iterator<Item = &'static Arc<Model>> {
    built_in().iter().filter(|model| !INCOMPLETE.contains(&model.description.name.as_str()))
}

fn node() -> NodeId {
    NodeId::new(9).expect("a node-ID")
}

/// A device on its own bus.
struct DeviceUnderTest<'a> {
    model: &'a Arc<Model>,
    master: Master<'a>,
}

fn with_device(model: &Arc<Model>, work: impl FnOnce(&mut DeviceUnderTest<'_>)) {
    let bit_rate = model.description.factory.bit_rate.unwrap_or(250_000);
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(bit_rate);
    bus.attach(Device::new(Setup::new(Arc::clone(model), node())).expect("a device"));
    let timing = Timing { timeout: Duration::from_millis(500), retries: 0 };
    work(&mut DeviceUnderTest { model, master: Master::new(&mut bus, timing) });
}

impl DeviceUnderTest<'_> {
    fn name(&self) -> &str {
        &self.model.description.name
    }

    fn read(&mut self, entry: &Entry) -> Result<Value, u32> {
        self.read_as(entry.object, entry.data_type)
    }

    fn read_as(&mut self, object: ObjectId, data_type: DataType) -> Result<Value, u32> {
        let answer = self.master.transfer_one(Request::read(node(), object)).expect("the bus works");
        let answer = answer.and_then(|answer| answer.value(node(), object, Some(data_type)));
        match answer.map_err(|error| error.failure) {
            Ok((value, None)) => Ok(value),
            Ok((_, Some(note))) => panic!("{} {object}: {note:?}", self.model.description.name),
            Err(SdoFailure::Refused(AbortCode(code))) => Err(code),
            Err(other) => panic!("{} {object}: {other}", self.model.description.name),
        }
    }

    fn write(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), u32> {
        let size = match self.model.description.sdo.size {
            SizeIndication::Indicated => DownloadSize::Indicated,
            SizeIndication::Omitted => DownloadSize::Omitted,
        };
        let request = Request::write(node(), object, bytes.to_vec(), size);
        match self.master.transfer_one(request).expect("the bus works").map_err(|error| error.failure) {
            Ok(_) => Ok(()),
            Err(SdoFailure::Refused(AbortCode(code))) => Err(code),
            Err(other) => panic!("{} {object}: {other}", self.model.description.name),
        }
    }

    fn write_number(&mut self, entry: &Entry, number: f64) -> Result<(), u32> {
        let text = match entry.data_type {
            DataType::Real32 => number.to_string(),
            _ => format!("{number:.0}"),
        };
        let bytes = entry.data_type.encode_text(&text).expect("a value of the type");
        self.write(entry.object, &bytes)
    }

    /// The first of `codes` that the manual lists.
    fn listed(&self, codes: &[u32]) -> u32 {
        let listed = &self.model.description.sdo.aborts;
        let mut codes = codes.iter().chain([&GENERAL]).copied();
        let code = if listed.is_empty() { codes.next() } else { codes.find(|code| listed.contains(code)) };
        code.unwrap_or_else(|| panic!("{}: none of the codes is listed", self.name()))
    }

    /// Makes PDO parameters writable: disables the PDO and empties its mapping.
    fn make_pdo_writable(&mut self, object: ObjectId) {
        let communication = (0x1800..0x1a00).contains(&object.index);
        // The inhibit time can be written only while the PDO is disabled.
        if !(is_mapping(object) || communication && object.sub == 3) {
            return;
        }
        if self.model.description.pdo.remap == Remap::Invalidate {
            let cob_id = ObjectId::new(if communication { object.index } else { object.index - 0x200 }, 1);
            let word = self.read_as(cob_id, DataType::Unsigned(4)).ok().and_then(|word| word.as_u64());
            let word = u32::try_from(word.expect("a COB-ID")).expect("32 bits");
            self.write(cob_id, &(word | 0x8000_0000).to_le_bytes()).expect("the PDO can be switched off");
        }
        if is_mapping(object) && object.sub > 0 {
            self.write(object.with_sub(0), &[0]).expect("the mapping can be emptied");
        }
    }
}

/// Entries with their descriptions.
fn described(model: &Model) -> Vec<(Entry, &ObjectEntry)> {
    let object = |entry: &Entry| model.description.object(entry.object).expect("it is described");
    model.dictionary.iter().map(|entry| (entry.clone(), object(entry))).collect()
}

fn number(scalar: &Option<cangauge::device::scalar::Scalar>, data_type: DataType) -> Option<f64> {
    let bytes = scalar.as_ref()?.encode(data_type, node()).ok()?;
    data_type.decode(&bytes).ok()?.as_f64()
}

/// The numbers of `allow`.
fn listed(described: &ObjectEntry) -> Vec<(f64, f64)> {
    described.allow.iter().map(|range| (f64::from(range.low), f64::from(range.high))).collect()
}

/// The lowest and the highest number of a type of integers.
fn limits(data_type: DataType) -> Option<(f64, f64)> {
    match data_type {
        DataType::Unsigned(bytes) => Some((0.0, 2f64.powi(8 * i32::from(bytes)) - 1.0)),
        DataType::Integer(bytes) => {
            let end = 2f64.powi(8 * i32::from(bytes) - 1);
            Some((-end, end - 1.0))
        }
        _ => None,
    }
}

#[test]
fn readable_objects_return_values_of_their_type() {
    for model in built_in() {
        with_device(model, |device| {
            for (entry, described) in described(model) {
                let place = format!("{} {} {}", device.name(), entry.object, entry.full_name());
                let read = device.read(&entry);
                if !entry.access.is_readable() {
                    assert_eq!(read, Err(device.listed(&[WRITE_ONLY])), "{place}");
                    continue;
                }
                let value = read.unwrap_or_else(|code| panic!("{place}: {code:08X}"));
                // Factory defaults, except for measured values.
                let default = entry.default_bytes(node()).and_then(|bytes| entry.data_type.decode(&bytes).ok());
                let measured = matches!(entry.object.index & 0x0fff, 0x100 | 0x130) && entry.object.index >= 0x6000;
                if let Some(default) = default.filter(|_| !measured) {
                    assert_eq!(value, default, "{place}");
                }
                assert!(!described.name.is_empty());
            }
        });
    }
}

#[test]
fn read_only_objects_refuse_writes_and_keep_their_value() {
    for model in built_in() {
        with_device(model, |device| {
            for (entry, _) in described(model).into_iter().filter(|(entry, _)| !entry.access.is_writable()) {
                let place = format!("{} {} {}", device.name(), entry.object, entry.full_name());
                let width = entry.data_type.width().unwrap_or(4).min(4);
                let before = device.read(&entry).expect("readable");
                assert_eq!(
                    device.write(entry.object, &[0x55; 4][..width]),
                    Err(device.listed(&[READ_ONLY])),
                    "{place}"
                );
                let measured = entry.object.index >= 0x6000 || MEASURED.contains(&&*entry.name);
                if !measured {
                    assert_eq!(device.read(&entry), Ok(before), "{place}");
                }
            }
        });
    }
}

#[test]
fn missing_objects_are_refused() {
    for model in built_in() {
        with_device(model, |device| {
            let u8 = DataType::Unsigned(1);
            assert_eq!(device.read_as(ObjectId::new(0x5fff, 0), u8), Err(NO_OBJECT), "{}", device.name());
            assert_eq!(device.write(ObjectId::new(0x5fff, 0), &[0]), Err(NO_OBJECT), "{}", device.name());
            let missing = device.listed(&[NO_SUB_INDEX]);
            let record =
                model.dictionary.iter().find(|entry| entry.object.sub > 0).expect("an object with sub-indices");
            let object = ObjectId::new(record.object.index, 99);
            assert_eq!(device.read_as(object, u8), Err(missing), "{} {object}", device.name());
            assert_eq!(device.write(object, &[0]), Err(missing), "{} {object}", device.name());
        });
    }
}

/// Allowed values are kept; other values are refused and do not change the object. Signatures, 1003h and COB-IDs have
/// their own tests.
#[test]
fn writable_objects_accept_allowed_values_only() {
    for model in complete() {
        let (mut inside, mut outside) = (0, 0);
        for (entry, described) in described(model) {
            let special = described.signature.is_some() || entry.object.index == 0x1003 || is_cob_id(entry.object);
            if !entry.access.is_writable() || special || entry.data_type.width().is_none() {
                continue;
            }
            // Each object on a new device, so that the writes are independent.
            with_device(model, |device| {
                let place = format!("{} {} {}", device.name(), entry.object, entry.full_name());
                device.make_pdo_writable(entry.object);
                // The type alone does not limit unit codes.
                let type_limits = limits(entry.data_type).filter(|_| entry.object.index != 0x6131);
                let low = number(&entry.low, entry.data_type).or(type_limits.map(|(low, _)| low));
                let high = number(&entry.high, entry.data_type).or(type_limits.map(|(_, high)| high));
                let ends = listed(described).into_iter().flat_map(|(low, high)| [low, high]);
                let good: Vec<f64> = [number(&entry.default, entry.data_type)]
                    .into_iter()
                    .flatten()
                    .chain(if described.allow.is_empty() { [low, high] } else { [None; 2] }.into_iter().flatten())
                    .chain(if entry.data_type == DataType::Real32 { vec![-12.5, 0.25] } else { Vec::new() })
                    .chain(ends)
                    .filter(|&good| !is_mapping(entry.object) || is_possible(device, entry.object, good))
                    .collect();
                for good in good {
                    assert!(described.allows(good), "{place}: the test is wrong about {good}");
                    assert_eq!(device.write_number(&entry, good), Ok(()), "{place}: {good}");
                    if entry.access == Access::Rw {
                        let held = device.read(&entry).expect("readable").as_f64();
                        assert_eq!(held, Some(good), "{place}");
                    }
                    inside += 1;
                }
                if entry.access == Access::Wo {
                    return;
                }
                let held = device.read(&entry).expect("readable");
                let beyond = [
                    (low.map(|low| low - 1.0), [TOO_LOW, VALUE, TOO_HIGH]),
                    (high.map(|high| high + 1.0), [TOO_HIGH, VALUE, TOO_HIGH]),
                ];
                let gaps = gaps(described).map(|gap| (Some(gap), [VALUE, TOO_HIGH, TOO_HIGH]));
                for (bad, codes) in beyond.into_iter().chain(gaps) {
                    let fits = |bad: &f64| type_limits.is_none_or(|(low, high)| (low..=high).contains(bad));
                    let Some(bad) = bad.filter(fits) else { continue };
                    let in_list = described.low.is_none() && described.high.is_none() && !described.allow.is_empty();
                    let codes = if in_list { [VALUE, TOO_HIGH, TOO_HIGH] } else { codes };
                    let refused = device.write_number(&entry, bad);
                    if is_mapping(entry.object) && entry.object.sub > 0 {
                        assert!(refused.is_err(), "{place}: {bad}");
                    } else {
                        assert_eq!(refused, Err(device.listed(&codes)), "{place}: {bad}");
                    }
                    assert_eq!(device.read(&entry), Ok(held.clone()), "{place}: the old value is held");
                    outside += 1;
                }
                // A wrong width, if sizes are indicated.
                let width = entry.data_type.width().expect("it has one");
                if model.description.sdo.size == SizeIndication::Indicated {
                    let wrong = if width == 4 { 2 } else { 4 };
                    let refused = device.write(entry.object, &[0; 4][..wrong]);
                    assert_eq!(refused, Err(device.listed(&[LENGTH])), "{place}");
                    assert_eq!(device.read(&entry), Ok(held), "{place}");
                }
            });
        }
        assert!(inside >= 10, "{}: {inside} values held", model.description.name);
        assert!(outside >= 2, "{}: {outside} values refused", model.description.name);
    }
}

/// Numbers between the listed ones.
fn gaps(described: &ObjectEntry) -> impl Iterator<Item = f64> {
    let listed = listed(described);
    let free = |number: &f64| !listed.iter().any(|(low, high)| low <= number && number <= high);
    let next: Vec<f64> = listed.iter().map(|(_, high)| high + 1.0).filter(free).collect();
    next.into_iter()
}

fn is_cob_id(object: ObjectId) -> bool {
    [0x1005, 0x1014].contains(&object.index) || ((0x1800..0x1a00).contains(&object.index) && object.sub == 1)
}

fn is_mapping(object: ObjectId) -> bool {
    (0x1a00..0x1c00).contains(&object.index)
}

/// Whether a number is possible in a mapping object: an existing entry, or the count of mapped entries.
fn is_possible(device: &DeviceUnderTest<'_>, object: ObjectId, number: f64) -> bool {
    if object.sub > 0 {
        return number == 0.0
            || device.model.dictionary.get(object).and_then(|entry| crate::number(&entry.default, entry.data_type))
                == Some(number);
    }
    let entries = (1..=64).map_while(|sub| device.model.dictionary.get(object.with_sub(sub)));
    let mapped =
        entries.take_while(|entry| crate::number(&entry.default, entry.data_type).is_some_and(|word| word != 0.0));
    number <= mapped.count() as f64
}

#[test]
fn only_the_right_signature_has_an_effect() {
    for model in built_in() {
        for (entry, described) in described(model) {
            let Some(signature) = described.signature else { continue };
            with_device(model, |device| {
                let place = format!("{} {} {}", device.name(), entry.object, entry.full_name());
                let refused = Err(device.listed(&[NOT_STORED]));
                for wrong in [&b"evas"[..], b"SAVE", &[0; 4], b"lolo"] {
                    assert_eq!(device.write(entry.object, wrong), refused, "{place}: {wrong:?}");
                }
                let right = if signature == Signature::Set { "\u{3}set" } else { signature.as_str() };
                assert_eq!(device.write(entry.object, right.as_bytes()), Ok(()), "{place}");
                if signature == Signature::Set {
                    assert_eq!(device.read(&entry), Ok(Value::Unsigned(3)), "{place}");
                }
            });
        }
    }
}

#[test]
fn guarding_and_heartbeat_exclude_each_other_as_described() {
    let mut tested = 0;
    for model in built_in() {
        for (entry, described) in
            described(model).into_iter().filter(|(_, described)| !described.only_if_zero.is_empty())
        {
            for &other in &described.only_if_zero {
                with_device(model, |device| {
                    let place = format!("{} {} {other}", device.name(), entry.object);
                    let width = |object| {
                        let entry: &Entry = model.dictionary.get(object).expect("described");
                        entry.data_type.width().expect("a number")
                    };
                    let five = [5, 0, 0, 0];
                    device.write(other, &five[..width(other)]).expect("it is free");
                    let refused = Err(device.listed(&[NOT_STORED]));
                    assert_eq!(device.write(entry.object, &five[..width(entry.object)]), refused, "{place}");
                    assert_eq!(device.read(&entry), Ok(Value::Unsigned(0)), "{place}");
                    device.write(other, &[0; 4][..width(other)]).expect("off is allowed");
                    assert_eq!(device.write(entry.object, &five[..width(entry.object)]), Ok(()), "{place}");
                    assert_eq!(device.read(&entry), Ok(Value::Unsigned(5)), "{place}");
                });
                tested += 1;
            }
        }
    }
    assert!(tested >= 8, "{tested}");
}

#[test]
fn cob_ids_change_by_the_rules_only() {
    for model in built_in() {
        let is_settable =
            |entry: &Entry| entry.object.sub == 1 && is_cob_id(entry.object) && entry.access != Access::Ro;
        for (entry, _) in described(model).into_iter().filter(|(entry, _)| is_settable(entry)) {
            with_device(model, |device| {
                let place = format!("{} {}", device.name(), entry.object);
                let mut put = |word: u32| device.write(entry.object, &word.to_le_bytes());
                // Disable, move, enable.
                assert_eq!(put(0x8000_0199), Ok(()), "{place}");
                assert_eq!(put(0x0000_0199), Ok(()), "{place}");
                // An enabled PDO cannot be moved; NMT's identifier and mapping entries are refused.
                for bad in [0x0000_019a, 0x0000_0000, 0x6130_0120] {
                    let zero = model.description.quirks.contains(&cangauge::device::quirk::Quirk::CobIdZeroIsDefault);
                    if bad == 0 && zero {
                        continue;
                    }
                    assert!(put(bad).is_err(), "{place}: {bad:08X}");
                }
                assert_eq!(device.read(&entry), Ok(Value::Unsigned(0x199)), "{place}");
            });
        }
    }
}

#[test]
fn hydac_zero_restores_the_default_cob_id() {
    let model = cangauge::device::catalog::by_name("hydac").expect("built in");
    with_device(&model, |device| {
        for (object, default) in [(ObjectId::new(0x1800, 1), 0x4000_0189), (ObjectId::new(0x1014, 0), 0x89)] {
            let entry = model.dictionary.get(object).expect("described").clone();
            device.write(object, &0x8000_0199u32.to_le_bytes()).expect("off, and elsewhere");
            device.write(object, &[0; 4]).expect("the default");
            assert_eq!(device.read(&entry), Ok(Value::Unsigned(default)), "{object}");
        }
    });
}

#[test]
fn only_zero_deletes_the_history() {
    for model in built_in() {
        let Some(entry) = model.dictionary.get(ObjectId::new(0x1003, 0)) else { continue };
        with_device(model, |device| {
            assert_eq!(device.write(entry.object, &[0]), Ok(()), "{}", device.name());
            assert!(device.write(entry.object, &[1]).is_err(), "{}", device.name());
        });
    }
}

#[test]
fn every_object_has_a_description() {
    for model in complete() {
        for object in &model.description.objects {
            let place = format!("{} {} {}", model.description.name, object.at, object.name);
            assert!(!object.page.is_empty() || !object.doubt.is_empty(), "{place}: neither page nor doubt");
            let counts = object.name.ends_with("entries");
            let plain = object.text.is_empty() && object.values.is_empty();
            assert!(counts || !plain || (0x1018..=0x1018).contains(&index(object)), "{place}: no meaning");
            // Measured values and signatures have no default; all other objects have one.
            let acts = object.access == Access::Wo;
            let measured =
                ["-pv", "-fv", "-i16", "-i32", "-integer", "-float"].iter().any(|end| object.name.ends_with(end));
            assert!(object.default.is_some() || acts || measured, "{place}: no default");
        }
    }
}

fn index(object: &ObjectEntry) -> u16 {
    object.at.first.index
}

#[test]
fn hydac_stores_its_node_id_with_1010h_4_only() {
    let model = cangauge::device::catalog::by_name("hydac").expect("built in");
    for (sub, expected) in [(1, 9), (4, 12)] {
        with_device(&model, |device| {
            device.write(ObjectId::new(0x2003, 2), &[12]).expect("pending");
            device.write(ObjectId::new(0x1010, sub), b"save").expect("saved");
            device.master.send("000#8109".parse().expect("a frame"));
            let later = device.master.now() + Duration::from_secs(1);
            let mut heard = Vec::new();
            while device.master.now() < later {
                if let MasterEvent::Frame(received) = device.master.next(later).expect("the bus works") {
                    heard.push(received.frame.to_string());
                }
            }
            let boot_up = format!("{:03X}#00", 0x700 + expected);
            assert!(heard.contains(&boot_up), "1010h:{sub}: {heard:?}");
        });
    }
}

/// The codes as printed in the manuals: MH-4 3.3.4, D-20-9 page 7, DPS table 23.
#[test]
fn the_abort_codes_of_the_manuals() {
    let cases: [(&str, u16, u8, &[u8], u32); 9] = [
        ("mh4", 0x61a0, 1, &[3], TOO_HIGH),
        ("mh4", 0x6131, 1, &[0, 0, 0x22, 3], VALUE),
        ("mh4", 0x1010, 1, b"evas", NOT_STORED),
        ("mh4", 0x6148, 1, &[0; 4], READ_ONLY),
        ("d20", 0x1800, 2, &[250], VALUE),
        ("d20", 0x1010, 1, b"evas", NOT_STORED),
        ("dps", 0x6131, 1, &[0, 0, 0x22, 6], TOO_HIGH),
        ("dps", 0x1010, 1, b"evas", GENERAL),
        ("dps", 0x6132, 1, &[2], READ_ONLY),
    ];
    for (name, index, sub, bytes, code) in cases {
        let model = cangauge::device::catalog::by_name(name).expect("built in");
        with_device(&model, |device| {
            assert_eq!(device.write(ObjectId::new(index, sub), bytes), Err(code), "{name} {index:04X}h:{sub}");
        });
    }
}
