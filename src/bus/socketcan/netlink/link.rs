//! Parses the kernel's description of a CAN interface (linux/can/netlink.h), and builds requests that set it.

use super::message::{Attributes, Header, NAME, Request, u16_at, u32_at};

/// `IFF_UP`: the flag of an interface that is up.
const UP: u32 = 1;
/// `ARPHRD_CAN`.
const CAN_HARDWARE: u16 = 280;
/// `IFLA_LINKINFO` with `IFLA_INFO_KIND` and `IFLA_INFO_DATA`.
const LINK_INFO: u16 = 18;
const INFO_KIND: u16 = 1;
const INFO_DATA: u16 = 2;
/// `IFLA_CAN_…`.
const BIT_TIMING: u16 = 1;
const STATE: u16 = 4;
const CONTROL_MODE: u16 = 5;
const RESTART_MS: u16 = 6;
const ERROR_COUNTERS: u16 = 8;
const FIXED_RATES: u16 = 13;
const RATE_MAX: u16 = 15;
const CONTROL_MODE_EXTENSION: u16 = 17;
/// `IFLA_CAN_CTRLMODE_SUPPORTED`, inside [`CONTROL_MODE_EXTENSION`].
const SUPPORTED: u16 = 1;
/// `CAN_CTRLMODE_LISTENONLY`.
const LISTEN_ONLY: u32 = 2;

/// The state of a CAN controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Both error counters are below 96.
    ErrorActive,
    /// An error counter has reached 96.
    ErrorWarning,
    /// An error counter has reached 128.
    ErrorPassive,
    /// The controller switched itself off after too many errors.
    BusOff,
    /// The controller is switched off.
    Stopped,
    /// The controller sleeps.
    Sleeping,
    /// An unknown state code.
    Unknown(u32),
}

impl State {
    fn new(code: u32) -> State {
        match code {
            0 => State::ErrorActive,
            1 => State::ErrorWarning,
            2 => State::ErrorPassive,
            3 => State::BusOff,
            4 => State::Stopped,
            5 => State::Sleeping,
            code => State::Unknown(code),
        }
    }

    /// Returns the name in lower case, as `ip` shows it.
    pub fn as_str(self) -> &'static str {
        match self {
            State::ErrorActive => "error-active",
            State::ErrorWarning => "error-warning",
            State::ErrorPassive => "error-passive",
            State::BusOff => "bus-off",
            State::Stopped => "stopped",
            State::Sleeping => "sleeping",
            State::Unknown(_) => "unknown",
        }
    }
}

/// `struct can_bittiming`: the bit timing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitTiming {
    /// Bit rate in bit/s.
    pub bit_rate: u32,
    /// Sample point in tenths of a percent of a bit.
    pub sample_point: u32,
    /// Time quantum in nanoseconds; 0 if the hardware only has fixed bit rates.
    pub(super) quantum: u32,
    /// Propagation segment, phase segments 1 and 2, jump width, in time quanta.
    pub(super) segments: [u32; 4],
}

impl BitTiming {
    fn read(data: &[u8]) -> Option<BitTiming> {
        let at = |index: usize| u32_at(data, index * 4);
        Some(BitTiming {
            bit_rate: at(0)?,
            sample_point: at(1)?,
            quantum: at(2)?,
            segments: [at(3)?, at(4)?, at(5)?, at(6)?],
        })
    }

    /// Returns a request for this bit rate. The kernel computes the bit timing.
    pub(in super::super) fn of_rate(bit_rate: u32) -> BitTiming {
        BitTiming { bit_rate, sample_point: 0, quantum: 0, segments: [0; 4] }
    }

    /// Returns this bit timing as a request. The kernel accepts either a bit rate or time quanta.
    pub(in super::super) fn to_request(self) -> BitTiming {
        if self.quantum == 0 { BitTiming::of_rate(self.bit_rate) } else { BitTiming { bit_rate: 0, ..self } }
    }

    fn bytes(self) -> Vec<u8> {
        // The last value is the prescaler, which the kernel computes.
        let [propagation, phase1, phase2, jump] = self.segments;
        [self.bit_rate, self.sample_point, self.quantum, propagation, phase1, phase2, jump, 0]
            .into_iter()
            .flat_map(u32::to_ne_bytes)
            .collect()
    }
}

