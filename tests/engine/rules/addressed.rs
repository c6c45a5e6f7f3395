//! Which devices a command addresses. No other device is changed.

use super::*;

/// Whether several devices may execute a command for the only one.
fn is_forced(command: &Command) -> bool {
    match command {
        Command::Assign { force, .. } | Command::LssStore { force, .. } | Command::LssActivate { force, .. } => *force,
        _ => false,
    }
}

/// The nodes that a command names.
pub(super) fn named(spec: &Spec) -> BTreeSet<u8> {
    let all = || spec.devices.iter().filter_map(|device| device.node).collect();
    let of = |target: &Target| match target {
        Target::Node(node) => vec![*node],
        Target::Identity(place) => spec.devices[*place].node.into_iter().collect(),
        Target::Only
            if spec.devices.len() == 1
                || spec.devices.iter().any(|device| device.node.is_none())
                || !spec.is_clean() =>
        {
            all()
        }
        Target::Only if is_forced(&spec.command) => all(),
        Target::Only | Target::Unconfigured => Vec::new(),
    };
    match &spec.command {
        Command::Scan { nodes }
        | Command::Read { nodes }
        | Command::Nmt { nodes, .. }
        | Command::NmtState { nodes }
        | Command::NmtWatch { nodes, .. }
        | Command::PdoWatch { nodes, .. }
        | Command::Check { nodes, .. }
        | Command::Log { nodes, .. } => nodes.iter().copied().collect(),
        Command::Info { node }
        | Command::PdoShow { node }
        | Command::SdoRead { node, .. }
        | Command::SdoWrite { node, .. }
        | Command::NmtProbe { node }
        | Command::Startup { node, .. }
        | Command::Map { node, .. }
        | Command::Configure { node, .. }
        | Command::Autozero { node, .. }
        | Command::Store { node, .. }
        | Command::Restore { node, .. }
        | Command::Unit { node, .. }
        | Command::Filter { node, .. }
        | Command::Limits { node, .. }
        | Command::Errors { node, .. }
        | Command::Minmax { node } => [*node].into(),
        Command::LssScan | Command::LssIdentify { .. } | Command::Detect { .. } => BTreeSet::new(),
        Command::LssActivate { target: None, .. } => all().into_iter().collect(),
        Command::LssInquire { target }
        | Command::LssStore { target, .. }
        | Command::LssActivate { target: Some(target), .. } => of(target).into_iter().collect(),
        Command::Assign { target, id, rate, .. } => {
            let new = id.or(rate.is_none().then_some(9));
            of(target).into_iter().chain(new).collect()
        }
    }
}

/// Whether the command addresses this device.
pub(super) fn is_meant(spec: &Spec, place: usize) -> bool {
    let node = spec.devices[place].node;
    match &spec.command {
        Command::LssActivate { target: None, .. } => true,
        Command::Assign { target, .. }
        | Command::LssStore { target, .. }
        | Command::LssActivate { target: Some(target), .. }
        | Command::LssInquire { target } => {
            match target {
                Target::Node(id) => node == Some(*id),
                Target::Identity(meant) => {
                    let same = |at: usize| (spec.devices[at].kind, spec.devices[at].serial);
                    same(*meant) == same(place)
                }
                // A device without node-ID and LSS inquiries is not detectable and obeys a command for the only one.
                Target::Only => {
                    spec.devices.len() == 1
                        || is_forced(&spec.command)
                        || node.is_none()
                        || spec.devices.iter().any(|device| device.node.is_none())
                        || !spec.is_clean()
                }
                Target::Unconfigured => node.is_none(),
            }
        }
        _ => node.is_some_and(|node| named(spec).contains(&node)),
    }
}

pub(super) fn others_unchanged(spec: &Spec, run: &Run, after: &[DeviceState], violations: &mut Vec<Violation>) {
    let written_by_others = spec.acts().any(|act| matches!(act, Act::Nmt { .. }));
    let own = |holds: &DeviceState| (holds.node, holds.bit_rate, holds.stored);
    for (place, (before, after)) in run.origin().iter().zip(after).enumerate() {
        if !is_meant(spec, place) && own(before) != own(after) {
            violations.push(("changes no other device", format!("device {place}: {before:?} became {after:?}")));
        }
        let meddled = written_by_others
            || spec.devices[place]
                .device_faults
                .iter()
                .any(|device_fault| matches!(device_fault, DeviceFault::ResetAt { .. } | DeviceFault::Hang { .. }));
        let broadcast = matches!(spec.command, Command::Nmt { all: true, .. });
        // A device without node-ID may be at the place of the new one.
        if !is_meant(spec, place) && !meddled && !broadcast && before.state != after.state {
            let shares = named(spec).iter().any(|node| before.node == Some(*node));
            if !shares {
                violations.push(("switches no other device", format!("device {place}: {before:?} became {after:?}")));
            }
        }
    }
}
