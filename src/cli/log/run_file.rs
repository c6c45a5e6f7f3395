//! Writes the file of the run to the folder of the recording.

use super::super::args::BusSpec;
use super::super::file::ReportFile;
use cangauge::bus::Wall;
use cangauge::bus::host::{host_name, new_run_id};
use cangauge::node::Node;
use cangauge::output::run_file::{RunNode, RunRecord};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// The file of the run, which is written before the first row.
#[derive(Debug)]
pub(super) struct RunFile {
    file: ReportFile,
    record: RunRecord,
}

/// Returns the path of the run file of a recording: `run.csv.run.json`. Rotated files share one run file.
pub(super) fn run_file_name(recording: &Path) -> PathBuf {
    let mut name = recording.file_name().map(OsString::from).unwrap_or_default();
    name.push(".run.json");
    recording.with_file_name(name)
}

/// Creates the record of a run that starts at `start`. The caller adds the file and the nodes.
pub(super) fn new_run(bus: &BusSpec, tags: &[(String, String)], start: Wall) -> RunRecord {
    let host = host_name();
    let bench_tag = tags.iter().find(|(key, _)| key == "bench").map(|(_, bench)| bench.clone());
    RunRecord {
        run: new_run_id(start),
        version: env!("CARGO_PKG_VERSION"),
        command: std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect(),
        bus: bus.to_string(),
        bench: bench_tag.unwrap_or_else(|| format!("{host}-{}", bus.short_name())),
        host,
        tags: tags.to_vec(),
        ..RunRecord::default()
    }
}

impl RunFile {
    pub(super) fn new(file: ReportFile, record: RunRecord) -> RunFile {
        RunFile { file, record }
    }

    pub(super) fn set_nodes(&mut self, nodes: &[Node]) {
        self.record.nodes = nodes.iter().map(RunNode::from).collect();
    }

    /// Writes the file; `start` is the time of the first row.
    pub(super) fn write(mut self, start: Wall) -> anyhow::Result<()> {
        self.record.started = start;
        self.file.write(&self.record.line()?)
    }
}
