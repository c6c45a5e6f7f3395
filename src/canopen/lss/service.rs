//! The services of CiA 305 and their request frames on 7E5h.

use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use std::fmt;

/// The node-ID of a slave that has none: FFh.
pub const UNCONFIGURED: u8 = 0xff;

/// The two states of a slave.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// 0: normal operation.
    Waiting,
    /// 1: the slave accepts configuration services.
    Configuration,
}

/// The four numbers of an LSS address, in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Part {
    /// 1018h.1.
    Vendor,
    /// 1018h.2.
    Product,
    /// 1018h.3.
    Revision,
    /// 1018h.4.
    Serial,
}

impl Part {
    /// All parts in order.
    pub const ALL: [Part; 4] = [Part::Vendor, Part::Product, Part::Revision, Part::Serial];

    /// The number of the part, 0 to 3.
    pub fn number(self) -> u8 {
        self as u8
    }

    /// The part with a number from 0 to 3.
    pub fn from_number(number: u8) -> Option<Part> {
        Part::ALL.into_iter().find(|part| part.number() == number)
    }
}

/// An LSS service.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Service {
    /// 04h, no answer.
    SwitchGlobal,
    /// 40h to 43h, answered with 44h.
    SwitchSelective,
    /// 11h.
    ConfigureNodeId,
    /// 13h.
    ConfigureBitTiming,
    /// 15h, no answer.
    ActivateBitTiming,
    /// 17h.
    Store,
    /// 5Ah to 5Dh.
    Inquire(Part),
    /// 5Eh.
    InquireNodeId,
    /// 46h to 4Bh, answered with 4Fh.
    Identify,
    /// 4Ch, answered with 50h.
    IdentifyUnconfigured,
    /// 51h, answered with 4Fh.
    Fastscan,
}

impl Service {
    /// The command specifier of the answer; `None` if slaves do not answer.
    pub fn answer_specifier(self) -> Option<u8> {
        Some(match self {
            Service::SwitchGlobal | Service::ActivateBitTiming => return None,
            Service::SwitchSelective => 0x44,
            Service::ConfigureNodeId => 0x11,
            Service::ConfigureBitTiming => 0x13,
            Service::Store => 0x17,
            Service::Inquire(part) => 0x5a + part.number(),
            Service::InquireNodeId => 0x5e,
            Service::Identify | Service::Fastscan => 0x4f,
            Service::IdentifyUnconfigured => 0x50,
        })
    }

    /// Whether all addressed slaves answer with the same frame. The number of answers is then not the number of slaves.
    pub fn has_common_answer(self) -> bool {
        matches!(self, Service::Identify | Service::IdentifyUnconfigured | Service::Fastscan)
    }
}

impl fmt::Display for Service {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Service::SwitchGlobal => "switch state global",
            Service::SwitchSelective => "switch state selective",
            Service::ConfigureNodeId => "configure node-ID",
            Service::ConfigureBitTiming => "configure bit timing",
            Service::ActivateBitTiming => "activate bit timing",
            Service::Store => "store configuration",
            Service::Inquire(Part::Vendor) => "inquire vendor-ID",
            Service::Inquire(Part::Product) => "inquire product code",
            Service::Inquire(Part::Revision) => "inquire revision number",
            Service::Inquire(Part::Serial) => "inquire serial number",
            Service::InquireNodeId => "inquire node-ID",
            Service::Identify => "identify remote slave",
            Service::IdentifyUnconfigured => "identify non-configured slaves",
            Service::Fastscan => "fastscan",
        })
    }
}

/// One request frame of a master.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Request {
    /// 04h: switches all slaves to a state.
    SwitchGlobal(Mode),
    /// 40h to 43h: selects the slave with these four numbers. It answers the last of the four requests.
    Select(Part, u32),
    /// 11h: sets the node-ID; `None` removes it.
    ConfigureNodeId(Option<NodeId>),
    /// 13h: sets the bit rate by table and index. Table 0 is the table of CiA 305.
    ConfigureBitTiming {
        /// The table.
        table: u8,
        /// The index.
        index: u8,
    },
    /// 15h: changes to the new bit rate after this many milliseconds, and sends again after the same time.
    ActivateBitTiming {
        /// The time in milliseconds.
        delay_ms: u16,
    },
    /// 17h: stores node-ID and bit rate.
    Store,
    /// 5Ah to 5Dh.
    Inquire(Part),
    /// 5Eh.
    InquireNodeId,
    /// 46h to 4Bh: asks for slaves with this vendor-ID and product code, and with numbers in these ranges. Slaves
    /// answer the last of the six requests.
    Identify(Limit, u32),
    /// 4Ch: asks for slaves without a node-ID.
    IdentifyUnconfigured,
    /// 51h: asks for slaves without a node-ID whose number has these upper bits.
    Fastscan {
        /// The number to compare with.
        number: u32,
        /// The lowest bit compared, 0 to 31. 80h ([`Request::ALL_SLAVES`]) asks all slaves and restarts their scans.
        bit_check: u8,
        /// The part that is compared.
        sub: Part,
        /// The part that matching slaves compare next.
        next: Part,
    },
}

