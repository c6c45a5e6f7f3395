//! An upload with arbitrary frames.
#![no_main]

use cangauge::canopen::id::CanId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{Progress, Upload, fit};
use cangauge::canopen::value::{DataType, Value};
use cangauge_fuzz::{Bytes, assert_requests, node};
use libfuzzer_sys::fuzz_target;

const TYPES: [DataType; 5] =
    [DataType::Unsigned(1), DataType::Unsigned(4), DataType::Integer(2), DataType::Real32, DataType::VisibleString];

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let head = bytes.byte();
    let mut upload = Upload::new(node(), ObjectId::new(0x1018, 1), head & 1 != 0);
    assert_requests(&[upload.request()]);
    let (mut out, mut received) = (Vec::new(), 0);
    while !bytes.is_empty() {
        let frame = bytes.frame(CanId::sdo_response(node()));
        received += frame.data().len();
        out.clear();
        let has_begun = upload.has_begun();
        match upload.on_frame(&frame, &mut out) {
            Progress::NotOurs => {
                assert!(out.is_empty() && upload.has_begun() == has_begun, "the state has changed");
            }
            Progress::Continue => assert_eq!(out.len(), 1),
            Progress::Done(uploaded) => {
                assert!(out.is_empty());
                assert!(uploaded.bytes.len() <= received, "no byte that has not been sent");
                for data_type in TYPES {
                    if let Ok(fitted) = fit(Some(data_type), &uploaded) {
                        let text = matches!(fitted.value, Value::Text(_));
                        assert_eq!(text, data_type == DataType::VisibleString, "{fitted:?}");
                    }
                }
                return;
            }
            Progress::Failed(_) => {
                assert!(out.len() <= 1);
                assert_requests(&out);
                return;
            }
        }
        assert_requests(&out);
        assert!(upload.received().0 <= received);
    }
    out.clear();
    upload.on_timeout(&mut out);
    assert_eq!(out.len(), usize::from(upload.has_begun()));
    assert_requests(&out);
});
