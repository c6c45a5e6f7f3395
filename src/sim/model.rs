//! The quantity that a simulated channel measures: a pure function of seed and time.

use crate::sim::data::{Form, SimChannel};
use std::time::Duration;

/// The side of the measuring range on which the quantity is outside.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Direction {
    /// Above the end of the range.
    High,
    /// Below the start of the range.
    Low,
}

/// A period in which the quantity is outside of the measuring range.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overload {
    /// The start of the period, in the time of the bus.
    pub from: Duration,
    /// The end of the period.
    pub until: Duration,
    /// The side of the measuring range.
    pub direction: Direction,
}

/// A measured quantity: a sine with noise, renewed once per sample time.
#[derive(Clone, Debug)]
pub(super) struct Quantity {
    channel: SimChannel,
    sample: Duration,
    /// The distance from the measuring range at which an overload begins, in the unit of the channel.
    margin: f64,
    overloads: Vec<Overload>,
    key: u64,
}

impl Quantity {
    /// Creates a quantity. `seed` is the seed of the bench. `serial` makes the noise of equal devices different.
    pub(super) fn new(
        channel: SimChannel,
        sample: Duration,
        overload_percent: f64,
        overloads: Vec<Overload>,
        seed: u64,
        serial: u32,
    ) -> Quantity {
        let key = mix(mix(seed ^ u64::from(serial) << 8) ^ u64::from(channel.channel));
        let margin = (channel.end - channel.start) * overload_percent / 100.0;
        Quantity { channel, sample: sample.max(Duration::from_nanos(1)), margin, overloads, key }
    }

    /// Sets the quantity to a constant value from now on.
    pub(super) fn hold(&mut self, value: f64) {
        self.channel.hold(value);
        self.overloads.clear();
    }

    /// Sets the sample time.
    pub(super) fn set_sample(&mut self, sample: Duration) {
        self.sample = sample.max(Duration::from_nanos(1));
    }

    /// The sample time in microseconds, at least 1.
    pub(super) fn sample_us(&self) -> u128 {
        self.sample.as_micros().max(1)
    }

    pub(super) fn channel(&self) -> &SimChannel {
        &self.channel
    }

    /// Returns the number of the sample at `time`.
    pub(super) fn index(&self, time: Duration) -> u64 {
        u64::try_from(time.as_nanos() / self.sample.as_nanos()).unwrap_or(u64::MAX)
    }

    /// Returns the time of the first sample after `time`.
    pub(super) fn next_sample(&self, time: Duration) -> Duration {
        self.sample_time(self.index(time).saturating_add(1))
    }

    fn sample_time(&self, index: u64) -> Duration {
        let nanos = u128::from(index) * self.sample.as_nanos();
        Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }

    /// Returns the quantity at `time`, in the unit of the channel.
    pub(super) fn at(&self, time: Duration) -> f64 {
        self.sample(self.index(time))
    }

    /// Returns the sample with this number.
    pub(super) fn sample(&self, index: u64) -> f64 {
        let sampled = self.sample_time(index);
        let channel = &self.channel;
        // The value is outside of the limit even with noise.
        let far = self.margin + 0.05 * (channel.end - channel.start);
        match self.scripted(sampled) {
            Some(Direction::High) => channel.end + far,
            Some(Direction::Low) => channel.start - far,
            None => {
                let seconds = sampled.as_secs_f64();
                let turns = if channel.period_s > 0.0 { seconds / channel.period_s } else { 0.0 };
                let value = match &channel.form {
                    Form::Sine => channel.base + channel.amplitude * (turns * std::f64::consts::TAU).sin(),
                    Form::Ramp => channel.base + channel.amplitude * (2.0 * turns.fract() - 1.0),
                    Form::Points(points) => between(points, seconds),
                };
                value + channel.noise * self.noise(index)
            }
        }
    }

