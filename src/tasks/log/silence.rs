//! Finds the nodes and signals of a recording that sent no values, and the reasons.

use super::checks::check_overheard;
use super::recording::Recording;
use super::{FIRST_SAMPLE_TIMEOUT, LogFailure, LogOptions, Mode};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::TpdoNumber;
use crate::master::Master;
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::diagnosis::{
    Findings, Inquiry, ObservedFrames, RequestContext, Silence, SilenceCause, diagnose, objects_to_read,
};
use std::collections::BTreeMap;
use std::time::Duration;

/// A node without values, or a signal without values although other signals of its node have values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Silent {
    Node(NodeId),
    Source(NodeId, usize),
}

impl Silent {
    pub(super) fn node(self) -> NodeId {
        match self {
            Silent::Node(node) | Silent::Source(node, _) => node,
        }
    }
}

/// The reads from silent nodes of a recording, and the answers.
#[derive(Default)]
pub(super) struct Questions {
    /// Whether the nodes were read during the recording.
    pub(super) were_asked: bool,
    pub(super) open: Option<Inquiry>,
    pub(super) findings: BTreeMap<NodeId, Findings>,
}

/// Returns why a recording has no rows.
pub(super) fn why_nothing(recording: &Recording<'_>, options: &LogOptions) -> Failure {
    let within = waited(options);
    if let Some(failure) = recording.two_devices.values().next() {
        return failure.clone();
    }
    if let Some(&node) = recording.listener.as_ref().and_then(|listener| listener.unknown_mappings.values().min()) {
        return Failure::at(node, LogFailure::UnknownMapping);
    }
    if recording.listener.is_some()
        && let Err(failure) = check_overheard(&recording.overheard_nodes(), options)
    {
        return failure;
    }
    if recording.nodes.is_empty() {
        let lengths = |&node: &NodeId| Some((node, recording.decoder.wrong_length(node)?));
        if let Some((node, (mapped, received))) = options.nodes.iter().find_map(lengths) {
            let is_live = recording.interface.is_some();
            return Failure::at(node, LogFailure::OtherLength { mapped, received, is_live });
        }
        if let Some((id, [(node, one), (_, other)])) = recording.decoder.shared_cob_ids().next() {
            let nodes = vec![(node, Silence::of(SilenceCause::SameCobId(id, [one, other])))];
            return Failure::at(node, LogFailure::NoMeasurements { within, nodes });
        }
        let state = |node: &NodeId| recording.observed.get(node).and_then(|observed| observed.state);
        let nodes = options.nodes.iter().map(|node| (*node, state(node))).collect();
        let (has_traffic, interface) = (recording.has_traffic, recording.interface.clone());
        let has_request = !options.wanted.is_empty();
        return Failure::general(LogFailure::NothingReceived { has_request, within, nodes, has_traffic, interface });
    }
    let nodes: Vec<(NodeId, Silence)> =
        recording.silent().into_iter().map(|silent| (silent.node(), recording.silence(silent))).collect();
    match nodes.as_slice() {
        [(only, _)] => Failure::at(*only, LogFailure::NoMeasurements { within, nodes }),
        _ => Failure::general(LogFailure::NoMeasurements { within, nodes }),
    }
}

fn waited(options: &LogOptions) -> Duration {
    options.duration.unwrap_or(FIRST_SAMPLE_TIMEOUT).min(FIRST_SAMPLE_TIMEOUT)
}

