//! Reads the contents of a file to which rows will be appended.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// The first line of a file, and the length of its whole lines.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ExistingLines {
    /// The first line, without line end and byte order mark.
    pub header: String,
    /// Bytes of all whole lines. A last line without a line end was cut off when the program was killed.
    pub length: u64,
}

/// A longer first line is not a header.
const MAX_HEADER: u64 = 1 << 20;

/// The number of bytes per read.
const CHUNK: u64 = 64 * 1024;

/// Reads a file that is open for reading; `None` if it has no whole line.
///
/// # Errors
/// The file cannot be read.
pub fn existing_lines(file: &mut File) -> io::Result<Option<ExistingLines>> {
    let mut end = file.metadata()?.len();
    let length = loop {
        if end == 0 {
            return Ok(None);
        }
        let start = end.saturating_sub(CHUNK);
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(start))?;
        Read::by_ref(file).take(end - start).read_to_end(&mut bytes)?;
        match bytes.iter().rposition(|&byte| byte == b'\n') {
            Some(at) => break start + at as u64 + 1,
            None => end = start,
        }
    };
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    Read::by_ref(file).take(length.min(MAX_HEADER)).read_to_end(&mut bytes)?;
    let line = bytes.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let line = line.strip_prefix(super::cells::BOM).unwrap_or(line);
    Ok(Some(ExistingLines { header: String::from_utf8_lossy(line).into_owned(), length }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn lines(text: &[u8]) -> Option<(String, u64)> {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(text).expect("written");
        existing_lines(&mut file).expect("read").map(|lines| (lines.header, lines.length))
    }

    #[test]
    fn whole_lines_are_found() {
        assert_eq!(lines(b""), None);
        assert_eq!(lines(b"time,elap"), None);
        assert_eq!(lines(b"a,b\n"), Some(("a,b".to_owned(), 4)));
        assert_eq!(lines(b"a,b\n1,2\n3,"), Some(("a,b".to_owned(), 8)));
        assert_eq!(lines(b"\xef\xbb\xbfa,b\n1"), Some(("a,b".to_owned(), 7)));
        let long = [b"a\n".repeat(100_000), vec![b'x'; 200_000]].concat();
        assert_eq!(lines(&long), Some(("a".to_owned(), 200_000)));
        assert_eq!(lines(&vec![b'x'; 200_000]), None);
    }
}
