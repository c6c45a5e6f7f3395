//! Heartbeat and node guarding.

use super::case::{Area, Case, Run, Severity::*};
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::session::{SETTLE, Session};
use crate::bus::Received;
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::node::Error;
use crate::node::state::HEARTBEAT_TIME;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::ErrorControl, id, sentence, clause, run)
}

const HEARTBEAT: &str = "CiA 301, heartbeat protocol";
const GUARDING: &str = "CiA 301, node guarding protocol";

pub(super) const CASES: &[Case] = &[
    case("ERR-01", "The heartbeat has the period of 1017h", HEARTBEAT, period)
        .matters(High, "Heartbeat consumers report errors."),
    case("ERR-02", "The first heartbeat comes within one period after 1017h is written", HEARTBEAT, first)
        .matters(Low, "Heartbeat consumers that start to monitor when 1017h is written report an error."),
    case("ERR-03", "A new period in 1017h is used while the heartbeat runs", HEARTBEAT, change)
        .matters(Medium, "The device must be restarted after a change."),
    case("ERR-04", "0 in 1017h switches the heartbeat off", HEARTBEAT, off)
        .matters(Medium, "The heartbeat cannot be switched off."),
    case("ERR-05", "A heartbeat is one byte, and its bit 7 is 0", HEARTBEAT, form)
        .matters(Medium, "Consumers show a wrong state."),
    case("ERR-06", "Node guarding is answered with the state, and the toggle bit alternates", GUARDING, guarding)
        .matters(Medium, "A master with node guarding reports errors."),
    case("ERR-07", "A reset of the communication sets the toggle bit to 0", GUARDING, toggle_after_reset)
        .matters(Medium, "A master with node guarding reports an error after each restart."),
    case(
        "ERR-08",
        "Without guarding requests, the life guarding event occurs after the life time",
        GUARDING,
        life_time,
    )
    .matters(High, "The device does not notice that the master is lost."),
    case("ERR-09", "Node guarding is not answered while the heartbeat is on", "CiA 301, error control", exclusion)
        .matters(Low, "Masters receive states from two services."),
];

/// The period in `ERR-01`, and the number of intervals measured.
const PERIOD: Duration = Duration::from_millis(100);
const INTERVALS: u32 = 10;

/// The allowed difference of a mean period: 5 %, and 3 ms for the clocks of adapters.
pub(super) fn is_near(found: Duration, wanted: Duration) -> bool {
    found.abs_diff(wanted) <= wanted / 20 + Duration::from_millis(3)
}

pub(super) fn set_period(session: &mut Session<'_, '_>, period: Duration) -> Result<bool, Error> {
    let milliseconds = u16::try_from(period.as_millis()).unwrap_or(u16::MAX);
    if session.number(HEARTBEAT_TIME)?.is_none() {
        return Ok(false);
    }
    Ok(session.try_write(HEARTBEAT_TIME, &milliseconds.to_le_bytes())?.is_none())
}

/// The mean interval of frames; `None` for fewer than three.
pub(super) fn mean_interval(frames: &[Received]) -> Option<Duration> {
    let [first, _, .., last] = frames else { return None };
    let count = u32::try_from(frames.len() - 1).ok()?;
    Some(last.at.mono.since(first.at.mono) / count)
}

/// Measures the period of the heartbeat.
fn measure(session: &mut Session<'_, '_>, period: Duration, intervals: u32) -> Result<Option<Finding>, Error> {
    let frames = session.lives(period * (intervals + 1) + SETTLE)?;
    Ok(match mean_interval(&frames) {
        Some(found) if is_near(found, period) => None,
        Some(found) => Some(Finding::at(HEARTBEAT_TIME, Expected::Period(period), Seen::Period(found))),
        None => Some(Finding::at(HEARTBEAT_TIME, Expected::Period(period), Seen::Frames(frames.len()))),
    })
}

const NO_HEARTBEAT: Verdict = Verdict::NotApplicable(WhyNot::NotWritable(HEARTBEAT_TIME));

fn period(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !set_period(session, PERIOD)? {
        return Ok(NO_HEARTBEAT);
    }
    Ok(Verdict::of(measure(session, PERIOD, INTERVALS)?))
}

