//! The timing profile of a device: figures without a verdict.

use super::alone::is_from;
use super::case::{Area, Case, Run, Severity::*};
use super::error_control::set_period;
use super::figure::{Figure, Statistic};
use super::finding::{Verdict, WhyNot};
use super::pdo::{TIMER, is_data, timed};
use super::sdo::narrow_setting;
use super::session::{Session, request};
use crate::bus::{Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand};
use crate::canopen::object::ObjectId;
use crate::node::Error;
use crate::node::state::HEARTBEAT_TIME;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Timing, id, sentence, clause, run).matters(Low, "")
}

const SDO: &str = "CiA 301, SDO protocols";
const NMT: &str = "CiA 301, NMT protocols";

pub(super) const CASES: &[Case] = &[
    case("TIM-01", "The time to answer a read", SDO, reads),
    case("TIM-02", "The time to acknowledge a write", SDO, writes),
    case("TIM-03", "The interval of heartbeats if 1017h is 100 ms", "CiA 301, heartbeat protocol", heartbeats),
    case("TIM-04", "The interval of TPDOs if the event timer is 100 ms", "CiA 301, event timer", tpdos).alone(),
    case("TIM-05", "The longest interval without a frame while the device answers reads and sends TPDOs", SDO, silence)
        .alone(),
    case("TIM-06", "The time from a reset of the node to its boot-up message", NMT, boot_node),
    case("TIM-07", "The time from a reset of the communication to the boot-up message", NMT, boot_communication),
];

/// The number of reads and writes that are timed. Some devices write each setting to non-volatile memory.
const READS: usize = 200;
const WRITES: usize = 20;

/// The number of intervals that are measured, and of resets.
const INTERVALS: u32 = 30;
const RESETS: usize = 3;

/// The number of reads during which silence is measured. Each of them ends with an answer or a time-out.
const READS_FOR_SILENCE: usize = 1000;

/// The longest time in which silence is measured.
const SILENCE_TIME: Duration = Duration::from_secs(2);

/// The objects that are read: on each device, at most one frame is needed.
const OBJECTS: [ObjectId; 3] = [ObjectId::DEVICE_TYPE, ObjectId::new(0x1001, 0), ObjectId::new(0x1018, 1)];

const ANSWER: &[Statistic] = &[Statistic::Min, Statistic::Median, Statistic::P99, Statistic::Max];
const INTERVAL: &[Statistic] = &[Statistic::Mean, Statistic::Jitter, Statistic::Min, Statistic::Max];

/// The figures of measured times; no verdict without a time.
fn measured(times: &[Duration], wanted: &[Statistic], otherwise: WhyNot) -> Verdict {
    if times.is_empty() {
        return Verdict::not_judged(otherwise);
    }
    Verdict::Measured(wanted.iter().map(|statistic| Figure::of(*statistic, times)).collect())
}

/// Sends a request, and returns the time until its answer.
fn answer_time(session: &mut Session<'_, '_>, data: [u8; 8]) -> Result<Option<Duration>, Error> {
    let start = session.master.now();
    Ok(session.raw_received(data, session.timeout())?.map(|answer| answer.at.mono.since(start)))
}

fn reads(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut times = Vec::new();
    for object in OBJECTS.into_iter().cycle().take(READS) {
        times.extend(answer_time(session, request(0x40, object, [0; 4]))?);
    }
    Ok(measured(&times, ANSWER, WhyNot::NoSuitableObject))
}

fn writes(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, value)) = narrow_setting(session)? else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    let data = session.download_request(object, &value);
    let mut times = Vec::new();
    for _ in 0..WRITES {
        times.extend(answer_time(session, data)?);
    }
    Ok(measured(&times, &[Statistic::Min, Statistic::Median, Statistic::Max], WhyNot::NotWritable(object)))
}

/// The intervals between frames.
fn intervals(frames: &[Received]) -> Vec<Duration> {
    frames.windows(2).map(|pair| pair[1].at.mono.since(pair[0].at.mono)).collect()
}

fn heartbeats(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !set_period(session, TIMER)? {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(HEARTBEAT_TIME)));
    }
    let frames = session.lives(TIMER * (INTERVALS + 1))?;
    Ok(measured(&intervals(&frames), INTERVAL, WhyNot::NoState))
}

fn tpdos(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let tpdo = match timed(session)? {
        Ok(tpdo) => tpdo,
        Err(verdict) => return Ok(verdict),
    };
    let mut frames = session.collect(TIMER * (INTERVALS + 1))?;
    frames.retain(|received| is_data(received, tpdo.cob_id.can_id()));
    Ok(measured(&intervals(&frames), INTERVAL, WhyNot::NoTpdoSent))
}

fn silence(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    // A device without an event timer only answers.
    if timed(session)?.is_err() {
        session.command(NmtCommand::Start)?;
    }
    let (node, timeout) = (session.node.clone(), session.timeout());
    let answer = CanId::sdo_response(node.id);
    let started = session.master.now();
    let mut seen: Vec<Mono> = vec![started];
    session.is_answer_open = true;
    for object in OBJECTS.into_iter().cycle().take(READS_FOR_SILENCE) {
        if session.master.now().since(started) >= SILENCE_TIME {
            break;
        }
        let frame = Frame::full(CanId::sdo_request(node.id), request(0x40, object, [0; 4]));
        session.master.exchange_watching(frame, answer, timeout, &mut |received| {
            if is_from(&node, &received.frame) {
                seen.push(received.at.mono);
            }
        })?;
    }
    seen.push(session.master.now());
    let gaps: Vec<Duration> = seen.windows(2).map(|pair| pair[1].since(pair[0])).collect();
    Ok(measured(&gaps, &[Statistic::Max], WhyNot::NoTpdoSent))
}

fn boot(session: &mut Session<'_, '_>, command: NmtCommand) -> Result<Verdict, Error> {
    let mut times = Vec::new();
    for _ in 0..RESETS {
        let start = session.master.now();
        let lives = session.reset(command)?;
        let is_boot_up =
            |one: &&Received| matches!(ErrorControlMessage::parse(&one.frame), Some((_, ErrorControlMessage::BootUp)));
        times.extend(lives.iter().find(is_boot_up).map(|one| one.at.mono.since(start)));
    }
    Ok(measured(&times, &[Statistic::Min, Statistic::Median, Statistic::Max], WhyNot::NoState))
}

fn boot_node(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    boot(session, NmtCommand::ResetNode)
}

fn boot_communication(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    boot(session, NmtCommand::ResetCommunication)
}
