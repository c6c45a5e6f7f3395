//! PEAK TRC, versions 1.0 to 2.1: `     1)         1.2  Rx         0185  4  D2 04 00 00`.
//!
//! The columns are named by letters, as in the header of version 2: N number, O time after the start in milliseconds,
//! B bus, T type, I identifier, d direction, R reserved, l or L length, D data.

use super::date::date;
use super::text::{
    FrameOrFault, TimeZone, data_frame, decimal, digits, identifier, milliseconds, number, remote_frame,
};
use super::{Line, Parser};
use crate::bus::{Fault, Wall};
use std::time::Duration;

const DAY: Duration = Duration::from_secs(24 * 3600);

/// 1970-01-01 in days since 1899-12-30, the first day of PEAK.
const FIRST_DAY: Duration = Duration::from_secs(25_569 * 24 * 3600);

/// The identifier of a line that contains a bus state.
const BUS_STATE: &str = "FFFFFFFF";

pub(super) struct Trc {
    zone: TimeZone,
    columns: String,
    /// The start of the recording, in the local time of the recording computer or in UTC (`is_utc`).
    clock: Option<Duration>,
    /// Whether `clock` is UTC.
    is_utc: bool,
    start: Option<Duration>,
}

impl Trc {
    pub(super) fn new(zone: TimeZone) -> Trc {
        Trc { zone, columns: columns("1.0").to_owned(), clock: None, is_utc: false, start: None }
    }

    /// Reads a line of the header.
    fn header(&mut self, text: &str) {
        if let Some(version) = text.strip_prefix("$FILEVERSION=") {
            columns(version.trim()).clone_into(&mut self.columns);
        } else if let Some(names) = text.strip_prefix("$COLUMNS=") {
            self.columns = names.chars().filter(char::is_ascii_alphabetic).collect();
        } else if let Some(days) = text.strip_prefix("$STARTTIME=") {
            self.clock = decimal(days.trim(), DAY).and_then(|time| time.checked_sub(FIRST_DAY));
        } else if let Some(time) = text.trim_start().strip_prefix("Start time:") {
            self.start = date(time, self.zone);
        } else if text.contains("python-can") {
            // python-can writes UTC; PEAK writes the local time.
            self.is_utc = true;
        }
    }

    /// When the recording started, since 1970; zero if unknown.
    fn start(&mut self) -> Duration {
        let Some(clock) = self.clock.take() else { return *self.start.get_or_insert_default() };
        // Ten decimal digits of a day have a resolution of 9 us. More digits are rounded to 1 us.
        let micros = (clock + Duration::from_nanos(500)).as_micros();
        let clock = Duration::from_micros(u64::try_from(micros).unwrap_or(u64::MAX));
        let (days, second) = (clock.as_secs() / DAY.as_secs(), clock.as_secs() % DAY.as_secs());
        let fields = [1, second].map(|it| i32::try_from(it).unwrap_or_default());
        let day = i32::try_from(days).ok().and_then(|days| days.checked_add(fields[0]));
        let local = day.and_then(|day| (self.zone)([1970, 1, day, 0, 0, fields[1]]));
        let seconds = if self.is_utc { Some(clock.as_secs()) } else { local };
        let start = seconds.map(|seconds| Duration::new(seconds, clock.subsec_nanos())).unwrap_or_default();
        *self.start.insert(start)
    }

    /// A frame or a state from the words of a line; `Some(None)` for another event.
    fn event(&self, words: &[&str]) -> Option<Option<FrameOrFault>> {
        let column = |name| self.columns.find(name);
        let word = |name| column(name).and_then(|at| words.get(at).copied());
        let kind = if column('T').is_some() { word('T')? } else { "Rx" };
        match kind.to_ascii_lowercase().as_str() {
            "rx" | "tx" | "dt" | "rr" => {}
            "error" | "er" => return Some(Some(Err(Fault::Protocol))),
            "warng" | "st" => return Some(state(words.get(column('I')?..)?).map(Err)),
            _ => return Some(None),
        }
        let (id, length) = (word('I')?, word('l').or_else(|| word('L'))?);
        let data = words.get(column('D')?..).unwrap_or_default();
        if id == BUS_STATE {
            return Some(state(data).map(Err));
        }
        if data.first() == Some(&"ERROR") {
            return Some(Some(Err(Fault::Protocol)));
        }
        // Four digits are an identifier of 11 bits.
        let id = identifier(id, 16, id.len() > 4)?;
        if kind == "RR" || data.first() == Some(&"RTR") {
            return Some(Some(Ok(remote_frame(id, length)?)));
        }
        let length = usize::try_from(number(length)?).ok()?;
        Some(Some(Ok(data_frame(id, length, data, 16)?)))
    }
}

/// The columns of a version. Later versions have a line with the columns.
fn columns(version: &str) -> &'static str {
    match version {
        "1.1" => "NOTIlD",
        "1.2" => "NOBTIlD",
        "1.3" => "NOBTIRlD",
        "2.0" => "NOTIdlD",
        "2.1" => "NOTBIdRlD",
        _ => "NOIlD",
    }
}

