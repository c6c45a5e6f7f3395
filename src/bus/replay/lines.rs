//! Reads the lines of a recording from a file or a pipe, compressed or not.

use crate::bus::file::GZIP;
use flate2::bufread::MultiGzDecoder;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Cursor, Read};

/// The longest line in bytes. The rest of a longer line is ignored.
const MAX_LINE: u64 = 4096;

/// The size of the read buffer in bytes.
const BUFFER_SIZE: usize = 1 << 16;

/// The first bytes of a file, which show its format.
const START_LENGTH: u64 = 16;

/// A mark that some editors write at the start of a UTF-8 file.
const BYTE_ORDER_MARK: &[u8] = b"\xef\xbb\xbf";

pub(super) struct Lines {
    reader: BufReader<Box<dyn Read>>,
    /// The first bytes, after decompression.
    pub(super) start: Vec<u8>,
    /// Lines that were read ahead, with their numbers.
    ahead: VecDeque<(u64, Vec<u8>)>,
    /// The number of lines read from the file.
    number: u64,
    /// Whether compressed data ends too early.
    pub(super) is_cut: bool,
}

impl Lines {
    /// Opens a file; `-` is standard input.
    pub(super) fn open(file: &str) -> io::Result<Lines> {
        if file == "-" {
            return Lines::new(Box::new(BufReader::new(io::stdin())));
        }
        Lines::new(Box::new(BufReader::with_capacity(BUFFER_SIZE, File::open(file)?)))
    }

    pub(super) fn new(reader: Box<dyn BufRead>) -> io::Result<Lines> {
        let (mut start, mut reader) = first_bytes(reader)?;
        let mut is_cut = false;
        if start.starts_with(GZIP) {
            let unpacked: Box<dyn BufRead> =
                Box::new(BufReader::with_capacity(BUFFER_SIZE, MultiGzDecoder::new(reader)));
            (start, reader) = match first_bytes(unpacked) {
                Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                    is_cut = true;
                    (Vec::new(), Box::new(io::empty()) as Box<dyn BufRead>)
                }
                unpacked => unpacked?,
            };
        }
        if let Some(rest) = start.strip_prefix(BYTE_ORDER_MARK) {
            start = rest.to_vec();
            reader.consume(BYTE_ORDER_MARK.len());
        }
        let reader = BufReader::with_capacity(BUFFER_SIZE, reader as Box<dyn Read>);
        Ok(Lines { reader, start, ahead: VecDeque::new(), number: 0, is_cut })
    }

    /// Reads the next line into `line`, and returns its number; `None` at the end.
    pub(super) fn next(&mut self, line: &mut Vec<u8>) -> io::Result<Option<u64>> {
        match self.ahead.pop_front() {
            Some((number, ahead)) => {
                *line = ahead;
                Ok(Some(number))
            }
            None => self.read(line),
        }
    }

    /// Reads a line ahead, which [`Lines::next`] returns later.
    pub(super) fn peek(&mut self) -> io::Result<Option<&[u8]>> {
        let mut line = Vec::new();
        let Some(number) = self.read(&mut line)? else { return Ok(None) };
        self.ahead.push_back((number, line));
        Ok(self.ahead.back().map(|(_, line)| &line[..]))
    }

    /// The bytes in the read buffer, which start with the next line. Empty if lines were read ahead.
    pub(super) fn buffered(&self) -> &[u8] {
        if self.ahead.is_empty() { self.reader.buffer() } else { &[] }
    }

    /// Skips the next line, which has `length` bytes and is in the read buffer. Returns its number.
    pub(super) fn skip(&mut self, length: usize) -> u64 {
        self.reader.consume(length);
        self.number += 1;
        self.number
    }

    /// The number of lines read from the file.
    pub(super) fn count(&self) -> u64 {
        self.number
    }

    fn read(&mut self, line: &mut Vec<u8>) -> io::Result<Option<u64>> {
        line.clear();
        if self.read_part(line)? == 0 {
            return Ok(None);
        }
        while !line.ends_with(b"\n") {
            let mut rest = Vec::new();
            if self.read_part(&mut rest)? == 0 {
                break;
            }
            if rest.ends_with(b"\n") {
                line.push(b'\n');
            }
        }
        self.number += 1;
        Ok(Some(self.number))
    }

    /// Reads up to the end of the line, at most [`MAX_LINE`] bytes.
    fn read_part(&mut self, part: &mut Vec<u8>) -> io::Result<usize> {
        match (&mut self.reader).take(MAX_LINE).read_until(b'\n', part) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                self.is_cut = true;
                self.reader = BufReader::new(Box::new(io::empty()));
                Ok(part.len())
            }
            read => read,
        }
    }
}

/// The first bytes, and a reader that starts with them.
fn first_bytes(mut reader: Box<dyn BufRead>) -> io::Result<(Vec<u8>, Box<dyn BufRead>)> {
    let mut start = Vec::new();
    (&mut reader).take(START_LENGTH).read_to_end(&mut start)?;
    Ok((start.clone(), Box::new(Cursor::new(start).chain(reader))))
}
