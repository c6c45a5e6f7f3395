//! Errors in the communication with a node, as types. The texts are in `output`.

use crate::bus::BusError;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value, ValueError};
use crate::master::{Error as MasterError, SdoError};

/// Why an operation on a node failed.
#[derive(Debug)]
pub enum Error {
    /// The bus fails.
    Bus(BusError),
    /// The user pressed Ctrl-C.
    Interrupted,
    /// The node did not carry out a transfer: it rejected it, did not answer or violated the protocol.
    ///
    /// If it was a write, the object is known to be unchanged.
    Sdo(SdoError),
    /// A write was sent but not acknowledged, and it is unknown whether the node executed the write.
    Unknown(SdoError),
    /// An object was written, but has a different value when read back.
    ReadBackDiffers {
        /// The node.
        node: NodeId,
        /// The object.
        object: ObjectId,
        /// The value that was written.
        written: Value,
        /// The value that was read back.
        found: Value,
    },
    /// The value is narrower than the object, and the node accepts only writes without a size. The node would then fill
    /// up the missing bytes.
    Width {
        /// The node.
        node: NodeId,
        /// The object.
        object: ObjectId,
        /// The bytes of the object.
        width: usize,
        /// The bytes of the value.
        given: usize,
    },
    /// A value does not fit the type of its object.
    Value {
        /// The node.
        node: NodeId,
        /// The object.
        object: ObjectId,
        /// The reason.
        error: ValueError,
    },
    /// The type of an object is unknown.
    TypeUnknown {
        /// The node.
        node: NodeId,
        /// The object.
        object: ObjectId,
    },
    /// No object has this name.
    Name(NameError),
    /// The node restarted in the middle of a change.
    Restarted(NodeId),
    /// No boot-up message was received after a reset.
    NoBootUp(NodeId),
}

/// A name that belongs to no object.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct NameError {
    /// The node.
    pub node: NodeId,
    /// The name.
    pub name: String,
    /// The title of the device description; `None` if only the names of the standard are known.
    pub title: Option<String>,
    /// Whether several objects have this name in the EDS.
    pub is_shared: bool,
    /// The full names of the objects that share the name; else at most three similar names, the nearest first.
    pub nearest: Vec<String>,
}

impl Error {
    /// Whether the bus failed or the user pressed Ctrl-C. Nothing else can then be tried.
    pub fn is_fatal(&self) -> bool {
        matches!(self, Error::Bus(_) | Error::Interrupted)
    }
}

impl From<BusError> for Error {
    fn from(error: BusError) -> Error {
        Error::Bus(error)
    }
}

impl From<SdoError> for Error {
    fn from(error: SdoError) -> Error {
        Error::Sdo(error)
    }
}

impl From<MasterError> for Error {
    fn from(error: MasterError) -> Error {
        match error {
            MasterError::Bus(error) => Error::Bus(error),
            MasterError::Sdo(error) => Error::Sdo(error),
            MasterError::Interrupted => Error::Interrupted,
        }
    }
}

/// Decodes data as a value of this type. Returns the bytes if they do not fit the type.
pub(super) fn shown(data: &[u8], data_type: DataType) -> Value {
    data_type.decode(data).unwrap_or_else(|_| Value::Bytes(data.to_vec()))
}
