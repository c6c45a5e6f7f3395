//! An odd device gives no wrong value, no false reason, and no failure that is not necessary.

use super::*;
use crate::odd::{Mute, Oddity};
use cangauge::output::failure::ErrorMessage;

/// Compares the result with the oddity of the device.
pub(super) fn odd(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let odd = spec.devices.iter().find_map(|device| Some((device.node?, device.oddity?)));
    let Some((node, oddity)) = odd.filter(|_| !spec.shares_node_ids()) else { return };
    let has_it = run.bus.bus.inner().stations::<FaultyDevice>().all(|station| station.has_oddity);
    if !has_it {
        return;
    }
    match oddity {
        Oddity::Mute(mute) => reason(run, mute.reason(), mute, violations),
        Oddity::Pdo(0..=7) => {
            if let Some(row) = run.observed.rows.first() {
                violations.push(("odd: no value from a short TPDO", row.clone()));
            }
        }
        Oddity::Stranger => {
            let is_known = |row: &&String| {
                let cells: Vec<&str> = row.split(',').collect();
                cells[1] == node.to_string() && !cells[3].is_empty()
            };
            if let Some(row) = run.observed.rows.iter().find(is_known) {
                violations.push(("odd: no value of an unknown type", row.clone()));
            }
        }
        _ => {}
    }
    if oddity.is_harmless() {
        like_the_plain_device(spec, run, violations);
    }
}

/// The reason for the silence is the real one.
fn reason(run: &Run, expected: &str, mute: Mute, violations: &mut Vec<Violation>) {
    let said = match &run.result {
        Err(failure) => ErrorMessage::of(failure).message,
        Ok(_) if run.observed.rows.is_empty() => "success".to_owned(),
        // Its other TPDOs may be sent.
        Ok(_) => return,
    };
    if !said.contains(expected) {
        violations.push(("odd: the reason for the silence", format!("{mute:?}: {said}")));
    }
}

/// The command ends as with a device that has no oddity.
fn like_the_plain_device(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let mut plain = spec.clone();
    plain.devices.iter_mut().for_each(|device| device.oddity = None);
    let plain = crate::run::run(&plain);
    let outcome = |run: &Run| (run.result.as_ref().err().map(|failure| failure.kind()), run.observed.rows.is_empty());
    if outcome(run) != outcome(&plain) {
        let how = format!("{:?} with {} rows", run.result, run.observed.rows.len());
        let without = format!("{:?} with {} rows", plain.result, plain.observed.rows.len());
        violations.push(("odd: as without the oddity", format!("{how}, and without it {without}")));
    }
}
