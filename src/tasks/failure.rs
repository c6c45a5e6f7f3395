//! Why a task failed: the node, the object, the cause, and the changes before the failure.
//!
//! These types contain no text. [`crate::output::failure`] converts them to a message and a hint.

pub use crate::bus::BusError;
pub use crate::master::{LssError, MissedAnswer, Operation, SdoError, SdoFailure, SecondAnswer};
pub use crate::measure::expression::ExpressionError;

use super::note::{Effect, Rule};
use super::{autozero, check, config, conform, detect, host, log, lss, nmt, pdo, read, scan, settings, store};
use crate::canopen::id::NodeId;
use crate::canopen::lss::Service;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::device::catalog::Model;
use crate::master::Error;
use crate::node::{self, Node};
use std::fmt;
use std::sync::Arc;

/// The kinds of failure that scripts can distinguish. Each kind has its own exit code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// A check failed, or a safety check stopped the command before it changed anything.
    CheckFailed,
    /// The arguments or a file are wrong; nothing was changed.
    Usage,
    /// A device did not answer in time.
    NoAnswer,
    /// A device rejected the request, or lacks the requested feature.
    Refused,
    /// The interface or the connection failed.
    Bus,
    /// An answer violates the protocol, or the device is not in the requested state.
    Unexpected,
    /// Of several nodes, some succeeded and some failed.
    Partial,
    /// A local file could not be opened, read or written.
    Io,
    /// Ctrl-C before a result.
    Interrupted,
}

/// Why a task failed.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The affected node; `None` for no node or several nodes.
    pub node: Option<NodeId>,
    /// The object that was read or written.
    pub object: Option<ObjectId>,
    /// The cause.
    pub cause: Cause,
    /// The changes before the failure, and the state left behind, in the order of time.
    pub effects: Vec<Effect>,
}

/// The cause of a failure. Each area of `tasks` has its own enum.
#[derive(Clone, Debug)]
pub enum Cause {
    /// The bus failed.
    Bus(Arc<BusError>),
    /// An SDO transfer failed.
    Sdo(Box<SdoError>),
    /// An LSS service failed.
    LssService(Arc<LssError>),
    /// Reading or writing a node failed.
    Node(Arc<node::Error>),
    /// A CAN interface of this computer could not be set.
    Host(host::HostFailure),
    /// The user stopped the command (Ctrl-C, SIGTERM, SIGHUP).
    Interrupted,
    /// An expression of `check` or `log --expect` is wrong.
    Expression(Box<ExpressionError>),
    /// No manual confirms the description with this name, and the user did not name it.
    Unconfirmed(String),
    /// Measured values could not be read.
    Read(read::ReadFailure),
    /// A scan did not find or identify nodes.
    Scan(scan::ScanFailure),
    /// An NMT state was not reached or not confirmed.
    Nmt(nmt::NmtFailure),
    /// Settings were not stored or restored.
    Store(store::StoreFailure),
    /// A TPDO could not be shown or changed.
    Pdo(pdo::PdoFailure),
    /// A setting could not be shown or changed.
    Settings(settings::SettingsFailure),
    /// Nothing was recorded, or a recording ended early.
    Log(log::LogFailure),
    /// Settings were not applied.
    Config(Box<config::ConfigFailure>),
    /// A check failed or had no data.
    Check(check::CheckFailure),
    /// A node-ID or a bit rate was not set.
    Lss(Box<lss::LssFailure>),
    /// The bit rate of a bus was not found.
    Detect(detect::DetectFailure),
    /// A channel was not set to zero.
    Autozero(autozero::AutozeroFailure),
    /// A device was not checked against the standard.
    Conform(conform::ConformFailure),
}

