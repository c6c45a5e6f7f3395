//! Sets the zero of a measuring channel (CiA 404, 6125h): measures, checks, writes the signature once, measures
//! again.
//!
//! The checks go by the measuring range. A reading is taken for zero up to 1 % of it, offsets may add up to 5 %, and
//! the readings may be 0.5 % apart; a limit that is named instead also bounds what offsets add up to.

mod channel;
mod failure;
mod safety;
mod samples;

pub use failure::AutozeroFailure;

pub use safety::Limit;

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
use crate::tasks::{Failure, Kind};
use channel::{Channel, Offset};
use safety::{Hint, Limits, Measured};
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
    /// What else is worth knowing, in whole sentences without the node.
    pub notes: Vec<String>,
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
    /// What proved that it acted, where no acknowledge did.
    shown_by: Option<&'static str>,
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
        Kind::Interrupted => failure.knowing(node, "nothing was changed"),
        _ => failure,
    };
    let device = survey_nodes(master, &[node], overrides).map_err(|error| unchanged(error.into()))?;
    let device = device.into_iter().next().unwrap_or_else(|| Node::new(node));
    let procedure = Procedure::prepare(master, &device, options).map_err(unchanged)?;
    let mut notes = procedure.check(options)?;
    if options.dry_run {
        notes.push("nothing was changed".to_owned());
        return Ok(procedure.report(None, notes));
    }
    let plan = match options.store {
        true => Some(store::plan(master, &device, procedure.group).map_err(unchanged)?),
        false => None,
    };
    let written = procedure.write(master, options.samples)?;
    procedure.prove(&written)?;
    notes.extend(written.shown_by.map(|what| format!("no answer came to the signature; {what} shows that it acted")));
    let mut report = procedure.report(Some(&written), notes);
    report.notes.push(procedure.undo(&written.offsets, options.store));
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
            let present = unit.map_or_else(|| "in no known unit".to_owned(), |unit| format!("in {unit}"));
            let message = format!("{} is {present}, and a limit in {named} does not convert", channel.signal.name);
            return Err(Failure::of_node(Kind::Usage, device.id, message));
        }
        let offsets = channel::offsets(master, device, &channel)?;
        let group = group(master, device, &channel, options.store)?;
        let before = samples::take(master, device, &channel.signal.name, options.samples)?;
        let decimals = decimals(channel.range, channel.signal.digits);
        Ok(Procedure { device, channel, limits, decimals, offsets, before, group })
    }

    /// What speaks against it: a failure, or with `force` notes.
    fn check(&self, options: &Options) -> Result<Vec<String>, Failure> {
        let (node, channel) = (self.device.id, &self.channel);
        if self.before.booted {
            let message = "it restarted while it was measured: nothing was changed";
            return Err(Failure::of_node(Kind::Unexpected, node, message));
        }
        let unit = unit_text(channel.signal.unit);
        let measured = Measured {
            signal: &channel.signal.name,
            unit: &unit,
            decimals: self.decimals,
            absolute: channel.absolute,
            before: &self.before,
            offset: self.offsets.first().map(|offset| offset.number.as_f64()),
        };
        let objections = measured.objections(self.limits.as_ref());
        let first = match objections.first() {
            Some(first) if !options.force => first,
            _ => return Ok(objections.into_iter().map(|objection| format!("forced: {}", objection.reason)).collect()),
        };
        let hint = match &first.hint {
            Hint::Say(text) => text.clone(),
            Hint::Limit(enough) => {
                let choice = options.channel.map(|channel| format!(" --channel {channel}")).unwrap_or_default();
                format!("vent the line, or allow it: cangauge autozero {node}{choice} --limit {enough}")
            }
        };
        let message = format!("{}: nothing was changed", first.reason);
        Err(Failure::of_node(Kind::CheckFailed, node, message).hint(hint))
    }

    /// Writes the signature once, and measures again.
    fn write(&self, master: &mut Master<'_>, count: u32) -> Result<Written, Failure> {
        let (device, channel) = (self.device, &self.channel);
        let node = device.id;
        let sent = format!("the signature went to {} once and is not repeated", channel.object);
        let unsure = |failure: Failure| failure.knowing(node, &sent).knowing(node, self.was()).hint(self.look());
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
        let shown_by = match error {
            None => None,
            Some(_) if self.moved(&offsets).is_some() => Some("the offset"),
            Some(_) if self.shows_it(&after) && self.is_zero(&after) => Some("the reading"),
            Some(error) => {
                let now = if self.offsets.is_empty() {
                    "no offset can be read here, and the reading has not come to zero"
                } else {
                    "the offset is as before"
                };
                return Err(Failure::from(error).knowing(node, sent).knowing(node, now).hint(self.look()));
            }
        };
        Ok(Written { offsets, after, shown_by })
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

    /// That the reading is zero now.
    fn prove(&self, written: &Written) -> Result<(), Failure> {
        let node = self.device.id;
        let fail = |message: String| {
            Err(Failure::of_node(Kind::Unexpected, node, message).hint(self.undo(&written.offsets, false)))
        };
        if written.after.booted {
            return fail("it took the signature and restarted: a zero that was not stored is gone".to_owned());
        }
        let acted = self.moved(&written.offsets).is_some() || self.shows_it(&written.after) || self.was_zero();
        if acted && self.is_zero(&written.after) {
            return Ok(());
        }
        let signal = &self.channel.signal.name;
        let reads = match written.after.mean() {
            Some(mean) if acted => format!("{signal} reads {} afterwards, which is not zero", self.show(mean)),
            Some(mean) => format!("nothing has changed: {signal} reads {}", self.show(mean)),
            None => format!("{signal} has no valid value afterwards"),
        };
        let offset = match self.moved(&written.offsets) {
            Some((old, new)) => format!("the offset went from {} to {}", old.number, new.number),
            None if self.offsets.is_empty() => "no offset can be read here".to_owned(),
            None => "the offset is as before".to_owned(),
        };
        fail(format!("it took the signature, and {reads}; {offset}"))
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
            let group = self.group.as_str();
            report.notes.push(format!("not stored, gone with the power: cangauge store {node} --group {group}"));
            return Ok(());
        };
        let set = match report.shift() {
            Some(shift) => format!("the zero was moved by {}", self.show(shift)),
            None => "the zero was set".to_owned(),
        };
        let done = store::carry_out(master, self.device, plan, false).map_err(|failure| failure.knowing(node, &set))?;
        let now = channel::offsets(master, self.device, &self.channel)
            .map_err(|failure| failure.knowing(node, format!("{set}, and stored")))?;
        if now != written.offsets {
            let message = "the offset has changed since it was set: what was stored is not this zero";
            return Err(Failure::of_node(Kind::Unexpected, node, message).hint(self.look()));
        }
        report.stored = true;
        report.notes.push(format!("stored: {}", done.groups()));
        report.notes.extend(done.notes);
        Ok(())
    }

    fn report(&self, written: Option<&Written>, notes: Vec<String>) -> Zeroed {
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

    fn show(&self, value: f64) -> String {
        let unit = unit_text(self.channel.signal.unit);
        format!("{value:.*} {unit}", self.decimals).trim_end().to_owned()
    }

    /// The offset as it was.
    fn was(&self) -> String {
        match self.offsets.first() {
            Some(offset) => format!("the offset {} was {}", offset.object, offset.number),
            None => "no offset can be read here".to_owned(),
        }
    }

    /// How to see what became of it.
    fn look(&self) -> String {
        let (node, signal) = (self.device.id, &self.channel.signal.name);
        match self.offsets.first() {
            Some(offset) => format!("see what became of it: cangauge sdo read {node} {}", offset.object),
            None => format!("see what became of it: cangauge read {node} {signal}"),
        }
    }

    /// The line that takes it back.
    fn undo(&self, now: &[Offset], stored: bool) -> String {
        let node = self.device.id;
        let written = |object| {
            let entry = self.device.model.as_ref().and_then(|model| model.dictionary.get(object));
            entry.is_none_or(|entry| entry.access.is_writable())
        };
        match self.moved(now) {
            Some((old, _)) if written(old.object) => {
                let line =
                    format!("undo: cangauge sdo write {node} {} {} --type {}", old.object, old.value, old.data_type);
                let again = if stored {
                    format!(" && cangauge store {node} --group {}", self.group.as_str())
                } else {
                    String::new()
                };
                line + &again
            }
            _ if stored => {
                format!("undo: no offset to be written is known; back to delivery: cangauge restore {node} --reset")
            }
            _ => format!("undo: what is not stored ends with a reset: cangauge nmt reset {node}"),
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
