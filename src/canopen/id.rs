//! Node-IDs and CAN identifiers. Their constructors check the range.
//!
//! The predefined connection set follows CiA 301, 7.3.3: function code in bits 10 to 7, node-ID in bits 6 to 0. The LSS
//! identifiers follow CiA 305.

use std::collections::HashMap;
use std::fmt;
use std::hash::{BuildHasherDefault, Hasher};
use std::str::FromStr;

/// A CANopen node-ID, 1 to 127 (CiA 301, 7.3.3). 0 addresses all nodes and is not a node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct NodeId(u8);

/// Text or a number that is not a node-ID.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("\"{0}\" is not a node-ID (1 to 127)")]
pub struct NodeIdError(String);

impl NodeId {
    /// The lowest node-ID.
    pub const MIN: NodeId = NodeId(1);
    /// The highest node-ID.
    pub const MAX: NodeId = NodeId(127);

    /// The node-ID with this number.
    ///
    /// # Errors
    /// `id` is not in 1 to 127.
    pub fn new(id: u8) -> Result<NodeId, NodeIdError> {
        if (1..=127).contains(&id) { Ok(NodeId(id)) } else { Err(NodeIdError(id.to_string())) }
    }

    /// The number, 1 to 127.
    pub fn get(self) -> u8 {
        self.0
    }

    /// All node-IDs in ascending order.
    pub fn all() -> impl Iterator<Item = NodeId> {
        (1..=127).map(NodeId)
    }

    fn from_cob_id(id: CanId, function: u16) -> Option<NodeId> {
        match id {
            CanId::Standard(id) if id & 0x780 == function && id & 0x7f != 0 => Some(NodeId((id & 0x7f) as u8)),
            _ => None,
        }
    }
}

impl fmt::Display for NodeId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(&self.0, f)
    }
}

impl FromStr for NodeId {
    type Err = NodeIdError;

    /// Parses `5` or `0x7f`.
    fn from_str(text: &str) -> Result<NodeId, NodeIdError> {
        parse_u32(text)
            .and_then(|number| u8::try_from(number).ok())
            .and_then(|number| NodeId::new(number).ok())
            .ok_or_else(|| NodeIdError(text.to_owned()))
    }
}

/// Parses an unsigned number that a user typed: decimal, or hexadecimal with `0x`. Returns `None` if the text is no
/// such number, or if the number has more than 32 bits.
pub fn parse_u32(text: &str) -> Option<u32> {
    let digits_only = |digits: &str| !digits.is_empty() && !digits.starts_with('+');
    match text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        Some(hex) if digits_only(hex) => u32::from_str_radix(hex, 16).ok(),
        None if digits_only(text) => text.parse().ok(),
        _ => None,
    }
}

/// The identifier of a CAN frame: 11 or 29 bits.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum CanId {
    /// 11 bits, 000h to 7FFh.
    Standard(u16),
    /// 29 bits, 0 to 1FFF_FFFFh.
    Extended(u32),
}

impl CanId {
    /// NMT commands, 000h.
    pub const NMT: CanId = CanId::Standard(0x000);
    /// The predefined SYNC identifier, 080h.
    pub const SYNC: CanId = CanId::Standard(0x080);
    /// LSS slave to master, 7E4h.
    pub const LSS_SLAVE: CanId = CanId::Standard(0x7e4);
    /// LSS master to slave, 7E5h.
    pub const LSS_MASTER: CanId = CanId::Standard(0x7e5);

    /// An 11-bit identifier; `None` if `id` is above 7FFh.
    pub fn standard(id: u16) -> Option<CanId> {
        (id <= 0x7ff).then_some(CanId::Standard(id))
    }

    /// A 29-bit identifier; `None` if `id` is above 1FFF_FFFFh.
    pub fn extended(id: u32) -> Option<CanId> {
        (id <= 0x1fff_ffff).then_some(CanId::Extended(id))
    }

    /// Returns the number of the identifier, without the width (11 or 29 bits).
    pub fn number(self) -> u32 {
        match self {
            CanId::Standard(id) => u32::from(id),
            CanId::Extended(id) => id,
        }
    }

    /// Returns the COB-ID of SDO requests to `node`: 600h + node-ID.
    pub fn sdo_request(node: NodeId) -> CanId {
        CanId::Standard(0x600 + u16::from(node.0))
    }

    /// Returns the COB-ID of SDO answers from `node`: 580h + node-ID.
    pub fn sdo_response(node: NodeId) -> CanId {
        CanId::Standard(0x580 + u16::from(node.0))
    }

    /// Returns the COB-ID of heartbeat, boot-up and node guarding of `node`: 700h + node-ID.
    pub fn heartbeat(node: NodeId) -> CanId {
        CanId::Standard(0x700 + u16::from(node.0))
    }

    /// Returns the predefined EMCY identifier of `node`: 080h + node-ID.
    pub fn emergency(node: NodeId) -> CanId {
        CanId::Standard(0x080 + u16::from(node.0))
    }

    /// The node whose SDO server sends with this identifier.
    pub fn sdo_response_node(self) -> Option<NodeId> {
        NodeId::from_cob_id(self, 0x580)
    }

    /// The node whose SDO server receives this identifier.
    pub fn sdo_request_node(self) -> Option<NodeId> {
        NodeId::from_cob_id(self, 0x600)
    }

