//! Messages, hints and notes if a node-ID or a bit rate was not set.

use super::CauseText;
use super::below;
use crate::bus::time::format_duration;
use crate::canopen::id::NodeId;
use crate::output::lss::{another, duplicate, progress, short};
use crate::output::notes::NoteText;
use crate::tasks::Failure;
use crate::tasks::failure::LssError;
use crate::tasks::lss::{
    DeviceName, DuplicateSign, HostObstacle, LssCause, LssEffect, LssFailure, Neighbour, NextStep, NotReset,
    RequestedRate, Setting, TakenSign,
};

/// The hint if one identity or one node-ID belongs to several devices.
const CONNECT_ALONE: &str = "connect only this device";

/// The message and the hint for a cause. A device without a known node-ID is shown by its identity.
pub(super) fn words(failure: &Failure, cause: &LssFailure) -> CauseText {
    let mut cause_text = describe_cause(failure, cause);
    if let (None, Some(address)) = (failure.node, cause.device.address) {
        cause_text.message = format!("{address}: {}", cause_text.message);
    }
    cause_text
}

fn describe_cause(failure: &Failure, cause: &LssFailure) -> CauseText {
    match &cause.cause {
        LssCause::Service(error) => service(&cause.device, error),
        LssCause::OtherDescription(device) => {
            let code =
                |number: Option<u32>| number.map_or_else(|| "unknown".to_owned(), |number| format!("0x{number:X}"));
            let (file, vendor, product) = (&device.file, code(device.vendor), code(device.product));
            CauseText::new(format!("{file} is for another device: vendor {vendor}, product {product}"))
                .hint("choose the file of this device, or add --accept-mismatch")
        }
        LssCause::NoSerialNumber => {
            CauseText::new("it has no serial number, so it cannot be distinguished from another device")
                .hint("connect only this device, and use the target \"only\"")
        }
        LssCause::DuplicateNodeId(sign) => duplicate_node_id(*sign),
        LssCause::NoAnswer(waited) => CauseText::new(format!("no answer within {}", format_duration(*waited)))
            .hint(below::check_node(cause.device.node)),
        LssCause::OtherNodeIdByLss(found) => other_node_id(*found),
        LssCause::SameIdentity(other) => {
            CauseText::new(format!("node {other} has the same identity")).hint(CONNECT_ALONE)
        }
        LssCause::SeveralWithIdentity => CauseText::new("more than one device has this identity").hint(CONNECT_ALONE),
        LssCause::NotTheOnly(sign) => {
            let names = cause.device.node.map_or_else(|| "node-ID".to_owned(), |node| format!("node-ID ({node})"));
            CauseText::new(another(sign))
                .hint(format!("use the {names} or the identity of one device; list them: cangauge lss scan"))
        }
        LssCause::NoDevice => CauseText::new("no device answers by SDO or LSS")
            .hint("check power, wiring and bit rate; find the cause: cangauge doctor all"),
        LssCause::NoUnconfigured => CauseText::new("no device without a node-ID answers")
            .hint("fastscan finds only devices without a node-ID; find the others: cangauge doctor all"),
        LssCause::NoneInRange(range) => CauseText::new(format!("no LSS slave within {range} answers")),
        LssCause::NoInquiry => CauseText::new("it does not support the LSS inquiries (5Ah to 5Eh)")
            .hint("read its identity by SDO: cangauge scan"),
        LssCause::Taken(new, sign) => {
            let sign = match sign {
                TakenSign::Answer => "a node answers",
                TakenSign::Heartbeat => "a node sends heartbeats",
            };
            CauseText::new(format!("node-ID {new} is taken ({sign})")).hint("list the devices: cangauge lss scan")
        }
        LssCause::ObjectsUnknown
        | LssCause::ObjectsOutOfReach
        | LssCause::NoObject(_)
        | LssCause::Number(..)
        | LssCause::NeedsStore(_) => objects(&cause.cause),
        LssCause::NoSuchRate { .. } | LssCause::RateCodesUnknown(_) => table(&cause.cause),
        LssCause::NotReset(..)
        | LssCause::OtherDeviceAnswers(_)
        | LssCause::NotIdentified
        | LssCause::DuplicateNewNodeId(_)
        | LssCause::SilentAfterBootUp(_)
        | LssCause::StillOldNodeId { .. }
        | LssCause::NotSeen { .. } => after_reset(failure, &cause.cause),
        LssCause::HostCannotChange(_)
        | LssCause::NotAloneForRetime(_)
        | LssCause::SilentAtRate(_)
        | LssCause::SilentAfterStore { .. } => retime(&cause.cause),
    }
}

