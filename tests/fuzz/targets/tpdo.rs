//! Decodes TPDOs by arbitrary mappings: no more samples than mapped objects, and only received bits.
#![no_main]

use cangauge::bus::Received;
use cangauge::bus::time::{Mono, Stamp, Wall};
use cangauge::canopen::id::CanId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::pdo::{CobId, MappingEntry, TpdoNumber, field_layout};
use cangauge::canopen::value::DataType;
use cangauge::device::unit::Unit;
use cangauge::measure::decode::{Decoded, Decoder};
use cangauge::measure::layout::{Signal, Tpdo};
use cangauge::node::Node;
use cangauge_fuzz::{Bytes, node};
use libfuzzer_sys::fuzz_target;
use std::time::Duration;

const TPDO: u32 = 0x185;

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let head = bytes.byte();
    let mut device = Node::new(node());
    device.signals.push(Signal {
        name: "pressure".into(),
        channel: 1,
        value_object: (ObjectId::new(0x9130, 1), Some(DataType::Integer(4))),
        other_objects: Vec::new(),
        status: (head & 1 != 0).then_some(ObjectId::new(0x6150, 1)),
        has_marker: head & 2 != 0,
        unit: Some(Unit(bytes.long())),
        digits: Some(bytes.byte()),
        lacks_scale: bytes.byte() == 0,
        rules: cangauge::measure::layout::Rules::default(),
        range: cangauge::measure::layout::MeasuringRange::Unknown,
    });
    let mapping: Vec<MappingEntry> = (0..head >> 4).map(|_| MappingEntry::from_word(bytes.long())).collect();
    let bits: usize = field_layout(&mapping).iter().map(|field| usize::from(field.entry.bits)).sum();
    let number = TpdoNumber::new(1).expect("1 to 512");
    let mapped = mapping.len();
    device.tpdos.push(Tpdo { number, cob_id: CobId(TPDO), transmission: None, event_timer_ms: None, mapping });
    let mut decoder = Decoder::default();
    decoder.add(device.layout(), &[]);
    assert!(decoder.sources().len() <= mapped);
    let at = Stamp { mono: Mono::START, wall: Wall::at(Duration::ZERO) };
    while !bytes.is_empty() {
        let frame = bytes.frame(CanId::standard(0x185).expect("eleven bits"));
        let mut samples = Vec::new();
        match decoder.decode(&Received { frame, at }, &mut samples) {
            // A TPDO with an empty mapping is not decoded.
            Decoded::OtherFrame => {
                assert!(bits == 0 || frame.is_remote() || Some(frame.id()) != CanId::standard(0x185))
            }
            Decoded::Paused(_) => panic!("a TPDO is held without a request"),
            Decoded::WrongLength(_) => assert_ne!(frame.data().len(), bits.div_ceil(8)),
            Decoded::Tpdo(of) => {
                assert_eq!((of, frame.data().len()), (node(), bits.div_ceil(8)));
                assert!(samples.len() <= mapped);
                for sample in &samples {
                    assert!(sample.source < decoder.sources().len());
                    if let Some(number) = sample.value {
                        assert!(number.is_finite() && !number.to_string().is_empty());
                    }
                }
                continue;
            }
        }
        assert!(samples.is_empty());
    }
});
