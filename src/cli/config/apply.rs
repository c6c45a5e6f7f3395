//! `cangauge config apply`.

mod prompt;

use super::table::Table;
use super::{Failures, described, file, mistakes, nodes_and_file, parse};
use crate::cli::args::Nodes;
use crate::cli::exit::{IntoFailure, several_each};
use crate::cli::file::ReportFile;
use crate::cli::journal::SettingsJournal;
use crate::cli::{Global, descriptions, open};
use cangauge::bus::Wall;
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::device::config_file::Document;
use cangauge::master::Master;
use cangauge::node::survey::identify_each;
use cangauge::node::{Node, Overrides};
use cangauge::output::config::{AppliedReport, LineReport};
use cangauge::output::config_record::ConfigRecord;
use cangauge::output::console::Console;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes;
use cangauge::tasks::config::diff::check_offline;
use cangauge::tasks::config::{
    ApplyReport, ConfigFailure, File, FileSettings, Line, Options, Sections, Snapshot, apply, check_device, lines,
    read, resume,
};
use cangauge::tasks::{Failure, Kind, Note};
use clap::Args;
use std::path::{Path, PathBuf};

/// Configure a device from a file: check the file, write the differences, read everything back
///
/// Settings are written in this order: sensor type, unit, digits, filter, limits, other objects, guarding and
/// heartbeat, TPDOs, COB-IDs. With --store, they are then stored. Node-ID and bit rate come last. A second run prints
/// "0 changes". If a write fails, the error lists the written settings and the missing ones. Run the same command again
/// to continue, or with --rollback to restore the old settings. The old settings are kept in $XDG_STATE_HOME/cangauge
/// (or ~/.local/state/cangauge) until the change is complete.
#[derive(Debug, Args)]
pub(super) struct Apply {
    /// Nodes (5, 0x7f, 1-16, 1,5, all), and the file
    #[arg(required = true, value_names = ["NODES", "FILE"], num_args = 1..=2)]
    words: Vec<String>,
    /// Save to non-volatile memory (1010h)
    #[arg(long)]
    store: bool,
    /// Reset the node after storing, and read everything again
    #[arg(long, requires = "store")]
    reset: bool,
    /// Show the writes; change nothing
    #[arg(long)]
    dry_run: bool,
    /// Set settings that are not in the file to their factory defaults
    #[arg(long)]
    exact: bool,
    /// Also set the section [address]: node-ID, bit rate, COB-IDs, SYNC producer. For one node only
    #[arg(long)]
    address: bool,
    /// Also set the section [calibration]. The serial number in the file must be that of the device
    #[arg(long)]
    with_calibration: bool,
    /// Restore the settings saved before the last failed or interrupted apply
    #[arg(long, conflicts_with_all = ["exact", "address", "with_calibration"])]
    rollback: bool,
    /// Configure many devices, one per row. Columns: vendor, product, serial, node (with --address), and one for each
    /// placeholder {NAME} in the settings file. A device that is not in the table is not changed
    #[arg(long, value_name = "FILE.csv", conflicts_with = "rollback")]
    table: Option<PathBuf>,
    /// Configure devices that you plug in one after the other, each with the values of its row. Includes --address and
    /// --store. The result is written to the column "result" of the table. Before you plug in a device, you can type the
    /// serial number on its label: it is compared with the serial number in the device
    #[arg(long, requires = "table", conflicts_with = "dry_run")]
    prompt: bool,
    /// Write a report: time, devices, old and new values, verification. It is HTML if the name ends with .html, else
    /// JSON
    #[arg(long, value_name = "FILE", conflicts_with = "dry_run")]
    record: Option<PathBuf>,
}

/// One device to configure.
struct Job {
    node: NodeId,
    /// The settings file; `None` to use the settings in the journal.
    file: Option<File>,
    /// The name of the file, for messages.
    label: String,
}