/// A network interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// The index in the kernel.
    pub(super) index: i32,
    /// The primary name. An interface may have other names (altname).
    pub name: String,
    /// Whether it carries CAN frames.
    pub is_can: bool,
    /// Whether it is up.
    pub up: bool,
    /// The kind: `can` is a controller, `vcan` and `vxcan` are virtual. `None` if it has no kind.
    pub kind: Option<String>,
    /// The bit timing, if a bit rate was set.
    pub bit_timing: Option<BitTiming>,
    /// The controller's state.
    pub state: Option<State>,
    /// Whether the controller only listens.
    pub listen_only: Option<bool>,
    /// Whether the controller supports listen-only mode, if the kernel reports that (Linux 5.17).
    pub can_listen_only: Option<bool>,
    /// The time in milliseconds until a restart after bus-off; 0: never.
    pub restart_ms: Option<u32>,
    /// The transmit and receive error counters.
    pub errors: Option<(u16, u16)>,
    /// The fixed bit rates of the hardware in bit/s, if it has such a list.
    pub fixed_rates: Option<Vec<u32>>,
    /// The highest bit rate in bit/s, if known.
    pub rate_max: Option<u32>,
}

impl Link {
    /// Parses the kernel's description.
    pub(super) fn read(header: Header, attributes: Attributes<'_>) -> Link {
        let info = attributes.nested(LINK_INFO);
        let kind = info.and_then(|info| info.text(INFO_KIND));
        // The attributes have these meanings only in an interface of the kind `can`.
        let can = info.filter(|_| kind == Some("can")).and_then(|info| info.nested(INFO_DATA));
        let mode = |data: &[u8]| u32_at(data, 4).map(|flags| flags & LISTEN_ONLY != 0);
        let supported = can.and_then(|can| can.nested(CONTROL_MODE_EXTENSION)?.u32(SUPPORTED));
        let timing = can.and_then(|can| BitTiming::read(can.get(BIT_TIMING)?));
        let rates = can.and_then(|can| can.get(FIXED_RATES)).map(|data| data.as_chunks::<4>().0);
        Link {
            index: header.index,
            name: attributes.text(NAME).unwrap_or_default().to_owned(),
            is_can: header.hardware == CAN_HARDWARE,
            up: header.flags & UP != 0,
            kind: kind.map(str::to_owned),
            bit_timing: timing.filter(|timing| timing.bit_rate > 0),
            state: can.and_then(|can| can.u32(STATE)).map(State::new),
            listen_only: can.and_then(|can| mode(can.get(CONTROL_MODE)?)),
            can_listen_only: supported.map(|modes| modes & LISTEN_ONLY != 0),
            restart_ms: can.and_then(|can| can.u32(RESTART_MS)),
            errors: can
                .and_then(|can| can.get(ERROR_COUNTERS))
                .and_then(|data| Some((u16_at(data, 0)?, u16_at(data, 2)?))),
            fixed_rates: rates.map(|rates| rates.iter().map(|rate| u32::from_ne_bytes(*rate)).collect()),
            rate_max: can.and_then(|can| can.u32(RATE_MAX)).filter(|&rate| rate > 0),
        }
    }

    /// The bit rate in bit/s, if one was set.
    pub fn bit_rate(&self) -> Option<u32> {
        self.bit_timing.map(|timing| timing.bit_rate)
    }

    /// Whether the interface is a controller with a bit rate.
    pub fn is_controller(&self) -> bool {
        self.kind.as_deref() == Some("can")
    }

    /// Returns a request that switches the interface on or off.
    pub(super) fn switch(&self, up: bool) -> Request {
        Request::set(self.index, u32::from(up), UP)
    }

    /// Returns a request that sets bit timing and listen-only mode.
    pub(super) fn configure(&self, timing: BitTiming, listen_only: Option<bool>) -> Request {
        let mut request = Request::set(self.index, 0, 0);
        request.nest(LINK_INFO, |request| {
            request.attribute(INFO_KIND, b"can");
            request.nest(INFO_DATA, |request| {
                request.attribute(BIT_TIMING, &timing.bytes());
                if let Some(listen_only) = listen_only {
                    let flags = if listen_only { LISTEN_ONLY } else { 0 };
                    request.attribute(CONTROL_MODE, &[LISTEN_ONLY.to_ne_bytes(), flags.to_ne_bytes()].concat());
                }
            });
        });
        request
    }
}
