//! The SDO server of a simulated device (CiA 301, 7.2.4): expedited and segmented transfers, where described
//! block transfers too, one at a time.

use super::abort::Abort;
use super::sdo_block::{self, Block, Step};
use crate::bus::time::Mono;
use crate::canopen::object::ObjectId;
use crate::device::description::{SdoStyle, SizeIndication};
use std::time::Duration;

/// How long the server waits for the next segment before it gives up.
const PATIENCE: Duration = Duration::from_secs(1);

/// The longest value that can be written.
const LONGEST: usize = 1 << 20;

/// The answer to an upload of 1 to 4 bytes.
const SIZED: [u8; 5] = [0x43, 0x4f, 0x4b, 0x47, 0x43];

/// What the server reads and writes.
pub(super) trait Dictionary {
    /// The value of an entry in wire order.
    fn upload(&mut self, object: ObjectId) -> Result<Vec<u8>, Abort>;

    /// Whether the entry can be written, and how many bytes its type has, where it says.
    fn width(&self, object: ObjectId) -> Result<Option<usize>, Abort>;

    /// A value arrives.
    fn download(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Abort>;
}

/// The server and the transfer that it is in.
#[derive(Clone, Debug)]
pub(super) struct SdoServer {
    style: SdoStyle,
    answers_60: bool,
    transfer: Transfer,
}

#[derive(Clone, Debug)]
enum Transfer {
    None,
    /// The client fetches segments.
    Upload {
        object: ObjectId,
        bytes: Vec<u8>,
        sent: usize,
        toggle: bool,
        until: Mono,
    },
    /// The client sends segments.
    Download {
        object: ObjectId,
        announced: Option<usize>,
        bytes: Vec<u8>,
        toggle: bool,
        until: Mono,
    },
    /// In blocks, either way.
    Block {
        object: ObjectId,
        block: Block,
        until: Mono,
    },
}

impl SdoServer {
    /// `answers_60` is the deviation of [`Quirk::UploadAnswered60`](crate::device::quirk::Quirk).
    pub(super) fn new(style: SdoStyle, answers_60: bool) -> SdoServer {
        SdoServer { style, answers_60, transfer: Transfer::None }
    }

    /// Forgets the transfer, as a reset and a stop do.
    pub(super) fn forget(&mut self) {
        self.transfer = Transfer::None;
    }

    /// When the server gives up on its client.
    pub(super) fn deadline(&self) -> Option<Mono> {
        match &self.transfer {
            Transfer::None => None,
            Transfer::Upload { until, .. } | Transfer::Download { until, .. } | Transfer::Block { until, .. } => {
                Some(*until)
            }
        }
    }

    /// The deadline has passed: what is sent then.
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

    /// A frame of this server is on the wire: the client's time begins with the last one.
    pub(super) fn sent(&mut self, now: Mono) {
        if let Transfer::Block { until, .. } = &mut self.transfer {
            *until = now + PATIENCE;
        }
    }

    /// Whether a sub-block is on its way to the client: whatever the client sends now, the rest of it is void.
    pub(super) fn is_giving(&self) -> bool {
        matches!(self.transfer, Transfer::Block { block: Block::Giving { .. }, .. })
    }

    /// A request, and the answers to it if there are any.
    pub(super) fn request(&mut self, now: Mono, request: [u8; 8], memory: &mut dyn Dictionary) -> Vec<[u8; 8]> {
        let [command, low, high, sub, ..] = request;
        let addressed = ObjectId { index: u16::from(high) << 8 | u16::from(low), sub };
        // Segments carry no address: an abort names the object of the transfer, or none.
        let in_transfer = self.object().unwrap_or(ObjectId::new(0, 0));
        // Within a block transfer a segment can look like any other request.
        if command != 0x80 && matches!(self.transfer, Transfer::Block { .. }) {
            match self.block(now, request, memory) {
                Ok(Some(answers)) => return answers,
                Ok(None) => {}
                Err(code) => return vec![abort(in_transfer, code)],
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
                vec![abort(object, code)]
            }
        }
    }

