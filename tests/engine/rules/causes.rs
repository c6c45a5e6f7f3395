//! The kind of a failure is its real cause.

use super::*;
use cangauge::output::failure::ErrorMessage;

/// The kind of a failure is its real cause.
pub(super) fn kinds(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let Err(failure) = &run.result else { return };
    if run.bus.overran {
        return;
    }
    let details = || format!("{:?}: {failure} (hint: {:?})", failure.kind(), ErrorMessage::of(failure).hint);
    let tap = &run.bus;
    if tap.interrupted.is_some() && !tap.was_down && !tap.was_off {
        // The failure may have happened before the interruption.
        let was_full = spec.faults.iter().any(|fault| matches!(fault, Fault::Full { .. } | Fault::BusOff { .. }));
        if failure.kind() == Kind::Bus && !was_full {
            violations.push(("names the cause", format!("interrupted: {}", details())));
        }
        let quiet = spec.faults.is_empty() && spec.others.is_empty() && spec.device_faults().next().is_none();
        // A recording may have ended before, for lack of rows, and was restoring states when it was interrupted.
        let in_time = tap.interrupted < tap.frames.last().map(|(at, _)| *at) || !records(spec);
        if quiet && failure.kind() == Kind::NoAnswer && all_there(spec) && in_time {
            violations.push(("names the cause", format!("interrupted: {}", details())));
        }
        return;
    }
    if failure.kind() == Kind::Interrupted && tap.interrupted.is_none() {
        violations.push(("names the cause", format!("not interrupted: {}", details())));
    }
    if tap.was_down && tap.interrupted.is_none() && !records(spec) && failure.kind() != Kind::Bus {
        // The command may have failed before.
        let down_at = spec.faults.iter().filter_map(|fault| match fault {
            Fault::Down { at_us, .. } => Some(*at_us),
            _ => None,
        });
        if down_at.min() == Some(0)
            || spec.faults.len() == 1 && !matches!(failure.kind(), Kind::Usage | Kind::Refused) && quiet(spec)
        {
            violations.push(("names the cause", format!("the interface was down: {}", details())));
        }
    }
    let bus_is_well = spec
        .faults
        .iter()
        .all(|fault| !matches!(fault, Fault::Down { .. } | Fault::BusOff { .. } | Fault::Full { .. }));
    if failure.kind() == Kind::Bus && bus_is_well && spec.devices.iter().all(|device| device.bit_rate.is_none()) {
        let sharing = spec.shares_node_ids() || !spec.others.is_empty();
        let answered = run.bus.frames.iter().any(|(_, passed)| matches!(passed, Passed::Received(_)));
        // A device that has switched to another bit rate acknowledges no frame.
        let retimes = matches!(spec.command, Command::Assign { rate: Some(_), .. } | Command::LssActivate { .. });
        if answered
            && !sharing
            && !retimes
            && !spec.device_faults().any(|device_fault| {
                // A device that floods the bus can cause any time-out.
                matches!(
                    device_fault,
                    DeviceFault::Hang { .. } | DeviceFault::OfflineAfterReset | DeviceFault::SendsEmergencies { .. }
                )
            })
        {
            violations.push(("names the cause", format!("the bus works: {}", details())));
        }
    }
    if !spec.is_clean() {
        return;
    }
    // Without faults every device answers and follows the protocol.
    if failure.kind() == Kind::NoAnswer && all_there(spec) && !may_be_silent(spec) {
        violations.push(("names the cause", format!("all devices answer: {}", details())));
    }
    if failure.kind() == Kind::Unexpected && !may_deviate(spec, &ErrorMessage::of(failure).message) {
        violations.push(("names the cause", format!("nothing is unexpected: {}", details())));
    }
    if failure.kind() == Kind::Refused
        && matches!(spec.command, Command::Scan { .. } | Command::Info { .. } | Command::Nmt { .. })
    {
        violations.push(("names the cause", format!("no device refuses: {}", details())));
    }
}

/// A recording continues when the interface is back.
fn records(spec: &Spec) -> bool {
    match &spec.command {
        Command::Log { .. } => true,
        Command::Check { how, .. } => *how != Measuring::Once,
        _ => false,
    }
}

fn quiet(spec: &Spec) -> bool {
    spec.others.is_empty() && spec.device_faults().next().is_none() && all_there(spec) && spec.has_only_bus_faults()
}

fn all_there(spec: &Spec) -> bool {
    let there: BTreeSet<u8> = spec.devices.iter().filter_map(|device| device.node).collect();
    !spec.command.is_lss() && named(spec).is_subset(&there)
}

/// TPDOs that wait for a trigger cause no rows. A device with a long latency exceeds a short time-out.
fn may_be_silent(spec: &Spec) -> bool {
    matches!(spec.command, Command::Log { .. } | Command::Check { .. } | Command::PdoWatch { .. })
        || spec.devices.iter().any(|device| device.latency_us * 2 >= spec.timeout_ms * 1000)
}

fn may_deviate(spec: &Spec, message: &str) -> bool {
    let only = matches!(
        spec.command,
        Command::Assign { target: Target::Only, .. } | Command::LssStore { target: Target::Only, .. }
    );
    // Devices without process values lack such objects, and a description may not know them.
    matches!(spec.devices.len(), 0)
        || [
            "it has no",
            "no source",
            "no object",
            "no signal",
            "no measured",
            "has no",
            "multiplexed",
            "is unknown",
            "it keeps no",
        ]
        .iter()
        .any(|part| message.contains(part))
        // The temperature of this device is in none of its TPDOs.
        || message.contains("temperature")
            && message.contains("TPDO")
            && spec.devices.iter().any(|device| device.kind == "hydac")
        // Several devices take one node-ID: allowed by --force, or not detectable.
        || only && spec.devices.len() > 1
        || spec.command.is_lss() && spec.devices.iter().any(|device| device.latency_us * 2 >= spec.timeout_ms * 1000)
}
