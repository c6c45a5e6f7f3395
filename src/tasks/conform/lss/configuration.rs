//! Node-ID (11h) and store configuration (17h).

use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::pending::LssSetting::NodeId;
use super::{NO_LSS, enter_configuration, is_accepted, is_rejected, prepare, wrong_form};
use crate::bus::Received;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand};
use crate::canopen::object::ObjectId;
use crate::master::lss::STORE_TIMEOUT;
use crate::node::Error;
use crate::node::state::BOOT_TIMEOUT;

pub(super) fn wrong_node_ids(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !enter_configuration(session)? {
        return Ok(NO_LSS);
    }
    for id in [0, 128] {
        match session.configure(NodeId, &[0x11, id])? {
            Some(frame) if is_rejected(&frame, 0x11) => {}
            Some(frame) => return Ok(Verdict::of([Finding::new(Expected::Refused, Seen::Frame(frame))])),
            None => return Ok(Verdict::NotApplicable(WhyNot::NoService(0x11))),
        }
    }
    Ok(Verdict::Pass)
}

/// Sets the present node-ID.
fn configure_own(session: &mut Session<'_, '_>) -> Result<Option<Frame>, Error> {
    let own = session.node.id.get();
    session.lss(&[0x11, own])
}

pub(super) fn own_node_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !enter_configuration(session)? {
        return Ok(NO_LSS);
    }
    Ok(match configure_own(session)? {
        Some(frame) if is_accepted(&frame, 0x11) => Verdict::Pass,
        Some(frame) => Verdict::of([Finding::new(Expected::Acknowledged, Seen::Frame(frame))]),
        None => Verdict::NotApplicable(WhyNot::NoService(0x11)),
    })
}

pub(super) fn form(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !enter_configuration(session)? {
        return Ok(NO_LSS);
    }
    let Some(answer) = configure_own(session)? else { return Ok(Verdict::NotApplicable(WhyNot::NoService(0x11))) };
    Ok(Verdict::of(wrong_form(answer, 3)))
}

/// Sets the present node-ID, and stores node-ID and bit rate (17h). Returns the verdict if the device does not
/// acknowledge one of the two services.
///
/// The bit rate is not set: a device that detects the bit rate would then store a fixed bit rate.
fn store_present(session: &mut Session<'_, '_>) -> Result<Result<Frame, Box<Verdict>>, Error> {
    let not_applicable = |why| Ok(Err(Box::new(Verdict::NotApplicable(why))));
    // A case has sent a reserved bit rate, and the device has not rejected it.
    if session.may_store_fixed_rate() {
        return Ok(Err(Box::new(Verdict::not_judged(WhyNot::DetectsBitRate { was_set: true }))));
    }
    if !enter_configuration(session)? {
        return Ok(Err(Box::new(NO_LSS)));
    }
    match configure_own(session)? {
        Some(frame) if is_accepted(&frame, 0x11) => {}
        Some(_) => return not_applicable(WhyNot::LssRejected(0x11)),
        None => return not_applicable(WhyNot::NoService(0x11)),
    }
    Ok(match session.lss_within(&[0x17], STORE_TIMEOUT)? {
        Some(frame) if is_accepted(&frame, 0x17) => Ok(frame),
        // Error code 1: the device cannot store, which CiA 305 allows.
        Some(frame) if frame.data().starts_with(&[0x17, 1]) => return not_applicable(WhyNot::LssRejected(0x17)),
        Some(frame) => Err(Box::new(Verdict::of([Finding::new(Expected::Acknowledged, Seen::Frame(frame))]))),
        None => return not_applicable(WhyNot::NoService(0x17)),
    })
}

pub(super) fn store(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    Ok(match store_present(session)? {
        Ok(answer) => Verdict::of(wrong_form(answer, 3)),
        Err(verdict) => *verdict,
    })
}

pub(super) fn keeps_node_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Err(verdict) = store_present(session)? {
        // LSS-24 reports the wrong answer.
        let is_wrong = matches!(*verdict, Verdict::Deviates(_));
        return Ok(if is_wrong { Verdict::NotApplicable(WhyNot::LssRejected(0x17)) } else { *verdict });
    }
    // LSS-03 checks whether the answer is the present node-ID.
    let before = session.lss(&[0x5e])?;
    let own = CanId::heartbeat(session.node.id);
    if let Some(boot_up) = reset(session)?
        && boot_up.frame.id() != own
    {
        return Ok(Verdict::of([Finding::new(Expected::BootUp, Seen::Frame(boot_up.frame))]));
    }
    session.read(ObjectId::DEVICE_TYPE)?;
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.switch(1)?;
    let other = session.lss(&[0x5e])?.filter(|frame| before.is_some_and(|before| before != *frame));
    let expected = Expected::Number(session.node.id.get().into());
    Ok(Verdict::of(other.map(|frame| Finding::new(expected, Seen::Frame(frame)))))
}

/// Resets the node. Returns the first boot-up message, of any node.
fn reset(session: &mut Session<'_, '_>) -> Result<Option<Received>, Error> {
    let timeout = BOOT_TIMEOUT.max(session.timeout());
    session.settings.all_changed();
    session.queue_command(NmtCommand::ResetNode);
    let mut found = None;
    session.collect_until(timeout, |received| {
        let is_boot_up = matches!(ErrorControlMessage::parse(&received.frame), Some((_, ErrorControlMessage::BootUp)));
        if is_boot_up {
            found = Some(*received);
        }
        is_boot_up
    })?;
    Ok(found)
}
