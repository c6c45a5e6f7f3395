//! The command line: one file a subcommand, with its arguments, its help, the task it runs and the output
//! it gets.

pub mod args;
mod autozero;
mod bus;
mod check;
mod completions;
mod each;
mod errors;
pub mod exit;
mod file;
mod filter;
mod info;
mod limits;
mod log;
mod lss;
mod minmax;
mod nmt;
mod open;
pub mod parse;
mod pdo;
mod read;
mod recording;
mod scan;
mod sdo;
mod sim;
mod store;
mod unit;

use crate::bus::claim::{Claim, Claims};
use crate::master::{Master, Timing};
use crate::output::console::Console;
use anstream::ColorChoice;
use args::{BusSpec, Duration, Override};
use clap::{Args, Parser, Subcommand, ValueEnum};
use exit::IntoFailure;
use std::io::{self, IsTerminal};
use std::path::PathBuf;

const EXAMPLES: &str = "\
Examples, on the simulated bus; leave `-b sim` out where one CAN interface is up:
  cangauge -b sim scan                                   who is there
  cangauge -b sim read 1                                 its measured values now
  cangauge -b sim log 1 --sync 100ms --count 20          its measurements as CSV
  cangauge -b sim log 1-3,127 --sync 10ms --duration 1h -o run.csv
  cangauge -b sim info 1                                 all of one device on one page
  cangauge -b sim unit 127 bar                           its unit, and what that rescales
  cangauge -b sim sdo read 1 0x1018:1                    one object, bare
  cangauge -b sim nmt reset 1                            restart it, wait for the boot-up
  cangauge -b sim lss set-id 127 12                      give it a node-ID, and see it come back

Exit codes:
  0  done                                    5  the bus fails: interface missing, down, bus-off
  1  the answer is no                        6  an unexpected answer or state
  2  usage: nothing was sent                 7  some nodes succeeded and some failed
  3  no answer in time                       8  a file or a stream fails
  4  refused by the device                 130  interrupted before there was a result";

/// Find, configure and log CANopen measuring devices (CiA 404): pressure and temperature transmitters,
/// thermocouple modules
#[derive(Debug, Parser)]
#[command(name = "cangauge", version, after_help = EXAMPLES, max_term_width = 100)]
#[command(propagate_version = true, subcommand_required = true, arg_required_else_help = true)]
pub struct Cli {
    #[command(flatten)]
    pub(crate) global: Global,
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Options of every command.
#[derive(Clone, Debug, Args)]
#[command(next_help_heading = "Global options")]
pub struct Global {
    /// Which bus: can0 (SocketCAN), sim, sim:mh4@5,dps@unconfigured, sim:FILE.toml, replay:FILE (a
    /// candump -L log; receives only). Not given: the only CAN interface that is up
    #[arg(short, long, global = true, env = "CANGAUGE_BUS", value_name = "BUS")]
    pub(crate) bus: Option<BusSpec>,

    /// Longest wait for one answer [default: 500ms; scan: 200ms]
    #[arg(short, long, global = true, value_name = "DUR")]
    pub(crate) timeout: Option<Duration>,

    /// How often a request that got no answer is repeated [default: 1]
    #[arg(long, global = true, value_name = "N")]
    pub(crate) retries: Option<u32>,

    /// Take a device for this one instead of recognising it: mh4, d20, dps, mc1609, hydac, jumo, or a description in
    /// TOML; NODE=NAME for one node of several
    #[arg(long, global = true, value_name = "[NODE=]NAME|FILE")]
    pub(crate) device: Vec<Override>,

    /// Take objects, names and types from an EDS or DCF file; NODE=FILE for one node of several
    #[arg(long, global = true, value_name = "[NODE=]FILE")]
    pub(crate) eds: Vec<Override>,

    /// Form of the output: for people, one object a line, or comma-separated; for log, text means csv
    #[arg(short, long, global = true, value_name = "FORM", default_value = "text")]
    pub(crate) format: Format,

    /// Write every frame sent and received to FILE, as candump -L does; - for stderr
    #[arg(long, global = true, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,

