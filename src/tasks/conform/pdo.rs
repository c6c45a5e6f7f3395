//! TPDOs: transmission types, timers, and the rules for their parameters.

pub(super) mod locks;
pub(super) mod mapping;

use super::case::{Area, Case, Run, Severity::*};
use super::codes;
use super::error_control::{is_near, mean_interval};
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::sdo::expect_abort;
use super::session::{SETTLE, Session};
use crate::bus::Received;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::CobId;
use crate::node::Error;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Pdo, id, sentence, clause, run)
}

const PARAMETERS: &str = "CiA 301, PDO communication parameter";
const TYPES: &str = "CiA 301, PDO transmission types";

pub(super) const CASES: &[Case] = &[
    case("PDO-01", "Each TPDO has a COB-ID, a transmission type and a mapping", PARAMETERS, parameters)
        .matters(High, "Masters cannot decode the measurements."),
    case("PDO-02", "The COB-ID of each valid TPDO is not restricted", "CiA 301, restricted CAN-IDs", cob_id)
        .matters(High, "Measurements disturb other services."),
    case("PDO-03", "Transmission type 1: one TPDO follows each SYNC", TYPES, every_sync)
        .matters(High, "Synchronous measurements are missing.")
        .alone(),
    case("PDO-04", "Transmission type 3: one TPDO follows each third SYNC", TYPES, third_sync)
        .matters(Medium, "Synchronous measurements come at a wrong rate.")
        .alone(),
    case("PDO-05", "With transmission types 0 and 1 no TPDO is sent without SYNC", TYPES, no_sync)
        .matters(Medium, "Unexpected frames load the bus.")
        .alone(),
    case("PDO-06", "The reserved transmission types 241 and 251 are rejected", TYPES, reserved_types)
        .matters(Low, "A wrong setting is not noticed."),
    case("PDO-07", "The event timer gives the period of the TPDO", "CiA 301, event timer", event_timer)
        .matters(High, "Measurements come at a wrong rate.")
        .alone(),
    case("PDO-08", "A new event timer is used while the node is OPERATIONAL", "CiA 301, event timer", new_event_timer)
        .matters(Low, "The node must be restarted after a change.")
        .alone(),
    case("PDO-09", "TPDOs do not come more often than the inhibit time allows", "CiA 301, inhibit time", inhibit_time)
        .matters(Medium, "A TPDO with high priority fills the bus.")
        .alone(),
    case("PDO-13", "The TPDO has the length of its mapping", "CiA 301, PDO mapping", length)
        .matters(High, "Masters reject the measurements, or decode them wrongly.")
        .alone(),
    case("PDO-14", "No TPDO is sent in PRE-OPERATIONAL and in STOPPED", "CiA 301, services in each NMT state", states)
        .matters(High, "Measurements are sent before the network is set up.")
        .alone(),
    case("PDO-15", "A TPDO that is not valid (bit 31) is not sent", PARAMETERS, invalid)
        .matters(Medium, "A TPDO cannot be switched off.")
        .alone(),
    case("PDO-16", "A new CAN-ID is used", PARAMETERS, new_cob_id)
        .matters(Medium, "Two devices cannot be given different CAN-IDs.")
        .alone(),
    case("PDO-17", "A new COB-ID of SYNC (1005h) is used", "CiA 301, object 1005h", sync_cob_id)
        .matters(Low, "Two groups of devices cannot have their own SYNC.")
        .alone(),
    case("PDO-18", "A remote request is answered unless bit 30 of the COB-ID is set", PARAMETERS, remote)
        .matters(Low, "A master that polls TPDOs gets no data, or data that it must not get.")
        .alone(),
];

/// A TPDO of the device.
#[derive(Clone, Copy)]
pub(super) struct Tpdo {
    pub(super) number: u16,
    pub(super) cob_id: CobId,
}

impl Tpdo {
    pub(super) fn communication(self, sub: u8) -> ObjectId {
        ObjectId::new(0x1800 + self.number, sub)
    }

    pub(super) fn mapping(self, sub: u8) -> ObjectId {
        ObjectId::new(0x1a00 + self.number, sub)
    }
}

/// The number of TPDOs that are looked for without a description.
const MAX_TPDOS: u16 = 16;

