//! The only way to write an object.
//!
//! An expedited download either contains its size (23h, 27h, 2Bh, 2Fh) or not (22h). Some devices accept only one of
//! the two forms:
//! 1. The first request has the form of the device description, else it contains the size.
//! 2. If the node rejects the command (0504 0001h), the same form is sent once more. The reason may be an unfinished
//!    transfer of another master. A signature is never sent again, and no write is sent again after foreign SDO
//!    traffic.
//! 3. If the node then rejects the form (0504 0001h) or the length (0607 0010h), the other form is sent once. If this
//!    form is also rejected, the first abort code is reported.
//! 4. Before a value is sent without its size, the width of the object is checked. If the object is wider, the node
//!    would add zero bytes: -5 as INTEGER16 would become 65531 in an INTEGER32.
//! 5. A signature ("save", "load", "zero", "tara", a number with "set") starts an action. It is sent again only in the
//!    other form, after a rejection (3).
//! 6. If no answer comes, a plain value is read back. A signature cannot be read back, so its result is unknown.

use super::Node;
use super::error::{Error, shown};
use crate::bus::Received;
use crate::canopen::frame::Frame;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::{AbortCode, DownloadSize};
use crate::canopen::value::DataType;
use crate::device::description::SizeIndication;
use crate::master::{BlockMode, Master, Moved, Operation, Request, SdoError, SdoFailure};
use std::time::Duration;

/// Whether an expedited download contains its size.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// As in the device description, else with the size; the other form if the node rejects the first one.
    #[default]
    Auto,
    /// With the size.
    Indicated,
    /// Without the size (22h).
    Omitted,
}

/// Whether a request without an answer may be sent again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Repeat {
    /// The master repeats it up to [`crate::master::Timing::retries`] times, then reads the object back. Not for
    /// signatures.
    #[default]
    Repeatable,
    /// The object is read back after each request. It is written again only if it has a different value.
    Once,
}

/// Options of a write.
pub struct WriteOptions<'a> {
    /// Whether the request contains the size.
    pub form: Form,
    /// When block transfer is used.
    pub blocks: BlockMode,
    /// Whether a request without an answer may be sent again.
    pub repeat: Repeat,
    /// The shortest time-out for the answer. Writing to non-volatile memory takes up to 3 s.
    pub min_timeout: Duration,
    /// Called every 100 ms with the bytes transferred.
    pub progress: &'a mut dyn FnMut(Moved),
    /// Called with each frame that belongs to no SDO transfer.
    pub watch: &'a mut dyn FnMut(&Received),
}

/// How a write was confirmed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Written {
    /// The node acknowledged the write.
    Acknowledged,
    /// No answer was received. The object was read back and has the value. The frame was received instead of the
    /// answer.
    ReadBack(Option<Frame>),
}

/// Writes an object with the default options.
///
/// # Errors
/// As [`write_with`].
pub fn write(master: &mut Master<'_>, node: &Node, object: ObjectId, data: &[u8]) -> Result<Written, Error> {
    let (progress, watch) = (&mut |_| {}, &mut |_: &Received| {});
    write_with(master, node, object, data, &mut WriteOptions::new(progress, watch))
}

/// Writes an object.
///
/// # Errors
/// - [`Error::Sdo`] if the object is known to be unchanged.
/// - [`Error::Unknown`] if no answer was received and it is unknown whether the node executed the write.
/// - [`Error::Width`] if the value is narrower than the object and the node does not accept a size.
/// - Bus errors and Ctrl-C.
pub fn write_with(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    options: &mut WriteOptions<'_>,
) -> Result<Written, Error> {
    master.ensure_single(node.id)??;
    let mut attempts_left = master.timing().retries;
    let mut sizes = sizes(node, options.form);
    let mut first_refusal: Option<SdoError> = None;
    let mut may_repeat = !is_signature(data) && options.blocks != BlockMode::Always;
    // The form concerns expedited downloads only.
    let is_expedited = (1..=4).contains(&data.len()) && options.blocks != BlockMode::Always;
    let is_auto = options.form == Form::Auto && is_expedited;
    if is_auto && sizes[0] == DownloadSize::Omitted {
        check_width(master, node, object, data, options)?;
    }
    loop {
        let request = request(master, node, object, data, sizes[0], options);
        let Err(error) = master.carry_out_watching(request, options.progress, options.watch)? else {
            return Ok(Written::Acknowledged);
        };
        match error.failure {
            SdoFailure::Refused(AbortCode::COMMAND_SPECIFIER) if std::mem::take(&mut may_repeat) => {}
            SdoFailure::Refused(AbortCode::COMMAND_SPECIFIER | AbortCode::LENGTH)
                if is_auto && first_refusal.is_none() =>
            {
                sizes.reverse();
                if sizes[0] == DownloadSize::Omitted
                    && check_width(master, node, object, data, options).is_err_and(|error| !error.is_fatal())
                {
                    return Err(error.into());
                }
                first_refusal = Some(error);
            }
            SdoFailure::Refused(_) => return Err(first_refusal.unwrap_or(error).into()),
            _ if error.operation == Operation::Read => return Err(error.into()),
            _ if !may_be_lost(&error) => return Err(Error::Unknown(error)),
            _ => match read_back(master, node, object, data, options)? {
                Some(true) => return Ok(Written::ReadBack(frame_instead_of_answer(&error))),
                Some(false) if options.repeat == Repeat::Once && attempts_left > 0 => attempts_left -= 1,
                Some(false) => return Err(error.into()),
                None => return Err(Error::Unknown(error)),
            },
        }
    }
}

