//! The step response of the filter (61A0h, 61A1h), and the sample rate (6114h). The command of `--stimulus` makes the
//! step.
//!
//! The time between two samples is often unknown, so the cases compare two responses. With twice the filter constant or
//! twice the sample time, the value takes twice the time to the middle of the step.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::codes;
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::session::{Session, number};
use super::super::stimulus::Input;
use super::filter::{CONSTANT, TYPE};
use super::{Channel, channels, rounding};
use crate::canopen::object::ObjectId;
use crate::node::Error;
use std::ops::Range;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case(
        "404-32",
        "With filter type 1, a step has the shape of a moving average, and twice the constant (61A1h) takes twice the time",
        FILTER,
        moving,
    )
    .matters(Medium, "The damping of the measurement is not the one that was set.")
    .stimulated(),
    case(
        "404-33",
        "With filter type 2, the value shows a step after two means over the number of samples in 61A1h",
        FILTER,
        repeating,
    )
    .matters(Medium, "The damping of the measurement is not the one that was set.")
    .stimulated(),
    case(
        "404-34",
        "Twice the sample time (6114h) can be read back, or the write is rejected with an abort code for the value",
        "CiA 404, object 6114h",
        read_back,
    )
    .matters(Low, "The set sample rate is not the one in use."),
    case(
        "404-35",
        "With twice the sample time (6114h), a step takes twice the time through filter type 1",
        "CiA 404, objects 6114h, 61A0h and 61A1h",
        sampled,
    )
    .matters(Medium, "The sample rate is not the one that was set.")
    .stimulated(),
];

const FILTER: &str = "CiA 404, objects 61A0h and 61A1h";
const SAMPLE_TIME: u16 = 0x6114;

/// The filter constants that are tried until the response is much slower than the input. The last constant is for
/// sample times of 0.05 ms.
const CONSTANTS: [u16; 5] = [16, 64, 250, 1000, 8000];

/// With the last constant and a sample time of 0.05 ms, the middle of the step is reached after this time.
const SHORTEST_LAST_RESPONSE: Duration = Duration::from_millis(200);

/// The time in which a device takes enough samples for the largest filter constant to have an effect.
const FIRST_SAMPLES: Duration = Duration::from_secs(3);

/// The time between two readings.
const POLL: Duration = Duration::from_millis(5);

/// Without a filter, the device shows a step of its input within this time.
const REACTION: Duration = Duration::from_millis(20);

/// A response is slow enough for a verdict if it takes this many times the uncertainty.
const SLOW_FACTOR: u32 = 5;

/// The recording of a response ends after this time.
const RESPONSE_LIMIT: Duration = Duration::from_secs(20);

/// How long the input may take to reach its new value after the command has ended.
const ARRIVAL: Duration = Duration::from_millis(500);

/// If the command takes longer than this, the time of the step is not known well enough.
const LONGEST_COMMAND: Duration = Duration::from_secs(1);

/// A step has to be this many times larger than the noise.
const NOISE_FACTOR: f64 = 20.0;

/// The channel whose input is changed, and the step without a filter.
struct Subject {
    channel: Channel,
    digits: u8,
    /// The width of the filter constant in bytes.
    width: usize,
    /// The value before and after the step.
    from: f64,
    to: f64,
    /// The noise of both values, as a share of the step.
    noise: f64,
    /// The time to the middle of the step without a filter.
    base_time: Duration,
}

/// The response to a step: for each reading, the time since the end of the command, and the share of the step.
struct Response {
    shares: Vec<(Duration, f64)>,
    /// The largest error of the times.
    uncertainty: Duration,
}

impl Response {
    /// The time at which a share of the step was reached.
    fn time(&self, share: f64) -> Option<Duration> {
        self.shares.iter().find(|(_, reached)| *reached >= share).map(|(time, _)| *time)
    }

    /// Counts the different values between the old and the new value.
    fn values_between(&self, noise: f64) -> usize {
        let margin = 0.05 + noise;
        let between =
            self.shares.iter().map(|(_, share)| *share).filter(|share| (margin..1.0 - margin).contains(share));
        let (mut count, mut last) = (0, f64::NAN);
        for share in between {
            // Each mean is shown until the next mean is complete.
            if last.is_nan() || (share - last).abs() > 0.02 {
                count += 1;
                last = share;
            }
        }
        count
    }
}

/// A result, or the verdict if the case cannot continue.
type OrVerdict<T> = Result<Result<T, Verdict>, Error>;

/// Returns the result, or ends the case with the verdict.
macro_rules! or_verdict {
    ($found:expr) => {
        match $found? {
            Ok(found) => found,
            Err(verdict) => return Ok(verdict),
        }
    };
}

