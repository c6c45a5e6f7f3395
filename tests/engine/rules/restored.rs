//! Temporary changes are restored.

use super::*;
use crate::deviation::Deviation;
use cangauge::bus::BitRateControl;
use cangauge::bus::memory::BIT_RATE;
use cangauge::output::failure::ErrorMessage;

/// Everything that the command switched temporarily is restored.
pub(super) fn restored(spec: &Spec, run: &mut Run, after: &[DeviceState], violations: &mut Vec<Violation>) {
    let detects = matches!(spec.command, Command::Detect { .. });
    let cannot = spec.loses_sent()
        // A device that floods the bus can delay the last frames.
        || spec.device_faults().any(|fault| matches!(fault, DeviceFault::Hang { .. } | DeviceFault::SendsEmergencies { .. }))
        || spec.devices.iter().any(|device| device.deviation.is_some_and(Deviation::has_own_state))
        // Some devices use LSS in one NMT state only, and another master may change that state.
        || spec.acts().any(|act| matches!(act, Act::Nmt { .. }))
        || spec.devices.iter().any(|device| device.bit_rate.is_some()) && !detects;
    // The second program does not know what the killed one had switched.
    if cannot || run.bus.overran || run.killed.is_some() {
        return;
    }
    // The interface has its previous bit rate again.
    if detects && run.bus.bit_rate() != Some(BIT_RATE) && !run.bus.was_down {
        violations.push(("restores the interface", format!("{:?}", run.bus.bit_rate())));
    }
    for (place, holds) in after.iter().enumerate() {
        if holds.configuring {
            violations.push(("leaves configuration state", format!("device {place}: {holds:?}")));
        }
    }
    if spec.is_changed_by_others() || spec.falsifies_data() || spec.is_disordered() || spec.shares_node_ids() {
        return;
    }
    // The NMT state is the same as in the heartbeats before the command.
    let clean_answers = spec.faults.is_empty()
        && spec.device_faults().all(|device_fault| matches!(device_fault, DeviceFault::Refuse { .. }));
    let keeps = match &spec.command {
        Command::Log { .. } | Command::Check { .. } => true,
        Command::Map { .. } | Command::Configure { .. } | Command::Store { .. } | Command::Restore { .. } => {
            clean_answers
        }
        _ => false,
    };
    if keeps && clean_answers {
        for (place, (before, after)) in run.before.iter().zip(after).enumerate() {
            let device = &spec.devices[place];
            let has_fast_heartbeat =
                device.heartbeat_ms.is_some_and(|time| time <= 200) && device.unsaved_heartbeat.is_none();
            let refuses = device
                .device_faults
                .iter()
                .any(|device_fault| matches!(device_fault, DeviceFault::Refuse { index: 0x1017, .. }));
            let shared = spec.shares_node_ids();
            if has_fast_heartbeat
                && !refuses
                && !shared
                && device.kind != "jumo"
                && before.state != after.state
                && heartbeats(run, before)
            {
                let remarks = match &run.result {
                    Ok(said) => format!("{said:?}"),
                    Err(failure) => ErrorMessage::of(failure).message.clone(),
                };
                if !remarks.contains("StatesNotRestored")
                    && !remarks.contains("LeftOperational")
                    && !remarks.contains("stays")
                    && !remarks.contains("state")
                {
                    violations
                        .push(("restores states", format!("device {place}: {before:?} became {after:?}: {remarks}")));
                }
            }
        }
    }
    // The heartbeat time after a probe is restored.
    if let Command::NmtProbe { node } = spec.command
        && !matches!(run.result, Ok(Claim::Probed(false)))
        && clean_answers
    {
        for station in run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>() {
            let device = &spec.devices[station.place];
            if device.node != Some(node) {
                continue;
            }
            let held = station.device.value(ObjectId::new(0x1017, 0), run.settled);
            let Some(held) = held.and_then(|bytes| bytes.try_into().ok()) else { continue };
            let period = u16::from_le_bytes(held);
            let expected = device.unsaved_heartbeat.or(device.heartbeat_ms);
            if expected.is_some_and(|expected| expected != period) || expected.is_none() && period == 100 {
                violations.push(("restores the heartbeat time", format!("{period} ms, not {expected:?}")));
            }
        }
    }
}

/// Whether heartbeats of a device were received.
fn heartbeats(run: &Run, before: &DeviceState) -> bool {
    run.bus.bus.inner().inner().stations::<FaultyDevice>().any(|station| {
        device_state(&station.device).node == before.node
            && station
                .sent
                .iter()
                .filter(|(_, frame)| frame.id().heartbeat_node().map(NodeId::get) == before.node)
                .count()
                > 1
    })
}
