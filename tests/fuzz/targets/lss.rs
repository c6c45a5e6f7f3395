//! One LSS service with arbitrary frames.
#![no_main]

use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::lss::{Answer, Exchange, ExchangeError, LssAddress, LssRange, Mode, Part, Request};
use cangauge_fuzz::Bytes;
use libfuzzer_sys::fuzz_target;

fn exchange(bytes: &mut Bytes<'_>) -> Exchange {
    let head = bytes.byte();
    let part = Part::from_number(head >> 4 & 3).expect("0 to 3");
    let address = LssAddress::new([bytes.long(), bytes.long(), bytes.long(), bytes.long()]);
    Exchange::new(match head & 0xf {
        0 => return Exchange::select(&address),
        1 => return Exchange::identify(&LssRange::from(address)),
        2 => Request::SwitchGlobal(Mode::Configuration),
        3 => Request::ConfigureNodeId(NodeId::new(bytes.byte()).ok()),
        4 => Request::ConfigureBitTiming { table: bytes.byte(), index: bytes.byte() },
        5 => Request::ActivateBitTiming { delay_ms: bytes.word() },
        6 => Request::Store,
        7 | 8 => Request::Inquire(part),
        9 | 10 => Request::InquireNodeId,
        11 => Request::IdentifyUnconfigured,
        _ => Request::Fastscan { number: bytes.long(), bit_check: bytes.byte(), sub: part, next: part },
    })
}

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let mut exchange = exchange(&mut bytes);
    for frame in exchange.ask() {
        assert_eq!((frame.id(), frame.len()), (CanId::LSS_MASTER, 8));
    }
    let (mut heard, mut ours) = (0, 0);
    while !bytes.is_empty() && heard < 4096 {
        let frame = bytes.frame(CanId::LSS_SLAVE);
        heard += 1;
        if exchange.on_frame(&frame) {
            ours += 1;
            assert_eq!(frame.id(), CanId::LSS_SLAVE);
            assert!(exchange.is_answered(), "an answer to a service without answers");
        }
    }
    assert_eq!(exchange.has_answer(), ours > 0);
    assert!(exchange.answers().len() <= ours);
    match exchange.one() {
        Ok(Answer::Acknowledge(code)) => assert!(code.is_success()),
        Ok(_) => assert!(ours > 0),
        Err(ExchangeError::NoAnswer) => assert_eq!(ours, 0),
        Err(ExchangeError::Several(_)) => assert!(ours > 1),
        Err(_) => {}
    }
});
