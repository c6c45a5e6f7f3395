//! Tests of the interpretation of frames.

use super::*;
use crate::bus::{Received, Stamp};
use crate::canopen::frame::Frame;

fn entries(frames: &[&str]) -> Vec<Entry> {
    let (mut interpreter, mut entries) = (Interpreter::new(&Overrides::new(), Overrides::new()), Vec::new());
    for (at, text) in (0..).zip(frames) {
        let at = Stamp { mono: Mono::at(Duration::from_millis(at)), ..Stamp::default() };
        interpreter.take(&Received { frame: text.parse().expect("a frame"), at }, &mut entries);
    }
    interpreter.finish(&mut entries);
    entries
}

#[test]
fn repeated_heartbeats_and_guarding_are_marked() {
    let heartbeats = entries(&["705#7F", "705#7F", "705#05", "705#05", "705#00", "705#05"]);
    let repeated: Vec<bool> = heartbeats.iter().map(|entry| entry.is_repeated).collect();
    assert_eq!(repeated, [false, true, false, true, false, false]);
    let guarding = entries(&["705#R1", "705#7F", "705#R1", "705#FF", "705#R1", "705#FF", "705#R1", "705#R1"]);
    let repeated: Vec<bool> = guarding.iter().map(|entry| entry.is_repeated).collect();
    assert_eq!(repeated, [false, false, true, true, true, false, true, false]);
    assert_eq!(guarding[5].content, Content::Guarded(crate::canopen::nmt::NmtState::PreOperational, false));
}

#[test]
fn time_has_the_cob_id_of_1012h() {
    let kinds = |frames: &[&str]| -> Vec<FrameKind> { entries(frames).iter().map(|entry| entry.kind).collect() };
    let time = "102#60E316004301";
    assert_eq!(kinds(&[time, &time.replace("102", "100")]), [FrameKind::Other, FrameKind::Time]);
    let other = FrameKind::Sdo;
    assert_eq!(kinds(&["605#4012100000000000", "585#4312100002010080", time]), [other, FrameKind::Time], "read");
    assert_eq!(kinds(&["605#2312100002010040", "585#6012100000000000", time]), [other, FrameKind::Time], "written");
    assert_eq!(kinds(&["605#2312100002010040", "585#8012100030000906", time]), [other, FrameKind::Other], "rejected");
}

/// Every frame is in a message or in an SDO transfer, and no frame panics.
#[test]
fn random_frames_are_shown() {
    let mut seed = 7u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        seed.to_be_bytes()
    };
    let functions = [0, 0x80, 0x100, 0x180, 0x280, 0x580, 0x600, 0x700, 0x780];
    let commands = [0x40, 0x43, 0x60, 0x2b, 0xa4, 0xc2, 0x51, 0x04, 0x80, 0x05];
    let mut interpreter = Interpreter::new(&Overrides::new(), Overrides::new());
    let mut parts = 0u64;
    for at in 0..100_000u64 {
        let ([a, b, c, d, choice, is_remote, length, ..], mut data) = (random(), random());
        data[0] = commands[usize::from(choice) % commands.len()];
        let id = match choice % 20 {
            0 => CanId::extended(u32::from_be_bytes([a & 0x1f, b, c, d])),
            1..=3 => CanId::standard(u16::from_be_bytes([a & 7, b])),
            4 => Some(CanId::LSS_MASTER),
            5 => Some(CanId::LSS_SLAVE),
            _ => CanId::standard(functions[usize::from(b) % functions.len()] + u16::from(a % 4)),
        };
        let (id, length) = (id.expect("in range"), length % 9);
        let frame =
            if is_remote < 20 { Frame::remote(id, length) } else { Frame::new(id, &data[..usize::from(length)]) };
        let at = Stamp { mono: Mono::at(Duration::from_millis(at)), ..Stamp::default() };
        let received = Received { frame: frame.expect("at most 8 bytes"), at };
        let mut entries = Vec::new();
        let kind = interpreter.take(&received, &mut entries);
        let shows = |entry: &Entry| entry.id == Some(id) && entry.data == received.frame.data();
        let is_part = kind == FrameKind::Sdo && !entries.last().is_some_and(shows);
        parts += u64::from(is_part);
        assert!(is_part || entries.last().is_some_and(|entry| shows(entry) && entry.kind == kind), "{entries:?}");
    }
    assert!(parts > 1000, "{parts}");
}
