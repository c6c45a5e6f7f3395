//! LSS addresses, and ranges of LSS addresses.

use super::{Limit, Part, Request};
use crate::canopen::id::parse_u32;
use std::fmt;
use std::str::FromStr;

/// The identity of a slave (1018h). It is unique worldwide.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct LssAddress {
    /// 1018h.1.
    pub vendor: u32,
    /// 1018h.2.
    pub product: u32,
    /// 1018h.3.
    pub revision: u32,
    /// 1018h.4.
    pub serial: u32,
}

/// Slaves of one vendor and product, with revision and serial numbers in these ranges (limits included).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct LssRange {
    /// 1018h.1.
    pub vendor: u32,
    /// 1018h.2.
    pub product: u32,
    /// The lowest and the highest 1018h.3.
    pub revision: (u32, u32),
    /// The lowest and the highest 1018h.4.
    pub serial: (u32, u32),
}

/// Text that is not an address or a range.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LssAddressError {
    /// The text is not an address.
    #[error("\"{0}\" is not an LSS address (VENDOR:PRODUCT:REVISION:SERIAL)")]
    Address(String),
    /// The text is not a range.
    #[error("\"{0}\" is not a range of LSS addresses (VENDOR:PRODUCT:REVMIN-REVMAX:SERMIN-SERMAX)")]
    Range(String),
    /// The lower limit of a range is above the upper one.
    #[error("{0}-{1}: the lower limit is above the upper one")]
    Reversed(String, String),
}

impl LssAddress {
    /// Creates an address from four numbers, in the order of [`Part::ALL`].
    pub fn new([vendor, product, revision, serial]: [u32; 4]) -> LssAddress {
        LssAddress { vendor, product, revision, serial }
    }

    /// The four numbers in the order of [`Part::ALL`].
    pub fn parts(&self) -> [u32; 4] {
        [self.vendor, self.product, self.revision, self.serial]
    }

    /// One of the four numbers.
    pub fn part(&self, part: Part) -> u32 {
        self.parts()[usize::from(part.number())]
    }

    /// Returns the requests that select the slave with this address, in order.
    pub fn selection(&self) -> [Request; 4] {
        Part::ALL.map(|part| Request::Select(part, self.part(part)))
    }

    /// Returns two ranges of the same vendor and product: all lower and all higher serial numbers, in all revisions.
    /// `None` if no lower or no higher number exists.
    pub fn neighbours(&self) -> [Option<LssRange>; 2] {
        let range = |serial| LssRange { vendor: self.vendor, product: self.product, revision: (0, u32::MAX), serial };
        [
            self.serial.checked_sub(1).map(|below| range((0, below))),
            self.serial.checked_add(1).map(|above| range((above, u32::MAX))),
        ]
    }

    /// Returns two ranges of the same vendor, product and serial number: all lower and all higher revisions.
    pub fn revisions(&self) -> [Option<LssRange>; 2] {
        let range = |revision| LssRange { revision, ..LssRange::from(*self) };
        [
            self.revision.checked_sub(1).map(|below| range((0, below))),
            self.revision.checked_add(1).map(|above| range((above, u32::MAX))),
        ]
    }
}

impl LssRange {
    /// Returns the frames of the identify request, in order.
    pub fn identification(&self) -> [Request; 6] {
        Limit::ALL.map(|limit| {
            let number = match limit {
                Limit::Vendor => self.vendor,
                Limit::Product => self.product,
                Limit::RevisionLow => self.revision.0,
                Limit::RevisionHigh => self.revision.1,
                Limit::SerialLow => self.serial.0,
                Limit::SerialHigh => self.serial.1,
            };
            Request::Identify(limit, number)
        })
    }

    /// Whether the range contains this address.
    pub fn contains(&self, address: &LssAddress) -> bool {
        let within = |number: u32, (low, high): (u32, u32)| (low..=high).contains(&number);
        self.vendor == address.vendor
            && self.product == address.product
            && within(address.revision, self.revision)
            && within(address.serial, self.serial)
    }
}

impl From<LssAddress> for LssRange {
    fn from(address: LssAddress) -> LssRange {
        let LssAddress { vendor, product, revision, serial } = address;
        LssRange { vendor, product, revision: (revision, revision), serial: (serial, serial) }
    }
}

impl fmt::Display for LssAddress {
    /// `0x362:0x443150:0x10000:20002`. The serial number is decimal, as on labels.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:X}:0x{:X}:0x{:X}:{}", self.vendor, self.product, self.revision, self.serial)
    }
}

impl fmt::Display for LssRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:X}:0x{:X}:", self.vendor, self.product)?;
        write!(f, "0x{:X}-0x{:X}:", self.revision.0, self.revision.1)?;
        write!(f, "{}-{}", self.serial.0, self.serial.1)
    }
}

impl FromStr for LssAddress {
    type Err = LssAddressError;

