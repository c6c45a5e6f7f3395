//! PDO parameters and the decoding of a TPDO by its mapping (CiA 301, 7.2.2 and 7.5.2.35 to 7.5.2.38).

use super::id::CanId;
use super::object::ObjectId;
use std::fmt;

/// The number n of a transmit PDO, 1 to 512. Its parameters are 1800h + n-1 (communication) and 1A00h + n-1 (mapping).
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TpdoNumber(u16);

impl TpdoNumber {
    /// The TPDO with this number; `None` if it is not in 1 to 512.
    pub fn new(number: u16) -> Option<TpdoNumber> {
        (1..=512).contains(&number).then_some(TpdoNumber(number))
    }

    /// The number, 1 to 512.
    pub fn get(self) -> u16 {
        self.0
    }

    /// The object at `sub` of the communication parameter record (CiA 301, 7.5.2.37).
    pub fn communication(self, sub: u8) -> ObjectId {
        ObjectId::new(0x1800 + self.0 - 1, sub)
    }

    /// The object at `sub` of the mapping parameter record (CiA 301, 7.5.2.38).
    pub fn mapping(self, sub: u8) -> ObjectId {
        ObjectId::new(0x1a00 + self.0 - 1, sub)
    }
}

impl fmt::Display for TpdoNumber {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "TPDO{}", self.0)
    }
}

/// A COB-ID as in 1005h, 1014h or 18xxh:1: a CAN identifier, and flags in bits 29 to 31.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CobId(pub u32);

impl CobId {
    const INVALID: u32 = 1 << 31;
    const NO_RTR: u32 = 1 << 30;
    const EXTENDED: u32 = 1 << 29;

    /// Whether the PDO or EMCY exists (bit 31 clear).
    pub fn is_valid(self) -> bool {
        self.0 & CobId::INVALID == 0
    }

    /// Whether a remote request is answered (bit 30 clear). PDOs only: in 1005h the bit means that the device sends
    /// SYNC.
    pub fn allows_rtr(self) -> bool {
        self.0 & CobId::NO_RTR == 0
    }

    /// The COB-ID with the PDO switched off: bit 31 set, other bits unchanged.
    pub fn switched_off(self) -> CobId {
        CobId(self.0 | CobId::INVALID)
    }

    /// The COB-ID with the PDO switched on: bit 31 clear, other bits unchanged.
    pub fn switched_on(self) -> CobId {
        CobId(self.0 & !CobId::INVALID)
    }

    /// The COB-ID with another 11-bit identifier and the same bits 30 and 31; `None` if `id` is above 7FFh.
    pub fn with_standard(self, id: u32) -> Option<CobId> {
        (id <= 0x7ff).then_some(CobId(self.0 & (CobId::INVALID | CobId::NO_RTR) | id))
    }

    /// The COB-ID without bit 30, for comparisons: some devices set this bit themselves.
    pub fn without_rtr(self) -> u32 {
        self.0 & !CobId::NO_RTR
    }

    /// The CAN identifier: bits 0 to 28 if bit 29 is set, else bits 0 to 10.
    pub fn can_id(self) -> CanId {
        if self.0 & CobId::EXTENDED == 0 {
            CanId::Standard((self.0 & 0x7ff) as u16)
        } else {
            CanId::Extended(self.0 & 0x1fff_ffff)
        }
    }
}

/// The transmission type of a TPDO (18xxh:2): when it is sent (CiA 301, table 72).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transmission {
    /// 0: at the next SYNC after a change.
    AcyclicSync,
    /// 1 to 240: at every n-th SYNC.
    Sync(u8),
    /// 252, 253: only on remote request.
    Rtr(u8),
    /// 254: manufacturer-specific; most measuring devices use the event timer.
    Manufacturer,
    /// 255: profile-specific: event timer, limits, delta.
    Profile,
    /// 241 to 251: reserved.
    Reserved(u8),
}

impl Transmission {
    /// The transmission type of a code.
    pub fn from_code(code: u8) -> Transmission {
        match code {
            0 => Transmission::AcyclicSync,
            1..=240 => Transmission::Sync(code),
            252 | 253 => Transmission::Rtr(code),
            254 => Transmission::Manufacturer,
            255 => Transmission::Profile,
            241..=251 => Transmission::Reserved(code),
        }
    }

    /// Whether the TPDO is sent only at a SYNC.
    pub fn needs_sync(self) -> bool {
        matches!(self, Transmission::AcyclicSync | Transmission::Sync(_))
    }
}

impl fmt::Display for Transmission {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Transmission::AcyclicSync => f.write_str("acyclic"),
            Transmission::Sync(n) => write!(f, "sync:{n}"),
            Transmission::Manufacturer => f.write_str("timer"),
            Transmission::Profile => f.write_str("event"),
            Transmission::Rtr(code) | Transmission::Reserved(code) => write!(f, "{code}"),
        }
    }
}

/// One entry of a mapping (1Axxh:1 …): an object and its length.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct MappingEntry {
    /// The mapped object.
    pub object: ObjectId,
    /// The length of the object in bits, 0 to 255.
    pub bits: u8,
}

impl MappingEntry {
    /// Decodes a mapping entry: index in bits 31 to 16, sub-index in bits 15 to 8, length in bits 7 to 0.
    pub fn from_word(word: u32) -> MappingEntry {
        let [bits, sub, low, high] = word.to_le_bytes();
        MappingEntry { object: ObjectId::new(u16::from_le_bytes([low, high]), sub), bits }
    }

