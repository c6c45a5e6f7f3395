//! `cangauge lss`.

mod assign;

use super::args::Duration;
use super::exit::stdout;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::device::catalog::Model;
use crate::master::Master;
use crate::node::Overrides;
use crate::output::{csv, json_lss, table};
use crate::tasks::lss::{LssAddress, LssRange, Named, Note, Slave, Target, activate, identify, inquire, scan, store};
use crate::tasks::{Failure, Kind};
use clap::{Args, Subcommand};
use std::io::{self, Write};
use std::str::FromStr;
use std::sync::Arc;

/// Give devices their node-ID and bit rate (LSS, CiA 305, or objects of the device's own)
///
/// TARGET is a node-ID (its identity is read, and it is addressed by that), VENDOR:PRODUCT:REVISION:SERIAL,
/// "only" (refused where more than one device shows itself), or "unconfigured" (found by fastscan).
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
    /// List who can be given a node-ID: those that have one by SDO, those that have none by fastscan
    Scan,
    /// Ask a device for its identity and node-ID by LSS
    Inquire(TargetArgs),
    SetId(assign::SetId),
    SetBitrate(assign::SetBitrate),
    Set(assign::Set),
    /// Bring configured bit rates into force: so long they go on, as long again they are silent
    Activate(Activate),
    /// Make node-ID and bit rate last
    Store(StoreArgs),
    /// Ask whether there are devices with numbers within limits; exit 3 where nobody answers
    Identify(Identify),
}

#[derive(Debug, Args)]
struct TargetArgs {
    /// Which device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
}

#[derive(Debug, Args)]
struct StoreArgs {
    /// Which device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured
    target: Target,
    /// "only" goes on where more than one device shows itself
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
struct Activate {
    /// Which device: 5, VENDOR:PRODUCT:REVISION:SERIAL, only, unconfigured; all is everybody
    target: Everybody,
    /// The delay, from 1ms to 65s: 1s
    delay: Duration,
    /// "only" goes on where more than one device shows itself
    #[arg(long)]
    force: bool,
}

#[derive(Debug, Args)]
struct Identify {
    /// VENDOR:PRODUCT:REVMIN-REVMAX:SERMIN-SERMAX
    range: LssRange,
}

/// One device, or all of them.
#[derive(Clone, Debug)]
enum Everybody {
    All,
    One(Target),
}

impl FromStr for Everybody {
    type Err = String;

    fn from_str(text: &str) -> Result<Everybody, String> {
        match text {
            "all" => Ok(Everybody::All),
            _ => text.parse().map(Everybody::One).map_err(|error: crate::tasks::lss::TargetError| error.to_string()),
        }
    }
}

impl LssCommand {
    /// LSS has no addresses of its own: the command needs the bus alone.
    pub(super) fn claim(&self) -> Claim {
        Claim::Bus
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::Scan => run_scan(global),
            Action::Inquire(args) => args.run(global),
            Action::SetId(args) => args.run(global),
            Action::SetBitrate(args) => args.run(global),
            Action::Set(args) => args.run(global),
            Action::Activate(args) => args.run(global),
            Action::Store(args) => {
                with_named(global, |master, named, tell| Ok(store(master, &args.target, named, args.force, tell)?))?;
                global.console().note("stored: the device acknowledged it");
                Ok(())
            }
            Action::Identify(args) => args.run(global),
        }
    }
}

/// What the user says of descriptions.
struct Descriptions {
    overrides: Overrides,
    given: Option<Arc<Model>>,
}

impl Descriptions {
    fn new(global: &Global) -> anyhow::Result<Descriptions> {
        let all: Vec<NodeId> = NodeId::all().collect();
        let overrides = open::overrides(global, &all)?;
        let named: Vec<NodeId> = global.device.iter().chain(&global.eds).filter_map(|given| given.node).collect();
        // What was given for no node in particular stands with every node that was not named.
        let given = overrides.iter().find(|(node, _)| !named.contains(node)).map(|(_, model)| Arc::clone(model));
        Ok(Descriptions { overrides, given })
    }

    fn named(&self) -> Named<'_> {
        (&self.overrides, self.given.as_ref())
    }
}

/// Runs a task with a master on the bus and what the user says of descriptions.
fn with_named<T>(
    global: &Global,
    work: impl FnOnce(&mut Master<'_>, Named<'_>, &mut dyn FnMut(Note)) -> anyhow::Result<T>,
) -> anyhow::Result<T> {
    let descriptions = Descriptions::new(global)?;
    global.with_master(|master| work(master, descriptions.named(), &mut |note| say(global, &note)))
}

