//! The length of a frame on the bus in bits (ISO 11898-1, 10.4 to 10.6): header, data, CRC, stuff bits, end of frame,
//! and the intermission after it.

use super::frame::Frame;
use super::id::CanId;
use std::time::Duration;

/// Bits after the CRC, without stuff bits: CRC delimiter, acknowledge slot and delimiter, seven bits end of frame.
const TAIL_BITS: u32 = 10;

/// The intermission between two frames, in bits.
pub const INTERMISSION: u32 = 3;

/// Returns the length of `frame` in bits, with stuff bits, without the intermission.
pub fn frame_bits(frame: &Frame) -> u32 {
    let mut bits = header_and_data(frame);
    bits.push(u32::from(bits.crc()), 15);
    bits.length + bits.stuff_bits() + TAIL_BITS
}

/// Returns the bits that the CRC covers: from the start of frame to the data.
fn header_and_data(frame: &Frame) -> Bits {
    let mut bits = Bits { value: 0, length: 0 };
    bits.push(0, 1);
    match frame.id() {
        CanId::Standard(id) => {
            bits.push(u32::from(id), 11);
            bits.push(u32::from(frame.is_remote()), 1);
            // IDE and r0, both dominant.
            bits.push(0, 2);
        }
        CanId::Extended(id) => {
            bits.push(id >> 18, 11);
            // SRR and IDE, both recessive.
            bits.push(0b11, 2);
            bits.push(id & 0x3_ffff, 18);
            bits.push(u32::from(frame.is_remote()), 1);
            // r1 and r0, both dominant.
            bits.push(0, 2);
        }
    }
    bits.push(u32::from(frame.len()), 4);
    for &byte in frame.data() {
        bits.push(u32::from(byte), 8);
    }
    bits
}

/// Returns the time that `frame` and its intermission take at `bit_rate` bit/s.
pub fn frame_time(frame: &Frame, bit_rate: u32) -> Duration {
    bit_time(frame_bits(frame) + INTERMISSION, bit_rate)
}

/// Returns the duration of `bits` at `bit_rate` bit/s. A bit rate of 0 counts as 1 bit/s.
pub fn bit_time(bits: u32, bit_rate: u32) -> Duration {
    Duration::from_nanos(u64::from(bits) * 1_000_000_000 / u64::from(bit_rate.max(1)))
}

/// Returns the arbitration field in wire order, left-aligned. If two frames start together, the smaller number wins.
pub fn priority(frame: &Frame) -> u32 {
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        // 11 bits, RTR, IDE = 0.
        CanId::Standard(id) => u32::from(id) << 21 | remote << 20,
        // 11 bits, SRR = 1, IDE = 1, 18 bits, RTR.
        CanId::Extended(id) => (id >> 18) << 21 | 0b11 << 19 | (id & 0x3_ffff) << 1 | remote,
    }
}

/// The bits of a frame before stuffing, the first bit highest. The longest frame has 118 bits up to its CRC.
struct Bits {
    value: u128,
    length: u32,
}

impl Bits {
    /// Adds the lowest `width` bits of `value`, highest bit first. The other bits of `value` are 0.
    fn push(&mut self, value: u32, width: u32) {
        self.value = self.value << width | u128::from(value);
        self.length += width;
    }

    /// Returns the CRC-15. Zeros before the first bit do not change it.
    fn crc(&self) -> u16 {
        let (mut crc, mut left) = (0, self.length.next_multiple_of(8));
        while left > 0 {
            left -= 8;
            let byte = (self.value >> left & 0xff) as usize;
            crc = crc << 8 & 0x7fff ^ CRC_TABLE[usize::from(crc >> 7) ^ byte];
        }
        crc
    }

    /// Counts the stuff bits: one of the opposite value after five equal bits. The stuff bit is the first bit of the
    /// next run.
    fn stuff_bits(&self) -> u32 {
        let mut rest = self.value << (u128::BITS - self.length);
        let (mut left, mut count, mut stuffed) = (self.length, 0, 0);
        while left > 0 {
            // Only the lengths of the runs matter: the first run always consists of zeros.
            if rest >> 127 == 1 {
                rest = !rest;
            }
            let zeros = rest.leading_zeros();
            let run = if zeros < left { zeros } else { left };
            left -= run;
            rest <<= run;
            count += (stuffed + run) / 5;
            stuffed = u32::from((stuffed + run) % 5 == 0);
        }
        count
    }
}

/// CRC-15 of CAN: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, without x^15.
const CRC_POLYNOMIAL: u16 = 0x4599;

