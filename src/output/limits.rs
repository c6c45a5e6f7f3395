//! The live lines of a check: the values at the moment against what is expected of them.

use super::progress::{RATE, bar, style};
use super::verdict::values;
use crate::measure::expression::verdict::Standing;
use indicatif::{MultiProgress, ProgressBar, ProgressDrawTarget};
use std::io::{self, Write};
use std::time::Duration;

/// Live lines on stderr.
#[derive(Debug)]
pub struct Limits {
    multi: MultiProgress,
    lines: Vec<ProgressBar>,
    total: ProgressBar,
    duration: Duration,
}

impl Limits {
    /// Live lines for a check of `duration`, hidden unless `show`.
    pub fn new(show: bool, duration: Duration) -> Limits {
        let target = if show { ProgressDrawTarget::stderr_with_hz(RATE) } else { ProgressDrawTarget::hidden() };
        let multi = MultiProgress::with_draw_target(target);
        let total = bar(&multi, u64::try_from(duration.as_millis()).unwrap_or(u64::MAX));
        Limits { multi, lines: Vec::new(), total, duration }
    }

    /// For lines that must not be torn.
    pub fn multi(&self) -> MultiProgress {
        self.multi.clone()
    }

    /// Whether anybody sees it.
    pub fn is_hidden(&self) -> bool {
        self.multi.is_hidden()
    }

    /// Redraws.
    pub fn show(&mut self, standing: &[Standing], elapsed: Duration) {
        while self.lines.len() < standing.len() {
            let line = self.multi.insert_before(&self.total, ProgressBar::new_spinner());
            line.set_style(style("{prefix:<4}  {msg}"));
            self.lines.push(line);
        }
        for (line, standing) in self.lines.iter().zip(standing) {
            line.set_prefix(match standing.holds {
                Some(true) => "ok",
                Some(false) => "FAIL",
                None => "-",
            });
            let node = standing.node.map(|node| format!("{node}  ")).unwrap_or_default();
            let now: Vec<Option<f64>> = standing.values.iter().map(|shown| shown.value).collect();
            line.set_message(format!("{node}{}  {}", standing.text, values(&standing.values, &now)));
        }
        self.total.set_position(u64::try_from(elapsed.as_millis()).unwrap_or(u64::MAX));
        let left = Duration::from_secs(self.duration.saturating_sub(elapsed).as_secs());
        self.total.set_message(format!("{} left", humantime::format_duration(left)));
    }

    /// Removes the lines. After Ctrl-C they stay: the terminal has written `^C` behind them, and where the
    /// cursor stands now is not known.
    pub fn finish(&self, interrupted: bool) {
        if interrupted && !self.is_hidden() {
            // A terminal that takes no more is gone.
            let _ = writeln!(io::stderr());
        } else {
            let _ = self.multi.clear();
        }
        self.multi.set_draw_target(ProgressDrawTarget::hidden());
    }
}
