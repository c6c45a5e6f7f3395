//! The cells of a line of CSV: text, numbers and times.

use std::borrow::Cow;

/// Microseconds of a day.
const DAY_US: f64 = 86_400e6;

/// Days from 1899-12-30, the first day of spreadsheets, to 1970-01-01.
const DAYS_BEFORE_1970: f64 = 25_569.0;

/// A smaller number is a day of a spreadsheet. A larger number is a number of seconds since 1970.
const FEWEST_SECONDS: f64 = 1e7;

/// `2023-11-14T22:13:21`.
const SECOND_LENGTH: usize = 19;

/// A cell without its quotes.
pub type CellBytes<'a> = Cow<'a, [u8]>;

/// Iterates over the cells of a line of CSV without its line end.
#[derive(Clone, Debug)]
pub struct Cells<'a> {
    rest: Option<&'a [u8]>,
    delimiter: u8,
}

impl<'a> Cells<'a> {
    /// The cells of `line`.
    pub fn new(line: &'a [u8], delimiter: u8) -> Cells<'a> {
        Cells { rest: Some(line), delimiter }
    }

    /// The cells that were not read yet, as they are in the line.
    pub fn rest(&self) -> &'a [u8] {
        self.rest.unwrap_or_default()
    }
}

impl<'a> Iterator for Cells<'a> {
    type Item = CellBytes<'a>;

    fn next(&mut self) -> Option<CellBytes<'a>> {
        let rest = self.rest?;
        let Some(mut quoted) = rest.strip_prefix(b"\"") else {
            let end = rest.iter().position(|byte| *byte == self.delimiter);
            self.rest = end.map(|end| &rest[end + 1..]);
            return Some(Cow::Borrowed(&rest[..end.unwrap_or(rest.len())]));
        };
        let mut cell = Vec::new();
        while let Some(end) = quoted.iter().position(|byte| *byte == b'"') {
            cell.extend_from_slice(&quoted[..end]);
            quoted = &quoted[end + 1..];
            if quoted.first() != Some(&b'"') {
                break;
            }
            cell.push(b'"');
            quoted = &quoted[1..];
        }
        self.rest = quoted.first().filter(|byte| **byte == self.delimiter).map(|_| &quoted[1..]);
        Some(Cow::Owned(cell))
    }
}

/// The text of a cell.
pub fn text(cell: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(cell)
}

/// Node, signal and unit of a column of layout `wide`: `5.pressure [bar]`.
pub fn wide_column(name: &str) -> Option<(u8, &str, &str)> {
    let (node, rest) = name.split_once('.')?;
    let (signal, unit) = rest.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")).unwrap_or((rest, ""));
    Some((node.parse().ok()?, signal, unit))
}

/// A number with a decimal point or comma.
pub fn decimal(cell: &[u8]) -> Option<f64> {
    let text = str::from_utf8(cell).ok()?;
    if text.contains(',') { text.replace(',', ".").parse().ok() } else { text.parse().ok() }
}

/// Seconds in microseconds.
#[allow(clippy::cast_possible_truncation)]
pub fn micros(seconds: f64) -> i64 {
    // The cast saturates.
    (seconds * 1e6).round() as i64
}

/// Reads times in the three forms that `log` writes. The last second is kept, because most rows repeat it.
#[derive(Debug, Default)]
pub struct Clock {
    second: Vec<u8>,
    at: i64,
}

impl Clock {
    /// Microseconds since 1970-01-01 UTC.
    pub fn time(&mut self, cell: &[u8]) -> Option<i64> {
        let Some((second, rest)) = cell.split_at_checked(SECOND_LENGTH).filter(|(second, _)| second[10] == b'T') else {
            return decimal(cell).map(moment);
        };
        let digits = rest.strip_prefix(b".").and_then(|rest| rest.strip_suffix(b"Z")).filter(|rest| rest.len() == 6);
        let Some(digits) = digits else { return text_time(str::from_utf8(cell).ok()?) };
        if self.second != second {
            self.at = text_time(&format!("{}Z", str::from_utf8(second).ok()?))?;
            self.second = second.to_vec();
        }
        Some(self.at + str::from_utf8(digits).ok()?.parse::<i64>().ok()?)
    }
}

/// The microseconds of an RFC 3339 time.
pub fn text_time(text: &str) -> Option<i64> {
    let time = humantime::parse_rfc3339(text).ok()?;
    i64::try_from(time.duration_since(std::time::UNIX_EPOCH).ok()?.as_micros()).ok()
}

/// The microseconds of a time that is written as a number.
pub fn moment(number: f64) -> i64 {
    if number < FEWEST_SECONDS { micros((number - DAYS_BEFORE_1970) * DAY_US / 1e6) } else { micros(number) }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str) -> Vec<String> {
        Cells::new(line.as_bytes(), b',').map(|cell| text(&cell).into_owned()).collect()
    }

    #[test]
    fn quoted_cells() {
        assert_eq!(cells("a,,b"), ["a", "", "b"]);
        assert_eq!(cells("\"a,\"\"b\"\"\",c,"), ["a,\"b\"", "c", ""]);
        assert_eq!(cells("\"cut, off"), [""; 1]);
        assert_eq!(cells(""), [""]);
    }

    #[test]
    fn times_in_three_forms() {
        let mut clock = Clock::default();
        for text in ["2023-11-14T22:13:21.010001Z", "1700000001.010001", "1700000001,010001", "45244.92593761575"] {
            assert_eq!(clock.time(text.as_bytes()), Some(1_700_000_001_010_001), "{text}");
        }
        assert_eq!(clock.time(b"2023-11-14T22:13:21.5Z"), Some(1_700_000_001_500_000));
        assert_eq!(clock.time(b"2023-11-14T22:13:21.99999"), None);
        assert_eq!(clock.time(b"yesterday"), None);
    }
}
