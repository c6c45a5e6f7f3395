//! The bit rate (13h). It is never activated (15h), and the present one is set again.

use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::Session;
use super::pending::LssSetting::BitRate;
use super::{NO_LSS, TIMEOUT, enter_configuration, is_accepted, is_rejected};
use crate::canopen::frame::Frame;
use crate::node::Error;

/// The reserved code between those with a bit rate. Some devices use it for 100 kbit/s.
const RESERVED: [u8; 1] = [5];

/// These codes stand for all reserved codes from 10 to 255.
const HIGH: [u8; 2] = [10, 255];

/// The codes of table 0 with a bit rate.
const CODES: [u8; 8] = [0, 1, 2, 3, 4, 6, 7, 8];

/// The code for automatic detection of the bit rate.
const DETECTION: u8 = 9;

/// The bit rates that an EDS file can name, in bit/s.
const OF_FILE: [u32; 8] = [10_000, 20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000];

impl Session<'_, '_> {
    /// Sends the bit rate with this code of table 0. Returns the answer.
    fn configure_rate(&mut self, code: u8) -> Result<Option<Frame>, Error> {
        self.configure(BitRate, &[0x13, 0, code])
    }
}

/// Brings the device to configuration state. Returns the verdict if the present bit rate could not be set again.
fn prepare_rates(session: &mut Session<'_, '_>) -> Result<Option<Verdict>, Error> {
    if session.present_rate_code().is_none() {
        return Ok(Some(Verdict::not_judged(WhyNot::UnknownBitRate)));
    }
    Ok((!enter_configuration(session)?).then_some(NO_LSS))
}

pub(super) fn reserved_table(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Some(verdict) = prepare_rates(session)? {
        return Ok(verdict);
    }
    // Tables 1 to 127 are reserved.
    Ok(match session.configure(BitRate, &[0x13, 1, 0])? {
        Some(frame) if is_rejected(&frame, 0x13) => Verdict::Pass,
        Some(frame) => Verdict::of([Finding::new(Expected::Refused, Seen::Frame(frame))]),
        None => Verdict::NotApplicable(WhyNot::NoService(0x13)),
    })
}

pub(super) fn reserved_code(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    rejected(session, &RESERVED)
}

pub(super) fn high_codes(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    rejected(session, &HIGH)
}

/// The device rejects these codes.
fn rejected(session: &mut Session<'_, '_>, codes: &[u8]) -> Result<Verdict, Error> {
    if let Some(verdict) = prepare_rates(session)? {
        return Ok(verdict);
    }
    let mut findings = Vec::new();
    for &code in codes {
        match session.configure_rate(code)? {
            Some(frame) if is_rejected(&frame, 0x13) => {}
            Some(frame) => findings.push(wrong_answer(code, false, frame)),
            None => return Ok(Verdict::NotApplicable(WhyNot::NoService(0x13))),
        }
    }
    Ok(Verdict::of(findings))
}

fn wrong_answer(code: u8, is_accepted: bool, answer: Frame) -> Finding {
    Finding::new(Expected::RateCode { code, is_accepted }, Seen::Frame(answer))
}

/// Like [`prepare_rates`], for cases that send codes that the device may accept. After the case, the present bit rate
/// is set, which ends automatic detection. So a device that can detect the bit rate is not checked.
fn prepare_accepted(session: &mut Session<'_, '_>) -> Result<Option<Verdict>, Error> {
    if session.rate_table().auto().is_some() {
        return Ok(Some(Verdict::NotApplicable(WhyNot::DetectsBitRate { was_set: false })));
    }
    if let Some(verdict) = prepare_rates(session)? {
        return Ok(Some(verdict));
    }
    Ok(match session.configure_rate(DETECTION)? {
        Some(frame) if is_accepted(&frame, 0x13) => Some(Verdict::not_judged(WhyNot::DetectsBitRate { was_set: true })),
        Some(_) => None,
        None => Some(Verdict::NotApplicable(WhyNot::NoService(0x13))),
    })
}

pub(super) fn all_codes(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(own) = session.present_rate_code() else { return Ok(Verdict::not_judged(WhyNot::UnknownBitRate)) };
    if let Some(verdict) = prepare_accepted(session)? {
        return Ok(verdict);
    }
    // If the device rejects the present bit rate, no other one is sent: the present one could not be set again.
    match session.configure_rate(own)? {
        Some(frame) if is_accepted(&frame, 0x13) => {}
        Some(frame) => return Ok(Verdict::of([wrong_answer(own, true, frame)])),
        None => return Ok(Verdict::of([Finding::new(Expected::Service(0x13), Seen::Nothing(TIMEOUT))])),
    }
    let mut findings = Vec::new();
    for code in CODES {
        match session.configure_rate(code)? {
            Some(frame) if matches!(frame.data(), [0x13, 0 | 1 | 0xff, ..]) => {}
            answer => findings.push(Finding::new(Expected::LssErrorCode, Seen::answer(answer, TIMEOUT))),
        }
    }
    Ok(Verdict::of(findings))
}

pub(super) fn of_file(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(eds) = session.eds.clone() else { return Ok(Verdict::NotApplicable(WhyNot::NoEds)) };
    if eds.info.bit_rates.is_empty() {
        return Ok(Verdict::NotApplicable(WhyNot::NoBitRates));
    }
    let Some(own) = session.present_rate_code() else { return Ok(Verdict::not_judged(WhyNot::UnknownBitRate)) };
    if let Some(verdict) = prepare_accepted(session)? {
        return Ok(verdict);
    }
    if !session.configure_rate(own)?.is_some_and(|frame| is_accepted(&frame, 0x13)) {
        return Ok(Verdict::NotApplicable(WhyNot::LssRejected(0x13)));
    }
    let table = session.rate_table();
    let mut findings = Vec::new();
    for rate in OF_FILE {
        let Some(code) = table.index_of(rate) else { continue };
        let is_in_file = eds.info.bit_rates.contains(&rate);
        let Some(answer) = session.configure_rate(code)? else { continue };
        if is_accepted(&answer, 0x13) != is_in_file {
            findings.push(wrong_answer(code, is_in_file, answer));
        }
    }
    Ok(Verdict::of(findings))
}
