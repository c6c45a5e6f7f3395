//! `config apply --table FILE.csv --prompt`: sets the devices of a table, which are plugged in one after the other.

use super::super::table::{OK, Table};
use super::{Apply, Job, Outcome, Results, check_before, ended, ends_all};
use crate::cli::{Global, descriptions};
use cangauge::bus::typed::TypedLines;
use cangauge::bus::{BusError, Wall};
use cangauge::canopen::id::parse_u32;
use cangauge::master::Master;
use cangauge::output::config::AppliedReport;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes;
use cangauge::tasks::config::{Arrivals, ConfigFailure, File, assign_first};
use cangauge::tasks::failure::Cause;
use cangauge::tasks::lss::FoundSlave;
use cangauge::tasks::{Failure, Note};
use std::collections::BTreeMap;
use std::io::{self, IsTerminal};
use std::path::Path;

/// The devices of a table, one after the other.
struct Series<'a> {
    apply: &'a Apply,
    global: &'a Global,
    table: Table,
    typed: TypedLines,
    arrivals: Arrivals,
    /// The results of the devices that were set.
    done: Vec<Outcome>,
    /// The failures of the last attempt, by row.
    failed: BTreeMap<usize, Vec<Failure>>,
}

/// Why the series ended.
enum End {
    /// Every device of the table is set.
    Complete,
    /// The input ended (Ctrl-D).
    Input,
}

impl Apply {
    /// Sets the devices of a table, which are plugged in one after the other.
    pub(super) fn by_prompt(&self, global: &Global, table: &Path) -> anyhow::Result<(usize, (String, Wall), Results)> {
        let table = self.table(table)?;
        table.rows.iter().try_for_each(|row| check_before(&row.document, &row.label))?;
        if !io::stdin().is_terminal() {
            return Err(ErrorMessage::usage("--prompt needs a terminal: someone plugs in the devices").into());
        }
        global.with_master(|master| {
            let mut series = Series {
                apply: self,
                global,
                table,
                typed: TypedLines::open(),
                arrivals: Arrivals::default(),
                done: Vec::new(),
                failed: BTreeMap::new(),
            };
            let result = series.carry_out(master);
            let device_count = series.table.rows.len();
            let mut failures: Vec<Vec<Failure>> = series.failed.into_values().collect();
            match result? {
                Ok(End::Complete) => {}
                Ok(End::Input) if series.done.is_empty() && failures.is_empty() => {
                    return Err(ErrorMessage::usage("the input ended before the first device").into());
                }
                Ok(End::Input) => {
                    let serials = (0..device_count).filter(|row| !series.table.is_done(*row));
                    let serials = serials.map(|row| series.table.rows[row].identity[2]).collect();
                    failures.push(vec![Failure::general(ConfigFailure::NotPluggedIn { serials })]);
                }
                Err(failure) => failures.push(vec![failure]),
            }
            Ok((device_count, ended(master), (series.done, failures)))
        })
    }
}

/// Whether no node acknowledges the frames: the only device was unplugged too early.
fn is_unplugged(failure: &Failure) -> bool {
    matches!(&failure.cause, Cause::Bus(error) if matches!(**error, BusError::QueueFull))
}

