//! Abort codes that the simulated SDO server sends (CiA 301, 7.2.4.3.17).

/// The reason for a rejection: the code in bytes 4 to 7 of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Abort(pub u32);

impl Abort {
    /// Returns the code that a device sends if its manual lists only `listed`: the nearest listed code. If no listed
    /// code is near, returns `self`.
    pub(super) fn of_list(self, listed: &[u32]) -> Abort {
        let similar: &[Abort] = match self {
            Abort::VALUE | Abort::TOO_HIGH | Abort::TOO_LOW => &[Abort::VALUE, Abort::TOO_HIGH],
            Abort::NOT_MAPPABLE | Abort::PDO_LENGTH => &[Abort::NOT_MAPPABLE, Abort::VALUE],
            Abort::LENGTH => &[Abort::COMMAND],
            Abort::UNSUPPORTED | Abort::DEVICE_STATE => &[Abort::NOT_STORED],
            Abort::TIMEOUT | Abort::TOGGLE => return self,
            _ => &[],
        };
        let is_listed = |abort: &&Abort| listed.contains(&abort.0);
        let general = &[Abort::GENERAL];
        let mut candidates = std::iter::once(&self).chain(similar).chain(general);
        candidates.find(is_listed).copied().unwrap_or(self)
    }

    /// Toggle bit not alternated.
    pub const TOGGLE: Abort = Abort(0x0503_0000);
    /// The client did not continue the transfer.
    pub const TIMEOUT: Abort = Abort(0x0504_0000);
    /// Client command specifier not valid or unknown.
    pub const COMMAND: Abort = Abort(0x0504_0001);
    /// The block size is not in the range 1 to 127.
    pub const BLOCK_SIZE: Abort = Abort(0x0504_0002);
    /// The client acknowledged segments that were not sent.
    pub const SEQUENCE: Abort = Abort(0x0504_0003);
    /// CRC error: the data differs from the data sent.
    pub const CRC: Abort = Abort(0x0504_0004);
    /// The data is longer than the server accepts.
    pub const MEMORY: Abort = Abort(0x0504_0005);
    /// Unsupported access to an object: the mapping cannot be changed while it is in use.
    pub const UNSUPPORTED: Abort = Abort(0x0601_0000);
    /// Read of a write-only object.
    pub const WRITE_ONLY: Abort = Abort(0x0601_0001);
    /// Write of a read-only object.
    pub const READ_ONLY: Abort = Abort(0x0601_0002);
    /// No such object.
    pub const NO_OBJECT: Abort = Abort(0x0602_0000);
    /// The object cannot be mapped.
    pub const NOT_MAPPABLE: Abort = Abort(0x0604_0041);
    /// More than eight bytes mapped.
    pub const PDO_LENGTH: Abort = Abort(0x0604_0042);
    /// Length does not fit the data type.
    pub const LENGTH: Abort = Abort(0x0607_0010);
    /// No such sub-index.
    pub const NO_SUB_INDEX: Abort = Abort(0x0609_0011);
    /// The value is not allowed.
    pub const VALUE: Abort = Abort(0x0609_0030);
    /// Above the highest value.
    pub const TOO_HIGH: Abort = Abort(0x0609_0031);
    /// Below the lowest value.
    pub const TOO_LOW: Abort = Abort(0x0609_0032);
    /// General error.
    pub const GENERAL: Abort = Abort(0x0800_0000);
    /// Cannot be transferred or stored: a wrong signature.
    pub const NOT_STORED: Abort = Abort(0x0800_0020);
    /// Not possible in the present state of the device.
    pub const DEVICE_STATE: Abort = Abort(0x0800_0022);
}
