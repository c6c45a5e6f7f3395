//! Opens the bus, and finds the nodes given by the options.

use super::Global;
use super::args::{BusSpec, Channel, Nodes};
use super::exit::{FileError, IntoFailure};
use super::file::{lock_output, no_reader};
use cangauge::bus::channels::{SdoChannel, SdoChannels};
use cangauge::bus::claim::{Claim, ClaimError, Claims, IfHeld, Part};
use cangauge::bus::file::wait_for_reader;
use cangauge::bus::interrupt::Interrupts;
use cangauge::bus::memory::MemoryBus;
use cangauge::bus::paced::Paced;
use cangauge::bus::remote::Use;
use cangauge::bus::replay::{Replay, ReplayNote};
use cangauge::bus::time::format_duration;
use cangauge::bus::trace::Traced;
use cangauge::bus::{Bus, BusError};
use cangauge::canopen::id::NodeId;
use cangauge::master::{Error, Master};
use cangauge::node::targets;
use cangauge::output;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Bench, BenchError};
use cangauge::tasks::scan::ScanFailure;
use cangauge::tasks::{Failure, Kind};
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

/// The time between two attempts to open an interface.
const WAIT_INTERVAL: Duration = Duration::from_millis(200);

/// The longest wait for another program that uses the same nodes.
const CLAIM_TIMEOUT: Duration = Duration::from_secs(10);

/// The longest wait for the reader of a trace that is a FIFO. The nodes stay locked during this time.
const TRACE_READER_TIMEOUT: Duration = Duration::from_secs(1);

/// The bus given by the options, or else the only CAN interface that is up.
pub(super) fn spec(global: &Global) -> anyhow::Result<BusSpec> {
    let down_reason = |error: &ErrorMessage| interfaces().iter().all(|(_, up)| !up).then(|| error.message.clone());
    match &global.bus {
        Some(bus) => Ok(bus.clone()),
        None => Ok(within(global, || choose_interface(&interfaces()), down_reason)??),
    }
}

/// Opens the bus given by the options, or else the only CAN interface that is up.
pub(super) fn open(global: &Global) -> anyhow::Result<Box<dyn Bus>> {
    open_as(global, &spec(global)?, false)
}

/// Locks the nodes that the command uses. A simulated bus and a recording are not shared with other processes.
pub(super) fn claim(global: &Global, spec: &BusSpec) -> Result<Claims, Failure> {
    let bus = match spec {
        BusSpec::SocketCan(name) => name.clone(),
        BusSpec::Remote(remote) => remote.to_string(),
        BusSpec::Sim(_) | BusSpec::Replay(_) => return Ok(Claims::default()),
    };
    let (if_held, consequence) = if global.ignore_lock {
        (IfHeld::Continue, "continuing (--ignore-lock)")
    } else {
        (IfHeld::Wait(CLAIM_TIMEOUT), "waiting for it to end")
    };
    let mut report = |error: &ClaimError| global.console().note(&format!("{error}; {consequence}"));
    Claims::take(&bus, &global.claim, if_held, &mut report).map_err(|error| match error {
        ClaimError::InUse(part, _) => {
            let node = if let Part::Node(node) = part { Some(node) } else { None };
            Failure { node, ..BusError::InUse(error.to_string()).into() }
        }
        ClaimError::Interrupted => Error::Interrupted.into(),
        ClaimError::System(part, source) => BusError::File { what: format!("claim {part}"), source }.into(),
    })
}

/// Opens this bus. With `even_down`, also an interface that is down.
pub(super) fn open_as(global: &Global, spec: &BusSpec, even_down: bool) -> anyhow::Result<Box<dyn Bus>> {
    let channels = channels(global)?;
    if global.pace && !matches!(spec, BusSpec::Replay(_)) {
        return Err(ErrorMessage::usage("--pace plays a recording: -b replay:FILE").into());
    }
    let bus: Box<dyn Bus> = match spec {
        BusSpec::Sim(bench) => Box::new(simulated(bench.as_deref())?),
        BusSpec::Replay(spec) => Box::new(recording(global, spec)?),
        BusSpec::SocketCan(name) => within(global, || socketcan(name, even_down), temporary_reason)?.or_fail()?,
        BusSpec::Remote(remote) => {
            let purpose = match (even_down, global.listens_only) {
                (true, _) => Use::Configure,
                (false, true) => Use::Listen,
                (false, false) => Use::Normal,
            };
            within(global, || remote.open(purpose), temporary_reason)?.map_err(interrupted)?
        }
    };
    let bus = traced(global, bus)?;
    let bus = if matches!(spec, BusSpec::Replay(_)) { bus } else { paced(global, bus, &channels) };
    Ok(if channels.is_empty() { bus } else { Box::new(SdoChannels::new(bus, &channels)) })
}

