//! Buses: what a CAN bus can do for the layers above, and everything that touches the outside world
//! for it. The only place with sockets, clocks, signals and `unsafe`.

pub mod claim;
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
use std::fmt;
pub use time::{Mono, Stamp, Wall};

/// A CAN bus: frames out, events in, time.
///
/// Nothing here blocks for longer than asked, and no call but [`Bus::receive`] waits.
pub trait Bus {
    /// What people call it, and what stands in a trace: `can0`, `sim`.
    fn name(&self) -> &str;

    /// The bit rate in bit/s, where the bus knows it.
    fn bit_rate(&self) -> Option<u32>;

    /// Where the wall time of received frames comes from.
    fn timestamps(&self) -> TimestampSource;

    /// Whether there is somebody on it now. A recording only receives, and it comes to an end.
    fn is_live(&self) -> bool {
        true
    }

    /// Whether it waits for who is slow: time passes only while somebody receives, as in a recording and on a
    /// virtual clock.
    fn waits(&self) -> bool {
        !self.is_live()
    }

    /// The present moment.
    fn now(&self) -> Stamp;

    /// The present moment on the monotonic time line alone: on some machines each clock is a system call.
    fn mono(&self) -> Mono {
        self.now().mono
    }

    /// Tells which frames are wanted from now on; others may or may not be delivered.
    /// A bus starts with every frame wanted.
    fn listen(&mut self, filters: &Filters) -> Result<(), BusError>;

    /// Hands one frame to the bus. [`BusError::QueueFull`] means: not sent, try again shortly.
    fn send(&mut self, frame: &Frame) -> Result<(), BusError>;

    /// The next thing that happens, at the latest [`Event::Timeout`] once `deadline` is reached.
    /// With a deadline in the past it returns what is there already, without waiting.
    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError>;

    /// How much is held back of what was received and not yet asked for; `None` where that has no bound, or
    /// nobody knows it.
    fn receive_buffer(&self) -> Option<ReceiveBuffer> {
        None
    }

    /// How many frames the kernel had to drop that no [`Event::Dropped`] has told of: the event comes with the next
    /// frame, and after these there was none. Each is told once.
    fn late_drops(&mut self) -> u32 {
        0
    }

    /// Whether [`Bus::set_bit_rate`] can be expected to work: asked before anything is changed that depends on it.
    ///
    /// # Errors
    /// Why not: no privilege, or no such thing on this bus.
    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        Err(BusError::Unsupported(format!("the bit rate of {} cannot be set from here", self.name())))
    }

    /// Takes this side of the bus to another bit rate in bit/s: the interface goes down and comes up at the new
    /// one. Frames that wait to be sent, and received ones that nobody has asked for yet, are lost.
    ///
    /// # Errors
    /// What the interface says; where it says no it is left as it was, as far as it can be put back.
    fn set_bit_rate(&mut self, _bit_rate: u32, _mode: Mode) -> Result<(), BusError> {
        self.can_set_bit_rate()
    }

    /// Puts the interface back as it was before the first [`Bus::set_bit_rate`]: bit rate, mode, switched off
    /// where it was. Nothing where none was set.
    ///
    /// # Errors
    /// What the interface says; it is then as the error tells.
    fn put_back_bit_rate(&mut self) -> Result<(), BusError> {
        Ok(())
    }

    /// Writes out what is still buffered (a trace). To be called when the work is done: dropping a
    /// bus can report nothing.
    fn finish(&mut self) -> Result<(), BusError> {
        Ok(())
    }
}

impl<B: Bus + ?Sized> Bus for Box<B> {
    fn name(&self) -> &str {
        (**self).name()
    }

    fn bit_rate(&self) -> Option<u32> {
        (**self).bit_rate()
    }

    fn timestamps(&self) -> TimestampSource {
        (**self).timestamps()
    }

    fn is_live(&self) -> bool {
        (**self).is_live()
    }

    fn waits(&self) -> bool {
        (**self).waits()
    }

    fn now(&self) -> Stamp {
        (**self).now()
    }

    fn mono(&self) -> Mono {
        (**self).mono()
    }

    fn listen(&mut self, filters: &Filters) -> Result<(), BusError> {
        (**self).listen(filters)
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        (**self).send(frame)
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        (**self).receive(deadline)
    }

    fn receive_buffer(&self) -> Option<ReceiveBuffer> {
        (**self).receive_buffer()
    }

    fn late_drops(&mut self) -> u32 {
        (**self).late_drops()
    }

    fn can_set_bit_rate(&self) -> Result<(), BusError> {
        (**self).can_set_bit_rate()
    }

    fn set_bit_rate(&mut self, bit_rate: u32, mode: Mode) -> Result<(), BusError> {
        (**self).set_bit_rate(bit_rate, mode)
    }

    fn put_back_bit_rate(&mut self) -> Result<(), BusError> {
        (**self).put_back_bit_rate()
    }

    fn finish(&mut self) -> Result<(), BusError> {
        (**self).finish()
    }
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
