//! What must always hold, whatever went wrong.

mod causes;
mod claims;
mod rows;

use causes::kinds;
use claims::{after_power, claims, last_writes};
use rows::{rows, signatures};

use crate::run::{Holds, Run, Said, group, hex, holds};
use crate::spec::{Act, Command, Fault, Spec, Target, Vagary};
use crate::station::Unruly;
use cangauge::bus::Mono;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::sim::State;
use cangauge::tasks::Kind;
use cangauge::tasks::pdo::Settings;
use cangauge::tasks::sdo::is_signature;
use cangauge::tasks::store::Group;
use std::collections::{BTreeMap, BTreeSet};

/// A rule that was broken, and how.
pub(crate) type Broken = (&'static str, String);

pub(crate) fn judge(spec: &Spec, run: &mut Run) -> Vec<Broken> {
    let mut broken = Vec::new();
    ends(run, &mut broken);
    frames(spec, run, &mut broken);
    let after: Vec<Holds> = run.bus.bus.inner().stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect();
    others_unchanged(spec, run, &after, &mut broken);
    put_back(spec, run, &after, &mut broken);
    kinds(spec, run, &mut broken);
    rows(spec, run, &mut broken);
    signatures(spec, run, &mut broken);
    if let Ok(said) = run.result.clone() {
        claims(spec, run, &said, &after, &mut broken);
        last_writes(spec, run, &mut broken);
    }
    after_power(spec, run, &mut broken);
    broken
}

fn ends(run: &Run, broken: &mut Vec<Broken>) {
    if run.bus.overran {
        broken.push(("ends in time", format!("not ended after {:?}", run.bound)));
    }
}

/// The nodes that a command names.
fn named(spec: &Spec) -> BTreeSet<u8> {
    let of = |target: &Target| match target {
        Target::Node(node) => vec![*node],
        Target::Identity(place) => spec.devices[*place].node.into_iter().collect(),
        Target::Only
            if spec.devices.len() == 1
                || spec.devices.iter().any(|device| device.node.is_none())
                || !spec.is_clean() =>
        {
            spec.devices.iter().filter_map(|device| device.node).collect()
        }
        Target::Only | Target::Unconfigured => Vec::new(),
    };
    match &spec.command {
        Command::Scan { nodes }
        | Command::Read { nodes }
        | Command::Nmt { nodes, .. }
        | Command::NmtState { nodes }
        | Command::Log { nodes, .. } => nodes.iter().copied().collect(),
        Command::Info { node }
        | Command::PdoShow { node }
        | Command::SdoRead { node, .. }
        | Command::SdoWrite { node, .. }
        | Command::NmtProbe { node }
        | Command::Startup { node, .. }
        | Command::Map { node, .. }
        | Command::Autozero { node, .. }
        | Command::Store { node, .. }
        | Command::Restore { node, .. }
        | Command::Unit { node, .. }
        | Command::Filter { node, .. }
        | Command::Limits { node, .. }
        | Command::Errors { node, .. }
        | Command::Minmax { node } => [*node].into(),
        Command::LssScan => BTreeSet::new(),
        Command::LssInquire { target } | Command::LssStore { target } => of(target).into_iter().collect(),
        Command::Assign { target, id, rate, .. } => {
            let new = id.or(rate.is_none().then_some(9));
            of(target).into_iter().chain(new).collect()
        }
    }
}

fn is_lss(command: &Command) -> bool {
    matches!(command, Command::LssScan | Command::LssInquire { .. } | Command::LssStore { .. } | Command::Assign { .. })
}

/// Whether a command may write anything by SDO.
fn writes(command: &Command) -> bool {
    !matches!(
        command,
        Command::Scan { .. }
            | Command::Read { .. }
            | Command::Info { .. }
            | Command::PdoShow { .. }
            | Command::SdoRead { .. }
            | Command::Nmt { .. }
            | Command::NmtState { .. }
            | Command::LssScan
            | Command::LssInquire { .. }
            | Command::LssStore { .. }
            | Command::Errors { clear: false, .. }
            | Command::Log { .. }
            | Command::Autozero { dry_run: true, .. }
    )
}

/// No frame that could change a device that was not meant.
fn frames(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let named = named(spec);
    let lss = is_lss(&spec.command);
    let resets = |command: &Command| match command {
        Command::Store { verify, .. } => *verify,
        Command::Restore { reset, .. } => *reset,
        Command::Log { nmt, sync_ms: _, poll_ms, .. } => *nmt && poll_ms.is_none(),
        Command::Assign { .. } | Command::Map { .. } | Command::LssInquire { .. } | Command::LssStore { .. } => true,
        _ => false,
    };
    for (at, frame) in run.bus.all_sent() {
        let allowed = match frame.id() {
            CanId::Standard(0) => match (&spec.command, frame.data()) {
                (Command::Nmt { what, nodes, all }, &[specifier, node]) => {
                    specifier == what.specifier() && if *all { node == 0 } else { nodes.contains(&node) }
                }
                (command, &[_, node]) => resets(command) && named.contains(&node),
                _ => false,
            },
            CanId::Standard(0x080) => {
                matches!(spec.command, Command::Log { sync_ms: Some(_), .. }) && !frame.is_remote()
            }
            CanId::Standard(0x7e5) => lss && !frame.is_remote(),
            id if frame.is_remote() => {
                let guards = matches!(
                    spec.command,
                    Command::Nmt { .. }
                        | Command::NmtState { .. }
                        | Command::NmtProbe { .. }
                        | Command::Map { .. }
                        | Command::Store { .. }
                        | Command::Restore { .. }
                );
                (guards || lss) && id.heartbeat_node().is_some_and(|node| named.contains(&node.get()))
            }
            id => match (id.sdo_request_node().map(NodeId::get), frame.all_eight()) {
                (Some(node), Some(data)) => {
                    let reads = matches!(data[0] >> 5, 2..=5);
                    let meant = named.contains(&node);
                    // A block of a long download begins with a number; only short ones are written here.
                    // Whether an identifier is free is seen by asking who there is.
                    let asks = lss || matches!(spec.command, Command::Map { cob_id: Some(_), .. });
                    if reads { meant || asks } else { meant && writes(&spec.command) }
                }
                _ => false,
            },
        };
        if !allowed {
            broken.push(("touches nobody else", format!("{:?}: {frame}", at.since_start())));
            return;
        }
    }
}

/// Whether a device is the one that is meant.
fn is_meant(spec: &Spec, place: usize) -> bool {
    let node = spec.devices[place].node;
    match &spec.command {
        Command::Assign { target, .. } | Command::LssStore { target } | Command::LssInquire { target } => {
            match target {
                Target::Node(id) => node == Some(*id),
                Target::Identity(meant) => {
                    let same = |at: usize| (spec.devices[at].kind, spec.devices[at].serial);
                    same(*meant) == same(place)
                }
                // Who has no node-ID and knows none of the inquiries cannot be seen, and takes what the only one takes.
                Target::Only => {
                    spec.devices.len() == 1
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

fn others_unchanged(spec: &Spec, run: &Run, after: &[Holds], broken: &mut Vec<Broken>) {
    let written_by_others = spec.acts().any(|act| matches!(act, Act::Nmt { .. }));
    let own = |holds: &Holds| (holds.node, holds.bit_rate, holds.stored);
    for (place, (before, after)) in run.before.iter().zip(after).enumerate() {
        if !is_meant(spec, place) && own(before) != own(after) {
            broken.push(("changes nobody else", format!("device {place}: {before:?} became {after:?}")));
        }
        let meddled = written_by_others
            || spec.devices[place]
                .vagaries
                .iter()
                .any(|vagary| matches!(vagary, Vagary::ResetAt { .. } | Vagary::Hang { .. }));
        let broadcast = matches!(spec.command, Command::Nmt { all: true, .. });
        // Who has no node-ID of its own may stand where the new one is.
        if !is_meant(spec, place) && !meddled && !broadcast && before.state != after.state {
            let shares = named(spec).iter().any(|node| before.node == Some(*node));
            if !shares {
                broken.push(("switches nobody else", format!("device {place}: {before:?} became {after:?}")));
            }
        }
    }
}

/// What was switched on the way is put back.
fn put_back(spec: &Spec, run: &mut Run, after: &[Holds], broken: &mut Vec<Broken>) {
    let cannot = spec.loses_sent()
        || spec.vagaries().any(|vagary| matches!(vagary, Vagary::Hang { .. }))
        // Some hear LSS in one NMT state only, and another master takes them out of it.
        || spec.acts().any(|act| matches!(act, Act::Nmt { .. }))
        || spec.devices.iter().any(|device| device.bit_rate.is_some());
    if cannot || run.bus.overran {
        return;
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
        Command::Log { .. } => true,
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
                    Err(failure) => failure.message.clone(),
                };
                if !remarks.contains("not put back") && !remarks.contains("stays") && !remarks.contains("state") {
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
