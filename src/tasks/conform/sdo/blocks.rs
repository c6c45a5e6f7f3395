//! SDO block transfer, which is optional.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::codes;
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot, abort_code};
use super::super::session::{Session, request};
use super::{expect_abort, narrow_setting, unchanged};
use crate::canopen::frame::Frame;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::crc16;
use crate::node::Error;
use crate::node::state::HEARTBEAT_TIME;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Sdo, id, sentence, clause, run)
}

const UPLOAD: &str = "CiA 301, SDO block upload";
const DOWNLOAD: &str = "CiA 301, SDO block download";

pub(in super::super) const CASES: &[Case] = &[
    case("SDO-30", "A block upload without CRC delivers the value of 1000h", UPLOAD, upload_plain)
        .matters(Medium, "Long objects are read incompletely by masters with block transfer."),
    case("SDO-31", "A block upload with CRC delivers the value and its CRC", UPLOAD, upload_crc)
        .matters(Medium, "Masters with block transfer reject the data."),
    case("SDO-32", "A block upload with a block size of 0 or 128 is rejected", UPLOAD, upload_block_size)
        .matters(Low, "A wrong block size is not noticed."),
    case("SDO-33", "A block download without CRC writes the value", DOWNLOAD, download_plain)
        .matters(Medium, "Masters with block transfer cannot write."),
    case("SDO-34", "A block download with CRC writes the value", DOWNLOAD, download_crc)
        .matters(Medium, "Masters with block transfer cannot write."),
    case("SDO-35", "A block download with a wrong CRC is rejected, and changes nothing", DOWNLOAD, download_wrong_crc)
        .matters(Medium, "Damaged data is written."),
    case("SDO-36", "An acknowledgement of block segments that were not sent is rejected", UPLOAD, upload_sequence)
        .matters(Low, "After a disturbed transfer, data is missing."),
];

/// Starts a block upload of 1000h. `Err` with the verdict if there is no block transfer.
fn start_upload(
    session: &mut Session<'_, '_>,
    with_crc: bool,
    block_size: u8,
) -> Result<Result<Frame, Verdict>, Error> {
    let object = ObjectId::DEVICE_TYPE;
    session.open_transfer = Some(object);
    let answer = session.raw(request(0xa0 | u8::from(with_crc) << 2, object, [block_size, 0, 0, 0]))?;
    Ok(match answer {
        Some(frame) if frame.data().first().is_some_and(|command| command >> 5 == 6) => Ok(frame),
        Some(frame) if abort_code(&frame).is_some() => Err(Verdict::NotApplicable(WhyNot::NoBlocks)),
        // A server may answer without blocks.
        Some(frame) if frame.data().first().is_some_and(|command| command >> 5 == 2) => {
            Err(Verdict::NotApplicable(WhyNot::NoBlocks))
        }
        answer => {
            let seen = Seen::answer(answer, session.timeout());
            Err(Verdict::of([Finding::at(object, Expected::Command(&[0xc6, 0xc2]), seen)]))
        }
    })
}

fn upload(session: &mut Session<'_, '_>, with_crc: bool) -> Result<Verdict, Error> {
    let object = ObjectId::DEVICE_TYPE;
    let Some(value) = session.read(object)? else { return Ok(Verdict::NotApplicable(WhyNot::NoObject(object))) };
    let initiate = match start_upload(session, with_crc, 20)? {
        Ok(frame) => frame,
        Err(verdict) => return Ok(verdict),
    };
    let mut findings = Vec::new();
    let segment = session.raw(request(0xa3, ObjectId::new(0, 0), [0; 4]))?;
    let data = segment.as_ref().map(|frame| frame.data().get(1..1 + value.len()).unwrap_or_default().to_vec());
    if segment.as_ref().and_then(|frame| frame.data().first()) != Some(&0x81) || data.as_deref() != Some(&value[..]) {
        findings.push(Finding::at(object, Expected::Bytes(value.clone()), Seen::answer(segment, session.timeout())));
        return Ok(Verdict::of(findings));
    }
    let end = session.raw([0xa2, 1, 20, 0, 0, 0, 0, 0])?;
    let has_crc = with_crc && initiate.data()[0] & 0x04 != 0;
    let unused = u8::try_from(7 - value.len()).unwrap_or(0);
    match end.as_ref().map(Frame::data) {
        Some([command, low, high, ..]) if *command == 0xc1 | unused << 2 => {
            let (found, right) = (u16::from_le_bytes([*low, *high]), crc16(&value));
            if has_crc && found != right {
                findings.push(Finding::at(object, Expected::Crc(right), Seen::Crc(found)));
            }
            session.open_transfer = None;
            session.raw_within([0xa1, 0, 0, 0, 0, 0, 0, 0], super::super::session::SETTLE)?;
        }
        _ => findings.push(Finding::at(object, Expected::Command(&[0xcd]), Seen::answer(end, session.timeout()))),
    }
    Ok(Verdict::of(findings))
}

