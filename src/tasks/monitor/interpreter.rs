//! Converts frames to messages.

use super::entry::{Content, Entry, FrameKind, LssMessage, SdoMessage};
use crate::bus::{Fault, Mono, Received, Stamp};
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{CobId, TpdoNumber};
use crate::canopen::sdo::{FitError, Note, Uploaded, fit};
use crate::canopen::value::{DataType, Value};
use crate::device::description::emergency_text;
use crate::device::standard;
use crate::device::unit::Unit;
use crate::master::Operation;
use crate::measure::decode::{self, Decoded, Decoder, Reading};
use crate::measure::sample::{Sample, Source, Status};
use crate::node::transfers::{Outcome, Part, Transfer, Transfers};
use crate::node::write::is_signature;
use crate::node::{Node, Overrides};
use crate::tasks::log::SetupListener;
use std::collections::{BTreeMap, BTreeSet};

/// TIME in the predefined connection set (CiA 301, 7.3.3).
const TIME: CanId = CanId::Standard(0x100);

/// The COB-ID of TIME.
const COB_ID_TIME: ObjectId = ObjectId::new(0x1012, 0);

/// Interprets the frames on a bus.
pub struct Interpreter {
    setup: SetupListener,
    decoder: Decoder,
    transfers: Transfers,
    /// The nodes as far as they are known.
    nodes: BTreeMap<NodeId, Node>,
    tpdos: BTreeMap<CanId, TpdoNumber>,
    syncs: BTreeSet<CanId>,
    times: BTreeSet<CanId>,
    emergencies: BTreeMap<CanId, NodeId>,
    /// The last state of each node by heartbeat.
    states: BTreeMap<NodeId, NmtState>,
    guarding: BTreeMap<NodeId, Guarding>,
    /// The last LSS request.
    lss_request: Option<lss::Service>,
    last_fault: Option<Fault>,
    /// Nodes whose SDO channel is used by two masters.
    disturbed: BTreeSet<NodeId>,
    samples: Vec<Sample>,
}

/// Node guarding of one node.
#[derive(Clone, Copy, Debug, Default)]
struct Guarding {
    /// Whether a request waits for its answer.
    is_asked: bool,
    /// The last answer: the state and the toggle bit.
    last: Option<u8>,
}

impl Interpreter {
    /// Creates an interpreter that uses the descriptions of the user and of recognised devices.
    pub fn new(overrides: &Overrides, recognised: Overrides) -> Interpreter {
        let all: Vec<NodeId> = NodeId::all().collect();
        let mut interpreter = Interpreter {
            setup: SetupListener::new(&all, overrides, &[]),
            decoder: Decoder::default(),
            transfers: Transfers::default(),
            nodes: BTreeMap::new(),
            tpdos: BTreeMap::new(),
            syncs: [CanId::SYNC].into(),
            times: [TIME].into(),
            emergencies: all.iter().map(|&node| (CanId::emergency(node), node)).collect(),
            states: BTreeMap::new(),
            guarding: BTreeMap::new(),
            lss_request: None,
            last_fault: None,
            disturbed: BTreeSet::new(),
            samples: Vec::new(),
        };
        let known: BTreeSet<NodeId> = overrides.keys().chain(recognised.keys()).copied().collect();
        interpreter.setup.recognised = recognised;
        interpreter.setup.apply_overrides(&mut interpreter.decoder);
        known.into_iter().for_each(|node| interpreter.learn(node));
        interpreter
    }

    /// Returns the COB-IDs of TPDOs whose mapping is unknown, and their nodes.
    pub fn not_decoded(&self) -> BTreeMap<CanId, NodeId> {
        self.setup.unknown_mappings.clone()
    }

    /// Returns when the next SDO transfer without an answer ends.
    pub fn next_deadline(&self) -> Option<Mono> {
        self.transfers.next_deadline()
    }

    /// Adds the SDO transfers that end because no answer was received.
    pub fn expire(&mut self, now: Mono, entries: &mut Vec<Entry>) {
        self.transfers.expire(now);
        self.push_transfers(entries);
    }

    /// Adds the SDO transfers that are not complete at the end.
    pub fn finish(&mut self, entries: &mut Vec<Entry>) {
        self.transfers.end_all();
        self.push_transfers(entries);
    }

