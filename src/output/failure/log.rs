//! Messages and hints if nothing was recorded, or a recording ended early.

use super::CauseText;
use crate::bus::time::format_duration;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtState;
use crate::canopen::pdo::TpdoNumber;
use crate::output::diagnosis;
use crate::output::events::two_senders;
use crate::tasks::Failure;
use crate::tasks::diagnosis::Silence;
use crate::tasks::log::LogFailure;
use std::time::Duration;

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &LogFailure) -> CauseText {
    match cause {
        LogFailure::UnknownSignal { name, known } => CauseText::new(format!("no node has a signal \"{name}\""))
            .hint(format!("the signals are: {}", known.join(", "))),
        LogFailure::NoStatus { signal } => CauseText::new(format!("no node has a status object for {signal}")),
        LogFailure::NotMapped { name, disabled } => {
            let message = match disabled {
                Some((node, number)) => format!(
                    "{number} of node {node} contains {name}, but is disabled (bit 31 of {:04X}h:1)",
                    number.communication(1).index
                ),
                None => format!("no TPDO contains {name}"),
            };
            CauseText::new(message)
                .hint("read it by SDO: --poll 100ms (without --sync); or put it into a TPDO: cangauge pdo map --help")
        }
        LogFailure::NotOverheard { name, known } => not_overheard(name, known),
        LogFailure::DifferentSyncIds(ids) => different_sync_ids(ids),
        LogFailure::DifferentSyncCounters(values) => {
            let values: Vec<String> = values.iter().map(|(node, value)| format!("node {node}: {value}")).collect();
            CauseText::new(format!("the nodes expect different SYNC counters (1019h): {}", values.join(", ")))
                .hint("set 1019h to the same value in all nodes, or record them one by one")
        }
        LogFailure::SecondSyncProducer => CauseText::new("another node sends SYNC on this bus: nothing was started")
            .hint("omit --sync: the other node already sends SYNC"),
        LogFailure::NoRtr { number } => no_rtr(*number),
        LogFailure::TwoSenders(number) => CauseText::new(two_senders(*number))
            .hint("disconnect one of them, or change its node-ID: cangauge lss scan"),
        LogFailure::Replaced => {
            CauseText::new("another device has this node-ID now (with -o, its rows are in a new file)")
        }
        LogFailure::UnknownMapping => unknown_mapping(failure),
        LogFailure::OtherLength { mapped, received, is_live } => other_length(failure, *mapped, *received, *is_live),
        LogFailure::NothingReceived { has_request, within, nodes, has_traffic, interface } => {
            let what = if *has_request { "no TPDO with these signals" } else { "no TPDO" };
            nothing_received(what, *within, nodes, *has_traffic, interface.as_deref())
        }
        LogFailure::NoMeasurements { within, nodes } => no_measurements(*within, nodes),
        LogFailure::NodesLost { nodes, .. } => CauseText::new(nodes_lost(nodes)),
        LogFailure::OtherColumns { file, found, expected } => {
            CauseText::new(format!("{file} has other columns: \"{found}\", not \"{expected}\""))
                .hint("choose another file, or overwrite it with --force")
        }
        LogFailure::OutputClosed { rows } => {
            CauseText::new(format!("the output was closed before the end: {} written", count(*rows)))
        }
        LogFailure::EndedEarly { rows } => {
            CauseText::new(format!("interrupted before the end: {} written", count(*rows)))
        }
        LogFailure::RowsLost { rows, output } => {
            CauseText::new(format!("{} lost: {output} could not keep up", count(*rows)))
        }
        LogFailure::FileDeleted { file } => {
            CauseText::new(format!("{file} was deleted while it was written: its rows are lost"))
        }
        LogFailure::EventsLost { output } => CauseText::new(format!("events lost: {output} could not keep up")),
    }
}

