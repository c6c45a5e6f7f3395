//! Causes of failures: nothing was recorded, or a recording ended early.

use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtState;
use crate::canopen::pdo::TpdoNumber;
use crate::tasks::Kind;
use crate::tasks::diagnosis::Silence;
use std::time::Duration;

/// Nothing was recorded, or a recording ended early.
#[derive(Clone, Debug, PartialEq)]
pub enum LogFailure {
    /// No node has a signal with this name.
    UnknownSignal {
        /// The signal or object.
        name: String,
        /// The existing signals of the nodes.
        known: Vec<String>,
    },
    /// No node has a status object for this signal.
    NoStatus {
        /// The signal.
        signal: String,
    },
    /// No TPDO contains this signal or object.
    NotMapped {
        /// The signal or object.
        name: String,
        /// A disabled TPDO that contains it.
        disabled: Option<(NodeId, TpdoNumber)>,
    },
    /// A passive recording knows no TPDO mapping with this signal or object.
    NotOverheard {
        /// The signal or object.
        name: String,
        /// The signals in the known mappings.
        known: Vec<String>,
    },
    /// The nodes have different COB-IDs of SYNC (1005h).
    DifferentSyncIds(Vec<(NodeId, CanId)>),
    /// The nodes have different overflow values of the SYNC counter (1019h); 0 if the node expects no counter.
    DifferentSyncCounters(Vec<(NodeId, u8)>),
    /// Another node sends SYNC.
    SecondSyncProducer,
    /// Two devices send this TPDO of the node.
    TwoSenders(TpdoNumber),
    /// Another device has replaced the node.
    Replaced,
    /// The node sends TPDOs whose mapping is unknown.
    UnknownMapping,
    /// A passive recording received only TPDOs of a wrong length from the node.
    OtherLength {
        /// The mapped length in bytes.
        mapped: usize,
        /// The received length in bytes.
        received: usize,
        /// `false` for a recording that is replayed.
        is_live: bool,
    },
    /// A passive recording received no TPDO of these nodes, or none with the requested signals.
    NothingReceived {
        /// Whether only some signals were requested.
        has_request: bool,
        /// The waiting time.
        within: Duration,
        /// The nodes, each with the state in its last heartbeat.
        nodes: Vec<(NodeId, Option<NmtState>)>,
        /// Whether any frame was received.
        has_traffic: bool,
        /// The interface; `None` for a recording that is replayed.
        interface: Option<String>,
    },
    /// The nodes sent no measurements, for the reasons given.
    NoMeasurements {
        /// The waiting time.
        within: Duration,
        /// The nodes.
        nodes: Vec<(NodeId, Silence)>,
    },
    /// These nodes stopped before the end.
    NodesLost {
        /// The nodes.
        nodes: Vec<NodeId>,
        /// Whether no other node was left.
        all: bool,
    },
    /// The existing file has other columns.
    OtherColumns {
        /// The name of the file.
        file: String,
        /// The first line of the file.
        found: String,
        /// The columns of the new rows.
        expected: String,
    },
    /// The reader closed the output before the planned end.
    OutputClosed {
        /// The number of rows.
        rows: u64,
    },
    /// Ctrl-C before the planned end.
    EndedEarly {
        /// The number of rows.
        rows: u64,
    },
    /// Rows were lost because the output was too slow.
    RowsLost {
        /// The number of rows.
        rows: u64,
        /// The name of the file or stream.
        output: String,
    },
    /// The TPDO does not answer remote requests (bit 30 of its COB-ID).
    NoRtr {
        /// The TPDO.
        number: TpdoNumber,
    },
    /// Another program deleted the file while it was written.
    FileDeleted {
        /// The name of the file.
        file: String,
    },
    /// Events were lost because the output was too slow.
    EventsLost {
        /// The name of the file or stream.
        output: String,
    },
}

impl LogFailure {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            LogFailure::UnknownSignal { .. }
            | LogFailure::NoStatus { .. }
            | LogFailure::UnknownMapping
            | LogFailure::OtherColumns { .. } => Kind::Usage,
            LogFailure::NotMapped { .. } | LogFailure::TwoSenders(_) | LogFailure::Replaced => Kind::Unexpected,
            LogFailure::NoRtr { .. } => Kind::Refused,
            LogFailure::DifferentSyncIds(_) | LogFailure::DifferentSyncCounters(_) | LogFailure::SecondSyncProducer => {
                Kind::CheckFailed
            }
            LogFailure::NothingReceived { .. }
            | LogFailure::NotOverheard { .. }
            | LogFailure::OtherLength { .. }
            | LogFailure::NoMeasurements { .. }
            | LogFailure::NodesLost { all: true, .. } => Kind::NoAnswer,
            LogFailure::NodesLost { all: false, .. } => Kind::Partial,
            LogFailure::OutputClosed { .. }
            | LogFailure::RowsLost { .. }
            | LogFailure::EventsLost { .. }
            | LogFailure::FileDeleted { .. } => Kind::Io,
            LogFailure::EndedEarly { .. } => Kind::Interrupted,
        }
    }
}
