//! One deviation for each case of the area 404.

use super::deviant::Deviation::{Answers, Both, Ignores, Sends, Takes};
use super::deviant::{Memory, NODE};
use super::table::{Row, ack, is, is_nmt, read, with};
use super::table_more::is_tpdo;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;

const UNIT: [u8; 3] = [0x31, 0x61, 1];
const DIGITS: [u8; 3] = [0x32, 0x61, 1];
/// The code of psi.
const PSI: u32 = 0x00ab_0000;

/// Changes the REAL32 in the answers to reads of this object.
fn real(frame: Frame, object: [u8; 3], change: fn(f32) -> f32) -> Vec<Frame> {
    match frame.data() {
        [0x43, x, y, z, a, b, c, d] if [*x, *y, *z] == object => {
            let value = change(f32::from_le_bytes([*a, *b, *c, *d]));
            with(frame, |data| data[4..].copy_from_slice(&value.to_le_bytes()))
        }
        _ => vec![frame],
    }
}

/// Changes the INTEGER16 in the answers to reads of this object.
fn integer(frame: Frame, object: [u8; 3], change: fn(i16) -> i16) -> Vec<Frame> {
    match frame.data() {
        [0x4b, x, y, z, a, b, ..] if [*x, *y, *z] == object => {
            let value = change(i16::from_le_bytes([*a, *b]));
            with(frame, |data| data[4..6].copy_from_slice(&value.to_le_bytes()))
        }
        _ => vec![frame],
    }
}

/// Replaces a value that is written to this object.
fn written_as(frame: Frame, object: [u8; 3], value: u32, other: u32) -> Frame {
    match frame.data() {
        [0x22..=0x2f, x, y, z, a, b, c, d]
            if [*x, *y, *z] == object && u32::from_le_bytes([*a, *b, *c, *d]) == value =>
        {
            with(frame, |data| data[4..].copy_from_slice(&other.to_le_bytes()))[0]
        }
        _ => frame,
    }
}

/// Counts the acknowledged writes of autozero and offset: two in each case.
fn count_zeros(memory: &mut Memory, frame: &Frame) {
    memory.count += u32::from(matches!(frame.data(), [0x60, 0x25 | 0x27, 0x61, 1, ..]));
}

const ZERO: [u8; 3] = [0x25, 0x61, 1];
const STATUS: [u8; 3] = [0x50, 0x61, 1];
const SAMPLE_TIME: [u8; 3] = [0x14, 0x61, 1];
const DELTA: [u8; 3] = [0x33, 0x61, 1];
const LOWER: [u8; 3] = [0x34, 0x61, 1];

fn is_event_driven(memory: &Memory) -> bool {
    memory.written([0x00, 0x18, 2]) == 255
}

