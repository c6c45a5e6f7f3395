//! Scaling of numbers, and the bits and numbers that report a bad value.

use std::str::FromStr;

/// A decimal number of a description. It is stored exactly, so that scaled integers stay exact.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Decimal {
    /// The number without its decimal point.
    pub mantissa: i64,
    /// The decimal digits.
    pub digits: u8,
}

impl Decimal {
    /// The number 1.
    pub const ONE: Decimal = Decimal { mantissa: 1, digits: 0 };
    /// The number 0.
    pub const ZERO: Decimal = Decimal { mantissa: 0, digits: 0 };
    /// A REAL64 represents at most this number of digits exactly.
    const MAX_DIGITS: usize = 15;

    /// `mantissa` divided by ten to the power of `digits`, without zeros at the end.
    pub fn new(mantissa: i64, digits: u8) -> Decimal {
        let mut decimal = Decimal { mantissa, digits };
        while decimal.digits > 0 && decimal.mantissa % 10 == 0 {
            decimal = Decimal { mantissa: decimal.mantissa / 10, digits: decimal.digits - 1 };
        }
        decimal
    }

    /// The nearest REAL64.
    pub fn as_f64(self) -> f64 {
        self.mantissa as f64 / 10f64.powi(i32::from(self.digits))
    }
}

impl FromStr for Decimal {
    type Err = String;

    fn from_str(text: &str) -> Result<Decimal, String> {
        let plain = text.replace('_', "");
        let (number, exponent) = plain.split_once(['e', 'E']).unwrap_or((&plain, "0"));
        let (whole, fraction) = number.split_once('.').unwrap_or((number, ""));
        let read = || {
            let exponent: i32 = exponent.parse().ok().filter(|exponent: &i32| exponent.abs() <= 15)?;
            let mantissa: i64 = format!("{whole}{fraction}").parse().ok()?;
            let digits = i32::try_from(fraction.len()).ok()? - exponent;
            match u8::try_from(digits) {
                Ok(digits) if usize::from(digits) <= Decimal::MAX_DIGITS => Some(Decimal::new(mantissa, digits)),
                Ok(_) => None,
                Err(_) => Some(Decimal {
                    mantissa: mantissa.checked_mul(10i64.checked_pow(digits.unsigned_abs())?)?,
                    digits: 0,
                }),
            }
        };
        read().ok_or_else(|| format!("{text} is not a decimal number with at most {} digits", Decimal::MAX_DIGITS))
    }
}

/// Converts the number in an object to the value: number * `factor` + `offset`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scale {
    /// Not 0.
    pub factor: Decimal,
    /// In the unit of the value.
    pub offset: Decimal,
}

/// One item for each reason why a value is bad.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bad<T> {
    /// For a value that is not valid.
    pub invalid: T,
    /// For a value above the measuring range.
    pub high: T,
    /// For a value below the measuring range.
    pub low: T,
}

/// Bits of a status object.
pub type StatusBits = Bad<u64>;

impl StatusBits {
    /// 6150h of CiA 404.
    pub const CIA_404: StatusBits = Bad { invalid: 1, high: 2, low: 4 };

    /// Converts bits of this status object to the bits of 6150h.
    pub fn to_cia_404(&self, bits: u64) -> u64 {
        let bit = |mask: u64, bit: u64| if bits & mask == 0 { 0 } else { bit };
        bit(self.invalid, 1) | bit(self.high, 2) | bit(self.low, 4)
    }
}

/// Numbers that a device sends instead of a value.
pub type Markers = Bad<Vec<i64>>;

impl Default for Markers {
    fn default() -> Markers {
        Bad { invalid: Vec::new(), high: Vec::new(), low: Vec::new() }
    }
}

impl Markers {
    /// Whether no number is a marker.
    pub fn is_empty(&self) -> bool {
        self.invalid.is_empty() && self.high.is_empty() && self.low.is_empty()
    }

    /// Returns the status of a marker as bits of 6150h, or `None` if the number is not a marker.
    pub fn status_bits(&self, number: i64) -> Option<u64> {
        let lists = [(&self.high, 0b011), (&self.low, 0b101), (&self.invalid, 0b001)];
        lists.into_iter().find(|(list, _)| list.contains(&number)).map(|(_, bits)| bits)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_exact() {
        let read = |text: &str| text.parse::<Decimal>().ok().map(|decimal| (decimal.mantissa, decimal.digits));
        assert_eq!(read("0.01"), Some((1, 2)));
        assert_eq!(read("-2.50"), Some((-25, 1)));
        assert_eq!(read("1e-3"), Some((1, 3)));
        assert_eq!(read("2.5e3"), Some((2500, 0)));
        assert_eq!(read("100"), Some((100, 0)));
        assert_eq!(read("-0.5"), Some((-5, 1)));
        for wrong in ["", "x", "nan", "inf", "1e99", "0.0000000000000000001"] {
            assert_eq!(read(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn bits_and_markers() {
        let own = Bad { invalid: 0x100, high: 0x20, low: 0x40 };
        assert_eq!([0u64, 0x100, 0x20, 0x140].map(|bits| own.to_cia_404(bits)), [0, 1, 2, 5]);
        let markers = Bad { invalid: vec![-1], high: vec![0x7fff], low: vec![-0x8000] };
        assert_eq!(
            [0, -1, 0x7fff, -0x8000].map(|number| markers.status_bits(number)),
            [None, Some(1), Some(3), Some(5)]
        );
    }
}
