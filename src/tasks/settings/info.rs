//! Everything a technician asks of one device, on one page.

use super::errors::{Errors, read as read_errors};
use super::limits::Limit;
use super::{Device, Quantity, filter, page};
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::measure::sample::Sample;
use crate::node::Node;
use crate::node::state;
use crate::tasks::Failure;
use crate::tasks::read::{requests, sample, targets};
use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

/// The page.
#[derive(Clone, Debug)]
pub struct Info {
    /// Identity, signals and TPDOs.
    pub instrument: Node,
    /// 1009h.
    pub hardware: Option<String>,
    /// 100Ah.
    pub software: Option<String>,
    /// Of the bus, or what the device is set to, in bit/s.
    pub bit_rate: Option<u32>,
    /// The NMT state, where a heartbeat told it.
    pub state: Option<NmtState>,
    /// How it is noticed that the device is gone.
    pub monitoring: String,
    /// The communication objects.
    pub communication: Vec<Setting>,
    /// Register and history; `None` where the device has neither.
    pub errors: Option<Errors>,
    /// The signals.
    pub channels: Vec<Channel>,
    /// Inhibit times (180xh:3) in the order of the TPDOs, in 100 us.
    pub inhibit_100us: Vec<Option<u64>>,
    /// When it was calibrated last, `2016-04-01`.
    pub calibrated: Option<String>,
    /// When it was made.
    pub produced: Option<String>,
    /// The manufacturer's own objects.
    pub own: Vec<Setting>,
    /// What 1010h can do and keeps.
    pub store: Store,
}

/// One object with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Setting {
    /// Where it stands.
    pub object: ObjectId,
    /// Its name without sub-index.
    pub name: String,
    /// As it was read.
    pub value: Value,
    /// With unit and meaning.
    pub text: String,
}

/// A signal with its settings.
#[derive(Clone, Debug)]
pub struct Channel {
    /// Name, channel, unit, digits.
    pub signal: Signal,
    /// The present value; `None` where the device does not tell it.
    pub sample: Option<Sample>,
    /// Start and end of the measuring range.
    pub range: Option<(Quantity, Quantity)>,
    /// The objects of this channel.
    pub settings: Vec<Setting>,
}

/// What is kept beyond power off.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Store {
    /// The sub-indices of 1010h that can be written, with the capability bits read there.
    pub groups: Vec<(u8, u32)>,
    /// Names of the settings that the description says are kept; empty where it says nothing.
    pub kept: Vec<String>,
    /// Names of the settings that are lost.
    pub lost: Vec<String>,
}

const HARDWARE: ObjectId = ObjectId::new(0x1009, 0);
const SOFTWARE: ObjectId = ObjectId::new(0x100a, 0);
const GUARD_TIME: ObjectId = ObjectId::new(0x100c, 0);
const LIFE_TIME: ObjectId = ObjectId::new(0x100d, 0);
const STORE: ObjectId = ObjectId::new(0x1010, 0);
const HEARTBEAT: ObjectId = ObjectId::new(0x1017, 0);

/// Communication objects worth a line. The identity, TPDOs and errors have places of their own.
const COMMUNICATION: [u16; 9] = [0x1005, 0x1006, 0x100c, 0x100d, 0x1014, 0x1015, 0x1017, 0x1019, 0x1f80];

/// Objects of a channel, as indices without the first digit; the rest of CiA 404 stands in all families.
const SCALING: [u16; 5] = [0x120, 0x121, 0x122, 0x123, 0x124];

/// A slower heartbeat is not waited for: a page is to be there at once.
const PATIENCE: Duration = Duration::from_secs(2);

