//! Sets node-ID and bit rate. Steps: find the device, check that the new node-ID is free, configure, store, reset,
//! confirm.

use super::cob_ids::{CobIds, cob_ids};
use super::confirm::{Confirmed, confirm};
use super::device::{Descriptions, LssDevice};
use super::event::LssEvent;
use super::failure::{LssCause, LssEffect, NextStep, NotReset};
use super::method::{PlannedRate, RequestedRate, check_objects, choose_method, objects_instead, plan_rate};
use super::node_id::find_taken_sign;
use super::objects::by_objects;
use super::progress::{Progress, Stage};
use super::resolve::resolve;
use super::retime::{Retiming, needs_host_change};
use super::services::{accepted_by_all, with_nothing_changed};
use super::session::{Session, in_required_state, is_silent, restore_state};
use super::{Notify, Target, Via};
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::device::assign::{AssignEntry, AssignKind, RateSource, RateTable};
use crate::device::catalog::Model;
use crate::master::{Lss, LssError, Master};
use crate::tasks::failure::check_confirmed;
use crate::tasks::{Failure, Kind};
use std::sync::Arc;
use std::time::Duration;

/// The settings to change.
#[derive(Clone, Debug)]
pub struct Job<'a> {
    /// The device.
    pub target: Target,
    /// The new node-ID.
    pub id: Option<NodeId>,
    /// The new bit rate.
    pub rate: Option<RequestedRate>,
    /// Whether to store node-ID and bit rate in non-volatile memory.
    pub store: bool,
    /// Whether the host changes to the new bit rate together with the device.
    pub retime: bool,
    /// The method.
    pub via: Via,
    /// Whether [`Target::Only`] continues if there is more than one device.
    pub force: bool,
    /// The descriptions that the user named.
    pub descriptions: Descriptions<'a>,
}

/// The result.
#[derive(Clone, Debug)]
pub struct Assigned {
    /// The device as the user named it.
    pub target: Target,
    /// Its previous node-ID; `None` if it had none or it is unknown.
    pub old: Option<NodeId>,
    /// Its new node-ID; `None` if only the bit rate was set.
    pub new: Option<NodeId>,
    /// The new bit rate.
    pub rate: Option<PlannedRate>,
    /// Whether the host works at the new bit rate.
    pub retimed: bool,
    /// Whether node-ID and bit rate are stored.
    pub stored: bool,
    /// The confirmation.
    pub confirmed: Confirmed,
    /// The time from the reset to the boot-up message.
    pub boot_time: Option<Duration>,
    /// The identity of the device.
    pub address: Option<LssAddress>,
    /// Its description; `None` for an unknown device.
    pub model: Option<Arc<Model>>,
    /// Its COB-IDs under the new node-ID.
    pub cob_ids: Option<CobIds>,
}

/// Sets node-ID, bit rate or both.
///
/// # Errors
/// The cause, the completed steps, and the next step; bus errors and Ctrl-C.
pub fn assign(master: &mut Master<'_>, job: &Job<'_>, notify: Notify<'_>) -> Result<Assigned, Failure> {
    let (device, method, rate) = prepare(master, job, notify).map_err(with_nothing_changed)?;
    let mut work = Work { job, device: &device, method, rate, progress: Progress::new(job.id, rate) };
    let mut result = work.carry_out(master, notify);
    if let Err(failure) = &result
        && let Some(objects) = work.objects_instead_of_lss(failure)
    {
        notify(device.note(LssEvent::ObjectsInsteadOfLss));
        result = check_objects(&device, &objects, job.store, notify).and_then(|()| {
            work.method = objects;
            work.progress = Progress::new(job.id, rate);
            work.carry_out(master, notify)
        });
    }
    result.map_err(|failure| work.explain(failure))
}

