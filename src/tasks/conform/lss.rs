//! LSS services (CiA 305).

use super::case::{Area, Case, Run, Severity::*};
use super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::session::{SETTLE, Session};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::NmtCommand;
use crate::canopen::object::ObjectId;
use crate::node::Error;
use std::time::Duration;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Lss, id, sentence, clause, run).alone()
}

const SWITCH: &str = "CiA 305, switch state";
const INQUIRE: &str = "CiA 305, inquire services";
const IDENTIFY: &str = "CiA 305, identify services";
const CONFIGURE: &str = "CiA 305, configuration services";

pub(super) const CASES: &[Case] = &[
    case("LSS-01", "Switch state global is not answered", SWITCH, global)
        .matters(Medium, "Masters assign the answer to the wrong service."),
    case("LSS-02", "The inquired LSS address is equal to 1018h", INQUIRE, address)
        .matters(High, "The device cannot be addressed by the numbers that tools show."),
    case("LSS-03", "The inquired node-ID is the present node-ID", INQUIRE, node_id)
        .matters(Medium, "Tools show a wrong node-ID."),
    case("LSS-04", "Inquiries are not answered in waiting state", INQUIRE, waiting)
        .matters(High, "Answers of several devices collide."),
    case("LSS-05", "Switch state selective with the address of 1018h is answered", SWITCH, selective)
        .matters(High, "One of several devices cannot be given a node-ID."),
    case("LSS-06", "Switch state selective with another serial number is not answered", SWITCH, other_address)
        .matters(High, "Another device gets the node-ID."),
    case("LSS-07", "Identify remote slave is answered for a range that contains the device", IDENTIFY, identified)
        .matters(Medium, "Masters do not find the device."),
    case(
        "LSS-08",
        "Identify remote slave is not answered for a range that does not contain the device",
        IDENTIFY,
        not_identified,
    )
    .matters(High, "Masters find devices that do not exist."),
    case(
        "LSS-09",
        "A device with a node-ID does not answer fastscan and identify non-configured slave",
        IDENTIFY,
        configured,
    )
    .matters(High, "Masters give the device a new node-ID while it is in use."),
    case("LSS-10", "Unknown services are not answered", "CiA 305, protocols", unknown)
        .matters(Low, "Masters assign the answer to the wrong service."),
    case("LSS-11", "Answers have eight bytes, and unused bytes are 0", "CiA 305, protocols", form)
        .matters(Low, "Masters that check the whole frame ignore the answers."),
    case("LSS-20", "Node-IDs 0 and 128 are rejected", CONFIGURE, bad_node_id)
        .matters(High, "The device gets an impossible node-ID and is lost.")
        .stores(),
    case("LSS-21", "The present node-ID is accepted", CONFIGURE, own_node_id)
        .matters(High, "The node-ID cannot be set.")
        .stores(),
    case("LSS-22", "A reserved table of bit rates is rejected", CONFIGURE, bad_table)
        .matters(Medium, "The device gets an unknown bit rate and is lost.")
        .stores(),
];

/// The wait for an answer. CiA 305 gives no time.
const TIMEOUT: Duration = Duration::from_millis(100);

const IDENTITY: ObjectId = ObjectId::new(0x1018, 0);

impl Session<'_, '_> {
    /// Sends an LSS request. Returns the answer.
    fn lss(&mut self, request: &[u8]) -> Result<Option<Frame>, Error> {
        let mut data = [0; 8];
        data[..request.len()].copy_from_slice(request);
        if data[0] != 0x04 || data[1] != 0 {
            self.lss_open = true;
        }
        let frame = Frame::full(CanId::LSS_MASTER, data);
        let answer = self.master.exchange(frame, CanId::LSS_SLAVE, TIMEOUT)?;
        Ok(answer.map(|received| received.frame))
    }

    /// Sends a service with a number.
    fn lss_number(&mut self, service: u8, number: u32) -> Result<Option<Frame>, Error> {
        let [a, b, c, d] = number.to_le_bytes();
        self.lss(&[service, a, b, c, d])
    }

