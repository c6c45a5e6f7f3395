//! Block transfer of the simulated SDO server (CiA 301, 7.2.4.3.9 to 7.2.4.3.16), with its own CRC.

use super::abort::Abort;

/// Segments per sub-block that this server requests.
const BLOCK_SIZE: u8 = 127;

/// The state of a block transfer in the server.
#[derive(Clone, Debug)]
pub(super) enum Block {
    /// Download: `received` segments of this sub-block were received in order.
    Receiving { value: Incoming, received: u8 },
    /// Download: the last segment was received, but not the end request.
    AwaitingEnd { value: Incoming, closing: [u8; 8] },
    /// Upload: the client has not sent the start request yet.
    AwaitingStart { value: Outgoing, block_size: u8 },
    /// Upload: a sub-block of `count` segments from byte `start` on was sent.
    Sending { value: Outgoing, start: usize, count: u8 },
    /// Upload: the end request was sent.
    EndSent,
}

/// A value that is received.
#[derive(Clone, Debug)]
pub(super) struct Incoming {
    pub(super) announced: Option<usize>,
    pub(super) bytes: Vec<u8>,
    pub(super) has_crc: bool,
}

/// A value that is sent.
#[derive(Clone, Debug)]
pub(super) struct Outgoing {
    pub(super) bytes: Vec<u8>,
    pub(super) has_crc: bool,
}

/// The result of a frame from the client.
pub(super) enum Step {
    /// The transfer continues with these answers.
    Continue(Block, Vec<[u8; 8]>),
    /// A value is complete; the answer is sent after the device has accepted it.
    Complete(Vec<u8>, [u8; 8]),
    /// The client has received everything.
    Finished,
    /// The frame is not allowed here; the transfer ends.
    Invalid,
}

/// Accepts a request for a download. A CRC is checked if the client sends one.
pub(super) fn accept(request: [u8; 8], announced: Option<usize>) -> (Block, [u8; 8]) {
    let has_crc = request[0] & 0b100 != 0;
    let answer = [0xa0 | u8::from(has_crc) << 2, request[1], request[2], request[3], BLOCK_SIZE, 0, 0, 0];
    (Block::Receiving { value: Incoming { announced, bytes: Vec::new(), has_crc }, received: 0 }, answer)
}

/// Accepts a request for an upload.
pub(super) fn offer(request: [u8; 8], bytes: Vec<u8>) -> Result<(Block, [u8; 8]), Abort> {
    let has_crc = request[0] & 0b100 != 0;
    let size = u32::try_from(bytes.len()).map_err(|_| Abort::MEMORY)?;
    let [a, b, c, d] = size.to_le_bytes();
    let answer = [0xc2 | u8::from(has_crc) << 2, request[1], request[2], request[3], a, b, c, d];
    let block = Block::AwaitingStart { value: Outgoing { bytes, has_crc }, block_size: block_size(request[4])? };
    Ok((block, answer))
}

fn block_size(byte: u8) -> Result<u8, Abort> {
    if (1..=127).contains(&byte) { Ok(byte) } else { Err(Abort::BLOCK_SIZE) }
}

impl Block {
    /// Handles a frame from the client, except an abort.
    pub(super) fn step(self, frame: [u8; 8], longest: usize) -> Result<Step, Abort> {
        match self {
            Block::Receiving { value, received } => on_segment(value, received, frame, longest),
            // The last segment was repeated. It can look like an end request.
            Block::AwaitingEnd { value, closing }
                if frame == closing && frame != end(&value.bytes, 0, value.has_crc) =>
            {
                Ok(Step::Continue(Block::AwaitingEnd { value, closing }, Vec::new()))
            }
            Block::AwaitingEnd { value, .. } if frame[0] & 0b1110_0001 == 0b1100_0001 => on_end_request(value, frame),
            Block::AwaitingStart { value, block_size } if frame[0] & 0b1110_0011 == 0b1010_0011 => {
                Ok(send_block(value, 0, block_size))
            }
            Block::Sending { value, start, count } if frame[0] & 0b1110_0011 == 0b1010_0010 => {
                let [_, received, next_size, ..] = frame;
                if received > count {
                    return Err(Abort::SEQUENCE);
                }
                let next = start + 7 * usize::from(received);
                if received == count && next >= value.bytes.len() {
                    let end = end(&value.bytes, next - value.bytes.len(), value.has_crc);
                    return Ok(Step::Continue(Block::EndSent, vec![end]));
                }
                Ok(send_block(value, next, block_size(next_size)?))
            }
            Block::EndSent if frame[0] & 0b1110_0011 == 0b1010_0001 => Ok(Step::Finished),
            _ => Ok(Step::Invalid),
        }
    }
}

