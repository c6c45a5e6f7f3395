//! `cangauge plot`.

use super::args::Duration;
use super::exit::{FileError, open_stdout, stdout};
use super::file::ReportFile;
use super::{ErrorMessage, Global};
use cangauge::bus::claim::Claim;
use cangauge::bus::file::open_text;
use cangauge::bus::time::ahead_of_utc;
use cangauge::device::nearest::distance;
use cangauge::output::plot::{self, TimeAxis};
use cangauge::output::recording::{Recording, RecordingError, TimeBase};
use cangauge::output::stdout_width;
use cangauge::publish::series;
use cangauge::tasks::Kind;
use clap::Args;
use std::path::{Path, PathBuf};
use std::str::FromStr;

/// Plot recordings of log, in the terminal or as SVG or PNG
///
/// Signals with the same unit share one panel. If an interval is longer than three usual intervals, the line is
/// interrupted. Overload, invalid and clipped values are marked.
#[derive(Debug, Args)]
#[command(after_help = "\
Time zone:
Times are in the time zone of this computer. For another time zone, type:
  TZ=UTC cangauge plot run.csv

Examples:
  cangauge plot run.csv
  cangauge plot run.csv -o run.svg
  cangauge plot run.csv --events events.csv --signal pressure --from 14:30 --to 14:45
  cangauge plot run-*.csv --elapsed --to 10m -o run.png
  cangauge log 1 --duration 10s | cangauge plot -")]
pub(crate) struct Plot {
    /// Files of log: CSV or JSON Lines, also compressed with gzip; - for stdin. If run.csv does not exist,
    /// run-0001.csv, run-0002.csv and so on are read
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Write the plot to a file: .svg or .png. An existing file is replaced
    #[arg(short, long, value_name = "FILE", value_parser = picture)]
    output: Option<PathBuf>,
    /// Plot only this signal: pressure, or 5.pressure for one node [default: all]
    #[arg(short, long, value_name = "SIGNAL", value_delimiter = ',')]
    signal: Vec<String>,
    /// Show the events in this file (log --events)
    #[arg(long, value_name = "FILE")]
    events: Vec<PathBuf>,
    /// Start here: 14:30, 2026-11-29T14:30:00Z, or a time since the first value: 10m
    #[arg(long, value_name = "TIME")]
    from: Option<Moment>,
    /// End here
    #[arg(long, value_name = "TIME")]
    to: Option<Moment>,
    /// Show the time since the start of the run, to compare several runs
    #[arg(long)]
    elapsed: bool,
}

/// Parses the file name of a plot.
fn picture(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match extension(&path).as_deref() {
        Some("svg" | "png") => Ok(path),
        _ => Err(format!("\"{text}\": a plot is an SVG or PNG file: its name ends in .svg or .png")),
    }
}

fn extension(path: &Path) -> Option<String> {
    Some(path.extension()?.to_str()?.to_lowercase())
}

/// A time of day, a time since the first value, or a date with a time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Moment {
    /// Microseconds of a day.
    OfDay(i64),
    /// Microseconds since the first value.
    Since(i64),
    /// Microseconds since 1970 in UTC.
    Utc(i64),
    /// Microseconds since 1970 in local time.
    Local(i64),
}

impl FromStr for Moment {
    type Err = String;

    fn from_str(text: &str) -> Result<Moment, String> {
        let wrong = || format!("\"{text}\" is not a time (14:30, 14:30:05.5, 2026-11-29T14:30:00Z, 10m)");
        let instant = |text: &str| {
            let time = humantime::parse_rfc3339_weak(text).ok()?;
            i64::try_from(time.duration_since(std::time::UNIX_EPOCH).ok()?.as_micros()).ok()
        };
        if let Some(at) = instant(text) {
            return Ok(if text.ends_with('Z') { Moment::Utc(at) } else { Moment::Local(at) });
        }
        if text.contains(':') {
            let seconds = if text.matches(':').count() == 1 { ":00" } else { "" };
            return instant(&format!("1970-01-01T{text}{seconds}")).map(Moment::OfDay).ok_or_else(wrong);
        }
        let since = text.parse::<Duration>().map_err(|_| wrong())?;
        i64::try_from(since.0.as_micros()).map(Moment::Since).map_err(|_| wrong())
    }
}

