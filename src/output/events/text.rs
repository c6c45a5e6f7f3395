//! The text of the events of a recording.

use super::{EventText, Severity};
use crate::bus::time::format_duration;
use crate::bus::{Fault, ReceiveBuffer};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::NodeId;
use crate::canopen::pdo::TpdoNumber;
use crate::measure::expression::bind::LimitWithoutUnit;
use crate::output::diagnosis;
use crate::output::failure::ErrorMessage;
use crate::output::monitor::command_text;
use crate::tasks::Failure;
use crate::tasks::log::{Change, LogEvent, Remark, TpdoChange};
use std::time::Duration;

/// Returns the text of an event of a recording.
pub fn event_text(event: &LogEvent) -> EventText {
    use Severity::{Detail, Note as Info, Warning};
    let of_all = EventText::of_all;
    match event {
        LogEvent::Remark(remark) => of_all("remark", Warning, remark_text(remark)),
        LogEvent::Emergency(node, emergency, meaning) => {
            of_node(*node, "emcy", Warning, format!("node {node}: {}", emergency_text(*emergency, meaning)))
        }
        LogEvent::Share(interval, share) => {
            EventText { event: None, node: None, text: share_text(*interval, *share), severity: Info }
        }
        LogEvent::Restarted(node) => of_node(*node, "reboot", Warning, format!("node {node} restarted")),
        LogEvent::ReadAgain(node, changes) if changes.is_empty() => {
            of_node(*node, "read-again", Info, format!("node {node} was read again: its setup is unchanged"))
        }
        LogEvent::ReadAgain(node, changes) if changes.iter().any(|change| matches!(change, Change::Device(..))) => {
            of_node(*node, "replaced", Warning, changed_text(*node, changes))
        }
        LogEvent::ReadAgain(node, changes) => of_node(*node, "changed", Warning, changed_text(*node, changes)),
        LogEvent::Unreadable(node, why) => of_node(*node, "unreadable", Warning, unreadable_text(*node, why)),
        LogEvent::HeartbeatLost(node, since) => {
            let text = format!("node {node}: heartbeat lost, none for {}", format_duration(*since));
            of_node(*node, "heartbeat-lost", Warning, text)
        }
        LogEvent::HeartbeatBack(node) => {
            of_node(*node, "heartbeat-back", Info, format!("node {node}: heartbeat is back"))
        }
        LogEvent::State(node, state) => of_node(*node, "state", Warning, format!("node {node} is {state} now")),
        LogEvent::Gap(node, length) => {
            of_node(*node, "gap", Detail, format!("node {node}: a gap of {}", format_duration(*length)))
        }
        LogEvent::Silent(node, since) => {
            of_node(*node, "lost", Warning, format!("node {node}: silent for {}", format_duration(*since)))
        }
        LogEvent::Back(node) => of_node(*node, "back", Info, format!("node {node} is back")),
        LogEvent::WrongLength(node, mapped, received) => {
            of_node(*node, "length", Warning, length_text(*node, *mapped, *received, "the TPDO is not recorded"))
        }
        LogEvent::LongerTpdo(node, mapped, received) => {
            let used = format!("the first {mapped} bytes are used from now on");
            of_node(*node, "length", Warning, length_text(*node, *mapped, *received, &used))
        }
        LogEvent::HeartbeatLength(node, length) => {
            of_node(*node, "heartbeat-length", Info, heartbeat_text(*node, *length))
        }
        LogEvent::EmergencyRepeated(node, emergency, meaning, count) => {
            let text = emergency_text(*emergency, meaning);
            of_node(*node, "emcy", Warning, format!("node {node}: {text}: {}", times_more(*count)))
        }
        LogEvent::Fault(fault) => of_all("fault", fault_severity(*fault), fault.to_string()),
        LogEvent::FaultRepeated(fault, count) => {
            of_all("fault", fault_severity(*fault), format!("{fault}: {}", times_more(*count)))
        }
        LogEvent::Buffer(buffer) => EventText { event: None, node: None, text: buffer_text(*buffer), severity: Detail },
        LogEvent::Dropped(count) => of_all("dropped", Warning, format!("the kernel dropped {count} frames")),
        LogEvent::Link(true) => of_all("link-up", Info, "the interface is up again".to_owned()),
        LogEvent::Link(false) => of_all("link-down", Warning, "the interface went down; waiting for it".to_owned()),
    }
}

fn of_node(node: NodeId, event: &'static str, severity: Severity, text: String) -> EventText {
    EventText { event: Some(event), node: Some(node), text, severity }
}

