//! Reduces a scenario: all variants with one piece less.

use crate::spec::{Other, Spec};

impl Spec {
    /// All variants with one piece less.
    pub(crate) fn smaller(&self) -> Vec<Spec> {
        let mut all = Vec::new();
        let mut without = |change: &dyn Fn(&mut Spec)| {
            let mut spec = self.clone();
            change(&mut spec);
            all.push(spec);
        };
        (0..self.others.len()).for_each(|at| without(&|spec| drop(spec.others.remove(at))));
        (0..self.faults.len()).for_each(|at| without(&|spec| _ = spec.faults.remove(at)));
        (0..self.interrupts.len()).for_each(|at| without(&|spec| _ = spec.interrupts.remove(at)));
        for (at, device) in self.devices.iter().enumerate() {
            for device_fault in 0..device.device_faults.len() {
                without(&|spec| _ = spec.devices[at].device_faults.remove(device_fault));
            }
            if device.latency_us > 0 {
                without(&|spec| spec.devices[at].latency_us = 0);
            }
            if device.unsaved_heartbeat.is_some() {
                without(&|spec| spec.devices[at].unsaved_heartbeat = None);
            }
            if device.heartbeat_ms.is_some() {
                without(&|spec| spec.devices[at].heartbeat_ms = None);
            }
            if device.event_timer_ms.is_some() {
                without(&|spec| spec.devices[at].event_timer_ms = None);
            }
            if device.deviation.is_some() {
                without(&|spec| spec.devices[at].deviation = None);
            }
            if device.overload {
                without(&|spec| spec.devices[at].overload = false);
            }
        }
        for (at, other) in self.others.iter().enumerate() {
            let Other::Master { plan } = other else { continue };
            for act in 0..plan.len() {
                without(&|spec| {
                    if let Other::Master { plan } = &mut spec.others[at] {
                        plan.remove(act);
                    }
                });
            }
        }
        if self.codec.is_some() {
            without(&|spec| spec.codec = None);
        }
        if self.kill.is_some() {
            without(&|spec| spec.kill = None);
        }
        if self.devices.len() > 1 && !self.command.counts_places() {
            without(&|spec| drop(spec.devices.pop()));
            without(&|spec| drop(spec.devices.remove(0)));
        }
        let named = self.command.clone().nodes_mut().map_or(0, |nodes| nodes.len());
        for at in (0..named).filter(|_| (2..10).contains(&named)) {
            without(&|spec| {
                if let Some(nodes) = spec.command.nodes_mut() {
                    nodes.remove(at);
                }
            });
        }
        if self.queue < 10 {
            without(&|spec| spec.queue = 10);
        }
        all
    }
}
