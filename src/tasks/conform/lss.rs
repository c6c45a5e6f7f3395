//! LSS services (CiA 305).

mod address;
mod configuration;
mod pending;
mod rates;
mod services;

pub use pending::LssSetting;
pub(super) use pending::PendingSettings;

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
const RATES: &str = "CiA 305, bit timing table";

pub(super) const CASES: &[Case] = &[
    case("LSS-01", "Switch state global is not answered", SWITCH, services::global)
        .matters(Medium, "Masters assign the answer to the wrong service."),
    case("LSS-02", "The inquired LSS address is equal to 1018h", INQUIRE, services::address)
        .matters(High, "The device cannot be addressed by the numbers that tools show."),
    case("LSS-03", "The inquired node-ID is the present node-ID", INQUIRE, services::node_id)
        .matters(Medium, "Tools show a wrong node-ID."),
    case("LSS-04", "Inquiries are not answered in waiting state", INQUIRE, services::waiting)
        .matters(High, "Answers of several devices collide."),
    case("LSS-05", "Switch state selective with the address of 1018h is answered", SWITCH, address::selective)
        .matters(High, "One of several devices cannot be given a node-ID."),
    case(
        "LSS-06",
        "Switch state selective with another vendor, product, revision or serial number is not answered",
        SWITCH,
        address::other_addresses,
    )
    .matters(High, "Another device gets the node-ID."),
    case(
        "LSS-07",
        "Identify remote slave is answered for a range that contains the device",
        IDENTIFY,
        address::identified,
    )
    .matters(Medium, "Masters do not find the device."),
    case(
        "LSS-08",
        "Identify remote slave is not answered for a range that does not contain the device",
        IDENTIFY,
        address::not_identified,
    )
    .matters(High, "Masters find devices that do not exist."),
    case(
        "LSS-09",
        "A device with a node-ID does not answer fastscan and identify non-configured slave",
        IDENTIFY,
        address::configured,
    )
    .matters(High, "Masters give the device a new node-ID while it is in use."),
    case("LSS-10", "Unknown services are not answered", "CiA 305, protocols", services::unknown)
        .matters(Low, "Masters assign the answer to the wrong service."),
    case("LSS-11", "Answers have eight bytes, and unused bytes are 0", "CiA 305, protocols", services::form)
        .matters(Low, "Masters that check the whole frame ignore the answers."),
    case(
        "LSS-12",
        "A device with a node-ID does not answer a fastscan of its own address, and stays in waiting state",
        IDENTIFY,
        address::scanned,
    )
    .matters(High, "Masters give the device a new node-ID while it is in use."),
    case("LSS-13", "After switch state selective, the device answers inquiries", SWITCH, address::configuring)
        .matters(High, "One of several devices cannot be given a node-ID."),
    case(
        "LSS-14",
        "In configuration state, the address of another device does not switch the device to waiting state",
        SWITCH,
        address::stays_in_configuration,
    )
    .matters(Low, "Of several devices in configuration state, only one executes a service."),
    case("LSS-20", "Node-IDs 0 and 128 are rejected", CONFIGURE, configuration::wrong_node_ids)
        .matters(High, "The device gets an impossible node-ID and is lost.")
        .stores(),
    case("LSS-21", "The present node-ID is accepted", CONFIGURE, configuration::own_node_id)
        .matters(High, "The node-ID cannot be set.")
        .stores(),
    case("LSS-22", "A reserved table of bit rates is rejected", CONFIGURE, rates::reserved_table)
        .matters(Medium, "The device gets an unknown bit rate and is lost.")
        .stores(),
    case(
        "LSS-23",
        "Answers to configuration services have eight bytes, and unused bytes are 0",
        "CiA 305, protocols",
        configuration::form,
    )
    .matters(Low, "Masters that check the whole frame ignore the answers.")
    .stores(),
    case("LSS-24", "Store configuration is acknowledged", CONFIGURE, configuration::store)
        .matters(High, "The node-ID cannot be stored.")
        .stores(),
    case("LSS-25", "After a store and a reset, the device has its node-ID", CONFIGURE, configuration::keeps_node_id)
        .matters(High, "The device has another node-ID after a restart and is lost.")
        .stores(),
    case("LSS-26", "The reserved code 5 of the table of bit rates is rejected", RATES, rates::reserved_code)
        .matters(Medium, "The device gets an unknown bit rate and is lost.")
        .stores(),
    case(
        "LSS-27",
        "The present bit rate is accepted, and each other code of the table is accepted or rejected",
        RATES,
        rates::all_codes,
    )
    .matters(High, "The bit rate cannot be set.")
    .stores(),
    case("LSS-28", "The device accepts the bit rates of the EDS file, and no others", RATES, rates::of_file)
        .matters(Medium, "Tools offer a bit rate that the device does not have, or do not offer one that it has.")
        .stores(),
    case("LSS-29", "The reserved codes 10 and 255 of the table of bit rates are rejected", RATES, rates::high_codes)
        .matters(Medium, "The device gets an unknown bit rate and is lost.")
        .stores(),
];

