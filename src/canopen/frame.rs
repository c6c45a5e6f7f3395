//! A classic CAN frame, and its text form as in `candump -L` and `cansend`.

use super::id::CanId;
use std::fmt;
use std::str::FromStr;

/// A classic CAN data or remote frame.
///
/// CANopen (CiA 301) does not use CAN FD frames; transports ignore them.
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
pub struct Frame {
    id: CanId,
    remote: bool,
    len: u8,
    data: [u8; 8],
}

/// Why text or bytes are not a classic CAN frame.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FrameError {
    /// More than eight bytes.
    #[error("a classic CAN frame holds at most 8 bytes, not {0}")]
    TooLong(usize),
    /// Text that does not follow `ID#DATA` or `ID#R`.
    #[error("\"{0}\" is not a CAN frame (ID#DATA, as for cansend)")]
    Text(String),
}

impl Frame {
    /// Creates a data frame of 0 to 8 bytes.
    ///
    /// # Errors
    /// [`FrameError::TooLong`] if `data` has more than 8 bytes.
    pub fn new(id: CanId, data: &[u8]) -> Result<Frame, FrameError> {
        match u8::try_from(data.len()) {
            Ok(len) if len <= 8 => {
                let mut frame = Frame { id, remote: false, len, data: [0; 8] };
                frame.data[..data.len()].copy_from_slice(data);
                Ok(frame)
            }
            _ => Err(FrameError::TooLong(data.len())),
        }
    }

    /// Creates a data frame of exactly eight bytes, as in SDO and LSS.
    pub fn full(id: CanId, data: [u8; 8]) -> Frame {
        Frame { id, remote: false, len: 8, data }
    }

    /// Creates a data frame without data, such as SYNC (CiA 301, 7.2.5).
    pub fn empty(id: CanId) -> Frame {
        Frame { id, remote: false, len: 0, data: [0; 8] }
    }

    /// Creates a data frame of one byte, such as a heartbeat.
    pub fn byte(id: CanId, byte: u8) -> Frame {
        Frame { id, remote: false, len: 1, data: [byte, 0, 0, 0, 0, 0, 0, 0] }
    }

    /// Creates a data frame of two bytes, such as an NMT command.
    pub fn pair(id: CanId, first: u8, second: u8) -> Frame {
        Frame { id, remote: false, len: 2, data: [first, second, 0, 0, 0, 0, 0, 0] }
    }

    /// Creates a remote transmission request for `len` bytes, 0 to 8.
    ///
    /// # Errors
    /// [`FrameError::TooLong`] if `len` is above 8.
    pub fn remote(id: CanId, len: u8) -> Result<Frame, FrameError> {
        if len > 8 {
            return Err(FrameError::TooLong(usize::from(len)));
        }
        Ok(Frame { id, remote: true, len, data: [0; 8] })
    }

    /// The identifier.
    pub fn id(&self) -> CanId {
        self.id
    }

    /// Whether this is a remote transmission request.
    pub fn is_remote(&self) -> bool {
        self.remote
    }

    /// The data length code, 0 to 8. For a remote frame this is the requested length.
    pub fn len(&self) -> u8 {
        self.len
    }

    /// Whether the frame has no data.
    pub fn is_empty(&self) -> bool {
        self.data().is_empty()
    }

    /// The data; empty for a remote frame.
    pub fn data(&self) -> &[u8] {
        if self.remote { &[] } else { &self.data[..usize::from(self.len)] }
    }

    /// The eight data bytes of an SDO or LSS frame; `None` if the frame is shorter.
    pub fn as_eight_bytes(&self) -> Option<[u8; 8]> {
        (self.len == 8 && !self.remote).then_some(self.data)
    }
}

impl fmt::Display for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}#", self.id)?;
        if self.remote {
            f.write_str("R")?;
            if self.len > 0 {
                write!(f, "{}", self.len)?;
            }
            return Ok(());
        }
        self.data().iter().try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl fmt::Debug for Frame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

impl FromStr for Frame {
    type Err = FrameError;

    /// Parses `123#0011`, `12345678#`, `701#R1`; dots between bytes are allowed, as in `cansend`.
    fn from_str(text: &str) -> Result<Frame, FrameError> {
        let wrong = || FrameError::Text(text.to_owned());
        let (id, rest) = text.split_once('#').ok_or_else(wrong)?;
        if !id.bytes().all(|digit| digit.is_ascii_hexdigit()) {
            return Err(wrong());
        }
        let number = u32::from_str_radix(id, 16).map_err(|_| wrong())?;
        let id = match id.len() {
            3 => u16::try_from(number).ok().and_then(CanId::standard),
            8 => CanId::extended(number),
            _ => None,
        }
        .ok_or_else(wrong)?;
        if let Some(len) = rest.strip_prefix(['R', 'r']) {
            let len = if len.is_empty() { 0 } else { len.parse().map_err(|_| wrong())? };
            return Frame::remote(id, len).map_err(|_| wrong());
        }
        let mut data = Vec::with_capacity(8);
        for part in rest.split('.') {
            if part.len() % 2 != 0 || !part.is_ascii() {
                return Err(wrong());
            }
            for at in (0..part.len()).step_by(2) {
                let digits = &part[at..at + 2];
                if digits.starts_with('+') {
                    return Err(wrong());
                }
                data.push(u8::from_str_radix(digits, 16).map_err(|_| wrong())?);
            }
        }
        Frame::new(id, &data).map_err(|_| wrong())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_round_trips() {
        for text in ["000#8001", "080#", "77F#00", "5FF#6030610150C30000", "1FFFFFFF#01", "701#R", "701#R1"] {
            assert_eq!(text.parse::<Frame>().map(|frame| frame.to_string()).as_deref(), Ok(text));
        }
        assert_eq!("123#11.22.33".parse::<Frame>().map(|f| f.to_string()).as_deref(), Ok("123#112233"));
    }

    #[test]
    fn invalid_text_is_rejected() {
        for text in
            ["", "123", "12#00", "800#", "20000000#", "123#0", "123#001122334455667788", "123#R9", "123#+1", "1é#"]
        {
            assert!(text.parse::<Frame>().is_err(), "{text}");
        }
    }

    #[test]
    fn nine_bytes_are_refused() {
        assert_eq!(Frame::new(CanId::NMT, &[0; 9]), Err(FrameError::TooLong(9)));
        assert!(Frame::remote(CanId::NMT, 9).is_err());
    }
}