/// The state of a controller from the bytes of its code; `None` if there is no code.
fn state(words: &[&str]) -> Option<Fault> {
    let bytes: Vec<u32> = words.iter().filter(|word| word.len() == 2).filter_map(|word| digits(word, 16)).collect();
    let [a, b, c, d] = bytes[..] else { return None };
    let code = a << 24 | b << 16 | c << 8 | d;
    let named = [
        (0x10, Fault::BusOff),
        (0x4_0000, Fault::ErrorPassive),
        (0x0c, Fault::ErrorWarning),
        (0x02, Fault::ControllerOverflow),
    ];
    let fault = named.iter().find(|(bit, _)| code & bit != 0).map(|(_, fault)| *fault);
    Some(fault.unwrap_or(if code == 0 { Fault::ErrorActive } else { Fault::Other }))
}

impl Parser for Trc {
    fn line<'a>(&mut self, text: &'a str) -> Line<'a> {
        if let Some(text) = text.strip_prefix(';') {
            self.header(text);
            return Line::Ignored;
        }
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let time = self.columns.find('O').and_then(|at| words.get(at)).and_then(|word| milliseconds(word));
        let Some(wall) = time.and_then(|time| self.start().checked_add(time)).map(Wall::at) else {
            return Line::Unknown;
        };
        let channel = self.columns.find('B').and_then(|at| words.get(at)).copied().unwrap_or_default();
        Line::at(wall, channel, self.event(&words))
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::lines;
    use super::super::text::test_zone;
    use super::*;

    fn read(text: &str) -> Vec<String> {
        lines(&mut Trc::new(test_zone), text)
    }

    #[test]
    fn version_1() {
        let frames = ["1501  185#D20400FF", "1502  705#R1", "1503  01890ABC#", "1504  Protocol", "1505  ErrorWarning"];
        let old = ";####\n;   Start time: 1.1.2000 00:00:01.500\n;   PCAN-Net: PCI1\n\
                   1)  1  0185  4  D2 04 00 FF\n 2)  2  0705  1  RTR\n 3)  3  01890ABC  0\n 4)  4  0008  4  ERROR 00 19 08 08\n \
                   5)  5  FFFFFFFF  4  00 00 00 04  BUSLIGHT\n";
        assert_eq!(read(old), frames);
        // Noon of the first day in the test time zone.
        let trc = |version: &str, lines: &str| read(&format!(";$FILEVERSION={version}\n;$STARTTIME=36729.5\n{lines}"));
        let lines = "1) 1.2 Rx 0185 2 D2 04\n2) 2.3 Error 0008 4 00 19 08 08\n3) 3.4 Warng FFFFFFFF 4 00 00 00 10 BUSOFF\n\
                     4) 4.5 Tx 0705 1 RTR\n";
        let frames = ["43200001  185#D204", "43200002  Protocol", "43200003  BusOff", "43200004  705#R1"];
        assert_eq!(trc("1.1", lines), frames);
        assert_eq!(trc("1.2", "1) 1059.900 2 Rx 0185 2 D2 04\n"), ["43201059 2 185#D204"]);
        assert_eq!(trc("1.3", "1) 1059.900 1 Rx 0185 - 2 D2 04\n"), ["43201059 1 185#D204"]);
    }

    #[test]
    fn version_2() {
        let head =
            ";$FILEVERSION=2.0\n;$STARTTIME=45244.92592592593\n;$COLUMNS=N,O,T,I,d,l,D\n;   Generated by python-can\n";
        let text = "1 1.250 DT 0185 Rx 2 D2 04\n2 2.0 RR 0705 Rx 1\n3 3.0 FB 0400 Tx 12 00\n4 4.0 ST Rx 00 00 00 08\n\
                    5 5.0 ER Rx 04 00 02 00 00\n6 6.0 EC Rx 02 02\n7 7.0 EV words of the user\n";
        let start = 1_700_000_000_000_u64;
        let expected = ["1  185#D204", "2  705#R1", "4  ErrorWarning", "5  Protocol"];
        let expected: Vec<String> = expected
            .iter()
            .map(|it| {
                let (ms, rest) = it.split_at(1);
                format!("{}{rest}", start + ms.parse::<u64>().unwrap_or_default())
            })
            .collect();
        assert_eq!(read(&format!("{head}{text}")), expected);
        let head = ";$FILEVERSION=2.1\n;$COLUMNS=N,O,T,B,I,d,R,L,D\n";
        let text = "1 1.0 DT 1 0185 Rx - 2 D2 04\n2 2.0 DT 2 01890ABC Tx - 0\n3 3.0 ST 1 - Rx - 4 00 04 00 00\n4 4.0 RR 1 0705 Rx - 1\n";
        assert_eq!(read(&format!("{head}{text}")), ["1 1 185#D204", "2 2 01890ABC#", "3 1 ErrorPassive", "4 1 705#R1"]);
    }

    #[test]
    fn broken_lines_are_unknown() {
        for text in [
            "1)",
            "1) 1",
            "1) 1 0185",
            "1) 1 0185 2",
            "1) 1 0185 2 D2",
            "1) 1 0999 0",
            "1) 1 0185 9 1 2 3 4 5 6 7 8 9",
            "nonsense",
            "1) -1 0185 0",
        ] {
            assert_eq!(read(text), ["Unknown"], "{text}");
        }
    }
}
