//! One deviation for each case of the area 404.

use super::deviant::Deviation::Sends;
use super::table::{Row, is, read, with};
use cangauge::canopen::frame::Frame;

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
];
