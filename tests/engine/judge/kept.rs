//! What was stored lasts.

use super::claims::{mapped_otherwise, number};
use super::*;
use crate::bench::Holds;
use crate::kinds::model;
use cangauge::output::failure::ErrorMessage;

/// What was stored is still there after power off and on; what was not changed is as it was.
pub(super) fn after_power(spec: &Spec, run: &mut Run, broken: &mut Vec<Broken>) {
    let settled = run.settled;
    let bus = run.bus.bus.inner_mut();
    bus.stations_mut::<Unruly>().for_each(Unruly::tame);
    bus.power_cycle();
    let after: Vec<Holds> = bus.stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect();
    if let (Ok(Said::Assigned { rate: Some(Some(rate)), stored: true, .. }), false) = (&run.result, spec.lies()) {
        let right = (0..after.len()).any(|place| is_meant(spec, place) && after[place].stored.1 == Some(*rate));
        if !right {
            broken.push(("keeps what was stored", format!("{rate} bit/s, and it is {after:?}")));
        }
    }
    match &run.result {
        Ok(Said::Assigned { new, stored: true, .. }) if !spec.lies() => {
            let meant = (0..after.len()).filter(|place| is_meant(spec, *place)).any(|place| after[place].node == *new);
            if !meant && new.is_some() {
                broken.push(("keeps what was stored", format!("node {new:?}, and it is {after:?}")));
            }
        }
        Ok(Said::Mapped(settings)) if !spec.lies() && !spec.is_meddled_with() && !spec.shares_node_ids() => {
            // What a device is and keeps is known of one that tells its identity.
            let tells = !spec.vagaries().any(|vagary| matches!(vagary, Vagary::Refuse { .. }));
            if let (Command::Map { node, keep: true, .. }, true) = (&spec.command, tells) {
                for unruly in bus.stations_mut::<Unruly>() {
                    if spec.devices[unruly.place].node == Some(*node)
                        && let Some(difference) = mapped_otherwise(unruly, settings, settled)
                    {
                        broken.push(("keeps what was stored", difference));
                    }
                }
            }
        }
        Ok(Said::Stored) if !spec.lies() && !spec.is_meddled_with() && !spec.shares_node_ids() => {
            heartbeat_kept(spec, bus, settled, broken);
        }
        Err(failure) if ErrorMessage::of(&failure).message.contains("nothing was changed") && !spec.lies() => {
            // What another program left configured comes into force with power.
            let own = |holds: &Holds| (holds.stored, holds.node.filter(|_| run.killed.is_none()));
            let before = run.before.iter().map(own);
            if spec.command.is_lss() && !before.eq(after.iter().map(own)) {
                broken.push(("says what was changed", format!("{failure}: {:?} became {after:?}", run.before)));
            }
        }
        _ => {}
    }
}

fn heartbeat_kept(spec: &Spec, bus: &mut cangauge::bus::memory::MemoryBus, now: Mono, broken: &mut Vec<Broken>) {
    let heartbeat = ObjectId::new(0x1017, 0);
    for unruly in bus.stations_mut::<Unruly>() {
        let device = &spec.devices[unruly.place];
        let model = model(device.kind);
        let Some(entry) = model.dictionary.get(heartbeat).filter(|entry| entry.access.is_writable()) else { continue };
        let Some(period) = unruly.device.value(heartbeat, now).map(|bytes| number(&bytes)) else { continue };
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
            broken.push(("keeps what was stored", format!("1017h is {period}, not {wanted:?}")));
        }
    }
}
