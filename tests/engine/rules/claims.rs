//! The results that a successful command reports are true. Results that it reports as stored last after power off.

use super::rows::answers;
use super::*;

/// The claims of a successful command are true.
pub(super) fn claims(spec: &Spec, run: &mut Run, said: &Claim, after: &[DeviceState], violations: &mut Vec<Violation>) {
    let settled = run.settled;
    match (said, &spec.command) {
        (Claim::Found(found), _) if !spec.falsifies_data() && !spec.shares_node_ids() => {
            let there: BTreeMap<u8, u32> =
                spec.devices.iter().filter_map(|device| Some((device.node?, device.serial))).collect();
            for (node, serial) in found {
                match (there.get(node), serial) {
                    (None, _) => violations.push(("finds the devices", format!("no device has node-ID {node}"))),
                    (Some(right), Some(serial)) if right != serial && has_serial(spec, *node) => {
                        violations.push(("finds the devices", format!("node {node} is {right}, not {serial}")));
                    }
                    _ => {}
                }
            }
            if let Command::Scan { nodes } = &spec.command
                && spec.is_clean()
                && spec.timeout_ms >= 100
            {
                let expected = nodes.iter().filter(|node| there.contains_key(node)).count();
                if expected != found.len() {
                    violations.push(("finds the devices", format!("{found:?} of {there:?}")));
                }
            }
        }
        (Claim::Values(values), _) if !spec.falsifies_data() => {
            let sent = answers(run);
            for (node, object, raw) in values {
                let expedited = sent.get(&(*node, *object)).is_some_and(|all| all.contains(raw));
                let mut holders = run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>();
                let held = holders.any(|station| {
                    let value = station.device.value(*object, settled);
                    value.is_some_and(|value| value == *raw)
                });
                // The value may have been written after the read.
                let is_written =
                    spec.acts().any(|act| matches!(act, Act::Write { index, .. } if *index == object.index));
                if !expedited && !held && !is_written {
                    violations.push(("reads real values", format!("node {node} {object}: {raw:02X?}")));
                }
            }
        }
        (Claim::States(states), command)
            if !spec.is_changed_by_others()
                && !spec.falsifies_data()
                && !spec.is_disordered()
                && !spec.shares_node_ids() =>
        {
            let hangs = spec
                .device_faults()
                .any(|device_fault| matches!(device_fault, DeviceFault::Hang { .. } | DeviceFault::Lose { .. }));
            // Silence proves that a node is stopped, but a node that cannot receive is silent as well.
            let stops = matches!(command, Command::Nmt { what, .. } if what.target() == NmtState::Stopped);
            let fails = !spec.faults.is_empty() || hangs || run.before.iter().any(|holds| holds.bit_rate.is_some());
            for (node, state) in states {
                let Some(state) = state else { continue };
                if stops && fails {
                    continue;
                }
                // On a disturbed bus the node may receive the command late. Then a heartbeat with the old state is
                // received after the command was sent.
                let late = spec.loses_sent() || spec.devices.iter().any(|device| device.bit_rate.is_some());
                if late && matches!(command, Command::Nmt { what, .. } if what.target() != *state) {
                    continue;
                }
                let really = after.iter().find(|holds| holds.node == Some(*node)).and_then(|holds| holds.state);
                let right = matches!(
                    (state, really),
                    (NmtState::Operational, Some(State::Operational))
                        | (NmtState::PreOperational, Some(State::PreOperational))
                        | (NmtState::Stopped, Some(State::Stopped))
                );
                if !right {
                    violations
                        .push(("reports the real state", format!("node {node}: {state:?}, and it is {really:?}")));
                }
            }
        }
        // A new bit rate becomes active with a power cycle, together with the other settings.
        (Claim::Assigned { rate: Some(_), retimed: false, .. }, _) => {}
        (Claim::Assigned { new, stored, rate, .. }, Command::Assign { id, .. }) => {
            // A node-ID that changed through a reset by another master is not the command's fault.
            let meant: Vec<&DeviceState> =
                after.iter().enumerate().filter(|(place, _)| is_meant(spec, *place)).map(|(_, holds)| holds).collect();
            let wanted = id.or(rate.is_none().then_some(9));
            let right = |holds: &&DeviceState| {
                (wanted.is_none() || holds.node == wanted && *new == wanted)
                    && (!stored || wanted.is_none() || holds.stored.0 == wanted)
                    && rate.flatten().is_none_or(|rate| !stored || holds.stored.1 == Some(rate))
            };
            let may_be_gone = spec.is_changed_by_others() && !stored;
            if !spec.falsifies_data() && !meant.iter().any(right) && !may_be_gone {
                violations.push(("has the requested settings", format!("{said:?}, and it is {meant:?}")));
            }
        }
        (Claim::Mapped(settings), Command::Map { node, .. })
            if !spec.is_changed_by_others() && !spec.falsifies_data() && !spec.shares_node_ids() =>
        {
            for station in run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>() {
                if spec.devices[station.place].node == Some(*node)
                    && let Some(difference) = mapped_otherwise(station, settings, settled)
                {
                    violations.push(("has the requested settings", difference));
                }
            }
        }
        (Claim::Configured(settings), Command::Configure { node, .. })
            if !spec.is_changed_by_others() && !spec.falsifies_data() && !spec.shares_node_ids() =>
        {
            for station in run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>() {
                for (object, wanted) in settings.iter().filter(|_| spec.devices[station.place].node == Some(*node)) {
                    let found = station.device.value(*object, settled);
                    if found.as_ref() != Some(wanted) {
                        let difference = format!("{object} is {found:02X?}, not {wanted:02X?}");
                        violations.push(("has the requested settings", difference));
                    }
                }
            }
        }
        (Claim::Detected(Some(rate)), _)
            if !spec.falsifies_data()
                && spec.others.is_empty()
                // This frame was sent at another bit rate, and received during the wait at this one.
                && !spec.is_disordered()
                && !spec.devices.iter().any(|device| device.bit_rate == Some(*rate)) =>
        {
            violations.push(("finds the devices", format!("no device is at {rate} bit/s")));
        }
        (Claim::Identified(answered), Command::LssIdentify { .. }) if spec.is_clean() => {
            let replied = run.bus.frames.iter().any(|(_, passed)| {
                matches!(passed, Passed::Received(frame) if frame.id() == CanId::LSS_SLAVE && frame.data()[0] == 0x4f)
            });
            if *answered != replied {
                violations.push(("finds the devices", format!("{answered}, and {replied}")));
            }
        }
        (Claim::Nothing, Command::SdoWrite { node, object, bytes, .. }) if !spec.falsifies_data() => {
            // The acknowledge of another master's write to the same object looks like ours.
            let acknowledged_by_others =
                spec.acts().any(|act| matches!(act, Act::Write { index, .. } if *index == object.index));
            let mut stations = run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>();
            let held = stations.any(|station| {
                let there = spec.devices[station.place].node == Some(*node);
                let now = station.device.value(*object, settled);
                there && (station.held.contains(bytes) && spec.is_changed_by_others() || now.as_deref() == Some(bytes))
            });
            if !held && !acknowledged_by_others && !becomes_another(spec, *node, *object) {
                violations.push(("has the requested settings", format!("node {node} {object} is not {bytes:02X?}")));
            }
        }
        _ => {}
    }
}

