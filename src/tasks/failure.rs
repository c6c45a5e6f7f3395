//! Why a task did not do what was asked: the cause, whom it concerns, and what to try next.

use crate::bus::BusError;
use crate::canopen::id::NodeId;
use crate::canopen::lss::Service;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::master::{Error, LssError, SdoError, SdoFailure};
use crate::measure::expression::ExpressionError;
use crate::node;
use std::fmt;

/// The kinds of failure that scripts tell apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Kind {
    /// The answer is no, or a safety check stopped the command before anything was changed.
    CheckFailed,
    /// Wrong arguments or files; nothing was sent.
    Usage,
    /// A device did not answer in time.
    NoAnswer,
    /// A device said no.
    Refused,
    /// The interface or the connection fails.
    Bus,
    /// An answer that breaks the protocol, or a device that is not in the state asked for.
    Unexpected,
    /// Some nodes succeeded and some failed.
    Partial,
    /// A local file fails.
    Io,
    /// Ctrl-C before there was a result.
    Interrupted,
}

/// Why something was not done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Which kind.
    pub kind: Kind,
    /// What happened, in one line, with node and object in front.
    pub message: String,
    /// Whom it concerns.
    pub node: Option<NodeId>,
    /// Which object was asked for.
    pub object: Option<ObjectId>,
    /// The device's own reason.
    pub abort: Option<AbortCode>,
    /// What to type next.
    pub hint: Option<String>,
    /// The place in what was typed.
    pub place: Option<Place>,
}

/// A character of something that was typed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// What was typed.
    pub text: String,
    /// The characters before it.
    pub before: String,
}

impl Place {
    /// The character, counted from 1.
    pub fn column(&self) -> usize {
        self.before.chars().count() + 1
    }
}

impl Failure {
    /// A failure that concerns no node in particular.
    pub fn new(kind: Kind, message: impl Into<String>) -> Failure {
        Failure { kind, message: message.into(), node: None, object: None, abort: None, hint: None, place: None }
    }

    /// A failure of one node.
    pub fn of_node(kind: Kind, node: NodeId, message: impl fmt::Display) -> Failure {
        Failure { node: Some(node), ..Failure::new(kind, format!("node {node}: {message}")) }
    }

    /// The same, with what is known of `node` all the same: what was changed before, or may have been.
    pub fn knowing(mut self, node: NodeId, known: impl fmt::Display) -> Failure {
        self.message = match self.node {
            Some(_) => format!("{}; {known}", self.message),
            None => format!("node {node}: {}; {known}", self.message),
        };
        self.node = Some(node);
        self
    }

    /// The same with a hint.
    pub fn hint(mut self, hint: impl Into<String>) -> Failure {
        self.hint = Some(hint.into());
        self
    }
}

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for Failure {}

impl From<SdoError> for Failure {
    fn from(error: SdoError) -> Failure {
        let (kind, abort, hint) = match error.failure {
            SdoFailure::Refused(code) => (Kind::Refused, Some(code), None),
            SdoFailure::NoAnswer { begun: false, .. } => {
                (Kind::NoAnswer, None, Some("who is there: cangauge scan".to_owned()))
            }
            SdoFailure::NoAnswer { begun: true, .. } => (Kind::NoAnswer, None, None),
            SdoFailure::Violation(..) | SdoFailure::NotANumber | SdoFailure::Ambiguous => {
                (Kind::Unexpected, None, None)
            }
            SdoFailure::Fit(_) => {
                let hint = format!("its bytes: cangauge sdo read {} {} --type hex", error.node, error.object);
                (Kind::Unexpected, None, Some(hint))
            }
            SdoFailure::Disturbed => {
                (Kind::Unexpected, None, Some("stop the other program for a moment, or try again".to_owned()))
            }
            SdoFailure::Cancelled => (Kind::Interrupted, None, None),
        };
        let object = Some(error.object);
        Failure { object, abort, hint, ..Failure::of_node(kind, error.node, &error) }
    }
}

impl From<ExpressionError> for Failure {
    fn from(error: ExpressionError) -> Failure {
        let place = Place { before: error.before().to_owned(), text: error.text };
        Failure { hint: error.hint, place: Some(place), ..Failure::new(Kind::Usage, error.message) }
    }
}

impl From<BusError> for Failure {
    fn from(error: BusError) -> Failure {
        let kind = match &error {
            BusError::File { .. } => Kind::Io,
            _ => Kind::Bus,
        };
        let hint = match &error {
            BusError::QueueFull => Some(
                "nobody acknowledges: check the sensor's power, the bit rate, the wiring and the 120 ohm terminators; \
                 or somebody fills the bus: candump shows who"
                    .to_owned(),
            ),
            BusError::Down(name) => {
                Some(format!("bring it up: sudo ip link set {name} up type can bitrate 250000 (the sensors' bit rate)"))
            }
            BusError::NoInterface(_) | BusError::NotCan(_) => {
                Some("see what is there: cangauge bus list; without hardware: --bus sim".to_owned())
            }
            BusError::ReceiveOnly(_) => Some("what listens only can do it: log, scan --passive, nmt watch".to_owned()),
            BusError::Unsupported(_) => Some("without it: --bus sim".to_owned()),
            _ => None,
        };
        Failure { hint, ..Failure::new(kind, error.to_string()) }
    }
}

impl From<Error> for Failure {
    fn from(error: Error) -> Failure {
        match error {
            Error::Bus(error) => error.into(),
            Error::Sdo(error) => error.into(),
            Error::Interrupted => Failure::new(Kind::Interrupted, "interrupted"),
        }
    }
}

