//! Data that only the simulator needs: the measured quantities of a device and facts that no manual contains.
//!
//! Some devices have a file in `models/`. A device without a file gets changing values from its description. So a new
//! device needs only a description.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::catalog::Model;
use crate::device::description::SignalEntry;
use serde::Deserialize;
use std::sync::OnceLock;

/// The name of a device and the text of its file, listed by the build script.
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/models.rs"));

/// Data that only the simulator needs.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimData {
    /// The sample time in microseconds; 1 ms if `None`.
    pub sample_us: Option<u32>,
    /// Whether a repeating average covers the samples since the last PDO, instead of 61A1h samples.
    #[serde(default)]
    pub mean_until_pdo: bool,
    /// Whether a new node-ID resets the COB-IDs of EMCY and TPDOs to the predefined connection set.
    #[serde(default)]
    pub cob_ids_follow_node_id: bool,
    /// The distance from the measuring range at which an overload begins, in percent of the range.
    #[serde(default)]
    pub overload_percent: f64,
    /// The emergency code of an overload, if the device sends one.
    pub overload_emcy: Option<u16>,
    /// The services of the LSS slave.
    #[serde(default)]
    pub lss: SimLss,
    /// The measured quantities, one per signal.
    #[serde(default, rename = "channel")]
    pub channels: Vec<SimChannel>,
}

/// The services of the LSS slave of a simulated device.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimLss {
    /// The services, by the command specifier of the request; an empty list means all of CiA 305.
    #[serde(default)]
    pub services: Vec<u8>,
    /// The NMT states in which the device answers LSS; an empty list means all.
    #[serde(default)]
    pub states: Vec<SimState>,
    /// Whether the answer to the selective switch contains the mode (44h 01h).
    #[serde(default)]
    pub reports_mode: bool,
}

/// An NMT state of a simulated device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum SimState {
    /// STOPPED.
    Stopped,
    /// PRE-OPERATIONAL.
    PreOperational,
    /// OPERATIONAL.
    Operational,
}

/// The waveform of a simulated quantity.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum Form {
    /// A sine; with amplitude 0, a constant value.
    #[default]
    Sine,
    /// From the lowest to the highest value in one period, again and again.
    Ramp,
    /// Lines between these points: seconds, value. The last value stays.
    Points(std::sync::Arc<[(f64, f64)]>),
}

/// A simulated quantity: a slow sine with noise.
#[derive(Clone, Debug, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SimChannel {
    /// The CiA 404 channel.
    pub channel: u8,
    /// Unit code of `base`, `amplitude`, `noise`, `start` and `end` (6131h).
    pub unit: u32,
    /// The mean value.
    pub base: f64,
    /// The amplitude of the sine.
    pub amplitude: f64,
    /// The period of the sine in seconds.
    pub period_s: f64,
    /// The noise is within this distance of the sine.
    pub noise: f64,
    /// Start of the measuring range.
    pub start: f64,
    /// End of the measuring range.
    pub end: f64,
    /// The field value (x100h) at the start and at the end of the range; 0 and 10000 if `None` (CiA 404).
    pub field: Option<[f64; 2]>,
    /// The waveform.
    #[serde(skip)]
    pub form: Form,
}

impl SimChannel {
    /// Sets the quantity to a constant value.
    pub fn hold(&mut self, value: f64) {
        (self.base, self.amplitude, self.noise, self.form) = (value, 0.0, 0.0, Form::Sine);
    }
}

impl SimData {
    /// Returns the data of a device: from its file, else from its description.
    pub fn of(model: &Model) -> SimData {
        static PARSED: [OnceLock<SimData>; FILES.len()] = [const { OnceLock::new() }; FILES.len()];
        let name = &model.description.name;
        match FILES.iter().zip(&PARSED).find(|((file, _), _)| file == name) {
            Some(((_, text), parsed)) => parsed.get_or_init(|| toml::from_str(text).unwrap_or_default()).clone(),
            None => SimData::generic(model),
        }
    }