/// The TPDOs of the device.
pub(super) fn tpdos(session: &mut Session<'_, '_>) -> Result<Vec<Tpdo>, Error> {
    let mut found = Vec::new();
    for number in 0..MAX_TPDOS {
        match session.number(ObjectId::new(0x1800 + number, 1))? {
            Some(word) => found.push(Tpdo { number, cob_id: CobId(u32::try_from(word).unwrap_or(0)) }),
            // The TPDO for a second probe may be the fifth one.
            None if number > 4 => break,
            None => {}
        }
    }
    Ok(found)
}

const NO_TPDO: Verdict = Verdict::NotApplicable(WhyNot::NoTpdo);

/// The first TPDO with an 11-bit COB-ID and a mapping, in PRE-OPERATIONAL and switched on; the others are switched off.
fn prepare(session: &mut Session<'_, '_>) -> Result<Option<Tpdo>, Error> {
    prepare_number(session, None)
}

/// The same for the TPDO with this number (0 for 1800h).
pub(super) fn prepare_number(session: &mut Session<'_, '_>, number: Option<u16>) -> Result<Option<Tpdo>, Error> {
    let all = tpdos(session)?;
    let mut chosen = None;
    for tpdo in all.iter().filter(|tpdo| number.is_none_or(|number| number == tpdo.number)) {
        let is_mapped = session.number(tpdo.mapping(0))?.is_some_and(|count| (1..=64).contains(&count));
        if chosen.is_none() && is_mapped && tpdo.cob_id.0 & 0x2000_0000 == 0 && tpdo.cob_id.0 & 0x7ff != 0 {
            chosen = Some(*tpdo);
        }
    }
    let Some(tpdo) = chosen else { return Ok(None) };
    session.command(NmtCommand::EnterPreOperational)?;
    for other in all.iter().filter(|other| other.number != tpdo.number && other.cob_id.is_valid()) {
        session.try_write(other.communication(1), &other.cob_id.switched_off().0.to_le_bytes())?;
    }
    if !tpdo.cob_id.is_valid() {
        session.try_write(tpdo.communication(1), &tpdo.cob_id.switched_on().0.to_le_bytes())?;
    }
    Ok(Some(Tpdo { cob_id: tpdo.cob_id.switched_on(), ..tpdo }))
}

/// Sets transmission type and event timer. `false` if the device rejects the type or the timer.
pub(super) fn set_up(session: &mut Session<'_, '_>, tpdo: Tpdo, kind: u8, timer_ms: u16) -> Result<bool, Error> {
    if session.try_write(tpdo.communication(2), &[kind])?.is_some() {
        return Ok(false);
    }
    let timer = tpdo.communication(5);
    if session.number(timer)?.is_none() {
        return Ok(timer_ms == 0);
    }
    // A synchronous TPDO ignores the timer, and some devices do not allow 0.
    let is_rejected = session.try_write(timer, &timer_ms.to_le_bytes())?.is_some();
    Ok(!is_rejected || timer_ms == 0 && kind <= 240)
}

/// Sets an event timer with the transmission type that the device uses for it. `false` if there is none.
fn set_timer(session: &mut Session<'_, '_>, tpdo: Tpdo, timer: Duration) -> Result<bool, Error> {
    let milliseconds = u16::try_from(timer.as_millis()).unwrap_or(u16::MAX);
    let described = session.node.model.as_ref().and_then(|model| model.description.pdo.timer);
    let kinds = described.map_or(vec![254, 255], |kind| vec![kind]);
    for kind in kinds {
        if session.number(tpdo.communication(5))?.is_some() && set_up(session, tpdo, kind, milliseconds)? {
            return Ok(true);
        }
    }
    Ok(false)
}

pub(super) fn is_data(received: &Received, id: CanId) -> bool {
    received.frame.id() == id && !received.frame.is_remote()
}

/// The TPDOs with this CAN-ID within this time.
fn received(session: &mut Session<'_, '_>, id: CanId, time: Duration) -> Result<Vec<Received>, Error> {
    Ok(session.collect(time)?.into_iter().filter(|received| is_data(received, id)).collect())
}

fn parameters(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let all = tpdos(session)?;
    if all.is_empty() {
        return Ok(NO_TPDO);
    }
    let mut findings = Vec::new();
    for tpdo in all {
        for object in [tpdo.communication(2), tpdo.mapping(0)] {
            if session.read(object)?.is_none() {
                findings.push(Finding::at(object, Expected::Answer, Seen::Bytes(Vec::new())));
            }
        }
    }
    Ok(Verdict::of(findings))
}

