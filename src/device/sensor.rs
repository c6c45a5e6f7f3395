//! Sensor types as coded in 6110h (CiA 404-1).

/// Codes and their meanings: 2 (HBM MC1609), 90 and 100 (WIKA MH-4-CAN, HYDAC) from manuals; the others are general
/// knowledge of CiA 404, no page at hand.
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

/// The meaning of a code of 6110h; `None` if it is unknown. Codes above 10000 are manufacturer-specific.
pub fn kind(code: u16) -> Option<&'static str> {
    KINDS.iter().find(|(known, _)| *known == code).map(|(_, kind)| *kind)
}

#[cfg(test)]
mod tests {
    use super::kind;

    #[test]
    fn codes_of_the_manuals() {
        assert_eq!(kind(90), Some("pressure transducer"));
        assert_eq!(kind(100), Some("temperature transducer"));
        assert_eq!(kind(2), Some("thermocouple K"));
        assert_eq!(kind(10_501), None);
    }
}
