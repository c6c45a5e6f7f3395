//! Changes the bit rate of device and host together. With LSS, nothing is stored before the device answers at the new
//! bit rate. A power cycle then restores the old bit rate.

use super::Notify;
use super::assign::Job;
use super::device::{LssDevice, Reach};
use super::event::LssEvent;
use super::failure::{HostObstacle, LssCause, LssEffect, Neighbour};
use super::method::PlannedRate;
use super::node_id::{AnsweringDevices, LISTEN_TIME, answering_devices};
use super::nodes;
use super::objects::by_objects;
use super::progress::{Progress, Stage};
use super::session::{PreviousState, in_configuration_state, in_required_state, restore_state};
use crate::bus::{Filters, Mono};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtCommand;
use crate::device::assign::{Applies, AssignEntry, AssignKind, RateTable};
use crate::master::{Master, MasterEvent};
use crate::node::wait::{Policy, pause, wait};
use crate::tasks::host::{HostAction, not_set};
use crate::tasks::{Effect, Failure, Kind};
use std::ops::ControlFlow;
use std::time::Duration;

/// The delay of the activation (15h). The device uses the old bit rate for this time, then it is silent for the same
/// time (table 8 of the DPS manual).
const DELAY_MS: u16 = 1000;
const DELAY: Duration = Duration::from_millis(DELAY_MS as u64);

/// Additional time for inaccurate clocks and for the interface.
const MARGIN: Duration = Duration::from_millis(50);

/// How long to wait for an answer of the device at a bit rate.
const SEARCH_TIME: Duration = Duration::from_secs(4);

/// Whether the device may change to a different bit rate than the host.
pub(super) fn needs_host_change(master: &Master<'_>, rate: Option<PlannedRate>) -> bool {
    rate.is_some_and(|rate| rate.bits.is_none() || rate.bits != master.bus().bit_rate())
}

/// A change of the bit rate of device and host.
pub(super) struct Retiming<'a> {
    job: &'a Job<'a>,
    device: &'a LssDevice,
    method: &'a AssignEntry,
    index: u8,
    /// The old bit rate in bit/s.
    old: u32,
    /// The new bit rate in bit/s.
    new: u32,
}

