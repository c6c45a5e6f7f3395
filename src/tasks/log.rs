//! Records measurements: TPDOs as they are sent, on SYNC, or values polled by SDO.
//!
//! What is recorded goes to an [`Observer`]; nothing is printed or written here. What the recording
//! switched on the way is put back at its end, on every way out.

mod changes;
mod checks;
mod events;
mod hearts;
mod passive;
mod poll;
mod producer;
mod recording;
mod renewal;
mod rhythm;
mod silence;
mod states;

use crate::bus::{Fault, Filters, ReceiveBuffer, Stamp, TimestampSource};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::master::{Error, Master};
use crate::measure::decode::Wanted;
use crate::measure::expression::judge::Jury;
use crate::measure::sample::{Sample, Source};
use crate::measure::statistics::Statistics;
use crate::node::Node;
use crate::node::Overrides;
use crate::node::survey::survey_nodes;
use crate::tasks::Failure;
use checks::{check_wanted, refuse_second_sync, sync_share};
pub use events::Events;
use passive::Learner;
use poll::Poll;
pub use producer::Syncs;
use recording::Recording;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// What is to be recorded, and how.
#[derive(Clone, Debug)]
pub struct Plan {
    /// Of which nodes.
    pub nodes: Vec<NodeId>,
    /// Which signals; none means all.
    pub wanted: Vec<Wanted>,
    /// How the values come.
    pub mode: Mode,
    /// For how long.
    pub duration: Option<Duration>,
    /// At most this many rows.
    pub count: Option<u64>,
    /// Whether NMT may be used.
    pub nmt: bool,
    /// The longest interval that is no gap; three usual ones where nothing is said.
    pub max_gap: Option<Duration>,
    /// Descriptions named by the user.
    pub overrides: Overrides,
}

/// How the values come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// As the devices send them.
    AsSent,
    /// With SYNC produced here, at this interval.
    Sync(Duration),
    /// Read by SDO, at this interval.
    Poll(Duration),
    /// Sending nothing at all.
    Passive,
}

/// What happens on the way.
#[derive(Clone, Debug, PartialEq)]
pub enum Note {
    /// Something to say that concerns no node.
    Remark(String),
    /// A node sent an emergency message, which means this.
    Emergency(NodeId, Emergency, String),
    /// SYNC at this interval and what comes in answer take this share of the bus.
    Share(Duration, f64),
    /// A node restarted.
    Restarted(NodeId),
    /// A node was read again, and this has changed; nothing where it is set up as before. From here on its
    /// measurements are read by what it is now.
    ReadAgain(NodeId, Vec<String>),
    /// A node should be read again and could not; it is tried on. What it sends meanwhile is not recorded.
    Unreadable(NodeId, String),
    /// The heartbeat of a node has stopped for so long.
    HeartbeatLost(NodeId, Duration),
    /// The heartbeat of a node is back.
    HeartbeatBack(NodeId),
    /// The heartbeat of a node tells that it is not operational any more.
    State(NodeId, NmtState),
    /// Something of the node came after an interval longer than [`Plan::max_gap`].
    Gap(NodeId, Duration),
    /// Nothing has come from the node for a while.
    Silent(NodeId, Duration),
    /// The node is back.
    Back(NodeId),
    /// A TPDO has not the length of its mapping.
    WrongLength(NodeId),
    /// The controller reports trouble.
    Fault(Fault),
    /// The kernel holds back so much of what is received.
    Buffer(ReceiveBuffer),
    /// The kernel dropped frames.
    Dropped(u32),
    /// The interface went down or came back.
    Link(bool),
}

/// Takes what is recorded. Breaking ends the recording; the reason is the observer's own.
pub trait Observer {
    /// These nodes will be recorded; nothing has been switched yet. Who only listens knows of none.
    ///
    /// # Errors
    /// Why nothing is to be recorded.
    fn begin(&mut self, _instruments: &[Node]) -> Result<(), Failure> {
        Ok(())
    }

    /// What will be recorded, in the order of the sources' numbers; more may come later. Nothing has been
    /// switched yet. Who only listens is not told.
    ///
    /// # Errors
    /// Why nothing is to be recorded.
    fn sources(&mut self, _sources: &[Source]) -> Result<(), Failure> {
        Ok(())
    }

    /// The cycle `number` of SYNC or polling begins at `at`. Numbers may be left out.
    fn cycle(&mut self, _number: u64, _at: Stamp) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }

    /// Samples of requests that were begun in this cycle; it need not be the last one.
    fn polled(&mut self, _cycle: u64, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.samples(samples, sources)
    }

    /// Samples that came together, in the order of their bytes; at most as many as may be counted.
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()>;

    /// Something happened.
    fn note(&mut self, note: &Note, at: Stamp);

    /// How things stand with what is expected of the measurements, as often as time passes.
    fn standing(&mut self, _jury: &Jury, _at: Stamp) {}

    /// Time passes: called at least ten times a second while nothing comes.
    fn tick(&mut self, at: Stamp, rows: u64) -> ControlFlow<()>;
}

