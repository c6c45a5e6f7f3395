//! Services with an address: switch state selective, identify, fastscan.

use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::{NO_LSS, TIMEOUT, enter_configuration, expect_silence, prepare};
use crate::canopen::frame::Frame;
use crate::node::Error;

pub(super) fn selective(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(address) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let answer = session.select(address)?;
    let is_right = answer.as_ref().is_some_and(|frame| frame.data().first() == Some(&0x44));
    let finding = || Finding::new(Expected::Service(0x44), Seen::answer(answer, TIMEOUT));
    Ok(Verdict::of((!is_right).then(finding)))
}

pub(super) fn other_addresses(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(own) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    for part in 0..own.len() {
        let mut other = own;
        other[part] ^= 1;
        if let Some(answer) = session.select(other)? {
            return Ok(expect_silence(Some(answer)));
        }
    }
    Ok(Verdict::Pass)
}

pub(super) fn identified(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some([vendor, product, revision, serial]) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    match session.identify([vendor, product, revision, revision, serial, serial])? {
        Some(frame) if frame.data().first() == Some(&0x4f) => Ok(Verdict::Pass),
        Some(frame) => Ok(Verdict::of([Finding::new(Expected::Service(0x4f), Seen::Frame(frame))])),
        None => Ok(Verdict::NotApplicable(WhyNot::NoService(0x46))),
    }
}

pub(super) fn not_identified(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some([vendor, product, revision, serial]) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let low = serial.checked_add(1).unwrap_or(0);
    let high = if low == 0 { 0 } else { u32::MAX };
    let answer = session.identify([vendor, product, revision, revision, low, high])?;
    Ok(expect_silence(answer))
}

pub(super) fn configured(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    for request in [&[0x4c][..], &SCAN_START] {
        if let Some(answer) = session.lss(request)? {
            return Ok(expect_silence(Some(answer)));
        }
    }
    Ok(Verdict::Pass)
}

/// Returns a fastscan request. It asks whether bits 31 to `last` of a part of the address are those of `number`.
fn scan_request(number: u32, last: u8, part: u8, next: u8) -> [u8; 8] {
    let [a, b, c, d] = number.to_le_bytes();
    [0x51, a, b, c, d, last, part, next]
}

/// The request that starts a fastscan. LSS-09 checks its answer.
const SCAN_START: [u8; 8] = [0x51, 0, 0, 0, 0, 0x80, 0, 0];

pub(super) fn scanned(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(address) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    // LSS-04 checks that inquiries are not answered in waiting state.
    let shows_state = session.lss(&[0x5a])?.is_none();
    session.lss(&SCAN_START)?;
    for (part, number) in (0..).zip(address) {
        for request in [scan_request(number, 31, part, part), scan_request(number, 0, part, (part + 1) % 4)] {
            if let Some(answer) = session.lss(&request)? {
                return Ok(expect_silence(Some(answer)));
            }
        }
    }
    if let Some(answer) = session.lss(&[0x5a])?.filter(|_| shows_state) {
        return Ok(expect_silence(Some(answer)));
    }
    session.switch(1)?;
    session.lss(&SCAN_START)?;
    let answer = session.lss(&scan_request(address[0], 0, 0, 1))?;
    Ok(expect_silence(answer))
}

/// The verdict on the answer to inquiry 5Ah. A device in configuration state has to answer.
fn expect_inquiry(answer: Option<Frame>) -> Verdict {
    match answer {
        Some(frame) if frame.data().first() == Some(&0x5a) => Verdict::Pass,
        answer => Verdict::of([Finding::new(Expected::Service(0x5a), Seen::answer(answer, TIMEOUT))]),
    }
}

pub(super) fn configuring(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(address) = session.address()? else { return Ok(NO_LSS) };
    if !enter_configuration(session)? {
        return Ok(NO_LSS);
    }
    if session.lss(&[0x5a])?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoService(0x5a)));
    }
    session.switch(0)?;
    if session.select(address)?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoService(0x40)));
    }
    let answer = session.lss(&[0x5a])?;
    Ok(expect_inquiry(answer))
}

pub(super) fn stays_in_configuration(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some([vendor, product, revision, serial]) = session.address()? else { return Ok(NO_LSS) };
    if !enter_configuration(session)? {
        return Ok(NO_LSS);
    }
    if session.lss(&[0x5a])?.is_none() {
        return Ok(Verdict::NotApplicable(WhyNot::NoService(0x5a)));
    }
    session.select([vendor, product, revision, serial ^ 1])?;
    let answer = session.lss(&[0x5a])?;
    Ok(expect_inquiry(answer))
}
