//! `cangauge lss set-id`, `set-bitrate` and `set`.

use super::{NamedDescriptions, print_note};
use crate::cli::Global;
use crate::cli::args::{BitRate, BusSpec, Nodes};
use crate::cli::exit::several;
use cangauge::canopen::id::NodeId;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::lss::AssignReport;
use cangauge::output::notes;
use cangauge::output::report::Stream;
use cangauge::tasks::lss::{Job, RequestedRate, Target, Via, assign, check_rate, check_store};
use clap::{Args, ValueEnum};
use std::str::FromStr;

/// Set the node-ID of a device: check that the node-ID is free, configure, store, reset, confirm
///
/// The command succeeds if the device sends its boot-up message and reports its identity with the new node-ID. COB-IDs
/// that still contain the old node-ID are reported.
#[derive(Debug, Args)]
pub(super) struct SetId {
    /// Device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// New node-ID. For "unconfigured" also a range (12-14): one node-ID for each device
    new: Nodes,
    #[command(flatten)]
    options: Options,
}

/// Set the bit rate of a device
///
/// The bit rate takes effect at the next start of the device, or at once with --retime.
#[derive(Debug, Args)]
pub(super) struct SetBitrate {
    /// Device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// 250k, 1M, 125000; auto if the device supports it
    #[arg(required_unless_present = "table_index")]
    rate: Option<RateArg>,
    #[command(flatten)]
    rates: RateOptions,
    #[command(flatten)]
    options: Options,
}

/// Set the node-ID and bit rate of a device, with a single store and a single reset
#[derive(Debug, Args)]
pub(super) struct Set {
    /// Device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// New node-ID
    #[arg(long, value_name = "NEW")]
    id: NodeId,
    /// 250k, 1M, 125000; auto if the device supports it
    #[arg(long, value_name = "RATE", required_unless_present = "table_index")]
    bitrate: Option<RateArg>,
    #[command(flatten)]
    rates: RateOptions,
    #[command(flatten)]
    options: Options,
}

#[derive(Debug, Args)]
struct RateOptions {
    /// Index of the bit rate in the table of the device. With --retime, also give RATE
    #[arg(long, value_name = "N")]
    table_index: Option<u8>,
    /// Also set the bit rate of the host interface, and store after the device responds at the new bit rate. It must be
    /// the only device on the bus
    #[arg(long)]
    retime: bool,
}

#[derive(Debug, Args)]
struct Options {
    /// Do not store: a power cycle restores the old values
    #[arg(long)]
    no_store: bool,
    /// Method: lss, sdo (objects of the device), or auto (the preferred method in its description)
    #[arg(long, value_name = "WAY", default_value = "auto")]
    via: ViaArg,
    /// Accept more than one device for "only": all of them are changed
    #[arg(long)]
    force: bool,
}

// The variants have no doc comments, because clap would print each one on its own line.

#[derive(Clone, Copy, Debug, ValueEnum)]
enum ViaArg {
    Auto,
    Lss,
    Sdo,
}

impl From<ViaArg> for Via {
    fn from(via: ViaArg) -> Via {
        match via {
            ViaArg::Auto => Via::Auto,
            ViaArg::Lss => Via::Lss,
            ViaArg::Sdo => Via::Sdo,
        }
    }
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
    fn rate(&self, rate: Option<RateArg>) -> Result<Option<RequestedRate>, ErrorMessage> {
        Ok(match (rate, self.table_index) {
            (Some(RateArg::Auto), Some(_)) => {
                return Err(ErrorMessage::usage("use either auto or --table-index"));
            }
            (Some(RateArg::Auto), None) => Some(RequestedRate::Auto),
            (Some(RateArg::Bits(bits)), None) => Some(RequestedRate::Bits(bits.0)),
            (Some(RateArg::Bits(bits)), Some(index)) => Some(RequestedRate::Index(index, Some(bits.0))),
            (None, index) => index.map(|index| RequestedRate::Index(index, None)),
        })
    }
}

/// Node-ID and bit rate to set, and whether the host also changes its bit rate.
#[derive(Clone, Copy, Debug)]
struct Values {
    id: Option<NodeId>,
    rate: Option<RequestedRate>,
    retime: bool,
}

impl SetId {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let nodes = match (&self.new, &self.target) {
            (Nodes::These(nodes), Target::Unconfigured) => nodes.clone(),
            (Nodes::These(nodes), _) if nodes.len() == 1 => nodes.clone(),
            _ => {
                let message = "give one new node-ID; several are possible for the target \"unconfigured\" only";
                return Err(ErrorMessage::usage(message).into());
            }
        };
        let values: Vec<Values> =
            nodes.into_iter().map(|id| Values { id: Some(id), rate: None, retime: false }).collect();
        self.options.run(global, &self.target, &values)
    }
}

impl SetBitrate {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let rate = self.rates.rate(self.rate)?;
        self.options.run(global, &self.target, &[Values { id: None, rate, retime: self.rates.retime }])
    }
}

impl Set {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let rate = self.rates.rate(self.bitrate)?;
        self.options.run(global, &self.target, &[Values { id: Some(self.id), rate, retime: self.rates.retime }])
    }
}

impl Options {
    fn run(&self, global: &Global, target: &Target, all: &[Values]) -> anyhow::Result<()> {
        let named = NamedDescriptions::new(global)?;
        let (descriptions, via) = (named.get(), Via::from(self.via));
        // If the user named a description, unsupported values are rejected before the bus is opened.
        let model = match target {
            Target::Node(node) => descriptions.overrides.get(node),
            _ => descriptions.given,
        };
        if let Some(model) = model {
            check_store(&model.description, !self.no_store, via)?;
            all.iter()
                .filter_map(|values| values.rate)
                .try_for_each(|rate| check_rate(&model.description, rate, via))?;
        }
        let mut failures = Vec::new();
        let mut reports = global.stream::<AssignReport>()?;
        global.with_master(|master| {
            for &Values { id, rate, retime } in all {
                let (store, force) = (!self.no_store, self.force);
                let job = Job { target: target.clone(), id, rate, store, retime, via, force, descriptions };
                match assign(master, &job, &mut |note| print_note(global, &note)) {
                    Ok(assigned) => {
                        let on_host = matches!(&global.bus, Some(BusSpec::SocketCan(_)) | None);
                        let interface = on_host.then(|| master.bus().name().to_owned());
                        report(global, &AssignReport { assigned, interface }, &mut reports)?;
                    }
                    Err(failure) => {
                        failures.push(failure);
                        break;
                    }
                }
            }
            Ok(())
        })?;
        let some_succeeded = all.len() > 1 && failures.len() < all.len();
        Ok(several(if some_succeeded { all.len() } else { 1 }, failures)?)
    }
}

/// Prints the result to stdout, and its confirmation and notes to stderr.
fn report(
    global: &Global,
    report: &AssignReport,
    reports: &mut Stream<AssignReport, std::io::Stdout>,
) -> anyhow::Result<()> {
    reports.push(report).map_err(crate::cli::exit::stdout)?;
    let console = global.console();
    if let Some(confirmation) = report.confirmation() {
        console.note(&confirmation);
    }
    report.notes().iter().for_each(|note| notes::print_text(&console, note));
    Ok(())
}
