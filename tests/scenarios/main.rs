//! Commands and recordings under bad conditions, on the virtual clock.

mod answers;
mod assign;
mod bit_rates;
mod config;
mod conform;
mod costly_clock;
mod detect;
mod doctor;
mod full_queue;
mod garbage;
mod log_goes_on;
mod lss;
mod nmt;
mod odd_answers;
mod pdo_map;
mod pdo_map_devices;
mod probe;
mod scan;
mod second_master;
mod second_sync;
mod settings;
mod signatures;
mod silence;
mod stalled;
mod transfer_ends;

use cangauge::bus::Stamp;
use cangauge::measure::sample::{Sample, Source};
use cangauge::tasks::log::{LogEvent, Observer};
use std::ops::ControlFlow;

/// Keeps the rows and events of a recording, in the format of the simulator's record.
#[derive(Default)]
struct RecordedRows {
    rows: Vec<String>,
    notes: Vec<LogEvent>,
}

impl Observer for RecordedRows {
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        for sample in samples {
            let source = &sources[sample.source];
            let value = sample.value.map(|value| value.to_string()).unwrap_or_default();
            let status = sample.status.map_or("", |status| status.as_str());
            let at = sample.at.mono.since_start().as_micros();
            let Source { node, signal, unit, .. } = source;
            self.rows.push(format!("{at},{node},{signal},{value},{unit},{status},{}", sample.raw));
        }
        ControlFlow::Continue(())
    }

    fn event(&mut self, note: &LogEvent, _: Stamp) {
        self.notes.push(note.clone());
    }

    fn tick(&mut self, _: Stamp, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}
