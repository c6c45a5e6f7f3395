//! Linux SocketCAN: kernel filters, timestamps of the interface or the kernel, the kernel's drop counter, error
//! frames.
//!
//! A system call costs more than all other work for a frame. So one `recvmmsg` serves up to 64 calls of `receive`, with
//! one reading of the clock. The program waits only after the socket was found empty. In dense traffic, frames collect in
//! the kernel first (`dense.rs`).

mod clocks;
mod convert;
mod dense;
mod faults;
mod interfaces;
mod netlink;
mod receive;
mod setup;
mod socket;

use super::interrupt::Interrupts;
use super::own_clock::InterfaceClock;
use super::{
    BitRateControl, Bus, BusError, Event, Filters, Mode, Mono, ReceiveBuffer, Received, Stamp, TimestampSource, Wall,
    poll,
};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use clocks::Clocks;
use convert::{from_kernel, to_kernel};
use dense::Traffic;
pub use interfaces::{Interface, interfaces};
pub use netlink::{BitTiming, Link, State};
use receive::{Batch, Message};
pub use setup::{Change, bring_down, bring_up, link};
use socket::Bound;
use socketcan::{CanFrame, CanSocket, Socket};
use std::cell::Cell;
use std::collections::{BTreeSet, VecDeque};
use std::io;
use std::os::fd::AsFd;
use std::time::{Duration, Instant};

/// The interval at which an interface is checked for being up again, because the kernel does not report it.
const LINK_CHECK_INTERVAL: Duration = Duration::from_millis(200);
/// The first wait after a send. It costs one system call, because it does not read the clock or check for signals.
const ANSWER_TIME: Duration = Duration::from_millis(10);
/// The number of waits of [`ANSWER_TIME`] after a send, if each of them receives a frame: the segments of a block.
const ANSWERS: u8 = 127;
/// The clock is read before each wait if the deadline is nearer than this.
const NEAR_DEADLINE: Duration = Duration::from_millis(30);
/// The longest wait without reading the clock. A program that was stopped for some time may be nearer to the deadline.
const LONGEST_BLIND_WAIT: Duration = Duration::from_millis(200);

/// A CAN interface of the Linux kernel.
pub struct SocketCan {
    name: String,
    socket: CanSocket,
    interrupts: Interrupts,
    opened: Instant,
    batch: Batch,
    clocks: Clocks,
    own_clock: InterfaceClock,
    /// The time of the last frame that was processed.
    last_frame_at: Mono,
    /// Whether the socket was found empty. The next read then waits first.
    is_drained: bool,
    /// The number of further answers that may come soon after the last send.
    expected_answers: u8,
    traffic: Traffic,
    /// The last reading of the clock.
    last_clock_reading: Cell<Mono>,
    /// Events to deliver before the rest of the batch.
    ready: VecDeque<Event>,
    /// Whether the interface is up, as last reported.
    is_up: bool,
    /// Whether the interface was removed. Its socket no longer works.
    is_removed: bool,
    /// The kernel's count of lost frames at the last report.
    reported_drops: u32,
    /// The filters, for a new socket.
    filters: Filters,
    /// The identifiers to deliver, if they are too many for the kernel.
    wanted: Option<BTreeSet<CanId>>,
    timestamps: TimestampSource,
    /// The bit rate, and whether the interface only listens. Read once while the interface stays up, because this takes
    /// several system calls.
    controller: Cell<Option<(Option<u32>, bool)>>,
    /// The settings of the interface before its bit rate was set.
    original_link: Option<Link>,
}

impl SocketCan {
    /// Opens the CAN interface `name`, which must be up.
    pub fn open(name: &str) -> Result<SocketCan, BusError> {
        SocketCan::open_filtered(name, &Filters::All)
    }

    /// Opens the CAN interface `name`, which may be down, for setting its bit rate.
    pub fn open_even_down(name: &str) -> Result<SocketCan, BusError> {
        let mut bus = SocketCan::bind(name, &Filters::All)?;
        match bus.socket.as_raw_socket().take_error() {
            Ok(None) => {}
            Ok(Some(error)) | Err(error) if error.raw_os_error() == Some(libc::ENETDOWN) => bus.is_up = false,
            Ok(Some(error)) | Err(error) => return Err(bus.error("open", error)),
        }
        Ok(bus)
    }

    /// Opens the CAN interface `name` with filters that apply from the first frame on.
    pub fn open_filtered(name: &str, filters: &Filters) -> Result<SocketCan, BusError> {
        let bus = SocketCan::bind(name, filters)?;
        // Binding to an interface that is down succeeds and leaves the error on the socket.
        match bus.socket.as_raw_socket().take_error() {
            Ok(Some(error)) | Err(error) => Err(bus.error("open", error)),
            Ok(None) => Ok(bus),
        }
    }

