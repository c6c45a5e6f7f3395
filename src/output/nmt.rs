//! Reports of `nmt`.

use super::report::{Cell, Column, Report, rows_only};
use crate::bus::time::format_duration;
use crate::tasks::nmt::{Change, Starts, StartupReport, StateEvent, StateReport, UnrestoredHeartbeat};
use std::io::{self, Write};

impl Report for StateReport {
    const COLUMNS: &'static [Column] = &[Column::new("node").right(), Column::new("state"), Column::new("by")];

    fn cells(&self) -> Vec<Cell> {
        vec![self.node.into(), self.state.map(|state| state.to_string()).into(), self.by.as_str().into()]
    }

    fn text(reports: &[StateReport], out: &mut dyn Write) -> io::Result<()> {
        rows_only(reports, out)
    }
}

impl Report for StateEvent {
    const COLUMNS: &'static [Column] =
        &[Column::new("time"), Column::new("node"), Column::new("event"), Column::new("state")];

    fn cells(&self) -> Vec<Cell> {
        let (event, state) = match self.change {
            Change::State(state) => ("state", Some(state)),
            Change::BootUp => ("boot-up", None),
            Change::Lost(_) => ("lost", None),
            Change::Back(state) => ("back", Some(state)),
        };
        vec![time(self).into(), self.node.into(), event.into(), state.map(|state| state.to_string()).into()]
    }

    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        let event = match self.change {
            Change::State(state) => format!("state {state}"),
            Change::Back(state) => format!("back {state}"),
            Change::Lost(silence) => format!("lost: no heartbeat for {}", format_duration(silence)),
            Change::BootUp => "boot-up".to_owned(),
        };
        writeln!(out, "{}  {:>3}  {event}", time(self), self.node)
    }
}

fn time(event: &StateEvent) -> String {
    humantime::format_rfc3339_micros(event.at.wall.system_time()).to_string()
}

impl Report for StartupReport {
    const COLUMNS: &'static [Column] = &[Column::new("node"), Column::new("startup"), Column::new("raw")];

    fn cells(&self) -> Vec<Cell> {
        vec![self.node.into(), word(self).into(), self.raw.into()]
    }

    fn text(reports: &[StartupReport], out: &mut dyn Write) -> io::Result<()> {
        reports.iter().try_for_each(|report| writeln!(out, "{}", word(report)))
    }
}

fn word(report: &StartupReport) -> String {
    match report.starts {
        Starts::Wait => "wait".to_owned(),
        Starts::Auto => "auto".to_owned(),
        Starts::Other(raw) => format!("0x{raw:X}"),
    }
}

/// The warning about a heartbeat time that a probe could not restore.
pub fn left_heartbeat(left: UnrestoredHeartbeat) -> String {
    let verb = if left.is_certain { "stays" } else { "may stay" };
    format!("1017h {verb} at {} ms; it was {} ms", left.milliseconds, left.before)
}