/// Makes all checks before the first change.
fn prepare(
    master: &mut Master<'_>,
    job: &Job<'_>,
    notify: Notify<'_>,
) -> Result<(LssDevice, AssignEntry, Option<PlannedRate>), Failure> {
    let start = master.now();
    let device = resolve(master, &job.target, &job.descriptions, (job.via, job.force), notify)?;
    check_confirmed(device.node, device.model.as_deref())?;
    let method = choose_method(&device, job.via, job.store, notify)?;
    let plan = |rate| plan_rate(device.description(), rate, method.kind).map_err(|cause| device.failure(cause));
    let rate = job.rate.map(plan).transpose()?;
    let table = RateTable::of(device.description(), method.kind);
    if let (Some(RequestedRate::Bits(_)), RateSource::Standard) = (job.rate, table.source) {
        notify(device.note(LssEvent::StandardRateTable));
    }
    let changes_to = job.id.filter(|new| device.node != Some(*new));
    if let Some(new) = job.id.filter(|_| changes_to.is_some() || !device.is_alone)
        && let Some(sign) = find_taken_sign(master, new, start)?
    {
        return Err(device.failure(LssCause::Taken(new, sign)));
    }
    let title = device.description().map(|description| description.title.clone());
    notify(device.note(LssEvent::Found { title, free: changes_to }));
    Ok((device, method, rate))
}

/// A job with the facts known before the first change.
struct Work<'a> {
    job: &'a Job<'a>,
    device: &'a LssDevice,
    method: AssignEntry,
    rate: Option<PlannedRate>,
    progress: Progress,
}

impl Work<'_> {
    fn carry_out(&mut self, master: &mut Master<'_>, notify: Notify<'_>) -> Result<Assigned, Failure> {
        let (job, device) = (self.job, self.device);
        let mut report = self.report();
        let needs_host_change = needs_host_change(master, self.rate);
        let host_follows = job.retime && needs_host_change;
        if let (true, Some(rate)) = (host_follows, self.rate) {
            let retiming = Retiming::new(master, job, device, &self.method, rate)?;
            let is_complete = retiming.carry_out(master, &mut self.progress, notify)?;
            (report.retimed, report.confirmed) = (true, Confirmed::Identity);
            if is_complete {
                report.cob_ids = self.cob_ids(master)?;
                return Ok(report);
            }
        }
        let booted = match self.method.kind {
            AssignKind::Lss => self.by_lss(master, host_follows, host_follows || !needs_host_change, notify)?,
            AssignKind::Objects => {
                by_objects(master, device, &self.method, job.store, &mut self.progress)?;
                false
            }
        };
        notify(device.note(LssEvent::Progress(self.progress.clone())));
        // After a reset, the device would use a different bit rate than the host.
        let Some(new) = job.id.filter(|_| host_follows || !needs_host_change) else { return Ok(report) };
        (report.confirmed, report.boot_time) = confirm(master, device, new, self.node_to_reset(new)?, booted)?;
        report.cob_ids = self.cob_ids(master)?;
        Ok(report)
    }

    fn report(&self) -> Assigned {
        Assigned {
            target: self.job.target.clone(),
            old: self.device.node,
            new: self.job.id,
            rate: self.rate,
            retimed: false,
            stored: self.job.store,
            confirmed: Confirmed::Acknowledge,
            boot_time: None,
            address: self.device.address,
            model: self.device.model.clone(),
            cob_ids: None,
        }
    }

    fn cob_ids(&self, master: &mut Master<'_>) -> Result<Option<CobIds>, Failure> {
        let Some(new) = self.job.id else { return Ok(None) };
        Ok(Some(cob_ids(master, new, self.device.node, self.device.model.as_deref())?))
    }

    /// Returns the node to reset; `None` if the device boots by itself.
    ///
    /// # Errors
    /// A reset would reach another device, or the node-ID is unknown.
    fn node_to_reset(&self, new: NodeId) -> Result<Option<NodeId>, Failure> {
        let why = match (self.device.own_node(), self.device.is_unconfigured, self.device.node) {
            (Some(node), ..) => return Ok(Some(node)),
            (None, true, _) => return Ok(None),
            (None, false, Some(node)) => NotReset::SharedNodeId(node),
            (None, false, None) => NotReset::NodeIdUnknown,
        };
        Err(self.device.failure(LssCause::NotReset(new, why)))
    }

    /// Configures and stores by LSS. Returns whether the device booted under its new node-ID.
    fn by_lss(
        &mut self,
        master: &mut Master<'_>,
        rate_is_set: bool,
        resets: bool,
        notify: Notify<'_>,
    ) -> Result<bool, Failure> {
        let (job, device, progress) = (self.job, self.device, &mut self.progress);
        let table = RateTable::of(device.description(), AssignKind::Lss);
        let old_rate = master.bus().bit_rate().and_then(|rate| table.index_of(rate));
        let session: Session<()> = in_required_state(master, device, &self.method, notify, |lss| {
            let result = configure(lss, job, !rate_is_set, progress).map_err(|error| device.lss_failure(error));
            if result.is_err() && progress.is_pending() {
                revert(lss, device, old_rate, progress);
            }
            result
        })?;
        let new = job.id.filter(|_| resets);
        // A reset restores the NMT state by itself.
        if new.is_none() {
            restore_state(master, device, session.previous_state, notify);
        }
        Ok(new.is_some_and(|new| session.booted.contains(&new)))
    }

    /// Returns the objects to use if the device does not answer LSS. They are used only if nothing was changed yet and
    /// the user did not choose the method.
    fn objects_instead_of_lss(&self, failure: &Failure) -> Option<AssignEntry> {
        let is_lss = self.job.via == Via::Auto && self.method.kind == AssignKind::Lss && !self.job.retime;
        let is_silent = is_lss && is_silent(self.device, failure) && self.progress.stored == Stage::NotDone;
        objects_instead(self.device, self.job.store).filter(|_| is_silent)
    }

    /// Adds the completed steps and the next step to a failure.
    fn explain(&self, mut failure: Failure) -> Failure {
        if self.progress.is_unchanged() {
            return with_nothing_changed(failure);
        }
        let next = match (self.progress.stored, failure.kind()) {
            (Stage::NotDone, Kind::Refused) => NextStep::Cause,
            (Stage::Done, _) => NextStep::SeeAfterPowerCycle,
            (Stage::Sent, _) => NextStep::StoreAgain,
            (Stage::NotDone | Stage::Reverted, _) => NextStep::PowerCycle,
        };
        failure.effects.push(LssEffect::Progress(self.device.name(), self.progress.clone(), next).into());
        failure
    }
}

