//! Simulated devices on a bus with other participants: a real interface, or a socket.

use crate::bus::memory::{Outbox, Station, Tuning};
use crate::bus::time::Mono;
use crate::bus::{Bus, BusError, Event};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::wire_length::priority;
use crate::sim::Device;
use std::time::Duration;

/// The wait if the bus accepts no more frames.
const QUEUE_RETRY_INTERVAL: Duration = Duration::from_millis(1);

/// The longest single wait. The value is not critical.
const MAX_WAIT: Duration = Duration::from_secs(3600);

/// Runs stations on `bus` until the user asks to stop, or until `until`.
///
/// A bus does not return frames to their sender, so frames are passed to the other stations here. A station at a
/// different bit rate than the bus neither receives nor sends; it cannot cause bus errors.
///
/// # Errors
/// The bus failed. A full transmit queue is not an error: the frame waits.
pub fn run(
    bus: &mut dyn Bus,
    stations: Vec<Box<dyn Station>>,
    until: Option<Mono>,
    mut console: Option<Console<'_>>,
) -> Result<Vec<Box<dyn Station>>, BusError> {
    let hosted = stations.into_iter().map(|station| (station, Outbox::default())).collect();
    let mut host = Host { hosted, bit_rate: bus.bit_rate() };
    let now = bus.now().mono;
    for (station, out) in &mut host.hosted {
        host.bit_rate.into_iter().for_each(|bit_rate| station.on_bus_bit_rate(bit_rate));
        station.power_on(now, out);
    }
    loop {
        let now = bus.now().mono;
        host.wake(now);
        let full = !host.send(bus)?;
        let next = host.next_wake().unwrap_or(now + MAX_WAIT);
        let next = if full { next.min(now + QUEUE_RETRY_INTERVAL) } else { next };
        let deadline = until.map_or(next, |until| until.min(next));
        match bus.receive(deadline)? {
            Event::Frame(received) => host.deliver(None, received.at.mono, &received.frame),
            Event::Interrupted if console.as_mut().is_some_and(|console| host.execute_line(console, bus.mono())) => {}
            Event::Interrupted | Event::Ended => break,
            Event::Timeout if until.is_some_and(|until| bus.now().mono >= until) => break,
            Event::Link(true) => host.retime(bus.bit_rate()),
            Event::Timeout | Event::Fault(..) | Event::Dropped(_) | Event::Link(false) => {}
        }
    }
    Ok(host.hosted.into_iter().map(|(station, _)| station).collect())
}

/// The commands of a user while the simulation runs. Each line comes with an interrupt, which ends a wait.
pub struct Console<'a> {
    /// The lines.
    pub lines: std::sync::mpsc::Receiver<String>,
    /// Receives the reason why a line was not executed.
    pub refuse: &'a mut dyn FnMut(&str),
}

struct Host {
    hosted: Vec<(Box<dyn Station>, Outbox)>,
    /// The bit rate of the bus, if it is known.
    bit_rate: Option<u32>,
}

impl Host {
    fn next_wake(&self) -> Option<Mono> {
        self.hosted.iter().filter_map(|(station, _)| station.next_wake()).min()
    }

    /// Executes the line that came with an interrupt. Returns `false` without a line: then the user asks to stop.
    fn execute_line(&mut self, console: &mut Console<'_>, now: Mono) -> bool {
        let Ok(line) = console.lines.try_recv() else { return false };
        if let Err(why) = self.execute(&line, now) {
            (console.refuse)(&format!("\"{}\": {why}", line.escape_debug()));
        }
        true
    }

    /// Executes `pressure 1 5.2bar`, `silent 1`, `emcy 1 F001`, `unplug 1`: the second word is the node-ID.
    fn execute(&mut self, line: &str, now: Mono) -> Result<(), String> {
        const USAGE: &str = "commands: pressure 1 5.2bar, silent 1, talk 1, emcy 1 F001, unplug 1, plug 1";
        let mut words: Vec<&str> = line.split_whitespace().collect();
        if words.is_empty() {
            return Ok(());
        }
        if words.len() < 2 {
            return Err(USAGE.to_owned());
        }
        let node: NodeId = words.remove(1).parse().map_err(|_| USAGE.to_owned())?;
        let devices = self.hosted.iter_mut().filter_map(|(station, out)| {
            let station: &mut dyn std::any::Any = &mut **station;
            Some((station.downcast_mut::<Device>()?, out))
        });
        let mut found = devices.filter(|(device, _)| device.node() == Some(node)).peekable();
        if found.peek().is_none() {
            return Err(format!("no simulated device has node-ID {node}"));
        }
        found.try_for_each(|(device, out)| device.command(&words, now, out))
    }

