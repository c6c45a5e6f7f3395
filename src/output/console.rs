//! Prints errors, hints, warnings and notes to stderr.

use super::failure::ErrorMessage;
use super::plot::{Plot, terminal};
use super::{stderr_size, text};
use anstream::ColorChoice;
use anstyle::{AnsiColor, Style};
use indicatif::MultiProgress;
use std::io::{self, Write};

/// The amount and the form of the output on stderr.
#[derive(Clone, Debug)]
pub struct Console {
    /// Whether only errors are printed.
    pub quiet: bool,
    /// The number of `-v` options.
    pub verbose: u8,
    /// Whether errors are printed as JSON.
    pub json: bool,
    /// Whether to use colour.
    pub color: ColorChoice,
    /// The progress display. Lines are printed above it.
    pub progress: Option<MultiProgress>,
}

impl Console {
    fn line(&self, style: Style, head: &str, rest: &str) {
        let write = || {
            let mut err = anstream::AutoStream::new(io::stderr(), self.color);
            // If stderr is closed, the error cannot be reported anywhere.
            let _ = writeln!(err, "{style}{head}{style:#}{}", text::safe(rest));
        };
        match &self.progress {
            Some(progress) => progress.suspend(write),
            None => write(),
        }
    }

    /// Prints a note, except with `-q`.
    pub fn note(&self, message: &str) {
        if !self.quiet {
            self.line(Style::new(), "", message);
        }
    }

    /// Prints a line for another program, also with `-q`.
    pub fn plain(&self, line: &str) {
        self.line(Style::new(), "", line);
    }

    /// Draws a plot.
    pub fn plot(&self, plot: &Plot) {
        let mut err = anstream::AutoStream::new(io::stderr(), self.color);
        // If stderr is closed, the error cannot be reported anywhere.
        let _ = terminal(plot, stderr_size().map_or(80, |(width, _)| width), &mut err);
    }

    /// Prints a detail, only with `-v`.
    pub fn detail(&self, message: &str) {
        if self.verbose > 0 {
            self.line(Style::new().dimmed(), "", message);
        }
    }

    /// Prints a warning: there is a problem, but the command continues.
    pub fn warn(&self, message: &str) {
        if !self.quiet {
            self.line(AnsiColor::Yellow.on_default(), "warning: ", message);
        }
    }

    /// Prints an error with its hint; with `json`, as one line of JSON.
    pub fn fail(&self, failure: &ErrorMessage, exit: u8) {
        let failure = &ErrorMessage { message: text::one_line(&failure.message), ..failure.clone() };
        if self.json {
            let mut out = Vec::new();
            // Writing to memory cannot fail.
            let _ = failure.json(&mut out, exit);
            let _ = io::stderr().write_all(&out);
            return;
        }
        self.line(AnsiColor::Red.on_default().bold(), "cangauge: ", &failure.message);
        if let Some(place) = &failure.place {
            let (shown, before) = text::around(&place.text, place.before.chars().count());
            let start: String = shown.chars().take(before).collect();
            // Escaped characters are longer, so the mark `^` moves to the right.
            let before = text::safe(&start).chars().count();
            self.line(Style::new(), "  ", &shown);
            self.line(AnsiColor::Red.on_default().bold(), &format!("  {}^", " ".repeat(before)), "");
        }
        if let Some(hint) = &failure.hint {
            self.line(AnsiColor::Cyan.on_default(), "hint: ", hint);
        }
    }
}
