//! `cangauge conform`.

mod stimulus;

use super::exit::{FileError, stdout};
use super::file::ReportFile;
use super::journal::SettingsJournal;
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::output::conform::{CaseRow, ConformRecord, ResultRow, SavedReport, left, summary, write_skipped};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::stdout_width;
use cangauge::tasks::conform::{Area, CaseResult, ConformFailure, ConformOptions, Stimulus, cases, conform};
use cangauge::tasks::{Failure, Kind, config};
use clap::builder::{PossibleValuesParser, TypedValueParser};
use clap::{Args, Subcommand};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use stimulus::StimulusCommand;

/// Check a device against CiA 301, CiA 305, CiA 404 and its EDS
///
/// The command runs a list of cases. Each case sends requests, right ones and wrong ones, and compares the answers with
/// the standard. It prints a verdict for each case: pass, deviates, not-judged or not-applicable. A deviation that the
/// manual of the device documents is reported as known. The cases of the area "timing" print measured times and no
/// verdict.
///
/// The device should be alone on the bus. If other nodes or other traffic are seen, only areas other than pdo and
/// lss can be checked (--only): they send nothing to other nodes. The command writes only objects of 1000h to
/// 1FFFh and settings of the device profile. Afterwards all settings and the NMT state are as before.
///
/// With --store, the command also stores settings, restores factory defaults, stores the present node-ID and bit rate
/// by LSS, sets other bit rates by LSS, and executes and undoes autozero. No bit rate is activated, and the present one
/// is set again. At the end the command stores the settings that the device had at the start.
///
/// With --eds FILE, the EDS or DCF file is also checked against CiA 306 and compared with the device: existence, size,
/// access, limits and mapping of each object, and with --store its defaults.
///
/// With --stimulus CMD, the first channel with a filter is checked with a step of its input, and the first channel that
/// can show overloads with a value outside of its measuring range. A failure of CMD, or no end within 60 s, is reported
/// as not-judged. CMD is always run with "normal" at the end.
///
/// Some cases reset the device. Without --store, settings in 2000h to 5FFFh that were not stored are then lost. They
/// are listed as "not restored" if the object dictionary of the device is known. If the error history (1003h) is not as
/// before, the last line shows it.
///
/// The exit code is 0 if there is no deviation, or only known ones, and 1 if there is a deviation.
#[derive(Debug, Args)]
#[command(
    args_conflicts_with_subcommands = true,
    subcommand_negates_reqs = true,
    after_help = "\
Areas:
  sdo            SDO transfers
  od             object dictionary
  nmt            NMT states and boot-up
  error-control  heartbeat and node guarding
  pdo            TPDOs and mapping
  emcy           emergencies and error history
  store          store and restore
  lss            LSS services
  404            analogue inputs of CiA 404
  eds            EDS file (--eds)
  timing         timing profile: figures without a verdict

Examples:
  cangauge -b sim:mh4@1 conform 1
  cangauge -b sim:mh4@1 conform 1 --only sdo,nmt --skip SDO-22
  cangauge -b sim:mh4@1 conform 1 --report new.html --report new.json
  cangauge conform 5 --eds sensor.eds --report new.html
  cangauge conform 5 --only 404 --stimulus ./pressure.sh
  cangauge conform diff old.json new.json
  cangauge -b sim:mh4@1 conform 1 --dry-run"
)]
pub(crate) struct Conform {
    #[command(subcommand)]
    other: Option<Other>,
    /// Node-ID: 5, 0x7f
    #[arg(value_parser = parse_node, required = true)]
    node: Option<NodeId>,
    /// Run only the cases of these areas: sdo,nmt. Can be repeated
    #[arg(long, value_name = "AREA", value_delimiter = ',', value_parser = PossibleValuesParser::new(Area::ALL.map(Area::name)).try_map(|text| text.parse::<Area>()))]
    only: Vec<Area>,
    /// Do not run these cases: SDO-07,SDO-22. Can be repeated
    #[arg(long, value_name = "CASE", value_delimiter = ',', value_parser = parse_case)]
    skip: Vec<String>,
    /// Also run the cases that write to non-volatile memory, set the node-ID or the bit rate, or execute autozero
    #[arg(long)]
    store: bool,
    /// Run the cases that need another input of the device. The shell command CMD sets the input: it is run with the
    /// argument step, overload-high, overload-low or normal, and ends when the input is set
    #[arg(long, value_name = "CMD")]
    stimulus: Option<String>,
    /// Write the verdicts as JUnit XML, for CI servers. An existing file is replaced
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write a report with the frames of each deviation: FILE.html to print, or FILE.json for conform diff. Can be
    /// repeated. An existing file is replaced
    #[arg(long, value_name = "FILE", value_parser = parse_report)]
    report: Vec<PathBuf>,
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

/// The other use of the command.
#[derive(Debug, Subcommand)]
enum Other {
    Diff(Diff),
}

/// Compare two reports of conform, for example of an old and a new firmware
///
/// The command lists the cases whose verdict or findings differ. In the area "timing", a median or mean differs if it
/// changes by more than 50 % and by more than 2 ms. Another figure differs if it changes by more than a factor of 3 and
/// by more than 10 ms. The exit code is 0 if nothing differs, and 1 otherwise.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge conform diff old.json new.json")]
struct Diff {
    /// The first report, from --report FILE.json
    #[arg(value_name = "A")]
    first: PathBuf,
    /// The second report
    #[arg(value_name = "B")]
    second: PathBuf,
}

impl Diff {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let read = |path: &Path| -> anyhow::Result<SavedReport> {
            let what = || format!("read {}", path.display());
            let text = std::fs::read_to_string(path).map_err(|source| FileError { what: what(), source })?;
            let wrong = |error| ErrorMessage::usage(format!("{}: not a report of conform: {error}", path.display()));
            Ok(SavedReport::parse(&text).map_err(wrong)?)
        };
        let rows = read(&self.first)?.diff(read(&self.second)?);
        global.print(&rows)?;
        match rows.len() {
            0 => Ok(()),
            1 => Err(ErrorMessage::new(Kind::CheckFailed, "1 case differs").into()),
            several => Err(ErrorMessage::new(Kind::CheckFailed, format!("{several} cases differ")).into()),
        }
    }
}

