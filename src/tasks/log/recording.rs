//! Converts received frames to samples, and passes them to the observer.

mod due;
mod emergencies;
mod incidents;
mod liveness;
mod repetitions;
mod report;
mod run;
mod tally;

use super::passive::SetupListener;
use super::poll::Poll;
use super::rereads::Rereads;
use super::silence::Questions;
use super::states::NmtStates;
use super::{LogEvent, LogFailure, LogOptions, Mode, Observer, Remark};
use crate::bus::{Bus, Fault, Filters, Mono, ReceiveBuffer, Received, TimestampSource};
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::pdo::Transmission;
use crate::master::{Answer, Error, Master, SdoError, SdoFailure, Ticket};
use crate::measure::decode::{Decoded, Decoder};
use crate::measure::layout::Tpdo;
use crate::measure::sample::{Doubt, Sample};
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::diagnosis::ObservedFrames;
use crate::tasks::synced::SyncedTpdos;
use due::DueTpdos;
use emergencies::Emergencies;
use liveness::Liveness;
use repetitions::Repetitions;
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;
use tally::Tally;

/// A signal without values is reported only if the recording is at least this long.
const MIN_SIGNAL_TIME: Duration = Duration::from_secs(1);

/// The longest time for which values are kept if another node sends SYNC. Values must be written within a second.
const FOREIGN_SECOND_SENDER_TIMEOUT: Duration = Duration::from_millis(900);

/// A recording: the setup of the nodes, and the values.
pub(super) struct Recording<'o> {
    pub(super) options: &'o LogOptions,
    pub(super) nodes: Vec<Node>,
    pub(super) decoder: Decoder,
    pub(super) poll: Option<Poll>,
    pub(super) states: NmtStates,
    pub(super) listener: Option<SetupListener>,
    tally: Tally,
    liveness: Liveness,
    emergencies: Emergencies,
    /// The faults that were reported a short time ago.
    faults: Repetitions<Fault>,
    due: DueTpdos,
    synced: SyncedTpdos,
    /// Nodes whose node-ID or COB-ID is used by two devices. Their TPDOs are ignored.
    pub(super) two_devices: BTreeMap<NodeId, Failure>,
    /// The values of the first SYNC. They are kept until it is known that no second device answers.
    early: Vec<Vec<Sample>>,
    early_until: Option<Mono>,
    /// Whether values were kept because another node sends SYNC.
    has_kept_early: bool,
    rereads: Rereads,
    timestamps: TimestampSource,
    receive_buffer: Option<ReceiveBuffer>,
    pub(super) link_is_up: bool,
    /// The interface; `None` for a recording that is replayed.
    pub(super) interface: Option<String>,
    /// Whether any frame was received.
    pub(super) has_traffic: bool,
    /// For each COB-ID: the number of SYNC messages of other nodes, and the length of the last message.
    pub(super) syncs_received: BTreeMap<CanId, (u64, usize)>,
    /// Whether frames with all COB-IDs are received.
    receives_all: bool,
    /// COB-IDs of frames that may be TPDOs of silent nodes.
    pub(super) unknown_cob_ids: BTreeSet<CanId>,
    /// Nodes that were replaced by other devices.
    replaced: BTreeSet<NodeId>,
    pub(super) questions: Questions,
    started: Mono,
    /// Nodes whose TPDOs were reported to have a wrong length.
    wrong_length_reported: BTreeSet<NodeId>,
    /// Nodes whose heartbeats were reported to have a wrong length.
    heartbeat_length_reported: BTreeSet<NodeId>,
    /// The last messages of each node.
    pub(super) observed: BTreeMap<NodeId, ObservedFrames>,
    pub(super) remarks: Vec<Remark>,
    /// The reported doubts about sources.
    doubts: BTreeSet<(usize, Doubt)>,
    interrupted: bool,
    /// The samples of the current frame. Kept to avoid allocations.
    samples: Vec<Sample>,
}

