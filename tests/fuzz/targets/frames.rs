//! Frames as text, and parsed by each layer.
#![no_main]

use cangauge::canopen::emcy::Emergency;
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use cangauge::canopen::nmt::{ErrorControlMessage, NmtCommand};
use cangauge::canopen::wire_length::frame_bits;
use cangauge_fuzz::Bytes;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(text) = std::str::from_utf8(data)
        && let Ok(frame) = text.parse::<Frame>()
    {
        assert_eq!(frame.to_string().parse(), Ok(frame));
        assert!(frame.data().len() <= 8);
    }
    let mut bytes = Bytes(data);
    while !bytes.is_empty() {
        let frame = bytes.frame(CanId::emergency(cangauge_fuzz::node()));
        assert_eq!(frame.to_string().parse(), Ok(frame));
        assert!(frame_bits(&frame) >= 44);
        if let Some(emergency) = Emergency::parse(&frame) {
            assert!(!Emergency::class(emergency.code).is_empty());
        }
        if let Some((command, node)) = NmtCommand::parse(&frame) {
            assert_eq!(NmtCommand::parse(&command.frame(node)), Some((command, node)));
        }
        if let Some((node, _)) = ErrorControlMessage::parse(&frame) {
            // An emergency without data is the boot-up message of devices before CiA 301 version 4.
            let is_old_boot_up = frame.id() == CanId::emergency(node) && frame.data().is_empty();
            assert!(frame.id() == CanId::heartbeat(node) || is_old_boot_up);
        }
    }
});