    fn bind(name: &str, filters: &Filters) -> Result<SocketCan, BusError> {
        let interrupts =
            Interrupts::new().map_err(|source| BusError::Io { what: "watch for signals".into(), source })?;
        let Bound { socket, wanted, timestamps } = socket::bind(name, filters, ANSWER_TIME)?;
        Ok(SocketCan {
            name: name.to_owned(),
            socket,
            interrupts,
            opened: Instant::now(),
            batch: Batch::new(),
            clocks: Clocks::default(),
            own_clock: InterfaceClock::default(),
            last_frame_at: Mono::START,
            is_drained: false,
            expected_answers: 0,
            traffic: Traffic::new(),
            last_clock_reading: Cell::new(Mono::START),
            ready: VecDeque::new(),
            is_up: true,
            is_removed: false,
            reported_drops: 0,
            filters: filters.clone(),
            wanted,
            timestamps,
            controller: Cell::new(None),
            original_link: None,
        })
    }

    fn error(&self, doing: &str, source: io::Error) -> BusError {
        match source.raw_os_error() {
            Some(libc::ENOBUFS | libc::EAGAIN) => BusError::QueueFull,
            Some(libc::ENETDOWN) => BusError::Down(self.name.clone()),
            // The interface was removed, for example an unplugged adapter.
            Some(libc::ENODEV | libc::ENXIO) => BusError::NoInterface(self.name.clone()),
            Some(libc::EPERM | libc::EACCES) => BusError::Permission(format!("{doing} {}", self.name)),
            _ => BusError::Io { what: format!("{doing} {}", self.name), source },
        }
    }

    /// Queues [`Event::Link`] if the state differs from the last reported one.
    fn set_is_up(&mut self, is_up: bool) {
        if self.is_up != is_up {
            self.is_up = is_up;
            self.controller.set(None);
            self.ready.push_back(Event::Link(is_up));
        }
    }

    /// Runs `work`, which may set the interface down and up. This causes no [`Event::Link`]. `work` calls its second
    /// argument to discard the frames received so far.
    fn reset<T>(&mut self, work: impl FnOnce(&str, &mut dyn FnMut()) -> Result<T, BusError>) -> Result<T, BusError> {
        let (batch, ready, socket) = (&mut self.batch, &mut self.ready, self.socket.as_fd());
        let result = work(&self.name, &mut || {
            ready.clear();
            // Read twice: the first loop may end at the error "interface is down", which is reported only once.
            while batch.fill(socket, false, receive::BATCH).is_ok() {}
            while batch.fill(socket, false, receive::BATCH).is_ok() {}
        });
        // Clears the error of the socket: if the bit rate is not supported, the interface may have gone down again.
        let _ = self.socket.as_raw_socket().take_error();
        self.is_drained = false;
        self.controller.set(None);
        self.is_up = interfaces::is_up(&self.name).unwrap_or(result.is_ok());
        result
    }

    /// The latest known moment.
    fn latest(&self) -> Mono {
        self.last_clock_reading.get().max(self.last_frame_at)
    }

    /// Reads the frames that the kernel holds for this socket. If `wait` is set, waits up to [`ANSWER_TIME`] for the
    /// first frame. Returns whether there was a frame.
    fn fill(&mut self, wait: bool) -> Result<bool, BusError> {
        // The first wait after a send often receives only one answer. Reading one frame is faster than reading a batch.
        let limit = if wait && self.expected_answers == ANSWERS - 1 { 1 } else { receive::BATCH };
        match self.batch.fill(self.socket.as_fd(), wait, limit) {
            Ok(count) => {
                self.traffic.on_batch(count, self.last_frame_at);
                self.is_drained = count < receive::BATCH;
                if wait {
                    // An upper estimate of the receive time. A later frame causes a new comparison of the clocks.
                    self.clocks.batch_after_wait(self.last_frame_at, self.latest() + ANSWER_TIME + ANSWER_TIME);
                } else {
                    let now = self.mono();
                    self.clocks.batch(now, self.is_drained);
                    // In dense traffic, the next frame also comes soon.
                    if now.since(self.last_frame_at) < ANSWER_TIME {
                        self.expected_answers = ANSWERS;
                    }
                }
                Ok(true)
            }
            Err(error) => match error.raw_os_error() {
                Some(libc::EAGAIN) => {
                    self.is_drained = true;
                    if wait {
                        self.traffic.on_silence();
                        // The sender may only pause, so these waits go on. With the clock, they end before the deadline.
                        self.expected_answers = self.expected_answers.saturating_sub(ANSWERS / 4);
                        self.mono();
                    }
                    Ok(false)
                }
                Some(libc::EINTR) => Ok(false),
                // The kernel reports this once. The socket stays bound and works again when the interface is up.
                Some(libc::ENETDOWN) => {
                    self.set_is_up(false);
                    Ok(false)
                }
                Some(libc::ENODEV | libc::ENXIO) => {
                    self.lose_interface();
                    Ok(false)
                }
                _ => Err(self.error("receive from", error)),
            },
        }
    }

