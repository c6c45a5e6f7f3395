//! The table of the latest values of a recording. Its lines never wrap: they are cut at the width of the terminal.

use super::table::align_decimals;
use super::text::{grouped, safe, significant};
use crate::bus::Mono;
use crate::measure::interval::IntervalTracker;
use crate::measure::sample::{Number, Sample, Source, Status};
use anstyle::{AnsiColor, Style};
use std::collections::VecDeque;
use std::time::Duration;

/// The time of one character of a sparkline.
const CHARACTER_TIME: Duration = Duration::from_secs(3);

/// The number of characters of a sparkline, which shows one minute.
const CHARACTERS: usize = 20;

/// The characters of a sparkline, from the lowest to the highest value.
const LEVELS: [char; 8] = ['▁', '▂', '▃', '▄', '▅', '▆', '▇', '█'];

/// If a node has more signals than this, each line shows this number of its signals. On a narrow terminal, half or a
/// quarter of this number is used.
const SIGNALS_IN_LINE: usize = 8;

/// The times and counts of a running recording.
#[derive(Clone, Debug, Default)]
pub struct LiveCounts {
    /// The time since the first tick.
    pub elapsed: Duration,
    /// The planned length.
    pub duration: Option<Duration>,
    /// The rows so far.
    pub rows: u64,
    /// The planned number of rows.
    pub count: Option<u64>,
    /// The rate of rows, measured over at least one second.
    pub rows_per_second: f64,
    /// Rows and frames that were lost.
    pub lost: u64,
    /// The gaps.
    pub gaps: u64,
    /// The name of the file with rows.
    pub file: String,
}

/// A line as parts with their styles.
type Line = Vec<(String, Style)>;

/// The latest values of one signal.
#[derive(Debug)]
struct LiveSignal {
    node: u8,
    name: String,
    unit: String,
    value: Option<Number>,
    status: Option<Status>,
    intervals: IntervalTracker,
    /// For each character of the sparkline: its time index, and the sum and the number of its values.
    history: VecDeque<(u64, f64, u32)>,
}

impl LiveSignal {
    fn value(&self) -> String {
        self.value.map_or_else(|| "-".to_owned(), |value| value.to_string())
    }

    fn rate(&self, now: Mono) -> String {
        let rate = match self.intervals.usual().filter(|_| self.intervals.silence(now).is_none()) {
            Some(usual) if !usual.is_zero() => significant(1.0 / usual.as_secs_f64(), 3),
            Some(_) => "-".to_owned(),
            None => "0".to_owned(),
        };
        format!("{rate}/s")
    }

    /// Draws the mean values of the last minute.
    fn sparkline(&self, now: Mono) -> String {
        let last = time_index(now);
        let means = self.history.iter().map(|(_, sum, count)| sum / f64::from(*count));
        let (low, high) =
            means.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), mean| (low.min(mean), high.max(mean)));
        let level = |mean: f64| match (mean - low) / (high - low) {
            share if share.is_nan() => LEVELS[3],
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            share => LEVELS[((share * 8.0) as usize).min(7)],
        };
        let at = |index: u64| {
            let found = self.history.iter().find(|(known, ..)| *known == index);
            found.map_or(' ', |(_, sum, count)| level(sum / f64::from(*count)))
        };
        (0..CHARACTERS as u64).rev().map(|back| last.checked_sub(back).map_or(' ', at)).collect()
    }
}

fn time_index(at: Mono) -> u64 {
    u64::try_from(at.since_start().as_millis() / CHARACTER_TIME.as_millis()).unwrap_or(u64::MAX)
}

/// The text and the style of a status.
fn status(status: Option<Status>) -> (&'static str, Style) {
    match status {
        None => ("(no status)", Style::new().dimmed()),
        Some(Status::Ok) => (Status::Ok.as_str(), AnsiColor::Green.on_default()),
        Some(Status::Invalid) => (Status::Invalid.as_str(), AnsiColor::Red.on_default().bold()),
        Some(status) => (status.as_str(), AnsiColor::Yellow.on_default().bold()),
    }
}