/// The results, and the failures of each device.
type Results = (Vec<Outcome>, Failures);

/// Compares vendor and product before the values, because the values of a DCF for another device have no meaning here.
fn check_conditions(document: &Document, snapshot: &Snapshot) -> Result<(), Failure> {
    let conditions = document.entries.iter().filter(|entry| entry.key.starts_with("device."));
    match snapshot.check(&Document { entries: conditions.cloned().collect() }) {
        Ok(conditions) => check_device(&conditions, snapshot, false),
        Err(_) => Ok(()),
    }
}

/// Checks a file against the description of its device. Needs no bus.
fn check_before(document: &Document, file: &str) -> anyhow::Result<()> {
    match described(document) {
        Some(node) => check_offline(document, &node).map_err(|found| mistakes(file, found)),
        None => Ok(()),
    }
}

/// The result for one node: the applied settings, or (--dry-run) the lines to write.
enum Outcome {
    ApplyReport(Box<ApplyReport>),
    Lines(Vec<Line>, Vec<Note>),
}

impl Apply {
    fn nodes(&self) -> Option<Nodes> {
        match (self.rollback, nodes_and_file(&self.words), self.words.as_slice()) {
            (_, Some((nodes, _)), _) => Some(nodes),
            (true, None, [nodes]) => nodes.parse().ok(),
            _ => None,
        }
    }

    pub(super) fn claim(&self) -> Claim {
        match &self.table {
            Some(_) => Claim::every_node(),
            None => self.nodes().map_or(Claim::Nothing, |nodes| nodes.claim()),
        }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let record = self.record.as_ref().map(|path| ReportFile::create(path, false, None)).transpose()?;
        let (device_count, (bus, time), (done, failures)) = match &self.table {
            Some(table) if self.prompt => self.by_prompt(global, table)?,
            Some(table) => self.by_table(global, table)?,
            None => self.by_nodes(global)?,
        };
        if let (Some(file), Some(path)) = (record, &self.record) {
            let applied = done.iter().filter_map(|outcome| match outcome {
                Outcome::ApplyReport(applied) => Some(&**applied),
                Outcome::Lines(..) => None,
            });
            let record = ConfigRecord {
                time,
                bus,
                file: self.words.last().cloned().unwrap_or_default(),
                done: applied.collect(),
                failed: failures.iter().flatten().map(|failure| ErrorMessage::of(failure).message).collect(),
            };
            let is_html = path.extension().is_some_and(|extension| extension == "html");
            file.write(if is_html { record.html() } else { record.json() }.as_bytes())?;
        }
        self.report(global, done)?;
        Ok(several_each(device_count, failures)?)
    }

    /// Configures the nodes named by the user.
    fn by_nodes(&self, global: &Global) -> anyhow::Result<(usize, (String, Wall), Results)> {
        let Some(nodes) = self.nodes() else { return Err(self.usage().into()) };
        let label = self.words.last().cloned().unwrap_or_default();
        let given = nodes_and_file(&self.words).filter(|_| !self.rollback);
        let file = given.map(|(_, name)| file(name, global)).transpose()?;
        if let Some(File::Settings(document)) = &file {
            check_before(document, &label)?;
        }
        let is_one = matches!(&nodes, Nodes::These(nodes) if nodes.len() == 1);
        if self.address && !is_one {
            let message = "--address is for one node, or for a --table: two nodes cannot have the same node-ID";
            return Err(ErrorMessage::usage(message).into());
        }
        global.with_master(|master| {
            let nodes = open::nodes(master, global, &nodes)?;
            let overrides = descriptions::overrides_on(master, global, &nodes)?;
            let job = |node: &NodeId| Job { node: *node, file: file.clone(), label: label.clone() };
            let results = self.work(global, master, nodes.iter().map(job).collect(), &overrides);
            Ok((nodes.len(), ended(master), results))
        })
    }

