//! What a command that ended well says is true, and lasts where it says so.

use super::rows::answers;
use super::*;

/// What a command that ended well says is true.
pub(super) fn claims(spec: &Spec, run: &mut Run, said: &Said, after: &[Holds], broken: &mut Vec<Broken>) {
    let settled = run.settled;
    match (said, &spec.command) {
        (Said::Found(found), _) if !spec.lies() && !spec.shares_node_ids() => {
            let there: BTreeMap<u8, u32> =
                spec.devices.iter().filter_map(|device| Some((device.node?, device.serial))).collect();
            for (node, serial) in found {
                match (there.get(node), serial) {
                    (None, _) => broken.push(("finds who is there", format!("nobody has node {node}"))),
                    (Some(right), Some(serial)) if right != serial && has_serial(spec, *node) => {
                        broken.push(("finds who is there", format!("node {node} is {right}, not {serial}")));
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
                    broken.push(("finds who is there", format!("{found:?} of {there:?}")));
                }
            }
        }
        (Said::Values(values), _) if !spec.lies() => {
            let sent = answers(run);
            for (node, object, raw) in values {
                let expedited = sent.get(&(*node, *object)).is_some_and(|all| all.contains(raw));
                let mut holders = run.bus.bus.inner_mut().stations_mut::<Unruly>();
                let held = holders.any(|unruly| {
                    let value = unruly.device.value(*object, settled);
                    value.is_some_and(|value| value == *raw)
                });
                // It may have been written after that.
                let is_written =
                    spec.acts().any(|act| matches!(act, Act::Write { index, .. } if *index == object.index));
                if !expedited && !held && !is_written {
                    broken.push(("reads what is there", format!("node {node} {object}: {raw:02X?}")));
                }
            }
        }
        (Said::States(states), command)
            if !spec.is_meddled_with() && !spec.lies() && !spec.is_disordered() && !spec.shares_node_ids() =>
        {
            let hangs = spec.vagaries().any(|vagary| matches!(vagary, Vagary::Hang { .. } | Vagary::Lose { .. }));
            // What proves that a node is stopped is that it is silent, and so is one that is deaf.
            let stops = matches!(command, Command::Nmt { what, .. } if what.target() == NmtState::Stopped);
            let fails = !spec.faults.is_empty() || hangs || run.before.iter().any(|holds| holds.bit_rate.is_some());
            for (node, state) in states {
                let Some(state) = state else { continue };
                if stops && fails {
                    continue;
                }
                // On a wire that somebody disturbs the command itself comes late, and a heartbeat from before it after it.
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
                // A boot-up says PRE-OPERATIONAL, also of one that starts by itself.
                let starts = *state == NmtState::PreOperational && really == Some(State::Operational);
                if !right && !starts {
                    broken.push(("tells the real state", format!("node {node}: {state:?}, and it is {really:?}")));
                }
            }
        }
        // Another bit rate comes into force with power, and so does what was set with it.
        (Said::Assigned { rate: Some(_), retimed: false, .. }, _) => {}
        (Said::Assigned { new, stored, rate, .. }, Command::Assign { id, .. }) => {
            // Who was given another node-ID by somebody else's reset is none of this command's business.
            let meant: Vec<&Holds> =
                after.iter().enumerate().filter(|(place, _)| is_meant(spec, *place)).map(|(_, holds)| holds).collect();
            let wanted = id.or(rate.is_none().then_some(9));
            let right = |holds: &&Holds| {
                (wanted.is_none() || holds.node == wanted && *new == wanted)
                    && (!stored || wanted.is_none() || holds.stored.0 == wanted)
                    && rate.flatten().is_none_or(|rate| !stored || holds.stored.1 == Some(rate))
            };
            let may_be_gone = spec.is_meddled_with() && !stored;
            if !spec.lies() && !meant.iter().any(right) && !may_be_gone {
                broken.push(("holds what was asked", format!("{said:?}, and it is {meant:?}")));
            }
        }
        (Said::Mapped(settings), Command::Map { node, .. })
            if !spec.is_meddled_with() && !spec.lies() && !spec.shares_node_ids() =>
        {
            for unruly in run.bus.bus.inner_mut().stations_mut::<Unruly>() {
                if spec.devices[unruly.place].node == Some(*node)
                    && let Some(difference) = mapped_otherwise(unruly, settings, settled)
                {
                    broken.push(("holds what was asked", difference));
                }
            }
        }
        (Said::Detected(Some(rate)), _)
            if !spec.lies()
                && spec.others.is_empty()
                // A frame of another bit rate, heard when this one is listened at.
                && !spec.is_disordered()
                && !spec.devices.iter().any(|device| device.bit_rate == Some(*rate)) =>
        {
            broken.push(("finds who is there", format!("nobody is at {rate} bit/s")));
        }
        (Said::Identified(answered), Command::LssIdentify { .. }) if spec.is_clean() => {
            let replied = run.bus.frames.iter().any(|(_, passed)| {
                matches!(passed, Passed::Received(frame) if frame.id() == CanId::LSS_SLAVE && frame.data()[0] == 0x4f)
            });
            if *answered != replied {
                broken.push(("finds who is there", format!("{answered}, and {replied}")));
            }
        }
        (Said::Nothing, Command::SdoWrite { node, object, bytes, .. }) if !spec.lies() => {
            // Nothing tells the acknowledge of somebody else's write to the same object from that of ours.
            let acknowledged_by_others =
                spec.acts().any(|act| matches!(act, Act::Write { index, .. } if *index == object.index));
            let mut stations = run.bus.bus.inner_mut().stations_mut::<Unruly>();
            let held = stations.any(|unruly| {
                let there = spec.devices[unruly.place].node == Some(*node);
                let now = unruly.device.value(*object, settled);
                there && (unruly.held.contains(bytes) && spec.is_meddled_with() || now.as_deref() == Some(bytes))
            });
            if !held && !acknowledged_by_others && !becomes_another(spec, *node, *object) {
                broken.push(("holds what was asked", format!("node {node} {object} is not {bytes:02X?}")));
            }
        }
        _ => {}
    }
}

/// Whether a device keeps the serial number that it was given.
fn has_serial(spec: &Spec, node: u8) -> bool {
    let device = spec.devices.iter().find(|device| device.node == Some(node));
    device.is_some_and(|device| crate::bench::identity(device).serial == device.serial)
}

/// Objects in which a value stands for another one, in any of the devices that are this node.
fn becomes_another(spec: &Spec, node: u8, object: ObjectId) -> bool {
    let becomes = |device: &crate::spec::DeviceSpec| {
        let model = crate::kinds::model(device.kind);
        // Short texts are filled up.
        let is_text = model.dictionary.get(object).is_some_and(|entry| entry.data_type.width().is_none());
        is_text && device.kind != crate::kinds::ATTIC || model.description.object(object).is_none()
    };
    // MH-4: 0 brings back the identifier as delivered.
    object.index & 0x0fff == 0x1a0
        || object.index == 0x1014
        || spec.devices.iter().filter(|device| device.node == Some(node)).any(becomes)
}

pub(super) fn number(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
}

pub(super) fn mapped_otherwise(unruly: &mut Unruly, settings: &Settings, now: Mono) -> Option<String> {
    let mut value = |object: ObjectId| unruly.device.value(object, now).map(|bytes| number(&bytes));
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

/// The last value that was written to each object, where writing keeps it.
pub(super) fn last_writes(spec: &Spec, run: &mut Run, broken: &mut Vec<Broken>) {
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
    // It says itself that it could not be put back.
    let admits = matches!(run.result, Ok(Said::Probed(false)));
    if resets || admits || spec.is_meddled_with() || spec.lies() || spec.loses_sent() || spec.shares_node_ids() {
        return;
    }
    let mut last: BTreeMap<(u8, ObjectId), Vec<u8>> = BTreeMap::new();
    for (_, frame) in run.bus.all_sent() {
        let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.all_eight()) else { continue };
        if data[0] >> 5 == 1 && data[0] & 3 == 3 && !is_signature(&data[4..8]) {
            let length = 4 - usize::from(data[0] >> 2 & 3);
            let object = ObjectId::from_multiplexer([data[1], data[2], data[3]]);
            last.insert((node.get(), object), data[4..4 + length].to_vec());
        }
    }
    let settled = run.settled;
    for unruly in run.bus.bus.inner_mut().stations_mut::<Unruly>() {
        let device = &spec.devices[unruly.place];
        for ((node, object), bytes) in &last {
            if device.node != Some(*node) || becomes_another(spec, *node, *object) {
                continue;
            }
            let found = unruly.device.value(*object, settled);
            if found.as_ref().is_some_and(|found| found != bytes) {
                broken
                    .push(("holds what was written", format!("node {node} {object}: {found:02X?}, not {bytes:02X?}")));
            }
        }
    }
}
