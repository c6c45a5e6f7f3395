//! The command line: one file per subcommand, with its arguments, its help text, and the task that it runs.

pub mod args;
mod autozero;
mod bus;
mod check;
pub mod completions;
mod config;
mod conform;
mod descriptions;
mod devices;
mod doctor;
mod effects;
mod errors;
pub mod exit;
mod export;
mod file;
mod filter;
mod health;
mod info;
mod journal;
mod limits;
mod log;
mod lss;
mod minmax;
mod monitor;
mod nmt;
mod nodes;
mod objects;
mod open;
mod own;
pub mod parse;
mod pdo;
mod plot;
#[cfg(feature = "publish")]
mod publish;
mod read;
mod recording;
mod scan;
mod sdo;
mod sim;
mod store;
mod tare;
#[cfg(test)]
mod tests;
mod unit;

use anstream::{AutoStream, ColorChoice};
use args::{BusSpec, Channel, Duration, Load, Override, one_of};
use cangauge::bus::claim::{Claim, Claims};
use cangauge::bus::interrupt::handle_file_size_limit;
use cangauge::canopen::id::NodeId;
use cangauge::master::{Master, OnTwoDevices, Timing};
use cangauge::output;
use cangauge::output::console::Console;
pub(crate) use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes::undone_text;
use cangauge::output::report::{Format, Report, Stream, render};
use cangauge::output::rows::CHOICES;
use cangauge::tasks::journal::Journal;
use clap::{Args, CommandFactory, Parser, Subcommand, ValueEnum};
use descriptions::Named;
use exit::{FileError, IntoFailure};
use journal::FileJournal;
use std::cell::RefCell;
use std::io::{self, IsTerminal};
use std::path::PathBuf;

/// The line about the global options in the help of each command.
const GLOBAL_OPTIONS: &str = "Global options: see cangauge --help";

const EXAMPLES: &str = "\
Buses:
  can0                      a SocketCAN interface
  slcan:/dev/ttyACM0@250k   a serial adapter, and the bit rate of the bus
  slcan:tcp://HOST:PORT@250k
                            a serial adapter on the network
  socketcand://HOST/can0    a CAN interface of another computer
  sim                       four simulated devices
  sim:mh4@5,dps@127         other simulated devices
  sim:mh4@5:pressure=0bar:temperature=20degC
                            a simulated device with constant values
  sim:FILE.toml             the devices in a bench file
  replay:FILE               a recording of candump, Vector ASC, PEAK TRC or
                            python-can CSV; receive only
  replay:FILE:can1          one channel of a recording

Examples:
  cangauge -b sim scan                             find the nodes
  cangauge -b sim read 1                           read measured values
  cangauge -b sim log 1 --sync 100ms --count 20    record measurements as CSV
  cangauge -b sim log 1-3,127 --sync 10ms --duration 1h -o run.csv
  cangauge -b sim info 1                           show all about a device
  cangauge -b sim unit 127 bar                     set the unit
  cangauge -b sim sdo read 1 0x1018:1              read one object
  cangauge -b sim nmt reset 1                      reset a node
  cangauge -b sim lss set-id 127 12                set and verify the node-ID
These examples use the simulated bus. For a real bus, omit -b sim.