    /// Waits for a frame, a signal or the deadline. Returns whether the deadline was reached without an event.
    fn wait(&mut self, deadline: Mono) -> Result<bool, BusError> {
        // The clock is not read here: on some machines, this takes as long as receiving a frame. So the time left may
        // be shorter than this estimate, and the first wait takes only half of it.
        let estimate = deadline.since(self.latest());
        let left =
            if estimate > NEAR_DEADLINE { (estimate / 2).min(LONGEST_BLIND_WAIT) } else { deadline.since(self.mono()) };
        let limit = if self.is_up { left } else { left.min(LINK_CHECK_INTERVAL) };
        // A socket without an interface receives nothing.
        let ready = if self.is_removed {
            poll::readable([self.interrupts.fd()], limit).map(|[signal]| [false, signal])
        } else {
            poll::readable([self.socket.as_fd(), self.interrupts.fd()], limit)
        };
        let [frames, signal] = ready.map_err(|error| self.error("wait for", error))?;
        if signal {
            self.interrupts.collect();
        }
        if frames {
            self.is_drained = false;
        } else if self.is_removed {
            self.reopen()?;
        } else if self.is_back() {
            self.set_is_up(true);
        }
        Ok(!frames && !signal && self.ready.is_empty() && self.mono() >= deadline)
    }

    /// Whether the interface was down and is up again.
    fn is_back(&self) -> bool {
        !self.is_up && !self.is_removed && interfaces::is_up(&self.name) == Some(true)
    }

    /// The bit rate, and whether the interface only listens.
    fn controller(&self) -> (Option<u32>, bool) {
        self.controller.get().unwrap_or_else(|| {
            let settings = |link: Link| (link.bit_rate(), link.listen_only == Some(true));
            let found = netlink::get(&self.name).map_or((None, false), settings);
            self.controller.set(Some(found));
            found
        })
    }

    fn lose_interface(&mut self) {
        self.is_removed = true;
        self.set_is_up(false);
    }

    /// Reopens the interface after an adapter was unplugged and plugged in again.
    ///
    /// # Errors
    /// The interface exists but cannot be opened.
    fn reopen(&mut self) -> Result<(), BusError> {
        let bound = match socket::bind(&self.name, &self.filters, ANSWER_TIME) {
            Ok(bound) => bound,
            // The interface is not ready yet: it is created, renamed and set up in steps.
            Err(BusError::NoInterface(_) | BusError::NotCan(_)) => return Ok(()),
            Err(error) => return Err(error),
        };
        let more = self.unreported_drops();
        if more > 0 {
            self.ready.push_back(Event::Dropped(more));
        }
        (self.socket, self.wanted, self.timestamps) = (bound.socket, bound.wanted, bound.timestamps);
        (self.is_removed, self.reported_drops, self.is_drained) = (false, 0, false);
        self.own_clock = InterfaceClock::default();
        // If the interface is down, the socket reports this as its first error.
        match self.socket.as_raw_socket().take_error() {
            Ok(None) => self.set_is_up(true),
            Ok(Some(error)) | Err(error) => match error.raw_os_error() {
                Some(libc::ENETDOWN) => {}
                Some(libc::ENODEV | libc::ENXIO) => self.is_removed = true,
                _ => return Err(self.error("open", error)),
            },
        }
        Ok(())
    }

    /// Returns the next event, or `None` at the deadline. Without a deadline, waits up to [`ANSWER_TIME`], and only if
    /// an answer is expected.
    fn receive_until(&mut self, deadline: Option<Mono>) -> Result<Option<Event>, BusError> {
        let mut has_discarded = false;
        loop {
            if self.interrupts.take() {
                return Ok(Some(Event::Interrupted));
            }
            if let Some(event) = self.ready.pop_front() {
                return Ok(Some(event));
            }
            if let Some(message) = self.batch.next() {
                match self.process(message) {
                    Some(event) => return Ok(Some(event)),
                    None => has_discarded = true,
                }
                continue;
            }
            // Frames that are filtered out must not extend the deadline.
            if has_discarded && deadline.is_none_or(|deadline| self.last_frame_at > deadline) {
                return Ok(None);
            }
            let allows_wait = deadline.is_none_or(|deadline| deadline.since(self.latest()) > ANSWER_TIME * 3);
            if !self.is_drained {
                self.fill(false)?;
            } else if self.expected_answers > 0 && self.is_up && allows_wait {
                self.expected_answers -= 1;
                if deadline.is_some() && self.traffic.can_collect(self.last_frame_at) {
                    std::thread::sleep(dense::COLLECT_TIME);
                }
                if !self.fill(true)? && deadline.is_none() {
                    return Ok(None);
                }
            } else if deadline.map_or(Ok(true), |deadline| self.wait(deadline))? {
                return Ok(None);
            }
        }
    }

