//! Runs the command of a [`Spec`], and keeps everything that is checked afterwards.

use crate::bench::{DeviceState, bench, device_state, plan};
use crate::carry_out::{Claim, Observations, carry_out};
use crate::spec::Spec;
use crate::station::{FaultyDevice, ms};
use crate::tap::{Passed, Tap};
use crate::time::bound;
use cangauge::bus::coded::TextRoundTrip;
use cangauge::bus::faults::Faulty;
use cangauge::bus::memory::MemoryBus;
use cangauge::bus::paced::Paced;
use cangauge::bus::{Bus, Event, Filters, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::sim::Recorder;
use cangauge::tasks::Failure;
use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A finished command.
pub(crate) struct Run {
    pub(crate) result: Result<Claim, Failure>,
    pub(crate) bus: Tap<TextRoundTrip<Faulty<MemoryBus>>>,
    /// The devices before the command.
    pub(crate) before: Vec<DeviceState>,
    pub(crate) started: Mono,
    /// The end of the command, and the moment when the bus was quiet again.
    pub(crate) ended: Mono,
    pub(crate) settled: Mono,
    pub(crate) bound: Duration,
    pub(crate) observed: Observations,
    /// The values that the devices sent, in the format of the simulator's record.
    pub(crate) truth: Vec<String>,
    /// The first run of the same command, if that program was killed.
    pub(crate) killed: Option<Killed>,
}

/// The run of a program that was killed.
pub(crate) struct Killed {
    pub(crate) frames: Vec<(Mono, Passed)>,
    /// The devices before and after it.
    pub(crate) before: Vec<DeviceState>,
    pub(crate) after: Vec<DeviceState>,
}

#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("no thread panicked").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Run {
    /// The devices before the first frame.
    pub(crate) fn origin(&self) -> &[DeviceState] {
        self.killed.as_ref().map_or(&self.before, |killed| &killed.before)
    }

    /// The frames that the killed program had sent.
    pub(crate) fn sent_by_killed(&self) -> impl Iterator<Item = (Mono, Frame)> {
        self.killed.iter().flat_map(|killed| &killed.frames).filter_map(|(at, passed)| match passed {
            Passed::Sent(frame) => Some((*at, *frame)),
            Passed::Received(_) => None,
        })
    }
}

/// Lets time pass without a program.
fn wait(bus: &mut impl Bus, until: Mono) {
    while !matches!(bus.receive(until), Ok(Event::Timeout) | Err(_)) {}
}

fn device_states(bus: &MemoryBus) -> Vec<DeviceState> {
    bus.stations::<FaultyDevice>().map(|station| device_state(&station.device)).collect()
}

/// The bus as the commands use it.
fn paced(bus: &mut dyn Bus) -> Paced<&mut dyn Bus> {
    Paced::new(bus, None, Vec::new())
}

pub(crate) fn run(spec: &Spec) -> Run {
    let record = Memory::default();
    let recorder = Recorder::new(Box::new(record.clone())).expect("memory");
    let mut bus = bench(spec, &recorder);
    // The boot-up messages are sent before the program starts.
    let mut started = ms(20);
    wait(&mut bus, started);
    for interrupt in &spec.interrupts {
        bus.interrupt_at(started + Duration::from_micros(*interrupt));
    }
    let mut before = device_states(&bus);
    let bound = bound(spec);
    let kill = spec.kill.map(|kill| kill.before);
    let bus = TextRoundTrip::new(Faulty::new(bus, plan(&spec.faults)), spec.codec);
    let mut bus = Tap::new(bus, started + bound, kill);
    let mut observed = Observations::default();
    let mut result = carry_out(&mut paced(&mut bus), spec, &mut observed);
    let mut killed = None;
    if let (true, Some(kill)) = (bus.is_dead, spec.kill) {
        let frames = std::mem::take(&mut bus.frames);
        started = bus.now().mono + Duration::from_millis(kill.again_ms);
        wait(&mut bus.bus, started);
        let after = device_states(bus.bus.inner().inner());
        killed = Some(Killed { frames, before, after: after.clone() });
        before = after;
        bus = bus.restarted(started + bound);
        // A program that starts receives every frame.
        bus.listen(&Filters::All).expect("it can always listen");
        observed = Observations::default();
        result = carry_out(&mut paced(&mut bus), spec, &mut observed);
    }
    let ended = bus.now().mono;
    if bus.overran {
        bus.overran = ended > bus.deadline || result.is_err();
    }
    // The last frames are sent, and devices that were reset have restarted.
    wait(bus.bus.inner_mut().inner_mut(), ended + Duration::from_millis(400));
    let settled = bus.now().mono;
    recorder.flush().expect("memory");
    let truth = record.0.lock().expect("no thread panicked").clone();
    let truth = String::from_utf8(truth).expect("text").lines().skip(1).map(str::to_owned).collect();
    Run { result, bus, before, started, ended, settled, bound, observed, truth, killed }
}

/// The frames as the program saw them, in the format of `candump -L`.
pub(crate) fn transcript(run: &Run) -> String {
    let line = |(at, passed): &(Mono, Passed)| {
        let time = at.since_start();
        let (frame, from): (&Frame, _) = match passed {
            Passed::Sent(frame) => (frame, "T"),
            Passed::Received(frame) => (frame, "R"),
        };
        format!("({}.{:06}) sim {frame} {from}\n", time.as_secs(), time.subsec_micros())
    };
    let first: String = run.killed.iter().flat_map(|killed| &killed.frames).map(line).collect();
    let gap = if run.killed.is_some() { "# killed\n" } else { "" };
    first + gap + &run.bus.frames.iter().map(line).collect::<String>()
}
