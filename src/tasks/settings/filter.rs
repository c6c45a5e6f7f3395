//! The filter of a signal: type (61A0h), constant (61A1h), and the damping that some devices make a constant
//! of (MH-4 2023h).

use super::Device;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::tasks::{Failure, Kind};
use std::time::Duration;

/// A filter as it is reported.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilterReport {
    /// The filter, read from the device.
    pub filter: FilterOf,
    /// Whether 61A1h shows the new damping; `None` if no damping was set.
    pub damping_shown: Option<bool>,
}

/// The filter of a signal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilterOf {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `ch1` …
    pub signal: String,
    /// 61A0h, where the device tells it.
    pub code: Option<u64>,
    /// What the code means on this device.
    pub kind: String,
    /// 61A1h, where the device tells it.
    pub constant: Option<u64>,
}

/// The types of CiA 404 that can be asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FilterType {
    /// 0.
    None,
    /// 1.
    Moving,
    /// 2.
    Repeating,
}

/// What is to be set; what is `None` stays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Wanted {
    /// 61A0h.
    pub kind: Option<FilterType>,
    /// 61A1h.
    pub constant: Option<u16>,
    /// Time within which the output follows a step: the device works out the constant.
    pub damping: Option<Duration>,
}

/// A filter that was set.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FilterChange {
    /// The filter before.
    pub before: FilterOf,
    /// The filter now, read back.
    pub now: FilterOf,
    /// Whether 61A1h showed the damping; it cannot be read itself. `None` where none was asked for.
    pub damping_shown: Option<bool>,
}

impl FilterType {
    fn code(self) -> u8 {
        match self {
            FilterType::None => 0,
            FilterType::Moving => 1,
            FilterType::Repeating => 2,
        }
    }

    /// How the meaning of its code begins.
    fn word(self) -> &'static str {
        match self {
            FilterType::None => "none",
            FilterType::Moving => "moving",
            FilterType::Repeating => "repeating",
        }
    }
}

fn kind_object(signal: &Signal) -> ObjectId {
    ObjectId::new(0x61a0, signal.channel)
}

fn constant_object(signal: &Signal) -> ObjectId {
    ObjectId::new(0x61a1, signal.channel)
}

/// What a code of 61A0h means: by the device's description, else by CiA 404.
pub fn meaning(device: &Device, signal: &Signal, code: u64) -> String {
    let described = device.described(kind_object(signal)).and_then(|entry| entry.meaning(code));
    described.map_or_else(
        || match code {
            0 => "none".to_owned(),
            1 => "moving average".to_owned(),
            2 => "repeating average".to_owned(),
            3 => "Bessel low-pass".to_owned(),
            4 => "Butterworth low-pass".to_owned(),
            100.. => format!("the manufacturer's ({code})"),
            _ => format!("unknown ({code})"),
        },
        str::to_owned,
    )
}

fn has_filter(device: &Device, signal: &Signal) -> bool {
    device.may_have(kind_object(signal)) || device.may_have(constant_object(signal))
}

/// The filters of the signals asked for.
///
/// # Errors
/// Signals that the device has not, devices without filter, silence.
pub fn show(master: &mut Master<'_>, device: &Device, signal: Option<&str>) -> Result<Vec<FilterOf>, Failure> {
    let signals: Vec<&Signal> = match signal {
        Some(name) => vec![device.signal(Some(name))?],
        None => device.instrument.signals.iter().collect(),
    };
    let mut filters = Vec::new();
    for signal in signals.into_iter().filter(|signal| has_filter(device, signal)) {
        filters.extend(filter_of(master, device, signal)?);
    }
    if filters.is_empty() {
        let message = format!("{} has no filter (61A0h, 61A1h)", signal.unwrap_or("it"));
        return Err(Failure::of_node(Kind::Unexpected, device.node(), message));
    }
    Ok(filters)
}

