//! The events of a recording: as text for people, and as CSV.

use super::rows::{Dialect, LineWriter, TimeForm, Times, push_number, push_seconds, push_text, push_texts};
use crate::bus::time::spoken;
use crate::bus::{Fault, ReceiveBuffer, Stamp};
use crate::canopen::id::NodeId;
use crate::tasks::log::Note;
use std::io;
use std::time::Duration;

/// The columns.
pub const COLUMNS: [&str; 5] = ["time", "elapsed_s", "node", "event", "text"];

/// How an event is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// Something is wrong.
    Warning,
    /// For information.
    Note,
    /// Shown with `-v` only.
    Detail,
}

/// An event as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Words {
    /// The word in the column `event`; `None` if it is not written to the file.
    pub event: Option<&'static str>,
    /// The node it concerns.
    pub node: Option<NodeId>,
    /// One line.
    pub text: String,
    /// How it is shown.
    pub weight: Weight,
}

impl Words {
    /// An event that concerns no single node.
    pub fn of_all(event: &'static str, weight: Weight, text: String) -> Words {
        Words { event: Some(event), node: None, text, weight }
    }
}

/// The text of a recording's event.
pub fn words(note: &Note) -> Words {
    use Weight::{Detail, Note as Remark, Warning};
    let of_node = |node: NodeId, event, weight, text| Words { event: Some(event), node: Some(node), text, weight };
    match note {
        Note::Remark(text) => Words::of_all("remark", Warning, text.clone()),
        Note::Emergency(node, emergency, meaning) => {
            let text = if emergency.code == 0 {
                "emergency over (0000h)".to_owned()
            } else {
                let register = emergency.register.map(|register| format!(", {register}")).unwrap_or_default();
                format!("emergency {:04X}h, {meaning}{register}", emergency.code)
            };
            of_node(*node, "emcy", Warning, format!("node {node}: {text}"))
        }
        Note::Share(period, share) => Words {
            event: None,
            node: None,
            text: format!(
                "SYNC every {} and the answers take about {:.1} % of the bus",
                spoken(*period),
                share * 100.0
            ),
            weight: Remark,
        },
        Note::Restarted(node) => of_node(*node, "reboot", Warning, format!("node {node} restarted")),
        Note::ReadAgain(node, changes) if changes.is_empty() => {
            of_node(*node, "read-again", Remark, format!("node {node} was read again: it is set up as before"))
        }
        Note::ReadAgain(node, changes) => {
            let changes = changes.join("; ");
            let text = format!("node {node} has changed, and is recorded as it is now: {changes}");
            of_node(*node, "changed", Warning, text)
        }
        Note::Unreadable(node, why) => {
            let text = format!("{why}: what node {node} sends is not recorded until it can be read again");
            of_node(*node, "unreadable", Warning, text)
        }
        Note::HeartbeatLost(node, since) => {
            let text = format!("node {node}: heartbeat lost, none for {}", spoken(*since));
            of_node(*node, "heartbeat-lost", Warning, text)
        }
        Note::HeartbeatBack(node) => {
            of_node(*node, "heartbeat-back", Remark, format!("node {node}: heartbeat is back"))
        }
        Note::State(node, state) => of_node(*node, "state", Warning, format!("node {node} is {state} now")),
        Note::Gap(node, length) => of_node(*node, "gap", Detail, format!("node {node}: a gap of {}", spoken(*length))),
        Note::Silent(node, since) => {
            of_node(*node, "lost", Warning, format!("node {node}: silent for {}", spoken(*since)))
        }
        Note::Back(node) => of_node(*node, "back", Remark, format!("node {node} is back")),
        Note::WrongLength(node) => {
            let text = "a TPDO has not the length of its mapping: no row is made of it";
            of_node(*node, "length", Warning, format!("node {node}: {text}"))
        }
        Note::Fault(fault) => {
            let weight = match fault {
                Fault::BusOff | Fault::ControllerOverflow => Warning,
                Fault::Restarted => Remark,
                _ => Detail,
            };
            Words::of_all("fault", weight, fault.to_string())
        }
        Note::Buffer(buffer) => Words { event: None, node: None, text: buffer_text(*buffer), weight: Detail },
        Note::Dropped(count) => Words::of_all("dropped", Warning, format!("the kernel dropped {count} frames")),
        Note::Link(true) => Words::of_all("link-up", Remark, "the interface is up again".to_owned()),
        Note::Link(false) => Words::of_all("link-down", Warning, "the interface went down; waiting for it".to_owned()),
    }
}

fn buffer_text(buffer: ReceiveBuffer) -> String {
    let ReceiveBuffer { bytes, wanted } = buffer;
    if buffer.is_small() {
        let more = format!("sudo sysctl net.core.rmem_max={}", wanted / 2);
        return format!("the receive buffer has {bytes} bytes; the kernel allows no more until: {more}");
    }
    format!("the receive buffer has {bytes} bytes")
}

/// Writes events as CSV.
#[derive(Debug)]
pub struct Events {
    writer: LineWriter,
    dialect: Dialect,
    times: Times,
    /// Whether the header must still be written.
    needs_header: bool,
}

impl Events {
    /// Events for `writer`. With `continues` the file already has its header.
    pub fn new(writer: LineWriter, dialect: Dialect, time: TimeForm, continues: bool) -> Events {
        Events { writer, dialect, times: Times::new(time), needs_header: !continues }
    }

    /// The header, without line end and byte order mark.
    pub fn header(dialect: Dialect) -> String {
        let mut head = Vec::new();
        push_texts(&mut head, COLUMNS, dialect.delimiter);
        String::from_utf8_lossy(&head).trim_end().to_owned()
    }

    /// Writes the header: a file without events has one as well.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn write_header(&mut self) -> io::Result<()> {
        if !std::mem::take(&mut self.needs_header) {
            return self.writer.check();
        }
        let mark = if self.dialect.bom { "\u{feff}" } else { "" };
        self.writer.put_header(format!("{mark}{}\n", Events::header(self.dialect)).into_bytes())
    }

    /// Writes an event at once. `elapsed` is the time since the first row.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn add(&mut self, at: Stamp, elapsed: Option<Duration>, words: &Words) -> io::Result<()> {
        let Some(event) = words.event else { return Ok(()) };
        self.write_header()?;
        let Dialect { delimiter, decimal, .. } = self.dialect;
        let mut line = Vec::new();
        self.times.write(&mut line, at.wall, decimal)?;
        line.push(delimiter);
        if let Some(elapsed) = elapsed {
            push_seconds(&mut line, elapsed, decimal);
        }
        line.push(delimiter);
        if let Some(node) = words.node {
            push_number(&mut line, u64::from(node.get()));
        }
        line.push(delimiter);
        line.extend_from_slice(event.as_bytes());
        line.push(delimiter);
        push_text(&mut line, &words.text, delimiter);
        line.push(b'\n');
        self.writer.put_rows(&mut line, 1)
    }

    /// Waits until everything is written, as [`super::rows::Rows::finish`] does.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        self.writer.finish(give_up)
    }

    /// Events that were lost.
    pub fn lost(&self) -> u64 {
        self.writer.lost()
    }
}
