//! Units: codes of devices, symbols typed by users, conversion.
#![no_main]

use cangauge::device::unit::Unit;
use cangauge_fuzz::Bytes;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    if let Ok(text) = std::str::from_utf8(data)
        && let Some(unit) = Unit::from_symbol(text)
        && unit != Unit::NONE
    {
        assert_eq!(Unit::from_symbol(&unit.to_string()), Some(unit), "{text:?}: {unit}");
    }
    let mut bytes = Bytes(data);
    let (from, to) = (Unit(bytes.long()), Unit(bytes.long()));
    assert!(from.to_string().is_ascii());
    if from.symbol().is_some_and(|symbol| !symbol.is_empty()) {
        assert_eq!(Unit::from_symbol(&from.to_string()), Some(from), "{from}");
    }
    let value = f64::from_bits(u64::from(bytes.long()) | u64::from(bytes.long()) << 32);
    assert!(from.convert(value, from).is_some());
    if let Some(there) = from.convert(value, to) {
        let back = to.convert(there, from).expect("the way back");
        // Without loss of precision and overflow, the value is the same after both conversions.
        if value.is_finite() && (1e-30..1e30).contains(&value.abs()) && there.is_finite() && there.abs() > 1e-60 {
            let scale = value.abs().max(1e3) * 1e30;
            assert!((back - value).abs() <= scale * 1e-9, "{value} {from} is {there} {to} is {back}");
        }
    }
});
