//! The rows of JSON Lines.

use crate::publish::cells::{moment, text_time};
use serde::de::{Deserialize, Deserializer, Error, IgnoredAny, MapAccess, Visitor};
use std::borrow::Cow;
use std::fmt;

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
