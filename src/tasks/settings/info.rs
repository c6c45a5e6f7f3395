//! Reads the page of `info`: everything about one device.

use super::errors::{Errors, read as read_errors};
use super::limits::Limit;
use super::{SettingsFailure, ValueWithUnit, page};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::profiles;
use crate::device::unit::Unit;
use crate::master::{Master, SdoFailure};
use crate::measure::layout::Signal;
use crate::measure::sample::Sample;
use crate::node::read::Reader;
use crate::node::survey::survey_with;
use crate::node::{Node, Overrides, state};
use crate::tasks::failure::Cause;
use crate::tasks::read::{objects, sample, targets};
use crate::tasks::{Failure, Kind};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The page of `info`.
#[derive(Clone, Debug)]
pub struct Info {
    /// Identity, signals and TPDOs.
    pub node: Node,
    /// The hardware version (1009h).
    pub hardware: Option<String>,
    /// The software version (100Ah).
    pub software: Option<String>,
    /// The bit rate of the device, else of the bus, in bit/s.
    pub bit_rate: Option<u32>,
    /// The NMT state; `None` if no heartbeat shows it.
    pub state: Option<NmtState>,
    /// How the loss of the device is detected: heartbeat or node guarding.
    pub monitoring: Monitoring,
    /// The communication objects.
    pub communication: Vec<Setting>,
    /// Register and history; `None` if the device has neither.
    pub errors: Option<Errors>,
    /// The signals.
    pub channels: Vec<Channel>,
    /// Inhibit times (180xh:3) in the order of the TPDOs, in 100 us.
    pub inhibit_100us: Vec<Option<u64>>,
    /// The date of the last calibration.
    pub calibrated: Option<Date>,
    /// The date of production.
    pub produced: Option<Date>,
    /// The manufacturer-specific objects.
    pub own: Vec<Setting>,
    /// The groups of 1010h, and the settings that the device stores.
    pub store: Store,
}

/// How the loss of a device is detected. CiA 301 allows either heartbeat or node guarding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Monitoring {
    /// The heartbeat time in ms; 0: off.
    pub heartbeat_ms: u64,
    /// The guard time in ms, and the life time in ms; a life time of 0: off.
    pub guarding_ms: (u64, u64),
}

/// One object with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// The object.
    pub object: ObjectId,
    /// Its name without sub-index.
    pub name: String,
    /// The value, as read.
    pub value: Value,
    /// The meaning of the value.
    pub meaning: Meaning,
}

/// The meaning of the value of an object.
#[derive(Clone, Debug, PartialEq)]
pub enum Meaning {
    /// The meaning is unknown.
    Plain,
    /// A number in the unit of its signal.
    Quantity(ValueWithUnit),
    /// The code of a unit.
    Unit(Unit),
    /// A number with this unit, or a code with this word. Both are from the description or CiA 404.
    Labelled(String),
    /// A COB-ID with its flags.
    CobId,
    /// The operating mode of a channel (6112h).
    OperatingMode,
    /// A time in microseconds.
    Microseconds,
    /// A time in multiples of 100 microseconds.
    HundredMicroseconds,
    /// A time in milliseconds; 0: off.
    Milliseconds,
}

/// A date as stored in the device. The numbers may be invalid as a date.
#[derive(Clone, Debug, PartialEq)]
pub struct Date {
    /// Year, month and day.
    pub parts: [Value; 3],
}

/// A signal with its settings.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name, channel, unit, digits.
    pub signal: Signal,
    /// The present value; `None` if it cannot be read.
    pub sample: Option<Sample>,
    /// Start and end of the measuring range.
    pub range: Option<(ValueWithUnit, ValueWithUnit)>,
    /// The objects of this channel.
    pub settings: Vec<Setting>,
}

/// The non-volatile settings.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Store {
    /// The sub-indices of 1010h that can be written, with the capability bits read there.
    pub groups: Vec<(u8, u32)>,
    /// The names of the settings that are stored, from the description; empty if they are unknown.
    pub kept: Vec<String>,
    /// The names of the settings that are lost at power off.
    pub lost: Vec<String>,
}

