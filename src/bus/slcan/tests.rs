use super::*;
use crate::bus::{Bus, Wall};

fn at(mono: Duration) -> Stamp {
    Stamp { mono: Mono::at(mono), wall: Wall::at(Duration::from_secs(1_436_509_052) + mono) }
}

/// A simulated adapter with the command set of the LAWICEL manuals.
#[derive(Clone, Default)]
struct Adapter {
    /// Whether the adapter never answers.
    is_silent: bool,
    /// The characters at the end of each answer.
    end: &'static str,
    /// Input before this moment is ignored.
    starts_at: Duration,
    /// Answers to `V`, `v` and `N`; empty for a rejection.
    version: [&'static str; 3],
    /// Rejected commands.
    rejects: Vec<&'static str>,
    /// How many of the next frames are rejected.
    is_full_for: u32,
    /// The time after a command in which further commands are lost.
    busy: Duration,
    busy_until: Duration,
    input: Vec<u8>,
    commands: Vec<String>,
}

impl Adapter {
    fn lawicel() -> Adapter {
        Adapter { end: "\r", version: ["V1013", "", "NA123"], ..Adapter::default() }
    }

    fn receive(&mut self, bytes: &[u8], now: Duration) -> Vec<u8> {
        let mut answer = Vec::new();
        let is_awake = now >= self.starts_at;
        for &byte in bytes.iter().filter(|_| is_awake) {
            if byte != b'\r' {
                self.input.push(byte);
                continue;
            }
            let command = String::from_utf8(std::mem::take(&mut self.input)).expect("text");
            if now < self.busy_until || command.is_empty() {
                continue;
            }
            self.busy_until = now + self.busy;
            if !self.is_silent {
                answer.extend(self.answer(&command).bytes());
            }
            self.commands.push(command);
        }
        answer
    }

    fn answer(&mut self, command: &str) -> String {
        const BELL: &str = "\x07";
        let is_frame = command.starts_with(['t', 'T', 'r', 'R']);
        if self.rejects.contains(&command) || is_frame && self.is_full_for > 0 {
            self.is_full_for = self.is_full_for.saturating_sub(u32::from(is_frame));
            return BELL.to_owned();
        }
        let text = match command {
            "V" => self.version[0],
            "v" => self.version[1],
            "N" => self.version[2],
            "F" => "F00",
            _ if is_frame => "z",
            _ => return self.end.to_owned(),
        };
        if text.is_empty() { BELL.to_owned() } else { format!("{text}{}", self.end) }
    }
}

/// The protocol and an adapter on a virtual clock. Transmission takes no time.
struct Bench {
    slcan: Slcan,
    adapter: Adapter,
    out: Output,
    now: Duration,
}

impl Bench {
    fn new(adapter: Adapter, bit_rate: u32, mode: Option<Mode>) -> Bench {
        let mut bench =
            Bench { slcan: Slcan::new(bit_rate, mode), adapter, out: Output::default(), now: Duration::ZERO };
        bench.slcan.start(at(bench.now), &mut bench.out);
        bench
    }

    fn exchange(&mut self) -> Result<(), String> {
        while !self.out.bytes.is_empty() {
            let answer = self.adapter.receive(&std::mem::take(&mut self.out.bytes), self.now);
            self.slcan.receive(&answer, at(self.now), &mut self.out)?;
        }
        Ok(())
    }

    /// Runs until `done` or the given time.
    fn run(&mut self, until: Duration, done: impl Fn(&Slcan) -> bool) -> Result<(), String> {
        self.exchange()?;
        while !done(&self.slcan) {
            let due = self.slcan.next_wake().map_or(until, |due| due.since_start());
            if due >= until {
                self.now = until;
                return Ok(());
            }
            self.now = self.now.max(due);
            self.slcan.wake(at(self.now), &mut self.out)?;
            self.exchange()?;
        }
        Ok(())
    }

    fn opened(adapter: Adapter, bit_rate: u32, mode: Option<Mode>) -> Result<Bench, String> {
        let mut bench = Bench::new(adapter, bit_rate, mode);
        bench.run(Duration::from_secs(20), Slcan::is_open)?;
        assert!(bench.slcan.is_open());
        Ok(bench)
    }

    fn send(&mut self, text: &str) -> Result<(), BusError> {
        let sent = self.slcan.send(&text.parse().expect("a frame"), at(self.now), &mut self.out);
        self.exchange().expect("no error");
        sent
    }

