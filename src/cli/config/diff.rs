//! `cangauge config diff`.

use super::{described, document, file, mistakes};
use crate::cli::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::master::Master;
use cangauge::node::Overrides;
use cangauge::output::config::ChangedSetting;
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes;
use cangauge::tasks::Kind;
use cangauge::tasks::config::diff::{Difference, check_offline, of_devices, of_files, with_file};
use cangauge::tasks::config::{File, Sections, read};
use clap::Args;

/// Compare a device with a file, two devices, or two files; exit 1 if anything differs
///
/// [address] and [calibration] differ between devices, so they are compared only with --address and --with-calibration.
/// In two files they are always compared.
#[derive(Debug, Args)]
pub(super) struct Diff {
    /// Node-ID or file
    #[arg(value_name = "NODE|FILE")]
    first: String,
    /// Node-ID or file
    #[arg(value_name = "NODE|FILE")]
    second: String,
    /// Compare [address], too
    #[arg(long)]
    address: bool,
    /// Compare [calibration], too
    #[arg(long)]
    with_calibration: bool,
}

/// One side of the comparison.
enum Side<'a> {
    Node(NodeId),
    File(&'a str),
}

fn side(text: &str) -> Side<'_> {
    text.parse().map_or(Side::File(text), Side::Node)
}

impl Diff {
    pub(super) fn claim(&self) -> Claim {
        let nodes = [side(&self.first), side(&self.second)].into_iter();
        let nodes: Vec<NodeId> =
            nodes.filter_map(|side| if let Side::Node(node) = side { Some(node) } else { None }).collect();
        if nodes.is_empty() { Claim::Nothing } else { Claim::Nodes(nodes) }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let sections = Sections { address: self.address, calibration: self.with_calibration };
        let difference = match (side(&self.first), side(&self.second)) {
            (Side::Node(node), Side::File(file)) => self.with_file(global, node, file, sections)?,
            (Side::File(file), Side::Node(node)) => {
                let mut difference = self.with_file(global, node, file, sections)?;
                difference.rows.iter_mut().for_each(|row| std::mem::swap(&mut row.before, &mut row.after));
                difference
            }
            (Side::File(first), Side::File(second)) => {
                let (first_document, second_document) = (document(first)?, document(second)?);
                let node = described(&first_document);
                for (file, document) in [(first, &first_document), (second, &second_document)] {
                    if let Some(node) = described(document) {
                        check_offline(document, &node).map_err(|found| mistakes(file, found))?;
                    }
                }
                let all = Sections { address: true, calibration: true };
                of_files(&first_document, &second_document, node.as_ref(), all)
            }
            (Side::Node(first), Side::Node(second)) => {
                let nodes = [first, second];
                let snapshots = global.with_master(|master| {
                    let overrides = descriptions::overrides_on(master, global, &nodes)?;
                    let mut snapshot = |node| read(master, node, &overrides, None);
                    Ok([snapshot(first)?, snapshot(second)?])
                })?;
                of_devices(&snapshots[0], &snapshots[1], sections)
            }
        };
        report(global, &difference)
    }

    fn with_file(&self, global: &Global, node: NodeId, name: &str, sections: Sections) -> anyhow::Result<Difference> {
        let file = file(name, global)?;
        if let File::Settings(document) = &file
            && let Some(described) = described(document)
        {
            check_offline(document, &described).map_err(|found| mistakes(name, found))?;
        }
        let overrides = descriptions::overrides(global, &[node])?;
        let compare = |master: &mut Master<'_>, overrides: &Overrides| {
            let snapshot = read(master, node, overrides, Some(&file))?;
            let (document, notes) = file.document(&snapshot);
            let settings = snapshot.check(&document).map_err(|found| mistakes(name, found))?;
            Ok((with_file(&snapshot, &settings, sections), notes))
        };
        let (difference, notes) = global.with_master(|master| compare(master, &overrides))?;
        notes.iter().for_each(|note| notes::print(&global.console(), note));
        Ok(difference)
    }
}

fn report(global: &Global, difference: &Difference) -> anyhow::Result<()> {
    let rows: Vec<ChangedSetting> = difference.rows.iter().cloned().map(ChangedSetting).collect();
    global.print(&rows)?;
    if !difference.ignored.is_empty() {
        let keys = difference.ignored.join(", ");
        global.console().note(&format!("not compared: {keys} (--address, --with-calibration)"));
    }
    match rows.len() {
        0 => Ok(()),
        1 => Err(ErrorMessage::new(Kind::CheckFailed, "1 setting differs").into()),
        count => Err(ErrorMessage::new(Kind::CheckFailed, format!("{count} settings differ")).into()),
    }
}
