//! Runs procedures for several nodes at the same time.

use super::Master;
use crate::bus::Filters;
use crate::bus::parallel::in_parallel;

impl Master<'_> {
    /// Runs `work` for all items at the same time, each with its own master on the same bus. The items must belong to
    /// different nodes, and `work` must not use LSS, which reaches all devices. The results have the order of the
    /// items.
    pub fn in_parallel<T: Send, R: Send>(
        &mut self,
        items: Vec<T>,
        work: &(dyn Fn(&mut Master<'_>, T) -> R + Sync),
    ) -> Vec<R> {
        self.settle();
        let (timing, reaction) = (self.timing, self.sdo.on_two_devices());
        let done = in_parallel(&mut *self.bus, items, &|bus, item| {
            let mut master = Master::new(bus, timing);
            master.set_on_two_devices(reaction);
            let result = work(&mut master, item);
            master.settle();
            (result, master.sdo)
        });
        let mut results = Vec::new();
        for (result, sdo) in done {
            self.sdo.merge(sdo);
            results.push(result);
        }
        // A failed bus reports its error again at the next call.
        let _ = self.bus.listen(if self.receives_all { &Filters::All } else { &self.filters });
        results
    }
}
