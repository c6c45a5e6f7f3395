//! Text for the reasons why a node sends no measurements, with hints.

use crate::bus::time::format_duration;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtState;
use crate::canopen::pdo::TpdoNumber;
use crate::node::state::Proof;
use crate::tasks::diagnosis::{Running, Silence, SilenceCause, TpdoCause};
use std::time::Duration;

/// Returns the reason why a node, or one of its signals, sends no measurements.
pub fn reason(silence: &Silence) -> String {
    let text = match &silence.cause {
        SilenceCause::InterfaceDown => return "the interface is down".to_owned(),
        SilenceCause::NotReadAgain => {
            return "it restarted or its heartbeat paused, and its setup could not be read again".to_owned();
        }
        SilenceCause::PollFailed(error) => return error.to_string(),
        SilenceCause::NotOperational { state, by, was_started } => {
            let again = match (was_started, state) {
                (true, NmtState::PreOperational) => " again after the start",
                (true, _) => " after the start",
                (false, _) => "",
            };
            let by = match by {
                Proof::Heartbeat => "",
                Proof::Command => " (NMT command)",
                _ => " (node guarding)",
            };
            format!("it is {state}{again}{by}")
        }
        SilenceCause::Restarted => "it restarted, and has sent no heartbeat since".to_owned(),
        SilenceCause::Unreachable { had_heartbeat: true } => {
            "its heartbeat stopped, and it does not answer: it has no power or cable".to_owned()
        }
        SilenceCause::Unreachable { had_heartbeat: false } => {
            "it does not answer: it is stopped, or has no power or cable".to_owned()
        }
        SilenceCause::HeartbeatStopped => "its heartbeat stopped".to_owned(),
        SilenceCause::WrongLength { mapped, received } => wrong_length(*mapped, *received),
        SilenceCause::SharedCobId(id, other) => format!("node {other} sends TPDOs with the same COB-ID {id}"),
        SilenceCause::SameCobId(id, [one, other]) => format!("its {one} and {other} have the same COB-ID {id}"),
        SilenceCause::NoTpdo => "it has no TPDO".to_owned(),
        SilenceCause::Tpdo(number, cause) => tpdo_reason(*number, *cause, silence),
    };
    match silence.emergency {
        Some(code) => format!("{text}, emergency {code:04X}h"),
        None => text,
    }
}

/// Returns a word for the cause, for scripts.
pub fn word(silence: &Silence) -> &'static str {
    match &silence.cause {
        SilenceCause::InterfaceDown => "interface-down",
        SilenceCause::NotReadAgain => "not-read-again",
        SilenceCause::PollFailed(_) => "no-answer",
        SilenceCause::NotOperational { state: NmtState::Stopped, .. } => "stopped",
        SilenceCause::NotOperational { .. } => "not-operational",
        SilenceCause::Restarted => "restarted",
        SilenceCause::Unreachable { .. } => "unreachable",
        SilenceCause::HeartbeatStopped => "heartbeat-stopped",
        SilenceCause::WrongLength { .. } => "wrong-length",
        SilenceCause::SharedCobId(..) | SilenceCause::SameCobId(..) => "shared-cob-id",
        SilenceCause::NoTpdo => "no-tpdo",
        SilenceCause::Tpdo(_, cause) => match cause {
            TpdoCause::Disabled => "tpdo-disabled",
            TpdoCause::NothingMapped(Some(0xfe..)) => "multiplexed-pdo",
            TpdoCause::NothingMapped(_) => "nothing-mapped",
            TpdoCause::OnlyOnRequest(_) => "only-on-request",
            TpdoCause::WaitsForSync(_) | TpdoCause::TooFewSyncs { .. } => "waits-for-sync",
            TpdoCause::SyncCounter { .. } | TpdoCause::SyncStart(_) | TpdoCause::SyncRejected => "sync-counter",
            TpdoCause::SteadyAtSync | TpdoCause::SendsOnChange => "steady",
            TpdoCause::NotSentAtSync | TpdoCause::NotSentOnRequest | TpdoCause::Due(_) => "not-sent",
            TpdoCause::SlowEventTimer(_) => "slow-event-timer",
            TpdoCause::InhibitTime(_) => "inhibit-time",
            TpdoCause::ChannelOff(_) => "channel-off",
            TpdoCause::InterruptsDisabled(_) => "interrupts-disabled",
            TpdoCause::NoTrigger(..) => "no-trigger",
            TpdoCause::UnknownType => "unknown-transmission",
        },
    }
}

