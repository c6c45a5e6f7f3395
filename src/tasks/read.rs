//! Reads measured values by SDO, once.

mod failure;

pub use failure::ReadFailure;

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::unit::Unit;
use crate::master::{Answer, Error, Master, Request, SdoError, SdoFailure};
use crate::measure::decode::{Reading, Wanted, source};
use crate::measure::layout::Signal;
use crate::measure::sample::{Sample, Source};
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::survey_each;
use crate::tasks::{Failure, Kind};

/// One thing to be read of a node: how, and what it is.
#[derive(Clone, Debug)]
pub struct Target {
    /// What the sample is of.
    pub source: Source,
    /// The unit, for conversion.
    pub unit: Option<Unit>,
    /// The object read.
    pub object: ObjectId,
    /// 6150h, read along.
    pub status: Option<ObjectId>,
    /// How the bytes become a sample.
    pub reading: Reading,
}

/// The targets of an instrument: what was asked for, or every signal.
///
/// # Errors
/// A signal that the device does not have, with the ones it has.
pub fn targets(instrument: &Node, wanted: &[Wanted], number: &mut usize) -> Result<Vec<Target>, Failure> {
    let all: Vec<Wanted> = instrument.signals.iter().map(|signal| Wanted::Signal(signal.name.clone())).collect();
    let wanted = if wanted.is_empty() { &all } else { wanted };
    if wanted.is_empty() {
        return Err(Failure::of_node(Kind::Unexpected, instrument.id, "it has no measured value of CiA 404")
            .hint(format!("read an object as it is: cangauge sdo read {} 0x1000", instrument.id)));
    }
    let mut take = || {
        *number += 1;
        *number - 1
    };
    wanted
        .iter()
        .map(|item| instrument.wanted(item))
        .map(|item| {
            Ok(match &item {
                Wanted::Signal(name) => {
                    let signal = find(instrument, name)?;
                    let (object, data_type) = signal.value;
                    Target {
                        source: source(instrument.id, name, Some(signal)),
                        unit: signal.unit,
                        object,
                        status: signal.status,
                        reading: Reading::of_signal(signal, data_type, take()),
                    }
                }
                Wanted::Status(name) => {
                    let object = find(instrument, name)?.status.ok_or_else(|| {
                        Failure::of_node(Kind::Usage, instrument.id, format!("{name} has no status object"))
                    })?;
                    plain(instrument, object, &format!("{name}.status"), take())
                }
                Wanted::Object(object, Some(stated)) => {
                    typed(instrument, *object, &item.name(), Reading::plain(Some(*stated), take()))
                }
                Wanted::Object(object, None) => plain(instrument, *object, &item.name(), take()),
            })
        })
        .collect()
}

/// The target for an object by its address.
fn plain(instrument: &Node, object: ObjectId, name: &str, number: usize) -> Target {
    let layout = instrument.layout();
    let reading = Reading::of_object(layout, object, layout.data_type(object), number);
    let signal = layout.signal_of(object).filter(|signal| !signal.is_value(object));
    Target {
        source: source(instrument.id, name, signal),
        unit: signal.and_then(|signal| signal.unit),
        ..typed(instrument, object, name, reading)
    }
}

fn typed(instrument: &Node, object: ObjectId, name: &str, reading: Reading) -> Target {
    Target { source: source(instrument.id, name, None), unit: None, object, status: None, reading }
}

pub(super) fn find<'a>(instrument: &'a Node, name: &str) -> Result<&'a Signal, Failure> {
    instrument.signals.iter().find(|signal| signal.name == name).ok_or_else(|| {
        let names: Vec<&str> = instrument.signals.iter().map(|signal| signal.name.as_str()).collect();
        let message = format!("it has no signal \"{name}\"");
        let failure = Failure::of_node(Kind::Usage, instrument.id, message);
        if names.is_empty() { failure } else { failure.hint(format!("it has: {}", names.join(", "))) }
    })
}

