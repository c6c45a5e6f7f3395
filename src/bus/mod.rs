//! Buses: what a CAN bus can do for the layers above, and everything that touches the outside world
//! for it. The only place with sockets, clocks, signals and `unsafe`.

pub mod claim;
mod delegate;
pub mod faults;
pub mod interrupt;
pub mod memory;
#[cfg(unix)]
mod poll;
pub mod replay;
#[cfg(test)]
mod script;
#[cfg(target_os = "linux")]
pub mod socketcan;
pub mod time;
pub mod trace;

use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
pub use delegate::delegate_bus;
use std::fmt;
pub use time::{Mono, Stamp, Wall};

/// Transport and time of a CAN bus: frames out, events in.
///
/// Only [`Bus::receive`] waits, and never beyond the deadline it is given.
pub trait Bus: BitRateControl {
    /// The name shown to people and written to traces: `can0`, `sim`.
    fn name(&self) -> &str;

    /// Where the wall time of received frames comes from.
    fn timestamps(&self) -> TimestampSource;

    /// Whether other participants may be on the bus now. `false` for a recording, which only receives and ends.
    fn is_live(&self) -> bool {
        true
    }

    /// Whether the bus waits for a slow program. On a recording and on a virtual clock, time passes only inside
    /// [`Bus::receive`].
    fn waits(&self) -> bool {
        !self.is_live()
    }

    /// The present moment on both time lines.
    fn now(&self) -> Stamp;

    /// The present moment on the monotonic time line only. On some machines each clock is a system call.
    fn mono(&self) -> Mono {
        self.now().mono
    }

    /// Sets which frames [`Bus::receive`] returns from now on. A new bus returns all frames. A bus may also return
    /// frames that do not match.
    ///
    /// # Errors
    /// The operating system rejects the filters.
    fn listen(&mut self, filters: &Filters) -> Result<(), BusError>;

    /// Hands one frame to the bus.
    ///
    /// # Errors
    /// [`BusError::QueueFull`]: the frame was not sent; try again after a short time.
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// Waits for the next event. Returns [`Event::Timeout`] when `deadline` is reached. With a deadline in the past
    /// it returns an event that is already there, without waiting.
    ///
    /// # Errors
    /// The bus failed. The caller may call again.
    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError>;

    /// The size of the buffer for frames that were received and not read yet. `None` if it has no limit or the
    /// limit is unknown.
    fn receive_buffer(&self) -> Option<ReceiveBuffer> {
        None
    }

    /// The number of frames that the kernel dropped and that no [`Event::Dropped`] reported. That event comes with
    /// the next frame, so drops after the last frame show only here. Each frame is counted once.
    fn late_drops(&mut self) -> u32 {
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

/// The bit rate of the interface behind a [`Bus`]: read it, set it, restore it.
///
/// A transport without such control implements the trait with an empty block.
pub trait BitRateControl {
    /// The bit rate in bit/s, if it is known.
    fn bit_rate(&self) -> Option<u32> {
        None
    }

    /// Checks whether [`BitRateControl::set_bit_rate`] can work, before the caller changes anything that depends on
    /// it.
    ///
    /// # Errors
    /// [`BusError::Permission`]: no privilege. [`BusError::Unsupported`]: this bus has no such function.
    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        Err(BusError::Unsupported("the bit rate of this bus cannot be set from here".to_owned()))
    }

    /// Sets the interface to another bit rate in bit/s: it goes down and comes up again. Frames that wait to be
    /// sent and received frames that were not read yet are lost.
    ///
    /// # Errors
    /// The interface rejects the bit rate. It is then restored as far as possible.
    fn set_bit_rate(&mut self, _bit_rate: u32, _mode: Mode) -> Result<(), BusError> {
        self.can_set_bit_rate()
    }

    /// Restores bit rate, mode and up/down state from before the first [`BitRateControl::set_bit_rate`]. Does
    /// nothing if the bit rate was not set.
    ///
    /// # Errors
    /// The interface cannot be restored; the error describes its state.
    fn restore_bit_rate(&mut self) -> Result<(), BusError> {
        Ok(())
    }
}

impl<B: Bus + ?Sized> Bus for Box<B> {
    delegate_bus!(self, (**self) => name timestamps is_live waits now mono listen send receive receive_buffer
        late_drops finish);
}

impl<B: BitRateControl + ?Sized> BitRateControl for Box<B> {
    delegate_bus!(self, (**self) => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

/// Room for what was received and not yet asked for. A frame takes some 800 bytes of it on Linux.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReceiveBuffer {
    /// What there is, in bytes.
    pub bytes: usize,
    /// What was asked for: the system may allow less (`net.core.rmem_max`).
    pub wanted: usize,
}

impl ReceiveBuffer {
    /// Whether the system did not allow what was asked for.
    pub fn is_small(self) -> bool {
        self.bytes < self.wanted
    }
}

/// How an interface takes part in the traffic.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// It sends and acknowledges.
    #[default]
    Normal,
    /// It only listens: no frame, no acknowledge, no error flag.
    ListenOnly,
}

/// What comes from a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Event {
    /// A frame of another participant.
    Frame(Received),
    /// The controller reports trouble on the wire.
    Fault(Fault, Stamp),
    /// The kernel had to drop this many frames since it last said so: the program read too slowly.
    Dropped(u32),
    /// The interface went down (`false`) or came back (`true`).
    Link(bool),
    /// The deadline was reached.
    Timeout,
    /// The recording is over. Reported once; from then on time passes and nothing comes.
    Ended,
    /// The user asked to stop (Ctrl-C, SIGTERM). Reported once a signal: what comes after it is
    /// tidying up, which may use the bus again.
    Interrupted,
}

