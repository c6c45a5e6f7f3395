//! A bus over a byte stream: an adapter at a serial port, or a server on the network. A [`Protocol`] handles the text
//! on the stream. This module connects, waits and reconnects.

use super::interrupt::Interrupts;
use super::port::{Place, Port, Waitable, resolve, wait};
use super::{BitRateControl, Bus, BusError, Event, Filters, Mode, Mono, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
use std::collections::VecDeque;
use std::io;
use std::net::SocketAddr;
use std::time::{Duration, Instant};

/// The longest wait for a TCP connection to one address.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
/// The interval between attempts to reconnect.
const RETRY_INTERVAL: Duration = Duration::from_millis(500);
/// The limit of unsent bytes. With more bytes, the transmit queue is full.
const MAX_UNSENT_BYTES: usize = 16 * 1024;
/// The longest wait for the last bytes when the bus is closed.
const CLOSE_TIMEOUT: Duration = Duration::from_millis(500);

/// The output of a protocol: bytes for the other side, and events for the program.
#[derive(Debug, Default)]
pub(super) struct Output {
    pub(super) bytes: Vec<u8>,
    pub(super) events: VecDeque<Event>,
}

/// The protocol of an adapter or server, as a state machine without I/O and clock.
///
/// The text of an error is the reason why the connection cannot be used.
pub(super) trait Protocol {
    /// Starts on a new connection.
    fn start(&mut self, now: Stamp, out: &mut Output);

    /// Processes received bytes, which arrive in pieces.
    fn receive(&mut self, bytes: &[u8], now: Stamp, out: &mut Output) -> Result<(), String>;

    /// Returns when [`Protocol::wake`] must be called.
    fn next_wake(&self) -> Option<Mono>;

    /// Does what is due at `now`, the moment of [`Protocol::next_wake`].
    fn wake(&mut self, now: Stamp, out: &mut Output) -> Result<(), String>;

    /// Accepts a frame to send.
    fn send(&mut self, frame: &Frame, now: Stamp, out: &mut Output) -> Result<(), BusError>;

    /// Whether frames can be sent and received.
    fn is_open(&self) -> bool;

    /// Whether accepted frames are not yet written to `out`.
    fn is_busy(&self) -> bool {
        false
    }

    /// Closes the connection properly.
    fn close(&mut self, _out: &mut Output) {}

    fn timestamps(&self) -> TimestampSource;

    fn sends_remote_frames(&self) -> bool {
        true
    }

    /// The bit rate in bit/s.
    fn bit_rate(&self) -> Option<u32> {
        None
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        Err(BusError::Unsupported("the bit rate of this bus cannot be set from here".to_owned()))
    }

    /// Starts to set the bit rate and the mode. [`Protocol::is_open`] is true again when this is complete. `None`
    /// closes the channel.
    fn set_channel(&mut self, _to: Option<(u32, Mode)>, _now: Stamp, _out: &mut Output) -> Result<(), BusError> {
        self.can_set_bit_rate()
    }

    /// The present bit rate and mode; `None` if the channel is closed.
    fn channel(&self) -> Option<(u32, Mode)> {
        None
    }

    /// Returns why the other side rejected the last [`Protocol::set_channel`], and clears the reason.
    fn take_refusal(&mut self) -> Option<String> {
        None
    }
}

/// The connection.
enum Link {
    /// Not connected. The next attempt is at this moment.
    Down(Mono),
    /// The connection is in progress, at most until this moment.
    Connecting(Port, Mono),
    Up(Port),
}

/// A bus over a byte stream.
pub(super) struct StreamBus<P: Protocol> {
    name: String,
    place: Place,
    addresses: Vec<SocketAddr>,
    /// The address to try next.
    next_address: usize,
    link: Link,
    protocol: P,
    out: Output,
    interrupts: Interrupts,
    opened: Instant,
    filters: Filters,
    /// Whether the bus was up in the last report.
    is_up: bool,
    /// Why the last connection failed.
    failure: Option<String>,
    /// The channel from before the first change of the bit rate.
    original_channel: Option<Option<(u32, Mode)>>,
}

impl<P: Protocol> StreamBus<P> {
    /// Connects, and waits until the bus can be used.
    pub(super) fn open(name: &str, place: &Place, protocol: P) -> Result<StreamBus<P>, BusError> {
        let io = |what: &str, source| BusError::Io { what: what.to_owned(), source };
        let interrupts = Interrupts::new().map_err(|source| io("watch for signals", source))?;
        let addresses = match place {
            Place::Serial(..) => Vec::new(),
            Place::Tcp(host, port) => resolve(host, *port)
                .map_err(|error| BusError::Unreachable { name: name.to_owned(), why: format!("{host}: {error}") })?,
        };
        let mut bus = StreamBus {
            name: name.to_owned(),
            place: place.clone(),
            addresses,
            next_address: 0,
            link: Link::Down(Mono::START),
            protocol,
            out: Output::default(),
            interrupts,
            opened: Instant::now(),
            filters: Filters::All,
            is_up: false,
            failure: None,
            original_channel: None,
        };
        bus.connect();
        bus.wait_until_open()?;
        bus.out.events.clear();
        bus.is_up = true;
        Ok(bus)
    }

    /// Waits until the protocol is open. Fails if the connection failed at each address.
    fn wait_until_open(&mut self) -> Result<(), BusError> {
        loop {
            if self.interrupts.take() {
                let source = io::ErrorKind::Interrupted.into();
                return Err(BusError::Io { what: format!("open {}", self.name), source });
            }
            match self.link {
                Link::Down(_) => {
                    let why = self.failure.take().unwrap_or_else(|| "it was closed".to_owned());
                    return Err(BusError::Unreachable { name: self.name.clone(), why });
                }
                Link::Up(_) if self.protocol.is_open() => return Ok(()),
                _ => self.step(self.now().mono + CONNECT_TIMEOUT),
            }
        }
    }

    /// Starts a connection to the next address.
    fn connect(&mut self) {
        let now = self.now();
        let opened = match &self.place {
            Place::Serial(path, speed) => Port::serial(path, *speed),
            Place::Tcp(..) => match self.addresses.get(self.next_address) {
                Some(address) => Port::tcp(*address),
                None => Err(io::Error::other("the host has no address")),
            },
        };
        match opened {
            Ok(port) => self.link = Link::Connecting(port, now.mono + CONNECT_TIMEOUT),
            Err(error) => self.fail(describe(&error)),
        }
        if let (Link::Connecting(..), Place::Serial(..)) = (&self.link, &self.place) {
            self.check_connection(now);
        }
    }

    /// Checks whether the connection is complete.
    fn check_connection(&mut self, now: Stamp) {
        match std::mem::replace(&mut self.link, Link::Down(now.mono)) {
            Link::Connecting(port, until) => match port.connected() {
                Ok(true) => {
                    self.link = Link::Up(port);
                    self.out.bytes.clear();
                    self.protocol.start(now, &mut self.out);
                }
                Ok(false) if now.mono >= until => self.fail("the host does not answer".to_owned()),
                Ok(false) => self.link = Link::Connecting(port, until),
                Err(error) => self.fail(describe(&error)),
            },
            other => self.link = other,
        }
    }

    /// Closes the connection. If it was not established yet, tries the next address of the host at once. Otherwise, or
    /// after the last address, waits before the next attempt.
    fn fail(&mut self, why: String) {
        let was_connecting = !matches!(self.link, Link::Up(_));
        self.failure = Some(why);
        self.link = Link::Down(self.now().mono + RETRY_INTERVAL);
        if std::mem::replace(&mut self.is_up, false) {
            self.out.events.push_back(Event::Link(false));
        }
        self.next_address += 1;
        if self.next_address >= self.addresses.len() {
            self.next_address = 0;
        } else if was_connecting {
            self.connect();
        }
    }

    /// Waits for the other side, a signal or the deadline, and handles the event.
    fn step(&mut self, deadline: Mono) {
        self.flush();
        let due = match &self.link {
            Link::Down(retry) => Some(*retry),
            Link::Connecting(_, until) => Some(*until),
            Link::Up(_) => self.protocol.next_wake(),
        };
        let limit = due.map_or(deadline, |due| due.min(deadline)).since(self.mono());
        let (port, writes) = match &self.link {
            Link::Down(_) => (None, false),
            Link::Connecting(port, _) => (Some(port), true),
            Link::Up(port) => (Some(port), !self.out.bytes.is_empty()),
        };
        let sources: Vec<(&dyn Waitable, bool)> =
            port.map(|port| (port as &dyn Waitable, writes)).into_iter().collect();
        let ready = match wait(&sources, &mut self.interrupts, limit) {
            Ok(ready) => ready.first().copied().unwrap_or(false),
            Err(error) => return self.fail(describe(&error)),
        };
        let now = self.now();
        match &self.link {
            Link::Down(retry) if now.mono >= *retry => self.connect(),
            Link::Connecting(_, until) if ready || now.mono >= *until => self.check_connection(now),
            Link::Up(_) => {
                if ready {
                    self.read(now);
                }
                self.flush();
                if let Link::Up(_) = self.link
                    && self.protocol.next_wake().is_some_and(|due| due <= now.mono)
                    && let Err(why) = self.protocol.wake(now, &mut self.out)
                {
                    self.fail(why);
                }
                self.flush();
            }
            _ => {}
        }
        if !self.is_up && self.protocol.is_open() && matches!(self.link, Link::Up(_)) {
            self.is_up = true;
            self.next_address = 0;
            self.out.events.push_back(Event::Link(true));
        }
    }

    fn read(&mut self, now: Stamp) {
        let Link::Up(port) = &mut self.link else { return };
        let mut buffer = [0; 4096];
        let result = match port.read(&mut buffer) {
            Ok(count) => self.protocol.receive(&buffer[..count], now, &mut self.out),
            Err(error) => Err(describe(&error)),
        };
        if let Err(why) = result {
            self.fail(why);
        }
    }

    fn flush(&mut self) {
        let Link::Up(port) = &mut self.link else { return };
        while !self.out.bytes.is_empty() {
            match port.write(&self.out.bytes) {
                Ok(0) => return,
                Ok(count) => drop(self.out.bytes.drain(..count)),
                Err(error) => return self.fail(describe(&error)),
            }
        }
    }

    /// Waits until all accepted frames were sent, at most [`CLOSE_TIMEOUT`].
    fn drain(&mut self) {
        let until = self.mono() + CLOSE_TIMEOUT;
        while matches!(self.link, Link::Up(_))
            && (self.protocol.is_busy() || !self.out.bytes.is_empty())
            && self.mono() < until
        {
            self.step(until);
        }
    }

    fn set_channel(&mut self, to: Option<(u32, Mode)>) -> Result<(), BusError> {
        self.drain();
        let now = self.now();
        self.protocol.set_channel(to, now, &mut self.out)?;
        self.wait_until_open()?;
        self.out.events.clear();
        match self.protocol.take_refusal() {
            Some(why) => {
                let bit_rate = to.map_or(0, |(bit_rate, _)| bit_rate);
                Err(BusError::BitRate { name: self.name.clone(), bit_rate, why })
            }
            None => Ok(()),
        }
    }
}

/// Makes a text from the other side safe for a terminal.
pub(super) fn printable(text: &str) -> String {
    let safe = |letter: char| if letter.is_ascii_graphic() || letter == ' ' { letter } else { '?' };
    text.chars().take(80).map(safe).collect()
}

/// Describes an error: common errors in plain words, others with the text of the operating system.
fn describe(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::ConnectionRefused => "connection refused: no server listens there".to_owned(),
        io::ErrorKind::NotFound => "there is no such device".to_owned(),
        io::ErrorKind::PermissionDenied => "no permission".to_owned(),
        _ => error.to_string(),
    }
}

