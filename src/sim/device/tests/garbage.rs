//! Tests with random frames.

use super::*;
use crate::canopen::id::CanId;
use proptest::prelude::*;

fn frame() -> impl Strategy<Value = Frame> {
    // Most frames have identifiers that the devices receive.
    let id = prop_oneof![
        3 => prop::sample::select(vec![0x000u16, 0x080, 0x601, 0x602, 0x603, 0x67f, 0x701, 0x702, 0x7e5]),
        1 => 0u16..0x800,
    ];
    let data = prop::collection::vec(any::<u8>(), 0..=8);
    (id, data, prop::bool::weighted(0.1), prop::bool::weighted(0.1)).prop_map(|(id, data, remote, extended)| {
        let id = if extended { CanId::Extended(id.into()) } else { CanId::Standard(id) };
        let len = u8::try_from(data.len()).expect("at most 8");
        if remote { Frame::remote(id, len) } else { Frame::new(id, &data) }.expect("at most 8")
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// After random frames there is no panic, time advances, and every device boots after a reset.
    #[test]
    fn any_traffic_is_survived(frames in prop::collection::vec(frame(), 1..60)) {
        let kinds = [("mh4", 1), ("d20", 2), ("mc1609", 3), ("dps", 127)];
        let mut bus = bus(kinds.map(|(kind, id)| constant(kind, id, 5.0)));
        for frame in frames {
            bus.send(&frame).expect("room");
            let until = bus.now().mono + Duration::from_millis(7);
            prop_assert!(receive(&mut bus, until).len() < 100);
        }
        bus.send(&"000#8100".parse().expect("a frame")).expect("room");
        let until = bus.now().mono + Duration::from_millis(400);
        let received = receive(&mut bus, until);
        for (_, id) in kinds {
            let boot_up = Frame::byte(CanId::heartbeat(node(id)), 0).to_string();
            prop_assert!(received.contains(&boot_up), "{boot_up} in {received:?}");
        }
    }
}
