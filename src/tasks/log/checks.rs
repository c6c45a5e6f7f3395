//! Checks before a recording changes anything.

use super::{LogFailure, LogOptions, Mode};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::booted;
use crate::canopen::pdo::Transmission;
use crate::master::{Master, MasterEvent};
use crate::measure::decode::Wanted;
use crate::measure::layout::{Signal, Tpdo};
use crate::node::Node;
use crate::node::wait::{Policy, wait};
use crate::tasks::Failure;
use crate::tasks::failure::Cause;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// Checks that every requested signal exists, and is mapped to a TPDO unless it is polled.
pub(super) fn check_wanted(nodes: &[Node], options: &LogOptions) -> Result<(), Failure> {
    let polled = matches!(options.mode, Mode::Poll(_));
    for item in &options.wanted {
        let is_mapped = |node: &Node| node.tpdos.iter().any(|tpdo| tpdo.cob_id.is_valid() && carries(node, tpdo, item));
        if !nodes.iter().any(is_mapped) {
            let has = |name: &str, with_status: bool| {
                let signals = nodes.iter().flat_map(|node| &node.signals);
                signals.filter(|signal| signal.name == name).any(|signal| !with_status || signal.status.is_some())
            };
            let resolved = nodes.iter().map(|node| node.wanted(item)).find(|resolved| resolved != item);
            let name = match resolved.as_ref().unwrap_or(item) {
                Wanted::Signal(name) | Wanted::Status(name) if !has(name, false) => {
                    return Err(Failure::general(unknown_signal(name, nodes)));
                }
                Wanted::Status(name) if !has(name, true) => {
                    return Err(Failure::general(LogFailure::NoStatus { signal: name.clone() }));
                }
                Wanted::Signal(name) | Wanted::Named(name, _) => name.clone(),
                Wanted::Status(name) => format!("{name}.status"),
                Wanted::Object(..) => item.name(),
            };
            if !polled {
                let disabled = nodes.iter().find_map(|node| {
                    let tpdo = node.tpdos.iter().find(|tpdo| carries(node, tpdo, item))?;
                    Some((node.id, tpdo.number))
                });
                return Err(Failure::general(LogFailure::NotMapped { name, disabled }));
            }
        }
    }
    Ok(())
}

/// Checks that the TPDOs of the nodes of a passive recording contain every requested signal. Without a description,
/// further signals of a node are unknown.
pub(super) fn check_overheard(nodes: &[Node], options: &LogOptions) -> Result<(), Failure> {
    check_wanted(nodes, options).map_err(|failure| {
        let name = match &failure.cause {
            Cause::Log(LogFailure::UnknownSignal { name, .. }) if nodes.iter().any(|node| node.model.is_none()) => name,
            Cause::Log(LogFailure::NotMapped { name, disabled: None }) => name,
            _ => return failure,
        };
        let mut known: Vec<String> = Vec::new();
        for node in nodes {
            let mapped = |signal: &&Signal| {
                node.tpdos.iter().any(|tpdo| tpdo.mapping.iter().any(|entry| signal.is_value(entry.object)))
            };
            known.extend(node.signals.iter().filter(mapped).map(|signal| signal.name.clone()));
        }
        known.dedup();
        Failure::general(LogFailure::NotOverheard { name: name.clone(), known })
    })
}

/// Whether a signal or object is mapped to a TPDO.
fn carries(node: &Node, tpdo: &Tpdo, item: &Wanted) -> bool {
    let mut entries = tpdo.mapping.iter().map(|entry| entry.object);
    let mut signals = node.signals.iter();
    match &node.wanted(item) {
        Wanted::Signal(name) => {
            entries.any(|object| node.signals.iter().any(|signal| signal.name == *name && signal.is_value(object)))
        }
        Wanted::Object(object, _) | Wanted::Named(_, object) => entries.any(|mapped| mapped == *object),
        Wanted::Status(name) => {
            signals.any(|signal| signal.name == *name && entries.any(|object| Some(object) == signal.status))
        }
    }
}

fn unknown_signal(name: &str, nodes: &[Node]) -> LogFailure {
    let mut known: Vec<String> = Vec::new();
    for like in nodes.iter().flat_map(|node| node.names_like(name)) {
        if !known.contains(&like) {
            known.push(like);
        }
    }
    LogFailure::UnknownSignal { name: name.to_owned(), known }
}

/// Fails if another node sends SYNC, because two SYNC producers would double every synchronous TPDO. Adds nodes that
/// restart during the check to `restarted`.
pub(super) fn refuse_second_sync(
    master: &mut Master<'_>,
    nodes: &[Node],
    period: Duration,
    restarted: &mut BTreeSet<NodeId>,
) -> Result<(), Failure> {
    let ids: BTreeSet<CanId> = nodes.iter().map(|node| node.sync).collect();
    if ids.len() > 1 {
        let values = nodes.iter().map(|node| (node.id, node.sync)).collect();
        return Err(Failure::general(LogFailure::DifferentSyncIds(values)));
    }
    if nodes.iter().any(|node| node.sync_overflow != nodes[0].sync_overflow) {
        let values = nodes.iter().map(|node| (node.id, node.sync_overflow.unwrap_or(0))).collect();
        return Err(Failure::general(LogFailure::DifferentSyncCounters(values)));
    }
    let length = (period * 3).clamp(Duration::from_millis(200), Duration::from_secs(2));
    let until = master.now() + length;
    let second_sync = wait(master, until, Policy::Command, |_, event| match event {
        MasterEvent::Frame(received) if ids.contains(&received.frame.id()) && !received.frame.is_remote() => {
            ControlFlow::Break(())
        }
        MasterEvent::Frame(received) => {
            restarted.extend(booted(&received.frame));
            ControlFlow::Continue(())
        }
        _ => ControlFlow::Continue(()),
    })?;
    if second_sync.done().is_none() {
        return Ok(());
    }
    Err(Failure::general(LogFailure::SecondSyncProducer))
}

/// Returns the bus load (0 to 1) of SYNC at this interval and of the TPDOs that follow it, for the greatest frame
/// length. `None` if the bit rate is unknown.
pub(super) fn sync_share(master: &Master<'_>, nodes: &[Node], period: Duration) -> Option<f64> {
    let bit_rate = master.bus().bit_rate()?;
    let tpdos = nodes.iter().flat_map(|node| &node.tpdos).filter(|tpdo| tpdo.cob_id.is_valid());
    let answers = tpdos.filter_map(|tpdo| match tpdo.transmission? {
        Transmission::AcyclicSync => Some(MAX_FRAME_BITS),
        Transmission::Sync(every) => Some(MAX_FRAME_BITS / f64::from(every)),
        _ => None,
    });
    Some((SYNC_BITS + answers.sum::<f64>()) / f64::from(bit_rate) / period.as_secs_f64())
}

/// The bits of a frame with eight bytes, with all stuff bits and the interframe space.
const MAX_FRAME_BITS: f64 = 135.0;

/// The bits of a frame without data, with some stuff bits and the interframe space.
const SYNC_BITS: f64 = 50.0;
