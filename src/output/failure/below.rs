//! Messages and hints for errors of the layers below the tasks: bus, SDO, LSS, expressions.

use super::{CauseText, Place};
use crate::bus::replay::{FileFormat, RecordingError, RecordingFormat};
use crate::bus::time::format_duration;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::lss::Service;
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::Violation;
use crate::tasks::failure::{
    BusError, ExpressionError, LssError, MissedAnswer, Operation, SdoError, SdoFailure, SecondAnswer,
};
use crate::tasks::journal::JournalError;
use std::path::Path;
use std::time::Duration;

/// Returns the message and the hint for a bus error.
pub(super) fn bus(error: &BusError) -> CauseText {
    let cause_text = CauseText::new(error.to_string());
    match error {
        BusError::QueueFull => cause_text.hint(
            "no node acknowledges the frames: check the sensor's power, the bit rate, the wiring and the 120 ohm \
             terminators; or the bus is overloaded: candump shows the traffic",
        ),
        // A virtual interface has no bit rate.
        BusError::Down(name) if name.starts_with("vcan") || name.starts_with("vxcan") => {
            cause_text.hint(format!("bring it up: sudo cangauge bus up {name}"))
        }
        BusError::Down(name) if name.contains(':') => cause_text.hint("check the cable, the adapter or the server"),
        BusError::Down(name) => {
            cause_text.hint(format!("bring it up: sudo cangauge bus up {name} 250k (use the sensors' bit rate)"))
        }
        BusError::Unreachable { name, .. } => cause_text.hint(if name.starts_with("socketcand") {
            "check the address, the name of the bus and that socketcand runs there; to wait for it, add --wait 1m"
        } else {
            "list the serial adapters: cangauge bus list; to wait for one, add --wait 1m"
        }),
        BusError::NoInterface(_) | BusError::NotCan(_) => {
            cause_text.hint("list the interfaces: cangauge bus list; without hardware: --bus sim")
        }
        BusError::ListenOnly(name) => {
            cause_text.hint(format!("leave this mode: sudo cangauge bus up {name} 250k (use the sensors' bit rate)"))
        }
        BusError::ReceiveOnly(_) => cause_text.hint(
            "commands that only listen work on it: log, check, monitor, health, pdo watch, scan --passive, nmt watch",
        ),
        BusError::InUse(_) => cause_text.hint("wait until it ends, or stop it; to ignore it, add --ignore-lock"),
        BusError::Recording { file, error, .. } => match recording_hint(file, error) {
            Some(hint) => cause_text.hint(hint),
            None => cause_text,
        },
        BusError::NoRemoteFrames => cause_text.hint("use SDO instead: --poll 100ms"),
        BusError::Unsupported(_) => cause_text.hint("use simulated devices: --bus sim"),
        _ => cause_text,
    }
}