fn configure(lss: &mut Lss<'_, '_>, job: &Job<'_>, with_rate: bool, progress: &mut Progress) -> Result<(), LssError> {
    if let Some((id, stage)) = &mut progress.id {
        let result = accepted_by_all(lss.configure_node_id(Some(*id)), job.force);
        *stage = Stage::after(&result);
        result?;
    }
    if let (Some((rate, stage)), true) = (&mut progress.rate, with_rate) {
        let result = accepted_by_all(lss.configure_bit_timing(0, rate.index), job.force);
        *stage = Stage::after(&result);
        result?;
    }
    if job.store {
        let result = accepted_by_all(lss.store(), job.force);
        progress.stored = Stage::after(&result);
        result?;
    }
    Ok(())
}

/// Restores values that were configured but not stored, because a later reset would activate them. Failures are
/// ignored, because the first failure is reported.
fn revert(lss: &mut Lss<'_, '_>, device: &LssDevice, old_rate: Option<u8>, progress: &mut Progress) {
    if let Some((_, stage)) = &mut progress.id
        && stage.may_be_set()
        && (device.node.is_some() || device.is_unconfigured)
        && lss.configure_node_id(device.node).is_ok()
    {
        *stage = Stage::Reverted;
    }
    if let (Some((_, stage)), Some(index)) = (&mut progress.rate, old_rate)
        && stage.may_be_set()
        && !progress.is_retimed
        && lss.configure_bit_timing(0, index).is_ok()
    {
        *stage = Stage::Reverted;
    }
}
