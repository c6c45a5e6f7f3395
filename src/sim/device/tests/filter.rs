//! Tests of filters by the frames on the bus.

use super::*;

/// Returns the values of channel 1 in the TPDOs after `count` SYNCs, one every 100 ms.
fn on_sync(bus: &mut MemoryBus, id: &str, count: usize) -> Vec<i16> {
    let mut values = Vec::new();
    for _ in 0..count {
        let received = ask(bus, "080#");
        let tpdo = received.iter().find(|frame| frame.starts_with(id)).expect("a TPDO");
        let frame: Frame = tpdo.parse().expect("a frame");
        values.push(i16::from_le_bytes(frame.data()[..2].try_into().expect("two bytes")));
        let until = bus.now().mono + Duration::from_millis(95);
        receive(bus, until);
    }
    values
}

fn spread(values: &[i16]) -> i16 {
    values.iter().max().expect("values") - values.iter().min().expect("values")
}

/// Creates an MC1609 whose channel 1 is at 500.0 degC with a noise of 50.0 K.
fn mc1609(set: &[(&str, i64)]) -> MemoryBus {
    let mut setup = constant("mc1609", 5, 500.0);
    setup.channels[0].noise = 50.0;
    setup.set = set.iter().map(|(object, value)| (id(object), Scalar::Integer(*value))).collect();
    setup.set.push((id("1800:2"), Scalar::Integer(1)));
    setup.start = true;
    bus([setup])
}

#[test]
fn the_mean_since_the_last_pdo_is_quieter_than_the_samples() {
    // The mean of 100 samples has a tenth of their standard deviation, 2.9 K instead of 29 K.
    for kind in [0, 2] {
        let values = on_sync(&mut mc1609(&[("61A0:1", kind)]), "185", 40);
        let spread = spread(&values[1..]);
        assert!((50..=200).contains(&spread), "{spread}: {values:?}");
    }
    // A moving average with constant 1 does not filter.
    let values = on_sync(&mut mc1609(&[("61A0:1", 1), ("61A1:1", 1)]), "185", 40);
    assert!(spread(&values) > 700, "{values:?}");
    let values = on_sync(&mut mc1609(&[("61A0:1", 1), ("61A1:1", 100)]), "185", 40);
    assert!(spread(&values[10..]) < 200, "{values:?}");
}

#[test]
fn filter_acts_as_soon_as_it_is_written() {
    let mut setup = constant("mh4", 5, 5.0);
    setup.channels[0].noise = 1.0;
    let mut bus = bus([setup]);
    let read = |bus: &mut MemoryBus| {
        let answer = ask(bus, "605#4030610100000000").pop().expect("an answer");
        let frame: Frame = answer.parse().expect("a frame");
        f32::from_le_bytes(frame.data()[4..].try_into().expect("four bytes"))
    };
    receive(&mut bus, ms(1));
    let raw: Vec<f32> = (0..20).map(|_| read(&mut bus)).collect();
    assert!(raw.iter().any(|value| (value - raw[0]).abs() > 0.5), "{raw:?}");
    // 61A1h:1 = 1024, 61A0h:1 = 1.
    play(&mut bus, &[("605#2BA1610100040000", "585#60A1610100000000")]);
    play(&mut bus, &[("605#2FA0610101000000", "585#60A0610100000000")]);
    let smooth: Vec<f32> = (0..20).map(|_| read(&mut bus)).collect();
    assert!(smooth.windows(2).all(|pair| (pair[0] - pair[1]).abs() < 0.02), "{smooth:?}");
    // Autozero uses the filtered value.
    play(&mut bus, &[("605#232561017A65726F", "585#6025610100000000")]);
    assert!(read(&mut bus).abs() < 0.02);
    // After a reset there is no filter: nothing was stored.
    ask(&mut bus, "000#8105");
    let until = bus.now().mono + Duration::from_millis(200);
    receive(&mut bus, until);
    let raw: Vec<f32> = (0..20).map(|_| read(&mut bus)).collect();
    assert!(raw.iter().any(|value| (value - raw[0]).abs() > 0.5), "{raw:?}");
}
