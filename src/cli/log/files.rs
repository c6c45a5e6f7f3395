//! The output files of `cangauge log`, and their format.

use super::super::args::{BusSpec, Tag, tag_pairs};
use super::super::exit::{FileError, open_stdout};
use super::super::file::{Existing, OutFile, ReportFile, lock_output};
use super::run_file::{RunFile, new_run, run_file_name};
use cangauge::bus::Wall;
use cangauge::output::events::Events;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::rows::{
    Dialect, ExistingLines, FileFormat, HeaderMismatch, Layout, LineWriter, OutputTarget, QUEUE_CAPACITY, Rotation,
    Rows, Series, Setup, TimeForm, existing_lines,
};
use cangauge::publish::series;
use cangauge::tasks::Failure;
use cangauge::tasks::log::LogFailure;
use clap::{Args, ValueEnum};
use std::fs::{File, OpenOptions};
use std::io;
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// The output options.
#[derive(Debug, Args)]
#[command(next_help_heading = "Output options")]
pub(super) struct Files {
    /// Write to a file instead of stdout
    #[arg(short, long, value_name = "FILE")]
    pub(super) output: Option<PathBuf>,
    /// Overwrite existing files
    #[arg(long, conflicts_with = "append")]
    force: bool,
    /// Append to existing files with the same columns. An incomplete last line is removed
    #[arg(long, requires = "output")]
    append: bool,
    /// One row per value, or one per cycle of --sync or --poll
    #[arg(long, value_name = "LAYOUT", default_value = "long")]
    layout: LayoutArg,
    /// Start a new file after this time or at this size: 10m, 1h, 100MB, 1GiB. The files for run.csv are
    /// run-0001.csv and so on
    #[arg(long, value_name = "DUR|SIZE", requires = "output")]
    rotate: Option<RotationArg>,
    /// Write events as CSV: emergencies, gaps, node losses, reboots
    #[arg(long, value_name = "FILE")]
    events: Option<PathBuf>,
    /// Write the summary as JSON to a file; - for stdout. Without --append, an existing file is replaced
    #[arg(long, value_name = "FILE")]
    pub(super) summary: Option<PathBuf>,
    /// Add a constant column at the end of each row: bench=3, part=P107. Can be repeated
    #[arg(long, value_name = "K=V")]
    tag: Vec<Tag>,
    /// Delimiter of CSV: , ; | or tab [default: ,]
    #[arg(long, value_name = "CHAR")]
    delimiter: Option<Delimiter>,
    /// Decimal sign of CSV: . or , [default: .]
    #[arg(long, value_name = "CHAR")]
    decimal: Option<Decimal>,
    /// Start the CSV with a byte order mark: some spreadsheets need it
    #[arg(long)]
    bom: bool,
    /// Format of times: text (RFC 3339), seconds since 1970, or days as in spreadsheets; all UTC
    #[arg(long, value_name = "FORM", default_value = "rfc3339")]
    time: TimeArg,
}

