//! One expression, for one node where it names none, and what has come of it.

use super::bind::{Bound, Display, Gathered};
use super::evaluate::{Formula, Values};
use super::tree::Function;
use super::verdict::{Ruling, Shown, Silence, Standing, Verdict, Violation};
use crate::bus::{Mono, Stamp};
use crate::measure::sample::Status;
use crate::measure::statistics::Statistics;
use std::time::Duration;

/// How often a signal came.
#[derive(Clone, Copy, Debug, Default)]
struct Rhythm {
    count: u32,
    first: Mono,
    last: Mono,
}

impl Rhythm {
    fn beat(&mut self, now: Mono) {
        if self.count == 0 {
            self.first = now;
        }
        self.count = self.count.saturating_add(1);
        self.last = now;
    }

    /// Whether nothing came for five of its intervals, at least for a second.
    fn has_ceased(&self, end: Mono) -> bool {
        let intervals = self.count.saturating_sub(1).max(1);
        let usual = self.last.since(self.first) / intervals;
        end.since(self.last) > (usual * 5).max(Duration::from_secs(1))
    }
}

/// Slots whose values belong together.
#[derive(Clone, Debug)]
struct Joint {
    slots: Vec<usize>,
    /// Whether the slot has come since the last time.
    fresh: Vec<bool>,
}

impl Joint {
    fn new(slots: Vec<usize>) -> Joint {
        let fresh = vec![false; slots.len()];
        Joint { slots, fresh }
    }

    fn is_fresh(&self, slot: usize) -> bool {
        self.slots.iter().zip(&self.fresh).any(|(&own, &fresh)| own == slot && fresh)
    }

    fn has_come(&mut self, slot: usize) {
        for (own, fresh) in self.slots.iter().zip(&mut self.fresh) {
            *fresh |= *own == slot;
        }
    }

    fn is_complete(&self) -> bool {
        !self.fresh.is_empty() && self.fresh.iter().all(|&fresh| fresh)
    }

    fn is_waiting(&self) -> bool {
        self.fresh.iter().any(|&fresh| fresh)
    }
}

/// What a joint is for.
#[derive(Clone, Copy, Debug)]
enum Role {
    /// A rule for every sample.
    Rule(usize),
    /// Samples to be gathered.
    Gather(usize),
    /// A value to be shown.
    Show(usize),
}

/// When a sample came, and what the device says of it.
pub(super) type Moment = (Stamp, Duration, Option<Status>);

/// One expression under judgement.
#[derive(Clone, Debug)]
pub(super) struct Case {
    bound: Bound,
    values: Vec<Option<f64>>,
    /// How often each slot came, and when first and last.
    rhythms: Vec<Rhythm>,
    digits: Vec<Option<u8>>,
    joints: Vec<(Joint, Role)>,
    /// Samples judged by each rule, and those of them without a value.
    judged: Vec<(u64, u64)>,
    gathered: Vec<Statistics>,
    shown: Vec<Statistics>,
    violations: u64,
    first: Option<Violation>,
    last: Option<Moment>,
}

impl Case {
    pub(super) fn new(bound: Bound) -> Case {
        let joint = |slots: &dyn Fn(&mut Vec<usize>), role| {
            let mut all = Vec::new();
            slots(&mut all);
            (Joint::new(all), role)
        };
        let mut joints = Vec::new();
        // What is shown comes first: a violation shows what it is judged by.
        for (at, display) in bound.displays.iter().enumerate() {
            joints.push(joint(&|slots| display.formula.slots(slots), Role::Show(at)));
        }
        for (at, rule) in bound.by_sample.iter().enumerate() {
            joints.push(joint(&|slots| rule.slots(slots), Role::Rule(at)));
        }
        for (at, gathered) in bound.gathered.iter().enumerate() {
            joints.push(joint(&|slots| gathered.argument.slots(slots), Role::Gather(at)));
        }
        Case {
            values: vec![None; bound.slots.len()],
            rhythms: vec![Rhythm::default(); bound.slots.len()],
            digits: vec![None; bound.slots.len()],
            joints,
            judged: vec![(0, 0); bound.by_sample.len()],
            gathered: vec![Statistics::default(); bound.gathered.len()],
            shown: vec![Statistics::default(); bound.displays.len()],
            violations: 0,
            first: None,
            last: None,
            bound,
        }
    }