/// The latest values of all signals.
#[derive(Debug, Default)]
pub(super) struct LiveTable {
    signals: Vec<LiveSignal>,
    /// For each source, the index of its signal in `signals`.
    places: Vec<Option<usize>>,
}

impl LiveTable {
    /// Adds a value.
    pub(super) fn update(&mut self, sample: &Sample, source: &Source) {
        if self.places.len() <= sample.source {
            self.places.resize(sample.source + 1, None);
        }
        let place = *self.places[sample.source].get_or_insert_with(|| add_signal(&mut self.signals, source));
        let signal = &mut self.signals[place];
        (signal.value, signal.status) = (sample.value, sample.status);
        signal.intervals.add(sample.at.mono, None);
        let Some(value) = sample.value.map(Number::as_f64).filter(|value| value.is_finite()) else { return };
        let index = time_index(sample.at.mono);
        match signal.history.back_mut().filter(|last| last.0 == index) {
            Some((_, sum, count)) => (*sum, *count) = (*sum + value, *count + 1),
            None => signal.history.push_back((index, value, 1)),
        }
        if signal.history.len() > CHARACTERS {
            signal.history.pop_front();
        }
    }

    /// The lines for a terminal of this width and height.
    pub(super) fn lines(&self, counts: &LiveCounts, now: Mono, (width, height): (usize, usize), color: bool) -> String {
        let mut lines = vec![status_line(counts)];
        lines.extend(self.table(now, width));
        // The last line of the terminal stays free.
        let max_lines = height.saturating_sub(1).max(1);
        if lines.len() > max_lines {
            let omitted = lines.len() - max_lines + 1;
            lines.truncate(max_lines - 1);
            lines.push(vec![(format!("{omitted} more lines"), Style::new().dimmed())]);
        }
        let text = |line: Line| cut(line, width.saturating_sub(1), color);
        lines.into_iter().map(text).collect::<Vec<_>>().join("\n")
    }

    fn table(&self, now: Mono, width: usize) -> Vec<Line> {
        let mut nodes: Vec<u8> = self.signals.iter().map(|signal| signal.node).collect();
        nodes.sort_unstable();
        nodes.dedup();
        let signals_of = |node: u8| self.signals.iter().filter(move |signal| signal.node == node);
        let (many, few): (Vec<u8>, Vec<u8>) =
            nodes.into_iter().partition(|&node| signals_of(node).count() > SIGNALS_IN_LINE);
        let mut lines = rows(&few.into_iter().flat_map(signals_of).collect::<Vec<_>>(), now, width);
        for node in many {
            let signals: Vec<&LiveSignal> = signals_of(node).collect();
            let mut in_line = SIGNALS_IN_LINE;
            let is_wide = |in_line| compact(&signals, now, in_line).iter().any(|line| length(line) >= width);
            while in_line > 2 && is_wide(in_line) {
                in_line /= 2;
            }
            lines.extend(compact(&signals, now, in_line));
        }
        lines
    }
}

/// Adds the signal of a source, and returns its index. A signal in another unit replaces the old entry.
fn add_signal(signals: &mut Vec<LiveSignal>, source: &Source) -> usize {
    let new = LiveSignal {
        node: source.node.get(),
        name: safe(&source.signal),
        unit: safe(&source.unit),
        value: None,
        status: None,
        intervals: IntervalTracker::default(),
        history: VecDeque::new(),
    };
    match signals.iter().position(|signal| signal.node == new.node && signal.name == new.name) {
        Some(place) => {
            signals[place] = new;
            place
        }
        None => {
            signals.push(new);
            signals.len() - 1
        }
    }
}