    fn wake(&mut self, now: Mono) {
        for (station, out) in &mut self.hosted {
            if station.next_wake().is_some_and(|due| due <= now) {
                station.wake(now, out);
            }
        }
    }

    /// Records that the interface is up again, perhaps at another bit rate.
    fn retime(&mut self, bit_rate: Option<u32>) {
        if bit_rate != self.bit_rate {
            self.bit_rate = bit_rate;
            for (station, _) in &mut self.hosted {
                bit_rate.into_iter().for_each(|bit_rate| station.on_bus_bit_rate(bit_rate));
            }
        }
    }

    /// Whether a station is on the bus at its bit rate.
    fn is_on_the_bus(&self, station: &dyn Station) -> bool {
        match station.tuning() {
            Tuning::Follows => true,
            Tuning::At(rate) => self.bit_rate.is_none_or(|bit_rate| bit_rate == rate),
            Tuning::Off => false,
        }
    }

    /// Delivers a frame to every station except its sender.
    fn deliver(&mut self, sender: Option<usize>, now: Mono, frame: &Frame) {
        for index in 0..self.hosted.len() {
            if sender != Some(index) && self.is_on_the_bus(&*self.hosted[index].0) {
                let (station, out) = &mut self.hosted[index];
                station.receive(now, frame, out);
            }
        }
    }

    /// Sends pending frames, the lowest identifier first; `false` if the bus accepts no more.
    fn send(&mut self, bus: &mut dyn Bus) -> Result<bool, BusError> {
        for index in 0..self.hosted.len() {
            if !self.is_on_the_bus(&*self.hosted[index].0) {
                self.hosted[index].1.clear();
            }
        }
        loop {
            let waiting = self.hosted.iter().enumerate();
            let heads = waiting.filter_map(|(index, (_, out))| Some((priority(out.front()?), index)));
            let Some((_, index)) = heads.min() else { return Ok(true) };
            let Some(frame) = self.hosted[index].1.front().copied() else { return Ok(true) };
            match bus.send(&frame) {
                Ok(()) => {}
                Err(BusError::QueueFull) => return Ok(false),
                Err(error) => return Err(error),
            }
            let now = bus.now().mono;
            let (station, out) = &mut self.hosted[index];
            out.pop();
            station.sent(now, &frame);
            self.deliver(Some(index), now, &frame);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::memory::{Clock, MemoryBus};
    use crate::sim::Setup;
    use std::collections::VecDeque;

    /// The peer on the bus: sends at given times and keeps the frames received.
    #[derive(Default)]
    struct Master {
        planned: VecDeque<(Mono, Frame)>,
        received: Vec<String>,
    }

    impl Station for Master {
        fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

        fn receive(&mut self, _: Mono, frame: &Frame, _: &mut Outbox) {
            self.received.push(frame.to_string());
        }

        fn wake(&mut self, now: Mono, out: &mut Outbox) {
            while self.next_wake().is_some_and(|due| due <= now) {
                self.planned.pop_front().into_iter().for_each(|(_, frame)| out.send(frame));
            }
        }

        fn next_wake(&self) -> Option<Mono> {
            self.planned.front().map(|(due, _)| *due)
        }

        fn sent(&mut self, _: Mono, _: &Frame) {}
    }

    fn ms(milliseconds: u64) -> Mono {
        Mono::at(Duration::from_millis(milliseconds))
    }

    fn device(kind: &str, node: u8) -> Box<dyn Station> {
        let model = crate::device::catalog::by_name(kind).expect("built in");
        let mut setup = Setup::new(model, crate::canopen::id::NodeId::new(node).expect("a node-ID"));
        for channel in &mut setup.channels {
            (channel.base, channel.amplitude, channel.noise) = (f64::from(channel.channel), 0.0, 0.0);
        }
        Box::new(Device::new(setup).expect("a device"))
    }

    fn master(frames: &[(u64, &str)]) -> Master {
        let planned = frames.iter().map(|(at, text)| (ms(*at), text.parse().expect("a frame"))).collect();
        Master { planned, ..Master::default() }
    }

    fn received(bus: &MemoryBus) -> Vec<String> {
        bus.stations::<Master>().flat_map(|master| master.received.clone()).collect()
    }

    #[test]
    fn devices_answer_a_master_on_the_bus() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(master(&[(10, "605#4000100000000000"), (20, "000#0100"), (30, "080#")]));
        let stations =
            run(&mut bus, vec![device("mh4", 5), device("dps", 127)], Some(ms(150)), None).expect("no error");
        assert_eq!(
            received(&bus),
            ["705#00", "77F#00", "585#4300100094018200", "185#0000803F00", "1FF#E8030000"].map(str::to_owned)
        );
        assert_eq!(stations.len(), 2);
        assert_eq!(bus.now().mono, ms(150));
    }

    #[test]
    fn stations_receive_the_frames_of_other_stations_only() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        let hosted: Vec<Box<dyn Station>> = vec![Box::new(master(&[(10, "000#0105"), (20, "080#")])), device("mh4", 5)];
        let stations = run(&mut bus, hosted, Some(ms(50)), None).expect("no error");
        let station: &dyn std::any::Any = &*stations[0];
        let master: &Master = station.downcast_ref().expect("the master");
        assert_eq!(master.received, ["705#00", "185#0000803F00"]);
    }

