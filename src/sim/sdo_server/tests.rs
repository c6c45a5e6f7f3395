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

/// Sends requests and checks their answers; `-` means no answer; several answers are separated by blanks.
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
            // Size not indicated: the size of the type.
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
    let mut server =
        SdoServer::new(SdoStyle { size: SizeIndication::Omitted, expedited_only: true, ..SdoStyle::default() }, false);
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
            // Segmented transfer is rejected in both directions.
            ("4008100000000000", "8008100000000008"),
            ("2100200005000000", "8000200001000405"),
            ("6000000000000000", "8000000001000405"),
        ],
    );
    let mut quirky = SdoServer::new(SdoStyle { size: SizeIndication::Omitted, ..SdoStyle::default() }, true);
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
            // The transfer has ended: a further segment is an invalid command.
            ("6000000000000000", "8000000001000405"),
            // Wrong toggle bit: the transfer ends, and the abort contains the object.
            ("4008100000000000", "4108100008000000"),
            ("7000000000000000", "8008100000000305"),
            ("6000000000000000", "8000000001000405"),
            // An empty value cannot be expedited.
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
            // Without a size; a small number may also be sent in segments.
            ("2017100000000000", "6017100000000000"),
            ("0B01020000000000", "2000000000000000"),
            ("4017100000000000", "4B17100001020000"),
            // The announced and the delivered size differ.
            ("2100200009000000", "6000200000000000"),
            ("0B41420000000000", "8000200010000706"),
            // The announced size does not fit the type.
            ("2117100004000000", "8017100010000706"),
            // Wrong toggle bit.
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
    let mut server = SdoServer::new(SdoStyle { block: true, ..SdoStyle::default() }, false);
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
            // Without CRC and size. The first segment is lost and the second is repeated, so no segment is in order.
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
            // An empty value.
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
            // An end request without a transfer, and a new request instead of the end request.
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
    let mut server = SdoServer::new(SdoStyle { block: true, ..SdoStyle::default() }, false);
    memory.0.insert(ObjectId::new(0x2000, 0), b"123456789".to_vec());
    transcript(
        &mut server,
        &mut memory,
        &[
            ("A40020007F000000", "C600200009000000"),
            ("A300000000000000", "0131323334353637 8238390000000000"),
            ("A2027F0000000000", "D5C3310000000000"),
            ("A100000000000000", "-"),
            // Sub-blocks of one segment, none accepted, then a larger one; no CRC.
            ("A000200001000000", "C200200009000000"),
            ("A300000000000000", "0131323334353637"),
            ("A200010000000000", "0131323334353637"),
            ("A201050000000000", "8138390000000000"),
            ("A201050000000000", "D500000000000000"),
            ("A100000000000000", "-"),
            // Up to the threshold, as in a normal read.
            ("A40020007F090000", "4100200009000000"),
            ("6000000000000000", "0031323334353637"),
            ("7000000000000000", "1B38390000000000"),
            ("A40020007F080000", "C600200009000000"),
            // More segments acknowledged than sent; no block size, at the start and later; no such object.
            ("A300000000000000", "0131323334353637 8238390000000000"),
            ("A2037F0000000000", "8000200003000405"),
            ("A400200000000000", "8000200002000405"),
            ("A400200080000000", "8000200002000405"),
            ("A40020007F000000", "C600200009000000"),
            ("A300000000000000", "0131323334353637 8238390000000000"),
            ("A201000000000000", "8000200002000405"),
            ("A40099297F000000", "8000992900000206"),
            // A start request without a transfer.
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
    server.sent(Mono::at(SEGMENT_TIMEOUT));
    assert_eq!(server.deadline(), Some(Mono::at(2 * SEGMENT_TIMEOUT)));
    assert_eq!(server.give_up(), Some([0x80, 0x00, 0x20, 0, 0, 0, 0x04, 0x05]));
    assert_eq!(server.deadline(), None);
}

#[test]
fn silent_client_is_aborted_after_the_time_limit() {
    let mut server = SdoServer::new(SdoStyle::default(), false);
    assert_eq!(server.deadline(), None);
    transcript(&mut server, &mut memory(), &[("4008100000000000", "4108100008000000")]);
    assert_eq!(server.deadline(), Some(Mono::at(SEGMENT_TIMEOUT)));
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
        let mut server = SdoServer::new(SdoStyle { block: true, ..SdoStyle::default() }, false);
        for (mut request, kind) in requests {
            // Some frames continue the transfer.
            let head = [request[0], 0xc6, 0xa4, 0xa2, 0xa3, 0x81][kind];
            request[0] = head;
            if head == 0xc6 || head == 0xa4 {
                request[1..4].copy_from_slice(&[0x00, 0x20, 0x00]);
            }
            prop_assert!(server.request(Mono::START, request, &mut memory).len() <= 127);
        }
    }
}
