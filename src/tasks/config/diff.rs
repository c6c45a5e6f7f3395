//! Compares settings: of a device and a file, of two files, of two devices.

use super::apply::Row;
use super::check::{FileSettings, Sections, check};
use super::conditions::unmet;
use super::dump;
use super::setting::settings;
use super::snapshot::Snapshot;
use super::value::Scales;
use crate::device::config_file::{Document, Item};
use crate::node::Node;
use std::collections::BTreeMap;

/// The differing settings, and the differing keys in ignored sections.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Difference {
    /// The settings that differ.
    pub rows: Vec<Row>,
    /// Keys of `[address]` and `[calibration]`.
    pub ignored: Vec<String>,
}

impl Difference {
    fn add(&mut self, row: Row, sections: Sections) {
        if sections.include(&row.key) { self.rows.push(row) } else { self.ignored.push(row.key) }
    }
}

/// Compares a device with a file that was checked against it.
pub fn with_file(snapshot: &Snapshot, file: &FileSettings, sections: Sections) -> Difference {
    let mut difference = Difference::default();
    for (entry, found) in unmet(file, snapshot) {
        difference.add(Row { key: entry.key.clone(), before: found, after: Some(entry.value.clone()) }, sections);
    }
    for wanted in &file.wanted {
        if snapshot.content(&wanted.setting).as_ref() != Some(&wanted.content) {
            let after = wanted.setting.show(&snapshot.node, &file.scales, &wanted.content);
            let row = Row { key: wanted.entry.key.clone(), before: snapshot.show(&wanted.setting), after: Some(after) };
            difference.add(row, sections);
        }
    }
    difference
}

/// Compares two devices.
pub fn of_devices(first: &Snapshot, second: &Snapshot, sections: Sections) -> Difference {
    let items = |snapshot: &Snapshot| -> BTreeMap<String, Item> {
        snapshot.dump(false).rows.into_iter().map(|row| (row.key, row.value)).collect()
    };
    compare(&items(first), &items(second), sections, &|_, first, second| first == second)
}

/// Compares two files. Different texts with the same meaning on the device of the first file are equal.
pub fn of_files(first: &Document, second: &Document, node: Option<&Node>, sections: Sections) -> Difference {
    let items = |document: &Document| -> BTreeMap<String, Item> {
        document.entries.iter().map(|entry| (entry.key.clone(), entry.value.clone())).collect()
    };
    let catalog = node.map(|node| (node, settings(node)));
    let is_same = |key: &str, first: &Item, second: &Item| {
        let means_same = || {
            let (node, catalog) = catalog.as_ref()?;
            let setting = catalog.iter().find(|setting| setting.key == key)?;
            let content = |item| setting.read(node, &Scales::of(node), item).ok().flatten();
            Some(content(first)? == content(second)?)
        };
        first == second || means_same() == Some(true)
    };
    compare(&items(first), &items(second), sections, &is_same)
}

fn compare(
    first: &BTreeMap<String, Item>,
    second: &BTreeMap<String, Item>,
    sections: Sections,
    is_same: &dyn Fn(&str, &Item, &Item) -> bool,
) -> Difference {
    let mut keys: Vec<&String> = first.keys().chain(second.keys()).collect();
    keys.sort_by_key(|key| (dump::section(key), *key));
    keys.dedup();
    let mut difference = Difference::default();
    for key in keys {
        let (before, after) = (first.get(key), second.get(key));
        let is_equal = matches!((before, after), (Some(before), Some(after)) if is_same(key, before, after));
        if !is_equal {
            let row = Row { key: key.clone(), before: before.cloned(), after: after.cloned() };
            difference.add(row, sections);
        }
    }
    difference
}

/// Checks a file against the description of its device. Needs no bus.
///
/// # Errors
/// All mistakes in the file.
pub fn check_offline(document: &Document, node: &Node) -> Result<(), Vec<super::Mistake>> {
    let mut catalog = settings(node);
    catalog.extend(super::check::named_objects(document, node, &catalog));
    check(document, node, &catalog, None).map(drop)
}
