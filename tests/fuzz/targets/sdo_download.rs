//! A download with arbitrary frames. If it succeeds, all bytes were sent.
#![no_main]

use cangauge::canopen::id::CanId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{Download, DownloadSize, Progress};
use cangauge_fuzz::{Bytes, assert_requests, node};
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let head = bytes.byte();
    let size = if head & 1 == 0 { DownloadSize::Indicated } else { DownloadSize::Omitted };
    let value: Vec<u8> = (0..head >> 1).collect();
    let mut download = Download::new(node(), ObjectId::new(0x1010, 1), value.clone(), size);
    let request = download.request();
    assert_requests(&[request]);
    let expedited = (1..=4).contains(&value.len());
    let mut carried = if expedited { value.clone() } else { Vec::new() };
    let mut out = Vec::new();
    while !bytes.is_empty() {
        let frame = bytes.frame(CanId::sdo_response(node()));
        out.clear();
        let progress = download.on_frame(&frame, &mut out);
        assert_requests(&out);
        match progress {
            Progress::NotOurs => assert!(out.is_empty()),
            Progress::Continue => {
                assert_eq!(out.len(), 1);
                let segment = out[0].data();
                let unused = usize::from(segment[0] >> 1 & 7);
                carried.extend_from_slice(&segment[1..8 - unused]);
            }
            Progress::Done(()) => {
                assert!(out.is_empty());
                assert_eq!(carried, value);
                return;
            }
            Progress::Failed(_) => return,
        }
        assert!(value.starts_with(&carried));
    }
    out.clear();
    download.on_timeout(&mut out);
    assert_requests(&out);
});
