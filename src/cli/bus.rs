//! `cangauge bus`.

pub(super) mod host;

use super::args::{BitRate, BusSpec, Duration, InterfaceName};
use super::exit::IntoFailure;
use super::{Global, open};
use cangauge::bus::claim::Claim;
use cangauge::bus::remote::{SerialAdapter, adapters};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::interfaces::{BitRateReport, Interface, change, tried_line};
use cangauge::output::progress::Activity;
use cangauge::tasks::Failure;
use cangauge::tasks::detect::{DetectFailure, Evidence, Method, detect};
use clap::{Args, Subcommand};

/// List CAN interfaces, bring them up and down, and find the bit rate of a bus
///
/// Setting an interface needs root (CAP_NET_ADMIN). Without it, the error shows the commands to type.
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
    /// List the CAN interfaces of this computer with bit rate, state and error counters, and the serial adapters
    List,
    /// Bring an interface up at a bit rate
    ///
    /// If the interface is up at another bit rate, it goes down for a moment. If it is already up at this bit rate,
    /// nothing is changed. The command sets only the bit rate, the listen-only mode and the up state of the interface,
    /// and reads them back.
    Up(Up),
    /// Bring an interface down
    Down(Down),
    /// Find the bit rate of a running bus by listening; print it in bit/s
    ///
    /// The usual bit rates are tried one after the other, the present one first, until valid frames are received. The
    /// command sends no frames and no acknowledgements. At the end, and on Ctrl-C, the interface is restored. A single
    /// device on the bus cannot be detected, because no node acknowledges its frames.
    Detect(Detect),
}

#[derive(Debug, Args)]
struct Up {
    /// Interface: can0
    interface: InterfaceName,
    /// Bit rate: 250k, 1M, 125000 [default: the present one; a virtual interface has none]
    rate: Option<BitRate>,
    /// Listen only: send no frame, no acknowledgement and no error flag
    #[arg(long, requires = "rate")]
    listen_only: bool,
}

#[derive(Debug, Args)]
struct Down {
    /// Interface: can0
    interface: InterfaceName,
}

#[derive(Debug, Args)]
struct Detect {
    /// Bus: can0, slcan:/dev/ttyACM0@250k, sim:FILE.toml [default: --bus]
    #[arg(value_name = "BUS")]
    on: Option<BusSpec>,
    /// If nothing is received, ask each node-ID for its device type at each bit rate. Only for a bench with one
    /// device: at a wrong bit rate this disturbs every frame on the bus
    #[arg(long)]
    active: bool,
    /// Time per bit rate; the default is longer than a heartbeat interval of 1 s
    #[arg(long = "for", value_name = "DUR", default_value = "1500ms")]
    time_per_rate: Duration,
}

impl BusCommand {
    /// No node is locked: other cangauge processes may use all nodes.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::List => {
                let all: Vec<_> = host::list().into_iter().chain(adapters().into_iter().map(describe_serial)).collect();
                if all.is_empty() {
                    global.console().note("this computer has no CAN interface and no serial adapter");
                }
                global.print(&all)
            }
            Action::Up(up) => {
                let rate = up.rate.map(|rate| rate.0);
                report(&host::up(&up.interface.0, rate, up.listen_only)?, global)
            }
            Action::Down(down) => report(&host::down(&down.interface.0)?, global),
            Action::Detect(detect) => detect.run(global),
        }
    }
}

/// Describes a serial adapter as an interface. It has no bit rate yet: the user chooses it with `--bus`.
fn describe_serial(found: SerialAdapter) -> Interface {
    let kind = Some("serial".to_owned());
    Interface {
        interface: format!("slcan:{}", found.path),
        up: false,
        driver: found.product,
        kind,
        ..Interface::default()
    }
}

fn report(changed: &host::Changed, global: &Global) -> anyhow::Result<()> {
    global.print_data(std::slice::from_ref(&changed.after))?;
    global.console().note(&change(&changed.before, &changed.after));
    Ok(())
}

impl Detect {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let Some(spec) = self.on.as_ref().or(global.bus.as_ref()) else {
            return Err(ErrorMessage::usage("no bus was given").hint("list the interfaces: cangauge bus list").into());
        };
        let mut bus = open::open_as(global, spec, true)?;
        let console = global.console();
        let mut is_asking = false;
        let activity = Activity::new(global.shows_progress(), "trying bit rates");
        let detection = detect(&mut *bus, self.active, self.time_per_rate.0, &mut |tried| {
            if tried.how == Method::Asking && !std::mem::replace(&mut is_asking, true) {
                let text = "no valid frame; now sending requests, which disturbs nodes at other bit rates";
                activity.above(|| console.note(text));
            }
            activity.above(|| console.note(&tried_line(tried)));
        });
        drop(activity);
        let interface = bus.name().to_owned();
        let finished = bus.finish().or_fail();
        let detection = detection?;
        finished?;
        let report = BitRateReport { interface, detection };
        let Some((_, evidence)) = report.detection.found else {
            global.print_json(std::slice::from_ref(&report))?;
            let BitRateReport { interface, detection } = report;
            return Err(Failure::general(DetectFailure::NotFound { interface, detection, active: self.active }).into());
        };
        global.print(std::slice::from_ref(&report))?;
        if evidence == Evidence::Acknowledge {
            console.warn("requests were acknowledged only at this bit rate, but no node answered");
        }
        Ok(())
    }
}