    pub(super) fn bound(&self) -> &Bound {
        &self.bound
    }

    /// Takes the value of a slot.
    pub(super) fn take(&mut self, slot: usize, value: Option<f64>, digits: Option<u8>, moment: Moment) {
        self.judge_where(|joint| joint.is_fresh(slot), self.last.unwrap_or(moment));
        self.values[slot] = value;
        self.rhythms[slot].beat(moment.0.mono);
        self.digits[slot] = digits.or(self.digits[slot]);
        self.joints.iter_mut().for_each(|(joint, _)| joint.has_come(slot));
        self.last = Some(moment);
        self.judge_where(Joint::is_complete, moment);
    }

    /// Judges what still waits for another signal.
    pub(super) fn finish(&mut self) {
        if let Some(last) = self.last {
            self.judge_where(Joint::is_waiting, last);
        }
    }

    fn judge_where(&mut self, is_due: impl Fn(&Joint) -> bool, moment: Moment) {
        for at in 0..self.joints.len() {
            let (joint, role) = &mut self.joints[at];
            if is_due(joint) && joint.slots.iter().all(|&slot| self.rhythms[slot].count > 0) {
                joint.fresh.fill(false);
                let role = *role;
                self.judge(role, moment);
            }
        }
    }

    fn judge(&mut self, role: Role, moment: Moment) {
        let values = Values { slots: &self.values, aggregates: &[] };
        let at = moment.0.mono.since_start();
        match role {
            Role::Show(display) => {
                let value = self.bound.displays[display].formula.value(values);
                self.shown[display].add(value, at);
            }
            Role::Gather(gathered) => {
                let Gathered { function, argument, .. } = &self.bound.gathered[gathered];
                let (function, value) = (*function, argument.value(values));
                self.gathered[gathered].add(value, at);
                if value.is_none() && function != Function::Invalid {
                    self.violated(moment);
                }
            }
            Role::Rule(rule) => {
                let holds = self.bound.by_sample[rule].holds(values);
                let (judged, invalid) = &mut self.judged[rule];
                *judged += 1;
                match holds {
                    Some(true) => return,
                    Some(false) => self.violations += 1,
                    None => *invalid += 1,
                }
                self.violated(moment);
            }
        }
    }

    /// Keeps the first sample that does not satisfy.
    fn violated(&mut self, (at, elapsed, status): Moment) {
        if self.first.is_none() {
            let values = Values { slots: &self.values, aggregates: &[] };
            let values = self.bound.displays.iter().map(|display| display.formula.value(values)).collect();
            self.first = Some(Violation { at, elapsed, values, status });
        }
    }

    /// The value of each function at the moment.
    fn aggregates(&self) -> Vec<Option<f64>> {
        let value = |(gathered, statistics): (&Gathered, &Statistics)| match gathered.function {
            Function::Mean => statistics.mean(),
            Function::Noise => statistics.deviation(),
            Function::Min => statistics.min(),
            Function::Max => statistics.max(),
            Function::Rate => statistics.rate(),
            Function::Gap => (statistics.count() > 1).then(|| statistics.longest_interval().as_secs_f64()),
            Function::Count => Some(statistics.count() as f64),
            Function::Invalid => Some(statistics.invalid() as f64),
        };
        self.bound.gathered.iter().zip(&self.gathered).map(value).collect()
    }

    fn count(&self) -> u64 {
        let gathered = self.gathered.iter().map(Statistics::count);
        self.judged.iter().map(|&(judged, _)| judged).chain(gathered).max().unwrap_or(0)
    }

    /// Samples without a value, where that is not what was asked about.
    fn invalid(&self) -> u64 {
        let asked = |gathered: &Gathered| gathered.function == Function::Invalid;
        let gathered = self.bound.gathered.iter().zip(&self.gathered).filter(|(gathered, _)| !asked(gathered));
        let gathered = gathered.map(|(_, statistics)| statistics.invalid());
        self.judged.iter().map(|&(_, invalid)| invalid).chain(gathered).max().unwrap_or(0)
    }

