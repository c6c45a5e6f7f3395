//! Checks whether a silent node answers, and reads the objects that can prevent its TPDOs.

use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::Transmission;
use crate::device::profiles;
use crate::master::{Answer, Error, Master, MasterEvent, Request, SdoError, SdoFailure, Ticket};
use crate::measure::layout::{PROCESS_VALUES, Tpdo};
use crate::node::Node;
use crate::node::state::{Proof, states};
use crate::node::wait::{Policy, wait};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// The time limit for all reads: two attempts of an SDO request with a long time-out.
const INQUIRY_LIMIT: Duration = Duration::from_secs(20);

/// The answers of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Findings {
    /// Whether the node answers SDO requests.
    pub answers: bool,
    /// Its NMT state, and the evidence for it.
    pub state: Option<(NmtState, Proof)>,
    values: BTreeMap<ObjectId, Vec<u8>>,
}

impl Findings {
    /// Whether an object is 0; `None` if it was not read.
    pub(super) fn is_zero(&self, object: ObjectId) -> Option<bool> {
        self.values.get(&object).map(|bytes| bytes.iter().all(|&byte| byte == 0))
    }

    /// Returns the number in an object of one or two bytes; `None` if the object was not read.
    pub(super) fn unsigned<T: TryFrom<u32>>(&self, object: ObjectId) -> Option<T> {
        let bytes = self.values.get(&object)?;
        let number = bytes.iter().take(2).rev().fold(0u32, |number, &byte| number << 8 | u32::from(byte));
        T::try_from(number).ok()
    }
}

/// Returns the objects to read in order to find out why these TPDOs are not sent.
pub fn objects_to_read(node: &Node, carries: &dyn Fn(&Tpdo) -> bool) -> Vec<ObjectId> {
    let mut objects = vec![ObjectId::DEVICE_TYPE];
    let valid = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
    for tpdo in valid.filter(|tpdo| tpdo.mapping.is_empty() || carries(tpdo)) {
        if tpdo.mapping.is_empty() {
            objects.push(tpdo.number.mapping(0));
        }
        let values = || tpdo.mapping.iter().map(|entry| entry.object);
        objects.extend(values().filter_map(|value| operating_mode(node, value)));
        if matches!(tpdo.transmission, Some(Transmission::Sync(_))) {
            objects.push(tpdo.number.communication(6));
        }
        if matches!(tpdo.transmission, Some(Transmission::AcyclicSync | Transmission::Sync(_) | Transmission::Rtr(_))) {
            continue;
        }
        objects.push(tpdo.number.communication(3));
        if node.event_timer(tpdo.transmission, tpdo.event_timer_ms).is_none() {
            objects.extend(values().filter_map(|value| triggers(node, value)).flatten());
            objects.extend(values().filter_map(|value| interrupt_enable(node, value)));
        }
    }
    objects.retain(|&object| object == ObjectId::DEVICE_TYPE || node.may_have(object));
    let mut seen = std::collections::BTreeSet::new();
    objects.retain(|&object| seen.insert(object));
    objects
}

/// Returns the channel of a process value of CiA 404.
fn channel(node: &Node, value: ObjectId) -> Option<u8> {
    let signal = node.signals.iter().find(|signal| signal.is_value(value))?;
    (signal.channel > 0).then_some(signal.channel)
}

/// Returns the operating mode object (6112h) for a process value. Mode 0 switches the channel off.
pub(super) fn operating_mode(node: &Node, value: ObjectId) -> Option<ObjectId> {
    channel(node, value).map(|channel| ObjectId::new(0x6112, channel))
}

/// Returns delta, lower limit and upper limit (x133h to x135h) of a process value.
pub(super) fn triggers(node: &Node, value: ObjectId) -> Option<[ObjectId; 3]> {
    channel(node, value)?;
    let is_family = PROCESS_VALUES.iter().any(|&(index, _)| index == value.index);
    is_family.then(|| [3, 4, 5].map(|offset| ObjectId::new(value.index + offset, value.sub)))
}

/// Returns the object that enables a CiA 401 device to send its analogue inputs (6423h).
pub(super) fn interrupt_enable(node: &Node, value: ObjectId) -> Option<ObjectId> {
    let is_input = matches!(value.index, 0x6400..=0x6404);
    (is_input && node.identity.profile() == Some(profiles::GENERIC_IO)).then_some(ObjectId::new(0x6423, 0))
}

/// Reads objects of silent nodes, without waiting for the answers.
pub struct Inquiry {
    pending: BTreeMap<Ticket, (NodeId, ObjectId)>,
    findings: BTreeMap<NodeId, Findings>,
}

impl Inquiry {
    /// Starts the reads.
    pub fn begin(master: &mut Master<'_>, asked: &[(NodeId, Vec<ObjectId>)]) -> Inquiry {
        let mut pending = BTreeMap::new();
        for (node, objects) in asked {
            for &object in objects {
                pending.insert(master.start(Request::read(*node, object)), (*node, object));
            }
        }
        Inquiry { pending, findings: BTreeMap::new() }
    }

    /// Handles the end of a transfer. Returns the findings after the last transfer.
    pub fn take(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
    ) -> Option<BTreeMap<NodeId, Findings>> {
        let (node, object) = self.pending.remove(&ticket)?;
        let findings = self.findings.entry(node).or_default();
        match result {
            Ok(answer) => {
                findings.answers = true;
                let uploaded = answer.uploaded.as_ref();
                findings.values.extend(uploaded.map(|uploaded| (object, uploaded.bytes.clone())));
            }
            Err(SdoError { failure: SdoFailure::NoAnswer { .. } | SdoFailure::Cancelled, .. }) => {
                let (others, rest) =
                    std::mem::take(&mut self.pending).into_iter().partition(|(_, (of, _))| *of == node);
                let others: BTreeMap<Ticket, _> = others;
                self.pending = rest;
                master.forget(others.into_keys());
            }
            Err(_) => findings.answers = true,
        }
        self.pending.is_empty().then(|| std::mem::take(&mut self.findings))
    }

    /// Whether a transfer belongs to this inquiry.
    pub fn has(&self, ticket: Ticket) -> bool {
        self.pending.contains_key(&ticket)
    }

    /// Reads the objects and waits for the answers. For answering nodes in `guarded`, the NMT state is determined as in
    /// `nmt state`.
    ///
    /// # Errors
    /// Bus errors and Ctrl-C.
    pub fn complete(
        master: &mut Master<'_>,
        asked: &[(NodeId, Vec<ObjectId>)],
        guarded: &[NodeId],
    ) -> Result<BTreeMap<NodeId, Findings>, Error> {
        let mut inquiry = Inquiry::begin(master, asked);
        let until = master.now() + INQUIRY_LIMIT;
        let waited = wait(master, until, Policy::Command, |master, event| match event {
            MasterEvent::Sdo(ticket, result) => match inquiry.take(ticket, &result, master) {
                Some(findings) => ControlFlow::Break(findings),
                None => ControlFlow::Continue(()),
            },
            _ => ControlFlow::Continue(()),
        })?;
        let mut findings = waited.done().unwrap_or_default();
        let answers = |node: &NodeId| findings.get(node).is_some_and(|findings| findings.answers);
        let guarded: Vec<NodeId> = guarded.iter().copied().filter(answers).collect();
        if guarded.is_empty() {
            return Ok(findings);
        }
        for report in states(master, &guarded)? {
            if let Some(findings) = findings.get_mut(&report.node) {
                findings.state = report.state.map(|state| (state, report.by));
            }
        }
        Ok(findings)
    }
}