impl From<node::Error> for Failure {
    fn from(error: node::Error) -> Failure {
        let of_object = |kind, node, object: ObjectId, message: String| Failure {
            object: Some(object),
            ..Failure::of_node(kind, node, message)
        };
        match error {
            node::Error::Bus(error) => error.into(),
            node::Error::Interrupted => Error::Interrupted.into(),
            node::Error::Sdo(error) | node::Error::Unknown(error) => error.into(),
            node::Error::NotKept { node, object, found, .. } => {
                of_object(Kind::Unexpected, node, object, format!("{object} was acknowledged and reads {found}"))
            }
            node::Error::Width { node, object, width, given } => {
                let message = format!(
                    "write {object}: the object has {width} bytes, the value {given}, and the device accepts no size"
                );
                of_object(Kind::Usage, node, object, message)
            }
            node::Error::Value { node, object, error } => {
                of_object(Kind::Usage, node, object, format!("write {object}: {error}"))
            }
            node::Error::TypeUnknown { node, object } => {
                of_object(Kind::Usage, node, object, format!("write {object}: its type is unknown"))
                    .hint(format!("state it: cangauge sdo write {node} {object} VALUE --type u32 (or i16, r32, vs)"))
            }
            node::Error::Name(error) => {
                let source = error.title.unwrap_or_else(|| "the standard".to_owned());
                let message = format!("{source} has no object \"{}\"", error.name);
                let failure = Failure::of_node(Kind::Usage, error.node, message);
                if error.nearest.is_empty() {
                    failure
                } else {
                    failure.hint(format!("nearest: {}", error.nearest.join(", ")))
                }
            }
            node::Error::Restarted(node) => Failure::of_node(Kind::Unexpected, node, "it has restarted"),
            node::Error::NoBootUp(node) => Failure::of_node(Kind::NoAnswer, node, "no boot-up came after the reset"),
        }
    }
}

impl From<LssError> for Failure {
    fn from(error: LssError) -> Failure {
        const BY_NAME: &str = "name the one you mean, by its node-ID or as VENDOR:PRODUCT:REVISION:SERIAL, or connect \
                               it alone";
        let message = error.to_string();
        let (kind, hint) = match error {
            LssError::Master(error) => return error.into(),
            LssError::Refused { service, .. } => (Kind::Refused, refusal_hint(service)),
            LssError::NoAnswer { service, .. } => (Kind::NoAnswer, silence_hint(service)),
            LssError::Several { service, .. } if changes(service) => (Kind::Unexpected, Some(BY_NAME)),
            LssError::Several { .. } => (Kind::CheckFailed, Some(BY_NAME)),
            LssError::Violation { .. } => (Kind::Unexpected, None),
            LssError::Disturbed(_) => (Kind::Unexpected, Some("stop the other program, or try again")),
            LssError::Fastscan(_) | LssError::Mistaken { .. } => {
                (Kind::Unexpected, Some("connect one device without a node-ID after the other"))
            }
        };
        Failure { hint: hint.map(str::to_owned), ..Failure::new(kind, message) }
    }
}

/// Whether more than one slave that answers means that more than one has been changed.
fn changes(service: Service) -> bool {
    matches!(service, Service::ConfigureNodeId | Service::ConfigureBitTiming | Service::Store)
}

fn refusal_hint(service: Service) -> Option<&'static str> {
    match service {
        Service::ConfigureBitTiming => Some("the device's own table of bit rates is in its manual: --table-index N"),
        Service::Store => Some("some devices store it through objects: --via sdo"),
        _ => None,
    }
}

fn silence_hint(service: Service) -> Option<&'static str> {
    match service {
        Service::SwitchSelective => Some(
            "no slave has this address, or it knows no LSS in its present state: see who is there with \
             cangauge lss scan, or stop it first: cangauge nmt stop NODE",
        ),
        Service::Store => Some("whether it stored is not known: read it again after power off and on"),
        Service::Inquire(_) | Service::InquireNodeId => {
            Some("not every device knows this service; its identity by SDO: cangauge scan")
        }
        _ => None,
    }
}

/// What several nodes end with together: nothing if all succeeded, the common kind if all failed alike,
/// `partial` if some succeeded, else `unexpected` (several that failed each in its own way).
pub fn together(asked: usize, failures: Vec<Failure>) -> Result<(), Vec<Failure>> {
    if failures.is_empty() { Ok(()) } else { Err(combine(asked, failures)) }
}

fn combine(asked: usize, mut failures: Vec<Failure>) -> Vec<Failure> {
    let kinds: Vec<Kind> = failures.iter().map(|failure| failure.kind).collect();
    let common = if failures.len() < asked {
        Kind::Partial
    } else if kinds.windows(2).all(|pair| pair[0] == pair[1]) {
        kinds[0]
    } else {
        Kind::Unexpected
    };
    for failure in &mut failures {
        failure.kind = common;
    }
    failures
}

#[cfg(test)]
mod tests {
    use super::*;

    fn failure(kind: Kind) -> Failure {
        Failure::new(kind, "")
    }

    #[test]
    fn several_nodes_together() {
        let kinds = |asked, kinds: &[Kind]| {
            together(asked, kinds.iter().map(|&kind| failure(kind)).collect()).map_err(|failures| failures[0].kind)
        };
        assert_eq!(kinds(2, &[]), Ok(()));
        assert_eq!(kinds(2, &[Kind::NoAnswer]), Err(Kind::Partial));
        assert_eq!(kinds(2, &[Kind::NoAnswer, Kind::NoAnswer]), Err(Kind::NoAnswer));
        assert_eq!(kinds(2, &[Kind::NoAnswer, Kind::Refused]), Err(Kind::Unexpected));
        assert_eq!(kinds(1, &[Kind::Refused]), Err(Kind::Refused));
    }
}