    /// The verdict; with the `end` of a recording, a signal that ceased before it leaves none.
    pub(super) fn verdict(&self, end: Option<Mono>, silent: &[Silence]) -> Verdict {
        let aggregates = self.aggregates();
        let (ruling, reason) = self.ruling(&aggregates, end, silent);
        Verdict {
            text: self.bound.text.clone(),
            node: self.bound.node,
            ruling,
            values: self.shown(&aggregates, false),
            count: self.count(),
            violations: self.violations,
            invalid: self.invalid(),
            first: self.first.clone(),
            reason,
        }
    }

    fn ruling(&self, aggregates: &[Option<f64>], end: Option<Mono>, silent: &[Silence]) -> (Ruling, Option<String>) {
        if self.violations > 0 || self.invalid() > 0 {
            return (Ruling::Fail, None);
        }
        let concerns = |silence: &&Silence| {
            let mut of_it = self.bound.slots.iter().filter(|slot| slot.node == silence.node);
            of_it.any(|slot| silence.signal.as_ref().is_none_or(|signal| *signal == slot.name))
        };
        if let Some(silence) = silent.iter().find(concerns) {
            return (Ruling::NoData, Some(silence.reason.clone()));
        }
        for (slot, rhythm) in self.bound.slots.iter().zip(&self.rhythms) {
            if rhythm.count == 0 {
                return (Ruling::NoData, Some(format!("node {}: {} did not come", slot.node, slot.name)));
            }
            if end.is_some_and(|end| rhythm.has_ceased(end)) {
                return (Ruling::NoData, Some(format!("node {}: {} was silent at the end", slot.node, slot.name)));
            }
        }
        let values = Values { slots: &self.values, aggregates };
        let held: Vec<Option<bool>> = self.bound.at_the_end.iter().map(|rule| rule.holds(values)).collect();
        if held.contains(&Some(false)) {
            return (Ruling::Fail, None);
        }
        if held.contains(&None) && !aggregates.contains(&None) {
            return (Ruling::Fail, Some("what it comes to is no number".to_owned()));
        }
        if held.contains(&None) {
            return (Ruling::NoData, Some("there are too few samples for it".to_owned()));
        }
        (Ruling::Ok, None)
    }

    pub(super) fn standing(&self) -> Standing {
        let aggregates = self.aggregates();
        let holds = match self.ruling(&aggregates, None, &[]).0 {
            Ruling::Ok => Some(true),
            Ruling::Fail => Some(false),
            Ruling::NoData => None,
        };
        let values = self.shown(&aggregates, true);
        Standing { text: self.bound.text.clone(), node: self.bound.node, holds, values }
    }

    /// The values of what is shown: those at the moment, or what became of all.
    fn shown(&self, aggregates: &[Option<f64>], now: bool) -> Vec<Shown> {
        let shown = |(display, statistics): (&Display, &Statistics)| {
            let values = Values { slots: &self.values, aggregates };
            let at_the_moment = display.formula.value(values);
            let several = statistics.count() > 1 && !now;
            Shown {
                name: display.name.clone(),
                unit: display.unit,
                digits: self.digits_of(&display.formula),
                exact: self.is_exact(&display.formula),
                value: if several { statistics.mean() } else { at_the_moment },
                range: statistics.min().zip(statistics.max()).filter(|_| several),
            }
        };
        self.bound.displays.iter().zip(&self.shown).map(shown).collect()
    }

    /// What a formula passes on as it was sent, where it does so.
    fn passed_on<'a>(&'a self, formula: &'a Formula) -> Option<&'a Formula> {
        match formula {
            Formula::Aggregate(at) => {
                let gathered = self.bound.gathered.get(*at)?;
                matches!(gathered.function, Function::Min | Function::Max).then_some(&gathered.argument)
            }
            Formula::Absolute(inner) => Some(inner),
            other => Some(other),
        }
    }

    fn digits_of(&self, formula: &Formula) -> Option<u8> {
        match self.passed_on(formula)? {
            Formula::Slot(slot) => self.digits.get(*slot).copied().flatten(),
            _ => None,
        }
    }

    fn is_exact(&self, formula: &Formula) -> bool {
        let counts = |at: &usize| {
            let gathered = self.bound.gathered.get(*at);
            gathered.is_some_and(|gathered| matches!(gathered.function, Function::Count | Function::Invalid))
        };
        match formula {
            Formula::Aggregate(at) if counts(at) => true,
            other => matches!(self.passed_on(other), Some(Formula::Slot(_))),
        }
    }
}
