//! Checks the conditions of `[device]`: the kind of device, its measuring range, relative or absolute pressure.

use super::check::{FileSettings, parse_number, parse_range};
use super::failure::ConfigFailure;
use super::identity::Range;
use super::snapshot::Snapshot;
use crate::device::config_file::{Entry, Item};
use crate::device::unit::Unit;
use crate::tasks::Failure;

/// The relative difference up to which two ranges are equal, because devices round after a change of the unit.
const RANGE_TOLERANCE: f64 = 0.001;

/// Checks the conditions of a file. The serial number is checked only if the calibration is used.
///
/// # Errors
/// [`ConfigFailure::Condition`] with the first condition that the device does not meet.
pub fn check_device(file: &FileSettings, snapshot: &Snapshot, with_calibration: bool) -> Result<(), Failure> {
    let node = snapshot.node.id;
    let is_checked = |entry: &&Entry| with_calibration || entry.key != "calibration.serial";
    if let Some((entry, found)) = unmet(file, snapshot).into_iter().find(|(entry, _)| is_checked(entry)) {
        let (key, place, wanted) = (entry.key.clone(), entry.value_at, entry.value.clone());
        return Err(Failure::at(node, ConfigFailure::Condition { place, key, wanted, found }));
    }
    let has_serial = file.conditions.iter().any(|entry| entry.key == "calibration.serial");
    let calibration = file.wanted.iter().find(|wanted| wanted.entry.key.starts_with("calibration."));
    match calibration.filter(|_| with_calibration && !has_serial) {
        Some(wanted) => Err(Failure::at(node, ConfigFailure::NoSerial { place: wanted.entry.key_at })),
        None => Ok(()),
    }
}

/// Returns the conditions that a device does not meet, with the values of the device.
pub(super) fn unmet<'a>(file: &'a FileSettings, snapshot: &Snapshot) -> Vec<(&'a Entry, Option<Item>)> {
    let kind = snapshot.kind();
    let identity = &snapshot.node.identity;
    let code = |number: Option<u32>| number.map(|number| Item::Text(format!("0x{number:X}")));
    let mut unmet = Vec::new();
    for entry in &file.conditions {
        let same_number = |found: Option<u32>| found.is_some() && found == parse_number(&entry.value);
        let same_text = |found: Option<Item>| (found.as_ref() == Some(&entry.value), found);
        let (is_met, found) = match entry.key.as_str() {
            "device.kind" => same_text(kind.name.clone().map(Item::Text)),
            "device.reference" => same_text(kind.reference.clone().map(Item::Text)),
            "device.vendor" => (same_number(identity.vendor), code(identity.vendor)),
            "device.product" => (same_number(identity.product), code(identity.product)),
            "calibration.serial" => {
                let is_met = identity.serial != Some(0) && same_number(identity.serial);
                (is_met, identity.serial.map(|serial| Item::Integer(serial.into())))
            }
            key => {
                let signal = key.strip_prefix("device.range.").unwrap_or_default();
                let found = kind.ranges.iter().find(|range| range.signal == signal);
                (found.is_some_and(|found| is_same_range(entry, found)), found.map(|found| Item::Text(found.text())))
            }
        };
        if !is_met {
            unmet.push((entry, found));
        }
    }
    unmet
}

fn is_same_range(entry: &Entry, found: &Range) -> bool {
    let Item::Text(text) = &entry.value else { return false };
    let Some((start, end, unit)) = parse_range(text) else { return false };
    let present = found.unit.unwrap_or(Unit::NONE);
    let unit = unit.beside(present);
    let convert = |number: f64| if unit == present { Some(number) } else { unit.convert(number, present) };
    let own_start = found.start.map(|start| start.as_f64());
    let own_end = found.end.as_f64();
    let tolerance = 1.5 * found.step + RANGE_TOLERANCE * (own_end - own_start.unwrap_or(0.0)).abs();
    let is_near = |wanted: f64, own: f64| convert(wanted).is_some_and(|wanted| (wanted - own).abs() <= tolerance);
    let is_same_start = match (start, own_start) {
        (Some(wanted), Some(own)) => is_near(wanted, own),
        (wanted, own) => wanted.is_none() && own.is_none(),
    };
    is_same_start && is_near(end, own_end)
}