/// The CRC of each byte.
const CRC_TABLE: [u16; 256] = {
    let mut table = [0; 256];
    let mut byte = 0u16;
    while byte < 256 {
        let mut crc = byte << 7;
        let mut bit = 0;
        while bit < 8 {
            crc = if crc & 0x4000 == 0 { crc << 1 } else { crc << 1 & 0x7fff ^ CRC_POLYNOMIAL };
            bit += 1;
        }
        table[byte as usize] = crc;
        byte += 1;
    }
    table
};

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    fn crc(text: &str) -> u16 {
        header_and_data(&frame(text)).crc()
    }

    /// Computes the CRC by polynomial division of a list of bits, as a reference for the table.
    fn remainder(bits: &[u8]) -> u16 {
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
        assert_eq!(crc("080#"), remainder(&sync));
        // 555#AA: SOF, 101 0101 0101, 000, 0001, 1010 1010.
        let other = [0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 1, 0, 0, 0, 0, 0, 0, 1, 1, 0, 1, 0, 1, 0, 1, 0];
        assert_eq!(crc("555#AA"), remainder(&other));
        assert_eq!(crc("000#"), 0);
    }

    #[test]
    fn lengths_match_a_count_by_hand() {
        // 000# has 34 dominant bits; the CRC is 0 too. A recessive stuff bit follows each 5 of them: 34 / 5 = 6.
        // Sum: 34 + 6 + 10.
        assert_eq!(frame_bits(&frame("000#")), 50);
        // 080#: with the CRC 1C05h the bits are 0000 1 0000000000000000 111 0000000 101. The run of sixteen zeros
        // needs three stuff bits, the run of seven needs one. Sum: 34 + 4 + 10.
        assert_eq!(crc("080#"), 7173);
        assert_eq!(frame_bits(&frame("080#")), 48);
        assert_eq!(crc("701#00"), 20568);
        assert_eq!(frame_bits(&frame("701#00")), 56);
        assert_eq!(crc("581#8000000000000000"), 7932);
        assert_eq!(frame_bits(&frame("581#8000000000000000")), 124);
    }

    #[test]
    fn extended_frames_match_a_separate_program() {
        for (text, length, checksum) in [
            ("00000000#", 71, 17936),
            ("18DAF110#0102", 83, 13860),
            ("00000601#4000100000000000", 144, 12526),
            ("1FFFFFFF#R8", 71, 6986),
        ] {
            assert_eq!((frame_bits(&frame(text)), crc(text)), (length, checksum), "{text}");
        }
    }

    #[test]
    fn eight_data_bytes_take_111_to_135_bits() {
        // An 11-bit frame with intermission has 47 + 8n bits: 111 for 8 bytes.
        let plain = frame("2AA#AAAAAAAAAAAAAAAA");
        let with_intermission = frame_bits(&plain) + INTERMISSION;
        assert!((111..=135).contains(&with_intermission), "{with_intermission}");
        // Data bytes AAh have no stuff bits; only the header (r0, DLC) and the CRC can have some.
        assert_eq!(frame_time(&plain, 250_000), Duration::from_micros(u64::from(with_intermission) * 4));
    }

    #[test]
    fn a_remote_frame_has_a_length_code_and_no_data() {
        assert!(frame_bits(&frame("701#R8")) < frame_bits(&frame("701#0000000000000000")));
        assert!(frame_bits(&frame("701#R1")) >= 44);
    }

    #[test]
    fn shortest_and_longest_frames_match_the_standard() {
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
    fn priority_orders_frames_as_arbitration_does() {
        let order = [
            "000#",
            "07F#R",
            "080#",
            "080#R",
            // A 29-bit frame with the same first 11 bits loses against both 11-bit frames.
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

    /// Counts the bits of a frame and its stuff bits one by one.
    fn counted_bits(frame: &Frame) -> u32 {
        let bits = header_and_data(frame);
        let mut wire: Vec<u8> = (0..bits.length).rev().map(|at| u8::from(bits.value >> at & 1 == 1)).collect();
        let crc = remainder(&wire);
        wire.extend((0..15).rev().map(|at| u8::from(crc >> at & 1 == 1)));
        let mut sent: Vec<u8> = Vec::new();
        let mut run = 0;
        for bit in wire {
            run = if sent.last() == Some(&bit) { run + 1 } else { 1 };
            sent.push(bit);
            if run == 5 {
                sent.push(1 - bit);
                run = 1;
            }
        }
        u32::try_from(sent.len()).expect("a small number") + TAIL_BITS
    }

    fn any_frame() -> impl Strategy<Value = Frame> {
        // Bytes of equal bits cause most stuff bits.
        let byte = prop_oneof![Just(0x00), Just(0xff), any::<u8>()];
        let data = proptest::collection::vec(byte, 0..=8);
        (0u32..0x2000_0000, any::<bool>(), any::<bool>(), data).prop_map(|(id, extended, remote, data)| {
            let id = if extended {
                CanId::Extended(id)
            } else {
                CanId::Standard(u16::try_from(id & 0x7ff).expect("11 bits"))
            };
            let len = u8::try_from(data.len()).expect("at most 8");
            if remote { Frame::remote(id, len) } else { Frame::new(id, &data) }.expect("at most 8")
        })
    }

    proptest! {
        #[test]
        fn lengths_stay_within_the_limits_of_the_standard(frame in any_frame()) {
            let header = if matches!(frame.id(), CanId::Extended(_)) { 39 } else { 19 };
            let data = if frame.is_remote() { 0 } else { 8 * u32::from(frame.len()) };
            let stuffable = header + data + 15;
            let bits = frame_bits(&frame);
            prop_assert!(bits >= stuffable + TAIL_BITS);
            prop_assert!(bits <= stuffable + TAIL_BITS + (stuffable - 1) / 4);
        }

        #[test]
        fn length_is_that_of_a_count_bit_by_bit(frame in any_frame()) {
            prop_assert_eq!(frame_bits(&frame), counted_bits(&frame));
        }
    }
}
