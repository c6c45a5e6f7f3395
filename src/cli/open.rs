//! Opens the bus, and finds the nodes that the options name.

use super::Global;
use super::args::{BusSpec, Channel, Nodes};
use super::exit::{FileError, IntoFailure};
use super::file::lock_output;
use crate::bus::channels::{SdoChannel, SdoChannels};
use crate::bus::claim::{Claim, ClaimError, Claims, IfHeld, Part};
use crate::bus::interrupt::Interrupts;
use crate::bus::memory::MemoryBus;
use crate::bus::replay::{Replay, ReplayNote};
use crate::bus::trace::Traced;
use crate::bus::{Bus, BusError};
use crate::canopen::id::NodeId;
use crate::master::{Error, Master};
use crate::node::targets;
use crate::output;
use crate::output::failure::ErrorMessage;
use crate::sim::{Bench, BenchError};
use crate::tasks::Failure;
use crate::tasks::scan::ScanFailure;
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::time::Duration;

/// The longest wait for another program that uses the same nodes.
const CLAIM_TIMEOUT: Duration = Duration::from_secs(10);

/// The bus that the options name, or else the only CAN interface that is up.
pub(super) fn spec(global: &Global) -> Result<BusSpec, ErrorMessage> {
    global.bus.clone().map_or_else(only_interface, Ok)
}

/// Opens the bus that the options name, or else the only CAN interface that is up.
pub(super) fn open(global: &Global) -> anyhow::Result<Box<dyn Bus>> {
    open_as(global, &spec(global)?, false)
}

/// Claims the nodes that the command uses. Only a CAN interface is shared with other processes.
pub(super) fn claim(global: &Global, spec: &BusSpec) -> Result<Claims, Failure> {
    let BusSpec::SocketCan(bus) = spec else { return Ok(Claims::default()) };
    let (if_held, consequence) = if global.ignore_lock {
        (IfHeld::Continue, "continuing (--ignore-lock)")
    } else {
        (IfHeld::Wait(CLAIM_TIMEOUT), "waiting for it to end")
    };
    let mut report = |error: &ClaimError| global.console().note(&format!("{error}; {consequence}"));
    Claims::take(bus, &global.claim, if_held, &mut report).map_err(|error| match error {
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
    let bus: Box<dyn Bus> = match spec {
        BusSpec::Sim(bench) => Box::new(simulated(bench.as_deref())?),
        BusSpec::Replay(file) => {
            let (console, name) = (global.console(), file.clone());
            let report = move |note: &ReplayNote| match output::replay::note(&name, note) {
                (text, true) => console.warn(&text),
                (text, false) => console.note(&text),
            };
            let what = || format!("replay {file}");
            Box::new(Replay::open(file, Box::new(report)).map_err(|source| FileError { what: what(), source })?)
        }
        BusSpec::SocketCan(name) => socketcan(name, even_down)?,
    };
    // After the bus: without one, an existing trace keeps its content. Nothing was sent yet.
    let bus: Box<dyn Bus> = match &global.trace {
        Some(path) => {
            let (out, name) = trace_output(path)?;
            Box::new(Traced::new(bus, out, &name))
        }
        None => bus,
    };
    Ok(if channels.is_empty() { bus } else { Box::new(SdoChannels::new(bus, &channels)) })
}

/// The SDO channels that the user named.
fn channels(global: &Global) -> Result<Vec<SdoChannel>, ErrorMessage> {
    let only = match &global.claim {
        Claim::Nodes(nodes) if nodes.len() == 1 => nodes.first().copied(),
        _ => None,
    };
    let channel = |named: &Channel| match named.node.or(only) {
        Some(node) => Ok(SdoChannel { node, request: named.request, response: named.response }),
        None => Err(ErrorMessage::usage("--sdo does not say for which node").hint("name it: --sdo 5=0x645:0x5C5")),
    };
    global.sdo.iter().map(channel).collect()
}

fn trace_output(path: &Path) -> anyhow::Result<(Box<dyn Write>, String)> {
    if path == Path::new("-") {
        return Ok((Box::new(io::stderr()), "stderr".to_owned()));
    }
    let name = path.display().to_string();
    let failed = |source| FileError { what: format!("write trace {name}"), source };
    let file = File::options().append(true).create(true).open(path).map_err(failed)?;
    lock_output(&file, path)?;
    if file.metadata().is_ok_and(|metadata| metadata.is_file()) {
        file.set_len(0).map_err(failed)?;
    }
    Ok((Box::new(file), name))
}

fn simulated(spec: Option<&str>) -> anyhow::Result<MemoryBus> {
    let interrupts = Interrupts::new().map_err(|source| FileError { what: "watch for Ctrl-C".to_owned(), source })?;
    Ok(bench(spec.unwrap_or_default())?.open().map_err(bench_error)?.with_sleeper(Box::new(interrupts)))
}

/// Reads a bench.
pub(super) fn bench(spec: &str) -> anyhow::Result<Bench> {
    Bench::parse(spec).map_err(bench_error)
}

/// The error of a bench file, with its kind.
pub(super) fn bench_error(error: BenchError) -> anyhow::Error {
    match error {
        BenchError::Usage(message) => ErrorMessage::usage(message).into(),
        BenchError::Io { path, source } => FileError { what: path.display().to_string(), source }.into(),
    }
}

#[cfg(target_os = "linux")]
fn socketcan(name: &str, even_down: bool) -> Result<Box<dyn Bus>, Failure> {
    use crate::bus::socketcan::SocketCan;
    let open = if even_down { SocketCan::open_even_down } else { SocketCan::open };
    Ok(Box::new(open(name).or_fail()?))
}

#[cfg(not(target_os = "linux"))]
fn socketcan(name: &str, _: bool) -> Result<Box<dyn Bus>, Failure> {
    let error = BusError::Unsupported(format!("{name}: this system has no SocketCAN"));
    Err(error).or_fail()
}

#[cfg(target_os = "linux")]
fn interfaces() -> Vec<(String, bool)> {
    crate::bus::socketcan::interfaces().into_iter().map(|interface| (interface.name, interface.up)).collect()
}

#[cfg(not(target_os = "linux"))]
fn interfaces() -> Vec<(String, bool)> {
    Vec::new()
}

fn only_interface() -> Result<BusSpec, ErrorMessage> {
    let all = interfaces();
    let up: Vec<&String> = all.iter().filter(|(_, up)| *up).map(|(name, _)| name).collect();
    if let [only] = up.as_slice() {
        return Ok(BusSpec::SocketCan((*only).clone()));
    }
    let list: Vec<String> =
        all.iter().map(|(name, up)| format!("{name} ({})", if *up { "up" } else { "down" })).collect();
    let message = match (all.is_empty(), up.is_empty()) {
        (true, _) => "this computer has no CAN interface".to_owned(),
        (false, true) => format!("no CAN interface is up: {}", list.join(", ")),
        (false, false) => format!("several CAN interfaces are up: {}", list.join(", ")),
    };
    let example =
        up.first().or(all.iter().map(|(name, _)| name).collect::<Vec<_>>().first()).map(|name| name.to_string());
    let hint = match example {
        Some(name) => format!("choose one: --bus {name}; without hardware: --bus sim"),
        None => "without hardware: --bus sim".to_owned(),
    };
    Err(ErrorMessage::usage(message).hint(hint))
}

/// The nodes that the user named; for `all`, those that [`all`] finds.
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