fn cob_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let all = tpdos(session)?;
    if all.is_empty() {
        return Ok(NO_TPDO);
    }
    let wrong = all.into_iter().filter(|tpdo| tpdo.cob_id.is_valid() && tpdo.cob_id.can_id().is_restricted());
    let finding = |tpdo: Tpdo| {
        Finding::at(tpdo.communication(1), Expected::OtherCanId, Seen::Bytes(tpdo.cob_id.0.to_le_bytes().to_vec()))
    };
    Ok(Verdict::of(wrong.map(finding)))
}

/// The interval between two SYNCs.
const SYNC_INTERVAL: Duration = Duration::from_millis(30);

/// The COB-ID of SYNC.
fn sync_id(session: &Session<'_, '_>) -> CanId {
    session.node.sync
}

/// Sends SYNC, and returns the number of TPDOs after each one.
fn after_syncs(session: &mut Session<'_, '_>, sync: CanId, id: CanId, count: usize) -> Result<Vec<usize>, Error> {
    let mut counts = Vec::new();
    for counter in 1..=count {
        let counter = u8::try_from(counter).unwrap_or(1);
        let frame = if session.node.sync_overflow.is_some() { Frame::byte(sync, counter) } else { Frame::empty(sync) };
        session.master.send(frame);
        counts.push(received(session, id, SYNC_INTERVAL)?.len());
    }
    Ok(counts)
}

/// The TPDOs of `syncs` SYNCs with a synchronous transmission type.
fn synchronous(session: &mut Session<'_, '_>, kind: u8, syncs: usize) -> Result<Option<(Tpdo, Vec<usize>)>, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(None) };
    if !set_up(session, tpdo, kind, 0)? {
        return Ok(None);
    }
    session.command(NmtCommand::Start)?;
    session.pause(SYNC_INTERVAL)?;
    let counts = after_syncs(session, sync_id(session), tpdo.cob_id.can_id(), syncs)?;
    Ok(Some((tpdo, counts)))
}

fn every_sync(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((tpdo, counts)) = synchronous(session, 1, 5)? else { return Ok(NO_TPDO) };
    let wrong = counts.iter().find(|count| **count != 1);
    let finding = |count: &usize| Finding::at(tpdo.communication(2), Expected::Frames(1), Seen::Frames(*count));
    Ok(Verdict::of(wrong.map(finding)))
}

fn third_sync(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((tpdo, counts)) = synchronous(session, 3, 9)? else { return Ok(NO_TPDO) };
    let total: usize = counts.iter().sum();
    let finding = || Finding::at(tpdo.communication(2), Expected::Frames(3), Seen::Frames(total));
    Ok(Verdict::of((total != 3).then(finding)))
}

fn no_sync(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    let mut findings = Vec::new();
    for kind in [0, 1] {
        session.command(NmtCommand::EnterPreOperational)?;
        if !set_up(session, tpdo, kind, 0)? {
            continue;
        }
        session.queue_command(NmtCommand::Start);
        let count = received(session, tpdo.cob_id.can_id(), SYNC_INTERVAL * 10)?.len();
        if count > 0 {
            findings.push(Finding::at(tpdo.communication(2), Expected::Frames(0), Seen::Frames(count)));
        }
    }
    Ok(Verdict::of(findings))
}

fn reserved_types(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    let object = tpdo.communication(2);
    let Some(old) = session.read(object)? else { return Ok(NO_TPDO) };
    if session.try_write(object, &old)?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    let mut findings = Vec::new();
    for kind in [241, 251] {
        let answer = session.download(object, &[kind])?;
        findings.extend(expect_abort(session, object, codes::VALUE, answer));
    }
    Ok(Verdict::of(findings))
}

/// The event timers of the cases. Some devices have a shortest one of 100 ms.
pub(super) const TIMER: Duration = Duration::from_millis(100);
const INTERVALS: u32 = 8;

fn period(session: &mut Session<'_, '_>, tpdo: Tpdo, wanted: Duration) -> Result<Option<Finding>, Error> {
    let frames = received(session, tpdo.cob_id.can_id(), wanted * (INTERVALS + 1) + SETTLE)?;
    let object = tpdo.communication(5);
    Ok(match mean_interval(&frames) {
        Some(found) if is_near(found, wanted) => None,
        Some(found) => Some(Finding::at(object, Expected::Period(wanted), Seen::Period(found))),
        None => Some(Finding::at(object, Expected::Period(wanted), Seen::Frames(frames.len()))),
    })
}

