//! stderr: errors, hints, warnings and notes.

use super::failure::ErrorMessage;
use super::text;
use anstream::ColorChoice;
use anstyle::{AnsiColor, Style};
use indicatif::MultiProgress;
use std::io::{self, Write};

/// How much is said, and how it looks.
#[derive(Clone, Debug)]
pub struct Console {
    /// Errors only.
    pub quiet: bool,
    /// How often `-v` was given.
    pub verbose: u8,
    /// Errors as JSON.
    pub json: bool,
    /// When to colour.
    pub color: ColorChoice,
    /// The progress display that lines must not tear.
    pub progress: Option<MultiProgress>,
}

impl Console {
    fn line(&self, style: Style, head: &str, rest: &str) {
        let write = || {
            let mut err = anstream::AutoStream::new(io::stderr(), self.color);
            // Nowhere is left to report a stderr that is gone.
            let _ = writeln!(err, "{style}{head}{style:#}{}", text::safe(rest));
        };
        match &self.progress {
            Some(progress) => progress.suspend(write),
            None => write(),
        }
    }

    /// Something worth knowing; silent with `-q`.
    pub fn note(&self, message: &str) {
        if !self.quiet {
            self.line(Style::new(), "", message);
        }
    }

    /// Something more, with `-v`.
    pub fn detail(&self, message: &str) {
        if self.verbose > 0 {
            self.line(Style::new().dimmed(), "", message);
        }
    }

    /// Something that is not as it should be, and does not end the command.
    pub fn warn(&self, message: &str) {
        if !self.quiet {
            self.line(AnsiColor::Yellow.on_default(), "warning: ", message);
        }
    }

    /// A failure with its hint; as JSON on one line.
    pub fn fail(&self, failure: &ErrorMessage, exit: u8) {
        if self.json {
            let mut out = Vec::new();
            // Writing to memory cannot fail.
            let _ = failure.json(&mut out, exit);
            let _ = io::stderr().write_all(&out);
            return;
        }
        self.line(AnsiColor::Red.on_default().bold(), "cangauge: ", &failure.message);
        if let Some(place) = &failure.place {
            // What is not shown as it is takes more room.
            let before = text::safe(&place.before).chars().count();
            self.line(Style::new(), "  ", &place.text);
            self.line(AnsiColor::Red.on_default().bold(), &format!("  {}^", " ".repeat(before)), "");
        }
        if let Some(hint) = &failure.hint {
            self.line(AnsiColor::Cyan.on_default(), "hint: ", hint);
        }
    }
}