    /// Reads the table, and fills the settings file with the values of each row.
    fn table(&self, table: &Path) -> anyhow::Result<Table> {
        match self.words.as_slice() {
            [file] => Table::read(table, file, self.sets_address()),
            _ => Err(ErrorMessage::usage("--table replaces NODES: cangauge config apply --table FILE.csv FILE").into()),
        }
    }

    fn sets_address(&self) -> bool {
        self.address || self.prompt
    }

    /// Configures the devices of a table, which are found by their identity.
    fn by_table(&self, global: &Global, table: &Path) -> anyhow::Result<(usize, (String, Wall), Results)> {
        let rows = self.table(table)?.rows;
        rows.iter().try_for_each(|row| check_before(&row.document, &row.label))?;
        global.with_master(|master| {
            let nodes = open::all(master, global)?;
            let overrides = descriptions::overrides_on(master, global, &nodes)?;
            let found = identify_each(master, &nodes, &overrides).or_fail()?;
            let found: Vec<Node> = found.into_iter().filter_map(Result::ok).collect();
            let (mut jobs, mut failures) = (Vec::new(), Failures::new());
            let device_count = rows.len();
            for row in rows {
                let [vendor, product, serial] = row.identity.map(Some);
                let is_this = |node: &&Node| {
                    let identity = &node.identity;
                    (identity.vendor, identity.product, identity.serial) == (vendor, product, serial)
                };
                let matching: Vec<NodeId> = found.iter().filter(is_this).map(|node| node.id).collect();
                match matching[..] {
                    [node] => jobs.push(Job { node, file: Some(File::Settings(row.document)), label: row.label }),
                    _ => {
                        let cause = ConfigFailure::NotOneDevice { serial: row.identity[2], nodes: matching };
                        failures.push(vec![Failure::general(cause)]);
                    }
                }
            }
            let (done, failed) = self.work(global, master, jobs, &overrides);
            failures.extend(failed);
            Ok((device_count, ended(master), (done, failures)))
        })
    }

    /// Configures all devices at the same time; with --address one after the other, because LSS reaches all devices.
    /// Then a bus failure or Ctrl-C ends the work.
    fn work(&self, global: &Global, master: &mut Master<'_>, jobs: Vec<Job>, overrides: &Overrides) -> Results {
        let console = global.console();
        if jobs.len() > 1 && !self.address {
            return split(master.in_parallel(jobs, &|master, job| self.one(&console, master, &job, overrides)));
        }
        let mut results = Vec::new();
        for job in &jobs {
            let result = self.one(&console, master, job, overrides);
            let ends = result.as_ref().is_err_and(|failures| failures.iter().any(ends_all));
            results.push(result);
            if ends {
                break;
            }
        }
        split(results)
    }

    fn usage(&self) -> ErrorMessage {
        let [first, rest @ ..] = self.words.as_slice() else { return ErrorMessage::usage("no nodes and no file") };
        match (first.parse::<Nodes>(), rest.is_empty()) {
            (Ok(_), true) => ErrorMessage::usage("which file? cangauge config apply NODES FILE"),
            (Ok(_), false) | (Err(_), true) => ErrorMessage::usage("which nodes? cangauge config apply NODES FILE"),
            (Err(error), false) => ErrorMessage::usage(error),
        }
    }

    fn options(&self) -> Options {
        let mut arguments: Vec<&str> = self.words.last().map(String::as_str).into_iter().collect();
        let flags = [
            (self.store || self.prompt, "--store"),
            (self.reset, "--reset"),
            (self.exact, "--exact"),
            (self.sets_address(), "--address"),
            (self.with_calibration, "--with-calibration"),
        ];
        arguments.extend(flags.iter().filter(|(is_given, _)| *is_given).map(|(_, flag)| *flag));
        Options {
            sections: Sections { address: self.sets_address(), calibration: self.with_calibration || self.rollback },
            exact: self.exact,
            store: self.store || self.prompt,
            reset: self.reset,
            arguments: arguments.join(" "),
        }
    }