    /// Processes a message. Returns the frame if no other event precedes it; otherwise queues all events in order.
    fn process(&mut self, message: Message) -> Option<Event> {
        // A frame may be the first sign that the interface is up again. But old frames, queued before the interface
        // went down, also arrive here. So the state is checked.
        if self.is_back() {
            self.set_is_up(true);
        }
        if let Some(lost) = message.lost {
            // `lost` is the count when this frame was queued. Later drops may already be reported.
            let more = lost.wrapping_sub(self.reported_drops);
            if more > 0 && more <= u32::MAX / 2 {
                self.reported_drops = lost;
                self.ready.push_back(Event::Dropped(more));
            }
        }
        let opened = self.opened;
        let mut at = self.clocks.stamp(message.wall, &|| now(opened));
        match message.own {
            Some(own) => {
                at = self.own_clock.place(own, at);
                self.timestamps = TimestampSource::Hardware;
            }
            None => self.own_clock.pass(at),
        }
        self.last_frame_at = at.mono;
        match CanFrame::from(message.frame) {
            CanFrame::Error(frame) => {
                self.ready.extend(faults::faults(frame).into_iter().map(|fault| Event::Fault(fault, at)));
            }
            CanFrame::Data(_) | CanFrame::Remote(_) => {
                let frame = from_kernel(&message.frame)?;
                if self.wanted.as_ref().is_some_and(|wanted| !wanted.contains(&frame.id())) {
                    return None;
                }
                let event = Event::Frame(Received { frame, at });
                if self.ready.is_empty() {
                    return Some(event);
                }
                self.ready.push_back(event);
            }
        }
        None
    }
}

impl BitRateControl for SocketCan {
    fn bit_rate(&self) -> Option<u32> {
        self.controller().0
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        setup::can_set_bit_rate(&self.name)
    }

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        let now = setup::link(&self.name)?;
        self.original_link.get_or_insert_with(|| now.clone());
        self.reset(|name, while_down| setup::retime(name, &now, bit_rate, mode, while_down)).map(|_| ())
    }

    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        match self.original_link.take() {
            Some(before) => self.reset(|name, while_down| setup::restore(name, &before, while_down)),
            None => Ok(()),
        }
    }
}

impl Bus for SocketCan {
    fn name(&self) -> &str {
        &self.name
    }

    fn timestamps(&self) -> TimestampSource {
        self.timestamps
    }

    fn now(&self) -> Stamp {
        let now = now(self.opened);
        self.last_clock_reading.set(now.mono);
        now
    }

    fn mono(&self) -> Mono {
        let mono = Mono::at(self.opened.elapsed());
        self.last_clock_reading.set(mono);
        mono
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        let set = socket::set_filters(&self.socket, filters);
        self.wanted = set.map_err(|error| self.error("set the filters of", error))?;
        self.filters = filters.clone();
        Ok(())
    }

    fn receive_buffer(&self) -> Option<ReceiveBuffer> {
        socket::receive_buffer(&self.socket)
    }

    fn unreported_drops(&mut self) -> u32 {
        let Some(lost) = socket::lost(&self.socket) else { return 0 };
        let more = lost.wrapping_sub(self.reported_drops);
        self.reported_drops = lost;
        more
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        // In listen-only mode, the driver would discard the frame without an error.
        if self.controller().1 {
            return Err(BusError::ListenOnly(self.name.clone()));
        }
        self.expected_answers = ANSWERS;
        self.traffic.on_send();
        self.socket.write_frame(&to_kernel(frame)).map_err(|error| {
            // The kernel reports these errors only once, to the first call.
            match error.raw_os_error() {
                Some(libc::ENETDOWN) => self.set_is_up(false),
                Some(libc::ENODEV | libc::ENXIO) => self.lose_interface(),
                _ => {}
            }
            self.error("send on", error)
        })
    }

    fn waits_without_clock(&self) -> bool {
        true
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        self.receive_until(Some(deadline)).map(|event| event.unwrap_or(Event::Timeout))
    }

    fn receive_answer(&mut self) -> Result<Option<Event>, BusError> {
        self.receive_until(None)
    }
}

/// Returns the primary name of an interface, given this name or another of its names (altname). `None` if there is no
/// such interface.
pub(super) fn primary_name(name: &str) -> Option<String> {
    netlink::get(name).ok().map(|link| link.name).filter(|name| !name.is_empty())
}

fn now(opened: Instant) -> Stamp {
    Stamp { mono: Mono::at(opened.elapsed()), wall: Wall::now() }
}
