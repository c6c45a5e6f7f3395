//! Reads measured values by SDO.

mod failure;

pub use failure::ReadFailure;

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{FitError, Note};
use crate::canopen::value::{DataType, Value};
use crate::device::unit::Unit;
use crate::master::{Answer, Error, Master, SdoError, SdoFailure};
use crate::measure::decode::{Reading, Wanted, source};
use crate::measure::layout::Signal;
use crate::measure::sample::{Doubt, Number, Sample, Source, Status};
use crate::node::Node;
use crate::node::Overrides;
use crate::node::read::Reader;
use crate::node::survey::survey_each;
use crate::tasks::Failure;

/// A value to read.
#[derive(Clone, Debug)]
pub struct Target {
    /// The source of the samples.
    pub source: Source,
    /// The unit, for conversion.
    pub unit: Option<Unit>,
    /// The object.
    pub object: ObjectId,
    /// The status object (6150h), which is also read.
    pub status: Option<ObjectId>,
    /// The type of the status.
    pub status_type: DataType,
    /// The bits of the error register (1001h) that mean an overload, if the signal has no status object. The register
    /// is also read.
    pub overload_register: Option<u8>,
    /// How the bytes are converted to a sample.
    pub reading: Reading,
}

impl Target {
    /// Returns the object that is read in addition to the value: the status, or the error register.
    pub fn second_object(&self) -> Option<ObjectId> {
        self.status.or(self.overload_register.map(|_| Node::ERROR_REGISTER))
    }

    /// Whether an answer with the error register reports an overload.
    pub fn reports_overload(&self, register: Option<&Result<Answer, SdoError>>) -> bool {
        let Some((Ok(answer), mask)) = register.zip(self.overload_register) else { return false };
        let value = answer.value(self.source.node, Node::ERROR_REGISTER, Some(DataType::Unsigned(1)));
        value.ok().and_then(|(bits, _)| bits.as_u64()).is_some_and(|bits| bits & u64::from(mask) == u64::from(mask))
    }

    /// Returns the unit of this target and the unit to convert to. If the target is a temperature, `C` and `F` are
    /// degrees.
    ///
    /// # Errors
    /// The units do not convert.
    pub fn unit_for(&self, to: Unit) -> Result<(Unit, Unit), Failure> {
        let units = self.unit.map(|from| (from, to.beside(from))).filter(|(from, to)| from.convert(0.0, *to).is_some());
        units.ok_or_else(|| {
            let signal = self.source.signal.to_string();
            Failure::at(self.source.node, ReadFailure::NotConvertible { signal, from: self.unit, to })
        })
    }

    /// Converts a value to another unit. Returns the value and this unit.
    ///
    /// # Errors
    /// The units do not convert.
    pub fn convert(&self, value: Option<Number>, to: Unit) -> Result<(Option<f64>, Unit), Failure> {
        let (from, to) = self.unit_for(to)?;
        Ok((value.and_then(|value| from.convert(value.as_f64(), to)), to))
    }
}

/// Returns the requested targets of a node, or the targets of all its signals.
///
/// # Errors
/// The device does not have a signal or status.
pub fn targets(node: &Node, wanted: &[Wanted], number: &mut usize) -> Result<Vec<Target>, Failure> {
    let all: Vec<Wanted> = node.signals.iter().map(|signal| Wanted::Signal(signal.name.clone())).collect();
    let wanted = if wanted.is_empty() { &all } else { wanted };
    if wanted.is_empty() {
        return Err(Failure::at(node.id, ReadFailure::NoMeasuredValue));
    }
    let mut next_number = || {
        *number += 1;
        *number - 1
    };
    wanted
        .iter()
        .map(|item| node.wanted(item))
        .map(|item| {
            Ok(match &item {
                Wanted::Signal(name) => {
                    let signal = find(node, name)?;
                    let (object, data_type) = signal.value_object;
                    let reading = Reading::of_signal(signal, data_type, next_number());
                    with_signal(node, signal, bare_target(node, object, name, reading))
                }
                Wanted::Status(name) => {
                    let no_status = || Failure::at(node.id, ReadFailure::NoStatus { signal: name.clone() });
                    let object = find(node, name)?.status.ok_or_else(no_status)?;
                    object_target(node, object, &format!("{name}.status"), next_number())
                }
                Wanted::Object(object, Some(stated)) => {
                    bare_target(node, *object, &item.name(), Reading::plain(Some(*stated), next_number()))
                }
                Wanted::Object(object, None) | Wanted::Named(_, object) => {
                    object_target(node, *object, &item.name(), next_number())
                }
            })
        })
        .collect()
}

/// Creates the target for an object.
fn object_target(node: &Node, object: ObjectId, name: &str, number: usize) -> Target {
    let layout = node.layout();
    let reading = Reading::of_object(layout, object, layout.data_type(object), number);
    let target = bare_target(node, object, name, reading);
    if let Some(signal) = layout.measured_signal(object) {
        return with_signal(node, signal, target);
    }
    let unit = layout.unit_of(object);
    Target { source: source(node.id, name, unit), unit, ..target }
}

/// Adds unit and status of a signal to the target for its process value.
fn with_signal(node: &Node, signal: &Signal, target: Target) -> Target {
    Target {
        source: source(node.id, &target.source.signal, signal.unit),
        unit: signal.unit,
        status: signal.status,
        status_type: status_type(node, signal.status),
        overload_register: node.overload_register().filter(|_| !signal.has_status()),
        ..target
    }
}