impl<'a> Retiming<'a> {
    /// Checks the conditions before anything is changed.
    ///
    /// # Errors
    /// A bit rate is unknown, the privilege is missing, or another device is on the bus.
    pub(super) fn new(
        master: &mut Master<'_>,
        job: &'a Job<'a>,
        device: &'a LssDevice,
        method: &'a AssignEntry,
        rate: PlannedRate,
    ) -> Result<Retiming<'a>, Failure> {
        let refuse = |obstacle| device.failure(LssCause::HostCannotChange(obstacle));
        let new = rate.bits.ok_or_else(|| refuse(HostObstacle::RateUnknown))?;
        let old = master.bus().bit_rate().ok_or_else(|| refuse(HostObstacle::NoBitRate))?;
        let name = master.bus().name().to_owned();
        master.bus().can_set_bit_rate().map_err(|error| not_set(error, host_action(name, new)))?;
        if method.kind == AssignKind::Objects && !job.store {
            return Err(refuse(HostObstacle::AppliesAfterStore));
        }
        if method.kind == AssignKind::Objects && method.applies == Applies::Power {
            return Err(refuse(HostObstacle::AppliesAtPowerOn));
        }
        check_alone(master, device)?;
        Ok(Retiming { job, device, method, index: rate.index, old, new })
    }

    /// Changes device and host to the new bit rate. Returns whether the job is complete. A device that must store the
    /// bit rate before it uses it also stores the node-ID.
    ///
    /// # Errors
    /// The device does not answer at the new bit rate. The host then uses the old bit rate again.
    pub(super) fn carry_out(
        &self,
        master: &mut Master<'_>,
        progress: &mut Progress,
        notify: Notify<'_>,
    ) -> Result<bool, Failure> {
        match self.method.kind {
            AssignKind::Lss => self.by_lss(master, progress, notify)?,
            AssignKind::Objects => self.by_storing(master, progress, notify)?,
        }
        Ok(self.job.id.is_none() || self.method.kind == AssignKind::Objects)
    }

    fn by_lss(&self, master: &mut Master<'_>, progress: &mut Progress, notify: Notify<'_>) -> Result<(), Failure> {
        let device = self.device;
        let mut activated = None;
        let session = in_required_state(master, device, self.method, notify, |lss| {
            let result = lss.configure_bit_timing(0, self.index);
            progress.set_rate(Stage::after(&result));
            result.map_err(|error| device.lss_failure(error))?;
            lss.activate(DELAY_MS).map_err(|error| device.lss_failure(error))?;
            activated = Some(lss.master().now());
            Ok(())
        });
        let previous = match session {
            Ok(session) => session.previous_state,
            Err(failure) if activated.is_none() => return Err(failure),
            Err(failure) => {
                return Err(self.restore_host_bit_rate(master, failure, (master.now(), None), progress, notify));
            }
        };
        let start = activated.unwrap_or_else(|| master.now());
        notify(device.note(LssEvent::ChangingRate { bit_rate: self.new, delay_ms: DELAY_MS }));
        let host_result = self.set_host_bit_rate(master, start);
        let host_result = host_result
            .map_err(|failure| self.restore_host_bit_rate(master, failure, (start, previous), progress, notify));
        master.set_tolerates_outages(false);
        host_result?;
        progress.is_retimed = true;
        notify(device.note(LssEvent::AnswersAt { bit_rate: self.new }));
        if self.job.id.is_some() {
            return Ok(());
        }
        let stored = if self.job.store { self.store(master, progress) } else { Ok(()) };
        restore_state(master, device, previous, notify);
        stored
    }

    /// Stores the new bit rate. Without a store, the device uses it until a power cycle.
    fn store(&self, master: &mut Master<'_>, progress: &mut Progress) -> Result<(), Failure> {
        in_configuration_state(master, self.device, |lss| {
            let result = lss.store();
            progress.stored = Stage::after(&result);
            result.map_err(|error| self.device.lss_failure(error))
        })
        .map(|_| ())
    }

    /// Sets the host to the new bit rate, and waits until the device answers.
    fn set_host_bit_rate(&self, master: &mut Master<'_>, start: Mono) -> Result<(), Failure> {
        // No node acknowledges frames at a wrong bit rate.
        master.set_tolerates_outages(true);
        pause(master, start + DELAY + MARGIN, Policy::Reconnect)?;
        set_bus_rate(master, self.new)?;
        pause(master, start + DELAY * 2 + MARGIN, Policy::Reconnect)?;
        if answers(master, self.device, self.device.node)? {
            return Ok(());
        }
        Err(self.device.failure(LssCause::SilentAtRate(self.new)))
    }

    /// Sets the host to the old bit rate again, and waits until the device answers.
    fn restore_host_bit_rate(
        &self,
        master: &mut Master<'_>,
        mut failure: Failure,
        (start, previous): (Mono, Option<PreviousState>),
        progress: &mut Progress,
        notify: Notify<'_>,
    ) -> Failure {
        let device = self.device;
        if master.bus().bit_rate() != Some(self.old)
            && let Err(error) = master.set_bit_rate(self.old)
        {
            let (interface, bit_rate) = (master.bus().name().to_owned(), Some(self.old));
            failure.effects.push(Effect::InterfaceNotRestored { interface, bit_rate, reason: error.to_string() });
            return failure;
        }
        // Before this moment the device may still change its bit rate. A second Ctrl-C ends the wait.
        let _ = pause(master, start + DELAY * 2 + MARGIN, Policy::Reconnect);
        let device_answers = matches!(answers(master, device, device.node), Ok(true));
        if device_answers {
            // Otherwise the next reset would activate the new bit rate.
            let index = RateTable::of(device.description(), self.method.kind).index_of(self.old);
            let is_reverted = index.is_some_and(|index| {
                let revert = in_configuration_state(master, device, |lss| {
                    lss.configure_bit_timing(0, index).map_err(|error| device.lss_failure(error))
                });
                revert.is_ok()
            });
            restore_state(master, device, previous, notify);
            if is_reverted {
                progress.set_rate(Stage::Reverted);
            }
        }
        let effect = LssEffect::HostIsBack { bit_rate: self.old, new: self.new, device_answers };
        failure.effects.push(effect.into());
        failure
    }

    /// Changes the bit rate of a device that uses it only after a store.
    fn by_storing(&self, master: &mut Master<'_>, progress: &mut Progress, notify: Notify<'_>) -> Result<(), Failure> {
        let device = self.device;
        notify(device.note(LssEvent::NoReturn { bit_rate: self.new }));
        by_objects(master, device, self.method, true, progress)?;
        master.send(NmtCommand::ResetNode.frame(device.node));
        let sent = master.now() + MARGIN;
        pause(master, sent, Policy::Reconnect)?;
        set_bus_rate(master, self.new)?;
        progress.is_retimed = true;
        master.set_tolerates_outages(true);
        let found = answers(master, device, self.job.id.or(device.node));
        master.set_tolerates_outages(false);
        if found? {
            return Ok(());
        }
        let is_back = set_bus_rate(master, self.old).is_ok();
        progress.is_retimed = false;
        Err(device.failure(LssCause::SilentAfterStore {
            bit_rate: self.new,
            interface: master.bus().name().to_owned(),
            host: if is_back { self.old } else { self.new },
        }))
    }
}