/// Handles a segment. Segments out of order are dropped; the answer follows at the end of the sub-block.
fn on_segment(mut value: Incoming, mut received: u8, frame: [u8; 8], longest: usize) -> Result<Step, Abort> {
    let sequence = frame[0] & 0x7f;
    let last = frame[0] & 0x80 != 0;
    let fits = sequence == received + 1;
    if fits {
        received = sequence;
        value.bytes.extend_from_slice(&frame[1..]);
        if value.bytes.len() > longest + 6 {
            return Err(Abort::MEMORY);
        }
    }
    if !last && sequence != BLOCK_SIZE {
        return Ok(Step::Continue(Block::Receiving { value, received }, Vec::new()));
    }
    let answers = vec![[0b1010_0010, received, BLOCK_SIZE, 0, 0, 0, 0, 0]];
    let block = if last && fits {
        Block::AwaitingEnd { value, closing: frame }
    } else {
        Block::Receiving { value, received: 0 }
    };
    Ok(Step::Continue(block, answers))
}

/// Creates the end request of a value, in either direction. `unused` bytes of the last segment are not part of the
/// value.
fn end(value: &[u8], unused: usize, has_crc: bool) -> [u8; 8] {
    let [low, high] = if has_crc { crc(value).to_le_bytes() } else { [0, 0] };
    let [unused, ..] = unused.to_le_bytes();
    [0b1100_0001 | unused << 2, low, high, 0, 0, 0, 0, 0]
}

/// Handles the end request of a download.
fn on_end_request(mut value: Incoming, frame: [u8; 8]) -> Result<Step, Abort> {
    let unused = usize::from(frame[0] >> 2 & 0b111);
    value.bytes.truncate(value.bytes.len().saturating_sub(unused));
    if value.has_crc && crc(&value.bytes).to_le_bytes() != [frame[1], frame[2]] {
        return Err(Abort::CRC);
    }
    if value.announced.is_some_and(|announced| announced != value.bytes.len()) {
        return Err(Abort::LENGTH);
    }
    Ok(Step::Complete(value.bytes, [0b1010_0001, 0, 0, 0, 0, 0, 0, 0]))
}

/// Returns the segments of the next sub-block. An empty value is one segment without data.
fn send_block(value: Outgoing, start: usize, block_size: u8) -> Step {
    let mut frames = Vec::new();
    let mut count = 0;
    let mut rest = value.bytes.get(start..).unwrap_or_default();
    while count < block_size {
        let (part, remaining) = rest.split_at(rest.len().min(7));
        rest = remaining;
        count += 1;
        let mut frame = [0; 8];
        frame[0] = if rest.is_empty() { 0x80 | count } else { count };
        frame[1..=part.len()].copy_from_slice(part);
        frames.push(frame);
        if rest.is_empty() {
            break;
        }
    }
    Step::Continue(Block::Sending { value, start, count }, frames)
}

/// Computes the CRC: the remainder of the value, followed by 16 zero bits, divided by x^16 + x^12 + x^5 + 1.
fn crc(value: &[u8]) -> u16 {
    let mut register = 0u16;
    for byte in value {
        register ^= u16::from(*byte) << 8;
        for _ in 0..8 {
            let carry = register >> 15;
            register = (register << 1) ^ (carry * 0b0001_0000_0010_0001);
        }
    }
    register
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn crc_of_the_standards_example() {
        assert_eq!(crc(b"123456789"), 0x31c3);
    }
}
