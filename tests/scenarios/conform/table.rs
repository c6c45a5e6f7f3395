//! One deviation for each case.

use super::deviant::{Deviation, Memory, NODE};
use Deviation::{Answers, Both, Ignores, Sends, Takes};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use cangauge::canopen::sdo::crc16;
use std::time::Duration;

/// A device, the case that finds the deviation, and the deviation.
pub(super) type Row = (&'static str, &'static str, Deviation);

/// The answer to a request with the same object.
pub(super) fn reply(command: u8, request: [u8; 8], data: [u8; 4]) -> [u8; 8] {
    let [_, a, b, c, ..] = request;
    let [d, e, f, g] = data;
    [command, a, b, c, d, e, f, g]
}

pub(super) fn abort(request: [u8; 8], code: u32) -> [u8; 8] {
    reply(0x80, request, code.to_le_bytes())
}

pub(super) fn ack(request: [u8; 8]) -> [u8; 8] {
    reply(0x60, request, [0; 4])
}

/// Whether a request starts with these bytes.
pub(super) fn is(request: [u8; 8], start: &[u8]) -> bool {
    request.starts_with(start)
}

const READ_TYPE: &[u8] = &[0x40, 0x00, 0x10, 0x00];

fn is_answer(frame: &Frame) -> bool {
    frame.id().number() == 0x580 + u32::from(NODE)
}

fn is_life(frame: &Frame) -> bool {
    frame.id().number() == 0x700 + u32::from(NODE)
}

/// The frame with changed data.
pub(super) fn with(frame: Frame, change: impl FnOnce(&mut Vec<u8>)) -> Vec<Frame> {
    let mut data = frame.data().to_vec();
    change(&mut data);
    vec![Frame::new(frame.id(), &data).expect("eight bytes at most")]
}

/// Changes the answer to a read of this object.
pub(super) fn read(memory: &Memory, frame: Frame, object: [u8; 3], change: fn(&mut Vec<u8>)) -> Vec<Frame> {
    let [a, b, c] = object;
    let is_this = memory.request.is_some_and(|request| is(request, &[0x40, a, b, c]));
    if is_answer(&frame) && is_this { with(frame, change) } else { vec![frame] }
}

/// Whether this frame is an NMT command with this specifier for this node-ID.
pub(super) fn is_nmt(frame: &Frame, specifier: u8, node: u8) -> bool {
    frame.id() == CanId::NMT && frame.data() == [specifier, node]
}

fn nmt(specifier: u8) -> Frame {
    Frame::pair(CanId::NMT, specifier, NODE)
}

fn heartbeat(frame: &Frame) -> bool {
    is_life(frame) && frame.data() != [0]
}

