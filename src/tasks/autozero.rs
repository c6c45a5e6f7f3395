//! Sets the zero of a measuring channel (CiA 404, 6125h): measures, checks, writes the signature once, measures
//! again.
//!
//! The checks go by the measuring range. A reading is taken for zero up to 1 % of it, offsets may add up to 5 %, and
//! the readings may be 0.5 % apart; a limit that is named instead also bounds what offsets add up to.

mod channel;
mod failure;
mod safety;
mod samples;

pub use failure::{AutozeroEffect, AutozeroFact, AutozeroFailure, OffsetChange, Quantity, Undo};

pub use safety::{Limit, Objection};

use crate::canopen::id::NodeId;
use crate::device::description::StoreGroup;
use crate::device::unit::Unit;
use crate::master::{Master, SdoFailure};
use crate::measure::sample::Number;
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::survey_nodes;
use crate::tasks::signature::{may_have_acted, sign};
use crate::tasks::store::{self, Group, Plan};
use crate::tasks::{Effect, Fact, Failure, Kind, Note};
use channel::{Channel, Offset};
use safety::{Limits, Measured};
use samples::Samples;
use std::time::Duration;

/// What is asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Options {
    /// Which channel; `None` is the only one.
    pub channel: Option<u8>,
    /// What is still taken for zero.
    pub limit: Limit,
    /// How many readings there are before and after.
    pub samples: u32,
    /// Whether the zero is set whatever speaks against it.
    pub force: bool,
    /// Whether it is stored.
    pub store: bool,
    /// Whether nothing is changed.
    pub dry_run: bool,
}

/// What was done.
#[derive(Clone, Debug, PartialEq)]
pub struct Zeroed {
    /// The CiA 404 channel.
    pub channel: u8,
    /// Its name.
    pub signal: String,
    /// The unit of all numbers, in ASCII; empty where the device tells none.
    pub unit: String,
    /// The mean before; `None` when a reading was invalid.
    pub before: Option<f64>,
    /// The mean after; `None` when nothing was changed.
    pub after: Option<f64>,
    /// The offset before; `None` where none can be read.
    pub offset_before: Option<Number>,
    /// The offset after; `None` where none can be read, or nothing was changed.
    pub offset: Option<Number>,
    /// Whether it was stored.
    pub stored: bool,
    /// Digits behind the point that tell something of this range.
    pub decimals: usize,
    /// Notes: skipped checks, how to undo it, whether it is stored.
    pub notes: Vec<Note>,
}

impl Zeroed {
    /// How far the zero was moved: the change of the offset, else of the reading.
    pub fn shift(&self) -> Option<f64> {
        let offsets = self.offset.zip(self.offset_before).map(|(new, old)| new.as_f64() - old.as_f64());
        offsets.or_else(|| Some(self.after? - self.before?))
    }
}

/// One procedure.
struct Procedure<'a> {
    device: &'a Node,
    channel: Channel,
    limits: Option<Limits>,
    decimals: usize,
    offsets: Vec<Offset>,
    before: Samples,
    group: Group,
}

/// What came of the signature.
struct Written {
    offsets: Vec<Offset>,
    after: Samples,
    /// If no acknowledge came: whether the offset, else the reading, proves that the device acted.
    is_offset_proof: Option<bool>,
}

/// Sets the zero of a channel, unless something speaks against it. With `store` the group that keeps the offset is
/// stored.
///
/// # Errors
/// What speaks against it (nothing was changed), refusals, silence, a reading that is not zero afterwards, and what
/// stops everything. Each says what was changed by then, so far as it is known.
pub fn autozero(
    master: &mut Master<'_>,
    node: NodeId,
    overrides: &Overrides,
    options: &Options,
) -> Result<Zeroed, Failure> {
    let unchanged = |failure: Failure| match failure.kind() {
        Kind::Interrupted => failure.with(node, Effect::NothingChanged),
        _ => failure,
    };
    let device = survey_nodes(master, &[node], overrides).map_err(|error| unchanged(error.into()))?;
    let device = device.into_iter().next().unwrap_or_else(|| Node::new(node));
    let procedure = Procedure::prepare(master, &device, options).map_err(unchanged)?;
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
    procedure.prove(&written)?;
    let proved_by = |offset| Note::of_node(node, AutozeroFact::ProvedBy { offset });
    notes.extend(written.is_offset_proof.map(proved_by));
    let mut report = procedure.report(Some(&written), notes);
    report.notes.push(Note::of_node(node, AutozeroFact::Undo(procedure.undo(&written.offsets, options.store))));
    procedure.keep(master, plan, &written, &mut report)?;
    Ok(report)
}

