//! What came of a recording.

use super::Recording;
use crate::measure::sample::Source;
use crate::measure::statistics::Statistics;
use crate::tasks::log::silence::{why_nothing, why_silent};
use crate::tasks::log::{Outcome, Plan};
use std::time::Duration;

impl Recording {
    pub(in crate::tasks::log) fn outcome(mut self, plan: &Plan) -> Outcome {
        let lost = self.lost();
        if self.syncs.left_out > 0 {
            let why = if self.events.link_losses > 0 {
                "the interface was down"
            } else {
                "the program was stopped or too slow"
            };
            self.remarks.push(format!("{} SYNC left out: {why}", self.syncs.left_out));
        }
        if let Some(buffer) = self.receive_buffer.filter(|buffer| self.dropped > 0 && buffer.is_small()) {
            self.remarks.push(format!(
                "the receive buffer had {} bytes, and the kernel allows no more; to allow it: \
                 sudo sysctl net.core.rmem_max={}",
                buffer.bytes,
                buffer.wanted / 2
            ));
        }
        for node in self.renewals.held() {
            self.remarks.push(format!("node {node} could not be read again: what it sent since was not recorded"));
        }
        let nothing = (self.rows == 0).then(|| why_nothing(&self.instruments, plan, &self));
        for &node in lost.iter().filter(|_| self.rows > 0) {
            if let Some(instrument) = self.instruments.iter().find(|instrument| instrument.id == node)
                && self.pulses[&node].last.is_none()
            {
                let (why, _) = why_silent(instrument, plan.mode);
                self.remarks.push(format!("node {node}: no measurements: {why}"));
            }
        }
        // A unit or a mapping that was learned on the way replaces what was known before; what gave nothing
        // under its old name is no source of its own.
        let statistics: Vec<(Source, Statistics)> =
            self.decoder.sources().iter().cloned().zip(self.statistics).collect();
        let named_again = |at: usize, source: &Source| {
            let others = statistics.iter().enumerate().filter(|&(other, _)| other > at);
            others.into_iter().any(|(_, (other, _))| (other.node, &other.signal) == (source.node, &source.signal))
        };
        let kept = |(at, (source, statistics)): (usize, &(Source, Statistics))| {
            let empty = statistics.count() == 0 && statistics.invalid() == 0;
            (!(empty && named_again(at, source))).then(|| (source.clone(), statistics.clone()))
        };
        let statistics = statistics.iter().enumerate().filter_map(kept).collect();
        Outcome {
            rows: self.rows,
            length: self.first.map_or(Duration::ZERO, |first| self.end.since(first)),
            statistics,
            lost,
            nothing,
            dropped: self.dropped,
            emergencies: self.emergencies,
            gaps: self.gaps,
            skipped: self.skipped,
            events: self.events,
            syncs: self.syncs,
            receive_buffer: self.receive_buffer,
            timestamps: self.timestamps,
            remarks: self.remarks,
            interrupted: self.interrupted,
        }
    }
}
