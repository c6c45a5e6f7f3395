//! Opens every bus, and finds the descriptions and nodes that the options name.

use super::Global;
use super::args::{BusSpec, Nodes};
use super::exit::{FileError, IntoFailure};
use super::read::everybody;
use crate::bus::Bus;
use crate::bus::trace::Traced;
use crate::canopen::id::NodeId;
use crate::device::catalog::{self, Model};
use crate::master::Master;
use crate::measure::survey::Overrides;
use crate::sim;
use crate::tasks::{Failure, Kind};
use std::fs::File;
use std::io::{self, Write};
use std::path::Path;
use std::sync::Arc;

/// Opens the bus that the options name, or the only one there is.
pub(super) fn open(global: &Global) -> anyhow::Result<Box<dyn Bus>> {
    let spec = match &global.bus {
        Some(spec) => spec.clone(),
        None => only_interface()?,
    };
    // Before the bus: a trace that cannot be written is found before anything is sent.
    let trace: Option<(Box<dyn Write>, String)> = match &global.trace {
        None => None,
        Some(path) if path == Path::new("-") => Some((Box::new(io::stderr()), "stderr".to_owned())),
        Some(path) => {
            let name = path.display().to_string();
            let what = format!("write trace {name}");
            let file = File::create(path).map_err(|source| FileError { what, source })?;
            Some((Box::new(file), name))
        }
    };
    let bus: Box<dyn Bus> = match &spec {
        BusSpec::Sim(bench) => Box::new(simulated(bench.as_deref())?),
        BusSpec::SocketCan(name) => socketcan(name)?,
    };
    Ok(match trace {
        Some((out, name)) => Box::new(Traced::new(bus, out, &name)),
        None => bus,
    })
}

fn simulated(bench: Option<&str>) -> anyhow::Result<crate::bus::memory::MemoryBus> {
    let usage = |message: String| Failure::new(Kind::Usage, message);
    let bench = sim::Bench::parse(bench.unwrap_or_default()).map_err(|error| usage(error.to_string()))?;
    Ok(sim::open(&bench).map_err(|source| FileError { what: "open the simulated bus".to_owned(), source })?)
}

#[cfg(target_os = "linux")]
fn socketcan(name: &str) -> Result<Box<dyn Bus>, Failure> {
    Ok(Box::new(crate::bus::socketcan::SocketCan::open(name).or_fail()?))
}

#[cfg(not(target_os = "linux"))]
fn socketcan(name: &str) -> Result<Box<dyn Bus>, Failure> {
    let error = crate::bus::BusError::Unsupported(format!("{name}: this system has no SocketCAN"));
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

fn only_interface() -> Result<BusSpec, Failure> {
    let all = interfaces();
    let up: Vec<&String> = all.iter().filter(|(_, up)| *up).map(|(name, _)| name).collect();
    if let [only] = up.as_slice() {
        return Ok(BusSpec::SocketCan((*only).clone()));
    }
    let list: Vec<String> =
        all.iter().map(|(name, up)| format!("{name} ({})", if *up { "up" } else { "down" })).collect();
    let message = match (all.is_empty(), up.is_empty()) {
        (true, _) => "which bus? There is no CAN interface here".to_owned(),
        (false, true) => format!("which bus? No CAN interface is up: {}", list.join(", ")),
        (false, false) => format!("which bus? There are several CAN interfaces: {}", list.join(", ")),
    };
    let example = up.first().or(all.iter().map(|(name, _)| name).collect::<Vec<_>>().first()).map(|name| name.to_string());
    let hint = match example {
        Some(name) => format!("name one: --bus {name}, or without hardware: --bus sim"),
        None => "without hardware: --bus sim".to_owned(),
    };
    Err(Failure::new(Kind::Usage, message).hint(hint))
}

/// The descriptions that the user named, for `nodes`.
pub(super) fn overrides(global: &Global, nodes: &[NodeId]) -> anyhow::Result<Overrides> {
    let mut overrides = Overrides::new();
    for given in &global.device {
        let model = model(&given.what)?;
        match given.node {
            Some(node) => {
                overrides.insert(node, model);
            }
            None => nodes.iter().for_each(|&node| {
                overrides.entry(node).or_insert_with(|| Arc::clone(&model));
            }),
        }
    }
    overrides.retain(|node, _| nodes.contains(node));
    Ok(overrides)
}

fn model(what: &str) -> anyhow::Result<Arc<Model>> {
    if let Some(model) = catalog::by_name(what) {
        return Ok(model);
    }
    let names: Vec<&str> = catalog::built_in().iter().map(|model| model.description.name.as_str()).collect();
    if !what.contains(['.', '/']) {
        let message = format!("there is no built-in device \"{what}\"");
        return Err(Failure::new(Kind::Usage, message).hint(format!("there are: {}; or name a file", names.join(", "))).into());
    }
    let text = std::fs::read_to_string(what).map_err(|source| FileError { what: format!("read {what}"), source })?;
    let model = Model::from_toml(&text).map_err(|error| Failure::new(Kind::Usage, format!("{what}: {error}")))?;
    Ok(Arc::new(model))
}

/// The nodes meant; `all` are those that a scan finds.
pub(super) fn nodes(master: &mut Master<'_>, global: &Global, nodes: &Nodes) -> anyhow::Result<Vec<NodeId>> {
    match nodes {
        Nodes::These(nodes) => Ok(nodes.clone()),
        Nodes::All => everybody(master, global),
    }
}
