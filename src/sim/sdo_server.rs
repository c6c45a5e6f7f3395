//! The SDO server of a simulated device (CiA 301, 7.2.4): expedited, segmented and (depending on the description) block
//! transfers, one at a time.

use super::abort::Abort;
use super::sdo_block::{self, Block, Step};
use crate::bus::time::Mono;
use crate::canopen::object::ObjectId;
use crate::device::description::{SdoStyle, SizeIndication};
use std::time::Duration;

/// Time limit for the next segment from the client.
const SEGMENT_TIMEOUT: Duration = Duration::from_secs(1);

/// The longest value that can be written.
const MAX_LENGTH: usize = 1 << 20;

/// The command specifiers of answers to expedited uploads, by the number of bytes.
const UPLOAD_COMMANDS: [u8; 5] = [0x43, 0x4f, 0x4b, 0x47, 0x43];

/// The objects that the server reads and writes.
pub(super) trait Dictionary {
    /// Reads the value of an entry in wire order.
    fn upload(&mut self, object: ObjectId) -> Result<Vec<u8>, Abort>;

    /// Returns the width of a writable entry in bytes; `None` if its type has no fixed width.
    fn width(&self, object: ObjectId) -> Result<Option<usize>, Abort>;

    /// Writes a value.
    fn download(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Abort>;
}

/// The server with its present transfer.
#[derive(Clone, Debug)]
pub(super) struct SdoServer {
    style: SdoStyle,
    answers_60: bool,
    transfer: Transfer,
}

#[derive(Clone, Debug)]
enum Transfer {
    None,
    /// The client reads segments.
    Upload {
        object: ObjectId,
        bytes: Vec<u8>,
        sent: usize,
        toggle: bool,
        until: Mono,
    },
    /// The client writes segments.
    Download {
        object: ObjectId,
        announced: Option<usize>,
        bytes: Vec<u8>,
        toggle: bool,
        until: Mono,
    },
    /// A block transfer in either direction.
    Block {
        object: ObjectId,
        block: Block,
        until: Mono,
    },
}

impl SdoServer {
    /// `answers_60`: whether the device has [`Quirk::UploadAnswered60`](crate::device::quirk::Quirk).
    pub(super) fn new(style: SdoStyle, answers_60: bool) -> SdoServer {
        SdoServer { style, answers_60, transfer: Transfer::None }
    }

    /// Drops the transfer, as at a reset and in STOPPED.
    pub(super) fn forget(&mut self) {
        self.transfer = Transfer::None;
    }

    /// The time limit of the present transfer.
    pub(super) fn deadline(&self) -> Option<Mono> {
        match &self.transfer {
            Transfer::None => None,
            Transfer::Upload { until, .. } | Transfer::Download { until, .. } | Transfer::Block { until, .. } => {
                Some(*until)
            }
        }
    }

    /// Ends a transfer whose time limit has passed; returns the abort to send.
    pub(super) fn give_up(&mut self) -> Option<[u8; 8]> {
        let object = self.object()?;
        self.transfer = Transfer::None;
        Some(abort(object, Abort::TIMEOUT))
    }

    fn object(&self) -> Option<ObjectId> {
        match &self.transfer {
            Transfer::None => None,
            Transfer::Upload { object, .. } | Transfer::Download { object, .. } | Transfer::Block { object, .. } => {
                Some(*object)
            }
        }
    }

    /// Records that a frame of this server was sent. The time limit for the client starts with the last frame.
    pub(super) fn sent(&mut self, now: Mono) {
        if let Transfer::Block { until, .. } = &mut self.transfer {
            *until = now + SEGMENT_TIMEOUT;
        }
    }

    /// Whether a sub-block is being sent. Any frame from the client cancels the rest of it.
    pub(super) fn is_sending_block(&self) -> bool {
        matches!(self.transfer, Transfer::Block { block: Block::Sending { .. }, .. })
    }

