//! NMT commands and states, and the boot-up.

use super::case::{Area, Case, Run, Severity::*};
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::session::{SETTLE, Session};
use crate::bus::Received;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::node::Error;
use crate::node::state::{BOOT_TIMEOUT, HEARTBEAT_TIME};

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Nmt, id, sentence, clause, run)
}

const STATES: &str = "CiA 301, NMT state machine";
const BOOT_UP: &str = "CiA 301, boot-up protocol";
const SERVICES: &str = "CiA 301, services in each NMT state";

pub(super) const CASES: &[Case] = &[
    case("NMT-01", "A reset of the node is followed by one boot-up message", BOOT_UP, reset_node)
        .matters(High, "Masters do not notice that the device is ready, or that it was restarted."),
    case("NMT-02", "A reset of the communication is followed by one boot-up message", BOOT_UP, reset_communication)
        .matters(High, "Masters do not notice that the device is ready, or that it was restarted."),
    case(
        "NMT-03",
        "After the boot-up message the node is PRE-OPERATIONAL, or OPERATIONAL if it starts by itself",
        STATES,
        state_after_boot,
    )
    .matters(High, "The device sends measurements before it is set up, or never."),
    case("NMT-04", "Start leads to OPERATIONAL, from PRE-OPERATIONAL and from STOPPED", STATES, start)
        .matters(High, "The device sends no measurements."),
    case("NMT-05", "Stop leads to STOPPED, from PRE-OPERATIONAL and from OPERATIONAL", STATES, stop)
        .matters(Medium, "The device cannot be silenced."),
    case(
        "NMT-06",
        "Enter pre-operational leads to PRE-OPERATIONAL, from OPERATIONAL and from STOPPED",
        STATES,
        pre_operational,
    )
    .matters(Medium, "The device cannot be set up without a restart."),
    case("NMT-07", "SDO requests are answered in PRE-OPERATIONAL and OPERATIONAL", SERVICES, sdo_available)
        .matters(High, "Settings can be read only in some states."),
    case("NMT-08", "SDO requests are not answered in STOPPED", SERVICES, sdo_stopped)
        .matters(Low, "Masters that detect STOPPED by missing answers are wrong."),
    case("NMT-09", "Heartbeats are sent in STOPPED", SERVICES, heartbeat_stopped)
        .matters(Medium, "A stopped device looks like a lost one."),
    case("NMT-10", "An SDO request immediately after the boot-up message is answered", BOOT_UP, sdo_after_boot)
        .matters(Medium, "Masters that start at the boot-up message do not find the device."),
    case("NMT-11", "Unknown NMT commands are ignored", STATES, unknown_command)
        .matters(Medium, "A frame for another purpose changes the state."),
    case("NMT-12", "NMT commands with a wrong length are ignored", STATES, wrong_length)
        .matters(Low, "A damaged frame changes the state."),
    case(
        "NMT-13",
        "A value that was not stored is lost at a reset of the communication",
        "CiA 301, reset communication",
        value_lost,
    )
    .matters(Medium, "Temporary settings stay active after a restart."),
    case("NMT-14", "NMT commands to all nodes are executed", "CiA 301, NMT protocols", broadcast)
        .matters(High, "The device does not start together with the others.")
        .alone(),
    case("NMT-15", "NMT commands to another node are ignored", "CiA 301, NMT protocols", other_node)
        .matters(High, "The device starts, stops or restarts with another one.")
        .alone(),
];

/// Boot-up messages: their number and form.
fn boot_up(session: &mut Session<'_, '_>, command: NmtCommand) -> Result<Verdict, Error> {
    let lives = session.reset(command)?;
    let is_boot_up = |received: &&Received| {
        ErrorControlMessage::parse(&received.frame).is_some_and(|(_, life)| life == ErrorControlMessage::BootUp)
    };
    let Some(first) = lives.iter().find(is_boot_up) else {
        return Ok(Verdict::of([Finding::new(Expected::BootUp, Seen::Nothing(BOOT_TIMEOUT))]));
    };
    if first.frame.data() != [0x00] {
        return Ok(Verdict::of([Finding::new(Expected::BootUp, Seen::Frame(first.frame))]));
    }
    let later = session.lives(SETTLE * 10)?;
    let count = 1 + later.iter().filter(is_boot_up).count();
    Ok(Verdict::of((count > 1).then(|| Finding::new(Expected::BootUp, Seen::Frames(count)))))
}

fn reset_node(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    boot_up(session, NmtCommand::ResetNode)
}

fn reset_communication(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    boot_up(session, NmtCommand::ResetCommunication)
}

fn state_after_boot(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    session.reset(NmtCommand::ResetNode)?;
    if !session.show_states()? {
        return Ok(Verdict::NotApplicable(WhyNot::NoState));
    }
    let found = session.await_state(NmtState::PreOperational)?;
    let is_right = match found {
        Some(NmtState::PreOperational) => true,
        Some(NmtState::Operational) => starts_itself(session)?,
        _ => false,
    };
    Ok(Verdict::of((!is_right).then(|| Finding::new(Expected::StateAfterBoot, Seen::State(found)))))
}

/// Whether the settings of the node allow that it enters OPERATIONAL by itself. A device without 1F80h decides itself.
fn starts_itself(session: &mut Session<'_, '_>) -> Result<bool, Error> {
    let described = session.node.model.as_ref().and_then(|model| model.description.startup.clone());
    if let Some(startup) = described {
        return Ok(session.number(startup.object)?.is_none_or(|value| value != u64::from(startup.wait)));
    }
    // CiA 302-2: bit 2 clear.
    Ok(session.number(ObjectId::new(0x1f80, 0))?.is_none_or(|value| value & 0b100 == 0))
}

