//! `cangauge bus`.

mod host;

use super::args::{BusSpec, Duration, InterfaceName, Rate};
use super::exit::{IntoFailure, stdout};
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::output::interfaces::{self, Interface};
use crate::tasks::detect::{By, Detection, How, Tried, detect};
use crate::tasks::{Failure, Kind};
use clap::{Args, Subcommand};
use std::io::{self, Write};

/// List CAN interfaces, switch them on and off, find the bit rate of a bus
///
/// Setting an interface takes root (CAP_NET_ADMIN); without it the lines to type are said.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge bus list\n  cangauge bus up can0 250k\n  cangauge bus detect can0\n  cangauge bus down can0"
)]
pub(crate) struct BusCommand {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
enum Action {
    /// List the CAN interfaces of this machine with bit rate, state and error counters
    List,
    /// Switch an interface on, at a bit rate
    ///
    /// One that is up at this rate is left alone; one that is up at another goes down for a moment. Only the
    /// bit rate, the listen-only mode and the switch are set. What was set is read back.
    Up(Up),
    /// Switch an interface off
    Down(Down),
    /// Find the bit rate of a running bus by listening only; prints it in bit/s
    ///
    /// The usual bit rates are tried one after the other, the interface's own first, until valid frames are
    /// heard. Nothing is sent, acknowledged or disturbed. At the end, on Ctrl-C too, the interface is put
    /// back as it was. A device alone with this machine is not heard like that: nobody acknowledges its frames.
    Detect(Detect),
}

#[derive(Debug, Args)]
struct Up {
    /// Which interface: can0
    interface: InterfaceName,
    /// 250k, 1M, 125000; not given: only switched on, as it is set (a virtual one has none)
    rate: Option<Rate>,
    /// Only listen: no frame, no acknowledge, no error flag
    #[arg(long, requires = "rate")]
    listen_only: bool,
}

#[derive(Debug, Args)]
struct Down {
    /// Which interface: can0
    interface: InterfaceName,
}

#[derive(Debug, Args)]
struct Detect {
    /// Which bus: can0, sim:FILE.toml; not given: --bus
    #[arg(value_name = "BUS")]
    on: Option<BusSpec>,
    /// Where nothing is heard, ask: every node-ID for its device type, at one rate after the other. Only
    /// for a bench with one device: at a wrong rate this disturbs every frame on the bus
    #[arg(long)]
    active: bool,
    /// How long each bit rate is tried; the default hears a heartbeat of once a second
    #[arg(long = "for", value_name = "DUR", default_value = "1500ms")]
    each: Duration,
}

impl BusCommand {
    /// Nothing: other cangauges may use every node.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::List => {
                let all = host::list();
                if all.is_empty() {
                    global.console().note("there is no CAN interface here");
                }
                global.print(&all)
            }
            Action::Up(up) => {
                let rate = up.rate.map(|rate| rate.0);
                let (after, said) = host::up(&up.interface.0, rate, up.listen_only)?;
                done(&after, &said, global)
            }
            Action::Down(down) => {
                let (after, said) = host::down(&down.interface.0)?;
                done(&after, &said, global)
            }
            Action::Detect(detect) => detect.run(global),
        }
    }
}

/// What was done is a note; as data only where a program asks for it.
fn done(after: &Interface, said: &str, global: &Global) -> anyhow::Result<()> {
    global.print_data(std::slice::from_ref(after))?;
    global.console().note(said);
    Ok(())
}

impl Detect {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let Some(spec) = self.on.as_ref().or(global.bus.as_ref()) else {
            let hint = "see what is there: cangauge bus list";
            return Err(Failure::new(Kind::Usage, "which bus?").hint(hint).into());
        };
        let mut bus = open::open_as(global, spec, true)?;
        let console = global.console();
        let mut asked = false;
        let found = detect(&mut *bus, self.active, self.each.0, &mut |tried| {
            if tried.how == How::Asking && !std::mem::replace(&mut asked, true) {
                console.note("nothing valid is heard: asking, which disturbs whoever is at another bit rate");
            }
            console.note(&said(tried));
        });
        let name = bus.name().to_owned();
        let finished = bus.finish().or_fail();
        let found = found?;
        finished?;
        let Some((bit_rate, by)) = found.found else {
            if global.format == Format::Json {
                write(|out| interfaces::detection_json(out, &name, &found))?;
            }
            return Err(nothing(&name, self.active, &found).into());
        };
        write(|out| match global.format {
            Format::Json => interfaces::detection_json(out, &name, &found),
            Format::Csv => interfaces::detection_csv(out, &name, &found),
            Format::Text => writeln!(out, "{bit_rate}"),
        })?;
        if by == By::Acknowledge {
            console.warn("at this rate alone somebody acknowledges; nobody answers");
        }
        Ok(())
    }
}

fn write(work: impl FnOnce(&mut dyn Write) -> io::Result<()>) -> anyhow::Result<()> {
    let mut out = io::stdout().lock();
    work(&mut out).and_then(|()| out.flush()).map_err(stdout)
}

fn said(tried: &Tried) -> String {
    let counted = |count: u32, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let what = match &tried.impossible {
        Some(why) => format!("not with this interface: {why}"),
        None => format!("{}, {}", counted(tried.frames, "valid frame"), counted(tried.errors, "error")),
    };
    let acknowledged = if tried.acknowledged { ", acknowledged" } else { "" };
    format!("{} bit/s: {what}{acknowledged}", tried.bit_rate)
}

fn nothing(name: &str, active: bool, detection: &Detection) -> Failure {
    let errors = detection.tried.iter().any(|tried| tried.errors > 0);
    let (message, hint) = match (active, errors) {
        (false, true) => (
            "errors, but no valid frame at any bit rate",
            format!(
                "a device alone on the bus is not heard, as nobody acknowledges it; on a bench with one device \
                 only: cangauge bus detect {name} --active"
            ),
        ),
        (false, false) => (
            "nothing is heard at any bit rate",
            format!(
                "the devices may be silent: listen longer (--for 5s), or on a bench with one device only: \
                 cangauge bus detect {name} --active"
            ),
        ),
        (true, _) => (
            "nothing tells the bit rate",
            "check the sensor's power, the wiring and the 120 ohm terminators".to_owned(),
        ),
    };
    Failure::new(Kind::NoAnswer, format!("{name}: {message}")).hint(hint)
}
