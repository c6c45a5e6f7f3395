//! LSS messages in words.

use crate::canopen::lss::{Answer, Limit, Mode, Part, Request, Service};
use crate::tasks::monitor::LssMessage;

/// A request or an answer in words.
pub(super) fn words(message: &LssMessage) -> String {
    match message {
        LssMessage::Request(request) => request_text(*request),
        LssMessage::Answer(service, answer) => format!("{service}: {}", answer_text(*service, *answer)),
    }
}

fn request_text(request: Request) -> String {
    let service = request.service();
    let argument = match request {
        Request::SwitchGlobal(Mode::Waiting) => "waiting".to_owned(),
        Request::SwitchGlobal(Mode::Configuration) => "configuration".to_owned(),
        Request::Select(part, number) => format!("{} {}", part_name(part), number_text(part, number)),
        Request::ConfigureNodeId(None) => "none".to_owned(),
        Request::ConfigureNodeId(Some(node)) => node.to_string(),
        Request::ConfigureBitTiming { table, index } => format!("table {table}, index {index}"),
        Request::ActivateBitTiming { delay_ms } => format!("after {delay_ms} ms"),
        Request::Identify(limit, number) => {
            let (part, word) = match limit {
                Limit::Vendor => (Part::Vendor, ""),
                Limit::Product => (Part::Product, ""),
                Limit::RevisionLow => (Part::Revision, "from "),
                Limit::RevisionHigh => (Part::Revision, "to "),
                Limit::SerialLow => (Part::Serial, "from "),
                Limit::SerialHigh => (Part::Serial, "to "),
            };
            format!("{} {word}{}", part_name(part), number_text(part, number))
        }
        Request::Fastscan { bit_check: Request::ALL_SLAVES, .. } => "all slaves without a node-ID".to_owned(),
        Request::Fastscan { number, bit_check, sub, next } => {
            let then = if next == sub { String::new() } else { format!(", then the {}", part_name(next)) };
            let bits = if bit_check == 31 { "bit 31".to_owned() } else { format!("bits 31 to {bit_check}") };
            format!("{} 0x{number:08X}, {bits}{then}", part_name(sub))
        }
        Request::Store | Request::Inquire(_) | Request::InquireNodeId | Request::IdentifyUnconfigured => {
            return service.to_string();
        }
    };
    format!("{service}: {argument}")
}

fn answer_text(service: Service, answer: Answer) -> String {
    match (service, answer) {
        (_, Answer::Selected) => "a slave is selected".to_owned(),
        (_, Answer::Acknowledge(code)) if code.is_success() => "done".to_owned(),
        (_, Answer::Acknowledge(code)) => code.describe(service).to_string(),
        (Service::Inquire(part), Answer::Number(number)) => number_text(part, number),
        (_, Answer::Number(number)) => number.to_string(),
        (_, Answer::NodeId(Some(node))) => node.to_string(),
        (_, Answer::NodeId(None)) => "none".to_owned(),
        (_, Answer::Here) => "a slave answers".to_owned(),
    }
}

fn part_name(part: Part) -> &'static str {
    match part {
        Part::Vendor => "vendor-ID",
        Part::Product => "product code",
        Part::Revision => "revision number",
        Part::Serial => "serial number",
    }
}

/// Formats a number. Serial numbers are decimal, as on labels.
fn number_text(part: Part, number: u32) -> String {
    if part == Part::Serial { number.to_string() } else { format!("0x{number:X}") }
}
