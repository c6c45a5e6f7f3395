//! Physical units as coded in 6131h (CiA 303-2). The table gives the source of each code.

use std::fmt;

/// A unit code: prefix in bits 31-24 (signed power of ten), numerator in 23-16, denominator in 15-8.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Unit(pub u32);

/// A numerator code with its ASCII symbol and its conversion to the base unit of its quantity.
struct Base {
    code: u8,
    symbol: &'static str,
    /// Quantity, factor and offset: base value = value * factor + offset.
    scale: Option<(Quantity, f64, f64)>,
}

/// A physical quantity; only values of one quantity can be converted into each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Quantity {
    Pressure,
    Temperature,
    Length,
    Time,
    Mass,
    Force,
    Voltage,
    Current,
    Frequency,
}

const fn plain(code: u8, symbol: &'static str) -> Base {
    Base { code, symbol, scale: None }
}

const fn scaled(code: u8, symbol: &'static str, quantity: Quantity, factor: f64, offset: f64) -> Base {
    Base { code, symbol, scale: Some((quantity, factor, offset)) }
}

/// 1 psi in Pa: pound-force (0.45359237 kg * 9.80665 m/s2) on a square inch (0.0254 m).
const PSI_PA: f64 = 0.453_592_37 * 9.806_65 / (0.0254 * 0.0254);

/// Sources: DRP-303-2 V1.1, except 2Dh (MH-4, MC1609), 4Eh, ABh, ACh (MH-4, DPS), 26h (esd CAN-CBX-THERMO) and 41h
/// (Epson). The other codes in 25h-32h and 40h-4Ch: general knowledge of CiA 303-2, without a page reference.
///
/// To add a unit, add one line.
const BASES: &[Base] = &[
    scaled(0x01, "m", Quantity::Length, 1.0, 0.0),
    scaled(0x02, "kg", Quantity::Mass, 1.0, 0.0),
    scaled(0x03, "s", Quantity::Time, 1.0, 0.0),
    scaled(0x04, "A", Quantity::Current, 1.0, 0.0),
    scaled(0x05, "K", Quantity::Temperature, 1.0, 0.0),
    plain(0x06, "mol"),
    plain(0x07, "cd"),
    plain(0x10, "rad"),
    plain(0x11, "sr"),
    scaled(0x20, "Hz", Quantity::Frequency, 1.0, 0.0),
    scaled(0x21, "N", Quantity::Force, 1.0, 0.0),
    scaled(0x22, "Pa", Quantity::Pressure, 1.0, 0.0),
    plain(0x23, "J"),
    plain(0x24, "W"),
    plain(0x25, "C"),
    scaled(0x26, "V", Quantity::Voltage, 1.0, 0.0),
    plain(0x27, "F"),
    plain(0x28, "ohm"),
    plain(0x29, "S"),
    plain(0x2a, "Wb"),
    plain(0x2b, "T"),
    plain(0x2c, "H"),
    scaled(0x2d, "degC", Quantity::Temperature, 1.0, 273.15),
    plain(0x2e, "lm"),
    plain(0x2f, "lx"),
    plain(0x30, "Bq"),
    plain(0x31, "Gy"),
    plain(0x32, "Sv"),
    plain(0x40, "gon"),
    plain(0x41, "deg"),
    plain(0x42, "arcmin"),
    plain(0x43, "arcsec"),
    plain(0x44, "l"),
    scaled(0x47, "min", Quantity::Time, 60.0, 0.0),
    scaled(0x48, "h", Quantity::Time, 3600.0, 0.0),
    scaled(0x49, "d", Quantity::Time, 86_400.0, 0.0),
    scaled(0x4b, "g", Quantity::Mass, 1e-3, 0.0),
    scaled(0x4c, "t", Quantity::Mass, 1e3, 0.0),
    scaled(0x4e, "bar", Quantity::Pressure, 1e5, 0.0),
    scaled(0xab, "psi", Quantity::Pressure, PSI_PA, 0.0),
    scaled(0xac, "degF", Quantity::Temperature, 5.0 / 9.0, 459.67 * 5.0 / 9.0),
];

