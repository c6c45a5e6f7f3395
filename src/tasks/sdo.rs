//! Reads and writes objects of the object dictionary.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{LONGEST, Note};
use crate::canopen::value::{DataType, Value};
use crate::master::transfer::{BlockMode, Moved};
use crate::master::{Error, Master, NUMBER_LIMIT, Request};
use crate::node::write::write_with;
use crate::node::{self, Node, Overrides, WriteOptions, Written, names, survey};
use crate::tasks::{self, Failure};

/// The maximum length (in bytes) of an object that is read into a file.
pub const FILE_LIMIT: usize = LONGEST;

/// A value of an object.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadValue {
    /// The node.
    pub node: NodeId,
    /// The object.
    pub object: ObjectId,
    /// Its name, if it is known.
    pub name: Option<String>,
    /// Its type, if it is known.
    pub data_type: Option<DataType>,
    /// The value; bytes if the type is unknown.
    pub value: Value,
    /// The bytes in wire order.
    pub raw: Vec<u8>,
    /// A deviation from the standard in the answer.
    pub note: Option<Note>,
}

/// How an object is read.
pub struct ReadOptions<'a> {
    /// When block transfer is used.
    pub blocks: BlockMode,
    /// The maximum number of bytes of an object of unknown length.
    pub longest: usize,
    /// Whether a length that differs from the announced length is always a failure. For content that is saved to a
    /// file.
    pub is_exact: bool,
    /// Called every 100 ms with the bytes transferred.
    pub progress: &'a mut dyn FnMut(Moved),
}

/// Reads an object. The type is `data_type`, else the type in the description or the standard.
///
/// # Errors
/// A failed transfer, bytes that do not fit the type, bus errors and Ctrl-C.
pub fn read(
    master: &mut Master<'_>,
    node: &mut Node,
    object: ObjectId,
    data_type: Option<DataType>,
    options: &mut ReadOptions<'_>,
) -> Result<ReadValue, Failure> {
    let expected = data_type.or_else(|| node.known_type(object));
    let limit = expected.and_then(DataType::width).map_or(options.longest, |_| NUMBER_LIMIT);
    let request = Request::read(node.id, object).blocks(options.blocks.for_read(expected));
    let request = request.up_to(limit).exact(options.is_exact);
    let answer = master.carry_out(request, options.progress)??;
    let entry = match data_type {
        Some(_) => node.entry(object),
        None => names::entry(master, node, object)?,
    };
    let data_type = data_type.or_else(|| node.known_type(object));
    let (value, note) = answer.value(node.id, object, data_type)?;
    let mut raw = answer.uploaded.map(|uploaded| uploaded.bytes).unwrap_or_default();
    raw.truncate(data_type.and_then(DataType::width).unwrap_or(usize::MAX));
    Ok(ReadValue { node: node.id, object, name: entry.map(|entry| entry.full_name()), data_type, value, raw, note })
}

/// Encodes a value for an object, and returns the bytes and their type. The type is `data_type`, else the type in the
/// description or the standard, else an integer as wide as the object.
///
/// # Errors
/// A value that does not fit the type, an unknown type, a failed transfer, bus errors and Ctrl-C.
pub fn encode(
    master: &mut Master<'_>,
    node: &mut Node,
    object: ObjectId,
    data_type: Option<DataType>,
    text: &str,
) -> Result<(Vec<u8>, DataType), Failure> {
    let data_type = match data_type {
        Some(data_type) => data_type,
        None => names::type_for(master, node, object, text)?,
    };
    let encoded = names::encode(node, object, data_type, text);
    if encoded.is_err() && !node.is_identified {
        // The description may explain the word.
        find_form(master, node)?;
        return Ok((names::encode(node, object, data_type, text)?, data_type));
    }
    Ok((encoded?, data_type))
}

/// Reads the identity of a node that has no description yet. The description contains the form of writes that the node
/// accepts.
///
/// A missing answer is not an error. The write itself then finds the form.
///
/// # Errors
/// Bus errors and Ctrl-C.
pub fn find_form(master: &mut Master<'_>, node: &mut Node) -> Result<(), Failure> {
    match survey::identify_late(master, node) {
        Ok(()) | Err(Error::Sdo(_)) => Ok(()),
        Err(error) => Err(error.into()),
    }
}

/// Returns warnings that signals may be clipped, after a write of unit, decimal digits, or the mapping of a TPDO.
pub fn clipping(master: &mut Master<'_>, node: &Node, written: ObjectId) -> Vec<tasks::Note> {
    if !matches!(written.index, 0x1a00..=0x1bff | 0x6131 | 0x6132) {
        return Vec::new();
    }
    let overrides: Overrides = node.model.clone().map(|model| (node.id, model)).into_iter().collect();
    // The write was successful, so a failure to get these warnings is ignored.
    let found = survey::survey_nodes(master, &[node.id], &overrides).unwrap_or_default();
    found.iter().flat_map(|node| tasks::Note::may_clip(node.id, node.layout().narrow_values())).collect()
}

/// Writes bytes to an object, reads them back if `verify` is `true`, and compares. Returns how the write was confirmed.
///
/// # Errors
/// The errors of [`write_with`]; the object has a different value.
pub fn write(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    verify: Option<DataType>,
    options: &mut WriteOptions<'_>,
) -> Result<Written, Failure> {
    let written = write_with(master, node, object, data, options)
        .map_err(|error| Failure::from(error).explained(node, object, data))?;
    let Some(data_type) = verify else { return Ok(written) };
    let (blocks, longest) = (options.blocks, FILE_LIMIT);
    let mut options = ReadOptions { blocks, longest, is_exact: false, progress: &mut *options.progress };
    let found = read(master, &mut node.clone(), object, Some(data_type), &mut options)?.raw;
    if found == data {
        return Ok(written);
    }
    let (written, found) = (Value::Bytes(data.to_vec()), Value::Bytes(found));
    Err(node::Error::ReadBackDiffers { node: node.id, object, written, found }.into())
}
