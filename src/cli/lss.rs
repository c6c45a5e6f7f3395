//! `cangauge lss`.

mod assign;

use super::args::Duration;
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::device::catalog::Model;
use cangauge::master::Master;
use cangauge::node::Overrides;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::lss::Identified;
use cangauge::output::notes;
use cangauge::output::progress::Activity;
use cangauge::tasks::lss::{
    Descriptions, LssCause, LssFailure, LssRange, SearchTimes, Target, TargetError, activate, identify, inquire, scan,
    store,
};
use cangauge::tasks::{Failure, Note};
use clap::{Args, Subcommand};
use std::str::FromStr;
use std::sync::Arc;

/// Set the node-ID and bit rate of devices (LSS, CiA 305, or objects of the device)
///
/// TARGET is a node-ID, an identity (VENDOR:PRODUCT:REVISION:SERIAL), "only" or "unconfigured". For a node-ID, the
/// identity is read first, and the device is then addressed by its identity. "only" is rejected if there is more than
/// one device. "unconfigured" is a device without a node-ID, found by fastscan.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim lss scan\n  cangauge -b sim:dps@127 lss set-id 127 12\n  cangauge -b sim:mh4@1 lss set-bitrate 1 500k --retime"
)]
pub(crate) struct LssCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List devices with a node-ID (found by SDO) and without one (found by fastscan)
    Scan,
    /// Read the identity and node-ID of a device by LSS
    Inquire(TargetArgs),
    SetId(assign::SetId),
    SetBitrate(assign::SetBitrate),
    Set(assign::Set),
    /// Activate the configured bit rate. The device is silent for DELAY before the change, and for DELAY after it
    Activate(Activate),
    /// Store node-ID and bit rate in non-volatile memory
    Store(StoreArgs),
    /// Check whether devices have an identity in a range. Exit code 3 if no device answers
    Identify(Identify),
}

#[derive(Debug, Args)]
struct TargetArgs {
    /// Device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
}

#[derive(Debug, Args)]
struct StoreArgs {
    /// Device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// Accept more than one device for "only"
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
struct Activate {
    /// Device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured; or all
    target: AnyTarget,
    /// Delay, from 1ms to 65s; usually 1s
    delay: Duration,
    /// Accept more than one device for "only"
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
struct Identify {
    /// VENDOR:PRODUCT:REVMIN-REVMAX:SERMIN-SERMAX
    range: LssRange,
}

/// One device, or all devices.
#[derive(Clone, Debug)]
enum AnyTarget {
    All,
    One(Target),
}

impl FromStr for AnyTarget {
    type Err = TargetError;

    fn from_str(text: &str) -> Result<AnyTarget, TargetError> {
        match text {
            "all" => Ok(AnyTarget::All),
            _ => text.parse().map(AnyTarget::One),
        }
    }
}

impl LssCommand {
    /// LSS reaches every device, so no other cangauge may use the bus.
    pub(super) fn claim(&self) -> Claim {
        Claim::Bus
    }

    pub(super) fn changes_devices(&self) -> bool {
        !matches!(self.action, Action::Scan | Action::Inquire(_) | Action::Identify(_))
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::Scan => run_scan(global),
            Action::Inquire(args) => args.run(global),
            Action::SetId(args) => args.run(global),
            Action::SetBitrate(args) => args.run(global),
            Action::Set(args) => args.run(global),
            Action::Activate(args) => args.run(global),
            Action::Store(args) => args.run(global),
            Action::Identify(args) => args.run(global),
        }
    }
}

/// The descriptions named by the user.
struct NamedDescriptions {
    overrides: Overrides,
    /// The description that was given without a node.
    given: Option<Arc<Model>>,
}

impl NamedDescriptions {
    fn new(global: &Global) -> anyhow::Result<NamedDescriptions> {
        let all: Vec<NodeId> = NodeId::all().collect();
        let overrides = descriptions::overrides(global, &all)?;
        let named_nodes: Vec<NodeId> = global.device.iter().chain(&global.eds).filter_map(|given| given.node).collect();
        // A description without a node is the override of every node that is not named.
        let given = overrides.iter().find(|(node, _)| !named_nodes.contains(node)).map(|(_, model)| Arc::clone(model));
        Ok(NamedDescriptions { overrides, given })
    }

    fn get(&self) -> Descriptions<'_> {
        Descriptions { overrides: &self.overrides, given: self.given.as_ref() }
    }
}

/// Runs a task with a master on the bus and the descriptions named by the user. Prints the notes of the task.
fn with_descriptions<T>(
    global: &Global,
    work: impl FnOnce(&mut Master<'_>, &Descriptions<'_>, &mut dyn FnMut(Note)) -> Result<T, Failure>,
) -> anyhow::Result<T> {
    let descriptions = NamedDescriptions::new(global)?;
    global.with_master(|master| Ok(work(master, &descriptions.get(), &mut |note| print_note(global, &note))?))
}

fn print_note(global: &Global, note: &Note) {
    notes::print(&global.console(), note);
}

fn failed(cause: LssCause) -> anyhow::Error {
    Failure::general(LssFailure::general(cause)).into()
}

fn run_scan(global: &Global) -> anyhow::Result<()> {
    let found = global.with_master(|master| {
        let activity = Activity::new(global.shows_progress(), "searching for devices");
        let times = global.timeout.map_or_else(SearchTimes::default, |timeout| SearchTimes::patient(timeout.0));
        Ok(scan(master, times, &mut |note| activity.above(|| print_note(global, &note)))?)
    })?;
    global.print(&found)?;
    if found.is_empty() { Err(failed(LssCause::NoDevice)) } else { Ok(()) }
}

impl TargetArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let inquired = with_descriptions(global, |master, named, notify| inquire(master, &self.target, named, notify))?;
        global.print(&[inquired])
    }
}

impl StoreArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        with_descriptions(global, |master, named, notify| store(master, &self.target, named, self.force, notify))?;
        global.console().note("stored: the device acknowledged it");
        Ok(())
    }
}

impl Activate {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let delay_ms = u16::try_from(self.delay.0.as_millis()).ok().filter(|&delay| delay > 0).ok_or_else(|| {
            ErrorMessage::usage("the delay must be from 1ms to 65.535s (CiA 305 has 16 bits for milliseconds)")
        })?;
        let target = match &self.target {
            AnyTarget::All => None,
            AnyTarget::One(target) => Some(target),
        };
        with_descriptions(global, |master, named, notify| {
            activate(master, target, delay_ms, named, self.force, notify)
        })?;
        let silent = cangauge::bus::time::format_duration(2 * self.delay.0);
        global.console().note(&format!(
            "sent; devices do not acknowledge this. The new bit rate is active in {silent}: set the host to it"
        ));
        Ok(())
    }
}

impl Identify {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let answered = global.with_master(|master| Ok(identify(master, &self.range)?))?;
        if !answered {
            return Err(failed(LssCause::NoneInRange(self.range)));
        }
        global.print(&[Identified { range: self.range }])
    }
}