pub(super) const ROWS: &[Row] = &[
    // Bar for a thermocouple.
    ("mc1609", "404-01", Sends(|memory, frame| read(memory, frame, UNIT, |data| data[6] = 0x4e))),
    ("mc1609", "404-02", Sends(|memory, frame| read(memory, frame, UNIT, |data| data[4] = 1))),
    ("mc1609", "404-03", Sends(|memory, frame| read(memory, frame, DIGITS, |data| data[4] = 10))),
    (
        "mh4",
        "404-04",
        Sends(|memory, frame| {
            // Only next to a read of 6130h.
            let is_compared = memory.last.is_some_and(|last| is(last, &[0x40, 0x30, 0x61, 1]));
            if is_compared { read(memory, frame, [0x30, 0x71, 1], |data| data[5] ^= 2) } else { vec![frame] }
        }),
    ),
    // The process value stays in bar.
    (
        "mh4",
        "404-10",
        Sends(|memory, frame| {
            if memory.written(UNIT) != PSI {
                return vec![frame];
            }
            real(frame, [0x30, 0x61, 1], |value| value / 14.503_8)
        }),
    ),
    (
        "mh4",
        "404-11",
        Sends(|memory, frame| {
            if memory.written(UNIT) != PSI {
                return vec![frame];
            }
            real(frame, [0x49, 0x61, 1], |_| 10.0)
        }),
    ),
    (
        "mh4",
        "404-12",
        Sends(|memory, frame| {
            // The third change is that of this case.
            memory.count += u32::from(frame.data().starts_with(&[0x60, 0x31, 0x61, 1]));
            if memory.count == 6 { real(frame, [0x49, 0x61, 1], |value| value + 1.0) } else { vec![frame] }
        }),
    ),
    // An overload within the span.
    (
        "mh4",
        "404-05",
        Sends(|memory, frame| {
            // Only before the cases of autozero and overload.
            if memory.was_written(ZERO) { vec![frame] } else { read(memory, frame, STATUS, |data| data[4] = 2) }
        }),
    ),
    (
        "mh4",
        "404-06",
        Sends(|_, frame| integer(frame, [0x49, 0x71, 1], |value| if value == 10_000 { 9_000 } else { value })),
    ),
    // The integer keeps its three digits.
    (
        "mh4",
        "404-20",
        Sends(|memory, frame| {
            if memory.written(DIGITS) != 2 {
                return vec![frame];
            }
            integer(frame, [0x30, 0x71, 1], |value| value * 10)
        }),
    ),
    (
        "mh4",
        "404-21",
        Sends(|memory, frame| {
            // The second change is that of this case.
            memory.count += u32::from(frame.data().starts_with(&[0x60, 0x32, 0x61, 1]));
            if memory.count == 4 { integer(frame, [0x49, 0x71, 1], |value| value - 100) } else { vec![frame] }
        }),
    ),
    ("mh4", "404-30", Answers(|_, request| is(request, &[0x2f, 0xa0, 0x61, 1, 99]).then(|| ack(request)))),
    (
        "mh4",
        "404-31",
        Sends(|memory, frame| {
            // Only the constant of this case.
            let is_filtered = memory.written([0xa0, 0x61, 1]) == 1 && memory.written([0xa1, 0x61, 1]) == 4;
            if is_filtered { real(frame, [0x30, 0x61, 1], |value| value * 1.5) } else { vec![frame] }
        }),
    ),
    // The larger constant is the same as the smaller one.
    (
        "mh4",
        "404-32",
        Takes(|_, frame| {
            let halves = [16, 64, 250, 1000, 8000].into_iter();
            halves.fold(*frame, |frame, half| written_as(frame, [0xa1, 0x61, 1], 2 * half, half))
        }),
    ),
    // The repeating average is a moving one.
    ("mh4", "404-33", Takes(|_, frame| written_as(*frame, [0xa0, 0x61, 1], 2, 1))),
    (
        "d20",
        "404-34",
        Sends(|memory, frame| {
            let is_twice = memory.written(SAMPLE_TIME) == 2000;
            if is_twice { read(memory, frame, SAMPLE_TIME, |data| data[4..6].fill(0)) } else { vec![frame] }
        }),
    ),
    // The sample time is only shown.
    (
        "hydac",
        "404-35",
        Both(
            |_, frame| written_as(*frame, SAMPLE_TIME, 2000, 1000),
            |memory, frame| {
                let is_twice = memory.written(SAMPLE_TIME) == 2000;
                let shown = |data: &mut Vec<u8>| data[4..].copy_from_slice(&2000u32.to_le_bytes());
                if is_twice { read(memory, frame, SAMPLE_TIME, shown) } else { vec![frame] }
            },
        ),
    ),
    (
        "mh4",
        "404-50",
        Answers(|_, request| is(request, &[0x23, 0x25, 0x61, 1, b'z', b'e', b'r', b'a']).then(|| ack(request))),
    ),
    (
        "mh4",
        "404-51",
        Sends(|memory, frame| {
            count_zeros(memory, &frame);
            if memory.count == 1 { real(frame, [0x30, 0x61, 1], |value| value + 0.5) } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "404-52",
        Sends(|memory, frame| {
            count_zeros(memory, &frame);
            if memory.count == 3 { real(frame, [0x27, 0x61, 1], |_| 0.0) } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "404-53",
        Sends(|memory, frame| {
            count_zeros(memory, &frame);
            if memory.count == 6 { real(frame, [0x30, 0x61, 1], |value| value + 0.5) } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "404-60",
        Sends(|memory, frame| {
            let is_lost = is_event_driven(memory) && is_tpdo(&frame) && memory.written(DELTA) != 0;
            if is_lost { Vec::new() } else { vec![frame] }
        }),
    ),
    // A TPDO after each change of the offset, although the delta is large.
    (
        "mh4",
        "404-61",
        Sends(|memory, frame| {
            let is_far = f32::from_bits(memory.written(DELTA)) > 1.0;
            let is_offset = frame.data().starts_with(&[0x60, 0x27, 0x61, 1]);
            if !is_event_driven(memory) || !is_far || !is_offset {
                return vec![frame];
            }
            let id = CanId::standard(0x180 + u16::from(NODE)).expect("an identifier");
            vec![frame, Frame::new(id, &[0; 5]).expect("five bytes")]
        }),
    ),
    (
        "mh4",
        "404-62",
        Sends(|memory, frame| {
            let is_upper = memory.written(DELTA) == 0 && f32::from_bits(memory.written(LOWER)) < 0.0;
            if is_event_driven(memory) && is_upper && is_tpdo(&frame) { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "404-63",
        Sends(|memory, frame| {
            let is_lower = memory.written(DELTA) == 0 && f32::from_bits(memory.written(LOWER)) > 0.0;
            if is_event_driven(memory) && is_lower && is_tpdo(&frame) { Vec::new() } else { vec![frame] }
        }),
    ),
    (
        "mh4",
        "404-64",
        Ignores(|memory, _, frame| is_nmt(frame, 0x80, NODE) && memory.nmt[1] == 0x01 && is_event_driven(memory)),
    ),
    ("mh4", "404-70", Sends(|memory, frame| read(memory, frame, STATUS, |data| data[4] &= !2))),
    ("mh4", "404-71", Sends(|memory, frame| read(memory, frame, STATUS, |data| data[4] &= !4))),
    (
        "mh4",
        "404-72",
        Sends(|_, frame| integer(frame, [0x30, 0x71, 1], |value| if value == i16::MIN { 12_000 } else { value })),
    ),
    ("dps", "404-73", Sends(|_, frame| if frame.data().starts_with(&[0x01, 0x32]) { Vec::new() } else { vec![frame] })),
    (
        "mh4",
        "404-74",
        Sends(|memory, frame| {
            // The fourth overload stays.
            let is_status = memory.request.is_some_and(|request| is(request, &[0x40, 0x50, 0x61, 1]));
            let [0x4f, _, _, _, status, ..] = *frame.data() else { return vec![frame] };
            if is_status && (status != 0) != (memory.count % 2 == 1) && memory.count < 8 {
                memory.count += 1;
            }
            if is_status && memory.count >= 8 { with(frame, |data| data[4] = 3) } else { vec![frame] }
        }),
    ),
];
