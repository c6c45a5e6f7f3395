//! Events (x133h delta, x134h lower limit, x135h upper limit) send a TPDO.
//!
//! The process value is moved by its offset, if the device has one that can be written. A missing TPDO is a deviation
//! only if reads show that the value has moved.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::pdo::{self, Tpdo, mapping::mapping};
use super::super::session::{SETTLE, Session};
use super::{Channel, Readings, channels, offset_object, rounding, step, touch_numbers};
use crate::bus::Received;
use crate::canopen::id::CanId;
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{SdoError, SdoFailure};
use crate::node::write::write_with;
use crate::node::{Error, WriteOptions};
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("404-60", "A change of the process value by the delta (x133h) sends the TPDO", DELTA_CLAUSE, delta)
        .matters(High, "Masters do not notice a change.")
        .alone(),
    case("404-61", "A smaller change than the delta (x133h) sends no TPDO", DELTA_CLAUSE, no_delta)
        .matters(Medium, "TPDOs without a new value load the bus.")
        .alone(),
    case(
        "404-62",
        "A process value above the upper limit (x135h) sends the TPDO",
        "CiA 404, object x135h",
        upper_limit,
    )
    .matters(High, "Masters do not notice that the limit is exceeded.")
    .alone(),
    case(
        "404-63",
        "A process value below the lower limit (x134h) sends the TPDO",
        "CiA 404, object x134h",
        lower_limit,
    )
    .matters(High, "Masters do not notice a value below the limit.")
    .alone(),
    case("404-64", "No event sends a TPDO in PRE-OPERATIONAL", "CiA 301, services in each NMT state", silent)
        .matters(High, "Measurements are sent before the network is set up.")
        .alone(),
];

const DELTA_CLAUSE: &str = "CiA 404, object x133h";

/// The distance of the parameters of events from the process value (x130h).
const DELTA: u16 = 3;
const LOWER: u16 = 4;
const UPPER: u16 = 5;

/// A TPDO whose process value can cause events.
struct Events {
    tpdo: Tpdo,
    channel: Channel,
    value: ObjectId,
    data_type: DataType,
    digits: u8,
    /// The process value before the event.
    present: Readings,
    /// A change that is larger than the noise.
    change: f64,
}

impl Events {
    fn parameter(&self, distance: u16) -> ObjectId {
        ObjectId::new(self.value.index + distance, self.value.sub)
    }

    fn id(&self) -> CanId {
        self.tpdo.cob_id.can_id()
    }
}

/// The first TPDO with a mapped process value that has a delta.
fn find(session: &mut Session<'_, '_>) -> Result<Option<(Tpdo, Channel, ObjectId, DataType)>, Error> {
    let channels = channels(session)?;
    for tpdo in pdo::tpdos(session)? {
        for entry in mapping(session, tpdo)? {
            let [_, sub, low, high] = entry.to_le_bytes();
            let object = ObjectId::new(u16::from_le_bytes([low, high]), sub);
            let delta = ObjectId::new(object.index.saturating_add(DELTA), sub);
            if object.index & 0xfff != 0x130 || session.settings.before(delta).is_none() {
                continue;
            }
            for channel in &channels {
                if let Some(&(_, data_type)) = channel.values.iter().find(|(value, _)| *value == object) {
                    return Ok(Some((tpdo, channel.clone(), object, data_type)));
                }
            }
        }
    }
    Ok(None)
}

