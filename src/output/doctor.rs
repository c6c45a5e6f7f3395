//! The report of `doctor`: the problems, and the commands to type.

use super::diagnosis;
use super::events::remark_text;
use super::failure::ErrorMessage;
use super::report::{Cell, Column, Report};
use super::text::safe;
use crate::bus::Fault;
use crate::bus::time::format_duration;
use crate::canopen::id::NodeId;
use crate::tasks::doctor::{Finding, FindingCause};
use crate::tasks::log::Remark;
use std::io::{self, Write};

/// A finding as text.
#[derive(Clone, Debug)]
pub struct FindingReport {
    node: Option<NodeId>,
    signal: Option<String>,
    /// A word for scripts.
    finding: &'static str,
    message: String,
    hint: Option<String>,
}

impl FindingReport {
    /// Converts a finding to text. `interface` is the name of the bus.
    pub fn new(finding: &Finding, interface: &str) -> FindingReport {
        let (word, message, hint) = finding_text(finding, interface);
        FindingReport { node: finding.node, signal: finding.signal.clone(), finding: word, message, hint }
    }

    /// The finding for a bus that cannot be opened.
    pub fn of_bus(error: ErrorMessage) -> FindingReport {
        FindingReport { node: None, signal: None, finding: "bus", message: error.message, hint: error.hint }
    }
}

impl Report for FindingReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("signal"),
        Column::new("finding"),
        Column::new("message"),
        Column::new("hint"),
    ];

    fn cells(&self) -> Vec<Cell> {
        vec![
            self.node.into(),
            self.signal.as_deref().into(),
            self.finding.into(),
            self.message.as_str().into(),
            self.hint.as_deref().into(),
        ]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        for report in reports {
            let place = match (report.node, &report.signal) {
                (Some(node), Some(signal)) => format!("node {node}, {signal}: "),
                (Some(node), None) => format!("node {node}: "),
                (None, _) => String::new(),
            };
            writeln!(out, "{}", safe(&format!("{place}{}", report.message)))?;
            if let Some(hint) = &report.hint {
                writeln!(out, "  {}", safe(hint))?;
            }
        }
        Ok(())
    }
}

/// The word for scripts, the message and the hint.
type FindingText = (&'static str, String, Option<String>);

fn finding_text(finding: &Finding, interface: &str) -> FindingText {
    let node = finding.node.map(|node| node.to_string()).unwrap_or_default();
    let without_node = |text: String| text.strip_prefix(&format!("node {node}: ")).map(str::to_owned).unwrap_or(text);
    let errors = || Some(format!("cangauge errors {node}"));
    match &finding.cause {
        FindingCause::Failed(failure) => {
            let error = ErrorMessage::of(failure);
            (super::failure::kind_name(error.kind), without_node(error.message), error.hint)
        }
        FindingCause::Silent(silence) => {
            let hint = finding.node.and_then(|node| diagnosis::hint(silence, node, &format!("cangauge log {node}")));
            (diagnosis::word(silence), diagnosis::reason(silence), hint)
        }
        FindingCause::NoTpdo => {
            let message = "it sends no TPDO: --passive starts no node".to_owned();
            ("no-tpdo-received", message, Some(format!("find out more: cangauge doctor {node}")))
        }
        FindingCause::Absent(others) if others.is_empty() => {
            ("no-answer", "it sends frames, but does not answer SDO requests".to_owned(), None)
        }
        FindingCause::Absent(others) => {
            let others: Vec<String> = others.iter().map(NodeId::to_string).collect();
            let message = format!(
                "it sends nothing and does not answer: no power, no cable, another node-ID, or stopped; on the bus: {}",
                others.join(", ")
            );
            let hint = format!("check its node-ID, power and cable; if it is stopped: cangauge nmt preop {node}");
            ("absent", message, Some(hint))
        }
        FindingCause::OnlyHeartbeat(state) => {
            let message = format!("its heartbeat shows {state}, and it does not answer SDO requests");
            ("no-answer", message, Some("if its SDO channel has other COB-IDs, add: --sdo 0xTX:0xRX".to_owned()))
        }
        FindingCause::Status(status) => ("status", format!("the status of its value is {}", status.as_str()), errors()),
        FindingCause::Register(text) => {
            ("error-register", format!("its error register (1001h) shows: {text}"), errors())
        }
        FindingCause::Remark(remark) => {
            let word = if matches!(remark, Remark::MayClip(..)) { "may-clip" } else { "doubt" };
            (word, without_node(remark_text(remark)), None)
        }
        FindingCause::NoFrame(_) | FindingCause::NoNode | FindingCause::Unconfigured | FindingCause::Fault(..) => {
            bus_text(&finding.cause, interface)
        }
    }
}

/// Returns the text of a finding about the bus.
fn bus_text(cause: &FindingCause, interface: &str) -> FindingText {
    let detect = format!("find the bit rate: cangauge bus detect {interface}");
    match cause {
        FindingCause::NoFrame(time) => {
            let time = format_duration(*time);
            let message = format!(
                "no frame was received in {time}, and no node answers: no power, no cable, another bit rate, or stopped"
            );
            let hint =
                format!("check the power and the cable; if the nodes are stopped: cangauge nmt preop all; {detect}");
            ("no-frame", message, Some(hint))
        }
        FindingCause::Unconfigured => {
            let message = "no node answers, but a device without a node-ID is on the bus".to_owned();
            ("unconfigured", message, Some("cangauge lss scan".to_owned()))
        }
        FindingCause::Fault(fault, is_answered) => fault_text(*fault, *is_answered, detect),
        _ => {
            let message = "frames are received, but no CANopen node answers".to_owned();
            ("no-node", message, Some("show the frames: candump, or cangauge scan --passive --trace -".to_owned()))
        }
    }
}

fn fault_text(fault: Fault, is_answered: bool, detect: String) -> FindingText {
    let (word, hint) = match fault {
        Fault::NoAcknowledge => {
            ("no-acknowledge", Some("check the power, the cable, the terminators and the bit rate".to_owned()))
        }
        Fault::Protocol | Fault::ErrorPassive | Fault::ErrorWarning if is_answered => (
            "bus-errors",
            Some("check the cable and the terminators, and that no two nodes send one COB-ID".to_owned()),
        ),
        Fault::BusOff => ("bus-off", Some(detect)),
        Fault::Protocol | Fault::ErrorPassive | Fault::ErrorWarning => ("bus-errors", Some(detect)),
        _ => ("controller", None),
    };
    (word, format!("the controller reports: {fault}"), hint)
}
