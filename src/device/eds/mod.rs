//! EDS and DCF files (CiA 306): the object dictionary that a vendor ships with a device, and the settings of one
//! device. The module takes bytes and returns a result; it opens no file and prints no warning.
//!
//! Few real files follow CiA 306. Deviations with only one meaning are accepted silently. Examples: letter case,
//! blanks, line ends, a byte order mark, Windows-1252, comments after values, `R` and `rwr`,
//! `0x180+$NODEID`, long lines. Lost, guessed or contradictory data gives a [`Warning`] with its line. Examples: octal
//! numbers, defaults that do not fit their type, unknown data types, duplicate keys. A file is rejected only if it
//! describes no object.
//!
//! `names.rs` describes the names of objects.

mod content;
mod info;
mod ini;
pub(in crate::device) mod names;
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

/// The contents of an EDS or DCF file.
#[derive(Clone, Debug, Default)]
pub struct Eds {
    /// The objects, each with its default from the file.
    pub dictionary: Dictionary,
    /// Vendor, product and versions.
    pub info: Info,
    /// The settings of one device; only a DCF has them.
    pub commissioning: Option<Commissioning>,
    /// The values of one device that replace the defaults; only a DCF has them.
    pub parameter_values: BTreeMap<ObjectId, Scalar>,
    /// The line of each of these values.
    pub value_lines: BTreeMap<ObjectId, usize>,
    /// Values of writable objects that cannot be read, with the reasons. They are missing in `parameter_values`.
    pub unread_values: Vec<Warning>,
    /// Objects that tools must skip when they read or write the whole dictionary.
    pub flags: BTreeMap<ObjectId, ObjectFlags>,
    /// The objects whose data type is missing or unknown. Their entries have the type DOMAIN and are read as bytes. For
    /// a write, the user or the device must give the type.
    pub untyped: BTreeSet<ObjectId>,
    /// Warnings, in the order of the lines.
    pub warnings: Vec<Warning>,
}

/// `[DeviceInfo]`, and the version from `[FileInfo]`. `None` for a missing or empty key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Info {
    /// Version of the EDS format; 3.0 if the file does not contain it (CiA 306).
    pub eds_version: String,
    /// The manufacturer.
    pub vendor_name: Option<String>,
    /// 1018h:1.
    pub vendor_number: Option<u32>,
    /// The product name.
    pub product_name: Option<String>,
    /// 1018h:2.
    pub product_number: Option<u32>,
    /// 1018h:3.
    pub revision_number: Option<u32>,
    /// The order code.
    pub order_code: Option<String>,
    /// The supported bit rates in bit/s, ascending.
    pub bit_rates: Vec<u32>,
    /// Whether the device supports LSS.
    pub lss_supported: Option<bool>,
}

/// `[DeviceCommissioning]`; CiA 306 spells it `[DeviceComissioning]`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Commissioning {
    /// The node-ID of the device.
    pub node_id: Option<NodeId>,
    /// The name of the node in its network.
    pub node_name: Option<String>,
    /// The bit rate of the network in bit/s (the file has kbit/s).
    pub bit_rate: Option<u32>,
    /// The number of the network.
    pub net_number: Option<u32>,
    /// The name of the network.
    pub network_name: Option<String>,
    /// Whether this node manages the network.
    pub manager: Option<bool>,
    /// The serial number by which LSS finds the device, 1018h:4.
    pub lss_serial: Option<u32>,
}

/// `ObjFlags` of an object.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ObjectFlags {
    /// Bit 0: whether a tool that writes a whole configuration skips the object (1010h, 1011h).
    pub skip_write: bool,
    /// Bit 1: whether a tool that reads a whole device skips the object.
    pub skip_read: bool,
}

/// Lost, guessed or contradictory data in a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The line, counted from 1.
    pub line: usize,
    /// The index of the object whose section contains the line.
    pub index: Option<u16>,
    /// One sentence. Text from the file is shortened and safe for a terminal.
    pub text: String,
}

impl Warning {
    fn new(line: usize, text: impl Into<String>) -> Warning {
        Warning { line, index: None, text: text.into() }
    }
}

impl fmt::Display for Warning {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "line {}: {}", self.line, self.text)
    }
}