const NO_TIMER: Verdict = Verdict::NotApplicable(WhyNot::NoEventTimer);

/// A TPDO that is sent by its event timer, in OPERATIONAL.
pub(super) fn timed(session: &mut Session<'_, '_>) -> Result<Result<Tpdo, Verdict>, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(Err(NO_TPDO)) };
    if !set_timer(session, tpdo, TIMER)? {
        return Ok(Err(NO_TIMER));
    }
    quiet(session)?;
    session.command(NmtCommand::Start)?;
    Ok(Ok(tpdo))
}

/// Switches off the events of CiA 404 (delta and limits), so that only the timer sends.
pub(super) fn quiet(session: &mut Session<'_, '_>) -> Result<(), Error> {
    let settings = session.settings.of_profile(&[0x133, 0x134, 0x135]);
    for (object, value) in settings {
        if value.iter().any(|&byte| byte != 0) {
            session.try_write(object, &vec![0; value.len()])?;
        }
    }
    Ok(())
}

fn event_timer(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let tpdo = match timed(session)? {
        Ok(tpdo) => tpdo,
        Err(verdict) => return Ok(verdict),
    };
    Ok(Verdict::of(period(session, tpdo, TIMER)?))
}

fn new_event_timer(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let tpdo = match timed(session)? {
        Ok(tpdo) => tpdo,
        Err(verdict) => return Ok(verdict),
    };
    session.pause(TIMER * 2)?;
    let object = tpdo.communication(5);
    if session.try_write(object, &200u16.to_le_bytes())?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    // One more TPDO may come in the old rhythm.
    session.pause(TIMER * 2)?;
    Ok(Verdict::of(period(session, tpdo, TIMER * 2)?))
}

/// The inhibit time in `PDO-09`, in units of 100 us: 250 ms.
const INHIBIT: u16 = 2500;

fn inhibit_time(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    let object = tpdo.communication(3);
    if session.read(object)?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoObject(object)));
    }
    session.set(tpdo.communication(1), &tpdo.cob_id.switched_off().0.to_le_bytes())?;
    if session.try_write(object, &INHIBIT.to_le_bytes())?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    session.set(tpdo.communication(1), &tpdo.cob_id.0.to_le_bytes())?;
    if !set_timer(session, tpdo, TIMER)? {
        return Ok(NO_TIMER);
    }
    session.command(NmtCommand::Start)?;
    let frames = received(session, tpdo.cob_id.can_id(), TIMER * 12)?;
    let least = Duration::from_micros(100) * u32::from(INHIBIT);
    let intervals = frames.windows(2).map(|pair| pair[1].at.mono.since(pair[0].at.mono));
    let shortest = intervals.min().filter(|interval| *interval + Duration::from_millis(3) < least);
    let finding = |interval| Finding::at(object, Expected::AtLeast(least), Seen::Period(interval));
    Ok(Verdict::of(shortest.map(finding)))
}

fn length(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let tpdo = match timed(session)? {
        Ok(tpdo) => tpdo,
        Err(verdict) => return Ok(verdict),
    };
    let count = session.number(tpdo.mapping(0))?.unwrap_or(0);
    let mut bits = 0;
    for sub in 1..=u8::try_from(count).unwrap_or(0) {
        bits += session.number(tpdo.mapping(sub))?.unwrap_or(0) & 0xff;
    }
    let frames = received(session, tpdo.cob_id.can_id(), TIMER * 3)?;
    let Some(frame) = frames.first() else { return Ok(Verdict::not_judged(WhyNot::NoTpdoSent)) };
    let bytes = usize::try_from(bits / 8).unwrap_or(0);
    let finding = || Finding::at(tpdo.mapping(0), Expected::Size(bytes), Seen::Frame(frame.frame));
    Ok(Verdict::of((frame.frame.data().len() != bytes).then(finding)))
}