fn say(global: &Global, note: &Note) {
    match note {
        Note::Step(text) => global.console().note(text),
        Note::Warning(text) => global.console().warn(text),
    }
}

fn run_scan(global: &Global) -> anyhow::Result<()> {
    let found = global.with_master(|master| Ok(scan(master, &mut |note| say(global, &note))?))?;
    print(&found, global.format).map_err(stdout)?;
    if found.is_empty() {
        let failure = Failure::new(Kind::NoAnswer, "nobody answers, neither by SDO nor by LSS fastscan");
        return Err(failure.hint("check power, wiring and bit rate: cangauge scan").into());
    }
    Ok(())
}

impl TargetArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let told = with_named(global, |master, named, tell| Ok(inquire(master, &self.target, named, tell)?))?;
        let node = told.node.map(|node| node.map_or_else(|| "-".to_owned(), |node| node.to_string()));
        let address = told.address.map(|address| address.to_string());
        let mut out = io::stdout().lock();
        match global.format {
            Format::Json => json_lss::inquired(&mut out, &self.target.to_string(), &told),
            Format::Csv => {
                writeln!(out, "{},{}", address.unwrap_or_default(), node.unwrap_or_default())
            }
            Format::Text => {
                let parts: Vec<String> = address.into_iter().chain(node.map(|node| format!("node {node}"))).collect();
                writeln!(out, "{}", parts.join("  "))
            }
        }
        .and_then(|()| out.flush())
        .map_err(stdout)
    }
}

impl Activate {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let delay_ms = u16::try_from(self.delay.0.as_millis()).ok().filter(|&delay| delay > 0).ok_or_else(|| {
            Failure::new(Kind::Usage, "the delay goes from 1ms to 65.535s (CiA 305 has 16 bits for milliseconds)")
        })?;
        let target = match &self.target {
            Everybody::All => None,
            Everybody::One(target) => Some(target),
        };
        with_named(global, |master, named, tell| Ok(activate(master, target, delay_ms, named, self.force, tell)?))?;
        let silent = crate::bus::time::spoken(2 * self.delay.0);
        let said =
            format!("sent, and nobody answers it: in {silent} the new bit rate is in force; this side follows by hand");
        global.console().note(&said);
        Ok(())
    }
}

impl Identify {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let answered = global.with_master(|master| Ok(identify(master, &self.range)?))?;
        if !answered {
            return Err(Failure::new(Kind::NoAnswer, format!("no LSS slave within {} answers", self.range)).into());
        }
        let mut out = io::stdout().lock();
        match global.format {
            Format::Json => json_lss::identified(&mut out, &self.range.to_string()),
            Format::Csv | Format::Text => writeln!(out, "yes"),
        }
        .and_then(|()| out.flush())
        .map_err(stdout)
    }
}

fn print(found: &[Slave], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match format {
        Format::Json => found.iter().try_for_each(|slave| json_lss::slave(&mut out, slave))?,
        Format::Csv => {
            let head = ["node", "device", "vendor", "product", "revision", "serial"];
            csv::write(&mut out, &head, found.iter().map(|slave| row(slave, "")))?;
        }
        Format::Text if found.is_empty() => {}
        Format::Text => {
            let head = HEAD.map(str::to_owned).to_vec();
            let rows: Vec<_> = std::iter::once(head).chain(found.iter().map(|slave| row(slave, "-"))).collect();
            use table::Align::{Left, Right};
            table::write(&mut out, &[Right, Left, Left, Left, Left, Right], &rows)?;
        }
    }
    out.flush()
}

const HEAD: [&str; 6] = ["NODE", "DEVICE", "VENDOR", "PRODUCT", "REVISION", "SERIAL"];

fn row(slave: &Slave, missing: &str) -> Vec<String> {
    let part = |part: fn(&LssAddress) -> u32| slave.address.as_ref().map(|address| format!("0x{:08X}", part(address)));
    [
        slave.node.map(|node| node.to_string()),
        slave.model.as_ref().map(|model| model.description.name.clone()),
        part(|address| address.vendor),
        part(|address| address.product),
        part(|address| address.revision),
        slave.address.map(|address| address.serial.to_string()),
    ]
    .map(|cell| cell.unwrap_or_else(|| missing.to_owned()))
    .to_vec()
}
