//! The CSV files of python-can: `1700000000.25,0x181,0,0,0,4,0gQAAA==`.

use super::text::{ERROR_FRAME, FrameOrFault, digits, fault, number, remote_frame, seconds};
use super::{Line, Parser};
use crate::bus::Wall;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use std::time::Duration;

/// The names of the columns that python-can writes first.
pub(super) const HEADER: &str = "timestamp,arbitration_id,extended";

pub(super) struct Csv;

/// A frame; `Some(None)` for CAN FD.
fn event(fields: &[&str]) -> Option<Option<FrameOrFault>> {
    let [id, extended, remote, error, length, data] = fields else { return None };
    let flag = |text: &str| if text == "1" { Some(true) } else { (text == "0").then_some(false) };
    let number_of_id = digits(id.strip_prefix("0x")?, 16)?;
    if flag(error)? {
        return Some(Some(Err(fault(number_of_id & !ERROR_FRAME))));
    }
    let id = match flag(extended)? {
        true => CanId::extended(number_of_id),
        false => CanId::standard(u16::try_from(number_of_id).ok()?),
    }?;
    if number(length)? > 8 {
        return Some(None);
    }
    if flag(remote)? {
        return Some(Some(Ok(remote_frame(id, length)?)));
    }
    let data = base64(data).filter(|data| Some(data.len() as u64) == number(length))?;
    Some(Some(Ok(Frame::new(id, &data).ok()?)))
}

fn base64(text: &str) -> Option<Vec<u8>> {
    let letters = text.trim_end_matches('=');
    if !text.len().is_multiple_of(4) || text.len() - letters.len() > 2 {
        return None;
    }
    let (mut bytes, mut bits, mut count) = (Vec::new(), 0_u32, 0);
    for letter in letters.bytes() {
        let value = match letter {
            b'A'..=b'Z' => letter - b'A',
            b'a'..=b'z' => letter - b'a' + 26,
            b'0'..=b'9' => letter - b'0' + 52,
            b'+' => 62,
            b'/' => 63,
            _ => return None,
        };
        (bits, count) = (bits << 6 | u32::from(value), count + 6);
        if count >= 8 {
            count -= 8;
            bytes.push((bits >> count & 0xff) as u8);
        }
    }
    Some(bytes)
}

/// Seconds as Python writes them, `1700000000.25` or `1e-05`, rounded to the microsecond, which is the precision of a
/// float.
fn time(text: &str) -> Option<Wall> {
    let exponent =
        || text.contains('e').then(|| text.parse().ok())?.and_then(|it| Duration::try_from_secs_f64(it).ok());
    let time = seconds(text).or_else(exponent)?;
    let time = time.checked_add(Duration::from_nanos(500))?;
    Some(Wall::at(Duration::new(time.as_secs(), time.subsec_micros() * 1000)))
}

impl Parser for Csv {
    fn line<'a>(&mut self, text: &'a str) -> Line<'a> {
        if text.starts_with(HEADER) {
            return Line::Ignored;
        }
        let fields: Vec<&str> = text.split(',').collect();
        let Some(wall) = fields.first().and_then(|field| time(field)) else { return Line::Unknown };
        Line::at(wall, "", event(&fields[1..]))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::lines;
    use super::*;

    #[test]
    fn frames_of_all_kinds() {
        let text = "timestamp,arbitration_id,extended,remote,error,dlc,data\n1.25,0x181,0,0,0,4,0gQA/w==\n\
                    1.5,0x1890abcd,1,0,0,0,\n2.0,0x705,0,1,0,1,\n2.5,0x20000040,0,0,1,8,AAAAAAAAAAA=\n\
                    3e-03,0x181,0,0,0,1,AQ==\n1.0000004,0x181,0,0,0,3,AQID\n1.0,0x181,0,0,0,12,AQID\n";
        assert_eq!(
            lines(&mut Csv, text),
            ["1250  181#D20400FF", "1500  1890ABCD#", "2000  705#R1", "2500  BusOff", "3  181#01", "1000  181#010203"]
        );
    }

    #[test]
    fn broken_lines_are_unknown() {
        for text in [
            "1.25",
            "1.25,0x181,0,0,0,4",
            "1.25,0x181,0,0,0,4,0gQA",
            "1.25,0x181,0,0,0,4,0gQA/w=",
            "x,0x181,0,0,0,0,",
            "1.25,0x981,0,0,0,0,",
            "1.25,0x181,2,0,0,0,",
            "1.25,0x181,0,0,0,1,A?==",
            "1.25,181,0,0,0,0,",
        ] {
            assert_eq!(lines(&mut Csv, text), ["Unknown"], "{text}");
        }
    }
}