    /// Returns a number between -1 and 1, which differs between samples and is the same in each run.
    fn noise(&self, index: u64) -> f64 {
        let bits = mix(self.key ^ index) >> 11;
        bits as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn scripted(&self, sampled: Duration) -> Option<Direction> {
        self.overloads
            .iter()
            .find(|overload| overload.from <= sampled && sampled < overload.until)
            .map(|overload| overload.direction)
    }

    /// Returns the direction of the overload at `time`, if there is one.
    pub(super) fn overload(&self, time: Duration) -> Option<Direction> {
        self.beyond(self.at(time))
    }

    /// Returns the direction in which a value is outside of the limits.
    pub(super) fn beyond(&self, value: f64) -> Option<Direction> {
        if value > self.channel.end + self.margin {
            Some(Direction::High)
        } else if value < self.channel.start - self.margin {
            Some(Direction::Low)
        } else {
            None
        }
    }

    /// Returns the next time after `time` at which an overload may begin or end.
    pub(super) fn next_change(&self, time: Duration) -> Option<Duration> {
        let edges = self.overloads.iter().flat_map(|overload| [overload.from, overload.until]);
        // A change becomes visible in the first sample at or after it.
        let shown = edges.map(|edge| {
            let index = self.index(edge);
            if self.sample_time(index) < edge { self.sample_time(index.saturating_add(1)) } else { edge }
        });
        let scripted = shown.filter(|edge| *edge > time).min();
        let (low, high) = self.swing();
        let natural = (high > self.channel.end + self.margin || low < self.channel.start - self.margin)
            .then(|| self.next_sample(time));
        scripted.into_iter().chain(natural).min()
    }

    /// The lowest and highest possible value without scripted overloads.
    fn swing(&self) -> (f64, f64) {
        let channel = &self.channel;
        let (low, high) = match &channel.form {
            Form::Points(points) => {
                points.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), (_, value)| {
                    (low.min(*value), high.max(*value))
                })
            }
            Form::Sine | Form::Ramp => {
                let reach = channel.amplitude.abs();
                (channel.base - reach, channel.base + reach)
            }
        };
        (low - channel.noise.abs(), high + channel.noise.abs())
    }

    /// The lowest and highest possible value.
    pub(super) fn reach(&self) -> (f64, f64) {
        let far = self.margin + 0.05 * (self.channel.end - self.channel.start);
        self.overloads.iter().fold(self.swing(), |(low, high), overload| match overload.direction {
            Direction::High => (low, high.max(self.channel.end + far)),
            Direction::Low => (low.min(self.channel.start - far), high),
        })
    }
}

/// Interpolates the value at a time between two points. Before the first point and after the last one, the value is
/// constant.
fn between(points: &[(f64, f64)], seconds: f64) -> f64 {
    let next = points.partition_point(|(at, _)| *at <= seconds);
    match (next.checked_sub(1).and_then(|last| points.get(last)), points.get(next)) {
        (Some((from, low)), Some((until, high))) => low + (high - low) * (seconds - from) / (until - from),
        (Some((_, value)), None) | (None, Some((_, value))) => *value,
        (None, None) => 0.0,
    }
}