fn changed_text(node: NodeId, changes: &[Change]) -> String {
    let changes = changes.iter().map(change_text).collect::<Vec<_>>().join("; ");
    format!("node {node} has changed, and is recorded with its new setup: {changes}")
}

fn unreadable_text(node: NodeId, why: &Failure) -> String {
    format!("{}: node {node} is not recorded until it can be read again", ErrorMessage::of(why).message)
}

fn times_more(count: u64) -> String {
    if count == 1 { "once more".to_owned() } else { format!("{count} times more") }
}

fn share_text(interval: Duration, share: f64) -> String {
    format!("SYNC every {} and its TPDOs use {:.1} % of the bus", format_duration(interval), share * 100.0)
}

fn length_text(node: NodeId, mapped: usize, received: usize, consequence: &str) -> String {
    format!("node {node}: a TPDO has {received} bytes, its mapping {mapped}: {consequence}")
}

/// The text for heartbeats whose length is not one byte.
pub fn heartbeat_text(node: NodeId, length: usize) -> String {
    match length {
        0 => format!("node {node}: frames of 0 bytes on its heartbeat COB-ID are ignored"),
        _ => format!("node {node}: its heartbeats have {length} bytes, not 1: the first byte is the state"),
    }
}

fn emergency_text(emergency: Emergency, meaning: &str) -> String {
    if emergency.code == 0 {
        return "emergency over (0000h)".to_owned();
    }
    format!("emergency {:04X}h, {meaning}", emergency.code)
}

fn fault_severity(fault: Fault) -> Severity {
    match fault {
        Fault::BusOff | Fault::ControllerOverflow => Severity::Warning,
        Fault::Restarted => Severity::Note,
        _ => Severity::Detail,
    }
}

fn buffer_text(buffer: ReceiveBuffer) -> String {
    let bytes = buffer.bytes;
    if buffer.is_small() {
        return format!("the receive buffer has {bytes} bytes; for a larger one: {}", allow_larger(buffer));
    }
    format!("the receive buffer has {bytes} bytes")
}

/// Returns the command that allows the wanted receive buffer. The kernel doubles the size given in the command.
fn allow_larger(buffer: ReceiveBuffer) -> String {
    format!("sudo sysctl net.core.rmem_max={}", buffer.wanted / 2)
}

/// The text for a TPDO from two devices.
pub fn two_senders(number: TpdoNumber) -> String {
    format!("{number} arrives twice at a SYNC, with different values: two devices have this node-ID or COB-ID")
}

fn repeated_tpdo(number: TpdoNumber) -> String {
    format!("{number} arrives twice at a SYNC: two devices send it, or a bridge repeats frames")
}

/// The text of a remark on a recording.
pub fn remark_text(remark: &Remark) -> String {
    match remark {
        Remark::NoRequestedSignal(node) => format!("node {node} has none of the requested signals"),
        Remark::SharedCobId(id, [(one, first), (other, second)]) if one == other => {
            format!("node {one}: {first} and {second} have the same COB-ID {id}: they are ignored")
        }
        Remark::SharedCobId(id, [(one, _), (other, _)]) => {
            format!("nodes {one} and {other} both send TPDOs with COB-ID {id}: these TPDOs are ignored")
        }
        Remark::NotDecoded(node, number, code) => format!("node {node}: {}", diagnosis::not_decoded(*number, *code)),
        Remark::UnknownMapping(node, id) => {
            format!("node {node}: TPDOs with COB-ID {id} are ignored: their mapping is unknown")
        }
        Remark::FreshnessNotProven => {
            "values were sent on remote request and may be old (--poll reads new values)".to_owned()
        }
        Remark::RepeatedTpdo(node, number) => format!("node {node}: {}", repeated_tpdo(*number)),
        Remark::TwoSenders(node, number) => format!("node {node}: {}", two_senders(*number)),
        Remark::SecondAnswer(node, answers) => crate::output::failure::second_answer(*node, *answers),
        Remark::PollFailed(error) => format!("node {}: {error}", error.node),
        Remark::ChangedWhileFramesLost(node, before) => {
            let before = format_duration(*before);
            format!("node {node} changed while frames were lost: its rows of the last {before} may be wrong")
        }
        Remark::NotReadAgain(node) => format!("node {node} could not be read again: its later frames were ignored"),
        Remark::LeftOperational(nodes) => left_operational(nodes),
        Remark::NotStarted(nodes) => not_started(nodes, "log starts only sensors"),
        Remark::OtherNmtMaster(nodes, command, target) => {
            let target = target.map_or_else(|| "all nodes".to_owned(), |node| format!("node {node}"));
            not_started(nodes, &format!("another NMT master sent \"{}\" to {target}", command_text(*command)))
        }
        Remark::NotOperational(node, silence) => {
            format!("node {node} is no longer operational: {}", diagnosis::reason(silence))
        }
        Remark::StatesNotRestored(failure) => {
            format!("the nodes' states were not restored: {}", ErrorMessage::of(failure).message)
        }
        Remark::SyncsOmittedWhileDown(count) => format!("{count} SYNC omitted: the interface was down"),
        Remark::SyncsOmittedTooSlow(count) => format!("{count} SYNC omitted: the program was stopped or too slow"),
        Remark::SmallReceiveBuffer(buffer) => format!("frames were dropped: {}", buffer_text(*buffer)),
        Remark::Doubt(node, signal, doubt) => crate::output::doubt::doubt(*node, signal, *doubt),
        Remark::LimitWithoutUnit(LimitWithoutUnit { limit, unit }) => {
            format!("limit {limit} has no unit: the unit of the device ({unit}) is used")
        }
        Remark::MayClip(node, value) => {
            format!("node {node}: {}", crate::output::doubt::may_clip(value))
        }
        Remark::NoMeasurements(node, None, silence) => {
            format!("node {node}: no measurements: {}", diagnosis::reason(silence))
        }
        Remark::NoMeasurements(node, Some(signal), silence) => {
            format!("node {node}: no measurements of {signal}: {}", diagnosis::reason(silence))
        }
    }
}