    /// Handles a request and returns the answers.
    pub(super) fn request(&mut self, now: Mono, request: [u8; 8], memory: &mut dyn Dictionary) -> Vec<[u8; 8]> {
        let [command, low, high, sub, ..] = request;
        let addressed = ObjectId { index: u16::from(high) << 8 | u16::from(low), sub };
        // Segments contain no address, so an abort contains the object of the transfer, or 0000h.
        let in_transfer = self.object().unwrap_or(ObjectId::new(0, 0));
        // In a block transfer, a segment can look like any other request.
        if command != 0x80 && matches!(self.transfer, Transfer::Block { .. }) {
            match self.block(now, request, memory) {
                Ok(Some(answers)) => return answers,
                Ok(None) => {}
                Err(code) => return vec![abort(in_transfer, code.of_list(&self.style.aborts))],
            }
        }
        let (answer, object) = match command >> 5 {
            0 => (self.download_segment(now, request, memory), in_transfer),
            1 => (self.download(now, request, addressed, memory), addressed),
            2 => (self.upload(now, addressed, memory), addressed),
            3 => (self.upload_segment(now, command), in_transfer),
            4 => {
                self.transfer = Transfer::None;
                return Vec::new();
            }
            5 if self.style.block && command & 0b11 == 0 => {
                (self.upload_block(now, request, addressed, memory), addressed)
            }
            6 if self.style.block && command & 0b1 == 0 => {
                (self.download_block(now, request, addressed, memory), addressed)
            }
            _ => (Err(Abort::COMMAND), addressed),
        };
        match answer {
            Ok(answer) => vec![answer],
            Err(code) => {
                self.transfer = Transfer::None;
                vec![abort(object, code.of_list(&self.style.aborts))]
            }
        }
    }

    /// Handles a frame in a block transfer; `None` if it is not allowed there.
    fn block(&mut self, now: Mono, frame: [u8; 8], memory: &mut dyn Dictionary) -> Result<Option<Vec<[u8; 8]>>, Abort> {
        let Transfer::Block { object, block, .. } = std::mem::replace(&mut self.transfer, Transfer::None) else {
            return Ok(None);
        };
        Ok(match block.step(frame, MAX_LENGTH)? {
            Step::Continue(block, answers) => {
                self.transfer = Transfer::Block { object, block, until: now + SEGMENT_TIMEOUT };
                Some(answers)
            }
            Step::Complete(bytes, answer) => {
                memory.download(object, &bytes)?;
                Some(vec![answer])
            }
            Step::Finished => Some(Vec::new()),
            Step::Invalid => None,
        })
    }

    fn upload_block(
        &mut self,
        now: Mono,
        request: [u8; 8],
        object: ObjectId,
        memory: &mut dyn Dictionary,
    ) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::None;
        let bytes = memory.upload(object)?;
        let threshold = usize::from(request[5]);
        if threshold > 0 && bytes.len() <= threshold {
            return self.upload(now, object, memory);
        }
        let (block, answer) = sdo_block::offer(request, bytes)?;
        self.transfer = Transfer::Block { object, block, until: now + SEGMENT_TIMEOUT };
        Ok(answer)
    }

