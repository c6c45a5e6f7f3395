//! Messages captured from Linux 6.1 with `kvaser_pci`, `vcan` and `lo`. Only name and link info are kept.

use super::link::{BitTiming, Link, State};
use super::message::{Reply, Request, reply};
use proptest::prelude::*;

/// can0 before its bit rate was set.
const FRESH: &str = "cc000000100000000100000076000000000018010200000080000400000000000900030063616e3000000000a0001200\
    0800010063616e001c0003000000000000000000000000000000000000000000000000007800020034000200736a6131\
    303030000000000000000000010000001000000001000000080000000400000001000000400000000100000008000300\
    00127a0008000400040000000c00050000000000000000000800060000000000080008000000000008000f0000000000\
    0c001180080001005f010000";
/// can0 after `type can bitrate 250000 restart-ms 100 listen-only on` and `up`.
const UP: &str = "f00000001000000001000000760000000000180102000000c1000500000000000900030063616e3000000000c4001200\
    0800010063616e001c0003000000000000000000000000000000000000000000000000009c0002002400010090d00300\
    6b030000fa000000060000000700000002000000010000000200000034000200736a6131303030000000000000000000\
    01000000100000000100000008000000040000000100000040000000010000000800030000127a000800040000000000\
    0c00050000000000020000000800060064000000080008000000000008000f00000000000c001180080001005f010000";
/// vcan0, up.
const VIRTUAL: &str = "3c0000001000000001000000760000000000180104000000c1000100000000000a0003007663616e3000000010001200\
    090001007663616e00000000";
/// lo.
const LOOPBACK: &str = "2800000010000000010000007600000000000403010000004900010000000000070003006c6f0000";
/// The error if the interface does not exist.
const MISSING: &str = "24000000020000010100000076000000edffffff2c000000120001000100000000000000";
/// The error for a bit rate if the interface is up.
const BUSY: &str = "24000000020000010100000076000000f0ffffff54000000100005000100000000000000";
/// An acknowledgement.
const DONE: &str = "240000000200000101000000760000000000000060000000100005000100000000000000";

/// Converts a capture from hexadecimal digits. The captures are from a little-endian machine.
fn captured(hex: &str) -> Vec<u8> {
    let nibbles: Vec<u8> = hex.chars().map(|c| u8::try_from(c.to_digit(16).unwrap()).unwrap()).collect();
    nibbles.as_chunks::<2>().0.iter().map(|[high, low]| high << 4 | low).collect()
}

fn link(hex: &str) -> Link {
    match reply(&captured(hex), 1) {
        Some(Reply::Link(header, attributes)) => Link::read(header, attributes),
        other => panic!("{other:?}"),
    }
}

#[test]
fn a_controller_without_a_bit_rate_is_parsed() {
    let link = link(FRESH);
    assert!(link.is_can && link.is_controller() && !link.up);
    assert_eq!((link.bit_timing, link.bit_rate()), (None, None));
    assert_eq!((link.state, link.listen_only, link.can_listen_only), (Some(State::Stopped), Some(false), Some(true)));
    assert_eq!((link.restart_ms, link.errors, link.rate_max), (Some(0), Some((0, 0)), None));
}

#[test]
fn a_listen_only_controller_is_parsed() {
    let link = link(UP);
    assert!(link.is_can && link.is_controller() && link.up);
    let timing = BitTiming { bit_rate: 250_000, sample_point: 875, quantum: 250, segments: [6, 7, 2, 1] };
    assert_eq!(link.bit_timing, Some(timing));
    assert_eq!((link.state, link.listen_only, link.restart_ms), (Some(State::ErrorActive), Some(true), Some(100)));
    assert_eq!(
        timing.to_request(),
        BitTiming { bit_rate: 0, ..timing },
        "the kernel accepts either a bit rate or time quanta"
    );
    assert_eq!(BitTiming::of_rate(125_000).to_request(), BitTiming::of_rate(125_000));
}