Exit codes:
  0    success
  1    check failed, or stopped for safety
  2    usage error: nothing was changed
  3    no answer in time
  4    rejected by the device
  5    bus error: the interface is missing, down or bus-off
  6    unexpected answer or state
  7    some nodes succeeded and some failed
  8    file or stream error
  130  interrupted before there was a result";

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
    /// Bus: can0, slcan:..., socketcand://..., sim, sim:..., replay:FILE (see below) [default: the only CAN interface
    /// that is up]
    #[arg(short, long, global = true, env = "CANGAUGE_BUS", value_name = "BUS")]
    pub(crate) bus: Option<BusSpec>,

    /// Longest wait for one answer [default: 500ms; scan: 200ms]
    #[arg(short, long, global = true, value_name = "DUR")]
    pub(crate) timeout: Option<Duration>,

    /// Number of times to repeat a request without an answer [default: 1]
    #[arg(long, global = true, value_name = "N")]
    pub(crate) retries: Option<u32>,

    /// Use this device description instead of the recognised one: a name or a TOML file. For one of several nodes:
    /// NODE=NAME
    #[arg(long, global = true, value_name = "[NODE=]NAME|FILE")]
    pub(crate) device: Vec<Override>,

    /// Use objects, names and types from an EDS or DCF file. For one of several nodes: NODE=FILE
    #[arg(long, global = true, value_name = "[NODE=]FILE")]
    pub(crate) eds: Vec<Override>,

    /// COB-IDs of the SDO requests and answers, if they are not the usual COB-IDs: 0x645:0x5C5. For one of several
    /// nodes: NODE=TX:RX
    #[arg(long, global = true, value_name = "[NODE=]TX:RX")]
    pub(crate) sdo: Vec<Channel>,

    /// Use a description or EDS of another device (its vendor or product differs)
    #[arg(long, global = true)]
    pub(crate) accept_mismatch: bool,

    /// Highest total bus load: SDO requests wait while the load is higher [default: 50% while other nodes send,
    /// otherwise no limit]
    #[arg(long, global = true, value_name = "SHARE")]
    pub(crate) max_load: Option<Load>,

    /// Output format (influx: InfluxDB line protocol, for log only). For log, text means csv
    #[arg(short, long, global = true, value_name = "FORM", default_value = "text")]
    #[arg(value_parser = one_of(CHOICES, Format::name))]
    pub(crate) format: Format,

    /// Wait up to DUR if the CAN interface is missing or down
    #[arg(long, global = true, value_name = "DUR")]
    pub(crate) wait: Option<Duration>,

    /// Replay a recording (replay:) in real time
    #[arg(long, global = true)]
    pub(crate) pace: bool,

    /// Write every frame to FILE in the format of candump -L, or for Wireshark if the name ends in .pcapng; - for
    /// stderr
    #[arg(long, global = true, value_name = "FILE")]
    pub(crate) trace: Option<PathBuf>,

    /// Continue although another program uses the same nodes
    #[arg(long, global = true)]
    pub(crate) ignore_lock: bool,

    /// Print less on stderr
    #[arg(short, long, global = true, conflicts_with = "verbose")]
    pub(crate) quiet: bool,

    /// Print more on stderr
    #[arg(short, long, global = true, action = clap::ArgAction::Count)]
    pub(crate) verbose: u8,

    /// Show live values and progress on stderr; auto: only on a terminal
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub(crate) progress: When,

    /// Use colour on stderr; auto: only on a terminal without NO_COLOR
    #[arg(long, global = true, value_name = "WHEN", default_value = "auto")]
    pub(crate) color: When,

    /// The nodes that no other cangauge may use at the same time.
    #[arg(skip)]
    pub(crate) claim: Claim,

    /// Whether the command only reads. A description for another device then causes a warning and no error.
    #[arg(skip)]
    pub(crate) only_reads: bool,

    /// Whether the command only listens.
    #[arg(skip)]
    pub(crate) listens_only: bool,

    /// The reaction of the command if two devices have the same node-ID.
    #[arg(skip)]
    pub(crate) on_two_devices: OnTwoDevices,

    /// Whether the command shows NMT states. Unusual heartbeats are then reported.
    #[arg(skip)]
    pub(crate) shows_states: bool,

    /// Descriptions, and the nodes whose devices must still be compared with them.
    #[arg(skip)]
    pub(crate) pending: RefCell<Option<(Vec<Named>, Vec<NodeId>)>>,
}

// The variants have no doc comments, because clap would print each one on its own line.

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum When {
    Auto,
    Always,
    Never,
}