/// Prefixes by power of ten. "da" and "h" are printed only if no other unit has the same symbol.
const PREFIXES: &[(i8, &str)] = &[
    (18, "E"),
    (15, "P"),
    (12, "T"),
    (9, "G"),
    (6, "M"),
    (3, "k"),
    (2, "h"),
    (1, "da"),
    (0, ""),
    (-1, "d"),
    (-2, "c"),
    (-3, "m"),
    (-6, "u"),
    (-9, "n"),
    (-12, "p"),
    (-15, "f"),
    (-18, "a"),
];

/// Units in descriptions without a code in CiA 303-2. Their codes here have a denominator that no device can send.
const EXTRA: [&str; 13] =
    ["%", "rpm", "1/min", "1/s", "ppm", "dB", "pH", "step", "kWh", "%RH", "m3/h", "l/min", "m/s2"];

/// The first code of [`EXTRA`].
const EXTRA_CODES: u32 = 0xffff_ff00;

const COULOMB: Unit = Unit(0x0025_0000);
const FARAD: Unit = Unit(0x0027_0000);
const DEGREE_CELSIUS: Unit = Unit(0x002d_0000);
const DEGREE_FAHRENHEIT: Unit = Unit(0x00ac_0000);

/// Replaces the degree sign and the micro signs by ASCII letters.
fn ascii(text: &str) -> String {
    text.replace('\u{b0}', "deg").replace(['\u{b5}', '\u{3bc}'], "u")
}

impl Unit {
    /// No dimension.
    pub const NONE: Unit = Unit(0);
    /// The base unit of pressures.
    pub const PASCAL: Unit = Unit(0x0022_0000);
    /// The base unit of temperatures.
    pub const KELVIN: Unit = Unit(0x0005_0000);

    fn parts(self) -> (i8, u8, u8, u8) {
        let [reserved, denominator, numerator, prefix] = self.0.to_le_bytes();
        (i8::from_le_bytes([prefix]), numerator, denominator, reserved)
    }

