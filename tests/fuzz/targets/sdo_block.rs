//! Block upload and download with arbitrary frames and time-outs. They always end: after a number of time-outs or
//! useless frames they send nothing more.
#![no_main]

use cangauge::canopen::id::CanId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{BlockDownload, BlockSize, BlockUpload, DownloadSize, Progress};
use cangauge_fuzz::{Bytes, assert_requests, node};
use libfuzzer_sys::fuzz_target;

/// The largest number of time-outs in a row before a transfer ends.
const MAX_TIMEOUTS: usize = 8;

fn upload(head: u8, mut bytes: Bytes<'_>) {
    let mut machine = BlockUpload::new(node(), ObjectId::new(0x1008, 0), head & 0x1f, head & 0x20 != 0);
    if let Some(size) = BlockSize::new(bytes.byte()) {
        machine = machine.with_block_size(size);
    }
    assert_requests(&[machine.request()]);
    let (mut out, mut received, mut timeouts) = (Vec::new(), 0, 0);
    loop {
        out.clear();
        // A control byte of FFh is a time-out. After the end of the input there are only time-outs.
        if bytes.is_empty() || bytes.0[0] == 0xff {
            bytes.byte();
            timeouts += 1;
            let end = machine.on_timeout(&mut out);
            assert_requests(&out);
            if end.is_some() {
                return;
            }
            assert!(timeouts < MAX_TIMEOUTS, "it does not end");
            continue;
        }
        let frame = bytes.frame(CanId::sdo_response(node()));
        received += 7;
        let progress = machine.on_frame(&frame, &mut out);
        assert_requests(&out);
        assert!(out.len() <= 2);
        match progress {
            Progress::NotOurs => assert!(out.is_empty()),
            Progress::Continue => timeouts = 0,
            Progress::Done(uploaded) => {
                assert!(uploaded.bytes.len() <= received, "no byte that has not been sent");
                return;
            }
            Progress::Failed(_) => return,
        }
    }
}

fn download(head: u8, mut bytes: Bytes<'_>) {
    let value: Vec<u8> = (0..bytes.word() % 2000).map(|number| number.to_le_bytes()[0]).collect();
    let size = if head & 1 == 0 { DownloadSize::Indicated } else { DownloadSize::Omitted };
    let mut machine = BlockDownload::new(node(), ObjectId::new(0x1010, 1), value.clone(), size);
    assert_requests(&[machine.request()]);
    let (mut out, mut ended) = (Vec::new(), false);
    while !bytes.is_empty() {
        let on_the_way = bytes.byte();
        let frame = bytes.frame(CanId::sdo_response(node()));
        out.clear();
        let progress = machine.on_frame(&frame, &mut out);
        assert_requests(&out);
        assert!(out.len() <= 127);
        let (sent, all) = machine.sent();
        assert!(sent <= all && all == value.len());
        match progress {
            Progress::NotOurs => assert!(out.is_empty()),
            Progress::Continue => {
                assert!(!out.is_empty());
                ended |= out.last().is_some_and(|frame| out.len() == 1 && frame.data()[0] & 0xe3 == 0xc1);
            }
            Progress::Done(()) => {
                assert!(ended && out.is_empty(), "done before its end");
                return;
            }
            Progress::Failed(_) => return,
        }
        for _ in 0..out.len().min(usize::from(on_the_way)) {
            machine.on_sent();
        }
    }
    out.clear();
    machine.on_timeout(&mut out);
    assert_requests(&out);
}

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let head = bytes.byte();
    if head & 0x80 == 0 { upload(head, bytes) } else { download(head, bytes) }
});