fn first(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !set_period(session, Duration::ZERO)? || !set_period(session, PERIOD)? {
        return Ok(NO_HEARTBEAT);
    }
    let (id, mut at) = (CanId::heartbeat(session.node.id), None);
    let start = session.master.now();
    session.collect_until(PERIOD * 3, |received| {
        at = (received.frame.id() == id).then_some(received.at.mono);
        at.is_some()
    })?;
    let limit = PERIOD + PERIOD / 10 + Duration::from_millis(3);
    let seen = match at.map(|at| at.since(start)) {
        Some(after) if after <= limit => return Ok(Verdict::Pass),
        Some(after) => Seen::After(after),
        None => Seen::Nothing(PERIOD * 3),
    };
    Ok(Verdict::of([Finding::at(HEARTBEAT_TIME, Expected::Within(PERIOD), seen)]))
}

fn change(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !set_period(session, PERIOD)? {
        return Ok(NO_HEARTBEAT);
    }
    session.pause(PERIOD * 2)?;
    if !set_period(session, PERIOD / 2)? {
        return Ok(NO_HEARTBEAT);
    }
    // One more heartbeat may come in the old rhythm.
    session.pause(PERIOD)?;
    Ok(Verdict::of(measure(session, PERIOD / 2, INTERVALS)?))
}

fn off(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !set_period(session, PERIOD / 2)? || !set_period(session, Duration::ZERO)? {
        return Ok(NO_HEARTBEAT);
    }
    session.pause(PERIOD / 2)?;
    let found = session.lives(PERIOD * 3)?.len();
    let finding = || Finding::at(HEARTBEAT_TIME, Expected::Frames(0), Seen::Frames(found));
    Ok(Verdict::of((found > 0).then(finding)))
}

fn form(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !set_period(session, PERIOD / 2)? {
        return Ok(NO_HEARTBEAT);
    }
    let frames = session.lives(PERIOD * 3)?;
    if frames.is_empty() {
        return Ok(Verdict::not_judged(WhyNot::NoState));
    }
    let wrong = frames.iter().find(|received| !matches!(received.frame.data(), [state] if state & 0x80 == 0));
    Ok(Verdict::of(wrong.map(|received| Finding::new(Expected::OneByte, Seen::Frame(received.frame)))))
}

pub(super) const GUARD_TIME: ObjectId = ObjectId::new(0x100c, 0);
pub(super) const LIFE_TIME_FACTOR: ObjectId = ObjectId::new(0x100d, 0);

/// Sends a guarding request. Returns the answer.
fn guard(session: &mut Session<'_, '_>) -> Result<Option<Frame>, Error> {
    let (id, timeout) = (CanId::heartbeat(session.node.id), session.timeout());
    let Ok(request) = Frame::remote(id, 1) else { return Ok(None) };
    session.guarded = true;
    Ok(session.master.exchange(request, id, timeout)?.map(|received| received.frame))
}

impl Session<'_, '_> {
    /// The next guarding request ends an error of life guarding.
    pub(super) fn end_guarding_error(&mut self) -> Result<(), Error> {
        if let Ok(request) = Frame::remote(CanId::heartbeat(self.node.id), 1) {
            self.send(request)?;
        }
        Ok(())
    }
}

/// Prepares node guarding: the heartbeat is off. The verdict if there is none.
fn prepare_guarding(session: &mut Session<'_, '_>) -> Result<Option<Verdict>, Error> {
    if !session.master.bus().sends_remote_frames() {
        return Ok(Some(Verdict::NotApplicable(WhyNot::NoRemoteFrames)));
    }
    let Some(guard_time) = session.number(GUARD_TIME)? else {
        return Ok(Some(Verdict::NotApplicable(WhyNot::NoObject(GUARD_TIME))));
    };
    // The first guarding request would start life guarding, and the device would report an error after the check.
    if guard_time > 0 && session.number(LIFE_TIME_FACTOR)?.is_some_and(|factor| factor > 0) {
        return Ok(Some(Verdict::not_judged(WhyNot::LifeGuarding)));
    }
    set_period(session, Duration::ZERO)?;
    session.pause(PERIOD)?;
    Ok(None)
}

