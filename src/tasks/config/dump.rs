//! Converts the settings of a device to the rows of a file.

use super::identity::Range;
use super::setting::{Form, Setting, Stage};
use super::snapshot::Snapshot;
use super::value::Content;
use crate::canopen::id::NodeId;
use crate::device::config_file::Item;
use crate::device::sensor;

/// One line of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// The node.
    pub node: NodeId,
    /// The path: `tpdo.1.event-timer`.
    pub key: String,
    /// The value.
    pub value: Item,
    /// Whether the value is the factory default; `None` if the default is unknown.
    pub is_default: Option<bool>,
    /// Whether the value cannot be changed.
    pub is_fixed: bool,
    /// The meaning of a number on this device.
    pub meaning: Option<String>,
}

/// The settings of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Dump {
    /// The name on the label of the device.
    pub title: Option<String>,
    /// The revision and the serial number.
    pub revision_and_serial: [Option<u32>; 2],
    /// The dates of calibration and production.
    pub dates: Vec<(&'static str, String)>,
    /// The settings, in the order of the sections.
    pub rows: Vec<Row>,
    /// Objects that cannot be read, with the reason.
    pub unreadable: Vec<String>,
}

/// The sections of a file, in their order.
pub const SECTIONS: [&str; 7] = ["device", "address", "node", "signal", "tpdo", "object", "calibration"];

/// Returns the path of a value in a file; explicit COB-IDs are in `[address]`.
pub(super) fn path(setting: &Setting, content: &Content) -> String {
    match (&setting.form, content) {
        (Form::CobId(default), Content::Number(id))
            if *id != u32::from(*default) && !setting.key.starts_with("address.") =>
        {
            format!("address.{}", setting.key)
        }
        _ => setting.key.clone(),
    }
}

impl Snapshot {
    /// Returns the settings as rows of a file. With `changed`, factory defaults and fixed values are omitted.
    pub fn dump(&self, changed: bool) -> Dump {
        let (node, identity, kind) = (self.node.id, &self.node.identity, self.kind());
        let row = |key: &str, value: Item| Row {
            node,
            key: key.to_owned(),
            value,
            is_default: None,
            is_fixed: false,
            meaning: None,
        };
        let mut rows = Vec::new();
        rows.extend(kind.name.map(|name| Row { meaning: kind.title.clone(), ..row("device.kind", Item::Text(name)) }));
        let code = |number: u32| Item::Text(format!("0x{number:X}"));
        rows.extend(identity.vendor.map(|vendor| row("device.vendor", code(vendor))));
        rows.extend(identity.product.map(|product| row("device.product", code(product))));
        let range = |range: &Range| row(&format!("device.range.{}", range.signal), Item::Text(range.text()));
        rows.extend(kind.ranges.iter().map(range));
        rows.extend(kind.reference.map(|reference| row("device.reference", Item::Text(reference))));
        let mut settings: Vec<Row> = self.settings.iter().filter_map(|setting| self.row(setting)).collect();
        if changed {
            settings.retain(|row| row.is_default != Some(true) && !row.is_fixed);
        }
        let has_calibration = settings.iter().any(|row| row.key.starts_with("calibration."));
        settings.extend(
            identity
                .serial
                .filter(|_| has_calibration)
                .map(|serial| row("calibration.serial", Item::Integer(serial.into()))),
        );
        settings.sort_by_key(|row| (section(&row.key), row.key != "calibration.serial"));
        rows.extend(settings);
        let unreadable =
            self.unreadable.iter().map(|(object, code)| format!("{} ({code})", self.node.name_of(*object)));
        Dump {
            title: kind.title,
            revision_and_serial: [identity.revision, identity.serial],
            dates: kind.dates,
            rows,
            unreadable: unreadable.collect(),
        }
    }

    fn row(&self, setting: &Setting) -> Option<Row> {
        let content = self.content(setting)?;
        let number = match &content {
            Content::Bytes(bytes) => setting.data_type.decode(bytes).ok().and_then(|value| value.as_u64()),
            Content::Number(_) | Content::Mapping(_) => None,
        };
        let value = setting.show(&self.node, &self.scales, &content);
        let is_number = matches!(value, Item::Integer(_));
        let described = |number| self.node.described(setting.object).and_then(|entry| entry.meaning(number));
        let kind = |number| u16::try_from(number).ok().and_then(sensor::kind);
        let meaning = number.filter(|_| is_number).and_then(|number| match setting.stage {
            Stage::Tpdo(_) => None,
            _ if setting.object.index == 0x6110 => described(number).or_else(|| kind(number)),
            _ => described(number),
        });
        Some(Row {
            node: self.node.id,
            key: path(setting, &content),
            value,
            is_default: self.is_default(setting),
            is_fixed: !setting.is_writable,
            meaning: meaning.map(str::to_owned),
        })
    }
}

/// Returns the position of the section of a key in [`SECTIONS`].
pub(super) fn section(key: &str) -> usize {
    let first = key.split('.').next().unwrap_or_default();
    SECTIONS.iter().position(|section| *section == first).unwrap_or(SECTIONS.len())
}

impl Range {
    /// Returns the range as text: `0 bar to 10 bar`, or `100 psi` if only the width is known.
    pub fn text(&self) -> String {
        let unit = self.unit.map(|unit| format!(" {unit}")).unwrap_or_default();
        let end = format!("{}{unit}", self.end);
        self.start.map_or_else(|| end.clone(), |start| format!("{start}{unit} to {end}"))
    }
}
