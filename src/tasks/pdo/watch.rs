//! Receives and decodes TPDOs.

use super::failure::PdoFailure;
use crate::bus::{BusError, Filters, Mono, Received, Stamp};
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::ErrorControlMessage;
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::TpdoNumber;
use crate::master::{Answer, Error, Master, MasterEvent, Operation, SdoError, SdoFailure, Ticket};
use crate::measure::decode::{Decoded, Decoder};
use crate::measure::layout::Tpdo;
use crate::measure::sample::{Sample, Source};
use crate::node::survey::{BackgroundSurvey, SETUP_TIMEOUT, survey_each};
use crate::node::wait::{Policy, Until, Waiter, run};
use crate::node::{Node, Overrides};
use crate::tasks::Failure;
use crate::tasks::diagnosis::{Findings, Inquiry, ObservedFrames, RequestContext, Silence, diagnose, objects_to_read};
use crate::tasks::log::{LogFailure, SetupListener, changes, compare_values, is_constant};
use crate::tasks::synced::{Surplus, SyncedTpdos};
use std::collections::{BTreeMap, BTreeSet};
use std::ops::ControlFlow;
use std::time::Duration;

/// If no TPDO is received within this time, the reasons are reported once.
const FIRST_TPDO_TIMEOUT: Duration = Duration::from_secs(5);

/// The tolerated delay of a heartbeat, in addition to twice its interval.
const HEARTBEAT_TOLERANCE: Duration = Duration::from_millis(50);