    /// Adds a fault that the controller reports.
    pub fn fault(&mut self, fault: Fault, at: Stamp, entries: &mut Vec<Entry>) {
        let is_repeated = self.last_fault.replace(fault) == Some(fault);
        entries.push(Entry { is_repeated, ..Entry::of_bus(at, Content::Fault(fault)) });
    }

    /// Interprets a frame. Adds the messages that are complete, and returns the kind of the frame.
    pub fn take(&mut self, received: &Received, entries: &mut Vec<Entry>) -> FrameKind {
        self.last_fault = None;
        let frame = &received.frame;
        if let Some(node) = self.setup.on_frame(received, &mut self.decoder) {
            self.learn(node);
        }
        let part = self.transfers.take(received);
        self.push_transfers(entries);
        if part == Part::OfTransfer {
            return FrameKind::Sdo;
        }
        let stray = if part == Part::Stray {
            let node = frame.id().sdo_request_node().or(frame.id().sdo_response_node());
            Some((node, FrameKind::Sdo, raw(frame)))
        } else {
            None
        };
        let (node, kind, content) = stray
            .or_else(|| self.pdo(received))
            .or_else(|| nmt(frame))
            .or_else(|| self.sync_or_time(frame))
            .or_else(|| self.life(frame))
            .or_else(|| self.emergency(frame))
            .or_else(|| self.lss(frame))
            .or_else(|| predefined_pdo(frame))
            .unwrap_or((None, FrameKind::Other, raw(frame)));
        let is_repeated = self.is_repeated(node, &content, frame);
        if content == Content::BootUp
            && let Some(node) = node
        {
            self.setup.forget(node, &mut self.decoder);
            self.learn(node);
        }
        entries.push(Entry { is_repeated, ..Entry::of_frame(received, node, kind, content) });
        kind
    }

    /// Updates the facts about a node.
    fn learn(&mut self, id: NodeId) {
        let node = self.setup.known_node(id);
        self.syncs.insert(node.sync);
        self.times.extend(self.setup.number(id, COB_ID_TIME).map(|word| CobId(word).can_id()));
        if node.emergency != CanId::emergency(id) {
            self.emergencies.insert(node.emergency, id);
        }
        let valid = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
        self.tpdos.extend(valid.map(|tpdo| (tpdo.cob_id.can_id(), tpdo.number)));
        self.nodes.insert(id, node);
    }

    fn pdo(&mut self, received: &Received) -> Option<(Option<NodeId>, FrameKind, Content)> {
        let id = received.frame.id();
        let number = *self.tpdos.get(&id).filter(|_| !id.is_restricted())?;
        self.samples.clear();
        let (node, content) = match self.decoder.decode(received, &mut self.samples) {
            Decoded::Tpdo(node) => {
                let sources = self.decoder.sources();
                let value = |sample: &Sample| Some((sources.get(sample.source)?.clone(), sample.clone()));
                (node, Content::Tpdo(number, self.samples.iter().filter_map(value).collect()))
            }
            Decoded::WrongLength(node) => {
                let mapped = self.decoder.mapped_length(id).map_or(0, |(_, length)| length);
                (node, Content::WrongLength(number, mapped))
            }
            Decoded::Paused(_) | Decoded::OtherFrame => return None,
        };
        Some((Some(node), FrameKind::Pdo, content))
    }

    fn sync_or_time(&self, frame: &Frame) -> Option<(Option<NodeId>, FrameKind, Content)> {
        if frame.is_remote() {
            return None;
        }
        match frame.data() {
            [] if self.syncs.contains(&frame.id()) => Some((None, FrameKind::Sync, Content::Sync(None))),
            &[counter] if self.syncs.contains(&frame.id()) => {
                Some((None, FrameKind::Sync, Content::Sync(Some(counter))))
            }
            data if self.times.contains(&frame.id()) => {
                let time = DataType::TimeOfDay.decode(data).ok()?;
                Some((None, FrameKind::Time, Content::Time(time)))
            }
            _ => None,
        }
    }