    /// Parses four numbers, decimal or `0x…`.
    fn from_str(text: &str) -> Result<LssAddress, LssAddressError> {
        let numbers: Option<Vec<u32>> = text.split(':').map(parse_u32).collect();
        numbers
            .and_then(|numbers| Some(LssAddress::new(<[u32; 4]>::try_from(numbers).ok()?)))
            .ok_or_else(|| LssAddressError::Address(text.to_owned()))
    }
}

impl FromStr for LssRange {
    type Err = LssAddressError;

    /// Parses two numbers and two ranges. A single number is a range with one element.
    fn from_str(text: &str) -> Result<LssRange, LssAddressError> {
        let wrong = || LssAddressError::Range(text.to_owned());
        let range = |text: &str| -> Result<(u32, u32), LssAddressError> {
            let (low, high) = text.split_once('-').unwrap_or((text, text));
            let limits = (parse_u32(low).ok_or_else(wrong)?, parse_u32(high).ok_or_else(wrong)?);
            if limits.0 > limits.1 {
                return Err(LssAddressError::Reversed(low.to_owned(), high.to_owned()));
            }
            Ok(limits)
        };
        let parts: Vec<&str> = text.split(':').collect();
        let [vendor, product, revision, serial] = parts[..] else { return Err(wrong()) };
        Ok(LssRange {
            vendor: parse_u32(vendor).ok_or_else(wrong)?,
            product: parse_u32(product).ok_or_else(wrong)?,
            revision: range(revision)?,
            serial: range(serial)?,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn addresses_and_ranges_are_parsed_and_printed() {
        let dps = LssAddress::new([0x362, 0x0044_3150, 0x0001_0000, 20002]);
        for text in ["0x362:0x443150:0x10000:20002", "866:4469072:65536:0x4E22"] {
            assert_eq!(text.parse(), Ok(dps), "{text}");
        }
        assert_eq!(dps.to_string(), "0x362:0x443150:0x10000:20002");
        for text in ["", "1:2:3", "1:2:3:4:5", "1:2:3:", "1:2:3:x", "1:2:3:-4", "1:2:3:4294967296", "1:2:3:4-5"] {
            assert_eq!(text.parse::<LssAddress>(), Err(LssAddressError::Address(text.to_owned())), "{text}");
        }
        let range = LssRange { revision: (0, u32::MAX), serial: (5, 7), ..LssRange::from(dps) };
        assert_eq!("0x362:0x443150:0-0xffffffff:5-7".parse(), Ok(range));
        assert_eq!(range.to_string(), "0x362:0x443150:0x0-0xFFFFFFFF:5-7");
        assert_eq!("0x362:0x443150:0x10000:20002".parse(), Ok(LssRange::from(dps)));
        for text in ["1:2:3-:4", "1:2:-3:4", "1-2:2:3:4", "1:2:3-4-5:6"] {
            assert_eq!(text.parse::<LssRange>(), Err(LssAddressError::Range(text.to_owned())), "{text}");
        }
        let reversed = LssAddressError::Reversed("7".to_owned(), "5".to_owned());
        assert_eq!("1:2:3:7-5".parse::<LssRange>(), Err(reversed));
    }

    #[test]
    fn the_lowest_and_highest_serial_number_have_one_neighbour() {
        let with_serial =
            |serial| LssAddress::new([1, 2, 3, serial]).neighbours().map(|range| range.map(|it| it.serial));
        assert_eq!(with_serial(0), [None, Some((1, u32::MAX))]);
        assert_eq!(with_serial(7), [Some((0, 6)), Some((8, u32::MAX))]);
        assert_eq!(with_serial(u32::MAX), [Some((0, u32::MAX - 1)), None]);
    }

    proptest! {
            #[test]
            fn text_round_trips(parts: [u32; 4], more: (u32, u32)) {
                let address = LssAddress::new(parts);
                prop_assert_eq!(address.to_string().parse(), Ok(address));
                let range = LssRange {
                    revision: (address.revision.min(more.0), address.revision.max(more.0)),
                    serial: (address.serial.min(more.1), address.serial.max(more.1)),
                    ..LssRange::from(address)
                };
                prop_assert_eq!(range.to_string().parse(), Ok(range));
                prop_assert!(range.contains(&address));
            }

    /// Together, `neighbours` and `revisions` contain every other address once, but not the address itself.
            #[test]
    fn ranges_cover_all_other_addresses(revision in 0u32..4, serial in 0u32..4, other in (0u32..4, 0u32..4)) {
                let address = LssAddress { vendor: 1, product: 2, revision, serial };
                let other = LssAddress { revision: other.0, serial: other.1, ..address };
                let found = address.neighbours().into_iter().chain(address.revisions()).flatten();
                prop_assert_eq!(found.filter(|range| range.contains(&other)).count(), usize::from(other != address));
            }
        }
}
