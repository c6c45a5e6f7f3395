//! Stored settings survive a power cycle.

use super::claims::{mapped_otherwise, number};
use super::*;
use crate::bench::DeviceState;
use crate::kinds::model;
use cangauge::output::failure::ErrorMessage;

/// After a power cycle stored settings have their new values, and all others their old ones.
pub(super) fn after_power(spec: &Spec, run: &mut Run, violations: &mut Vec<Violation>) {
    let settled = run.settled;
    let bus = run.bus.bus.inner_mut().inner_mut();
    bus.stations_mut::<FaultyDevice>().for_each(FaultyDevice::remove_faults);
    bus.power_cycle();
    let after: Vec<DeviceState> = bus.stations::<FaultyDevice>().map(|station| device_state(&station.device)).collect();
    if let (Ok(Claim::Assigned { rate: Some(Some(rate)), stored: true, .. }), false) =
        (&run.result, spec.falsifies_data())
    {
        let right = (0..after.len()).any(|place| is_meant(spec, place) && after[place].stored.1 == Some(*rate));
        if !right {
            violations.push(("keeps stored settings", format!("{rate} bit/s, and it is {after:?}")));
        }
    }
    match &run.result {
        Ok(Claim::Assigned { new, stored: true, .. }) if !spec.falsifies_data() => {
            let meant = (0..after.len()).filter(|place| is_meant(spec, *place)).any(|place| after[place].node == *new);
            if !meant && new.is_some() {
                violations.push(("keeps stored settings", format!("node {new:?}, and it is {after:?}")));
            }
        }
        Ok(Claim::Mapped(settings))
            if !spec.falsifies_data() && !spec.is_changed_by_others() && !spec.shares_node_ids() =>
        {
            // The properties of a device are known only if it reports its identity.
            let is_identified =
                !spec.device_faults().any(|device_fault| matches!(device_fault, DeviceFault::Refuse { .. }));
            if let (Command::Map { node, keep: true, .. }, true) = (&spec.command, is_identified) {
                for station in bus.stations_mut::<FaultyDevice>() {
                    if spec.devices[station.place].node == Some(*node)
                        && let Some(difference) = mapped_otherwise(station, settings, settled)
                    {
                        violations.push(("keeps stored settings", difference));
                    }
                }
            }
        }
        Ok(Claim::Stored) if !spec.falsifies_data() && !spec.is_changed_by_others() && !spec.shares_node_ids() => {
            heartbeat_kept(spec, bus, settled, violations);
        }
        Err(failure) if ErrorMessage::of(failure).message.contains("nothing was changed") && !spec.falsifies_data() => {
            // Settings that another program left configured become active with a power cycle.
            let own = |holds: &DeviceState| (holds.stored, holds.node.filter(|_| run.killed.is_none()));
            let before = run.before.iter().map(own);
            if spec.command.is_lss() && !before.eq(after.iter().map(own)) {
                violations.push(("reports its changes", format!("{failure}: {:?} became {after:?}", run.before)));
            }
        }
        _ => {}
    }
}

fn heartbeat_kept(spec: &Spec, bus: &mut cangauge::bus::memory::MemoryBus, now: Mono, violations: &mut Vec<Violation>) {
    let heartbeat = ObjectId::new(0x1017, 0);
    for station in bus.stations_mut::<FaultyDevice>() {
        let device = &spec.devices[station.place];
        let model = model(device.kind);
        let Some(entry) = model.dictionary.get(heartbeat).filter(|entry| entry.access.is_writable()) else { continue };
        let Some(period) = station.device.value(heartbeat, now).map(|bytes| number(&bytes)) else { continue };
        let (wanted, group) = match &spec.command {
            Command::Store { node, group: of, .. } if device.node == Some(*node) => {
                (device.unsaved_heartbeat.map(u32::from), group(*of))
            }
            Command::Restore { node, group: of, .. } if device.node == Some(*node) => {
                let default = entry.default_bytes(NodeId::new(*node).expect("a node-ID"));
                (default.map(|bytes| number(&bytes)), group(*of))
            }
            _ => continue,
        };
        if group != Group::Application && wanted.is_some_and(|wanted| wanted != period) {
            violations.push(("keeps stored settings", format!("1017h is {period}, not {wanted:?}")));
        }
    }
}
