//! Converts numbers of the model to numbers on the wire, without silent casts.

use crate::canopen::value::DataType;

/// Rounds to the nearest integer of the type (half away from zero), limited to the range of the type. NaN gives 0.
pub(super) fn to_integer(value: f64, data_type: DataType) -> i64 {
    let (low, high) = match data_type {
        DataType::Integer(width) => {
            let high = i64::MAX >> (64 - 8 * u32::from(width.clamp(1, 8)));
            (-high - 1, high)
        }
        DataType::Unsigned(width) => (0, i64::MAX >> (64 - 8 * u32::from(width.clamp(1, 8))).saturating_sub(1)),
        _ => (i64::MIN, i64::MAX),
    };
    nearest_integer(value).clamp(low, high)
}

/// Rounds to the nearest integer, computed from the bits of the number: the mantissa shifted by the exponent.
fn nearest_integer(value: f64) -> i64 {
    let rounded = value.round();
    if rounded.is_nan() {
        return 0;
    }
    let bits = rounded.abs().to_bits();
    let mantissa = bits & 0x000f_ffff_ffff_ffff | 0x0010_0000_0000_0000;
    // The mantissa is an integer of 53 bits; numbers below 2^0 round to 0 or 1.
    let magnitude = match i64::try_from(bits >> 52).unwrap_or(0) - 1075 {
        shift @ 0..=10 => mantissa << shift,
        shift @ -52..=-1 => mantissa >> -shift,
        shift if shift > 10 => u64::MAX,
        _ => 0,
    };
    let magnitude = i64::try_from(magnitude).unwrap_or(i64::MAX);
    if rounded.is_sign_negative() { -magnitude } else { magnitude }
}

/// Encodes `value` in a numeric type, in wire order.
pub(super) fn to_bytes(value: f64, data_type: DataType) -> Vec<u8> {
    match data_type {
        DataType::Real32 => to_real32(value).to_le_bytes().to_vec(),
        DataType::Real64 => value.to_le_bytes().to_vec(),
        _ => {
            let width = data_type.width().unwrap_or(8).min(8);
            to_integer(value, data_type).to_le_bytes()[..width].to_vec()
        }
    }
}

/// Rounds to the nearest REAL32, converted as text, because the standard library then rounds only once.
fn to_real32(value: f64) -> f32 {
    if value.is_nan() {
        return f32::NAN;
    }
    value.to_string().parse().unwrap_or(f32::NAN)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn integers_are_rounded_and_limited_to_their_range() {
        let i16 = DataType::Integer(2);
        for (value, expected) in [
            (0.0, 0),
            (0.4, 0),
            (0.5, 1),
            (-0.5, -1),
            (-0.4, 0),
            (1.0, 1),
            (798.5, 799),
            (7984.5, 7985),
            (-1000.0, -1000),
            (32767.4, 32767),
            (40000.0, 32767),
            (-40000.0, -32768),
            (f64::INFINITY, 32767),
            (f64::NEG_INFINITY, -32768),
            (f64::NAN, 0),
            (1e-300, 0),
        ] {
            assert_eq!(to_integer(value, i16), expected, "{value}");
        }
        assert_eq!(to_integer(65535.0, DataType::Unsigned(2)), 65535);
        assert_eq!(to_integer(65536.0, DataType::Unsigned(2)), 65535);
        assert_eq!(to_integer(-1.0, DataType::Unsigned(2)), 0);
        assert_eq!(to_integer(1e300, DataType::Integer(8)), i64::MAX);
        assert_eq!(to_integer(4_294_967_295.0, DataType::Unsigned(4)), 4_294_967_295);
    }

    #[test]
    fn bytes_in_wire_order() {
        assert_eq!(to_bytes(50000.0, DataType::Integer(4)), [0x50, 0xc3, 0, 0]);
        assert_eq!(to_bytes(1.0, DataType::Real32), [0, 0, 0x80, 0x3f]);
        assert_eq!(to_bytes(f64::NAN, DataType::Real32), [0, 0, 0xc0, 0x7f]);
        assert_eq!(to_bytes(-1.0, DataType::Integer(3)), [0xff, 0xff, 0xff]);
        assert_eq!(to_bytes(300.0, DataType::Unsigned(1)), [0xff]);
    }

    proptest! {
        #[test]
        fn whole_agrees_with_the_printed_number(value in -1e15f64..1e15) {
            prop_assert_eq!(nearest_integer(value), format!("{:.0}", value.round()).parse::<i64>().expect("an integer"));
        }

        #[test]
        fn real32_is_the_nearest(value: f32) {
            prop_assume!(!value.is_nan());
            prop_assert_eq!(to_real32(f64::from(value)).to_bits(), value.to_bits());
        }
    }
}