/// A sample out of the answers to a target's reads.
///
/// # Errors
/// The value's own failure. A status that the device refuses is a device without status.
pub fn sample(
    target: &Target,
    value: Result<Answer, SdoError>,
    status: Option<Result<Answer, SdoError>>,
) -> Result<Sample, SdoError> {
    let node = target.source.node;
    let answer = value?;
    let not_a_number = || SdoError {
        node,
        object: target.object,
        operation: crate::master::Operation::Read,
        failure: SdoFailure::NotANumber,
    };
    let Some(data_type) = target.reading.data_type() else {
        // Bytes without a stated type stay bytes.
        let bytes = answer.uploaded.as_ref().map(|uploaded| uploaded.bytes.as_slice()).unwrap_or_default();
        let sample = target.reading.sample(answer.at, bytes, None).filter(|_| bytes.len() <= 8);
        return sample.ok_or_else(not_a_number);
    };
    let (number, _) = answer.value(node, target.object, Some(data_type))?;
    let bits = match status {
        None | Some(Err(SdoError { failure: SdoFailure::Refused(_), .. })) => None,
        Some(Err(error)) => return Err(error),
        Some(Ok(answer)) => {
            let object = target.status.unwrap_or(target.object);
            answer.value(node, object, Some(DataType::Unsigned(1)))?.0.as_u64()
        }
    };
    let bytes = wire_bytes(&number, data_type);
    target.reading.sample(answer.at, &bytes, bits).ok_or_else(not_a_number)
}

/// The value's bytes in the width of its type: an answer may have had more or fewer.
fn wire_bytes(value: &Value, data_type: DataType) -> Vec<u8> {
    let width = data_type.width().unwrap_or(8).min(8);
    match value {
        Value::Bool(bit) => vec![u8::from(*bit)],
        Value::Unsigned(number) => number.to_le_bytes()[..width].to_vec(),
        Value::Integer(number) => number.to_le_bytes()[..width].to_vec(),
        Value::Real32(number) => number.to_le_bytes().to_vec(),
        Value::Real64(number) => number.to_le_bytes().to_vec(),
        Value::Text(_) | Value::Bytes(_) | Value::TimeOfDay(_) | Value::TimeDifference(_) => Vec::new(),
    }
}

/// The requests for a target: its value, and its status.
pub fn requests(target: &Target) -> Vec<Request> {
    let objects = [Some(target.object), target.status];
    objects.into_iter().flatten().map(|object| Request::read(target.source.node, object)).collect()
}

/// What was read of one node.
pub type Readings = Vec<(Target, Sample)>;

/// Reads measured values of several nodes, side by side. One result a node: its targets with their
/// samples, or why there is none.
///
/// # Errors
/// What stops everything.
pub fn read(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    wanted: &[Wanted],
    overrides: &Overrides,
) -> Result<Vec<Result<Readings, Failure>>, Error> {
    master.listen_to(nodes)?;
    let planned: Vec<Result<Vec<Target>, Failure>> =
        survey_each(master, nodes, overrides)?.into_iter().map(|node| targets(&node?, wanted, &mut 0)).collect();
    let asked = planned.iter().flatten().flatten().flat_map(requests).collect();
    let mut answers = master.transfer(asked, &mut |_| {})?.into_iter();
    Ok(planned.into_iter().map(|targets| readings(targets?, &mut answers)).collect())
}

/// The samples of one node's targets, out of the answers to [`requests`]. All of its answers are taken,
/// whatever the first ones are: the next node's come behind them.
fn readings(
    targets: Vec<Target>,
    answers: &mut dyn Iterator<Item = Result<Answer, SdoError>>,
) -> Result<Readings, Failure> {
    let answered: Vec<_> = targets
        .into_iter()
        .filter_map(|target| {
            let value = answers.next()?;
            let status = if target.status.is_some() { answers.next() } else { None };
            Some((target, value, status))
        })
        .collect();
    answered
        .into_iter()
        .map(|(target, value, status)| {
            let sample = sample(&target, value, status)?;
            Ok((target, sample))
        })
        .collect()
}
