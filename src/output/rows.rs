//! The rows of a log, as CSV or JSON Lines, written whole.

use super::elapsed::Elapsed;
use super::json;
use crate::bus::{Mono, Stamp};
use crate::measure::sample::{Number, Sample, Source};
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Write};
use std::time::Duration;

/// The header of layout `long`.
pub const HEADER: &str = "time,elapsed_s,node,signal,value,unit,status,raw";

/// The form of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// CSV, layout `long`.
    Csv,
    /// JSON Lines.
    Json,
}

/// Where rows go.
#[derive(Debug)]
pub enum Target {
    /// A regular file: what stood in it goes with the first row, and a row that could not be written whole is
    /// cut off again.
    File(File),
    /// stdout, a pipe, a device.
    Stream(Box<dyn WriteDebug>),
}

/// A stream.
pub trait WriteDebug: Write + std::fmt::Debug {}

impl<T: Write + std::fmt::Debug> WriteDebug for T {}

/// Rows wait here for at most this many bytes.
const BLOCK: usize = 32 * 1024;

/// Rows are handed to the kernel at the latest after this.
const LATEST: Duration = Duration::from_millis(500);

/// Writes the rows of a log.
#[derive(Debug)]
pub struct Rows {
    target: Target,
    form: Form,
    block: Vec<u8>,
    /// Rows in the block.
    waiting: u64,
    /// When the first of them was put there.
    since: Option<Mono>,
    elapsed: Option<Elapsed>,
    lost: u64,
    scratch: String,
    header: bool,
}

impl Rows {
    /// Rows of `form` to `target`. A CSV file begins with a header, which comes with the first row: where
    /// nothing was measured, nothing is written.
    pub fn new(target: Target, form: Form) -> Rows {
        Rows {
            target,
            form,
            block: Vec::with_capacity(BLOCK + 4096),
            waiting: 0,
            since: None,
            elapsed: None,
            lost: 0,
            scratch: String::new(),
            header: form == Form::Csv,
        }
    }

    /// Adds a row.
    pub fn add(&mut self, sample: &Sample, source: &Source) -> io::Result<()> {
        if self.elapsed.is_none()
            && let Target::File(file) = &self.target
            && file.metadata()?.is_file()
        {
            file.set_len(0)?;
        }
        let elapsed = self.elapsed.get_or_insert_default().take(sample.at);
        if std::mem::take(&mut self.header) {
            self.block.extend_from_slice(HEADER.as_bytes());
            self.block.push(b'\n');
        }
        match self.form {
            Form::Csv => self.csv(sample, source, elapsed)?,
            Form::Json => {
                let time = humantime::format_rfc3339_micros(sample.at.wall.system_time()).to_string();
                let elapsed_s = elapsed.as_secs_f64();
                json::row(&mut self.block, &time, elapsed_s, sample, source)?;
            }
        }
        self.waiting += 1;
        self.since.get_or_insert(sample.at.mono);
        if self.block.len() >= BLOCK { self.flush() } else { Ok(()) }
    }

    fn csv(&mut self, sample: &Sample, source: &Source, elapsed: Duration) -> io::Result<()> {
        let line = &mut self.scratch;
        line.clear();
        let time = humantime::format_rfc3339_micros(sample.at.wall.system_time());
        let written = write!(line, "{time},{}.{:06},{},", elapsed.as_secs(), elapsed.subsec_micros(), source.node)
            .and_then(|()| write_cell(line, &source.signal))
            .and_then(|()| write_value(line, sample.value))
            .and_then(|()| write_cell(line, &source.unit))
            .and_then(|()| write!(line, "{},{}", sample.status.map_or("", |status| status.as_str()), sample.raw));
        written.map_err(io::Error::other)?;
        line.push('\n');
        self.block.extend_from_slice(line.as_bytes());
        Ok(())
    }

    /// Hands over what has waited long enough.
    pub fn flush_if_due(&mut self, now: Stamp) -> io::Result<()> {
        if self.since.is_some_and(|since| now.mono.since(since) >= LATEST) { self.flush() } else { Ok(()) }
    }

    /// Hands everything over. On failure the target ends with a whole row, and the rest is counted as lost.
    pub fn flush(&mut self) -> io::Result<()> {
        let result = write_whole(&mut self.target, &self.block);
        if let Err((_, kept)) = &result {
            let lines = |bytes: &[u8]| bytes.iter().filter(|&&byte| byte == b'\n').count() as u64;
            // The header is no row.
            self.lost += lines(&self.block[*kept..]).min(self.waiting);
        }
        self.block.clear();
        self.waiting = 0;
        self.since = None;
        result.map_err(|(error, _)| error)
    }

    /// Rows that could not be written.
    pub fn lost(&self) -> u64 {
        self.lost
    }
}

/// Text that needs quotes gets them: a comma, a quote, or a line end inside.
fn write_cell(line: &mut String, text: &str) -> std::fmt::Result {
    if text.contains([',', '"', '\n', '\r']) {
        write!(line, "\"{}\",", text.replace('"', "\"\""))
    } else {
        line.push_str(text);
        line.push(',');
        Ok(())
    }
}

fn write_value(line: &mut String, value: Option<Number>) -> std::fmt::Result {
    match value {
        Some(number) => write!(line, "{number},"),
        None => {
            line.push(',');
            Ok(())
        }
    }
}

/// Writes all of `bytes`, or up to a line end. Returns how many bytes of whole lines were kept.
fn write_whole(target: &mut Target, bytes: &[u8]) -> Result<(), (io::Error, usize)> {
    let mut done = 0;
    while done < bytes.len() {
        let result = match target {
            Target::File(file) => file.write(&bytes[done..]),
            Target::Stream(stream) => stream.write(&bytes[done..]),
        };
        match result {
            Ok(0) => return Err((io::ErrorKind::WriteZero.into(), cut(target, bytes, done))),
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err((error, cut(target, bytes, done))),
        }
    }
    if let Target::Stream(stream) = target {
        stream.flush().map_err(|error| (error, bytes.len()))?;
    }
    Ok(())
}

