//! The messages of `monitor`.

mod lss;

use super::report::{Cell, Column, Report};
use super::{pdo, sdo, text};
use crate::bus::time::format_duration;
use crate::canopen::emcy::Emergency;
use crate::canopen::nmt::NmtCommand;
use crate::canopen::value::Value;
use crate::measure::sample::{Sample, Source};
use crate::node::transfers::{Operation, Outcome};
use crate::tasks::monitor::{Content, Entry, FrameKind, LssMessage, MonitorReport, SdoMessage};
use std::io::{self, Write};
use std::time::Duration;

/// The longest value in bytes that a line shows completely.
const SHOWN_BYTES: usize = 32;

impl Report for Entry {
    const COLUMNS: &'static [Column] = &[
        Column::new("time"),
        Column::new("node"),
        Column::new("kind"),
        Column::new("event"),
        Column::new("object"),
        Column::new("name"),
        Column::new("type"),
        Column::new("value"),
        Column::new("unit"),
        Column::new("abort"),
        Column::new("cob_id"),
        Column::new("raw"),
        Column::new("values").json_only(),
        Column::new("text"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let message = if let Content::Sdo(message) = &self.content { Some(&**message) } else { None };
        let abort = message.and_then(|message| match message.transfer.outcome {
            Outcome::Aborted { code, .. } => Some(Cell::hex(code.0, 8)),
            _ => None,
        });
        let raw = message.map_or(self.data.as_slice(), |message| &message.raw);
        vec![
            text::utc(self.at).into(),
            self.node.into(),
            self.kind.as_str().into(),
            event(&self.content).into(),
            message.map(|message| message.transfer.object).into(),
            message.and_then(|message| message.name.as_ref()).into(),
            message.and_then(|message| message.data_type).map(|data_type| data_type.to_string()).into(),
            value(&self.content),
            message.and_then(unit).into(),
            abort.into(),
            self.id.map(|id| Cell::cob_id(id.number())).into(),
            if raw.is_empty() { Cell::Null } else { text::wire_bytes(raw).into() },
            Cell::List(samples(&self.content).iter().map(sample).collect()),
            entry_text(self).into(),
        ]
    }

    /// `TIME  node 5    read       producer-heartbeat-time -> 100 ms`.
    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        let node = match (self.node, &self.content) {
            (Some(node), _) => format!("node {node}"),
            (None, Content::Nmt(_)) => "all nodes".to_owned(),
            (None, _) => "-".to_owned(),
        };
        let heading = match &self.content {
            Content::Sdo(_) | Content::Tpdo(..) | Content::WrongLength(..) | Content::Pdo(..) => event(&self.content),
            _ => self.kind.as_str().to_owned(),
        };
        let line = format!("{}  {node:<9}  {heading:<9}  {}", text::utc(self.at), entry_text(self));
        writeln!(out, "{}", text::safe(line.trim_end()))
    }
}

/// Returns the totals in one line: all frames, the frames of each kind, and the repetitions that were not shown.
pub fn totals(report: &MonitorReport) -> String {
    let frames: u64 = report.frames.values().sum();
    let kinds: Vec<String> =
        report.frames.iter().map(|(kind, count)| format!("{} {}", text::grouped(*count), kind.as_str())).collect();
    let number = |count: u64, word: &str| {
        let plural = if count == 1 { "" } else { "s" };
        format!("{} {word}{plural}", text::grouped(count))
    };
    let mut line = format!("{} in {}", number(frames, "frame"), format_duration(report.length));
    if !kinds.is_empty() {
        line += &format!(": {}", kinds.join(", "));
    }
    if report.repeated > 0 {
        line += &format!("; {} not shown (--all)", number(report.repeated, "repetition"));
    }
    line
}

/// The services that masters used: `NMT commands, SDO requests`. `None` if no master was seen.
pub fn masters(report: &MonitorReport) -> Option<String> {
    let word = |kind: &FrameKind| match kind {
        FrameKind::Nmt => "NMT commands",
        FrameKind::Sdo => "SDO requests",
        FrameKind::Lss => "LSS requests",
        _ => "node guarding",
    };
    let words: Vec<&str> = report.masters.iter().map(word).collect();
    (!words.is_empty()).then(|| format!("sent by masters: {}", words.join(", ")))
}

