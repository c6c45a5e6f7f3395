//! What stands in a file that is to be continued.

use std::fs::File;
use std::io::{self, Read, Seek, SeekFrom};

/// The beginning and the end of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Kept {
    /// Its first line, without line end and byte order mark.
    pub head: String,
    /// How many bytes its whole lines have: a last line without line end was cut off by a kill.
    pub length: u64,
}

/// A first line longer than this is no header.
const LONGEST_HEAD: u64 = 1 << 20;

/// How much is looked at, at a time.
const STEP: u64 = 64 * 1024;

/// Looks at a file that is open for reading; nothing where it has no whole line.
///
/// # Errors
/// It cannot be read.
pub fn look(file: &mut File) -> io::Result<Option<Kept>> {
    let mut end = file.metadata()?.len();
    let length = loop {
        if end == 0 {
            return Ok(None);
        }
        let begin = end.saturating_sub(STEP);
        let mut bytes = Vec::new();
        file.seek(SeekFrom::Start(begin))?;
        Read::by_ref(file).take(end - begin).read_to_end(&mut bytes)?;
        match bytes.iter().rposition(|&byte| byte == b'\n') {
            Some(at) => break begin + at as u64 + 1,
            None => end = begin,
        }
    };
    let mut bytes = Vec::new();
    file.seek(SeekFrom::Start(0))?;
    Read::by_ref(file).take(length.min(LONGEST_HEAD)).read_to_end(&mut bytes)?;
    let line = bytes.split(|&byte| byte == b'\n').next().unwrap_or_default();
    let line = line.strip_prefix(super::cells::BOM).unwrap_or(line);
    Ok(Some(Kept { head: String::from_utf8_lossy(line).into_owned(), length }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;

    fn kept(text: &[u8]) -> Option<(String, u64)> {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(text).expect("written");
        look(&mut file).expect("read").map(|kept| (kept.head, kept.length))
    }

    #[test]
    fn whole_lines() {
        assert_eq!(kept(b""), None);
        assert_eq!(kept(b"time,elap"), None);
        assert_eq!(kept(b"a,b\n"), Some(("a,b".to_owned(), 4)));
        assert_eq!(kept(b"a,b\n1,2\n3,"), Some(("a,b".to_owned(), 8)));
        assert_eq!(kept(b"\xef\xbb\xbfa,b\n1"), Some(("a,b".to_owned(), 7)));
        let long = [b"a\n".repeat(100_000), vec![b'x'; 200_000]].concat();
        assert_eq!(kept(&long), Some(("a".to_owned(), 200_000)));
        assert_eq!(kept(&vec![b'x'; 200_000]), None);
    }
}