fn states(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let tpdo = match timed(session)? {
        Ok(tpdo) => tpdo,
        Err(verdict) => return Ok(verdict),
    };
    let mut findings = Vec::new();
    for command in [NmtCommand::EnterPreOperational, NmtCommand::Stop] {
        session.command(command)?;
        session.master.send(Frame::empty(sync_id(session)));
        let count = received(session, tpdo.cob_id.can_id(), TIMER * 4)?.len();
        if count > 0 {
            findings.push(Finding::at(tpdo.communication(1), Expected::Frames(0), Seen::Frames(count)));
        }
    }
    Ok(Verdict::of(findings))
}

fn invalid(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    if !set_timer(session, tpdo, TIMER)? {
        return Ok(NO_TIMER);
    }
    let object = tpdo.communication(1);
    if session.try_write(object, &tpdo.cob_id.switched_off().0.to_le_bytes())?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    session.command(NmtCommand::Start)?;
    let count = received(session, tpdo.cob_id.can_id(), TIMER * 4)?.len();
    let finding = || Finding::at(object, Expected::Frames(0), Seen::Frames(count));
    Ok(Verdict::of((count > 0).then(finding)))
}

fn new_cob_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    if !set_timer(session, tpdo, TIMER)? {
        return Ok(NO_TIMER);
    }
    let (object, new) = (tpdo.communication(1), locks::other_id(tpdo));
    let steps = [tpdo.cob_id.switched_off(), new.switched_off(), new];
    for word in steps {
        if session.try_write(object, &word.0.to_le_bytes())?.is_some() {
            return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
        }
    }
    session.command(NmtCommand::Start)?;
    let frames = session.collect(TIMER * 5)?;
    let count = |id: CanId| frames.iter().filter(|received| is_data(received, id)).count();
    let (old, new) = (count(tpdo.cob_id.can_id()), count(new.can_id()));
    let missing = (new == 0).then(|| Finding::at(object, Expected::Within(TIMER), Seen::Nothing(TIMER * 5)));
    let extra = (old > 0).then(|| Finding::at(object, Expected::Frames(0), Seen::Frames(old)));
    Ok(Verdict::of(missing.into_iter().chain(extra)))
}

const COB_ID_SYNC: ObjectId = ObjectId::new(0x1005, 0);

/// Another CAN-ID for SYNC.
const OTHER_SYNC: u16 = 0x0f0;

fn sync_cob_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    if !set_up(session, tpdo, 1, 0)? {
        return Ok(NO_TPDO);
    }
    let Some(other) = CanId::standard(OTHER_SYNC) else { return Ok(NO_TPDO) };
    if session.try_write(COB_ID_SYNC, &other.number().to_le_bytes())?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(COB_ID_SYNC)));
    }
    session.command(NmtCommand::Start)?;
    let id = tpdo.cob_id.can_id();
    let new: usize = after_syncs(session, other, id, 3)?.iter().sum();
    let old: usize = after_syncs(session, sync_id(session), id, 3)?.iter().sum();
    let missing = (new == 0).then(|| Finding::at(COB_ID_SYNC, Expected::Frames(3), Seen::Frames(new)));
    let extra = (old > 0).then(|| Finding::at(COB_ID_SYNC, Expected::Frames(0), Seen::Frames(old)));
    Ok(Verdict::of(missing.into_iter().chain(extra)))
}

fn remote(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !session.master.bus().sends_remote_frames() {
        return Ok(Verdict::NotApplicable(WhyNot::NoRemoteFrames));
    }
    let Some(tpdo) = prepare(session)? else { return Ok(NO_TPDO) };
    if !set_up(session, tpdo, 1, 0)? {
        return Ok(NO_TPDO);
    }
    session.command(NmtCommand::Start)?;
    session.pause(SYNC_INTERVAL)?;
    let id = tpdo.cob_id.can_id();
    let Ok(request) = Frame::remote(id, 8) else { return Ok(NO_TPDO) };
    session.master.send(request);
    let count = received(session, id, SYNC_INTERVAL * 3)?.len();
    let wanted = usize::from(tpdo.cob_id.allows_rtr());
    let finding = || Finding::at(tpdo.communication(1), Expected::Frames(wanted), Seen::Frames(count));
    // Many controllers cannot answer remote requests, and CiA 301 advises against them. Only an answer is a deviation.
    Ok(if wanted == 1 && count == 0 {
        Verdict::NotApplicable(WhyNot::NoRemoteAnswer)
    } else {
        Verdict::of((count != wanted).then(finding))
    })
}
