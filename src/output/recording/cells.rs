//! The cells of recorded rows: text, numbers and times.

use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use std::borrow::Cow;
use std::fmt;

/// Microseconds of a day.
const DAY_US: f64 = 86_400e6;

/// Days from 1899-12-30, the first day of spreadsheets, to 1970-01-01.
const DAYS_BEFORE_1970: f64 = 25_569.0;

/// A smaller number is a day of a spreadsheet. A larger number is a number of seconds since 1970.
const FEWEST_SECONDS: f64 = 1e7;

/// `2023-11-14T22:13:21`.
const SECOND_LENGTH: usize = 19;

/// A number with a decimal point or comma.
pub(super) fn decimal(cell: &[u8]) -> Option<f64> {
    let text = str::from_utf8(cell).ok()?;
    if text.contains(',') { text.replace(',', ".").parse().ok() } else { text.parse().ok() }
}

/// Seconds in microseconds.
#[allow(clippy::cast_possible_truncation)]
pub(super) fn micros(seconds: f64) -> i64 {
    // The cast saturates.
    (seconds * 1e6).round() as i64
}

/// Reads times in the three forms that `log` writes. The last second is kept, because most rows repeat it.
#[derive(Debug, Default)]
pub(super) struct Clock {
    second: Vec<u8>,
    at: i64,
}

impl Clock {
    /// Microseconds since 1970-01-01 UTC.
    pub(super) fn time(&mut self, cell: &[u8]) -> Option<i64> {
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
fn text_time(text: &str) -> Option<i64> {
    let time = humantime::parse_rfc3339(text).ok()?;
    i64::try_from(time.duration_since(std::time::UNIX_EPOCH).ok()?.as_micros()).ok()
}

/// The microseconds of a time that is written as a number.
fn moment(number: f64) -> i64 {
    if number < FEWEST_SECONDS { micros((number - DAYS_BEFORE_1970) * DAY_US / 1e6) } else { micros(number) }
}

/// A time in JSON: text or a number.
pub(super) struct JsonTime(pub(super) i64);

impl<'de> Deserialize<'de> for JsonTime {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<JsonTime, D::Error> {
        struct Time;
        impl Visitor<'_> for Time {
            type Value = JsonTime;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a time")
            }

            fn visit_str<E: Error>(self, text: &str) -> Result<JsonTime, E> {
                text_time(text).map(JsonTime).ok_or_else(|| E::custom("not a time"))
            }

            fn visit_f64<E: Error>(self, number: f64) -> Result<JsonTime, E> {
                Ok(JsonTime(moment(number)))
            }

            fn visit_u64<E: Error>(self, number: u64) -> Result<JsonTime, E> {
                Ok(JsonTime(moment(number as f64)))
            }
        }
        deserializer.deserialize_any(Time)
    }
}

/// A row of layout `long`.
#[derive(serde::Deserialize)]
pub(super) struct LongRow<'a> {
    pub(super) time: JsonTime,
    pub(super) elapsed_s: f64,
    pub(super) node: u8,
    #[serde(borrow)]
    pub(super) signal: Cow<'a, str>,
    pub(super) value: Option<f64>,
    pub(super) unit: Option<Cow<'a, str>>,
    pub(super) status: Option<Cow<'a, str>>,
}

/// A row of layout `wide`.
#[derive(Default)]
pub(super) struct WideRow {
    pub(super) time: Option<i64>,
    pub(super) elapsed_s: Option<f64>,
    /// `5.pressure [bar]`.
    pub(super) values: Vec<(String, Option<f64>)>,
    /// `5.pressure.status`.
    pub(super) statuses: Vec<(String, Option<String>)>,
}

impl<'de> Deserialize<'de> for WideRow {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<WideRow, D::Error> {
        struct Row;
        impl<'de> Visitor<'de> for Row {
            type Value = WideRow;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("a row")
            }

            fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<WideRow, A::Error> {
                let mut row = WideRow::default();
                while let Some(name) = map.next_key::<String>()? {
                    if name == "time" {
                        row.time = Some(map.next_value::<JsonTime>()?.0);
                    } else if name == "elapsed_s" {
                        row.elapsed_s = Some(map.next_value()?);
                    } else if name.ends_with(".status") {
                        row.statuses.push((name, map.next_value()?));
                    } else if name.contains('.') {
                        row.values.push((name, map.next_value()?));
                    } else {
                        map.next_value::<IgnoredAny>()?;
                    }
                }
                Ok(row)
            }
        }
        deserializer.deserialize_map(Row)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

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
