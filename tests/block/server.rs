//! An SDO server for block transfers, written only from CiA 301, 7.2.4.3.9 to 7.2.4.3.16. It shares no code with the
//! client, so that a mistake in one of them is found.

use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};

/// The behaviour of the server.
#[derive(Clone, Debug)]
pub(crate) struct ServerBehaviour {
    pub(crate) crc: bool,
    pub(crate) announces: bool,
    /// The block sizes of a download, used in turn.
    pub(crate) block_sizes: Vec<u8>,
    /// Acknowledges as soon as a segment is missing, like CANopenNode, instead of at the end of the sub-block.
    pub(crate) hasty: bool,
}

#[derive(Clone, Debug, PartialEq)]
enum State {
    Idle,
    /// Receiving: the bytes so far, the segments of this sub-block, its size, whether the last one has arrived.
    Taking {
        bytes: Vec<u8>,
        size: Option<usize>,
        sequence: u8,
        block_size: u8,
        complete: bool,
    },
    /// Sending: the start of the sub-block and its number of segments.
    Offered {
        block_size: u8,
    },
    Giving {
        start: usize,
        count: u8,
    },
    GaveAll,
}

/// The server of one node with one object.
#[derive(Clone, Debug)]
pub(crate) struct Server {
    node: NodeId,
    pub(crate) object: Vec<u8>,
    behaviour: ServerBehaviour,
    multiplexer: [u8; 3],
    state: State,
    block_sizes_given: usize,
}

impl Server {
    pub(crate) fn new(node: NodeId, object: Vec<u8>, behaviour: ServerBehaviour) -> Server {
        Server { node, object, behaviour, multiplexer: [0; 3], state: State::Idle, block_sizes_given: 0 }
    }

    pub(crate) fn is_idle(&self) -> bool {
        self.state == State::Idle
    }

    fn frame(&self, bytes: [u8; 8]) -> Frame {
        Frame::full(CanId::sdo_response(self.node), bytes)
    }

    fn abort(&mut self, code: u32) -> Vec<Frame> {
        self.state = State::Idle;
        let [a, b, c] = self.multiplexer;
        let [d, e, f, g] = code.to_le_bytes();
        vec![self.frame([0x80, a, b, c, d, e, f, g])]
    }

    fn next_block_size(&mut self) -> u8 {
        let size = self.behaviour.block_sizes[self.block_sizes_given % self.behaviour.block_sizes.len()];
        self.block_sizes_given += 1;
        size
    }

    pub(crate) fn on_frame(&mut self, frame: &Frame) -> Vec<Frame> {
        let Some(bytes) = frame.as_eight_bytes().filter(|_| frame.id() == CanId::sdo_request(self.node)) else {
            return Vec::new();
        };
        if bytes[0] == 0x80 {
            self.state = State::Idle;
            return Vec::new();
        }
        match self.state.clone() {
            State::Taking { bytes: taken, size, sequence, block_size, complete: false } => {
                self.segment(bytes, taken, size, sequence, block_size)
            }
            State::Taking { bytes: taken, size, complete: true, .. } if bytes[0] & 0xe1 == 0xc1 => {
                self.end(bytes, taken, size)
            }
            // A repeated segment of a complete sub-block.
            State::Taking { complete: true, .. } if bytes[0] & 0x7f >= 1 && bytes[0] & 0x60 != 0x40 => Vec::new(),
            State::Offered { block_size } if bytes[0] == 0xa3 => self.send_block(0, block_size),
            State::Giving { start, count } if bytes[0] & 0xe3 == 0xa2 => {
                let (taken, block_size) = (bytes[1], bytes[2]);
                if taken > count {
                    return self.abort(0x0504_0003);
                }
                let next = start + 7 * usize::from(taken);
                if taken == count && next >= self.object.len() {
                    self.state = State::GaveAll;
                    let unused = u8::try_from(next - self.object.len()).unwrap();
                    let [low, high] = if self.behaviour.crc { check_sum(&self.object).to_le_bytes() } else { [0, 0] };
                    return vec![self.frame([0xc1 | unused << 2, low, high, 0, 0, 0, 0, 0])];
                }
                if !(1..=127).contains(&block_size) {
                    return self.abort(0x0504_0002);
                }
                self.send_block(next, block_size)
            }
            State::GaveAll if bytes[0] & 0xe3 == 0xa1 => {
                self.state = State::Idle;
                Vec::new()
            }
            _ => self.initiate(bytes),
        }
    }

