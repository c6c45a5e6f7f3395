//! The device of a task, and how it is addressed by LSS.

use super::Via;
use super::event::{LssEvent, LssFact};
use super::failure::{LssCause, LssFailure};
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::device::assign::AssignKind;
use crate::device::catalog::{self, Model, TargetDevice};
use crate::device::description::Description;
use crate::master::{LssError, Master};
use crate::node::survey::identify;
use crate::node::{Node, Overrides};
use crate::tasks::{Failure, Note};
use std::sync::Arc;

/// The name of a device in messages.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DeviceName {
    /// Its node-ID; `None` if it has none or it is unknown.
    pub node: Option<NodeId>,
    /// Its identity; `None` if it is unknown.
    pub address: Option<LssAddress>,
}

/// How a device is addressed by LSS.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reach {
    /// By its identity (40h to 43h).
    Selective(LssAddress),
    /// Every slave on the bus (04h).
    Global,
}

/// The device of a task.
#[derive(Clone, Debug)]
pub(super) struct LssDevice {
    /// Its identity; `None` if it is unknown.
    pub address: Option<LssAddress>,
    /// Its present node-ID; `None` if it has none or it is unknown.
    pub node: Option<NodeId>,
    /// Whether the device is known to have no node-ID.
    pub is_unconfigured: bool,
    /// Whether a message to its node-ID reaches only this device.
    pub is_alone: bool,
    /// Its description; `None` for an unknown device.
    pub model: Option<Arc<Model>>,
    /// How the device is addressed by LSS.
    pub reach: Reach,
}

impl LssDevice {
    /// Creates a device of which only the identity is known.
    pub(super) fn with_address(address: LssAddress) -> LssDevice {
        LssDevice {
            address: Some(address),
            node: None,
            is_unconfigured: false,
            is_alone: false,
            model: None,
            reach: Reach::Selective(address),
        }
    }

    /// Returns the name for messages.
    pub(super) fn name(&self) -> DeviceName {
        DeviceName { node: self.node, address: self.address }
    }

    /// Returns the node-ID, if a message to this node-ID reaches only this device.
    pub(super) fn own_node(&self) -> Option<NodeId> {
        self.node.filter(|_| self.is_alone)
    }

    /// Returns the description of the device.
    pub(super) fn description(&self) -> Option<&Description> {
        self.model.as_ref().map(|model| &model.description)
    }

    /// Returns the device as a node for SDO.
    pub(super) fn as_node(&self, node: NodeId) -> Node {
        Node { model: self.model.clone(), is_identified: true, ..Node::new(node) }
    }

    /// Whether the node-ID of the device is set by LSS.
    pub(super) fn uses_lss(&self, via: Via) -> bool {
        let preferred = self.description().and_then(Description::preferred_assign);
        match via {
            Via::Auto => preferred.is_none_or(|entry| entry.kind == AssignKind::Lss),
            Via::Lss => true,
            Via::Sdo => false,
        }
    }

    /// Creates a failure of this device.
    pub(super) fn failure(&self, cause: LssCause) -> Failure {
        Failure { node: self.node, ..Failure::general(LssFailure { device: self.name(), cause }) }
    }

    /// Converts the error of an LSS service to a failure of this device.
    pub(super) fn lss_failure(&self, error: LssError) -> Failure {
        match error {
            LssError::Master(error) => error.into(),
            error => self.failure(LssCause::Service(Arc::new(error))),
        }
    }

    /// Creates a note about this device.
    pub(super) fn note(&self, event: LssEvent) -> Note {
        Note { node: self.node, fact: LssFact { device: self.name(), event }.into() }
    }
}

/// The descriptions that the user named.
#[derive(Clone, Copy, Debug)]
pub struct Descriptions<'a> {
    /// The descriptions for nodes.
    pub overrides: &'a Overrides,
    /// The description for the target, independent of its node-ID.
    pub given: Option<&'a Arc<Model>>,
}

impl Descriptions<'_> {
    /// Returns the description of a device: chosen by the user, else found from its SDO answers, else from its
    /// identity.
    ///
    /// # Errors
    /// The named description is for another device. Bus errors and Ctrl-C; the node stops answering.
    pub(super) fn model_of(&self, master: &mut Master<'_>, device: &LssDevice) -> Result<Option<Arc<Model>>, Failure> {
        let given = device.node.and_then(|node| self.overrides.get(&node)).or(self.given);
        let is_other = |made_for: &&TargetDevice| {
            device.address.is_some_and(|device| !made_for.fits(Some(device.vendor), Some(device.product)))
        };
        if let Some(other) = given.and_then(|model| model.made_for.iter().find(is_other)) {
            return Err(device.failure(LssCause::OtherDescription(other.clone())));
        }
        if let Some(given) = self.given {
            return Ok(Some(Arc::clone(given)));
        }
        let by_identity = device.address.and_then(|address| catalog::by_identity(address.vendor, address.product));
        let Some(node) = device.own_node() else { return Ok(by_identity) };
        let found = identify(master, &[node], self.overrides)?.pop();
        Ok(found.and_then(|node| node.model).or(by_identity))
    }
}