    /// Switches to waiting state.
    pub(super) fn leave_lss(&mut self) -> Result<(), Error> {
        if self.lss_open {
            let frame = Frame::full(CanId::LSS_MASTER, [0x04, 0, 0, 0, 0, 0, 0, 0]);
            self.send(frame)?;
            self.lss_open = false;
        }
        Ok(())
    }

    /// The four numbers of 1018h.
    fn address(&mut self) -> Result<Option<[u32; 4]>, Error> {
        let mut address = [0; 4];
        for (sub, part) in (1..).zip(&mut address) {
            match self.number(IDENTITY.with_sub(sub))? {
                Some(number) => *part = u32::try_from(number).unwrap_or(0),
                None => return Ok(None),
            }
        }
        Ok(Some(address))
    }

    /// Sends an address. Returns the answer to the serial number, or an earlier one.
    fn select(&mut self, address: [u32; 4]) -> Result<Option<Frame>, Error> {
        for (service, number) in (0x40..).zip(address) {
            let answer = if service < 0x43 {
                let [a, b, c, d] = number.to_le_bytes();
                let frame = Frame::full(CanId::LSS_MASTER, [service, a, b, c, d, 0, 0, 0]);
                self.lss_open = true;
                self.master.exchange(frame, CanId::LSS_SLAVE, SETTLE)?.map(|received| received.frame)
            } else {
                self.lss_number(service, number)?
            };
            if answer.is_some() {
                return Ok(answer);
            }
        }
        Ok(None)
    }

    /// Sends a range. Returns the answer to the last part, or an earlier one.
    fn identify(&mut self, parts: [u32; 6]) -> Result<Option<Frame>, Error> {
        for (service, number) in (0x46..).zip(parts) {
            let answer = self.lss_number(service, number)?;
            if answer.is_some() || service == 0x4b {
                return Ok(answer);
            }
        }
        Ok(None)
    }
}

/// Brings the node to a state in which it answers LSS, and to waiting state. `false` if it has no LSS.
fn prepare(session: &mut Session<'_, '_>) -> Result<bool, Error> {
    let Some(address) = session.address()? else { return Ok(false) };
    for command in [NmtCommand::EnterPreOperational, NmtCommand::Stop] {
        session.command(command)?;
        session.lss(&[0x04, 0])?;
        if session.select(address)?.is_some() {
            session.lss(&[0x04, 0])?;
            return Ok(true);
        }
        session.lss(&[0x04, 0])?;
        session.lss(&[0x04, 1])?;
        let has_inquiry = session.lss(&[0x5a])?.is_some();
        session.lss(&[0x04, 0])?;
        if has_inquiry {
            return Ok(true);
        }
    }
    Ok(false)
}

const NO_LSS: Verdict = Verdict::NotApplicable(WhyNot::NoLss);

fn expect_silence(answer: Option<Frame>) -> Verdict {
    Verdict::of(answer.map(|frame| Finding::new(Expected::NoAnswer, Seen::Frame(frame))))
}

fn global(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let answer = session.lss(&[0x04, 1])?;
    Ok(expect_silence(answer))
}

fn address(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(address) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.lss(&[0x04, 1])?;
    let mut findings = Vec::new();
    for ((service, sub), number) in (0x5a..).zip(1..).zip(address) {
        let Some(answer) = session.lss(&[service])? else {
            return Ok(Verdict::NotApplicable(WhyNot::NoService(service)));
        };
        let [a, b, c, d] = number.to_le_bytes();
        if !answer.data().starts_with(&[service, a, b, c, d]) {
            let expected = Expected::Number(number.into());
            findings.push(Finding::at(IDENTITY.with_sub(sub), expected, Seen::Frame(answer)));
        }
    }
    Ok(Verdict::of(findings))
}

fn node_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.lss(&[0x04, 1])?;
    let Some(answer) = session.lss(&[0x5e])? else { return Ok(Verdict::NotApplicable(WhyNot::NoService(0x5e))) };
    let own = session.node.id.get();
    let finding = || Finding::new(Expected::Number(own.into()), Seen::Frame(answer));
    Ok(Verdict::of((!answer.data().starts_with(&[0x5e, own])).then(finding)))
}

fn waiting(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    for service in 0x5a..=0x5e {
        if let Some(answer) = session.lss(&[service])? {
            return Ok(expect_silence(Some(answer)));
        }
    }
    Ok(Verdict::Pass)
}