/// Returns the first channel with a filter type and a filter constant, and the width of the constant in bytes.
fn filtered(session: &mut Session<'_, '_>) -> OrVerdict<(Channel, usize)> {
    for channel in channels(session)? {
        let [kind, constant] = [TYPE, CONSTANT].map(|index| channel.object(index));
        if !session.node.may_have(kind) || !session.node.may_have(constant) {
            continue;
        }
        let (Some(_), Some(present)) = (session.read(kind)?, session.read(constant)?) else { continue };
        return Ok(Ok((channel, present.len())));
    }
    Ok(Err(Verdict::NotApplicable(WhyNot::NoSuitableObject)))
}

/// Sets the filter. Returns the verdict if the device rejects the type or the constant.
fn set_filter(
    session: &mut Session<'_, '_>,
    channel: &Channel,
    kind: u8,
    constant: u16,
    width: usize,
) -> OrVerdict<()> {
    let mut bytes = u64::from(constant).to_le_bytes().to_vec();
    bytes.truncate(width.clamp(1, 4));
    for (index, bytes) in [(CONSTANT, bytes), (TYPE, vec![kind])] {
        let object = channel.object(index);
        if let Some(code) = session.try_write(object, &bytes)? {
            return Ok(Err(Verdict::not_judged(WhyNot::Rejected(object, code))));
        }
    }
    Ok(Ok(()))
}

/// Switches off the filter, and sets the normal input.
fn settle(session: &mut Session<'_, '_>, channel: &Channel, width: usize) -> OrVerdict<()> {
    if let Err(verdict) = set_filter(session, channel, 1, 1, width)? {
        return Ok(Err(verdict));
    }
    if let Some(why) = session.set_input(Input::Normal)? {
        return Ok(Err(Verdict::not_judged(why)));
    }
    Ok(Ok(()))
}

/// Finds a channel, and measures the step without a filter (a moving average with the constant 1).
fn subject(session: &mut Session<'_, '_>) -> OrVerdict<Subject> {
    let (channel, width) = match filtered(session)? {
        Ok(found) => found,
        Err(verdict) => return Ok(Err(verdict)),
    };
    if session.stimulus.is_none() {
        return Ok(Err(Verdict::not_judged(WhyNot::NoStimulus)));
    }
    if let Err(verdict) = settle(session, &channel, width)? {
        return Ok(Err(verdict));
    }
    session.pause(ARRIVAL)?;
    let (value, data_type) = channel.values[0];
    let digits = session.digits_of(&channel)?;
    let invalid = Verdict::not_judged(WhyNot::NoValidValue(value));
    let Some(before) = session.readings(value, data_type, digits)? else { return Ok(Err(invalid)) };
    let asked = session.master.now();
    if let Some(why) = session.set_input(Input::Step)? {
        return Ok(Err(Verdict::not_judged(why)));
    }
    let start = session.master.now();
    if start.since(asked) > LONGEST_COMMAND {
        return Ok(Err(Verdict::not_judged(WhyNot::StepTooSlow)));
    }
    let mut readings = Vec::new();
    while session.master.now().since(start) < ARRIVAL {
        let Some(reading) = session.quantity(value, data_type, digits)? else { return Ok(Err(invalid)) };
        readings.push((session.master.now().since(start), reading));
        session.pause(POLL)?;
    }
    let Some(after) = session.readings(value, data_type, digits)? else { return Ok(Err(invalid)) };
    let (from, to) = (before.middle(), after.middle());
    let height = (to - from).abs();
    let noise = before.spread() + after.spread() + 2.0 * rounding(data_type, digits, to);
    if height < NOISE_FACTOR * noise || height == 0.0 {
        return Ok(Err(Verdict::not_judged(WhyNot::NotMoved(value))));
    }
    let middle = readings.into_iter().find(|(_, reading)| (reading - from).abs() >= height / 2.0);
    let base_time = middle.map_or(ARRIVAL, |(time, _)| time);
    Ok(Ok(Subject { channel, digits, width, from, to, noise: noise / height, base_time }))
}

impl Subject {
    /// The share of the step that a value shows.
    fn share(&self, value: f64) -> f64 {
        (value - self.from) / (self.to - self.from)
    }

