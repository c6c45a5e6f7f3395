//! Emergencies of a simulated device: pending errors, the error register, the history, and the frames.

use super::device::next_due;
use super::objects::Objects;
use crate::bus::time::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::device::description::{Description, EmergencyEntry, ErrorHistory};
use crate::device::quirk::Quirk;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

const ERROR_REGISTER: ObjectId = ObjectId::new(0x1001, 0);
const HISTORY: ObjectId = ObjectId::new(0x1003, 0);
const EMCY_COB_ID: ObjectId = ObjectId::new(0x1014, 0);
const INHIBIT_TIME: ObjectId = ObjectId::new(0x1015, 0);

/// The emergencies of one device.
#[derive(Clone, Debug, Default)]
pub(super) struct Emergencies {
    described: Vec<EmergencyEntry>,
    layout: ErrorHistory,
    /// Pending codes with their channels; channel 0 is the device itself.
    pending: BTreeMap<u16, BTreeSet<u8>>,
    history: VecDeque<u32>,
    /// The number of errors in 1003h:0, for a device without the entries 1003h:1 to 254.
    count: u8,
    waiting: VecDeque<[u8; 8]>,
    /// End of the inhibit time.
    inhibited_until: Mono,
    /// Whether the device has [`Quirk::EmergencyRepeats`].
    repeats: bool,
    /// The message that is repeated while an error is pending, and the time of its next repetition.
    next_repeat: Option<([u8; 8], Mono)>,
}

impl Emergencies {
    pub(super) fn new(description: &Description) -> Emergencies {
        let described = description.emergencies.clone();
        let repeats = description.quirks.contains(&Quirk::EmergencyRepeats);
        Emergencies { described, layout: description.error_history, repeats, ..Emergencies::default() }
    }

    /// Whether the device can send this emergency.
    pub(super) fn knows(&self, code: u16) -> bool {
        self.described.iter().any(|entry| entry.code == code)
    }

    /// Records an error of a channel. A code that is already pending is not sent again.
    pub(super) fn raise(&mut self, objects: &mut Objects, code: u16, channel: u8, status: u8) {
        let known = self.pending.contains_key(&code);
        self.pending.entry(code).or_default().insert(channel);
        if known {
            return;
        }
        let described = self.described.iter().find(|entry| entry.code == code);
        let mut extra = [0; 5];
        for (byte, meaning) in extra.iter_mut().zip(described.map_or(&[][..], |entry| &entry.bytes)) {
            *byte = byte_value(meaning, channel, status);
        }
        let entries = self.capacity(objects);
        if entries > 0 {
            let [low, high] = code.to_le_bytes();
            self.history.push_front(u32::from_le_bytes(match self.layout {
                ErrorHistory::CodeLow => [low, high, 0, 0],
                ErrorHistory::CodeLowBytesSwapped => [low, high, extra[1], extra[0]],
                ErrorHistory::CodeHigh => [0, 0, low, high],
            }));
            self.history.truncate(entries);
        }
        self.count = self.count.saturating_add(1);
        self.publish(objects);
        self.queue(objects, code, extra);
    }

    /// Records the end of an error.
    pub(super) fn clear(&mut self, objects: &mut Objects, code: u16, channel: u8) {
        let Some(channels) = self.pending.get_mut(&code) else { return };
        channels.remove(&channel);
        if channels.is_empty() {
            self.pending.remove(&code);
            self.publish(objects);
            self.queue(objects, 0x0000, [0; 5]);
        }
    }

    /// Deletes the history; pending errors stay pending.
    pub(super) fn clear_history(&mut self, objects: &mut Objects) {
        self.history.clear();
        self.count = 0;
        self.publish(objects);
    }

    /// Ends all errors.
    pub(super) fn end(&mut self, objects: &mut Objects) {
        self.pending.clear();
        self.publish(objects);
        self.queue(objects, 0x0000, [0; 5]);
    }

    /// Resets everything, as at power-on.
    pub(super) fn forget(&mut self) {
        self.pending.clear();
        self.next_repeat = None;
        self.history.clear();
        self.count = 0;
        self.waiting.clear();
    }

    /// Drops the waiting messages, as in STOPPED.
    pub(super) fn drop_waiting(&mut self) {
        self.waiting.clear();
    }

    /// Writes register and history to their objects.
    pub(super) fn publish(&self, objects: &mut Objects) {
        objects.put(ERROR_REGISTER, vec![self.register()]);
        let capacity = u8::try_from(self.capacity(objects)).unwrap_or(u8::MAX);
        let entries = u8::try_from(self.history.len()).unwrap_or(u8::MAX);
        objects.put(HISTORY, vec![if capacity == 0 { self.count } else { entries }]);
        for sub in 1..=capacity {
            let error = self.history.get(usize::from(sub) - 1).copied().unwrap_or(0);
            objects.put(HISTORY.with_sub(sub), error.to_le_bytes().to_vec());
        }
    }