    /// Interprets heartbeats, boot-up messages and node guarding.
    fn life(&mut self, frame: &Frame) -> Option<(Option<NodeId>, FrameKind, Content)> {
        if let (Some(node), true) = (frame.id().heartbeat_node(), frame.is_remote()) {
            return Some((Some(node), FrameKind::Guarding, Content::GuardingRequest));
        }
        let (node, life) = ErrorControlMessage::parse(frame)?;
        let ErrorControlMessage::State(state) = life else {
            return Some((Some(node), FrameKind::BootUp, Content::BootUp));
        };
        let guarding = self.guarding.get(&node).filter(|guarding| guarding.is_asked);
        Some(match (guarding, frame.data()) {
            (Some(guarding), [code, ..]) => {
                let alternates = guarding.last.is_none_or(|last| (last ^ code) & 0x80 != 0);
                (Some(node), FrameKind::Guarding, Content::Guarded(state, alternates))
            }
            _ => (Some(node), FrameKind::Heartbeat, Content::State(state)),
        })
    }

    /// Whether a message repeats an earlier message. Stores the states of the nodes.
    fn is_repeated(&mut self, node: Option<NodeId>, content: &Content, frame: &Frame) -> bool {
        let Some(node) = node else { return false };
        match *content {
            Content::State(state) => self.states.insert(node, state) == Some(state),
            Content::BootUp => {
                self.states.remove(&node);
                self.guarding.remove(&node);
                false
            }
            Content::GuardingRequest => {
                let guarding = self.guarding.entry(node).or_default();
                // A request without an answer is shown.
                !std::mem::replace(&mut guarding.is_asked, true) && guarding.last.is_some()
            }
            Content::Guarded(state, alternates) => {
                let guarding = self.guarding.entry(node).or_default();
                let last =
                    std::mem::replace(guarding, Guarding { is_asked: false, last: frame.data().first().copied() });
                alternates && last.last.is_some_and(|code| NmtState::from_code(code) == state)
            }
            _ => false,
        }
    }

    fn emergency(&self, frame: &Frame) -> Option<(Option<NodeId>, FrameKind, Content)> {
        let node = *self.emergencies.get(&frame.id()).filter(|_| !frame.is_remote())?;
        let emergency = Emergency::parse(frame)?;
        let model = self.nodes.get(&node).and_then(|node| node.model.as_ref());
        let meaning = emergency_text(model.map(|model| &model.description), emergency);
        Some((Some(node), FrameKind::Emergency, Content::Emergency(emergency, meaning)))
    }

    fn lss(&mut self, frame: &Frame) -> Option<(Option<NodeId>, FrameKind, Content)> {
        let message = if let Some(request) = lss::Request::parse(frame) {
            self.lss_request = Some(request.service());
            Some(LssMessage::Request(request))
        } else {
            let answer = |service| Some(LssMessage::Answer(service, lss::Answer::parse(frame, service)?.ok()?));
            self.lss_request.and_then(answer)
        };
        let is_lss = matches!(frame.id(), CanId::LSS_MASTER | CanId::LSS_SLAVE);
        is_lss.then(|| (None, FrameKind::Lss, message.map_or(raw(frame), Content::Lss)))
    }

    /// Adds the SDO transfers that have ended.
    fn push_transfers(&mut self, entries: &mut Vec<Entry>) {
        while let Some(transfer) = self.transfers.next_finished() {
            let (at, node) = (transfer.ended, transfer.node);
            let mut push = |content| {
                let (node, kind, id) = (Some(node), FrameKind::Sdo, None);
                entries.push(Entry { at, node, kind, id, data: Vec::new(), is_repeated: false, content });
            };
            if transfer.is_disturbed && self.disturbed.insert(node) {
                push(Content::SecondMaster);
            }
            let unknown = Node::new(node);
            let known = self.nodes.get(&node).unwrap_or(&unknown);
            push(Content::Sdo(Box::new(sdo_message(known, transfer))));
        }
    }
}

/// Returns the content of a frame that cannot be interpreted.
fn raw(frame: &Frame) -> Content {
    Content::Raw(frame.is_remote().then(|| frame.len()))
}

