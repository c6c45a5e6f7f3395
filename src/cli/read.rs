//! `cangauge read`.

use super::args::{Nodes, SignalArg};
use super::exit::{IntoFailure, several, stdout};
use super::{Format, Global, descriptions, open};
use crate::bus::claim::Claim;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use crate::measure::sample::{Doubt, Number, Raw, Sample, Status};
use crate::output::failure::ErrorMessage;
use crate::output::{csv, doubt, json, table, text};
use crate::tasks::read::{Target, read};
use crate::tasks::{Failure, Kind};
use clap::Args;
use std::io::{self, Write};

/// Read measured values now, scaled, with unit and status
///
/// One signal of one node prints the bare number, so that P=$(cangauge read 5 pressure) works. Without
/// SIGNAL every signal of the device is read.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim read 1\n  cangauge -b sim read 127 pressure --in bar\n  cangauge -b sim read 1,127 --format json"
)]
pub(crate) struct Read {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// pressure, temperature, ch1 to ch16, pressure.status, or an object as it is: 0x6130:1, 0x6010:0/i16
    signals: Vec<SignalArg>,
    /// Convert to this unit: bar, mbar, kPa, MPa, psi, degC, degF, K
    #[arg(long = "in", value_name = "UNIT", value_parser = parse_unit)]
    unit: Option<Unit>,
}

pub(super) fn parse_unit(text: &str) -> Result<Unit, String> {
    Unit::from_symbol(text)
        .ok_or_else(|| format!("\"{text}\" is not a known unit (bar, mbar, kPa, MPa, psi, degC, degF, K, 0x4E0000)"))
}

/// A value ready to be shown.
struct Shown {
    target: Target,
    value: Option<Number>,
    /// The text of the value: as sent, or converted with the precision of what was sent.
    text: String,
    unit: String,
    status: Option<Status>,
    doubt: Option<Doubt>,
    raw: Raw,
}

impl Read {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let wanted: Vec<Wanted> = self.signals.iter().map(|signal| signal.0.clone()).collect();
        let (asked, results) = global.with_master(|master| {
            let nodes = open::nodes(master, global, &self.nodes)?;
            let overrides = descriptions::overrides_on(master, global, &nodes)?;
            let results = read(master, &nodes, &wanted, &overrides).or_fail()?;
            Ok((nodes.len(), results))
        })?;
        let bare = asked == 1 && wanted.len() == 1;
        let (mut shown, mut failures) = (Vec::new(), Vec::new());
        for result in results {
            match result.and_then(|samples| {
                for (target, sample) in &samples {
                    if let Some(doubt) = sample.doubt.filter(|doubt| !bare || *doubt != Doubt::UnknownType) {
                        let (node, signal) = (target.source.node, &target.source.signal);
                        global.console().warn(&doubt::doubt(node, signal, doubt));
                    }
                }
                samples.into_iter().map(|(target, sample)| self.show(target, &sample)).collect::<Result<Vec<_>, _>>()
            }) {
                Ok(values) => shown.extend(values),
                Err(failure) => failures.push(failure),
            }
        }
        // Everybody was meant who has it; that somebody has it not is no failure, unless nobody has.
        if self.nodes == Nodes::All && !shown.is_empty() {
            let (without, failed) = failures.into_iter().partition(|failure| failure.kind() == Kind::Usage);
            failures = failed;
            let without: Vec<Failure> = without;
            without.iter().for_each(|failure| global.console().note(&ErrorMessage::from(failure).message));
        }
        let invalid = print(&shown, global.format, bare).map_err(stdout)?;
        if let Some(failure) = invalid {
            failures.push(failure);
        }
        Ok(several(asked, failures)?)
    }

    fn show(&self, target: Target, sample: &Sample) -> Result<Shown, Failure> {
        let as_sent = sample.value.map(|value| value.to_string()).unwrap_or_default();
        let (value, text, unit) = match (self.unit, target.unit) {
            (None, _) => (sample.value, as_sent, target.source.unit.to_string()),
            (Some(to), from) => {
                let from = from.ok_or_else(|| {
                    let message = format!("{} has no unit to convert from", target.source.signal);
                    Failure::of_node(Kind::Usage, target.source.node, message)
                })?;
                let converted = match sample.value {
                    None => None,
                    Some(value) => Some(from.convert(value.as_f64(), to).ok_or_else(|| {
                        let message = format!("{} is in {from}, which is no {to}", target.source.signal);
                        Failure::of_node(Kind::Usage, target.source.node, message)
                    })?),
                };
                let shown = converted.map(|value| text::significant(value, precision(sample.value)));
                (converted.map(Number::Real64), shown.unwrap_or_default(), to.to_string())
            }
        };
        let (status, doubt, raw) = (sample.status, sample.doubt, sample.raw);
        Ok(Shown { target, value, text, unit, status, doubt, raw })
    }
}

/// How many significant digits a value was sent with: a converted one has no more.
fn precision(value: Option<Number>) -> usize {
    match value {
        Some(Number::Decimal { mantissa, .. }) => mantissa.unsigned_abs().to_string().len().max(4),
        Some(Number::Real32(_)) | None => 7,
        Some(Number::Real64(_)) => 15,
    }
}

/// Prints; a bare value that is invalid is a failure, since an empty line is no number.
fn print(shown: &[Shown], format: Format, bare: bool) -> io::Result<Option<Failure>> {
    let mut out = io::stdout().lock();
    match format {
        Format::Json => {
            for item in shown {
                json::reading(&mut out, &item.target.source, item.value, &item.unit, item.status)?;
            }
        }
        Format::Csv => {
            let cells = |item: &Shown| {
                let status = item.status.map_or("", Status::as_str);
                let source = &item.target.source;
                [&source.node.to_string(), &*source.signal, &item.text, &item.unit, status].map(str::to_owned).to_vec()
            };
            csv::write(&mut out, &["node", "signal", "value", "unit", "status"], shown.iter().map(cells))?;
        }
        Format::Text if bare => {
            if let [item] = shown {
                if item.value.is_none() {
                    let source = &item.target.source;
                    if item.doubt == Some(Doubt::UnknownType) {
                        let raw: String = item.raw.bytes().iter().map(|byte| format!("{byte:02X}")).collect();
                        let message = format!("{} (received 0x{raw})", doubt::unknown_type(&source.signal));
                        let remedy = doubt::type_remedy(source.node, &source.signal);
                        return Ok(Some(Failure::of_node(Kind::Usage, source.node, message).hint(remedy)));
                    }
                    let status = item.status.map_or("invalid", Status::as_str);
                    let message = format!("{} has no valid value: {status}", source.signal);
                    return Ok(Some(Failure::of_node(Kind::Unexpected, source.node, message)));
                }
                writeln!(out, "{}", item.text)?;
            }
        }
        Format::Text => {
            let cell = |item: &Shown| {
                let value = if item.text.is_empty() { "-".to_owned() } else { format!("{} {}", item.text, item.unit) };
                let status = item.status.map_or("(tells no status)", Status::as_str);
                let source = &item.target.source;
                vec![source.node.to_string(), source.signal.to_string(), value.trim_end().to_owned(), status.to_owned()]
            };
            let rows: Vec<_> = shown.iter().map(cell).collect();
            table::write(&mut out, &[table::Align::Left; 4], &rows)?;
        }
    }
    out.flush()?;
    Ok(None)
}
