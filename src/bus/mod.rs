//! CAN buses: the trait [`Bus`] and its transports.
//!
//! This layer provides frames with two receive times, waits with a deadline, and a clock. Sockets, clocks, signals and
//! `unsafe` occur only in this layer. It handles frames, but no protocol.

pub mod channels;
pub mod claim;
pub mod coded;
mod delegate;
pub mod faults;
pub mod file;
pub mod host;
pub mod interrupt;
pub mod memory;
mod own_clock;
pub mod owner;
pub mod paced;
pub mod parallel;
mod pcapng;
#[cfg(unix)]
mod poll;
mod port;
pub mod program;
pub mod remote;
pub mod replay;
#[cfg(test)]
mod script;
pub mod server;
mod slcan;
#[cfg(all(target_os = "linux", not(without_socketcan)))]
pub mod socketcan;
mod socketcand;
pub mod stdout;
mod stream;
pub mod time;
pub mod trace;
pub mod typed;

use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
pub use delegate::delegate_bus;
use std::fmt;
pub use time::{Mono, Stamp, Wall};

/// Transport and time of a CAN bus: it sends frames and receives events.
///
/// Only [`Bus::receive`] waits, and never after its deadline.
pub trait Bus: BitRateControl {
    /// The name in messages and traces: `can0`, `sim`.
    fn name(&self) -> &str;

    /// The source of the wall time of received frames.
    fn timestamps(&self) -> TimestampSource;

    /// Whether other participants may be on the bus. `false` for a recording.
    fn is_live(&self) -> bool {
        true
    }

    /// Whether the bus waits for a slow program. For recordings and virtual clocks, time passes only inside
    /// [`Bus::receive`].
    fn waits(&self) -> bool {
        !self.is_live()
    }

    /// Whether the transport carries remote frames (RTR).
    fn sends_remote_frames(&self) -> bool {
        true
    }

    /// The present moment on both time lines.
    fn now(&self) -> Stamp;

    /// The present moment on the monotonic time line only. Reading both clocks is slow on some machines.
    fn mono(&self) -> Mono {
        self.now().mono
    }

    /// Whether [`Bus::receive_answer`] waits for an answer. If so, the caller need not read the clock after a send.
    fn waits_without_clock(&self) -> bool {
        false
    }

    /// Sets which frames [`Bus::receive`] returns from now on. A new bus returns all frames. A bus may also return
    /// frames that do not match.
    ///
    /// # Errors
    /// The operating system rejects the filters.
    fn listen(&mut self, filters: &Filters) -> Result<(), BusError>;

    /// Passes one frame to the bus.
    ///
    /// # Errors
    /// [`BusError::QueueFull`]: the frame was not sent; try again after a short time.
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// Waits for the next event. Returns [`Event::Timeout`] when `deadline` is reached. With a deadline in the past,
    /// returns an event that was already received, without waiting.
    ///
    /// # Errors
    /// The bus failed. The caller may call again.
    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError>;

    /// Like [`Bus::receive`], but waits for some 10 ms, and does not read the clock: on some machines, this takes as
    /// long as receiving a frame. Returns `None` if there was no event, or if this bus does not implement the wait.
    ///
    /// # Errors
    /// The bus failed. The caller may call again.
    fn receive_answer(&mut self) -> Result<Option<Event>, BusError> {
        Ok(None)
    }

    /// The size of the buffer for received frames that are not read yet. `None` if it has no limit or the limit is
    /// unknown.
    fn receive_buffer(&self) -> Option<ReceiveBuffer> {
        None
    }

    /// Returns the number of dropped frames that no [`Event::Dropped`] reported. The kernel reports drops with the next
    /// frame, so drops after the last frame are reported only here. Each dropped frame is counted once.
    fn unreported_drops(&mut self) -> u32 {
        0
    }

    /// Writes buffered output (a trace) to its file. Call it after the last use of the bus, because `drop` cannot
    /// report errors.
    ///
    /// # Errors
    /// The file cannot be written.
    fn finish(&mut self) -> Result<(), BusError> {
        Ok(())
    }
}

/// Reads, sets and restores the bit rate of the interface of a [`Bus`].
///
/// A transport that cannot control the bit rate implements the trait with an empty block.
pub trait BitRateControl {
    /// The bit rate in bit/s, if it is known.
    fn bit_rate(&self) -> Option<u32> {
        None
    }

