//! An overload of the first channel that shows overloads. The user produces it (`--stimulus`).

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::{SETTLE, Session};
use super::super::stimulus::Input;
use super::values::{NEGATIVE, POSITIVE, spans};
use super::{Channel, Number, channels};
use crate::bus::Received;
use crate::canopen::emcy::Emergency;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::measure::reading::is_smallest;
use crate::node::{Error, Node};
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Cia404, id, sentence, clause, run).stimulated()
}

pub(in super::super) const CASES: &[Case] = &[
    case(
        "404-70",
        "A positive overload sets bit 1 of the status (6150h), or the bits of 1001h in the manual",
        STATUS,
        high,
    )
    .matters(High, "Wrong measurements are used."),
    case(
        "404-71",
        "A negative overload sets bit 2 of the status (6150h), or the bits of 1001h in the manual",
        STATUS,
        low,
    )
    .matters(High, "Wrong measurements are used."),
    case(
        "404-72",
        "During an overload, the process values of all types are the markers of the manual (NaN, smallest integer)",
        "CiA 404, objects x130h",
        markers,
    )
    .matters(High, "Masters that do not read the status use wrong measurements."),
    case(
        "404-73",
        "An overload sends the emergency of the manual, and its end sends code 0000h",
        "CiA 301, EMCY protocol",
        emergency,
    )
    .matters(Medium, "Masters do not notice the overload."),
    case("404-74", "After an overload, the status (6150h) or 1001h shows none", STATUS, ended)
        .matters(High, "Right measurements are not used."),
];

const STATUS: &str = "CiA 404, object 6150h; CiA 301, object 1001h";

/// How long the device may take to show an overload or its end.
const REACTION: Duration = Duration::from_secs(2);

/// Where a device shows an overload.
#[derive(Clone, Copy)]
struct Sign {
    object: ObjectId,
    /// All bits of overloads.
    bits: u64,
    /// The bits of a positive and of a negative overload.
    each: [u64; 2],
}

/// The channel whose overload is produced.
struct Subject {
    channel: Channel,
    sign: Sign,
    span: Option<[Number; 2]>,
    digits: u8,
}

/// Where a channel shows an overload: in its status, else in the error register as the manual states.
fn sign(node: &Node, channel: &Channel) -> Option<Sign> {
    let status = channel.object(0x6150);
    if channel.signal.status == Some(status) && node.may_have(status) {
        return Some(Sign { object: status, bits: POSITIVE | NEGATIVE, each: [POSITIVE, NEGATIVE] });
    }
    let bits = u64::from(node.overload_register()?);
    Some(Sign { object: Node::ERROR_REGISTER, bits, each: [bits; 2] })
}

/// The first channel that shows overloads. The verdict if there is none, or if no overload may be produced.
fn subject(session: &mut Session<'_, '_>) -> Result<Result<Subject, Verdict>, Error> {
    for channel in channels(session)? {
        let Some(sign) = sign(&session.node, &channel) else { continue };
        if session.number(sign.object)?.is_none() {
            continue;
        }
        if session.stimulus.is_none() {
            return Ok(Err(Verdict::not_judged(WhyNot::NoStimulus)));
        }
        // The overload is an entry of the error history, which is deleted afterwards.
        if !session.may_cause_error()? {
            return Ok(Err(Verdict::not_judged(WhyNot::ErrorHistory)));
        }
        let span = spans(session, &channel)?.first().copied();
        let digits = session.digits_of(&channel)?;
        return Ok(Ok(Subject { channel, sign, span, digits }));
    }
    Ok(Err(Verdict::NotApplicable(WhyNot::NoSuitableObject)))
}

impl Subject {
    /// Whether the process value is not valid, or at the end of the span.
    fn is_beyond(&self, session: &mut Session<'_, '_>) -> Result<bool, Error> {
        let (object, data_type) = self.channel.values[0];
        let value = session.quantity(object, data_type, self.digits)?;
        Ok(match (value, &self.span) {
            (Some(value), Some([start, end])) => {
                value >= end.value - end.rounding || value <= start.value - start.rounding
            }
            (Some(_), None) => false,
            (None, _) => true,
        })
    }

    /// Waits until these bits of the sign are set, and no others. Returns the number without them.
    fn await_bits(&self, session: &mut Session<'_, '_>, wanted: u64) -> Result<Option<u64>, Error> {
        let until = session.master.now() + REACTION;
        loop {
            let number = session.number(self.sign.object)?.unwrap_or(0);
            if number & self.sign.bits == wanted {
                return Ok(None);
            }
            if session.master.now() >= until {
                return Ok(Some(number));
            }
            session.pause(SETTLE)?;
        }
    }

