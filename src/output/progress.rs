//! The live lines of a recording: the latest values of each node, and the progress.

use super::text;
use crate::measure::sample::{Sample, Source};
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget, ProgressStyle};
use std::cell::Cell;
use std::collections::BTreeMap;
use std::io::{self, Write};
use std::time::Duration;

/// Redraws per second.
pub(super) const REDRAWS_PER_SECOND: u8 = 10;

/// Live lines on stderr.
#[derive(Debug)]
pub struct Progress {
    multi: MultiProgress,
    nodes: BTreeMap<u8, (ProgressBar, BTreeMap<usize, String>)>,
    total: ProgressBar,
    duration: Option<Duration>,
    count: Option<u64>,
    changed: bool,
}

impl Progress {
    /// Live lines, hidden unless `show`.
    pub fn new(show: bool, duration: Option<Duration>, count: Option<u64>) -> Progress {
        let target =
            if show { ProgressDrawTarget::stderr_with_hz(REDRAWS_PER_SECOND) } else { ProgressDrawTarget::hidden() };
        let multi = MultiProgress::with_draw_target(target);
        let total = match (count, duration) {
            (Some(count), _) => bar(&multi, count),
            (None, Some(duration)) => bar(&multi, u64::try_from(duration.as_millis()).unwrap_or(u64::MAX)),
            (None, None) => {
                let line = multi.add(ProgressBar::new_spinner());
                line.set_style(style("{msg}"));
                line
            }
        };
        Progress { multi, nodes: BTreeMap::new(), total, duration, count, changed: false }
    }

    /// Returns the [`MultiProgress`]: the console prints its lines between the redraws.
    pub fn multi(&self) -> MultiProgress {
        self.multi.clone()
    }

    /// Whether nothing is shown.
    pub fn is_hidden(&self) -> bool {
        self.multi.is_hidden()
    }

    /// Stores the latest values for the next redraw.
    pub fn update_values(&mut self, samples: &[Sample], sources: &[Source]) {
        if self.is_hidden() {
            return;
        }
        for sample in samples {
            let Some(source) = sources.get(sample.source) else { continue };
            let (_, values) = self.nodes.entry(source.node.get()).or_insert_with(|| {
                let line = self.multi.insert_before(&self.total, ProgressBar::new_spinner());
                line.set_style(style("{prefix:<4} {msg}"));
                line.set_prefix(source.node.to_string());
                (line, BTreeMap::new())
            });
            let value = sample.value.map_or_else(|| "-".to_owned(), |value| value.to_string());
            let status = sample.status.map_or("", |status| status.as_str());
            values.insert(sample.source, format!("{} {value} {} {status}", source.signal, source.unit));
            self.changed = true;
        }
    }

    /// Redraws.
    pub fn tick(&mut self, elapsed: Duration, rows: u64) {
        if self.is_hidden() {
            return;
        }
        if std::mem::take(&mut self.changed) {
            for (line, values) in self.nodes.values() {
                let all: Vec<&str> = values.values().map(|value| value.trim_end()).collect();
                line.set_message(all.join("   "));
            }
        }
        let counted = format!("{} rows", text::grouped(rows));
        match (self.count, self.duration) {
            (Some(count), _) => {
                self.total.set_position(rows.min(count));
                self.total.set_message(counted);
            }
            (None, Some(duration)) => {
                self.total.set_position(u64::try_from(elapsed.as_millis()).unwrap_or(u64::MAX));
                let left = Duration::from_secs(duration.saturating_sub(elapsed).as_secs());
                self.total.set_message(format!("{} left   {counted}", humantime::format_duration(left)));
            }
            (None, None) => {
                let spent = Duration::from_secs(elapsed.as_secs());
                self.total.set_message(format!("{}   {counted}   Ctrl-C ends", humantime::format_duration(spent)));
            }
        }
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
    }
}

/// The progress of one transfer, shown only for long transfers.
#[derive(Debug)]
pub struct TransferProgress {
    bar: Option<ProgressBar>,
    /// The number of calls of [`TransferProgress::show_bytes`], ten per second.
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

/// A progress bar of this length.
pub(super) fn bar(multi: &MultiProgress, length: u64) -> ProgressBar {
    let bar = multi.add(ProgressBar::new(length));
    bar.set_style(style("[{bar:27}] {msg}").progress_chars("=> "));
    bar
}

/// The style of a line.
pub(super) fn style(template: &str) -> ProgressStyle {
    ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar())
}