/// Returns the reason why a TPDO is not sent.
fn tpdo_reason(number: TpdoNumber, cause: TpdoCause, silence: &Silence) -> String {
    let communication = number.communication(0).index;
    let mapping = number.mapping(0).index;
    let also = or_not_running(silence.running);
    match cause {
        TpdoCause::Disabled => format!("its TPDOs are disabled (bit 31 of {communication:04X}h:1)"),
        TpdoCause::NothingMapped(Some(0)) => format!("nothing is mapped to {number} ({mapping:04X}h:0 is 0)"),
        TpdoCause::NothingMapped(code) => not_decoded(number, code),
        TpdoCause::OnlyOnRequest(code) => {
            format!("{number} is sent on remote request only ({communication:04X}h:2 is {code})")
        }
        TpdoCause::WaitsForSync(CanId::SYNC) => format!("{number} waits for SYNC, and no node sends SYNC"),
        TpdoCause::WaitsForSync(id) => {
            format!("{number} waits for SYNC with COB-ID {id} (1005h), and no node sends it")
        }
        TpdoCause::SyncCounter { is_expected: true } => {
            format!("{number} waits for SYNC with a counter (1019h), and SYNC is sent without one{also}")
        }
        TpdoCause::SyncCounter { is_expected: false } => {
            format!("{number} waits for SYNC without a counter (1019h is 0), and SYNC is sent with one{also}")
        }
        TpdoCause::SyncStart(start) => format!(
            "{number} starts at the SYNC with counter {start} ({communication:04X}h:6), and the counter never has this value (1019h){also}"
        ),
        TpdoCause::SyncRejected => format!("{number} waits for SYNC, and the node rejects the length of SYNC"),
        TpdoCause::TooFewSyncs { every, seen } => {
            let every = if every == 1 { "every SYNC".to_owned() } else { format!("every {every}th SYNC") };
            format!("{number} is sent at {every} ({communication:04X}h:2), and {seen} SYNC were sent")
        }
        TpdoCause::SteadyAtSync => format!(
            "{number} is sent at a SYNC only after a change ({communication:04X}h:2 is 0): its value is steady{also}"
        ),
        TpdoCause::NotSentOnRequest => not_sent(number, "on each remote request", silence),
        TpdoCause::NotSentAtSync => not_sent(number, "at SYNC, and SYNC was sent", silence),
        TpdoCause::SlowEventTimer(timer) => {
            format!("the event timer of {number} is longer than the wait ({communication:04X}h:5 is {timer} ms)")
        }
        TpdoCause::InhibitTime(inhibit) => {
            let inhibit = format_duration(Duration::from_micros(100) * u32::from(inhibit));
            format!("the inhibit time of {number} is longer than the wait ({communication:04X}h:3 is {inhibit}){also}")
        }
        TpdoCause::ChannelOff(mode) => format!("its channel is off ({mode} is 0)"),
        TpdoCause::InterruptsDisabled(object) => {
            format!("its analogue inputs are not sent on change ({object} is 0), and {number} has no event timer")
        }
        TpdoCause::NoTrigger(first, last) => format!(
            "{number} has no event timer ({communication:04X}h:2 and :5), and delta and limits are 0 ({first} to {last})"
        ),
        TpdoCause::SendsOnChange => {
            format!(
                "{number} has no event timer ({communication:04X}h:2 and :5), and its value does not change enough{also}"
            )
        }
        TpdoCause::Due(timer) => not_sent(number, &format!("every {timer} ms ({communication:04X}h:5)"), silence),
        TpdoCause::UnknownType => {
            format!("the transmission type of {number} cannot be read ({communication:04X}h:2){also}")
        }
    }
}

/// Returns the text for TPDOs whose length differs from their mapping.
pub fn wrong_length(mapped: usize, received: usize) -> String {
    format!("its TPDOs have {received} bytes, but their mapping has {mapped}")
}

/// Returns the reason why a TPDO cannot be decoded. `code` is 1Axxh:0, if it was read.
pub fn not_decoded(number: TpdoNumber, code: Option<u8>) -> String {
    let mapping = number.mapping(0).index;
    match code {
        Some(code @ 0xfe..) => {
            format!("{number} is a multiplexed PDO ({mapping:04X}h:0 is {code:02X}h), which cannot be decoded")
        }
        _ => format!("the mapping of {number} could not be read ({mapping:04X}h)"),
    }
}

/// The text for a TPDO that is due but was not received.
fn not_sent(number: TpdoNumber, when: &str, silence: &Silence) -> String {
    let unknown: Vec<String> = silence.unknown_cob_ids.iter().take(MAX_LISTED).map(CanId::to_string).collect();
    let state = match (silence.running, unknown.is_empty()) {
        (Running::Operational, true) => "the node is operational",
        (Running::NotStopped, true) => "the node answers SDO, and is probably not operational",
        (Running::Unknown, true) => "the node is not operational, or has no power or cable",
        (Running::Operational, false) => "the node is operational, and may send with another COB-ID",
        (Running::NotStopped, false) => "the node is not operational, or sends with another COB-ID",
        (Running::Unknown, false) => "the node is not operational, sends with another COB-ID, or has no power or cable",
    };
    let received = match unknown.is_empty() {
        true => String::new(),
        false => format!(" (frames were received with COB-ID {}, which no TPDO of the node uses)", unknown.join(", ")),
    };
    format!("{number} is due {when}, and no {number} was received{received}: {state}")
}