    fn events(&mut self) -> Vec<String> {
        let text = |event| match event {
            Event::Frame(received) => received.frame.to_string(),
            Event::Fault(fault, _) => fault.to_string(),
            other => format!("{other:?}"),
        };
        self.out.events.drain(..).map(text).collect()
    }
}

fn commands(bench: &Bench) -> String {
    let mut commands = bench.adapter.commands.clone();
    commands.dedup();
    commands.join(" ")
}

#[test]
fn channel_is_opened_step_by_step() {
    let normal = Some(Mode::Normal);
    let bench = Bench::opened(Adapter::lawicel(), 250_000, normal).expect("opened");
    assert_eq!(commands(&bench), "C V v N S5 Z1 O F");
    assert!(bench.now < Duration::from_millis(200), "{:?}", bench.now);
    assert_eq!(bench.slcan.timestamps(), TimestampSource::Hardware);
    let canable =
        Adapter { version: ["CANable-3ab9e32", "", ""], end: "\r\n", rejects: vec!["Z1"], ..Adapter::default() };
    let bench = Bench::opened(canable, 750_000, normal).expect("opened");
    assert_eq!(commands(&bench), "C V v N S7 Z1 M0 O F");
    assert_eq!(bench.slcan.timestamps(), TimestampSource::Program);
    // A board that ignores everything for its first two seconds.
    let slow = Adapter { starts_at: Duration::from_secs(2), ..Adapter::lawicel() };
    let bench = Bench::opened(slow, 125_000, normal).expect("opened");
    assert_eq!(commands(&bench), "C V v N S4 Z1 O F");
}

#[test]
fn mute_adapter_is_opened_and_gets_frames_slowly() {
    let silent = Adapter { is_silent: true, busy: Duration::from_micros(900), ..Adapter::default() };
    let mut bench = Bench::opened(silent, 250_000, Some(Mode::Normal)).expect("opened");
    assert!(bench.now < Duration::from_secs(3), "{:?}", bench.now);
    for number in 0..5 {
        bench.send(&format!("605#{number:02}")).expect("sent");
    }
    bench.run(bench.now + Duration::from_secs(1), |slcan| !slcan.is_busy()).expect("no error");
    assert!(commands(&bench).ends_with("S5 Z1 O F t605100 t605101 t605102 t605103 t605104"), "{}", commands(&bench));
    assert!(matches!(bench.slcan.can_set_bit_rate(), Err(BusError::Unsupported(_))));
}

#[test]
fn rates_and_modes_that_are_not_certain_are_refused() {
    let unknown = || Adapter { version: ["Vx", "", ""], ..Adapter::lawicel() };
    let error = |adapter, bit_rate, mode| Bench::opened(adapter, bit_rate, Some(mode)).err().expect("an error");
    let why = error(unknown(), 800_000, Mode::Normal);
    assert!(why.starts_with("cannot confirm that the adapter (Vx) supports 800000 bit/s"), "{why}");
    assert_eq!(
        error(unknown(), 250_000, Mode::ListenOnly),
        "cannot confirm that the adapter (Vx) supports listen-only mode"
    );
    let silent = Adapter { is_silent: true, ..Adapter::default() };
    let why = error(silent, 250_000, Mode::ListenOnly);
    assert_eq!(why, "cannot confirm that the adapter (version unknown) supports listen-only mode");
    let rejecting = Adapter { rejects: vec!["S8"], ..Adapter::lawicel() };
    assert_eq!(error(rejecting, 1_000_000, Mode::Normal), "the adapter (V1013) rejects the bit rate 1000000");
    let mut bench = Bench::opened(Adapter::lawicel(), 250_000, Some(Mode::ListenOnly)).expect("opened");
    assert!(commands(&bench).ends_with("Z1 L F"), "{}", commands(&bench));
    assert!(matches!(bench.send("000#8100"), Err(BusError::ReceiveOnly(_))));
}

#[test]
fn rejected_frames_are_sent_again() {
    let mut bench =
        Bench::opened(Adapter { is_full_for: 3, ..Adapter::lawicel() }, 250_000, Some(Mode::Normal)).expect("opened");
    bench.send("080#").expect("sent");
    bench.send("701#R").expect("sent");
    bench.run(bench.now + Duration::from_millis(100), |slcan| !slcan.is_busy()).expect("no error");
    assert!(
        bench.adapter.commands.ends_with(&["t0800".to_owned(), "r7010".to_owned()]),
        "{:?}",
        bench.adapter.commands
    );
    assert_eq!(bench.events(), [""; 0]);
    // No node acknowledges.
    bench.adapter.is_full_for = u32::MAX;
    bench.send("080#").expect("sent");
    bench.run(bench.now + Duration::from_secs(1), |slcan| !slcan.is_busy()).expect("no error");
    assert_eq!(bench.events(), [Fault::TransmitTimeout.to_string()]);
    let full = (0..100).map(|_| bench.send("080#")).find_map(Result::err);
    assert!(matches!(full, Some(BusError::QueueFull)));
}

#[test]
fn frames_and_garbage_are_received() {
    let mut bench = Bench::opened(Adapter::lawicel(), 250_000, Some(Mode::Normal)).expect("opened");
    let text = b"t1852112200FF\rT18FF00011AA0100\r84001\x00\xff\rt7FF0\rr70110101\rF\x07\r";
    for cut in 0..text.len() {
        for piece in [&text[..cut], &text[cut..]] {
            bench.slcan.receive(piece, at(bench.now), &mut bench.out).expect("received");
        }
        let garbled = Fault::Garbled.to_string();
        let expected = ["185#1122", "18FF0001#AA", &garbled, "7FF#", "701#R1", &garbled];
        assert_eq!(bench.events(), expected, "{cut}");
    }
}

#[test]
fn error_flags_are_asked_for_and_reported() {
    let mut bench = Bench::opened(Adapter::lawicel(), 250_000, Some(Mode::Normal)).expect("opened");
    bench.run(bench.now + Duration::from_millis(1500), |_| false).expect("no error");
    assert!(commands(&bench).ends_with("O F"), "{}", commands(&bench));
    let asked = bench.adapter.commands.iter().filter(|command| *command == "F").count();
    assert!((2..=3).contains(&asked), "{asked}");
    bench.slcan.pending = Some(Pending::Step(Step::Flags));
    bench.slcan.receive(b"FA4\r", at(bench.now), &mut bench.out).expect("received");
    let expected = [Fault::Protocol, Fault::ErrorPassive, Fault::ErrorWarning].map(|fault| fault.to_string());
    assert_eq!(bench.events(), expected);
}

#[test]
fn bit_rate_is_changed_and_restored() {
    let mut bench =
        Bench::opened(Adapter { rejects: vec!["S6"], ..Adapter::lawicel() }, 250_000, None).expect("opened");
    assert_eq!((commands(&bench).as_str(), bench.slcan.bit_rate()), ("C V v N", Some(250_000)));
    let mut set = |to, commands: &[&str]| {
        bench.adapter.commands.clear();
        let result = bench.slcan.set_channel(to, at(bench.now), &mut bench.out);
        bench.run(bench.now + Duration::from_secs(2), Slcan::is_open).expect("no error");
        assert_eq!(bench.adapter.commands, commands);
        (result, bench.slcan.take_refusal())
    };
    assert!(matches!(set(Some((125_000, Mode::ListenOnly)), &["C", "S4", "Z1", "L", "F"]), (Ok(()), None)));
    let (result, refusal) = set(Some((500_000, Mode::Normal)), &["C", "S6"]);
    assert_eq!((result.is_ok(), refusal.as_deref()), (true, Some("the adapter (V1013) rejects the bit rate 500000")));
    assert!(matches!(set(Some((123_000, Mode::Normal)), &[]), (Err(BusError::BitRate { .. }), None)));
    assert!(matches!(set(None, &["C"]), (Ok(()), None)));
}

/// An adapter at one end of a pseudo terminal.
#[cfg(unix)]
#[test]
fn unplugged_adapter_is_found_again() {
    use crate::bus::remote::{Remote, Use};
    use serial2::SerialPort;
    use std::os::fd::AsRawFd;
    let folder = tempfile::tempdir().expect("a folder");
    let link = folder.path().join("adapter");
    // Connects a simulated adapter. It is unplugged when both values are dropped.
    let plug = |link: std::path::PathBuf| {
        let (host, device) = SerialPort::pair().expect("a pseudo terminal");
        let name = std::fs::read_link(format!("/proc/self/fd/{}", device.as_raw_fd())).expect("a name");
        let _ = std::fs::remove_file(&link);
        std::os::unix::fs::symlink(name, &link).expect("a link");
        (host, device)
    };
    let serve = |host: SerialPort, frame: &'static [u8]| {
        std::thread::spawn(move || {
            let (mut adapter, mut buffer) = (Adapter::lawicel(), [0; 256]);
            while !adapter.commands.iter().any(|command| command == "F") {
                let count = host.read(&mut buffer).unwrap_or(0);
                let answer = adapter.receive(&buffer[..count], Duration::ZERO);
                host.write_all(&answer).expect("written");
            }
            host.write_all(frame).expect("written");
            // Waits until the other end has read the bytes.
            std::thread::sleep(Duration::from_millis(200));
        })
    };
    let (host, device) = plug(link.clone());
    let thread = serve(host, b"t70110500FF\r");
    let remote = Remote::parse(&format!("slcan:{}@250k", link.display())).expect("remote").expect("a name");
    let mut bus = remote.open(Use::Normal).expect("opened");
    let second = remote.open(Use::Normal).err().expect("locked").to_string();
    assert!(second.ends_with("another program uses it"), "{second}");
    let until = bus.mono() + Duration::from_secs(20);
    let mut next = move || match bus.receive(until).expect("an event") {
        Event::Frame(received) => received.frame.to_string(),
        event => format!("{event:?}"),
    };
    assert_eq!(next(), "701#05");
    thread.join().expect("the adapter");
    drop(device);
    assert_eq!(next(), "Link(false)");
    let (host, _device) = plug(link);
    let thread = serve(host, b"t7011050100\r");
    assert_eq!(next(), "Link(true)");
    assert_eq!(next(), "701#05");
    thread.join().expect("the adapter");
}