/// Returns one line for each signal, below a heading. If the width is too small, the sparkline is omitted.
fn rows(signals: &[&LiveSignal], now: Mono, width: usize) -> Vec<Line> {
    if signals.is_empty() {
        return Vec::new();
    }
    let column =
        |cell: &dyn Fn(&LiveSignal) -> String| -> Vec<String> { signals.iter().map(|signal| cell(signal)).collect() };
    let mut values = column(&LiveSignal::value);
    align_decimals(&mut values);
    let mut columns = [
        ("NODE", true, column(&|signal| signal.node.to_string())),
        ("SIGNAL", false, column(&|signal| signal.name.clone())),
        ("VALUE", false, values),
        ("UNIT", false, column(&|signal| signal.unit.clone())),
        ("STATUS", false, column(&|signal| status(signal.status).0.to_owned())),
        ("RATE", true, column(&|signal| signal.rate(now))),
        ("LAST MINUTE", false, column(&|signal| signal.sparkline(now))),
    ]
    .to_vec();
    let width_of = |cells: &[String], heading: &str| {
        cells.iter().map(|cell| cell.chars().count()).max().unwrap_or(0).max(heading.len())
    };
    let widths: Vec<usize> = columns.iter().map(|(heading, _, cells)| width_of(cells, heading)).collect();
    if widths.iter().map(|width| width + 2).sum::<usize>() > width {
        columns.pop();
    }
    let line = |cell: &dyn Fn(usize) -> (String, Style)| -> Line {
        let padded = columns.iter().zip(&widths).enumerate().map(|(number, ((_, is_right, _), width))| {
            let (text, style) = cell(number);
            let space = " ".repeat(width - text.chars().count());
            let gap = if number > 0 { "  " } else { "" };
            match is_right {
                true => [(format!("{gap}{space}"), Style::new()), (text, style), (String::new(), style)],
                false => [(gap.to_owned(), Style::new()), (text, style), (space, Style::new())],
            }
        });
        padded.flatten().collect()
    };
    let head = line(&|number| (columns[number].0.to_owned(), Style::new().dimmed()));
    let row = |(place, signal): (usize, &&LiveSignal)| {
        line(&|number| {
            let style = if columns[number].0 == "STATUS" { status(signal.status).1 } else { Style::new() };
            (columns[number].2[place].clone(), style)
        })
    };
    std::iter::once(head).chain(signals.iter().enumerate().map(row)).collect()
}

/// Returns lines with up to `in_line` signals of one node: `3  ch1-ch8  20.1  20.4 …  degC  ok  10.0/s`.
fn compact(signals: &[&LiveSignal], now: Mono, in_line: usize) -> Vec<Line> {
    let mut values: Vec<String> = signals.iter().map(|signal| signal.value()).collect();
    align_decimals(&mut values);
    let width = values.iter().map(|value| value.chars().count()).max().unwrap_or(0);
    let names: Vec<String> = signals
        .chunks(in_line)
        .map(|chunk| match chunk {
            [first, .., last] => format!("{}-{}", first.name, last.name),
            _ => chunk.iter().map(|signal| signal.name.as_str()).collect(),
        })
        .collect();
    let widest = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
    let mut lines = Vec::new();
    for (number, chunk) in signals.chunks(in_line).enumerate() {
        let node = if number == 0 { chunk[0].node.to_string() } else { String::new() };
        let mut line = vec![(format!("{node:>4}  {:<widest$}", names[number]), Style::new())];
        for (signal, value) in chunk.iter().zip(&values[number * in_line..]) {
            let style = if signal.status.is_none_or(|status| status == Status::Ok) {
                Style::new()
            } else {
                status(signal.status).1
            };
            line.extend([("  ".to_owned(), Style::new()), (format!("{value:<width$}"), style)]);
        }
        // Of several signals, only the first status that is not ok is shown.
        let worst = chunk.iter().find(|signal| signal.status.is_some_and(|status| status != Status::Ok));
        let (text, style) = status(worst.unwrap_or(&chunk[0]).status);
        let text = worst.map_or_else(|| text.to_owned(), |signal| format!("{} {text}", signal.name));
        line.push((format!("  {}  ", chunk[0].unit), Style::new()));
        line.push((text, style));
        line.push((format!("  {}", chunk[0].rate(now)), Style::new()));
        lines.push(line);
    }
    lines
}