/// Other possible causes, if the state of the node is unknown.
fn or_not_running(running: Running) -> &'static str {
    match running {
        Running::Operational => "",
        Running::NotStopped => ", or the node is not operational",
        Running::Unknown => ", or the node is not operational, or has no power or cable",
    }
}

/// The number of nodes listed with their reasons in a message.
const MAX_LISTED: usize = 3;

/// Lists the reasons of the first nodes: `node 5: …; node 6: …`.
pub fn reasons(nodes: &[(NodeId, Silence)]) -> String {
    let listed = nodes.iter().take(MAX_LISTED);
    let mut reasons: Vec<String> = listed.map(|(node, silence)| format!("node {node}: {}", reason(silence))).collect();
    if nodes.len() > MAX_LISTED {
        reasons.push(format!("{} more", nodes.len() - MAX_LISTED));
    }
    reasons.join("; ")
}

/// Returns a command to type, or one thing to check. `log` starts this command: `add`, or `cangauge log 5`.
pub fn hint(silence: &Silence, node: NodeId, log: &str) -> Option<String> {
    let poll = || Some(format!("read by SDO instead: {log} --poll 100ms"));
    match &silence.cause {
        SilenceCause::InterfaceDown => Some("show the interfaces: cangauge bus list".to_owned()),
        SilenceCause::NotReadAgain | SilenceCause::PollFailed(_) | SilenceCause::SharedCobId(..) => None,
        SilenceCause::SameCobId(_, [_, number]) => {
            Some(format!("give one of them another COB-ID: cangauge pdo map {node} {} --cob-id 0xCOB-ID", number.get()))
        }
        SilenceCause::NotOperational { state: NmtState::Stopped, .. } => Some(format!("cangauge nmt preop {node}")),
        // The node left OPERATIONAL by itself, and would leave it again.
        SilenceCause::NotOperational { was_started, by, .. }
            if *by != Proof::Command && (*was_started || silence.emergency.is_some()) =>
        {
            Some(format!("cangauge errors {node}"))
        }
        SilenceCause::NotOperational { .. } | SilenceCause::Restarted => Some(format!("cangauge nmt start {node}")),
        SilenceCause::Unreachable { had_heartbeat: false } => {
            Some(format!("check its power and cable; if it is stopped: cangauge nmt preop {node}"))
        }
        SilenceCause::Unreachable { had_heartbeat: true } | SilenceCause::HeartbeatStopped => {
            Some("check its power and cable".to_owned())
        }
        SilenceCause::WrongLength { .. } | SilenceCause::NoTpdo => poll(),
        SilenceCause::Tpdo(number, cause) => match cause {
            TpdoCause::OnlyOnRequest(_) => {
                Some(format!("read by SDO instead: {log} --poll 100ms (or request it: --request 100ms)"))
            }
            TpdoCause::WaitsForSync(_) => {
                Some(format!("{log} --sync 100ms, or read by SDO: --poll 100ms (node {node})"))
            }
            TpdoCause::NotSentAtSync | TpdoCause::Due(_) if silence.running == Running::Operational => poll(),
            TpdoCause::NotSentAtSync | TpdoCause::Due(_) if silence.running == Running::NotStopped => {
                Some(format!("cangauge nmt state {node} --probe"))
            }
            TpdoCause::NotSentAtSync | TpdoCause::Due(_) => Some("check its power and cable".to_owned()),
            TpdoCause::SlowEventTimer(_) | TpdoCause::NoTrigger(..) | TpdoCause::SendsOnChange => Some(format!(
                "read by SDO instead: {log} --poll 100ms (or: cangauge pdo map {node} {} --event-timer 100ms)",
                number.get()
            )),
            TpdoCause::SyncRejected => Some(format!(
                "the node expects SYNC with a counter if its 1019h is not 0: cangauge sdo read {node} 0x1019"
            )),
            TpdoCause::Disabled
            | TpdoCause::NothingMapped(_)
            | TpdoCause::NotSentOnRequest
            | TpdoCause::SyncCounter { .. }
            | TpdoCause::SyncStart(_)
            | TpdoCause::TooFewSyncs { .. }
            | TpdoCause::SteadyAtSync
            | TpdoCause::InhibitTime(_)
            | TpdoCause::ChannelOff(_)
            | TpdoCause::InterruptsDisabled(_)
            | TpdoCause::UnknownType => poll(),
        },
    }
}
