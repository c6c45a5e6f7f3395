//! Node-ID and bit rate of a simulated device: what is in force, what waits to be, what survives without power.

use super::objects::Objects;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::assign::{Applies, AssignEntry, AssignPlace, AssignWay};
use crate::device::description::Description;

/// The bit timing table 0 of CiA 305, in bit/s; 5 is reserved.
const STANDARD: [(u8, u32); 8] =
    [(0, 1_000_000), (1, 800_000), (2, 500_000), (3, 250_000), (4, 125_000), (6, 50_000), (7, 20_000), (8, 10_000)];

/// A bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rate {
    /// This one, in bit/s.
    At(u32),
    /// That of the bus.
    Auto,
}

/// Node-ID and bit rate. Without a node-ID the device is unconfigured.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Pair {
    pub(super) node: Option<NodeId>,
    pub(super) rate: Rate,
}

/// The three pairs of CiA 305, and the objects in which the device shows and takes them.
#[derive(Clone, Debug)]
pub(super) struct Settings {
    /// In force.
    pub(super) active: Pair,
    /// In force after the next reset.
    pub(super) pending: Pair,
    /// In force after power on.
    pub(super) persistent: Pair,
    /// The bit rate of the bus, where somebody has told it.
    pub(super) wire: Option<u32>,
    /// What stands in a request for which rate.
    codes: Vec<(u8, Rate)>,
    node_at: Option<Place>,
    rate_at: Option<Place>,
}

/// An object that takes a setting.
#[derive(Clone, Copy, Debug)]
struct Place {
    object: ObjectId,
    /// What has to be written for it to last; none where writing is enough.
    store: Option<ObjectId>,
    /// Whether only power on brings it into force.
    needs_power: bool,
}

impl Settings {
    pub(super) fn new(description: &Description, objects: &Objects, pair: Pair) -> Settings {
        let mut codes: Vec<(u8, Rate)> =
            description.bit_rates.iter().map(|(code, rate)| (*code, Rate::At(*rate))).collect();
        if codes.is_empty() {
            codes = STANDARD.map(|(code, rate)| (code, Rate::At(rate))).to_vec();
        }
        codes.extend(description.auto_bit_rate.map(|code| (code, Rate::Auto)));
        let way = description.assign.iter().find(|entry| entry.way == AssignWay::Objects);
        let place = |place: fn(&AssignEntry) -> Option<AssignPlace>| {
            let entry = way?;
            let object = place(entry)?.object;
            let needs_power = entry.applies == Applies::Power;
            objects.has(object).then_some(Place { object, store: entry.store, needs_power })
        };
        Settings {
            active: pair,
            pending: pair,
            persistent: pair,
            wire: None,
            codes,
            node_at: place(|entry| entry.node_id),
            rate_at: place(|entry| entry.bit_rate),
        }
    }

    /// What is in force after power on.
    pub(super) fn power_on(&mut self) {
        self.pending = self.persistent;
        self.active = self.persistent;
    }

    /// What is in force after a reset.
    pub(super) fn reset(&mut self) {
        self.active = self.pending;
    }

    /// The bit rate of the bus; a device of which nothing else is said was made for it.
    pub(super) fn tell_wire(&mut self, bit_rate: u32, is_given: bool) {
        if self.wire.is_none() && !is_given {
            for pair in [&mut self.active, &mut self.pending, &mut self.persistent] {
                pair.rate = Rate::At(bit_rate);
            }
        }
        self.wire = Some(bit_rate);
    }

    /// Takes a node-ID for later, FFh for none; `false` if it is neither.
    pub(super) fn configure_node(&mut self, number: u8) -> bool {
        let node = NodeId::new(number).ok();
        let is_taken = node.is_some() || number == 0xff;
        if is_taken {
            self.pending.node = node;
        }
        is_taken
    }

    /// Takes a bit rate for later; `false` if the device has none of that code.
    pub(super) fn configure_rate(&mut self, code: u8) -> bool {
        match self.rate(code) {
            Some(rate) => {
                self.pending.rate = rate;
                true
            }
            None => false,
        }
    }

    fn rate(&self, code: u8) -> Option<Rate> {
        self.codes.iter().find(|(known, _)| *known == code).map(|(_, rate)| *rate)
    }

    /// Whether an object may be written with this, as far as node-ID and bit rate go.
    pub(super) fn allows(&self, object: ObjectId, bytes: &[u8]) -> bool {
        let is = |place: Option<Place>| place.is_some_and(|place| place.object == object);
        let number = bytes.first().copied().unwrap_or_default();
        if is(self.node_at) { NodeId::new(number).is_ok() } else { !is(self.rate_at) || self.rate(number).is_some() }
    }

    /// `written` was written: the store command that keeps what stands in the objects, or an object that
    /// needs none.
    pub(super) fn keep(&mut self, written: ObjectId, objects: &Objects) {
        let number = |place: Option<Place>| {
            let place = place.filter(|place| place.store.unwrap_or(place.object) == written)?;
            Some((*objects.bytes(place.object)?.first()?, place.needs_power))
        };
        let (node, rate, shown) = (number(self.node_at), number(self.rate_at), self.shown_rate());
        if let Some((number, needs_power)) = node
            && let Ok(node) = NodeId::new(number)
        {
            self.persistent.node = Some(node);
            self.pending.node = if needs_power { self.pending.node } else { Some(node) };
        }
        // An object that shows the rate found does not turn automatic detection off.
        if let Some((code, needs_power)) = rate.filter(|(code, _)| Some(*code) != shown)
            && let Some(rate) = self.rate(code)
        {
            self.persistent.rate = rate;
            self.pending.rate = if needs_power { self.pending.rate } else { rate };
        }
    }

    /// Shows in the objects what is in force.
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

    /// The code of the bit rate in force; with automatic detection of the one found (MH-4, 4.3.9).
    fn shown_rate(&self) -> Option<u8> {
        let rate = match self.active.rate {
            Rate::At(rate) => rate,
            Rate::Auto => self.wire?,
        };
        self.codes.iter().find(|(_, known)| *known == Rate::At(rate)).map(|(code, _)| *code)
    }
}