/// A frame and the moment it was received.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Received {
    /// What was received.
    pub frame: Frame,
    /// When.
    pub at: Stamp,
}

/// Trouble that a CAN controller reports (Linux: an error frame).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Fault {
    /// The controller has switched itself off after too many errors.
    BusOff,
    /// The controller may no longer signal errors actively.
    ErrorPassive,
    /// An error counter passed the warning level.
    ErrorWarning,
    /// The controller is error-active again.
    ErrorActive,
    /// The controller was restarted after bus-off.
    Restarted,
    /// Nobody acknowledged a frame.
    NoAcknowledge,
    /// A bit, stuff, form or CRC error on the wire: wrong bit rate, bad wiring, two senders.
    Protocol,
    /// The controller's own receive or transmit buffer ran over.
    ControllerOverflow,
    /// The transceiver reports a fault of the wires.
    Transceiver,
    /// A transmission took too long.
    TransmitTimeout,
    /// Anything else.
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
            Fault::NoAcknowledge => "no acknowledge: nobody else is listening at this bit rate",
            Fault::Protocol => "protocol error on the wire",
            Fault::ControllerOverflow => "controller buffer overflow",
            Fault::Transceiver => "transceiver fault",
            Fault::TransmitTimeout => "transmit time-out",
            Fault::Other => "bus error",
        })
    }
}

/// Where the wall time of a received frame comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TimestampSource {
    /// The interface's own clock, laid upon the computer's.
    Hardware,
    /// The kernel, when the driver handed the frame over.
    Kernel,
    /// This program, when it read the frame.
    Program,
    /// The clock of the simulated bus.
    Simulated,
    /// Whatever recorded it.
    Recorded,
}

impl fmt::Display for TimestampSource {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            TimestampSource::Hardware => "hardware",
            TimestampSource::Kernel => "kernel",
            TimestampSource::Program => "program",
            TimestampSource::Simulated => "simulated",
            TimestampSource::Recorded => "recorded",
        })
    }
}

/// Which frames are wanted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Filters {
    /// Every frame.
    All,
    /// Data frames with exactly these identifiers.
    Only(Vec<CanId>),
}

impl Filters {
    /// Whether `frame` is wanted.
    pub fn wants(&self, frame: &Frame) -> bool {
        match self {
            Filters::All => true,
            Filters::Only(ids) => !frame.is_remote() && ids.contains(&frame.id()),
        }
    }
}

/// Why a bus does not do what was asked.
#[derive(Debug, thiserror::Error)]
pub enum BusError {
    /// The transmit queue is full; nothing was sent.
    #[error("the transmit queue is full")]
    QueueFull,
    /// No interface of that name.
    #[error("there is no CAN interface \"{0}\"")]
    NoInterface(String),
    /// The interface exists and is down.
    #[error("interface {0} is down")]
    Down(String),
    /// The interface is there and is no CAN interface.
    #[error("{0} is not a CAN interface")]
    NotCan(String),
    /// The operating system forbids it.
    #[error("no permission to {0}")]
    Permission(String),
    /// This bus only receives.
    #[error("{0} is receive only")]
    ReceiveOnly(String),
    /// The interface cannot do that bit rate; it is as it was.
    #[error("{name} cannot do {bit_rate} bit/s: {why}")]
    BitRate {
        /// The interface.
        name: String,
        /// The bit rate asked for.
        bit_rate: u32,
        /// What the driver says.
        why: String,
    },
    /// This system or this build has no such bus.
    #[error("{0}")]
    Unsupported(String),
    /// A local file fails: a trace, a recording.
    #[error("{what}: {source}")]
    File {
        /// What was being done.
        what: String,
        /// What the operating system says.
        source: std::io::Error,
    },
    /// Anything else, with what was being done.
    #[error("{what}: {source}")]
    Io {
        /// What was being done.
        what: String,
        /// What the operating system says.
        source: std::io::Error,
    },
}
