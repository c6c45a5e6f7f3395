//! The whole job: who is meant, whether the new node-ID is free, configure, store, reset, confirm.

use super::cob_ids::{CobIds, cob_ids};
use super::confirm::{Confirmed, confirm};
use super::objects::by_objects;
use super::only::agreed;
use super::presence::taken;
use super::progress::{Done, Stage};
use super::retime::{Host, Retiming};
use super::session::{Session, prepared, put_back};
use super::subject::{Knowledge, Subject, subject};
use super::ways::{PlannedRate, Rate, plan_rate, way};
use super::{Note, Target, Tell, Via};
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::device::assign::{AssignEntry, AssignKind, RateSource, RateTable};
use crate::device::catalog::Model;
use crate::master::{Lss, LssError, Master};
use crate::node::Overrides;
use crate::tasks::{Failure, Kind};
use std::sync::Arc;
use std::time::Duration;

/// What is to be done.
#[derive(Clone, Debug)]
pub struct Job<'a> {
    /// To whom.
    pub target: Target,
    /// The node-ID that it gets.
    pub id: Option<NodeId>,
    /// The bit rate that it gets.
    pub rate: Option<Rate>,
    /// Whether it lasts.
    pub store: bool,
    /// Whether the host goes to the new bit rate together with the device.
    pub retime: bool,
    /// By which means.
    pub via: Via,
    /// Whether `only` goes on where more than one device shows itself.
    pub force: bool,
    /// Descriptions that the user named for nodes.
    pub overrides: &'a Overrides,
    /// The description that the user named for whichever device is meant.
    pub given: Option<Arc<Model>>,
}

/// What became of it.
#[derive(Clone, Debug)]
pub struct Report {
    /// As it was named.
    pub target: Target,
    /// Its node-ID before; `None` where it had none or nothing told it.
    pub old: Option<NodeId>,
    /// Its node-ID now.
    pub new: Option<NodeId>,
    /// The bit rate that was set, in bit/s where it is known, and its index.
    pub rate: Option<PlannedRate>,
    /// Whether the host is at the new bit rate, too.
    pub retimed: bool,
    /// Whether it lasts.
    pub stored: bool,
    /// What confirms it.
    pub confirmed: Confirmed,
    /// How long after the reset the boot-up came.
    pub boot: Option<Duration>,
    /// Its identity.
    pub address: Option<LssAddress>,
    /// Its description.
    pub model: Option<Arc<Model>>,
    /// Its COB-IDs under the new node-ID.
    pub cob_ids: Option<CobIds>,
}

/// Gives a device its node-ID or bit rate, or both.
///
/// # Errors
/// Why it was not done, what has been done and how to go on. Nothing is a success that the device has not shown.
pub fn assign(master: &mut Master<'_>, job: &Job<'_>, tell: Tell<'_>) -> Result<Report, Failure> {
    let knowledge = Knowledge { overrides: job.overrides, given: job.given.as_ref() };
    let subject = subject(master, &job.target, &knowledge, (job.via, job.force), tell)?;
    let way = way(&subject, job.via, job.store, tell)?;
    let description = subject.model.as_ref().map(|model| &model.description);
    let rate = job.rate.map(|rate| plan_rate(description, rate, way.way)).transpose()?;
    if let (Some(Rate::Bits(_)), RateSource::Standard) = (job.rate, RateTable::of(description).source) {
        tell(Note::Step(format!(
            "{}: its own table of bit rates is not known; that of CiA 305 is taken",
            subject.name()
        )));
    }
    check_free(master, job, &subject)?;
    tell(Note::Step(introduction(&subject, job)));
    let mut done = Done::of(job.id, rate);
    let result = carry_out(master, job, &subject, &way, rate, &mut done, tell);
    result.map_err(|failure| done.explain(failure, &subject))
}

fn check_free(master: &mut Master<'_>, job: &Job<'_>, subject: &Subject) -> Result<(), Failure> {
    let Some(new) = job.id.filter(|new| subject.node != Some(*new) || !subject.alone) else { return Ok(()) };
    let Some(sign) = taken(master, new)? else { return Ok(()) };
    let message = format!("node-ID {new} is taken ({sign}): nothing was changed");
    Err(subject.failure(Kind::CheckFailed, message).hint("who has which: cangauge lss scan"))
}

fn introduction(subject: &Subject, job: &Job<'_>) -> String {
    let free = job.id.filter(|new| subject.node != Some(*new)).map_or(String::new(), |new| format!("; {new} is free"));
    match subject.node {
        Some(node) => format!("node {node} is {}{free}", subject.title()),
        None => format!("{}{free}", subject.title()),
    }
}

