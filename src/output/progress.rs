//! The live lines of a recording: the latest values of each node, and the progress.

use super::live::{LiveCounts, LiveTable};
use super::stderr_size;
use crate::bus::Mono;
use crate::measure::sample::{Sample, Source};
use anstream::adapter::strip_str;
use anstream::{AutoStream, ColorChoice};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle, TermLike};
use std::cell::Cell;
use std::io::{self, Write};
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

/// The rate of rows is measured over at least this time.
const MIN_RATE_WINDOW: Duration = Duration::from_secs(1);

/// Redraws per second.
pub(super) const REDRAWS_PER_SECOND: u8 = 10;

/// Live lines on stderr.
#[derive(Debug)]
pub struct Progress {
    multi: MultiProgress,
    /// Whether nothing is shown. Stored, because it is checked for each frame.
    is_hidden: bool,
    /// One bar with all lines, so that they are drawn together.
    lines: ProgressBar,
    table: LiveTable,
    color: bool,
    /// The width of the terminal and the lengths of the lines at the last redraw.
    drawn: (usize, Vec<usize>),
    /// The time and the number of rows at the start of the present rate measurement.
    rate_start: (Duration, u64),
    rows_per_second: f64,
}

impl Progress {
    /// Live lines, hidden unless `show`.
    pub fn new(show: bool, color: ColorChoice) -> Progress {
        let target = match stderr_size().filter(|_| show) {
            Some(_) => ProgressDrawTarget::term_like_with_hz(Box::new(LineTerminal::default()), REDRAWS_PER_SECOND),
            None => ProgressDrawTarget::hidden(),
        };
        let multi = MultiProgress::with_draw_target(target);
        let lines = multi.add(ProgressBar::new_spinner());
        lines.set_style(style("{msg}"));
        let color = has_color(color);
        let (table, drawn) = (LiveTable::default(), (0, Vec::new()));
        let is_hidden = multi.is_hidden();
        Progress { multi, is_hidden, lines, table, color, drawn, rate_start: (Duration::ZERO, 0), rows_per_second: 0.0 }
    }

    /// Returns the [`MultiProgress`]: the console prints its lines between the redraws.
    pub fn multi(&self) -> MultiProgress {
        self.multi.clone()
    }

    /// Whether nothing is shown.
    pub fn is_hidden(&self) -> bool {
        self.is_hidden
    }

    /// Stores the latest values for the next redraw.
    pub fn update_values(&mut self, samples: &[Sample], sources: &[Source]) {
        if self.is_hidden() {
            return;
        }
        for sample in samples {
            if let Some(source) = sources.get(sample.source) {
                self.table.update(sample, source);
            }
        }
    }

    /// Updates the rate of rows, and redraws the lines.
    pub fn tick(&mut self, now: Mono, counts: LiveCounts) {
        if self.is_hidden() {
            return;
        }
        let passed = counts.elapsed.saturating_sub(self.rate_start.0);
        if passed >= MIN_RATE_WINDOW {
            self.rows_per_second = counts.rows.saturating_sub(self.rate_start.1) as f64 / passed.as_secs_f64();
            self.rate_start = (counts.elapsed, counts.rows);
        }
        let size = stderr_size().unwrap_or((80, 24));
        let counts = LiveCounts { rows_per_second: self.rows_per_second, ..counts };
        let text = self.table.lines(&counts, now, size, self.color);
        let lengths = strip_str(&text).to_string().lines().map(|line| line.chars().count()).collect();
        let (width, before) = std::mem::replace(&mut self.drawn, (size.0, lengths));
        let wrapped: usize = before.iter().map(|length| length.saturating_sub(1) / size.0.max(1)).sum();
        if size.0 < width && wrapped > 0 {
            // The narrower terminal has wrapped the lines, so they are erased. If it is closed, the error is ignored.
            let _ = write!(io::stderr(), "\x1b[{wrapped}A\r\x1b[J");
        }
        self.lines.set_message(text);
    }

    /// Removes the lines. After Ctrl-C they stay: the terminal has printed `^C`, so the position of the cursor is
    /// unknown.
    pub fn finish(&mut self, interrupted: bool) {
        if interrupted && !self.is_hidden() {
            // If the terminal is closed, there is nothing to clean up.
            let _ = writeln!(io::stderr());
        } else {
            let _ = self.multi.clear();
        }
        self.multi.set_draw_target(ProgressDrawTarget::hidden());
        self.is_hidden = true;
    }
}

/// The terminal on stderr. Lines are not filled with spaces: a terminal that changes its width would join filled lines.
#[derive(Debug, Default)]
struct LineTerminal {
    output: Mutex<ScreenOutput>,
}

#[derive(Debug, Default)]
struct ScreenOutput {
    text: String,
    /// Whether the next text starts on a new line.
    is_line_full: bool,
}

impl LineTerminal {
    fn put(&self, text: &str) -> io::Result<()> {
        let mut output = self.output.lock().unwrap_or_else(PoisonError::into_inner);
        // indicatif fills each line with spaces.
        if !text.is_empty() && text.bytes().all(|byte| byte == b' ') {
            output.text.push_str("\x1b[K");
            output.is_line_full = true;
            return Ok(());
        }
        if std::mem::take(&mut output.is_line_full) {
            output.text.push_str("\r\n");
        }
        output.text.push_str(text);
        Ok(())
    }

