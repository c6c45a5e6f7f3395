//! From what the user typed to one device: who it is, where it is, and how it is reached.

use super::only::{known_service, only};
use super::presence::{Presence, only_one, presence};
use super::session::{Reach, configured};
use super::{Note, Target, Tell, Via};
use crate::bus::Filters;
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::device::assign::AssignKind;
use crate::device::catalog::{self, Model};
use crate::master::Master;
use crate::node::Overrides;
use crate::node::survey::identify;
use crate::tasks::scan::{Found, scan};
use crate::tasks::{Failure, Kind};
use std::fmt;
use std::sync::Arc;
use std::time::Duration;

/// How long after the last question of an SDO scan an answer is waited for.
const SCAN: Duration = Duration::from_millis(200);

/// The device that is meant.
#[derive(Clone, Debug)]
pub(super) struct Subject {
    /// Its identity, where it is known.
    pub address: Option<LssAddress>,
    /// Its node-ID at the moment; `None` where it has none, or nothing tells it.
    pub node: Option<NodeId>,
    /// It is known to have no node-ID.
    pub unconfigured: bool,
    /// Whether what is sent to its node-ID reaches it and nobody else.
    pub alone: bool,
    /// Its description, where one is known.
    pub model: Option<Arc<Model>>,
    /// How LSS reaches it.
    pub reach: Reach,
}

impl Subject {
    /// What it is called: `node 5`, `0x47:0x1:0x10007:10001`.
    pub(super) fn name(&self) -> String {
        match (self.node, self.address) {
            (Some(node), _) => format!("node {node}"),
            (None, Some(address)) => address.to_string(),
            (None, None) => "the device".to_owned(),
        }
    }

    /// What it is, for people: `node 127 is Honeywell DPS, serial 20002`.
    pub(super) fn title(&self) -> String {
        match (&self.model, self.address) {
            (Some(model), Some(address)) => format!("{}, serial {}", model.description.title, address.serial),
            (Some(model), None) => model.description.title.clone(),
            (None, Some(address)) => address.to_string(),
            (None, None) => "a device that tells nothing of itself".to_owned(),
        }
    }

    /// How to name it in the next command: its node-ID, else its identity.
    pub(super) fn argument(&self) -> String {
        match (self.node.filter(|_| self.alone), self.address) {
            (Some(node), _) => node.to_string(),
            (None, Some(address)) => address.to_string(),
            (None, None) => "only".to_owned(),
        }
    }

    /// Whether it is LSS by which it takes its node-ID.
    fn uses_lss(&self, via: Via) -> bool {
        let way = self.model.as_ref().and_then(|model| model.description.preferred_assign());
        match via {
            Via::Auto => way.is_none_or(|way| way.way == AssignKind::Lss),
            Via::Lss => true,
            Via::Sdo => false,
        }
    }

    /// A failure of this device.
    pub(super) fn failure(&self, kind: Kind, message: impl fmt::Display) -> Failure {
        Failure { node: self.node, ..Failure::new(kind, format!("{}: {message}", self.name())) }
    }
}

/// What the user says of descriptions.
#[derive(Clone, Copy, Debug)]
pub(super) struct Knowledge<'a> {
    /// By node-ID.
    pub overrides: &'a Overrides,
    /// Of whichever device is meant.
    pub given: Option<&'a Arc<Model>>,
}

impl Knowledge<'_> {
    /// The description of a device: as the user says, by what it answers by SDO, or by its identity alone.
    ///
    /// # Errors
    /// What stops everything.
    pub(super) fn model(&self, master: &mut Master<'_>, subject: &Subject) -> Result<Option<Arc<Model>>, Failure> {
        if let Some(given) = self.given {
            return Ok(Some(Arc::clone(given)));
        }
        let by_identity = subject.address.and_then(|address| catalog::by_identity(address.vendor, address.product));
        match subject.node.filter(|_| subject.alone) {
            Some(node) => {
                let found = identify(master, &[node], self.overrides)?.pop();
                Ok(found.and_then(|instrument| instrument.model).or(by_identity))
            }
            None => Ok(by_identity),
        }
    }
}

/// Finds the device that is meant. Nothing is changed by it, and configuration state is left again. `force` is for
/// [`Target::Only`].
///
/// # Errors
/// Nobody there, more than one device, none that can be told from another.
pub(super) fn subject(
    master: &mut Master<'_>,
    target: &Target,
    knowledge: &Knowledge<'_>,
    (via, force): (Via, bool),
    tell: Tell<'_>,
) -> Result<Subject, Failure> {
    match target {
        Target::Node(node) => {
            let address = only_one(master, *node)?;
            nobody_alike(master, address, Some(*node))?;
            let (reach, node, address) = (Reach::Selective(address), Some(*node), Some(address));
            let subject = Subject { address, node, unconfigured: false, alone: true, model: None, reach };
            let model = knowledge.model(master, &subject)?;
            let subject = Subject { model, ..subject };
            if subject.uses_lss(via)
                && let Ok(Some(told)) = told(master, &subject)?
                && told != node
            {
                let told = told.map_or_else(|| "has no node-ID".to_owned(), |told| format!("is node {told}"));
                let message = format!("by LSS the device with its identity {told}: nothing was changed");
                return Err(subject.failure(Kind::CheckFailed, message).hint(ALONE));
            }
            Ok(subject)
        }
        Target::Address(address) => addressed(master, *address, knowledge, tell),
        Target::Only => only(master, knowledge, force, tell),
        Target::Unconfigured => {
            let found = {
                let mut lss = master.lss();
                let found = lss.fastscan();
                let left = lss.leave();
                let found = found?;
                left?;
                found
            };
            let address = found.ok_or_else(|| {
                Failure::new(Kind::NoAnswer, "no device without a node-ID answers: nothing was changed")
                    .hint("devices that have one take no part in it: cangauge lss scan")
            })?;
            let (reach, address) = (Reach::Selective(address), Some(address));
            let subject = Subject { address, node: None, unconfigured: true, alone: false, model: None, reach };
            // Another one that has a node-ID and the same identity shows itself here.
            let _ = told(master, &subject)?;
            let model = knowledge.model(master, &subject)?;
            Ok(Subject { model, ..subject })
        }
    }
}