/// A file that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("line {line}: {reason}")]
pub struct EdsError {
    /// The line, counted from 1.
    pub line: usize,
    /// The reason.
    pub reason: String,
}

/// Reads an EDS or DCF file.
///
/// Time and memory grow with the length of `bytes` only, not with the numbers in the file.
///
/// # Errors
/// The file describes no object.
pub fn read(bytes: &[u8]) -> Result<Eds, EdsError> {
    let text = text::decode(bytes);
    let mut warnings = Vec::new();
    let ini = ini::Ini::read(&text, &mut warnings);
    if let Some(reason) = other_format(bytes, &text) {
        return Err(EdsError { line: 1, reason: reason.to_owned() });
    }
    if ini.sections.is_empty() {
        return Err(no_section(&text));
    }
    let info = info::info(&ini, &mut warnings);
    let commissioning = info::commissioning(&ini, &mut warnings);
    let objects = objects::read(&ini, &mut warnings);
    if objects.described.is_empty() {
        return Err(EdsError {
            line: ini.lines,
            reason: "the file has no object: a section such as [1000] is missing".to_owned(),
        });
    }
    warnings.sort_by_key(|warning| warning.line);
    for warning in &mut warnings {
        let section = ini.sections.iter().filter(|section| section.line <= warning.line).max_by_key(|one| one.line);
        warning.index = section.and_then(|section| section_index(&section.name));
    }
    Ok(Eds {
        dictionary: names::dictionary(&objects.names, objects.described),
        info,
        commissioning,
        parameter_values: objects.parameter_values,
        value_lines: objects.value_lines,
        unread_values: objects.unread_values,
        flags: objects.flags,
        untyped: objects.untyped,
        warnings,
    })
}

/// Returns the index of the object in the name of its section: `1018`, `1018sub1`, `1018Name`.
fn section_index(name: &str) -> Option<u16> {
    let name = name.strip_prefix("0x").unwrap_or(name);
    let digits = name.get(..4)?;
    let is_object = name.len() == 4 || name[4..].starts_with(['s', 'S', 'n', 'N', 'v', 'V', 'd', 'D']);
    u16::from_str_radix(digits, 16).ok().filter(|_| is_object)
}

/// Returns a message for a file of another format that is often used instead of an EDS by mistake.
fn other_format(bytes: &[u8], text: &str) -> Option<&'static str> {
    let binary: [(&[u8], &str); 4] = [
        (b"PK\x03\x04", "this is a zip archive: unpack it, and use the EDS file in it"),
        (b"\x1f\x8b", "this is a gzip file: unpack it (gunzip)"),
        (b"%PDF", "this is a PDF document, perhaps the manual; expected an EDS or DCF file"),
        (b"MZ", "this is a program, perhaps an installer; expected an EDS or DCF file"),
    ];
    let known = binary.iter().find(|(magic, _)| bytes.starts_with(magic)).map(|(_, reason)| *reason);
    let start = text.trim_start().get(..14).unwrap_or_default().to_ascii_lowercase();
    let is_page = start.starts_with("<!doctype html") || start.starts_with("<html");
    known.or(is_page.then_some("this is a web page: download the EDS file itself")).or_else(|| {
        let is_description = text.lines().any(|line| matches!(line.trim(), "[[signal]]" | "[[object]]"));
        is_description.then_some("this is a device description in TOML: use --device instead of --eds")
    })
}

fn no_section(text: &str) -> EdsError {
    let first = (1..).zip(text.lines()).find(|(_, line)| !line.trim().is_empty());
    let (line, reason) = match first {
        None => (1, "the file is empty"),
        Some((line, content)) if content.trim_start().starts_with('<') => {
            (line, "this is XML, perhaps an XDD or XDC file; expected an EDS or DCF file")
        }
        Some((line, _)) => (line, "this is not an EDS or DCF file: it has no section such as [DeviceInfo]"),
    };
    EdsError { line, reason: reason.to_owned() }
}

impl Eds {
    /// Returns the value for the device: the parameter value of a DCF, else the default.
    pub fn value(&self, object: ObjectId) -> Option<&Scalar> {
        let default = || self.dictionary.get(object)?.default.as_ref();
        self.parameter_values.get(&object).or_else(default)
    }

    /// The dictionary with the parameter values of the DCF in place of the defaults.
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