    #[test]
    fn full_queue_loses_no_frame() {
        let mut bus = MemoryBus::new(Clock::Virtual).with_queue_length(1);
        bus.attach(master(&[(10, "000#0103")]));
        run(&mut bus, vec![device("mc1609", 3)], Some(ms(120)), None).expect("no error");
        assert_eq!(
            received(&bus),
            ["703#00", "183#0A0014001E002800", "283#32003C0046005000", "383#5A0064006E007800", "483#82008C009600A000"]
                .map(str::to_owned)
        );
    }

    #[test]
    fn device_at_another_bit_rate_neither_receives_nor_sends() {
        // LSS switches to 125 kbit/s. Then a request at 250 kbit/s and the time for a heartbeat follow.
        let configure = ["7E5#0401000000000000", "7E5#1300040000000000", "7E5#1500000000000000"];
        let mut plan = vec![(1, "605#2B17100064000000")];
        plan.extend(configure.iter().zip([10, 20, 30]).map(|(frame, at)| (at, *frame)));
        plan.push((40, "605#4000100000000000"));
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(master(&plan));
        run(&mut bus, vec![device("mh4", 5)], Some(ms(500)), None).expect("no error");
        assert_eq!(received(&bus), ["705#00", "585#6017100000000000", "705#7F", "7E4#1300000000000000"]);
    }

    #[test]
    fn interrupt_ends_the_run() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.interrupt_at(ms(70));
        run(&mut bus, vec![device("mh4", 5)], None, None).expect("no error");
        assert_eq!(bus.now().mono, ms(70));
    }

    #[test]
    fn lines_change_values_and_cause_faults() {
        let mut bus = MemoryBus::new(Clock::Virtual);
        bus.attach(master(&[
            (5, "000#0105"),
            (40, "080#"),
            (120, "605#4000100000000000"),
            (200, "605#4000100000000000"),
        ]));
        let (sender, lines) = std::sync::mpsc::channel();
        let plan = [
            (10, "pressure 5 1.5bar"),
            (15, "pressure 5 2"),
            (20, "volume 5 1l"),
            (21, "pressure 6 1bar"),
            (22, "dance"),
            (60, "emcy 5 f001"),
            (70, "emcy 5 0"),
            (100, "silent 5"),
            (150, "talk 5"),
            (220, "unplug 5"),
            (230, "plug 5"),
            (231, "plug 5"),
        ];
        for (at, line) in plan {
            sender.send(line.to_owned()).expect("sent");
            bus.interrupt_at(ms(at));
        }
        let mut refused = Vec::new();
        let console = Console { lines, refuse: &mut |why: &str| refused.push(why.to_owned()) };
        run(&mut bus, vec![device("mh4", 5)], Some(ms(300)), Some(console)).expect("no error");
        assert_eq!(
            received(&bus),
            [
                "705#00",
                "185#0000004000",
                "085#01F0810000000000",
                "085#0000000000000000",
                "585#4300100094018200",
                "705#00"
            ]
        );
        assert_eq!(
            refused,
            [
                "\"volume 5 1l\": no signal \"volume\" (it has: pressure, temperature)",
                "\"pressure 6 1bar\": no simulated device has node-ID 6",
                "\"dance\": commands: pressure 1 5.2bar, silent 1, talk 1, emcy 1 F001, unplug 1, plug 1",
                "\"plug 5\": the device is not unplugged",
            ]
        );
    }
}
