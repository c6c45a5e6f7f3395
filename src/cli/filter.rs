//! `cangauge filter`.

use super::args::Duration;
use super::exit::stdout;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, settings as json, table};
use crate::tasks::settings::Device;
use crate::tasks::settings::filter::{FilterOf, FilterType, Wanted, set, show};
use clap::{Args, ValueEnum};
use std::io::{self, Write};

/// Tell or set the filter of a signal: type (61A0h) and constant (61A1h)
///
/// What a type does is told as the device's manual has it: not everywhere is 0 no filter. What is set is
/// read back; a damping, which cannot be read, by the constant that the device makes of it.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim filter 1\n  cangauge -b sim filter 1 pressure --type moving --constant 8\n  cangauge -b sim filter 1 --type moving --damping 100ms"
)]
pub(crate) struct Filter {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// pressure, temperature, ch1 to ch16 [default: every signal; to set: the only one with a filter]
    signal: Option<String>,
    /// What the filter does
    #[arg(long = "type", value_name = "TYPE")]
    kind: Option<Type>,
    /// How many steps it takes
    #[arg(long, value_name = "N")]
    constant: Option<u16>,
    /// Within which time the value follows a step; the device works out the constant
    #[arg(long, value_name = "DUR", conflicts_with = "constant")]
    damping: Option<Duration>,
}

// No doc comments on the variants: clap would spread each over lines of its own.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Type {
    None,
    Moving,
    Repeating,
}

impl Filter {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let wanted = Wanted {
            kind: self.kind.map(|kind| match kind {
                Type::None => FilterType::None,
                Type::Moving => FilterType::Moving,
                Type::Repeating => FilterType::Repeating,
            }),
            constant: self.constant,
            damping: self.damping.map(|damping| damping.0),
        };
        let overrides = open::overrides(global, &[self.node])?;
        let signal = self.signal.as_deref();
        if wanted == Wanted::default() {
            let filters = global.with_master(|master| {
                let device = Device::open(master, self.node, &overrides)?;
                Ok(show(master, &device, signal)?)
            })?;
            return self.print(&filters, None, global.format).map_err(stdout);
        }
        let change = global.with_master(|master| {
            let device = Device::open(master, self.node, &overrides)?;
            Ok(set(master, &device, signal, wanted)?)
        })?;
        self.print(std::slice::from_ref(&change.now), change.damping_shown, global.format).map_err(stdout)?;
        let (console, node) = (global.console(), self.node);
        if change.damping_shown == Some(false) {
            let constant = change.now.constant.map_or_else(|| "nothing".to_owned(), |constant| constant.to_string());
            console.warn(&format!(
                "node {node}: the damping was acknowledged; the filter constant reads {constant} as before, so nothing shows it"
            ));
        }
        if change.before != change.now {
            console.note(&format!("node {node}: lost at power-off unless stored: cangauge store {node}"));
        }
        Ok(())
    }

    fn print(&self, filters: &[FilterOf], damping_shown: Option<bool>, format: Format) -> io::Result<()> {
        let mut out = io::stdout().lock();
        let node = self.node.to_string();
        let number = |number: Option<u64>| number.map(|number| number.to_string()).unwrap_or_default();
        match format {
            Format::Json => {
                filters.iter().try_for_each(|filter| json::filter(&mut out, self.node, filter, damping_shown))?;
            }
            Format::Csv => {
                let row = |filter: &FilterOf| {
                    let (code, constant) = (number(filter.code), number(filter.constant));
                    vec![node.clone(), filter.signal.clone(), code, filter.kind.clone(), constant]
                };
                csv::write(&mut out, &["node", "signal", "code", "type", "constant"], filters.iter().map(row))?;
            }
            Format::Text => {
                let row = |filter: &FilterOf| {
                    let kind = format!("{} ({})", filter.kind, number(filter.code));
                    let constant = filter.constant.map(|constant| format!("constant {constant}"));
                    let kind = if filter.code.is_some() { kind } else { "-".to_owned() };
                    vec![filter.signal.clone(), kind, constant.unwrap_or_default()]
                };
                let rows: Vec<Vec<String>> = filters.iter().map(row).collect();
                table::write(&mut out, &[table::Align::Left; 3], &rows)?;
            }
        }
        out.flush()
    }
}
