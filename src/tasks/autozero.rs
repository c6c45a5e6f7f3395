//! Sets a measuring channel (CiA 404, 6125h) or its net value (6139h) to zero. The sequence: measure, check, write the
//! signature once, measure again.
//!
//! Default limits in percent of the measuring range:
//! - 1 % for the reading
//! - 5 % for the total offset
//! - 0.5 % for the variation of the readings
//!
//! A larger limit from the user also applies to the total offset.

mod channel;
mod failure;
mod safety;
mod samples;

pub use failure::{AutozeroEffect, AutozeroFact, AutozeroFailure, OffsetChange, Proof, Quantity, Undo};

pub use safety::{FailedCheck, Limit};

use crate::canopen::id::NodeId;
use crate::device::description::StoreGroup;
use crate::device::unit::Unit;
use crate::master::{Master, SdoFailure};
use crate::measure::sample::Number;
use crate::node::survey::survey_nodes;
use crate::node::write::{write, write_and_verify};
use crate::node::{Error as NodeError, Node, Overrides};
use crate::tasks::failure::check_confirmed;
use crate::tasks::store::{self, Group, StorePlan};
use crate::tasks::{Effect, Failure, Kind, Note};
use channel::{Channel, Offset};
use safety::{Limits, Measured};
use samples::Samples;

/// The value to set to zero.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ZeroTarget {
    /// The process value, which is shifted by the offset.
    Autozero,
    /// The net value (x140h), which is shifted by the tare zero (x138h).
    Tare,
}

impl ZeroTarget {
    /// Returns the name of the command.
    pub fn as_str(self) -> &'static str {
        match self {
            ZeroTarget::Autozero => "autozero",
            ZeroTarget::Tare => "tare",
        }
    }
}

/// The options of an autozero or a tare.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// The value to set to zero. A tare ignores the limit.
    pub target: ZeroTarget,
    /// The channel; `None` for the only channel.
    pub channel: Option<u8>,
    /// The largest reading that is accepted as zero.
    pub limit: Limit,
    /// The number of readings before the signature is written, and also after it.
    pub samples: u32,
    /// Whether the safety checks are skipped.
    pub force: bool,
    /// Whether the zero is stored.
    pub store: bool,
    /// Whether to measure and check only.
    pub dry_run: bool,
}

/// The result of an autozero.
#[derive(Clone, Debug, PartialEq)]
pub struct AutozeroReport {
    /// The CiA 404 channel.
    pub channel: u8,
    /// The name of the channel.
    pub signal: String,
    /// The unit of all numbers, in ASCII; empty if the device reports none.
    pub unit: String,
    /// The mean of the readings before the write; `None` if a reading was invalid.
    pub before: Option<f64>,
    /// The mean of the readings after the write; `None` if nothing was changed.
    pub after: Option<f64>,
    /// The offset before the write; `None` if no offset can be read.
    pub offset_before: Option<Number>,
    /// The offset after the write; `None` if no offset can be read, or nothing was changed.
    pub offset: Option<Number>,
    /// Whether the zero was stored.
    pub stored: bool,
    /// The number of decimal digits to show.
    pub decimals: usize,
    /// Notes: skipped checks, how to undo the change, whether the zero is stored.
    pub notes: Vec<Note>,
}

impl AutozeroReport {
    /// Returns the change of the offset. If no offset can be read, returns the change of the reading.
    pub fn shift(&self) -> Option<f64> {
        let offsets = self.offset.zip(self.offset_before).map(|(new, old)| new.as_f64() - old.as_f64());
        offsets.or_else(|| Some(self.after? - self.before?))
    }
}

/// An autozero in progress.
struct Procedure<'a> {
    target: ZeroTarget,
    device: &'a Node,
    channel: Channel,
    limits: Option<Limits>,
    decimals: usize,
    offsets: Vec<Offset>,
    before: Samples,
    group: Group,
}

/// Sets the tare zero of a channel to 0, so that the net value is the process value again.
///
/// # Errors
/// - The device has no tare, or its tare zero cannot be written.
/// - The device rejects a request or does not answer.
/// - Bus errors and Ctrl-C.
pub fn undo_tare(
    master: &mut Master<'_>,
    node: NodeId,
    overrides: &Overrides,
    options: &Options,
) -> Result<AutozeroReport, Failure> {
    let device = survey_nodes(master, &[node], overrides)?;
    let mut device = device.into_iter().next().unwrap_or_else(|| Node::new(node));
    check_confirmed(Some(node), device.model.as_deref())?;
    let channel = channel::find_tare(master, &mut device, options.channel)?;
    let procedure = Procedure::prepare(master, &device, channel, options)?;
    let Some(old) = procedure.offsets.first().filter(|old| !device.is_read_only(old.object)) else {
        let cause = AutozeroFailure::NoTareZero { channel: procedure.channel.signal.channel };
        return Err(Failure::at(node, cause));
    };
    let zero = vec![0; old.data_type.width().unwrap_or(4)];
    write_and_verify(master, &device, old.object, &zero, old.data_type)?;
    let after = samples::read_samples(master, &device, &procedure.channel.signal.name, options.samples)?;
    let offsets = channel::offsets(master, &device, &procedure.channel)?;
    let undo = Note::of_node(node, AutozeroFact::Undo(procedure.undo(&offsets, false)));
    let notes = procedure.changed_offset(&offsets).map(|_| undo).into_iter().collect();
    Ok(procedure.report(Some(&AfterWrite { offsets, after, proof: None }), notes))
}

