//! The EDS file of the device: against CiA 306, and against the device.

mod limits;
mod mapping;
mod objects;
mod structure;
mod values;

use super::case::{Area, Case, Run, Severity::*};
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::session::Session;
use super::settings::may_write;
use crate::canopen::object::ObjectId;
use crate::device::dictionary::Entry;
use crate::device::eds::{Eds, Warning};
use crate::device::{profiles, standard};
use crate::node::Error;
use std::sync::Arc;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Eds, id, sentence, clause, run)
}

const OBJECTS: &str = "CiA 306, object sections";
const ACCESS: &str = "CiA 306, AccessType";
const LIMITS: &str = "CiA 306, LowLimit and HighLimit";
const MAPPING: &str = "CiA 306, PDOMapping";

pub(super) const CASES: &[Case] = &[
    case("EDS-01", "The file follows CiA 306", "CiA 306, file format", format)
        .matters(Medium, "Tools reject the file, or read it differently."),
    case("EDS-02", "The file contains 1000h, 1001h and 1018h", "CiA 306, mandatory objects", mandatory)
        .matters(Medium, "Tools do not recognise the device, or reject the file."),
    case("EDS-03", "Objects of CiA 301 have the data types of CiA 301 in the file", "CiA 301, objects", types)
        .matters(High, "Masters write values of a wrong length, or decode values wrongly."),
    case("EDS-04", "Each default of the file is within its limits", LIMITS, values::defaults_within_limits)
        .matters(Low, "Tools reject the file or the default."),
    case(
        "EDS-05",
        "[DeviceInfo] has the vendor, the product and the revision of the device",
        "CiA 306, DeviceInfo",
        values::device_info,
    )
    .matters(Medium, "Tools do not assign the file to the device."),
    case("EDS-06", "1000h, 1008h and 1018h have the defaults of the file", OBJECTS, values::identity)
        .matters(Medium, "Masters that compare the device with the file reject the device."),
    case("EDS-10", "Each object of the file exists in the device", OBJECTS, objects::exist)
        .matters(High, "Masters that use the object fail."),
    case(
        "EDS-11",
        "The file contains the objects of CiA 301 and CiA 404 that the device has",
        OBJECTS,
        objects::are_listed,
    )
    .matters(Low, "Tools do not offer a setting of the device."),
    case("EDS-12", "Each object has the size of its data type", "CiA 306, DataType", objects::have_sizes)
        .matters(High, "Masters write values of a wrong length, or decode values wrongly."),
    case(
        "EDS-13",
        "Objects that the file calls ro or const reject a write of their present value",
        ACCESS,
        objects::read_only,
    )
    .matters(Medium, "A wrong write changes the device, or the abort code does not show the reason."),
    case("EDS-14", "Objects that the file calls wo reject a read", ACCESS, objects::write_only)
        .matters(Low, "The reason of a failed read is not shown."),
    case("EDS-15", "Objects that the file calls rw are not read-only", ACCESS, objects::writable)
        .matters(High, "Masters cannot configure the device."),
    case("EDS-16", "An integer above its HighLimit is rejected, and changes nothing", LIMITS, limits::too_high)
        .matters(Medium, "A setting that the device does not support is not noticed."),
    case("EDS-17", "An integer below its LowLimit is rejected, and changes nothing", LIMITS, limits::too_low)
        .matters(Medium, "A setting that the device does not support is not noticed."),
    case(
        "EDS-18",
        "After a restore and a reset, the settings have the defaults of the file",
        "CiA 306, DefaultValue",
        values::restored,
    )
    .matters(Medium, "Masters that write only the differences from the defaults configure the device wrongly.")
    .stores(),
    case("EDS-19", "Objects that the file calls mappable can be mapped to a TPDO", MAPPING, mapping::mappable)
        .matters(High, "Masters that map the object fail."),
    case("EDS-20", "Objects that the file does not call mappable cannot be mapped", MAPPING, mapping::not_mappable)
        .matters(Low, "A wrong mapping is not noticed."),
    case(
        "EDS-21",
        "Sub-index 255 of an object, if there is one, contains the data type of the file",
        "CiA 301, sub-index 255",
        structure::types,
    )
    .matters(Low, "Tools that read the data types from the device decode values wrongly."),
];

/// The objects that each device has.
const MANDATORY: [u16; 3] = [0x1000, 0x1001, 0x1018];

const NO_FILE: Verdict = Verdict::NotApplicable(WhyNot::NoEds);

/// The file that the user named.
fn file(session: &Session<'_, '_>) -> Option<Arc<Eds>> {
    session.eds.clone()
}

/// The entries of the file with a known type that a tool may read.
fn entries(eds: &Eds) -> impl Iterator<Item = &Entry> {
    let may_read = |entry: &&Entry| eds.flags.get(&entry.object).is_none_or(|flags| !flags.skip_read);
    eds.dictionary.iter().filter(may_read).filter(|entry| !eds.untyped.contains(&entry.object))
}

/// Whether a write starts an action. CiA 301 and 302: commands, program download, NMT of other nodes.
fn starts_action(index: u16) -> bool {
    // CiA 404: 6111h calibrates, 6125h sets zero, 6139h tares, also in its other number formats.
    let is_command = index >= 0x6000 && matches!(index & 0x7ff, 0x111 | 0x125 | 0x139);
    is_command || matches!(index, 0x1021..=0x1026 | 0x1f20..=0x1f5f | 0x1f82)
}

/// Whether a case may write the object: a setting of the communication or of the profile, no process data, no action.
fn is_setting(session: &Session<'_, '_>, entry: &Entry) -> bool {
    let described = session.node.model.as_ref().and_then(|model| model.description.object(entry.object));
    let is_signature = described.is_some_and(|object| object.signature.is_some());
    may_write(entry.object) && !starts_action(entry.object.index) && !entry.pdo && !is_signature
}

fn format(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let finding = |warning: &Warning| Finding {
        object: warning.index.map(|index| ObjectId::new(index, 0)),
        expected: Expected::Cia306,
        seen: Seen::Line(warning.line, warning.text.clone()),
    };
    Ok(Verdict::of(eds.warnings.iter().map(finding)))
}

fn mandatory(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let missing = MANDATORY.into_iter().filter(|index| !eds.dictionary.has_index(*index));
    let finding = |index| Finding::at(ObjectId::new(index, 0), Expected::InFile, Seen::NotInFile);
    Ok(Verdict::of(missing.map(finding)))
}

fn types(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = file(session) else { return Ok(NO_FILE) };
    let of_standard = entries(&eds).filter(|entry| entry.object.index < 0x2000);
    let finding = |entry: &Entry| {
        let wanted = standard::entry(entry.object)?.data_type;
        let is_other = wanted != entry.data_type;
        is_other.then(|| Finding::at(entry.object, Expected::Type(wanted), Seen::Type(entry.data_type)))
    };
    Ok(Verdict::of(of_standard.filter_map(finding)))
}

/// Whether the objects of CiA 404 apply to the device.
fn is_measuring(session: &mut Session<'_, '_>) -> Result<bool, Error> {
    let device_type = session.number(ObjectId::DEVICE_TYPE)?;
    Ok(device_type.is_some_and(|word| word & 0xffff == u64::from(profiles::MEASURING)))
}