/// How a recording ended.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// Rows recorded.
    pub rows: u64,
    /// From the first row to the end.
    pub length: Duration,
    /// What each source gave.
    pub statistics: Vec<(Source, Statistics)>,
    /// Nodes that gave nothing, or nothing any more, at the end.
    pub lost: Vec<NodeId>,
    /// Why nothing came, if nothing came.
    pub nothing: Option<Failure>,
    /// Frames that the kernel had to drop.
    pub dropped: u64,
    /// Emergency messages.
    pub emergencies: u64,
    /// Intervals longer than [`Plan::max_gap`].
    pub gaps: u64,
    /// Polls that could not be sent because the one before was not finished.
    pub skipped: u64,
    /// What else happened.
    pub events: Events,
    /// SYNC messages sent.
    pub syncs: Syncs,
    /// How much of what was received the kernel could hold back, where that is known.
    pub receive_buffer: Option<ReceiveBuffer>,
    /// Where the time stamps come from.
    pub timestamps: TimestampSource,
    /// What was switched and not put back, in words.
    pub remarks: Vec<String>,
    /// Whether the user ended it.
    pub interrupted: bool,
}

/// When nothing comes for this long after the start, it is said why.
const PATIENCE: Duration = Duration::from_secs(5);

/// How often time is told to the observer when nothing comes.
const TICK: Duration = Duration::from_millis(100);

/// Records.
///
/// # Errors
/// What stops it before the first row; from then on every end is an [`Outcome`].
pub fn log(master: &mut Master<'_>, plan: &Plan, observer: &mut dyn Observer) -> Result<Outcome, Failure> {
    if plan.mode == Mode::Passive {
        return record_passively(master, plan, observer);
    }
    master.listen_to(&plan.nodes)?;
    let instruments = survey_nodes(master, &plan.nodes, &plan.overrides)?;
    observer.begin(&instruments)?;
    check_wanted(&instruments, plan)?;
    let mut recording = Recording::new(instruments, plan, master.bus());
    match plan.mode {
        Mode::Poll(period) => {
            let poll = Poll::new(&recording.instruments, &plan.wanted, &mut recording.decoder, period)?;
            recording.poll = Some(poll);
        }
        _ => {
            recording.instruments.iter().for_each(|instrument| recording.decoder.add(instrument.layout(), &plan.wanted))
        }
    }
    recording.expect_sources();
    recording.excuse(plan);
    observer.sources(recording.decoder.sources())?;
    // Between the reading and the recording, too, nodes restart.
    let mut restarted = BTreeSet::new();
    recording.tell_contested(master.bus().now(), observer);
    master.listen(&recording.filters())?;
    if let Mode::Sync(period) = plan.mode {
        refuse_second_sync(master, &recording.instruments, period, &mut restarted)?;
        if let Some(share) = sync_share(master, &recording.instruments, period) {
            observer.note(&Note::Share(period, share), master.bus().now());
        }
    }
    let started = recording.states.start(master, &recording.instruments, plan, &mut restarted);
    let result = started.and_then(|()| {
        master.ride_out(true);
        recording.doubt_restarted(&restarted, master, observer);
        recording.run(master, plan, observer)
    });
    master.ride_out(false);
    let restored = recording.states.restore(master);
    recording.remarks.extend(recording.states.remarks());
    match result {
        Ok(()) => {}
        Err(Error::Interrupted) if recording.rows > 0 => recording.interrupted = true,
        Err(error) => return Err(error.into()),
    }
    if let Err(error) = restored {
        recording.remarks.push(format!("the nodes' states were not put back: {error}"));
    }
    Ok(recording.outcome(plan))
}

fn record_passively(master: &mut Master<'_>, plan: &Plan, observer: &mut dyn Observer) -> Result<Outcome, Failure> {
    let mut recording = Recording::new(Vec::new(), plan, master.bus());
    let mut learner = Learner::new(&plan.nodes, &plan.overrides, &plan.wanted);
    learner.begin(&mut recording.decoder);
    recording.learner = Some(learner);
    recording.expect_sources();
    master.listen(&Filters::All)?;
    match recording.run(master, plan, observer) {
        Ok(()) => {}
        Err(Error::Interrupted) if recording.rows > 0 => recording.interrupted = true,
        Err(error) => return Err(error.into()),
    }
    Ok(recording.outcome(plan))
}

/// `period` times `n`, to the nanosecond, for as many as there may be.
fn nth(period: Duration, n: u64) -> Duration {
    let nanoseconds = period.as_nanos().saturating_mul(u128::from(n));
    Duration::from_nanos(u64::try_from(nanoseconds).unwrap_or(u64::MAX))
}