impl Moment {
    /// Converts to microseconds on the axis of a recording that starts at `first`. `None` if it has no clock times.
    fn resolve(self, first: i64, axis: TimeAxis) -> Option<i64> {
        const DAY: i64 = 86_400_000_000;
        match (self, axis) {
            (Moment::Since(since), _) => Some(first.saturating_add(since)),
            (_, TimeAxis::Elapsed) => None,
            (Moment::Utc(at), _) => Some(at),
            (Moment::Local(at), TimeAxis::Clock(zone)) => Some(at - zone(at - zone(at))),
            (Moment::OfDay(of_day), TimeAxis::Clock(zone)) => {
                let start = first + zone(first);
                let at = start.div_euclid(DAY) * DAY + of_day - zone(first);
                // The minute of the first value is on the first day. An earlier time of day is on the next day.
                Some(if at + 60_000_000 > first { at } else { at + DAY })
            }
        }
    }
}

impl Plot {
    /// No node is used.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        if !global.prints_text() {
            return Err(ErrorMessage::usage("a plot is a picture: omit --format").into());
        }
        let base = if self.elapsed { TimeBase::Elapsed } else { TimeBase::Clock };
        let mut recording = Recording::new(base);
        for file in self.files.iter().chain(&self.events) {
            for path in parts(file)? {
                read(&path, &mut recording, global)?;
            }
        }
        recording.finish();
        let names: Vec<String> = self.files.iter().map(|file| file.display().to_string()).collect();
        let title = names.join(", ");
        if recording.curves.is_empty() {
            return Err(ErrorMessage::new(Kind::Io, format!("{title}: no rows")).into());
        }
        self.choose(&mut recording, &title)?;
        let axis = if self.elapsed { TimeAxis::Elapsed } else { TimeAxis::Clock(ahead_of_utc) };
        let span = self.span(&recording, axis)?;
        let plot = plot::Plot::new(recording, title, axis, span);
        let plot = plot.ok_or_else(|| ErrorMessage::usage("no values between --from and --to"))?;
        let Some(path) = &self.output else {
            let mut out = anstream::AutoStream::new(open_stdout()?, global.console().color).lock();
            return plot::terminal(&plot, stdout_width().unwrap_or(80), &mut out).map_err(stdout);
        };
        let picture = match extension(path).as_deref() {
            Some("png") => plot::png(&plot)?,
            _ => plot::svg(&plot).into_bytes(),
        };
        ReportFile::create(path, false, None)?.write(&picture)
    }

    /// Keeps only the chosen signals.
    fn choose(&self, recording: &mut Recording, title: &str) -> Result<(), ErrorMessage> {
        for signal in &self.signal {
            let names = recording.curves.iter().map(|curve| curve.signal.as_str());
            if recording.curves.iter().any(|curve| is_chosen(signal, curve.node, &curve.signal)) {
                continue;
            }
            let mut names: Vec<&str> = names.collect();
            names.sort_by_key(|name| (distance(signal.rsplit('.').next().unwrap_or(signal), name), *name));
            names.dedup();
            let mut nodes: Vec<u8> = recording.curves.iter().map(|curve| curve.node).collect();
            nodes.sort_unstable();
            nodes.dedup();
            let nodes: Vec<String> = nodes.iter().map(u8::to_string).collect();
            let nearest = names[..names.len().min(3)].join(", ");
            let hint = format!("nodes in the recording: {}", nodes.join(", "));
            let message = format!("{title}: no signal \"{signal}\" (nearest: {nearest})");
            return Err(ErrorMessage::usage(message).hint(hint));
        }
        let wanted =
            |node, name: &str| self.signal.is_empty() || self.signal.iter().any(|signal| is_chosen(signal, node, name));
        recording.curves.retain(|curve| wanted(curve.node, &curve.signal));
        Ok(())
    }

    fn span(&self, recording: &Recording, axis: TimeAxis) -> Result<[Option<i64>; 2], ErrorMessage> {
        let firsts = recording.curves.iter().filter_map(|curve| curve.points.first());
        let first = firsts.map(|point| point.at).min().unwrap_or(0);
        let resolve = |moment: Option<Moment>| match moment {
            None => Ok(None),
            Some(moment) => moment
                .resolve(first, axis)
                .map(Some)
                .ok_or_else(|| ErrorMessage::usage("with --elapsed, --from and --to are times since the start: 10m")),
        };
        let [from, to] = [resolve(self.from)?, resolve(self.to)?];
        match (from, to) {
            (Some(from), Some(to)) if from >= to => Err(ErrorMessage::usage("--from must be before --to")),
            _ => Ok([from, to]),
        }
    }
}

