//! Why a recording has no value.

use super::recording::Recording;
use super::{FIRST_SAMPLE_TIMEOUT, Mode, Plan, SilenceReason};
use crate::bus::time::spoken;
use crate::canopen::id::NodeId;
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::tasks::{Failure, Kind};

/// Why a recording has not one row.
pub(super) fn why_nothing(recording: &Recording<'_>, plan: &Plan) -> Failure {
    let within = spoken(plan.duration.unwrap_or(FIRST_SAMPLE_TIMEOUT).min(FIRST_SAMPLE_TIMEOUT));
    if let Some(node) = recording.listener.as_ref().and_then(|listener| listener.not_understood.first()) {
        let message = "it sends TPDOs, and their mapping is unknown";
        return Failure::of_node(Kind::Usage, *node, message).hint(format!(
            "name the device: --device {node}=mh4 (or a file), or record from the start of a log that reads it"
        ));
    }
    let Some(first) = recording.instruments.first() else {
        let node = match plan.nodes.as_slice() {
            [only] => only.to_string(),
            _ => "all".to_owned(),
        };
        return Failure::new(Kind::NoAnswer, format!("no measurements within {within}: no TPDO received"))
            .hint(format!("--passive starts no node: leave it out, or: cangauge nmt start {node}"));
    };
    let reason = match recording.decoder.wrong_lengths(first.id) {
        0 => silence_reason(first, plan.mode),
        _ => SilenceReason::WrongLength,
    };
    let (why, hint) = text(reason, first.id);
    let failure = match recording.instruments.as_slice() {
        [only] => Failure::of_node(Kind::NoAnswer, only.id, format!("no measurements within {within}: {why}")),
        _ => Failure::new(
            Kind::NoAnswer,
            format!("no measurements from any node within {within}; node {}: {why}", first.id),
        ),
    };
    match hint {
        Some(hint) => failure.hint(hint),
        None => failure,
    }
}

/// Why a node with this setup sends no measurements.
pub(super) fn silence_reason(instrument: &Node, mode: Mode) -> SilenceReason {
    if matches!(mode, Mode::Poll(_)) {
        return SilenceReason::NoAnswer;
    }
    let valid: Vec<&Tpdo> = instrument.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).collect();
    let waits_for_sync = |tpdo: &&&Tpdo| tpdo.transmission.is_some_and(|transmission| transmission.needs_sync());
    if instrument.tpdos.is_empty() {
        SilenceReason::NoTpdo
    } else if valid.is_empty() {
        SilenceReason::AllTpdosDisabled
    } else if valid.iter().all(|tpdo| tpdo.mapping.is_empty()) {
        SilenceReason::NothingMapped
    } else if let (Some(tpdo), false) = (valid.iter().find(waits_for_sync), matches!(mode, Mode::Sync(_))) {
        SilenceReason::WaitsForSync(tpdo.number)
    } else if let Some(tpdo) = valid.iter().find(|tpdo| tpdo.event_timer_ms == Some(0)) {
        SilenceReason::NoEventTimer(tpdo.number)
    } else {
        SilenceReason::Unknown
    }
}

/// The reason as text, and a hint.
pub fn text(reason: SilenceReason, node: NodeId) -> (String, Option<String>) {
    let poll = || Some("read by SDO instead: add --poll 100ms".to_owned());
    match reason {
        SilenceReason::NoAnswer => ("it does not answer".to_owned(), None),
        SilenceReason::NoTpdo => ("it has no TPDO".to_owned(), poll()),
        SilenceReason::AllTpdosDisabled => ("all its TPDOs are disabled (bit 31 of 1800h:1)".to_owned(), poll()),
        SilenceReason::NothingMapped => ("nothing is mapped into its TPDOs".to_owned(), poll()),
        SilenceReason::WaitsForSync(number) => (
            format!("{number} waits for SYNC, and no node sends SYNC"),
            Some(format!("add --sync 100ms, or read by SDO: --poll 100ms (node {node})")),
        ),
        SilenceReason::NoEventTimer(number) => {
            (format!("{number} has no event timer (1800h:5 is 0), and its value does not change enough"), poll())
        }
        SilenceReason::WrongLength => ("its TPDOs have another length than their mapping".to_owned(), None),
        SilenceReason::Unknown => {
            ("its TPDOs should be sent; is it started?".to_owned(), Some(format!("cangauge nmt state {node}")))
        }
    }
}
