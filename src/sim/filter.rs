//! The filter of a simulated channel (CiA 404: 61A0h, 61A1h), between the samples of the sensor and the process value.

use super::model::Quantity;
use super::objects::Objects;
use crate::canopen::object::ObjectId;
use crate::device::description::Description;
use std::collections::BTreeMap;
use std::time::Duration;

const TYPE: u16 = 0x61a0;
const CONSTANT: u16 = 0x61a1;
/// The longest time over which the mean until the next PDO is calculated. After this time, the filter is a moving
/// average (MC1609, 2.2, Filter).
const MAX_LENGTH: Duration = Duration::from_millis(1000);
/// A moving average no longer depends on samples older than this multiple of its constant.
const MEMORY_FACTOR: u64 = 40;

/// How samples are combined into one value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Each sample is a value.
    None,
    /// A part of the difference is added to the value: `v += (in - v) / N`.
    Moving,
    /// The mean of N samples, renewed every N samples.
    Repeating,
    /// The mean of the samples since the last PDO.
    SincePdo,
}

/// The filter of one channel.
#[derive(Clone, Debug)]
pub(super) struct Filter {
    channel: u8,
    /// The meanings of the codes of 61A0h.
    kinds: BTreeMap<u32, Kind>,
    kind: Kind,
    /// N, the filter constant (61A1h), at least 1.
    constant: u64,
    /// The number of the next sample.
    next: u64,
    /// Whether the next sample is the first.
    is_new: bool,
    value: f64,
    sum: f64,
    /// The number of samples in the sum.
    count: u64,
    /// Whether a mean is complete.
    is_full: bool,
}

impl Filter {
    /// Creates the filter of a channel from the description. Without 61A0h, the channel has no filter.
    pub(super) fn new(description: &Description, channel: u8, until_pdo: bool) -> Filter {
        let codes = description.object(ObjectId::new(TYPE, channel)).map(|entry| &entry.values);
        let kinds = codes.into_iter().flatten().filter_map(|(code, meaning)| {
            let kind = match meaning.as_str() {
                "moving average" => Kind::Moving,
                "repeating average" if until_pdo => Kind::SincePdo,
                "repeating average" => Kind::Repeating,
                _ => return None,
            };
            Some((u32::try_from(*code).ok()?, kind))
        });
        Filter {
            channel,
            kinds: kinds.collect(),
            kind: Kind::None,
            constant: 1,
            next: 0,
            is_new: true,
            value: 0.0,
            sum: 0.0,
            count: 0,
            is_full: false,
        }
    }

    /// Whether an object sets this filter.
    pub(super) fn is_set_by(&self, object: ObjectId) -> bool {
        object.sub == self.channel && matches!(object.index, TYPE | CONSTANT)
    }

    /// Restarts at `time` with the values of the objects.
    pub(super) fn begin(&mut self, objects: &Objects, quantity: &Quantity, time: Duration) {
        let [kind, constant] = [TYPE, CONSTANT].map(|index| objects.number(ObjectId::new(index, self.channel)));
        self.kind = self.kinds.get(&kind).copied().unwrap_or(Kind::None);
        // The manual does not contain the effect of constant 0. It is treated as 1.
        self.constant = u64::from(constant).max(1);
        self.next = quantity.index(time);
        self.is_new = true;
    }

    /// Returns the filtered quantity at `time`. An overload passes unfiltered and restarts the filter.
    pub(super) fn value(&mut self, quantity: &Quantity, time: Duration) -> f64 {
        let present = quantity.index(time);
        if self.kind == Kind::None {
            return quantity.sample(present);
        }
        let longest = u64::try_from(MAX_LENGTH.as_micros() / quantity.sample_us()).unwrap_or(u64::MAX).max(1);
        self.skip(present, longest);
        while self.next <= present {
            let input = quantity.sample(self.next);
            self.next += 1;
            if quantity.beyond(input).is_some() {
                self.is_new = true;
                self.value = input;
            } else {
                self.add_sample(input, longest);
            }
        }
        self.value
    }

    /// Skips the samples of a long pause that do not change the value.
    fn skip(&mut self, present: u64, longest: u64) {
        let missing = present.saturating_sub(self.next);
        let window = self.constant.saturating_mul(MEMORY_FACTOR);
        match self.kind {
            Kind::Moving if missing > window => {
                self.next = present - window;
                self.is_new = true;
            }
            Kind::SincePdo if missing > window.saturating_add(longest) => {
                self.next = present - window;
                // The mean already covers its longest time.
                (self.is_new, self.count) = (false, longest);
            }
            // Skips whole means, so that later means still end at the same samples.
            Kind::Repeating => self.next += (missing / self.constant).saturating_sub(2) * self.constant,
            _ => {}
        }
    }

