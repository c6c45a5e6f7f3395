//! Why a recording has no value. The reason comes from what the node sent last, then from its setup.

use super::recording::Recording;
use super::{FIRST_SAMPLE_TIMEOUT, LogFailure, LogOptions, Mode, SilenceReason};
use crate::canopen::nmt::NmtState;
use crate::canopen::pdo::Transmission;
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::tasks::Failure;
use std::time::Duration;

/// What a node sent last.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Evidence {
    /// The state of the last heartbeat; `None` after a boot-up.
    pub(super) state: Option<NmtState>,
    /// The error code of the last emergency.
    pub(super) emergency: Option<u16>,
}

/// Why a recording has not one row.
pub(super) fn why_nothing(recording: &Recording<'_>, options: &LogOptions) -> Failure {
    let within = waited(options);
    if let Some(&node) = recording.listener.as_ref().and_then(|listener| listener.not_understood.first()) {
        return Failure::at(node, LogFailure::UnknownMapping);
    }
    let Some(first) = recording.nodes.first() else {
        return Failure::general(LogFailure::NothingReceived { within, nodes: options.nodes.clone() });
    };
    let reason = silence_reason(recording, first, options);
    let of_several = recording.nodes.len() > 1;
    let cause = LogFailure::NoMeasurements { within, node: first.id, reason, of_several };
    if of_several { Failure::general(cause) } else { Failure::at(first.id, cause) }
}

fn waited(options: &LogOptions) -> Duration {
    options.duration.unwrap_or(FIRST_SAMPLE_TIMEOUT).min(FIRST_SAMPLE_TIMEOUT)
}

/// Why a node sends no measurements.
pub(super) fn silence_reason(recording: &Recording<'_>, node: &Node, options: &LogOptions) -> SilenceReason {
    if matches!(options.mode, Mode::Poll(_)) {
        return SilenceReason::NoAnswer;
    }
    let evidence = recording.evidence.get(&node.id).copied().unwrap_or_default();
    if let Some(state) = evidence.state.filter(|&state| state != NmtState::Operational) {
        let was_started = recording.states.has_started(node.id);
        return SilenceReason::NotOperational { state, was_started, emergency: evidence.emergency };
    }
    if let Some((mapped, received)) = recording.decoder.wrong_length(node.id) {
        return SilenceReason::WrongLength { mapped, received };
    }
    let mut valid: Vec<&Tpdo> = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).collect();
    let Some(first) = node.tpdos.first() else { return SilenceReason::NoTpdo };
    let Some(first_valid) = valid.first() else { return SilenceReason::AllTpdosDisabled(first.number) };
    if valid.iter().all(|tpdo| tpdo.mapping.is_empty()) {
        return SilenceReason::NothingMapped(first_valid.number);
    }
    // The TPDOs of the requested signals.
    let has_values = |tpdo: &&Tpdo| recording.decoder.values_of(tpdo.cob_id.can_id()) > 0;
    if valid.iter().any(has_values) {
        valid.retain(has_values);
    }
    let reasons = valid.iter().map(|tpdo| tpdo_reason(tpdo, options, recording.syncs()));
    reasons
        .reduce(|first, other| if first == SilenceReason::Unknown { other } else { first })
        .unwrap_or(SilenceReason::Unknown)
}

/// Why a valid TPDO is not sent, by its parameters.
fn tpdo_reason(tpdo: &Tpdo, options: &LogOptions, syncs: u64) -> SilenceReason {
    let number = tpdo.number;
    let sends_sync = matches!(options.mode, Mode::Sync(_));
    match tpdo.transmission {
        Some(Transmission::Rtr(_)) => SilenceReason::OnlyOnRequest(number),
        Some(Transmission::AcyclicSync | Transmission::Sync(_)) if !sends_sync => SilenceReason::WaitsForSync(number),
        Some(Transmission::AcyclicSync) => SilenceReason::SteadyAtSync(number),
        Some(Transmission::Sync(every)) if u64::from(every) > syncs => SilenceReason::TooFewSyncs(number, every, syncs),
        Some(Transmission::Sync(_)) => SilenceReason::NotSentAtSync(number),
        _ => match tpdo.event_timer_ms {
            Some(0) => SilenceReason::NoEventTimer(number),
            Some(timer) if Duration::from_millis(u64::from(timer)) >= waited(options) => {
                SilenceReason::SlowEventTimer(number, timer)
            }
            _ => SilenceReason::Unknown,
        },
    }
}