/// An event while TPDOs are received.
#[derive(Clone, Copy, Debug)]
pub enum WatchEvent<'a> {
    /// A TPDO, decoded.
    Tpdo {
        /// When it was received.
        at: Stamp,
        /// The node that sent it.
        node: NodeId,
        /// The TPDO.
        number: TpdoNumber,
        /// Its values, in the order of its bytes.
        samples: &'a [Sample],
        /// The sources of the decoder: each sample contains the number of its source.
        sources: &'a [Source],
    },
    /// A TPDO has a length different from its mapping. Reported once.
    WrongLength {
        /// The node that sent it.
        node: NodeId,
        /// The TPDO.
        number: TpdoNumber,
        /// The length of its mapping in bytes.
        mapped: usize,
        /// Its length in bytes.
        length: usize,
        /// Whether its mapped bytes are shown. They are ignored otherwise.
        is_used: bool,
    },
    /// At the end: the number of TPDOs of a node with a wrong length.
    WrongLengths(NodeId, u64),
    /// A node restarted, so its mapping may have changed.
    Restarted(NodeId),
    /// The mapping of a node could not be read, so its TPDOs are not shown.
    Failed(&'a Failure),
    /// A TPDO arrives twice at a SYNC, with the same values.
    Repeated(NodeId, TpdoNumber),
    /// No TPDO was received so far, for these reasons.
    NothingYet(&'a [(NodeId, Silence)]),
}

/// Shows the TPDOs of the nodes until the time has passed, or until Ctrl-C or `on_event` ends it. Sends no NMT command.
/// Returns the failures of the nodes whose mapping could not be read; the other nodes are shown. For a replayed
/// recording, the mapping comes from its SDO traffic, or from a description named by the user.
///
/// # Errors
/// [`PdoFailure::NothingReceived`]; bus errors, and Ctrl-C before the first TPDO.
pub fn watch(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    overrides: &Overrides,
    duration: Option<Duration>,
    on_event: &mut dyn FnMut(&WatchEvent<'_>) -> ControlFlow<()>,
) -> Result<Vec<Failure>, Failure> {
    let end_after = |start: Mono| duration.map_or(Mono::at(Duration::MAX), |duration| start + duration);
    if !master.bus().is_live() {
        let setup = SetupListener::new(nodes, overrides, &[]);
        let mut watcher = {
            let (nodes, start) = (nodes.iter().map(|&node| Node::new(node)).collect(), master.now());
            Watcher::new(nodes, start, end_after(start), on_event)
        };
        watcher.learn(setup, overrides);
        run(master, Policy::Record, &mut watcher)?;
        watcher.report_wrong_lengths();
        return Ok(watcher.failures);
    }
    master.listen_to(nodes)?;
    let (mut surveyed, mut failures) = (Vec::new(), Vec::new());
    master.limit_transfers(duration.map(|duration| duration.saturating_add(SETUP_TIMEOUT)));
    let results = survey_each(master, nodes, overrides)?;
    master.limit_transfers(None);
    for result in results {
        match result {
            Ok(node) => match compare_values(master, &node)? {
                Ok(()) => surveyed.push(node),
                Err(error) => failures.push(error.into()),
            },
            Err(error) => failures.push(Failure::from(error)),
        }
    }
    if surveyed.is_empty() {
        return Ok(failures);
    }
    for failure in &failures {
        if on_event(&WatchEvent::Failed(failure)).is_break() {
            return Ok(failures);
        }
    }
    let start = master.now();
    let mut watcher = Watcher::new(surveyed, start, end_after(start), on_event);
    watcher.failures = failures;
    watcher.next = watcher.end.min(start + FIRST_TPDO_TIMEOUT);
    watcher.overrides = overrides.clone();
    for node in watcher.nodes.clone() {
        watcher.decoder.add(node.layout(), &[]);
        watcher.set_up(&node);
    }
    watcher.listen(master)?;
    run(master, Policy::Record, &mut watcher)?;
    watcher.report_wrong_lengths();
    Ok(watcher.failures)
}

struct Watcher<'a> {
    nodes: Vec<Node>,
    /// Reads the mappings from a recording.
    setup: Option<SetupListener>,
    decoder: Decoder,
    numbers: BTreeMap<CanId, TpdoNumber>,
    synced: SyncedTpdos,
    /// Other frames of the nodes, and the time of their last heartbeat.
    observed: BTreeMap<NodeId, (ObservedFrames, Mono)>,
    /// The reads from silent nodes.
    inquiry: Option<Inquiry>,
    overrides: Overrides,
    /// Nodes whose mapping is read again because of a TPDO that is longer; `None` after the end of the read.
    rereads: BTreeMap<NodeId, Option<BackgroundSurvey>>,
    /// TPDOs whose wrong length was reported, and whether they were used.
    reported: BTreeSet<(CanId, bool)>,
    /// TPDOs with a wrong length before the mapping of the node was read again.
    wrong_lengths: BTreeMap<NodeId, u64>,
    samples: Vec<Sample>,
    start: Mono,
    end: Mono,
    /// The end, or the time to report that no TPDO was received.
    next: Mono,
    has_received: bool,
    failures: Vec<Failure>,
    on_event: &'a mut dyn FnMut(&WatchEvent<'_>) -> ControlFlow<()>,
}

