//! Why a file cannot be replayed.

/// A file that is not a usable recording.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum RecordingError {
    /// The file contains nothing.
    #[error("the file is empty")]
    Empty,
    /// The file has another format.
    #[error("this is {}, not a candump log", .0.name())]
    OtherFormat(FileFormat),
    /// No line is one of a candump log.
    #[error("not a candump log: no line has a time, an interface and a frame")]
    NotALog,
    /// The screen form of candump without times.
    #[error("the frames have no times")]
    NoTimes,
    /// The times count from the previous frame (`candump -td`), or their resolution is too low.
    #[error("the times do not increase: they seem to be intervals from frame to frame (candump -td)")]
    Intervals,
    /// Frames of two interfaces.
    #[error("frames of {0} and of {1}: select one interface (grep)")]
    SeveralInterfaces(String, String),
}

/// Other formats that are recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// Compressed with gzip.
    Gzip,
    /// Vector BLF.
    Blf,
    /// ASAM MDF.
    Mdf,
    /// A database of python-can.
    Sqlite,
    /// A capture of Wireshark or tcpdump.
    Pcap,
    /// Text in UTF-16.
    Utf16,
    /// Vector ASC.
    Asc,
    /// PEAK TRC.
    Trc,
    /// CSV of python-can.
    PythonCanCsv,
    /// CSV of SavvyCAN.
    SavvyCanCsv,
    /// Measurements that `cangauge log` wrote.
    Measurements,
    /// XML.
    Xml,
}

impl FileFormat {
    /// The name, with its article.
    pub fn name(self) -> &'static str {
        match self {
            FileFormat::Gzip => "a gzip file",
            FileFormat::Blf => "a Vector BLF file",
            FileFormat::Mdf => "an MDF file",
            FileFormat::Sqlite => "an SQLite database",
            FileFormat::Pcap => "a Wireshark capture",
            FileFormat::Utf16 => "text in UTF-16",
            FileFormat::Asc => "a Vector ASC file",
            FileFormat::Trc => "a PEAK TRC file",
            FileFormat::PythonCanCsv => "a CSV file of python-can",
            FileFormat::SavvyCanCsv => "a CSV file of SavvyCAN",
            FileFormat::Measurements => "a CSV file of measurements",
            FileFormat::Xml => "an XML file",
        }
    }

    /// The format of a file by its first bytes; `None` if it is not one of these.
    pub(super) fn of(start: &[u8]) -> Option<FileFormat> {
        let binary: [(&[u8], FileFormat); 11] = [
            (b"\x1f\x8b", FileFormat::Gzip),
            (b"LOGG", FileFormat::Blf),
            (b"MDF ", FileFormat::Mdf),
            (b"UnFinMF ", FileFormat::Mdf),
            (b"SQLite format 3\0", FileFormat::Sqlite),
            (b"\x0a\x0d\x0d\x0a", FileFormat::Pcap),
            (b"\xa1\xb2\xc3\xd4", FileFormat::Pcap),
            (b"\xd4\xc3\xb2\xa1", FileFormat::Pcap),
            (b"\x4d\x3c\xb2\xa1", FileFormat::Pcap),
            (b"\xff\xfe", FileFormat::Utf16),
            (b"\xfe\xff", FileFormat::Utf16),
        ];
        if let Some((_, format)) = binary.iter().find(|(magic, _)| start.starts_with(magic)) {
            return Some(*format);
        }
        let text = String::from_utf8_lossy(start.strip_prefix(super::BYTE_ORDER_MARK).unwrap_or(start)).to_lowercase();
        let words = [
            ("date ", FileFormat::Asc),
            ("base hex", FileFormat::Asc),
            ("base dec", FileFormat::Asc),
            (";$fileversion", FileFormat::Trc),
            (";####", FileFormat::Trc),
            ("timestamp,arbitration_id", FileFormat::PythonCanCsv),
            ("time stamp,id,", FileFormat::SavvyCanCsv),
            ("time,elapsed_s,", FileFormat::Measurements),
            ("<", FileFormat::Xml),
        ];
        // Comments may stand before.
        let of_line = |line: &str| words.iter().find(|(word, _)| line.trim_start().starts_with(word));
        text.lines().find_map(of_line).map(|(_, format)| *format)
    }
}
