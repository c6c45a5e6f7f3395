//! Where lines are written: a file, a series of files, or a stream. A failure leaves whole lines only.

use super::series::Series;
use std::fs::File;
use std::io::{self, Seek, Write};

/// Where lines are written.
#[derive(Debug)]
pub enum Target {
    /// A file. A regular file keeps its first `keep` bytes; the first line replaces the rest.
    File {
        /// Open for writing.
        file: File,
        /// How many of its bytes are kept.
        keep: u64,
    },
    /// stdout, a pipe, a device.
    Stream(Box<dyn Stream>),
}

/// A stream that a thread can write to.
pub trait Stream: Write + std::fmt::Debug + Send {}

impl<T: Write + std::fmt::Debug + Send> Stream for T {}

/// What failed, and how many rows were lost with it.
pub(super) type WriteFailure = (io::Error, u64);

/// Writes lines to a target, and to the files of a series after it.
#[derive(Debug)]
pub(super) struct TargetWriter {
    target: Target,
    series: Option<Series>,
    is_prepared: bool,
}

impl TargetWriter {
    pub(super) fn new(target: Target, series: Option<Series>) -> TargetWriter {
        TargetWriter { target, series, is_prepared: false }
    }

    /// Writes the lines before the first row. With `new_file` they start the next file of the series.
    pub(super) fn header(&mut self, new_file: bool, bytes: &[u8]) -> Result<(), WriteFailure> {
        self.prepare().map_err(|error| (error, 0))?;
        if let (true, Some(series)) = (new_file, &mut self.series) {
            let file = series.create().map_err(|error| (error, 0))?;
            self.target = Target::File { file, keep: 0 };
        }
        self.rows(bytes, 0)
    }

    /// Writes whole lines. After a failure the file ends with a whole line.
    pub(super) fn rows(&mut self, bytes: &[u8], rows: u64) -> Result<(), WriteFailure> {
        self.prepare().map_err(|error| (error, rows))?;
        write_lines(&mut self.target, bytes).map_err(|(error, kept)| {
            let lines = bytes[kept..].iter().filter(|&&byte| byte == b'\n').count() as u64;
            (error, lines.min(rows))
        })
    }

    /// Before the first line: removes the bytes of the file that are not kept.
    fn prepare(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.is_prepared, true) {
            return Ok(());
        }
        if let Some(series) = &mut self.series {
            series.repair_last()?;
        }
        if let Target::File { file, keep } = &mut self.target
            && file.metadata()?.is_file()
        {
            file.set_len(*keep)?;
            file.seek(io::SeekFrom::End(0))?;
        }
        Ok(())
    }
}

/// Writes all of `bytes`. The error comes with the number of bytes that were kept: whole lines.
fn write_lines(target: &mut Target, bytes: &[u8]) -> Result<(), (io::Error, usize)> {
    let mut done = 0;
    while done < bytes.len() {
        let result = match target {
            Target::File { file, .. } => file.write(&bytes[done..]),
            Target::Stream(stream) => stream.write(&bytes[done..]),
        };
        match result {
            Ok(0) => return Err((io::ErrorKind::WriteZero.into(), cut_partial_line(target, bytes, done))),
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err((error, cut_partial_line(target, bytes, done))),
        }
    }
    if let Target::Stream(stream) = target {
        stream.flush().map_err(|error| (error, bytes.len()))?;
    }
    Ok(())
}

/// Cuts a file back to its last whole line. `done` of `bytes` were written; returns how many of them are kept.
fn cut_partial_line(target: &mut Target, bytes: &[u8], done: usize) -> usize {
    let whole = bytes[..done].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    if let Target::File { file, .. } = target {
        let excess = (done - whole) as u64;
        if let Ok(metadata) = file.metadata()
            && metadata.is_file()
            && excess > 0
        {
            // The disk has already failed; the caller reports the cause.
            let _ = file.set_len(metadata.len().saturating_sub(excess));
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_partial_row_is_removed() {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(b"head\naaa\nbb").expect("written");
        let mut target = Target::File { file: file.try_clone().expect("a file"), keep: 0 };
        assert_eq!(cut_partial_line(&mut target, b"aaa\nbbb\n", 6), 4);
        assert_eq!(file.metadata().expect("a file").len(), 9, "header and the first row");
        assert_eq!(cut_partial_line(&mut target, b"ccc\n", 0), 0);
        assert_eq!(file.metadata().expect("a file").len(), 9);
    }
}