/// Returns the hint that shows how to get a usable recording.
fn recording_hint(file: &str, error: &RecordingError) -> Option<String> {
    let converted = Path::new(file).with_extension("candump.log");
    let converted = converted.display();
    let channel =
        |name: &str| format!("choose one: -b replay:{}:{name}", if file == "standard input" { "-" } else { file });
    Some(match error {
        RecordingError::Empty | RecordingError::NoFrames(_) | RecordingError::CutOff => return None,
        RecordingError::UnknownFormat | RecordingError::NoneUnderstood(RecordingFormat::Candump) => {
            "record with: candump -L can0".to_owned()
        }
        RecordingError::NoneUnderstood(RecordingFormat::Asc) => {
            "save it with numbers as identifiers and with decimal points".to_owned()
        }
        RecordingError::NoneUnderstood(_) => "save it again with the program that recorded it".to_owned(),
        RecordingError::SeveralChannels(first, _) => channel(first),
        RecordingError::NoChannel { channels, .. } => match channels.first() {
            Some(first) => channel(first),
            None => format!("leave the channel out: -b replay:{file}"),
        },
        RecordingError::NoTimes => "record with times: candump -L can0 (or candump -ta can0)".to_owned(),
        RecordingError::Intervals => "record with absolute times: candump -L can0".to_owned(),
        RecordingError::OtherFormat(format) => match format {
            FileFormat::Gzip => format!("unpack it: zcat {file} | cangauge -b replay:- ..."),
            FileFormat::Xz => format!("unpack it: xzcat {file} | cangauge -b replay:- ..."),
            FileFormat::Bzip2 => format!("unpack it: bzcat {file} | cangauge -b replay:- ..."),
            FileFormat::Zstd => format!("unpack it: zstdcat {file} | cangauge -b replay:- ..."),
            FileFormat::Zip => format!("unpack it: unzip -p {file} | cangauge -b replay:- ..."),
            FileFormat::Utf16 => format!("convert it: iconv -f UTF-16 -t UTF-8 {file} > {converted}"),
            FileFormat::Blf | FileFormat::Sqlite => {
                format!("convert it with python-can: python3 -m can.logconvert {file} {converted}")
            }
            FileFormat::Mdf => format!(
                "convert it with python-can (pip install 'python-can[mf4]'): python3 -m can.logconvert {file} \
                 {converted}"
            ),
            FileFormat::Pcap => format!(
                "convert it: tshark -r {file} -Y 'can.flags.xtd==0 && can.flags.rtr==0' -T fields -E separator=, -e \
                 frame.time_epoch -e can.id -e data | while IFS=, read t i d; do printf \"($t) can0 %03X#$d\\n\" $i; \
                 done > {converted}"
            ),
            FileFormat::SavvyCanCsv => "save it from SavvyCAN as a candump log".to_owned(),
            FileFormat::Busmaster => "convert it to Vector ASC with the format converters of BUSMASTER".to_owned(),
            FileFormat::Kvaser => "convert it to Vector ASC with the converter of Kvaser".to_owned(),
            FileFormat::Ixxat | FileFormat::VehicleSpy => "save it in this program as Vector ASC".to_owned(),
            FileFormat::CanEdge => "convert the MF4 file to Vector ASC: mdf2asc (CSS Electronics)".to_owned(),
            FileFormat::PythonCanScreen => "record with: python3 -m can.logger -f run.log ...".to_owned(),
            FileFormat::Measurements => {
                "replay needs the frames: record them with --trace FILE or candump -L".to_owned()
            }
            FileFormat::Xml => "record with: candump -L can0".to_owned(),
        },
    })
}

/// Returns the message and the hint for a failed SDO transfer.
pub(super) fn sdo(error: &SdoError) -> CauseText {
    let cause_text = CauseText::new(error.to_string());
    match error.failure {
        SdoFailure::NoAnswer { waited, started, missed } => match silence_advice(error.node, waited, started, missed) {
            Some(hint) => cause_text.hint(hint),
            None => cause_text,
        },
        SdoFailure::Fit(_) => {
            cause_text.hint(format!("show its bytes: cangauge sdo read {} {} --type hex", error.node, error.object))
        }
        SdoFailure::Refused(code) if error.operation == Operation::Write && error.object.index == 0x1010 => {
            match code.0 {
                0x0606_0000 => cause_text.hint("its non-volatile memory may be worn out"),
                0x0800_0021 | 0x0800_0022 => {
                    cause_text.hint(format!("leave OPERATIONAL first: cangauge nmt preop {}", error.node))
                }
                _ => cause_text,
            }
        }
        SdoFailure::TwoDevices(_) | SdoFailure::NotWritten(_) => cause_text.hint(format!(
            "disconnect one of them, or change its node-ID: cangauge lss scan; to see both answers: cangauge scan {} \
             --trace -",
            error.node
        )),
        SdoFailure::Disturbed => cause_text.hint("stop the other program for a moment, or try again"),
        SdoFailure::Violation(Violation::WriteAcknowledgeToRead, _) => cause_text.hint(format!(
            "if it answers every read with 60h, read its device type first: cangauge sdo read {} 0x1000 {}",
            error.node, error.object
        )),
        SdoFailure::Violation(Violation::Crc, _) => cause_text.hint("read it without blocks: add --block never"),
        SdoFailure::Refused(_)
        | SdoFailure::Violation(..)
        | SdoFailure::WrongLength { .. }
        | SdoFailure::NotANumber
        | SdoFailure::Ambiguous
        | SdoFailure::TimeLimit(_)
        | SdoFailure::Cancelled => cause_text,
    }
}

/// Returns the warning about a node that sent two answers to one request.
pub fn second_answer(node: NodeId, answers: SecondAnswer) -> String {
    if answers.differs() {
        return format!("node {node}: {}", SdoFailure::TwoDevices(Some(answers)));
    }
    format!("node {node}: answers arrive twice: two devices have node-ID {node}, or a bridge repeats frames")
}