impl<P: Protocol> BitRateControl for StreamBus<P> {
    fn bit_rate(&self) -> Option<u32> {
        self.protocol.bit_rate()
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        self.protocol.can_set_bit_rate()
    }

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        let before = self.protocol.channel();
        self.original_channel.get_or_insert(before);
        self.set_channel(Some((bit_rate, mode)))
    }

    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        match self.original_channel.take() {
            Some(before) => self.set_channel(before),
            None => Ok(()),
        }
    }
}

impl<P: Protocol> Bus for StreamBus<P> {
    fn name(&self) -> &str {
        &self.name
    }

    fn timestamps(&self) -> TimestampSource {
        self.protocol.timestamps()
    }

    fn sends_remote_frames(&self) -> bool {
        self.protocol.sends_remote_frames()
    }

    fn now(&self) -> Stamp {
        Stamp { mono: Mono::at(self.opened.elapsed()), wall: Wall::now() }
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        self.filters = filters.clone();
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        if !self.is_up {
            return Err(BusError::Down(self.name.clone()));
        }
        if self.out.bytes.len() > MAX_UNSENT_BYTES {
            self.flush();
            if self.out.bytes.len() > MAX_UNSENT_BYTES {
                return Err(BusError::QueueFull);
            }
        }
        let now = self.now();
        self.protocol.send(frame, now, &mut self.out)?;
        self.flush();
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            if self.interrupts.take() {
                return Ok(Event::Interrupted);
            }
            while let Some(event) = self.out.events.pop_front() {
                match event {
                    Event::Frame(received) if !self.filters.wants(&received.frame) => {}
                    event => return Ok(event),
                }
            }
            let is_late = self.mono() >= deadline;
            self.step(deadline);
            if is_late && self.out.events.is_empty() {
                return Ok(Event::Timeout);
            }
        }
    }

    fn finish(&mut self) -> Result<(), BusError> {
        self.drain();
        Ok(())
    }
}

impl<P: Protocol> Drop for StreamBus<P> {
    fn drop(&mut self) {
        self.protocol.close(&mut self.out);
        self.flush();
    }
}
