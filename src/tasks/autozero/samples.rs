//! Reads one signal several times, and computes the statistics.

use crate::bus::Received;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::ErrorControlMessage;
use crate::master::{Error, Master, MasterEvent, Request};
use crate::measure::decode::Wanted;
use crate::measure::sample::{Doubt, Status};
use crate::measure::statistics::Statistics;
use crate::node::Node;
use crate::node::wait::{Policy, wait};
use crate::tasks::Failure;
use crate::tasks::read::{Target, objects, sample, targets};
use std::ops::ControlFlow;
use std::time::Duration;

/// The time between two readings: at least one measuring cycle of the transmitter (DPS: 100 ms).
const READING_INTERVAL: Duration = Duration::from_millis(100);

/// The statistics of several readings.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Samples {
    statistics: Statistics,
    /// The status of the first invalid reading.
    pub(super) bad: Option<Status>,
    /// Whether the node restarted during the readings.
    pub(super) booted: bool,
}

impl Samples {
    /// Returns the mean; `None` if a reading was invalid.
    pub(super) fn mean(&self) -> Option<f64> {
        self.statistics.mean().filter(|_| self.bad.is_none() && self.statistics.invalid() == 0)
    }

    /// Returns the difference between the greatest and the least reading.
    pub(super) fn spread(&self) -> f64 {
        self.statistics.max().zip(self.statistics.min()).map_or(0.0, |(max, min)| max - min)
    }

    fn watch(&mut self, node: NodeId, received: &Received) {
        self.booted |= ErrorControlMessage::parse(&received.frame) == Some((node, ErrorControlMessage::BootUp));
    }

    fn pause(&mut self, master: &mut Master<'_>, node: NodeId) -> Result<(), Error> {
        let until = master.now() + READING_INTERVAL;
        wait(master, until, Policy::Command, |_, event| {
            if let MasterEvent::Frame(received) = event {
                self.watch(node, &received);
            }
            ControlFlow::<()>::Continue(())
        })?;
        Ok(())
    }

    fn read(&mut self, master: &mut Master<'_>, target: &Target) -> Result<(), Failure> {
        let node = target.source.node;
        let requests = objects(target).map(|(node, object)| Request::read(node, object)).collect();
        let mut answers = master.transfer(requests, &mut |received| self.watch(node, received))?.into_iter();
        let Some(value) = answers.next() else { return Ok(()) };
        let status = answers.next();
        let is_reported = target.reports_overload(status.as_ref());
        let failed = status.as_ref().and_then(|status| status.as_ref().err()).cloned();
        let sample = sample(target, value, status)?;
        if let Some(error) = failed.filter(|_| sample.doubt == Some(Doubt::UnknownStatus)) {
            return Err(error.into());
        }
        // An overload computed only from the measuring range is ignored, because a large zero error looks the same.
        let is_from_span = target.status.is_none() && sample.value.is_some() && !is_reported;
        let from_span = |status: Status| is_from_span && status.is_overload();
        let bad = sample.status.filter(|&status| status != Status::Ok && !from_span(status));
        self.bad = self.bad.or(bad).or_else(|| sample.value.is_none().then_some(Status::Invalid));
        self.statistics.add(sample.value.map(|value| value.as_f64()), sample.at.mono.since_start());
        Ok(())
    }
}

/// Reads a signal `count` times. A pause before each reading makes sure that the value is new.
///
/// # Errors
/// An SDO abort, no answer, a bus error, Ctrl-C.
pub(super) fn read_samples(
    master: &mut Master<'_>,
    device: &Node,
    signal: &str,
    count: u32,
) -> Result<Samples, Failure> {
    let mut samples = Samples::default();
    for target in targets(device, &[Wanted::Signal(signal.to_owned())], &mut 0)? {
        for _ in 0..count {
            samples.pause(master, device.id)?;
            samples.read(master, &target)?;
        }
    }
    Ok(samples)
}
