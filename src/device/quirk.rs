//! Deviations of real devices that data alone cannot express, each by name.

use serde::Deserialize;

/// A deviation from the standard. Each acts in one place, which names it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Deserialize)]
#[serde(rename_all = "kebab-case")]
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
}