    fn initiate(&mut self, bytes: [u8; 8]) -> Vec<Frame> {
        let [a, b, c] = [bytes[1], bytes[2], bytes[3]];
        self.multiplexer = [a, b, c];
        let crc = u8::from(self.behaviour.crc) << 2;
        match bytes[0] & 0xe3 {
            // Bit 1 is reserved in an upload request, and the size bit in a download request.
            0xa0 => {
                if !(1..=127).contains(&bytes[4]) {
                    return self.abort(0x0504_0002);
                }
                self.state = State::Offered { block_size: bytes[4] };
                let size = u32::try_from(self.object.len()).unwrap();
                let [d, e, f, g] = if self.behaviour.announces { size.to_le_bytes() } else { [0; 4] };
                vec![self.frame([0xc0 | crc | u8::from(self.behaviour.announces) << 1, a, b, c, d, e, f, g])]
            }
            0xc0 | 0xc2 => {
                let size = u32::from_le_bytes([bytes[4], bytes[5], bytes[6], bytes[7]]);
                let size = (bytes[0] & 2 != 0).then(|| usize::try_from(size).unwrap());
                let block_size = self.next_block_size();
                self.state = State::Taking { bytes: Vec::new(), size, sequence: 0, block_size, complete: false };
                vec![self.frame([0xa0 | crc, a, b, c, block_size, 0, 0, 0])]
            }
            _ => self.abort(0x0504_0001),
        }
    }

    fn segment(
        &mut self,
        frame: [u8; 8],
        mut bytes: Vec<u8>,
        size: Option<usize>,
        mut sequence: u8,
        mut block_size: u8,
    ) -> Vec<Frame> {
        let number = frame[0] & 0x7f;
        let fits = number == sequence + 1;
        let mut complete = false;
        if fits {
            sequence = number;
            bytes.extend_from_slice(&frame[1..]);
            complete = frame[0] & 0x80 != 0;
        }
        let over = number == block_size || frame[0] & 0x80 != 0 || self.behaviour.hasty && number > sequence;
        let mut answer = Vec::new();
        if over {
            block_size = self.next_block_size();
            answer.push(self.frame([0xa2, sequence, block_size, 0, 0, 0, 0, 0]));
            sequence = 0;
        }
        self.state = State::Taking { bytes, size, sequence, block_size, complete };
        answer
    }

    fn end(&mut self, frame: [u8; 8], mut bytes: Vec<u8>, size: Option<usize>) -> Vec<Frame> {
        let unused = usize::from(frame[0] >> 2 & 7);
        bytes.truncate(bytes.len() - unused);
        if size.is_some_and(|size| size != bytes.len()) {
            return self.abort(0x0607_0010);
        }
        if self.behaviour.crc && check_sum(&bytes).to_le_bytes() != [frame[1], frame[2]] {
            return self.abort(0x0504_0004);
        }
        self.object = bytes;
        self.state = State::Idle;
        vec![self.frame([0xa1, 0, 0, 0, 0, 0, 0, 0])]
    }

    fn send_block(&mut self, start: usize, block_size: u8) -> Vec<Frame> {
        let mut parts: Vec<Vec<u8>> = self.object[start..].chunks(7).map(<[u8]>::to_vec).collect();
        if parts.is_empty() {
            parts.push(Vec::new());
        }
        let all = parts.len();
        parts.truncate(usize::from(block_size));
        let count = u8::try_from(parts.len()).unwrap();
        self.state = State::Giving { start, count };
        (1..=count)
            .zip(parts)
            .map(|(number, part)| {
                let mut frame = [0u8; 8];
                frame[0] = if usize::from(number) == all { 0x80 | number } else { number };
                frame[1..=part.len()].copy_from_slice(&part);
                self.frame(frame)
            })
            .collect()
    }
}

/// The CRC by long division, bit by bit: the 16 bits after the data are the remainder.
fn check_sum(data: &[u8]) -> u16 {
    let mut remainder: u32 = 0;
    for byte in data.iter().chain(&[0, 0]) {
        for bit in (0..8).rev() {
            remainder = remainder << 1 | u32::from(byte >> bit & 1);
            if remainder & 0x1_0000 != 0 {
                remainder ^= 0x1_1021;
            }
        }
    }
    u16::try_from(remainder).unwrap()
}

#[test]
fn the_check_sum_is_the_standards() {
    assert_eq!(check_sum(b"123456789"), 0x31c3);
}
