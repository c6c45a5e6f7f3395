//! `cangauge autozero`.

use super::args::Nodes;
use super::each::each;
use super::exit::stdout;
use super::{Format, Global};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit;
use crate::measure::sample::Number;
use crate::output::{csv, json, notes, table};
use crate::tasks::Kind;
use crate::tasks::autozero::{Limit, Options, Zeroed, autozero};
use clap::Args;
use std::io::{self, Write};

/// Make the present reading of a channel zero (6125h), with checks before and after
///
/// Reads the old offset, measures, and refuses with exit 1, nothing changed, when a reading is invalid, when the sensor
/// measures absolute pressure, when the mean is farther from zero than the limit, when the readings are more than
/// 0.5 % of the measuring range apart (where the range is not known: half of the limit), or when the offsets would
/// add up to more than 5 % of the range. Then the signature is written, once: when no answer comes, the offset shows
/// what became of it. Measures again; a reading that is not zero then is exit 6. Prints the shift, and on stderr the
/// line that takes it back.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim autozero 1 --limit 2bar --samples 2 --dry-run\n  cangauge -b sim autozero 1 --limit 2bar --samples 2 --store\n  cangauge -b sim autozero 127 --limit 25% --samples 2 --format json"
)]
pub(crate) struct Autozero {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Which channel; not given: the only one that has a zero
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=199))]
    channel: Option<u8>,
    /// The largest reading that is taken for zero: 0.1 in the present unit, 100mbar, 2% of the measuring range
    /// [default: 1%]
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true, value_parser = parse_limit)]
    limit: Option<Limit>,
    /// How many readings, 100 ms apart, before and after
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u32).range(2..=10_000))]
    samples: u32,
    /// Whatever speaks against it
    #[arg(long)]
    force: bool,
    /// Store it, with the other application settings
    #[arg(long)]
    store: bool,
    /// Measure and check, and change nothing
    #[arg(long)]
    dry_run: bool,
}

fn parse_limit(text: &str) -> Result<Limit, String> {
    let fails = || format!("\"{text}\" is not a limit (0.1, 100mbar, 2%)");
    let is_unit =
        |letter: char| letter.is_alphabetic() && !matches!(letter, 'e' | 'E') || matches!(letter, '%' | '\u{b0}');
    let (number, unit) = text.split_at(text.find(is_unit).unwrap_or(text.len()));
    let number: f64 = number.trim().parse().map_err(|_| fails())?;
    if !number.is_finite() || number <= 0.0 {
        return Err(format!("\"{text}\": a limit is more than 0"));
    }
    match unit.trim() {
        "" => Ok(Limit::Value(number, None)),
        "%" => Ok(Limit::Percent(number)),
        unit => Unit::from_symbol(unit).map(|unit| Limit::Value(number, Some(unit))).ok_or_else(fails),
    }
}

impl Autozero {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let options = Options {
            channel: self.channel,
            limit: self.limit.unwrap_or_default(),
            samples: self.samples,
            force: self.force,
            store: self.store,
            dry_run: self.dry_run,
        };
        let mut each =
            each(global, &self.nodes, |master, node, overrides| autozero(master, node, overrides, &options))?;
        print(&each.done, global.format).map_err(stdout)?;
        for (_, zeroed) in &each.done {
            zeroed.notes.iter().for_each(|note| notes::print(&global.console(), note));
        }
        if self.nodes == Nodes::All {
            each.excuse(global, |failure| failure.kind() == Kind::Usage);
        }
        each.end()
    }
}

fn print(done: &[(NodeId, Zeroed)], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match format {
        Format::Json => done.iter().try_for_each(|(node, zeroed)| json::zeroed(&mut out, *node, zeroed))?,
        Format::Csv => {
            let mean =
                |mean: Option<f64>, decimals: usize| mean.map(|mean| format!("{mean:.decimals$}")).unwrap_or_default();
            let head = ["node", "channel", "unit", "before", "after", "offset_before", "offset", "stored"];
            let rows = done.iter().map(|(node, zeroed)| {
                let decimals = zeroed.decimals + 2;
                vec![
                    node.to_string(),
                    zeroed.channel.to_string(),
                    zeroed.unit.clone(),
                    mean(zeroed.before, decimals),
                    mean(zeroed.after, decimals),
                    offset(zeroed.offset_before),
                    offset(zeroed.offset),
                    zeroed.stored.to_string(),
                ]
            });
            csv::write(&mut out, &head, rows)?;
        }
        Format::Text => {
            let rows: Vec<Vec<String>> = done.iter().map(|(node, zeroed)| words(*node, zeroed)).collect();
            table::write(&mut out, &[table::Align::Left; 5], &rows)?;
        }
    }
    out.flush()
}

fn offset(offset: Option<Number>) -> String {
    offset.map(|offset| offset.to_string()).unwrap_or_default()
}

/// Half of the last digit that is shown.
fn half(zeroed: &Zeroed) -> f64 {
    i32::try_from(zeroed.decimals).map_or(0.0, |decimals| 0.5 * 10f64.powi(-decimals))
}

/// `1  pressure  0.013 -> 0.000 bar  shift -0.013 bar  offset 0.0 -> -0.013`; nothing of the later parts where nothing
/// was changed.
fn words(node: NodeId, zeroed: &Zeroed) -> Vec<String> {
    // What rounds to zero has no sign.
    let number =
        |number: f64| format!("{:.*}", zeroed.decimals, if number.abs() < half(zeroed) { 0.0 } else { number });
    let mean = |mean: Option<f64>| mean.map_or_else(|| "-".to_owned(), number);
    let with_unit = |text: String| format!("{text} {}", zeroed.unit).trim_end().to_owned();
    let mut row = vec![node.to_string(), zeroed.signal.clone()];
    if zeroed.after.is_none() {
        row.push(with_unit(mean(zeroed.before)));
        row.extend(zeroed.offset_before.map(|old| format!("offset {old}")));
        return row;
    }
    row.push(with_unit(format!("{} -> {}", mean(zeroed.before), mean(zeroed.after))));
    row.extend(zeroed.shift().map(|shift| format!("shift {}", with_unit(number(shift)))));
    row.extend(zeroed.offset_before.zip(zeroed.offset).map(|(old, new)| format!("offset {old} -> {new}")));
    row
}
