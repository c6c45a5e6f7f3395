//! Why a node sends no measurements.
//!
//! [`diagnose`] decides from evidence, in this order: the last frames of the node ([`ObservedFrames`]), its present
//! answers ([`Inquiry`]) and the parameters of the TPDOs with the requested signals. Causes that cannot be
//! distinguished are reported together: see [`Running`].

mod inquiry;

pub use inquiry::{Findings, Inquiry, objects_to_read};

use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{TpdoNumber, Transmission};
use crate::master::SdoError;
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::node::state::Proof;
use std::time::Duration;

/// The emergency of a node that received a SYNC of an unexpected length.
const SYNC_LENGTH: u16 = 0x8240;

/// Why a node or one of its signals sends no measurements.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Silence {
    /// The cause.
    pub cause: SilenceCause,
    /// The code of the last emergency of the node.
    pub emergency: Option<u16>,
    /// Whether the node is OPERATIONAL. Reported with uncertain causes, because a node in another state is also silent.
    pub running: Running,
    /// COB-IDs of received frames that may be TPDOs of the node. No known TPDO has these COB-IDs.
    pub unknown_cob_ids: Vec<CanId>,
}

impl Silence {
    /// Creates a silence without further evidence.
    pub fn of(cause: SilenceCause) -> Silence {
        Silence { cause, emergency: None, running: Running::Unknown, unknown_cob_ids: Vec::new() }
    }
}

/// Whether a node is OPERATIONAL, as far as known. If another state is known, that state is the cause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Running {
    /// The node is OPERATIONAL.
    Operational,
    /// The node answers SDO requests, so it is OPERATIONAL or PRE-OPERATIONAL.
    NotStopped,
    /// The state is unknown.
    Unknown,
}

/// The cause of a silence.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SilenceCause {
    /// The interface of the host is down.
    InterfaceDown,
    /// The node restarted, and its setup could not be read again.
    NotReadAgain,
    /// The value could not be polled.
    PollFailed(Box<SdoError>),
    /// The node is not operational.
    NotOperational {
        /// The state.
        state: NmtState,
        /// The evidence for the state.
        by: Proof,
        /// Whether the node was started before.
        was_started: bool,
    },
    /// The node restarted, and has not been operational since then.
    Restarted,
    /// The node sends no heartbeat and does not answer. With `had_heartbeat`, the heartbeat stopped, so the node is not
    /// in STOPPED.
    Unreachable {
        /// Whether the node had a heartbeat.
        had_heartbeat: bool,
    },
    /// The heartbeat stopped, and no request was sent since then.
    HeartbeatStopped,
    /// The length of the received TPDOs differs from the length of the mapping (both in bytes).
    WrongLength {
        /// The length of the mapping.
        mapped: usize,
        /// The length of the received TPDOs.
        received: usize,
    },
    /// Another node sends TPDOs with the same COB-ID.
    SharedCobId(CanId, NodeId),
    /// Two TPDOs of the node have the same COB-ID.
    SameCobId(CanId, [TpdoNumber; 2]),
    /// The node has no TPDO.
    NoTpdo,
    /// The TPDO is not sent.
    Tpdo(TpdoNumber, TpdoCause),
}

