//! Shows or sets how a device starts after power-on: by the master or by itself (1F80h, or an object of the device).

use super::NmtFailure;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::Master;
use crate::node::survey::identify;
use crate::node::write::write_and_verify;
use crate::node::{Node, Overrides};
use crate::tasks::Failure;

/// How the device starts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Starts {
    /// The device waits in PRE-OPERATIONAL for the master.
    Wait,
    /// The device changes to OPERATIONAL by itself.
    Auto,
    /// A number that the description does not explain.
    Other(u64),
}

/// The start-up setting of a device.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct StartupReport {
    /// The node.
    pub node: NodeId,
    /// The object that was read.
    pub object: ObjectId,
    /// How the device starts.
    pub starts: Starts,
    /// The number in the object.
    pub raw: u64,
    /// The doubt, if the manual is contradictory or incomplete.
    pub doubt: String,
}

/// Reads how a device starts. With `set`, the setting is written first and read back.
///
/// # Errors
/// [`NmtFailure::NoStartupObject`]; a failed transfer, a value that differs when read back, bus errors and Ctrl-C.
pub fn startup(
    master: &mut Master<'_>,
    node: NodeId,
    overrides: &Overrides,
    set: Option<Starts>,
) -> Result<StartupReport, Failure> {
    let node = identify(master, &[node], overrides)?.pop().unwrap_or_else(|| Node::new(node));
    let described = node.model.as_ref().and_then(|model| model.description.startup.clone());
    let entry = described.ok_or_else(|| Failure::at(node.id, NmtFailure::NoStartupObject))?;
    let number = match set {
        Some(Starts::Wait) => Some(entry.wait),
        Some(Starts::Auto) => Some(entry.auto),
        Some(Starts::Other(_)) | None => None,
    };
    let data_type = DataType::Unsigned(4);
    if let Some(number) = number {
        write_and_verify(master, &node, entry.object, &number.to_le_bytes(), data_type)?;
    }
    let raw = master.read(node.id, entry.object, data_type)??.as_u64().unwrap_or(0);
    let starts = if raw == u64::from(entry.wait) {
        Starts::Wait
    } else if raw == u64::from(entry.auto) {
        Starts::Auto
    } else {
        Starts::Other(raw)
    };
    Ok(StartupReport { node: node.id, object: entry.object, starts, raw, doubt: entry.doubt.clone() })
}
