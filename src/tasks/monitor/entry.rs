//! The messages that `monitor` shows.

use crate::bus::{Fault, Received, Stamp};
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::canopen::pdo::TpdoNumber;
use crate::canopen::sdo::{FitError, Note};
use crate::canopen::value::{DataType, Value};
use crate::measure::sample::{Sample, Source};
use crate::node::transfers::Transfer;

/// The kinds of frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FrameKind {
    /// NMT commands.
    Nmt,
    /// Heartbeats.
    Heartbeat,
    /// Boot-up messages.
    BootUp,
    /// Node guarding: requests and answers.
    Guarding,
    /// Emergency messages.
    Emergency,
    /// SDO transfers.
    Sdo,
    /// LSS requests and answers.
    Lss,
    /// SYNC.
    Sync,
    /// TIME.
    Time,
    /// PDOs and remote requests for them.
    Pdo,
    /// Error frames, changes of the interface, lost frames.
    Error,
    /// All other frames.
    Other,
}

impl FrameKind {
    /// All kinds.
    pub const ALL: [FrameKind; 12] = [
        FrameKind::Nmt,
        FrameKind::Heartbeat,
        FrameKind::BootUp,
        FrameKind::Guarding,
        FrameKind::Emergency,
        FrameKind::Sdo,
        FrameKind::Lss,
        FrameKind::Sync,
        FrameKind::Time,
        FrameKind::Pdo,
        FrameKind::Error,
        FrameKind::Other,
    ];

    /// Returns the word on the command line and in the output.
    pub fn as_str(self) -> &'static str {
        match self {
            FrameKind::Nmt => "nmt",
            FrameKind::Heartbeat => "heartbeat",
            FrameKind::BootUp => "boot-up",
            FrameKind::Guarding => "guarding",
            FrameKind::Emergency => "emcy",
            FrameKind::Sdo => "sdo",
            FrameKind::Lss => "lss",
            FrameKind::Sync => "sync",
            FrameKind::Time => "time",
            FrameKind::Pdo => "pdo",
            FrameKind::Error => "error",
            FrameKind::Other => "other",
        }
    }

    /// Whether a frame of this kind was sent by a master.
    pub(super) fn is_of_master(self, frame: &Frame) -> bool {
        match self {
            FrameKind::Nmt => true,
            FrameKind::Sdo => frame.id().sdo_request_node().is_some(),
            FrameKind::Lss => frame.id() == CanId::LSS_MASTER,
            FrameKind::Guarding => frame.is_remote(),
            _ => false,
        }
    }
}

/// One message: a frame, or the frames of one SDO transfer.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The time of the last frame.
    pub at: Stamp,
    /// The node; `None` for messages that do not belong to one node.
    pub node: Option<NodeId>,
    /// Its kind.
    pub kind: FrameKind,
    /// The COB-ID of the frame; `None` for an SDO transfer and for events that are not frames.
    pub id: Option<CanId>,
    /// The data of the frame.
    pub data: Vec<u8>,
    /// Whether it repeats an earlier message: a heartbeat with the same state.
    pub is_repeated: bool,
    /// The content.
    pub content: Content,
}

impl Entry {
    /// Creates the message of a frame.
    pub(super) fn of_frame(received: &Received, node: Option<NodeId>, kind: FrameKind, content: Content) -> Entry {
        let (id, data) = (Some(received.frame.id()), received.frame.data().to_vec());
        Entry { at: received.at, node, kind, id, data, is_repeated: false, content }
    }

    /// Creates the message of an event that is not a frame.
    pub(super) fn of_bus(at: Stamp, content: Content) -> Entry {
        Entry { at, node: None, kind: FrameKind::Error, id: None, data: Vec::new(), is_repeated: false, content }
    }
}

/// The content of a message.
#[derive(Clone, Debug, PartialEq)]
pub enum Content {
    /// An NMT command, for the node or for all nodes.
    Nmt(NmtCommand),
    /// A heartbeat.
    State(NmtState),
    /// A boot-up message.
    BootUp,
    /// A request of node guarding.
    GuardingRequest,
    /// An answer of node guarding: the state, and whether the toggle bit alternated as required.
    Guarded(NmtState, bool),
    /// An emergency, and its meaning on this device.
    Emergency(Emergency, String),
    /// An SDO transfer.
    Sdo(Box<SdoMessage>),
    /// Another master sent a request to this node before the answer to the last one.
    SecondMaster,
    /// An LSS request or answer.
    Lss(LssMessage),
    /// SYNC, with its counter.
    Sync(Option<u8>),
    /// TIME: the time of day.
    Time(Value),
    /// A TPDO, with its values.
    Tpdo(TpdoNumber, Vec<(Source, Sample)>),
    /// A TPDO whose length differs from its mapping. The number is the mapped length in bytes.
    WrongLength(TpdoNumber, usize),
    /// A PDO with an unknown mapping: its number by the predefined COB-ID, and whether nodes receive it (RPDO).
    Pdo(u8, bool),
    /// A remote request for a PDO.
    Request,
    /// A fault that the controller reports.
    Fault(Fault),
    /// The kernel dropped frames.
    Dropped(u32),
    /// The interface went up (`true`) or down.
    Link(bool),
    /// Any other frame. The number is the requested length of a remote frame.
    Raw(Option<u8>),
}

/// An SDO transfer with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct SdoMessage {
    /// The transfer.
    pub transfer: Transfer,
    /// The name of the object, if it is known.
    pub name: Option<String>,
    /// Its type, if it is known.
    pub data_type: Option<DataType>,
    /// The value, as `sdo read` shows it; bytes if the type is unknown or does not fit.
    pub value: Option<Value>,
    /// The bytes of the value.
    pub raw: Vec<u8>,
    /// A deviation from the standard.
    pub note: Option<Result<Note, FitError>>,
    /// The fixed unit of the number: `ms`, `100us`.
    pub unit: Option<String>,
    /// The meaning of the number: `bar` for 004E0000h.
    pub meaning: Option<String>,
    /// The measured value, if the object contains one.
    pub sample: Option<(Source, Sample)>,
}

/// An LSS message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LssMessage {
    /// A request of a master.
    Request(lss::Request),
    /// An answer to the last request.
    Answer(lss::Service, lss::Answer),
}
