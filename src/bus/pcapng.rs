//! Formats frames as a capture file for Wireshark (pcapng, link type SocketCAN).

use super::Wall;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;

/// The link type of SocketCAN frames.
const LINKTYPE_CAN_SOCKETCAN: u16 = 227;

/// The block types.
const SECTION_HEADER: u32 = 0x0a0d_0d0a;
const INTERFACE_DESCRIPTION: u32 = 1;
const ENHANCED_PACKET: u32 = 6;

/// Options of an interface block: the name, and the time resolution as a negative power of ten.
const IF_NAME: u16 = 2;
const IF_TSRESOL: u16 = 9;

/// The option of a packet block that contains the direction.
const EPB_FLAGS: u16 = 2;

/// The flags that SocketCAN adds to an identifier.
const EXTENDED: u32 = 0x8000_0000;
const REMOTE: u32 = 0x4000_0000;

/// Returns the blocks at the start of a file with the frames of one interface.
pub(super) fn header(interface: &str) -> Vec<u8> {
    let mut section = 0x1a2b_3c4d_u32.to_le_bytes().to_vec();
    // Version 1.0; the length of the section is unknown.
    section.extend([1, 0, 0, 0]);
    section.extend([0xff; 8]);
    let mut description = LINKTYPE_CAN_SOCKETCAN.to_le_bytes().to_vec();
    description.extend([0; 6]);
    let name = &interface.as_bytes()[..interface.len().min(usize::from(u8::MAX))];
    description.extend(option(IF_NAME, name));
    description.extend(option(IF_TSRESOL, &[9]));
    description.extend(option(0, &[]));
    [block(SECTION_HEADER, &section), block(INTERFACE_DESCRIPTION, &description)].concat()
}

/// Returns the block of a frame. `is_sent`: this program sent the frame.
pub(super) fn packet(wall: Wall, frame: &Frame, is_sent: bool) -> Vec<u8> {
    let flags = if let CanId::Extended(_) = frame.id() { EXTENDED } else { 0 };
    let flags = if frame.is_remote() { flags | REMOTE } else { flags };
    let mut data = (frame.id().number() | flags).to_be_bytes().to_vec();
    data.extend([frame.len(), 0, 0, 0]);
    data.extend(frame.data());
    let time = u64::try_from(wall.since_epoch().as_nanos()).unwrap_or(u64::MAX);
    let [high, low] = [time >> 32, time & 0xffff_ffff].map(|half| u32::try_from(half).unwrap_or_default());
    let length = u32::try_from(data.len()).unwrap_or_default();
    let mut packet: Vec<u8> = [0, high, low, length, length].into_iter().flat_map(u32::to_le_bytes).collect();
    packet.extend(padded(&data));
    packet.extend(option(EPB_FLAGS, &[if is_sent { 2 } else { 1 }, 0, 0, 0]));
    packet.extend(option(0, &[]));
    block(ENHANCED_PACKET, &packet)
}

fn block(kind: u32, body: &[u8]) -> Vec<u8> {
    let length = u32::try_from(body.len() + 12).unwrap_or_default().to_le_bytes();
    [&kind.to_le_bytes()[..], &length, body, &length].concat()
}

fn option(code: u16, value: &[u8]) -> Vec<u8> {
    let length = u16::try_from(value.len()).unwrap_or_default();
    [&code.to_le_bytes()[..], &length.to_le_bytes(), &padded(value)].concat()
}

/// Pads to a multiple of four bytes.
fn padded(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    bytes.resize(bytes.len().next_multiple_of(4), 0);
    bytes
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    #[test]
    fn file_of_one_interface() {
        let expected: Vec<u8> = [
            &b"\x0a\x0d\x0d\x0a\x1c\0\0\0\x4d\x3c\x2b\x1a\x01\0\0\0\xff\xff\xff\xff\xff\xff\xff\xff\x1c\0\0\0"[..],
            b"\x01\0\0\0\x28\0\0\0\xe3\0\0\0\0\0\0\0",
            b"\x02\0\x04\0can0\x09\0\x01\0\x09\0\0\0\0\0\0\0\x28\0\0\0",
        ]
        .concat();
        assert_eq!(header("can0"), expected);
    }

    #[test]
    fn frames_of_all_kinds() {
        let wall = Wall::at(Duration::new(1_700_000_000, 1_000));
        let body = |text: &str, is_sent| packet(wall, &text.parse().expect("a frame"), is_sent);
        let expected: Vec<u8> = [
            &b"\x06\0\0\0\x38\0\0\0\0\0\0\0"[..],
            &(0x1797_9cfe_u32).to_le_bytes(),
            &(0x362a_03e8_u32).to_le_bytes(),
            b"\x0a\0\0\0\x0a\0\0\0\0\0\x01\x81\x02\0\0\0\xd2\x04\0\0\x02\0\x04\0\x01\0\0\0\0\0\0\0\x38\0\0\0",
        ]
        .concat();
        assert_eq!(body("181#D204", false), expected);
        let start = |text: &str, is_sent| body(text, is_sent)[28..].to_vec();
        assert_eq!(start("01890ABC#", true)[..16], *b"\x81\x89\x0a\xbc\0\0\0\0\x02\0\x04\0\x02\0\0\0");
        assert_eq!(start("705#R1", false)[..16], *b"\x40\0\x07\x05\x01\0\0\0\x02\0\x04\0\x01\0\0\0");
    }
}