    /// The value of 1001h: bit 0 is set with every error.
    fn register(&self) -> u8 {
        self.pending.keys().fold(0, |register, code| {
            let described = self.described.iter().find(|entry| entry.code == *code);
            let own = described.map_or(0, |entry| {
                entry.register.unwrap_or(0)
                    | entry.register_bit.map_or(0, |bit| 1u8.checked_shl(bit.into()).unwrap_or(0))
            });
            register | own | 1
        })
    }

    /// Returns the number of errors that 1003h can hold.
    fn capacity(&self, objects: &Objects) -> usize {
        (1..=254).take_while(|sub| objects.has(HISTORY.with_sub(*sub))).count()
    }

    fn queue(&mut self, objects: &Objects, code: u16, extra: [u8; 5]) {
        let [low, high] = code.to_le_bytes();
        let register = objects.bytes(ERROR_REGISTER).and_then(|bytes| bytes.first().copied()).unwrap_or(0);
        let [a, b, c, d, e] = extra;
        self.waiting.push_back([low, high, register, a, b, c, d, e]);
    }

    /// Queues the repeated emergency of a pending error when it is due.
    pub(super) fn repeat(&mut self, objects: &Objects, now: Mono) {
        let Some((message, due)) = self.next_repeat else { return };
        if self.pending.is_empty() {
            self.next_repeat = None;
        } else if due <= now {
            self.waiting.push_back(message);
            self.next_repeat = repeat_time(objects).map(|period| (message, next_due(due, period, now)));
        }
    }

    /// Returns the next message, if there is one and the inhibit time has passed.
    pub(super) fn next_frame(&mut self, objects: &Objects, node: NodeId, now: Mono) -> Option<Frame> {
        if now < self.inhibited_until {
            return None;
        }
        let message = self.waiting.pop_front()?;
        if self.repeats && self.next_repeat.is_none() && !self.pending.is_empty() {
            self.next_repeat = repeat_time(objects).map(|period| (message, now + period));
        }
        self.inhibited_until = now + Duration::from_micros(100) * objects.number(INHIBIT_TIME);
        Some(Frame::full(cob_id(objects, node)?, message))
    }

    /// The time of the next message of [`Emergencies::next_frame`].
    pub(super) fn next_wake(&self) -> Option<Mono> {
        let waiting = self.waiting.front().map(|_| self.inhibited_until);
        let next_repeat = self.next_repeat.map(|(_, due)| due);
        Mono::earlier(waiting, next_repeat)
    }
}

/// Returns the repeat period of a pending error; `None` if it is sent once.
fn repeat_time(objects: &Objects) -> Option<Duration> {
    let (object, _) = objects.specs().find(|(_, spec)| spec.name == "emcy-repeat-time")?;
    Some(objects.number(object)).filter(|&period| period > 0).map(|period| Duration::from_millis(period.into()))
}

/// Returns the COB-ID of emergencies: 1014h, unless its bit 31 disables them.
fn cob_id(objects: &Objects, node: NodeId) -> Option<CanId> {
    if !objects.has(EMCY_COB_ID) {
        return Some(CanId::emergency(node));
    }
    let cob_id = objects.number(EMCY_COB_ID);
    let id = u16::try_from(cob_id & 0x7ff).ok()?;
    if cob_id & 0x8000_0000 == 0 { CanId::standard(id) } else { None }
}