#[test]
fn virtual_and_other_interfaces_are_not_controllers() {
    let link = |hex| {
        let link = link(hex);
        (link.is_can, link.is_controller(), link.up, link.kind, link.bit_timing, link.state)
    };
    assert_eq!(link(VIRTUAL), (true, false, true, Some("vcan".into()), None, None));
    assert_eq!(link(LOOPBACK), (false, false, true, None, None, None));
}

#[test]
fn acknowledges_and_errors_are_parsed() {
    assert_eq!(reply(&captured(DONE), 1), Some(Reply::Done));
    assert_eq!(reply(&captured(MISSING), 1), Some(Reply::Refused(libc::ENODEV, None)));
    assert_eq!(reply(&captured(BUSY), 1), Some(Reply::Refused(libc::EBUSY, None)));
    assert_eq!(reply(&captured(DONE), 2), None, "of another request");
    assert_eq!(reply(&[captured(DONE), captured(MISSING)].concat(), 1), Some(Reply::Done), "the first one");
}

/// An error with a message and only the header of the request, as in linux/netlink.h.
const CAPPED: &str = "58000000020000030700000076000000eaffffff60000000100005000700000000000000320001006269747261746520\
    33303030303030206270732065786365656473207472616e73636569766572206c696d6974000000";
/// The same error with the whole request before the message.
const REPEATED: &str = "a8000000020000020700000076000000eaffffff60000000100005000700000000000000000000000200000000000000\
    00000000400012000700010063616e00340002002400010020a107000000000000000000000000000000000000000000\
    00000000000000000c000500020000000000000032000100626974726174652033303030303030206270732065786365\
    656473207472616e73636569766572206c696d6974000000";
/// A request for 500 kbit/s and listen-only off for interface 2, encoded by hand.
const SET: &str = "6000000010000500070000000000000000000000020000000000000000000000400012000700010063616e0034000200\
    2400010020a10700000000000000000000000000000000000000000000000000000000000c0005000200000000000000";

#[test]
fn the_message_of_the_kernel_is_read() {
    let words = "bitrate 3000000 bps exceeds transceiver limit";
    for hex in [CAPPED, REPEATED] {
        assert_eq!(reply(&captured(hex), 7), Some(Reply::Refused(libc::EINVAL, Some(words))));
    }
}

#[test]
fn a_request_contains_only_the_given_settings() {
    let link = Link { index: 2, ..link(UP) };
    let request = |timing, listens| link.configure(timing, listens).finish(7);
    assert_eq!(request(BitTiming::of_rate(500_000), Some(false)), captured(SET));
    let without = request(BitTiming::of_rate(500_000), None);
    assert_eq!(without.len(), captured(SET).len() - 12, "no mode");
    // A header, then: any family, index, flags, mask.
    let up = link.switch(true).finish(1);
    assert_eq!(up[16..], [[0, 0, 0, 0], [2, 0, 0, 0], [1, 0, 0, 0], [1, 0, 0, 0]].concat());
    let down = link.switch(false).finish(1);
    assert_eq!(down[24..], [[0, 0, 0, 0], [1, 0, 0, 0]].concat());
}

#[test]
fn an_interface_is_requested_by_name() {
    let request = Request::get("can0").finish(1);
    assert_eq!((request.len(), request[0]), (44, 44));
    assert_eq!(request[32..], *b"\x09\x00\x03\x00can0\0\0\0\0");
}

/// Parses any bytes, which must not panic.
fn read(bytes: &[u8]) {
    if let Some(Reply::Link(header, attributes)) = reply(bytes, 1) {
        let link = Link::read(header, attributes);
        assert!(link.bit_rate() != Some(0));
    }
}

proptest! {
    #[test]
    fn any_bytes(bytes in prop::collection::vec(any::<u8>(), 0..200)) {
        read(&bytes);
    }

    #[test]
    fn captures_that_are_cut_and_changed(cut in 0usize..240, at in 0usize..240, byte: u8, which in 0usize..4) {
        let mut bytes = captured([FRESH, UP, VIRTUAL, BUSY][which]);
        bytes.truncate(cut);
        if let Some(place) = bytes.get_mut(at) {
            *place = byte;
        }
        read(&bytes);
    }
}