/// Returns the message if a device with the same identity has another node-ID, or none.
fn other_node_id(found: Option<NodeId>) -> CauseText {
    let found = found.map_or_else(|| "has no node-ID".to_owned(), |found| format!("has node-ID {found}"));
    CauseText::new(format!("a device with the same identity answers LSS and {found}")).hint(CONNECT_ALONE)
}

/// Returns the message if the answers from a node-ID cannot be assigned to one device.
fn duplicate_node_id(sign: DuplicateSign) -> CauseText {
    let message = duplicate(sign);
    match sign {
        DuplicateSign::OtherMaster => CauseText::new(message).hint("stop the other program, or try again"),
        _ => CauseText::new(format!("{message}: several devices probably have this node-ID")).hint(
            "connect one device at a time, or use the identity on its label: \
             cangauge lss set-id VENDOR:PRODUCT:REVISION:SERIAL NEW",
        ),
    }
}

/// Returns the message if an LSS service failed. If the device is silent, the hint says that it may answer in STOPPED.
fn service(device: &DeviceName, error: &LssError) -> CauseText {
    let cause_text = below::lss(error);
    let is_silent = matches!(error, LssError::NoAnswer { service, .. } if below::is_addressing(*service));
    match (device.node, device.address) {
        (Some(node), Some(address)) if is_silent => cause_text.hint(format!(
            "it may answer LSS only in STOPPED: cangauge nmt stop {node} && cangauge lss inquire {address}"
        )),
        _ => cause_text,
    }
}

/// Returns the message if the objects of the device cannot be used.
fn objects(cause: &LssCause) -> CauseText {
    const BY_LSS: &str = "use LSS: --via lss";
    match cause {
        LssCause::ObjectsUnknown => CauseText::new("the objects that set its node-ID and bit rate are unknown")
            .hint("use LSS: --via lss; or choose a description: --device NAME"),
        LssCause::ObjectsOutOfReach => CauseText::new("SDO does not reach it, or another device has the same node-ID")
            .hint(format!("{CONNECT_ALONE}, or {BY_LSS}")),
        LssCause::NoObject(setting) => {
            let setting = match setting {
                Setting::NodeId => "node-ID",
                Setting::BitRate => "bit rate",
            };
            CauseText::new(format!("the object that sets its {setting} is unknown")).hint(BY_LSS)
        }
        LssCause::Number(object, reason) => CauseText::new(format!("{object}: {reason}")),
        LssCause::NeedsStore(Some(object)) => CauseText::new(format!(
            "its objects take effect only after they are stored ({object}) and the device is reset"
        ))
        .hint(format!("omit --no-store, or {BY_LSS}")),
        LssCause::NeedsStore(None) => CauseText::new("the device stores its objects as soon as they are written")
            .hint(format!("omit --no-store, or {BY_LSS}")),
        _ => CauseText::default(),
    }
}

/// Returns the message if the bit rate is not in the table of the device.
fn table(cause: &LssCause) -> CauseText {
    match cause {
        LssCause::NoSuchRate { title, rate, rates, has_auto, is_standard } => {
            let wanted = match rate {
                RequestedRate::Bits(bits) => short(*bits),
                RequestedRate::Auto => "auto".to_owned(),
                RequestedRate::Index(index, _) => format!("index {index}"),
            };
            let mut list: Vec<String> = rates.iter().map(|rate| short(*rate)).collect();
            list.extend(has_auto.then(|| "auto".to_owned()));
            let source = if *is_standard { "the table of CiA 305" } else { "its table" };
            let title = title.as_deref().unwrap_or("CiA 305");
            CauseText::new(format!("{title} has no bit rate {wanted}"))
                .hint(format!("{source} has {}; for another rate: --table-index N", list.join(", ")))
        }
        LssCause::RateCodesUnknown(title) => {
            let title = title.as_deref().unwrap_or("this device");
            CauseText::new(format!("the bit rate codes of {title} are unknown"))
                .hint("find the code in its manual, then use --table-index N")
        }
        _ => CauseText::default(),
    }
}

