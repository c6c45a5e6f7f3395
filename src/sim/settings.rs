//! Node-ID and bit rate of a simulated device: active, pending and stored.

use super::objects::Objects;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::assign::{Applies, AssignEntry, AssignKind, AssignObject};
use crate::device::description::Description;

/// The bit timing table 0 of CiA 305, in bit/s; 5 is reserved.
const STANDARD: [(u8, u32); 8] =
    [(0, 1_000_000), (1, 800_000), (2, 500_000), (3, 250_000), (4, 125_000), (6, 50_000), (7, 20_000), (8, 10_000)];

/// A bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum BitRate {
    /// A fixed bit rate in bit/s.
    At(u32),
    /// The bit rate of the bus.
    Auto,
}

/// Node-ID and bit rate. Without a node-ID the device is unconfigured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) node: Option<NodeId>,
    pub(super) rate: BitRate,
}

/// The three pairs of CiA 305, and the objects that contain and change them.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    /// Active now.
    pub(super) active: Pair,
    /// Active after the next reset.
    pub(super) pending: Pair,
    /// Active after the next power-on.
    pub(super) persistent: Pair,
    /// The bit rate of the bus, if it is known.
    pub(super) bus_bit_rate: Option<u32>,
    /// The codes of the bit rates for LSS.
    lss_codes: Vec<(u8, BitRate)>,
    /// The codes of the bit rates in the object.
    object_codes: Vec<(u8, BitRate)>,
    node_at: Option<Place>,
    rate_at: Option<Place>,
}

/// An object that sets node-ID or bit rate.
#[derive(Clone, Copy, Debug)]
struct Place {
    object: ObjectId,
    /// The object that stores the value; `None` if the write itself stores it.
    store: Option<ObjectId>,
    /// Whether only a power cycle activates the value.
    needs_power_cycle: bool,
}

impl Settings {
    pub(super) fn new(description: &Description, objects: &Objects, pair: Pair) -> Settings {
        let codes = |method| {
            let own = description.bit_rates_of(method).iter().map(|(&code, &rate)| (code, rate));
            let own: Vec<(u8, u32)> = own.collect();
            let known = if own.is_empty() { STANDARD.to_vec() } else { own };
            let rates = known.into_iter().map(|(code, rate)| (code, BitRate::At(rate)));
            rates.chain(description.auto_bit_rate.map(|code| (code, BitRate::Auto))).collect()
        };
        let entry = description.assign.iter().find(|entry| entry.kind == AssignKind::Objects);
        let place = |place: fn(&AssignEntry) -> Option<AssignObject>| {
            let entry = entry?;
            let object = place(entry)?.object;
            let needs_power_cycle = entry.applies == Applies::Power;
            objects.has(object).then_some(Place { object, store: entry.store, needs_power_cycle })
        };
        Settings {
            active: pair,
            pending: pair,
            persistent: pair,
            bus_bit_rate: None,
            lss_codes: codes(AssignKind::Lss),
            object_codes: codes(AssignKind::Objects),
            node_at: place(|entry| entry.node_id),
            rate_at: place(|entry| entry.bit_rate),
        }
    }

    /// Activates the stored pair, as at power-on.
    pub(super) fn power_on(&mut self) {
        self.pending = self.persistent;
        self.active = self.persistent;
    }

    /// Activates the pending pair, as at a reset.
    pub(super) fn reset(&mut self) {
        self.active = self.pending;
    }

    /// Records the bit rate of the bus. A device without a given bit rate uses it.
    pub(super) fn set_bus_bit_rate(&mut self, bit_rate: u32, is_given: bool) {
        if self.bus_bit_rate.is_none() && !is_given {
            for pair in [&mut self.active, &mut self.pending, &mut self.persistent] {
                pair.rate = BitRate::At(bit_rate);
            }
        }
        self.bus_bit_rate = Some(bit_rate);
    }

    /// Sets the pending node-ID, FFh for unconfigured; `false` if the number is not valid.
    pub(super) fn configure_node(&mut self, number: u8) -> bool {
        let node = NodeId::new(number).ok();
        let is_valid = node.is_some() || number == 0xff;
        if is_valid {
            self.pending.node = node;
        }
        is_valid
    }

    /// Sets the pending bit rate; `false` if the device has no such code.
    pub(super) fn configure_rate(&mut self, code: u8) -> bool {
        let rate = self.lss_codes.iter().find(|(known, _)| *known == code).map(|(_, rate)| *rate);
        self.pending.rate = rate.unwrap_or(self.pending.rate);
        rate.is_some()
    }

    /// Returns the bit rate of a code in the object.
    fn rate(&self, code: u8) -> Option<BitRate> {
        self.object_codes.iter().find(|(known, _)| *known == code).map(|(_, rate)| *rate)
    }

    /// Whether a write of node-ID or bit rate is allowed.
    pub(super) fn allows(&self, object: ObjectId, bytes: &[u8]) -> bool {
        let is_at = |place: Option<Place>| place.is_some_and(|place| place.object == object);
        let number = bytes.first().copied().unwrap_or_default();
        if is_at(self.node_at) {
            NodeId::new(number).is_ok()
        } else {
            !is_at(self.rate_at) || self.rate(number).is_some()
        }
    }

    /// Handles the write of `written`: a store command, or an object that needs no store command.
    pub(super) fn keep(&mut self, written: ObjectId, objects: &Objects) {
        let number = |place: Option<Place>| {
            let place = place.filter(|place| place.store.unwrap_or(place.object) == written)?;
            Some((*objects.bytes(place.object)?.first()?, place.needs_power_cycle))
        };
        let (node, rate, shown) = (number(self.node_at), number(self.rate_at), self.shown_rate());
        if let Some((number, needs_power_cycle)) = node
            && let Ok(node) = NodeId::new(number)
        {
            self.persistent.node = Some(node);
            self.pending.node = if needs_power_cycle { self.pending.node } else { Some(node) };
        }
        // A write of the detected bit rate does not disable automatic detection.
        if let Some((code, needs_power_cycle)) = rate.filter(|(code, _)| Some(*code) != shown)
            && let Some(rate) = self.rate(code)
        {
            self.persistent.rate = rate;
            self.pending.rate = if needs_power_cycle { self.pending.rate } else { rate };
        }
    }

    /// Writes the active pair into the objects.
    pub(super) fn show(&self, objects: &mut Objects) {
        let node = self.active.node.map(NodeId::get);
        for (place, number) in [(self.node_at, node), (self.rate_at, self.shown_rate())] {
            if let (Some(place), Some(number)) = (place, number) {
                let width = objects.bytes(place.object).map_or(1, <[u8]>::len);
                let mut bytes = vec![0; width];
                bytes.iter_mut().take(1).for_each(|byte| *byte = number);
                objects.put(place.object, bytes);
            }
        }
    }

    /// The code of the active bit rate or, with automatic detection, of the detected bit rate (MH-4, 4.3.9).
    fn shown_rate(&self) -> Option<u8> {
        let rate = match self.active.rate {
            BitRate::At(rate) => rate,
            BitRate::Auto => self.bus_bit_rate?,
        };
        self.object_codes.iter().find(|(_, known)| *known == BitRate::At(rate)).map(|(code, _)| *code)
    }
}
