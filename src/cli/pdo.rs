//! `cangauge pdo`.

use super::args::{Duration, Nodes};
use super::exit::{several, stdout};
use super::journal::FileJournal;
use super::{Global, descriptions, open};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::pdo::TpdoNumber;
use cangauge::output::console::Console;
use cangauge::output::events::remark_text;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::pdo::ReceivedTpdo;
use cangauge::output::{diagnosis, notes};
use cangauge::tasks::log::Remark;
use cangauge::tasks::pdo::{Item, PdoRequest, Trigger, WatchEvent, map, show, watch};
use clap::{Args, Subcommand};
use std::ops::ControlFlow;

/// Show, change and watch the transmit PDOs of nodes
///
/// PDO 1 is TPDO1 (1800h, 1A00h). A new mapping is written and read back. If this fails, the old settings are restored
/// and the error shows the rejected write.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim pdo show 1\n  cangauge -b sim pdo map 1 1 pressure pressure.status --transmission timer --event-timer 100ms\n  cangauge -b sim pdo map 2 1 0x6130:1/32\n  cangauge pdo watch 127 --duration 10s"
)]
pub(crate) struct Pdo {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
#[command(defer = true)]
enum Action {
    /// Show the settings of TPDOs
    Show(ShowArgs),
    /// Set the mapping and the transmission of a TPDO
    Map(MapArgs),
    /// Show received TPDOs, decoded, until Ctrl-C
    Watch(WatchArgs),
}

#[derive(Debug, Args)]
struct ShowArgs {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// TPDO: 1 to 512 [default: all]
    #[arg(value_parser = tpdo)]
    pdo: Option<TpdoNumber>,
}

#[derive(Debug, Args)]
struct MapArgs {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// TPDO: 1 to 512
    #[arg(value_parser = tpdo)]
    pdo: TpdoNumber,
    /// Mapped signals or objects, in order: pressure, pressure.status, ai-input-pv:1, 0x6130:1, 0x9130:1/32 [default:
    /// keep the mapping]
    #[arg(value_name = "SIGNAL|OBJECT")]
    signals: Vec<Item>,
    /// Transmission type: acyclic (on SYNC after a change), sync:N (on every N-th SYNC), event (255), timer (event
    /// timer), or a number
    #[arg(long, value_name = "HOW", value_parser = transmission)]
    transmission: Option<Trigger>,
    /// Event timer, in whole milliseconds; 0: off
    #[arg(long, value_name = "DUR", value_parser = event_timer)]
    event_timer: Option<u16>,
    /// Inhibit time: shortest time between two transmissions, in steps of 100us; 0: none
    #[arg(long, value_name = "DUR", value_parser = inhibit)]
    inhibit: Option<u16>,
    /// CAN identifier, 11 bits: 0x1A5
    #[arg(long, value_name = "ID", value_parser = identifier)]
    cob_id: Option<u16>,
    /// Store the change (1010h; only the communication settings if the device can store them separately)
    #[arg(long)]
    store: bool,
}

#[derive(Debug, Args)]
struct WatchArgs {
    /// Nodes: 5, 0x7f, 1-16, 1,5, all
    nodes: Nodes,
    /// End after this time
    #[arg(short, long, value_name = "DUR")]
    duration: Option<Duration>,
}

fn tpdo(text: &str) -> Result<TpdoNumber, String> {
    let number = text.parse().ok().and_then(TpdoNumber::new);
    number.ok_or_else(|| format!("\"{text}\" is not the number of a TPDO (1 to 512)"))
}

fn transmission(text: &str) -> Result<Trigger, String> {
    let wrong =
        || format!("\"{text}\" is not a transmission type (acyclic, sync:1 to sync:240, event, timer, 0 to 255)");
    Ok(match text {
        "acyclic" => Trigger::Code(0),
        "event" => Trigger::Code(255),
        "timer" => Trigger::Timer,
        _ => match text.strip_prefix("sync:") {
            Some(every) => {
                Trigger::Code(every.parse().ok().filter(|every| (1..=240).contains(every)).ok_or_else(wrong)?)
            }
            None => Trigger::Code(text.parse().map_err(|_| wrong())?),
        },
    })
}

/// Parses a duration as a 16-bit number of `unit`s.
fn duration_as_u16(text: &str, unit: std::time::Duration, form: &str) -> Result<u16, String> {
    let wrong = || match text.parse::<f64>() {
        Ok(_) => format!("\"{text}\" has no unit ({text}ms): it must be {form}"),
        Err(_) => format!("\"{text}\" is not {form}"),
    };
    let duration = match text {
        "0" => std::time::Duration::ZERO,
        _ => humantime::parse_duration(text).map_err(|_| wrong())?,
    };
    let whole = duration.as_nanos() % unit.as_nanos() == 0;
    let number = u16::try_from(duration.as_nanos() / unit.as_nanos()).ok().filter(|_| whole);
    number.ok_or_else(wrong)
}

fn event_timer(text: &str) -> Result<u16, String> {
    duration_as_u16(text, std::time::Duration::from_millis(1), "a duration in whole milliseconds (0ms to 65535ms)")
}

fn inhibit(text: &str) -> Result<u16, String> {
    duration_as_u16(text, std::time::Duration::from_micros(100), "a duration in steps of 100us (0us to 6553500us)")
}

fn identifier(text: &str) -> Result<u16, String> {
    let number = cangauge::canopen::id::parse_u32(text);
    number.and_then(|number| u16::try_from(number).ok()).filter(|&number| number <= 0x7ff).ok_or_else(|| {
        format!("\"{text}\" is not an 11-bit identifier (0x181 to 0x57F, without the flags of the COB-ID)")
    })
}

impl Pdo {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Action::Show(args) => Claim::Nodes(vec![args.node]),
            Action::Map(args) => Claim::Nodes(vec![args.node]),
            Action::Watch(args) => args.nodes.claim(),
        }
    }

    pub(super) fn writes(&self) -> bool {
        matches!(self.action, Action::Map(_))
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::Show(args) => args.run(global),
            Action::Map(args) => args.run(global),
            Action::Watch(args) => args.run(global),
        }
    }
}