/// Why a TPDO is not sent, by its parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TpdoCause {
    /// Bit 31 of the COB-ID is set in all TPDOs of the node. The first TPDO is reported.
    Disabled,
    /// No object is mapped. The number is 1Axxh:0, if it was read: FEh and FFh mean multiplexed PDOs.
    NothingMapped(Option<u8>),
    /// The TPDO is sent only on remote request (transmission type 252 or 253).
    OnlyOnRequest(u8),
    /// The TPDO waits for SYNC with this COB-ID, but no SYNC was received or sent.
    WaitsForSync(CanId),
    /// SYNC has a counter but the node expects none, or vice versa.
    SyncCounter {
        /// Whether the node expects a counter.
        is_expected: bool,
    },
    /// The TPDO starts at the SYNC with this counter (180xh:6), and SYNC never has this counter (1019h).
    SyncStart(u8),
    /// The node reports that SYNC has an unexpected length (emergency 8240h).
    SyncRejected,
    /// The TPDO is sent at every n-th SYNC, but fewer SYNC messages were received.
    TooFewSyncs {
        /// The number n.
        every: u8,
        /// The number of SYNC messages received.
        seen: u64,
    },
    /// The TPDO is sent only at a SYNC after a change, and its value is steady.
    SteadyAtSync,
    /// The TPDO was requested, but not received.
    NotSentOnRequest,
    /// The TPDO is sent at SYNC. SYNC was sent, but the TPDO was not received.
    NotSentAtSync,
    /// The event timer in milliseconds is longer than the waiting time.
    SlowEventTimer(u16),
    /// The inhibit time in multiples of 100 µs is longer than the waiting time.
    InhibitTime(u16),
    /// The channel of its value is switched off by this object (6112h).
    ChannelOff(ObjectId),
    /// The node sends analogue inputs only if this object is 1 (6423h of CiA 401).
    InterruptsDisabled(ObjectId),
    /// The event timer is 0, and delta and limits are 0, so nothing triggers the TPDO. The objects are the first and
    /// the last of delta and limits.
    NoTrigger(ObjectId, ObjectId),
    /// The event timer is 0, and the TPDO is sent only on change.
    SendsOnChange,
    /// The event timer (in milliseconds) is set, but the TPDO was not received.
    Due(u16),
    /// The transmission type cannot be read.
    UnknownType,
}

/// The frames of a node while it was observed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ObservedFrames {
    /// The state of its last heartbeat; `None` after a boot-up.
    pub state: Option<NmtState>,
    /// The state that the last NMT command of another master demands; `None` if it is OPERATIONAL.
    pub commanded: Option<NmtState>,
    /// Whether the latest heartbeat or boot-up message was a boot-up message.
    pub booted: bool,
    /// Whether the node was operational before.
    pub was_operational: bool,
    /// Whether its heartbeat stopped.
    pub heartbeat_stopped: bool,
    /// The code of its last emergency.
    pub emergency: Option<u16>,
    /// Whether the node sent TPDOs. It is then operational.
    pub sends_tpdos: bool,
    /// The number of SYNC messages from other nodes, and the length of the last message.
    pub syncs: (u64, usize),
    /// The mapped and the received length in bytes of ignored TPDOs.
    pub wrong_length: Option<(usize, usize)>,
    /// A COB-ID that two TPDOs share. The second TPDO belongs to the same node or to another node.
    pub shared: Option<(CanId, [(NodeId, TpdoNumber); 2])>,
}

/// How measurements were requested.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RequestContext {
    /// The waiting time.
    pub waited: Duration,
    /// SYNC messages that the program sent; `None` if it sends no SYNC.
    pub syncs_sent: Option<u64>,
    /// Whether the program requests TPDOs by remote frames.
    pub requests: bool,
    /// Whether the program started the node.
    pub was_started: bool,
}

/// Decides why a node sends no measurements. `carries` returns whether a TPDO contains a requested value.
pub fn diagnose(
    node: &Node,
    carries: &dyn Fn(&Tpdo) -> bool,
    observed: &ObservedFrames,
    findings: Option<&Findings>,
    context: &RequestContext,
) -> Silence {
    let heartbeat = observed.state.filter(|_| !observed.heartbeat_stopped).map(|state| (state, Proof::Heartbeat));
    let answers = findings.map(|findings| findings.answers);
    // A node that answers is not stopped. A node that does not answer may be stopped.
    let is_possible = |&state: &NmtState| !observed.sends_tpdos && answers != Some(state == NmtState::Stopped);
    let commanded = observed.commanded.filter(is_possible).map(|state| (state, Proof::Command));
    let known = heartbeat.or_else(|| findings.and_then(|findings| findings.state)).or(commanded);
    let is_operational = observed.sends_tpdos || known.is_some_and(|(state, _)| state == NmtState::Operational);
    let running = match answers {
        _ if is_operational => Running::Operational,
        Some(true) => Running::NotStopped,
        _ => Running::Unknown,
    };
    let was_started = context.was_started;
    let cause = match known {
        Some((state, by)) if state != NmtState::Operational => SilenceCause::NotOperational { state, by, was_started },
        _ if observed.booted && !is_operational => SilenceCause::Restarted,
        _ if observed.wrong_length.is_some() || observed.shared.is_some() => frames_cause(node.id, observed),
        _ if answers == Some(false) && !observed.sends_tpdos => {
            SilenceCause::Unreachable { had_heartbeat: observed.heartbeat_stopped }
        }
        _ if observed.heartbeat_stopped && answers.is_none() => SilenceCause::HeartbeatStopped,
        _ => setup_cause(node, carries, observed, findings, context),
    };
    Silence { emergency: observed.emergency, running, ..Silence::of(cause) }
}

