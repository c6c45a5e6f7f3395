//! TPDOs of a simulated device (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38): the rules for their parameters, and the
//! causes of a transmission.

use super::abort::Abort;
use super::channels::Channels;
use super::device::next_due;
use super::objects::Objects;
use crate::bus::time::Mono;
use crate::canopen::id::CanId;
use crate::canopen::object::ObjectId;
use crate::device::description::{PdoStyle, Remap};
use std::time::Duration;

pub(super) const COB_ID_SYNC: u16 = 0x1005;
pub(super) const COB_ID_EMCY: u16 = 0x1014;
/// The period of SYNC. A device with this object can produce SYNC.
const SYNC_PERIOD: ObjectId = ObjectId::new(0x1006, 0);

/// One TPDO.
#[derive(Clone, Debug)]
pub(super) struct Tpdo {
    /// The number of the TPDO, counted from 0 (1800h and 1A00h).
    number: u16,
    style: PdoStyle,
    /// SYNCs since the last transmission.
    syncs: u8,
    /// The data of the last transmission, for "if changed".
    sent: Option<Vec<u8>>,
    sent_at: Option<Mono>,
    /// When the event timer elapses.
    timer: Option<Mono>,
    /// The end of the inhibit time, if an event waits for it.
    held_back: Option<Mono>,
    watches: Vec<Watch>,
    /// The next time to compare the values that can cause an event.
    compare_at: Option<Mono>,
}

/// A mapped value whose change can cause an event (CiA 404: x133h to x136h).
#[derive(Clone, Debug)]
struct Watch {
    object: ObjectId,
    delta: f64,
    /// Lower and upper limit; both 0 means none.
    limits: Option<(f64, f64)>,
    hysteresis: f64,
    /// The value of the last transmission.
    reference: f64,
    below: bool,
    above: bool,
    /// Whether the value can reach a limit or change by the delta.
    is_possible: bool,
}

/// The cause of a transmission.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Cause {
    /// The SYNC or the event timer of the TPDO.
    Due,
    /// A SYNC. The TPDO is sent if the values have changed.
    IfChanged,
    /// A remote request. The count of SYNCs continues.
    Requested,
}

impl Tpdo {
    /// Returns all TPDOs in the object dictionary.
    pub(super) fn all(objects: &Objects, style: PdoStyle) -> Vec<Tpdo> {
        objects.indexes(0x1800..=0x19ff).into_iter().map(|index| Tpdo::new(index - 0x1800, style)).collect()
    }

    fn new(number: u16, style: PdoStyle) -> Tpdo {
        Tpdo {
            number,
            style,
            syncs: 0,
            sent: None,
            sent_at: None,
            timer: None,
            held_back: None,
            watches: Vec::new(),
            compare_at: None,
        }
    }

    fn communication(&self, sub: u8) -> ObjectId {
        ObjectId::new(0x1800 + self.number, sub)
    }

    fn kind(&self, objects: &Objects) -> u32 {
        objects.number(self.communication(2))
    }

    fn event_timer(&self, objects: &Objects) -> Option<Duration> {
        let milliseconds = objects.number(self.communication(5));
        let is_used = u8::try_from(self.kind(objects)).is_ok_and(|kind| self.style.uses_timer(kind));
        (milliseconds > 0 && is_used).then(|| Duration::from_millis(milliseconds.into()))
    }

    fn is_event_driven(&self, objects: &Objects) -> bool {
        matches!(self.kind(objects), 254 | 255)
    }

    /// Returns the COB-ID, if the TPDO is valid.
    pub(super) fn cob_id(&self, objects: &Objects) -> Option<CanId> {
        let cob_id = objects.number(self.communication(1));
        let id = u16::try_from(cob_id & 0x7ff).ok()?;
        if is_valid(cob_id) { CanId::standard(id) } else { None }
    }

    /// Whether the TPDO answers remote requests with this identifier.
    pub(super) fn answers(&self, objects: &Objects, id: CanId) -> bool {
        let refuses = objects.number(self.communication(1)) & 0x4000_0000 != 0;
        !refuses && self.cob_id(objects) == Some(id)
    }

    /// Returns the present mapping.
    pub(super) fn mapping(&self, objects: &Objects) -> Vec<ObjectId> {
        let map = 0x1a00 + self.number;
        let count = u8::try_from(objects.number(ObjectId::new(map, 0))).unwrap_or(0);
        (1..=count).map(|sub| split_entry(objects.number(ObjectId::new(map, sub))).0).collect()
    }

    /// Whether an index belongs to this TPDO.
    pub(super) fn is_configured_by(&self, index: u16) -> bool {
        index == 0x1800 + self.number || index == 0x1a00 + self.number
    }

    /// Restarts the TPDO when the node becomes OPERATIONAL or when a parameter of the TPDO is written. Sends nothing.
    pub(super) fn start(&mut self, objects: &Objects, channels: &mut Channels, now: Mono) {
        *self = Tpdo::new(self.number, self.style);
        self.timer = self.event_timer(objects).map(|period| now + period);
        self.watch(objects, channels, now, false);
    }

