//! Tests of the assembly of transfers.

use super::*;
use crate::canopen::id::CanId;
use crate::canopen::sdo::{BlockDownload, BlockUpload, DownloadSize, Progress};

fn node() -> NodeId {
    NodeId::new(5).expect("a node-ID")
}

fn received(frame: Frame, milliseconds: u64) -> Received {
    Received { frame, at: Stamp { mono: Mono::at(Duration::from_millis(milliseconds)), ..Stamp::default() } }
}

/// Assembles the transfers in these frames, one per millisecond. Also returns the texts of the stray frames.
fn assembled(frames: &[&str]) -> (Vec<Transfer>, Vec<String>) {
    let (mut transfers, mut strays, mut finished) = (Transfers::default(), Vec::new(), Vec::new());
    for (at, text) in (0..).zip(frames) {
        let frame: Frame = text.parse().expect("a frame");
        if transfers.take(&received(frame, at)) == Part::Stray {
            strays.push(frame.to_string());
        }
        finished.extend(std::iter::from_fn(|| transfers.next_finished()));
    }
    transfers.end_all();
    finished.extend(std::iter::from_fn(|| transfers.next_finished()));
    (finished, strays)
}

fn bytes(transfer: &Transfer) -> Option<&[u8]> {
    match &transfer.outcome {
        Outcome::Done(uploaded) => Some(&uploaded.bytes),
        _ => None,
    }
}

#[test]
fn expedited_and_segmented_transfers() {
    let (transfers, strays) = assembled(&[
        "605#4017100000000000",
        "585#4B17100064000000",
        "605#2B171000F4010000",
        "585#6017100000000000",
        "605#4008100000000000",
        "585#4108100008000000",
        "605#6000000000000000",
        "585#004D482D342D4341",
        "605#7000000000000000",
        "585#1D4E000000000000",
        "605#2102200009000000",
        "585#6002200000000000",
        "605#0001020304050607",
        "585#2000000000000000",
        "605#1B08090000000000",
        "585#3000000000000000",
    ]);
    assert_eq!(strays, [""; 0]);
    let all: Vec<_> = transfers.iter().map(|it| (it.operation, it.form, bytes(it).expect("done"))).collect();
    assert_eq!(
        all,
        [
            (Operation::Read, Form::Expedited, &[100, 0][..]),
            (Operation::Write, Form::Expedited, &[0xf4, 1]),
            (Operation::Read, Form::Segmented, b"MH-4-CAN"),
            (Operation::Write, Form::Segmented, &[1, 2, 3, 4, 5, 6, 7, 8, 9]),
        ]
    );
    let last = &transfers[3];
    let ms = |stamp: Stamp| stamp.mono.since_start().as_millis();
    assert_eq!((ms(last.requested), last.answered.map(ms), ms(last.ended)), (10, Some(11), 15));
}

#[test]
fn aborts_missing_answers_and_retries() {
    let (transfers, strays) = assembled(&[
        "605#4017100000000000",
        "605#4017100000000000",
        "585#8017100000000206",
        "605#4018100100000000",
        "605#4000100000000000",
        "585#4300100094010200",
        "605#2102200009000000",
        "585#6002200000000000",
        "605#8002200000000405",
        "585#4318100147000000",
        "605#40",
    ]);
    let outcomes: Vec<_> = transfers.iter().map(|it| (it.object.index, it.outcome.clone())).collect();
    let aborted = |code, by_master| Outcome::Aborted { code: AbortCode(code), by_master };
    assert_eq!(
        outcomes[..3],
        [(0x1017, Outcome::NoAnswer), (0x1017, aborted(0x0602_0000, false)), (0x1018, Outcome::NoAnswer),]
    );
    assert_eq!(outcomes[4], (0x2002, aborted(0x0504_0000, true)));
    assert_eq!(strays, ["585#4318100147000000", "605#40"]);
}

/// A request without an answer ends after the time-out, without another frame of the node.
#[test]
fn silent_node_is_reported_by_other_traffic() {
    let mut transfers = Transfers::default();
    transfers.take(&received("605#4017100000000000".parse().expect("a frame"), 0));
    assert_eq!(transfers.next_deadline(), Some(Mono::at(READ_TIMEOUT)));
    assert_eq!(transfers.take(&received("080#".parse().expect("a frame"), 2000)), Part::OtherFrame);
    assert_eq!(transfers.next_finished().map(|it| it.outcome), Some(Outcome::NoAnswer));
}

#[test]
fn second_master_disturbs_a_transfer() {
    let disturbed = |frames: &[&str]| assembled(frames).0.iter().any(|it| it.is_disturbed);
    let answered = ["605#4017100000000000", "585#4B17100064000000", "605#4018100100000000", "585#4318100147000000"];
    assert!(!disturbed(&answered));
    assert!(disturbed(&[answered[0], answered[2], answered[1], answered[3]]));
}