    /// Quantities in the middle of the measuring ranges in the description, else between 0 and 100.
    fn generic(model: &Model) -> SimData {
        // A value with a default is constant: the simulator returns the default.
        let is_changing =
            |signal: &&SignalEntry| model.dictionary.get(signal.value).is_some_and(|entry| entry.default.is_none());
        let channels = model.description.signals.iter().filter(is_changing).map(|signal| {
            let end = |object: Option<ObjectId>| number(model, object?, signal.digits);
            let range = end(signal.span_start).zip(end(signal.span_end)).filter(|(start, end)| start < end);
            let (start, end) = range.unwrap_or((0.0, 100.0));
            let coded = signal.unit.and_then(|unit| number(model, unit, None)).unwrap_or(0.0);
            let length = end - start;
            SimChannel {
                channel: signal.channel,
                unit: signal.fixed_unit.map_or_else(|| format!("{coded:.0}").parse().unwrap_or(0), |unit| unit.0),
                base: start + 0.5 * length,
                amplitude: 0.05 * length,
                period_s: 20.0 + f64::from(signal.channel),
                noise: 0.0005 * length,
                start,
                end,
                field: None,
                form: Form::Sine,
            }
        });
        SimData { channels: channels.collect(), ..SimData::default() }
    }
}

/// Returns the default of an object. An integer is divided by the power of ten of its decimal digits.
fn number(model: &Model, object: ObjectId, digits: Option<ObjectId>) -> Option<f64> {
    let entry = model.dictionary.get(object)?;
    let number = entry.data_type.decode(&entry.default_bytes(NodeId::MIN)?).ok()?.as_f64()?;
    let is_real = matches!(entry.data_type, DataType::Real32 | DataType::Real64);
    let digits = digits.filter(|_| !is_real).and_then(|digits| number_of_digits(model, digits)).unwrap_or(0);
    Some(number / 10f64.powi(digits))
}

fn number_of_digits(model: &Model, object: ObjectId) -> Option<i32> {
    let entry = model.dictionary.get(object)?;
    let number = entry.data_type.decode(&entry.default_bytes(NodeId::MIN)?).ok()?.as_u64()?;
    i32::try_from(number.min(9)).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::catalog::{built_in, by_name};
    use crate::device::scalar::Scalar;

    #[test]
    fn every_file_belongs_to_a_device_and_loads() {
        for (name, text) in FILES {
            assert!(by_name(name).is_some(), "{name}");
            toml::from_str::<SimData>(text).unwrap_or_else(|error| panic!("{name}: {error}"));
        }
    }

    #[test]
    fn every_signal_has_a_quantity_within_its_range_and_in_its_unit() {
        for model in built_in() {
            let (sim, device) = (SimData::of(model), &model.description.name);
            for signal in &model.description.signals {
                let quantity = sim.channels.iter().find(|quantity| quantity.channel == signal.channel);
                let quantity = quantity.unwrap_or_else(|| panic!("{device} {}: no simulated quantity", signal.name));
                assert!(quantity.start <= quantity.base - quantity.amplitude, "{device} {}", signal.name);
                assert!(quantity.base + quantity.amplitude <= quantity.end, "{device} {}", signal.name);
                let unit = signal.unit.and_then(|unit| model.dictionary.get(unit)?.default.clone());
                let fixed = signal.fixed_unit.map(|unit| Scalar::Integer(unit.0.into()));
                let unit = fixed.or(unit).unwrap_or(Scalar::Integer(0));
                assert_eq!(unit, Scalar::Integer(quantity.unit.into()), "{device} {}", signal.name);
            }
            assert_eq!(sim.channels.len(), model.description.signals.len(), "{device}");
        }
    }

    #[test]
    fn a_value_with_a_default_is_constant() {
        let text = "name='x'\ntitle=''\nvendor=''\n[[signal]]\nname='flow'\nchannel=1\nvalue='0x2000:1'\n[[object]]\n\
                    at='0x2000:1'\nname='volume-flow'\ntype='r32'\naccess='ro'\npdo=true\n";
        let channels = |text: &str| SimData::of(&Model::from_toml(text).expect("a description")).channels;
        assert_eq!(channels(&format!("{text}default=12.5")), []);
        let [channel] = &channels(text)[..] else { panic!("one channel") };
        assert_eq!((channel.start, channel.base, channel.end), (0.0, 50.0, 100.0));
    }

    #[test]
    fn a_device_without_a_file_moves_in_the_middle_of_its_range() {
        let dps = by_name("dps").expect("built in");
        let [channel] = &SimData::generic(&dps).channels[..] else { panic!("one channel") };
        // 6148h and 6149h: 0 and 100000 with three digits, in psi.
        assert_eq!((channel.start, channel.end, channel.base, channel.unit), (0.0, 100.0, 50.0, 0x00ab_0000));
    }
}