/// The text for nodes that were started and stay operational.
pub(in crate::output) fn left_operational(nodes: &[NodeId]) -> String {
    match nodes {
        [node] => format!(
            "node {node} was started and stays operational: its previous state is unknown and cannot be restored"
        ),
        nodes => format!(
            "nodes {} were started and stay operational: their previous states are unknown and cannot be restored",
            listed(nodes)
        ),
    }
}

fn not_started(nodes: &[NodeId], why: &str) -> String {
    let subject = if nodes.len() == 1 { "node" } else { "nodes" };
    let verb = if nodes.len() == 1 { "was" } else { "were" };
    format!("{subject} {} {verb} not started: {why}; start all nodes: log --start", listed(nodes))
}

/// `1, 2, 3`.
fn listed(nodes: &[NodeId]) -> String {
    nodes.iter().map(NodeId::to_string).collect::<Vec<String>>().join(", ")
}

fn change_text(change: &Change) -> String {
    let digits = |digits: &Option<u8>| digits.map_or_else(|| "unknown".to_owned(), |digits| digits.to_string());
    match change {
        Change::Device(before, after) if before == after => "it is another device".to_owned(),
        Change::Device(before, after) => {
            let serial = |serial: &Option<u32>| serial.map_or_else(|| "none".to_owned(), |serial| serial.to_string());
            format!("it is another device: serial {}, before {}", serial(after), serial(before))
        }
        Change::TpdoRemoved(number) => format!("{number} no longer exists"),
        Change::TpdoDisabled(number) => format!("{number} is disabled"),
        Change::Tpdo(number, parts) => {
            let parts: Vec<String> = parts.iter().map(tpdo_change_text).collect();
            format!("{number}: {}", parts.join(", "))
        }
        Change::Unit(signal, before, after) => {
            let unit = |unit: &Option<_>| {
                unit.as_ref().map_or_else(|| "unknown".to_owned(), |unit: &crate::device::unit::Unit| unit.to_string())
            };
            format!("{signal}: unit {}, before {}", unit(after), unit(before))
        }
        Change::Digits(signal, before, after) => {
            format!("{signal}: decimal digits {}, before {}", digits(after), digits(before))
        }
        Change::Type(signal) => format!("{signal}: another data type"),
    }
}

fn tpdo_change_text(change: &TpdoChange) -> String {
    match change {
        TpdoChange::Mapping(names) if names.is_empty() => "nothing mapped".to_owned(),
        TpdoChange::Mapping(names) => format!("mapping {}", names.join(" ")),
        TpdoChange::CanId(id) => format!("COB-ID {id}"),
        TpdoChange::Transmission(transmission) => format!("transmission {transmission}"),
        TpdoChange::EventTimer(milliseconds) => format!("event timer {milliseconds} ms"),
        TpdoChange::CobIdFlags => "other COB-ID flags".to_owned(),
    }
}