fn bare_target(node: &Node, object: ObjectId, name: &str, reading: Reading) -> Target {
    let (status, status_type, overload_register) = (None, U8, None);
    Target { source: source(node.id, name, None), unit: None, object, status, status_type, overload_register, reading }
}

const U8: DataType = DataType::Unsigned(1);

/// Returns the type of a status object: UNSIGNED8 (as 6150h), unless a description or an EDS states another type.
fn status_type(node: &Node, status: Option<ObjectId>) -> DataType {
    let stated = status.and_then(|object| node.layout().data_type(object));
    stated.filter(|data_type| matches!(data_type, DataType::Unsigned(_) | DataType::Integer(_))).unwrap_or(U8)
}

pub(super) fn find<'a>(node: &'a Node, name: &str) -> Result<&'a Signal, Failure> {
    node.signals.iter().find(|signal| signal.name == name).ok_or_else(|| {
        let available = node.names_like(name);
        Failure::at(node.id, ReadFailure::NoSignal { name: name.to_owned(), available })
    })
}

/// Converts the answers to the [`objects`] of a target to a sample.
///
/// # Errors
/// The value could not be read. If the device rejects the status object, it has no status; without a valid answer, the
/// status is unknown.
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
    let Some(data_type) = target.reading.data_type().filter(|data_type| data_type.is_number()) else {
        // Bytes without a known type stay bytes. A sample cannot contain a long text.
        let bytes = answer.uploaded.as_ref().map(|uploaded| uploaded.bytes.as_slice()).unwrap_or_default();
        let is_text = target.reading.data_type().is_some();
        let bytes = if is_text && bytes.len() > 8 { &[] } else { bytes };
        let sample = target.reading.sample(answer.at, bytes, None).filter(|_| bytes.len() <= 8);
        return sample.ok_or_else(not_a_number);
    };
    let (number, note) = answer.value(node, target.object, Some(data_type))?;
    if let Some(Note::Narrower { expected, found }) = note {
        // A part of a number is not a measured value.
        let failure = SdoFailure::Fit(FitError::Width { data_type, expected, found });
        return Err(SdoError { failure, ..not_a_number() });
    }
    let is_overload = target.reports_overload(status.as_ref());
    let second_type = if target.status.is_some() { target.status_type } else { U8 };
    let second = status.zip(target.second_object()).map(|(result, object)| {
        result.and_then(|answer| answer.value(node, object, Some(second_type))).map(|(value, _)| value.as_u64())
    });
    let (bits, is_unknown) = match second {
        None => (None, target.second_object().is_some()),
        Some(Err(SdoError { failure: SdoFailure::Refused(_), .. })) => (None, false),
        Some(Err(error @ SdoError { failure: SdoFailure::TwoDevices(_) | SdoFailure::NotWritten(_), .. })) => {
            return Err(error);
        }
        Some(Err(_)) => (None, true),
        Some(Ok(bits)) => (bits.filter(|_| target.status.is_some()), false),
    };
    let bytes = wire_bytes(&number, data_type);
    let mut sample = target.reading.sample(answer.at, &bytes, bits).ok_or_else(not_a_number)?;
    if is_overload {
        target.reading.report_overload(&mut sample, None);
    }
    if is_unknown {
        // Without the status, a marker in the value can only show an overload.
        sample.status = sample.status.filter(|&status| status != Status::Ok);
        sample.doubt = sample.doubt.or(Some(Doubt::UnknownStatus));
    }
    Ok(sample)
}

/// Encodes a value in the width of its type. The answer may have more or fewer bytes.
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

/// Returns the objects of a target: value, and status or error register.
pub fn objects(target: &Target) -> impl Iterator<Item = (NodeId, ObjectId)> + use<> {
    let node = target.source.node;
    [Some(target.object), target.second_object()].into_iter().flatten().map(move |object| (node, object))
}

/// The values of one node.
pub type Readings = Vec<(Target, Sample)>;

/// Reads measured values of several nodes in parallel. Each node has its own result.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn read(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    wanted: &[Wanted],
    overrides: &Overrides,
) -> Result<Vec<Result<Readings, Failure>>, Error> {
    master.listen_to(nodes)?;
    let planned: Vec<Result<Vec<Target>, Failure>> =
        survey_each(master, nodes, overrides)?.into_iter().map(|node| targets(&node?, wanted, &mut 0)).collect();
    let asked: Vec<_> = planned.iter().flatten().flatten().flat_map(objects).collect();
    let mut answers = Reader::new(master).read(&asked)?.into_iter();
    Ok(planned.into_iter().map(|targets| readings(targets?, &mut answers)).collect())
}

/// Converts the answers to the [`objects`] of one node to samples. Takes all answers of the node, even after an error,
/// because the answers of the next node follow.
fn readings(
    targets: Vec<Target>,
    answers: &mut dyn Iterator<Item = Result<Answer, SdoError>>,
) -> Result<Readings, Failure> {
    let answered: Vec<_> = targets
        .into_iter()
        .filter_map(|target| {
            let value = answers.next()?;
            let status = target.second_object().and_then(|_| answers.next());
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