/// How long to wait for an answer. CiA 305 states no time.
const TIMEOUT: Duration = Duration::from_millis(100);

const IDENTITY: ObjectId = ObjectId::new(0x1018, 0);

impl Session<'_, '_> {
    /// Sends an LSS request. Returns the answer.
    fn lss(&mut self, request: &[u8]) -> Result<Option<Frame>, Error> {
        self.lss_within(request, TIMEOUT)
    }

    /// Sends an LSS request, and waits for the answer until this time-out.
    fn lss_within(&mut self, request: &[u8], timeout: Duration) -> Result<Option<Frame>, Error> {
        let mut data = [0; 8];
        data[..request.len()].copy_from_slice(request);
        if data[0] != 0x04 || data[1] != 0 {
            self.lss_open = true;
        }
        let frame = Frame::full(CanId::LSS_MASTER, data);
        let answer = self.master.exchange(frame, CanId::LSS_SLAVE, timeout)?;
        Ok(answer.map(|received| received.frame))
    }

    /// Switches to configuration state (1) or to waiting state (0). LSS-01 checks that there is no answer.
    fn switch(&mut self, mode: u8) -> Result<(), Error> {
        self.lss_within(&[0x04, mode], SETTLE).map(drop)
    }

    /// Sends a service with a 32-bit number. Returns the answer.
    fn lss_number(&mut self, service: u8, number: u32) -> Result<Option<Frame>, Error> {
        let [a, b, c, d] = number.to_le_bytes();
        self.lss(&[service, a, b, c, d])
    }

    /// Reads the LSS address: the four numbers of 1018h.
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

    /// Sends switch state selective. Returns the answer to the serial number, or to an earlier part of the address.
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

    /// Sends identify remote slave. Returns the answer to the last part of the range, or to an earlier part.
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

/// Brings the node to an NMT state in which it answers LSS, and to waiting state. Returns `false` if it has no LSS.
fn prepare(session: &mut Session<'_, '_>) -> Result<bool, Error> {
    let Some(address) = session.address()? else { return Ok(false) };
    let known = session.lss_command;
    let commands = [NmtCommand::EnterPreOperational, NmtCommand::Stop];
    for command in commands.into_iter().filter(|command| known.is_none_or(|known| known == *command)) {
        session.command(command)?;
        session.switch(0)?;
        if session.select(address)?.is_some() {
            session.switch(0)?;
            session.lss_command = Some(command);
            return Ok(true);
        }
        session.switch(0)?;
        session.switch(1)?;
        let has_inquiry = session.lss(&[0x5a])?.is_some();
        session.switch(0)?;
        if has_inquiry {
            session.lss_command = Some(command);
            return Ok(true);
        }
    }
    Ok(false)
}

const NO_LSS: Verdict = Verdict::NotApplicable(WhyNot::NoLss);

fn expect_silence(answer: Option<Frame>) -> Verdict {
    Verdict::of(answer.map(|frame| Finding::new(Expected::NoAnswer, Seen::Frame(frame))))
}

/// Brings the node to configuration state. Returns `false` if it has no LSS.
fn enter_configuration(session: &mut Session<'_, '_>) -> Result<bool, Error> {
    if !prepare(session)? {
        return Ok(false);
    }
    session.switch(1)?;
    Ok(true)
}

/// Returns a finding if an answer does not have eight bytes, or if a byte after the first `used` bytes is not 0.
fn wrong_form(answer: Frame, used: usize) -> Option<Finding> {
    if answer.data().len() != 8 {
        return Some(Finding::new(Expected::EightBytes, Seen::Frame(answer)));
    }
    let is_padded = answer.data()[used..].iter().all(|&byte| byte == 0);
    (!is_padded).then(|| Finding::new(Expected::ZeroPadding, Seen::Frame(answer)))
}

/// Whether an answer acknowledges this configuration service (error code 0).
fn is_accepted(answer: &Frame, service: u8) -> bool {
    matches!(answer.data(), [found, 0, ..] if *found == service)
}

/// Whether an answer rejects this configuration service (any other error code).
fn is_rejected(answer: &Frame, service: u8) -> bool {
    matches!(answer.data(), [found, code, ..] if *found == service && *code != 0)
}
