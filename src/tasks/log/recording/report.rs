//! Creates the report of a recording.

use super::Recording;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::NmtState;
use crate::node::Node;
use crate::node::state::Proof;
use crate::tasks::Failure;
use crate::tasks::diagnosis::{Silence, SilenceCause};
use crate::tasks::log::checks::check_overheard;
use crate::tasks::log::silence::{Silent, why_nothing};
use crate::tasks::log::{LogFailure, Mode, RecordingReport, Remark};

impl Recording<'_> {
    /// Ends the recording.
    pub(in crate::tasks::log) fn report(mut self) -> RecordingReport {
        let overheard = self.overheard_nodes();
        let failed = check_overheard(&overheard, self.options).err().filter(|_| self.tally.rows > 0);
        self.ignore_without_signals(overheard.iter().map(|node| node.id).collect());
        let lost = self.liveness.lost(self.tally.end());
        self.remark_at_end();
        let two_devices = self.two_devices.values().cloned().collect();
        let replaced = self.replaced.iter().map(|&node| Failure::at(node, LogFailure::Replaced)).collect();
        let nothing = (self.tally.rows == 0).then(|| why_nothing(&self, self.options));
        RecordingReport {
            failed: failed.into_iter().collect(),
            two_devices,
            replaced,
            rows: self.tally.rows,
            length: self.tally.length(),
            lost,
            nothing,
            dropped: self.tally.dropped,
            emergencies: self.tally.emergencies,
            gaps: self.tally.gaps,
            skipped: self.tally.skipped,
            events: self.tally.events.clone(),
            syncs: self.tally.syncs.clone(),
            statistics: self.tally.into_statistics(self.decoder.sources()),
            receive_buffer: self.receive_buffer,
            timestamps: self.timestamps,
            remarks: self.remarks,
            interrupted: self.interrupted,
        }
    }

    /// Returns the nodes of a passive recording whose TPDOs are known. If no signals were requested, none can be
    /// missing, and no node is returned.
    pub(in crate::tasks::log) fn overheard_nodes(&self) -> Vec<Node> {
        let listener = self.listener.as_ref().filter(|_| !self.options.wanted.is_empty());
        let nodes =
            listener.into_iter().flat_map(|listener| self.options.nodes.iter().map(|&node| listener.known_node(node)));
        nodes.filter(|node| !node.tpdos.is_empty()).collect()
    }

    fn remark_at_end(&mut self) {
        match self.tally.syncs.left_out {
            0 => {}
            count if self.tally.events.link_losses > 0 => self.remarks.push(Remark::SyncsOmittedWhileDown(count)),
            count => self.remarks.push(Remark::SyncsOmittedTooSlow(count)),
        }
        let buffer = self.receive_buffer.filter(|buffer| self.tally.dropped > 0 && buffer.is_small());
        self.remarks.extend(buffer.map(Remark::SmallReceiveBuffer));
        self.remarks.extend(self.rereads.paused().map(Remark::NotReadAgain));
        self.remarks.extend(self.not_operational());
        if self.tally.rows > 0 {
            let unknown = self.listener.iter().flat_map(|listener| &listener.unknown_mappings);
            self.remarks.extend(unknown.map(|(&id, &node)| Remark::UnknownMapping(node, id)));
            let requests = matches!(self.options.mode, Mode::Request(_));
            self.remarks.extend(requests.then_some(Remark::FreshnessNotProven));
            let remarks = self.silence_remarks();
            self.remarks.extend(remarks);
        }
    }

    /// Returns a remark for each node that sent values, but left OPERATIONAL according to its last heartbeat.
    fn not_operational(&self) -> Vec<Remark> {
        let remark = |node: NodeId| {
            let observed = self.observed.get(&node)?;
            let state = observed.state.filter(|&state| state != NmtState::Operational)?;
            let was_operational = observed.was_operational || self.poll.is_none();
            let cause = SilenceCause::NotOperational {
                state,
                by: Proof::Heartbeat,
                was_started: self.states.has_started(node),
            };
            let silence = Silence { emergency: observed.emergency, ..Silence::of(cause) };
            (was_operational && self.has_sent(node)).then(|| Remark::NotOperational(node, Box::new(silence)))
        };
        self.liveness.nodes().filter_map(remark).collect()
    }

    /// Returns the reasons why nodes or single signals have no values.
    pub(super) fn silence_remarks(&self) -> Vec<Remark> {
        let silent = self.silent().into_iter().filter_map(|silent| {
            let signal = match silent {
                Silent::Node(_) => None,
                Silent::Source(..) if self.is_short() => return None,
                Silent::Source(_, source) => Some(self.decoder.sources()[source].signal.to_string()),
            };
            Some(Remark::NoMeasurements(silent.node(), signal, Box::new(self.silence(silent))))
        });
        silent.collect()
    }
}