impl<'a> Procedure<'a> {
    /// Reads everything that has to be known before.
    fn prepare(master: &mut Master<'_>, device: &'a Node, options: &Options) -> Result<Procedure<'a>, Failure> {
        let channel = channel::find(master, device, options.channel)?;
        let unit = channel.signal.unit;
        let limits = Limits::new(options.limit, channel.range, unit);
        if let (Limit::Value(_, Some(named)), None) = (options.limit, limits) {
            let cause = AutozeroFailure::LimitUnit { signal: channel.signal.name, unit, limit: named };
            return Err(Failure::at(device.id, cause));
        }
        let offsets = channel::offsets(master, device, &channel)?;
        let group = group(master, device, &channel, options.store)?;
        let before = samples::take(master, device, &channel.signal.name, options.samples)?;
        let decimals = decimals(channel.range, channel.signal.digits);
        Ok(Procedure { device, channel, limits, decimals, offsets, before, group })
    }

    /// What speaks against it: a failure, or with `force` notes.
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
        let mut objections = measured.objections(self.limits.as_ref());
        if objections.is_empty() || options.force {
            let forced = |objection| Note::of_node(node, AutozeroFact::Forced(objection));
            return Ok(objections.into_iter().map(forced).collect());
        }
        let cause = AutozeroFailure::Unsafe { objection: objections.swap_remove(0), channel: options.channel };
        Err(Failure::at(node, cause))
    }

    /// Writes the signature once, and measures again.
    fn write(&self, master: &mut Master<'_>, count: u32) -> Result<Written, Failure> {
        let (device, channel) = (self.device, &self.channel);
        let node = device.id;
        let sent = AutozeroEffect::SignatureSent { object: channel.object };
        let signal = || channel.signal.name.clone();
        let offset = self.offsets.first().map(|offset| (offset.object, offset.number));
        let unsure = |failure: Failure| {
            failure.with(node, sent.clone()).with(node, AutozeroEffect::OffsetBefore { offset, signal: signal() })
        };
        let result = sign(master, device, channel.object, &channel.signature, Duration::ZERO);
        let error = match result.map_err(|error| unsure(error.into()))? {
            Ok(()) => None,
            Err(error) if !may_have_acted(&error) => return Err(error.into()),
            Err(error) if matches!(error.failure, SdoFailure::Cancelled) => return Err(unsure(error.into())),
            Err(error) => Some(error),
        };
        let after = samples::take(master, device, &channel.signal.name, count).map_err(unsure)?;
        // Last, so that a device that has restarted meanwhile shows the offset of before.
        let offsets = channel::offsets(master, device, channel).map_err(unsure)?;
        let is_offset_proof = match error {
            None => None,
            Some(_) if self.moved(&offsets).is_some() => Some(true),
            Some(_) if self.shows_it(&after) && self.is_zero(&after) => Some(false),
            Some(error) => {
                let seen = AutozeroEffect::NoChangeSeen { offset: offset.map(|(object, _)| object), signal: signal() };
                return Err(Failure::from(error).with(node, sent).with(node, seen));
            }
        };
        Ok(Written { offsets, after, is_offset_proof })
    }

    /// The offset that is another one now, as it was and as it is.
    fn moved<'b>(&'b self, now: &'b [Offset]) -> Option<(&'b Offset, &'b Offset)> {
        let pairs = self.offsets.iter().filter_map(|old| Some((old, now.iter().find(|new| new.object == old.object)?)));
        pairs.into_iter().find(|(old, new)| old.value != new.value)
    }

    /// How far from zero a reading may be afterwards: as far as readings may be apart; where that is not known, half
    /// as far as before.
    fn tolerance(&self) -> f64 {
        let before = self.before.mean().unwrap_or(0.0).abs();
        self.limits.map_or(before / 2.0, |limits| limits.spread).max(self.before.spread())
    }

    fn is_zero(&self, samples: &Samples) -> bool {
        samples.mean().is_some_and(|mean| mean.abs() <= self.tolerance())
    }

    /// Whether the reading shows that the signature acted: it has come nearer to zero than its unrest explains. Where
    /// an offset is known to be moved, that alone counts.
    fn shows_it(&self, after: &Samples) -> bool {
        let means = self.before.mean().zip(after.mean()).filter(|_| !self.channel.is_described);
        means.is_some_and(|(before, after)| after.abs() + self.before.spread() < before.abs())
    }

    /// Whether there was nothing to be moved: the reading was zero before, up to its unrest and the last digit of the
    /// offset.
    fn was_zero(&self) -> bool {
        let digit = match self.offsets.first().map(|offset| offset.number) {
            Some(Number::Decimal { digits, .. }) => 10f64.powi(-i32::from(digits)),
            _ => 0.0,
        };
        self.before.mean().is_some_and(|before| before.abs() <= self.before.spread() + digit)
    }

    /// Checks that the reading is zero afterwards.
    fn prove(&self, written: &Written) -> Result<(), Failure> {
        let node = self.device.id;
        let fail = |cause: AutozeroFailure| {
            Err(Failure::at(node, cause).with(node, AutozeroEffect::Undo(self.undo(&written.offsets, false))))
        };
        if written.after.booted {
            return fail(AutozeroFailure::RestartedAfter);
        }
        let has_acted = self.moved(&written.offsets).is_some() || self.shows_it(&written.after) || self.was_zero();
        if has_acted && self.is_zero(&written.after) {
            return Ok(());
        }
        let offset = match self.moved(&written.offsets) {
            Some((old, new)) => OffsetChange::Changed(old.number, new.number),
            None if self.offsets.is_empty() => OffsetChange::Unreadable,
            None => OffsetChange::Unchanged,
        };
        let reading = written.after.mean().map(|mean| self.quantity(mean));
        fail(AutozeroFailure::NotZero { signal: self.channel.signal.name.clone(), reading, has_acted, offset })
    }

    /// Stores, if that was asked for, and looks whether what was stored is this zero: a device that restarts just
    /// before stores the old one.
    fn keep(
        &self,
        master: &mut Master<'_>,
        plan: Option<Plan>,
        written: &Written,
        report: &mut Zeroed,
    ) -> Result<(), Failure> {
        let node = self.device.id;
        let Some(plan) = plan else {
            report.notes.push(Note::of_node(node, AutozeroFact::NotStored { group: self.group }));
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
        report.notes.push(Note::of_node(node, AutozeroFact::Stored { groups: done.groups() }));
        report.notes.extend(done.notes.into_iter().map(|text| Note::of_node(node, Fact::Text(text))));
        Ok(())
    }

    fn report(&self, written: Option<&Written>, notes: Vec<Note>) -> Zeroed {
        let moved = written.and_then(|written| self.moved(&written.offsets));
        let still = || written.and_then(|written| self.offsets.first().zip(written.offsets.first()));
        let (old, new) = match moved.or_else(still) {
            Some((old, new)) => (Some(old), Some(new)),
            None => (self.offsets.first(), None),
        };
        let signal = &self.channel.signal;
        Zeroed {
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

    /// How to undo it.
    fn undo(&self, now: &[Offset], stored: bool) -> Undo {
        let is_writable = |object| {
            let entry = self.device.model.as_ref().and_then(|model| model.dictionary.get(object));
            entry.is_none_or(|entry| entry.access.is_writable())
        };
        match self.moved(now) {
            Some((old, _)) if is_writable(old.object) => Undo::write(old, stored.then_some(self.group)),
            _ if stored => Undo::Restore,
            _ => Undo::Reset,
        }
    }
}

/// The group of settings that keeps the offset: the application's where the device has that by itself.
fn group(master: &mut Master<'_>, device: &Node, channel: &Channel, stores: bool) -> Result<Group, Failure> {
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

/// Digits behind the point that tell something: a hundredth of a percent of the range, else those of the device.
fn decimals(range: Option<f64>, digits: Option<u8>) -> usize {
    let steps = range.map(|range| range / 1e4).filter(|step| *step > 0.0);
    let needed = steps.and_then(|step| (0..=9).find(|&decimals| 10f64.powi(-decimals) <= step * 1.000_001));
    let needed = needed.and_then(|decimals| usize::try_from(decimals).ok());
    needed.unwrap_or_else(|| usize::from(digits.unwrap_or(4)))
}