/// Prepares a TPDO that is sent by events only, without limits and delta. The node is PRE-OPERATIONAL.
fn prepare(session: &mut Session<'_, '_>) -> Result<Result<Events, Verdict>, Error> {
    let no_tpdo = Verdict::NotApplicable(WhyNot::NoTpdo);
    let Some((tpdo, channel, value, data_type)) = find(session)? else { return Ok(Err(no_tpdo)) };
    let Some(tpdo) = pdo::prepare_number(session, Some(tpdo.number))? else { return Ok(Err(no_tpdo)) };
    if !pdo::set_up(session, tpdo, 255, 0)? && !pdo::set_up(session, tpdo, 254, 0)? {
        return Ok(Err(no_tpdo));
    }
    touch_numbers(session, &channel)?;
    pdo::quiet(session)?;
    let digits = session.digits_of(&channel)?;
    let Some(present) = session.readings(value, data_type, digits)? else {
        return Ok(Err(Verdict::not_judged(WhyNot::NoValidValue(value))));
    };
    let middle = present.middle().abs();
    let change = (4.0 * present.spread()).max(0.02 * middle).max(20.0 * rounding(data_type, digits, middle)).max(0.001);
    Ok(Ok(Events { tpdo, channel, value, data_type, digits, present, change }))
}

/// Writes a parameter in the unit of the channel. `false` if the device rejects it.
fn set(session: &mut Session<'_, '_>, events: &Events, distance: u16, value: f64) -> Result<bool, Error> {
    let object = events.parameter(distance);
    let data_type = session.node.known_type(object).unwrap_or(events.data_type);
    let Some(bytes) = encode(value, data_type, events.digits) else { return Ok(false) };
    Ok(session.try_write(object, &bytes)?.is_none())
}

/// The bytes of a number, with the nearest value of an integer type.
fn encode(value: f64, data_type: DataType, digits: u8) -> Option<Vec<u8>> {
    let step = step(data_type, digits);
    let text = match data_type {
        DataType::Real32 | DataType::Real64 => value.to_string(),
        _ => format!("{:.0}", (value / step).round()),
    };
    data_type.encode_text(&text).ok()
}

/// The move of the process value in units of [`Events::change`]. The value may move back by itself meanwhile.
const MOVE: f64 = 10.0;

/// How long an event may take.
const REACTION: Duration = Duration::from_millis(200);

/// The wait for a change if the offset cannot be written.
const CHANGE_TIMEOUT: Duration = Duration::from_secs(2);

/// Moves the process value by its offset. Returns the number of TPDOs. Without an offset, waits for a change.
fn count_after_move(session: &mut Session<'_, '_>, events: &Events, by: f64) -> Result<usize, Error> {
    let (id, mut count) = (events.id(), 0);
    let is_tpdo = |received: &Received| received.frame.id() == id && !received.frame.is_remote();
    let mut time = CHANGE_TIMEOUT;
    if let Some(object) = offset_object(session, &events.channel) {
        let data_type = session.node.data_type(object);
        let old = session.quantity(object, data_type, events.digits)?;
        if let Some(bytes) = old.and_then(|old| encode(old + by, data_type, events.digits)) {
            session.touch(object)?;
            let mut watch = |received: &Received| count += usize::from(is_tpdo(received));
            let mut progress = |_| {};
            let mut options = WriteOptions::new(&mut progress, &mut watch);
            match write_with(session.master, &session.node, object, &bytes, &mut options) {
                Ok(_) => time = REACTION,
                Err(Error::Sdo(SdoError { failure: SdoFailure::Refused(_), .. })) => {}
                Err(error) => return Err(error),
            }
        }
    }
    Ok(count + session.collect(time)?.iter().filter(|received| is_tpdo(received)).count())
}

/// The verdict after a move: a TPDO must have been sent if the value has moved as far as `is_far`.
fn judge(
    session: &mut Session<'_, '_>,
    events: &Events,
    distance: u16,
    count: usize,
    is_far: impl Fn(Readings) -> bool,
) -> Result<Verdict, Error> {
    if count > 0 {
        return Ok(Verdict::Pass);
    }
    let Some(now) = session.readings(events.value, events.data_type, events.digits)? else {
        return Ok(Verdict::not_judged(WhyNot::NoValidValue(events.value)));
    };
    if !is_far(now) {
        return Ok(Verdict::not_judged(WhyNot::NotMoved(events.value)));
    }
    let object = events.parameter(distance);
    Ok(Verdict::of([Finding::at(object, Expected::Frames(1), Seen::Frames(0))]))
}

