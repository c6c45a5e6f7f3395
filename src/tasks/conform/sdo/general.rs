//! Rules for all SDO requests and answers.

use super::super::case::{Area, Case, Run, Severity::*};
use super::super::finding::{Expected, Finding, Seen, Verdict, WhyNot};
use super::super::session::{Session, request};
use super::{ABORT, MISSING, expedited_size, narrow_setting, unchanged};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::multiplexer;
use crate::node::Error;

const fn case(id: &'static str, sentence: &'static str, clause: &'static str, run: Run) -> Case {
    Case::new(Area::Sdo, id, sentence, clause, run)
}

pub(in super::super) const CASES: &[Case] = &[
    case("SDO-20", "Aborts and acknowledgements contain the object of the request", ABORT, multiplexers)
        .matters(High, "A master assigns the answer to the wrong request."),
    case("SDO-21", "Unused bytes of answers are 0", "CiA 301, SDO protocols", padding)
        .matters(Low, "Masters that decode the value with a longer type get a wrong value."),
    case("SDO-22", "Each of 50 reads without a pause is answered once", "CiA 301, SDO protocols", in_a_row)
        .matters(High, "Reads are lost, or an answer is assigned to the next read."),
    case("SDO-23", "A request of fewer than eight bytes is not executed", "CiA 301, SDO protocols", short_request)
        .matters(Low, "A cut-off request changes a setting."),
    case("SDO-24", "Requests to another node-ID are not answered", "CiA 301, predefined connection set", other_node)
        .matters(High, "The device disturbs the transfers of other nodes.")
        .alone(),
];

fn multiplexers(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut findings = Vec::new();
    let mut check = |object: ObjectId, answer: Option<Frame>| {
        if let Some(frame) = answer.filter(|frame| multiplexer(frame.data()).is_some_and(|found| found != object)) {
            findings.push(Finding::at(object, Expected::Answer, Seen::Frame(frame)));
        }
    };
    for object in [MISSING, ObjectId::DEVICE_TYPE.with_sub(1), ObjectId::new(0x1018, 1)] {
        check(object, session.upload(object)?);
    }
    session.open_transfer = None;
    if let Some((object, value)) = narrow_setting(session)? {
        check(object, session.download(object, &value)?);
    }
    Ok(Verdict::of(findings))
}

fn padding(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let mut findings = Vec::new();
    for object in [ObjectId::new(0x1001, 0), ObjectId::new(0x1018, 0)] {
        let Some(answer) = session.upload(object)? else { continue };
        let Some(used) = expedited_size(&answer) else { continue };
        if answer.data().get(4 + used..).unwrap_or_default().iter().any(|&byte| byte != 0) {
            findings.push(Finding::at(object, Expected::ZeroPadding, Seen::Frame(answer)));
        }
    }
    session.open_transfer = None;
    if let Some((object, value)) = narrow_setting(session)?
        && let Some(answer) = session.download(object, &value)?
        && let [0x60, _, _, _, rest @ ..] = answer.data()
        && rest.iter().any(|&byte| byte != 0)
    {
        findings.push(Finding::at(object, Expected::ZeroPadding, Seen::Frame(answer)));
    }
    Ok(Verdict::of(findings))
}

/// The reads of `SDO-22`.
const READS_IN_A_ROW: usize = 50;

fn in_a_row(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let (object, id) = (ObjectId::DEVICE_TYPE, CanId::sdo_response(session.node.id));
    let timeout = session.timeout();
    for count in 0..READS_IN_A_ROW {
        let answer = session.upload(object)?;
        if answer.as_ref().and_then(|frame| multiplexer(frame.data())) != Some(object) {
            session.open_transfer = None;
            let missing = Finding::at(object, Expected::Frames(READS_IN_A_ROW), Seen::Frames(count));
            return Ok(Verdict::of([missing]));
        }
    }
    session.open_transfer = None;
    let further = session.collect(timeout / 2)?;
    let extra = further.iter().find(|received| received.frame.id() == id);
    Ok(Verdict::of(extra.map(|extra| Finding::at(object, Expected::NoAnswer, Seen::Frame(extra.frame)))))
}

fn short_request(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let Some((object, value)) = narrow_setting(session)?.filter(|(_, value)| value.len() == 2) else {
        return Ok(Verdict::NotApplicable(WhyNot::NoSuitableObject));
    };
    session.touch(object)?;
    let [a, b, c] = object.multiplexer();
    let command = if session.omits_sizes() { 0x22 } else { 0x2b };
    let id = session.node.id;
    if let Ok(frame) = Frame::new(CanId::sdo_request(id), &[command, a, b, c, value[0] ^ 0x40, value[1]]) {
        session.master.exchange(frame, CanId::sdo_response(id), session.timeout())?;
    }
    Ok(Verdict::of(unchanged(session, object, &value)?))
}

fn other_node(session: &mut Session<'_, '_>) -> Result<Verdict, Error> {
    let own = session.node.id;
    let other = NodeId::new(own.get() % 127 + 1).unwrap_or(NodeId::MIN);
    let frame = Frame::full(CanId::sdo_request(other), request(0x40, ObjectId::DEVICE_TYPE, [0; 4]));
    session.master.send(frame);
    let timeout = session.timeout();
    let found =
        session.collect(timeout)?.into_iter().find(|received| received.frame.id().sdo_response_node().is_some());
    Ok(Verdict::of(found.map(|found| Finding::new(Expected::NoAnswer, Seen::Frame(found.frame)))))
}