/// The times and the number of rows; the numbers of lost rows and of gaps are red if they are not 0.
fn status_line(counts: &LiveCounts) -> Line {
    let plain = |text: String| (text, Style::new());
    let clock = |time: Duration| {
        let seconds = time.as_secs();
        format!("{:02}:{:02}:{:02}", seconds / 3600, seconds / 60 % 60, seconds % 60)
    };
    let total = counts.duration.map(|total| format!(" / {}", clock(total))).unwrap_or_default();
    let count = counts.count.map(|count| format!(" / {}", grouped(count))).unwrap_or_default();
    let counted = |count: u64, name: &str| {
        let style = if count > 0 { AnsiColor::Red.on_default().bold() } else { Style::new() };
        (format!("{} {name}", grouped(count)), style)
    };
    let mut line = vec![
        plain(format!("{}{total}   ", clock(counts.elapsed))),
        plain(format!("{}{count} rows   {:.0}/s   ", grouped(counts.rows), counts.rows_per_second)),
        counted(counts.lost, "lost"),
        plain("   ".to_owned()),
        counted(counts.gaps, "gaps"),
        plain(format!("   {}", safe(&counts.file))),
    ];
    if counts.duration.is_none() && counts.count.is_none() {
        line.push(plain("   Ctrl-C ends".to_owned()));
    }
    line
}

/// The number of characters of a line.
fn length(line: &Line) -> usize {
    line.iter().map(|(part, _)| part.chars().count()).sum()
}