/// Whether a device keeps the serial number of the scenario.
fn has_serial(spec: &Spec, node: u8) -> bool {
    let device = spec.devices.iter().find(|device| device.node == Some(node));
    device.is_some_and(|device| crate::bench::identity(device).serial == device.serial)
}

/// Objects that do not return the written value, in any device with this node-ID.
fn becomes_another(spec: &Spec, node: u8, object: ObjectId) -> bool {
    let becomes = |device: &crate::spec::DeviceSpec| {
        let model = crate::kinds::model(device.kind);
        // Short texts are padded.
        let is_text = model.dictionary.get(object).is_some_and(|entry| entry.data_type.width().is_none());
        is_text && device.kind != crate::kinds::LARGE_KIND || model.description.object(object).is_none()
    };
    // MH-4: 0 restores the default COB-ID.
    object.index & 0x0fff == 0x1a0
        || object.index == 0x1014
        || spec.devices.iter().filter(|device| device.node == Some(node)).any(becomes)
}

pub(super) fn number(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
}

pub(super) fn mapped_otherwise(station: &mut FaultyDevice, settings: &Settings, now: Mono) -> Option<String> {
    let mut value = |object: ObjectId| station.device.value(object, now).map(|bytes| number(&bytes));
    let mut expected = vec![
        (settings.number.communication(1), settings.cob_id.0),
        (settings.number.communication(2), settings.transmission.into()),
        (settings.number.mapping(0), u32::try_from(settings.mapping.len()).unwrap_or(0)),
    ];
    expected.extend(settings.event_timer_ms.map(|timer| (settings.number.communication(5), timer.into())));
    for (sub, entry) in (1u8..).zip(&settings.mapping) {
        expected.push((settings.number.mapping(sub), entry.word()));
    }
    expected.into_iter().find_map(|(object, wanted)| {
        let found = value(object);
        (found.is_some_and(|found| found != wanted)).then(|| format!("{object} is {found:08X?}, not {wanted:08X}"))
    })
}

/// The last value that was written to each object, if the object keeps a written value.
pub(super) fn last_writes(spec: &Spec, run: &mut Run, violations: &mut Vec<Violation>) {
    let resets = matches!(
        spec.command,
        Command::Store { .. }
            | Command::Restore { .. }
            | Command::Assign { .. }
            | Command::Startup { .. }
            | Command::Autozero { .. }
            | Command::Errors { .. }
            | Command::Minmax { .. }
    );
    // The command itself reports that it could not restore the value.
    let admits = matches!(run.result, Ok(Claim::Probed(false)));
    if resets
        || admits
        || spec.is_changed_by_others()
        || spec.falsifies_data()
        || spec.loses_sent()
        || spec.shares_node_ids()
    {
        return;
    }
    let mut last: BTreeMap<(u8, ObjectId), Vec<u8>> = BTreeMap::new();
    for (_, frame) in run.bus.all_sent() {
        let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.as_eight_bytes()) else { continue };
        if data[0] >> 5 == 1 && data[0] & 3 == 3 && !is_signature(&data[4..8]) {
            let length = 4 - usize::from(data[0] >> 2 & 3);
            let object = ObjectId::from_multiplexer([data[1], data[2], data[3]]);
            last.insert((node.get(), object), data[4..4 + length].to_vec());
        }
    }
    let settled = run.settled;
    for station in run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>() {
        let device = &spec.devices[station.place];
        for ((node, object), bytes) in &last {
            if device.node != Some(*node) || becomes_another(spec, *node, *object) {
                continue;
            }
            let found = station.device.value(*object, settled);
            if found.as_ref().is_some_and(|found| found != bytes) {
                violations
                    .push(("keeps the written value", format!("node {node} {object}: {found:02X?}, not {bytes:02X?}")));
            }
        }
    }
}