/// The readings and offsets after the signature was written.
struct AfterWrite {
    offsets: Vec<Offset>,
    after: Samples,
    /// The proof that the device executed the signature, if it did not acknowledge it.
    proof: Option<Proof>,
}

/// Sets a channel to zero if the safety checks allow it. With `store`, it also stores the group that contains the
/// offset.
///
/// # Errors
/// - A safety check failed, and nothing was changed.
/// - The device rejects a request or does not answer.
/// - The reading is not zero afterwards.
/// - Bus errors and Ctrl-C.
///
/// The effects list the changes made before the failure.
pub fn autozero(
    master: &mut Master<'_>,
    node: NodeId,
    overrides: &Overrides,
    options: &Options,
) -> Result<AutozeroReport, Failure> {
    let unchanged = |failure: Failure| match failure.kind() {
        Kind::Interrupted => failure.with(node, Effect::NothingChanged),
        _ => failure,
    };
    let device = survey_nodes(master, &[node], overrides).map_err(|error| unchanged(error.into()))?;
    let mut device = device.into_iter().next().unwrap_or_else(|| Node::new(node));
    check_confirmed(Some(node), device.model.as_deref())?;
    let channel = match options.target {
        ZeroTarget::Autozero => channel::find(master, &device, options.channel),
        ZeroTarget::Tare => channel::find_tare(master, &mut device, options.channel),
    };
    let procedure = Procedure::prepare(master, &device, channel.map_err(unchanged)?, options).map_err(unchanged)?;
    let mut notes = procedure.check(options)?;
    if options.dry_run {
        notes.push(Note::of_node(node, AutozeroFact::NothingChanged));
        return Ok(procedure.report(None, notes));
    }
    let plan = match options.store {
        true => Some(store::plan(master, &device, procedure.group).map_err(unchanged)?),
        false => None,
    };
    let written = procedure.write(master, options.samples)?;
    procedure.check_is_zero(&written)?;
    let proved_by = |proof| Note::of_node(node, AutozeroFact::ProvedBy(proof));
    notes.extend(written.proof.map(proved_by));
    let mut report = procedure.report(Some(&written), notes);
    report.notes.push(Note::of_node(node, AutozeroFact::Undo(procedure.undo(&written.offsets, options.store))));
    procedure.store(master, plan, &written, &mut report)?;
    Ok(report)
}

