//! Text for causes: nothing was recorded, or a recording ended early.

use super::Words;
use crate::bus::time::spoken;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::tasks::Failure;
use crate::tasks::log::{LogFailure, SilenceReason};

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &LogFailure) -> Words {
    match cause {
        LogFailure::UnknownSignal { name, known } => {
            Words::new(format!("no node has a signal \"{name}\"")).hint(format!("there are: {}", known.join(", ")))
        }
        LogFailure::NoStatus { signal } => Words::new(format!("no node has a status object for {signal}")),
        LogFailure::NotMapped { name } => {
            Words::new(format!("no TPDO contains {name}")).hint("read it by SDO instead: add --poll 100ms")
        }
        LogFailure::DifferentSyncIds => Words::new("the nodes have different COB-IDs of SYNC (1005h)"),
        LogFailure::DifferentSyncCounters(values) => {
            let values: Vec<String> = values.iter().map(|(node, value)| format!("node {node}: {value}")).collect();
            Words::new(format!("the nodes expect different SYNC counters (1019h): {}", values.join(", ")))
                .hint("set 1019h to the same value in all nodes, or record them one by one")
        }
        LogFailure::SecondSyncProducer => Words::new("another node sends SYNC on this bus: nothing was started")
            .hint("omit --sync: the nodes send on the SYNC that is already there"),
        LogFailure::UnknownMapping => {
            let node = failure.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
            Words::new("it sends TPDOs, and their mapping is unknown").hint(format!(
                "name the device: --device {node}=mh4 (or a file), or record from the start of a log that reads it"
            ))
        }
        LogFailure::NothingReceived { within, nodes } => {
            let node = match nodes.as_slice() {
                [only] => only.to_string(),
                _ => "all".to_owned(),
            };
            Words::new(format!("no measurements within {}: no TPDO received", spoken(*within)))
                .hint(format!("--passive starts no node: omit it, or: cangauge nmt start {node}"))
        }
        LogFailure::NoMeasurements { within, node, reason, of_several } => {
            let (within, why) = (spoken(*within), reason_text(*reason));
            let words = Words::new(if *of_several {
                format!("no measurements from any node within {within}; node {node}: {why}")
            } else {
                format!("no measurements within {within}: {why}")
            });
            match reason_hint(*reason, *node) {
                Some(hint) => words.hint(hint),
                None => words,
            }
        }
        LogFailure::NodesLost { nodes, .. } => {
            let names: Vec<String> = nodes.iter().map(|node| node.to_string()).collect();
            let word = if nodes.len() == 1 { "node" } else { "nodes" };
            Words::new(format!("{word} {} lost: no measurements at the end", names.join(", ")))
        }
        LogFailure::OtherColumns { file, found, expected } => {
            Words::new(format!("{file} has other columns: \"{found}\", not \"{expected}\""))
                .hint("choose another file, or overwrite it with --force")
        }
        LogFailure::OutputClosed { rows } => {
            Words::new(format!("the output was closed before the end: {} written", count(*rows)))
        }
        LogFailure::EndedEarly { rows } => Words::new(format!("interrupted before the end: {} written", count(*rows))),
        LogFailure::RowsLost { rows, output } => {
            Words::new(format!("{} lost: {output} could not keep up", count(*rows)))
        }
        LogFailure::EventsLost { output } => Words::new(format!("events lost: {output} could not keep up")),
    }
}

fn count(rows: u64) -> String {
    if rows == 1 { "1 row".to_owned() } else { format!("{rows} rows") }
}

/// What cannot be told apart without a heartbeat.
const NOT_RUNNING: &str = "the node is not operational, or has no power or cable";

/// Why a node sends no measurements.
pub(in crate::output) fn reason_text(reason: SilenceReason) -> String {
    match reason {
        SilenceReason::NoAnswer => "it does not answer".to_owned(),
        SilenceReason::NotOperational { state, was_started, emergency } => {
            let again = if was_started { " again after the start" } else { "" };
            let emergency = emergency.map(|code| format!(", emergency {code:04X}h")).unwrap_or_default();
            format!("it is {state}{again}{emergency}")
        }
        SilenceReason::NoTpdo => "it has no TPDO".to_owned(),
        SilenceReason::AllTpdosDisabled(number) => {
            format!("its TPDOs are disabled (bit 31 of {:04X}h:1)", number.communication(1).index)
        }
        SilenceReason::NothingMapped(number) => format!(
            "nothing is mapped into its TPDOs, or they are multiplexed PDOs ({:04X}h:0)",
            number.mapping(0).index
        ),
        SilenceReason::OnlyOnRequest(number) => {
            format!("{number} is sent on remote request only ({:04X}h:2 is 252 or 253)", number.communication(2).index)
        }
        SilenceReason::SteadyAtSync(number) => format!(
            "{number} is sent at a SYNC only after a change ({:04X}h:2 is 0): its value is steady, or {NOT_RUNNING}",
            number.communication(2).index
        ),
        SilenceReason::TooFewSyncs(number, every, sent) => {
            format!("{number} is sent at every {every}th SYNC, and {sent} SYNC were sent")
        }
        SilenceReason::NotSentAtSync(number) => {
            format!("{number} is sent at SYNC; SYNC was sent, and no {number} was received: {NOT_RUNNING}")
        }
        SilenceReason::SlowEventTimer(number, timer) => {
            format!("the event timer of {number} is longer ({:04X}h:5 is {timer} ms)", number.communication(5).index)
        }
        SilenceReason::WaitsForSync(number) => format!("{number} waits for SYNC, and no node sends SYNC"),
        SilenceReason::NoEventTimer(number) => {
            let index = number.communication(5).index;
            format!(
                "{number} has no event timer ({index:04X}h:5 is 0): its value does not change enough, or {NOT_RUNNING}"
            )
        }
        SilenceReason::WrongLength { mapped, received } => {
            format!("its TPDOs have {received} bytes, their mapping {mapped}")
        }
        SilenceReason::Unknown => format!("its TPDOs are due: {NOT_RUNNING}"),
    }
}

fn reason_hint(reason: SilenceReason, node: NodeId) -> Option<String> {
    match reason {
        SilenceReason::NoAnswer => None,
        SilenceReason::NotOperational { state: NmtState::Stopped, .. } => Some(format!("cangauge nmt preop {node}")),
        SilenceReason::NotOperational { emergency: Some(_), .. } => Some(format!("cangauge errors {node}")),
        SilenceReason::NotOperational { .. } => Some(format!("cangauge nmt start {node}")),
        SilenceReason::NoTpdo
        | SilenceReason::AllTpdosDisabled(_)
        | SilenceReason::NothingMapped(_)
        | SilenceReason::OnlyOnRequest(_)
        | SilenceReason::SteadyAtSync(_)
        | SilenceReason::TooFewSyncs(..)
        | SilenceReason::SlowEventTimer(..)
        | SilenceReason::WrongLength { .. }
        | SilenceReason::NoEventTimer(_) => Some("read by SDO instead: add --poll 100ms".to_owned()),
        SilenceReason::WaitsForSync(_) => Some(format!("add --sync 100ms, or read by SDO: --poll 100ms (node {node})")),
        SilenceReason::Unknown | SilenceReason::NotSentAtSync(_) => Some(format!("cangauge nmt state {node}")),
    }
}
