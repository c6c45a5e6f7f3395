//! Deviations of real devices that data alone cannot express, each by name.

/// A deviation from the standard. Each acts in one place, which names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Quirk {
    /// Uploads are answered with command specifier 60h that carries the data.
    ///
    /// Device: Honeywell DPS. Evidence: manual 50085804, table 19, where both reads are answered with
    /// 60h. Trigger: an expedited upload. Not set by default: nothing shows that the sensors in the
    /// field do what the table prints, and 60h is the acknowledge of a write.
    UploadAnswered60,
    /// Saving everything (1010h:1) puts the identifiers of 1014h and 180xh:1 back to their defaults;
    /// saving the communication parameters (1010h:2) keeps them.
    ///
    /// Device: WIKA MH-4-CAN. Evidence: manual 14547342.01, object 1010h. Trigger: "save" written to
    /// 1010h:1.
    SaveAllResetsCobIds,
    /// Writing 0 to a COB-ID (1014h, 180xh:1) puts back the default that follows the node-ID; any other
    /// value stays where it is when the node-ID changes.
    ///
    /// Device: HYDAC. Evidence: protocol description VFL 4639928, 2021-10-25. Trigger: 0 written to a COB-ID.
    CobIdZeroIsDefault,
    /// An emergency is sent again and again while its error is pending, every 2002h milliseconds.
    ///
    /// Device: JUMO CANtrans. Evidence: operating instructions B 902910, 5.4. Trigger: an error that is
    /// pending while `emcy-repeat-time` is not 0.
    EmergencyRepeats,
}
