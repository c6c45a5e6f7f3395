//! `cangauge conform`.

use super::journal::SettingsJournal;
use super::{Global, descriptions};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::conform::{CaseRow, ResultRow, left, summary};
use crate::output::failure::ErrorMessage;
use crate::tasks::conform::{Area, CaseResult, ConformFailure, ConformOptions, cases, conform};
use crate::tasks::{Failure, Kind, config};
use clap::Args;
use clap::builder::{PossibleValuesParser, TypedValueParser};

/// Check a device against CiA 301
///
/// The command runs a list of cases. Each case sends requests, right ones and wrong ones, and compares the answers with
/// the standard. It prints a verdict for each case: pass, deviates, not-judged or not-applicable. A deviation that the
/// manual of the device states is reported as known.
///
/// The device should be alone on the bus. If other nodes or other traffic are seen, only one area can be checked
/// (--only). The command writes only objects of 1000h to 1FFFh and settings of the device profile. Afterwards all
/// settings and the NMT state are as before. A reset is part of some cases. Settings of 2000h to 5FFFh that are not
/// stored are lost by it, and are named.
///
/// The exit code is 0 if there is no deviation, or only known ones, and 1 if there is a deviation.
#[derive(Debug, Args)]
#[command(
    after_help = "Areas:\n  sdo            SDO transfers\n  od             object dictionary\n  nmt            NMT states and boot-up\n  error-control  heartbeat and node guarding\n\nExamples:\n  cangauge -b sim:mh4@1 conform 1\n  cangauge -b sim:mh4@1 conform 1 --only sdo --skip SDO-22\n  cangauge -b sim:mh4@1 conform 1 --dry-run"
)]
pub(crate) struct Conform {
    /// Node-ID: 5, 0x7f
    #[arg(value_parser = parse_node)]
    node: NodeId,
    /// Run only the cases of this area
    #[arg(long, value_name = "AREA", value_parser = PossibleValuesParser::new(Area::ALL.map(Area::name)).try_map(|text| text.parse::<Area>()))]
    only: Option<Area>,
    /// Do not run this case: SDO-07. Can be repeated
    #[arg(long, value_name = "CASE", value_parser = parse_case)]
    skip: Vec<String>,
    /// List the cases; use no bus
    #[arg(long)]
    pub(super) dry_run: bool,
}

fn parse_node(text: &str) -> Result<NodeId, String> {
    match text.parse::<super::args::Nodes>()? {
        super::args::Nodes::These(nodes) if nodes.len() == 1 => Ok(nodes[0]),
        _ => Err("conform checks one node".to_owned()),
    }
}

fn parse_case(text: &str) -> Result<String, String> {
    let id = text.to_ascii_uppercase();
    match cases().any(|case| case.id == id) {
        true => Ok(id),
        false => Err(format!("\"{text}\" is not a case (list them: cangauge conform 1 --dry-run)")),
    }
}

impl Conform {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        if self.dry_run { Claim::Nothing } else { Claim::Bus }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let options = ConformOptions { only: self.only, skip: self.skip.clone() };
        if self.dry_run {
            return global.print(&options.selected().map(CaseRow).collect::<Vec<_>>());
        }
        let overrides = descriptions::overrides(global, &[self.node])?;
        let console = global.console();
        let mut stream = global.stream::<ResultRow>()?;
        let (report, printed) = global.with_master(|master| {
            let mut journal = Journal { bus: master.bus().name().to_owned(), console: &console, file: None };
            let mut printed = Ok(());
            let mut observe = |result: &CaseResult| {
                if printed.is_ok() {
                    printed = stream.push(&ResultRow { node: self.node, result: result.clone() });
                }
            };
            let report = conform(master, self.node, &overrides, &options, &mut journal, &mut observe)?;
            Ok((report, printed))
        })?;
        printed.map_err(super::exit::stdout)?;
        console.note(&format!("node {}: {}", self.node, summary(&report)));
        if let Some(left) = left(&report) {
            console.warn(&format!("node {}: {left}", self.node));
        }
        let deviations = report.results.iter().filter(|result| result.is_new_deviation()).count();
        match deviations {
            0 => Ok(()),
            1 => Err(ErrorMessage::new(Kind::CheckFailed, "1 deviation").into()),
            several => Err(ErrorMessage::new(Kind::CheckFailed, format!("{several} deviations")).into()),
        }
    }
}

/// Keeps the settings in the file of `config apply --rollback`.
struct Journal<'a> {
    bus: String,
    console: &'a crate::output::console::Console,
    file: Option<SettingsJournal<'a>>,
}

impl config::Journal for Journal<'_> {
    fn begin(&mut self, before: &config::Snapshot) -> Result<(), Failure> {
        let mut file = SettingsJournal::new(&self.bus, before, self.console);
        if file.latest().is_ok() {
            return Err(Failure::at(before.node.id, ConformFailure::Unfinished));
        }
        file.begin(before)?;
        self.file = Some(file);
        Ok(())
    }

    fn finish(&mut self) {
        if let Some(file) = &mut self.file {
            file.finish();
        }
    }
}