/// The device with an identity, and where it is.
fn addressed(
    master: &mut Master<'_>,
    address: LssAddress,
    knowledge: &Knowledge<'_>,
    tell: Tell<'_>,
) -> Result<Subject, Failure> {
    let reach = Reach::Selective(address);
    let mut subject =
        Subject { address: Some(address), node: None, unconfigured: false, alone: false, model: None, reach };
    // A device that wants another NMT state first does not answer here; SDO may show it all the same.
    let (silence, told) = match told(master, &subject)? {
        Ok(told) => (None, told),
        Err(silence) => (Some(silence), None),
    };
    match told {
        Some(Some(node)) => subject.node = Some(node),
        Some(None) => subject.unconfigured = true,
        None => subject.node = alike(master, address)?.first().copied(),
    }
    nobody_alike(master, address, subject.node)?;
    if let Some(node) = subject.node {
        match presence(master, node)? {
            Presence::One(found) if found == address => subject.alone = true,
            Presence::One(_) | Presence::Several(_) => tell(Note::Warning(format!(
                "another device has node-ID {node} too: it is not reset, since that would reset the other one"
            ))),
            Presence::Nameless | Presence::Nobody(_) => {}
        }
    }
    if let Some(silence) = silence.filter(|_| !subject.alone) {
        return Err(silence);
    }
    subject.model = knowledge.model(master, &subject)?;
    Ok(subject)
}

/// The node-ID that the device with an identity tells by LSS; `Some(None)` of one that has none, `None` where it does not
/// know the question. The inner error is that nobody answers to the identity: some devices do so in one NMT state only.
///
/// # Errors
/// [`Kind::CheckFailed`] where more than one answers; what stops everything.
fn told(master: &mut Master<'_>, subject: &Subject) -> Result<Result<Option<Option<NodeId>>, Failure>, Failure> {
    let asked = configured(master, subject, |lss| {
        known_service(lss.inquire_node_id()).map_err(|error| subject.lss_failure(error))
    });
    let told = match asked {
        Ok(session) => session.done,
        Err(failure) if failure.kind() == Kind::NoAnswer => return Ok(Err(failure)),
        Err(failure) => return Err(failure),
    };
    match told {
        Some(told) if !told.is_one() => {
            let message = "more than one device answers to its identity: nothing was changed";
            Err(subject.failure(Kind::CheckFailed, message).hint(ALONE))
        }
        told => Ok(Ok(told.and_then(|told| told.answers.first().copied()))),
    }
}

/// The way out where one identity is that of several.
const ALONE: &str = "connect the one you mean alone";

/// Where SDO finds devices with this identity.
fn alike(master: &mut Master<'_>, address: LssAddress) -> Result<Vec<NodeId>, Failure> {
    let found = everybody_described(master)?;
    let is_alike = |found: &&Found| {
        let identity = &found.instrument.identity;
        [identity.vendor, identity.product, identity.revision, identity.serial] == address.parts().map(Some)
    };
    Ok(found.iter().filter(is_alike).map(|found| found.node).collect())
}

/// Refuses an identity that another node has, too: whoever is addressed by it is more than one. There are makers who
/// give every device the same serial number.
fn nobody_alike(master: &mut Master<'_>, address: LssAddress, node: Option<NodeId>) -> Result<(), Failure> {
    let Some(other) = alike(master, address)?.into_iter().find(|&other| Some(other) != node) else { return Ok(()) };
    let message = format!("node {other} has the identity {address}, too: nothing was changed");
    Err(Failure::new(Kind::CheckFailed, message).hint(ALONE))
}

/// Every node that shows itself to an SDO scan.
///
/// # Errors
/// What stops everything.
pub(super) fn everybody(master: &mut Master<'_>) -> Result<Vec<NodeId>, Failure> {
    Ok(everybody_described(master)?.into_iter().map(|found| found.node).collect())
}

/// The same with what they say of themselves.
///
/// # Errors
/// What stops everything.
pub(super) fn everybody_described(master: &mut Master<'_>) -> Result<Vec<Found>, Failure> {
    let all: Vec<NodeId> = NodeId::all().collect();
    let found = scan(master, &all, SCAN, 2, &Overrides::new())?;
    master.listen(&Filters::All)?;
    Ok(found)
}