/// The word of the event in JSON and CSV; some are also the heading of a line.
fn event(content: &Content) -> String {
    match content {
        Content::Nmt(command) => command_text(*command).to_owned(),
        Content::State(_) => "state".to_owned(),
        Content::BootUp => "boot-up".to_owned(),
        Content::GuardingRequest | Content::Request | Content::Lss(LssMessage::Request(_)) => "request".to_owned(),
        Content::Guarded(..) | Content::Lss(LssMessage::Answer(..)) => "answer".to_owned(),
        Content::Emergency(emergency, _) => if emergency.code == 0 { "reset" } else { "error" }.to_owned(),
        Content::Sdo(message) => message.transfer.operation.to_string(),
        Content::SecondMaster => "second-master".to_owned(),
        Content::Sync(_) => "sync".to_owned(),
        Content::Time(_) => "time".to_owned(),
        Content::Tpdo(number, _) | Content::WrongLength(number, _) => number.to_string(),
        Content::Pdo(number, false) => format!("TPDO{number}"),
        Content::Pdo(number, true) => format!("RPDO{number}"),
        Content::Fault(_) => "fault".to_owned(),
        Content::Dropped(_) => "dropped".to_owned(),
        Content::Link(is_up) => if *is_up { "link-up" } else { "link-down" }.to_owned(),
        Content::Raw(_) => "frame".to_owned(),
    }
}

/// The content in words.
fn entry_text(entry: &Entry) -> String {
    let bytes = || text::spaced_bytes(&entry.data);
    let id = || entry.id.map(|id| format!("0x{id}")).unwrap_or_default();
    match &entry.content {
        Content::Nmt(command) => command_text(*command).to_owned(),
        Content::State(state) => state.to_string(),
        Content::BootUp => String::new(),
        Content::GuardingRequest => "request".to_owned(),
        Content::Guarded(state, true) => state.to_string(),
        Content::Guarded(state, false) => format!("{state}; the toggle bit has not alternated"),
        Content::Emergency(emergency, meaning) => emergency_text(*emergency, meaning),
        Content::Sdo(message) => sdo_text(message),
        Content::SecondMaster => "two masters use the SDO channel at the same time".to_owned(),
        Content::Lss(message) => lss::words(message),
        Content::Sync(counter) => counter.map(|counter| format!("counter {counter}")).unwrap_or_default(),
        Content::Time(time) => time.to_string(),
        Content::Tpdo(_, values) => pdo::values_text(values),
        Content::WrongLength(_, mapped) => {
            format!("{}  {}  ({} bytes, its mapping has {mapped})", id(), bytes(), entry.data.len())
        }
        Content::Pdo(..) => format!("{}  {}  (unknown mapping)", id(), bytes()),
        Content::Request => format!("{}  remote request", id()),
        Content::Fault(fault) => fault.to_string(),
        Content::Dropped(count) => format!("the kernel dropped {count} frames"),
        Content::Link(true) => "the interface is up".to_owned(),
        Content::Link(false) => "the interface is down".to_owned(),
        Content::Raw(Some(length)) => format!("{}  remote request for {length} bytes", id()),
        Content::Raw(None) if entry.data.is_empty() => format!("{}  no data", id()),
        Content::Raw(None) => format!("{}  {}", id(), bytes()),
    }
}

/// The command in words.
pub(super) fn command_text(command: NmtCommand) -> &'static str {
    match command {
        NmtCommand::Start => "start",
        NmtCommand::Stop => "stop",
        NmtCommand::EnterPreOperational => "enter pre-operational",
        NmtCommand::ResetNode => "reset node",
        NmtCommand::ResetCommunication => "reset communication",
    }
}

fn emergency_text(emergency: Emergency, meaning: &str) -> String {
    if emergency.code == 0 && emergency.register.is_none_or(|register| register.0 == 0) {
        return "0000h emergency over".to_owned();
    }
    let text = format!("{:04X}h {meaning}", emergency.code);
    if emergency.manufacturer == [0; 5] {
        return text;
    }
    format!("{text} ({})", text::spaced_bytes(&emergency.manufacturer))
}