    /// Say less on stderr
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(crate) quiet: bool,

    /// Say more on stderr
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,

    /// Show live values and progress on stderr; auto: on a terminal
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub(crate) progress: When,

    /// Colour on stderr; auto: on a terminal, and without NO_COLOR
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub(crate) color: When,

    /// What the command keeps other cangauges from.
    #[arg(skip)]
    pub(crate) claim: Claim,
}

// No doc comments on the variants: clap would spread each over lines of its own in every help text.

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Format {
    Text,
    Json,
    Csv,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum When {
    Auto,
    Always,
    Never,
}

/// What to do. The first line of each command's own help, which is made up only when it is chosen, stands
/// here again.
#[derive(Debug, Subcommand)]
#[command(defer = true)]
pub(crate) enum Command {
    /// List every node that answers, with its state, identity and recognised device
    Scan(scan::Scan),
    /// Read measured values now, scaled, with unit and status
    Read(read::Read),
    /// Send NMT commands and tell states
    Nmt(nmt::Nmt),
    /// Read and write objects of the object dictionary
    Sdo(sdo::Sdo),
    /// Record measurements as CSV or JSON Lines
    Log(log::Log),
    /// Check measurements against limits: exit code 0 if all hold, 1 if not, 3 without data
    Check(check::Check),
    /// Give devices their node-ID and bit rate (LSS, CiA 305, or objects of the device's own)
    Lss(lss::LssCommand),
    /// Tell everything about one device on one page
    Info(info::Info),
    /// Tell or set the physical unit of a signal (6131h)
    Unit(unit::Unit),
    /// Tell or set the filter of a signal: type (61A0h) and constant (61A1h)
    Filter(filter::Filter),
    /// Tell or set what makes a TPDO of a signal go out by itself: delta, limits, hysteresis (x133h to x136h)
    Limits(limits::Limits),
    /// Tell the lowest and highest value that the device has measured, or reset them
    Minmax(minmax::Minmax),
    /// Tell the errors of a device: register (1001h) and history (1003h) in words, or clear the history
    Errors(errors::Errors),
    /// List CAN interfaces, switch them on and off, find the bit rate of a bus
    Bus(bus::BusCommand),
    /// Show, change and watch what the nodes' transmit PDOs carry
    Pdo(pdo::Pdo),
    /// Make the present reading of a channel zero (6125h), with checks before and after
    Autozero(autozero::Autozero),
    /// Let devices keep their settings beyond power off (1010h)
    Store(store::Store),
    /// Give devices their settings as delivered (1011h); node-ID and bit rate stay
    Restore(store::Restore),
    /// Simulate devices on a bus until Ctrl-C
    Sim(sim::Sim),
    /// Print the completions for a shell
    Completions(completions::Completions),
}

impl Global {
    /// stderr as these options want it.
    pub(crate) fn console(&self) -> Console {
        Console {
            quiet: self.quiet,
            verbose: self.verbose,
            json: self.format == Format::Json,
            color: match self.color {
                When::Auto => ColorChoice::Auto,
                When::Always => ColorChoice::Always,
                When::Never => ColorChoice::Never,
            },
            progress: None,
        }
    }

    /// Whether progress is shown.
    pub(crate) fn shows_progress(&self) -> bool {
        match self.progress {
            When::Auto => !self.quiet && io::stderr().is_terminal(),
            When::Always => true,
            When::Never => false,
        }
    }

    /// The time-outs; `timeout` where the command has another default.
    pub(crate) fn timing(&self, timeout: std::time::Duration) -> Timing {
        Timing {
            timeout: self.timeout.map_or(timeout, |timeout| timeout.0),
            retries: self.retries.unwrap_or(Timing::default().retries),
        }
    }

    /// Runs `work` with a master on the bus.
    pub(crate) fn with_master<T>(&self, work: impl FnOnce(&mut Master<'_>) -> anyhow::Result<T>) -> anyhow::Result<T> {
        self.with_claims(|master, _| work(master))
    }

    /// The same for work that need not keep others away to its end: what it takes of the claims is its own.
    pub(crate) fn with_claims<T>(
        &self,
        work: impl FnOnce(&mut Master<'_>, &mut Claims) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let spec = open::spec(self)?;
        let mut claims = open::claim(self, &spec)?;
        let mut bus = open::open_as(self, &spec, false)?;
        let mut master = Master::new(&mut *bus, self.timing(Timing::default().timeout));
        let result = work(&mut master, &mut claims);
        // What a command leaves behind at its end still goes out: an abort, a node's state.
        master.settle();
        let finished = bus.finish().or_fail();
        let result = result?;
        finished?;
        Ok(result)
    }
}

/// Runs a command line.
///
/// # Errors
/// Why it was not done; [`exit::report`] turns it into words and an exit code.
pub fn run(cli: &Cli) -> anyhow::Result<()> {
    let global = Global { claim: cli.command.claim(), ..cli.global.clone() };
    match &cli.command {
        Command::Scan(command) => command.run(&global),
        Command::Read(command) => command.run(&global),
        Command::Nmt(command) => command.run(&global),
        Command::Sdo(command) => command.run(&global),
        Command::Log(command) => command.run(&global),
        Command::Check(command) => command.run(&global),
        Command::Lss(command) => command.run(&global),
        Command::Info(command) => command.run(&global),
        Command::Unit(command) => command.run(&global),
        Command::Filter(command) => command.run(&global),
        Command::Limits(command) => command.run(&global),
        Command::Minmax(command) => command.run(&global),
        Command::Errors(command) => command.run(&global),
        Command::Bus(command) => command.run(&global),
        Command::Pdo(command) => command.run(&global),
        Command::Autozero(command) => command.run(&global),
        Command::Store(command) => command.run(&global),
        Command::Restore(command) => command.run(&global),
        Command::Sim(command) => command.run(&global),
        Command::Completions(command) => command.run(),
    }
}

/// Gives a command its arguments.
type Augment = fn(clap::Command) -> clap::Command;

/// The commands by name: one is made up without the others.
const ARGUMENTS: [(&str, Augment); 20] = [
    ("scan", scan::Scan::augment_args),
    ("read", read::Read::augment_args),
    ("nmt", nmt::Nmt::augment_args),
    ("sdo", sdo::Sdo::augment_args),
    ("log", log::Log::augment_args),
    ("check", check::Check::augment_args),
    ("lss", lss::LssCommand::augment_args),
    ("info", info::Info::augment_args),
    ("unit", unit::Unit::augment_args),
    ("filter", filter::Filter::augment_args),
    ("limits", limits::Limits::augment_args),
    ("minmax", minmax::Minmax::augment_args),
    ("errors", errors::Errors::augment_args),
    ("bus", bus::BusCommand::augment_args),
    ("pdo", pdo::Pdo::augment_args),
    ("autozero", autozero::Autozero::augment_args),
    ("store", store::Store::augment_args),
    ("restore", store::Restore::augment_args),
    ("sim", sim::Sim::augment_args),
    ("completions", completions::Completions::augment_args),
];

impl Command {
    /// What it does not share with another cangauge while it runs.
    fn claim(&self) -> Claim {
        match self {
            Command::Scan(command) => command.claim(),
            Command::Read(command) => command.claim(),
            Command::Nmt(command) => command.claim(),
            Command::Sdo(command) => command.claim(),
            Command::Log(command) => command.claim(),
            Command::Check(command) => command.claim(),
            Command::Lss(_) => Claim::Bus,
            Command::Info(command) => command.claim(),
            Command::Unit(command) => command.claim(),
            Command::Filter(command) => command.claim(),
            Command::Limits(command) => command.claim(),
            Command::Minmax(command) => command.claim(),
            Command::Errors(command) => command.claim(),
            Command::Pdo(command) => command.claim(),
            Command::Autozero(command) => command.claim(),
            Command::Store(command) => command.claim(),
            Command::Restore(command) => command.claim(),
            Command::Bus(_) | Command::Sim(_) | Command::Completions(_) => Claim::Nothing,
        }
    }
}