fn carry_out(
    master: &mut Master<'_>,
    job: &Job<'_>,
    subject: &Subject,
    way: &AssignEntry,
    rate: Option<PlannedRate>,
    done: &mut Done,
    tell: Tell<'_>,
) -> Result<Report, Failure> {
    let mut report = Report {
        target: job.target.clone(),
        old: subject.node,
        new: job.id,
        rate,
        retimed: false,
        stored: job.store,
        confirmed: Confirmed::Acknowledge,
        boot: None,
        address: subject.address,
        model: subject.model.clone(),
        cob_ids: None,
    };
    let host = Host::of(master, rate);
    let follows = job.retime && host.is_left_behind();
    if let (true, Some(rate)) = (follows, rate) {
        let complete = Retiming::new(master, job, subject, way, rate)?.carry_out(master, done, tell)?;
        (report.retimed, report.confirmed) = (true, Confirmed::Identity);
        if complete {
            if let Some(new) = job.id {
                report.cob_ids = Some(cob_ids(master, new, subject.node, subject.model.as_deref())?);
            }
            return Ok(report);
        }
    }
    // Reset, it would come back at a bit rate at which nobody here hears it.
    let new = job.id.filter(|_| follows || !host.is_left_behind());
    let booted = match way.way {
        AssignKind::Lss => {
            let session = by_lss(master, job, subject, way, rate.filter(|_| !follows), done, tell)?;
            // A reset puts the NMT state to rights by itself.
            if new.is_none() {
                put_back(master, session.before, tell);
            }
            new.is_some_and(|new| session.booted.contains(&new))
        }
        AssignKind::Objects => {
            by_objects(master, subject, way, job.store, done)?;
            false
        }
    };
    tell(Note::Step(done.spoken()));
    let Some(new) = new else { return Ok(report) };
    let reset = match (subject.node.filter(|_| subject.alone), subject.unconfigured) {
        (Some(node), _) => Some(node),
        (None, true) => None,
        (None, false) => return Err(not_reset(subject, new)),
    };
    let (confirmed, boot) = confirm(master, subject, new, reset, booted)?;
    (report.confirmed, report.boot) = (confirmed, boot);
    report.cob_ids = Some(cob_ids(master, new, subject.node, subject.model.as_deref())?);
    Ok(report)
}

/// A reset by node-ID would hit another device, too, or nobody.
fn not_reset(subject: &Subject, new: NodeId) -> Failure {
    let why = match subject.node {
        Some(node) => format!("another device has node-ID {node} too"),
        None => "its present node-ID is not known".to_owned(),
    };
    let message = format!("not reset, since {why}: whether it becomes node {new} has not been seen");
    subject.failure(Kind::Unexpected, message)
}

/// Configures and stores by LSS.
fn by_lss(
    master: &mut Master<'_>,
    job: &Job<'_>,
    subject: &Subject,
    way: &AssignEntry,
    rate: Option<PlannedRate>,
    done: &mut Done,
    tell: Tell<'_>,
) -> Result<Session<()>, Failure> {
    let old_rate = old_index(master, subject);
    prepared(master, subject, way, tell, |lss| {
        let result = configure(lss, job, rate, done).map_err(|error| subject.lss_failure(error));
        if result.is_err() && done.is_pending() {
            undo(lss, subject, old_rate, done);
        }
        result
    })
}

/// The index of the bit rate at which the device works at the moment.
fn old_index(master: &Master<'_>, subject: &Subject) -> Option<u8> {
    let description = subject.model.as_ref().map(|model| &model.description);
    master.bus().bit_rate().and_then(|rate| RateTable::of(description).index_of(rate))
}

fn configure(lss: &mut Lss<'_, '_>, job: &Job<'_>, rate: Option<PlannedRate>, done: &mut Done) -> Result<(), LssError> {
    if let Some((id, stage)) = &mut done.id {
        let result = agreed(lss.configure_node_id(Some(*id)), job.force);
        *stage = stage_of(&result);
        result?;
    }
    if let (Some(rate), Some((_, stage))) = (rate, &mut done.rate) {
        let result = agreed(lss.configure_bit_timing(0, rate.index), job.force);
        *stage = stage_of(&result);
        result?;
    }
    if job.store {
        let result = agreed(lss.store(), job.force);
        done.stored = stage_of(&result);
        result?;
    }
    Ok(())
}

/// What an answer, or none, says of a step that was sent.
pub(super) fn stage_of(result: &Result<(), LssError>) -> Stage {
    match result {
        Ok(()) => Stage::Done,
        Err(LssError::Refused { .. }) => Stage::No,
        Err(_) => Stage::Sent,
    }
}

/// Takes back what is configured and not stored, so that no later reset brings it into force. What can be done is
/// done; the first failure is the one that counts.
fn undo(lss: &mut Lss<'_, '_>, subject: &Subject, old_rate: Option<u8>, done: &mut Done) {
    let is_open = |stage: Stage| matches!(stage, Stage::Sent | Stage::Done);
    if let Some((_, stage)) = &mut done.id
        && is_open(*stage)
        && (subject.node.is_some() || subject.unconfigured)
        && lss.configure_node_id(subject.node).is_ok()
    {
        *stage = Stage::Undone;
    }
    if let (Some((_, stage)), Some(index)) = (&mut done.rate, old_rate)
        && is_open(*stage)
        && !done.retimed
        && lss.configure_bit_timing(0, index).is_ok()
    {
        *stage = Stage::Undone;
    }
}

impl Report {
    /// What the device is, for people.
    pub fn title(&self) -> Option<&str> {
        self.model.as_ref().map(|model| model.description.title.as_str())
    }

    /// The bit rate that was set, in words.
    pub fn rate_spoken(&self) -> Option<String> {
        self.rate.map(|rate| rate.to_string())
    }

    /// The description's short name.
    pub fn device(&self) -> Option<&str> {
        self.model.as_ref().map(|model| model.description.name.as_str())
    }
}