    /// Checks whether [`BitRateControl::set_bit_rate`] is possible, before the caller makes changes that depend on it.
    ///
    /// # Errors
    /// [`BusError::Permission`]: no privilege. [`BusError::Unsupported`]: this bus has no such function.
    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        Err(BusError::Unsupported("the bit rate of this bus cannot be set from here".to_owned()))
    }

    /// Sets the interface to another bit rate in bit/s: it goes down and comes up again. Waiting frames and unread
    /// frames are lost.
    ///
    /// # Errors
    /// The interface rejects the bit rate. It is then restored as far as possible.
    fn set_bit_rate(&mut self, _bit_rate: u32, _mode: Mode) -> Result<(), BusError> {
        self.can_set_bit_rate()
    }

    /// Restores the bit rate, mode and up/down state from before the first [`BitRateControl::set_bit_rate`]. Does
    /// nothing if the bit rate was not set.
    ///
    /// # Errors
    /// The interface cannot be restored; the error describes its state.
    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        Ok(())
    }
}

impl<B: Bus + ?Sized> Bus for Box<B> {
    delegate_bus!(self, (**self) => name timestamps is_live sends_remote_frames waits now mono
        waits_without_clock listen send receive receive_answer receive_buffer unreported_drops finish);
}

impl<B: BitRateControl + ?Sized> BitRateControl for Box<B> {
    delegate_bus!(self, (**self) => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl<B: Bus + ?Sized> Bus for &mut B {
    delegate_bus!(self, (**self) => name timestamps is_live sends_remote_frames waits now mono
        waits_without_clock listen send receive receive_answer receive_buffer unreported_drops finish);
}

impl<B: BitRateControl + ?Sized> BitRateControl for &mut B {
    delegate_bus!(self, (**self) => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

/// The size of the receive buffer. On Linux a frame takes about 800 bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceiveBuffer {
    /// The actual size in bytes.
    pub bytes: usize,
    /// The requested size in bytes. The system may allow less (`net.core.rmem_max`).
    pub wanted: usize,
}

impl ReceiveBuffer {
    /// Whether the system allowed less than requested.
    pub fn is_small(self) -> bool {
        self.bytes < self.wanted
    }
}

/// How an interface takes part in bus traffic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// It sends and acknowledges.
    #[default]
    Normal,
    /// It only receives: it sends no frames, no acknowledgements and no error flags.
    ListenOnly,
}

/// An event on a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame of another participant.
    Frame(Received),
    /// The controller reports a fault.
    Fault(Fault, Stamp),
    /// The kernel dropped this many frames since its last report, because the program read too slowly.
    Dropped(u32),
    /// The interface went down (`false`) or came up (`true`).
    Link(bool),
    /// The deadline was reached.
    Timeout,
    /// The recording has ended. Reported once; after that there are only time-outs.
    Ended,
    /// The user asked to stop (Ctrl-C, SIGTERM). Reported once per signal, so that the caller can still use the bus to
    /// clean up.
    Interrupted,
}

/// A received frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// The frame.
    pub frame: Frame,
    /// When it was received.
    pub at: Stamp,
}

/// A fault that a CAN controller reports (Linux: an error frame).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The controller switched itself off after too many errors.
    BusOff,
    /// The controller is error-passive: it may no longer send active error flags.
    ErrorPassive,
    /// An error counter reached the warning level (96).
    ErrorWarning,
    /// The controller is error-active again.
    ErrorActive,
    /// The controller was restarted after bus-off.
    Restarted,
    /// No node acknowledged a frame.
    NoAcknowledge,
    /// A bit, stuff, form or CRC error: wrong bit rate, bad wiring, or two nodes that send the same COB-ID.
    Protocol,
    /// The receive or transmit buffer of the controller overflowed.
    ControllerOverflow,
    /// The transceiver reports a wiring fault.
    Transceiver,
    /// A transmission took too long.
    TransmitTimeout,
    /// The adapter or server sent invalid text. A frame may be lost.
    Garbled,
    /// Another fault.
    Other,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Fault::BusOff => "bus-off",
            Fault::ErrorPassive => "error passive",
            Fault::ErrorWarning => "error warning",
            Fault::ErrorActive => "error active again",
            Fault::Restarted => "restarted after bus-off",
            Fault::NoAcknowledge => "no acknowledgement: no other node at this bit rate",
            Fault::Protocol => "protocol error on the bus",
            Fault::ControllerOverflow => "controller buffer overflow",
            Fault::Transceiver => "transceiver fault",
            Fault::TransmitTimeout => "transmit time-out",
            Fault::Garbled => "unreadable data from the adapter or server",
            Fault::Other => "bus error",
        })
    }
}

