//! SDO abort codes (CiA 301, table 22).

use std::fmt;

/// The reason why a device rejected or aborted a transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct AbortCode(pub u32);

impl AbortCode {
    /// Toggle bit not alternated.
    pub const TOGGLE: AbortCode = AbortCode(0x0503_0000);
    /// SDO protocol timed out.
    pub const TIMEOUT: AbortCode = AbortCode(0x0504_0000);
    /// Command specifier not valid or unknown.
    pub const COMMAND_SPECIFIER: AbortCode = AbortCode(0x0504_0001);
    /// Invalid block size.
    pub const BLOCK_SIZE: AbortCode = AbortCode(0x0504_0002);
    /// Invalid sequence number.
    pub const SEQUENCE: AbortCode = AbortCode(0x0504_0003);
    /// CRC error.
    pub const CRC: AbortCode = AbortCode(0x0504_0004);
    /// Out of memory.
    pub const OUT_OF_MEMORY: AbortCode = AbortCode(0x0504_0005);
    /// Object does not exist.
    pub const NO_OBJECT: AbortCode = AbortCode(0x0602_0000);
    /// The object cannot be mapped to a PDO.
    pub const NOT_MAPPABLE: AbortCode = AbortCode(0x0604_0041);
    /// Data type or length does not match.
    pub const LENGTH: AbortCode = AbortCode(0x0607_0010);
    /// Length too high.
    pub const LENGTH_HIGH: AbortCode = AbortCode(0x0607_0012);
    /// Length too low.
    pub const LENGTH_LOW: AbortCode = AbortCode(0x0607_0013);
    /// Sub-index does not exist.
    pub const NO_SUB_INDEX: AbortCode = AbortCode(0x0609_0011);
    /// Value outside its range.
    pub const VALUE: AbortCode = AbortCode(0x0609_0030);
    /// Attempt to read a write-only object.
    pub const WRITE_ONLY: AbortCode = AbortCode(0x0601_0001);
    /// Attempt to write a read-only object.
    pub const READ_ONLY: AbortCode = AbortCode(0x0601_0002);
    /// Not possible in the present device state.
    pub const DEVICE_STATE: AbortCode = AbortCode(0x0800_0022);
    /// General error.
    pub const GENERAL: AbortCode = AbortCode(0x0800_0000);

    /// Returns the meaning of the code; `None` if CiA 301 does not define the code.
    pub fn meaning(self) -> Option<&'static str> {
        Some(match self.0 {
            0x0503_0000 => "toggle bit not alternated",
            0x0504_0000 => "SDO protocol timed out",
            0x0504_0001 => "command specifier not valid or unknown",
            0x0504_0002 => "invalid block size",
            0x0504_0003 => "invalid sequence number",
            0x0504_0004 => "CRC error",
            0x0504_0005 => "out of memory",
            0x0601_0000 => "unsupported access to the object",
            0x0601_0001 => "the object is write-only",
            0x0601_0002 => "the object is read-only",
            0x0602_0000 => "the object does not exist",
            0x0604_0041 => "the object cannot be mapped to a PDO",
            0x0604_0042 => "the mapped objects exceed the length of a PDO",
            0x0604_0043 => "general parameter incompatibility",
            0x0604_0047 => "general internal incompatibility in the device",
            0x0606_0000 => "access failed because of a hardware error",
            0x0607_0010 => "data type or length does not match",
            0x0607_0012 => "data type does not match, length too high",
            0x0607_0013 => "data type does not match, length too low",
            0x0609_0011 => "the sub-index does not exist",
            0x0609_0030 => "value outside its range",
            0x0609_0031 => "value too high",
            0x0609_0032 => "value too low",
            0x0609_0036 => "maximum is less than minimum",
            0x060a_0023 => "resource not available: SDO connection",
            0x0800_0000 => "general error",
            0x0800_0020 => "data cannot be transferred or stored",
            0x0800_0021 => "data cannot be transferred or stored because of local control",
            0x0800_0022 => "data cannot be transferred or stored in the present device state",
            0x0800_0023 => "no object dictionary",
            0x0800_0024 => "no data available",
            _ => return None,
        })
    }
}

impl fmt::Display for AbortCode {
    /// `0x06020000, the object does not exist`; only the number for unknown codes.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "0x{:08X}", self.0)?;
        self.meaning().map_or(Ok(()), |meaning| write!(f, ", {meaning}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_of_the_standard_have_a_meaning_and_others_print_as_numbers() {
        let codes = [
            0x0503_0000,
            0x0504_0000,
            0x0504_0001,
            0x0504_0002,
            0x0504_0003,
            0x0504_0004,
            0x0504_0005,
            0x0601_0000,
            0x0601_0001,
            0x0601_0002,
            0x0602_0000,
            0x0604_0041,
            0x0604_0042,
            0x0604_0043,
            0x0604_0047,
            0x0606_0000,
            0x0607_0010,
            0x0607_0012,
            0x0607_0013,
            0x0609_0011,
            0x0609_0030,
            0x0609_0031,
            0x0609_0032,
            0x0609_0036,
            0x060a_0023,
            0x0800_0000,
            0x0800_0020,
            0x0800_0021,
            0x0800_0022,
            0x0800_0023,
            0x0800_0024,
        ];
        let mut words: Vec<_> = codes.iter().map(|&code| AbortCode(code).meaning().expect("a meaning")).collect();
        words.sort_unstable();
        words.dedup();
        assert_eq!(words.len(), codes.len());
        // Many programs contain a wrong table (0606_0010 …), which differs from the standard.
        assert_eq!(AbortCode(0x0606_0010).to_string(), "0x06060010");
        assert_eq!(AbortCode(0x0602_0000).to_string(), "0x06020000, the object does not exist");
    }
}