    fn command(&self, count: usize, letter: char) -> io::Result<()> {
        if count > 0 { self.put(&format!("\x1b[{count}{letter}")) } else { Ok(()) }
    }
}

impl TermLike for LineTerminal {
    fn width(&self) -> u16 {
        stderr_size().map_or(80, |(width, _)| u16::try_from(width).unwrap_or(u16::MAX))
    }

    fn height(&self) -> u16 {
        stderr_size().map_or(24, |(_, height)| u16::try_from(height).unwrap_or(u16::MAX))
    }

    fn move_cursor_up(&self, count: usize) -> io::Result<()> {
        self.command(count, 'A')
    }

    fn move_cursor_down(&self, count: usize) -> io::Result<()> {
        self.command(count, 'B')
    }

    fn move_cursor_right(&self, count: usize) -> io::Result<()> {
        self.command(count, 'C')
    }

    fn move_cursor_left(&self, count: usize) -> io::Result<()> {
        self.command(count, 'D')
    }

    fn write_line(&self, text: &str) -> io::Result<()> {
        self.put(&format!("{text}\r\n"))
    }

    fn write_str(&self, text: &str) -> io::Result<()> {
        self.put(text)
    }

    fn clear_line(&self) -> io::Result<()> {
        self.put("\r\x1b[K")
    }

    fn flush(&self) -> io::Result<()> {
        let mut output = self.output.lock().unwrap_or_else(PoisonError::into_inner);
        output.is_line_full = false;
        let text = std::mem::take(&mut output.text);
        // Automatic line wrap is off during the output: if the terminal has become narrower, lines are cut.
        let mut err = io::stderr();
        write!(err, "\x1b[?7l{text}\x1b[?7h")?;
        err.flush()
    }
}

/// The interval of the redraws of an [`Activity`].
const TICK: Duration = Duration::from_millis(200);

/// The progress of one transfer, shown only for long transfers.
#[derive(Debug)]
pub struct TransferProgress {
    bar: Option<ProgressBar>,
    /// The number of calls of [`TransferProgress::show_bytes`]. There are ten calls per second.
    calls: Cell<u32>,
}

/// The first call that shows the progress: after 0.3 s.
const FIRST_SHOWN_CALL: u32 = 3;

impl TransferProgress {
    /// A transfer that starts now; hidden unless `show`.
    pub fn new(show: bool) -> TransferProgress {
        let bar = show.then(|| ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden()));
        TransferProgress { bar, calls: Cell::new(0) }
    }

    /// Shows the number of transferred bytes, and the total if known.
    pub fn show_bytes(&self, (done, total): (usize, Option<usize>)) {
        self.calls.set(self.calls.get().saturating_add(1));
        let Some(bar) = self.bar.as_ref().filter(|_| self.calls.get() >= FIRST_SHOWN_CALL) else { return };
        if bar.is_hidden() {
            bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(REDRAWS_PER_SECOND));
            bar.set_style(style("[{bar:27}] {bytes} of {total_bytes}, {binary_bytes_per_sec}").progress_chars("=> "));
        }
        if let Some(total) = total {
            bar.set_length(total as u64);
        }
        bar.set_position(done as u64);
    }

    /// Removes the line.
    pub fn finish(&self) {
        if let Some(bar) = &self.bar {
            bar.finish_and_clear();
        }
    }
}

/// A line on stderr with the elapsed time, while a command works.
#[derive(Debug)]
pub struct Activity(ProgressBar);

impl Activity {
    /// Shows a line such as `asking all nodes`; hidden unless `show`.
    pub fn new(show: bool, what: &'static str) -> Activity {
        let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::hidden());
        if show {
            bar.set_draw_target(ProgressDrawTarget::stderr_with_hz(REDRAWS_PER_SECOND));
            bar.set_style(style("{spinner} {msg} ({elapsed})"));
            bar.set_message(what);
            bar.enable_steady_tick(TICK);
        }
        Activity(bar)
    }

    /// Prints other lines above this line.
    pub fn above(&self, print: impl FnOnce()) {
        self.0.suspend(print);
    }
}

impl Drop for Activity {
    fn drop(&mut self) {
        self.0.finish_and_clear();
    }
}

/// A progress bar of this length.
pub(super) fn bar(multi: &MultiProgress, length: u64) -> ProgressBar {
    let bar = multi.add(ProgressBar::new(length));
    bar.set_style(style("[{bar:27}] {msg}").progress_chars("=> "));
    bar
}

/// Whether stderr shows colours.
pub(super) fn has_color(choice: ColorChoice) -> bool {
    match choice {
        ColorChoice::Auto => AutoStream::choice(&io::stderr()) != ColorChoice::Never,
        choice => choice != ColorChoice::Never,
    }
}

/// The style of a line.
pub(super) fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_end_without_spaces() {
        let screen = LineTerminal::default();
        for text in ["first", "   ", "second", " "] {
            screen.put(text).expect("memory");
        }
        let output = screen.output.into_inner().expect("not poisoned");
        assert_eq!((output.text.as_str(), output.is_line_full), ("first\x1b[K\r\nsecond\x1b[K", true));
    }
}
