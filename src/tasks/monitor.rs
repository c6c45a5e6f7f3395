//! Shows all traffic on the bus, live or from a recording. Nothing is sent.

mod entry;
mod interpreter;
#[cfg(test)]
mod tests;

pub use entry::{Content, Entry, FrameKind, LssMessage, SdoMessage};
pub use interpreter::Interpreter;

use crate::bus::Mono;
use crate::canopen::id::{CanId, NodeId};
use crate::master::{Master, MasterEvent};
use crate::node::Overrides;
use crate::node::overheard::Overheard;
use crate::node::wait::{Policy, Until, Waiter, run, wait};
use crate::tasks::Failure;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// What is shown, and for how long.
#[derive(Clone, Debug, Default)]
pub struct MonitorOptions {
    /// The nodes to show; empty for all nodes. Messages that do not belong to one node are also shown.
    pub nodes: BTreeSet<NodeId>,
    /// The kinds of messages to show; empty for all.
    pub kinds: BTreeSet<FrameKind>,
    /// Whether repetitions are shown: heartbeats without a change, and error frames that repeat the last error frame.
    pub all: bool,
    /// The monitor ends after this time.
    pub duration: Option<Duration>,
    /// The monitor ends after this number of messages.
    pub count: Option<u64>,
    /// Descriptions chosen by the user.
    pub overrides: Overrides,
    /// Descriptions of the devices in a recording: see [`identify`].
    pub recognised: Overrides,
}

/// The totals at the end.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct MonitorReport {
    /// How long the bus was observed.
    pub length: Duration,
    /// The number of received frames of each kind, shown or not.
    pub frames: BTreeMap<FrameKind, u64>,
    /// Messages that were not shown because they repeat an earlier message.
    pub repeated: u64,
    /// COB-IDs of TPDOs whose mapping is unknown, and their nodes.
    pub not_decoded: BTreeMap<CanId, NodeId>,
    /// The services that other masters used.
    pub masters: BTreeSet<FrameKind>,
}

/// Returns the descriptions of the devices whose identity is read in a recording. With them, the names and types of
/// objects are known from the first frame on.
///
/// # Errors
/// The recording cannot be read.
pub fn identify(master: &mut Master<'_>) -> Result<Overrides, Failure> {
    let mut overheard = Overheard::default();
    wait(master, Mono::at(Duration::MAX), Policy::Record, |_, event| {
        if let MasterEvent::Frame(received) = event {
            overheard.take(&received);
        }
        ControlFlow::<()>::Continue(())
    })?;
    Ok(NodeId::all().filter_map(|node| Some((node, overheard.recognise(node)?))).collect())
}

/// Shows the traffic until the time or the number of messages is reached, the recording ends, the user presses Ctrl-C,
/// or `on_entry` breaks.
///
/// # Errors
/// Bus errors.
pub fn monitor(
    master: &mut Master<'_>,
    options: &MonitorOptions,
    on_entry: &mut dyn FnMut(&Entry) -> ControlFlow<()>,
) -> Result<MonitorReport, Failure> {
    let start = master.now();
    let end = options.duration.map_or(Mono::at(Duration::MAX), |duration| start + duration);
    let interpreter = Interpreter::new(&options.overrides, options.recognised.clone());
    let report = MonitorReport::default();
    let mut watcher = Watcher { options, interpreter, report, entries: Vec::new(), shown: 0, end, on_entry };
    run(master, Policy::Record, &mut watcher)?;
    watcher.report.length = master.now().since(start);
    watcher.report.not_decoded = watcher.interpreter.not_decoded();
    Ok(watcher.report)
}

struct Watcher<'a> {
    options: &'a MonitorOptions,
    interpreter: Interpreter,
    report: MonitorReport,
    entries: Vec<Entry>,
    shown: u64,
    end: Mono,
    on_entry: &'a mut dyn FnMut(&Entry) -> ControlFlow<()>,
}

impl Watcher<'_> {
    /// Shows the messages that are complete.
    fn show(&mut self) -> ControlFlow<()> {
        let options = self.options;
        for entry in std::mem::take(&mut self.entries) {
            let is_of_node = entry.node.is_none_or(|node| options.nodes.is_empty() || options.nodes.contains(&node));
            if !is_of_node || !options.kinds.is_empty() && !options.kinds.contains(&entry.kind) {
                continue;
            }
            if entry.is_repeated && !options.all {
                self.report.repeated += 1;
                continue;
            }
            self.shown += 1;
            (self.on_entry)(&entry)?;
            if Some(self.shown) == options.count {
                return ControlFlow::Break(());
            }
        }
        ControlFlow::Continue(())
    }
}

impl Waiter for Watcher<'_> {
    type Output = ();
    type Error = Failure;

    fn until(&self) -> Until {
        Until::Deadline(self.interpreter.next_deadline().map_or(self.end, |next| next.min(self.end)))
    }

    fn on_event(&mut self, master: &mut Master<'_>, event: MasterEvent) -> Result<ControlFlow<()>, Failure> {
        let now = master.bus().now();
        let entries = &mut self.entries;
        let mut is_over = false;
        match event {
            MasterEvent::Frame(received) => {
                let kind = self.interpreter.take(&received, entries);
                *self.report.frames.entry(kind).or_default() += 1;
                if kind.is_of_master(&received.frame) {
                    self.report.masters.insert(kind);
                }
            }
            MasterEvent::Fault(fault, at) => self.interpreter.fault(fault, at, entries),
            MasterEvent::Dropped(count) => entries.push(Entry::of_bus(now, Content::Dropped(count))),
            MasterEvent::Link(is_up) => entries.push(Entry::of_bus(now, Content::Link(is_up))),
            MasterEvent::Deadline => {
                self.interpreter.expire(now.mono, entries);
                is_over = now.mono >= self.end;
            }
            MasterEvent::Interrupted | MasterEvent::Ended => is_over = true,
            MasterEvent::Sdo(..) => {}
        }
        if is_over {
            self.interpreter.finish(entries);
        }
        let shown = self.show();
        Ok(if is_over { ControlFlow::Break(()) } else { shown })
    }
}