/// Returns the message if the device does not respond at its new node-ID.
fn after_reset(failure: &Failure, cause: &LssCause) -> CauseText {
    match cause {
        LssCause::NotReset(new, why) => {
            let why = match why {
                NotReset::SharedNodeId(node) => format!("another device also has node-ID {node}"),
                NotReset::NodeIdUnknown => "its present node-ID is unknown".to_owned(),
            };
            CauseText::new(format!("not reset, because {why}: node-ID {new} is not confirmed"))
        }
        LssCause::OtherDeviceAnswers(found) => {
            CauseText::new(format!("another device answers under the new node-ID: {found}"))
        }
        LssCause::NotIdentified => CauseText::new("the device with the new node-ID reports no identity"),
        LssCause::DuplicateNewNodeId(DuplicateSign::OtherMaster) => {
            CauseText::new(duplicate(DuplicateSign::OtherMaster))
                .hint("stop the other program, and check: cangauge scan")
        }
        LssCause::DuplicateNewNodeId(sign) => {
            CauseText::new(format!("{}: several devices have this node-ID", duplicate(*sign)))
        }
        LssCause::SilentAfterBootUp(waited) => {
            CauseText::new(format!("boot-up received, then no answer within {}", format_duration(*waited)))
        }
        LssCause::StillOldNodeId { old, new } => {
            CauseText::new(format!("it was reset but still has node-ID {old}, not {new}"))
        }
        LssCause::NotSeen { new, waited } => {
            let cause_text =
                CauseText::new(format!("no boot-up and no answer from node {new} within {}", format_duration(*waited)));
            match failure.node {
                Some(_) => cause_text.hint("list the devices: cangauge lss scan"),
                None => cause_text,
            }
        }
        _ => CauseText::default(),
    }
}

/// Returns the message if device and host did not change the bit rate together.
fn retime(cause: &LssCause) -> CauseText {
    match cause {
        LssCause::HostCannotChange(obstacle) => {
            let why = match obstacle {
                HostObstacle::RateUnknown => "the new bit rate is unknown",
                HostObstacle::NoBitRate => "the interface has no bit rate",
                HostObstacle::AppliesAtPowerOn => "the device changes its bit rate at power-on",
                HostObstacle::AppliesAfterStore => "the device changes its bit rate only after it is stored",
            };
            CauseText::new(format!("{why}, so the host cannot change its bit rate together with the device"))
                .hint("omit --retime, and set the interface by hand")
        }
        LssCause::NotAloneForRetime(neighbour) => {
            let other = match neighbour {
                Neighbour::Node(node) => format!("node {node} is"),
                Neighbour::Unconfigured => "a device without a node-ID is".to_owned(),
                Neighbour::Sender(id) => format!("a sender of frames {id} is"),
            };
            CauseText::new(format!("{other} on the bus too; --retime requires a single device"))
                .hint(format!("{CONNECT_ALONE}, or omit --retime"))
        }
        LssCause::SilentAtRate(bits) => CauseText::new(format!("it does not answer at {}", short(*bits))),
        LssCause::SilentAfterStore { bit_rate, interface, host } => {
            let new = short(*bit_rate);
            let cause_text = CauseText::new(format!(
                "stored and reset, but the device does not answer at {new}; the host uses {}",
                short(*host)
            ));
            cause_text.hint(format!("find its bit rate: cangauge bus detect {interface} --active"))
        }
        _ => CauseText::default(),
    }
}

/// The text for an effect.
pub(in crate::output) fn effect(effect: &LssEffect) -> NoteText {
    match effect {
        LssEffect::MayBeConfiguring => {
            NoteText::new("may-be-configuring", "the device may still be in the LSS configuration state")
                .command("a power cycle ends it; then", "cangauge lss scan")
        }
        LssEffect::HostIsBack { bit_rate, device_answers: false, .. } => NoteText::new(
            "host-restored",
            format!("the host is back at {}", short(*bit_rate)),
        )
        .command("nothing was stored; power the device off and on, then check that it answers", "cangauge lss scan"),
        LssEffect::HostIsBack { bit_rate, new, device_answers: true } => {
            let (old, new) = (short(*bit_rate), short(*new));
            let message =
                format!("the device still answers at {old}, and the host is back at {old}; check its manual for {new}");
            NoteText::new("host-restored", message).command("show its state", "cangauge lss scan")
        }
        LssEffect::Progress(device, done, next) => {
            let text = NoteText::new("progress", progress(done));
            match next {
                NextStep::Cause => text,
                NextStep::SeeAfterPowerCycle => {
                    text.command("power it off and on, then show its node-ID", "cangauge lss scan")
                }
                NextStep::StoreAgain => text.command(
                    "store again, or power the device off and on and check its settings",
                    format!("cangauge lss store {}", argument(device)),
                ),
                NextStep::PowerCycle => text.command(
                    "power the device off and on to discard values that are not stored, then show its node-ID",
                    "cangauge lss scan",
                ),
            }
        }
    }
}

/// Returns the argument that names the device in the next command.
fn argument(device: &DeviceName) -> String {
    match (device.node, device.address) {
        (Some(node), _) => node.to_string(),
        (None, Some(address)) => address.to_string(),
        (None, None) => "only".to_owned(),
    }
}
