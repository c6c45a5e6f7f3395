//! Values of each type, from bytes and from text.
#![no_main]

use cangauge::canopen::value::{DataType, Value, parse_hex};
use cangauge_fuzz::Bytes;
use libfuzzer_sys::fuzz_target;

const TYPES: [&str; 21] = [
    "b", "u8", "u16", "u24", "u32", "u40", "u48", "u56", "u64", "i8", "i16", "i24", "i32", "i40", "i64", "r32", "r64",
    "vs", "os", "us", "d",
];

fn is_nan(value: &Value) -> bool {
    matches!(value, Value::Real32(number) if number.is_nan())
        || matches!(value, Value::Real64(number) if number.is_nan())
}

/// The milliseconds of a time can exceed one day; such times have another, shorter encoding.
fn is_canonical(value: &Value) -> bool {
    !matches!(value, Value::TimeOfDay(time) | Value::TimeDifference(time) if time.milliseconds >= 86_400_000)
}

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let (head, rest) = (bytes.byte(), bytes.0);
    if let Some(found) = DataType::from_code(u16::from(head)) {
        assert_eq!(found.to_string().parse(), Ok(found));
    }
    let times = ["t", "td"];
    let name = TYPES.iter().chain(&times).cycle().nth(usize::from(head)).expect("for ever");
    let data_type: DataType = name.parse().expect("a type");
    assert_eq!(data_type.to_string().parse(), Ok(data_type));
    match data_type.decode(rest) {
        Ok(value) => {
            assert!(data_type.width().is_none_or(|width| width == rest.len()));
            let text = value.to_string();
            // Trailing zeros are not part of a text, and 255 byte values of a Boolean are true.
            let exact = !matches!(value, Value::Text(_) | Value::Bool(_)) && !is_nan(&value);
            if exact && !times.contains(name) {
                assert_eq!(data_type.encode_text(&text).as_deref(), Ok(rest), "{name}: {text}");
            } else if !matches!(value, Value::Text(_)) && !is_nan(&value) && is_canonical(&value) {
                let again = data_type.encode_text(&text).expect("printed text can be parsed");
                assert_eq!(data_type.decode(&again).expect("its width"), value, "{name}: {text}");
            }
        }
        Err(error) => assert_ne!(error.expected, error.found),
    }
    if let Ok(text) = std::str::from_utf8(rest) {
        let _ = text.parse::<DataType>();
        if let Some(hex) = parse_hex(text) {
            assert!(hex.len() <= text.len());
        }
        match data_type.encode_text(text) {
            Ok(encoded) => {
                assert!(data_type.width().is_none_or(|width| width == encoded.len()), "{name}: {text:?}");
                assert!(data_type.decode(&encoded).is_ok());
            }
            Err(error) => assert!(!error.to_string().is_empty()),
        }
    }
});
