//! What a recording reports besides its rows and counts.

use crate::bus::ReceiveBuffer;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtState;
use crate::canopen::pdo::TpdoNumber;
use crate::master::SdoError;
use crate::measure::layout::NarrowValue;
use crate::measure::sample::Doubt;
use crate::tasks::Failure;
use std::time::Duration;

/// Something to know about a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// The node has none of the requested signals.
    NoRequestedSignal(NodeId),
    /// Both nodes send TPDOs with this COB-ID: they make no rows.
    SharedCobId(CanId, [NodeId; 2]),
    /// A value could not be polled.
    PollFailed(SdoError),
    /// The node's setup changed while frames were lost: its rows of this time before may be wrong.
    ChangedWhileFramesLost(NodeId, Duration),
    /// The node could not be read again: its later frames made no rows.
    NotReadAgain(NodeId),
    /// These nodes were started. Their previous state is unknown, so they stay operational.
    LeftOperational(Vec<NodeId>),
    /// The nodes were not returned to their previous NMT states.
    StatesNotRestored(Box<Failure>),
    /// This many SYNC messages were omitted while the interface was down.
    SyncsOmittedWhileDown(u64),
    /// This many SYNC messages were omitted because the program was stopped or too slow.
    SyncsOmittedTooSlow(u64),
    /// Frames were dropped, and the kernel did not allow a larger receive buffer.
    SmallReceiveBuffer(ReceiveBuffer),
    /// A value of this signal is missing or may be wrong.
    Doubt(NodeId, String, Doubt),
    /// The values of a signal may be clipped.
    MayClip(NodeId, NarrowValue),
    /// The node sent no measurements, for this reason.
    NoMeasurements(NodeId, SilenceReason),
}

/// Why a node sends no measurements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SilenceReason {
    /// It does not answer SDO requests.
    NoAnswer,
    /// Its last heartbeat shows this state. Whether this recording had started it, and the code of its last emergency.
    NotOperational {
        /// The state.
        state: NmtState,
        /// Whether this recording had started it.
        was_started: bool,
        /// The error code of its last emergency.
        emergency: Option<u16>,
    },
    /// It has no TPDO.
    NoTpdo,
    /// Bit 31 of the COB-ID is set in all its TPDOs; this is the first one.
    AllTpdosDisabled(TpdoNumber),
    /// No object is mapped into its TPDOs, or they are multiplexed PDOs; this is the first one.
    NothingMapped(TpdoNumber),
    /// This TPDO is sent on remote request only (transmission type 252 or 253).
    OnlyOnRequest(TpdoNumber),
    /// This TPDO is sent at a SYNC after a change only, and its value is steady.
    SteadyAtSync(TpdoNumber),
    /// This TPDO is sent at every n-th SYNC (the first number), and fewer were sent (the second one).
    TooFewSyncs(TpdoNumber, u8, u64),
    /// This TPDO is sent at SYNC. SYNC was sent, and no TPDO was received.
    NotSentAtSync(TpdoNumber),
    /// The event timer of this TPDO, in milliseconds, is longer than the recording.
    SlowEventTimer(TpdoNumber, u16),
    /// This TPDO waits for SYNC, and no node sends SYNC.
    WaitsForSync(TpdoNumber),
    /// This TPDO has no event timer, and its value does not change enough.
    NoEventTimer(TpdoNumber),
    /// Its TPDOs have another length than their mapping.
    WrongLength {
        /// The length of the mapping in bytes.
        mapped: usize,
        /// The length of the received TPDOs in bytes.
        received: usize,
    },
    /// Its TPDOs are set up to be sent.
    Unknown,
}
