//! Observations that a recording reports besides its rows and counts.

use crate::bus::ReceiveBuffer;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtCommand;
use crate::canopen::pdo::TpdoNumber;
use crate::master::{SdoError, SecondAnswer};
use crate::measure::expression::bind::LimitWithoutUnit;
use crate::measure::layout::NarrowValue;
use crate::measure::sample::Doubt;
use crate::tasks::Failure;
use crate::tasks::diagnosis::Silence;
use std::time::Duration;

/// An observation about a recording.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// The node has none of the requested signals.
    NoRequestedSignal(NodeId),
    /// Two TPDOs, of one node or of two nodes, have this COB-ID. They are ignored.
    SharedCobId(CanId, [(NodeId, TpdoNumber); 2]),
    /// A valid TPDO is not decoded. The number is 1Axxh:0: FEh and FFh mean multiplexed PDOs; `None` if the mapping
    /// could not be read.
    NotDecoded(NodeId, TpdoNumber, Option<u8>),
    /// TPDOs of the node with this COB-ID were ignored, because their mapping is unknown.
    UnknownMapping(NodeId, CanId),
    /// The values were sent on remote request, so it is not proven that each value is new.
    FreshnessNotProven,
    /// A TPDO of the node arrives twice at a SYNC, with the same values.
    RepeatedTpdo(NodeId, TpdoNumber),
    /// A TPDO of the node arrives twice at a SYNC, with different values. It is ignored.
    TwoSenders(NodeId, TpdoNumber),
    /// The node sent two answers to one request of another master.
    SecondAnswer(NodeId, SecondAnswer),
    /// A value could not be polled.
    PollFailed(SdoError),
    /// The setup of the node changed while frames were lost. Rows within this time before the detection may be wrong.
    ChangedWhileFramesLost(NodeId, Duration),
    /// The node could not be read again. Its later frames were ignored.
    NotReadAgain(NodeId),
    /// These nodes were started. Their previous state is unknown, so they stay operational.
    LeftOperational(Vec<NodeId>),
    /// These nodes are not sensors, and were not started.
    NotStarted(Vec<NodeId>),
    /// These nodes were not started, because another NMT master sent this command, to this node (`None`: all nodes).
    OtherNmtMaster(Vec<NodeId>, NmtCommand, Option<NodeId>),
    /// The node was operational, but its last heartbeat shows another state.
    NotOperational(NodeId, Box<Silence>),
    /// The previous NMT states of the nodes were not restored.
    StatesNotRestored(Box<Failure>),
    /// This many SYNC messages were omitted while the interface was down.
    SyncsOmittedWhileDown(u64),
    /// This many SYNC messages were omitted because the program was stopped or too slow.
    SyncsOmittedTooSlow(u64),
    /// Frames were dropped, and the kernel did not allow a larger receive buffer.
    SmallReceiveBuffer(ReceiveBuffer),
    /// A value of this signal is missing or may be wrong.
    Doubt(NodeId, String, Doubt),
    /// A limit of an expression has no unit.
    LimitWithoutUnit(LimitWithoutUnit),
    /// The values of a signal may be clipped.
    MayClip(NodeId, NarrowValue),
    /// The node, or only this signal, sent no measurements for this reason.
    NoMeasurements(NodeId, Option<String>, Box<Silence>),
}