    /// The node whose heartbeat, boot-up message or node guarding answer has this identifier.
    pub fn heartbeat_node(self) -> Option<NodeId> {
        NodeId::from_cob_id(self, 0x700)
    }

    /// The node with this predefined EMCY identifier.
    pub fn emergency_node(self) -> Option<NodeId> {
        NodeId::from_cob_id(self, 0x080)
    }

    /// Whether this is one of the predefined identifiers of PDOs, 180h to 57Fh.
    pub fn is_predefined_pdo(self) -> bool {
        matches!(self, CanId::Standard(0x180..=0x57f))
    }

    /// Whether CiA 301, 7.3.5 forbids this identifier for PDOs, SYNC and EMCY.
    pub fn is_restricted(self) -> bool {
        match self {
            CanId::Extended(_) => false,
            CanId::Standard(id) => matches!(
                id,
                0x000..=0x07f | 0x101..=0x180 | 0x581..=0x5ff | 0x601..=0x67f | 0x6e0..=0x6ff | 0x701..=0x7ff
            ),
        }
    }
}

/// A hash map with identifiers as keys. The hash is fast, but not safe if others choose the keys. So only the program
/// adds keys, and frames from the bus are only looked up.
pub type CanIdMap<V> = HashMap<CanId, V, BuildHasherDefault<CanIdHasher>>;

/// Hashes an identifier in a few instructions.
#[derive(Clone, Copy, Debug, Default)]
pub struct CanIdHasher(u64);

impl Hasher for CanIdHasher {
    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(byte.into()));
    }

    fn write_u16(&mut self, number: u16) {
        self.write_u64(number.into());
    }

    fn write_u32(&mut self, number: u32) {
        self.write_u64(number.into());
    }

    fn write_u64(&mut self, number: u64) {
        self.0 = (self.0.rotate_left(32) ^ number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    }

    /// Hashes the discriminant of [`CanId`]: the width of the identifier.
    fn write_isize(&mut self, number: isize) {
        self.write_u64(u64::from(number != 0));
    }

    fn finish(&self) -> u64 {
        self.0 ^ self.0 >> 32
    }
}

impl fmt::Display for CanId {
    /// Three hexadecimal digits for 11 bits, eight for 29, as candump prints them.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            CanId::Standard(id) => write!(f, "{id:03X}"),
            CanId::Extended(id) => write!(f, "{id:08X}"),
        }
    }
}

/// The bit rates of classic CAN, in bit/s.
const BIT_RATES: std::ops::RangeInclusive<u32> = 1_000..=1_000_000;

/// Parses a CAN bit rate (`250k`, `1M`, `125000`). Returns bit/s.
///
/// # Errors
/// The text is not a bit rate.
pub fn bit_rate(text: &str) -> Result<u32, String> {
    let (number, factor) = match text.strip_suffix(['k', 'K']) {
        Some(number) => (number, 1_000),
        None => text.strip_suffix('M').map_or((text, 1), |number| (number, 1_000_000)),
    };
    let digits = !number.is_empty() && number.bytes().all(|byte| byte.is_ascii_digit());
    let rate = number.parse::<u32>().ok().filter(|_| digits).and_then(|number| number.checked_mul(factor));
    rate.filter(|rate| BIT_RATES.contains(rate))
        .ok_or_else(|| format!("\"{text}\" is not a CAN bit rate (250k, 1M, 125000)"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn node_ids_are_checked_never_clamped() {
        assert_eq!("5".parse::<NodeId>().map(NodeId::get), Ok(5));
        assert_eq!("0x7f".parse::<NodeId>().map(NodeId::get), Ok(127));
        for wrong in ["0", "128", "200", "0x80", "-1", "+5", "5 ", "", "0x", "five", "99999999999"] {
            assert_eq!(wrong.parse::<NodeId>(), Err(NodeIdError(wrong.to_owned())), "{wrong}");
        }
    }

    #[test]
    fn predefined_connection_set() {
        let dps = NodeId::MAX;
        assert_eq!(CanId::sdo_request(dps).to_string(), "67F");
        assert_eq!(CanId::sdo_response(dps).to_string(), "5FF");
        assert_eq!(CanId::heartbeat(dps).to_string(), "77F");
        assert_eq!(CanId::heartbeat(dps).heartbeat_node(), Some(dps));
        assert_eq!(CanId::Standard(0x700).heartbeat_node(), None);
        assert_eq!(CanId::Extended(0x77f).heartbeat_node(), None);
        // Table 8 of the DPS manual contains 7FFh as heartbeat, but no node has this COB-ID.
        assert_eq!(CanId::Standard(0x7ff).heartbeat_node(), None);
    }

    #[test]
    fn restricted_identifiers() {
        for id in [0x000, 0x001, 0x07f, 0x101, 0x180, 0x581, 0x601, 0x6e0, 0x701, 0x77f, 0x7e4] {
            assert!(CanId::Standard(id).is_restricted(), "{id:03X}");
        }
        for id in [0x080, 0x081, 0x100, 0x181, 0x580, 0x600, 0x680, 0x700] {
            assert!(!CanId::Standard(id).is_restricted(), "{id:03X}");
        }
    }
}