/// Mixes bits with the finalizer of SplitMix64: each bit of the input changes about half of the output bits.
fn mix(input: u64) -> u64 {
    let mut z = input.wrapping_add(0x9e37_79b9_7f4a_7c15);
    z = (z ^ z >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ z >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    z ^ z >> 31
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel() -> SimChannel {
        toml::from_str(
            "channel = 1\nunit = 0x4E0000\nbase = 5.0\namplitude = 2.0\nperiod_s = 4.0\nnoise = 0.1\nstart = 0.0\nend = 10.0",
        )
        .expect("a channel")
    }

    fn quantity(channel: SimChannel, overloads: Vec<Overload>, seed: u64) -> Quantity {
        Quantity::new(channel, Duration::from_micros(640), 3.125, overloads, seed, 1)
    }

    const fn ms(milliseconds: u64) -> Duration {
        Duration::from_millis(milliseconds)
    }

    #[test]
    fn quantity_follows_its_sine() {
        let quiet = quantity(SimChannel { noise: 0.0, ..channel() }, Vec::new(), 1);
        assert_eq!(quiet.at(Duration::ZERO), 5.0);
        assert!((quiet.at(ms(1000)) - 7.0).abs() < 0.01, "{}", quiet.at(ms(1000)));
        assert!((quiet.at(ms(3000)) - 3.0).abs() < 0.01);
        // The value changes only every 640 us.
        assert_eq!(quiet.at(Duration::from_micros(640)), quiet.at(Duration::from_micros(1279)));
        assert_ne!(quiet.at(Duration::from_micros(640)), quiet.at(Duration::from_micros(1280)));
        assert_eq!(quiet.next_sample(Duration::from_micros(640)), Duration::from_micros(1280));
        // A period of 0 means constant.
        let still = quantity(SimChannel { noise: 0.0, period_s: 0.0, ..channel() }, Vec::new(), 1);
        assert_eq!(still.at(ms(1234)), 5.0);
    }

    #[test]
    fn noise_is_reproducible_bounded_and_not_constant() {
        let still = SimChannel { amplitude: 0.0, ..channel() };
        let values = |seed| -> Vec<f64> {
            let noisy = quantity(still.clone(), Vec::new(), seed);
            (0..1000).map(|index| noisy.at(Duration::from_micros(640) * index)).collect()
        };
        let first = values(1);
        assert_eq!(first, values(1));
        assert_ne!(first, values(2));
        assert!(first.iter().all(|value| (4.9..=5.1).contains(value)));
        let mean = first.iter().sum::<f64>() / 1000.0;
        assert!((mean - 5.0).abs() < 0.01, "{mean}");
        let spread = first.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / 1000.0;
        assert!((spread.sqrt() - 0.1 / 3f64.sqrt()).abs() < 0.005, "uniform noise, {}", spread.sqrt());
        let other = Quantity::new(still, Duration::from_micros(640), 0.0, Vec::new(), 1, 2);
        assert_ne!(first[1], other.at(Duration::from_micros(640)), "another serial number, another noise");
    }

    #[test]
    fn overload_begins_outside_of_range_and_margin() {
        let at = |base: f64| {
            quantity(SimChannel { base, amplitude: 0.0, noise: 0.0, ..channel() }, Vec::new(), 1).overload(ms(1))
        };
        assert_eq!(at(10.0), None);
        assert_eq!(at(10.3125), None);
        assert_eq!(at(10.3126), Some(Direction::High));
        assert_eq!(at(-0.3125), None);
        assert_eq!(at(-0.3126), Some(Direction::Low));
    }

    #[test]
    fn scripted_overloads_start_with_the_next_sample() {
        let script = vec![
            Overload { from: ms(1), until: ms(2), direction: Direction::High },
            Overload { from: ms(5), until: ms(6), direction: Direction::Low },
        ];
        let quantity = quantity(channel(), script, 1);
        let us = Duration::from_micros;
        assert_eq!(quantity.next_change(Duration::ZERO), Some(us(1280)));
        assert_eq!(quantity.overload(us(1279)), None);
        assert_eq!(quantity.overload(us(1280)), Some(Direction::High));
        assert_eq!(quantity.next_change(us(1280)), Some(us(2560)));
        assert_eq!(quantity.overload(us(2559)), Some(Direction::High));
        assert_eq!(quantity.overload(us(2560)), None);
        assert_eq!(quantity.overload(us(5120)), Some(Direction::Low));
        assert_eq!(quantity.next_change(us(5120)), Some(us(6400)));
        assert_eq!(quantity.next_change(us(6400)), None, "nothing to watch for");
        let (low, high) = quantity.reach();
        assert!(low < -0.3125 && high > 10.3125);
    }

    #[test]
    fn quantity_that_can_leave_its_range_is_checked_at_every_sample() {
        let wide = quantity(SimChannel { amplitude: 8.0, ..channel() }, Vec::new(), 1);
        assert_eq!(wide.next_change(Duration::ZERO), Some(Duration::from_micros(640)));
        assert_eq!(wide.overload(ms(1000)), Some(Direction::High));
        assert_eq!(wide.overload(ms(3000)), Some(Direction::Low));
    }
}
