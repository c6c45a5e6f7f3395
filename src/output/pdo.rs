//! The reports of TPDOs: their settings and values.

use super::failure::pdo::entry;
use super::report::{Cell, Column, Report, joined};
use super::{notes, text};
use crate::bus::Stamp;
use crate::bus::time::format_duration;
use crate::canopen::id::NodeId;
use crate::canopen::pdo::TpdoNumber;
use crate::measure::sample::{Sample, Source, Status};
use crate::tasks::pdo::{MapReport, MappedItem, TpdoReport};
use std::io::{self, Write};
use std::time::Duration;

const TPDO_COLUMNS: [Column; 10] = [
    Column::new("node").data_only(),
    Column::new("pdo").right(),
    Column::new("cob_id").heading("COB-ID"),
    Column::new("valid").data_only(),
    Column::new("rtr").data_only(),
    Column::new("transmission").heading("SENT"),
    Column::new("event_timer_ms").heading("TIMER").right(),
    Column::new("inhibit_us").heading("INHIBIT").right(),
    Column::new("mapping").json_only(),
    Column::new("mapping").not_json(),
];

impl Report for TpdoReport {
    const COLUMNS: &'static [Column] = &TPDO_COLUMNS;

    fn cells(&self) -> Vec<Cell> {
        let settings = &self.settings;
        let is_valid = settings.cob_id.is_valid();
        let sent = settings.transmission().to_string();
        let sent_or_off = if is_valid { sent.clone() } else { format!("off ({sent})") };
        let timer = settings.event_timer_ms.map(|timer| Duration::from_millis(timer.into()));
        let entries = self.items.iter().map(|item| Cell::from(entry(item.entry)).shown_as(entry_text(item)));
        let mut mapping = Cell::List(entries.collect());
        if self.items.is_empty() {
            mapping = mapping.shown_as("nothing");
        }
        vec![
            self.node.into(),
            settings.number.get().into(),
            Cell::Text(format!("0x{}", settings.cob_id.can_id())),
            is_valid.into(),
            settings.cob_id.allows_rtr().into(),
            Cell::from(sent).shown_as(sent_or_off),
            Cell::from(settings.event_timer_ms).shown_as(time(timer)),
            Cell::from(settings.inhibit_100us.map(|inhibit| 100 * u32::from(inhibit))).shown_as(time(self.inhibit())),
            Cell::List(self.items.iter().map(entry_cell).collect()),
            mapping,
        ]
    }
}

impl Report for MapReport {
    const COLUMNS: &'static [Column] = &joined::<10, 3, 13>(
        TPDO_COLUMNS,
        [Column::new("writes").json_only(), Column::new("stored").json_only(), Column::new("notes").json_only()],
    );

    fn cells(&self) -> Vec<Cell> {
        let mut cells = self.shown.cells();
        cells.extend([self.writes.into(), self.stored.into(), notes::cell(&self.notes)]);
        cells
    }
}

fn time(time: Option<Duration>) -> String {
    match time {
        None => "-".to_owned(),
        Some(time) if time.is_zero() => "0".to_owned(),
        Some(time) => format_duration(time),
    }
}

fn entry_cell(item: &MappedItem) -> Cell {
    Cell::Object(vec![
        ("object", item.entry.object.into()),
        ("bits", item.entry.bits.into()),
        ("signal", item.signal.as_ref().into()),
        ("unit", item.unit.into()),
    ])
}

/// `0x6130:1/32 pressure [bar]`.
fn entry_text(item: &MappedItem) -> String {
    let mut text = entry(item.entry);
    if let Some(signal) = &item.signal {
        text += &format!(" {signal}");
    }
    if let Some(unit) = item.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty()) {
        text += &format!(" [{unit}]");
    }
    text
}

/// A received TPDO.
#[derive(Clone, Debug)]
pub struct ReceivedTpdo {
    /// When it was received.
    pub at: Stamp,
    /// The node that sent it.
    pub node: NodeId,
    /// The number of the TPDO.
    pub number: TpdoNumber,
    /// The values, in the order of the bytes.
    pub values: Vec<(Source, Sample)>,
}

impl ReceivedTpdo {
    /// Combines the samples of a TPDO with their sources. `sources`: all sources of the decoder.
    pub fn new(at: Stamp, node: NodeId, number: TpdoNumber, samples: &[Sample], sources: &[Source]) -> ReceivedTpdo {
        let value = |sample: &Sample| Some((sources.get(sample.source)?.clone(), sample.clone()));
        ReceivedTpdo { at, node, number, values: samples.iter().filter_map(value).collect() }
    }
}

impl Report for ReceivedTpdo {
    const COLUMNS: &'static [Column] = &[
        Column::new("time"),
        Column::new("node"),
        Column::new("pdo"),
        Column::nested(
            "values",
            &[
                Column::new("signal"),
                Column::new("value"),
                Column::new("unit"),
                Column::new("status"),
                Column::new("raw"),
            ],
        ),
    ];

    fn cells(&self) -> Vec<Cell> {
        let row = |(source, sample): &(Source, Sample)| {
            let (signal, unit) = ((&*source.signal).into(), (&*source.unit).into());
            vec![signal, sample.value.into(), unit, sample.status.into(), sample.raw.into()]
        };
        let values = Cell::Rows(self.values.iter().map(row).collect());
        vec![text::utc(self.at).into(), self.node.into(), self.number.get().into(), values]
    }

    /// All values of a TPDO on one line.
    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        let values = values_text(&self.values);
        writeln!(out, "{}  {:>3}  {}  {values}", text::utc(self.at), self.node, self.number)
    }
}

/// `pressure 1.234 bar ok  temperature 25.0 degC ok`.
pub(super) fn values_text(values: &[(Source, Sample)]) -> String {
    let value = |(source, sample): &(Source, Sample)| {
        let value = sample.value.map_or_else(|| "-".to_owned(), |value| value.to_string());
        let status = sample.status.map_or("", Status::as_str);
        let words = [&*source.signal, &value, &*source.unit, status];
        words.iter().filter(|word| !word.is_empty()).copied().collect::<Vec<_>>().join(" ")
    };
    values.iter().map(value).collect::<Vec<_>>().join("  ")
}
