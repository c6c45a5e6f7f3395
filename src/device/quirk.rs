//! Deviations of real devices that need their own code, each with a name.

/// A deviation from the standard. Each one is handled in one place in the code, which mentions its name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quirk {
    /// Uploads are answered with command specifier 60h and the data.
    ///
    /// Device: Honeywell DPS. Evidence: manual 50085804, table 19: both reads are answered with 60h. Trigger: an
    /// expedited upload. Not set by default: no sensor is known to do so, and 60h acknowledges a write.
    UploadAnswered60,
    /// Storing everything (1010h:1) resets the COB-IDs of 1014h and 180xh:1 to their defaults; storing the
    /// communication parameters (1010h:2) keeps them.
    ///
    /// Device: WIKA MH-4-CAN. Evidence: manual 14547342.01, object 1010h. Trigger: "save" written to
    /// 1010h:1.
    SaveAllResetsCobIds,
    /// Writing 0 to a COB-ID (1014h, 180xh:1) restores the default that follows the node-ID. Any other value stays the
    /// same if the node-ID changes.
    ///
    /// Device: HYDAC. Evidence: protocol description VFL 4639928, 2021-10-25. Trigger: 0 written to a COB-ID.
    CobIdZeroIsDefault,
    /// An emergency is repeated every 2002h milliseconds while its error is pending.
    ///
    /// Device: JUMO CANtrans. Evidence: operating instructions B 902910, 5.4. Trigger: an error that is
    /// pending while `emcy-repeat-time` is not 0.
    EmergencyRepeats,
}