    fn add_sample(&mut self, input: f64, longest: u64) {
        if self.is_new {
            (self.is_new, self.is_full) = (false, false);
            (self.sum, self.count) = (0.0, 0);
            self.value = input;
            if self.kind == Kind::Moving {
                return;
            }
        }
        if self.kind == Kind::Moving || self.kind == Kind::SincePdo && self.count >= longest {
            self.value += (input - self.value) / self.constant as f64;
            return;
        }
        self.sum += input;
        self.count += 1;
        let ends = self.kind == Kind::Repeating && self.count == self.constant;
        if ends || !self.is_full {
            self.value = self.sum / self.count as f64;
        }
        if ends {
            (self.sum, self.count) = (0.0, 0);
            self.is_full = true;
        }
    }

    /// Records that a PDO with the value was sent.
    pub(super) fn sent(&mut self) {
        if self.kind == Kind::SincePdo {
            (self.sum, self.count) = (0.0, 0);
        }
    }
}

/// Returns the constant of a moving average for a damping time: after this time, the value is within 1 % of a step.
/// MH-4, 4.3.7 gives this meaning of 2023h, but not its formula.
pub(super) fn constant_for(damping: Duration, sample_us: u128) -> u16 {
    let steps = damping.as_micros() as f64 / sample_us as f64;
    // (1 - 1/N)^steps = 0.01
    let constant = if steps >= 1.0 { 1.0 / (1.0 - 0.01f64.powf(1.0 / steps)) } else { 1.0 };
    let below = (1..=u16::MAX).rev().find(|number| f64::from(*number) <= constant);
    below.unwrap_or(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::id::NodeId;
    use crate::device::catalog;
    use crate::sim::model::{Direction, Overload};

    const MS: u128 = 1000;
    const LONG: u64 = 1000;

    fn filter(kind: Kind, constant: u64) -> Filter {
        let mh4 = catalog::by_name("mh4").expect("built in");
        Filter { kind, constant, ..Filter::new(&mh4.description, 1, false) }
    }

    /// Returns the filtered value after each sample.
    fn shown(filter: &mut Filter, inputs: &[f64], longest: u64) -> Vec<f64> {
        let mut shown = Vec::new();
        for input in inputs {
            filter.add_sample(*input, longest);
            shown.push(filter.value);
        }
        shown
    }

    /// Creates a quantity around 5 with noise of 1 and a new sample every millisecond.
    fn noisy(overloads: Vec<Overload>) -> Quantity {
        let channel = toml::from_str(
            "channel = 1\nunit = 0x4E0000\nbase = 5.0\namplitude = 2.0\nperiod_s = 4.0\nnoise = 1.0\nstart = 0.0\nend = 10.0",
        );
        Quantity::new(channel.expect("a channel"), Duration::from_millis(1), 0.0, overloads, 1, 1)
    }

    #[test]
    fn codes_are_those_of_the_description() {
        let of = |name: &str, channel: u8| {
            let kinds =
                Filter::new(&catalog::by_name(name).expect("built in").description, channel, name == "mc1609").kinds;
            [0, 1, 2].map(|code| kinds.get(&code).copied())
        };
        assert_eq!(of("mh4", 1), [None, Some(Kind::Moving), Some(Kind::Repeating)]);
        assert_eq!(of("mh4", 2), [None; 3], "the temperature has none");
        assert_eq!(of("d20", 1), [None, Some(Kind::Moving), Some(Kind::Repeating)]);
        // "The value 0 will be ignored for the filter type": the manual of the MC1609.
        assert_eq!(of("mc1609", 16), [Some(Kind::SincePdo), Some(Kind::Moving), Some(Kind::SincePdo)]);
        assert_eq!(of("dps", 1), [None; 3]);
    }

    #[test]
    fn moving_average_adds_a_part_of_the_difference() {
        // MC1609, 2.2: Value = Value + (Input - Value) / N.
        let mut moving = filter(Kind::Moving, 4);
        assert_eq!(shown(&mut moving, &[0.0, 8.0, 8.0, 0.0], LONG), [0.0, 2.0, 3.5, 2.625]);
        let mut bare = filter(Kind::Moving, 1);
        assert_eq!(shown(&mut bare, &[0.0, 8.0, 3.0], LONG), [0.0, 8.0, 3.0]);
    }

    #[test]
    fn damping_is_the_time_to_within_one_percent_of_a_step() {
        for (milliseconds, sample_us) in [(100, 640), (10, 640), (2000, MS), (5, MS)] {
            let damping = Duration::from_millis(milliseconds);
            let constant = constant_for(damping, sample_us);
            let steps = usize::try_from(damping.as_micros() / sample_us).expect("few");
            let left = |constant: u16| {
                let mut moving = filter(Kind::Moving, constant.into());
                let mut inputs = vec![1.0; steps + 1];
                inputs[0] = 0.0;
                1.0 - shown(&mut moving, &inputs, LONG).last().expect("steps")
            };
            assert!(left(constant) <= 0.0101, "{milliseconds} ms: {constant} leaves {}", left(constant));
            assert!(left(constant + 1) > 0.01, "{milliseconds} ms: {constant} is the largest");
        }
        assert_eq!(constant_for(Duration::ZERO, 640), 1);
        assert_eq!(constant_for(Duration::from_micros(100), 640), 1);
        assert_eq!(constant_for(Duration::from_secs(65), 1), u16::MAX);
    }

    #[test]
    fn repeating_average_is_renewed_every_n_samples() {
        let mut repeating = filter(Kind::Repeating, 3);
        let inputs = [1.0, 2.0, 6.0, 10.0, 11.0, 12.0, 0.0];
        assert_eq!(shown(&mut repeating, &inputs, LONG), [1.0, 1.5, 3.0, 3.0, 3.0, 11.0, 11.0]);
    }

    #[test]
    fn mean_ends_with_the_pdo_or_after_one_second() {
        let mut mean = filter(Kind::SincePdo, 4);
        assert_eq!(shown(&mut mean, &[1.0, 3.0, 8.0], 5), [1.0, 2.0, 4.0]);
        mean.sent();
        assert_eq!(mean.value, 4.0, "until the next sample");
        assert_eq!(shown(&mut mean, &[10.0, 20.0, 30.0, 40.0, 50.0], 5), [10.0, 15.0, 20.0, 25.0, 30.0]);
        // From here on, the filter is the moving average with this constant.
        assert_eq!(shown(&mut mean, &[70.0, 0.0], 5), [40.0, 30.0]);
        mean.sent();
        assert_eq!(shown(&mut mean, &[2.0, 4.0], 5), [2.0, 3.0]);
        // The other kinds ignore PDOs.
        let mut repeating = filter(Kind::Repeating, 2);
        shown(&mut repeating, &[1.0], LONG);
        repeating.sent();
        assert_eq!(shown(&mut repeating, &[3.0], LONG), [2.0]);
    }

    #[test]
    fn overload_passes_unfiltered_and_restarts_the_filter() {
        let (from, until) = (Duration::from_millis(20), Duration::from_millis(30));
        let quantity = noisy(vec![Overload { from, until, direction: Direction::High }]);
        let mut moving = filter(Kind::Moving, 1000);
        let mut at = |milliseconds| moving.value(&quantity, Duration::from_millis(milliseconds));
        assert!((4.0..6.0).contains(&at(19)));
        assert_eq!(at(20), quantity.sample(20));
        assert_eq!(at(29), quantity.sample(29));
        assert_eq!(at(30), quantity.sample(30), "starts again");
        assert!((at(40) - quantity.sample(30)).abs() < 0.05);
    }

    #[test]
    fn long_pause_does_not_change_the_value() {
        let quantity = noisy(Vec::new());
        let at = Duration::from_millis;
        for (kind, constant) in [(Kind::Moving, 7), (Kind::Repeating, 50), (Kind::SincePdo, 20), (Kind::None, 9)] {
            let (mut often, mut once) = (filter(kind, constant), filter(kind, constant));
            (0..60_123).for_each(|millisecond| {
                often.value(&quantity, at(millisecond));
            });
            let (often, once) = (often.value(&quantity, at(60_123)), once.value(&quantity, at(60_123)));
            assert!((often - once).abs() < 1e-9, "{kind:?}: {often} {once}");
        }
    }

    #[test]
    fn filter_restarts_with_the_values_of_the_objects() {
        let mh4 = catalog::by_name("mh4").expect("built in");
        let mut objects = Objects::new(&mh4, NodeId::new(5).expect("a node-ID"));
        let (quantity, at) = (noisy(Vec::new()), Duration::from_millis);
        let mut filter = Filter::new(&mh4.description, 1, false);
        filter.begin(&objects, &quantity, at(3));
        assert_eq!(filter.value(&quantity, at(100)), quantity.sample(100), "no filter by default");
        let [kind, constant] = [TYPE, CONSTANT].map(|index| ObjectId::new(index, 1));
        assert!(filter.is_set_by(kind) && filter.is_set_by(constant) && !filter.is_set_by(kind.with_sub(2)));
        objects.put(kind, vec![1]);
        objects.put(constant, vec![0, 1]);
        filter.begin(&objects, &quantity, at(200));
        assert_eq!(filter.value(&quantity, at(200)), quantity.sample(200));
        let next = quantity.sample(200) + (quantity.sample(201) - quantity.sample(200)) / 256.0;
        assert_eq!(filter.value(&quantity, at(201)), next);
    }
}
