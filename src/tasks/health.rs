//! Measures a running bus: load, faults, heartbeat intervals and SDO answer times.
//!
//! Frames are interpreted as in [`super::monitor`]. The reads of this program are counted like the reads of other
//! masters.

mod figures;
mod load;
mod tally;

pub use figures::{Figure, Verdict, figures, names};
pub use load::Load;
pub use tally::{NodeTally, Spread};

use super::monitor::{Content, Entry, FrameKind, Interpreter};
use crate::bus::{Fault, Filters, Mono, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::Upload;
use crate::master::{Error, Master, MasterEvent, Request, Ticket};
use crate::node::Overrides;
use crate::node::state::HEARTBEAT_TIME;
use crate::node::wait::{Policy, Until, Waiter, run};
use crate::tasks::Failure;
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// The shortest interval between two reads of one node.
const READ_INTERVAL: Duration = Duration::from_millis(100);

/// The bus load (0 to 1) that the reads may cause.
const READ_SHARE: f64 = 0.05;

/// The length of a request and its answer in bits.
const READ_BITS: f64 = 270.0;

/// The bit rate used to compute the read interval if the real bit rate is unknown.
const ASSUMED_BIT_RATE: u32 = 125_000;

/// What is measured, and for how long.
#[derive(Clone, Debug)]
pub struct HealthOptions {
    /// The nodes to report. If the list is empty, every node that sends is reported.
    pub nodes: Vec<NodeId>,
    /// Whether the answer times of the nodes are measured by reads. If not, nothing is sent.
    pub reads: bool,
    /// The duration; `None`: until the end of a recording, or Ctrl-C.
    pub duration: Option<Duration>,
    /// The bit rate in bit/s, if the bus does not report it.
    pub bit_rate: Option<u32>,
    /// Descriptions chosen by the user.
    pub overrides: Overrides,
}

/// The state of the CAN controller at the end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Controller {
    /// Its state: `error-active`.
    pub state: &'static str,
    /// The transmit error counter.
    pub tx_errors: Option<u16>,
    /// The receive error counter.
    pub rx_errors: Option<u16>,
}

/// The result of the observation.
#[derive(Clone, Debug, Default)]
pub struct Health {
    /// The bit rate in bit/s, if it is known.
    pub bit_rate: Option<u32>,
    /// How long the bus was observed.
    pub length: Duration,
    /// The load of the bus.
    pub load: Load,
    /// The number of frames of each kind.
    pub frames: BTreeMap<FrameKind, u64>,
    /// The faults that the controller reported, with their number.
    pub faults: Vec<(Fault, u64)>,
    /// Frames that the kernel dropped.
    pub dropped: u64,
    /// The controller, if the interface reports it.
    pub controller: Option<Controller>,
    /// The nodes.
    pub nodes: BTreeMap<NodeId, NodeTally>,
}

/// Observes the bus.
///
/// # Errors
/// Bus errors. Ctrl-C ends the observation early, and is an error before the first frame.
pub fn health(master: &mut Master<'_>, options: &HealthOptions) -> Result<Health, Failure> {
    master.listen(&Filters::All)?;
    master.deliver_own_answers();
    let start = master.now();
    let bit_rate = options.bit_rate.or(master.bus().bit_rate()).filter(|&rate| rate > 0);
    let rate = f64::from(bit_rate.unwrap_or(ASSUMED_BIT_RATE));
    let count = u32::try_from(options.nodes.len()).unwrap_or(1).max(1);
    let per_read = Duration::from_secs_f64(READ_BITS / (rate * READ_SHARE));
    let mut observer = HealthObserver {
        options,
        interpreter: Interpreter::new(&options.overrides, Overrides::new()),
        health: Health { bit_rate, load: Load::new(bit_rate, start), ..Health::default() },
        entries: Vec::new(),
        start,
        end: options.duration.map_or(Mono::at(Duration::MAX), |duration| start + duration),
        read_interval: per_read.max(READ_INTERVAL / count),
        next_read: if options.reads { start } else { Mono::at(Duration::MAX) },
        reads: 0,
        pending: Vec::new(),
        last: start,
    };
    for &node in &options.nodes {
        observer.health.nodes.insert(node, NodeTally::default());
    }
    run(master, Policy::Record, &mut observer)?;
    Ok(observer.health)
}

struct HealthObserver<'a> {
    options: &'a HealthOptions,
    interpreter: Interpreter,
    health: Health,
    entries: Vec<Entry>,
    start: Mono,
    end: Mono,
    read_interval: Duration,
    next_read: Mono,
    /// The number of reads so far.
    reads: usize,
    /// Reads without an answer yet.
    pending: Vec<(Ticket, NodeId)>,
    /// The time of the last frame.
    last: Mono,
}