/// Returns the message for a temporary write that could not be recorded in the journal.
pub(super) fn not_recorded(error: &JournalError) -> String {
    format!("write the journal {}: {}", error.file, error.reason)
}

/// Returns the note about optional objects of a node that could not be read.
pub fn unknown_objects(node: NodeId, objects: &[ObjectId]) -> String {
    let objects: Vec<String> = objects.iter().map(ObjectId::to_string).collect();
    format!("node {node}: unknown objects (no valid answer): {}", objects.join(", "))
}

/// The hint for a node that does not answer.
fn silence_advice(node: NodeId, waited: Duration, started: bool, missed: MissedAnswer) -> Option<String> {
    if let Some(frame) = missed.frame {
        return (frame.id() != CanId::sdo_response(node)).then(|| {
            format!(
                "if it answers with another COB-ID, add: --sdo {node}=0x{}:0x{}",
                CanId::sdo_request(node),
                frame.id()
            )
        });
    }
    Some(match missed.state {
        Some(NmtState::Stopped) => format!("a stopped node does not answer SDO: cangauge nmt preop {node}"),
        _ if missed.has_answered || started => {
            format!(
                "the node answered before; find the cause: cangauge doctor {node}; if it is only slow, allow more time: \
                 -t {}",
                format_duration(waited * 4).replace(' ', "")
            )
        }
        Some(_) => "if its SDO channel has other COB-IDs, add: --sdo 0xTX:0xRX".to_owned(),
        None => check_silent_node(node),
    })
}

/// Returns the hint for a node that sends nothing. `node` is `None` if its node-ID is unknown. The hint names `doctor`
/// and not `scan`, because `scan` finds no cause on a dead bus.
pub(super) fn check_node(node: Option<NodeId>) -> String {
    let node = node.map_or_else(|| "all".to_owned(), |node| node.to_string());
    format!("check its node-ID, power and cable; find the cause: cangauge doctor {node}")
}

/// Returns the hint for a node that does not answer. A stopped node without heartbeat looks the same.
pub(super) fn check_silent_node(node: NodeId) -> String {
    format!("check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor {node}")
}

/// Returns the message and the hint for a failed LSS service.
pub(super) fn lss(error: &LssError) -> CauseText {
    let cause_text = CauseText::new(error.to_string());
    let hint = match error {
        LssError::Refused { service, .. } => refusal_hint(*service),
        LssError::NoAnswer { service, .. } => silence_hint(*service),
        LssError::Several { .. } => Some(
            "address one device, by its node-ID or as VENDOR:PRODUCT:REVISION:SERIAL, or connect it as the only device",
        ),
        LssError::Disturbed(_) => Some("stop the other program, or try again"),
        LssError::Fastscan(_) | LssError::AddressMismatch { .. } => {
            Some("connect the devices without a node-ID one at a time")
        }
        LssError::Violation { .. } | LssError::Master(_) => None,
    };
    match hint {
        Some(hint) => cause_text.hint(hint),
        None => cause_text,
    }
}

/// Whether a service addresses one slave.
pub(super) fn is_addressing(service: Service) -> bool {
    service == Service::SwitchSelective
}

fn refusal_hint(service: Service) -> Option<&'static str> {
    match service {
        Service::ConfigureBitTiming => {
            Some("find the bit rate table of the device in its manual, then use --table-index N")
        }
        Service::Store => Some("some devices store it through objects: --via sdo"),
        _ => None,
    }
}

fn silence_hint(service: Service) -> Option<&'static str> {
    match service {
        Service::SwitchSelective => Some(
            "no slave has this address, or it does not accept LSS in its NMT state: cangauge lss scan, or stop the node first: cangauge nmt stop NODE",
        ),
        Service::Store => {
            Some("it is unknown whether the values are stored: power the device off and on, then read it again")
        }
        Service::Inquire(_) | Service::InquireNodeId => {
            Some("not every device has this service; read its identity by SDO: cangauge scan")
        }
        _ => None,
    }
}

/// Returns the message, the hint and the place for a wrong expression.
pub(super) fn expression(error: &ExpressionError) -> CauseText {
    let place = Place { before: error.before().to_owned(), text: error.text.clone() };
    CauseText { message: error.message.clone(), hint: error.hint.clone(), place: Some(place) }
}