/// The source of the wall time of a received frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimestampSource {
    /// The clock of the interface, converted to the host's time.
    Hardware,
    /// The clock of the kernel, when the driver delivered the frame.
    Kernel,
    /// The clock of this program, when it read the frame.
    Program,
    /// The clock of the socketcand server, converted to the time of the host.
    Server,
    /// The clock of the simulated bus.
    Simulated,
    /// The time stamp in the recording.
    Recorded,
}

impl fmt::Display for TimestampSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            TimestampSource::Hardware => "hardware",
            TimestampSource::Kernel => "kernel",
            TimestampSource::Program => "program",
            TimestampSource::Server => "server",
            TimestampSource::Simulated => "simulated",
            TimestampSource::Recorded => "recorded",
        })
    }
}

/// Which frames a bus delivers.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Filters {
    /// Every frame.
    All,
    /// Data frames and remote frames with exactly these identifiers.
    Only(Vec<CanId>),
}

impl Filters {
    /// Combines filters: the result passes each frame that at least one of `each` passes.
    pub fn any_of<'a>(each: impl Iterator<Item = &'a Filters>) -> Filters {
        let mut all = Vec::new();
        for filters in each {
            match filters {
                Filters::All => return Filters::All,
                Filters::Only(ids) => all.extend(ids),
            }
        }
        all.sort_unstable();
        all.dedup();
        Filters::Only(all)
    }

    /// Whether `frame` passes.
    pub fn wants(&self, frame: &Frame) -> bool {
        match self {
            Filters::All => true,
            Filters::Only(ids) => ids.contains(&frame.id()),
        }
    }
}

/// Why an operation on a bus failed.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The transmit queue is full; nothing was sent.
    #[error("the transmit queue is full")]
    QueueFull,
    /// No interface of that name.
    #[error("there is no CAN interface \"{0}\"")]
    NoInterface(String),
    /// The interface exists but is down.
    #[error("interface {0} is down")]
    Down(String),
    /// The adapter or server cannot be used.
    #[error("{name}: {why}")]
    Unreachable {
        /// The bus.
        name: String,
        /// The reason.
        why: String,
    },
    /// The interface is not a CAN interface.
    #[error("{0} is not a CAN interface")]
    NotCan(String),
    /// The operating system denies the operation.
    #[error("no permission to {0}")]
    Permission(String),
    /// Another cangauge process uses the same nodes or the whole bus.
    #[error("{0}")]
    InUse(String),
    /// The transport carries no remote frames.
    #[error("socketcand carries no remote frames (RTR)")]
    NoRemoteFrames,
    /// This bus can only receive.
    #[error("{0} can only receive")]
    ReceiveOnly(String),
    /// The interface is in listen-only mode.
    #[error("{0} is in listen-only mode: it can only receive")]
    ListenOnly(String),
    /// The interface does not support the bit rate. Its old settings are restored.
    #[error("{name} does not support {bit_rate} bit/s: {why}")]
    BitRate {
        /// The interface.
        name: String,
        /// The requested bit rate in bit/s.
        bit_rate: u32,
        /// The reason that the driver gives.
        why: String,
    },
    /// This system or this build does not support the operation.
    #[error("{0}")]
    Unsupported(String),
    /// A local file failed: a trace or a recording.
    #[error("{what}: {source}")]
    File {
        /// The operation that failed.
        what: String,
        /// The error of the operating system.
        source: std::io::Error,
    },
    /// A file is not a usable recording.
    #[error("replay {file}{}: {error}", line.map(|line| format!(":{line}")).unwrap_or_default())]
    Recording {
        /// The file.
        file: String,
        /// The line, counted from 1, if the error is in one line.
        line: Option<u64>,
        /// The mistake.
        error: replay::RecordingError,
    },
    /// Another error of the operating system.
    #[error("{what}: {source}")]
    Io {
        /// The operation that failed.
        what: String,
        /// The error of the operating system.
        source: std::io::Error,
    },
}