/// Reads the page. What the device lacks or refuses is left out.
///
/// # Errors
/// Silence, breaches of the protocol, and what stops everything.
pub fn read(master: &mut Master<'_>, device: &Device) -> Result<Info, Failure> {
    let instrument = &device.instrument;
    let communication = communication(device);
    let channels: Vec<Vec<ObjectId>> = instrument.signals.iter().map(|signal| of_channel(device, signal)).collect();
    let own = own(device, &channels);
    let dates = [page::CALIBRATED, page::PRODUCED].map(|parts| page::date_objects(device, parts));
    let store: Vec<ObjectId> = (0..=4).map(|sub| STORE.with_sub(sub)).collect();
    let inhibit: Vec<ObjectId> = instrument.tpdos.iter().map(|tpdo| tpdo.number.communication(3)).collect();
    let spans = instrument.signals.iter().flat_map(|signal| span(device, signal));
    let all: BTreeSet<ObjectId> = [HARDWARE, SOFTWARE]
        .into_iter()
        .chain(communication.iter().copied())
        .chain(channels.iter().flatten().copied())
        .chain(own.iter().copied())
        .chain(dates.iter().flatten().flatten().copied())
        .chain(store)
        .chain(inhibit.iter().copied())
        .chain(spans)
        .filter(|&object| device.may_have(object))
        .collect();
    let all: Vec<ObjectId> = all.into_iter().collect();
    let read = device.read_each(master, &all)?;
    let values: BTreeMap<ObjectId, Value> =
        all.into_iter().zip(read).filter_map(|(object, value)| Some((object, value?))).collect();
    let samples = samples(master, device)?;
    let errors = match read_errors(master, device) {
        Ok(errors) => Some(errors),
        // It has neither register nor history.
        Err(failure) if failure.object.is_none() && failure.kind() == crate::tasks::Kind::Unexpected => None,
        Err(failure) => return Err(failure),
    };
    let state = state(master, device, &values)?;
    let text = |object: ObjectId| values.get(&object).map(Value::to_string);
    let setting = |signal: Option<&Signal>, object: ObjectId| {
        let value = values.get(&object)?.clone();
        let name = device.entry(object).map_or_else(|| object.to_string(), |entry| entry.name);
        let text = page::text(device, &values, signal, object, &value);
        Some(Setting { object, name, value, text })
    };
    let [calibrated, produced] = dates.map(|objects| page::date(&values, objects?));
    let shown = instrument.signals.iter().zip(channels).zip(samples);
    let channels = shown.map(|((signal, objects), sample)| Channel {
        range: page::range(device, &values, signal, span(device, signal)),
        settings: objects.into_iter().filter_map(|object| setting(Some(signal), object)).collect(),
        signal: signal.clone(),
        sample,
    });
    Ok(Info {
        hardware: text(HARDWARE),
        software: text(SOFTWARE),
        bit_rate: page::bit_rate(device, &values).or(master.bus().bit_rate()),
        state,
        monitoring: monitoring(&values),
        communication: communication.into_iter().filter_map(|object| setting(None, object)).collect(),
        errors,
        channels: channels.collect(),
        inhibit_100us: inhibit.iter().map(|object| values.get(object).and_then(Value::as_u64)).collect(),
        calibrated,
        produced,
        own: own.into_iter().filter_map(|object| setting(instrument.signals.first(), object)).collect(),
        store: page::store(device, &values, STORE),
        instrument: instrument.clone(),
    })
}

fn communication(device: &Device) -> Vec<ObjectId> {
    let startup = device.model().and_then(|model| model.description.startup.as_ref()).map(|startup| startup.object);
    let mut objects: Vec<ObjectId> = COMMUNICATION.into_iter().map(|index| ObjectId::new(index, 0)).collect();
    objects.extend(startup.filter(|object| !objects.contains(object)));
    objects.retain(|&object| device.may_have(object));
    objects
}

/// The objects of a channel in the order in which they are shown.
fn of_channel(device: &Device, signal: &Signal) -> Vec<ObjectId> {
    let at = |index: u16| ObjectId::new(index, signal.channel);
    let described = device.model().is_some_and(|model| !model.dictionary.is_empty());
    let own = signal.value.0.index & 0xf000;
    let scaling = [0x6000, 0x7000, 0x8000, 0x9000].into_iter().filter(|&family| described || family == own);
    let scaling = SCALING.into_iter().flat_map(|low| scaling.clone().map(move |family| at(family | low)));
    let mut objects: Vec<ObjectId> = [0x6110, 0x6112, 0x6114].map(at).to_vec();
    objects.extend(scaling);
    objects.extend([0x6126, 0x6127, 0x6132, 0x61a0, 0x61a1].map(at));
    objects.extend(Limit::ALL.map(|limit| limit.object(device, signal)));
    // The manufacturer's objects that have the channels as sub-indices, and minimum and maximum.
    let numbered = device.model().into_iter().flat_map(|model| model.dictionary.iter());
    let numbered = numbered.filter(|entry| entry.numbered && entry.object.sub == signal.channel);
    objects.extend(numbered.map(|entry| entry.object).filter(|object| page::is_own(*object)));
    objects.extend(["minimum-pv", "maximum-pv"].into_iter().filter_map(|name| device.of_signal(signal, name)));
    let mut seen: BTreeSet<ObjectId> = signal.also.iter().copied().collect();
    objects.retain(|&object| {
        let readable = device.entry(object).is_none_or(|entry| entry.access.is_readable());
        device.may_have(object) && readable && seen.insert(object)
    });
    objects
}

