//! Who starts a device after power on: the master, or the device itself (1F80h, and its like).

use crate::canopen::id::NodeId;
use crate::canopen::value::DataType;
use crate::device::description::Startup;
use crate::master::{BlockMode, Master};
use crate::node::Overrides;
use crate::node::survey::identify;
use crate::tasks::sdo::{Knowledge, Options, SizeMode, write};
use crate::tasks::{Failure, Kind};
use std::sync::Arc;

/// Who starts the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Starts {
    /// It waits in PRE-OPERATIONAL for the master.
    Wait,
    /// It goes to OPERATIONAL by itself.
    Auto,
    /// A number whose meaning its description does not tell.
    Other(u64),
}

/// What a device is set to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StartupReport {
    /// Who starts it.
    pub starts: Starts,
    /// The number in the object.
    pub raw: u64,
    /// What the manual contradicts or leaves open.
    pub doubt: String,
}

/// Reads who starts a device, after setting it if `set` says so. It is read back after being set.
///
/// # Errors
/// A device whose description names no such object, refusals, and an object that does not keep what was
/// written.
pub fn startup(
    master: &mut Master<'_>,
    node: NodeId,
    overrides: &Overrides,
    set: Option<Starts>,
) -> Result<StartupReport, Failure> {
    let model = identify(master, &[node], overrides)?.pop().and_then(|instrument| instrument.model);
    let entry = model.as_ref().and_then(|model| model.description.startup.clone()).ok_or_else(|| {
        let message = "no source at hand says which object of this device decides who starts it";
        Failure::of_node(Kind::Unexpected, node, message)
            .hint(format!("many devices have 1F80h; read it raw: cangauge sdo read {node} 0x1F80"))
    })?;
    let wanted = match set {
        Some(Starts::Wait) => Some(entry.wait),
        Some(Starts::Auto) => Some(entry.auto),
        Some(Starts::Other(_)) | None => None,
    };
    if let Some(number) = wanted {
        let data = DataType::Unsigned(4).encode_text(&number.to_string());
        let data = data.map_err(|error| Failure::of_node(Kind::Usage, node, error))?;
        let known = model.as_ref().map(|model| (node, Arc::clone(model)));
        let knowledge = Knowledge::new(node, &known.into_iter().collect());
        let mut options = Options { blocks: BlockMode::Never, size: SizeMode::Auto, progress: &mut |_| {} };
        write(master, &knowledge, entry.object, &data, &mut options)?;
    }
    let found = report(&entry, master, node)?;
    if wanted.is_some_and(|wanted| u64::from(wanted) != found.raw) {
        let message = format!("{} was acknowledged and reads {}", entry.object, found.raw);
        return Err(Failure::of_node(Kind::Unexpected, node, message));
    }
    Ok(found)
}

fn report(entry: &Startup, master: &mut Master<'_>, node: NodeId) -> Result<StartupReport, Failure> {
    let raw = master.read(node, entry.object, DataType::Unsigned(4))??.as_u64().unwrap_or(0);
    let starts = if raw == u64::from(entry.wait) {
        Starts::Wait
    } else if raw == u64::from(entry.auto) {
        Starts::Auto
    } else {
        Starts::Other(raw)
    };
    Ok(StartupReport { starts, raw, doubt: entry.doubt.clone() })
}
