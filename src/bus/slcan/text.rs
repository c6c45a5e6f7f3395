//! The lines of the LAWICEL protocol: frames and answers.

use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;

/// The longest line that is accepted. A frame has at most 30 characters, but an answer to `V` can have more.
const MAX_LINE: usize = 128;

/// A message from an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(in crate::bus) enum Answer {
    /// `\r`, `z\r` or `Z\r`: the command was executed.
    Done,
    /// `\a`: the command was rejected.
    Rejected,
    /// A frame, with the milliseconds of the adapter's clock if it has one.
    Frame(Frame, Option<u16>),
    /// Another line: the answer to a query.
    Text(String),
    /// Bytes that are not a line.
    Garbage,
}

impl Answer {
    /// Returns the frame, if the message is one.
    pub(in crate::bus) fn frame(self) -> Option<Frame> {
        if let Answer::Frame(frame, _) = self { Some(frame) } else { None }
    }
}

/// Splits a byte stream into lines. The bytes may arrive in pieces.
#[derive(Debug, Default)]
pub(in crate::bus) struct Lines {
    line: Vec<u8>,
    /// Whether the present line is too long or has invalid bytes.
    is_garbage: bool,
}

impl Lines {
    pub(in crate::bus) fn feed(&mut self, bytes: &[u8], mut found: impl FnMut(Answer)) {
        for &byte in bytes {
            match byte {
                b'\r' => {
                    let line = std::mem::take(&mut self.line);
                    let is_garbage = std::mem::take(&mut self.is_garbage);
                    found(if is_garbage { Answer::Garbage } else { parse_line(&line) });
                }
                0x07 => {
                    if std::mem::take(&mut self.is_garbage) || !self.line.is_empty() {
                        found(Answer::Garbage);
                    }
                    self.line.clear();
                    found(Answer::Rejected);
                }
                // Some firmware ends its lines with CR and LF.
                b'\n' => {}
                b' '..=b'~' if self.line.len() < MAX_LINE => self.line.push(byte),
                _ => self.is_garbage = true,
            }
        }
    }
}

fn parse_line(line: &[u8]) -> Answer {
    // Only printable characters were kept.
    let text = String::from_utf8_lossy(line);
    match line.first() {
        None => Answer::Done,
        Some(b'z' | b'Z') if line.len() == 1 => Answer::Done,
        Some(b't' | b'T' | b'r' | b'R') => {
            parse_frame(&text).map_or(Answer::Garbage, |(frame, time)| Answer::Frame(frame, time))
        }
        Some(_) => Answer::Text(text.into_owned()),
    }
}

/// Parses `t1A4300AABB`, `T0000018A300AABB` or remote `r7011`. Each can end with four digits of time.
fn parse_frame(line: &str) -> Option<(Frame, Option<u16>)> {
    let kind = line.get(..1)?;
    let rest = line.get(1..).filter(|rest| rest.bytes().all(|byte| byte.is_ascii_hexdigit()))?;
    let (id, rest) = rest.split_at_checked(if matches!(kind, "t" | "r") { 3 } else { 8 })?;
    let number = u32::from_str_radix(id, 16).ok()?;
    let id = match id.len() {
        3 => CanId::standard(u16::try_from(number).ok()?)?,
        _ => CanId::extended(number)?,
    };
    let (length, rest) = rest.split_at_checked(1)?;
    let length: u8 = length.parse().ok().filter(|length| *length <= 8)?;
    let is_remote = kind.eq_ignore_ascii_case("r");
    let (data, time) = rest.split_at_checked(if is_remote { 0 } else { usize::from(length) * 2 })?;
    let time = match time.len() {
        0 => None,
        4 => Some(u16::from_str_radix(time, 16).ok()?),
        _ => return None,
    };
    if is_remote {
        return Some((Frame::remote(id, length).ok()?, time));
    }
    let bytes = (0..data.len()).step_by(2).map(|at| u8::from_str_radix(&data[at..at + 2], 16).ok());
    Some((Frame::new(id, &bytes.collect::<Option<Vec<u8>>>()?).ok()?, time))
}

/// Returns the command that sends a frame.
pub(in crate::bus) fn command(frame: &Frame) -> String {
    let is_extended = matches!(frame.id(), CanId::Extended(_));
    let kind = match (is_extended, frame.is_remote()) {
        (false, false) => 't',
        (false, true) => 'r',
        (true, false) => 'T',
        (true, true) => 'R',
    };
    let data: String = frame.data().iter().map(|byte| format!("{byte:02X}")).collect();
    format!("{kind}{}{}{data}", frame.id(), frame.len())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn answers(bytes: &[u8]) -> Vec<Answer> {
        let mut found = Vec::new();
        Lines::default().feed(bytes, |answer| found.push(answer));
        found
    }

    #[test]
    fn frames_round_trip() {
        for text in
            ["t60584000100000000000", "t0800", "T0000018A3AABBCC", "r7011", "R1FFFFFFF8", "t1FF80102030405060708"]
        {
            let [Answer::Frame(frame, None)] = &answers(format!("{text}\r").as_bytes())[..] else { panic!("{text}") };
            assert_eq!(command(frame), text);
            let [Answer::Frame(timed, Some(0xea5f))] = &answers(format!("{text}EA5F\r\n").as_bytes())[..] else {
                panic!("{text} with a time")
            };
            assert_eq!(timed, frame);
        }
    }

    #[test]
    fn damaged_lines_are_garbage() {
        for line in
            ["t", "t60", "t6059", "t60584000", "t8000", "t605+", "T2000000000", "r7019", "t0800123", "t08001234567"]
        {
            assert_eq!(answers(format!("{line}\r").as_bytes()), [Answer::Garbage], "{line}");
        }
        assert_eq!(answers(b"t6\xff058\rz\r"), [Answer::Garbage, Answer::Done]);
        assert_eq!(
            answers(&[&[b't'; 1 << 20][..], b"\r\r\x07V1013\r"].concat()),
            [Answer::Garbage, Answer::Done, Answer::Rejected, Answer::Text("V1013".to_owned())]
        );
    }

    #[test]
    fn lines_may_be_cut_anywhere() {
        let bytes = b"V1013\r\n\x07z\rt1FF21234EA60\r\rT0000018A0\r";
        let whole = answers(bytes);
        assert_eq!(whole.len(), 6);
        for cut in 0..bytes.len() {
            let (mut lines, mut found) = (Lines::default(), Vec::new());
            lines.feed(&bytes[..cut], |answer| found.push(answer));
            lines.feed(&bytes[cut..], |answer| found.push(answer));
            assert_eq!(found, whole, "{cut}");
        }
    }
}