/// Returns the value of a message byte from its meaning in the manual: "1 (channel)", "AI status 6150h", "0".
fn byte_value(meaning: &str, channel: u8, status: u8) -> u8 {
    let meaning = meaning.to_ascii_lowercase();
    if meaning.contains("channel") {
        channel
    } else if meaning.contains("status") {
        status
    } else {
        meaning.trim().parse().unwrap_or(0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::catalog;

    fn node() -> NodeId {
        NodeId::new(5).expect("a node-ID")
    }

    fn mh4() -> (Objects, Emergencies) {
        let model = catalog::by_name("mh4").expect("built in");
        (Objects::new(&model, node()), Emergencies::new(&model.description))
    }

    fn frames(objects: &Objects, emergencies: &mut Emergencies) -> Vec<String> {
        std::iter::from_fn(|| emergencies.next_frame(objects, node(), Mono::START))
            .map(|frame| frame.to_string())
            .collect()
    }

    #[test]
    fn each_error_sends_one_message_and_one_at_its_end() {
        let (mut objects, mut emergencies) = mh4();
        emergencies.raise(&mut objects, 0xf001, 1, 0x03);
        assert_eq!(frames(&objects, &mut emergencies), ["085#01F0810103000000"]);
        assert_eq!(objects.number(ERROR_REGISTER), 0x81);
        assert_eq!(objects.number(HISTORY), 1);
        // Byte 4 in bits 16 to 23, byte 3 in bits 24 to 31.
        assert_eq!(objects.number(HISTORY.with_sub(1)), 0x0103_f001);
        // The same code on another channel while it is pending sends nothing.
        emergencies.raise(&mut objects, 0xf001, 2, 0x05);
        emergencies.clear(&mut objects, 0xf001, 1);
        assert_eq!(frames(&objects, &mut emergencies), Vec::<String>::new());
        emergencies.clear(&mut objects, 0xf001, 2);
        assert_eq!(frames(&objects, &mut emergencies), ["085#0000000000000000"]);
        assert_eq!(objects.number(ERROR_REGISTER), 0);
        assert_eq!(objects.number(HISTORY), 1, "the history stays");
        emergencies.clear(&mut objects, 0xf001, 2);
        assert_eq!(frames(&objects, &mut emergencies), Vec::<String>::new());
        emergencies.clear_history(&mut objects);
        assert_eq!((objects.number(HISTORY), objects.number(HISTORY.with_sub(1))), (0, 0));
    }

    #[test]
    fn pending_errors_stay_in_the_register() {
        let (mut objects, mut emergencies) = mh4();
        emergencies.raise(&mut objects, 0xf001, 1, 0x03);
        emergencies.raise(&mut objects, 0x8240, 0, 0);
        emergencies.clear(&mut objects, 0xf001, 1);
        assert_eq!(
            frames(&objects, &mut emergencies),
            ["085#01F0810103000000", "085#4082910000000000", "085#0000110000000000"]
        );
    }

    #[test]
    fn the_history_keeps_the_newest() {
        let (mut objects, mut emergencies) = mh4();
        for code in [0x1000, 0x4200, 0x5030, 0x8110, 0x8120] {
            emergencies.raise(&mut objects, code, 0, 0);
        }
        assert_eq!(objects.number(HISTORY), 4);
        let codes: Vec<u32> = (1..=4).map(|sub| objects.number(HISTORY.with_sub(sub)) & 0xffff).collect();
        assert_eq!(codes, [0x8120, 0x8110, 0x5030, 0x4200]);
    }

    #[test]
    fn inhibit_time_delays_messages() {
        let (mut objects, mut emergencies) = mh4();
        objects.put(INHIBIT_TIME, 50u16.to_le_bytes().to_vec());
        emergencies.raise(&mut objects, 0xf001, 1, 0x03);
        emergencies.clear(&mut objects, 0xf001, 1);
        assert!(emergencies.next_frame(&objects, node(), Mono::START).is_some());
        assert!(emergencies.next_frame(&objects, node(), Mono::at(Duration::from_micros(4999))).is_none());
        assert_eq!(emergencies.next_wake(), Some(Mono::at(Duration::from_millis(5))));
        assert!(emergencies.next_frame(&objects, node(), Mono::at(Duration::from_millis(5))).is_some());
        assert_eq!(emergencies.next_wake(), None);
    }

    #[test]
    fn cob_id_moves_or_disables_emergencies() {
        let (mut objects, mut emergencies) = mh4();
        objects.put(EMCY_COB_ID, 0x99u32.to_le_bytes().to_vec());
        emergencies.raise(&mut objects, 0x8110, 0, 0);
        assert_eq!(frames(&objects, &mut emergencies), ["099#1081110000000000"]);
        objects.put(EMCY_COB_ID, 0x8000_0099u32.to_le_bytes().to_vec());
        emergencies.raise(&mut objects, 0x8120, 0, 0);
        assert_eq!(frames(&objects, &mut emergencies), Vec::<String>::new());
        assert_eq!(objects.number(HISTORY), 2);
    }

    #[test]
    fn dps_has_its_own_codes_and_registers() {
        let model = catalog::by_name("dps").expect("built in");
        let mut objects = Objects::new(&model, node());
        let mut emergencies = Emergencies::new(&model.description);
        emergencies.raise(&mut objects, 0x3201, 1, 0x03);
        assert_eq!(frames(&objects, &mut emergencies), ["085#0132050000000000"]);
        // The appendix lists 1003h:0 only, so the errors are counted without entries.
        assert_eq!(objects.number(HISTORY), 1);
        emergencies.clear(&mut objects, 0x3201, 1);
        emergencies.raise(&mut objects, 0x3201, 1, 0x05);
        assert_eq!(objects.number(HISTORY), 2);
        emergencies.clear_history(&mut objects);
        assert_eq!(objects.number(HISTORY), 0);
    }
}