    /// Encodes the mapping entry.
    pub fn word(self) -> u32 {
        let [low, high] = self.object.index.to_le_bytes();
        u32::from_le_bytes([self.bits, self.object.sub, low, high])
    }
}

/// The position of a mapped object in the data of a PDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// The mapped object and its length.
    pub entry: MappingEntry,
    /// The number of the first bit; bit 0 is the lowest bit of byte 0.
    pub start: u16,
}

impl Field {
    /// Extracts the field from the data of a PDO: its bytes in wire order, and their number. Unused upper bits of the
    /// last byte are 0. `None` if the data is too short, or the field has more than 64 bits.
    pub fn bytes(&self, data: &[u8]) -> Option<([u8; 8], usize)> {
        let bits = u32::from(self.entry.bits);
        let end = usize::from(self.start) + usize::from(self.entry.bits);
        if end > data.len() * 8 || bits > 64 || data.len() > 8 {
            return None;
        }
        let mut all = [0u8; 8];
        all[..data.len()].copy_from_slice(data);
        let shifted = u64::from_le_bytes(all).checked_shr(u32::from(self.start)).unwrap_or(0);
        let mask = if bits == 64 { u64::MAX } else { (1 << bits) - 1 };
        Some(((shifted & mask).to_le_bytes(), usize::from(self.entry.bits).div_ceil(8)))
    }
}

/// Returns the fields of a mapping. Each field starts at the end of the previous field (CiA 301, 7.5.2.36).
///
/// Some devices set the highest bit of an entry's length. A PDO has at most 64 bits, so the lower seven bits are used.
pub fn field_layout(mapping: &[MappingEntry]) -> Vec<Field> {
    let mut start = 0u16;
    mapping
        .iter()
        .map(|&entry| {
            let entry = MappingEntry { bits: entry.bits & 0x7f, ..entry };
            let field = Field { entry, start };
            start = start.saturating_add(u16::from(entry.bits));
            field
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn mapping_entries_of_the_manuals_decode() {
        // MH-4: pressure (REAL32). MC1609, TPDO4: sub-index 10h is 16.
        let pressure = MappingEntry { object: ObjectId::new(0x6130, 1), bits: 32 };
        assert_eq!(MappingEntry::from_word(0x6130_0120), pressure);
        assert_eq!(pressure.word(), 0x6130_0120);
        assert_eq!(MappingEntry::from_word(0x7130_1010).object, ObjectId::new(0x7130, 16));
    }

    #[test]
    fn cob_id_flags_are_read_and_changed() {
        let mh4 = CobId(0x4000_0181);
        assert!(mh4.is_valid() && !mh4.allows_rtr());
        assert_eq!(mh4.can_id(), CanId::Standard(0x181));
        assert!(!CobId(0xc000_0181).is_valid());
        assert_eq!(mh4.switched_off(), CobId(0xc000_0181));
        assert_eq!(mh4.switched_off().switched_on(), mh4);
        assert_eq!(mh4.with_standard(0x1a5), Some(CobId(0x4000_01a5)));
        assert_eq!(CobId(0xe012_3456).with_standard(0x1a5), Some(CobId(0xc000_01a5)));
        assert_eq!((mh4.with_standard(0x800), mh4.without_rtr()), (None, 0x181));
        assert_eq!(CobId(0x2012_3456).can_id(), CanId::Extended(0x0012_3456));
    }

    #[test]
    fn a_tpdo_is_decoded_by_its_mapping() {
        let fields = field_layout(&[MappingEntry::from_word(0x6130_0120), MappingEntry::from_word(0x6150_0108)]);
        let data = [0x50, 0xc3, 0, 0, 3];
        assert_eq!(fields[0].bytes(&data), Some(([0x50, 0xc3, 0, 0, 0, 0, 0, 0], 4)));
        assert_eq!(fields[1].bytes(&data), Some(([3, 0, 0, 0, 0, 0, 0, 0], 1)));
        assert_eq!(fields[1].bytes(&data[..4]), None);
        assert_eq!(fields[0].bytes(&[]), None);
    }

    #[test]
    fn a_field_may_start_within_a_byte() {
        let entries = [
            MappingEntry { object: ObjectId::new(1, 0), bits: 3 },
            MappingEntry { object: ObjectId::new(2, 0), bits: 13 },
        ];
        let fields = field_layout(&entries);
        assert_eq!(fields[1].bytes(&[0b1010_1101, 0xff]), Some(([0xf5, 0x1f, 0, 0, 0, 0, 0, 0], 2)));
    }

    #[test]
    fn transmission_types_have_names() {
        for (code, text, needs_sync) in [
            (0, "acyclic", true),
            (1, "sync:1", true),
            (240, "sync:240", true),
            (241, "241", false),
            (252, "252", false),
            (254, "timer", false),
            (255, "event", false),
        ] {
            let transmission = Transmission::from_code(code);
            assert_eq!((transmission.to_string().as_str(), transmission.needs_sync()), (text, needs_sync));
        }
    }

    proptest! {
            #[test]
    fn only_fields_inside_the_data_are_extracted(
                words in proptest::collection::vec(any::<u32>(), 0..10),
                data in proptest::collection::vec(any::<u8>(), 0..=8),
            ) {
                let mapping: Vec<_> = words.into_iter().map(MappingEntry::from_word).collect();
                for field in field_layout(&mapping) {
                    let fits = usize::from(field.start) + usize::from(field.entry.bits) <= data.len() * 8;
                    prop_assert_eq!(field.bytes(&data).is_some(), fits);
                }
            }
        }
}