    /// A frame within a block transfer; `None` if it has no place there.
    fn block(&mut self, now: Mono, frame: [u8; 8], memory: &mut dyn Dictionary) -> Result<Option<Vec<[u8; 8]>>, Abort> {
        let Transfer::Block { object, block, .. } = std::mem::replace(&mut self.transfer, Transfer::None) else {
            return Ok(None);
        };
        Ok(match block.step(frame, LONGEST)? {
            Step::On(block, answers) => {
                self.transfer = Transfer::Block { object, block, until: now + PATIENCE };
                Some(answers)
            }
            Step::Arrived(bytes, answer) => {
                memory.download(object, &bytes)?;
                Some(vec![answer])
            }
            Step::Over => Some(Vec::new()),
            Step::Foreign => None,
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
        self.transfer = Transfer::Block { object, block, until: now + PATIENCE };
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
        self.transfer = Transfer::Block { object, block, until: now + PATIENCE };
        Ok(answer)
    }

    fn upload(&mut self, now: Mono, object: ObjectId, memory: &mut dyn Dictionary) -> Result<[u8; 8], Abort> {
        self.transfer = Transfer::None;
        let bytes = memory.upload(object)?;
        let omitted = self.style.size == SizeIndication::Omitted;
        // Four bytes without a size can hold a short text, but nothing shows that it is none at all.
        if (1..=4).contains(&bytes.len()) || (bytes.is_empty() && omitted) {
            let command = match (self.answers_60, self.style.size) {
                (true, _) => 0x60,
                (false, SizeIndication::Omitted) => 0x42,
                (false, SizeIndication::Indicated) => SIZED[bytes.len()],
            };
            let mut data = [0; 4];
            data[..bytes.len()].copy_from_slice(&bytes);
            return Ok(frame(command, object, data));
        }
        if self.style.expedited_only {
            return Err(Abort::GENERAL);
        }
        let size = u32::try_from(bytes.len()).map_err(|_| Abort::MEMORY)?;
        self.transfer = Transfer::Upload { object, bytes, sent: 0, toggle: false, until: now + PATIENCE };
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
        *until = now + PATIENCE;
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
                // What the type cannot hold is not cut off in silence.
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
            Transfer::Download { object, announced, bytes: Vec::new(), toggle: false, until: now + PATIENCE };
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
        if bytes.len() > LONGEST {
            return Err(Abort::MEMORY);
        }
        let answer = [0x20 | command & 0x10, 0, 0, 0, 0, 0, 0, 0];
        *toggle = !*toggle;
        *until = now + PATIENCE;
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

/// The announced size, if there is one and it makes sense.
fn announced(sized: bool, data: [u8; 4], width: Option<usize>) -> Result<Option<usize>, Abort> {
    if !sized {
        return Ok(None);
    }
    let size = usize::try_from(u32::from_le_bytes(data)).map_err(|_| Abort::MEMORY)?;
    if size > LONGEST {
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
mod tests {
    use super::*;
    use crate::canopen::value::parse_hex;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    /// Entries with their values; 2000h is a text of any length, 2001h cannot be written.
    #[derive(Default)]
    struct Memory(BTreeMap<ObjectId, Vec<u8>>);

    impl Dictionary for Memory {
        fn upload(&mut self, object: ObjectId) -> Result<Vec<u8>, Abort> {
            self.0.get(&object).cloned().ok_or(Abort::NO_OBJECT)
        }

        fn width(&self, object: ObjectId) -> Result<Option<usize>, Abort> {
            match object.index {
                0x2000 => Ok(None),
                0x2001 => Err(Abort::READ_ONLY),
                _ => self.0.get(&object).map(|value| Some(value.len())).ok_or(Abort::NO_OBJECT),
            }
        }

        fn download(&mut self, object: ObjectId, bytes: &[u8]) -> Result<(), Abort> {
            match self.width(object)? {
                Some(width) if width != bytes.len() => Err(Abort::LENGTH),
                _ => {
                    self.0.insert(object, bytes.to_vec());
                    Ok(())
                }
            }
        }
    }

    fn memory() -> Memory {
        Memory(BTreeMap::from([
            (ObjectId::new(0x1000, 0), vec![0x94, 0x01, 0x82, 0x00]),
            (ObjectId::new(0x1001, 0), vec![0x11]),
            (ObjectId::new(0x1017, 0), vec![0, 0]),
            (ObjectId::new(0x1008, 0), b"MH-4-CAN".to_vec()),
            (ObjectId::new(0x1009, 0), b"1.0".to_vec()),
            (ObjectId::new(0x2000, 0), Vec::new()),
            (ObjectId::new(0x2001, 0), vec![0]),
        ]))
    }

    fn style(text: &str) -> SdoStyle {
        toml::from_str(text).expect("a style")
    }

    /// Plays request and answer lines; `-` is silence, several answers stand side by side.
    fn transcript(server: &mut SdoServer, memory: &mut Memory, lines: &[(&str, &str)]) {
        for (request, answer) in lines {
            let bytes: [u8; 8] = parse_hex(request).expect("bytes").try_into().expect("eight");
            let found = server.request(Mono::START, bytes, memory);
            let hex = |bytes: &[u8; 8]| bytes.iter().map(|byte| format!("{byte:02X}")).collect::<String>();
            let found: Vec<String> = found.iter().map(hex).collect();
            let found = if found.is_empty() { "-".to_owned() } else { found.join(" ") };
            assert_eq!(found, *answer, "after {request}");
        }
    }

    #[test]
    fn expedited() {
        let mut memory = memory();
        let mut server = SdoServer::new(SdoStyle::default(), false);
        transcript(
            &mut server,
            &mut memory,
            &[
                ("4000100000000000", "4300100094018200"),
                ("4001100000000000", "4F01100011000000"),
                ("4017100000000000", "4B17100000000000"),
                ("4009100000000000", "47091000312E3000"),
                ("2B171000E8030000", "6017100000000000"),
                ("4017100000000000", "4B171000E8030000"),
                // Size not indicated: as much as the type has.
                ("2217100064000000", "6017100000000000"),
                ("4017100000000000", "4B17100064000000"),
                ("2217100000000100", "8017100010000706"),
                // Wrong length, no such object, read only.
                ("2F17100001000000", "8017100010000706"),
                ("2317100001000000", "8017100010000706"),
                ("2F99290001000000", "8099290000000206"),
                ("4099290000000000", "8099290000000206"),
                ("2F01200001000000", "8001200002000106"),
                ("4017100000000000", "4B17100064000000"),
            ],
        );
    }

    #[test]
    fn sizes_omitted_as_d20_and_dps_do() {
        let mut memory = memory();
        let mut server = SdoServer::new(style("size = \"omitted\"\nexpedited_only = true"), false);
        transcript(
            &mut server,
            &mut memory,
            &[
                ("4000100000000000", "4200100094018200"),
                ("4001100000000000", "4201100011000000"),
                ("4009100000000000", "42091000312E3000"),
                ("2217100064000000", "6017100000000000"),
                ("2B17100065000000", "6017100000000000"),
                ("4017100000000000", "4217100065000000"),
                // No segmented transfer, in neither direction.
                ("4008100000000000", "8008100000000008"),
                ("2100200005000000", "8000200001000405"),
                ("6000000000000000", "8000000001000405"),
            ],
        );
        let mut quirky = SdoServer::new(style("size = \"omitted\""), true);
        transcript(&mut quirky, &mut memory, &[("4000100000000000", "6000100094018200")]);
    }

    #[test]
    fn segmented_upload() {
        let mut memory = memory();
        let mut server = SdoServer::new(SdoStyle::default(), false);
        transcript(
            &mut server,
            &mut memory,
            &[
                ("4008100000000000", "4108100008000000"),
                ("6000000000000000", "004D482D342D4341"),
                ("7000000000000000", "1D4E000000000000"),
                // Over: another segment is a wrong command.
                ("6000000000000000", "8000000001000405"),
                // Toggle wrong: the transfer is over and the abort names the object.
                ("4008100000000000", "4108100008000000"),
                ("7000000000000000", "8008100000000305"),
                ("6000000000000000", "8000000001000405"),
                // Nothing at all cannot be expedited.
                ("4000200000000000", "4100200000000000"),
                ("6000000000000000", "0F00000000000000"),
                // A new request replaces the transfer; an abort of the client ends it without an answer.
                ("4008100000000000", "4108100008000000"),
                ("4001100000000000", "4F01100011000000"),
                ("7000000000000000", "8000000001000405"),
                ("4008100000000000", "4108100008000000"),
                ("8008100000000405", "-"),
                ("6000000000000000", "8000000001000405"),
            ],
        );
    }

    #[test]
    fn segmented_download() {
        let mut memory = memory();
        let mut server = SdoServer::new(SdoStyle::default(), false);
        transcript(
            &mut server,
            &mut memory,
            &[
                ("2100200009000000", "6000200000000000"),
                ("0041424344454647", "2000000000000000"),
                ("1B48490000000000", "3000000000000000"),
            ],
        );
        assert_eq!(memory.0[&ObjectId::new(0x2000, 0)], b"ABCDEFGHI");
        transcript(
            &mut server,
            &mut memory,
            &[
                // Without a size; a small number may come in segments, too.
                ("2017100000000000", "6017100000000000"),
                ("0B01020000000000", "2000000000000000"),
                ("4017100000000000", "4B17100001020000"),
                // Announced and delivered differ.
                ("2100200009000000", "6000200000000000"),
                ("0B41420000000000", "8000200010000706"),
                // Announced does not fit the type.
                ("2117100004000000", "8017100010000706"),
                // Toggle wrong.
                ("2100200009000000", "6000200000000000"),
                ("1041424344454647", "8000200000000305"),
                ("0041424344454647", "8000000001000405"),
                // Too long, read only.
                ("2100200001001000", "8000200005000405"),
                ("2101200009000000", "8001200002000106"),
            ],
        );
        assert_eq!(memory.0[&ObjectId::new(0x2000, 0)], b"ABCDEFGHI", "a failed transfer changes nothing");
    }

    #[test]
    fn block_transfer_is_not_offered() {
        let mut server = SdoServer::new(SdoStyle::default(), false);
        transcript(
            &mut server,
            &mut memory(),
            &[
                ("A008100020000000", "8008100001000405"),
                ("C200200009000000", "8000200001000405"),
                ("E000000000000000", "8000000001000405"),
            ],
        );
    }

    #[test]
    fn block_download() {
        let mut memory = memory();
        let mut server = SdoServer::new(style("block = true"), false);
        transcript(
            &mut server,
            &mut memory,
            &[
                ("C600200009000000", "A40020007F000000"),
                ("0131323334353637", "-"),
                ("8238390000000000", "A2027F0000000000"),
                ("8238390000000000", "-"),
                ("D5C3310000000000", "A100000000000000"),
            ],
        );
        assert_eq!(memory.0[&ObjectId::new(0x2000, 0)], b"123456789");
        transcript(
            &mut server,
            &mut memory,
            &[
                // Without CRC and size. The first segment lost, the second doubled: nothing in order.
                ("C000200000000000", "A00020007F000000"),
                ("0241424344454647", "-"),
                ("0241424344454647", "-"),
                ("8348000000000000", "A2007F0000000000"),
                ("0131323334353637", "-"),
                ("0341424344454647", "-"),
                ("8348000000000000", "A2017F0000000000"),
                ("0141424344454647", "-"),
                ("8248000000000000", "A2027F0000000000"),
                ("D900000000000000", "A100000000000000"),
            ],
        );
        assert_eq!(memory.0[&ObjectId::new(0x2000, 0)], b"1234567ABCDEFGH");
        transcript(
            &mut server,
            &mut memory,
            &[
                // Nothing at all.
                ("C600200000000000", "A40020007F000000"),
                ("8100000000000000", "A2017F0000000000"),
                ("DD00000000000000", "A100000000000000"),
                // Wrong CRC, another size than announced, too long, read only, an abort in the middle.
                ("C600200001000000", "A40020007F000000"),
                ("8141000000000000", "A2017F0000000000"),
                ("D9FFFF0000000000", "8000200004000405"),
                ("C200200002000000", "A00020007F000000"),
                ("8141000000000000", "A2017F0000000000"),
                ("D900000000000000", "8000200010000706"),
                ("C600200001001000", "8000200005000405"),
                ("C601200001000000", "8001200002000106"),
                ("C600200009000000", "A40020007F000000"),
                ("0141424344454647", "-"),
                ("8000200000000405", "-"),
                ("8248490000000000", "-"),
                // An end without a beginning, and a new request instead of the end.
                ("C100000000000000", "8000000001000405"),
                ("C600200001000000", "A40020007F000000"),
                ("8141000000000000", "A2017F0000000000"),
                ("4000200000000000", "4100200000000000"),
            ],
        );
    }

    #[test]
    fn block_upload() {
        let mut memory = memory();
        let mut server = SdoServer::new(style("block = true"), false);
        memory.0.insert(ObjectId::new(0x2000, 0), b"123456789".to_vec());
        transcript(
            &mut server,
            &mut memory,
            &[
                ("A40020007F000000", "C600200009000000"),
                ("A300000000000000", "0131323334353637 8238390000000000"),
                ("A2027F0000000000", "D5C3310000000000"),
                ("A100000000000000", "-"),
                // Sub-blocks of one, none taken, then a larger one; no CRC.
                ("A000200001000000", "C200200009000000"),
                ("A300000000000000", "0131323334353637"),
                ("A200010000000000", "0131323334353637"),
                ("A201050000000000", "8138390000000000"),
                ("A201050000000000", "D500000000000000"),
                ("A100000000000000", "-"),
                // As to a normal read up to the threshold.
                ("A40020007F090000", "4100200009000000"),
                ("6000000000000000", "0031323334353637"),
                ("7000000000000000", "1B38390000000000"),
                ("A40020007F080000", "C600200009000000"),
                // More acknowledged than sent; no block size, at the start and later; no such object.
                ("A300000000000000", "0131323334353637 8238390000000000"),
                ("A2037F0000000000", "8000200003000405"),
                ("A400200000000000", "8000200002000405"),
                ("A400200080000000", "8000200002000405"),
                ("A40020007F000000", "C600200009000000"),
                ("A300000000000000", "0131323334353637 8238390000000000"),
                ("A201000000000000", "8000200002000405"),
                ("A40099297F000000", "8000992900000206"),
                // A start without a beginning.
                ("A300000000000000", "8000000001000405"),
            ],
        );
        memory.0.insert(ObjectId::new(0x2000, 0), Vec::new());
        transcript(
            &mut server,
            &mut memory,
            &[
                ("A40020007F000000", "C600200000000000"),
                ("A300000000000000", "8100000000000000"),
                ("A2017F0000000000", "DD00000000000000"),
                ("A100000000000000", "-"),
            ],
        );
        transcript(&mut server, &mut memory, &[("A40020007F000000", "C600200000000000")]);
        server.sent(Mono::at(PATIENCE));
        assert_eq!(server.deadline(), Some(Mono::at(2 * PATIENCE)));
        assert_eq!(server.give_up(), Some([0x80, 0x00, 0x20, 0, 0, 0, 0x04, 0x05]));
        assert_eq!(server.deadline(), None);
    }

    #[test]
    fn a_client_that_stays_away_is_given_up() {
        let mut server = SdoServer::new(SdoStyle::default(), false);
        assert_eq!(server.deadline(), None);
        transcript(&mut server, &mut memory(), &[("4008100000000000", "4108100008000000")]);
        assert_eq!(server.deadline(), Some(Mono::at(PATIENCE)));
        assert_eq!(server.give_up(), Some([0x80, 0x08, 0x10, 0, 0, 0, 0x04, 0x05]));
        assert_eq!(server.deadline(), None);
        assert_eq!(server.give_up(), None);
    }

    proptest! {
        #[test]
        fn any_request_is_answered_or_dropped(requests in proptest::collection::vec(any::<[u8; 8]>(), 1..40)) {
            let mut memory = memory();
            let mut server = SdoServer::new(SdoStyle::default(), false);
            for request in requests {
                let answer = server.request(Mono::START, request, &mut memory);
                prop_assert_eq!(answer.is_empty(), request[0] >> 5 == 4);
            }
        }

        #[test]
        fn block_transfers_take_any_frame(
            requests in proptest::collection::vec((any::<[u8; 8]>(), 0..6usize), 1..60)
        ) {
            let mut memory = memory();
            let mut server = SdoServer::new(style("block = true"), false);
            for (mut request, kind) in requests {
                // Now and then something that leads on.
                let head = [request[0], 0xc6, 0xa4, 0xa2, 0xa3, 0x81][kind];
                request[0] = head;
                if head == 0xc6 || head == 0xa4 {
                    request[1..4].copy_from_slice(&[0x00, 0x20, 0x00]);
                }
                prop_assert!(server.request(Mono::START, request, &mut memory).len() <= 127);
            }
        }
    }
}