/// Sends commands one after the other, and checks the state after the last one.
fn reaches(session: &mut Session<'_, '_>, commands: &[NmtCommand]) -> Result<Verdict, Error> {
    let mut found = None;
    let mut wanted = NmtState::PreOperational;
    for command in commands {
        session.command(*command)?;
        wanted = command.target();
        found = session.await_state(wanted)?;
    }
    if found.is_none() {
        return Ok(Verdict::not_judged(WhyNot::NoState));
    }
    Ok(Verdict::of((found != Some(wanted)).then(|| Finding::new(Expected::State(wanted), Seen::State(found)))))
}

fn paths(session: &mut Session<'_, '_>, paths: [&[NmtCommand]; 2]) -> Result<Verdict, Error> {
    if !session.show_states()? {
        return Ok(Verdict::NotApplicable(WhyNot::NoState));
    }
    for path in paths {
        let verdict = reaches(session, path)?;
        if !matches!(verdict, Verdict::Pass) {
            return Ok(verdict);
        }
    }
    Ok(Verdict::Pass)
}

use NmtCommand::{EnterPreOperational, Start, Stop};

fn start(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    paths(session, [&[EnterPreOperational, Start], &[Stop, Start]])
}

fn stop(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    paths(session, [&[EnterPreOperational, Stop], &[Start, Stop]])
}

fn pre_operational(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    paths(session, [&[Start, EnterPreOperational], &[Stop, EnterPreOperational]])
}

fn sdo_available(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut findings = Vec::new();
    for command in [EnterPreOperational, Start] {
        session.command(command)?;
        if session.upload(ObjectId::DEVICE_TYPE)?.is_none() {
            let seen = Seen::Nothing(session.timeout());
            findings.push(Finding::at(ObjectId::DEVICE_TYPE, Expected::Answer, seen));
        }
        session.open_transfer = None;
    }
    Ok(Verdict::of(findings))
}

fn sdo_stopped(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    session.command(Stop)?;
    let answer = session.upload(ObjectId::DEVICE_TYPE)?;
    session.open_transfer = None;
    let finding = |frame| Finding::at(ObjectId::DEVICE_TYPE, Expected::NoAnswer, Seen::Frame(frame));
    Ok(Verdict::of(answer.map(finding)))
}

fn heartbeat_stopped(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !session.show_states()? {
        return Ok(Verdict::NotApplicable(WhyNot::NoState));
    }
    session.command(Stop)?;
    let found = session.await_state(NmtState::Stopped)?;
    Ok(Verdict::of(found.is_none().then(|| Finding::new(Expected::State(NmtState::Stopped), Seen::State(None)))))
}

fn sdo_after_boot(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    session.reset(NmtCommand::ResetCommunication)?;
    let answer = session.upload(ObjectId::DEVICE_TYPE)?;
    session.open_transfer = None;
    let seen = Seen::Nothing(session.timeout());
    let finding = || Finding::at(ObjectId::DEVICE_TYPE, Expected::Answer, seen);
    Ok(Verdict::of(answer.is_none().then(finding)))
}

/// Sends frames that must not change PRE-OPERATIONAL.
fn ignores(session: &mut Session<'_, '_>, frames: &[Frame]) -> Result<Verdict, Error> {
    if !session.show_states()? {
        return Ok(Verdict::NotApplicable(WhyNot::NoState));
    }
    session.command(EnterPreOperational)?;
    let mut findings = Vec::new();
    for frame in frames {
        session.settings.all_changed();
        session.send(*frame)?;
        // A heartbeat of the old state may be under way.
        session.pause(super::session::STATE_PERIOD)?;
        let found = session.await_state(NmtState::PreOperational)?;
        if found != Some(NmtState::PreOperational) {
            findings.push(Finding::new(Expected::State(NmtState::PreOperational), Seen::State(found)));
            break;
        }
    }
    Ok(Verdict::of(findings))
}

fn unknown_command(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let node = session.node.id.get();
    ignores(session, &[0x00, 0x03, 0x7f, 0xff].map(|specifier| Frame::pair(CanId::NMT, specifier, node)))
}

fn wrong_length(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let node = session.node.id.get();
    let frames = [&[0x02][..], &[0x02, node, 0]];
    let frames: Vec<Frame> = frames.into_iter().filter_map(|data| Frame::new(CanId::NMT, data).ok()).collect();
    ignores(session, &frames)
}

fn value_lost(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = HEARTBEAT_TIME;
    let Some(value) = session.read(object)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(object))) };
    // This value is not stored.
    let new = 54_321u16.to_le_bytes();
    if value == new || session.try_write(object, &new)?.is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NotWritable(object)));
    }
    session.reset(NmtCommand::ResetCommunication)?;
    let found = session.read(object)?.unwrap_or_default();
    let finding = || Finding::at(object, Expected::OtherBytes(new.to_vec()), Seen::Bytes(new.to_vec()));
    Ok(Verdict::of((found == new).then(finding)))
}

fn broadcast(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !session.show_states()? {
        return Ok(Verdict::NotApplicable(WhyNot::NoState));
    }
    session.command(EnterPreOperational)?;
    session.send(Start.frame(None))?;
    let found = session.await_state(NmtState::Operational)?;
    let is_right = found == Some(NmtState::Operational);
    let finding = || Finding::new(Expected::State(NmtState::Operational), Seen::State(found));
    Ok(Verdict::of((!is_right).then(finding)))
}

fn other_node(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let other = session.node.id.get() % 127 + 1;
    ignores(session, &[0x01, 0x02].map(|specifier| Frame::pair(CanId::NMT, specifier, other)))
}