/// Writes a value and reads it back.
///
/// # Errors
/// As [`write()`]; [`Error::ReadBackDiffers`] if the object has a different value.
pub fn write_and_verify(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    data_type: DataType,
) -> Result<Written, Error> {
    let written = write(master, node, object, data)?;
    verify(master, node, object, data, data_type)?;
    Ok(written)
}

/// Reads an object and compares it with the written bytes.
///
/// # Errors
/// The read failed; [`Error::ReadBackDiffers`] if the object has a different value.
pub fn verify(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    data_type: DataType,
) -> Result<(), Error> {
    let found = master.read(node.id, object, data_type)??;
    let written = shown(data, data_type);
    if found == written { Ok(()) } else { Err(Error::ReadBackDiffers { node: node.id, object, written, found }) }
}

/// Whether these bytes are a signature: "save", "load", "zero", "tara", or a number with "set".
///
/// A signature starts an action. A read of the object returns another value (2321h: the detected bit rate).
pub fn is_signature(data: &[u8]) -> bool {
    [&b"save"[..], b"load", b"zero", b"tara"].contains(&data) || data.len() == 4 && data[1..] == *b"set"
}

impl<'a> WriteOptions<'a> {
    /// Creates the default options.
    pub fn new(progress: &'a mut dyn FnMut(Moved), watch: &'a mut dyn FnMut(&Received)) -> WriteOptions<'a> {
        WriteOptions {
            form: Form::Auto,
            blocks: BlockMode::Never,
            repeat: Repeat::Repeatable,
            min_timeout: Duration::ZERO,
            progress,
            watch,
        }
    }
}

/// Returns the forms, in the order in which they are tried.
fn sizes(node: &Node, form: Form) -> [DownloadSize; 2] {
    let described = node.model.as_ref().map(|model| model.description.sdo.size);
    match (form, described) {
        (Form::Omitted, _) | (Form::Auto, Some(SizeIndication::Omitted)) => {
            [DownloadSize::Omitted, DownloadSize::Indicated]
        }
        (Form::Indicated, _) | (Form::Auto, Some(SizeIndication::Indicated) | None) => {
            [DownloadSize::Indicated, DownloadSize::Omitted]
        }
    }
}

fn request(
    master: &Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    size: DownloadSize,
    options: &WriteOptions<'_>,
) -> Request {
    let request = Request::write(node.id, object, data.to_vec(), size).blocks(options.blocks.for_write(data.len()));
    let is_longer = options.min_timeout > master.timing().timeout;
    let request = if is_longer { request.within(options.min_timeout) } else { request };
    if options.repeat == Repeat::Once || is_signature(data) { request.once() } else { request }
}

/// Checks that the object is not wider than the value. The width comes from the description. If the object is not
/// described, it is read; the answer shows the width if the node indicates sizes. A signature always has the width of
/// its object.
fn check_width(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    options: &mut WriteOptions<'_>,
) -> Result<(), Error> {
    if data.len() == 4 || is_signature(data) {
        return Ok(());
    }
    let width = match node.known_type(object).and_then(DataType::width) {
        Some(width) => Some(width),
        None => {
            let answer = master.carry_out_watching(Request::read(node.id, object), options.progress, options.watch)?;
            let uploaded = answer.ok().and_then(|answer| answer.uploaded);
            uploaded.filter(|uploaded| uploaded.indicated).map(|uploaded| uploaded.bytes.len())
        }
    };
    match width {
        Some(width) if width > data.len() => Err(Error::Width { node: node.id, object, width, given: data.len() }),
        Some(_) | None => Ok(()),
    }
}

/// Reads the object back. Returns whether it has the value; `None` for a signature or an object that cannot be read.
fn read_back(
    master: &mut Master<'_>,
    node: &Node,
    object: ObjectId,
    data: &[u8],
    options: &mut WriteOptions<'_>,
) -> Result<Option<bool>, Error> {
    if is_signature(data) || data.is_empty() {
        return Ok(None);
    }
    let answer = master.carry_out_watching(Request::read(node.id, object), options.progress, options.watch)?;
    let Some(uploaded) = answer.ok().and_then(|answer| answer.uploaded) else { return Ok(None) };
    // A node that does not indicate the size sends four bytes for every type.
    let may_be_equal = !uploaded.indicated || uploaded.bytes.len() == data.len();
    Ok(Some(may_be_equal && uploaded.bytes.get(..data.len()) == Some(data)))
}

/// Returns the frame that was received instead of the answer.
fn frame_instead_of_answer(error: &SdoError) -> Option<Frame> {
    match error.failure {
        SdoFailure::NoAnswer { missed, .. } => missed.frame,
        _ => None,
    }
}

/// Whether the request or its answer may have been lost. After any other failure, the node may execute the write later.
fn may_be_lost(error: &SdoError) -> bool {
    matches!(error.failure, SdoFailure::NoAnswer { .. } | SdoFailure::Ambiguous | SdoFailure::Disturbed)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn signatures_and_plain_values_are_distinguished() {
        for signature in [&b"save"[..], b"load", b"zero", b"tara", b"\x03set"] {
            assert!(is_signature(signature));
        }
        for plain in [&b"sav"[..], b"evas", &[1, 2, 3, 4], b"set"] {
            assert!(!is_signature(plain));
        }
    }
}