pub(super) const SDO: &[Row] = &[
    ("mh4", "SDO-01", Sends(|memory, frame| read(memory, frame, [0x00, 0x10, 0], |data| data[0] = 0x53))),
    ("mh4", "SDO-02", Sends(|memory, frame| read(memory, frame, [0x01, 0x10, 0], |data| data.truncate(5)))),
    ("mh4", "SDO-03", Answers(|_, request| is(request, &[0x23, 0x00, 0x10]).then(|| ack(request)))),
    (
        "mh4",
        "SDO-04",
        Sends(|_, frame| {
            let is_write_only =
                is_answer(&frame) && frame.data().starts_with(&[0x80]) && frame.data()[4..] == [1, 0, 1, 6];
            if is_write_only { with(frame, |data| data[0] = 0x43) } else { vec![frame] }
        }),
    ),
    ("mh4", "SDO-05", Answers(|_, request| is(request, &[0x40, 0x00, 0x10, 1]).then(|| reply(0x43, request, [1; 4])))),
    ("mh4", "SDO-06", Answers(|_, request| is(request, &[0x40, 0x04, 0x10, 0]).then(|| reply(0x43, request, [1; 4])))),
    ("mh4", "SDO-07", Ignores(|_, _, frame| frame.data().first() == Some(&0xe0))),
    ("mh4", "SDO-08", Answers(|_, request| is(request, &[0x23, 0x17, 0x10]).then(|| ack(request)))),
    ("mh4", "SDO-09", Answers(|_, request| is(request, &[0x2f, 0x17, 0x10]).then(|| ack(request)))),
    (
        "mh4",
        "SDO-10",
        Sends(|memory, frame| {
            let is_setting =
                memory.request.is_some_and(|request| request[0] >> 5 == 1 && request[1..3] == [0x32, 0x61]);
            let is_abort = is_answer(&frame) && frame.data().starts_with(&[0x80]);
            if is_setting && is_abort {
                with(frame, |data| data[4..].copy_from_slice(&[0, 0, 1, 6]))
            } else {
                vec![frame]
            }
        }),
    ),
    ("mc1609", "SDO-11", Answers(|_, request| is(request, &[0x2b, 0x00, 0x18, 5, 99]).then(|| ack(request)))),
    ("dps", "SDO-12", Sends(|memory, frame| read(memory, frame, [0x00, 0x12, 1], |data| data[4] ^= 1))),
    ("mh4", "SDO-13", Sends(|memory, frame| read(memory, frame, [0x08, 0x10, 0], |data| data[4] += 1))),
    ("mh4", "SDO-14", Answers(|_, request| is(request, &[0x0b]).then(|| abort([0; 8], 0x0800_0000)))),
    (
        "mh4",
        "SDO-15",
        Answers(|memory, request| {
            let follows_initiate = memory.last.is_some_and(|last| is(last, &[0x40]));
            (is(request, &[0x70]) && follows_initiate).then_some([0x11, 0, 0, 0, 0, 0, 0, 0])
        }),
    ),
    ("mh4", "SDO-16", Answers(|_, request| is(request, &[0x1b]).then_some([0x30, 0, 0, 0, 0, 0, 0, 0]))),
    (
        "mh4",
        "SDO-17",
        Answers(|memory, request| {
            let follows_read = memory.last.is_some_and(|last| is(last, READ_TYPE));
            (is(request, &[0x60]) && follows_read).then_some([0x01, 0, 0, 0, 0, 0, 0, 0])
        }),
    ),
    ("mh4", "SDO-18", Answers(|_, request| is(request, &[0x80]).then_some(request))),
    (
        "mh4",
        "SDO-19",
        Answers(|memory, request| {
            let follows_initiate = memory.last.is_some_and(|last| is(last, &[0x40, 0x08, 0x10]));
            (is(request, READ_TYPE) && follows_initiate).then(|| abort(request, 0x0800_0000))
        }),
    ),
    (
        "mh4",
        "SDO-20",
        Sends(|_, frame| {
            let is_ack = is_answer(&frame) && frame.data().first() == Some(&0x60);
            if is_ack { with(frame, |data| data[1..4].fill(0)) } else { vec![frame] }
        }),
    ),
    ("mh4", "SDO-21", Sends(|memory, frame| read(memory, frame, [0x01, 0x10, 0], |data| data[5] = 0xff))),
    (
        "mh4",
        "SDO-22",
        Ignores(|memory, _, frame| {
            if !is_answer(frame) && frame.data().starts_with(READ_TYPE) {
                memory.count += 1;
            } else if frame.as_eight_bytes().is_some() {
                memory.count = 0;
            }
            memory.count == 40
        }),
    ),
    (
        "mh4",
        "SDO-23",
        Takes(|_, frame| {
            let mut data = frame.data().to_vec();
            data.resize(8, 0);
            if data[0] == 0x2b && !frame.is_remote() {
                Frame::new(frame.id(), &data).expect("eight bytes")
            } else {
                *frame
            }
        }),
    ),
    (
        "mh4",
        "SDO-24",
        Takes(|_, frame| {
            let is_other = frame.id().number() == 0x600 + u32::from(NODE) + 1;
            let id = CanId::standard(0x600 + u16::from(NODE)).expect("an identifier");
            if is_other { Frame::new(id, frame.data()).expect("eight bytes") } else { *frame }
        }),
    ),
    (
        "large",
        "SDO-30",
        Sends(|memory, frame| {
            let is_segment =
                is_answer(&frame) && memory.initiate == 0xa0 && memory.request.is_some_and(|last| last[0] == 0xa3);
            if is_segment { with(frame, |data| data[1] ^= 1) } else { vec![frame] }
        }),
    ),
    (
        "large",
        "SDO-31",
        Sends(|memory, frame| {
            let is_end =
                is_answer(&frame) && memory.initiate == 0xa4 && memory.request.is_some_and(|last| last[0] == 0xa2);
            if is_end { with(frame, |data| data[1] ^= 1) } else { vec![frame] }
        }),
    ),
    (
        "large",
        "SDO-32",
        Answers(|_, request| (is(request, &[0xa0]) && request[4] == 128).then(|| reply(0xc2, request, [4, 0, 0, 0]))),
    ),
    (
        "large",
        "SDO-33",
        Answers(|memory, request| {
            (is(request, &[0xd5]) && memory.initiate == 0xc2).then(|| abort([0; 8], 0x0800_0000))
        }),
    ),
    (
        "large",
        "SDO-34",
        Answers(|memory, request| {
            let is_right = request[1..3] == crc16(&memory.segment).to_le_bytes();
            (is(request, &[0xd5]) && memory.initiate == 0xc6 && is_right).then(|| abort([0; 8], 0x0504_0004))
        }),
    ),
    (
        "large",
        "SDO-35",
        Answers(|memory, request| {
            let is_right = request[1..3] == crc16(&memory.segment).to_le_bytes();
            (is(request, &[0xd5]) && memory.initiate == 0xc6 && !is_right).then_some([0xa1, 0, 0, 0, 0, 0, 0, 0])
        }),
    ),
    ("large", "SDO-36", Answers(|_, request| is(request, &[0xa2, 128]).then_some([0xcd, 0, 0, 0, 0, 0, 0, 0]))),
];

