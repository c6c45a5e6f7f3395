//! `cangauge limits`.

use super::exit::stdout;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, settings as json, table};
use crate::tasks::settings::Device;
use crate::tasks::settings::limits::{Limit, Limits as Report, set, show};
use clap::Args;
use std::io::{self, Write};

/// Tell or set what makes a TPDO of a signal go out by itself: delta, limits, hysteresis (x133h to x136h)
///
/// In the unit of the signal. They count for transmission types 254 and 255; a PDO of these types whose
/// event timer and delta are both 0 may never be sent, and that is said.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim limits 1 pressure\n  cangauge -b sim limits 1 temperature --delta 0.5\n  cangauge -b sim limits 1 pressure --lower 0.5 --upper 8 --hysteresis 0.1"
)]
pub(crate) struct Limits {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// pressure, temperature, ch1 to ch16
    signal: String,
    /// A change of at least this sends; 0 is off
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    delta: Option<f64>,
    /// Below it, it sends
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    lower: Option<f64>,
    /// Above it, it sends
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    upper: Option<f64>,
    /// How far back behind a limit before it counts again
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    hysteresis: Option<f64>,
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("\"{text}\" is not a number (0.5, -20)"))
}

impl Limits {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let given = [self.delta, self.lower, self.upper, self.hysteresis];
        let wanted: Vec<(Limit, f64)> =
            Limit::ALL.into_iter().zip(given).filter_map(|(limit, number)| Some((limit, number?))).collect();
        for (limit, number) in wanted.iter().filter(|(limit, _)| matches!(limit, Limit::Delta | Limit::Hysteresis)) {
            if *number < 0.0 {
                let message = format!("{} cannot be less than 0: {number}", limit.as_str());
                return Err(crate::tasks::Failure::new(crate::tasks::Kind::Usage, message).into());
            }
        }
        let overrides = open::overrides(global, &[self.node])?;
        let report = global.with_master(|master| {
            let device = Device::open(master, self.node, &overrides)?;
            Ok(match wanted.is_empty() {
                true => show(master, &device, &self.signal)?,
                false => set(master, &device, &self.signal, &wanted)?,
            })
        })?;
        self.print(&report, global.format).map_err(stdout)?;
        let console = global.console();
        for tpdo in &report.silent {
            console.warn(&format!(
                "node {}: {tpdo} goes out by event, without a timer, and delta is 0: it may never be sent",
                self.node
            ));
        }
        if !wanted.is_empty() {
            console.note(&format!("node {0}: lost at power-off unless stored: cangauge store {0}", self.node));
        }
        Ok(())
    }

    fn print(&self, report: &Report, format: Format) -> io::Result<()> {
        let mut out = io::stdout().lock();
        match format {
            Format::Json => json::limits(&mut out, self.node, report)?,
            Format::Csv => {
                let rows = report.values.iter().map(|(limit, _, quantity)| {
                    let unit = quantity.unit.map(|unit| unit.to_string()).unwrap_or_default();
                    let (node, limit) = (self.node.to_string(), limit.as_str().to_owned());
                    vec![node, report.signal.clone(), limit, quantity.number.to_string(), unit]
                });
                csv::write(&mut out, &["node", "signal", "limit", "value", "unit"], rows)?;
            }
            Format::Text => {
                let rows = report.values.iter().map(|(limit, object, quantity)| {
                    vec![limit.as_str().to_owned(), quantity.to_string(), format!("({object})")]
                });
                table::write(&mut out, &[table::Align::Left; 3], &rows.collect::<Vec<_>>())?;
            }
        }
        out.flush()
    }
}
