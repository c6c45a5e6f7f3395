//! Detects the features of an adapter from its answers to `V`, `v` and `N`.

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
    /// LAWICEL CAN232 and CANUSB, which do not answer `v`, and USBtin, which answers all three commands.
    Lawicel,
    /// CANable and similar adapters (normaldotcom/canable-fw).
    Canable,
    /// Other firmware. Only common commands are used.
    Unknown,
}

/// The command that sets a bit rate.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Rate {
    /// `S5`.
    Digit(u8),
    /// `s031C`: BTR0 and BTR1 of an SJA1000 with 16 MHz.
    Registers([u8; 2]),
}

impl Rate {
    /// Returns the registers for a bit rate; `None` if the clock cannot generate it to 0.05 %. A bit has about 16 time
    /// quanta, and is sampled at about 85 %.
    fn registers(bit_rate: u32) -> Option<Rate> {
        const CLOCK: u32 = 8_000_000;
        let divisor = (CLOCK + bit_rate / 2).checked_div(bit_rate).filter(|&divisor| divisor > 0)?;
        (CLOCK / divisor).abs_diff(bit_rate).checked_mul(2000).filter(|error| *error <= bit_rate)?;
        let fits = |quanta: &u32| divisor % quanta == 0 && divisor / quanta <= 64;
        let quanta = (8..=25).filter(fits).min_by_key(|quanta| quanta.abs_diff(16))?;
        let second = quanta.div_ceil(8);
        let first = quanta - 1 - second;
        let registers = [divisor / quanta - 1, (second - 1) << 4 | (first - 1)];
        let [Ok(first), Ok(second)] = registers.map(u8::try_from) else { return None };
        (first < 64).then_some(Rate::Registers([first, second]))
    }
}

impl fmt::Display for Rate {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Rate::Digit(digit) => write!(f, "S{digit}"),
            Rate::Registers([first, second]) => write!(f, "s{first:02X}{second:02X}"),
        }
    }
}

/// The command that opens the channel without sending acknowledgements.
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

    /// Returns the command for a bit rate: a digit after `S`, or the registers of the controller. `S7` and `S9` mean
    /// different rates in different firmware.
    pub(super) fn rate(&self, bit_rate: u32) -> Option<Rate> {
        // CAN232 and CANUSB have an SJA1000. USBtin has other registers.
        let has_registers = self.kind() == Kind::Lawicel && self.detail.is_none();
        let registers = || Rate::registers(bit_rate).filter(|_| has_registers);
        self.rate_digit(bit_rate).map(Rate::Digit).or_else(registers)
    }

    fn rate_digit(&self, bit_rate: u32) -> Option<u8> {
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
            None => f.write_str("the adapter (version unknown)"),
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
        let commands = |firmware: &Firmware| {
            rates.map(|rate| firmware.rate(rate).map_or_else(String::new, |rate| rate.to_string()))
        };
        let lawicel = firmware("V1013", "", "NA123");
        let usbtin = firmware("V0101", "v0107", "N1234");
        let canable = firmware("CANable-3ab9e32 github.com/normaldotcom/canable-fw.git", "", "");
        assert_eq!(commands(&lawicel), ["S0", "S5", "S8", "S7", "", "s051C", "s0E1C"]);
        assert_eq!(commands(&usbtin), ["S0", "S5", "S8", "S7", "", "", ""]);
        assert_eq!(commands(&canable), ["S0", "S5", "S8", "", "S7", "S9", ""]);
        // The example of the LAWICEL manual.
        assert_eq!(Rate::registers(125_000), Some(Rate::Registers([0x03, 0x1c])));
        assert_eq!([0, 1, 4000, 3_000_000, u32::MAX].map(Rate::registers), [None; 5]);
        assert_eq!(
            (lawicel.listen_only(), canable.listen_only()),
            (Some(ListenOnly::OtherOpen), Some(ListenOnly::SilentMode))
        );
        for unknown in [Firmware::default(), firmware("V1013", "", ""), firmware("V2.1 wifi", "", "NA123")] {
            assert_eq!(commands(&unknown), ["S0", "S5", "S8", "", "", "", ""]);
            assert_eq!(unknown.listen_only(), None);
        }
    }
}
