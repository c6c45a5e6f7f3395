//! Recognises the format of a file: a recording that can be replayed, or something else.

use super::Parser;
use super::asc::Asc;
use super::candump::{self, Candump};
use super::python_can::{self, Csv};
use super::text::{self, number};
use super::trc::Trc;

/// The formats that can be replayed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RecordingFormat {
    /// `candump -L`, or the screen form of candump with times.
    Candump,
    /// Vector ASC.
    Asc,
    /// PEAK TRC.
    Trc,
    /// CSV of python-can.
    PythonCanCsv,
}

/// Other formats that are recognised.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FileFormat {
    /// Compressed twice with gzip.
    Gzip,
    /// Compressed with xz.
    Xz,
    /// Compressed with bzip2.
    Bzip2,
    /// Compressed with zstd.
    Zstd,
    /// A zip archive.
    Zip,
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
    /// CSV of SavvyCAN.
    SavvyCanCsv,
    /// A log of BUSMASTER.
    Busmaster,
    /// Text or CSV of Kvaser.
    Kvaser,
    /// CSV of the IXXAT analyser.
    Ixxat,
    /// CSV of Vehicle Spy.
    VehicleSpy,
    /// CSV of the CANedge.
    CanEdge,
    /// The screen output of python-can.
    PythonCanScreen,
    /// Measurements that `cangauge log` wrote.
    Measurements,
    /// XML.
    Xml,
}

impl RecordingFormat {
    /// The name, with its article.
    pub fn name(self) -> &'static str {
        match self {
            RecordingFormat::Candump => "a candump log",
            RecordingFormat::Asc => "a Vector ASC file",
            RecordingFormat::Trc => "a PEAK TRC file",
            RecordingFormat::PythonCanCsv => "a CSV file of python-can",
        }
    }

    pub(super) fn parser(self) -> Box<dyn Parser> {
        match self {
            RecordingFormat::Candump => Box::new(Candump::new(text::local_time)),
            RecordingFormat::Asc => Box::new(Asc::new(text::local_time)),
            RecordingFormat::Trc => Box::new(Trc::new(text::local_time)),
            RecordingFormat::PythonCanCsv => Box::new(Csv),
        }
    }

    /// The format of a file by one of its first lines; `None` if the line does not show it.
    pub(super) fn of(line: &str) -> Option<Result<RecordingFormat, FileFormat>> {
        let lower = line.to_lowercase();
        let words: Vec<&str> = lower.split_ascii_whitespace().collect();
        let heads = [
            ("(", Ok(RecordingFormat::Candump)),
            ("date ", Ok(RecordingFormat::Asc)),
            ("base hex", Ok(RecordingFormat::Asc)),
            ("base dec", Ok(RecordingFormat::Asc)),
            ("begin triggerblock", Ok(RecordingFormat::Asc)),
            (";$", Ok(RecordingFormat::Trc)),
            (";####", Ok(RecordingFormat::Trc)),
            (python_can::HEADER, Ok(RecordingFormat::PythonCanCsv)),
            ("time stamp,id,", Err(FileFormat::SavvyCanCsv)),
            ("***busmaster", Err(FileFormat::Busmaster)),
            ("chn identifier", Err(FileFormat::Kvaser)),
            ("time,channel,id,dlc,flags", Err(FileFormat::Kvaser)),
            ("\"ascii trace ixxat", Err(FileFormat::Ixxat)),
            ("ascii trace ixxat", Err(FileFormat::Ixxat)),
            ("line,abs time(sec)", Err(FileFormat::VehicleSpy)),
            ("timestampepoch;", Err(FileFormat::CanEdge)),
            ("timestamp:", Err(FileFormat::PythonCanScreen)),
            ("time,elapsed_s,", Err(FileFormat::Measurements)),
            ("<", Err(FileFormat::Xml)),
        ];
        if let Some((_, format)) = heads.iter().find(|(head, _)| lower.starts_with(head)) {
            return Some(*format);
        }
        let is_direction = |word: &&str| ["rx", "tx"].contains(word);
        let is_number = |word: &str| !word.is_empty() && number(word).is_some();
        // Lines of files without a header.
        let format = match words[..] {
            [time, "canfd", ..] if text::seconds(time).is_some() => RecordingFormat::Asc,
            [time, channel, _, ref rest @ ..]
                if time.contains('.')
                    && text::seconds(time).is_some()
                    && is_number(channel)
                    && rest.first().is_some_and(is_direction) =>
            {
                RecordingFormat::Asc
            }
            [first, ..] if first.strip_suffix(')').is_some_and(is_number) => RecordingFormat::Trc,
            [row] if row.split(',').count() == 7 && row.contains(",0x") => RecordingFormat::PythonCanCsv,
            _ if candump::has_no_time(line) => RecordingFormat::Candump,
            _ => return None,
        };
        Some(Ok(format))
    }
}

impl FileFormat {
    /// The name, with its article.
    pub fn name(self) -> &'static str {
        match self {
            FileFormat::Gzip => "a gzip file in a gzip file",
            FileFormat::Xz => "an xz file",
            FileFormat::Bzip2 => "a bzip2 file",
            FileFormat::Zstd => "a zstd file",
            FileFormat::Zip => "a zip archive",
            FileFormat::Blf => "a Vector BLF file",
            FileFormat::Mdf => "an MDF file",
            FileFormat::Sqlite => "an SQLite database",
            FileFormat::Pcap => "a Wireshark capture",
            FileFormat::Utf16 => "text in UTF-16",
            FileFormat::SavvyCanCsv => "a CSV file of SavvyCAN",
            FileFormat::Busmaster => "a BUSMASTER log",
            FileFormat::Kvaser => "a text file of Kvaser",
            FileFormat::Ixxat => "a trace of the IXXAT analyser",
            FileFormat::VehicleSpy => "a CSV file of Vehicle Spy",
            FileFormat::CanEdge => "a CSV file of the CANedge",
            FileFormat::PythonCanScreen => "the screen output of python-can",
            FileFormat::Measurements => "a CSV file of measurements",
            FileFormat::Xml => "an XML file",
        }
    }

    /// The format of a binary file by its first bytes; `None` for other formats.
    pub(super) fn of(start: &[u8]) -> Option<FileFormat> {
        let magic: [(&[u8], FileFormat); 17] = [
            (crate::bus::file::GZIP, FileFormat::Gzip),
            (b"\xfd7zXZ", FileFormat::Xz),
            (b"BZh", FileFormat::Bzip2),
            (b"\x28\xb5\x2f\xfd", FileFormat::Zstd),
            (b"PK\x03\x04", FileFormat::Zip),
            (b"LOGG", FileFormat::Blf),
            (b"MDF ", FileFormat::Mdf),
            (b"UnFinMF ", FileFormat::Mdf),
            (b"SQLite format 3\0", FileFormat::Sqlite),
            (b"\x0a\x0d\x0d\x0a", FileFormat::Pcap),
            (b"\xa1\xb2\xc3\xd4", FileFormat::Pcap),
            (b"\xd4\xc3\xb2\xa1", FileFormat::Pcap),
            (b"\xa1\xb2\x3c\x4d", FileFormat::Pcap),
            (b"\x4d\x3c\xb2\xa1", FileFormat::Pcap),
            (b"\xff\xfe", FileFormat::Utf16),
            (b"\xfe\xff", FileFormat::Utf16),
            (b"(\0", FileFormat::Utf16),
        ];
        magic.iter().find(|(magic, _)| start.starts_with(magic)).map(|(_, format)| *format)
    }
}