fn nmt(frame: &Frame) -> Option<(Option<NodeId>, FrameKind, Content)> {
    if frame.id() != CanId::NMT || frame.is_remote() {
        return None;
    }
    let parsed = NmtCommand::parse(frame);
    let content = parsed.map_or(raw(frame), |(command, _)| Content::Nmt(command));
    Some((parsed.and_then(|(_, node)| node), FrameKind::Nmt, content))
}

/// Recognises PDOs by the COB-IDs of the predefined connection set (CiA 301, 7.3.3).
fn predefined_pdo(frame: &Frame) -> Option<(Option<NodeId>, FrameKind, Content)> {
    let CanId::Standard(id) = frame.id() else { return None };
    let node = NodeId::new((id & 0x7f) as u8).ok()?;
    let (number, is_received) = match id & 0x780 {
        0x180 => (1, false),
        0x200 => (1, true),
        0x280 => (2, false),
        0x300 => (2, true),
        0x380 => (3, false),
        0x400 => (3, true),
        0x480 => (4, false),
        0x500 => (4, true),
        _ => return None,
    };
    let content = if frame.is_remote() { Content::Request } else { Content::Pdo(number, is_received) };
    Some((Some(node), FrameKind::Pdo, content))
}

/// Adds the name, type and value of the object to a transfer.
fn sdo_message(node: &Node, transfer: Transfer) -> SdoMessage {
    let object = transfer.object;
    let data_type = node.known_type(object);
    let mut message = SdoMessage {
        name: node.entry(object).map(|entry| entry.full_name()),
        data_type,
        value: None,
        raw: Vec::new(),
        note: None,
        unit: unit(node, object),
        meaning: None,
        sample: None,
        transfer,
    };
    if let Outcome::Done(uploaded) = &message.transfer.outcome {
        let (value, note) = value(data_type, uploaded);
        let mut raw = uploaded.bytes.clone();
        raw.truncate(data_type.and_then(DataType::width).unwrap_or(usize::MAX));
        let is_write = message.transfer.operation == Operation::Write;
        message.meaning = if is_write && is_signature(&raw) {
            Some(String::from_utf8_lossy(&raw).into_owned())
        } else {
            value.as_u64().and_then(|number| meaning(node, object, number))
        };
        message.sample = sample(node, object, &raw, message.transfer.ended);
        (message.value, message.note, message.raw) = (Some(value), note, raw);
    }
    message
}

/// Returns the value in the bytes of a transfer, as `sdo read` shows it.
fn value(data_type: Option<DataType>, uploaded: &Uploaded) -> (Value, Option<Result<Note, FitError>>) {
    match fit(data_type, uploaded) {
        Ok(fitted) => (fitted.value, fitted.note.map(Ok)),
        Err(error) => (Value::Bytes(uploaded.bytes.clone()), Some(Err(error))),
    }
}

/// Returns the fixed unit of the number in an object.
fn unit(node: &Node, object: ObjectId) -> Option<String> {
    let described = node.described(object).and_then(|entry| entry.unit.clone());
    described.or_else(|| standard::unit(object).map(str::to_owned))
}

/// Returns the meaning of a number in an object.
fn meaning(node: &Node, object: ObjectId, number: u64) -> Option<String> {
    let described = || node.described(object)?.meaning(number).map(str::to_owned);
    let of_status = node.signals.iter().find(|signal| signal.status == Some(object));
    if let Some(signal) = of_status {
        return Some(Status::from_bits(signal.rules.status_bits.to_cia_404(number)).0.as_str().to_owned());
    }
    let unit = (object.index == 0x6131 && object.sub > 0).then(|| u32::try_from(number).ok()).flatten();
    described().or_else(|| unit.map(|code| Unit(code).to_string())).filter(|text| !text.is_empty())
}

/// Returns the measured value in an object, with decimal digits and unit.
fn sample(node: &Node, object: ObjectId, bytes: &[u8], at: Stamp) -> Option<(Source, Sample)> {
    let layout = node.layout();
    let signal = layout.value_signal(object).or_else(|| layout.measured_signal(object))?;
    let data_type = layout.data_type(object).filter(|data_type| data_type.width() == Some(bytes.len()))?;
    let sample = Reading::of_signal(signal, Some(data_type), 0).sample(at, bytes, None)?;
    Some((decode::source(node.id, &signal.name, signal.unit), sample))
}
