//! Expressions of `check`: a printed expression parses to the same expression.
#![no_main]

use cangauge::measure::expression::Expression;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Expression::parse(text) {
        Ok(expression) => {
            let printed = expression.to_string();
            match Expression::parse(&printed) {
                Ok(again) => assert_eq!(again.to_string(), printed, "{text:?}"),
                // Added parentheses and spaces can make it too long.
                Err(error) => assert!(printed.chars().count() > 1000, "{text:?}: {printed:?}: {error}"),
            }
            let _ = (expression.wanted(), expression.needs_many_samples());
        }
        Err(error) => {
            assert!(error.at <= error.text.len() && !error.message.is_empty());
            assert!(error.text.is_char_boundary(error.at), "{text:?}");
            let _ = error.column();
        }
    }
});
