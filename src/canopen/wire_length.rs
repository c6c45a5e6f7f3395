//! How many bits a frame takes on the wire (ISO 11898-1, 10.4 to 10.6): header, data, CRC, stuff bits,
//! end of frame, and the pause that must follow.

use super::frame::Frame;
use super::id::CanId;
use std::time::Duration;

/// Bits after the CRC: its delimiter, acknowledge and its delimiter, seven bits of end of frame. Never stuffed.
const TAIL: u32 = 10;

/// The pause between two frames.
pub const INTERMISSION: u32 = 3;

/// The length of `frame` in bits, stuff bits included, the pause after it not.
pub fn frame_bits(frame: &Frame) -> u32 {
    let mut wire = Wire::new();
    wire.put(0, 1);
    match frame.id() {
        CanId::Standard(id) => {
            wire.put(u32::from(id), 11);
            wire.put(u32::from(frame.is_remote()), 1);
            // IDE and r0, both dominant.
            wire.put(0, 2);
        }
        CanId::Extended(id) => {
            wire.put(id >> 18, 11);
            // SRR and IDE, both recessive.
            wire.put(0b11, 2);
            wire.put(id & 0x3_ffff, 18);
            wire.put(u32::from(frame.is_remote()), 1);
            // r1 and r0, both dominant.
            wire.put(0, 2);
        }
    }
    wire.put(u32::from(frame.len()), 4);
    for &byte in frame.data() {
        wire.put(u32::from(byte), 8);
    }
    wire.put_crc();
    wire.bits + TAIL
}

/// How long `frame` occupies a bus of `bit_rate` bit/s, the pause after it included.
pub fn frame_time(frame: &Frame, bit_rate: u32) -> Duration {
    bit_time(frame_bits(frame) + INTERMISSION, bit_rate)
}

/// How long `bits` take at `bit_rate` bit/s. At 0 bit/s nothing is ever sent, which no bus has: taken as 1.
pub fn bit_time(bits: u32, bit_rate: u32) -> Duration {
    Duration::from_nanos(u64::from(bits) * 1_000_000_000 / u64::from(bit_rate.max(1)))
}

/// What decides when two frames begin at the same moment: the bits of the arbitration field in wire order,
/// left-aligned, so that the smaller number wins.
pub fn priority(frame: &Frame) -> u32 {
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        // 11 bits, RTR, IDE = 0.
        CanId::Standard(id) => u32::from(id) << 21 | remote << 20,
        // 11 bits, SRR = 1, IDE = 1, 18 bits, RTR.
        CanId::Extended(id) => (id >> 18) << 21 | 0b11 << 19 | (id & 0x3_ffff) << 1 | remote,
    }
}

/// A frame on its way to the wire: counts bits and stuff bits, and carries the CRC along.
struct Wire {
    bits: u32,
    crc: u16,
    last: bool,
    /// How many equal bits the last one ends; 0 before the first bit.
    run: u8,
}

impl Wire {
    fn new() -> Wire {
        Wire { bits: 0, crc: 0, last: false, run: 0 }
    }

    /// The lowest `width` bits of `value`, the highest first.
    fn put(&mut self, value: u32, width: u32) {
        // Not a reversed range: in a build without optimization that takes most of the simulator's time.
        let mut position = width;
        while position > 0 {
            position -= 1;
            let bit = value >> position & 1 == 1;
            // CRC-15 of CAN: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1.
            let invert = bit ^ (self.crc & 0x4000 != 0);
            self.crc = self.crc << 1 & 0x7fff;
            if invert {
                self.crc ^= 0x4599;
            }
            self.stuff(bit);
        }
    }

    fn put_crc(&mut self) {
        let crc = self.crc;
        let mut position = 15;
        while position > 0 {
            position -= 1;
            self.stuff(crc >> position & 1 == 1);
        }
    }

