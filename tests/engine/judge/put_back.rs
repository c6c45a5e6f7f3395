//! Nothing stays switched that was switched on the way.

use super::*;
use cangauge::bus::BitRateControl;
use cangauge::bus::memory::BIT_RATE;
use cangauge::output::failure::ErrorMessage;

/// What was switched on the way is put back.
pub(super) fn put_back(spec: &Spec, run: &mut Run, after: &[Holds], broken: &mut Vec<Broken>) {
    let detects = matches!(spec.command, Command::Detect { .. });
    let cannot = spec.loses_sent()
        // Who babbles may fill the bus, and the last frames wait.
        || spec.vagaries().any(|vagary| matches!(vagary, Vagary::Hang { .. } | Vagary::Babbles { .. }))
        // Some hear LSS in one NMT state only, and another master takes them out of it.
        || spec.acts().any(|act| matches!(act, Act::Nmt { .. }))
        || spec.devices.iter().any(|device| device.bit_rate.is_some()) && !detects;
    // What a program left that vanished, the next one need not know of.
    if cannot || run.bus.overran || run.killed.is_some() {
        return;
    }
    // The interface is as it was before.
    if detects && run.bus.bit_rate() != Some(BIT_RATE) && !run.bus.was_down {
        broken.push(("puts the interface back", format!("{:?}", run.bus.bit_rate())));
    }
    for (place, holds) in after.iter().enumerate() {
        if holds.configuring {
            broken.push(("leaves configuration state", format!("device {place}: {holds:?}")));
        }
    }
    if spec.is_meddled_with() || spec.lies() || spec.is_disordered() || spec.shares_node_ids() {
        return;
    }
    // A state that heartbeats told is what it was.
    let clean_answers = spec.faults.is_empty() && spec.vagaries().all(|vagary| matches!(vagary, Vagary::Refuse { .. }));
    let keeps = match &spec.command {
        Command::Log { .. } | Command::Check { .. } => true,
        Command::Map { .. } | Command::Store { .. } | Command::Restore { .. } => clean_answers,
        _ => false,
    };
    if keeps && clean_answers {
        for (place, (before, after)) in run.before.iter().zip(after).enumerate() {
            let device = &spec.devices[place];
            let told = device.heartbeat_ms.is_some_and(|time| time <= 200) && device.unsaved_heartbeat.is_none();
            let refuses = device.vagaries.iter().any(|vagary| matches!(vagary, Vagary::Refuse { index: 0x1017, .. }));
            let shared = spec.shares_node_ids();
            if told
                && !refuses
                && !shared
                && device.kind != "jumo"
                && before.state != after.state
                && heartbeats(run, before)
            {
                let remarks = match &run.result {
                    Ok(said) => format!("{said:?}"),
                    Err(failure) => ErrorMessage::of(&failure).message.clone(),
                };
                if !remarks.contains("StatesNotRestored")
                    && !remarks.contains("LeftOperational")
                    && !remarks.contains("stays")
                    && !remarks.contains("state")
                {
                    broken
                        .push(("puts states back", format!("device {place}: {before:?} became {after:?}: {remarks}")));
                }
            }
        }
    }
    // So is the heartbeat after a probe.
    if let Command::NmtProbe { node } = spec.command
        && !matches!(run.result, Ok(Said::Probed(false)))
        && clean_answers
    {
        for unruly in run.bus.bus.inner_mut().stations_mut::<Unruly>() {
            let device = &spec.devices[unruly.place];
            if device.node != Some(node) {
                continue;
            }
            let held = unruly.device.value(ObjectId::new(0x1017, 0), run.settled);
            let Some(held) = held.and_then(|bytes| bytes.try_into().ok()) else { continue };
            let period = u16::from_le_bytes(held);
            let expected = device.unsaved_heartbeat.or(device.heartbeat_ms);
            if expected.is_some_and(|expected| expected != period) || expected.is_none() && period == 100 {
                broken.push(("puts the heartbeat back", format!("{period} ms, not {expected:?}")));
            }
        }
    }
}

/// Whether heartbeats of a device were seen.
fn heartbeats(run: &Run, before: &Holds) -> bool {
    run.bus.bus.inner().stations::<Unruly>().any(|unruly| {
        holds(&unruly.device).node == before.node
            && unruly
                .sent
                .iter()
                .filter(|(_, frame)| frame.id().heartbeat_node().map(NodeId::get) == before.node)
                .count()
                > 1
    })
}
