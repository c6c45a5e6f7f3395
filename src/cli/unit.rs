//! `cangauge unit`.

use super::exit::stdout;
use super::read::parse_unit;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit as Code;
use crate::output::console::Console;
use crate::output::{csv, settings as json, table};
use crate::tasks::settings::Device;
use crate::tasks::settings::unit::{Rescaled, UnitChange, UnitOf, list, set, show};
use crate::tasks::{Failure, Kind};
use clap::Args;
use std::io::{self, Write};

/// Tell or set the physical unit of a signal (6131h)
///
/// A unit is set, read back, and with it everything that it rescales: span, offset, limits, the value
/// itself. One signal's unit is printed bare.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim unit 1\n  cangauge -b sim unit 1 temperature K\n  cangauge -b sim unit 1 pressure 0x06220000"
)]
pub(crate) struct Unit {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// pressure, temperature, ch1 to ch16; and the unit to set: bar, psi, MPa, kPa, mbar, degC, K,
    /// or its raw code 0x004E0000
    #[arg(value_names = ["SIGNAL", "UNIT"], num_args = 0..=2)]
    words: Vec<String>,
}

impl Unit {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (signal, unit) = self.words().map_err(|message| Failure::new(Kind::Usage, message))?;
        let overrides = open::overrides(global, &[self.node])?;
        let console = global.console();
        match unit {
            None => {
                let units = global.with_master(|master| {
                    let device = Device::open(master, self.node, &overrides)?;
                    Ok(show(&device, signal)?)
                })?;
                print(self.node, &units, global.format).map_err(stdout)
            }
            Some(unit) => {
                let change = global.with_master(|master| {
                    let mut device = Device::open(master, self.node, &overrides)?;
                    Ok(set(master, &mut device, signal, unit)?)
                })?;
                print_change(self.node, &change, global.format).map_err(stdout)?;
                self.tell(&change, &console);
                Ok(())
            }
        }
    }

    /// One word is a unit if it is the name of one, else a signal.
    fn words(&self) -> Result<(Option<&str>, Option<Code>), String> {
        match self.words.as_slice() {
            [] => Ok((None, None)),
            [word] => match parse_unit(word) {
                Ok(unit) => Ok((None, Some(unit))),
                Err(_) => Ok((Some(word), None)),
            },
            [signal, unit, ..] => Ok((Some(signal), Some(parse_unit(unit)?))),
        }
    }

    fn tell(&self, change: &UnitChange, console: &Console) {
        let node = self.node;
        if change.before == change.now.unit {
            console.note(&format!("node {node}: {} was in {} already", change.now.signal, change.before));
            return;
        }
        for item in change.rescaled.iter().filter(|item| item.stale) {
            let number = item.after.map(|after| after.to_string()).unwrap_or_default();
            console.warn(&format!("node {node}: {} was not converted by the device: it is now {number}", item.name));
        }
        console.note(&format!("node {node}: kept after power off only when it is stored: cangauge store {node}"));
    }
}

fn print(node: NodeId, units: &[UnitOf], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match (format, units) {
        (Format::Json, _) => units.iter().try_for_each(|unit| json::unit(&mut out, node, unit))?,
        (Format::Csv, _) => {
            let row = |unit: &UnitOf| {
                vec![node.to_string(), unit.signal.clone(), unit.unit.to_string(), format!("0x{:08X}", unit.unit.0)]
            };
            csv::write(&mut out, &["node", "signal", "unit", "code"], units.iter().map(row))?;
        }
        (Format::Text, [only]) => writeln!(out, "{}", only.unit)?,
        (Format::Text, several) => {
            let choice = |unit: &UnitOf| match (unit.fixed, unit.takes.as_slice()) {
                (true, _) => "(fixed)".to_owned(),
                (false, []) => String::new(),
                (false, takes) => format!("(takes {})", list(takes)),
            };
            let row = |unit: &UnitOf| vec![unit.signal.clone(), unit.unit.to_string(), choice(unit)];
            table::write(&mut out, &[table::Align::Left; 3], &several.iter().map(row).collect::<Vec<_>>())?;
        }
    }
    out.flush()
}

fn print_change(node: NodeId, change: &UnitChange, format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    let text = |quantity: Option<crate::tasks::settings::Quantity>| {
        quantity.map_or_else(|| "-".to_owned(), |quantity| quantity.to_string())
    };
    let rows = change.rescaled.iter().map(|item: &Rescaled| [item.name.clone(), text(item.before), text(item.after)]);
    let head = [change.now.signal.clone(), change.before.to_string(), change.now.unit.to_string()];
    match format {
        Format::Json => json::unit_change(&mut out, node, change)?,
        Format::Csv => {
            let rows = std::iter::once(head).chain(rows).map(Vec::from);
            csv::write(&mut out, &["name", "before", "after"], rows)?;
        }
        Format::Text => {
            let arrow = |[name, before, after]: [String; 3]| vec![name, before, "->".to_owned(), after];
            let rows: Vec<Vec<String>> = std::iter::once(head).chain(rows).map(arrow).collect();
            table::write(&mut out, &[table::Align::Left; 4], &rows)?;
        }
    }
    out.flush()
}