impl ShowArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let overrides = descriptions::overrides(global, &[self.node])?;
        let shown = global.with_master(|master| Ok(show(master, self.node, self.pdo, &overrides)?))?;
        global.print(&shown)
    }
}

impl MapArgs {
    fn request(&self) -> anyhow::Result<PdoRequest> {
        let request = PdoRequest {
            node: self.node,
            number: self.pdo,
            items: self.signals.clone(),
            trigger: self.transmission,
            event_timer_ms: self.event_timer,
            inhibit_100us: self.inhibit,
            cob_id: self.cob_id,
        };
        let parameters = [request.event_timer_ms, request.inhibit_100us, request.cob_id];
        if request.items.is_empty() && request.trigger.is_none() && parameters.iter().all(Option::is_none) {
            let hint = format!("show its settings: cangauge pdo show {} {}", self.node, self.pdo.get());
            return Err(ErrorMessage::usage(
                "nothing to set: add signals, or use --transmission, --event-timer, --inhibit or --cob-id",
            )
            .hint(hint)
            .into());
        }
        request.check()?;
        Ok(request)
    }

    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let request = self.request()?;
        let overrides = descriptions::overrides(global, &[self.node])?;
        let mut journal = FileJournal::of(&open::spec(global)?);
        let mapped = global.with_master(|master| Ok(map(master, &request, self.store, &overrides, &mut journal)?))?;
        let console = global.console();
        match mapped.writes {
            0 => {}
            1 => console.detail(&format!("node {}: 1 write, read back", self.node)),
            writes => console.detail(&format!("node {}: {writes} writes, read back", self.node)),
        }
        mapped.notes.iter().for_each(|note| notes::print(&console, note));
        global.print(&[mapped])
    }
}

impl WatchArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let console = global.console();
        let (mut write_error, mut node_failures) = (None, Vec::new());
        let mut rows = global.stream::<ReceivedTpdo>()?;
        let (node_count, result) = global.with_claims(|master, claims| {
            let nodes = match &self.nodes {
                Nodes::All if !master.bus().is_live() => NodeId::all().collect(),
                nodes => open::nodes(master, global, nodes)?,
            };
            let overrides = descriptions::overrides_on(master, global, &nodes)?;
            let is_live = master.bus().is_live();
            let mut claims = Some(std::mem::take(claims));
            let mut report = |event: &WatchEvent<'_>| {
                // The mappings have been read, and the command only listens from now on, so the nodes are unlocked.
                claims.take();
                match *event {
                    WatchEvent::Restarted(node) => {
                        // In a recording, the mapping is known only after another master has read it again.
                        let mapping =
                            if is_live { "assumed to be unchanged" } else { "unknown until it is read again" };
                        console.warn(&format!("node {node} restarted; its mapping is {mapping}"));
                    }
                    WatchEvent::Failed(failure) => {
                        console.warn(&format!("{}: the node is not shown", ErrorMessage::of(failure).message));
                        node_failures.push(failure.clone());
                    }
                    WatchEvent::NothingYet(nodes) => {
                        console.note(&format!("no TPDO yet; {}", diagnosis::reasons(nodes)));
                    }
                    WatchEvent::Repeated(node, number) => {
                        console.warn(&remark_text(&Remark::RepeatedTpdo(node, number)));
                    }
                    WatchEvent::WrongLength { .. } | WatchEvent::WrongLengths(..) => {
                        print_wrong_length(&console, event);
                    }
                    WatchEvent::Tpdo { at, node, number, samples, sources } => {
                        let tpdo = ReceivedTpdo::new(at, node, number, samples, sources);
                        if let Err(error) = rows.push(&tpdo) {
                            write_error = Some(error);
                            return ControlFlow::Break(());
                        }
                    }
                }
                ControlFlow::Continue(())
            };
            let duration = self.duration.map(|duration| duration.0);
            Ok((nodes.len(), watch(master, &nodes, &overrides, duration, &mut report)))
        })?;
        if let Some(error) = write_error {
            return Err(stdout(error));
        }
        match result {
            Ok(failures) => Ok(several(node_count, failures)?),
            Err(failure) => {
                node_failures.push(failure);
                Ok(several(node_failures.len(), node_failures)?)
            }
        }
    }
}

/// Reports a TPDO of a wrong length, or the number of these TPDOs at the end.
fn print_wrong_length(console: &Console, event: &WatchEvent<'_>) {
    match *event {
        WatchEvent::WrongLength { node, number, mapped, length, is_used } => {
            let consequence = match is_used {
                true => format!("its first {mapped} bytes are shown"),
                false => format!("it is not shown; read by SDO instead: cangauge log {node} --poll 100ms"),
            };
            console.warn(&format!("node {node}: {number} has {length} bytes, its mapping {mapped}: {consequence}"));
        }
        WatchEvent::WrongLengths(node, 1) => console.note(&format!("node {node}: 1 TPDO of the wrong length")),
        WatchEvent::WrongLengths(node, count) => {
            console.note(&format!("node {node}: {count} TPDOs of the wrong length"));
        }
        _ => {}
    }
}
