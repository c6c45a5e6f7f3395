//! `nmt watch` reports exactly the changes that were received.

use super::*;
use cangauge::canopen::nmt::ErrorControlMessage;
use cangauge::tasks::nmt::Change;
use std::time::Duration;

/// Every reported change has its own frame; every boot-up and every change of state is reported.
pub(super) fn watched(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let Command::NmtWatch { nodes, .. } = &spec.command else { return };
    let received = run.bus.frames.iter().filter_map(|(at, passed)| match passed {
        Passed::Received(frame) => ErrorControlMessage::parse(frame).map(|(node, life)| (*at, node, life)),
        Passed::Sent(_) => None,
    });
    let lives: Vec<(Mono, NodeId, ErrorControlMessage)> =
        received.filter(|(_, node, _)| nodes.contains(&node.get())).collect();
    let mut left = lives.clone();
    for seen in &run.observed.seen {
        let at = seen.at.mono;
        let life = match seen.change {
            Change::BootUp => ErrorControlMessage::BootUp,
            Change::State(state) | Change::Back(state) => ErrorControlMessage::State(state),
            Change::Lost(silent) => {
                let is_silent = |(came, node, _): &(Mono, NodeId, ErrorControlMessage)| {
                    *node == seen.node && *came > at - silent && *came <= at
                };
                if silent < Duration::from_millis(50) || lives.iter().any(is_silent) {
                    violations.push(("reports received changes", format!("{seen:?} of {lives:?}")));
                }
                continue;
            }
        };
        match left.iter().position(|came| *came == (at, seen.node, life)) {
            Some(place) => drop(left.remove(place)),
            None => violations.push(("reports received changes", format!("{seen:?} of {lives:?}"))),
        }
    }
    if run.result.is_err() {
        return;
    }
    let mut before: BTreeMap<NodeId, NmtState> = BTreeMap::new();
    for (at, node, life) in lives.iter().filter(|(at, ..)| *at > run.started) {
        let is_news = match life {
            ErrorControlMessage::BootUp => {
                before.remove(node);
                true
            }
            ErrorControlMessage::State(state) => before.insert(*node, *state).is_some_and(|before| before != *state),
        };
        let is_told = run.observed.seen.iter().any(|seen| seen.node == *node && seen.at.mono == *at);
        if is_news && !is_told {
            violations.push(("reports received changes", format!("nothing of {life:?} of node {node} at {at:?}")));
            return;
        }
    }
}