impl Cause {
    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        match self {
            Cause::Bus(error) => match **error {
                BusError::File { .. } | BusError::Recording { .. } => Kind::Io,
                _ => Kind::Bus,
            },
            Cause::Sdo(error) => match error.failure {
                SdoFailure::Refused(_) => Kind::Refused,
                SdoFailure::NoAnswer { .. } | SdoFailure::TimeLimit(_) => Kind::NoAnswer,
                SdoFailure::NotWritten(_) => Kind::CheckFailed,
                SdoFailure::Violation(..)
                | SdoFailure::WrongLength { .. }
                | SdoFailure::TwoDevices(_)
                | SdoFailure::NotANumber
                | SdoFailure::Ambiguous
                | SdoFailure::Fit(_)
                | SdoFailure::Disturbed => Kind::Unexpected,
                SdoFailure::Cancelled => Kind::Interrupted,
            },
            Cause::LssService(error) => lss_kind(error),
            Cause::Node(error) => node_kind(error),
            Cause::Host(cause) => cause.kind(),
            Cause::Interrupted => Kind::Interrupted,
            Cause::Expression(_) | Cause::Unconfirmed(_) => Kind::Usage,
            Cause::Read(cause) => cause.kind(),
            Cause::Scan(cause) => cause.kind(),
            Cause::Nmt(cause) => cause.kind(),
            Cause::Store(cause) => cause.kind(),
            Cause::Pdo(cause) => cause.kind(),
            Cause::Settings(cause) => cause.kind(),
            Cause::Log(cause) => cause.kind(),
            Cause::Check(cause) => cause.kind(),
            Cause::Config(cause) => cause.kind(),
            Cause::Lss(cause) => cause.kind(),
            Cause::Detect(cause) => cause.kind(),
            Cause::Autozero(cause) => cause.kind(),
            Cause::Conform(cause) => cause.kind(),
        }
    }

    /// Returns the abort code, if the device rejected an SDO request.
    pub fn abort(&self) -> Option<AbortCode> {
        match self {
            Cause::Sdo(error) => match error.failure {
                SdoFailure::Refused(code) => Some(code),
                _ => None,
            },
            Cause::Autozero(cause) => cause.abort(),
            Cause::Pdo(cause) => cause.abort(),
            Cause::Store(cause) => cause.abort(),
            _ => None,
        }
    }
}

fn node_kind(error: &node::Error) -> Kind {
    use node::Error as NodeError;
    match error {
        NodeError::Bus(_) => Kind::Bus,
        NodeError::Interrupted => Kind::Interrupted,
        NodeError::Sdo(_) | NodeError::Unknown(_) | NodeError::ReadBackDiffers { .. } | NodeError::Restarted(_) => {
            Kind::Unexpected
        }
        NodeError::Width { .. } | NodeError::Value { .. } | NodeError::TypeUnknown { .. } | NodeError::Name(_) => {
            Kind::Usage
        }
        NodeError::NoBootUp(_) => Kind::NoAnswer,
    }
}

/// Returns the kind of an LSS error.
pub(super) fn lss_kind(error: &LssError) -> Kind {
    match error {
        LssError::Master(Error::Bus(BusError::File { .. } | BusError::Recording { .. })) => Kind::Io,
        LssError::Master(Error::Bus(_)) => Kind::Bus,
        LssError::Master(Error::Interrupted) => Kind::Interrupted,
        LssError::Refused { .. } => Kind::Refused,
        LssError::NoAnswer { .. } => Kind::NoAnswer,
        LssError::Several { service, .. } if changes_slave(*service) => Kind::Unexpected,
        LssError::Several { .. } => Kind::CheckFailed,
        LssError::Master(Error::Sdo(_))
        | LssError::Violation { .. }
        | LssError::Disturbed(_)
        | LssError::Fastscan(_)
        | LssError::AddressMismatch { .. } => Kind::Unexpected,
    }
}

/// Whether the service changes every slave that answers it.
fn changes_slave(service: Service) -> bool {
    matches!(service, Service::ConfigureNodeId | Service::ConfigureBitTiming | Service::Store)
}

impl Failure {
    /// Creates a failure that does not belong to a single node.
    pub fn general(cause: impl Into<Cause>) -> Failure {
        Failure { node: None, object: None, cause: cause.into(), effects: Vec::new() }
    }

    /// Creates a failure of one node.
    pub fn at(node: NodeId, cause: impl Into<Cause>) -> Failure {
        Failure { node: Some(node), ..Failure::general(cause) }
    }

    /// Adds the object that was read or written.
    #[must_use]
    pub fn of_object(mut self, object: ObjectId) -> Failure {
        self.object = Some(object);
        self
    }

    /// Adds an effect on `node`.
    #[must_use]
    pub fn with(mut self, node: NodeId, effect: impl Into<Effect>) -> Failure {
        self.node.get_or_insert(node);
        self.effects.push(effect.into());
        self
    }