impl<'a> Watcher<'a> {
    fn new(
        nodes: Vec<Node>,
        start: Mono,
        end: Mono,
        on_event: &'a mut dyn FnMut(&WatchEvent<'_>) -> ControlFlow<()>,
    ) -> Watcher<'a> {
        Watcher {
            nodes,
            setup: None,
            decoder: Decoder::default(),
            numbers: BTreeMap::new(),
            synced: SyncedTpdos::default(),
            observed: BTreeMap::new(),
            inquiry: None,
            overrides: Overrides::default(),
            rereads: BTreeMap::new(),
            reported: BTreeSet::new(),
            wrong_lengths: BTreeMap::new(),
            samples: Vec::new(),
            start,
            end,
            next: end,
            has_received: false,
            failures: Vec::new(),
            on_event,
        }
    }

    /// Stores the TPDO numbers of a node by COB-ID.
    fn set_up(&mut self, node: &Node) {
        self.synced.set_up(node);
        let valid = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
        self.numbers.extend(valid.map(|tpdo| (tpdo.cob_id.can_id(), tpdo.number)));
    }

    /// Uses the descriptions that the user named, and from then on the mappings in the recording.
    fn learn(&mut self, mut setup: SetupListener, overrides: &Overrides) {
        setup.apply_overrides(&mut self.decoder);
        overrides.keys().for_each(|&node| self.set_up(&setup.known_node(node)));
        self.setup = Some(setup);
    }

    fn listen(&self, master: &mut Master<'_>) -> Result<(), Error> {
        let own = |node: &Node| [CanId::heartbeat(node.id), CanId::sdo_response(node.id), node.sync, node.emergency];
        let ids: BTreeSet<CanId> = self.numbers.keys().copied().chain(self.nodes.iter().flat_map(own)).collect();
        master.listen(&Filters::Only(ids.into_iter().collect()))
    }

    fn on_frame(&mut self, received: &Received, master: &mut Master<'_>) -> ControlFlow<()> {
        let at = received.at;
        if let Some(setup) = &mut self.setup {
            if let Some(node) = setup.on_frame(received, &mut self.decoder) {
                let node = setup.known_node(node);
                self.set_up(&node);
            } else if let Some((node, ErrorControlMessage::BootUp)) = ErrorControlMessage::parse(&received.frame) {
                setup.forget(node, &mut self.decoder);
            }
            if let Some((node, object, answers)) = self.setup.as_mut().and_then(SetupListener::next_second_answer)
                && answers.differs()
                && is_constant(object)
            {
                let failure = SdoFailure::TwoDevices(Some(answers));
                return self.exclude(SdoError { node, object, operation: Operation::Read, failure }.into(), node);
            }
        }
        self.samples.clear();
        let decoded = self.decoder.decode(received, &mut self.samples);
        if matches!(decoded, Decoded::Tpdo(_) | Decoded::OtherFrame)
            && let Some(surplus) = self.synced.on_frame(&received.frame, at.mono)
        {
            return self.on_surplus(surplus);
        }
        match (decoded, self.numbers.get(&received.frame.id())) {
            (Decoded::Tpdo(node), Some(&number)) => {
                self.has_received = true;
                let (samples, sources) = (&self.samples, self.decoder.sources());
                (self.on_event)(&WatchEvent::Tpdo { at, node, number, samples, sources })
            }
            (Decoded::WrongLength(node), Some(&number)) => {
                self.has_received = true;
                self.on_wrong_length(node, number, &received.frame, master)
            }
            _ => self.on_other_frame(received),
        }
    }

    /// Handles a TPDO whose length differs from its mapping. After the first TPDO that is longer, the mapping is read
    /// again.
    fn on_wrong_length(
        &mut self,
        node: NodeId,
        number: TpdoNumber,
        frame: &Frame,
        master: &mut Master<'_>,
    ) -> ControlFlow<()> {
        let (id, length) = (frame.id(), frame.data().len());
        let mapped = self.decoder.mapped_length(id).map_or(0, |(_, mapped)| mapped);
        let is_longer = length > mapped && self.setup.is_none();
        if is_longer && !self.rereads.contains_key(&node) {
            self.rereads.insert(node, Some(BackgroundSurvey::start(node, &self.overrides, false, master)));
        }
        let is_read = matches!(self.rereads.get(&node), Some(Some(_)));
        if is_longer && is_read || !self.reported.insert((id, false)) {
            return ControlFlow::Continue(());
        }
        (self.on_event)(&WatchEvent::WrongLength { node, number, mapped, length, is_used: false })
    }

    /// Handles an answer of a node whose mapping is read again. If the mapping is unchanged, TPDOs that are always
    /// longer are used.
    fn read_again(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
    ) -> Result<ControlFlow<()>, Error> {
        let mut pending = self.rereads.iter_mut().filter_map(|(&id, survey)| Some((id, survey.as_mut()?)));
        let Some((id, survey)) = pending.find(|(_, survey)| survey.has(ticket)) else {
            return Ok(ControlFlow::Continue(()));
        };
        let Some(read) = survey.take(ticket, result, master) else { return Ok(ControlFlow::Continue(())) };
        self.rereads.insert(id, None);
        let (Ok(node), Some(place)) = (read, self.nodes.iter().position(|node| node.id == id)) else {
            return Ok(ControlFlow::Continue(()));
        };
        let is_unchanged = changes(&self.nodes[place], &node).is_empty();
        let seen = self.decoder.lengths_seen(id);
        self.wrong_lengths.insert(id, self.decoder.wrong_lengths(id));
        self.decoder.replace(node.layout(), &[]);
        self.set_up(&node);
        self.nodes[place] = node;
        self.listen(master)?;
        let used = if is_unchanged { self.decoder.use_longer(id, &seen) } else { Vec::new() };
        for (cob_id, mapped, length) in used {
            if let Some(&number) = self.numbers.get(&cob_id).filter(|_| self.reported.insert((cob_id, true))) {
                let event = WatchEvent::WrongLength { node: id, number, mapped, length, is_used: true };
                if (self.on_event)(&event).is_break() {
                    return Ok(ControlFlow::Break(()));
                }
            }
        }
        Ok(ControlFlow::Continue(()))
    }

    fn report_wrong_lengths(&mut self) {
        let nodes: BTreeSet<NodeId> = self.decoder.sources().iter().map(|source| source.node).collect();
        for node in nodes {
            let before = self.wrong_lengths.get(&node).copied().unwrap_or_default();
            let count = before + self.decoder.wrong_lengths(node);
            if count > 0 && (self.on_event)(&WatchEvent::WrongLengths(node, count)).is_break() {
                return;
            }
        }
    }

    fn on_surplus(&mut self, surplus: Surplus) -> ControlFlow<()> {
        let Surplus { node, number, differs, is_new } = surplus;
        match (is_new, differs) {
            (false, _) => ControlFlow::Continue(()),
            (true, false) => (self.on_event)(&WatchEvent::Repeated(node, number)),
            (true, true) => self.exclude(Failure::at(node, LogFailure::TwoSenders(number)), node),
        }
    }

    /// Ignores a node from now on.
    fn exclude(&mut self, failure: Failure, node: NodeId) -> ControlFlow<()> {
        self.nodes.retain(|other| other.id != node);
        if let Some(setup) = &mut self.setup {
            setup.exclude(node, &mut self.decoder);
        }
        self.failures.push(failure.clone());
        (self.on_event)(&WatchEvent::Failed(&failure))?;
        if self.nodes.is_empty() { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    }

    /// Handles heartbeats, boot-up messages, emergencies and SYNC. They may explain missing TPDOs.
    fn on_other_frame(&mut self, received: &Received) -> ControlFlow<()> {
        let (frame, now) = (&received.frame, received.at.mono);
        for node in self.nodes.iter().filter(|node| node.sync == frame.id() && !frame.is_remote()) {
            let (observed, _) = self.observed.entry(node.id).or_default();
            observed.syncs = (observed.syncs.0 + 1, frame.data().len());
        }
        let emergency = Emergency::parse(frame).filter(|emergency| emergency.code != 0);
        if let Some(node) = self.nodes.iter().find(|node| node.emergency == frame.id())
            && let Some(emergency) = emergency
        {
            self.observed.entry(node.id).or_default().0.emergency = Some(emergency.code);
        }
        let Some((id, life)) = ErrorControlMessage::parse(frame) else { return ControlFlow::Continue(()) };
        if !self.nodes.iter().any(|node| node.id == id) {
            return ControlFlow::Continue(());
        }
        let (observed, last) = self.observed.entry(id).or_default();
        *last = now;
        observed.booted = life == ErrorControlMessage::BootUp;
        observed.state = if let ErrorControlMessage::State(state) = life { Some(state) } else { None };
        if observed.booted { (self.on_event)(&WatchEvent::Restarted(id)) } else { ControlFlow::Continue(()) }
    }

    /// Returns why the nodes send no TPDOs.
    fn silences(&self, findings: &BTreeMap<NodeId, Findings>, now: Mono) -> Vec<(NodeId, Silence)> {
        let context =
            RequestContext { waited: now.since(self.start), syncs_sent: None, requests: false, was_started: false };
        let silence = |node: &Node| {
            let (mut observed, last) = self.observed.get(&node.id).copied().unwrap_or_default();
            let period = node.heartbeat_ms.map(|period| Duration::from_millis(period.into()));
            observed.heartbeat_stopped = period.is_some_and(|period| {
                !period.is_zero() && now.since(last.max(self.start)) > period * 2 + HEARTBEAT_TOLERANCE
            });
            (node.id, diagnose(node, &has_mapped_object, &observed, findings.get(&node.id), &context))
        };
        self.nodes.iter().map(silence).collect()
    }

    fn objects_to_read(&self) -> Vec<(NodeId, Vec<ObjectId>)> {
        self.nodes.iter().map(|node| (node.id, objects_to_read(node, &has_mapped_object))).collect()
    }

    /// Returns the result at the end.
    fn result(&mut self, master: &mut Master<'_>) -> Result<ControlFlow<()>, Failure> {
        if self.has_received {
            return Ok(ControlFlow::Break(()));
        }
        if let Some(&node) = self.setup.as_ref().and_then(|setup| setup.unknown_mappings.values().min()) {
            return Err(Failure::at(node, LogFailure::UnknownMapping));
        }
        if self.setup.is_some() {
            // The nodes of a recording cannot be read, so no reasons are known.
            return Err(Failure::general(PdoFailure::NothingReceived { nodes: Vec::new() }));
        }
        let now = master.now();
        let is_unknown =
            |node: &&Node| self.observed.get(&node.id).is_none_or(|(observed, _)| observed.state.is_none());
        let guarded: Vec<NodeId> = self.nodes.iter().filter(is_unknown).map(|node| node.id).collect();
        let findings = Inquiry::complete(master, &self.objects_to_read(), &guarded)?;
        Err(Failure::general(PdoFailure::NothingReceived { nodes: self.silences(&findings, now) }))
    }
}