/// Adds a limit for the load of SDO transfers to the bus.
fn paced(global: &Global, bus: Box<dyn Bus>, channels: &[SdoChannel]) -> Box<dyn Bus> {
    if global.max_load.is_some() && bus.bit_rate().is_none() {
        global.console().note(&format!("the bit rate of {} is unknown: --max-load has no effect", bus.name()));
    }
    let ids = channels.iter().map(|channel| (channel.request, channel.response)).collect();
    Box::new(Paced::new(bus, global.max_load.map(|load| load.0), ids))
}

/// Adds a trace to the bus, if requested. The trace is opened after the bus: if the bus cannot be opened, an existing
/// trace is not overwritten. No frame is missing in the trace, because nothing is sent before.
pub(super) fn traced(global: &Global, bus: Box<dyn Bus>) -> anyhow::Result<Box<dyn Bus>> {
    let Some(path) = &global.trace else { return Ok(bus) };
    let (out, name) = trace_output(path)?;
    Ok(Box::new(Traced::new(bus, out, &name)))
}

/// The SDO channels given by the user.
fn channels(global: &Global) -> Result<Vec<SdoChannel>, ErrorMessage> {
    let only = match &global.claim {
        Claim::Nodes(nodes) if nodes.len() == 1 => nodes.first().copied(),
        _ => None,
    };
    let channel = |named: &Channel| match named.node.or(only) {
        Some(node) => Ok(SdoChannel { node, request: named.request, response: named.response }),
        None => Err(ErrorMessage::usage("the node of --sdo is missing").hint("add it: --sdo 5=0x645:0x5C5")),
    };
    global.sdo.iter().map(channel).collect()
}

fn trace_output(path: &Path) -> anyhow::Result<(Box<dyn Write>, String)> {
    if path == Path::new("-") {
        return Ok((Box::new(io::stderr()), "stderr".to_owned()));
    }
    let name = path.display().to_string();
    let failed = |source| FileError { what: format!("write trace {name}"), source };
    let (_, _reader) = wait_for_reader(path, Some(TRACE_READER_TIMEOUT)).map_err(|source| no_reader(path, source))?;
    let file = File::options().append(true).create(true).open(path).map_err(failed)?;
    lock_output(&file, path)?;
    if file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        file.set_len(0).map_err(failed)?;
    }
    Ok((Box::new(file), name))
}

fn simulated(spec: Option<&str>) -> anyhow::Result<MemoryBus> {
    let interrupts = interrupts()?;
    Ok(bench(spec.unwrap_or_default())?.open().map_err(bench_error)?.with_sleeper(Box::new(interrupts)))
}

fn interrupts() -> Result<Interrupts, FileError> {
    Interrupts::new().map_err(|source| FileError { what: "watch for Ctrl-C".to_owned(), source })
}

/// Opens a recording: `FILE`, `FILE:CHANNEL`, or `-`.
fn recording(global: &Global, spec: &str) -> anyhow::Result<Replay> {
    let is_file = |name: &str| name == "-" || Path::new(name).exists();
    // A file may have a colon in its name.
    let chosen = spec.rsplit_once(':').filter(|(file, channel)| !is_file(spec) && is_file(file) && !channel.is_empty());
    let (file, channel) = chosen.map_or((spec, None), |(file, channel)| (file, Some(channel)));
    let (console, name) = (global.console(), file.to_owned());
    let report = move |note: &ReplayNote| match output::replay::note(&name, note) {
        (text, true) => console.warn(&text),
        (text, false) => console.note(&text),
    };
    let failed = |source| FileError { what: format!("replay {file}"), source };
    let mut bus = Replay::open(file, Box::new(report)).map_err(failed)?;
    if let Some(channel) = channel {
        bus = bus.of_channel(channel);
    }
    Ok(if global.pace { bus.in_real_time(Box::new(interrupts()?)) } else { bus })
}