/// Whether `wanted` is this signal: `pressure` or `5.pressure`.
fn is_chosen(wanted: &str, node: u8, signal: &str) -> bool {
    let is_name = |wanted: &str| wanted.eq_ignore_ascii_case(signal);
    is_name(wanted) || wanted.strip_prefix(&format!("{node}.")).is_some_and(is_name)
}

/// Returns the file itself if it exists, otherwise the parts that `log --rotate` wrote.
fn parts(file: &Path) -> anyhow::Result<Vec<PathBuf>> {
    if file == Path::new("-") || file.exists() {
        return Ok(vec![file.to_owned()]);
    }
    let parts: Vec<PathBuf> =
        series::existing(file).unwrap_or_default().into_iter().map(|number| series::name(file, number)).collect();
    // If the file is missing, the error is reported when it is opened.
    Ok(if parts.is_empty() { vec![file.to_owned()] } else { parts })
}

/// Reads a file, and reports the lines that could not be read.
fn read(path: &Path, recording: &mut Recording, global: &Global) -> anyhow::Result<()> {
    let name = path.display();
    let failed = |verb: &str, source| FileError { what: format!("{verb} {name}"), source };
    let omitted = recording.read(&mut *open_text(path).map_err(|source| failed("open", source))?);
    let omitted = omitted.map_err(|error| match error {
        RecordingError::Io(source) => anyhow::Error::from(failed("read", source)),
        RecordingError::Empty => ErrorMessage::new(Kind::Io, format!("{name}: the file is empty")).into(),
        RecordingError::OtherKind => {
            let message = format!("{name}: not a recording of log (CSV or JSON Lines)");
            let hint = format!("decode recorded frames first: cangauge -b replay:{name} log all -o run.csv");
            ErrorMessage::new(Kind::Io, message).hint(hint).into()
        }
    })?;
    let console = global.console();
    match (omitted.lines, omitted.first) {
        (0, _) => {}
        (1, first) => console.warn(&format!("{name}: line {first} is not a row, and was skipped")),
        (count, first) => {
            console.warn(&format!("{name}: {count} lines are not rows, and were skipped (first: {first})"))
        }
    }
    if omitted.is_cut {
        console.warn(&format!("{name}: the last line is incomplete, and was skipped"));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_a_plot() {
        let (hour, day) = (3_600_000_000, 86_400_000_000);
        let axis = TimeAxis::Clock(|_| 7_200_000_000);
        // 22:30 local time.
        let first = 100 * day + 20 * hour + hour / 2;
        let at = |text: &str| text.parse::<Moment>().map(|moment| moment.resolve(first, axis).map(|at| at - first));
        assert_eq!(at("10m"), Ok(Some(600_000_000)));
        assert_eq!(at("23:00"), Ok(Some(hour / 2)));
        assert_eq!(at("01:00:00.5"), Ok(Some(2 * hour + hour / 2 + 500_000)), "the next day");
        assert_eq!(at("1970-04-11T20:31:00Z"), Ok(Some(60_000_000)));
        assert_eq!(at("1970-04-11 22:31:00"), Ok(Some(60_000_000)));
        for wrong in ["", "10", "25:00", "10:", "soon", "-5m"] {
            assert!(wrong.parse::<Moment>().is_err(), "{wrong}");
        }
        assert_eq!(Moment::OfDay(0).resolve(0, TimeAxis::Elapsed), None);
        assert_eq!(Moment::Since(5).resolve(7, TimeAxis::Elapsed), Some(12));
    }

    #[test]
    fn signals_by_name_and_node() {
        for (wanted, is_expected) in [("pressure", true), ("5.Pressure", true), ("6.pressure", false), ("press", false)]
        {
            assert_eq!(is_chosen(wanted, 5, "pressure"), is_expected, "{wanted}");
        }
        assert!(is_chosen("pressure.status", 5, "pressure.status"));
    }
}