    /// Determines the values that can cause an event. If `keeps`, they are compared with the values before: the last
    /// transmitted values, and the limits that were crossed.
    pub(super) fn watch(&mut self, objects: &Objects, channels: &mut Channels, now: Mono, keeps: bool) {
        let before = std::mem::take(&mut self.watches);
        if self.is_event_driven(objects) && self.cob_id(objects).is_some() {
            for object in self.mapping(objects) {
                let Some(mut watch) = Watch::new(objects, channels, object, now.since_start()) else { continue };
                if let Some(last) = before.iter().find(|last| keeps && last.object == object) {
                    (watch.reference, watch.below, watch.above) = (last.reference, last.below, last.above);
                }
                self.watches.push(watch);
            }
        }
        self.schedule_comparison(objects, channels, now);
        if keeps && !self.watches.is_empty() {
            self.compare_at = Some(now);
        }
    }

    /// Stops the TPDO when the node leaves OPERATIONAL.
    pub(super) fn stop(&mut self) {
        *self = Tpdo::new(self.number, self.style);
    }

    fn schedule_comparison(&mut self, objects: &Objects, channels: &mut Channels, now: Mono) {
        let next = |watch: &Watch| channels.next_sample(objects, watch.object, now.since_start());
        self.compare_at = self.watches.iter().filter(|watch| watch.is_possible).filter_map(next).min().map(Mono::at);
    }

    /// Handles a SYNC. Returns the cause if the TPDO must be sent.
    pub(super) fn sync(&mut self, objects: &Objects) -> Option<Cause> {
        match self.kind(objects) {
            0 => Some(Cause::IfChanged),
            every @ 1..=240 => {
                self.syncs = self.syncs.saturating_add(1);
                (u32::from(self.syncs) >= every).then_some(Cause::Due)
            }
            _ => None,
        }
    }

    /// Handles what is due at `now`. Returns the cause if the event timer or an event triggers a transmission.
    pub(super) fn wake(&mut self, objects: &Objects, channels: &mut Channels, now: Mono) -> Option<Cause> {
        let mut event = self.held_back.is_some_and(|due| due <= now);
        if self.compare_at.is_some_and(|due| due <= now) {
            for watch in &mut self.watches {
                event |= watch.compare(objects, channels, now.since_start());
            }
            self.schedule_comparison(objects, channels, now);
        }
        event |= self.timer.is_some_and(|due| due <= now);
        if !event {
            return None;
        }
        // The timer counts from its previous due time, so that it does not drift.
        let from = self.timer.filter(|due| *due <= now).unwrap_or(now);
        self.timer = self.event_timer(objects).map(|period| next_due(from, period, now));
        let inhibit = Duration::from_micros(100) * objects.number(self.communication(3));
        let free = self.sent_at.map_or(now, |sent| sent + inhibit);
        self.held_back = (free > now).then_some(free);
        self.held_back.is_none().then_some(Cause::Due)
    }

    /// The next time at which [`Tpdo::wake`] must be called.
    pub(super) fn next_wake(&self) -> Option<Mono> {
        Mono::earlier(Mono::earlier(self.timer, self.held_back), self.compare_at)
    }

    /// Records a transmission. Returns `false` if nothing is sent because nothing changed.
    pub(super) fn note(
        &mut self,
        cause: Cause,
        data: &[u8],
        objects: &Objects,
        channels: &mut Channels,
        now: Mono,
    ) -> bool {
        if cause == Cause::IfChanged && self.sent.as_deref() == Some(data) {
            return false;
        }
        self.sent = Some(data.to_vec());
        self.sent_at = Some(now);
        if cause != Cause::Requested {
            self.syncs = 0;
        }
        for watch in &mut self.watches {
            watch.reference = channels.number(objects, watch.object, now.since_start()).unwrap_or(watch.reference);
        }
        true
    }
}

impl Watch {
    /// Creates the watch of a mapped value; `None` if the value can cause no event.
    fn new(objects: &Objects, channels: &mut Channels, object: ObjectId, time: Duration) -> Option<Watch> {
        let value = channels.number(objects, object, time)?;
        let parameter = |offset| objects.real(ObjectId::new(object.index.saturating_add(offset), object.sub));
        // Only x130h has its parameters at x133h.
        let family = object.index & 0x0fff == 0x130;
        let (delta, lower, upper, hysteresis) =
            if family { (parameter(3), parameter(4), parameter(5), parameter(6)) } else { (None, None, None, None) };
        let delta = delta.unwrap_or(0.0);
        let limits = lower.zip(upper).filter(|limits| *limits != (0.0, 0.0));
        let (lowest, highest) = channels.reach(objects, object)?;
        let reachable = limits.is_some_and(|(lower, upper)| lowest < lower || upper < highest);
        (delta > 0.0 || limits.is_some()).then(|| Watch {
            object,
            delta,
            limits,
            hysteresis: hysteresis.unwrap_or(0.0),
            reference: value,
            below: limits.is_some_and(|(lower, _)| value < lower),
            above: limits.is_some_and(|(_, upper)| value > upper),
            is_possible: delta > 0.0 || reachable,
        })
    }