/// The manufacturer's objects that belong to no channel.
fn own(device: &Device, channels: &[Vec<ObjectId>]) -> Vec<ObjectId> {
    let taken: BTreeSet<ObjectId> = channels.iter().flatten().copied().collect();
    let values = device.instrument.signals.iter().flat_map(|signal| signal.also.iter().copied());
    let startup = communication(device).into_iter();
    let dates = [page::CALIBRATED, page::PRODUCED].into_iter().filter_map(|parts| page::date_objects(device, parts));
    let taken: BTreeSet<ObjectId> = taken.into_iter().chain(values).chain(startup).chain(dates.flatten()).collect();
    let entries = device.model().into_iter().flat_map(|model| model.dictionary.iter());
    let entries = entries.filter(|entry| page::is_own(entry.object) && entry.access.is_readable());
    let entries = entries.filter(|entry| !entry.name.ends_with("-entries") && !taken.contains(&entry.object));
    entries.map(|entry| entry.object).collect()
}

/// Start and end of the measuring range of a signal.
fn span(device: &Device, signal: &Signal) -> [ObjectId; 2] {
    let described = device.model().map_or(&[][..], |model| &model.description.signals);
    let entry = described.iter().find(|entry| entry.name == signal.name);
    let start = entry.and_then(|entry| entry.span_start).unwrap_or_else(|| device.in_family(signal, 0x148));
    let end = entry.and_then(|entry| entry.span_end).unwrap_or_else(|| device.in_family(signal, 0x149));
    [start, end]
}

/// The present values, `None` where the device refuses one.
fn samples(master: &mut Master<'_>, device: &Device) -> Result<Vec<Option<Sample>>, Failure> {
    if device.instrument.signals.is_empty() {
        return Ok(Vec::new());
    }
    let targets = targets(&device.instrument, &[], &mut 0)?;
    let asked = targets.iter().flat_map(requests).collect();
    let mut answers = master.transfer(asked, &mut |_| {})?.into_iter();
    let mut samples = Vec::new();
    for target in targets {
        let Some(value) = answers.next() else { break };
        let status = if target.status.is_some() { answers.next() } else { None };
        samples.push(match sample(&target, value, status) {
            Ok(sample) => Some(sample),
            Err(error) => match Failure::from(error) {
                failure if failure.kind() == crate::tasks::Kind::NoAnswer => return Err(failure),
                _ => None,
            },
        });
    }
    Ok(samples)
}

/// The NMT state, where a heartbeat tells it soon. Guarding could tell it, too, but another master that guards would miss
/// a toggle of the answer.
fn state(
    master: &mut Master<'_>,
    device: &Device,
    values: &BTreeMap<ObjectId, Value>,
) -> Result<Option<NmtState>, Failure> {
    let period = values.get(&HEARTBEAT).and_then(Value::as_u64).map(Duration::from_millis);
    match period.filter(|period| !period.is_zero() && *period <= PATIENCE) {
        Some(period) => Ok(state::by_heartbeat(master, device.instrument.id, period)?),
        None => Ok(None),
    }
}

/// How it is noticed that the device is gone: heartbeat or node guarding, of which CiA 301 allows one.
fn monitoring(values: &BTreeMap<ObjectId, Value>) -> String {
    let number = |object: ObjectId| values.get(&object).and_then(Value::as_u64).unwrap_or(0);
    let (heartbeat, guard, life) = (number(HEARTBEAT), number(GUARD_TIME), number(LIFE_TIME));
    match (heartbeat, guard * life) {
        (0, 0) => "none".to_owned(),
        (0, life) => format!("node guarding every {guard} ms, life time {life} ms"),
        (heartbeat, 0) => format!("heartbeat every {heartbeat} ms"),
        (heartbeat, _) => format!("heartbeat every {heartbeat} ms and node guarding, of which CiA 301 allows one"),
    }
}

/// What a code of 61A0h means, for the page.
pub(super) fn filter_text(device: &Device, signal: &Signal, code: u64) -> String {
    filter::meaning(device, signal, code)
}