/// Returns the frames of a block read by our own client from a server that sends `data` in blocks of `size` segments.
fn block_read(data: &[u8], repeat: bool) -> Vec<Frame> {
    let object = ObjectId::new(0x2002, 0);
    let (mut upload, mut frames) = (BlockUpload::new(node(), object, 0, false), Vec::new());
    let answer = |data: [u8; 8]| Frame::full(CanId::sdo_response(node()), data);
    frames.push(upload.request());
    let [a, b, c, d] = u32::try_from(data.len()).expect("short").to_le_bytes();
    let mut next = vec![answer([0xc6, 0x02, 0x20, 0, a, b, c, d])];
    let (mut at, mut has_repeated) = (0, !repeat);
    loop {
        let mut out = Vec::new();
        let mut done = false;
        for frame in std::mem::take(&mut next) {
            frames.push(frame);
            done |= matches!(upload.on_frame(&frame, &mut out), Progress::Done(_));
        }
        frames.extend(&out);
        if done {
            return frames;
        }
        let command = out.last().expect("a request").data().to_vec();
        match command[0] {
            0xa3 => {}
            0xa2 => at += 7 * usize::from(command[1]),
            other => panic!("{other:02X}"),
        }
        if at >= data.len() {
            let [low, high] = crate::canopen::sdo::crc16(data).to_le_bytes();
            let unused = u8::try_from(at - data.len()).expect("0 to 6");
            next.push(answer([0xc1 | unused << 2, low, high, 0, 0, 0, 0, 0]));
            continue;
        }
        let parts: Vec<&[u8]> = data[at..].chunks(7).take(127).collect();
        let is_end = at + 7 * parts.len() >= data.len();
        for (sequence, part) in (1u8..).zip(&parts) {
            let mut segment = [0; 8];
            let is_last = is_end && usize::from(sequence) == parts.len();
            segment[0] = sequence | u8::from(is_last) << 7;
            segment[1..=part.len()].copy_from_slice(part);
            next.push(answer(segment));
        }
        if !has_repeated && parts.len() > 2 {
            // The master misses a segment and asks for the rest again.
            has_repeated = true;
            next.remove(1);
        }
    }
}

#[test]
fn block_transfers_of_every_length() {
    for length in [1, 6, 7, 8, 14, 500, 889, 890, 2000] {
        let data: Vec<u8> = (0..=250).cycle().take(length).collect();
        for repeat in [false, true] {
            let frames: Vec<String> = block_read(&data, repeat).iter().map(Frame::to_string).collect();
            let (transfers, strays) = assembled(&frames.iter().map(String::as_str).collect::<Vec<_>>());
            assert_eq!(strays, [""; 0], "{length}");
            let [transfer] = &transfers[..] else { panic!("{transfers:?}") };
            assert_eq!((transfer.form, bytes(transfer)), (Form::Block, Some(&data[..])), "{length} {repeat}");
        }
        let frames: Vec<String> = block_write(&data).iter().map(Frame::to_string).collect();
        let (transfers, strays) = assembled(&frames.iter().map(String::as_str).collect::<Vec<_>>());
        assert_eq!(strays, [""; 0], "{length}");
        assert_eq!(bytes(&transfers[0]), Some(&data[..]), "{length}");
    }
}

/// Returns the frames of a block write by our own client to a server with blocks of 5 segments.
fn block_write(data: &[u8]) -> Vec<Frame> {
    let object = ObjectId::new(0x2002, 0);
    let mut download = BlockDownload::new(node(), object, data.to_vec(), DownloadSize::Indicated);
    let answer = |data: [u8; 8]| Frame::full(CanId::sdo_response(node()), data);
    let mut frames = vec![download.request()];
    let mut next = answer([0xa4, 0x02, 0x20, 0, 5, 0, 0, 0]);
    loop {
        let mut out = Vec::new();
        frames.push(next);
        if matches!(download.on_frame(&next, &mut out), Progress::Done(())) {
            return frames;
        }
        out.iter().for_each(|_| download.on_sent());
        frames.extend(&out);
        let is_end = out.len() == 1 && out[0].data()[0] & 0xe1 == 0xc1 && out[0].data()[3..].iter().all(|&it| it == 0);
        let sent = u8::try_from(out.len()).expect("5 at most");
        let ends = is_end && frames.iter().rev().nth(1).is_some_and(|frame| frame.data()[0] == 0xa2);
        next = answer(if ends { [0xa1, 0, 0, 0, 0, 0, 0, 0] } else { [0xa2, sent, 5, 0, 0, 0, 0, 0] });
    }
}

/// Random frames on SDO channels never panic, and each is part of a transfer or stray.
#[test]
fn random_frames_are_handled() {
    let mut seed = 1u64;
    let mut random = move || {
        seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        seed.to_be_bytes()
    };
    let commands =
        [0x40, 0x43, 0x41, 0x60, 0x70, 0, 0x10, 1, 0x21, 0x23, 0x20, 0x30, 0xa4, 0xc2, 0xa2, 0xa1, 0xc1, 0x80];
    let mut transfers = Transfers::default();
    for at in 0..200_000u64 {
        let [choice, length, is_request, ..] = random();
        let mut data = random();
        data[0] = commands[usize::from(choice) % commands.len()];
        data[1..4].fill(0);
        let id = if is_request < 128 { CanId::sdo_request(node()) } else { CanId::sdo_response(node()) };
        let frame = Frame::new(id, &data[..usize::from(length) % 9]).expect("at most 8 bytes");
        assert_ne!(transfers.take(&received(frame, at)), Part::OtherFrame);
        while transfers.next_finished().is_some() {}
    }
}