const HARDWARE: ObjectId = ObjectId::new(0x1009, 0);
const SOFTWARE: ObjectId = ObjectId::new(0x100a, 0);
const GUARD_TIME: ObjectId = ObjectId::new(0x100c, 0);
const LIFE_TIME: ObjectId = ObjectId::new(0x100d, 0);
const STORE: ObjectId = ObjectId::new(0x1010, 0);
const HEARTBEAT: ObjectId = ObjectId::new(0x1017, 0);

/// The communication objects on the page. Identity, TPDOs and errors have their own sections.
const COMMUNICATION_OBJECTS: [u16; 9] = [0x1005, 0x1006, 0x100c, 0x100d, 0x1014, 0x1015, 0x1017, 0x1019, 0x1f80];

/// The scaling objects of a channel, as indices without the first digit. Every family has them.
const SCALING_OBJECTS: [u16; 5] = [0x120, 0x121, 0x122, 0x123, 0x124];

/// If the heartbeat time is longer, the state is not shown, because the page should appear at once.
const HEARTBEAT_TIMEOUT: Duration = Duration::from_secs(2);

/// The objects on the page.
struct Selection {
    communication: Vec<ObjectId>,
    /// The objects of each signal.
    channels: Vec<Vec<ObjectId>>,
    own: Vec<ObjectId>,
    dates: [Option<[ObjectId; 3]>; 2],
    /// The inhibit time of each TPDO.
    inhibit: Vec<ObjectId>,
}

impl Selection {
    fn of(node: &Node) -> Selection {
        let channels: Vec<Vec<ObjectId>> = node.signals.iter().map(|signal| channel_objects(node, signal)).collect();
        Selection {
            communication: communication(node),
            own: manufacturer_objects(node, &channels),
            channels,
            dates: [page::CALIBRATED, page::PRODUCED].map(|parts| page::date_objects(node, parts)),
            inhibit: node.tpdos.iter().map(|tpdo| tpdo.number.communication(3)).collect(),
        }
    }

    /// Reads the objects that the node can have. A missing answer does not affect other objects.
    fn read(&self, reader: &mut Reader<'_, Master<'_>>, node: &Node) -> Result<BTreeMap<ObjectId, Value>, Failure> {
        let all: BTreeSet<ObjectId> = [HARDWARE, SOFTWARE]
            .into_iter()
            .chain(self.communication.iter().copied())
            .chain(self.channels.iter().flatten().copied())
            .chain(self.own.iter().copied())
            .chain(self.dates.iter().flatten().flatten().copied())
            .chain((0..=4).map(|sub| STORE.with_sub(sub)))
            .chain(self.inhibit.iter().copied())
            .chain(node.signals.iter().filter_map(|signal| span(node, signal)).flatten())
            .filter(|&object| node.may_have(object))
            .collect();
        let all: Vec<ObjectId> = all.into_iter().collect();
        let items: Vec<_> = all.iter().map(|&object| (node.id, object, node.data_type(object))).collect();
        let values = reader.values(&items)?;
        Ok(all.into_iter().zip(values).filter_map(|(object, value)| Some((object, value?))).collect())
    }
}