impl<'a> Procedure<'a> {
    /// Reads the values for the safety checks.
    fn prepare(
        master: &mut Master<'_>,
        device: &'a Node,
        channel: Channel,
        options: &Options,
    ) -> Result<Procedure<'a>, Failure> {
        let unit = channel.signal.unit;
        let limits = Limits::new(options.limit, channel.range, unit);
        if let (Limit::Value(_, Some(limit_unit)), None) = (options.limit, limits) {
            let cause = AutozeroFailure::LimitUnit { signal: channel.signal.name, unit, limit: limit_unit };
            return Err(Failure::at(device.id, cause));
        }
        let offsets = channel::offsets(master, device, &channel)?;
        let group = store_group(master, device, &channel, options.store)?;
        let before = samples::read_samples(master, device, &channel.signal.name, options.samples)?;
        let decimals = shown_decimals(channel.range, channel.signal.digits);
        Ok(Procedure { target: options.target, device, channel, limits, decimals, offsets, before, group })
    }

    /// Runs the safety checks. With `force`, a failed check is a note.
    fn check(&self, options: &Options) -> Result<Vec<Note>, Failure> {
        let (node, channel) = (self.device.id, &self.channel);
        if self.before.booted {
            return Err(Failure::at(node, AutozeroFailure::RestartedBefore));
        }
        let measured = Measured {
            signal: &channel.signal.name,
            unit: channel.signal.unit,
            decimals: self.decimals,
            absolute: channel.absolute,
            before: &self.before,
            offset: self.offsets.first().map(|offset| offset.number.as_f64()),
        };
        let mut failed_checks = measured.failed_checks(self.limits.as_ref());
        failed_checks.retain(|failed_check| options.target == ZeroTarget::Autozero || failed_check.concerns_tare());
        if failed_checks.is_empty() || options.force {
            let forced = |failed_check| Note::of_node(node, AutozeroFact::Forced(failed_check));
            return Ok(failed_checks.into_iter().map(forced).collect());
        }
        let cause = AutozeroFailure::Unsafe {
            target: options.target,
            failed_check: failed_checks.swap_remove(0),
            channel: options.channel,
        };
        Err(Failure::at(node, cause))
    }

    /// Writes the signature once, and measures again.
    fn write(&self, master: &mut Master<'_>, count: u32) -> Result<AfterWrite, Failure> {
        let (device, channel) = (self.device, &self.channel);
        let node = device.id;
        let sent = AutozeroEffect::SignatureSent { object: channel.object };
        let signal = || channel.signal.name.clone();
        let offset = self.offsets.first().map(|offset| (offset.object, offset.number));
        let with_effects = |failure: Failure| {
            failure.with(node, sent.clone()).with(node, AutozeroEffect::OffsetBefore { offset, signal: signal() })
        };
        let error = match write(master, device, channel.object, &channel.signature) {
            Ok(_) => None,
            Err(NodeError::Unknown(error)) if !matches!(error.failure, SdoFailure::Cancelled) => Some(error),
            Err(error @ (NodeError::Unknown(_) | NodeError::Bus(_) | NodeError::Interrupted)) => {
                return Err(with_effects(error.into()));
            }
            Err(error) => return Err(error.into()),
        };
        let after = samples::read_samples(master, device, &channel.signal.name, count).map_err(with_effects)?;
        // Read the offset last: if the device restarted in between, it shows the old offset.
        let offsets = channel::offsets(master, device, channel).map_err(with_effects)?;
        let proof = match error {
            None => None,
            Some(_) if self.changed_offset(&offsets).is_some() => Some(Proof::Offset),
            Some(_) if self.has_moved(&after) && self.is_zero(&after) => Some(Proof::Reading),
            Some(error) => {
                let seen = AutozeroEffect::NoChangeSeen { offset: offset.map(|(object, _)| object), signal: signal() };
                return Err(Failure::from(error).with(node, sent).with(node, seen));
            }
        };
        Ok(AfterWrite { offsets, after, proof })
    }

    /// Returns the old and the new value of the first offset that changed.
    fn changed_offset<'b>(&'b self, now: &'b [Offset]) -> Option<(&'b Offset, &'b Offset)> {
        let pairs = self.offsets.iter().filter_map(|old| Some((old, now.iter().find(|new| new.object == old.object)?)));
        pairs.into_iter().find(|(old, new)| old.value != new.value)
    }

    /// Returns the largest mean that is accepted as zero after the write: the limit of the variation. If no limits are
    /// known, it is half of the mean before. The measured variation is always accepted.
    fn tolerance(&self) -> f64 {
        let before = self.before.mean().unwrap_or(0.0).abs();
        self.limits.map_or(before / 2.0, |limits| limits.spread).max(self.before.spread())
    }

    fn is_zero(&self, samples: &Samples) -> bool {
        samples.mean().is_some_and(|mean| mean.abs() <= self.tolerance())
    }

    /// Whether the reading moved towards zero by more than its variation. This proves that the device executed the
    /// signature. Always false if the description contains the object of the offset.
    fn has_moved(&self, after: &Samples) -> bool {
        let means = self.before.mean().zip(after.mean()).filter(|_| !self.channel.is_described);
        means.is_some_and(|(before, after)| after.abs() + self.before.spread() < before.abs())
    }

    /// Whether the reading was zero before the write. The tolerance is its variation plus one last digit of the offset.
    fn was_zero(&self) -> bool {
        let digit = match self.offsets.first().map(|offset| offset.number) {
            Some(Number::Decimal { digits, .. }) => 10f64.powi(-i32::from(digits)),
            _ => 0.0,
        };
        self.before.mean().is_some_and(|before| before.abs() <= self.before.spread() + digit)
    }

    /// Checks that the reading is zero after the write.
    fn check_is_zero(&self, written: &AfterWrite) -> Result<(), Failure> {
        let node = self.device.id;
        let fail = |cause: AutozeroFailure| {
            Err(Failure::at(node, cause).with(node, AutozeroEffect::Undo(self.undo(&written.offsets, false))))
        };
        if written.after.booted {
            return fail(AutozeroFailure::RestartedAfter);
        }
        let has_acted =
            self.changed_offset(&written.offsets).is_some() || self.has_moved(&written.after) || self.was_zero();
        if has_acted && self.is_zero(&written.after) {
            return Ok(());
        }
        let offset = match self.changed_offset(&written.offsets) {
            Some((old, new)) => OffsetChange::Changed(old.number, new.number),
            None if self.offsets.is_empty() => OffsetChange::Unreadable,
            None => OffsetChange::Unchanged,
        };
        let reading = written.after.mean().map(|mean| self.quantity(mean));
        fail(AutozeroFailure::NotZero { signal: self.channel.signal.name.clone(), reading, has_acted, offset })
    }

    /// Stores the zero if requested, and checks that the new offset was stored. A device that restarts just before the
    /// store would store the old offset.
    fn store(
        &self,
        master: &mut Master<'_>,
        plan: Option<StorePlan>,
        written: &AfterWrite,
        report: &mut AutozeroReport,
    ) -> Result<(), Failure> {
        let node = self.device.id;
        let Some(plan) = plan else {
            let note = Note::of_node(node, AutozeroFact::NotStored { group: self.group });
            report.notes.extend((self.target == ZeroTarget::Autozero).then_some(note));
            return Ok(());
        };
        let moved = AutozeroEffect::Moved(report.shift().map(|shift| self.quantity(shift)));
        let done =
            store::carry_out(master, self.device, plan, false).map_err(|failure| failure.with(node, moved.clone()))?;
        let now = channel::offsets(master, self.device, &self.channel)
            .map_err(|failure| failure.with(node, moved).with(node, AutozeroEffect::Stored))?;
        if now != written.offsets {
            return Err(Failure::at(node, AutozeroFailure::OtherOffsetStored));
        }
        report.stored = true;
        report.notes.push(Note::of_node(node, AutozeroFact::Stored { groups: done.groups }));
        report.notes.extend(done.notes);
        Ok(())
    }

    fn report(&self, written: Option<&AfterWrite>, notes: Vec<Note>) -> AutozeroReport {
        let moved = written.and_then(|written| self.changed_offset(&written.offsets));
        let first_offset = || written.and_then(|written| self.offsets.first().zip(written.offsets.first()));
        let (old, new) = match moved.or_else(first_offset) {
            Some((old, new)) => (Some(old), Some(new)),
            None => (self.offsets.first(), None),
        };
        let signal = &self.channel.signal;
        AutozeroReport {
            channel: signal.channel,
            signal: signal.name.clone(),
            unit: unit_text(signal.unit),
            before: self.before.mean(),
            after: written.and_then(|written| written.after.mean()),
            offset_before: old.map(|old| old.number),
            offset: new.map(|new| new.number),
            stored: false,
            decimals: self.decimals,
            notes,
        }
    }

    fn quantity(&self, value: f64) -> Quantity {
        Quantity { value, unit: self.channel.signal.unit, decimals: self.decimals }
    }

    /// Returns how to undo the change.
    fn undo(&self, now: &[Offset], stored: bool) -> Undo {
        let is_writable = |object| {
            let entry = self.device.model.as_ref().and_then(|model| model.dictionary.get(object));
            entry.is_none_or(|entry| entry.access.is_writable())
        };
        match self.changed_offset(now) {
            Some((old, _)) if is_writable(old.object) => Undo::write(old, stored.then_some(self.group)),
            _ if stored => Undo::Restore,
            _ => Undo::Reset,
        }
    }
}