    fn download_block(
        &mut self,
        now: Mono,
        request: [u8; 8],
        object: ObjectId,
        memory: &mut dyn Dictionary,
    ) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::None;
        let data = [request[4], request[5], request[6], request[7]];
        let announced = announced(request[0] & 0b10 != 0, data, memory.width(object)?)?;
        let (block, answer) = sdo_block::accept(request, announced);
        self.transfer = Transfer::Block { object, block, until: now + SEGMENT_TIMEOUT };
        Ok(answer)
    }

    fn upload(&mut self, now: Mono, object: ObjectId, memory: &mut dyn Dictionary) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::None;
        let bytes = memory.upload(object)?;
        let omitted = self.style.size == SizeIndication::Omitted;
        // Without a size, a short or empty text is filled to four bytes. With a size, an empty text needs segments.
        if (1..=4).contains(&bytes.len()) || (bytes.is_empty() && omitted) {
            let command = match (self.answers_60, self.style.size) {
                (true, _) => 0x60,
                (false, SizeIndication::Omitted) => 0x42,
                (false, SizeIndication::Indicated) => UPLOAD_COMMANDS[bytes.len()],
            };
            let mut data = [0; 4];
            data[..bytes.len()].copy_from_slice(&bytes);
            return Ok(frame(command, object, data));
        }
        if self.style.expedited_only {
            return Err(Abort::GENERAL);
        }
        let size = u32::try_from(bytes.len()).map_err(|_| Abort::MEMORY)?;
        self.transfer = Transfer::Upload { object, bytes, sent: 0, toggle: false, until: now + SEGMENT_TIMEOUT };
        Ok(frame(0x41, object, size.to_le_bytes()))
    }

    fn upload_segment(&mut self, now: Mono, command: u8) -> Result<[u8; 8], Abort> {
        let Transfer::Upload { bytes, sent, toggle, until, .. } = &mut self.transfer else {
            return Err(Abort::COMMAND);
        };
        if (command & 0x10 != 0) != *toggle {
            return Err(Abort::TOGGLE);
        }
        let rest = bytes.get(*sent..).unwrap_or_default();
        let part = &rest[..rest.len().min(7)];
        let last = part.len() == rest.len();
        let unused = u8::try_from(7 - part.len()).unwrap_or(0);
        let mut answer = [0; 8];
        answer[0] = u8::from(*toggle) << 4 | unused << 1 | u8::from(last);
        answer[1..=part.len()].copy_from_slice(part);
        *sent += part.len();
        *toggle = !*toggle;
        *until = now + SEGMENT_TIMEOUT;
        if last {
            self.transfer = Transfer::None;
        }
        Ok(answer)
    }

    fn download(
        &mut self,
        now: Mono,
        request: [u8; 8],
        object: ObjectId,
        memory: &mut dyn Dictionary,
    ) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::None;
        let command = request[0];
        let (expedited, sized) = (command & 0b10 != 0, command & 0b01 != 0);
        let data = [request[4], request[5], request[6], request[7]];
        let width = memory.width(object)?;
        if expedited {
            let bytes = if sized {
                &data[..4 - usize::from(command >> 2 & 0b11)]
            } else {
                let width = width.unwrap_or(4).min(4);
                // A value that is too long for the type is rejected, not truncated.
                if data[width..].iter().any(|&byte| byte != 0) {
                    return Err(Abort::LENGTH);
                }
                &data[..width]
            };
            memory.download(object, bytes)?;
            return Ok(frame(0x60, object, [0; 4]));
        }
        if self.style.expedited_only {
            return Err(Abort::COMMAND);
        }
        let announced = announced(sized, data, width)?;
        self.transfer =
            Transfer::Download { object, announced, bytes: Vec::new(), toggle: false, until: now + SEGMENT_TIMEOUT };
        Ok(frame(0x60, object, [0; 4]))
    }

    fn download_segment(&mut self, now: Mono, request: [u8; 8], memory: &mut dyn Dictionary) -> Result<[u8; 8], Abort> {
        let Transfer::Download { object, announced, bytes, toggle, until } = &mut self.transfer else {
            return Err(Abort::COMMAND);
        };
        let command = request[0];
        if (command & 0x10 != 0) != *toggle {
            return Err(Abort::TOGGLE);
        }
        let len = 7 - usize::from(command >> 1 & 0b111);
        bytes.extend_from_slice(&request[1..=len]);
        if bytes.len() > MAX_LENGTH {
            return Err(Abort::MEMORY);
        }
        let answer = [0x20 | command & 0x10, 0, 0, 0, 0, 0, 0, 0];
        *toggle = !*toggle;
        *until = now + SEGMENT_TIMEOUT;
        if command & 1 != 0 {
            if announced.is_some_and(|announced| announced != bytes.len()) {
                return Err(Abort::LENGTH);
            }
            let object = *object;
            let bytes = std::mem::take(bytes);
            memory.download(object, &bytes)?;
            self.transfer = Transfer::None;
        }
        Ok(answer)
    }
}

/// Checks the announced size; `None` if no size is announced.
fn announced(sized: bool, data: [u8; 4], width: Option<usize>) -> Result<Option<usize>, Abort> {
    if !sized {
        return Ok(None);
    }
    let size = usize::try_from(u32::from_le_bytes(data)).map_err(|_| Abort::MEMORY)?;
    if size > MAX_LENGTH {
        return Err(Abort::MEMORY);
    }
    if width.is_some_and(|width| width != size) {
        return Err(Abort::LENGTH);
    }
    Ok(Some(size))
}

fn frame(command: u8, object: ObjectId, data: [u8; 4]) -> [u8; 8] {
    let [low, high] = object.index.to_le_bytes();
    [command, low, high, object.sub, data[0], data[1], data[2], data[3]]
}

fn abort(object: ObjectId, Abort(code): Abort) -> [u8; 8] {
    frame(0x80, object, code.to_le_bytes())
}

#[cfg(test)]
mod tests;