/// Returns why no values are decoded from the received TPDOs.
fn frames_cause(node: NodeId, observed: &ObservedFrames) -> SilenceCause {
    match (observed.shared, observed.wrong_length) {
        (Some((id, [(one, first), (other, second)])), _) if one == other => {
            SilenceCause::SameCobId(id, [first, second])
        }
        (_, Some((mapped, received))) => SilenceCause::WrongLength { mapped, received },
        (Some((id, senders)), None) => {
            let other = senders.iter().map(|&(sender, _)| sender).find(|&sender| sender != node);
            SilenceCause::SharedCobId(id, other.unwrap_or(node))
        }
        (None, None) => SilenceCause::NoTpdo,
    }
}

/// Returns why a node that may be operational sends no measurements, from the parameters of its TPDOs.
fn setup_cause(
    node: &Node,
    carries: &dyn Fn(&Tpdo) -> bool,
    observed: &ObservedFrames,
    findings: Option<&Findings>,
    context: &RequestContext,
) -> SilenceCause {
    let Some(first) = node.tpdos.first() else { return SilenceCause::NoTpdo };
    let valid: Vec<&Tpdo> = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).collect();
    if valid.is_empty() {
        return SilenceCause::Tpdo(first.number, TpdoCause::Disabled);
    }
    let candidates: Vec<&Tpdo> = valid.iter().copied().filter(|tpdo| carries(tpdo)).collect();
    let candidates = if candidates.is_empty() { valid } else { candidates };
    let empty = Findings::default();
    let known = findings.unwrap_or(&empty);
    let causes: Vec<(TpdoNumber, TpdoCause)> =
        candidates.iter().map(|tpdo| (tpdo.number, tpdo_cause(node, tpdo, observed, known, context))).collect();
    // If a due TPDO is not sent, the parameters of the other TPDOs are not the cause.
    let is_due = |cause: &TpdoCause| {
        matches!(
            cause,
            TpdoCause::Due(_)
                | TpdoCause::NotSentAtSync
                | TpdoCause::NotSentOnRequest
                | TpdoCause::SyncRejected
                | TpdoCause::SyncStart(_)
        )
    };
    let cause = causes.iter().find(|(_, cause)| is_due(cause)).or(causes.first());
    cause.map_or(SilenceCause::NoTpdo, |&(number, cause)| SilenceCause::Tpdo(number, cause))
}

/// Returns why a valid TPDO is not sent.
fn tpdo_cause(
    node: &Node,
    tpdo: &Tpdo,
    observed: &ObservedFrames,
    findings: &Findings,
    context: &RequestContext,
) -> TpdoCause {
    if tpdo.mapping.is_empty() {
        return TpdoCause::NothingMapped(findings.unsigned(tpdo.number.mapping(0)));
    }
    let (received, length) = observed.syncs;
    let seen = context.syncs_sent.unwrap_or(0) + received;
    let is_expected = node.sync_overflow.is_some();
    match tpdo.transmission {
        _ if context.requests => TpdoCause::NotSentOnRequest,
        None => TpdoCause::UnknownType,
        Some(Transmission::Rtr(code)) => TpdoCause::OnlyOnRequest(code),
        Some(Transmission::AcyclicSync | Transmission::Sync(_)) if seen == 0 && context.syncs_sent.is_none() => {
            TpdoCause::WaitsForSync(node.sync)
        }
        Some(Transmission::AcyclicSync | Transmission::Sync(_)) if received > 0 && is_expected != (length > 0) => {
            TpdoCause::SyncCounter { is_expected }
        }
        Some(Transmission::AcyclicSync | Transmission::Sync(_)) if observed.emergency == Some(SYNC_LENGTH) => {
            TpdoCause::SyncRejected
        }
        Some(Transmission::Sync(every)) if u64::from(every) > seen => TpdoCause::TooFewSyncs { every, seen },
        Some(Transmission::AcyclicSync) if seen == 0 => TpdoCause::TooFewSyncs { every: 1, seen },
        Some(Transmission::AcyclicSync) => channel_off(node, tpdo, findings).unwrap_or(TpdoCause::SteadyAtSync),
        Some(Transmission::Sync(_)) => channel_off(node, tpdo, findings)
            .or_else(|| sync_start(node, tpdo, findings))
            .unwrap_or(TpdoCause::NotSentAtSync),
        Some(Transmission::Manufacturer | Transmission::Profile | Transmission::Reserved(_)) => {
            event_cause(node, tpdo, findings, context.waited)
        }
    }
}

