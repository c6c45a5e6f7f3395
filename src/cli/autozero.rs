//! `cangauge autozero`.

use super::Global;
use super::args::Nodes;
use super::nodes::on_each_node;
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::device::unit::Unit;
use cangauge::master::Master;
use cangauge::node::Overrides;
use cangauge::output::autozero::ZeroReport;
use cangauge::output::notes;
use cangauge::tasks::autozero::{AutozeroFailure, AutozeroReport, Limit, Options, ZeroTarget, autozero};
use cangauge::tasks::failure::Cause;
use cangauge::tasks::{Failure, Kind};
use clap::Args;

/// Set the zero of a channel (6125h), with checks before and after
///
/// The command measures, writes the signature once, and measures again. If the reading is then not zero, the exit
/// code is 6. The change of the zero is printed as "shift". The command to undo it is printed on stderr.
///
/// Before the write it checks these conditions. If one of them is not met, it changes nothing and exits with 1. Each
/// reading must be valid. The sensor must not measure absolute pressure. The mean must be within the limit. The
/// readings may vary by at most 0.5 % of the measuring range (half of the limit if the range is unknown). The total
/// offset may be at most 5 % of the range, or at most --limit if that is larger.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim autozero 1 --limit 2bar --samples 2 --dry-run\n  cangauge -b sim autozero 1 --limit 2bar --samples 2 --store\n  cangauge -b sim autozero 127 --limit 25% --samples 2 --format json"
)]
pub(crate) struct Autozero {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// Channel [default: the only channel that can be set to zero]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u8).range(1..=199))]
    channel: Option<u8>,
    /// Largest accepted reading: 0.1 (in the present unit), 100mbar, 2% (of the measuring range) [default: 1%]
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true, value_parser = parse_limit)]
    limit: Option<Limit>,
    /// Number of readings before and after, 100 ms apart
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u32).range(2..=10_000))]
    samples: u32,
    /// Skip the safety checks
    #[arg(long)]
    force: bool,
    /// Store the offset, with the other application settings
    #[arg(long)]
    store: bool,
    /// Measure and check only; change nothing
    #[arg(long)]
    pub(super) dry_run: bool,
}

fn parse_limit(text: &str) -> Result<Limit, String> {
    let fails = || format!("\"{text}\" is not a limit (0.1, 100mbar, 2%)");
    let is_unit =
        |letter: char| letter.is_alphabetic() && !matches!(letter, 'e' | 'E') || matches!(letter, '%' | '\u{b0}');
    let (number, unit) = text.split_at(text.find(is_unit).unwrap_or(text.len()));
    let number: f64 = number.trim().parse().map_err(|_| fails())?;
    if !number.is_finite() || number <= 0.0 {
        return Err(format!("\"{text}\": a limit must be greater than 0"));
    }
    match unit.trim() {
        "" => Ok(Limit::Value(number, None)),
        "%" => Ok(Limit::Percent(number)),
        unit => Unit::from_symbol(unit).map(|unit| Limit::Value(number, Some(unit))).ok_or_else(fails),
    }
}

impl Autozero {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        self.nodes.claim()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let options = Options {
            target: ZeroTarget::Autozero,
            channel: self.channel,
            limit: self.limit.unwrap_or_default(),
            samples: self.samples,
            force: self.force,
            store: self.store,
            dry_run: self.dry_run,
        };
        run_each(global, &self.nodes, |master, node, overrides| autozero(master, node, overrides, &options))
    }
}

/// Runs an autozero or a tare on each node and prints the reports.
pub(super) fn run_each(
    global: &Global,
    nodes: &Nodes,
    work: impl FnMut(&mut Master<'_>, NodeId, &Overrides) -> Result<AutozeroReport, Failure>,
) -> anyhow::Result<()> {
    let mut results = on_each_node(global, nodes, work)?;
    let reports: Vec<ZeroReport<'_>> =
        results.done.iter().map(|(node, zeroed)| ZeroReport { node: *node, zeroed }).collect();
    global.print(&reports)?;
    for (_, zeroed) in &results.done {
        zeroed.notes.iter().for_each(|note| notes::print(&global.console(), note));
    }
    if *nodes == Nodes::All {
        let has_none = |failure: &Failure| matches!(failure.cause, Cause::Autozero(AutozeroFailure::NoAutozero { .. }));
        results.tolerate(global, |failure| failure.kind() == Kind::Usage || has_none(failure));
    }
    results.end()
}