fn sdo_text(message: &SdoMessage) -> String {
    let transfer = &message.transfer;
    let object = message.name.clone().unwrap_or_else(|| transfer.object.to_string());
    match &transfer.outcome {
        Outcome::Done(_) => {
            let arrow = if transfer.operation == Operation::Read { "->" } else { "<-" };
            let note = match &message.note {
                Some(Ok(note)) => format!("; {note}"),
                Some(Err(error)) => format!("; {error}"),
                None => String::new(),
            };
            format!("{object} {arrow} {}{note}", value_text(message))
        }
        Outcome::Aborted { code, by_master: false } => format!("{object}: rejected: {code}"),
        Outcome::Aborted { code, by_master: true } => format!("{object}: aborted by the master: {code}"),
        Outcome::Violation(violation, frame) => format!("{object}: unexpected frame {frame}: {violation}"),
        Outcome::NoAnswer if transfer.answered.is_some() => format!("{object}: not completed"),
        Outcome::NoAnswer => format!("{object}: no answer"),
    }
}

/// `100 ms`, `5120256 (bar)`, `1234 (1.234 bar)`.
fn value_text(message: &SdoMessage) -> String {
    let Some(value) = &message.value else { return String::new() };
    let raw = &message.raw;
    let shown = match value {
        Value::Bytes(bytes) if bytes.len() > SHOWN_BYTES => {
            format!("{} bytes: {} …", text::grouped(bytes.len() as u64), text::spaced_bytes(&bytes[..SHOWN_BYTES]))
        }
        Value::Bytes(bytes) if bytes.is_empty() => "no bytes".to_owned(),
        value => sdo::usual(message.transfer.object, value, raw),
    };
    match (unit(message), &message.meaning, &message.sample) {
        (Some("100us"), ..) => {
            let count = value.as_u64().and_then(|count| u32::try_from(count).ok()).unwrap_or_default();
            format_duration(Duration::from_micros(100) * count)
        }
        (_, Some(meaning), _) => format!("{shown} ({meaning})"),
        (Some(unit), ..) => format!("{shown} {unit}"),
        (None, None, Some((source, Sample { value: Some(number), .. }))) => {
            let measured = format!("{number} {}", source.unit);
            if measured.trim() == shown { shown } else { format!("{shown} ({})", measured.trim()) }
        }
        _ => shown,
    }
}

/// The unit of the value of an object. A measured integer gets no unit, because it is shown without its decimal digits.
fn unit(message: &SdoMessage) -> Option<&str> {
    let is_real = matches!(message.value, Some(Value::Real32(_) | Value::Real64(_)));
    let measured = message.sample.as_ref().map(|(source, _)| &*source.unit).filter(|unit| is_real && !unit.is_empty());
    message.unit.as_deref().or(measured)
}

/// Returns the value in a message as a cell, empty if there is none.
fn value(content: &Content) -> Cell {
    match content {
        Content::State(state) | Content::Guarded(state, _) => state.to_string().into(),
        Content::Emergency(emergency, _) => Cell::hex(emergency.code, 4),
        Content::Sdo(message) => match &message.value {
            Some(Value::Bytes(bytes)) => text::wire_bytes(bytes).into(),
            value => value.as_ref().into(),
        },
        Content::Sync(counter) => (*counter).into(),
        Content::Time(time) => time.into(),
        _ => Cell::Null,
    }
}

/// The measured values in a message.
fn samples(content: &Content) -> &[(Source, Sample)] {
    match content {
        Content::Tpdo(_, values) => values,
        Content::Sdo(message) => message.sample.as_slice(),
        _ => &[],
    }
}

fn sample((source, sample): &(Source, Sample)) -> Cell {
    Cell::Object(vec![
        ("signal", (&*source.signal).into()),
        ("value", sample.value.into()),
        ("unit", (&*source.unit).into()),
        ("status", sample.status.into()),
        ("raw", sample.raw.into()),
    ])
}
