//! One deviation for each case of the areas pdo, emcy, store and lss.

use super::deviant::Deviation::{Adds, Answers, Ignores, Lss, Sends, Takes};
use super::deviant::NODE;
use super::table::{Row, abort, ack, is, is_nmt, read, with};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;

pub(super) fn is_tpdo(frame: &Frame) -> bool {
    frame.id().number() == 0x180 + u32::from(NODE)
}

fn is_emergency(frame: &Frame) -> bool {
    frame.id().number() == 0x080 + u32::from(NODE)
}

/// Changes the answer to an LSS service.
fn lss(frame: Frame, service: u8, change: fn(&mut Vec<u8>)) -> Vec<Frame> {
    let is_this = frame.id() == CanId::LSS_SLAVE && frame.data().first() == Some(&service);
    if is_this { with(frame, change) } else { vec![frame] }
}

/// The part of the LSS address with the product code.
const PRODUCT: [u8; 8] = [0x41, 1, 0, 0, 0, 0, 0, 0];

/// Switch state global: waiting.
const WAITING: [u8; 8] = [0x04, 0, 0, 0, 0, 0, 0, 0];

/// An LSS request that follows the last part of an LSS address: of the device, or of another one.
fn after(frame: &Frame, is_own: bool, request: [u8; 8]) -> Option<Frame> {
    let bytes = frame.as_eight_bytes().filter(|_| frame.id() == CanId::LSS_MASTER)?;
    let found = is(bytes, &[0x43]) && is(bytes, &[0x43, 0x11, 0x27]) == is_own;
    found.then(|| Frame::full(CanId::LSS_MASTER, request))
}

/// Acknowledges this write without executing it.
macro_rules! pretends {
    ($($byte:expr),+) => { Answers(|_, request| is(request, &[$($byte),+]).then(|| ack(request))) };
}

const TRANSMISSION: [u8; 3] = [0x00, 0x18, 2];
const TIMER: [u8; 3] = [0x00, 0x18, 5];
const COB_ID: [u8; 3] = [0x00, 0x18, 1];