    /// Produces an overload, and waits until the device shows it. The verdict if that is not possible.
    fn overload(&self, session: &mut Session<'_, '_>, input: Input) -> Result<Result<Option<u64>, Verdict>, Error> {
        if let Some(why) = session.set_input(input)? {
            return Ok(Err(Verdict::not_judged(why)));
        }
        self.judge_overload(session, input)
    }

    /// Waits until the device shows the overload. Returns the number if it is wrong. Without any effect on the device,
    /// there is no verdict: the input may be normal.
    fn judge_overload(
        &self,
        session: &mut Session<'_, '_>,
        input: Input,
    ) -> Result<Result<Option<u64>, Verdict>, Error> {
        let wanted = self.sign.each[usize::from(input == Input::OverloadLow)];
        let wrong = self.await_bits(session, wanted)?;
        let has_no_sign = wrong.is_some_and(|number| number & self.sign.bits == 0);
        if has_no_sign && !self.is_beyond(session)? {
            return Ok(Err(Verdict::not_judged(WhyNot::NotMoved(self.channel.values[0].0))));
        }
        Ok(Ok(wrong))
    }
}

fn high(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    shown(session, Input::OverloadHigh)
}

fn low(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    shown(session, Input::OverloadLow)
}

fn shown(session: &mut Session<'_, '_>, input: Input) -> Result<Verdict, Error> {
    let subject = match subject(session)? {
        Ok(subject) => subject,
        Err(verdict) => return Ok(verdict),
    };
    let wanted = subject.sign.each[usize::from(input == Input::OverloadLow)];
    Ok(match subject.overload(session, input)? {
        Ok(wrong) => Verdict::of(
            wrong.map(|number| Finding::at(subject.sign.object, Expected::BitsSet(wanted), Seen::Number(number))),
        ),
        Err(verdict) => verdict,
    })
}

/// Whether these bytes are the marker of an overload: NaN, or the smallest integer.
fn is_marker(bytes: &[u8], data_type: DataType) -> bool {
    data_type.decode(bytes).is_ok_and(|value| match data_type {
        DataType::Real32 | DataType::Real64 => value.as_f64().is_some_and(f64::is_nan),
        _ => is_smallest(&value, data_type),
    })
}

fn markers(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let subject = match subject(session)? {
        Ok(subject) if subject.channel.signal.has_marker => subject,
        Ok(_) => return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject)),
        Err(verdict) => return Ok(verdict),
    };
    if let Err(verdict) = subject.overload(session, Input::OverloadHigh)? {
        return Ok(verdict);
    }
    let mut findings = Vec::new();
    for &(object, data_type) in &subject.channel.values {
        let bytes = session.read(object)?.unwrap_or_default();
        if !is_marker(&bytes, data_type) {
            findings.push(Finding::at(object, Expected::Marker, Seen::Bytes(bytes)));
        }
    }
    Ok(Verdict::of(findings))
}

/// Whether an emergency with this code was received.
fn has_code(session: &Session<'_, '_>, frames: &[Received], code: u16) -> bool {
    let is_this = |received: &Received| {
        received.frame.id() == session.node.emergency
            && Emergency::parse(&received.frame).is_some_and(|emergency| emergency.code == code)
    };
    frames.iter().any(is_this)
}

fn emergency(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let description = session.node.model.as_ref().map(|model| &model.description);
    let entry = description.and_then(|description| description.emergencies.iter().find(|entry| entry.overload));
    let Some(code) = entry.map(|entry| entry.code) else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let subject = match subject(session)? {
        Ok(subject) => subject,
        Err(verdict) => return Ok(verdict),
    };
    let mut findings = Vec::new();
    for (input, code) in [(Input::OverloadHigh, code), (Input::Normal, 0)] {
        if let Some(why) = session.set_input(input)? {
            return Ok(Verdict::not_judged(why));
        }
        let frames = session.collect(REACTION)?;
        let is_sent = has_code(session, &frames, code);
        if input != Input::Normal
            && let Err(verdict) = subject.judge_overload(session, input)?
        {
            return Ok(verdict);
        }
        if !is_sent {
            findings.push(Finding::new(Expected::Emergency(code), Seen::Nothing(REACTION)));
            break;
        }
    }
    Ok(Verdict::of(findings))
}

fn ended(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let subject = match subject(session)? {
        Ok(subject) => subject,
        Err(verdict) => return Ok(verdict),
    };
    if let Err(verdict) = subject.overload(session, Input::OverloadHigh)? {
        return Ok(verdict);
    }
    if let Some(why) = session.set_input(Input::Normal)? {
        return Ok(Verdict::not_judged(why));
    }
    let wrong = subject.await_bits(session, 0)?;
    let finding =
        |number| Finding::at(subject.sign.object, Expected::BitsClear(subject.sign.bits), Seen::Number(number));
    Ok(Verdict::of(wrong.map(finding)))
}