/// Reads the page. Objects that the device does not have or rejects are omitted. Each object is read once.
///
/// # Errors
/// No answer, protocol errors, bus errors and Ctrl-C.
pub fn read(master: &mut Master<'_>, node: NodeId, overrides: &Overrides) -> Result<Info, Failure> {
    master.listen_to(&[node])?;
    let mut reader = Reader::new(master);
    let node = &survey_with(&mut reader, &[node], overrides)?.pop().unwrap_or_else(|| Node::new(node));
    let selection = Selection::of(node);
    let values = selection.read(&mut reader, node)?;
    let samples = samples(master, node)?;
    let errors = match read_errors(master, node) {
        Ok(errors) => Some(errors),
        Err(Failure { cause: Cause::Settings(SettingsFailure::NoErrorObjects), .. }) => None,
        // The device has answered other reads. A note names the objects without an answer.
        Err(failure) if failure.kind() == Kind::NoAnswer => None,
        Err(failure) => return Err(failure),
    };
    let state = state(master, node, &values)?;
    let text = |object: ObjectId| values.get(&object).map(Value::to_string);
    let setting = |signal: Option<&Signal>, object: ObjectId| {
        let value = values.get(&object)?.clone();
        let name = node.entry(object).map_or_else(|| node.layout().name_of(object), |entry| entry.name);
        let meaning = page::meaning(node, &values, signal, object, &value);
        Some(Setting { object, name, value, meaning })
    };
    let Selection { communication, channels, own, dates, inhibit } = selection;
    let [calibrated, produced] = dates.map(|objects| page::date(&values, objects?));
    let channels = node.signals.iter().zip(channels).zip(samples).map(|((signal, objects), sample)| Channel {
        range: span(node, signal).and_then(|ends| page::range(&values, signal, ends)),
        settings: objects.into_iter().filter_map(|object| setting(Some(signal), object)).collect(),
        signal: signal.clone(),
        sample,
    });
    Ok(Info {
        hardware: text(HARDWARE),
        software: text(SOFTWARE),
        bit_rate: page::bit_rate(node, &values).or(master.bus().bit_rate()),
        state,
        monitoring: monitoring(&values),
        communication: communication.into_iter().filter_map(|object| setting(None, object)).collect(),
        errors,
        channels: channels.collect(),
        inhibit_100us: inhibit.iter().map(|object| values.get(object).and_then(Value::as_u64)).collect(),
        calibrated,
        produced,
        own: own.into_iter().filter_map(|object| setting(node.signals.first(), object)).collect(),
        store: page::store(node, &values, STORE),
        node: node.clone(),
    })
}

fn communication(node: &Node) -> Vec<ObjectId> {
    let startup =
        node.model.as_ref().and_then(|model| model.description.startup.as_ref()).map(|startup| startup.object);
    let mut objects: Vec<ObjectId> = COMMUNICATION_OBJECTS.into_iter().map(|index| ObjectId::new(index, 0)).collect();
    objects.extend(startup.filter(|object| !objects.contains(object)));
    objects.retain(|&object| node.may_have(object));
    objects
}

/// Returns the objects of a channel in the order in which they are shown.
fn channel_objects(node: &Node, signal: &Signal) -> Vec<ObjectId> {
    if !signal.has_channel() {
        return Vec::new();
    }
    let at = |index: u16| ObjectId::new(index, signal.channel);
    let described = node.model.as_ref().is_some_and(|model| !model.dictionary.is_empty());
    let own = signal.value_object.0.index & 0xf000;
    let scaling = [0x6000, 0x7000, 0x8000, 0x9000].into_iter().filter(|&family| described || family == own);
    let scaling = SCALING_OBJECTS.into_iter().flat_map(|low| scaling.clone().map(move |family| at(family | low)));
    let mut objects: Vec<ObjectId> = [0x6110, 0x6112, 0x6114].map(at).to_vec();
    objects.extend(scaling);
    objects.extend([0x6126, 0x6127, 0x6132, 0x61a0, 0x61a1].map(at));
    objects.extend(Limit::ALL.map(|limit| limit.object(node, signal)));
    // Add manufacturer-specific objects that have the channel as sub-index, and minimum and maximum.
    let numbered = node.model.as_ref().into_iter().flat_map(|model| model.dictionary.iter());
    let numbered = numbered.filter(|entry| entry.numbered && entry.object.sub == signal.channel);
    objects.extend(numbered.map(|entry| entry.object).filter(|object| page::is_own(*object)));
    objects.extend(["minimum-pv", "maximum-pv"].into_iter().filter_map(|name| node.object_of(signal, name)));
    let mut seen: BTreeSet<ObjectId> = signal.other_objects.iter().copied().collect();
    objects.retain(|&object| {
        let readable = node.entry(object).is_none_or(|entry| entry.access.is_readable());
        node.may_have(object) && readable && seen.insert(object)
    });
    objects
}

