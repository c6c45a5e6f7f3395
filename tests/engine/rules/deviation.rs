//! A device with a deviation causes no wrong value, no false reason and no unnecessary failure.

use super::*;
use crate::deviation::{Deviation, TpdoFault};
use cangauge::canopen::frame::Frame;
use cangauge::output::failure::ErrorMessage;

/// Compares the result with the deviation of the device.
pub(super) fn deviation(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let duplicate = spec.devices.iter().find(|device| device.deviation == Some(Deviation::DuplicateId));
    if let Some(duplicate) = duplicate.filter(|_| spec.shares_node_ids()) {
        duplicate_id(duplicate.node.unwrap_or_default(), run, violations);
    }
    let found = spec.devices.iter().find_map(|device| Some((device.node?, device.deviation?)));
    let Some((node, deviation)) = found.filter(|_| !spec.shares_node_ids()) else { return };
    let has_it = run.bus.bus.inner().inner().stations::<FaultyDevice>().all(|station| station.has_deviation);
    if !has_it {
        return;
    }
    match deviation {
        Deviation::NoTpdo(fault) => reason(run, fault.reason(), fault, violations),
        Deviation::Pdo(0..=7) => {
            if let Some(row) = run.observed.rows.first() {
                violations.push(("deviation: no value from a short TPDO", row.clone()));
            }
        }
        Deviation::Clips => {
            let is_clipped = |row: &&String| row.ends_with(",,bar,clipped,0xFF7F");
            let of_node = |row: &&String| row.split(',').nth(1) == Some(node.to_string().as_str());
            let wrong =
                run.observed.rows.iter().filter(of_node).find(|row| row.ends_with("0xFF7F") && !is_clipped(row));
            violations.extend(wrong.map(|row| ("deviation: no value of a clipped integer", row.clone())));
            if matches!(run.result, Ok(Claim::Satisfied)) {
                violations.push(("deviation: no value of a clipped integer", "the check is satisfied".to_owned()));
            }
        }
        Deviation::Unidentified => {
            let is_known = |row: &&String| {
                let cells: Vec<&str> = row.split(',').collect();
                cells[1] == node.to_string() && !cells[3].is_empty()
            };
            if let Some(row) = run.observed.rows.iter().find(is_known) {
                violations.push(("deviation: no value of an unknown type", row.clone()));
            }
        }
        _ => {}
    }
    if deviation.is_harmless() {
        like_the_plain_device(spec, run, violations);
    }
}

/// Two devices with one node-ID: no value of either, and no write.
fn duplicate_id(node: u8, run: &Run, violations: &mut Vec<Violation>) {
    let has_value = |row: &&String| {
        let cells: Vec<&str> = row.split(',').collect();
        cells[1] == node.to_string() && !cells[3].is_empty()
    };
    let row = run.observed.rows.iter().find(has_value);
    violations.extend(row.map(|row| ("deviation: no value of two devices", row.clone())));
    // After a collision, an answer arrives later or never, because a device may then be bus-off.
    let sent = run.bus.bus.inner().inner().stations::<FaultyDevice>().flat_map(|station| &station.sent);
    let answers: Vec<_> = sent
        .filter(|(at, frame)| *at <= run.ended && frame.id().sdo_response_node().is_some_and(|from| from.get() == node))
        .collect();
    if let Ok(Claim::Values(values)) = &run.result {
        let contents = |object: ObjectId| {
            let [low, high] = object.index.to_le_bytes();
            let data = answers.iter().filter_map(|(_, frame)| frame.as_eight_bytes());
            let data = data.filter(|data| data[1..4] == [low, high, object.sub]);
            data.map(|data| data[4..].to_vec()).collect::<BTreeSet<_>>()
        };
        let differs = values.iter().find(|(_, object, _)| contents(*object).len() > 1);
        violations.extend(differs.map(|value| ("deviation: no value of two devices", format!("{value:?}"))));
    }
    let requests = run.bus.all_sent();
    let requests =
        requests.iter().filter(|(_, frame)| frame.id().sdo_request_node().is_some_and(|to| to.get() == node));
    let write = requests.clone().find(|(_, frame)| frame.data().first().is_some_and(|first| first >> 5 == 1));
    let Some((written, frame)) = write else { return };
    // The serial numbers differ. The bus may deliver one answer only.
    let is_serial = |frame: &Frame| frame.data().get(1..4) == Some(&[0x18, 0x10, 4]);
    let is_asked = requests.clone().any(|(at, frame)| at < written && is_serial(frame));
    let serials = answers.iter().filter(|(at, frame)| at < written && is_serial(frame));
    let is_single = is_asked && serials.count() == 1;
    if !is_single {
        violations.push(("deviation: no write to two devices", frame.to_string()));
    }
}

/// The reason for the silence is the real one.
fn reason(run: &Run, expected: &str, fault: TpdoFault, violations: &mut Vec<Violation>) {
    let said = match &run.result {
        Err(failure) => ErrorMessage::of(failure).message,
        Ok(_) if run.observed.rows.is_empty() => "success".to_owned(),
        // Its other TPDOs may be sent.
        Ok(_) => return,
    };
    if !said.contains(expected) {
        violations.push(("deviation: the reason for the silence", format!("{fault:?}: {said}")));
    }
}

/// The command ends as with a device that has no deviation.
fn like_the_plain_device(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let mut plain = spec.clone();
    plain.devices.iter_mut().for_each(|device| device.deviation = None);
    let plain = crate::run::run(&plain);
    let outcome = |run: &Run| (run.result.as_ref().err().map(|failure| failure.kind()), run.observed.rows.is_empty());
    if outcome(run) != outcome(&plain) {
        let how = format!("{:?} with {} rows", run.result, run.observed.rows.len());
        let without = format!("{:?} with {} rows", plain.result, plain.observed.rows.len());
        violations.push(("deviation: as without the deviation", format!("{how}, and without it {without}")));
    }
}