    /// Sets the filter, waits for `ready_after`, makes the step, and records the values until the device shows this
    /// share of the step.
    fn respond(
        &self,
        session: &mut Session<'_, '_>,
        kind: u8,
        constant: u16,
        share: f64,
        ready_after: Duration,
    ) -> OrVerdict<Response> {
        let (value, data_type) = self.channel.values[0];
        if let Err(verdict) = settle(session, &self.channel, self.width)? {
            return Ok(Err(verdict));
        }
        let until = session.master.now() + ARRIVAL;
        while session.quantity(value, data_type, self.digits)?.is_none_or(|reading| self.share(reading).abs() > 0.05) {
            if session.master.now() >= until {
                return Ok(Err(Verdict::not_judged(WhyNot::NotReturned(value))));
            }
            session.pause(POLL)?;
        }
        if let Err(verdict) = set_filter(session, &self.channel, kind, constant, self.width)? {
            return Ok(Err(verdict));
        }
        session.pause(ready_after)?;
        let started = session.master.now();
        if let Some(why) = session.set_input(Input::Step)? {
            return Ok(Err(Verdict::not_judged(why)));
        }
        let ended = session.master.now();
        let mut response = Response { shares: Vec::new(), uncertainty: ended.since(started) + REACTION };
        let (mut last, mut longest_gap) = (Duration::ZERO, Duration::ZERO);
        loop {
            let Some(reading) = session.quantity(value, data_type, self.digits)? else {
                return Ok(Err(Verdict::not_judged(WhyNot::NoValidValue(value))));
            };
            let (time, reached) = (session.master.now().since(ended), self.share(reading));
            response.shares.push((time, reached));
            longest_gap = longest_gap.max(time.saturating_sub(last));
            last = time;
            if reached >= share || time > RESPONSE_LIMIT {
                response.uncertainty += longest_gap;
                return Ok(Ok(response));
            }
            session.pause(POLL)?;
        }
    }

    /// Finds a moving average whose response is slow enough for a verdict. Returns the filter constant, the response,
    /// and the time to the middle of the step.
    fn slow_response(&self, session: &mut Session<'_, '_>) -> OrVerdict<(u16, Response, Duration)> {
        let object = self.channel.object(CONSTANT);
        let mut last = None;
        let possible = CONSTANTS.into_iter().filter(|constant| self.width > 1 || *constant <= u16::from(u8::MAX) / 2);
        for constant in possible {
            let response = match self.respond(session, 1, constant, 0.9, Duration::ZERO)? {
                Ok(response) => response,
                Err(verdict) => return Ok(Err(verdict)),
            };
            let Some(half) = response.time(0.5) else { break };
            let half = half.saturating_sub(self.base_time);
            // The next response takes up to 4.4 times this time, and has to end before the limit.
            if half > RESPONSE_LIMIT / 5 {
                break;
            }
            if half >= response.uncertainty * SLOW_FACTOR {
                return Ok(Ok((constant, response, half)));
            }
            last = Some((constant, half, response.uncertainty));
        }
        // Even the largest constant has no effect. After a slow command, a short response could not be seen.
        if let Some((constant, half, uncertainty)) = last
            && constant == CONSTANTS[CONSTANTS.len() - 1]
            && half <= uncertainty
            && uncertainty < SHORTEST_LAST_RESPONSE
        {
            // A device may begin a new average when the constant is written. It then needs some samples.
            let response = match self.respond(session, 1, constant, 0.5, FIRST_SAMPLES)? {
                Ok(response) => response,
                Err(verdict) => return Ok(Err(verdict)),
            };
            let seen = response.time(0.5).map(|half| half.saturating_sub(self.base_time));
            if seen.is_some_and(|half| half <= response.uncertainty) {
                let expected = Expected::Step { percent: 50, from: response.uncertainty, until: RESPONSE_LIMIT };
                return Ok(Err(Verdict::of([Finding::at(object, expected, Seen::StepAfter(seen))])));
            }
        }
        Ok(Err(Verdict::not_judged(WhyNot::StepTooSlow)))
    }

    /// Returns a finding if this share of the step is not reached within these times.
    fn expect(&self, response: &Response, object: ObjectId, percent: u8, times: Range<Duration>) -> Option<Finding> {
        let seen = response.time(f64::from(percent) / 100.0).map(|time| time.saturating_sub(self.base_time));
        let from = times.start.saturating_sub(response.uncertainty);
        let until = times.end + response.uncertainty;
        let is_right = seen.is_some_and(|seen| (from..=until).contains(&seen));
        let expected = Expected::Step { percent, from, until };
        (!is_right).then(|| Finding::at(object, expected, Seen::StepAfter(seen)))
    }

    /// Returns a finding if the middle of the step is not reached after about twice this time.
    fn expect_twice(&self, response: &Response, object: ObjectId, half: Duration) -> Option<Finding> {
        self.expect(response, object, 50, half.mul_f64(1.7)..half.mul_f64(2.3))
    }
}