/// Returns why a TPDO with event timer or with transmission on change was not sent.
fn event_cause(node: &Node, tpdo: &Tpdo, findings: &Findings, waited: Duration) -> TpdoCause {
    let inhibit: Option<u16> = findings.unsigned(tpdo.number.communication(3));
    let inhibit = inhibit.filter(|&inhibit| Duration::from_micros(100) * u32::from(inhibit) >= waited);
    match node.event_timer(tpdo.transmission, tpdo.event_timer_ms) {
        Some(timer) if Duration::from_millis(timer.into()) >= waited => TpdoCause::SlowEventTimer(timer),
        Some(timer) => inhibit.map_or(TpdoCause::Due(timer), TpdoCause::InhibitTime),
        None => channel_off(node, tpdo, findings)
            .or_else(|| interrupts_disabled(node, tpdo, findings))
            .or_else(|| no_trigger(node, tpdo, findings))
            .or(inhibit.map(TpdoCause::InhibitTime))
            .unwrap_or(TpdoCause::SendsOnChange),
    }
}

/// Returns a cause if a TPDO starts at a SYNC counter that SYNC never has.
fn sync_start(node: &Node, tpdo: &Tpdo, findings: &Findings) -> Option<TpdoCause> {
    let start: u8 = findings.unsigned(tpdo.number.communication(6))?;
    (start > node.sync_overflow.unwrap_or(0)).then_some(TpdoCause::SyncStart(start))
}

/// Returns a cause if all channels of a TPDO are switched off.
fn channel_off(node: &Node, tpdo: &Tpdo, findings: &Findings) -> Option<TpdoCause> {
    let modes: Vec<ObjectId> =
        tpdo.mapping.iter().filter_map(|entry| inquiry::operating_mode(node, entry.object)).collect();
    let are_off = !modes.is_empty() && modes.iter().all(|&mode| findings.is_zero(mode) == Some(true));
    are_off.then(|| TpdoCause::ChannelOff(modes[0]))
}

fn interrupts_disabled(node: &Node, tpdo: &Tpdo, findings: &Findings) -> Option<TpdoCause> {
    let enable = tpdo.mapping.iter().find_map(|entry| inquiry::interrupt_enable(node, entry.object))?;
    (findings.is_zero(enable) == Some(true)).then_some(TpdoCause::InterruptsDisabled(enable))
}

/// Returns a cause if the deltas and limits of all values of a TPDO were read and are 0. A missing object triggers
/// nothing.
fn no_trigger(node: &Node, tpdo: &Tpdo, findings: &Findings) -> Option<TpdoCause> {
    let values: Vec<[ObjectId; 3]> =
        tpdo.mapping.iter().filter_map(|entry| inquiry::triggers(node, entry.object)).collect();
    let is_known = |object: &ObjectId| findings.is_zero(*object).is_some();
    let is_set = |object: &ObjectId| findings.is_zero(*object) == Some(false);
    let first = values.first()?;
    let all_zero = values.iter().all(|of_value| of_value.iter().any(is_known) && !of_value.iter().any(is_set));
    all_zero.then_some(TpdoCause::NoTrigger(first[0], first[2]))
}
