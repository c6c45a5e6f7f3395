//! Block transfer of the simulated SDO server (CiA 301, 7.2.4.3.9 to 7.2.4.3.16), with its own CRC.

use super::abort::Abort;

/// Segments per sub-block that this server requests.
const BLOCK_SIZE: u8 = 127;

/// The state of a block transfer in the server.
#[derive(Clone, Debug)]
pub(super) enum Block {
    /// Download: `taken` segments of this sub-block were received in order.
    Taking { value: Incoming, taken: u8 },
    /// Download: the last segment was received, but not the end request.
    Taken { value: Incoming, closing: [u8; 8] },
    /// Upload: the client has not sent the start request yet.
    Offered { value: Outgoing, block_size: u8 },
    /// Upload: a sub-block of `count` segments from byte `start` on was sent.
    Giving { value: Outgoing, start: usize, count: u8 },
    /// Upload: the end request was sent.
    Given,
}

/// A value that is received.
#[derive(Clone, Debug)]
pub(super) struct Incoming {
    pub(super) announced: Option<usize>,
    pub(super) bytes: Vec<u8>,
    pub(super) checked: bool,
}

/// A value that is sent.
#[derive(Clone, Debug)]
pub(super) struct Outgoing {
    pub(super) bytes: Vec<u8>,
    pub(super) checked: bool,
}

/// The result of a frame from the client.
pub(super) enum Step {
    /// The transfer continues with these answers.
    On(Block, Vec<[u8; 8]>),
    /// A value is complete; the answer is sent after the device has accepted it.
    Arrived(Vec<u8>, [u8; 8]),
    /// The client has received everything.
    Over,
    /// The frame is not allowed here; the transfer ends.
    Foreign,
}

/// The answer to a request for a download. A CRC is checked if the client sends one.
pub(super) fn accept(request: [u8; 8], announced: Option<usize>) -> (Block, [u8; 8]) {
    let checked = request[0] & 0b100 != 0;
    let answer = [0xa0 | u8::from(checked) << 2, request[1], request[2], request[3], BLOCK_SIZE, 0, 0, 0];
    (Block::Taking { value: Incoming { announced, bytes: Vec::new(), checked }, taken: 0 }, answer)
}

/// The answer to a request for an upload.
pub(super) fn offer(request: [u8; 8], bytes: Vec<u8>) -> Result<(Block, [u8; 8]), Abort> {
    let checked = request[0] & 0b100 != 0;
    let size = u32::try_from(bytes.len()).map_err(|_| Abort::MEMORY)?;
    let [a, b, c, d] = size.to_le_bytes();
    let answer = [0xc2 | u8::from(checked) << 2, request[1], request[2], request[3], a, b, c, d];
    let block = Block::Offered { value: Outgoing { bytes, checked }, block_size: block_size(request[4])? };
    Ok((block, answer))
}

fn block_size(byte: u8) -> Result<u8, Abort> {
    if (1..=127).contains(&byte) { Ok(byte) } else { Err(Abort::BLOCK_SIZE) }
}

impl Block {
    /// Handles a frame from the client, except an abort.
    pub(super) fn step(self, frame: [u8; 8], longest: usize) -> Result<Step, Abort> {
        match self {
            Block::Taking { value, taken } => take(value, taken, frame, longest),
            // The last segment was repeated. It can look like an end request.
            Block::Taken { value, closing } if frame == closing && frame != end(&value.bytes, 0, value.checked) => {
                Ok(Step::On(Block::Taken { value, closing }, Vec::new()))
            }
            Block::Taken { value, .. } if frame[0] & 0b1110_0001 == 0b1100_0001 => arrive(value, frame),
            Block::Offered { value, block_size } if frame[0] & 0b1110_0011 == 0b1010_0011 => {
                Ok(give(value, 0, block_size))
            }
            Block::Giving { value, start, count } if frame[0] & 0b1110_0011 == 0b1010_0010 => {
                let [_, taken, next_size, ..] = frame;
                if taken > count {
                    return Err(Abort::SEQUENCE);
                }
                let next = start + 7 * usize::from(taken);
                if taken == count && next >= value.bytes.len() {
                    let end = end(&value.bytes, next - value.bytes.len(), value.checked);
                    return Ok(Step::On(Block::Given, vec![end]));
                }
                Ok(give(value, next, block_size(next_size)?))
            }
            Block::Given if frame[0] & 0b1110_0011 == 0b1010_0001 => Ok(Step::Over),
            _ => Ok(Step::Foreign),
        }
    }
}

/// Handles a segment. Segments out of order are dropped; the answer follows at the end of the sub-block.
fn take(mut value: Incoming, mut taken: u8, frame: [u8; 8], longest: usize) -> Result<Step, Abort> {
    let sequence = frame[0] & 0x7f;
    let last = frame[0] & 0x80 != 0;
    let fits = sequence == taken + 1;
    if fits {
        taken = sequence;
        value.bytes.extend_from_slice(&frame[1..]);
        if value.bytes.len() > longest + 6 {
            return Err(Abort::MEMORY);
        }
    }
    if !last && sequence != BLOCK_SIZE {
        return Ok(Step::On(Block::Taking { value, taken }, Vec::new()));
    }
    let answers = vec![[0b1010_0010, taken, BLOCK_SIZE, 0, 0, 0, 0, 0]];
    let block = if last && fits { Block::Taken { value, closing: frame } } else { Block::Taking { value, taken: 0 } };
    Ok(Step::On(block, answers))
}

/// The end request of a value, in either direction; `unused` bytes of the last segment are not part of the value.
fn end(value: &[u8], unused: usize, checked: bool) -> [u8; 8] {
    let [low, high] = if checked { remainder(value).to_le_bytes() } else { [0, 0] };
    let [unused, ..] = unused.to_le_bytes();
    [0b1100_0001 | unused << 2, low, high, 0, 0, 0, 0, 0]
}

/// Handles the end request of a download.
fn arrive(mut value: Incoming, frame: [u8; 8]) -> Result<Step, Abort> {
    let unused = usize::from(frame[0] >> 2 & 0b111);
    value.bytes.truncate(value.bytes.len().saturating_sub(unused));
    if value.checked && remainder(&value.bytes).to_le_bytes() != [frame[1], frame[2]] {
        return Err(Abort::CRC);
    }
    if value.announced.is_some_and(|announced| announced != value.bytes.len()) {
        return Err(Abort::LENGTH);
    }
    Ok(Step::Arrived(value.bytes, [0b1010_0001, 0, 0, 0, 0, 0, 0, 0]))
}

/// The segments of a sub-block. An empty value is one segment without data.
fn give(value: Outgoing, start: usize, block_size: u8) -> Step {
    let mut frames = Vec::new();
    let mut count = 0;
    let mut rest = value.bytes.get(start..).unwrap_or_default();
    while count < block_size {
        let (part, behind) = rest.split_at(rest.len().min(7));
        rest = behind;
        count += 1;
        let mut frame = [0; 8];
        frame[0] = if rest.is_empty() { 0x80 | count } else { count };
        frame[1..=part.len()].copy_from_slice(part);
        frames.push(frame);
        if rest.is_empty() {
            break;
        }
    }
    Step::On(Block::Giving { value, start, count }, frames)
}

/// The remainder of the value, followed by 16 zero bits, divided by x^16 + x^12 + x^5 + 1.
fn remainder(value: &[u8]) -> u16 {
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
        assert_eq!(remainder(b"123456789"), 0x31c3);
    }
}
