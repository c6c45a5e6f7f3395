use super::*;
use proptest::prelude::*;

fn text(data_type: DataType, bytes: &[u8]) -> String {
    data_type.decode(bytes).expect("the width fits").to_string()
}

#[test]
fn examples_of_the_manuals_decode() {
    // DPS, table 19: 50 C3 00 00 is 50000; MC1609: 7130h.2 = 7985.
    assert_eq!(text(DataType::Integer(4), &[0x50, 0xc3, 0, 0]), "50000");
    assert_eq!(text(DataType::Integer(2), &[0x31, 0x1f]), "7985");
    // D-20-9, 1008h.
    assert_eq!(text(DataType::VisibleString, b"D2X9"), "D2X9");
    // MH-4 overload markers.
    assert_eq!(text(DataType::Integer(2), &[0, 0x80]), "-32768");
    assert_eq!(text(DataType::Integer(4), &[0, 0, 0, 0x80]), "-2147483648");
    assert_eq!(text(DataType::Real32, &[0, 0, 0xc0, 0x7f]), "NaN");
    assert_eq!(text(DataType::Integer(3), &[0xff, 0xff, 0xff]), "-1");
}

#[test]
fn reals_print_the_shortest_text_that_parses_to_the_same_number() {
    assert_eq!(text(DataType::Real32, &1.1f32.to_le_bytes()), "1.1");
    assert_eq!(text(DataType::Real32, &0f32.to_le_bytes()), "0");
    assert_eq!(text(DataType::Real32, &(-0f32).to_le_bytes()), "-0");
    assert_eq!(text(DataType::Real32, &1e-38f32.to_le_bytes()), "1e-38");
    assert_eq!(text(DataType::Real64, &1e300f64.to_le_bytes()), "1e300");
    assert_eq!(text(DataType::Real64, &f64::NEG_INFINITY.to_le_bytes()), "-inf");
}

#[test]
fn times_are_parsed_and_printed() {
    assert_eq!(text(DataType::TimeOfDay, &[0, 0, 0, 0, 0, 0]), "1984-01-01T00:00:00.000Z");
    let bytes = DataType::TimeOfDay.encode_text("2026-11-22T12:00:00.250Z").expect("a time");
    assert_eq!(text(DataType::TimeOfDay, &bytes), "2026-11-22T12:00:00.250Z");
    assert!(DataType::TimeOfDay.encode_text("1980-01-01T00:00:00Z").is_err());
    let bytes = DataType::TimeDifference.encode_text("1day 2s").expect("a length");
    assert_eq!(text(DataType::TimeDifference, &bytes), "1day 2s");
}

#[test]
fn values_out_of_range_are_rejected_not_truncated() {
    for (data_type, wrong) in [
        ("u8", "300"),
        ("u8", "-1"),
        ("u8", "0x100"),
        ("i8", "128"),
        ("i8", "-129"),
        ("i8", "0x100"),
        ("u64", "18446744073709551616"),
        ("i64", "9223372036854775808"),
        ("b", "2"),
        ("r32", "1e39"),
        ("u8", "1.0"),
        ("u8", ""),
        ("u8", "0x"),
        ("u8", "0x-1"),
        ("u8", "+1"),
        ("r32", "1,5"),
        ("vs", "\u{20ac}"),
        ("os", "123"),
        ("os", "0g"),
        ("td", "5"),
    ] {
        let data_type: DataType = data_type.parse().expect("a type");
        assert!(data_type.encode_text(wrong).is_err(), "{data_type} {wrong}");
    }
    assert_eq!(
        DataType::Unsigned(1).encode_text("300").map_err(|error| error.to_string()),
        Err("300 does not fit u8 (0 to 255)".to_owned())
    );
}

#[test]
fn signed_integers_accept_a_hexadecimal_bit_pattern() {
    assert_eq!(DataType::Integer(2).encode_text("0x8000"), Ok(vec![0, 0x80]));
    assert_eq!(DataType::Integer(2).encode_text("0x7fff"), Ok(vec![0xff, 0x7f]));
    assert_eq!(DataType::Unsigned(4).encode_text("0x65766173"), Ok(b"save".to_vec()));
    assert_eq!(DataType::Domain.encode_text("0x01 02"), Ok(vec![1, 2]));
}

#[test]
fn type_names_round_trip() {
    for name in
        ["b", "u8", "u16", "u24", "u32", "u64", "i8", "i24", "i64", "r32", "r64", "vs", "os", "us", "d", "t", "td"]
    {
        assert_eq!(name.parse::<DataType>().map(|found| found.to_string()).as_deref(), Ok(name));
    }
    for wrong in ["", "u", "u7", "x8", "i128", "é8", "u8 "] {
        assert!(wrong.parse::<DataType>().is_err(), "{wrong}");
    }
}

proptest! {
    #[test]
    fn decoding_is_total(code in 0u16..0x20, bytes in proptest::collection::vec(any::<u8>(), 0..16)) {
        if let Some(data_type) = DataType::from_code(code) {
            let decoded = data_type.decode(&bytes);
            prop_assert_eq!(decoded.is_ok(), data_type.width().is_none_or(|width| width == bytes.len()));
            if let Ok(value) = decoded { let _ = value.to_string(); }
        }
    }

    #[test]
    fn integers_round_trip_through_text(width in 1u8..=8, bits in any::<u64>()) {
        let bytes = bits.to_le_bytes()[..usize::from(width)].to_vec();
        for data_type in [DataType::Unsigned(width), DataType::Integer(width)] {
            let text = data_type.decode(&bytes).expect("the width fits").to_string();
            prop_assert_eq!(data_type.encode_text(&text), Ok(bytes.clone()));
        }
    }

    #[test]
    fn reals_round_trip_through_text(bits in any::<u32>()) {
        let number = f32::from_bits(bits);
        prop_assume!(!number.is_nan());
        let text = Value::Real32(number).to_string();
        prop_assert_eq!(DataType::Real32.encode_text(&text), Ok(number.to_le_bytes().to_vec()));
    }
}
