//! The TOML file of a bench.

use super::{BenchError, UNCONFIGURED, check_rate, read};
use crate::bus::memory::Clock;
use crate::canopen::id::{NodeId, parse_u32};
use crate::canopen::object::ObjectId;
use crate::device::catalog::{self, Model};
use crate::device::eds;
use crate::device::scalar::Scalar;
use crate::device::unit::Unit;
use crate::sim::data::{Form, SimChannel};
use crate::sim::model::{Direction, Overload};
use crate::sim::setup::{OfflineAfter, Setup, SimulatedFaults};
use serde::{Deserialize, Deserializer};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

fn yes() -> bool {
    true
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct BenchFile {
    #[serde(default)]
    pub(super) clock: ClockName,
    pub(super) bit_rate: Option<u32>,
    #[serde(default = "yes")]
    pub(super) retime: bool,
    #[serde(default)]
    pub(super) seed: u64,
    pub(super) record: Option<PathBuf>,
    pub(super) state: Option<PathBuf>,
    #[serde(default)]
    pub(super) device: Vec<DeviceEntry>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(super) enum ClockName {
    #[default]
    Real,
    Virtual,
}

impl From<ClockName> for Clock {
    fn from(name: ClockName) -> Clock {
        match name {
            ClockName::Real => Clock::Real,
            ClockName::Virtual => Clock::Virtual,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DeviceEntry {
    pub(super) kind: String,
    pub(super) node: Option<NodeId>,
    #[serde(default)]
    pub(super) duplicate_id: bool,
    bit_rate: Option<u32>,
    #[serde(default, deserialize_with = "duration")]
    latency: Duration,
    #[serde(default)]
    answers_only: Vec<ObjectId>,
    #[serde(default)]
    offline_after: Vec<OfflineName>,
    connected: Option<Connected>,
    #[serde(default)]
    lss: LssEntry,
    serial: Option<u32>,
    #[serde(default)]
    start: bool,
    #[serde(default)]
    set: BTreeMap<ObjectId, Scalar>,
    #[serde(default)]
    channel: Vec<ChannelEntry>,
    #[serde(default)]
    overload: Vec<OverloadEntry>,
    /// Constant values of the one-line form: `pressure=0bar`.
    #[serde(skip)]
    constant: Vec<String>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(deny_unknown_fields)]
struct Connected {
    #[serde(deserialize_with = "duration")]
    from: Duration,
    #[serde(default = "no_end", deserialize_with = "duration")]
    until: Duration,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum OfflineName {
    Reset,
    Activate,
}

impl From<OfflineName> for OfflineAfter {
    fn from(name: OfflineName) -> OfflineAfter {
        match name {
            OfflineName::Reset => OfflineAfter::Reset,
            OfflineName::Activate => OfflineAfter::Activate,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LssEntry {
    #[serde(default)]
    lose: Vec<u8>,
    #[serde(default)]
    late: BTreeMap<Service, Late>,
    #[serde(default)]
    refuse: BTreeMap<Service, u8>,
    #[serde(default)]
    endless_fastscan: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
struct Service(u8);

impl TryFrom<String> for Service {
    type Error = String;

    fn try_from(text: String) -> Result<Service, String> {
        let number = parse_u32(&text).and_then(|number| u8::try_from(number).ok());
        number.map(Service).ok_or_else(|| format!("\"{text}\" is not a service (\"0x17\")"))
    }
}

#[derive(Clone, Copy, Deserialize)]
struct Late(#[serde(deserialize_with = "duration")] Duration);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelEntry {
    channel: u8,
    base: Option<f64>,
    amplitude: Option<f64>,
    period_s: Option<f64>,
    noise: Option<f64>,
    start: Option<f64>,
    end: Option<f64>,
    form: Option<FormName>,
    csv: Option<PathBuf>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum FormName {
    Sine,
    Ramp,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OverloadEntry {
    channel: u8,
    #[serde(deserialize_with = "duration")]
    from: Duration,
    #[serde(default = "no_end", deserialize_with = "duration")]
    until: Duration,
    direction: DirectionName,
}

fn no_end() -> Duration {
    Duration::MAX
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DirectionName {
    High,
    Low,
}

fn duration<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
    humantime::parse_duration(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
}

impl DeviceEntry {
    pub(super) fn new(kind: &str, node: Option<NodeId>, constant: Vec<String>) -> DeviceEntry {
        DeviceEntry { kind: kind.to_owned(), node, constant, ..DeviceEntry::default() }
    }

    /// Whether the device is connected only for a part of the time.
    pub(super) fn is_partly_connected(&self) -> bool {
        self.connected.is_some()
    }

    /// The short form: `mh4@5`.
    pub(super) fn name(&self) -> String {
        match self.node {
            Some(node) => format!("{}@{node}", self.kind),
            None => format!("{}@{UNCONFIGURED}", self.kind),
        }
    }

    /// Converts the entry to a setup. `before` is the number of previous devices of this kind. It is added to the
    /// serial number, so that each device has another one.
    pub(super) fn setup(&self, seed: u64, before: u32, folder: &Path) -> Result<Setup, BenchError> {
        let mut setup = Setup::new(self.model(folder)?, self.node.unwrap_or(NodeId::MIN));
        setup.node = self.node;
        let named = |error| BenchError::Usage(format!("{}: {error}", self.name()));
        setup.bit_rate = self.bit_rate.map(check_rate).transpose().map_err(named)?;
        setup.oddities = SimulatedFaults {
            latency: self.latency,
            lose: self.lss.lose.clone(),
            late: self.lss.late.iter().map(|(service, late)| (service.0, late.0)).collect(),
            refuse: self.lss.refuse.iter().map(|(service, code)| (service.0, *code)).collect(),
            endless_fastscan: self.lss.endless_fastscan,
            answers_only: self.answers_only.clone(),
            offline_after: self.offline_after.iter().map(|name| OfflineAfter::from(*name)).collect(),
            connected: self.connected.map(|connected| connected.from..connected.until),
        };
        setup.serial = self.serial.unwrap_or(setup.serial.wrapping_add(before));
        setup.start = self.start;
        setup.set = self.set.iter().map(|(object, value)| (*object, value.clone())).collect();
        setup.seed = seed;
        for changed in &self.channel {
            changed.apply(self.find(&mut setup.channels, changed.channel)?, folder)?;
        }
        for text in &self.constant {
            self.set_constant(&mut setup, text).ok_or_else(|| {
                let signals: Vec<&str> = setup.model.description.signals.iter().map(|it| it.name.as_str()).collect();
                let message = format!("\"{text}\" is not SIGNAL=VALUE with a unit of the signal");
                BenchError::Usage(format!("{}: {message} ({})", self.name(), signals.join(", ")))
            })?;
        }
        for overload in &self.overload {
            self.find(&mut setup.channels, overload.channel)?;
            if overload.from >= overload.until {
                return Err(BenchError::Usage(format!("{}: an overload that ends before it begins", self.name())));
            }
            let direction = match overload.direction {
                DirectionName::High => Direction::High,
                DirectionName::Low => Direction::Low,
            };
            let scripted = Overload { from: overload.from, until: overload.until, direction };
            setup.overloads.push((overload.channel, scripted));
        }
        Ok(setup)
    }

    /// Sets a signal to a constant value: `pressure=0bar`. Without a unit, the unit of the simulator is used.
    fn set_constant(&self, setup: &mut Setup, text: &str) -> Option<()> {
        let (name, value) = text.split_once('=')?;
        let signal = setup.model.description.signals.iter().find(|signal| signal.name == name)?;
        let channel = setup.channels.iter_mut().find(|channel| channel.channel == signal.channel)?;
        channel.hold(value_in(value, Unit(channel.unit))?);
        Some(())
    }

    fn find<'a>(&self, channels: &'a mut [SimChannel], number: u8) -> Result<&'a mut SimChannel, BenchError> {
        channels
            .iter_mut()
            .find(|channel| channel.channel == number)
            .ok_or_else(|| BenchError::Usage(format!("{} has no channel {number}", self.name())))
    }

    fn model(&self, folder: &Path) -> Result<Arc<Model>, BenchError> {
        let has_extension =
            |kind: &str| Path::new(&self.kind).extension().is_some_and(|it| it.eq_ignore_ascii_case(kind));
        let path = folder.join(&self.kind);
        if has_extension("eds") || has_extension("dcf") {
            let bytes = std::fs::read(&path).map_err(|source| BenchError::Io { path: path.clone(), source })?;
            let eds = eds::read(&bytes).map_err(|error| BenchError::Usage(format!("{}: {error}", path.display())))?;
            return Ok(Arc::new(Model::from_eds(&eds)));
        }
        if has_extension("toml") {
            let model = Model::from_toml(&read(&path)?);
            return model.map(Arc::new).map_err(|error| BenchError::Usage(error.in_file(&path.display().to_string())));
        }
        catalog::by_name(&self.kind).ok_or_else(|| {
            let known: Vec<&str> = catalog::names().collect();
            BenchError::Usage(format!("no device \"{}\" ({}, FILE.toml or FILE.eds)", self.kind, known.join(", ")))
        })
    }
}

/// Parses a value and converts it to the unit `own`: `5.2bar`, or a number in this unit.
pub(in crate::sim) fn value_in(text: &str, own: Unit) -> Option<f64> {
    let (number, unit) =
        text.split_at(text.find(|letter: char| !"+-.0123456789".contains(letter)).unwrap_or(text.len()));
    let unit = if unit.is_empty() { own } else { Unit::from_symbol(unit.trim())?.beside(own) };
    unit.convert(number.parse().ok()?, own)
}

/// Reads the points of a CSV file: seconds, value. A first line that is not a number is a heading.
fn points(path: &Path) -> Result<Form, BenchError> {
    let mut points: Vec<(f64, f64)> = Vec::new();
    for (index, line) in read(path)?.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
        let pair = line
            .split_once([',', ';'])
            .and_then(|(at, value)| Some((at.trim().parse().ok()?, value.trim().parse().ok()?)));
        match pair {
            Some((at, value)) if points.last().is_none_or(|(before, _)| *before < at) && f64::is_finite(value) => {
                points.push((at, value));
            }
            None if index == 0 => {}
            _ => {
                let line = index + 1;
                let message = "expected SECONDS,VALUE, with a later time than in the previous line";
                return Err(BenchError::Usage(format!("{}:{line}: {message}", path.display())));
            }
        }
    }
    match points.is_empty() {
        true => Err(BenchError::Usage(format!("{}: no values", path.display()))),
        false => Ok(Form::Points(points.into())),
    }
}

impl ChannelEntry {
    fn apply(&self, channel: &mut SimChannel, folder: &Path) -> Result<(), BenchError> {
        channel.form = match (&self.csv, self.form) {
            (Some(path), _) => points(&folder.join(path))?,
            (None, Some(FormName::Ramp)) => Form::Ramp,
            (None, Some(FormName::Sine) | None) => Form::Sine,
        };
        let SimChannel { base, amplitude, period_s, noise, start, end, .. } = channel;
        for (given, value) in [
            (self.base, base),
            (self.amplitude, amplitude),
            (self.period_s, period_s),
            (self.noise, noise),
            (self.start, start),
            (self.end, end),
        ] {
            *value = given.unwrap_or(*value);
        }
        Ok(())
    }
}
