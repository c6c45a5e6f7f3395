//! EDS and DCF files (CiA 306): the object dictionary that a vendor ships with a device, and the settings
//! of one device of the kind. Bytes in, result out; who opens the file, and where warnings go, is not known here.
//!
//! Real files are seldom what CiA 306 asks for. What can be read in one way only is read without a word:
//! letter case, blanks anywhere, every kind of line end, a byte order mark, UTF-8, Windows-1252, comments
//! behind values, `R` and `RW`, `rwr`, both spellings of Commissioning, `0x180+$NODEID`, overlong lines.
//! What is lost, guessed or contradicts itself is a [`Warning`] with its line: octal numbers, `0.0` for an
//! integer, defaults that do not fit their type, unknown data types, keys given twice, sub-objects without
//! an object. A file is refused only when it describes no object at all.
//!
//! How objects are called is told in `names.rs`.

mod content;
mod info;
mod ini;
mod names;
mod objects;
mod sections;
mod text;
mod value;

use super::dictionary::Dictionary;
use super::scalar::Scalar;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt;

/// What an EDS or DCF file says.
#[derive(Clone, Debug, Default)]
pub struct Eds {
    /// The objects, each with its default as the file gives it.
    pub dictionary: Dictionary,
    /// Who made what.
    pub info: Info,
    /// The settings of one device; only a DCF has them.
    pub commissioning: Option<Commissioning>,
    /// The values that one device is to have in place of the defaults; only a DCF has them.
    pub parameter_values: BTreeMap<ObjectId, Scalar>,
    /// What tools that read or write the whole dictionary are to leave out.
    pub flags: BTreeMap<ObjectId, ObjectFlags>,
    /// The objects of which the file does not say a data type that we know. Their entries have DOMAIN: they
    /// can be read by name, as bytes; what to write to them is for the user, or for the device, to tell.
    pub untyped: BTreeSet<ObjectId>,
    /// What was lost, guessed or contradictory, by line.
    pub warnings: Vec<Warning>,
}

/// `[DeviceInfo]`, and the version out of `[FileInfo]`. What the file leaves out or leaves empty is `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Info {
    /// Version of the EDS format; CiA 306 wants a file without one to be read as 3.0.
    pub eds_version: String,
    /// Who makes the device.
    pub vendor_name: Option<String>,
    /// 1018h:1.
    pub vendor_number: Option<u32>,
    /// What it is called.
    pub product_name: Option<String>,
    /// 1018h:2.
    pub product_number: Option<u32>,
    /// 1018h:3.
    pub revision_number: Option<u32>,
    /// What to ask the vendor for.
    pub order_code: Option<String>,
    /// The bit rates that it knows, in bit/s, ascending.
    pub bit_rates: Vec<u32>,
    /// Whether it has LSS.
    pub lss_supported: Option<bool>,
}

/// `[DeviceCommissioning]`, which CiA 306 spells `[DeviceComissioning]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Commissioning {
    /// The node-ID of the device.
    pub node_id: Option<NodeId>,
    /// What the node is called in its network.
    pub node_name: Option<String>,
    /// The bit rate of the network in bit/s (the file has kbit/s).
    pub bit_rate: Option<u32>,
    /// The number of the network.
    pub net_number: Option<u32>,
    /// What the network is called.
    pub network_name: Option<String>,
    /// Whether this node manages the network.
    pub manager: Option<bool>,
    /// The serial number by which LSS finds the device, 1018h:4.
    pub lss_serial: Option<u32>,
}

/// `ObjFlags` of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ObjectFlags {
    /// Bit 0: a tool that writes a whole configuration leaves it out (1010h, 1011h).
    pub skip_write: bool,
    /// Bit 1: a tool that reads a whole device leaves it out.
    pub skip_read: bool,
}

/// Something in a file that was lost, guessed or contradictory.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// Where, counted from 1.
    pub line: usize,
    /// What, in one sentence; file text in it is short and safe for a terminal.
    pub text: String,
}

impl Warning {
    fn new(line: usize, text: impl Into<String>) -> Warning {
        Warning { line, text: text.into() }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.text)
    }
}

/// A file that is of no use.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct EdsError {
    /// Where that became clear, counted from 1.
    pub line: usize,
    /// Why.
    pub reason: String,
}

/// Reads an EDS or DCF file.
///
/// Time and memory grow with the length of `bytes`, whatever numbers stand in them.
///
/// # Errors
/// A file that describes no object.
pub fn read(bytes: &[u8]) -> Result<Eds, EdsError> {
    let text = text::decode(bytes);
    let mut warnings = Vec::new();
    let ini = ini::Ini::read(&text, &mut warnings);
    if ini.sections.is_empty() {
        return Err(no_section(&text));
    }
    let info = info::info(&ini, &mut warnings);
    let commissioning = info::commissioning(&ini, &mut warnings);
    let objects = objects::read(&ini, &mut warnings);
    if objects.described.is_empty() {
        return Err(EdsError {
            line: ini.lines,
            reason: "the file ends, and no section such as [1000] describes an object".to_owned(),
        });
    }
    warnings.sort_by_key(|warning| warning.line);
    Ok(Eds {
        dictionary: names::dictionary(&objects.names, objects.described),
        info,
        commissioning,
        parameter_values: objects.parameter_values,
        flags: objects.flags,
        untyped: objects.untyped,
        warnings,
    })
}

fn no_section(text: &str) -> EdsError {
    let first = (1..).zip(text.lines()).find(|(_, line)| !line.trim().is_empty());
    let (line, reason) = match first {
        None => (1, "the file is empty"),
        Some((line, content)) if content.trim_start().starts_with('<') => {
            (line, "this is XML, perhaps an XDD or XDC file; an EDS or DCF file is wanted")
        }
        Some((line, _)) => (line, "no section such as [DeviceInfo] follows: not an EDS or DCF file"),
    };
    EdsError { line, reason: reason.to_owned() }
}

impl Eds {
    /// The value that the device is to have: the parameter value of a DCF, else the default.
    pub fn value(&self, object: ObjectId) -> Option<&Scalar> {
        let default = || self.dictionary.get(object)?.default.as_ref();
        self.parameter_values.get(&object).or_else(default)
    }

    /// The dictionary of the device as the DCF configures it: parameter values in place of defaults.
    pub fn configured(&self) -> Dictionary {
        let mut dictionary = self.dictionary.clone();
        for (object, value) in &self.parameter_values {
            if let Some(entry) = self.dictionary.get(*object) {
                let mut entry = entry.clone();
                entry.default = Some(value.clone());
                dictionary.insert(entry);
            }
        }
        dictionary
    }
}