fn moving(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let subject = or_verdict!(subject(session));
    let (constant, response, half) = or_verdict!(subject.slow_response(session));
    let object = subject.channel.object(CONSTANT);
    // Relative to the time of 50 %, the moving average of CiA 404 (a part of the difference is added to the value)
    // shows 25 % after 0.42, and 75 % after 2. The mean of the last N samples shows 25 % after 0.5, and 75 % after 1.5.
    let shape = [(25, 0.35, 0.6), (75, 1.3, 2.3)];
    let mut findings: Vec<Finding> = shape
        .into_iter()
        .filter_map(|(percent, from, until)| {
            subject.expect(&response, subject.channel.object(TYPE), percent, half.mul_f64(from)..half.mul_f64(until))
        })
        .collect();
    let twice = or_verdict!(subject.respond(session, 1, constant * 2, 0.5, Duration::ZERO));
    findings.extend(subject.expect_twice(&twice, object, half));
    Ok(Verdict::of(findings))
}

fn repeating(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let subject = or_verdict!(subject(session));
    let (constant, _, half) = or_verdict!(subject.slow_response(session));
    let object = subject.channel.object(TYPE);
    // Until the first mean is complete, the value is not defined.
    let first_mean = half.mul_f64(2.5);
    let response = or_verdict!(subject.respond(session, 2, constant, 0.95, first_mean));
    // The first mean contains samples from before and after the step. The second mean is the new value. The moving
    // average reaches the middle after 0.5 to 0.7 times the time of one mean.
    let times = half.mul_f64(1.3)..half.mul_f64(4.4);
    let late = subject.expect(&response, object, 95, times);
    let between = response.values_between(subject.noise);
    let several = (between > 1).then(|| Finding::at(object, Expected::OneMean, Seen::Values(between)));
    Ok(Verdict::of(late.into_iter().chain(several)))
}

/// Returns the object with the sample time, and twice its present value. Returns the verdict if it cannot be written.
fn sample_time(session: &mut Session<'_, '_>, channel: &Channel) -> OrVerdict<(ObjectId, Vec<u8>)> {
    let object = channel.object(SAMPLE_TIME);
    let present = if session.node.may_have(object) { session.read(object)? } else { None };
    let Some(present) = present.filter(|bytes| (1..=8).contains(&bytes.len())) else {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NoObject(object))));
    };
    let twice = number(&present).checked_mul(2).filter(|twice| *twice > 0);
    let fits = |twice: &u64| present.len() == 8 || twice >> (8 * present.len()) == 0;
    let Some(twice) = twice.filter(fits).filter(|_| !session.node.is_read_only(object)) else {
        return Ok(Err(Verdict::NotApplicable(WhyNot::NotWritable(object))));
    };
    Ok(Ok((object, twice.to_le_bytes()[..present.len()].to_vec())))
}

fn read_back(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut other = None;
    for channel in channels(session)? {
        match sample_time(session, &channel)? {
            Ok((object, twice)) => return read_back_of(session, object, &twice),
            Err(verdict) => other = other.or(Some(verdict)),
        }
    }
    Ok(other.unwrap_or(Verdict::NotApplicable(WhyNot::NoChannel)))
}

fn read_back_of(session: &mut Session<'_, '_>, object: ObjectId, twice: &[u8]) -> Result<Verdict, Error> {
    let answer = session.download(object, twice)?;
    match answer.as_ref().and_then(abort_code) {
        Some(code) if codes::VALUE.contains(&code.0) => return Ok(Verdict::Pass),
        // The object is read-only, or the state of the device does not allow the write.
        Some(code) if codes::READ_ONLY.contains(&code.0) || code.0 >> 8 == 0x08_0000 => {
            return Ok(Verdict::NotApplicable(WhyNot::Rejected(object, code)));
        }
        Some(code) => return Ok(Verdict::of([Finding::at(object, Expected::Abort(codes::VALUE), Seen::Abort(code))])),
        None => {}
    }
    let found = session.read(object)?.unwrap_or_default();
    let is_right = found == twice;
    Ok(Verdict::of((!is_right).then(|| Finding::at(object, Expected::Bytes(twice.to_vec()), Seen::Bytes(found)))))
}

fn sampled(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let (channel, _) = or_verdict!(filtered(session));
    let (object, twice) = or_verdict!(sample_time(session, &channel));
    let subject = or_verdict!(subject(session));
    let (constant, _, half) = or_verdict!(subject.slow_response(session));
    if session.try_write(object, &twice)?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    let response = or_verdict!(subject.respond(session, 1, constant, 0.5, Duration::ZERO));
    Ok(Verdict::of(subject.expect_twice(&response, object, half)))
}
