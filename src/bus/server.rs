//! A bus that is a socketcand server. The clients are the other participants. Each client receives the frames of this
//! program and of the other clients.

use super::interrupt::Interrupts;
use super::port::{Waitable, wait};
use super::socketcand::{Messages, frame_message, sent_frame};
use super::{BitRateControl, Bus, BusError, Event, Filters, Mono, Received, Stamp, TimestampSource, Wall};
use crate::canopen::frame::Frame;
use std::collections::VecDeque;
use std::fmt;
use std::io::{self, ErrorKind, Read, Write};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::str::FromStr;
use std::time::{Duration, Instant};

/// A client with more unread bytes than this is disconnected.
const MAX_UNREAD_BYTES: usize = 256 * 1024;
/// The largest number of clients.
const MAX_CLIENTS: usize = 64;

/// The address of a server: `29536` (only on this computer), `0.0.0.0:29536`, `[::]:29536`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Address(SocketAddr);

impl Address {
    /// Whether only programs on this computer can connect.
    pub fn is_local(self) -> bool {
        self.0.ip().is_loopback()
    }

    /// The TCP port.
    pub fn port(self) -> u16 {
        self.0.port()
    }
}

impl FromStr for Address {
    type Err = String;

    fn from_str(text: &str) -> Result<Address, String> {
        let port = text.parse().map(|port| SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
        let address = port.or_else(|_| text.parse());
        address.map(Address).map_err(|_| format!("\"{text}\" is not PORT or ADDRESS:PORT (29536, 0.0.0.0:29536)"))
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

/// A socketcand server. Clients can open this bus with any name.
pub struct Server {
    name: String,
    listener: TcpListener,
    clients: Vec<Client>,
    interrupts: Interrupts,
    opened: Instant,
    ready: VecDeque<Event>,
    filters: Filters,
}

struct Client {
    stream: TcpStream,
    messages: Messages,
    has_opened: bool,
    is_raw: bool,
    unsent: Vec<u8>,
    is_closed: bool,
}

impl Client {
    fn send_text(&mut self, message: &str) {
        self.unsent.extend(message.bytes());
        self.flush();
    }

    fn flush(&mut self) {
        while !self.unsent.is_empty() && !self.is_closed {
            match self.stream.write(&self.unsent) {
                Ok(count @ 1..) => drop(self.unsent.drain(..count)),
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Ok(_) | Err(_) => self.is_closed = true,
            }
        }
        self.is_closed |= self.unsent.len() > MAX_UNREAD_BYTES;
    }

    /// Reads from the client. Returns the received frames.
    fn read(&mut self) -> Vec<Frame> {
        let mut buffer = [0; 4096];
        let count = match self.stream.read(&mut buffer) {
            Ok(0) => {
                self.is_closed = true;
                0
            }
            Ok(count) => count,
            Err(error) => {
                self.is_closed |= !matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::Interrupted);
                0
            }
        };
        let (mut frames, mut found) = (Vec::new(), Vec::new());
        self.messages.feed(&buffer[..count], |message| found.extend(message.map(str::to_owned)));
        for message in found {
            frames.extend(self.process(&message));
        }
        frames
    }

    fn process(&mut self, message: &str) -> Option<Frame> {
        let mut words = message.split_ascii_whitespace();
        match words.next().unwrap_or_default() {
            "open" if words.next().is_some() => {
                self.has_opened = true;
                self.send_text("< ok >");
            }
            "rawmode" if self.has_opened => {
                self.is_raw = true;
                self.send_text("< ok >");
            }
            "send" if self.is_raw => match sent_frame(words) {
                Some(frame) => return Some(frame),
                None => self.send_text("< error invalid frame >"),
            },
            "echo" => self.send_text("< echo >"),
            _ => self.send_text("< error unknown command >"),
        }
        None
    }
}

impl Server {
    /// Listens at an address.
    ///
    /// # Errors
    /// The address is in use, or does not belong to this host.
    pub fn listen(address: Address) -> Result<Server, BusError> {
        let failed = |source| BusError::Io { what: format!("listen at {address}"), source };
        let listener = TcpListener::bind(address.0).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        Ok(Server {
            name: format!("socketcand {}", listener.local_addr().map_err(failed)?),
            listener,
            clients: Vec::new(),
            interrupts: Interrupts::new().map_err(failed)?,
            opened: Instant::now(),
            ready: VecDeque::new(),
            filters: Filters::All,
        })
    }

    /// The address, with the port chosen by the system.
    ///
    /// # Errors
    /// The system cannot report the address.
    pub fn address(&self) -> io::Result<Address> {
        self.listener.local_addr().map(Address)
    }

    fn accept(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            if self.clients.len() >= MAX_CLIENTS || stream.set_nonblocking(true).is_err() {
                continue;
            }
            // This option only improves the speed.
            let _ = stream.set_nodelay(true);
            let mut client = Client {
                stream,
                messages: Messages::default(),
                has_opened: false,
                is_raw: false,
                unsent: Vec::new(),
                is_closed: false,
            };
            client.send_text("< hi >");
            self.clients.push(client);
        }
    }

    /// Passes a frame to all clients except its sender.
    fn pass(&mut self, frame: &Frame, sender: Option<usize>) {
        // The protocol does not support remote frames.
        if frame.is_remote() {
            return;
        }
        let message = frame_message(frame, self.now());
        for (index, client) in self.clients.iter_mut().enumerate() {
            if client.is_raw && sender != Some(index) {
                client.send_text(&message);
            }
        }
    }

    fn serve_clients(&mut self, limit: Duration) -> Result<(), BusError> {
        let listener: (&dyn Waitable, bool) = (&self.listener, false);
        let clients = self.clients.iter().map(|it| (&it.stream as &dyn Waitable, !it.unsent.is_empty()));
        let sources: Vec<_> = [listener].into_iter().chain(clients).collect();
        let ready = wait(&sources, &mut self.interrupts, limit)
            .map_err(|source| BusError::Io { what: format!("wait for {}", self.name), source })?;
        for (index, _) in ready.iter().skip(1).enumerate().filter(|(_, ready)| **ready) {
            self.clients[index].flush();
            for frame in self.clients[index].read() {
                self.pass(&frame, Some(index));
                if self.filters.wants(&frame) {
                    let received = Received { frame, at: self.now() };
                    self.ready.push_back(Event::Frame(received));
                }
            }
        }
        self.clients.retain(|client| !client.is_closed);
        self.accept();
        Ok(())
    }
}

impl BitRateControl for Server {}

impl Bus for Server {
    fn name(&self) -> &str {
        &self.name
    }

    fn timestamps(&self) -> TimestampSource {
        TimestampSource::Program
    }

    fn sends_remote_frames(&self) -> bool {
        false
    }

    fn now(&self) -> Stamp {
        Stamp { mono: Mono::at(self.opened.elapsed()), wall: Wall::now() }
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        self.filters = filters.clone();
        Ok(())
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        self.pass(frame, None);
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            if self.interrupts.take() {
                return Ok(Event::Interrupted);
            }
            if let Some(event) = self.ready.pop_front() {
                return Ok(event);
            }
            let left = deadline.since(self.mono());
            self.serve_clients(left)?;
            if left.is_zero() && self.ready.is_empty() {
                return Ok(Event::Timeout);
            }
        }
    }
}