fn parse_report(text: &str) -> Result<PathBuf, String> {
    let path = PathBuf::from(text);
    match path.extension().and_then(|extension| extension.to_str()) {
        Some("html" | "json") => Ok(path),
        _ => Err("the name of a report ends in .html or .json".to_owned()),
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
        if self.only_reads() { Claim::Nothing } else { Claim::Bus }
    }

    /// Whether the command uses no bus.
    pub(super) fn only_reads(&self) -> bool {
        self.dry_run || self.other.is_some()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match (&self.other, self.node) {
            (Some(Other::Diff(diff)), _) => diff.run(global),
            (None, Some(node)) => self.check(global, node),
            (None, None) => Err(ErrorMessage::usage("which node? cangauge conform NODE").into()),
        }
    }

    fn check(&self, global: &Global, node: NodeId) -> anyhow::Result<()> {
        let eds = descriptions::file_of(global, node)?.map(Arc::new);
        let options = ConformOptions { only: self.only.clone(), skip: self.skip.clone(), store: self.store, eds };
        if self.dry_run {
            return global.print(&options.selected().map(CaseRow).collect::<Vec<_>>());
        }
        let open = |path: &PathBuf| ReportFile::create(path, false, None).map(|file| (path.clone(), file));
        let junit = self.junit.as_ref().map(open).transpose()?;
        let files = self.report.iter().map(open).collect::<anyhow::Result<Vec<_>>>()?;
        let overrides = descriptions::overrides(global, &[node])?;
        let console = global.console();
        let mut stream = global.stream::<ResultRow>()?;
        let width = stdout_width();
        let (report, bus, printed) = global.with_master(|master| {
            let mut journal = Journal { bus: master.bus().name().to_owned(), console: &console, file: None };
            let mut printed = Ok(());
            let mut observe = |result: &CaseResult| {
                if printed.is_ok() {
                    printed = stream.push(&ResultRow { node, result: result.clone(), width });
                }
            };
            let mut command = self.stimulus.as_deref().map(StimulusCommand::new).transpose()?;
            let stimulus = command.as_mut().map(|command| command as &mut dyn Stimulus);
            let report = conform(master, node, &overrides, &options, stimulus, &mut journal, &mut observe)?;
            let bus = (master.bus().name().to_owned(), master.bus().bit_rate(), master.bus().now().wall);
            Ok((report, bus, printed))
        })?;
        printed.map_err(stdout)?;
        stream.end_text(|out| write_skipped(&report.results, width, out)).map_err(stdout)?;
        let command = std::env::args_os().map(|word| word.to_string_lossy().into_owned()).collect::<Vec<_>>().join(" ");
        let (bus, bit_rate, time) = bus;
        let record = ConformRecord { time, bus: &bus, bit_rate, command: &command, report: &report };
        for (path, file) in files {
            let is_html = path.extension().is_some_and(|extension| extension == "html");
            file.write(if is_html { record.html() } else { record.json() }.as_bytes())?;
        }
        if let Some((_, file)) = junit {
            file.write(record.junit().as_bytes())?;
        }
        console.note(&format!("node {node}: {}", summary(&report)));
        if let Some(left) = left(&report) {
            console.warn(&format!("node {node}: {left}"));
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
    console: &'a cangauge::output::console::Console,
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