fn filter_of(master: &mut Master<'_>, device: &Device, signal: &Signal) -> Result<Option<FilterOf>, Failure> {
    let values = device.read_each(master, &[kind_object(signal), constant_object(signal)])?;
    let [code, constant] = [0, 1].map(|at| values.get(at).and_then(Option::as_ref).and_then(Value::as_u64));
    let kind = code.map(|code| meaning(device, signal, code)).unwrap_or_default();
    let told = code.is_some() || constant.is_some();
    Ok(told.then(|| FilterOf { node: device.node(), signal: signal.name.clone(), code, kind, constant }))
}

/// Sets the filter of a signal, or of the only one that has one, and reads it back.
///
/// # Errors
/// What the device does not take by its description, refusals, silence, and a device that keeps something
/// else.
pub fn set(
    master: &mut Master<'_>,
    device: &Device,
    signal: Option<&str>,
    wanted: Wanted,
) -> Result<FilterChange, Failure> {
    let mut with_filter = device.instrument.signals.iter().filter(|signal| has_filter(device, signal));
    let signal = match (signal, with_filter.next(), with_filter.next()) {
        (None, Some(only), None) => only,
        (name, ..) => device.signal(name)?,
    };
    let node = device.node();
    let usage = |message: String| Failure::of_node(Kind::Usage, node, message);
    let none = || Failure::of_node(Kind::Unexpected, node, format!("{} has no filter (61A0h, 61A1h)", signal.name));
    if !has_filter(device, signal) {
        return Err(none());
    }
    // Everything that can be wrong is found before the first write.
    let kind = wanted.kind.map(|kind| code_of(device, signal, kind)).transpose()?;
    let constant = constant_object(signal);
    if let (Some(number), Some(entry)) = (wanted.constant, device.described(constant))
        && !entry.allows(f64::from(number))
    {
        return Err(usage(format!("{} takes no filter constant {number}", signal.name)));
    }
    let before = filter_of(master, device, signal)?.ok_or_else(none)?;
    let damping = match wanted.damping {
        None => None,
        Some(damping) => {
            let Some(object) = device.of_signal(signal, "damping") else {
                return Err(usage(format!("no object of {} is known to take a damping", signal.name))
                    .hint("set the steps of the filter: --constant N"));
            };
            if kind.map(u64::from).or(before.code) != Some(1) {
                let now = if kind.is_some() { "another filter was asked for" } else { before.kind.as_str() };
                let message = format!("{}: a damping sets the moving average ({now})", signal.name);
                return Err(usage(message).hint("add --type moving"));
            }
            let milliseconds = u16::try_from(damping.as_millis());
            let milliseconds = milliseconds.map_err(|_| usage("a damping is at most 65535 ms".to_owned()))?;
            Some((object, milliseconds))
        }
    };
    if let Some(code) = kind {
        device.set(master, kind_object(signal), &[code])?;
    }
    if let Some(number) = wanted.constant {
        let width = device.data_type(constant).width().unwrap_or(2).min(4);
        device.set(master, constant, &u32::from(number).to_le_bytes()[..width])?;
    }
    if let Some((object, milliseconds)) = damping {
        device.write(master, object, &milliseconds.to_le_bytes())?;
    }
    let now = filter_of(master, device, signal)?.ok_or_else(none)?;
    let damping_shown = damping.map(|_| now.constant != before.constant);
    Ok(FilterChange { before, now, damping_shown })
}

/// The code of a type on this device. A code that means something else there is not taken for it: the
/// MC1609's 0 may be a filter.
fn code_of(device: &Device, signal: &Signal, kind: FilterType) -> Result<u8, Failure> {
    let code = kind.code();
    let Some(entry) = device.described(kind_object(signal)).filter(|entry| !entry.values.is_empty()) else {
        return Ok(code);
    };
    if entry.meaning(code.into()).is_some_and(|meaning| meaning.starts_with(kind.word())) {
        return Ok(code);
    }
    let known: Vec<String> = entry.values.iter().map(|(code, meaning)| format!("{meaning} ({code})")).collect();
    let message = format!("{} has no filter type \"{}\", but {}", signal.name, kind.word(), known.join(", "));
    let failure = Failure::of_node(Kind::Usage, device.node(), message);
    Err(if entry.doubt.is_empty() { failure } else { failure.hint(format!("61A0h: {}", entry.doubt)) })
}