    fn base(code: u8) -> Option<&'static Base> {
        BASES.iter().find(|base| base.code == code)
    }

    /// The ASCII symbol: `bar`, `degC`, `mbar`, `deg/s`; empty for no dimension. `None` if the code is unknown, or if
    /// the symbol would mean another unit ("cd" is candela, not a hundredth of a day).
    pub fn symbol(self) -> Option<String> {
        self.composed().filter(|symbol| symbol.is_empty() || Unit::from_symbol(symbol) == Some(self))
    }

    fn composed(self) -> Option<String> {
        let (prefix, numerator, denominator, reserved) = self.parts();
        if self == Unit::NONE {
            return Some(String::new());
        }
        if self.0 >= EXTRA_CODES {
            return EXTRA.get(usize::from(reserved)).map(|symbol| (*symbol).to_owned());
        }
        let (_, prefix) = PREFIXES.iter().find(|(power, _)| *power == prefix)?;
        let numerator = Unit::base(numerator)?.symbol;
        match (denominator, reserved) {
            (0, 0) => Some(format!("{prefix}{numerator}")),
            (denominator, 0) => Some(format!("{prefix}{numerator}/{}", Unit::base(denominator)?.symbol)),
            _ => None,
        }
    }

    /// Parses the symbol of a unit: `bar`, `mbar`, `kPa`, `°C` or `degC`, `deg/s`, or a raw code `0x…`. Other upper and
    /// lower case (`PSI`) is accepted if the unit is unambiguous.
    pub fn from_symbol(text: &str) -> Option<Unit> {
        Unit::from_exact(text).or_else(|| match Unit::spellings(text).as_slice() {
            [only] => Unit::from_exact(only),
            _ => None,
        })
    }

    /// Returns the symbols that are equal to `text` except for their case: MPa and mPa for `mpa`.
    pub fn spellings(text: &str) -> Vec<String> {
        let text = ascii(text);
        let denominator = text.split_once('/').map_or("", |(_, denominator)| denominator);
        let symbols = || BASES.iter().map(|base| base.symbol);
        let mut found: Vec<String> = EXTRA.map(str::to_owned).to_vec();
        for below in [""].into_iter().chain(symbols()).filter(|below| below.eq_ignore_ascii_case(denominator)) {
            let slash = if below.is_empty() { "" } else { "/" };
            let prefixes = || PREFIXES.iter().map(|(_, prefix)| prefix);
            found.extend(
                symbols().flat_map(|symbol| prefixes().map(move |prefix| format!("{prefix}{symbol}{slash}{below}"))),
            );
        }
        found.retain(|symbol| symbol.eq_ignore_ascii_case(&text));
        found.sort_unstable();
        found.dedup();
        found
    }

    /// Returns the unit that the user means together with the unit `other`: with a temperature, `C` and `F` are
    /// degrees.
    #[must_use]
    pub fn beside(self, other: Unit) -> Unit {
        match self {
            COULOMB if other.is_temperature() => DEGREE_CELSIUS,
            FARAD if other.is_temperature() => DEGREE_FAHRENHEIT,
            unit => unit,
        }
    }

    fn is_temperature(self) -> bool {
        matches!(self.scale(), Some((Quantity::Temperature, ..)))
    }

    fn from_exact(text: &str) -> Option<Unit> {
        if text.starts_with("0x") || text.starts_with("0X") {
            return crate::canopen::id::parse_u32(text).map(Unit);
        }
        if let Some(code) = EXTRA.iter().zip(EXTRA_CODES..).find_map(|(symbol, code)| (*symbol == text).then_some(code))
        {
            return Some(Unit(code));
        }
        let text = ascii(text);
        let (numerator, denominator) = match text.split_once('/') {
            Some((numerator, symbol)) => (numerator, BASES.iter().find(|base| base.symbol == symbol)?.code),
            None => (text.as_str(), 0),
        };
        for base in BASES {
            for (power, prefix) in PREFIXES {
                if numerator.strip_suffix(base.symbol) == Some(*prefix) {
                    return Some(Unit(u32::from_le_bytes([0, denominator, base.code, power.to_le_bytes()[0]])));
                }
            }
        }
        None
    }

    fn scale(self) -> Option<(Quantity, f64, f64)> {
        let (prefix, numerator, 0, 0) = self.parts() else { return None };
        let (quantity, factor, offset) = Unit::base(numerator)?.scale?;
        Some((quantity, factor * 10f64.powi(i32::from(prefix)), offset))
    }

    /// Converts `value` from this unit to another; `None` if the quantities differ or a unit is unknown. A temperature
    /// is converted as a temperature, not as a difference.
    pub fn convert(self, value: f64, to: Unit) -> Option<f64> {
        self.convert_with_zeros(value, to, 1.0)
    }

    /// Converts a value that contains the offset of its scale `zeros` times: 1 for a temperature, 0 for a difference.
    pub fn convert_with_zeros(self, value: f64, to: Unit, zeros: f64) -> Option<f64> {
        if self == to {
            return Some(value);
        }
        let (from_quantity, from_factor, from_offset) = self.scale()?;
        let (to_quantity, to_factor, to_offset) = to.scale()?;
        (from_quantity == to_quantity).then(|| (value * from_factor + (from_offset - to_offset) * zeros) / to_factor)
    }

    /// Whether both units have the same zero point; degC and K do not.
    pub fn has_same_zero(self, other: Unit) -> bool {
        let zero = |unit: Unit| unit.scale().map(|(_, _, offset)| offset);
        self == other || zero(self) == zero(other)
    }
}

