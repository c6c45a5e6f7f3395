//! The features of an adapter, from its answers to `V`, `v` and `N`.

use std::fmt;

/// The firmware of an adapter.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Firmware {
    /// The answer to `V`: `V1013`.
    pub(super) version: Option<String>,
    /// The answer to `v`: `v0107`.
    pub(super) detail: Option<String>,
    /// The answer to `N`: `NA123`.
    pub(super) serial: Option<String>,
}

/// The kinds of firmware.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// LAWICEL CAN232 and CANUSB do not answer `v`. USBtin answers all three commands.
    Lawicel,
    /// CANable and similar adapters (normaldotcom/canable-fw).
    Canable,
    /// Other firmware. Only common commands are used.
    Unknown,
}

/// The command for opening the channel without acknowledgements.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum ListenOnly {
    /// `L` instead of `O`.
    OtherOpen,
    /// `M1` before `O`.
    SilentMode,
}

impl Firmware {
    fn kind(&self) -> Kind {
        let answers = || [&self.version, &self.detail, &self.serial].into_iter().flatten();
        let is_plain = |answer: &Option<String>, first: char| {
            answer
                .as_ref()
                .and_then(|text| text.strip_prefix(first))
                .is_some_and(|rest| rest.len() == 4 && rest.bytes().all(|byte| byte.is_ascii_alphanumeric()))
        };
        if answers().any(|answer| answer.to_ascii_lowercase().contains("canable")) {
            Kind::Canable
        } else if is_plain(&self.version, 'V')
            && is_plain(&self.serial, 'N')
            && (self.detail.is_none() || is_plain(&self.detail, 'v'))
        {
            Kind::Lawicel
        } else {
            Kind::Unknown
        }
    }

    /// The digit after `S` for a bit rate. `S7` and `S9` mean different rates in different firmware.
    pub(super) fn rate_digit(&self, bit_rate: u32) -> Option<u8> {
        const COMMON: [u32; 7] = [10_000, 20_000, 50_000, 100_000, 125_000, 250_000, 500_000];
        match (bit_rate, self.kind()) {
            (1_000_000, _) => Some(8),
            (800_000, Kind::Lawicel) | (750_000, Kind::Canable) => Some(7),
            (83_300 | 83_333, Kind::Canable) => Some(9),
            _ => COMMON.iter().position(|rate| *rate == bit_rate).and_then(|digit| u8::try_from(digit).ok()),
        }
    }

    pub(super) fn listen_only(&self) -> Option<ListenOnly> {
        match self.kind() {
            Kind::Lawicel => Some(ListenOnly::OtherOpen),
            Kind::Canable => Some(ListenOnly::SilentMode),
            Kind::Unknown => None,
        }
    }
}

impl fmt::Display for Firmware {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match &self.version {
            Some(version) => write!(f, "the adapter ({})", crate::bus::stream::printable(version)),
            None => f.write_str("an adapter without a known version"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn firmware(version: &str, detail: &str, serial: &str) -> Firmware {
        let some = |text: &str| (!text.is_empty()).then(|| text.to_owned());
        Firmware { version: some(version), detail: some(detail), serial: some(serial) }
    }

    #[test]
    fn doubtful_rates_need_known_firmware() {
        let rates = [10_000, 250_000, 1_000_000, 800_000, 750_000, 83_333, 33_333];
        let digits = |firmware: &Firmware| rates.map(|rate| firmware.rate_digit(rate));
        let lawicel = firmware("V1013", "", "NA123");
        let usbtin = firmware("V0101", "v0107", "N1234");
        let canable = firmware("CANable-3ab9e32 github.com/normaldotcom/canable-fw.git", "", "");
        assert_eq!(digits(&lawicel), [Some(0), Some(5), Some(8), Some(7), None, None, None]);
        assert_eq!(digits(&usbtin), digits(&lawicel));
        assert_eq!(digits(&canable), [Some(0), Some(5), Some(8), None, Some(7), Some(9), None]);
        assert_eq!(
            (lawicel.listen_only(), canable.listen_only()),
            (Some(ListenOnly::OtherOpen), Some(ListenOnly::SilentMode))
        );
        for unknown in [Firmware::default(), firmware("V1013", "", ""), firmware("V2.1 wifi", "", "NA123")] {
            assert_eq!(digits(&unknown), [Some(0), Some(5), Some(8), None, None, None, None]);
            assert_eq!(unknown.listen_only(), None);
        }
    }
}