/// Returns the manufacturer-specific objects without a channel. If no signals are described, also returns the objects
/// of the profile, from the EDS or the profile.
fn manufacturer_objects(node: &Node, channels: &[Vec<ObjectId>]) -> Vec<ObjectId> {
    let taken: BTreeSet<ObjectId> = channels.iter().flatten().copied().collect();
    let values = node.signals.iter().flat_map(|signal| signal.other_objects.iter().copied());
    let startup = communication(node).into_iter();
    let dates = [page::CALIBRATED, page::PRODUCED].into_iter().filter_map(|parts| page::date_objects(node, parts));
    let taken: BTreeSet<ObjectId> = taken.into_iter().chain(values).chain(startup).chain(dates.flatten()).collect();
    let entries = node.model.as_ref().into_iter().flat_map(|model| model.dictionary.iter());
    let is_described = node.model.as_ref().is_some_and(|model| !model.description.signals.is_empty());
    let of_profile = |object: ObjectId| !is_described && (0x6000..0xa000).contains(&object.index);
    let entries = entries.filter(|entry| {
        let object = entry.object;
        // Sub-index 0 of numbered entries contains the number of entries.
        let is_count = entry.name.ends_with("-entries") || entry.numbered && object.sub == 0;
        (page::is_own(object) || of_profile(object) && !is_count) && entry.access.is_readable()
    });
    let entries = entries.filter(|entry| !entry.name.ends_with("-entries") && !taken.contains(&entry.object));
    let mut own: Vec<ObjectId> = entries.map(|entry| entry.object).collect();
    if node.model.is_none() {
        let objects = node.identity.profile().into_iter().flat_map(profiles::settings_of);
        own.extend(objects);
    }
    let signals: BTreeSet<ObjectId> = node.signals.iter().map(|signal| signal.value_object.0).collect();
    own.retain(|object| !signals.contains(object));
    own
}

/// Returns the objects with the start and the end of the measuring range, if the signal can have them.
fn span(node: &Node, signal: &Signal) -> Option<[ObjectId; 2]> {
    let described = node.model.as_ref().map_or(&[][..], |model| &model.description.signals);
    let entry = described.iter().find(|entry| entry.name == signal.name);
    let of_channel = |low| signal.has_channel().then(|| node.object_in_family(signal, low));
    let start = entry.and_then(|entry| entry.span_start).or_else(|| of_channel(0x148))?;
    let end = entry.and_then(|entry| entry.span_end).or_else(|| of_channel(0x149))?;
    Some([start, end])
}

/// Reads the present values. A value is `None` if it cannot be read.
fn samples(master: &mut Master<'_>, node: &Node) -> Result<Vec<Option<Sample>>, Failure> {
    if node.signals.is_empty() {
        return Ok(Vec::new());
    }
    let targets = targets(node, &[], &mut 0)?;
    let asked: Vec<_> = targets.iter().flat_map(objects).collect();
    let mut answers = Reader::new(master).read(&asked)?.into_iter();
    let mut samples = Vec::new();
    for target in targets {
        let Some(value) = answers.next() else { break };
        let status = target.second_object().and_then(|_| answers.next());
        samples.push(match sample(&target, value, status) {
            Ok(sample) => Some(sample),
            Err(error) => {
                if matches!(error.failure, SdoFailure::NoAnswer { .. }) {
                    master.add_unknown(node.id, error.object);
                }
                None
            }
        });
    }
    Ok(samples)
}

/// Returns the NMT state, if a heartbeat shows it within a short time. Node guarding is not used, because it would
/// disturb the toggle bit for another guarding master.
fn state(
    master: &mut Master<'_>,
    node: &Node,
    values: &BTreeMap<ObjectId, Value>,
) -> Result<Option<NmtState>, Failure> {
    let period = values.get(&HEARTBEAT).and_then(Value::as_u64).map(Duration::from_millis);
    match period.filter(|period| !period.is_zero() && *period <= HEARTBEAT_TIMEOUT) {
        Some(period) => Ok(state::by_heartbeat(master, node.id, period)?),
        None => Ok(None),
    }
}

fn monitoring(values: &BTreeMap<ObjectId, Value>) -> Monitoring {
    let number = |object: ObjectId| values.get(&object).and_then(Value::as_u64).unwrap_or(0);
    let guard = number(GUARD_TIME);
    Monitoring { heartbeat_ms: number(HEARTBEAT), guarding_ms: (guard, guard * number(LIFE_TIME)) }
}
