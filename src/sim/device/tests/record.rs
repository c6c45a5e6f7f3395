//! Tests of the record of sent values.

use super::*;
use std::sync::Mutex;

/// A file in memory that the test can read.
#[derive(Clone, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl std::io::Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("not poisoned").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

#[test]
fn record_has_the_time_of_the_complete_frame() {
    let file = Shared::default();
    let recorder = Recorder::new(Box::new(file.clone())).expect("memory");
    let mut setup = constant("mh4", 5, 5.0);
    setup.overloads =
        vec![(1, Overload { from: Duration::from_millis(49), until: Duration::MAX, direction: Direction::High })];
    setup.start = true;
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Device::new(setup).expect("a device").recording(recorder.clone()));
    let mut dps = constant("dps", 127, 17.898);
    dps.start = true;
    bus.attach(Device::new(dps).expect("a device").recording(recorder.clone()));
    let mut frames = Vec::new();
    for at in [10, 60, 110] {
        bus.receive(ms(at - 10)).expect("no error");
        bus.send(&"080#".parse().expect("a frame")).expect("room");
        while let Ok(Event::Frame(received)) = bus.receive(ms(at)) {
            if !received.frame.data().is_empty() && received.frame.len() >= 4 && received.frame.len() < 8 {
                frames.push((received.at.mono.since_start().as_micros(), received.frame));
            }
        }
    }
    recorder.flush().expect("memory");
    let text = String::from_utf8(file.0.lock().expect("not poisoned").clone()).expect("text");
    let lines: Vec<&str> = text.lines().collect();
    let at: Vec<u128> = frames.iter().map(|(at, _)| *at).collect();
    assert_eq!(
        lines,
        [
            crate::sim::HEADER.to_owned(),
            format!("{},5,pressure,5,bar,ok,0x0000A040", at[0]),
            format!("{},5,pressure,,bar,overload-high,0x0000C07F", at[1]),
            format!("{},127,pressure,17.898,psi,,0xEA450000", at[2]),
            format!("{},5,pressure,,bar,overload-high,0x0000C07F", at[3]),
        ]
    );
}

#[test]
fn tpdo_pending_at_a_reset_is_neither_sent_nor_recorded() {
    let file = Shared::default();
    let recorder = Recorder::new(Box::new(file.clone())).expect("memory");
    let mut setup = Setup::new(catalog::by_name("mh4").expect("built in"), node(5));
    setup.start = true;
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Device::new(setup).expect("a device").recording(recorder.clone()));
    receive(&mut bus, ms(10));
    // The reset waits for the SYNC and has priority over the TPDO that the SYNC causes.
    bus.send(&"080#".parse().expect("a frame")).expect("room");
    bus.send(&"000#8105".parse().expect("a frame")).expect("room");
    assert_eq!(receive(&mut bus, ms(200)), ["705#00"]);
    let sent = ask(&mut bus, "080#");
    assert_eq!(sent.len(), 1);
    recorder.flush().expect("memory");
    let text = String::from_utf8(file.0.lock().expect("not poisoned").clone()).expect("text");
    let raw: Vec<&str> = text.lines().skip(1).filter_map(|line| line.rsplit_once(",0x")).map(|(_, raw)| raw).collect();
    assert_eq!(raw, [&sent[0][4..12]]);
}

#[test]
fn record_continues_after_the_controller_was_off() {
    let file = Shared::default();
    let recorder = Recorder::new(Box::new(file.clone())).expect("memory");
    let mut setup = constant("dps", 33, 17.898);
    setup.start = true;
    setup.seed = 1;
    setup.channels.iter_mut().for_each(|channel| channel.noise = 0.5);
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(Device::new(setup).expect("a device").recording(recorder.clone()));
    // A device at another bit rate destroys every frame, until the controllers are bus-off, one after the other.
    let mut other = constant("mc1609", 11, 1.0);
    other.bit_rate = Some(500_000);
    other.set = vec![(id("0x1017"), Scalar::Integer(1000))];
    bus.attach(Device::new(other).expect("a device"));
    let mut sent = Vec::new();
    while let Ok(event) = bus.receive(ms(2000)) {
        match event {
            Event::Frame(received) if received.frame.len() == 4 => {
                sent.push(received.frame.to_string().split_off(4));
            }
            Event::Timeout => break,
            _ => {}
        }
    }
    recorder.flush().expect("memory");
    let text = String::from_utf8(file.0.lock().expect("not poisoned").clone()).expect("text");
    let raw: Vec<&str> = text.lines().skip(1).filter_map(|line| line.rsplit_once(",0x")).map(|(_, raw)| raw).collect();
    assert!(sent.len() > 3 && sent.len() < 18, "some went out, and some did not: {}", sent.len());
    assert_eq!(raw, sent);
}
