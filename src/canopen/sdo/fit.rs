//! Converts the delivered bytes of an object to a value of the expected type.
//!
//! Deviations of real sensors are accepted, and each one is reported.

use super::Uploaded;
use crate::canopen::frame::Frame;
use crate::canopen::value::{DataType, Value, WidthError};
use std::fmt;

/// A value, and a note about deviations.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// The value.
    pub value: Value,
    /// The deviation to report.
    pub note: Option<Note>,
}

/// A deviation that does not affect the value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Note {
    /// The type is unknown and the device did not indicate the size.
    SizeNotIndicated,
    /// More bytes than the type has; the excess bytes are zeros or the sign extension.
    Wider {
        /// Bytes of the type.
        expected: usize,
        /// Bytes delivered.
        found: usize,
    },
    /// An integer in fewer bytes than its type has.
    Narrower {
        /// Bytes of the type.
        expected: usize,
        /// Bytes delivered.
        found: usize,
    },
    /// A segmented transfer delivered another size than it announced.
    Announced {
        /// Bytes announced.
        announced: u32,
        /// Bytes delivered.
        found: usize,
    },
    /// A segment before the last one was not full, in both reads of the object.
    ShortSegment,
    /// The end frame of a block transfer declares the last segment invalid, but size and CRC include the segment.
    WrongEnd,
}

impl fmt::Display for Note {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Note::SizeNotIndicated => f.write_str("size not indicated: all four bytes are shown"),
            Note::Wider { expected, found } => write!(f, "the device delivered {found} bytes for {expected}"),
            Note::Narrower { expected, found } => write!(f, "the device delivered {found} bytes for {expected}"),
            Note::Announced { announced, found } => {
                write!(f, "the device announced {announced} bytes and delivered {found}")
            }
            Note::ShortSegment => f.write_str("the device sent a segment in the middle that is not full"),
            Note::WrongEnd => {
                f.write_str("the device calls the last 7 bytes unused; they are kept, since size and CRC include them")
            }
        }
    }
}

/// Bytes that do not fit the type.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FitError {
    /// Too few or too many bytes.
    #[error("the device delivered {found} bytes, but {data_type} has {expected}")]
    Width {
        /// The expected type.
        data_type: DataType,
        /// The size of the type in bytes.
        expected: usize,
        /// Bytes delivered.
        found: usize,
    },
    /// An expedited answer has fewer bytes than it declares, and the type needs the missing bytes or is unknown.
    #[error("the frame has fewer bytes than it declares: {0}")]
    Truncated(Frame),
}

