//! The live lines of a check: one line per expression, with the latest values.

use super::progress::{REDRAWS_PER_SECOND, bar, has_color, style};
use super::verdict::{values, word};
use crate::measure::expression::verdict::{LiveResult, Outcome};
use anstream::ColorChoice;
use anstyle::Style;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget};
use std::io::{self, Write};
use std::time::Duration;

/// The live lines on stderr.
#[derive(Debug)]
pub struct CheckProgress {
    multi: MultiProgress,
    lines: Vec<ProgressBar>,
    total: ProgressBar,
    color: bool,
    duration: Duration,
}

impl CheckProgress {
    /// Live lines for a check of `duration`. Hidden unless `show`.
    pub fn new(show: bool, color: ColorChoice, duration: Duration) -> CheckProgress {
        let target =
            if show { ProgressDrawTarget::stderr_with_hz(REDRAWS_PER_SECOND) } else { ProgressDrawTarget::hidden() };
        let multi = MultiProgress::with_draw_target(target);
        let total = bar(&multi, u64::try_from(duration.as_millis()).unwrap_or(u64::MAX));
        CheckProgress { multi, lines: Vec::new(), total, color: has_color(color), duration }
    }

    /// Returns the display, so that other lines on stderr can be printed above it.
    pub fn multi(&self) -> MultiProgress {
        self.multi.clone()
    }

    /// Whether nothing is drawn.
    pub fn is_hidden(&self) -> bool {
        self.multi.is_hidden()
    }

    /// Redraws all lines.
    pub fn show(&mut self, results: &[LiveResult], elapsed: Duration) {
        while self.lines.len() < results.len() {
            let line = self.multi.insert_before(&self.total, ProgressBar::new_spinner());
            line.set_style(style("{prefix:<4}  {msg}"));
            self.lines.push(line);
        }
        for (line, result) in self.lines.iter().zip(results) {
            let outcome = result.is_satisfied.map(|is_ok| if is_ok { Outcome::Ok } else { Outcome::Fail });
            let (text, style) = outcome.map_or(("-", Style::new()), word);
            let style = if self.color { style } else { Style::new() };
            line.set_prefix(format!("{style}{text}{style:#}"));
            let node = result.node.map(|node| format!("{node}  ")).unwrap_or_default();
            let latest: Vec<Option<f64>> = result.values.iter().map(|value| value.value).collect();
            line.set_message(format!("{node}{}  {}", result.text, values(&result.values, &latest)));
        }
        self.total.set_position(u64::try_from(elapsed.as_millis()).unwrap_or(u64::MAX));
        let left = Duration::from_secs(self.duration.saturating_sub(elapsed).as_secs());
        self.total.set_message(format!("{} left", humantime::format_duration(left)));
    }

    /// Removes the lines. After Ctrl-C they stay: the terminal printed `^C`, so the cursor position is unknown.
    pub fn finish(&self, interrupted: bool) {
        if interrupted && !self.is_hidden() {
            // If the terminal is closed, the error cannot be reported anywhere.
            let _ = writeln!(io::stderr());
        } else {
            let _ = self.multi.clear();
        }
        self.multi.set_draw_target(ProgressDrawTarget::hidden());
    }
}