/// Converts the error of opening a bus. Ctrl-C while connecting to a server is not an error of the bus.
fn interrupted(error: BusError) -> Failure {
    match error {
        BusError::Io { source, .. } if source.kind() == io::ErrorKind::Interrupted => Error::Interrupted.into(),
        error => error.into(),
    }
}

/// Returns the message of an error that may be temporary: the interface is missing or down, or the server unreachable.
fn temporary_reason(error: &BusError) -> Option<String> {
    matches!(error, BusError::NoInterface(_) | BusError::Down(_) | BusError::Unreachable { .. })
        .then(|| error.to_string())
}

/// Repeats `attempt` for the time of `--wait`, while `obstacle` returns the reason of a temporary error. Returns the
/// result of the last attempt.
///
/// # Errors
/// Ctrl-C.
fn within<T, E>(
    global: &Global,
    mut attempt: impl FnMut() -> Result<T, E>,
    obstacle: impl Fn(&E) -> Option<String>,
) -> anyhow::Result<Result<T, E>> {
    let mut remaining = global.wait.map_or(Duration::ZERO, |wait| wait.0);
    let mut interrupts = None;
    loop {
        let result = attempt();
        let Some(reason) = result.as_ref().err().and_then(&obstacle).filter(|_| !remaining.is_zero()) else {
            return Ok(result);
        };
        if interrupts.is_none() {
            global.console().note(&format!("{reason}; waiting up to {}", format_duration(remaining)));
            interrupts = Some(self::interrupts()?);
        }
        let pause = remaining.min(WAIT_INTERVAL);
        if interrupts.as_mut().is_some_and(|interrupts| interrupts.wait_for(pause)) {
            return Err(Failure::from(Error::Interrupted).into());
        }
        remaining -= pause;
    }
}

/// Reads a bench.
pub(super) fn bench(spec: &str) -> anyhow::Result<Bench> {
    Bench::parse(spec).map_err(bench_error)
}

/// Converts the error of a bench to a usage error or a file error.
pub(super) fn bench_error(error: BenchError) -> anyhow::Error {
    match error {
        BenchError::Usage(message) => ErrorMessage::usage(message).into(),
        BenchError::Io { path, source } => FileError { what: path.display().to_string(), source }.into(),
    }
}

#[cfg(all(target_os = "linux", not(without_socketcan)))]
fn socketcan(name: &str, even_down: bool) -> Result<Box<dyn Bus>, BusError> {
    use cangauge::bus::socketcan::SocketCan;
    let open = if even_down { SocketCan::open_even_down } else { SocketCan::open };
    Ok(Box::new(open(name)?))
}

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
fn socketcan(name: &str, _: bool) -> Result<Box<dyn Bus>, BusError> {
    Err(BusError::Unsupported(format!("{name}: this system has no SocketCAN")))
}

/// The CAN interfaces of this computer, and whether each is up.
#[cfg(all(target_os = "linux", not(without_socketcan)))]
pub(super) fn interfaces() -> Vec<(String, bool)> {
    cangauge::bus::socketcan::interfaces().into_iter().map(|interface| (interface.name, interface.up)).collect()
}

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
pub(super) fn interfaces() -> Vec<(String, bool)> {
    Vec::new()
}

/// Whether a CAN interface is up.
pub(super) fn has_interface() -> bool {
    interfaces().iter().any(|(_, up)| *up)
}

