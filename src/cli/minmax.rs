//! `cangauge minmax`.

use super::exit::stdout;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, settings as json, table};
use crate::tasks::settings::minmax::{Extremes, reset, show};
use crate::tasks::settings::{Device, Quantity};
use clap::Args;
use std::io::{self, Write};

/// Tell the lowest and highest value that the device has measured, or reset them
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim minmax 1\n  cangauge -b sim minmax 1 --reset")]
pub(crate) struct Minmax {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// Begin anew; printed is what was there before
    #[arg(long)]
    reset: bool,
}

impl Minmax {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = open::overrides(global, &[self.node])?;
        let report: Vec<(Extremes, Option<Extremes>)> = global.with_master(|master| {
            let device = Device::open(master, self.node, &overrides)?;
            Ok(match self.reset {
                true => reset(master, &device)?.into_iter().map(|(before, now)| (now, Some(before))).collect(),
                false => show(master, &device)?.into_iter().map(|now| (now, None)).collect(),
            })
        })?;
        self.print(&report, global.format).map_err(stdout)?;
        if self.reset {
            global.console().note(&format!("node {}: minimum and maximum begin anew", self.node));
        }
        Ok(())
    }

    fn print(&self, report: &[(Extremes, Option<Extremes>)], format: Format) -> io::Result<()> {
        let mut out = io::stdout().lock();
        let text =
            |quantity: Option<Quantity>| quantity.map_or_else(|| "-".to_owned(), |quantity| quantity.to_string());
        // After a reset what was there before is worth more than what has come since.
        let shown = report.iter().map(|(now, before)| before.as_ref().unwrap_or(now));
        match format {
            Format::Json => {
                report
                    .iter()
                    .try_for_each(|(now, before)| json::extremes(&mut out, self.node, now, before.as_ref()))?;
            }
            Format::Csv => {
                let number = |quantity: Option<Quantity>| {
                    quantity.map(|quantity| quantity.number.to_string()).unwrap_or_default()
                };
                let row = |extremes: &Extremes| {
                    let unit = extremes.lowest.and_then(|quantity| quantity.unit).map(|unit| unit.to_string());
                    let (node, unit) = (self.node.to_string(), unit.unwrap_or_default());
                    let (lowest, highest) = (number(extremes.lowest), number(extremes.highest));
                    vec![node, extremes.signal.clone(), lowest, highest, unit]
                };
                csv::write(&mut out, &["node", "signal", "min", "max", "unit"], shown.map(row))?;
            }
            Format::Text => {
                let row = |extremes: &Extremes| {
                    let (lowest, highest) = (text(extremes.lowest), text(extremes.highest));
                    vec![extremes.signal.clone(), format!("min {lowest}"), format!("max {highest}")]
                };
                table::write(&mut out, &[table::Align::Left; 3], &shown.map(row).collect::<Vec<_>>())?;
            }
        }
        out.flush()
    }
}