pub(super) const OD: &[Row] = &[
    ("mh4", "OD-01", Answers(|_, request| is(request, &[0x40, 0x01, 0x10, 0]).then(|| abort(request, 0x0602_0000)))),
    ("mh4", "OD-02", Sends(|memory, frame| read(memory, frame, [0x01, 0x10, 0], |data| data[4] = 0x10))),
    ("mh4", "OD-03", Sends(|memory, frame| read(memory, frame, [0x18, 0x10, 3], |data| data[0] = 0x4b))),
    (
        "mc1609",
        "OD-04",
        Both(
            |_, frame| match frame.as_eight_bytes() {
                // The device shows the same vendor-ID by LSS.
                Some([service @ (0x40 | 0x46), 0, 0, 0, 0, ..]) => {
                    Frame::full(frame.id(), [service, 0x1d, 0x01, 0, 0, 0, 0, 0])
                }
                _ => *frame,
            },
            |memory, frame| {
                if frame.id() == CanId::LSS_SLAVE && frame.data().first() == Some(&0x5a) {
                    return with(frame, |data| data[1..].fill(0));
                }
                read(memory, frame, [0x18, 0x10, 1], |data| data[4..].fill(0))
            },
        ),
    ),
    ("mh4", "OD-05", Answers(|_, request| is(request, &[0x40, 0x18, 0x10, 5]).then(|| reply(0x43, request, [1; 4])))),
    ("mh4", "OD-06", Answers(|_, request| is(request, &[0x23, 0x18, 0x10, 1]).then(|| ack(request)))),
    ("mh4", "OD-07", Sends(|memory, frame| read(memory, frame, [0x0a, 0x10, 0], |data| data[5] = 0x01))),
    (
        "mh4",
        "OD-08",
        Sends(|memory, frame| {
            memory.count += u32::from(memory.request.is_some_and(|request| is(request, &[0x40, 0x18, 0x10, 3])));
            if memory.count % 2 == 0 {
                return vec![frame];
            }
            read(memory, frame, [0x18, 0x10, 3], |data| data[7] ^= 1)
        }),
    ),
    (
        "mh4",
        "OD-09",
        Sends(|memory, frame| {
            read(memory, frame, [0x14, 0x10, 0], |data| data[4..].copy_from_slice(&[0x01, 0x07, 0, 0]))
        }),
    ),
    ("mh4", "OD-10", Answers(|_, request| is(request, &[0x23, 0x05, 0x10, 0, 1, 6]).then(|| ack(request)))),
];