/// The text of a line, at most `width` characters, with its styles if `color`. A cut line ends with `…`.
fn cut(line: Line, width: usize, color: bool) -> String {
    let is_cut = length(&line) > width;
    let (mut text, mut remaining) = (String::new(), width.saturating_sub(usize::from(is_cut)));
    for (part, style) in line {
        let part: String = part.chars().take(remaining).collect();
        remaining -= part.chars().count();
        if color && style != Style::new() && !part.is_empty() {
            text.push_str(&format!("{style}{part}{style:#}"));
        } else {
            text.push_str(&part);
        }
    }
    text.truncate(text.trim_end().len());
    text.extend(is_cut.then_some('…'));
    text
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::{Stamp, Wall};
    use crate::canopen::id::NodeId;
    use crate::measure::sample::Raw;

    /// Makes a table with ten values of each signal in one second. `signals`: nodes, and the number of their signals.
    fn table(signals: &[(u8, usize)]) -> LiveTable {
        let mut table = LiveTable::default();
        let mut number = 0;
        for &(node, count) in signals {
            for channel in 1..=count {
                let node = NodeId::new(node).expect("a node-ID");
                let source = Source { node, signal: format!("ch{channel}").into(), unit: "degC".into() };
                for at in 0..10u64 {
                    let since = Duration::from_millis(at * 100);
                    let value = Some(Number::Decimal { mantissa: i128::from(at) + 200 * channel as i128, digits: 1 });
                    let status = if channel == 3 { Status::OverloadHigh } else { Status::Ok };
                    let at = Stamp { mono: Mono::at(since), wall: Wall::at(since) };
                    let raw = Raw::new(&[]);
                    table
                        .update(&Sample { at, source: number, value, status: Some(status), raw, doubt: None }, &source);
                }
                number += 1;
            }
        }
        table
    }

    fn lines(table: &LiveTable, width: usize, height: usize) -> Vec<String> {
        let counts = LiveCounts { rows: 1234, gaps: 2, file: "run.csv".into(), ..LiveCounts::default() };
        let text = table.lines(&counts, Mono::at(Duration::from_secs(1)), (width, height), false);
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn one_line_for_each_signal() {
        assert_eq!(
            lines(&table(&[(5, 3)]), 80, 24),
            [
                "00:00:00   1,234 rows   0/s   0 lost   2 gaps   run.csv   Ctrl-C ends",
                "NODE  SIGNAL  VALUE  UNIT  STATUS           RATE  LAST MINUTE",
                "   5  ch1     20.9   degC  ok             10.0/s                     ▄",
                "   5  ch2     40.9   degC  ok             10.0/s                     ▄",
                "   5  ch3     60.9   degC  overload-high  10.0/s                     ▄",
            ]
        );
    }

    #[test]
    fn sixteen_channels_are_two_lines() {
        let lines = lines(&table(&[(3, 16), (5, 1)]), 120, 24);
        assert_eq!(lines.len(), 5, "{lines:?}");
        assert!(lines[2].starts_with("   5  ch1 "), "{lines:?}");
        assert_eq!(
            lines[3],
            "   3  ch1-ch8    20.9   40.9   60.9   80.9  100.9  120.9  140.9  160.9  degC  ch3 overload-high  10.0/s"
        );
        assert!(lines[4].starts_with("      ch9-ch16  180.9  200.9 ") && lines[4].ends_with("  degC  ok  10.0/s"));
    }

    #[test]
    fn lines_are_cut_at_the_size_of_the_terminal() {
        let table = table(&[(3, 16), (5, 8), (6, 7)]);
        for width in [20, 60, 80, 120, 200] {
            for height in [2, 5, 10, 60] {
                let lines = lines(&table, width, height);
                assert!(lines.len() < height && lines.iter().all(|line| line.chars().count() < width), "{lines:?}");
            }
        }
        assert_eq!(lines(&table, 80, 4)[2], "19 more lines");
        assert!(!lines(&table, 60, 24)[1].contains("LAST MINUTE"));
        let status_line = &lines(&table, 30, 24)[0];
        assert_eq!(status_line, "00:00:00   1,234 rows   0/s…");
    }

    #[test]
    fn narrow_terminal_has_fewer_values_in_each_line() {
        let at = |width: usize| lines(&table(&[(3, 16)]), width, 60);
        for (width, count) in [(120, 2), (80, 4), (64, 8), (40, 8)] {
            let lines = at(width);
            assert_eq!(lines.len(), 1 + count, "{width}: {lines:?}");
            assert!(lines.concat().contains("320.9"), "{width}: {lines:?}");
            assert!(width < 64 || !lines[1..].concat().contains('…'), "{width}: {lines:?}");
        }
        assert_eq!(at(40)[2], "      ch3-ch4     60.9   80.9  degC  c…");
    }

    #[test]
    fn only_values_that_are_not_ok_and_losses_are_red_or_yellow() {
        let counts = LiveCounts { gaps: 2, ..LiveCounts::default() };
        let text = table(&[(5, 3)]).lines(&counts, Mono::START, (120, 24), true);
        let red = AnsiColor::Red.on_default().bold();
        assert!(text.contains(&format!("{red}2 gaps{red:#}")) && text.contains("0 lost   "), "{text:?}");
        let yellow = AnsiColor::Yellow.on_default().bold();
        assert!(text.contains(&format!("{yellow}overload-high{yellow:#}")), "{text:?}");
    }

    #[test]
    fn silent_signal_has_no_rate_and_a_short_line() {
        let table = table(&[(5, 1)]);
        let signal = &table.signals[0];
        assert_eq!(signal.rate(Mono::at(Duration::from_secs(30))), "0/s");
        assert_eq!(signal.sparkline(Mono::at(Duration::from_secs(30))).trim_end().chars().last(), Some('▄'));
        assert_eq!(signal.sparkline(Mono::at(Duration::from_secs(90))).trim(), "");
    }
}