/// Cuts a file back to the last whole line.
fn cut(target: &mut Target, bytes: &[u8], done: usize) -> usize {
    let whole = bytes[..done].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    if let Target::File(file) = target {
        let excess = (done - whole) as u64;
        if let Ok(metadata) = file.metadata()
            && metadata.is_file()
            && excess > 0
        {
            // What the disk refuses here it has refused before; the cause is reported by the caller.
            let _ = file.set_len(metadata.len().saturating_sub(excess));
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::Wall;
    use crate::canopen::id::NodeId;
    use crate::measure::sample::{Raw, Status};
    use std::sync::{Arc, Mutex};

    #[derive(Clone, Debug, Default)]
    struct Shared(Arc<Mutex<Vec<u8>>>);

    impl Write for Shared {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.0.lock().expect("not poisoned").extend_from_slice(bytes);
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn text(form: Form, samples: &[(Sample, Source)]) -> String {
        let shared = Shared::default();
        let mut rows = Rows::new(Target::Stream(Box::new(shared.clone())), form);
        for (sample, source) in samples {
            rows.add(sample, source).expect("memory");
        }
        rows.flush().expect("memory");
        String::from_utf8(shared.0.lock().expect("not poisoned").clone()).expect("text")
    }

    fn sample(at_us: u64, value: Option<Number>, status: Option<Status>, raw: &[u8]) -> Sample {
        let since = Duration::from_micros(at_us);
        let at = Stamp { mono: Mono::at(since), wall: Wall::at(Duration::from_secs(1_700_000_000) + since) };
        Sample { at, source: 0, value, status, raw: Raw::new(raw) }
    }

    fn source(signal: &str, unit: &str) -> Source {
        Source { node: NodeId::new(5).expect("a node-ID"), signal: signal.into(), unit: unit.into() }
    }

    #[test]
    fn csv_rows() {
        let rows = [
            (
                sample(1_000_000, Some(Number::Decimal { mantissa: 50_000, digits: 3 }), None, &[0x50, 0xc3, 0, 0]),
                source("pressure", "psi"),
            ),
            (
                sample(1_010_001, Some(Number::Real32(1.1)), Some(Status::Ok), &[0xcd, 0xcc, 0x8c, 0x3f]),
                source("pressure", "bar"),
            ),
            (sample(3_000_000, None, Some(Status::OverloadHigh), &[0, 0, 0xc0, 0x7f]), source("a,\"b", "")),
        ];
        assert_eq!(
            text(Form::Csv, &rows),
            "time,elapsed_s,node,signal,value,unit,status,raw\n\
             2023-11-14T22:13:21.000000Z,0.000000,5,pressure,50.000,psi,,0x50C30000\n\
             2023-11-14T22:13:21.010001Z,0.010001,5,pressure,1.1,bar,ok,0xCDCC8C3F\n\
             2023-11-14T22:13:23.000000Z,2.000000,5,\"a,\"\"b\",,,overload-high,0x0000C07F\n"
        );
    }

    #[test]
    fn json_rows() {
        let rows = [
            (
                sample(0, Some(Number::Decimal { mantissa: 17_898, digits: 3 }), None, &[0xea, 0x45, 0, 0]),
                source("pressure", "psi"),
            ),
            (sample(10_000, Some(Number::Real32(1.1)), Some(Status::Ok), &[1]), source("pressure", "bar")),
            (sample(20_000, None, Some(Status::Invalid), &[2]), source("ch1", "")),
        ];
        assert_eq!(
            text(Form::Json, &rows),
            "{\"time\":\"2023-11-14T22:13:20.000000Z\",\"elapsed_s\":0.0,\"node\":5,\"signal\":\"pressure\",\"value\":17.898,\"unit\":\"psi\",\"status\":null,\"raw\":\"0xEA450000\"}\n\
             {\"time\":\"2023-11-14T22:13:20.010000Z\",\"elapsed_s\":0.01,\"node\":5,\"signal\":\"pressure\",\"value\":1.1,\"unit\":\"bar\",\"status\":\"ok\",\"raw\":\"0x01\"}\n\
             {\"time\":\"2023-11-14T22:13:20.020000Z\",\"elapsed_s\":0.02,\"node\":5,\"signal\":\"ch1\",\"value\":null,\"unit\":null,\"status\":\"invalid\",\"raw\":\"0x02\"}\n"
        );
    }

    #[test]
    fn what_does_not_fit_is_counted_and_the_target_ends_with_a_whole_row() {
        #[derive(Debug)]
        struct Small(Shared, usize);
        impl Write for Small {
            fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
                let room = self.1.min(bytes.len());
                self.1 -= room;
                if room == 0 { Err(io::ErrorKind::StorageFull.into()) } else { self.0.write(&bytes[..room]) }
            }
            fn flush(&mut self) -> io::Result<()> {
                Ok(())
            }
        }
        let shared = Shared::default();
        let target = Target::Stream(Box::new(Small(shared.clone(), 49 + 75 + 10)));
        let mut rows = Rows::new(target, Form::Csv);
        let row = sample(0, Some(Number::Real32(1.1)), Some(Status::Ok), &[0xcd, 0xcc, 0x8c, 0x3f]);
        for _ in 0..3 {
            rows.add(&row, &source("pressure", "bar")).expect("not written yet");
        }
        assert_eq!(rows.flush().map_err(|error| error.kind()), Err(io::ErrorKind::StorageFull));
        assert_eq!(rows.lost(), 2);
    }
}
