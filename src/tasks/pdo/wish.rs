//! What the user wants of a TPDO, and the settings that this comes to.

use super::device::Device;
use super::settings::Settings;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{MappingEntry, TpdoNumber};
use crate::canopen::value::DataType;
use crate::device::standard;
use crate::master::Request;
use crate::measure::layout::{PROCESS_VALUES, Signal};
use crate::node::Node;
use crate::node::names::nearest;
use crate::tasks::{Failure, Kind};

/// The transmission type by which the event timer sends, where no description tells another one.
const TIMER: u8 = 254;

/// The bits of a classic CAN frame's data.
const MOST_BITS: u32 = 64;

/// Something to be mapped, and its bits where the user fixes them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Item {
    /// `0x9130:1/32`.
    Object(ObjectId, Option<u8>),
    /// `pressure`, `pressure.status`, `ai-input-pv:1`.
    Name(String, Option<u8>),
}

/// When the TPDO is to be sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Send {
    /// 180xh:2.
    Code(u8),
    /// By the event timer: the device's own code for it.
    Timer,
}

/// What a TPDO is to be set to; what is `None` stays as it is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Wish {
    /// Of which node.
    pub node: NodeId,
    /// Which TPDO.
    pub number: TpdoNumber,
    /// What it is to carry; nothing leaves the mapping as it is.
    pub items: Vec<Item>,
    /// When it is to be sent.
    pub send: Option<Send>,
    /// 180xh:5 in ms.
    pub event_timer_ms: Option<u16>,
    /// 180xh:3 in 100 µs.
    pub inhibit_100us: Option<u16>,
    /// Its identifier, 11 bits.
    pub cob_id: Option<u16>,
}

impl Wish {
    /// The bits that the items fix by themselves: what is too long by that is known without a bus.
    ///
    /// # Errors
    /// More than 64 bits.
    pub fn check(&self) -> Result<(), Failure> {
        let bits = |item: &Item| match item {
            Item::Object(_, bits) | Item::Name(_, bits) => bits.map_or(0, u32::from),
        };
        check_length(self.node, self.items.iter().map(bits).sum())?;
        match self.cob_id.and_then(CanId::standard) {
            Some(id) if id.is_restricted() => {
                let message = format!("identifier 0x{id} is not for PDOs (CiA 301 keeps it for other services)");
                Err(Failure::new(Kind::Usage, message).hint("free for PDOs are 0x181 to 0x57F where nobody uses them"))
            }
            _ => Ok(()),
        }
    }

    /// The mapping asked for, `None` where none is; and remarks on it.
    ///
    /// # Errors
    /// Names that the device does not have, objects of unknown width, more than 64 bits.
    pub(super) fn mapping(
        &self,
        device: &mut Device<'_, '_>,
        instrument: &Node,
    ) -> Result<(Option<Vec<MappingEntry>>, Vec<String>), Failure> {
        let (mut entries, mut remarks) = (Vec::new(), Vec::new());
        for item in &self.items {
            let (object, bits) = match item {
                Item::Object(object, bits) => (*object, *bits),
                Item::Name(name, bits) => (named(instrument, name)?, *bits),
            };
            let bits = match bits.or_else(|| width(instrument, object)) {
                Some(bits) => bits,
                None => ask_width(device, object)?,
            };
            let known = instrument.model.as_ref().and_then(|model| model.dictionary.get(object));
            let is_mapped = instrument.tpdos.iter().flat_map(|tpdo| &tpdo.mapping).any(|entry| entry.object == object);
            if known.is_some_and(|entry| !entry.pdo) && !is_mapped {
                let node = self.node;
                remarks.push(format!("node {node}: its description says that {object} cannot be mapped; it is asked"));
            }
            entries.push(MappingEntry { object, bits });
        }
        check_length(self.node, entries.iter().map(|entry| u32::from(entry.bits)).sum())?;
        Ok((Some(entries).filter(|entries| !entries.is_empty()), remarks))
    }

    /// The settings asked for: what is not asked for stays. Who names what is to be sent, or where, wants it sent.
    ///
    /// # Errors
    /// Parameters that the device does not have, and a TPDO without an identifier.
    pub(super) fn settings(
        &self,
        old: &Settings,
        mapping: Option<Vec<MappingEntry>>,
        instrument: &Node,
    ) -> Result<Settings, Failure> {
        let mut wanted = old.clone();
        if mapping.is_some() || self.cob_id.is_some() {
            wanted.cob_id = wanted.cob_id.switched_on();
        }
        if let Some(id) = self.cob_id {
            wanted.cob_id = wanted.cob_id.with_standard(id.into()).unwrap_or(wanted.cob_id);
        }
        if wanted.cob_id.is_valid() && !old.cob_id.is_valid() && wanted.cob_id.can_id().is_restricted() {
            let message = format!("{} has no identifier yet (0x{})", old.number, wanted.cob_id.can_id());
            return Err(Failure::of_node(Kind::Usage, self.node, message).hint("give it one: --cob-id 0x3A5"));
        }
        wanted.mapping = mapping.unwrap_or(wanted.mapping);
        if let Some(send) = self.send {
            let timer = instrument.model.as_ref().and_then(|model| model.description.pdo.timer);
            wanted.transmission = match send {
                Send::Code(code) => code,
                Send::Timer => timer.unwrap_or(TIMER),
            };
        }
        let lacks = |what: &str, object: ObjectId| {
            let message = format!("{} has no {what} ({object} does not exist)", old.number);
            Failure { object: Some(object), ..Failure::of_node(Kind::Refused, self.node, message) }
        };
        if let Some(timer) = self.event_timer_ms {
            old.event_timer_ms.ok_or_else(|| lacks("event timer", old.number.communication(5)))?;
            wanted.event_timer_ms = Some(timer);
        }
        if let Some(inhibit) = self.inhibit_100us {
            old.inhibit_100us.ok_or_else(|| lacks("inhibit time", old.number.communication(3)))?;
            wanted.inhibit_100us = Some(inhibit);
        }
        Ok(wanted)
    }
}