impl Series<'_> {
    /// Sets the devices until the table is complete or the input ends. The outer error is about a local file, the inner
    /// error about the bus (or Ctrl-C).
    fn carry_out(&mut self, master: &mut Master<'_>) -> anyhow::Result<Result<End, Failure>> {
        loop {
            let remaining = (0..self.table.rows.len()).filter(|row| !self.table.is_done(*row)).count();
            if remaining == 0 {
                return Ok(Ok(End::Complete));
            }
            self.note(&format!("plug in the next sensor ({remaining} left; Ctrl-D ends)"));
            let (found, label) = match self.next(master) {
                Ok(Some(next)) => next,
                Ok(None) => return Ok(Ok(End::Input)),
                Err(failure) => return Ok(Err(failure)),
            };
            if let Err(failure) = self.work_on(master, &found, label.as_deref())? {
                return Ok(Err(failure));
            }
            self.note("unplug the sensor");
            loop {
                match self.arrivals.is_unplugged(master, &found) {
                    Ok(false) if self.typed.take().is_ok() => {}
                    Ok(false) => return Ok(Ok(End::Input)),
                    Ok(true) => break,
                    Err(failure) => return Ok(Err(failure)),
                }
            }
        }
    }

    /// Waits for exactly one new device. Returns the device, and the serial number on its label if the user typed it
    /// during the wait. Returns `None` if the input ended.
    fn next(&mut self, master: &mut Master<'_>) -> Result<Option<(FoundSlave, Option<String>)>, Failure> {
        let (mut label, mut reported) = (None, 0);
        loop {
            match self.typed.take() {
                Ok(line) => label = line.filter(|line| !line.trim().is_empty()).or(label),
                Err(_) => return Ok(None),
            }
            let mut found = self.arrivals.search(master)?;
            match found.len() {
                0 => reported = 0,
                1 => return Ok(found.pop().map(|found| (found, label))),
                count if count != reported => {
                    self.global.console().warn(&format!("{count} new devices: plug in one at a time"));
                    reported = count;
                }
                _ => {}
            }
        }
    }

    /// Sets a device if it is in the table.
    fn work_on(
        &mut self,
        master: &mut Master<'_>,
        found: &FoundSlave,
        label: Option<&str>,
    ) -> anyhow::Result<Result<(), Failure>> {
        let name = match found.address {
            Some(address) => format!("serial number {}", address.serial),
            None => "the device does not report its identity (1018h:1 to 4)".to_owned(),
        };
        let identity = found.address.map(|address| [address.vendor, address.product, address.serial]);
        let Some(row) = self.table.rows.iter().position(|row| Some(row.identity) == identity) else {
            self.global.console().warn(&format!("{name}: not in the table; nothing was changed"));
            return Ok(Ok(()));
        };
        if let Some(label) = label.filter(|label| parse_u32(label.trim()) != identity.map(|identity| identity[2])) {
            let label = label.trim();
            self.global.console().warn(&format!("{name}: the label has {label}; nothing was changed"));
            return Ok(Ok(()));
        }
        let text = match self.set(master, found, row)? {
            Ok(outcome) => {
                let (node, sentence) = match &outcome {
                    Outcome::ApplyReport(applied) => {
                        (applied.after.node.id, AppliedReport((**applied).clone()).sentence())
                    }
                    Outcome::Lines(..) => return Ok(Ok(())),
                };
                self.done.push(outcome);
                self.failed.remove(&row);
                format!("{OK}: node {node}, {sentence}")
            }
            Err(failures) => {
                if let Some(end) = failures.iter().find(|failure| ends_all(failure) && !is_unplugged(failure)) {
                    return Ok(Err(end.clone()));
                }
                let messages: Vec<String> = failures.iter().map(|failure| ErrorMessage::of(failure).message).collect();
                self.failed.insert(row, failures);
                format!("failed: {}", messages.join("; "))
            }
        };
        self.note(&format!("{name}: {text}"));
        self.table.write_result(row, text)?;
        Ok(Ok(()))
    }

    /// Sets the device of a row. A device without a node-ID first gets the node-ID of the row.
    fn set(
        &mut self,
        master: &mut Master<'_>,
        found: &FoundSlave,
        row: usize,
    ) -> anyhow::Result<Result<Outcome, Vec<Failure>>> {
        let console = self.global.console();
        let row = &self.table.rows[row];
        let mut node = found.node;
        if let (None, Some(address)) = (node, found.address) {
            let Some(id) = row.node else {
                return Ok(Err(vec![Failure::general(ConfigFailure::NoNodeId { serial: address.serial })]));
            };
            let overrides = descriptions::overrides(self.global, &[id])?;
            let mut notify = |note: Note| notes::print(&console, &note);
            if let Err(failure) = assign_first(master, address, id, &overrides, &mut notify) {
                return Ok(Err(vec![failure]));
            }
            node = Some(id);
        }
        let Some(node) = node else { return Ok(Err(Vec::new())) };
        let overrides = descriptions::overrides_on(master, self.global, &[node])?;
        let job = Job { node, file: Some(File::Settings(row.document.clone())), label: row.label.clone() };
        Ok(self.apply.one(&console, master, &job, &overrides))
    }

    fn note(&self, text: &str) {
        self.global.console().note(text);
    }
}
