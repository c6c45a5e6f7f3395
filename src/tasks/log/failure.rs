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
    /// No node has a signal with this name. The nodes have the known ones.
    UnknownSignal {
        /// The signal or object.
        name: String,
        /// The signals of the nodes.
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
        /// A TPDO that contains it and is disabled.
        disabled: Option<(NodeId, TpdoNumber)>,
    },
    /// The nodes have different COB-IDs of SYNC (1005h).
    DifferentSyncIds(Vec<(NodeId, CanId)>),
    /// The nodes have different overflow values of the SYNC counter (1019h); 0 if the node expects no counter.
    DifferentSyncCounters(Vec<(NodeId, u8)>),
    /// Another node sends SYNC.
    SecondSyncProducer,
    /// Two devices send this TPDO of the node.
    TwoSenders(TpdoNumber),
    /// The node sends TPDOs whose mapping is unknown.
    UnknownMapping,
    /// A passive recording received no TPDO of these nodes.
    NothingReceived {
        /// How long it waited.
        within: Duration,
        /// The nodes, each with the state that its last heartbeat showed.
        nodes: Vec<(NodeId, Option<NmtState>)>,
        /// Whether any frame was received.
        has_traffic: bool,
        /// The interface; `None` for a recording that is replayed.
        interface: Option<String>,
    },
    /// The nodes sent no measurements, for these reasons.
    NoMeasurements {
        /// How long it waited.
        within: Duration,
        /// The nodes.
        nodes: Vec<(NodeId, Silence)>,
    },
    /// These nodes stopped before the end. With `all`, no node was left.
    NodesLost {
        /// The nodes.
        nodes: Vec<NodeId>,
        /// Whether no other node is left.
        all: bool,
    },
    /// The file to be continued has other columns.
    OtherColumns {
        /// The name of the file.
        file: String,
        /// Its first line.
        found: String,
        /// The columns of the new rows.
        expected: String,
    },
    /// The reader closed the output before the planned end. This many rows were written.
    OutputClosed {
        /// Number of rows.
        rows: u64,
    },
    /// Ctrl-C before the planned end. This many rows were written.
    EndedEarly {
        /// Number of rows.
        rows: u64,
    },
    /// The output could not keep up: this many rows were lost.
    RowsLost {
        /// Number of rows.
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
    /// The output of the events could not keep up.
    EventsLost {
        /// The name of the file or stream.
        output: String,
    },
}

impl LogFailure {
    /// The kind, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            LogFailure::UnknownSignal { .. }
            | LogFailure::NoStatus { .. }
            | LogFailure::UnknownMapping
            | LogFailure::OtherColumns { .. } => Kind::Usage,
            LogFailure::NotMapped { .. } | LogFailure::TwoSenders(_) => Kind::Unexpected,
            LogFailure::NoRtr { .. } => Kind::Refused,
            LogFailure::DifferentSyncIds(_) | LogFailure::DifferentSyncCounters(_) | LogFailure::SecondSyncProducer => {
                Kind::CheckFailed
            }
            LogFailure::NothingReceived { .. }
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
