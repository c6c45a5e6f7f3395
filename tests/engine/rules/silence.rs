//! The cause that a failure names was seen: silence, a refusal, an unchanged device.

use super::*;
use cangauge::canopen::frame::Frame;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::Failure;
use std::time::Duration;

/// Compares the cause that a failure names with the frames of the command.
pub(super) fn check_cause(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let Err(failure) = &run.result else { return };
    match failure.kind() {
        Kind::NoAnswer if !spec.falsifies_data() && !spec.shares_node_ids() => {
            was_silent(spec, run, failure, violations)
        }
        // A refusal by the program itself sends no request.
        Kind::Refused if ErrorMessage::of(failure).message.contains("refused by the device") => {
            was_refused(run, failure, violations)
        }
        _ => {}
    }
    let stopped = failure.kind() == Kind::CheckFailed && !matches!(spec.command, Command::Check { .. });
    // A setting that was written and restored is not a change. The check after a power cycle shows other changes.
    let undoes = matches!(spec.command, Command::Assign { .. });
    if undoes {
        return;
    }
    if stopped || failure.kind() == Kind::Usage || ErrorMessage::of(failure).message.contains("nothing was changed") {
        let changes = (0..run.bus.frames.len()).find_map(|place| taken(&run.bus.frames[place..]));
        if let Some((at, frame)) = changes {
            violations.push(("reports its changes", format!("{failure}, and {frame} at {:?}", at.since_start())));
        }
    }
}

/// The first of these frames that changed a device, or may have.
fn taken(frames: &[(Mono, Passed)]) -> Option<(Mono, Frame)> {
    let (&(at, Passed::Sent(request)), rest) = frames.split_first()? else { return None };
    let refuses =
        |answer: &Frame| match (request.id().sdo_request_node(), request.as_eight_bytes(), answer.as_eight_bytes()) {
            (Some(node), Some(request), Some(answered)) => {
                answer.id() == CanId::sdo_response(node) && answered[0] == 0x80 && answered[1..4] == request[1..4]
            }
            (None, Some(request), Some(answered)) => {
                answer.id() == CanId::LSS_SLAVE && answered[0] == request[0] && answered[1] != 0
            }
            _ => false,
        };
    let refused = rest.iter().any(|(_, passed)| matches!(passed, Passed::Received(answer) if refuses(answer)));
    (changes(&request) && !refused).then_some((at, request))
}

/// Whether a frame of the program changes a device beyond the end of the command.
fn changes(frame: &Frame) -> bool {
    match (frame.id().sdo_request_node(), frame.data().first()) {
        (Some(_), Some(first)) => begins(frame).is_some() && matches!(first >> 5, 1 | 6),
        (None, Some(first)) => frame.id() == CanId::LSS_MASTER && matches!(first, 0x11 | 0x13 | 0x15 | 0x17),
        (_, None) => false,
    }
}

/// The object of a request that begins a transfer.
fn begins(frame: &Frame) -> Option<ObjectId> {
    let data = frame.as_eight_bytes()?;
    let begins = match data[0] >> 5 {
        1 | 2 => true,
        5 => data[0] & 0x03 == 0,
        6 => data[0] & 0x01 == 0,
        _ => false,
    };
    begins.then(|| ObjectId::from_multiplexer([data[1], data[2], data[3]]))
}

/// If the failure is "no answer", there is a request without an answer.
fn was_silent(spec: &Spec, run: &Run, failure: &Failure, violations: &mut Vec<Violation>) {
    let (Some(node), Some(object)) = (failure.node, failure.object) else { return };
    let message = ErrorMessage::of(failure).message;
    // The set-up of a recording has a limit for all transfers together: the last one may not have started.
    if message.contains("in the middle") || message.contains("not finished within") {
        return;
    }
    let writes = message.contains(&format!("write {object}"));
    let asks = |frame: &Frame| {
        let writing = frame.data().first().is_some_and(|first| matches!(first >> 5, 1 | 6));
        let started = begins(frame).filter(|_| frame.id() == CanId::sdo_request(node));
        started.map(|started| (started, started == object && writing == writes))
    };
    let requests = run.bus.all_sent().into_iter().filter_map(|(at, frame)| Some((at, asks(&frame)?)));
    let requests: Vec<(Mono, (ObjectId, bool))> = requests.collect();
    let Some(first) = requests.iter().position(|(_, (_, is_it))| *is_it) else {
        if !(run.bus.was_down || run.bus.was_off || spec.faults.iter().any(is_full)) {
            violations.push(("names the cause", format!("never asked: {failure}")));
        }
        return;
    };
    // Before an object is read again, another one is read, so that a late answer cannot count as the new one. The
    // read without an answer may be this other read.
    let answered = requests[first..].iter().all(|(at, (object, _))| {
        let until = *at + Duration::from_millis(spec.timeout_ms);
        let mut received = run.bus.frames.iter();
        received.any(|(came, passed)| {
            came > at && *came < until && matches!(passed, Passed::Received(frame) if answers(frame, node, *object))
        })
    });
    if answered {
        violations.push(("names the cause", format!("it was answered: {failure}")));
    }
}

/// Whether a frame answers a request that begins a transfer of an object.
fn answers(frame: &Frame, node: NodeId, object: ObjectId) -> bool {
    let addressed = frame.as_eight_bytes().map(|data| ObjectId::from_multiplexer([data[1], data[2], data[3]]));
    let is_answer = frame.data().first().is_some_and(|first| matches!(first >> 5, 2..=6));
    frame.id() == CanId::sdo_response(node) && addressed == Some(object) && is_answer
}

fn is_full(fault: &Fault) -> bool {
    matches!(fault, Fault::QueueFull(_) | Fault::Full { .. })
}

/// If the failure is "refused", a device has rejected a request.
fn was_refused(run: &Run, failure: &Failure, violations: &mut Vec<Violation>) {
    let refuses = |frame: &Frame| match (failure.abort(), failure.node, frame.data()) {
        (Some(code), Some(node), [0x80, rest @ ..]) => {
            // Missing bytes of a truncated frame count as zero.
            let said = rest.get(3..).unwrap_or_default();
            frame.id().sdo_response_node().or(frame.id().sdo_request_node()) == Some(node)
                && (said == code.0.to_le_bytes() || said.len() < 4 && code.0 == 0)
        }
        (None, _, [_, code, ..]) => frame.id() == CanId::LSS_SLAVE && *code != 0,
        _ => false,
    };
    let came = run.bus.frames.iter().any(|(_, passed)| matches!(passed, Passed::Received(frame) if refuses(frame)));
    if !came {
        violations.push(("names the cause", format!("no device rejected a request: {failure} {:?}", failure.abort())));
    }
}
