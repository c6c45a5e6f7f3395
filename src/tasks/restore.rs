//! Restores the factory defaults of a device: "load" written to 1011h. Node-ID and bit rate do not change.

use crate::master::Master;
use crate::node::{Node, state};
use crate::tasks::store::snapshot::{self, Snapshot};
use crate::tasks::store::{
    Difference, Group, StoreCommand, StoreEffect, StoreFact, StoreFailure, StoreReport, Verified, check_capability,
    send,
};
use crate::tasks::{Failure, Note};

/// Restores a group of settings. The defaults are used after the next reset. With `reset`, the device is reset at once,
/// compared with its description, and set to its previous NMT state.
///
/// # Errors
/// - The device does not restore on command, rejects the command or does not answer.
/// - Settings do not have their defaults after the reset.
/// - Bus errors and Ctrl-C.
pub fn restore(master: &mut Master<'_>, device: &Node, group: Group, reset: bool) -> Result<StoreReport, Failure> {
    let node = device.id;
    check_capability(master, device, StoreCommand::Restore, group)?;
    let objects = snapshot::objects(device, &[group]);
    let (before, state) = match reset {
        true => (snapshot::read_settings(master, device, &objects)?, state::state(master, node)?),
        false => (Vec::new(), None),
    };
    send(master, device, StoreCommand::Restore, group)?;
    let mut report = StoreReport { node, groups: vec![group], verified: Verified::Ack, notes: Vec::new() };
    let note = |fact| Note::of_node(node, fact);
    if !reset {
        report.notes.push(note(StoreFact::AfterReset(group)));
        return Ok(report);
    }
    let read = |master: &mut Master<'_>| snapshot::read_settings(master, device, &objects);
    let (after, state_notes) = snapshot::reset(master, node, state, read)
        .map_err(|failure| failure.with(node, StoreEffect::NotVerified(StoreCommand::Restore)))?;
    report.notes.extend(state_notes);
    let Comparison { equal, unchanged } = compare(device, &before, &after)?;
    if !unchanged.is_empty() {
        report.notes.push(note(StoreFact::Unchanged(unchanged)));
    } else if equal == 0 {
        report.notes.push(note(StoreFact::NothingCompared));
    } else {
        report.verified = Verified::Reset;
    }
    Ok(report)
}

/// The result of a comparison with the description.
struct Comparison {
    /// The number of settings that have their default.
    equal: usize,
    /// Settings that kept a value other than the default in the description. This default is uncertain: it is not in
    /// the manual, or differs between devices.
    unchanged: Vec<Snapshot>,
}

/// Checks that all settings with a known default have this default.
fn compare(device: &Node, before: &[Snapshot], after: &[Snapshot]) -> Result<Comparison, Failure> {
    let (mut equal, mut wrong, mut unchanged) = (0, Vec::new(), Vec::new());
    for setting in after {
        match snapshot::default(device, setting.object) {
            None => {}
            Some(default) if default == setting.bytes => equal += 1,
            Some(default) if snapshot::is_default_certain(device, setting.object) => wrong.push(Difference {
                expected: Snapshot { bytes: default, ..setting.clone() },
                found: Some(setting.clone()),
            }),
            Some(_) if before.contains(setting) => unchanged.push(setting.clone()),
            Some(_) => {}
        }
    }
    match wrong.is_empty() {
        true => Ok(Comparison { equal, unchanged }),
        false => Err(Failure::at(device.id, StoreFailure::NotDefault(wrong))),
    }
}
