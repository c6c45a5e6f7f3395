//! `cangauge lss set-id`, `set-bitrate` and `set`.

use super::{Descriptions, say};
use crate::canopen::id::NodeId;
use crate::cli::args::{BusSpec, Nodes, Rate as BitRate};
use crate::cli::exit::{several, stdout};
use crate::cli::{Format, Global};
use crate::output::failure::host::up_by_hand;
use crate::output::json_lss;
use crate::tasks::lss::{Job, PlannedRate, Rate, Report, Target, Via, assign, check_rate, check_store};
use crate::tasks::{Failure, Kind};
use clap::{Args, ValueEnum};
use std::io::{self, Write};
use std::str::FromStr;

/// Give a device its node-ID: checked to be free, configured, stored, reset, and confirmed
///
/// Success is the boot-up under the new node-ID and the identity read under it. COB-IDs that have not followed
/// are named.
#[derive(Debug, Args)]
pub(super) struct SetId {
    /// Which device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// Its new node-ID; for unconfigured also several (12-14), one device after the other
    new: Nodes,
    #[command(flatten)]
    options: Options,
}

/// Give a device its bit rate, by its own table
///
/// It takes effect when the device starts again, or with --retime at once.
#[derive(Debug, Args)]
pub(super) struct SetBitrate {
    /// Which device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// 250k, 1M, 125000, auto where the device has it
    #[arg(required_unless_present = "table_index")]
    rate: Option<RateArg>,
    #[command(flatten)]
    rates: RateOptions,
    #[command(flatten)]
    options: Options,
}

/// Give a device its node-ID and its bit rate: one store, one reset
#[derive(Debug, Args)]
pub(super) struct Set {
    /// Which device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// Its new node-ID
    #[arg(long, value_name = "NEW")]
    id: NodeId,
    /// 250k, 1M, 125000, auto where the device has it
    #[arg(long, value_name = "RATE", required_unless_present = "table_index")]
    bitrate: Option<RateArg>,
    #[command(flatten)]
    rates: RateOptions,
    #[command(flatten)]
    options: Options,
}

#[derive(Debug, Args)]
struct RateOptions {
    /// The entry of the device's bit rate table, where that table is not known
    #[arg(long, value_name = "N")]
    table_index: Option<u8>,
    /// Take this side to the new bit rate, too, and store only once the device is heard there. Only for a device
    /// alone with this machine
    #[arg(long)]
    retime: bool,
}

#[derive(Debug, Args)]
struct Options {
    /// Only until power off
    #[arg(long)]
    no_store: bool,
    /// By LSS, by objects of the device's own, or what its description says
    #[arg(long, value_name = "WAY", default_value = "auto")]
    via: ViaArg,
    /// "only" goes on where more than one device shows itself: all of them take it
    #[arg(long)]
    force: bool,
}

// No doc comments on the variants: clap would spread each over lines of its own in every help text.

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ViaArg {
    Auto,
    Lss,
    Sdo,
}

/// A bit rate, or `auto`.
#[derive(Clone, Copy, Debug)]
enum RateArg {
    Auto,
    Bits(BitRate),
}

impl FromStr for RateArg {
    type Err = String;

    fn from_str(text: &str) -> Result<RateArg, String> {
        if text == "auto" { Ok(RateArg::Auto) } else { text.parse().map(RateArg::Bits) }
    }
}

impl RateOptions {
    fn rate(&self, rate: Option<RateArg>) -> Result<Option<Rate>, Failure> {
        Ok(match (rate, self.table_index) {
            (Some(RateArg::Auto), Some(_)) => {
                return Err(Failure::new(Kind::Usage, "auto and --table-index exclude each other"));
            }
            (Some(RateArg::Auto), None) => Some(Rate::Auto),
            (Some(RateArg::Bits(bits)), None) => Some(Rate::Bits(bits.0)),
            (Some(RateArg::Bits(bits)), Some(index)) => Some(Rate::Index(index, Some(bits.0))),
            (None, index) => index.map(|index| Rate::Index(index, None)),
        })
    }
}

impl SetId {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let nodes = match (&self.new, &self.target) {
            (Nodes::These(nodes), Target::Unconfigured) => nodes.clone(),
            (Nodes::These(nodes), _) if nodes.len() == 1 => nodes.clone(),
            _ => {
                let message = "one device takes one node-ID; several are for \"unconfigured\"";
                return Err(Failure::new(Kind::Usage, message).into());
            }
        };
        let jobs: Vec<Wanted> = nodes.into_iter().map(|id| (Some(id), None, false)).collect();
        self.options.run(global, &self.target, &jobs)
    }
}