    /// Adds the violated rule of the description, if the device rejected the written number.
    #[must_use]
    pub fn explained(self, node: &Node, object: ObjectId, data: &[u8]) -> Failure {
        match self.abort().and_then(|_| Rule::broken(node, object, data)) {
            Some(rule) => self.with(node.id, Effect::Rule(Box::new(rule))),
            None => self,
        }
    }

    /// Returns the kind of the failure, which decides the exit code.
    pub fn kind(&self) -> Kind {
        self.cause.kind()
    }

    /// Returns the abort code, if the device rejected an SDO request.
    pub fn abort(&self) -> Option<AbortCode> {
        self.cause.abort()
    }
}

/// Rejects a change of a device by a description that no manual confirms, unless the user named the description.
pub fn check_confirmed(node: Option<NodeId>, model: Option<&Model>) -> Result<(), Failure> {
    let unconfirmed = model.map(|model| &model.description).filter(|description| description.unconfirmed);
    match unconfirmed {
        Some(description) => Err(Failure { node, ..Failure::general(Cause::Unconfirmed(description.name.clone())) }),
        None => Ok(()),
    }
}

/// Failures are equal if all their parts are equal. The debug form of the cause is compared, because errors of the
/// operating system have no comparison.
impl PartialEq for Failure {
    fn eq(&self, other: &Failure) -> bool {
        let same_place = (self.node, self.object) == (other.node, other.object);
        same_place && self.effects == other.effects && format!("{:?}", self.cause) == format!("{:?}", other.cause)
    }
}

/// The text for logs and tests. Users see the text of [`crate::output::failure`].
impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(node) = self.node {
            write!(f, "node {node}: ")?;
        }
        match &self.cause {
            Cause::Bus(error) => error.fmt(f),
            Cause::Sdo(error) => error.fmt(f),
            Cause::LssService(error) => error.fmt(f),
            cause => fmt::Debug::fmt(cause, f),
        }
    }
}

impl std::error::Error for Failure {}

/// Converts the cause of an area to a [`Cause`].
macro_rules! causes {
    ($($variant:ident($cause:ty);)+) => {
        $(impl From<$cause> for Cause {
            fn from(cause: $cause) -> Cause {
                Cause::$variant(cause.into())
            }
        })+
    };
}

causes! {
    Host(host::HostFailure);
    Read(read::ReadFailure);
    Scan(scan::ScanFailure);
    Nmt(nmt::NmtFailure);
    Store(store::StoreFailure);
    Pdo(pdo::PdoFailure);
    Settings(settings::SettingsFailure);
    Log(log::LogFailure);
    Check(check::CheckFailure);
    Lss(lss::LssFailure);
    Detect(detect::DetectFailure);
    Autozero(autozero::AutozeroFailure);
}

impl From<SdoError> for Failure {
    fn from(error: SdoError) -> Failure {
        Failure::at(error.node, Cause::Sdo(Box::new(error.clone()))).of_object(error.object)
    }
}

impl From<ExpressionError> for Failure {
    fn from(error: ExpressionError) -> Failure {
        Failure::general(Cause::Expression(Box::new(error)))
    }
}

impl From<BusError> for Failure {
    fn from(error: BusError) -> Failure {
        Failure::general(Cause::Bus(Arc::new(error)))
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        match error {
            Error::Bus(error) => error.into(),
            Error::Sdo(error) => error.into(),
            Error::Interrupted => Failure::general(Cause::Interrupted),
        }
    }
}

impl From<node::Error> for Failure {
    fn from(error: node::Error) -> Failure {
        use node::Error as NodeError;
        let (node, object) = match error {
            NodeError::Bus(error) => return error.into(),
            NodeError::Interrupted => return Error::Interrupted.into(),
            NodeError::Sdo(error) | NodeError::Unknown(error) => return error.into(),
            NodeError::ReadBackDiffers { node, object, .. }
            | NodeError::Width { node, object, .. }
            | NodeError::Value { node, object, .. }
            | NodeError::TypeUnknown { node, object } => (node, Some(object)),
            NodeError::Name(ref error) => (error.node, None),
            NodeError::Restarted(node) | NodeError::NoBootUp(node) => (node, None),
        };
        Failure { object, ..Failure::at(node, Cause::Node(Arc::new(error))) }
    }
}

impl From<LssError> for Failure {
    fn from(error: LssError) -> Failure {
        match error {
            LssError::Master(error) => error.into(),
            error => Failure::general(Cause::LssService(Arc::new(error))),
        }
    }
}
