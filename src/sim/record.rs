//! The record of the values that the simulator sent: one line for each measured value in each TPDO. The time is the end
//! of the frame. The text is formatted without the output code of the program, so that a test can compare both.

use super::channels::Reading;
use super::model::Direction;
use crate::bus::time::Mono;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use std::io::Write;
use std::sync::{Arc, Mutex};

/// The first line.
pub const HEADER: &str = "t_us,node,signal,value,unit,status,raw";

/// The destination of the record; clones write to the same place.
#[derive(Clone)]
pub struct Recorder {
    inner: Arc<Mutex<Inner>>,
}

struct Inner {
    out: std::io::BufWriter<Box<dyn Write + Send>>,
    error: Option<std::io::Error>,
}

/// A line without its time.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Line(String);

impl Recorder {
    /// Starts a record and writes its header.
    ///
    /// # Errors
    /// The header cannot be written.
    pub fn new(out: Box<dyn Write + Send>) -> std::io::Result<Recorder> {
        let mut out = std::io::BufWriter::new(out);
        writeln!(out, "{HEADER}")?;
        Ok(Recorder { inner: Arc::new(Mutex::new(Inner { out, error: None })) })
    }

    /// Writes buffered lines. Dropping the last clone does the same.
    ///
    /// # Errors
    /// The first error since the start of the record.
    pub fn flush(&self) -> std::io::Result<()> {
        let Ok(mut inner) = self.inner.lock() else { return Ok(()) };
        match inner.error.take() {
            Some(error) => Err(error),
            None => inner.out.flush(),
        }
    }

    pub(super) fn write(&self, at: Mono, line: &Line) {
        if let Ok(mut inner) = self.inner.lock()
            && inner.error.is_none()
            && let Err(error) = writeln!(inner.out, "{},{}", at.since_start().as_micros(), line.0)
        {
            inner.error = Some(error);
        }
    }
}

/// Formats the line of one mapped value. `has_status`: the same PDO contains the status.
pub(super) fn line(node: NodeId, reading: &Reading, bytes: &[u8], has_status: bool) -> Line {
    let status = match (reading.overload, has_status, reading.marker) {
        (Some(Direction::High), true, _) => "overload-high",
        (Some(Direction::Low), true, _) => "overload-low",
        // A marker without a status does not show the direction.
        (Some(_), false, true) => "invalid",
        (None, true, _) | (None, false, true) => "ok",
        (_, false, false) => "",
    };
    let value = match (reading.overload, has_status || reading.marker) {
        (Some(_), true) => String::new(),
        _ => match reading.digits {
            Some(digits) => decimal(signed(bytes), digits),
            None => real(bytes),
        },
    };
    let unit = reading.unit;
    Line(format!("{node},{},{value},{unit},{status},{}", reading.signal, raw(bytes)))
}

/// Formats the line of a mapped object that is not a process value (a field value), with its address.
pub(super) fn plain(node: NodeId, object: ObjectId, data_type: DataType, bytes: &[u8]) -> Line {
    let value = match data_type {
        DataType::Real32 | DataType::Real64 => real(bytes),
        DataType::Integer(_) => signed(bytes).to_string(),
        _ => bytes.iter().rev().fold(0u64, |number, byte| number << 8 | u64::from(*byte)).to_string(),
    };
    Line(format!("{node},{object},{value},,,{}", raw(bytes)))
}

fn raw(bytes: &[u8]) -> String {
    let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
    format!("0x{digits}")
}

/// Decodes the two's complement number in `bytes`, the lowest byte first.
fn signed(bytes: &[u8]) -> i128 {
    let negative = bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    let unsigned = bytes.iter().rev().fold(0i128, |number, byte| number * 256 + i128::from(*byte));
    if negative { unsigned - (0..bytes.len()).fold(1i128, |power, _| power * 256) } else { unsigned }
}

/// Formats an integer with a decimal point before the last `digits`.
fn decimal(number: i128, digits: u32) -> String {
    let mut text = number.unsigned_abs().to_string();
    let digits = usize::try_from(digits).unwrap_or(0);
    while text.len() <= digits {
        text.insert(0, '0');
    }
    if digits > 0 {
        text.insert(text.len() - digits, '.');
    }
    if number < 0 {
        text.insert(0, '-');
    }
    text
}

/// Formats a REAL32 as the shortest text that parses to the same number.
fn real(bytes: &[u8]) -> String {
    let Ok(bytes) = bytes.try_into() else { return String::new() };
    let number = f32::from_le_bytes(bytes);
    if number != 0.0 && (number.abs() < 1e-5 || number.abs() >= 1e16) {
        format!("{number:e}")
    } else {
        number.to_string()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::unit::Unit;

    fn reading(digits: Option<u32>, overload: Option<Direction>, marker: bool) -> Reading {
        Reading { signal: "pressure".to_owned(), unit: Unit(0xab_0000), status: None, digits, overload, marker }
    }

    fn text(reading: &Reading, bytes: &[u8], has_status: bool) -> String {
        line(NodeId::MAX, reading, bytes, has_status).0
    }

    #[test]
    fn values_are_json() {
        // DPS, table 19: 50 C3 00 00 is 50.000 psi.
        let integer = reading(Some(3), None, false);
        assert_eq!(text(&integer, &[0x50, 0xc3, 0, 0], false), "127,pressure,50.000,psi,,0x50C30000");
        assert_eq!(text(&integer, &[0x05, 0, 0, 0], false), "127,pressure,0.005,psi,,0x05000000");
        assert_eq!(text(&integer, &[0xff, 0xff, 0xff, 0xff], false), "127,pressure,-0.001,psi,,0xFFFFFFFF");
        assert_eq!(text(&reading(Some(0), None, false), &[0xf6, 0xff], false), "127,pressure,-10,psi,,0xF6FF");
        let real = reading(None, None, true);
        assert_eq!(text(&real, &1.1f32.to_le_bytes(), true), "127,pressure,1.1,psi,ok,0xCDCC8C3F");
        assert_eq!(text(&real, &1e-6f32.to_le_bytes(), false), "127,pressure,1e-6,psi,ok,0xBD378635");
    }

    #[test]
    fn field_values_are_recorded_under_their_address() {
        let line = |data_type, bytes: &[u8]| plain(NodeId::MAX, ObjectId::new(0x7100, 1), data_type, bytes).0;
        assert_eq!(line(DataType::Integer(2), &[0xff, 0xff]), "127,0x7100:1,-1,,,0xFFFF");
        assert_eq!(line(DataType::Unsigned(2), &[0xff, 0xff]), "127,0x7100:1,65535,,,0xFFFF");
    }

    #[test]
    fn status_is_recorded_only_if_the_device_sends_it() {
        let nan = f32::NAN.to_le_bytes();
        let high = |marker| reading(None, Some(Direction::High), marker);
        assert_eq!(text(&high(true), &nan, true), "127,pressure,,psi,overload-high,0x0000C07F");
        assert_eq!(text(&high(true), &nan, false), "127,pressure,,psi,invalid,0x0000C07F");
        let low = reading(None, Some(Direction::Low), true);
        assert_eq!(text(&low, &nan, true), "127,pressure,,psi,overload-low,0x0000C07F");
        // Without status and marker, nothing shows that the value is invalid.
        assert_eq!(text(&high(false), &[0, 0, 0xd2, 0x42], false), "127,pressure,105,psi,,0x0000D242");
    }
}