fn check_length(node: NodeId, bits: u32) -> Result<(), Failure> {
    if bits <= MOST_BITS {
        return Ok(());
    }
    let (bytes, rest) = (bits / 8, bits % 8);
    let length = if rest == 0 { format!("{bytes} bytes") } else { format!("{bits} bits") };
    Err(Failure::of_node(Kind::Usage, node, format!("that makes {length}; a PDO carries 8 bytes at most")))
}

/// The object of a signal, its status, or a name of the dictionary.
fn named(instrument: &Node, name: &str) -> Result<ObjectId, Failure> {
    let signals = &instrument.signals;
    let of = |name: &str| signals.iter().find(|signal| signal.name == name);
    if let Some(signal) = of(name) {
        return Ok(value_object(instrument, signal));
    }
    if let Some(signal) = name.strip_suffix(".status").and_then(of) {
        return signal.status.ok_or_else(|| {
            let message = format!("no object tells the status of {}", signal.name);
            Failure::of_node(Kind::Usage, instrument.id, message)
        });
    }
    let dictionary = instrument.model.as_ref().map(|model| &model.dictionary);
    if let Some(entry) = dictionary.and_then(|dictionary| dictionary.find(name)) {
        return Ok(entry.object);
    }
    if let Some(entry) = standard::find(name) {
        return Ok(entry.object);
    }
    let mut known: Vec<String> = signals.iter().map(|signal| signal.name.clone()).collect();
    known.extend(signals.iter().filter(|signal| signal.status.is_some()).map(|signal| signal.name.clone() + ".status"));
    let near = match known.as_slice() {
        [] => String::new(),
        signals => format!("its signals: {}", signals.join(", ")),
    };
    known.extend(dictionary.into_iter().flat_map(|dictionary| dictionary.iter().map(|entry| entry.full_name())));
    let hint = match nearest(name, known.into_iter()).as_slice() {
        [] => near,
        names => format!("nearest: {}", names.join(", ")),
    };
    let failure = Failure::of_node(Kind::Usage, instrument.id, format!("it has no object or signal \"{name}\""));
    Err(if hint.is_empty() { failure } else { failure.hint(hint) })
}

/// The object that carries a signal in a PDO: the one that it is read from, unless the dictionary knows that
/// this one cannot be mapped and another of the same quantity can.
fn value_object(instrument: &Node, signal: &Signal) -> ObjectId {
    let value = signal.value.0;
    let Some(model) = &instrument.model else { return value };
    let mappable = |object: &ObjectId| model.dictionary.get(*object).is_some_and(|entry| entry.pdo);
    let families = PROCESS_VALUES.iter().map(|&(index, _)| ObjectId::new(index, signal.channel));
    let others = signal.also.iter().copied().chain(families);
    match model.dictionary.get(value) {
        Some(entry) if !entry.pdo => others.into_iter().find(mappable).unwrap_or(value),
        _ => value,
    }
}

/// The bits of an object, where its description or the standard tells its type.
fn width(instrument: &Node, object: ObjectId) -> Option<u8> {
    let model = instrument.model.as_ref();
    let described = model.and_then(|model| {
        let entry = model.dictionary.get(object)?;
        (!model.untyped.contains(&object)).then_some(entry.data_type)
    });
    let family = PROCESS_VALUES.iter().find(|&&(index, _)| index == object.index).map(|&(_, data_type)| data_type);
    let standard = || standard::entry(object).map(|entry| entry.data_type);
    // Indices below 20h are the types themselves: they fill gaps.
    let dummy = || DataType::from_code(object.index).filter(|_| object.sub == 0 && object.index < 0x20);
    match described.or(family).or_else(standard).or_else(dummy)? {
        DataType::Boolean => Some(1),
        data_type => u8::try_from(8 * data_type.width()?).ok(),
    }
}

/// The bits of an object as the device says them in answer to a read.
fn ask_width(device: &mut Device<'_, '_>, object: ObjectId) -> Result<u8, Failure> {
    let node = device.node;
    let answer = device.master.transfer_one(Request::read(node, object))??;
    let told = answer.uploaded.filter(|uploaded| uploaded.indicated && (1..=8).contains(&uploaded.bytes.len()));
    told.and_then(|uploaded| u8::try_from(8 * uploaded.bytes.len()).ok()).ok_or_else(|| {
        Failure::of_node(Kind::Usage, node, format!("the width of {object} is not known"))
            .hint(format!("say it: {object}/32"))
    })
}