    /// One bit; after five alike, a stuff bit of the other kind, which starts a run of its own.
    fn stuff(&mut self, bit: bool) {
        self.bits += 1;
        self.run = if self.last == bit { self.run + 1 } else { 1 };
        self.last = bit;
        if self.run == 5 {
            self.bits += 1;
            self.last = !bit;
            self.run = 1;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    fn crc(text: &str) -> u16 {
        let frame = frame(text);
        let mut wire = Wire::new();
        let CanId::Standard(id) = frame.id() else { panic!("11 bits") };
        wire.put(0, 1);
        wire.put(u32::from(id), 11);
        wire.put(u32::from(frame.is_remote()), 1);
        wire.put(0, 2);
        wire.put(u32::from(frame.len()), 4);
        frame.data().iter().for_each(|&byte| wire.put(u32::from(byte), 8));
        wire.crc
    }

    /// The CRC as polynomial division over a list of bits, to check the shift register against.
    fn divided(bits: &[u8]) -> u16 {
        let mut rest: Vec<u8> = bits.iter().copied().chain([0; 15]).collect();
        let divisor = [1, 1, 0, 0, 0, 1, 0, 1, 1, 0, 0, 1, 1, 0, 0, 1];
        for at in 0..bits.len() {
            if rest[at] == 1 {
                divisor.iter().enumerate().for_each(|(offset, bit)| rest[at + offset] ^= bit);
            }
        }
        rest[bits.len()..].iter().fold(0, |crc, &bit| crc << 1 | u16::from(bit))
    }

    #[test]
    fn crc_is_the_remainder_of_the_division() {
        // 080#: SOF, 000 1000 0000, RTR IDE r0, DLC 0000.
        let sync = [0, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0];
        assert_eq!(crc("080#"), divided(&sync));
        // 555#AA: SOF, 101 0101 0101, 000, 0001, 1010 1010.
        let other = [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 1, 0, 1, 0, 1, 0];
        assert_eq!(crc("555#AA"), divided(&other));
        assert_eq!(crc("000#"), 0);
    }

    #[test]
    fn counted_by_hand() {
        // 000# is 34 dominant bits (the CRC is 0 too). The first stuff bit stands after 5; being recessive it
        // breaks the run, and every further 5 dominant bits bring one more: 34 / 5 = 6. 34 + 6 + 10.
        assert_eq!(frame_bits(&frame("000#")), 50);
        // 080#: with the CRC 1C05h the bits are 0000 1 0000000000000000 111 0000000 101. The run of sixteen zeros
        // brings three stuff bits, the one of seven brings one: 34 + 4 + 10.
        assert_eq!(crc("080#"), 7173);
        assert_eq!(frame_bits(&frame("080#")), 48);
        assert_eq!(crc("701#00"), 20568);
        assert_eq!(frame_bits(&frame("701#00")), 56);
        assert_eq!(crc("581#8000000000000000"), 7932);
        assert_eq!(frame_bits(&frame("581#8000000000000000")), 124);
    }

    #[test]
    fn a_frame_without_stuff_bits_has_the_length_of_the_books() {
        // 47 + 8n for 11 bits with the pause: 111 for 8 bytes.
        let plain = frame("2AA#AAAAAAAAAAAAAAAA");
        let with_pause = frame_bits(&plain) + INTERMISSION;
        assert!((111..=135).contains(&with_pause), "{with_pause}");
        // 55h in the data has no run longer than 2; only header (r0, DLC) and CRC could have one.
        assert_eq!(frame_time(&plain, 250_000), Duration::from_micros(u64::from(with_pause) * 4));
    }

    #[test]
    fn a_remote_frame_carries_its_length_and_no_data() {
        assert!(frame_bits(&frame("701#R8")) < frame_bits(&frame("701#0000000000000000")));
        assert!(frame_bits(&frame("701#R1")) >= 44);
    }

    #[test]
    fn the_shortest_and_the_longest_of_many() {
        let (mut shortest, mut longest) = (u32::MAX, 0);
        for id in 0..0x800u16 {
            for fill in [0x00, 0xff, 0x55, 0x0f, 0x78, 0xe1, 0x3c, 0x87] {
                let bits = frame_bits(&Frame::full(CanId::Standard(id), [fill; 8])) + INTERMISSION;
                shortest = shortest.min(bits);
                longest = longest.max(bits);
            }
        }
        assert_eq!(shortest, 111);
        assert!((130..=135).contains(&longest), "{longest}");
    }

    #[test]
    fn arbitration_is_decided_as_on_the_wire() {
        let order = [
            "000#",
            "07F#R",
            "080#",
            "080#R",
            // The 29-bit frame with the same first 11 bits loses to both 11-bit frames, then its own order.
            "02000000#",
            "02000000#R",
            "02000001#",
            "081#",
            "7FF#R",
            "1FFFFFFF#",
        ];
        for pair in order.windows(2) {
            assert!(priority(&frame(pair[0])) < priority(&frame(pair[1])), "{pair:?}");
        }
    }

    proptest! {
        #[test]
        fn lengths_stay_within_the_bounds_of_the_standard(
            id in 0u32..0x2000_0000, extended: bool, remote: bool,
            data in proptest::collection::vec(any::<u8>(), 0..=8),
        ) {
            let id = if extended {
                CanId::Extended(id)
            } else {
                CanId::Standard(u16::try_from(id & 0x7ff).expect("11 bits"))
            };
            let len = u8::try_from(data.len()).expect("at most 8");
            let frame = if remote { Frame::remote(id, len) } else { Frame::new(id, &data) }.expect("at most 8");
            let stuffable = if extended { 54 } else { 34 } + if remote { 0 } else { 8 * u32::from(len) };
            let bits = frame_bits(&frame);
            prop_assert!(bits >= stuffable + TAIL);
            prop_assert!(bits <= stuffable + TAIL + (stuffable - 1) / 4);
        }
    }
}