/// Fails if another device is on the bus, because it would stay at the old bit rate and be disturbed.
fn check_alone(master: &mut Master<'_>, device: &LssDevice) -> Result<(), Failure> {
    let refuse = |neighbour| device.failure(LssCause::NotAloneForRetime(neighbour));
    if let Some(other) = nodes::find_ids(master)?.into_iter().find(|&node| device.node != Some(node)) {
        return Err(refuse(Neighbour::Node(other)));
    }
    if !device.is_unconfigured && master.lss().identify_unconfigured()? {
        return Err(refuse(Neighbour::Unconfigured));
    }
    let until = master.now() + LISTEN_TIME;
    let sender = wait(master, until, Policy::Command, |_, event| match event {
        MasterEvent::Frame(received) if !may_be_of(received.frame.id(), device.node) => {
            ControlFlow::Break(received.frame.id())
        }
        _ => ControlFlow::Continue(()),
    })?;
    sender.done().map_or(Ok(()), |id| Err(refuse(Neighbour::Sender(id))))
}

/// Whether a node can send a frame with this identifier in the predefined connection set.
fn may_be_of(id: CanId, node: Option<NodeId>) -> bool {
    let CanId::Standard(number) = id else { return false };
    let is_own = node.is_some_and(|node| number & 0x7f == u16::from(node.get()) && number >= 0x080);
    is_own || id == CanId::LSS_SLAVE
}

fn host_action(interface: String, bit_rate: u32) -> HostAction {
    HostAction::Up { interface, bit_rate: Some(bit_rate), listen_only: false }
}

fn set_bus_rate(master: &mut Master<'_>, bit_rate: u32) -> Result<(), Failure> {
    let name = master.bus().name().to_owned();
    master.set_bit_rate(bit_rate).map_err(|error| not_set(error, host_action(name, bit_rate)))
}

/// Whether the device answers at the present bit rate of the bus within [`SEARCH_TIME`].
fn answers(master: &mut Master<'_>, device: &LssDevice, node: Option<NodeId>) -> Result<bool, Failure> {
    let until = master.now() + SEARCH_TIME;
    master.listen(&Filters::All)?;
    loop {
        match answers_now(master, device, node) {
            Ok(true) => return Ok(true),
            Ok(false) => {}
            // No node acknowledges at this bit rate, or the interface is not up yet.
            Err(failure) if matches!(failure.kind(), Kind::Bus | Kind::NoAnswer) => {}
            Err(failure) => return Err(failure),
        }
        let now = master.now();
        if now >= until {
            return Ok(false);
        }
        pause(master, now + MARGIN, Policy::Reconnect)?;
    }
}

/// Whether the device answers SDO. A stopped device does not answer SDO, so its LSS answer is used.
fn answers_now(master: &mut Master<'_>, device: &LssDevice, node: Option<NodeId>) -> Result<bool, Failure> {
    if let Some(node) = node {
        match answering_devices(master, node)? {
            AnsweringDevices::Device(found) => return Ok(device.address.is_none_or(|address| address == found)),
            AnsweringDevices::Unidentified => return Ok(device.address.is_none()),
            AnsweringDevices::Several(_) => return Ok(false),
            AnsweringDevices::None(_) => {}
        }
    }
    let Some(address) = device.address else { return Ok(false) };
    let by_identity = LssDevice { reach: Reach::Selective(address), ..device.clone() };
    in_configuration_state(master, &by_identity, |_| Ok(())).map(|_| true)
}