/// Chooses the only CAN interface that is up. If none is up and there is only one, chooses this one.
fn choose_interface(all: &[(String, bool)]) -> Result<BusSpec, ErrorMessage> {
    let up: Vec<&String> = all.iter().filter(|(_, up)| *up).map(|(name, _)| name).collect();
    let (kind, words) = match (up.as_slice(), all) {
        ([only], _) => return Ok(BusSpec::SocketCan((*only).clone())),
        (_, []) => {
            let message = ErrorMessage::new(Kind::Bus, "this computer has no CAN interface");
            return Err(message.hint("without hardware: --bus sim"));
        }
        ([], [(only, _)]) => return Ok(BusSpec::SocketCan(only.clone())),
        ([], _) => (Kind::Bus, "no CAN interface is up"),
        _ => (Kind::Usage, "several CAN interfaces are up"),
    };
    let state = |up: bool| if up { "up" } else { "down" };
    let list: Vec<String> = all.iter().map(|(name, up)| format!("{name} ({})", state(*up))).collect();
    let example = up.first().map_or(&all[0].0, |name| *name);
    let hint = format!("choose one: --bus {example}; without hardware: --bus sim");
    Err(ErrorMessage::new(kind, format!("{words}: {}", list.join(", "))).hint(hint))
}

/// Returns the nodes given by the user; for `all`, the nodes found by [`all`].
///
/// # Errors
/// `all` finds no node; bus errors and Ctrl-C.
pub(super) fn nodes(master: &mut Master<'_>, global: &Global, nodes: &Nodes) -> anyhow::Result<Vec<NodeId>> {
    match nodes {
        Nodes::These(nodes) => Ok(nodes.clone()),
        Nodes::All => {
            let nodes = all(master, global)?;
            if nodes.is_empty() { Err(Failure::general(ScanFailure::NoAnswer).into()) } else { Ok(nodes) }
        }
    }
}

/// The nodes for `all`, see [`targets`]. The list may be empty.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub(super) fn all(master: &mut Master<'_>, global: &Global) -> anyhow::Result<Vec<NodeId>> {
    let timing = global.timing(super::scan::SCAN_TIMEOUT);
    Ok(targets::all(master, timing.timeout, 1 + timing.retries).or_fail()?)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cli::Cli;
    use clap::Parser;

    #[test]
    fn interface_is_chosen_if_only_one_is_possible() {
        let chosen = |all: &[(&str, bool)]| {
            let all: Vec<(String, bool)> = all.iter().map(|(name, up)| ((*name).to_owned(), *up)).collect();
            let name = |spec| if let BusSpec::SocketCan(name) = spec { name } else { panic!("an interface") };
            choose_interface(&all).map(name).map_err(|error| (error.kind, error.message))
        };
        assert_eq!(chosen(&[("can0", false), ("can1", true)]), Ok("can1".to_owned()));
        assert_eq!(chosen(&[("can0", false)]), Ok("can0".to_owned()), "opening it reports that it is down");
        assert_eq!(chosen(&[]), Err((Kind::Bus, "this computer has no CAN interface".to_owned())));
        let down = "no CAN interface is up: can0 (down), can1 (down)".to_owned();
        assert_eq!(chosen(&[("can0", false), ("can1", false)]), Err((Kind::Bus, down)));
        let several = "several CAN interfaces are up: can0 (up), can1 (up)".to_owned();
        assert_eq!(chosen(&[("can0", true), ("can1", true)]), Err((Kind::Usage, several)));
    }

    #[test]
    fn wait_ends_when_the_interface_is_up_or_the_time_is_over() {
        let global = Cli::parse_from(["cangauge", "-q", "--wait", "250ms", "scan"]).global;
        let mut attempts = 0;
        let mut up_at = |attempt, error: fn(String) -> BusError| {
            attempts = 0;
            let attempt = || {
                attempts += 1;
                if attempts == attempt { Ok(()) } else { Err(error("can0".to_owned())) }
            };
            let opened = within(&global, attempt, temporary_reason);
            (opened.is_ok_and(|opened| opened.is_ok()), attempts)
        };
        assert_eq!(up_at(2, BusError::Down), (true, 2));
        assert_eq!(up_at(2, BusError::NoInterface), (true, 2));
        assert_eq!(up_at(9, BusError::Down), (false, 3), "at once, after 200 ms and after 250 ms");
        assert_eq!(up_at(2, BusError::NotCan), (false, 1));
    }
}
