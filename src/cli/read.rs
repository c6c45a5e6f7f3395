//! `cangauge read`.

use super::args::{Nodes, SignalArg};
use super::exit::{IntoFailure, several};
use super::{Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::device::unit::Unit;
use cangauge::measure::decode::Wanted;
use cangauge::measure::sample::{Doubt, Sample, Source};
use cangauge::output::doubt;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::read::ReadValue;
use cangauge::tasks::read::{ReadFailure, Readings, Target, read};
use cangauge::tasks::{Failure, Kind};
use clap::Args;

/// Read measured values now, scaled, with unit and status
///
/// For one signal of one node, only the number is printed: P=$(cangauge read 5 pressure). Without SIGNAL, every signal
/// of the device is read.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim read 1\n  cangauge -b sim read 127 pressure --in bar\n  cangauge -b sim read 1,127 --format json"
)]
pub(crate) struct Read {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// pressure, temperature, ch1 to ch16, pressure.status, or an object, unscaled: 0x6130:1, 0x6010:0/i16
    signals: Vec<SignalArg>,
    /// Convert to this unit: bar, mbar, kPa, MPa, psi, degC, degF, K. Without SIGNAL, other quantities keep their unit
    #[arg(long = "in", value_name = "UNIT", value_parser = parse_unit)]
    unit: Option<Unit>,
}

pub(super) fn parse_unit(text: &str) -> Result<Unit, String> {
    Unit::from_symbol(text).ok_or_else(|| match Unit::spellings(text).as_slice() {
        [] => format!("\"{text}\" is not a known unit (bar, mbar, kPa, MPa, psi, degC, degF, K, 0x4E0000)"),
        several => format!("the unit \"{text}\" is ambiguous: {}", several.join(" or ")),
    })
}

impl Read {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let wanted: Vec<Wanted> = self.signals.iter().map(|signal| signal.0.clone()).collect();
        let (node_count, results) = global.with_master(|master| {
            let nodes = open::nodes(master, global, &self.nodes)?;
            let overrides = descriptions::overrides_on(master, global, &nodes)?;
            let results = read(master, &nodes, &wanted, &overrides).or_fail()?;
            Ok((nodes.len(), results))
        })?;
        let is_number_only = node_count == 1 && wanted.len() == 1;
        let (mut values, mut failures) = (Vec::new(), Vec::new());
        for result in results {
            match result.and_then(|readings| self.convert(global, readings, is_number_only)) {
                Ok(converted) => values.extend(converted),
                Err(failure) => failures.push(failure),
            }
        }
        // `all` means the nodes with the signal. The command fails if no node has the signal.
        if self.nodes == Nodes::All && !values.is_empty() {
            let (without_signal, failed): (Vec<_>, Vec<_>) =
                failures.into_iter().partition(|failure| failure.kind() == Kind::Usage);
            failures = failed;
            without_signal.iter().for_each(|failure| global.console().note(&ErrorMessage::from(failure).message));
        }
        let reports: Vec<ReadValue<'_>> = values.iter().map(|value| report(value, is_number_only)).collect();
        global.print(&reports)?;
        Ok(several(node_count, failures)?)
    }

    /// Prints the warnings of the readings of one node, and converts the values.
    fn convert(&self, global: &Global, readings: Readings, is_number_only: bool) -> Result<Vec<Converted>, Failure> {
        for (target, sample) in &readings {
            if let Some(doubt) =
                sample.doubt.filter(|doubt| !is_number_only || !matches!(doubt, Doubt::UnknownType | Doubt::NotNumber))
            {
                let (node, signal) = (target.source.node, &target.source.signal);
                global.console().warn(&doubt::doubt(node, signal, doubt));
            }
        }
        let converts = |(target, _): &(Target, Sample)| self.unit.is_some_and(|unit| target.unit_for(unit).is_ok());
        let converts_any = self.signals.is_empty() && readings.iter().any(converts);
        let convert = |(target, sample): (Target, Sample)| {
            let converted = match self.unit.map(|unit| target.convert(sample.value, unit)).transpose() {
                // Without SIGNAL, a signal of another quantity keeps its unit.
                Err(_) if converts_any => {
                    global.console().note(&kept_unit(&target));
                    None
                }
                result => result?,
            };
            // A script expects a number, so an empty line would be wrong.
            if is_number_only && global.prints_text() && sample.value.is_none() {
                return Err(no_value(&target, &sample));
            }
            Ok((target, sample, converted))
        };
        readings.into_iter().map(convert).collect()
    }
}

fn report((target, sample, converted): &Converted, is_number_only: bool) -> ReadValue<'_> {
    let value = ReadValue::new(&target.source, sample, is_number_only);
    match *converted {
        Some((converted, unit)) => value.converted(converted, unit),
        None => value,
    }
}

/// Note about a signal that `--in` does not convert.
fn kept_unit(target: &Target) -> String {
    let Source { node, signal, unit, .. } = &target.source;
    let unit = if unit.is_empty() { "no unit" } else { unit };
    format!("node {node}: {signal} is not converted ({unit})")
}

/// A reading, and (if a unit is requested) its value in this unit.
type Converted = (Target, Sample, Option<(Option<f64>, Unit)>);

/// Returns the failure for a reading without a value.
fn no_value(target: &Target, sample: &Sample) -> Failure {
    let signal = target.source.signal.to_string();
    let cause = match sample.doubt {
        Some(Doubt::UnknownType) => ReadFailure::TypeUnknown { signal, raw: sample.raw },
        Some(Doubt::NotNumber) => ReadFailure::NotNumber { signal },
        _ => ReadFailure::Invalid { signal, status: sample.status },
    };
    Failure::at(target.source.node, cause)
}