impl Recording<'_> {
    /// Returns the nodes without values, and the signals without values of nodes that send other values.
    pub(super) fn silent(&self) -> Vec<Silent> {
        let expected = |node: &&Node| self.is_expected(node.id);
        let mut silent = Vec::new();
        for node in self.nodes.iter().filter(expected) {
            if !self.has_sent(node.id) {
                silent.push(Silent::Node(node.id));
                continue;
            }
            let sources = self.decoder.sources().iter().enumerate();
            let own: Vec<(usize, &str)> = sources
                .filter(|(_, source)| source.node == node.id)
                .map(|(at, source)| (at, &*source.signal))
                .collect();
            for &(at, name) in &own {
                // A signal whose unit became known later has two sources.
                let is_last = own.iter().all(|&(other, other_name)| other_name != name || other <= at);
                if is_last && own.iter().all(|&(other, other_name)| other_name != name || self.count(other) == 0) {
                    silent.push(Silent::Source(node.id, at));
                }
            }
        }
        silent
    }

    /// Returns why a node or a source has no values.
    pub(super) fn silence(&self, silent: Silent) -> Silence {
        let id = silent.node();
        let without_evidence = Silence::of;
        if !self.link_is_up {
            return without_evidence(SilenceCause::InterfaceDown);
        }
        if self.is_paused(id) {
            return without_evidence(SilenceCause::NotReadAgain);
        }
        if let Some(error) = self.poll.as_ref().and_then(|poll| poll.error(silent)) {
            return without_evidence(SilenceCause::PollFailed(Box::new(error.clone())));
        }
        let Some(node) = self.nodes.iter().find(|node| node.id == id) else {
            return without_evidence(SilenceCause::NoTpdo);
        };
        let carries = |tpdo: &Tpdo| self.carries(silent, tpdo);
        let (observed, wrong_length) =
            (self.observed.get(&id).copied().unwrap_or_default(), self.decoder.wrong_length(id));
        let observed = ObservedFrames {
            sends_tpdos: observed.sends_tpdos || self.has_sent(id) || wrong_length.is_some(),
            wrong_length,
            shared: self.shared_cob_id(node, &carries),
            syncs: self.syncs_received.get(&node.sync).copied().unwrap_or_default(),
            ..observed
        };
        let context = RequestContext {
            waited: self.waited(),
            syncs_sent: matches!(self.options.mode, Mode::Sync(_)).then(|| self.syncs()),
            requests: matches!(self.options.mode, Mode::Request(_)),
            was_started: self.states.has_started(id),
        };
        let silence = diagnose(node, &carries, &observed, self.questions.findings.get(&id), &context);
        Silence { unknown_cob_ids: self.unknown_cob_ids.iter().copied().collect(), ..silence }
    }

    /// Whether a TPDO contains recorded values of a silent node or signal.
    fn carries(&self, silent: Silent, tpdo: &Tpdo) -> bool {
        let id = tpdo.cob_id.can_id();
        match silent {
            Silent::Node(_) => self.decoder.values_of(id) > 0,
            Silent::Source(_, source) => self.decoder.carries(id, source),
        }
    }

    /// Returns a COB-ID that two TPDOs share, if one of the TPDOs contains requested values.
    fn shared_cob_id(
        &self,
        node: &Node,
        carries: &dyn Fn(&Tpdo) -> bool,
    ) -> Option<(CanId, [(NodeId, TpdoNumber); 2])> {
        let mut own = node.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid() && carries(tpdo));
        own.find_map(|tpdo| {
            let id = tpdo.cob_id.can_id();
            Some((id, self.decoder.shared_cob_id(id)?))
        })
    }

    /// Returns the objects to read from silent nodes. Polled nodes are omitted: the polls already show the reason.
    fn objects_to_read(&self) -> Vec<(NodeId, Vec<ObjectId>)> {
        if matches!(self.options.mode, Mode::Poll(_) | Mode::Passive) || !self.link_is_up || self.interface.is_none() {
            return Vec::new();
        }
        let mut asked: BTreeMap<NodeId, Vec<_>> = BTreeMap::new();
        for silent in self.silent() {
            let Some(node) = self.nodes.iter().find(|node| node.id == silent.node()) else { continue };
            let objects = objects_to_read(node, &|tpdo| self.carries(silent, tpdo));
            let known = asked.entry(node.id).or_default();
            let new: Vec<_> = objects.into_iter().filter(|object| !known.contains(object)).collect();
            known.extend(new);
        }
        asked.into_iter().collect()
    }

    /// Reads objects of the silent nodes during a recording. The reasons are reported after all answers.
    pub(super) fn read_silent_nodes_during_recording(&mut self, master: &mut Master<'_>) {
        self.questions.were_asked = true;
        let asked = self.objects_to_read();
        if !asked.is_empty() {
            self.questions.open = Some(Inquiry::begin(master, &asked));
        }
    }

    /// Reads objects of the silent nodes at the end of a recording. If the bus fails meanwhile, the reasons are less
    /// exact, but the recording does not fail.
    pub(super) fn ask_silent_nodes(&mut self, master: &mut Master<'_>) {
        let asked = self.objects_to_read();
        if asked.is_empty() || self.is_interrupted() || self.rows() > 0 && self.is_short() {
            return;
        }
        let is_unknown = |node: &NodeId| {
            !self.has_sent(*node) && self.observed.get(node).is_none_or(|observed| observed.state.is_none())
        };
        let guarded: Vec<NodeId> = asked.iter().map(|(node, _)| *node).filter(is_unknown).collect();
        if let Ok(findings) = Inquiry::complete(master, &asked, &guarded) {
            self.questions.findings.extend(findings);
        }
    }
}