impl fmt::Display for Unit {
    /// Writes the symbol, or the raw code if the unit is unknown.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.symbol() {
            Some(symbol) => f.write_str(&symbol),
            None => write!(f, "0x{:08X}", self.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_and_symbols() {
        for (code, symbol) in [
            (0x004E_0000, "bar"),
            (0x00AB_0000, "psi"),
            (0x0622_0000, "MPa"),
            (0x0322_0000, "kPa"),
            (0x0222_0000, "hPa"),
            (0x0022_0000, "Pa"),
            (0xFD4E_0000, "mbar"),
            (0x002D_0000, "degC"),
            (0x00AC_0000, "degF"),
            (0x0005_0000, "K"),
            (0xFA26_0000, "uV"),
            (0xFD26_0000, "mV"),
            (0xFD04_0000, "mA"),
            (0x0321_0000, "kN"),
            (0xFD01_0000, "mm"),
            (0x0002_0000, "kg"),
            (0x004B_0000, "g"),
        ] {
            assert_eq!(Unit(code).to_string(), symbol);
            assert_eq!(Unit::from_symbol(symbol), Some(Unit(code)), "{symbol}");
        }
        assert_eq!(Unit(0x0041_0300).to_string(), "deg/s");
        assert_eq!(Unit::NONE.to_string(), "");
        assert_eq!(Unit::from_symbol("\u{b0}C"), Some(Unit(0x002D_0000)));
        assert_eq!(Unit::from_symbol("0x004E0000"), Some(Unit(0x004E_0000)));
        assert_eq!(Unit::from_symbol("mmHg"), None);
    }

    #[test]
    fn another_case_is_accepted_if_it_means_one_unit() {
        for (text, symbol) in [
            ("PSI", "psi"),
            ("Bar", "bar"),
            ("KPA", "kPa"),
            ("hpa", "hPa"),
            ("\u{b0}c", "degC"),
            ("DEGF", "degF"),
            ("k", "K"),
            ("L/MIN", "l/min"),
        ] {
            assert_eq!(Unit::from_symbol(text), Unit::from_symbol(symbol), "{text}");
        }
        for text in ["mpa", "MBAR", "pa", "MM", "M/S", "bar/", "mmhg"] {
            assert_eq!(Unit::from_symbol(text), None, "{text}");
        }
        assert_eq!(Unit::spellings("mpa"), ["MPa", "mPa"]);
    }

    #[test]
    fn c_and_f_are_degrees_for_a_temperature_only() {
        let unit = |symbol| Unit::from_symbol(symbol).expect("a unit");
        for (text, other, means) in [
            ("C", "K", "degC"),
            ("c", "degF", "degC"),
            ("F", "degC", "degF"),
            ("C", "A", "C"),
            ("F", "psi", "F"),
            ("mC", "K", "mC"),
        ] {
            assert_eq!(unit(text).beside(unit(other)).to_string(), means, "{text} {other}");
        }
    }

    #[test]
    fn unknown_codes_stay_raw() {
        for code in [0x00F1_0000, 0x004E_0001, 0x004E_FF00, 0x104E_0000, 0xFFFF_FFFF] {
            assert_eq!(Unit(code).to_string(), format!("0x{code:08X}"));
        }
    }

    #[test]
    fn every_unit_code_occurs_once_and_reads_back() {
        for base in BASES {
            let unit = Unit(u32::from(base.code) << 16);
            assert_eq!(unit.to_string(), base.symbol);
            assert_eq!(Unit::from_symbol(base.symbol), Some(unit), "{}", base.symbol);
        }
    }

    #[test]
    fn no_two_codes_have_the_same_symbol() {
        // Centi-days must not have the symbol of candela, and m/rad must be possible.
        let mut shown = std::collections::BTreeMap::new();
        for base in BASES {
            for (power, _) in PREFIXES {
                for below in [0, 0x03, 0x10, 0x47] {
                    let unit = Unit(u32::from_le_bytes([0, below, base.code, power.to_le_bytes()[0]]));
                    assert_eq!(shown.insert(unit.to_string(), unit), None, "{unit}");
                    assert_eq!(Unit::from_symbol(&unit.to_string()), Some(unit));
                }
            }
        }
        assert_eq!(Unit(0xfe49_0000).to_string(), "0xFE490000");
        assert_eq!((Unit::from_symbol("m/"), Unit::from_symbol("/s")), (None, None));
    }

    #[test]
    fn conversion() {
        let unit = |symbol| Unit::from_symbol(symbol).expect("a unit");
        let convert = |value: f64, from, to| unit(from).convert(value, unit(to)).expect("the same quantity");
        // DPS, table 19: 50.000 psi are 3.448 bar after the change of unit. 3.44738 is exact; the device rounds.
        assert!((convert(50.0, "psi", "bar") - 3.447_379).abs() < 1e-6);
        assert!((convert(1.0, "bar", "kPa") - 100.0).abs() < 1e-9);
        assert!((convert(25.0, "degC", "degF") - 77.0).abs() < 1e-9);
        assert!((convert(0.0, "degC", "K") - 273.15).abs() < 1e-9);
        assert_eq!(unit("bar").convert(1.0, unit("degC")), None);
        assert_eq!(Unit(0x00F1_0000).convert(1.0, unit("bar")), None);
        assert_eq!(Unit(0x00F1_0000).convert(1.0, Unit(0x00F1_0000)), Some(1.0));
    }
}