impl HealthObserver<'_> {
    fn on_frame(&mut self, received: &Received) {
        let kind = self.interpreter.take(received, &mut self.entries);
        self.last = self.last.max(received.at.mono);
        *self.health.frames.entry(kind).or_default() += 1;
        let bits = self.health.load.add(&received.frame, received.at.mono);
        let sender = self.sender(&received.frame, kind);
        if let Some(tally) = sender.and_then(|node| self.tally(node)) {
            tally.frames += 1;
            tally.bits += bits;
        }
        self.count_entries();
    }

    /// Returns the node that sent a frame; `None` for masters.
    fn sender(&self, frame: &Frame, kind: FrameKind) -> Option<NodeId> {
        if frame.is_remote() || matches!(kind, FrameKind::Nmt | FrameKind::Other) {
            return None;
        }
        if kind == FrameKind::Sdo {
            return frame.id().sdo_response_node();
        }
        let last = self.entries.last().filter(|entry| entry.id == Some(frame.id()))?;
        if matches!(last.content, Content::Pdo(_, true)) { None } else { last.node }
    }

    /// Returns the figures of a node; `None` if the node is not reported.
    fn tally(&mut self, node: NodeId) -> Option<&mut NodeTally> {
        let is_reported = self.options.nodes.is_empty() || self.options.nodes.contains(&node);
        is_reported.then(|| self.health.nodes.entry(node).or_default())
    }

    fn count_entries(&mut self) {
        for entry in std::mem::take(&mut self.entries) {
            if let Some(tally) = entry.node.and_then(|node| self.tally(node)) {
                tally.count(&entry);
            }
        }
    }

    /// Starts the next read: first the heartbeat time of each node, then the device type again and again.
    fn start_read(&mut self, master: &mut Master<'_>) {
        let nodes = &self.options.nodes;
        let now = master.now();
        let Some(&node) = nodes.get(self.reads % nodes.len().max(1)) else {
            self.next_read = Mono::at(Duration::MAX);
            return;
        };
        let object = if self.reads < nodes.len() { HEARTBEAT_TIME } else { ObjectId::DEVICE_TYPE };
        self.reads += 1;
        self.next_read = now + self.read_interval;
        if self.pending.iter().any(|(_, of)| *of == node) {
            return;
        }
        self.pending.push((master.start(Request::read(node, object).once()), node));
        // The bus does not return frames of this program, so the request is counted here.
        let at = master.bus().now();
        self.on_frame(&Received { frame: Upload::new(node, object, false).request(), at });
    }

    fn finish(&mut self, now: Mono) {
        self.interpreter.finish(&mut self.entries);
        self.count_entries();
        self.health.length = now.since(self.start);
        self.health.load.finish(now);
        self.health.nodes.values_mut().for_each(|tally| tally.finish(now));
    }
}

impl Waiter for HealthObserver<'_> {
    type Output = ();
    type Error = Failure;

    fn until(&self) -> Until {
        let next = self.interpreter.next_deadline().map_or(self.end, |next| next.min(self.end));
        Until::Deadline(next.min(self.next_read))
    }

    fn on_event(&mut self, master: &mut Master<'_>, event: MasterEvent) -> Result<ControlFlow<()>, Failure> {
        match event {
            MasterEvent::Frame(received) => self.on_frame(&received),
            MasterEvent::Fault(fault, _) => match self.health.faults.iter_mut().find(|(known, _)| *known == fault) {
                Some((_, count)) => *count += 1,
                None => self.health.faults.push((fault, 1)),
            },
            MasterEvent::Dropped(count) => self.health.dropped += u64::from(count),
            MasterEvent::Interrupted if self.health.frames.is_empty() => return Err(Error::Interrupted.into()),
            MasterEvent::Interrupted => {
                self.finish(master.now());
                return Ok(ControlFlow::Break(()));
            }
            MasterEvent::Ended => {
                self.finish(self.last);
                return Ok(ControlFlow::Break(()));
            }
            MasterEvent::Deadline => {
                let now = master.now();
                self.interpreter.expire(now, &mut self.entries);
                self.count_entries();
                if now >= self.end {
                    self.finish(self.end);
                    return Ok(ControlFlow::Break(()));
                }
                if now >= self.next_read {
                    self.start_read(master);
                }
            }
            MasterEvent::Sdo(ticket, _) => self.pending.retain(|(own, _)| *own != ticket),
            MasterEvent::Link(_) => {}
        }
        Ok(ControlFlow::Continue(()))
    }
}