pub(super) const PDO: &[Row] = &[
    ("mh4", "PDO-01", Answers(|_, request| is(request, &[0x40, 0x01, 0x18, 2]).then(|| abort(request, 0x0609_0011)))),
    (
        "mh4",
        "PDO-02",
        Sends(|memory, frame| {
            read(memory, frame, [0x01, 0x18, 1], |data| data[4..].copy_from_slice(&[0x01, 0x07, 0, 0x40]))
        }),
    ),
    (
        "mh4",
        "PDO-03",
        Sends(|memory, frame| {
            memory.count += u32::from(is_tpdo(&frame));
            let is_lost = is_tpdo(&frame) && memory.written(TRANSMISSION) == 1 && memory.count % 4 == 0;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "PDO-04",
        Sends(|memory, frame| {
            let copies = if is_tpdo(&frame) && memory.written(TRANSMISSION) == 3 { 2 } else { 1 };
            vec![frame; copies]
        }),
    ),
    (
        "mh4",
        "PDO-05",
        Adds(|memory, frame| {
            let starts =
                is_nmt(frame, 0x01, NODE) && memory.was_written(TRANSMISSION) && memory.written(TRANSMISSION) == 0;
            starts.then(|| Frame::empty(CanId::SYNC))
        }),
    ),
    ("mh4", "PDO-06", pretends!(0x2f, 0x00, 0x18, 2, 241)),
    (
        "mh4",
        "PDO-07",
        Sends(|memory, frame| {
            memory.count += u32::from(is_tpdo(&frame));
            let is_lost = is_tpdo(&frame) && memory.written(TIMER) == 100 && memory.count % 4 == 0;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "PDO-08",
        Sends(|memory, frame| {
            memory.count += u32::from(is_tpdo(&frame));
            let is_lost = is_tpdo(&frame) && memory.written(TIMER) == 200 && memory.count % 4 == 0;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    ("hydac", "PDO-09", pretends!(0x2b, 0x00, 0x18, 3, 0xc4)),
    (
        "hydac",
        "PDO-30",
        Answers(|memory, request| {
            let is_valid = memory.written(COB_ID) & 0x8000_0000 == 0;
            (is(request, &[0x2b, 0x00, 0x18, 3]) && is_valid).then(|| ack(request))
        }),
    ),
    (
        "mh4",
        "PDO-31",
        Answers(|memory, request| {
            let was_valid = memory.before(COB_ID) & 0x8000_0000 == 0;
            (is(request, &[0x23, 0x00, 0x18, 1, 0xf0, 0x01, 0, 0x40]) && was_valid).then(|| ack(request))
        }),
    ),
    ("mh4", "PDO-32", pretends!(0x23, 0x00, 0x18, 1, 0x01, 0x06)),
    ("mh4", "PDO-13", Sends(|_, frame| if is_tpdo(&frame) { with(frame, |data| data.push(0)) } else { vec![frame] })),
    (
        "mh4",
        "PDO-14",
        Ignores(|memory, _, frame| {
            is_nmt(frame, 0x80, NODE) && memory.nmt[1] == 0x01 && memory.written(TRANSMISSION) == 254
        }),
    ),
    (
        "mh4",
        "PDO-15",
        Answers(|memory, request| {
            let is_off = is(request, &[0x23, 0x00, 0x18, 1, 0x85, 0x01, 0, 0xc0]);
            (is_off && memory.written(TRANSMISSION) == 254).then(|| ack(request))
        }),
    ),
    (
        "mh4",
        "PDO-16",
        Sends(|_, frame| {
            let id = CanId::standard(0x180 + u16::from(NODE)).expect("an identifier");
            let is_new = frame.id().number() == 0x1f0;
            vec![if is_new { Frame::new(id, frame.data()).expect("eight bytes at most") } else { frame }]
        }),
    ),
    ("mh4", "PDO-17", pretends!(0x23, 0x05, 0x10, 0, 0xf0, 0)),
    (
        "mh4",
        "PDO-18",
        Takes(|_, frame| if is_tpdo(frame) && frame.is_remote() { Frame::empty(CanId::SYNC) } else { *frame }),
    ),
    (
        "mh4",
        "PDO-20",
        Answers(|memory, request| {
            let is_valid = memory.written(COB_ID) & 0x8000_0000 == 0;
            (is(request, &[0x2f, 0x00, 0x1a, 0, 0]) && is_valid).then(|| ack(request))
        }),
    ),
    (
        "mh4",
        "PDO-21",
        Answers(|memory, request| {
            let is_locked = memory.written([0x00, 0x1a, 0]) == 2;
            (is(request, &[0x23, 0x00, 0x1a, 1]) && is_locked).then(|| ack(request))
        }),
    ),
    ("mh4", "PDO-22", pretends!(0x23, 0x00, 0x1a, 1, 0x20, 0x00, 0x04, 0x10)),
    ("mh4", "PDO-23", pretends!(0x23, 0x00, 0x1a, 1, 0x08, 0x00, 0x18, 0x10)),
    ("mh4", "PDO-24", pretends!(0x23, 0x00, 0x1a, 1, 0x30, 0x01, 0x30, 0x61)),
    ("mh4", "PDO-25", pretends!(0x2f, 0x00, 0x1a, 0, 3)),
    ("mh4", "PDO-26", pretends!(0x2f, 0x00, 0x1a, 0, 65)),
    (
        "mh4",
        "PDO-27",
        Answers(|memory, request| {
            let follows = memory.before([0x00, 0x1a, 1]) == 0x1004_0020;
            (is(request, &[0x23, 0x00, 0x1a, 1]) && follows).then(|| abort(request, 0x0800_0022))
        }),
    ),
];

pub(super) const EMCY: &[Row] = &[
    ("mh4", "EMC-01", Sends(|memory, frame| read(memory, frame, [0x14, 0x10, 0], |data| data[4] ^= 3))),
    ("mh4", "EMC-02", Sends(|memory, frame| read(memory, frame, [0x03, 0x10, 0], |data| data[4] = 1))),
    ("dps", "EMC-03", pretends!(0x22, 0x03, 0x10, 0, 5)),
    ("mh4", "EMC-04", Sends(|memory, frame| read(memory, frame, [0x01, 0x10, 0], |data| data[4] = 0))),
    (
        "mh4",
        "EMC-05",
        Sends(|_, frame| if is_emergency(&frame) { with(frame, |data| data[2] ^= 0x20) } else { vec![frame] }),
    ),
    ("mh4", "EMC-06", Sends(|memory, frame| read(memory, frame, [0x03, 0x10, 1], |data| data[4] ^= 1))),
    (
        "mh4",
        "EMC-07",
        Sends(|_, frame| {
            let is_end = is_emergency(&frame) && frame.data().starts_with(&[0, 0]);
            if is_end { Vec::new() } else { vec![frame] }
        }),
    ),
];

pub(super) const STORE: &[Row] = &[
    ("mh4", "STO-01", Sends(|memory, frame| read(memory, frame, [0x10, 0x10, 1], |data| data[6] = 1))),
    ("mh4", "STO-02", Sends(|memory, frame| read(memory, frame, [0x11, 0x10, 1], |data| data[6] = 1))),
    ("mh4", "STO-03", pretends!(0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'a')),
    ("mh4", "STO-04", pretends!(0x23, 0x10, 0x10, 2, b's', b'a', b'v', b'e')),
    ("mh4", "STO-05", pretends!(0x23, 0x11, 0x10, 2, b'l', b'o', b'a', b'a')),
    (
        "mh4",
        "STO-06",
        Sends(|memory, frame| {
            let is_restored = memory.last.is_some_and(|last| is(last, &[0x23, 0x11, 0x10, 2, b'l', b'o', b'a', b'd']));
            if is_restored { read(memory, frame, [0x17, 0x10, 0], |data| data[4..6].fill(0)) } else { vec![frame] }
        }),
    ),
    ("mh4", "STO-07", pretends!(0x23, 0x11, 0x10, 2, b'l', b'o', b'a', b'd')),
];

pub(super) const LSS: &[Row] = &[
    ("mh4", "LSS-01", Lss(|_, request| is(request, &[0x04, 1]).then_some(request))),
    ("mh4", "LSS-02", Sends(|_, frame| lss(frame, 0x5b, |data| data[1] ^= 1))),
    ("mh4", "LSS-03", Sends(|_, frame| lss(frame, 0x5e, |data| data[1] ^= 1))),
    (
        "mh4",
        "LSS-04",
        Lss(|memory, request| (is(request, &[0x5a]) && !memory.is_configuring).then_some([0x5a, 71, 0, 0, 0, 0, 0, 0])),
    ),
    (
        "mh4",
        "LSS-05",
        Sends(|_, frame| {
            let is_answer = frame.id() == CanId::LSS_SLAVE && frame.data().first() == Some(&0x44);
            if is_answer { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "LSS-06",
        Lss(|_, request| {
            (is(request, &[0x43]) && !is(request, &[0x43, 0x11, 0x27])).then_some([0x44, 0, 0, 0, 0, 0, 0, 0])
        }),
    ),
    // The device ignores the product code.
    (
        "mh4",
        "LSS-06",
        Takes(|_, frame| match frame.as_eight_bytes() {
            Some([0x41, ..]) => Frame::full(frame.id(), PRODUCT),
            _ => *frame,
        }),
    ),
    ("mh4", "LSS-07", Sends(|_, frame| lss(frame, 0x4f, |data| data[0] = 0x4e))),
    ("mh4", "LSS-08", Lss(|_, request| is(request, &[0x4b, 0xff]).then_some([0x4f, 0, 0, 0, 0, 0, 0, 0]))),
    ("mh4", "LSS-09", Lss(|_, request| is(request, &[0x4c]).then_some([0x50, 0, 0, 0, 0, 0, 0, 0]))),
    ("mh4", "LSS-10", Lss(|_, request| is(request, &[0x7f]).then_some(request))),
    ("mh4", "LSS-11", Sends(|_, frame| lss(frame, 0x5a, |data| data[7] = 1))),
    (
        "mh4",
        "LSS-12",
        Lss(|memory, request| {
            let is_last = request[0] == 0x51 && request[5..] == [0, 3, 0];
            (is_last && !memory.is_configuring).then_some([0x4f, 0, 0, 0, 0, 0, 0, 0])
        }),
    ),
    // As CANopenNode with a node-ID of 255.
    (
        "mh4",
        "LSS-12",
        Lss(|memory, request| (request[0] == 0x51 && memory.is_configuring).then_some([0x4f, 0, 0, 0, 0, 0, 0, 0])),
    ),
    ("mh4", "LSS-13", Adds(|_, frame| after(frame, true, WAITING))),
    ("mh4", "LSS-14", Adds(|_, frame| after(frame, false, WAITING))),
    (
        "mh4",
        "LSS-20",
        Sends(|memory, frame| if memory.lss[1] == 128 { lss(frame, 0x11, |data| data[1] = 0) } else { vec![frame] }),
    ),
    (
        "mh4",
        "LSS-21",
        Sends(|memory, frame| if memory.lss[1] == NODE { lss(frame, 0x11, |data| data[1] = 1) } else { vec![frame] }),
    ),
    (
        "mh4",
        "LSS-22",
        Sends(|memory, frame| if memory.lss[1] == 1 { lss(frame, 0x13, |data| data[1] = 0) } else { vec![frame] }),
    ),
    ("mh4", "LSS-23", Sends(|_, frame| lss(frame, 0x11, |data| data.truncate(2)))),
    ("mh4", "LSS-24", Sends(|_, frame| lss(frame, 0x17, |data| data[1] = 2))),
    ("dps", "LSS-24", Sends(|_, frame| lss(frame, 0x17, |data| data[7] = 1))),
    (
        "mh4",
        "LSS-25",
        Sends(|memory, frame| {
            let is_boot_up = frame.id().number() == 0x700 + u32::from(NODE) && frame.data() == [0];
            memory.count = match (memory.count, memory.lss[0]) {
                (0, 0x17) => 1,
                (1, _) if is_boot_up => 2,
                (count, _) => count,
            };
            // The reset after the store.
            if memory.count == 2 { lss(frame, 0x5e, |data| data[1] = 6) } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "LSS-26",
        Sends(|memory, frame| if memory.lss[2] == 5 { lss(frame, 0x13, |data| data[1] = 0) } else { vec![frame] }),
    ),
    (
        "mh4",
        "LSS-29",
        Sends(|memory, frame| if memory.lss[2] == 10 { lss(frame, 0x13, |data| data[1] = 0) } else { vec![frame] }),
    ),
    (
        "mc1609",
        "LSS-27",
        Sends(|memory, frame| if memory.lss[2] == 3 { lss(frame, 0x13, |data| data[1] = 1) } else { vec![frame] }),
    ),
    (
        "dps",
        "LSS-27",
        Sends(|memory, frame| if memory.lss[2] == 8 { lss(frame, 0x13, |data| data[1] = 7) } else { vec![frame] }),
    ),
];