/// Starts the node with these parameters. The verdict if that is not possible.
fn start_with(
    session: &mut Session<'_, '_>,
    parameters: impl Fn(&Events) -> Vec<(u16, f64)>,
) -> Result<Result<Events, Verdict>, Error> {
    let mut events = match prepare(session)? {
        Ok(events) => events,
        Err(verdict) => return Ok(Err(verdict)),
    };
    session.command(NmtCommand::Start)?;
    // A first TPDO may be sent without an event.
    session.pause(REACTION)?;
    let Some(present) = session.readings(events.value, events.data_type, events.digits)? else {
        return Ok(Err(Verdict::not_judged(WhyNot::NoValidValue(events.value))));
    };
    events.present = present;
    for (distance, value) in parameters(&events) {
        if !set(session, &events, distance, value)? {
            return Ok(Err(Verdict::NotApplicable(WhyNot::NotWritable(events.parameter(distance)))));
        }
    }
    // The parameters may cause an event themselves.
    session.pause(SETTLE)?;
    Ok(Ok(events))
}

fn delta(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let events = match start_with(session, |events| vec![(DELTA, events.change)])? {
        Ok(events) => events,
        Err(verdict) => return Ok(verdict),
    };
    let old = events.present.middle();
    let count = count_after_move(session, &events, MOVE * events.change)?;
    judge(session, &events, DELTA, count, |now| (now.middle() - old).abs() > 2.0 * events.change)
}

fn no_delta(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    // The limits are as far away, because 0 may be a limit.
    let events = match start_with(session, |events| {
        let (middle, far) = (events.present.middle(), 100.0 * events.change);
        vec![(DELTA, far), (LOWER, middle - far), (UPPER, middle + far)]
    })? {
        Ok(events) => events,
        Err(verdict) => return Ok(verdict),
    };
    let count = count_after_move(session, &events, MOVE * events.change)?;
    let finding = || Finding::at(events.parameter(DELTA), Expected::Frames(0), Seen::Frames(count));
    Ok(Verdict::of((count > 0).then(finding)))
}

fn upper_limit(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    limit(session, UPPER, 1.0)
}

fn lower_limit(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    limit(session, LOWER, -1.0)
}

/// The value crosses the limit that is above it (`direction` is 1), or below it (-1).
fn limit(session: &mut Session<'_, '_>, distance: u16, direction: f64) -> Result<Verdict, Error> {
    let events = match start_with(session, |events| {
        let (middle, change) = (events.present.middle(), direction * events.change);
        let other = if distance == UPPER { LOWER } else { UPPER };
        vec![(other, middle - 100.0 * change), (distance, middle + 2.0 * change)]
    })? {
        Ok(events) => events,
        Err(verdict) => return Ok(verdict),
    };
    let limit = events.present.middle() + 2.0 * direction * events.change;
    let is_beyond = |now: Readings| (now.middle() - limit) * direction > 0.0;
    // The value may have crossed the limit while the parameters were written.
    let Some(now) = session.readings(events.value, events.data_type, events.digits)? else {
        return Ok(Verdict::not_judged(WhyNot::NoValidValue(events.value)));
    };
    if is_beyond(now) {
        return Ok(Verdict::not_judged(WhyNot::MovedEarly(events.value)));
    }
    let count = count_after_move(session, &events, MOVE * direction * events.change)?;
    let is_far = |now: Readings| (now.middle() - limit) * direction > events.change;
    judge(session, &events, distance, count, is_far)
}

fn silent(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let events = match start_with(session, |events| vec![(DELTA, events.change)])? {
        Ok(events) => events,
        Err(verdict) => return Ok(verdict),
    };
    session.command(NmtCommand::EnterPreOperational)?;
    let count = count_after_move(session, &events, MOVE * events.change)?;
    let finding = || Finding::at(events.tpdo.communication(1), Expected::Frames(0), Seen::Frames(count));
    Ok(Verdict::of((count > 0).then(finding)))
}