fn guarding(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = prepare_guarding(session)? {
        return Ok(verdict);
    }
    session.reset(NmtCommand::ResetCommunication)?;
    if let Some(verdict) = prepare_guarding(session)? {
        return Ok(verdict);
    }
    session.command(NmtCommand::EnterPreOperational)?;
    let mut last = None;
    for _ in 0..4 {
        match guard(session)? {
            Some(frame) if is_guarding_answer(&frame, last) => last = frame.data().first().copied(),
            Some(frame) => return Ok(Verdict::of([Finding::new(Expected::AlternatingToggle, Seen::Frame(frame))])),
            None => {
                let seen = Seen::Nothing(session.timeout());
                return Ok(Verdict::of([Finding::new(Expected::AlternatingToggle, seen)]));
            }
        }
    }
    Ok(Verdict::Pass)
}

/// Whether an answer has the state PRE-OPERATIONAL and another toggle bit than the last one.
fn is_guarding_answer(frame: &Frame, last: Option<u8>) -> bool {
    let [state] = *frame.data() else { return false };
    state & 0x7f == 0x7f && last.is_none_or(|last| last ^ 0x80 == state)
}

fn toggle_after_reset(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = prepare_guarding(session)? {
        return Ok(verdict);
    }
    if guard(session)?.is_none() {
        return Ok(Verdict::not_judged(WhyNot::NoGuarding));
    }
    session.reset(NmtCommand::ResetCommunication)?;
    if let Some(verdict) = prepare_guarding(session)? {
        return Ok(verdict);
    }
    let answer = guard(session)?;
    let is_right = matches!(answer.as_ref().map(Frame::data), Some([state]) if state & 0x80 == 0);
    let finding = || Finding::new(Expected::FirstToggle, Seen::answer(answer, session.timeout()));
    Ok(Verdict::of((!is_right).then(finding)))
}

fn life_time(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = prepare_guarding(session)? {
        return Ok(verdict);
    }
    if session.number(LIFE_TIME_FACTOR)?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(LIFE_TIME_FACTOR)));
    }
    // An earlier guarding request may have started life guarding, which then fails as soon as a life time is set.
    if !session.may_cause_error()? {
        return Ok(Verdict::not_judged(WhyNot::ErrorHistory));
    }
    if session.try_write(GUARD_TIME, &100u16.to_le_bytes())?.is_some()
        || session.try_write(LIFE_TIME_FACTOR, &[3])?.is_some()
    {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(GUARD_TIME)));
    }
    session.command(NmtCommand::Start)?;
    if guard(session)?.is_none() {
        return Ok(Verdict::not_judged(WhyNot::NoGuarding));
    }
    let frames = session.collect(PERIOD * 5)?;
    let is_event = |received: &Received| {
        received.frame.id() == session.node.emergency
            && Emergency::parse(&received.frame).is_some_and(|emergency| emergency.code == 0x8130)
    };
    if frames.iter().any(is_event) {
        return Ok(Verdict::Pass);
    }
    let answer = guard(session)?;
    let state = answer.as_ref().and_then(ErrorControlMessage::parse).map(|(_, life)| match life {
        ErrorControlMessage::State(state) => state,
        ErrorControlMessage::BootUp => NmtState::Other(0),
    });
    let is_event = state == Some(NmtState::PreOperational);
    Ok(Verdict::of((!is_event).then(|| Finding::new(Expected::LifeGuardingEvent, Seen::State(state)))))
}

fn exclusion(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = prepare_guarding(session)? {
        return Ok(verdict);
    }
    // Long, so that a heartbeat is not mistaken for an answer.
    if !set_period(session, PERIOD * 50)? {
        return Ok(NO_HEARTBEAT);
    }
    // Some devices send the first heartbeat at once.
    session.pause(PERIOD)?;
    let (id, timeout) = (CanId::heartbeat(session.node.id), PERIOD * 3);
    let Ok(request) = Frame::remote(id, 1) else { return Ok(Verdict::not_judged(WhyNot::NoGuarding)) };
    let answer = session.master.exchange(request, id, timeout)?;
    Ok(Verdict::of(answer.map(|received| Finding::new(Expected::NoAnswer, Seen::Frame(received.frame)))))
}
