//! InfluxDB line protocol: one line for each value, with its time in nanoseconds.
//!
//! `cangauge,bench=3,run=20261129T150102-7f3a9c21,node=5,signal=pressure,unit=bar,status=ok value=1.25 17…`
//!
//! Texts are tags, because VictoriaMetrics and others store only numbers as fields. A row without a value has the field
//! `missing` instead of `value`.

/// The measurement of all lines.
pub const MEASUREMENT: &str = "cangauge";

/// One value of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Line<'a> {
    /// The node-ID.
    pub node: u8,
    /// The signal.
    pub signal: &'a str,
    /// The unit; empty if it is unknown.
    pub unit: &'a str,
    /// The status; empty if the device reports none.
    pub status: &'a str,
    /// The number with a decimal point; `None` if there is no value.
    pub value: Option<&'a [u8]>,
    /// Nanoseconds since 1970-01-01 UTC.
    pub time_ns: i128,
}

/// The start of each line with these tags: measurement and tags. A tag with an empty value is omitted.
pub fn head<'a>(tags: impl IntoIterator<Item = (&'a str, &'a str)>) -> Vec<u8> {
    let mut head = MEASUREMENT.as_bytes().to_vec();
    tags.into_iter().for_each(|(key, value)| push_tag(&mut head, key, value));
    head
}

/// Appends a line with its line end. `head` is the result of [`head`].
pub fn push_line(out: &mut Vec<u8>, head: &[u8], line: &Line<'_>) {
    out.extend_from_slice(head);
    push_tag(out, "node", itoa(line.node.into(), &mut [0; 40]));
    push_tag(out, "signal", line.signal);
    push_tag(out, "status", line.status);
    push_tag(out, "unit", line.unit);
    match line.value {
        Some(value) => {
            out.extend_from_slice(b" value=");
            out.extend_from_slice(value);
        }
        None => out.extend_from_slice(b" missing=1i"),
    }
    out.push(b' ');
    out.extend_from_slice(itoa(line.time_ns, &mut [0; 40]).as_bytes());
    out.push(b'\n');
}

/// Appends a tag. Comma, equals sign and blank are escaped. A backslash or a control character has no safe form in all
/// databases, and is replaced with `_`.
fn push_tag(out: &mut Vec<u8>, key: &str, value: &str) {
    if value.is_empty() {
        return;
    }
    out.push(b',');
    push_escaped(out, key);
    out.push(b'=');
    push_escaped(out, value);
}

fn push_escaped(out: &mut Vec<u8>, text: &str) {
    for byte in text.bytes() {
        match byte {
            b',' | b'=' | b' ' => out.extend_from_slice(&[b'\\', byte]),
            b'\\' | 0..=31 | 127 => out.push(b'_'),
            _ => out.push(byte),
        }
    }
}

/// A whole number as text.
fn itoa(number: i128, digits: &mut [u8; 40]) -> &str {
    let mut at = digits.len();
    let mut rest = number.unsigned_abs();
    loop {
        at -= 1;
        digits[at] = b'0' + u8::try_from(rest % 10).unwrap_or(0);
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    if number < 0 {
        at -= 1;
        digits[at] = b'-';
    }
    str::from_utf8(&digits[at..]).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    const LINE: Line<'_> =
        Line { node: 5, signal: "pressure", unit: "bar", status: "ok", value: Some(b"1.25"), time_ns: 1_000_000_001 };

    fn text(head: &[u8], line: &Line<'_>) -> String {
        let mut out = Vec::new();
        push_line(&mut out, head, line);
        String::from_utf8(out).expect("text")
    }

    #[test]
    fn line_with_and_without_a_value() {
        let start = head([("bench", "3"), ("part", "")]);
        assert_eq!(
            text(&start, &LINE),
            "cangauge,bench=3,node=5,signal=pressure,status=ok,unit=bar value=1.25 1000000001\n"
        );
        let without = Line { value: None, status: "", unit: "", time_ns: -7, ..LINE };
        assert_eq!(text(&head([]), &without), "cangauge,node=5,signal=pressure missing=1i -7\n");
    }

    #[test]
    fn separators_are_escaped_and_no_line_is_added() {
        let start = head([("part", "a b,c=d\\\n\u{7f}e")]);
        let line = text(&start, &Line { time_ns: 0, ..LINE });
        assert!(line.starts_with("cangauge,part=a\\ b\\,c\\=d___e,node=5,"), "{line}");
        assert_eq!((line.matches('\n').count(), line.ends_with(" 0\n")), (1, true));
    }

    #[test]
    fn whole_numbers_match_their_display() {
        for number in [0, 7, -7, i128::from(u64::MAX), i128::MAX, i128::MIN] {
            assert_eq!(itoa(number, &mut [0; 40]), number.to_string());
        }
    }
}