    /// Configures one device.
    fn one(
        &self,
        console: &Console,
        master: &mut Master<'_>,
        job: &Job,
        overrides: &Overrides,
    ) -> Result<Outcome, Vec<Failure>> {
        let as_list = |failure: Failure| vec![failure];
        let node = job.node;
        master.listen_to(&[node]).map_err(|error| as_list(error.into()))?;
        let snapshot = read(master, node, overrides, job.file.as_ref()).map_err(as_list)?;
        let mut journal = SettingsJournal::new(master.bus().name(), &snapshot, console);
        let interrupted = journal.latest().and_then(|(file, text)| {
            let unreadable = || Failure::at(node, ConfigFailure::Journal { reason: file.clone() });
            let document = parse(&file, &text).map_err(|_| unreadable())?;
            Ok((file, document))
        });
        let (file, (document, found)) = match (&job.file, interrupted) {
            (Some(file), interrupted) => {
                let (mut document, found) = file.document(&snapshot);
                if let Ok((_, before)) = interrupted {
                    resume(&mut document, &before);
                }
                (job.label.clone(), (document, found))
            }
            (None, interrupted) => {
                let (file, document) = interrupted.map_err(as_list)?;
                (file, (document, Vec::new()))
            }
        };
        if let Some(File::Dcf(_)) = &job.file {
            check_conditions(&document, &snapshot).map_err(as_list)?;
        }
        let settings: Result<FileSettings, _> = snapshot.check(&document);
        let settings = settings.map_err(|found| ConfigFailure::of_mistakes(&file, Some(node), found))?;
        let options = self.options();
        if self.dry_run {
            check_device(&settings, &snapshot, self.with_calibration).map_err(as_list)?;
            let (lines, notes) = lines(&settings, &snapshot, &options);
            return Ok(Outcome::Lines(lines, found.into_iter().chain(notes).collect()));
        }
        let mut applied = apply(master, snapshot, &settings, &options, overrides, &mut journal).map_err(as_list)?;
        applied.notes.splice(..0, found);
        Ok(Outcome::ApplyReport(Box::new(applied)))
    }

    fn report(&self, global: &Global, done: Vec<Outcome>) -> anyhow::Result<()> {
        let (mut reports, mut steps, mut all_notes) = (Vec::new(), Vec::new(), Vec::new());
        for outcome in done {
            match outcome {
                Outcome::ApplyReport(applied) => {
                    all_notes.extend(applied.notes.iter().cloned());
                    reports.push(AppliedReport(*applied));
                }
                Outcome::Lines(lines, notes) => {
                    all_notes.extend(notes);
                    steps.extend(lines.into_iter().map(LineReport));
                }
            }
        }
        if self.dry_run {
            global.print(&steps)?;
        } else {
            global.print(&reports)?;
        }
        all_notes.iter().for_each(|note| notes::print(&global.console(), note));
        if let [only] = reports.as_slice() {
            global.console().note(&format!("node {}: {}", only.0.node, only.sentence()));
        }
        Ok(())
    }
}

/// The results, and the failures of each device.
fn split(results: Vec<Result<Outcome, Vec<Failure>>>) -> Results {
    let (mut done, mut failures) = (Vec::new(), Failures::new());
    for result in results {
        match result {
            Ok(outcome) => done.push(outcome),
            Err(of_node) => failures.push(of_node),
        }
    }
    (done, failures)
}

/// Whether a failure ends the work on all devices: the bus failed, or Ctrl-C.
fn ends_all(failure: &Failure) -> bool {
    matches!(failure.kind(), Kind::Interrupted | Kind::Bus)
}

/// Returns the name of the bus and the present time.
fn ended(master: &mut Master<'_>) -> (String, Wall) {
    let bus = master.bus();
    (bus.name().to_owned(), bus.now().wall)
}