/// Converts delivered bytes to `data_type`; if it is `None`, the bytes stay as they are.
///
/// If no size is indicated, bytes beyond the size of the type are ignored. If a size is indicated, these bytes must be
/// zero or the sign extension of a negative integer. An integer may have fewer bytes than its type, unless the length
/// differs from the announced one.
///
/// # Errors
/// The bytes do not fit the type.
pub fn fit(data_type: Option<DataType>, uploaded: &Uploaded) -> Result<Fitted, FitError> {
    let found = uploaded.bytes.len();
    let deviation = uploaded.announced.filter(|&size| usize::try_from(size) != Ok(found));
    let deviation = deviation.map(|announced| Note::Announced { announced, found });
    let deviation = deviation.or(uploaded.has_short_segment.then_some(Note::ShortSegment));
    let deviation = deviation.or(uploaded.has_wrong_end.then_some(Note::WrongEnd));
    let suffices = |data_type: DataType| data_type.width().is_some_and(|width| width <= found);
    if let Some(frame) = uploaded.truncated.filter(|_| !data_type.is_some_and(suffices)) {
        return Err(FitError::Truncated(frame));
    }
    let Some(data_type) = data_type else {
        let note = if uploaded.indicated { deviation } else { Some(Note::SizeNotIndicated) };
        return Ok(Fitted { value: Value::Bytes(uploaded.bytes.clone()), note });
    };
    let error = |error: WidthError| FitError::Width { data_type, expected: error.expected, found };
    let Some(expected) = data_type.width() else {
        return Ok(Fitted { value: data_type.decode(&uploaded.bytes).map_err(error)?, note: deviation });
    };
    if found < expected {
        let narrow = match data_type {
            DataType::Unsigned(_) => u8::try_from(found).ok().map(DataType::Unsigned),
            DataType::Integer(_) => u8::try_from(found).ok().map(DataType::Integer),
            _ => None,
        };
        let narrow = narrow.filter(|_| uploaded.indicated && found > 0 && !uploaded.has_doubtful_length());
        let narrow = narrow.ok_or(FitError::Width { data_type, expected, found })?;
        let value = narrow.decode(&uploaded.bytes).map_err(error)?;
        return Ok(Fitted { value, note: Some(Note::Narrower { expected, found }) });
    }
    let (value_bytes, excess) = uploaded.bytes.split_at(expected);
    if excess.is_empty() || !uploaded.indicated {
        return Ok(Fitted { value: data_type.decode(value_bytes).map_err(error)?, note: deviation });
    }
    let negative = matches!(data_type, DataType::Integer(_)) && value_bytes.last().is_some_and(|byte| byte & 0x80 != 0);
    let excess_is = |byte: u8| excess.iter().all(|&found| found == byte);
    if excess_is(0) || negative && excess_is(0xff) {
        let note = Some(Note::Wider { expected, found });
        return Ok(Fitted { value: data_type.decode(value_bytes).map_err(error)?, note });
    }
    Err(FitError::Width { data_type, expected, found })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn uploaded(bytes: &[u8], indicated: bool) -> Uploaded {
        Uploaded { indicated, ..Uploaded::complete(bytes.to_vec()) }
    }

    fn text(data_type: DataType, uploaded: &Uploaded) -> Result<(String, Option<Note>), FitError> {
        fit(Some(data_type), uploaded).map(|fitted| (fitted.value.to_string(), fitted.note))
    }

    #[test]
    fn without_an_indicated_size_the_type_decides() {
        let answer = uploaded(&[0xe8, 0x03, 0xaa, 0xbb], false);
        assert_eq!(text(DataType::Unsigned(2), &answer), Ok(("1000".into(), None)));
        assert_eq!(text(DataType::VisibleString, &uploaded(b"D2X9", false)), Ok(("D2X9".into(), None)));
        assert_eq!(text(DataType::VisibleString, &uploaded(b"DPS\0", false)), Ok(("DPS".into(), None)));
        let raw = fit(None, &answer).expect("no type, no error");
        assert_eq!((raw.value.to_string().as_str(), raw.note), ("E803AABB", Some(Note::SizeNotIndicated)));
        assert!(text(DataType::Unsigned(8), &answer).is_err());
        assert!(text(DataType::Unsigned(4), &uploaded(&[1, 2, 3], false)).is_err());
    }

    #[test]
    fn excess_bytes_must_be_zero_or_the_sign() {
        let note = Some(Note::Wider { expected: 1, found: 4 });
        assert_eq!(text(DataType::Unsigned(1), &uploaded(&[5, 0, 0, 0], true)), Ok(("5".into(), note)));
        assert_eq!(text(DataType::Integer(1), &uploaded(&[0xfb, 0xff, 0xff, 0xff], true)), Ok(("-5".into(), note)));
        assert!(text(DataType::Unsigned(1), &uploaded(&[5, 1, 0, 0], true)).is_err());
        assert!(text(DataType::Unsigned(1), &uploaded(&[0xfb, 0xff, 0xff, 0xff], true)).is_err());
        assert!(text(DataType::Integer(1), &uploaded(&[5, 0xff, 0xff, 0xff], true)).is_err());
    }

    #[test]
    fn only_integers_may_be_narrower_than_their_type() {
        // MH-4, 9130h: INTEGER16 in the table, INTEGER32 in the text and the mapping.
        let note = Some(Note::Narrower { expected: 4, found: 2 });
        assert_eq!(text(DataType::Integer(4), &uploaded(&[0xfe, 0xff], true)), Ok(("-2".into(), note)));
        assert!(text(DataType::Real32, &uploaded(&[0, 0], true)).is_err());
        assert!(text(DataType::Integer(4), &uploaded(&[], true)).is_err());
        assert_eq!(
            text(DataType::Real32, &uploaded(&[0, 0], true)).map_err(|error| error.to_string()),
            Err("the device delivered 2 bytes, but r32 has 4".into())
        );
    }

    #[test]
    fn a_size_that_differs_from_the_announced_one_is_noted() {
        let answer = Uploaded { announced: Some(9), ..Uploaded::complete(b"MH-4-CAN".to_vec()) };
        let note = Some(Note::Announced { announced: 9, found: 8 });
        assert_eq!(text(DataType::VisibleString, &answer), Ok(("MH-4-CAN".into(), note)));
        // A number with missing bytes would be wrong.
        let answer = Uploaded { announced: Some(4), ..Uploaded::complete(vec![0xfe, 0xff]) };
        assert!(text(DataType::Integer(4), &answer).is_err());
        assert!(text(DataType::Integer(2), &answer).is_ok());
    }

    #[test]
    fn a_truncated_expedited_answer_is_used_if_the_type_needs_no_more() {
        let frame = "585#431710002C01".parse().expect("a frame");
        let answer = Uploaded { truncated: Some(frame), ..Uploaded::complete(vec![0x2c, 0x01]) };
        assert_eq!(text(DataType::Unsigned(2), &answer), Ok(("300".into(), None)));
        for data_type in [DataType::Unsigned(4), DataType::Integer(3), DataType::Real32, DataType::VisibleString] {
            assert_eq!(text(data_type, &answer), Err(FitError::Truncated(frame)), "{data_type}");
        }
        assert_eq!(fit(None, &answer), Err(FitError::Truncated(frame)));
    }
}