/// Registers the commands: condition, variant, type of the arguments, name, aliases. Each type has a
/// `claim` (the nodes that no other cangauge may use) and a `run`. Its doc comment is the help text.
macro_rules! commands {
    ($($(#[$condition:meta])? $variant:ident($arguments:ty): $name:literal $(| $alias:literal)*;)+) => {
        // The doc comment of the type is the help of the command.
        #[allow(missing_docs)]
        #[derive(Debug, Subcommand)]
        pub(crate) enum Command {
            $(
                $(#[$condition])?
                #[command(name = $name)]
                $(#[command(visible_alias = $alias)])*
                $variant($arguments),
            )+
        }

        impl Command {
            /// The nodes that no other cangauge may use at the same time.
            fn claim(&self) -> Claim {
                match self {
                    $($(#[$condition])? Command::$variant(command) => command.claim(),)+
                }
            }

            fn run(&self, global: &Global) -> anyhow::Result<()> {
                match self {
                    $($(#[$condition])? Command::$variant(command) => command.run(global),)+
                }
            }
        }

        /// Names of a command, and the function that adds its arguments. Each command can be built without the others.
        const ARGUMENTS: &[(&[&str], Augment)] =
            &[$($(#[$condition])? (&[$name $(, $alias)*], <$arguments>::augment_args)),+];
    };
}

commands! {
    Scan(scan::Scan): "scan" | "ls";
    Read(read::Read): "read";
    Nmt(nmt::Nmt): "nmt";
    Sdo(sdo::Sdo): "sdo";
    Log(log::Log): "log";
    Check(check::Check): "check";
    Lss(lss::LssCommand): "lss";
    Info(info::Info): "info" | "status";
    Unit(unit::Unit): "unit";
    Filter(filter::Filter): "filter";
    Limits(limits::Limits): "limits";
    Minmax(minmax::Minmax): "minmax";
    Errors(errors::Errors): "errors";
    Bus(bus::BusCommand): "bus";
    Pdo(pdo::Pdo): "pdo";
    Config(config::Config): "config";
    Autozero(autozero::Autozero): "autozero" | "zero";
    Tare(tare::Tare): "tare";
    Store(store::Store): "store";
    Restore(store::Restore): "restore";
    Sim(sim::Sim): "sim";
    Doctor(doctor::Doctor): "doctor";
    Conform(conform::Conform): "conform";
    Monitor(monitor::Monitor): "monitor";
    Health(health::HealthCommand): "health";
    Objects(objects::Objects): "objects";
    Export(export::Export): "export";
    Plot(plot::Plot): "plot";
    #[cfg(feature = "publish")] Publish(publish::Publish): "publish";
    Devices(devices::Devices): "devices";
    Completions(completions::Completions): "completions";
}

/// Whether the text after `sim:` names a bench file, and not devices.
fn is_bench_file(bench: &Option<String>) -> bool {
    bench.as_ref().is_some_and(|bench| bench.ends_with(".toml"))
}

/// Adds the arguments of a command.
type Augment = fn(clap::Command) -> clap::Command;

impl Global {
    /// Returns the console, which prints to stderr with these options.
    pub(crate) fn console(&self) -> Console {
        Console {
            quiet: self.quiet,
            verbose: self.verbose,
            json: self.format.is_json(),
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

    /// Returns the time-out and the retries; `timeout` is the default of the command.
    pub(crate) fn timing(&self, timeout: std::time::Duration) -> Timing {
        Timing {
            timeout: self.timeout.map_or(timeout, |timeout| timeout.0),
            retries: self.retries.unwrap_or(Timing::default().retries),
        }
    }

    /// Whether the output is text.
    pub(crate) fn prints_text(&self) -> bool {
        self.format.is_text()
    }

    /// Prints reports to stdout in the chosen format.
    pub(crate) fn print<R: Report>(&self, reports: &[R]) -> anyhow::Result<()> {
        let stdout = exit::open_stdout()?;
        // Only text has colours. Data is not changed.
        let color = if self.prints_text() { self.console().color } else { ColorChoice::AlwaysAnsi };
        render(reports, self.format, &mut AutoStream::new(stdout, color).lock()).map_err(exit::stdout)
    }

    /// Prints reports as JSON or CSV. If the format is text, calls `text` instead.
    pub(crate) fn print_or<R: Report>(
        &self,
        reports: &[R],
        text: impl FnOnce(&mut dyn io::Write) -> io::Result<()>,
    ) -> anyhow::Result<()> {
        if !self.prints_text() {
            return self.print(reports);
        }
        text(&mut exit::open_stdout()?.lock()).map_err(exit::stdout)
    }

    /// Prints reports as JSON or CSV. For text, the command prints a note on stderr instead.
    pub(crate) fn print_data<R: Report>(&self, reports: &[R]) -> anyhow::Result<()> {
        self.print_or(reports, |_| Ok(()))
    }

    /// Prints the results of a failed command, if the format is JSON.
    pub(crate) fn print_json<R: Report>(&self, reports: &[R]) -> anyhow::Result<()> {
        if self.format.is_json() { self.print(reports) } else { Ok(()) }
    }

    /// Prints reports one by one as they arrive.
    pub(crate) fn stream<R: Report>(&self) -> anyhow::Result<Stream<R, io::Stdout>> {
        Stream::new(self.format, exit::open_stdout()?).map_err(exit::stdout)
    }

    /// Runs `work` with a master on the bus.
    pub(crate) fn with_master<T>(&self, work: impl FnOnce(&mut Master<'_>) -> anyhow::Result<T>) -> anyhow::Result<T> {
        self.with_claims(|master, _| work(master))
    }

    /// Like [`Global::with_master`], for work that can release its claims before it ends.
    pub(crate) fn with_claims<T>(
        &self,
        work: impl FnOnce(&mut Master<'_>, &mut Claims) -> anyhow::Result<T>,
    ) -> anyhow::Result<T> {
        let spec = open::spec(self)?;
        let mut claims = open::claim(self, &spec)?;
        let mut bus = open::open_as(self, &spec, false)?;
        let mut master = Master::new(&mut *bus, self.timing(Timing::default().timeout));
        master.set_on_two_devices(self.on_two_devices);
        let result = self
            .undo_left_behind(&mut master, &spec)
            .and_then(|()| descriptions::check_pending(&mut master, self))
            .and_then(|()| work(&mut master, &mut claims));
        // Sends the last frames of a command: an abort, or a command that restores an NMT state.
        master.settle();
        for (node, answers) in master.second_answers() {
            // If the answers differ, the failure of the command reports it, except in a scan.
            if !answers.differs() || self.on_two_devices == OnTwoDevices::Report {
                self.console().warn(&output::failure::second_answer(node, answers));
            }
        }
        for (node, length) in master.unusual_heartbeats().filter(|_| self.shows_states) {
            self.console().warn(&output::events::heartbeat_text(node, length));
        }
        let unknown = master.unknown_objects();
        let finished = bus.finish().or_fail();
        // Printed before the failure, because an unknown object can be its cause: without 1000h, types are unknown.
        let note = |(&node, objects): (&NodeId, &Vec<_>)| output::failure::unknown_objects(node, objects);
        unknown.iter().map(note).for_each(|text| self.console().note(&text));
        let result = result?;
        finished?;
        Ok(result)
    }

    /// Undoes the temporary writes of a killed program on the nodes of this command.
    fn undo_left_behind(&self, master: &mut Master<'_>, bus: &BusSpec) -> anyhow::Result<()> {
        let is_ours = |node: NodeId| match &self.claim {
            Claim::Nothing => false,
            Claim::Nodes(nodes) => nodes.contains(&node),
            Claim::Bus => true,
        };
        let mut journal = FileJournal::of(bus);
        for write in journal.left_behind(&is_ours) {
            master.listen_to(&[write.node]).or_fail()?;
            let undone = write.undo(master).or_fail()?;
            self.console().warn(&undone_text(&write, undone));
            if !undone.is_open() {
                journal.remove(&write);
            }
        }
        Ok(())
    }
}

/// Runs a command line.
///
/// # Errors
/// The failure of the command; [`exit::report`] converts it to text and an exit code.
pub fn run(cli: &Cli) -> anyhow::Result<()> {
    let failed = |source| FileError { what: "watch for the file size limit".to_owned(), source };
    handle_file_size_limit().map_err(failed)?;
    if cli.global.format.is_for_recordings() && !matches!(cli.command, Command::Log(_)) {
        let message = format!("--format {} is only for recordings (log)", cli.global.format.name());
        return Err(ErrorMessage::usage(message).into());
    }
    let global = Global {
        claim: cli.command.claim(),
        only_reads: cli.command.only_reads(),
        listens_only: cli.command.listens_only(),
        on_two_devices: cli.command.on_two_devices(),
        shows_states: matches!(cli.command, Command::Scan(_) | Command::Nmt(_)),
        ..cli.global.clone()
    };
    let broken = own::load()?;
    if !matches!(cli.command, Command::Completions(_)) {
        own::report(&broken, &global);
    }
    cli.command.run(&global)?;
    if cli.command.changes_devices() && matches!(&global.bus, Some(BusSpec::Sim(bench)) if !is_bench_file(bench)) {
        global.console().note("each command starts the simulated devices with default settings: this change is lost");
    }
    Ok(())
}

/// The program with its commands. The global options are described only in the help of the program. Other help texts
/// refer to it in one line.
pub fn program() -> clap::Command {
    fn with_hidden_globals(command: clap::Command) -> clap::Command {
        let globals = Global::augment_args(clap::Command::new("globals"));
        let hidden = globals.get_arguments().map(|argument| argument.clone().hide(true));
        let notes = command.get_after_help().map(|notes| format!("{notes}\n\n")).unwrap_or_default();
        let names: Vec<String> = command.get_subcommands().map(|command| command.get_name().to_owned()).collect();
        let command = command.args(hidden).after_help(notes + GLOBAL_OPTIONS);
        names.into_iter().fold(command, |command, name| command.mut_subcommand(name, with_hidden_globals))
    }
    let program = Cli::command();
    let names: Vec<String> = program.get_subcommands().map(|command| command.get_name().to_owned()).collect();
    names.into_iter().fold(program, |program, name| program.mut_subcommand(name, with_hidden_globals))
}