impl SetBitrate {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        self.options.run(global, &self.target, &[(None, self.rates.rate(self.rate)?, self.rates.retime)])
    }
}

impl Set {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let rate = self.rates.rate(self.bitrate)?;
        self.options.run(global, &self.target, &[(Some(self.id), rate, self.rates.retime)])
    }
}

/// Node-ID, bit rate, and whether the host follows.
type Wanted = (Option<NodeId>, Option<Rate>, bool);

impl Options {
    fn run(&self, global: &Global, target: &Target, wanted: &[Wanted]) -> anyhow::Result<()> {
        let descriptions = Descriptions::new(global)?;
        let via = match self.via {
            ViaArg::Auto => Via::Auto,
            ViaArg::Lss => Via::Lss,
            ViaArg::Sdo => Via::Sdo,
        };
        let (overrides, given) = descriptions.named();
        // What the user says of the device is enough to refuse a bit rate, and a way, before anything is sent.
        let model = match target {
            Target::Node(node) => overrides.get(node),
            _ => given,
        };
        model.map_or(Ok(()), |model| check_store(&model.description, !self.no_store, via))?;
        for rate in wanted.iter().filter_map(|(_, rate, _)| *rate) {
            model.map_or(Ok(()), |model| check_rate(&model.description, rate, via))?;
        }
        let mut failures = Vec::new();
        global.with_master(|master| {
            for &(id, rate, retime) in wanted {
                let job = Job {
                    target: target.clone(),
                    id,
                    rate,
                    store: !self.no_store,
                    retime,
                    via,
                    force: self.force,
                    overrides,
                    given: given.cloned(),
                };
                match assign(master, &job, &mut |note| say(global, &note)) {
                    Ok(report) => tell(global, &report, master.bus().name())?,
                    Err(failure) => {
                        failures.push(failure);
                        break;
                    }
                }
            }
            Ok(())
        })?;
        let done = wanted.len() > 1 && failures.len() < wanted.len();
        Ok(several(if done { wanted.len() } else { 1 }, failures)?)
    }
}

/// What was done: the number bare on stdout, the rest on stderr.
fn tell(global: &Global, report: &Report, bus: &str) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    match global.format {
        Format::Json => json_lss::report(&mut out, report),
        Format::Csv | Format::Text => {
            let rate = report.rate.map(PlannedRate::bare);
            let numbers: Vec<String> = report.new.map(|new| new.to_string()).into_iter().chain(rate).collect();
            writeln!(out, "{}", numbers.join(if global.format == Format::Csv { "," } else { " " }))
        }
    }
    .and_then(|()| out.flush())
    .map_err(stdout)?;
    let console = global.console();
    if let (Some(new), Some(ids)) = (report.new, &report.cob_ids) {
        let boot = match report.boot {
            Some(after) => format!("boot-up from {new} after {:.2} s, identity confirmed", after.as_secs_f64()),
            None => format!("{new} answers, identity confirmed; no boot-up was seen"),
        };
        let tpdos = ids.tpdos.iter().map(|(number, id)| format!("TPDO{number} is at 0x{id}"));
        console.note(&std::iter::once(boot).chain(tpdos).collect::<Vec<_>>().join("; "));
        for stale in &ids.stale {
            let way_on = format!("cangauge sdo write {new} {} 0x{:X}", stale.object, stale.expected);
            console.warn(&format!("{stale}, as node {} had it; new: {way_on}", report.old.map_or(0, NodeId::get)));
        }
    }
    if let (Some(rate), false) = (report.rate_spoken(), report.retimed) {
        console.note(&host_has_to_follow(global, report, bus, &rate));
    }
    if !report.stored {
        console.note("not stored: power off and on brings the old setting back");
    }
    Ok(())
}

/// What has to happen to the host's interface.
fn host_has_to_follow(global: &Global, report: &Report, bus: &str, rate: &str) -> String {
    let bits = report.rate.and_then(|rate| rate.bits);
    let side = match (&global.bus, bits) {
        (Some(BusSpec::SocketCan(_)) | None, Some(bits)) => up_by_hand(bus, Some(bits)),
        _ => format!("this side to {rate}"),
    };
    if report.rate.is_some_and(|rate| rate.is_auto) {
        return "it finds out the bit rate of the bus once it has started again: power it off and on".to_owned();
    }
    if report.stored {
        format!("bit rate {rate} is in force when the device starts again: power it off; {side}; power it on")
    } else {
        let target = report.target.to_string();
        format!("bit rate {rate} is in force after: cangauge lss activate {target} 1s; then {side}")
    }
}
