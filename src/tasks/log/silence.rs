//! Why a recording has no value.

use super::recording::Recording;
use super::{FIRST_SAMPLE_TIMEOUT, LogFailure, LogOptions, Mode, SilenceReason};
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::tasks::Failure;

/// Why a recording has not one row.
pub(super) fn why_nothing(recording: &Recording<'_>, options: &LogOptions) -> Failure {
    let within = options.duration.unwrap_or(FIRST_SAMPLE_TIMEOUT).min(FIRST_SAMPLE_TIMEOUT);
    if let Some(&node) = recording.listener.as_ref().and_then(|listener| listener.not_understood.first()) {
        return Failure::at(node, LogFailure::UnknownMapping);
    }
    let Some(first) = recording.nodes.first() else {
        return Failure::general(LogFailure::NothingReceived { within, nodes: options.nodes.clone() });
    };
    let reason = match recording.decoder.wrong_lengths(first.id) {
        0 => silence_reason(first, options.mode),
        _ => SilenceReason::WrongLength,
    };
    let of_several = recording.nodes.len() > 1;
    let cause = LogFailure::NoMeasurements { within, node: first.id, reason, of_several };
    if of_several { Failure::general(cause) } else { Failure::at(first.id, cause) }
}

/// Why a node with this setup sends no measurements.
pub(super) fn silence_reason(node: &Node, mode: Mode) -> SilenceReason {
    if matches!(mode, Mode::Poll(_)) {
        return SilenceReason::NoAnswer;
    }
    let valid: Vec<&Tpdo> = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).collect();
    let waits_for_sync = |tpdo: &&&Tpdo| tpdo.transmission.is_some_and(|transmission| transmission.needs_sync());
    if node.tpdos.is_empty() {
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