/// Whether a TPDO contains any object.
fn has_mapped_object(tpdo: &Tpdo) -> bool {
    !tpdo.mapping.is_empty()
}

impl Waiter for Watcher<'_> {
    type Output = ();
    type Error = Failure;

    fn until(&self) -> Until {
        Until::Deadline(self.next)
    }

    fn on_event(&mut self, master: &mut Master<'_>, event: MasterEvent) -> Result<ControlFlow<()>, Failure> {
        Ok(match event {
            MasterEvent::Frame(received) => self.on_frame(&received, master),
            MasterEvent::Ended => return self.result(master),
            MasterEvent::Deadline if self.next == self.end => return self.result(master),
            MasterEvent::Deadline => {
                self.next = self.end;
                if !self.has_received {
                    self.inquiry = Some(Inquiry::begin(master, &self.objects_to_read()));
                }
                ControlFlow::Continue(())
            }
            MasterEvent::Sdo(ticket, result) if self.rereads.values().flatten().any(|survey| survey.has(ticket)) => {
                self.read_again(ticket, &result, master)?
            }
            MasterEvent::Sdo(ticket, result) => {
                let findings = self.inquiry.as_mut().and_then(|inquiry| inquiry.take(ticket, &result, master));
                match findings {
                    Some(findings) if !self.has_received => {
                        let silences = self.silences(&findings, master.now());
                        (self.on_event)(&WatchEvent::NothingYet(&silences))
                    }
                    _ => ControlFlow::Continue(()),
                }
            }
            MasterEvent::Dropped(_) => {
                self.synced.on_lost_frames();
                ControlFlow::Continue(())
            }
            MasterEvent::Interrupted if self.has_received => ControlFlow::Break(()),
            MasterEvent::Interrupted => return Err(Error::Interrupted.into()),
            MasterEvent::Link(false) => return Err(BusError::Down(master.bus().name().to_owned()).into()),
            MasterEvent::Fault(..) | MasterEvent::Link(true) => ControlFlow::Continue(()),
        })
    }
}
