//! Sensor types as coded in 6110h (CiA 404-1).

/// Codes and their meanings: 2 (HBM MC1609), 90 and 100 (WIKA MH-4-CAN, HYDAC) are from manuals. The others are general
/// knowledge of CiA 404, without a page reference.
const KINDS: [(u16, &str); 16] = [
    (1, "thermocouple J"),
    (2, "thermocouple K"),
    (3, "thermocouple L"),
    (4, "thermocouple N"),
    (5, "thermocouple R"),
    (6, "thermocouple S"),
    (7, "thermocouple T"),
    (8, "thermocouple U"),
    (9, "thermocouple B"),
    (30, "Pt100"),
    (31, "Pt200"),
    (32, "Pt500"),
    (33, "Pt1000"),
    (40, "voltage"),
    (90, "pressure transducer"),
    (100, "temperature transducer"),
];

/// Finds the code for a word: `J`, `type K`, `Pt 100`.
pub fn code(word: &str) -> Option<u16> {
    KINDS.iter().find(|(_, kind)| is_same(kind, word)).map(|(code, _)| *code)
}

/// Whether two words mean the same kind of sensor. Case, blanks and the words "thermocouple" and "type" are ignored.
pub fn is_same(one: &str, other: &str) -> bool {
    let bare = |text: &str| {
        let folded = text.to_lowercase();
        let words = folded.split([' ', '-', '_']).filter(|word| !matches!(*word, "thermocouple" | "type"));
        words.collect::<String>()
    };
    let bare_word = bare(one);
    !bare_word.is_empty() && bare_word == bare(other)
}

/// What a sensor measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Measurand {
    /// Pressure.
    Pressure,
    /// Temperature.
    Temperature,
}

/// What a sensor with this code of 6110h measures; `None` if that is unknown. The unit of a voltage depends on the scaling.
pub fn measurand(code: u16) -> Option<Measurand> {
    match code {
        1..=9 | 30..=33 | 100 => Some(Measurand::Temperature),
        90 => Some(Measurand::Pressure),
        _ => None,
    }
}

/// The meaning of a code of 6110h; `None` if it is unknown. Codes above 10000 are manufacturer-specific.
pub fn kind(code: u16) -> Option<&'static str> {
    KINDS.iter().find(|(known, _)| *known == code).map(|(_, kind)| *kind)
}

#[cfg(test)]
mod tests {
    use super::{KINDS, Measurand, code, is_same, kind, measurand};

    #[test]
    fn codes_of_the_manuals() {
        assert_eq!(kind(90), Some("pressure transducer"));
        assert_eq!(kind(100), Some("temperature transducer"));
        assert_eq!(kind(2), Some("thermocouple K"));
        assert_eq!(kind(10_501), None);
    }

    #[test]
    fn measurand_is_that_of_the_kind() {
        for (code, kind) in KINDS {
            let expected = match kind {
                "voltage" => None,
                "pressure transducer" => Some(Measurand::Pressure),
                _ => Some(Measurand::Temperature),
            };
            assert_eq!(measurand(code), expected, "{kind}");
        }
    }

    #[test]
    fn words_for_a_sensor_are_found() {
        for (word, expected) in [
            ("J", Some(1)),
            ("type k", Some(2)),
            ("thermocouple-T", Some(7)),
            ("Pt100", Some(30)),
            ("PT 1000", Some(33)),
            ("Pressure Transducer", Some(90)),
            ("Pt10", None),
            ("type", None),
            ("", None),
        ] {
            assert_eq!(code(word), expected, "{word}");
        }
        assert!(is_same("thermocouple type K", "K") && !is_same("thermocouple type K", "J"));
    }
}
