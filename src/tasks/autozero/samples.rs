//! Several readings of one signal, one after the other.

use crate::bus::{BusError, Received};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::Life;
use crate::master::{Error, Happening, Master};
use crate::measure::decode::Wanted;
use crate::measure::sample::Status;
use crate::measure::statistics::Statistics;
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::read::{Target, requests, sample, targets};
use std::time::Duration;

/// The time between two readings: slower than what a transmitter takes to measure anew (DPS: 100 ms).
const BETWEEN: Duration = Duration::from_millis(100);

/// What several readings came to.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct Samples {
    statistics: Statistics,
    /// What the device said of the first reading that was not valid.
    pub(super) bad: Option<Status>,
    /// Whether the node booted meanwhile.
    pub(super) booted: bool,
}

impl Samples {
    /// The mean; `None` when not every reading was valid.
    pub(super) fn mean(&self) -> Option<f64> {
        self.statistics.mean().filter(|_| self.bad.is_none() && self.statistics.invalid() == 0)
    }

    /// From the least to the greatest reading.
    pub(super) fn spread(&self) -> f64 {
        self.statistics.max().zip(self.statistics.min()).map_or(0.0, |(max, min)| max - min)
    }

    fn watch(&mut self, node: NodeId, received: &Received) {
        self.booted |= Life::parse(&received.frame) == Some((node, Life::BootUp));
    }

    fn wait(&mut self, master: &mut Master<'_>, node: NodeId) -> Result<(), Error> {
        let until = master.now() + BETWEEN;
        loop {
            match master.next(until)? {
                Happening::Frame(received) => self.watch(node, &received),
                Happening::Deadline => return Ok(()),
                Happening::Interrupted => return Err(Error::Interrupted),
                Happening::Link(false) => return Err(Error::Bus(BusError::Down(master.bus().name().to_owned()))),
                Happening::Sdo(..)
                | Happening::Fault(..)
                | Happening::Dropped(_)
                | Happening::Link(true)
                | Happening::Ended => {}
            }
        }
    }

    fn read(&mut self, master: &mut Master<'_>, target: &Target) -> Result<(), Failure> {
        let node = target.source.node;
        let mut answers = master.transfer(requests(target), &mut |received| self.watch(node, received))?.into_iter();
        let Some(value) = answers.next() else { return Ok(()) };
        let sample = sample(target, value, answers.next())?;
        let bad = sample.status.filter(|status| *status != Status::Ok);
        self.bad = self.bad.or(bad).or_else(|| sample.value.is_none().then_some(Status::Invalid));
        self.statistics.add(sample.value.map(|value| value.as_f64()), sample.at.mono.since_start());
        Ok(())
    }
}

/// Reads a signal `count` times; before each reading some time is left, so that all of them are new.
///
/// # Errors
/// Refusals, silence, and what stops everything.
pub(super) fn take(master: &mut Master<'_>, device: &Node, signal: &str, count: u32) -> Result<Samples, Failure> {
    let mut samples = Samples::default();
    for target in targets(device, &[Wanted::Signal(signal.to_owned())], &mut 0)? {
        for _ in 0..count {
            samples.wait(master, device.id)?;
            samples.read(master, &target)?;
        }
    }
    Ok(samples)
}