/// The six numbers of [`Request::Identify`], in their order.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Limit {
    /// 46h.
    Vendor,
    /// 47h.
    Product,
    /// 48h.
    RevisionLow,
    /// 49h.
    RevisionHigh,
    /// 4Ah.
    SerialLow,
    /// 4Bh.
    SerialHigh,
}

impl Limit {
    /// All limits in order.
    pub const ALL: [Limit; 6] =
        [Limit::Vendor, Limit::Product, Limit::RevisionLow, Limit::RevisionHigh, Limit::SerialLow, Limit::SerialHigh];
}

impl Request {
    /// The value of `bit_check` that all slaves without a node-ID answer.
    pub const ALL_SLAVES: u8 = 0x80;

    /// The fastscan request that all slaves without a node-ID answer.
    pub const ANY_UNCONFIGURED: Request =
        Request::Fastscan { number: 0, bit_check: Request::ALL_SLAVES, sub: Part::Vendor, next: Part::Vendor };

    /// The service that the frame belongs to.
    pub fn service(self) -> Service {
        match self {
            Request::SwitchGlobal(_) => Service::SwitchGlobal,
            Request::Select(..) => Service::SwitchSelective,
            Request::ConfigureNodeId(_) => Service::ConfigureNodeId,
            Request::ConfigureBitTiming { .. } => Service::ConfigureBitTiming,
            Request::ActivateBitTiming { .. } => Service::ActivateBitTiming,
            Request::Store => Service::Store,
            Request::Inquire(part) => Service::Inquire(part),
            Request::InquireNodeId => Service::InquireNodeId,
            Request::Identify(..) => Service::Identify,
            Request::IdentifyUnconfigured => Service::IdentifyUnconfigured,
            Request::Fastscan { .. } => Service::Fastscan,
        }
    }

    /// Returns the frame: always eight bytes; unused bytes are 0.
    pub fn frame(self) -> Frame {
        let with_number = |specifier: u8, number: u32| {
            let [a, b, c, d] = number.to_le_bytes();
            [specifier, a, b, c, d, 0, 0, 0]
        };
        let with_pair = |specifier: u8, [first, second]: [u8; 2]| [specifier, first, second, 0, 0, 0, 0, 0];
        let data = match self {
            Request::SwitchGlobal(mode) => with_pair(0x04, [u8::from(mode == Mode::Configuration), 0]),
            Request::Select(part, number) => with_number(0x40 + part.number(), number),
            Request::ConfigureNodeId(node) => with_pair(0x11, [node.map_or(UNCONFIGURED, NodeId::get), 0]),
            Request::ConfigureBitTiming { table, index } => with_pair(0x13, [table, index]),
            Request::ActivateBitTiming { delay_ms } => with_pair(0x15, delay_ms.to_le_bytes()),
            Request::Store => with_pair(0x17, [0, 0]),
            Request::Inquire(part) => with_pair(0x5a + part.number(), [0, 0]),
            Request::InquireNodeId => with_pair(0x5e, [0, 0]),
            Request::Identify(limit, number) => with_number(0x46 + limit as u8, number),
            Request::IdentifyUnconfigured => with_pair(0x4c, [0, 0]),
            Request::Fastscan { number, bit_check, sub, next } => {
                let [a, b, c, d] = number.to_le_bytes();
                [0x51, a, b, c, d, bit_check, sub.number(), next.number()]
            }
        };
        Frame::full(CanId::LSS_MASTER, data)
    }