fn upload_plain(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    upload(session, false)
}

fn upload_crc(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    upload(session, true)
}

fn upload_block_size(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    if let Err(verdict) = start_upload(session, false, 20)? {
        return Ok(verdict);
    }
    session.end_transfer()?;
    let object = ObjectId::DEVICE_TYPE;
    let mut findings = Vec::new();
    for size in [0, 128] {
        session.open_transfer = Some(object);
        let answer = session.raw(request(0xa0, object, [size, 0, 0, 0]))?;
        findings.extend(expect_abort(session, object, codes::BLOCK_SIZE, answer));
        session.end_transfer()?;
    }
    Ok(Verdict::of(findings))
}

/// A sequence number that no segment has.
const WRONG_SEQUENCE: u8 = 128;

fn upload_sequence(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let object = ObjectId::DEVICE_TYPE;
    if let Err(verdict) = start_upload(session, false, 20)? {
        return Ok(verdict);
    }
    if session.raw(request(0xa3, ObjectId::new(0, 0), [0; 4]))?.is_none() {
        return Ok(Verdict::not_judged(WhyNot::NoBlocks));
    }
    let answer = session.raw([0xa2, WRONG_SEQUENCE, 20, 0, 0, 0, 0, 0])?;
    Ok(Verdict::of(expect_abort(session, object, codes::SEQUENCE, answer)))
}

/// The CRC of a block download.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Crc {
    None,
    Right,
    Wrong,
}

fn download(session: &mut Session<'_, '_>, crc: Crc) -> Result<Verdict, Error> {
    let object = HEARTBEAT_TIME;
    let Some((_, value)) = narrow_setting(session)?.filter(|(found, _)| *found == object) else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    session.touch(object)?;
    session.open_transfer = Some(object);
    let command = if crc == Crc::None { 0xc2 } else { 0xc6 };
    let answer = session.raw(request(command, object, [2, 0, 0, 0]))?;
    let timeout = session.timeout();
    let Some(initiate) = answer else {
        let finding = Finding::at(object, Expected::Command(&[0xa4, 0xa0]), Seen::Nothing(timeout));
        return Ok(Verdict::of([finding]));
    };
    if abort_code(&initiate).is_some() {
        return Ok(Verdict::NotApplicable(WhyNot::NoBlocks));
    }
    let has_crc = crc != Crc::None && initiate.data().first().is_some_and(|command| command & 0x04 != 0);
    if crc == Crc::Wrong && !has_crc {
        return Ok(Verdict::NotApplicable(WhyNot::NoBlocks));
    }
    let new = [value[0] ^ 0x40, value[1]];
    let taken = session.raw([0x81, new[0], new[1], 0, 0, 0, 0, 0])?;
    if !matches!(taken.as_ref().map(Frame::data), Some([0xa2, 1, ..])) {
        return Ok(Verdict::of([Finding::at(object, Expected::Command(&[0xa2]), Seen::answer(taken, timeout))]));
    }
    let [low, high] = match crc {
        Crc::None => [0, 0],
        Crc::Right => crc16(&new).to_le_bytes(),
        Crc::Wrong => (!crc16(&new)).to_le_bytes(),
    };
    let end = session.raw([0xd5, low, high, 0, 0, 0, 0, 0])?;
    session.open_transfer = None;
    if crc == Crc::Wrong {
        let refused = expect_abort(session, object, codes::CRC, end);
        return Ok(Verdict::of(refused.into_iter().chain(unchanged(session, object, &value)?)));
    }
    if !matches!(end.as_ref().map(Frame::data), Some([0xa1, ..])) {
        return Ok(Verdict::of([Finding::at(object, Expected::Command(&[0xa1]), Seen::answer(end, timeout))]));
    }
    Ok(Verdict::of(unchanged(session, object, &new)?))
}

fn download_plain(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    download(session, Crc::None)
}

fn download_crc(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    download(session, Crc::Right)
}

fn download_wrong_crc(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    download(session, Crc::Wrong)
}