impl<'o> Recording<'o> {
    pub(super) fn new(nodes: Vec<Node>, options: &'o LogOptions, bus: &dyn Bus) -> Recording<'o> {
        // A passive recording does not know its nodes yet. It expects the nodes that the user named.
        let is_passive = options.mode == Mode::Passive && options.nodes.len() < NodeId::all().count();
        let named = options.nodes.iter().copied().filter(|_| is_passive);
        let expected: Vec<NodeId> = nodes.iter().map(|node| node.id).chain(named).collect();
        let mut emergencies = Emergencies::default();
        nodes.iter().for_each(|node| emergencies.watch(node));
        Recording {
            options,
            nodes,
            decoder: Decoder::default(),
            poll: None,
            states: NmtStates::default(),
            listener: None,
            tally: Tally::new(),
            liveness: Liveness::new(expected.into_iter()),
            emergencies,
            faults: Repetitions::default(),
            due: DueTpdos::default(),
            synced: SyncedTpdos::new(matches!(options.mode, Mode::Sync(_)), matches!(options.mode, Mode::Request(_))),
            two_devices: BTreeMap::new(),
            early: Vec::new(),
            early_until: None,
            has_kept_early: false,
            rereads: Rereads::new(&options.overrides),
            timestamps: bus.timestamps(),
            receive_buffer: bus.receive_buffer(),
            link_is_up: true,
            interface: bus.is_live().then(|| bus.name().to_owned()),
            has_traffic: false,
            syncs_received: BTreeMap::new(),
            receives_all: false,
            unknown_cob_ids: BTreeSet::new(),
            replaced: BTreeSet::new(),
            questions: Questions::default(),
            started: bus.mono(),
            wrong_length_reported: BTreeSet::new(),
            heartbeat_length_reported: BTreeSet::new(),
            observed: BTreeMap::new(),
            remarks: Vec::new(),
            doubts: BTreeSet::new(),
            interrupted: false,
            samples: Vec::new(),
        }
    }

    /// Returns the TPDOs whose values are recorded.
    fn recorded_tpdos(&self) -> impl Iterator<Item = (&Node, &Tpdo)> {
        let tpdos = self.nodes.iter().flat_map(|node| node.tpdos.iter().map(move |tpdo| (node, tpdo)));
        tpdos.filter(|(_, tpdo)| tpdo.cob_id.is_valid() && self.decoder.values_of(tpdo.cob_id.can_id()) > 0)
    }

    /// Returns the interval at which this program sends SYNC; `None` if it sends no SYNC. Requests of type 252 need
    /// SYNC.
    pub(super) fn sync_interval(&self) -> Option<Duration> {
        let mut kinds = self.recorded_tpdos().map(|(_, tpdo)| tpdo.transmission);
        match self.options.mode {
            Mode::Sync(interval) => Some(interval),
            Mode::Request(interval) if kinds.any(|kind| kind == Some(Transmission::Rtr(252))) => Some(interval),
            _ => None,
        }
    }

    /// Fails if a requested TPDO does not answer remote requests (bit 30 of its COB-ID).
    pub(super) fn refuse_without_rtr(&self) -> Result<(), Failure> {
        let mut without = self.recorded_tpdos().filter(|(_, tpdo)| !tpdo.cob_id.allows_rtr());
        match (self.options.mode, without.next()) {
            (Mode::Request(_), Some((node, tpdo))) => {
                Err(Failure::at(node.id, LogFailure::NoRtr { number: tpdo.number }))
            }
            _ => Ok(()),
        }
    }

    /// Returns the number of SYNC messages that this program sent.
    pub(super) fn syncs(&self) -> u64 {
        self.tally.syncs.sent
    }

    /// Returns the number of values recorded so far.
    pub(super) fn rows(&self) -> u64 {
        self.tally.rows
    }

    /// Returns the number of values of a source recorded so far.
    pub(super) fn count(&self, source: usize) -> u64 {
        self.tally.count(source)
    }

    /// Whether values of this node are expected.
    pub(super) fn is_expected(&self, node: NodeId) -> bool {
        self.liveness.has(node)
    }

    /// Whether this node sent at least one value.
    pub(super) fn has_sent(&self, node: NodeId) -> bool {
        self.liveness.has_sent(node)
    }

    /// Whether the setup of this node may have changed.
    pub(super) fn is_paused(&self, node: NodeId) -> bool {
        self.rereads.paused().any(|paused| paused == node)
    }

    /// Returns the time since the start of the recording.
    pub(super) fn waited(&self) -> Duration {
        self.tally.end().since(self.started)
    }

    /// Whether the recording was too short to judge single signals.
    pub(super) fn is_short(&self) -> bool {
        self.waited() < MIN_SIGNAL_TIME
    }

    /// Whether the user ended the recording.
    pub(super) fn is_interrupted(&self) -> bool {
        self.interrupted
    }

    /// Records that the user ended the recording.
    pub(super) fn set_interrupted(&mut self) {
        self.interrupted = true;
    }

    /// Expects no samples from nodes without any of the requested signals. At least one node has such signals.
    pub(super) fn ignore_nodes_without_signals(&mut self) {
        let nodes = self.liveness.nodes().collect();
        self.ignore_without_signals(nodes);
    }

    /// Expects no samples from `nodes` without any of the requested signals, if another node has such a signal.
    fn ignore_without_signals(&mut self, nodes: Vec<NodeId>) {
        let sources = self.decoder.sources();
        if self.options.wanted.is_empty() || sources.is_empty() {
            return;
        }
        let has_none = |node: &NodeId| sources.iter().all(|source| source.node != *node);
        let without: Vec<NodeId> = nodes.into_iter().filter(has_none).collect();
        for node in without {
            self.liveness.remove(node);
            self.remarks.push(Remark::NoRequestedSignal(node));
        }
    }

    /// Records the emergencies of nodes that are not surveyed.
    pub(super) fn watch_emergencies(&mut self, nodes: impl Iterator<Item = Node>) {
        nodes.for_each(|node| self.emergencies.watch(&node));
    }

    /// Watches the TPDOs on SYNC of nodes that are not surveyed.
    pub(super) fn watch_syncs(&mut self, nodes: impl Iterator<Item = Node>) {
        nodes.for_each(|node| self.synced.set_up(&node));
    }

    /// Adds statistics for all known sources.
    pub(super) fn update_sources(&mut self) {
        self.tally.set_sources(self.decoder.sources());
    }

    /// Returns the filters for TPDOs, emergencies, heartbeats and SDO messages of the recorded nodes, and for SYNC and
    /// NMT.
    pub(super) fn filters(&self) -> Filters {
        let mut ids: Vec<CanId> = self.decoder.can_ids().chain([CanId::NMT]).collect();
        for node in &self.nodes {
            let id = node.id;
            ids.extend([node.emergency, node.sync, CanId::heartbeat(id)]);
            ids.extend([CanId::sdo_response(id), CanId::sdo_request(id)]);
        }
        ids.sort_unstable();
        ids.dedup();
        Filters::Only(ids)
    }

    /// Handles a frame.
    fn on_frame(
        &mut self,
        received: &Received,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> ControlFlow<()> {
        self.tally.extend_to(received.at.mono);
        self.samples.clear();
        self.due.on_frame(&received.frame);
        self.has_traffic = true;
        if let Some(listener) = &mut self.listener {
            if let Some(node) = listener.on_frame(received, &mut self.decoder) {
                let node = listener.known_node(node);
                self.emergencies.learn(&node);
                self.synced.set_up(&node);
                self.report_shared_cob_ids(received.at, observer);
                self.update_sources();
            }
            let second = self.listener.as_mut().and_then(SetupListener::next_second_answer);
            if let Some((node, object, answers)) = second {
                self.on_second_answer(node, object, answers, received.at, observer)?;
            }
        }
        let decoded = self.decoder.decode(received, &mut self.samples);
        if matches!(decoded, Decoded::Tpdo(_) | Decoded::OtherFrame)
            && let Some(surplus) = self.synced.on_frame(&received.frame, received.at.mono)
        {
            return self.on_surplus(surplus, received.at, observer);
        }
        self.keep_early(&received.frame, decoded, received.at.mono, observer)?;
        match decoded {
            Decoded::Tpdo(_) if self.early_until.is_some_and(|until| received.at.mono < until) => {
                self.early.push(std::mem::take(&mut self.samples));
            }
            Decoded::Tpdo(_) => {
                let samples = std::mem::take(&mut self.samples);
                self.pass_early(observer)?;
                self.samples = samples;
                return self.pass_samples(None, observer);
            }
            Decoded::Paused(node) => self.on_paused_tpdo(node, received.at.mono),
            Decoded::WrongLength(node) => self.on_wrong_length(node, received.at, master, observer),
            Decoded::OtherFrame => self.on_other_frame(received, master, observer),
        }
        ControlFlow::Continue(())
    }

    /// Handles the result of an SDO transfer, which belongs to a reread, an inquiry or a poll.
    fn on_answer(
        &mut self,
        ticket: Ticket,
        result: Result<Answer, SdoError>,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<ControlFlow<()>, Error> {
        if self.rereads.has(ticket) {
            self.read_again(ticket, &result, master, observer)?;
            return Ok(ControlFlow::Continue(()));
        }
        if self.questions.open.as_ref().is_some_and(|open| open.has(ticket)) {
            self.on_finding(ticket, &result, master, observer);
            return Ok(ControlFlow::Continue(()));
        }
        let Some(poll) = &mut self.poll else { return Ok(ControlFlow::Continue(())) };
        self.samples.clear();
        let cycle = poll.cycle_of(ticket);
        if let Some(error) = poll.on_answer(ticket, result, &self.decoder, &mut self.samples) {
            observer.event(&LogEvent::Remark(Remark::PollFailed(error.clone())), master.bus().now());
            if matches!(error.failure, SdoFailure::TwoDevices(Some(_))) {
                return Ok(self.exclude(error.node, error.into()));
            }
        }
        Ok(self.pass_samples(cycle, observer))
    }

    /// If another node may send SYNC, keeps the first values until enough SYNC messages were received to detect a
    /// second device.
    fn keep_early(
        &mut self,
        frame: &Frame,
        decoded: Decoded,
        now: Mono,
        observer: &mut dyn Observer,
    ) -> ControlFlow<()> {
        if matches!(decoded, Decoded::Tpdo(_)) && !self.has_kept_early && self.synced.may_have_second_sender(frame.id())
        {
            self.has_kept_early = true;
            self.early_until = Some(now + FOREIGN_SECOND_SENDER_TIMEOUT);
        } else if self.has_kept_early && self.early_until.is_some() && self.synced.is_decided() {
            let samples = std::mem::take(&mut self.samples);
            self.pass_early(observer)?;
            self.samples = samples;
        }
        ControlFlow::Continue(())
    }

    /// Passes the values of the first SYNC to the observer.
    fn pass_early(&mut self, observer: &mut dyn Observer) -> ControlFlow<()> {
        if self.early_until.take().is_none() {
            return ControlFlow::Continue(());
        }
        for samples in std::mem::take(&mut self.early) {
            self.samples = samples;
            self.pass_samples(None, observer)?;
        }
        ControlFlow::Continue(())
    }

    /// Counts the samples and passes them to the observer. `cycle` is the cycle of their poll.
    fn pass_samples(&mut self, cycle: Option<u64>, observer: &mut dyn Observer) -> ControlFlow<()> {
        if let Some(count) = self.options.count {
            let left = usize::try_from(count - self.tally.rows).unwrap_or(usize::MAX);
            self.samples.truncate(left);
        }
        let Some(last) = self.samples.last() else { return ControlFlow::Continue(()) };
        let at = last.at;
        let sources = self.decoder.sources();
        let node = sources[last.source].node;
        for sample in &self.samples {
            if let Some(doubt) = sample.doubt
                && self.doubts.insert((sample.source, doubt))
            {
                let source = &sources[sample.source];
                let remark = Remark::Doubt(source.node, source.signal.to_string(), doubt);
                observer.event(&LogEvent::Remark(remark.clone()), at);
                self.remarks.push(remark);
            }
        }
        if let Some(gap) = self.tally.add(&self.samples, self.options.max_gap) {
            observer.event(&LogEvent::Gap(node, gap), at);
        }
        if self.liveness.on_samples(node, at.mono) {
            observer.event(&LogEvent::Back(node), at);
        }
        match cycle {
            Some(cycle) => observer.polled(cycle, &self.samples, sources)?,
            None => observer.samples(&self.samples, sources)?,
        }
        match self.options.count {
            Some(count) if self.tally.rows >= count => {
                self.tally.end_at(at.mono);
                ControlFlow::Break(())
            }
            _ => ControlFlow::Continue(()),
        }
    }
}