fn selective(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some(address) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let answer = session.select(address)?;
    let is_right = answer.as_ref().is_some_and(|frame| frame.data().first() == Some(&0x44));
    let finding = || Finding::new(Expected::Service(0x44), Seen::answer(answer, TIMEOUT));
    Ok(Verdict::of((!is_right).then(finding)))
}

fn other_address(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some([vendor, product, revision, serial]) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let answer = session.select([vendor, product, revision, serial ^ 1])?;
    Ok(expect_silence(answer))
}

fn identified(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
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

fn not_identified(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some([vendor, product, revision, serial]) = session.address()? else { return Ok(NO_LSS) };
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    let low = serial.checked_add(1).unwrap_or(0);
    let high = if low == 0 { 0 } else { u32::MAX };
    let answer = session.identify([vendor, product, revision, revision, low, high])?;
    Ok(expect_silence(answer))
}

fn configured(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    for request in [&[0x4c][..], &[0x51, 0, 0, 0, 0, 0x80, 0, 0]] {
        if let Some(answer) = session.lss(request)? {
            return Ok(expect_silence(Some(answer)));
        }
    }
    Ok(Verdict::Pass)
}

fn unknown(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.lss(&[0x04, 1])?;
    let answer = session.lss(&[0x7f])?;
    Ok(expect_silence(answer))
}

fn form(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !prepare(session)? {
        return Ok(NO_LSS);
    }
    session.lss(&[0x04, 1])?;
    let mut is_any = false;
    for service in [0x5a, 0x5e] {
        let Some(answer) = session.lss(&[service])? else { continue };
        is_any = true;
        if answer.data().len() != 8 {
            return Ok(Verdict::of([Finding::new(Expected::EightBytes, Seen::Frame(answer))]));
        }
        let used = if service == 0x5e { 2 } else { 5 };
        if answer.data()[used..].iter().any(|&byte| byte != 0) {
            return Ok(Verdict::of([Finding::new(Expected::ZeroPadding, Seen::Frame(answer))]));
        }
    }
    Ok(if is_any { Verdict::Pass } else { Verdict::NotApplicable(WhyNot::NoService(0x5a)) })
}

/// Switches the device to configuration state (switch state global). `false` if it has no LSS.
fn configure(session: &mut Session<'_, '_>) -> Result<bool, Error> {
    if !prepare(session)? {
        return Ok(false);
    }
    session.lss(&[0x04, 1])?;
    Ok(true)
}

/// Whether the error code of a configuration service is as expected.
fn expect_code(answer: Option<Frame>, service: u8, is_ok: bool) -> Verdict {
    match answer {
        Some(frame) if matches!(frame.data(), [found, code, ..] if *found == service && (*code == 0) == is_ok) => {
            Verdict::Pass
        }
        Some(frame) => {
            let expected = if is_ok { Expected::Acknowledged } else { Expected::Refused };
            Verdict::of([Finding::new(expected, Seen::Frame(frame))])
        }
        None => Verdict::NotApplicable(WhyNot::NoService(service)),
    }
}

fn bad_node_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !configure(session)? {
        return Ok(NO_LSS);
    }
    for id in [0, 128] {
        let answer = session.lss(&[0x11, id])?;
        let verdict = expect_code(answer, 0x11, false);
        if !matches!(verdict, Verdict::Pass) {
            restore_node_id(session)?;
            return Ok(verdict);
        }
    }
    Ok(Verdict::Pass)
}

/// Configures the present node-ID again, because a reset would make the configured one active.
fn restore_node_id(session: &mut Session<'_, '_>) -> Result<(), Error> {
    let own = session.node.id.get();
    session.lss(&[0x11, own]).map(drop)
}

fn own_node_id(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !configure(session)? {
        return Ok(NO_LSS);
    }
    let own = session.node.id.get();
    let answer = session.lss(&[0x11, own])?;
    Ok(expect_code(answer, 0x11, true))
}

fn bad_table(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if !configure(session)? {
        return Ok(NO_LSS);
    }
    // Tables 1 to 127 are reserved.
    let answer = session.lss(&[0x13, 1, 0])?;
    Ok(expect_code(answer, 0x13, false))
}