    /// Parses a frame of a master; `None` for other frames, short frames, and numbers that the standard does not
    /// define.
    pub fn parse(frame: &Frame) -> Option<Request> {
        if frame.id() != CanId::LSS_MASTER {
            return None;
        }
        let (&specifier, rest) = frame.data().split_first()?;
        let number = || rest.first_chunk().map(|bytes| u32::from_le_bytes(*bytes));
        Some(match specifier {
            0x04 => Request::SwitchGlobal(match rest.first()? {
                0 => Mode::Waiting,
                1 => Mode::Configuration,
                _ => return None,
            }),
            0x11 => Request::ConfigureNodeId(match *rest.first()? {
                UNCONFIGURED => None,
                node => Some(NodeId::new(node).ok()?),
            }),
            0x13 => Request::ConfigureBitTiming { table: *rest.first()?, index: *rest.get(1)? },
            0x15 => Request::ActivateBitTiming { delay_ms: u16::from_le_bytes(*rest.first_chunk()?) },
            0x17 => Request::Store,
            0x40..=0x43 => Request::Select(Part::from_number(specifier - 0x40)?, number()?),
            0x46..=0x4b => Request::Identify(*Limit::ALL.get(usize::from(specifier - 0x46))?, number()?),
            0x4c => Request::IdentifyUnconfigured,
            0x51 => match rest {
                [_, _, _, _, bit_check @ (0..=31 | Request::ALL_SLAVES), sub, next, ..] => Request::Fastscan {
                    number: number()?,
                    bit_check: *bit_check,
                    sub: Part::from_number(*sub)?,
                    next: Part::from_number(*next)?,
                },
                _ => return None,
            },
            0x5a..=0x5d => Request::Inquire(Part::from_number(specifier - 0x5a)?),
            0x5e => Request::InquireNodeId,
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    #[test]
    fn requests_match_the_frames_of_the_standard() {
        let node = NodeId::new(0x7e).ok();
        for (request, text) in [
            (Request::SwitchGlobal(Mode::Waiting), "7E5#0400000000000000"),
            (Request::SwitchGlobal(Mode::Configuration), "7E5#0401000000000000"),
            (Request::Select(Part::Vendor, 0x362), "7E5#4062030000000000"),
            (Request::Select(Part::Product, 0x0044_3150), "7E5#4150314400000000"),
            (Request::Select(Part::Revision, 0x0001_0000), "7E5#4200000100000000"),
            (Request::Select(Part::Serial, 20002), "7E5#43224E0000000000"),
            (Request::ConfigureNodeId(node), "7E5#117E000000000000"),
            (Request::ConfigureNodeId(None), "7E5#11FF000000000000"),
            (Request::ConfigureBitTiming { table: 0, index: 4 }, "7E5#1300040000000000"),
            (Request::ActivateBitTiming { delay_ms: 1000 }, "7E5#15E8030000000000"),
            (Request::Store, "7E5#1700000000000000"),
            (Request::Inquire(Part::Vendor), "7E5#5A00000000000000"),
            (Request::Inquire(Part::Serial), "7E5#5D00000000000000"),
            (Request::InquireNodeId, "7E5#5E00000000000000"),
            (Request::Identify(Limit::Vendor, 0x362), "7E5#4662030000000000"),
            (Request::Identify(Limit::SerialHigh, u32::MAX), "7E5#4BFFFFFFFF000000"),
            (Request::IdentifyUnconfigured, "7E5#4C00000000000000"),
            (
                Request::Fastscan { number: 0, bit_check: Request::ALL_SLAVES, sub: Part::Vendor, next: Part::Vendor },
                "7E5#5100000000800000",
            ),
            (
                Request::Fastscan { number: 0x1234_5678, bit_check: 0, sub: Part::Vendor, next: Part::Product },
                "7E5#5178563412000001",
            ),
        ] {
            assert_eq!(request.frame(), frame(text));
            assert_eq!(Request::parse(&frame(text)), Some(request), "{text}");
        }
    }

    #[test]
    fn invalid_frames_are_not_requests() {
        for text in [
            "7E5#",
            "7E5#04",
            "7E5#0402",
            "7E5#1100",
            "7E5#1180",
            "7E5#1300",
            "7E5#15E8",
            "7E5#40620300",
            "7E5#4B620300",
            "7E5#51000000008000",
            "7E5#5100000000200000",
            "7E5#5100000000000400",
            "7E5#4400000000000000",
            "7E4#0401000000000000",
            "000007E5#0401000000000000",
            "7E5#R8",
        ] {
            assert_eq!(Request::parse(&frame(text)), None, "{text}");
        }
    }

    proptest! {
            #[test]
    fn parsed_requests_round_trip(bytes in proptest::collection::vec(any::<u8>(), 0..=8)) {
                let frame = Frame::new(CanId::LSS_MASTER, &bytes).expect("a frame");
                if let Some(request) = Request::parse(&frame) {
                    // The parsed request equals the sent request, except for unused bytes.
                    prop_assert_eq!(Request::parse(&request.frame()), Some(request));
                }
            }
        }
}