pub(super) const NMT: &[Row] = &[
    (
        "mh4",
        "NMT-01",
        Sends(|memory, frame| {
            let copies = if memory.nmt[0] == 0x81 && is_life(&frame) && frame.data() == [0] { 2 } else { 1 };
            vec![frame; copies]
        }),
    ),
    (
        "mh4",
        "NMT-02",
        Sends(|memory, frame| {
            let copies = if memory.nmt[0] == 0x82 && is_life(&frame) && frame.data() == [0] { 2 } else { 1 };
            vec![frame; copies]
        }),
    ),
    (
        "mh4",
        "NMT-03",
        Sends(
            |memory, frame| {
                if memory.nmt[0] == 0x81 && heartbeat(&frame) { with(frame, |data| data[0] = 4) } else { vec![frame] }
            },
        ),
    ),
    ("mh4", "NMT-04", Ignores(|memory, _, frame| is_nmt(frame, 0x01, NODE) && memory.nmt[1] == 0x02)),
    ("mh4", "NMT-05", Ignores(|memory, _, frame| is_nmt(frame, 0x02, NODE) && memory.nmt[1] == 0x01)),
    (
        "mh4",
        "NMT-06",
        Ignores(|memory, _, frame| is_nmt(frame, 0x80, NODE) && memory.nmt[1] == 0x01 && memory.periods[0] == 50),
    ),
    ("mh4", "NMT-07", Ignores(|memory, _, frame| frame.data().starts_with(READ_TYPE) && memory.nmt[0] == 0x01)),
    (
        "mh4",
        "NMT-08",
        Answers(|memory, request| {
            (is(request, READ_TYPE) && memory.nmt[0] == 0x02).then(|| reply(0x43, request, [1; 4]))
        }),
    ),
    ("mh4", "NMT-09", Sends(|_, frame| if is_life(&frame) && frame.data() == [4] { Vec::new() } else { vec![frame] })),
    (
        "mh4",
        "NMT-10",
        Ignores(|memory, now, frame| {
            let is_new = memory.booted.is_some_and(|at| now.saturating_sub(at) < Duration::from_millis(10));
            is_new && frame.data().starts_with(READ_TYPE) && memory.nmt[0] == 0x82
        }),
    ),
    ("mh4", "NMT-11", Takes(|_, frame| if is_nmt(frame, 0x03, NODE) { nmt(0x02) } else { *frame })),
    ("mh4", "NMT-12", Takes(|_, frame| if frame.id() == CanId::NMT && frame.len() == 1 { nmt(0x02) } else { *frame })),
    (
        "mh4",
        "NMT-13",
        Sends(|memory, frame| {
            if memory.periods[0] == 54_321 && memory.nmt[0] == 0x82 {
                return read(memory, frame, [0x17, 0x10, 0], |data| {
                    data[4..6].copy_from_slice(&54_321u16.to_le_bytes())
                });
            }
            vec![frame]
        }),
    ),
    ("mh4", "NMT-14", Ignores(|_, _, frame| is_nmt(frame, 0x01, 0))),
    ("mh4", "NMT-15", Takes(|_, frame| if is_nmt(frame, 0x02, NODE + 1) { nmt(0x02) } else { *frame })),
];

pub(super) const ERROR_CONTROL: &[Row] = &[
    (
        "mh4",
        "ERR-01",
        Sends(|memory, frame| {
            memory.count += u32::from(heartbeat(&frame));
            let is_lost = memory.periods[0] == 100 && heartbeat(&frame) && memory.count % 4 == 0;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "ERR-02",
        Sends(|memory, frame| {
            memory.count += u32::from(heartbeat(&frame));
            let is_lost = memory.periods[0] == 100 && heartbeat(&frame) && memory.count <= 2;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "ERR-03",
        Sends(|memory, frame| {
            memory.count += u32::from(heartbeat(&frame));
            let is_lost = memory.periods == [50, 100] && heartbeat(&frame) && memory.count % 2 == 0;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "ERR-04",
        Both(
            |_, frame| {
                let is_off = frame.data().starts_with(&[0x2b, 0x17, 0x10, 0, 0, 0]);
                if is_off { Frame::full(frame.id(), [0x2b, 0x17, 0x10, 0, 50, 0, 0, 0]) } else { *frame }
            },
            |memory, frame| {
                if memory.periods[0] == 0 {
                    read(memory, frame, [0x17, 0x10, 0], |data| data[4..6].fill(0))
                } else {
                    vec![frame]
                }
            },
        ),
    ),
    ("mh4", "ERR-05", Sends(|_, frame| if heartbeat(&frame) { with(frame, |data| data.push(0)) } else { vec![frame] })),
    (
        "mc1609",
        "ERR-06",
        Sends(|_, frame| if heartbeat(&frame) { with(frame, |data| data[0] &= 0x7f) } else { vec![frame] }),
    ),
    (
        "mc1609",
        "ERR-07",
        Sends(|memory, frame| {
            if heartbeat(&frame) && memory.periods[0] == 0 { with(frame, |data| data[0] ^= 0x80) } else { vec![frame] }
        }),
    ),
    (
        "mc1609",
        "ERR-08",
        Answers(|_, request| {
            (is(request, &[0x2b, 0x0c, 0x10]) || is(request, &[0x2f, 0x0d, 0x10])).then(|| ack(request))
        }),
    ),
    (
        "mc1609",
        "ERR-09",
        Both(
            |memory, frame| {
                memory.count = u32::from(is_life(frame) && frame.is_remote());
                // The device then answers a request for its type, which is turned into a guarding answer.
                let id = CanId::standard(0x600 + u16::from(NODE)).expect("an identifier");
                let read = Frame::full(id, [0x40, 0, 0x10, 0, 0, 0, 0, 0]);
                if memory.count == 1 && memory.periods[0] != 0 { read } else { *frame }
            },
            |memory, frame| {
                if is_answer(&frame) && memory.count == 1 && memory.periods[0] != 0 {
                    let id = CanId::standard(0x700 + u16::from(NODE)).expect("an identifier");
                    return vec![Frame::byte(id, 0x7f)];
                }
                vec![frame]
            },
        ),
    ),
];
