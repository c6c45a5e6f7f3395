//! Restarts the filters of the channels: at the start of the device, and when an object of a filter is written.

use super::{Channel, Channels};
use crate::canopen::object::ObjectId;
use crate::sim::filter;
use crate::sim::objects::Objects;
use std::time::Duration;

/// The object with the time between two samples in microseconds (CiA 404).
const SAMPLE_TIME: u16 = 0x6114;

/// The lowest sample time. A shorter one would only slow down the simulation.
const SHORTEST_SAMPLE: Duration = Duration::from_micros(100);

impl Channels {
    /// Restarts every filter, because the device has started.
    pub(in crate::sim) fn begin(&mut self, objects: &mut Objects, time: Duration) {
        self.list.iter().for_each(|channel| channel.align(objects, None));
        self.list.iter_mut().for_each(|channel| channel.restart(objects, time));
    }

    /// Restarts a filter if the written object belongs to it.
    pub(in crate::sim) fn refilter(&mut self, objects: &mut Objects, written: ObjectId, time: Duration) {
        let constant = self.apply_damping(objects, written);
        let written = constant.unwrap_or(written);
        let sets = |channel: &&mut Channel| {
            channel.filter.is_set_by(written) || written == ObjectId::new(SAMPLE_TIME, channel.signal.channel)
        };
        self.list.iter_mut().filter(sets).for_each(|channel| channel.restart(objects, time));
    }

    /// Records that a PDO with these objects was sent.
    pub(in crate::sim) fn sent(&mut self, mapped: &[ObjectId]) {
        for (index, _) in mapped.iter().filter_map(|object| self.contents.get(object)) {
            if let Some(channel) = self.list.get_mut(*index) {
                channel.filter.sent();
            }
        }
    }

    /// Computes the constant of the moving average from a written damping (MH-4, 4.3.7). Returns the changed object.
    fn apply_damping(&self, objects: &mut Objects, object: ObjectId) -> Option<ObjectId> {
        objects.spec(object).filter(|spec| spec.name == "damping")?;
        let [kind, constant] = [0x61a0, 0x61a1].map(|index| ObjectId::new(index, object.sub));
        let channel = self.by_number(object.sub).filter(|_| objects.number(kind) == 1)?;
        let damping = Duration::from_millis(objects.number(object).into());
        let steps = filter::constant_for(damping, channel.quantity.sample_us());
        objects.put(constant, steps.to_le_bytes().to_vec());
        Some(constant)
    }
}

impl Channel {
    /// Restarts the filter with the values of the objects.
    fn restart(&mut self, objects: &Objects, time: Duration) {
        let sample_us = objects.number(ObjectId::new(SAMPLE_TIME, self.signal.channel));
        if sample_us > 0 {
            self.quantity.set_sample(Duration::from_micros(sample_us.into()).max(SHORTEST_SAMPLE));
        }
        self.filter.begin(objects, &self.quantity, time);
    }
}