fn different_sync_ids(ids: &[(NodeId, CanId)]) -> CauseText {
    let ids: Vec<String> = ids.iter().map(|(node, id)| format!("node {node}: {id}")).collect();
    CauseText::new(format!("the nodes have different COB-IDs of SYNC (1005h): {}", ids.join(", ")))
        .hint("set 1005h to the same value in all nodes, or record them one by one")
}

fn unknown_mapping(failure: &Failure) -> CauseText {
    let node = failure.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    CauseText::new("the mapping of its TPDOs is unknown").hint(format!(
        "name the device: --device {node}=mh4 (or a file), or start recording before another master reads the mapping"
    ))
}

fn other_length(failure: &Failure, mapped: usize, received: usize, is_live: bool) -> CauseText {
    let cause_text = CauseText::new(diagnosis::wrong_length(mapped, received));
    let node = failure.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    cause_text.hint(match is_live {
        true => "read by SDO instead: omit --passive, and add --poll 100ms".to_owned(),
        false => format!("name a description that has its mapping: --device {node}=FILE, or --eds {node}=FILE"),
    })
}

fn no_rtr(number: TpdoNumber) -> CauseText {
    let index = number.communication(1).index;
    CauseText::new(format!("{number} does not answer remote requests (bit 30 of {index:04X}h:1): nothing was started"))
        .hint("read by SDO instead: --poll 100ms")
}

fn not_overheard(name: &str, known: &[String]) -> CauseText {
    let cause_text = CauseText::new(format!("none of the known TPDO mappings contains {name}"));
    if known.is_empty() { cause_text } else { cause_text.hint(format!("they contain: {}", known.join(", "))) }
}

fn nodes_lost(nodes: &[NodeId]) -> String {
    let names: Vec<String> = nodes.iter().map(|node| node.to_string()).collect();
    let word = if nodes.len() == 1 { "node" } else { "nodes" };
    format!("{word} {} lost: no measurements at the end", names.join(", "))
}

fn count(rows: u64) -> String {
    if rows == 1 { "1 row".to_owned() } else { format!("{rows} rows") }
}

fn no_measurements(within: Duration, nodes: &[(NodeId, Silence)]) -> CauseText {
    let within = format_duration(within);
    let cause_text = match nodes {
        [(_, silence)] => CauseText::new(format!("no measurements within {within}: {}", diagnosis::reason(silence))),
        _ => CauseText::new(format!("no measurements from any node within {within}; {}", diagnosis::reasons(nodes))),
    };
    match nodes.first().and_then(|(node, silence)| diagnosis::hint(silence, *node, "add")) {
        Some(hint) => cause_text.hint(hint),
        None => cause_text,
    }
}

/// Returns the message and the hint if a passive recording received no TPDO.
fn nothing_received(
    what: &str,
    within: Duration,
    nodes: &[(NodeId, Option<NmtState>)],
    has_traffic: bool,
    interface: Option<&str>,
) -> CauseText {
    let Some(interface) = interface else {
        return CauseText::new(format!("the recording contains {what} of these nodes"));
    };
    let within = format_duration(within);
    if !has_traffic {
        return CauseText::new(format!("no measurements within {within}: no frame was received at all"))
            .hint(format!("check the cable and the bit rate: cangauge bus detect {interface}"));
    }
    let states: Vec<String> =
        nodes.iter().filter_map(|(node, state)| Some(format!("node {node} is {}", (*state)?))).collect();
    let states = if states.is_empty() { String::new() } else { format!("; {}", states.join(", ")) };
    let node = match nodes {
        [(only, _)] => only.to_string(),
        _ => "all".to_owned(),
    };
    let cause_text = CauseText::new(format!("no measurements within {within}: {what} received{states}"));
    // The nodes are already started, so they wait for another trigger.
    if nodes.iter().all(|(_, state)| *state == Some(NmtState::Operational)) {
        return cause_text.hint("--passive cannot read the reason from the nodes: omit it");
    }
    cause_text.hint(format!("--passive starts no node: omit it, or: cangauge nmt start {node}"))
}