    /// Whether the value changed by the delta, or left the range between the limits since the last call.
    fn compare(&mut self, objects: &Objects, channels: &mut Channels, time: Duration) -> bool {
        let Some(value) = channels.number(objects, self.object, time) else { return false };
        let mut event = self.delta > 0.0 && (value - self.reference).abs() >= self.delta;
        if let Some((lower, upper)) = self.limits {
            let (was_below, was_above) = (self.below, self.above);
            self.below = value < lower || (was_below && value < lower + self.hysteresis);
            self.above = value > upper || (was_above && value > upper - self.hysteresis);
            event |= (self.below && !was_below) || (self.above && !was_above);
        }
        event
    }
}

/// Whether the PDO is valid: bit 31 of its COB-ID is 0.
fn is_valid(cob_id: u32) -> bool {
    cob_id & 0x8000_0000 == 0
}

/// Splits a mapping entry into the object and its length in bits.
fn split_entry(entry: u32) -> (ObjectId, u32) {
    let [bits, sub, low, high] = entry.to_le_bytes();
    (ObjectId::new(u16::from_le_bytes([low, high]), sub), bits.into())
}

/// Checks a write to the parameters of a TPDO, or to the COB-ID of SYNC or EMCY.
pub(super) fn check(
    objects: &Objects,
    remap: Remap,
    pre_operational: bool,
    object: ObjectId,
    bytes: &[u8],
) -> Result<(), Abort> {
    let number = bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte));
    match object.index {
        // Bit 30 means that the device produces SYNC.
        COB_ID_SYNC if number & 0x4000_0000 != 0 && !objects.has(SYNC_PERIOD) => Err(Abort::VALUE),
        COB_ID_SYNC => check_identifier(number),
        COB_ID_EMCY if is_valid(number) => check_identifier(number),
        0x1800..=0x19ff => check_communication(objects, object, number),
        0x1a00..=0x1bff => check_mapping(objects, remap, pre_operational, object, number),
        _ => Ok(()),
    }
}

/// Whether a COB-ID has a 29-bit identifier (bits 11 to 29), which is not supported.
fn is_extended(cob_id: u32) -> bool {
    cob_id & 0x3fff_f800 != 0
}

/// Checks that CiA 301 allows the identifier of a COB-ID.
fn check_identifier(cob_id: u32) -> Result<(), Abort> {
    let id = CanId::Standard(u16::try_from(cob_id & 0x7ff).unwrap_or(0));
    if is_extended(cob_id) || id.is_restricted() { Err(Abort::VALUE) } else { Ok(()) }
}

fn check_communication(objects: &Objects, object: ObjectId, number: u32) -> Result<(), Abort> {
    let old = objects.number(object.with_sub(1));
    match object.sub {
        1 => {
            let moved = is_valid(old) && is_valid(number) && old & 0x7ff != number & 0x7ff;
            if is_extended(number) || moved {
                return Err(Abort::VALUE);
            }
            if is_valid(number) {
                check_identifier(number)?;
            }
        }
        2 if (241..=253).contains(&number) => return Err(Abort::VALUE),
        // The inhibit time can change only while the PDO is not valid.
        3 if is_valid(old) && number != objects.number(object) => return Err(Abort::VALUE),
        _ => {}
    }
    Ok(())
}

fn check_mapping(
    objects: &Objects,
    remap: Remap,
    pre_operational: bool,
    object: ObjectId,
    number: u32,
) -> Result<(), Abort> {
    match remap {
        Remap::Invalidate if is_valid(objects.number(ObjectId::new(object.index - 0x200, 1))) => {
            return Err(Abort::UNSUPPORTED);
        }
        Remap::CountOnly if !pre_operational => return Err(Abort::DEVICE_STATE),
        _ => {}
    }
    if object.sub > 0 {
        if objects.number(object.with_sub(0)) != 0 {
            return Err(Abort::UNSUPPORTED);
        }
        return if number == 0 { Ok(()) } else { check_mappable(objects, number).map(|_| ()) };
    }
    let mut bits = 0;
    for sub in 1..=u8::try_from(number).unwrap_or(u8::MAX) {
        bits += check_mappable(objects, objects.number(object.with_sub(sub)))?;
    }
    if bits > 64 { Err(Abort::PDO_LENGTH) } else { Ok(()) }
}

/// Checks that an object can be mapped. Returns the length of its mapping entry in bits.
fn check_mappable(objects: &Objects, entry: u32) -> Result<u32, Abort> {
    let (object, bits) = split_entry(entry);
    let spec = objects.spec(object).filter(|spec| spec.pdo).ok_or(Abort::NOT_MAPPABLE)?;
    let width = spec.data_type.width().and_then(|bytes| u32::try_from(8 * bytes).ok());
    if width == Some(bits) { Ok(bits) } else { Err(Abort::NOT_MAPPABLE) }
}