/// Returns the store group that contains the offset. If the description does not name it, this is the application
/// settings if the device can store them separately.
fn store_group(master: &mut Master<'_>, device: &Node, channel: &Channel, stores: bool) -> Result<Group, Failure> {
    let described = device.model.iter().flat_map(|model| &model.description.objects);
    let entry = described
        .filter(|entry| entry.stored.is_some())
        .find(|entry| channel.offsets.first().is_some_and(|&offset| entry.at.contains(offset)));
    match entry.and_then(|entry| entry.stored) {
        Some(StoreGroup::Application) => Ok(Group::Application),
        Some(_) => Ok(Group::All),
        None if !stores => Ok(Group::All),
        None => match store::plan(master, device, Group::Application) {
            Ok(_) => Ok(Group::Application),
            Err(failure) if failure.kind() == Kind::Refused => Ok(Group::All),
            Err(failure) => Err(failure),
        },
    }
}

fn unit_text(unit: Option<Unit>) -> String {
    unit.map(|unit| unit.to_string()).unwrap_or_default()
}

/// Returns the number of decimal digits that resolves 0.01 % of the measuring range. If the range is unknown, returns
/// the number of decimal digits of the device.
fn shown_decimals(range: Option<f64>, digits: Option<u8>) -> usize {
    let step = range.map(|range| range / 1e4).filter(|step| *step > 0.0);
    let needed = step.and_then(|step| (0..=9).find(|&decimals| 10f64.powi(-decimals) <= step * 1.000_001));
    let needed = needed.and_then(|decimals| usize::try_from(decimals).ok());
    needed.unwrap_or_else(|| usize::from(digits.unwrap_or(4)))
}
