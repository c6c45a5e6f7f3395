//! Lets a command run on the bench that a [`Spec`] says, and keeps everything that can be judged afterwards.

use crate::bench::{Holds, bench, holds, plan};
use crate::carry_out::{Heard, Said, carry_out};
use crate::spec::Spec;
use crate::station::{Unruly, ms};
use crate::tap::{Passed, Tap};
use crate::time::bound;
use cangauge::bus::faults::Faulty;
use cangauge::bus::memory::MemoryBus;
use cangauge::bus::{Bus, Event, Filters, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::sim::Recorder;
use cangauge::tasks::Failure;
use std::io::Write;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// A command that has come to its end.
pub(crate) struct Run {
    pub(crate) result: Result<Said, Failure>,
    pub(crate) bus: Tap<Faulty<MemoryBus>>,
    /// The devices before the command.
    pub(crate) before: Vec<Holds>,
    pub(crate) begun: Mono,
    /// When the command had ended, and when it had settled.
    pub(crate) ended: Mono,
    pub(crate) settled: Mono,
    pub(crate) bound: Duration,
    pub(crate) heard: Heard,
    /// What the devices sent, as the simulator's own record writes it.
    pub(crate) truth: Vec<String>,
    /// What came before, if the program was killed in the middle of the same command.
    pub(crate) killed: Option<Killed>,
}

/// What a program that vanished leaves behind.
pub(crate) struct Killed {
    pub(crate) frames: Vec<(Mono, Passed)>,
    /// The devices before and after it.
    pub(crate) before: Vec<Holds>,
    pub(crate) after: Vec<Holds>,
}

#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("nobody panicked").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

impl Run {
    /// The devices before anything was asked of them.
    pub(crate) fn origin(&self) -> &[Holds] {
        self.killed.as_ref().map_or(&self.before, |killed| &killed.before)
    }

    /// What a program that vanished had sent.
    pub(crate) fn sent_by_killed(&self) -> impl Iterator<Item = (Mono, Frame)> {
        self.killed.iter().flat_map(|killed| &killed.frames).filter_map(|(at, passed)| match passed {
            Passed::Sent(frame) => Some((*at, *frame)),
            Passed::Received(_) => None,
        })
    }
}

/// Lets time pass in which nobody runs a program.
fn wait(bus: &mut impl Bus, until: Mono) {
    while !matches!(bus.receive(until), Ok(Event::Timeout) | Err(_)) {}
}

fn all_hold(bus: &MemoryBus) -> Vec<Holds> {
    bus.stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect()
}

pub(crate) fn run(spec: &Spec) -> Run {
    let record = Memory::default();
    let recorder = Recorder::new(Box::new(record.clone())).expect("memory");
    let mut bus = bench(spec, &recorder);
    // The boot-ups go over the wire before the program comes.
    let mut begun = ms(20);
    wait(&mut bus, begun);
    for interrupt in &spec.interrupts {
        bus.interrupt_at(begun + Duration::from_micros(*interrupt));
    }
    let mut before = all_hold(&bus);
    let bound = bound(spec);
    let kill = spec.kill.map(|kill| kill.before);
    let mut bus = Tap::new(Faulty::new(bus, plan(&spec.faults)), begun + bound, kill);
    let mut heard = Heard::default();
    let mut result = carry_out(&mut bus, spec, &mut heard);
    let mut killed = None;
    if let (true, Some(kill)) = (bus.is_dead, spec.kill) {
        let frames = std::mem::take(&mut bus.frames);
        begun = bus.now().mono + Duration::from_millis(kill.again_ms);
        wait(&mut bus.bus, begun);
        let after = all_hold(bus.bus.inner());
        killed = Some(Killed { frames, before, after: after.clone() });
        before = after;
        bus = bus.anew(begun + bound);
        // A program that starts wants every frame.
        bus.listen(&Filters::All).expect("it can always listen");
        heard = Heard::default();
        result = carry_out(&mut bus, spec, &mut heard);
    }
    let ended = bus.now().mono;
    if bus.overran {
        bus.overran = ended > bus.deadline || result.is_err();
    }
    // What was handed over last gets there, and who was reset is back.
    wait(bus.bus.inner_mut(), ended + Duration::from_millis(400));
    let settled = bus.now().mono;
    recorder.flush().expect("memory");
    let truth = record.0.lock().expect("nobody panicked").clone();
    let truth = String::from_utf8(truth).expect("text").lines().skip(1).map(str::to_owned).collect();
    Run { result, bus, before, begun, ended, settled, bound, heard, truth, killed }
}

/// The frames as the program saw them, like those of `candump -L`.
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
