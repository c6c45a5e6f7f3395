//! Numbers, dates and frames in the text of recordings.

use crate::bus::Fault;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use std::borrow::Cow;
use std::time::Duration;

/// Converts a date and time of a time zone, year to second, to seconds since 1970.
pub(super) type TimeZone = fn([i32; 6]) -> Option<u64>;

/// A frame, or the fault that an error frame reports.
pub(super) type FrameOrFault = Result<Frame, Fault>;

/// The flag of an error frame in an identifier (`CAN_ERR_FLAG`).
pub(super) const ERROR_FRAME: u32 = 0x2000_0000;

/// Further digits of a fraction are below a nanosecond, even of a fraction of a day.
const MAX_DIGITS: usize = 15;

const SECOND: Duration = Duration::from_secs(1);
const MILLISECOND: Duration = Duration::from_millis(1);

/// Parses digits only: `parse` would also accept a sign.
pub(super) fn number(text: &str) -> Option<u64> {
    if text.bytes().all(|byte| byte.is_ascii_digit()) { text.parse().ok() } else { None }
}

/// `1059.9` or `1059` in a unit of time.
pub(super) fn decimal(text: &str, unit: Duration) -> Option<Duration> {
    let (whole, fraction) = text.split_once('.').unwrap_or((text, "0"));
    let fraction = fraction.get(..fraction.len().min(MAX_DIGITS))?;
    let digits = u32::try_from(fraction.len()).ok().filter(|&digits| digits > 0)?;
    let (whole, part, scale) = (u128::from(number(whole)?), u128::from(number(fraction)?), 10u128.pow(digits));
    let nanoseconds = whole.checked_mul(unit.as_nanos())? + (part * unit.as_nanos() + scale / 2) / scale;
    let seconds = u64::try_from(nanoseconds / SECOND.as_nanos()).ok()?;
    Some(Duration::new(seconds, u32::try_from(nanoseconds % SECOND.as_nanos()).ok()?))
}

/// `1436509053.249713`.
pub(super) fn seconds(text: &str) -> Option<Duration> {
    decimal(text, SECOND)
}

/// `1059.9` or `1841`.
pub(super) fn milliseconds(text: &str) -> Option<Duration> {
    decimal(text, MILLISECOND)
}

/// An identifier in this number base.
pub(super) fn identifier(text: &str, base: u32, is_extended: bool) -> Option<CanId> {
    let number = digits(text, base)?;
    if is_extended { CanId::extended(number) } else { CanId::standard(u16::try_from(number).ok()?) }
}

/// A data frame whose bytes are words in this number base. Hexadecimal bytes have two digits; a single digit is cut
/// off.
pub(super) fn data_frame(id: CanId, length: usize, words: &[&str], base: u32) -> Option<Frame> {
    let words = words.get(..length)?;
    if base == 16 && words.iter().any(|word| word.len() != 2) {
        return None;
    }
    let bytes: Option<Vec<u8>> = words.iter().map(|word| u8::try_from(digits(word, base)?).ok()).collect();
    Frame::new(id, &bytes?).ok()
}

/// A remote frame.
pub(super) fn remote_frame(id: CanId, length: &str) -> Option<Frame> {
    Frame::remote(id, u8::try_from(number(length)?).ok()?).ok()
}

/// Parses digits of this number base only: `from_str_radix` would also accept a sign.
pub(super) fn digits(text: &str, base: u32) -> Option<u32> {
    if text.bytes().all(|byte| byte.is_ascii_alphanumeric()) { u32::from_str_radix(text, base).ok() } else { None }
}

/// The fault of an error frame by the class in its identifier (linux/can/error.h).
pub(super) fn fault(classes: u32) -> Fault {
    let named = [
        (0x040, Fault::BusOff),
        (0x100, Fault::Restarted),
        (0x020, Fault::NoAcknowledge),
        (0x008, Fault::Protocol),
        (0x080, Fault::Protocol),
        (0x010, Fault::Transceiver),
        (0x001, Fault::TransmitTimeout),
    ];
    named.iter().find(|(class, _)| classes & class != 0).map_or(Fault::Other, |(_, fault)| *fault)
}

/// A date and time in the time zone of this machine.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library knows no time zones")]
pub(super) fn local_time([year, month, day, hour, minute, second]: [i32; 6]) -> Option<u64> {
    // SAFETY: `tm` is a plain C structure for which zero is a valid value in every field.
    let mut fields: libc::tm = unsafe { std::mem::zeroed() };
    fields.tm_year = year.checked_sub(1900)?;
    fields.tm_mon = month.checked_sub(1)?;
    (fields.tm_mday, fields.tm_hour, fields.tm_min, fields.tm_sec) = (day, hour, minute, second);
    fields.tm_isdst = -1;
    // SAFETY: `mktime` reads and writes only the structure that it is given.
    let seconds = unsafe { libc::mktime(&raw mut fields) };
    u64::try_from(seconds).ok()
}

/// Time zones are unknown on this system.
#[cfg(not(unix))]
pub(super) fn local_time(_: [i32; 6]) -> Option<u64> {
    None
}

/// A time zone for tests: days of 24 hours from 2000-01-01, months of 31 days.
/// A line as text, without the escape sequences of `candump -c`.
pub(super) fn text_of(bytes: &[u8]) -> Cow<'_, str> {
    let text = String::from_utf8_lossy(bytes);
    if !text.contains('\x1b') {
        return text;
    }
    let mut parts = text.split('\x1b');
    let mut plain = parts.next().unwrap_or_default().to_owned();
    for part in parts {
        plain.push_str(part.split_once('m').map_or(part, |(_, rest)| rest));
    }
    Cow::Owned(plain)
}

#[cfg(test)]
pub(super) fn test_zone([year, month, day, hour, minute, second]: [i32; 6]) -> Option<u64> {
    let days = ((year - 2000) * 12 + month - 1) * 31 + day - 1;
    u64::try_from(days * 86_400 + hour * 3_600 + minute * 60 + second).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_times() {
        assert_eq!(milliseconds("1059.9"), Some(Duration::from_micros(1_059_900)));
        assert_eq!(milliseconds("1841"), Some(Duration::from_millis(1_841)));
        assert_eq!(seconds("0.016728"), Some(Duration::from_micros(16_728)));
        assert_eq!(decimal("2.5", Duration::from_secs(86_400)), Some(Duration::from_secs(216_000)));
        for wrong in ["", ".", "1.", "-1.0", "1.-5", "+1.0", "1e5", "99999999999999999999.0", "1.5.2"] {
            assert_eq!(seconds(wrong), None, "{wrong}");
        }
    }
}