// The variants have no doc comments, because clap would print each one on its own line.

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum LayoutArg {
    Long,
    Wide,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum TimeArg {
    Rfc3339,
    Unix,
    Excel,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Delimiter(u8);

impl FromStr for Delimiter {
    type Err = String;

    fn from_str(text: &str) -> Result<Delimiter, String> {
        match text {
            "," | ";" | "|" | "\t" => Ok(Delimiter(text.as_bytes()[0])),
            "tab" | "\\t" => Ok(Delimiter(b'\t')),
            _ => Err(format!("\"{text}\" is not a delimiter (, ; | or tab)")),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Decimal(u8);

impl FromStr for Decimal {
    type Err = String;

    fn from_str(text: &str) -> Result<Decimal, String> {
        match text {
            "." | "," => Ok(Decimal(text.as_bytes()[0])),
            _ => Err(format!("\"{text}\" is not a decimal sign (. or ,)")),
        }
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct RotationArg(Rotation);

/// The shortest time of `--rotate`.
const MIN_FILE_TIME: Duration = Duration::from_secs(1);

/// The smallest size of `--rotate`, in bytes.
const MIN_FILE_SIZE: u64 = 1000;

impl FromStr for RotationArg {
    type Err = String;

    fn from_str(text: &str) -> Result<RotationArg, String> {
        let wrong = || format!("\"{text}\" is neither a time nor a size (10m, 1h30m, 100MB, 1GiB)");
        if let Some(size) = text.strip_suffix('B') {
            let digits = size.bytes().take_while(u8::is_ascii_digit).count();
            let (number, prefix) = size.split_at(digits);
            let factors = [("", 1), ("k", 1000), ("M", 1_000_000), ("G", 1_000_000_000), ("T", 1_000_000_000_000)];
            let binary = [("Ki", 1 << 10), ("Mi", 1 << 20), ("Gi", 1 << 30), ("Ti", 1 << 40)];
            let mut factors = factors.into_iter().chain(binary);
            let factor: u64 = factors.find(|(name, _)| *name == prefix).map(|(_, factor)| factor).ok_or_else(wrong)?;
            let size = number.parse::<u64>().ok().and_then(|number| number.checked_mul(factor)).ok_or_else(wrong)?;
            return match size {
                MIN_FILE_SIZE.. => Ok(RotationArg(Rotation::Size(size))),
                _ => Err(format!("\"{text}\" is too small for a file (1kB or more)")),
            };
        }
        match humantime::parse_duration(text) {
            // 10M could be months or megabytes.
            Ok(_) if text.contains('M') => Err(wrong()),
            Ok(length) if length >= MIN_FILE_TIME => Ok(RotationArg(Rotation::Every(length))),
            Ok(_) => Err(format!("\"{text}\" is too short for a file (1s or more)")),
            Err(_) => Err(wrong()),
        }
    }
}

/// The open files.
pub(super) struct OpenFiles {
    pub(super) rows: Option<OutFile>,
    pub(super) events: Option<OutFile>,
    pub(super) summary: Option<ReportFile>,
    series: Option<Series>,
    /// The file of the run, if the rows go to a regular file.
    run: Option<ReportFile>,
    /// The name given by `--output`, if files are rotated. `None` with `--force`: existing files may be of older runs.
    rotated: Option<PathBuf>,
    setup: Setup,
    /// The number of bytes of the existing file that are kept.
    keep: u64,
    /// The existing lines of the events file.
    existing_events: Option<ExistingLines>,
    /// The time that opening waited for readers of FIFOs.
    pub(super) waited: Duration,
}

impl Files {
    /// Whether the layout is wide.
    pub(super) fn is_wide(&self) -> bool {
        self.layout == LayoutArg::Wide
    }

    /// Rejects contradictory options before anything is opened.
    pub(super) fn check(&self, format: FileFormat, has_cycles: bool) -> Result<(), ErrorMessage> {
        let refuse = |message: &str, hint: &str| Err(ErrorMessage::usage(message).hint(hint));
        if self.is_wide() && !has_cycles {
            return refuse(
                "--layout wide needs --sync, --poll or --request: each row is one of their cycles",
                "add --sync 100ms or --poll 100ms, or omit --layout wide",
            );
        }
        let has_csv_options = self.delimiter.is_some() || self.decimal.is_some() || self.bom;
        if !format.is_csv() && has_csv_options {
            let hint = format!("omit --format {} or these options", format.name());
            return refuse("--delimiter, --decimal and --bom are for CSV", &hint);
        }
        if !format.has_time_forms() && self.time != TimeArg::Rfc3339 {
            return refuse("line protocol has times in nanoseconds", "omit --time");
        }
        tag_pairs(&self.tag).map_err(ErrorMessage::usage)?;
        let Dialect { delimiter, decimal, .. } = self.dialect();
        if delimiter == decimal {
            return refuse("the decimal sign and the delimiter must differ", "add --delimiter ';'");
        }
        let files = [&self.output, &self.events, &self.summary].into_iter().flatten();
        let files: Vec<&PathBuf> = files.filter(|path| path.as_path() != Path::new("-")).collect();
        for (at, path) in files.iter().enumerate() {
            // Two paths of the same file are detected later, by the lock of the file.
            if files[..at].contains(path) {
                return refuse(
                    &format!("{} is used for two outputs", path.display()),
                    "each output needs a file of its own",
                );
            }
        }
        Ok(())
    }

    fn dialect(&self) -> Dialect {
        let delimiter = self.delimiter.map_or(b',', |delimiter| delimiter.0);
        Dialect { delimiter, decimal: self.decimal.map_or(b'.', |decimal| decimal.0), bom: self.bom }
    }

    fn time(&self) -> TimeForm {
        match self.time {
            TimeArg::Rfc3339 => TimeForm::Rfc3339,
            TimeArg::Unix => TimeForm::Unix,
            TimeArg::Excel => TimeForm::Excel,
        }
    }

    fn existing(&self) -> Existing {
        match (self.force, self.append) {
            (true, _) => Existing::Overwrite,
            (_, true) => Existing::Continue,
            _ => Existing::Refuse,
        }
    }

    /// Opens all files, before the bus is opened. Waits for readers of FIFOs, at most for `limit`.
    pub(super) fn open(
        &self,
        format: FileFormat,
        count: Option<u64>,
        limit: Option<Duration>,
    ) -> anyhow::Result<OpenFiles> {
        let setup = Setup {
            format,
            tags: tag_pairs(&self.tag).unwrap_or_default(),
            layout: if self.is_wide() { Layout::Wide } else { Layout::Long },
            dialect: self.dialect(),
            time: self.time(),
            rotation: self.rotate.map(|rotation| rotation.0),
            max_rows: count.filter(|_| self.is_wide()),
            ..Setup::default()
        };
        let mut opened = OpenFiles {
            rows: None,
            events: None,
            summary: None,
            series: None,
            run: None,
            rotated: self.output.clone().filter(|_| self.rotate.is_some() && !self.force),
            setup,
            keep: 0,
            existing_events: None,
            waited: Duration::ZERO,
        };
        match &self.output {
            Some(base) if self.rotate.is_some() => self.open_first(base, &mut opened)?,
            Some(path) => {
                let mut file = OutFile::open(path, self.existing(), limit)?;
                opened.waited = file.waited;
                if let Some(kept) = file.existing_lines()? {
                    opened.keep = kept.length;
                    opened.setup.continues = true;
                    opened.setup.existing_header = Some(kept.header);
                }
                if file.is_regular() {
                    opened.series = Some(Series::new(path, 2, self.force));
                    opened.setup.has_series = true;
                }
                opened.rows = Some(file);
            }
            None => {}
        }
        if let (false, Some(file)) = (self.is_wide(), &opened.rows) {
            opened.setup.check_long().map_err(|mismatch| header_mismatch(file.path(), mismatch))?;
        }
        self.open_run(&mut opened)?;
        self.open_events(&mut opened, limit)?;
        let summary = self.summary.as_ref().filter(|path| path.as_path() != Path::new("-"));
        if let Some(path) = summary {
            let remaining = limit.map(|limit| limit.saturating_sub(opened.waited));
            let file = ReportFile::create(path, self.append, remaining)?;
            opened.waited += file.waited;
            opened.summary = Some(file);
        }
        Ok(opened)
    }

    /// Opens the file of the run, if the rows go to a regular file.
    fn open_run(&self, opened: &mut OpenFiles) -> anyhow::Result<()> {
        if let (Some(name), true) = (&self.output, opened.rows.as_ref().is_some_and(OutFile::is_regular)) {
            opened.run = Some(ReportFile::create(&run_file_name(name), self.append, None)?);
        }
        Ok(())
    }

    /// Opens the events file. `limit` is the longest wait for the readers of all FIFOs together.
    fn open_events(&self, opened: &mut OpenFiles, limit: Option<Duration>) -> anyhow::Result<()> {
        let Some(path) = &self.events else { return Ok(()) };
        let remaining = limit.map(|limit| limit.saturating_sub(opened.waited));
        let mut file = OutFile::open(path, self.existing(), remaining)?;
        opened.waited += file.waited;
        opened.existing_events = file.existing_lines()?;
        let expected = Events::header(self.dialect());
        if let Some(kept) = opened.existing_events.as_ref().filter(|kept| kept.header != expected) {
            return Err(header_mismatch(path, HeaderMismatch { found: kept.header.clone(), expected }).into());
        }
        opened.events = Some(file);
        Ok(())
    }

    /// Opens the first file of a rotated recording.
    fn open_first(&self, base: &Path, opened: &mut OpenFiles) -> anyhow::Result<()> {
        let numbers = series::existing(base)
            .map_err(|source| FileError { what: format!("create {}", series::name(base, 1).display()), source })?;
        let mut first = 1;
        let mut last_file = None;
        if let (Some(last), Existing::Overwrite) = (numbers.last(), self.existing()) {
            let path = series::name(base, *last);
            File::open(&path).map_or(Ok(()), |file| lock_output(&file, &path))?;
        }
        match (numbers.last(), self.existing()) {
            (Some(_), Existing::Refuse) => {
                let name = series::name(base, *numbers.first().unwrap_or(&1));
                let failure = ErrorMessage::usage(format!("{} exists", name.display()));
                return Err(failure
                    .hint("overwrite with --force, continue with --append, or choose another file")
                    .into());
            }
            (Some(last), Existing::Continue) => {
                let path = series::name(base, *last);
                let read = |path: &Path| -> io::Result<_> {
                    let mut file = OpenOptions::new().read(true).append(true).open(path)?;
                    let kept = existing_lines(&mut file)?;
                    Ok((file, kept))
                };
                let (file, kept) =
                    read(&path).map_err(|source| FileError { what: format!("read {}", path.display()), source })?;
                lock_output(&file, &path)?;
                first = last.saturating_add(1);
                opened.setup.existing_header = kept.as_ref().map(|kept| kept.header.clone());
                last_file = Some((file, kept.map_or(0, |kept| kept.length)));
            }
            _ => {}
        }
        let existing = if self.force { Existing::Overwrite } else { Existing::Refuse };
        opened.rows = Some(OutFile::open(&series::name(base, first), existing, None)?);
        opened.setup.has_series = true;
        let series = Series::new(base, first.saturating_add(1), self.force);
        opened.series = Some(match last_file {
            Some((file, length)) => series.with_last(file, length),
            None => series,
        });
        Ok(())
    }
}

impl OpenFiles {
    /// Starts a run on this bus. Returns the file of the run, if the rows go to a regular file.
    pub(super) fn start_run(&mut self, bus: &BusSpec, start: Wall) -> Option<RunFile> {
        let mut run = new_run(bus, &self.setup.tags, start);
        let origin = [("bench", &run.bench), ("run", &run.run)].map(|(key, value)| (key.to_owned(), value.clone()));
        let is_new = |(key, _): &(String, String)| self.setup.tags.iter().all(|(known, _)| known != key);
        self.setup.origin = origin.into_iter().filter(is_new).collect();
        let (file, rows) = (self.run.take()?, self.rows.as_ref()?);
        run.file = rows.path().file_name().unwrap_or_default().to_string_lossy().into_owned();
        run.offset = self.keep;
        Some(RunFile::new(file, run))
    }

    /// Returns the writer of the rows. A thread writes, unless the bus waits for the program (`waits`).
    pub(super) fn rows(&mut self, waits: bool) -> anyhow::Result<Rows> {
        let target = match &self.rows {
            Some(file) => file.target(self.keep)?,
            None => OutputTarget::Stream(Box::new(open_stdout()?)),
        };
        Ok(Rows::new(line_writer(target, self.series.take(), waits)?, self.setup.clone()))
    }

    /// Returns the writer of the events, if requested.
    pub(super) fn events(&self, waits: bool) -> anyhow::Result<Option<Events>> {
        let Some(file) = &self.events else { return Ok(None) };
        let (dialect, kept) = (self.setup.dialect, self.existing_events.as_ref());
        let target = file.target(kept.map_or(0, |kept| kept.length))?;
        let writer = line_writer(target, None, waits)?;
        Ok(Some(Events::new(writer, dialect, self.setup.time, kept.is_some())))
    }

    /// Returns the names of the files with rows, as text. `None` for stdout.
    pub(super) fn written(&self) -> Option<String> {
        let first = self.rows.as_ref()?.path().display();
        let base = self.rotated.as_ref().map(|base| series::existing(base).unwrap_or_default());
        let last = base.and_then(|numbers| numbers.last().copied()).zip(self.rotated.as_ref());
        let last = last.map(|(number, base)| series::name(base, number).display().to_string());
        Some(match last.filter(|last| *last != first.to_string()) {
            Some(last) => format!("{first} and the following files up to {last}"),
            None => first.to_string(),
        })
    }

    /// Returns the name of the file with rows, or "stdout".
    pub(super) fn rows_name(&self) -> String {
        self.rows.as_ref().map_or_else(|| "stdout".to_owned(), |file| file.path().display().to_string())
    }
}

fn line_writer(target: OutputTarget, series: Option<Series>, waits: bool) -> anyhow::Result<LineWriter> {
    if waits {
        return Ok(LineWriter::direct(target, series));
    }
    let writer = LineWriter::queued(target, series, QUEUE_CAPACITY);
    Ok(writer.map_err(|source| FileError { what: "start a thread".to_owned(), source })?)
}

fn header_mismatch(path: &Path, mismatch: HeaderMismatch) -> Failure {
    let HeaderMismatch { found, expected } = mismatch;
    Failure::general(LogFailure::OtherColumns { file: path.display().to_string(), found, expected })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rotations() {
        let rotation = |text: &str| text.parse::<RotationArg>().map(|rotation| rotation.0);
        assert_eq!(rotation("10m"), Ok(Rotation::Every(Duration::from_secs(600))));
        assert_eq!(rotation("1h30m"), Ok(Rotation::Every(Duration::from_secs(5400))));
        assert_eq!(rotation("100MB"), Ok(Rotation::Size(100_000_000)));
        assert_eq!(rotation("1GiB"), Ok(Rotation::Size(1 << 30)));
        assert_eq!(rotation("1500B"), Ok(Rotation::Size(1500)));
        for wrong in ["", "B", "10", "10M", "MB", "1.5MB", "-1MB", "10mB", "10 MB", "99999999999TB", "10KB", "1é0MB"] {
            let neither = format!("\"{wrong}\" is neither a time nor a size (10m, 1h30m, 100MB, 1GiB)");
            assert_eq!(rotation(wrong), Err(neither), "{wrong}");
        }
        assert_eq!(rotation("10ms"), Err("\"10ms\" is too short for a file (1s or more)".to_owned()));
        assert_eq!(rotation("999B"), Err("\"999B\" is too small for a file (1kB or more)".to_owned()));
    }

    #[test]
    fn delimiters_and_decimal_signs() {
        assert_eq!(("tab".parse(), "\\t".parse()), (Ok(Delimiter(b'\t')), Ok(Delimiter(b'\t'))));
        assert_eq!((";".parse(), ",".parse()), (Ok(Delimiter(b';')), Ok(Decimal(b','))));
        for wrong in ["", ".", "a", ";;", ":", "é"] {
            assert!(wrong.parse::<Delimiter>().is_err(), "{wrong}");
        }
        assert!(";".parse::<Decimal>().is_err());
    }
}
