//! Handles incidents during a recording.

use super::Recording;
use super::emergencies::OverloadChange;
use crate::bus::{Fault, Filters, Mono, Received, Stamp};
use crate::canopen::emcy::Emergency;
use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::master::{Answer, Error, Master, Operation, SdoError, SdoFailure, SecondAnswer, Ticket};
use crate::node::Node;
use crate::tasks::Failure;
use crate::tasks::log::changes::changes;
use crate::tasks::log::heartbeats::HeartbeatChange;
use crate::tasks::log::passive::{is_constant, predefined_tpdo};
use crate::tasks::log::rereads::{Reread, RereadReason, node_with_written_setup};
use crate::tasks::log::{Change, FIRST_SAMPLE_TIMEOUT, LogEvent, LogFailure, Mode, Observer, Remark};
use crate::tasks::synced::Surplus;
use std::collections::BTreeSet;
use std::ops::ControlFlow;
use std::time::Duration;

/// Frames with all COB-IDs are received if a node has sent no values after this time.
const UNKNOWN_TPDO_DELAY: Duration = Duration::from_secs(1);

impl Recording<'_> {
    /// Reports COB-IDs that two TPDOs share.
    pub(in crate::tasks::log) fn report_shared_cob_ids(&mut self, at: Stamp, observer: &mut dyn Observer) {
        for (id, tpdos) in self.decoder.take_shared_cob_ids() {
            let remark = Remark::SharedCobId(id, tpdos);
            if !self.remarks.contains(&remark) {
                self.remark(remark, at, observer);
            }
        }
    }

    /// Reports valid TPDOs that cannot be decoded, if the node sends other values. If a node sends no values, this is
    /// reported at the end as the reason.
    fn report_not_decoded(&mut self, at: Stamp, observer: &mut dyn Observer) {
        let with_values = |node: &&Node| self.decoder.sources().iter().any(|source| source.node == node.id);
        let nodes = self.nodes.iter().filter(with_values).filter(|_| self.options.wanted.is_empty());
        let remarks: Vec<Remark> = nodes
            .flat_map(|node| node.not_decoded.iter().map(|&(number, code)| Remark::NotDecoded(node.id, number, code)))
            .collect();
        remarks.into_iter().for_each(|remark| self.remark(remark, at, observer));
    }

    /// Adopts the overloads that the nodes reported before the recording.
    pub(in crate::tasks::log) fn adopt_overloads(&mut self) {
        self.nodes.iter().for_each(|node| self.decoder.set_overload(node.id, node.has_overload));
    }

    /// Reports TPDOs that cannot be decoded, and signals whose values may be clipped.
    pub(in crate::tasks::log) fn report_setup(&mut self, at: Stamp, observer: &mut dyn Observer) {
        self.report_not_decoded(at, observer);
        let narrow: Vec<Remark> = self
            .nodes
            .iter()
            .flat_map(|node| node.layout().narrow_values().into_iter().map(|value| Remark::MayClip(node.id, value)))
            .collect();
        narrow.into_iter().for_each(|remark| self.remark(remark, at, observer));
    }

    /// Reports an observation now and in the summary.
    pub(in crate::tasks::log) fn remark(&mut self, remark: Remark, at: Stamp, observer: &mut dyn Observer) {
        observer.event(&LogEvent::Remark(remark.clone()), at);
        self.remarks.push(remark);
    }

    /// Handles a frame that is not a TPDO.
    pub(super) fn on_other_frame(&mut self, received: &Received, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let (frame, at) = (&received.frame, received.at);
        if let Some((node, emergency)) = self.emergencies.parse(frame) {
            self.on_emergency(node, emergency, at, observer);
        } else if let Some((node, life)) = ErrorControlMessage::parse(frame) {
            if let Some((node, length)) = ErrorControlMessage::unusual_length(frame) {
                self.wrong_heartbeat_length(node, length, at, observer);
            }
            self.on_life(node, life, at, master, observer);
        } else if let Some((node, length)) = ErrorControlMessage::unusual_length(frame) {
            self.wrong_heartbeat_length(node, length, at, observer);
        } else if let Some(node) = node_with_written_setup(frame, &self.nodes) {
            self.request_reread(node, RereadReason::Written, at.mono, master);
        } else if let Some((command, node)) = NmtCommand::parse(frame) {
            let state = command.target();
            let state = (!command.is_reset() && state != NmtState::Operational).then_some(state);
            let addressed =
                self.nodes.iter().map(|known| known.id).filter(|&known| node.is_none_or(|node| node == known));
            addressed.for_each(|node| self.observed.entry(node).or_default().commanded = state);
        } else if !frame.is_remote() && self.nodes.iter().any(|node| node.sync == frame.id()) {
            let (count, length) = self.syncs_received.entry(frame.id()).or_default();
            (*count, *length) = (*count + 1, frame.data().len());
        } else if let Some((node, _)) = self.decoder.mapped_length(frame.id()).filter(|_| !frame.is_remote()) {
            // The mapping of this TPDO is unknown.
            self.observed.entry(node).or_default().sends_tpdos = true;
        } else if self.receives_all && self.is_unknown_tpdo(frame) {
            self.unknown_cob_ids.insert(frame.id());
        }
    }

    /// Whether this may be a TPDO of a recorded node whose COB-ID differs from 180xh:1. TPDOs of other nodes that send
    /// heartbeats are excluded.
    fn is_unknown_tpdo(&self, frame: &Frame) -> bool {
        let is_of_other = |of: NodeId| self.observed.contains_key(&of) && self.nodes.iter().all(|node| node.id != of);
        matches!(frame.id(), CanId::Standard(0x181..=0x57f))
            && !frame.is_remote()
            && !predefined_tpdo(frame).is_some_and(is_of_other)
    }

    /// Receives frames with all COB-IDs while nodes send no values: the COB-IDs of their TPDOs may differ from 180xh:1.
    pub(super) fn look_for_unknown_tpdos(&mut self, waited: Duration, master: &mut Master<'_>) {
        let is_due = UNKNOWN_TPDO_DELAY <= waited && waited < FIRST_SAMPLE_TIMEOUT;
        let is_needed = is_due
            && matches!(self.options.mode, Mode::AsSent | Mode::Sync(_))
            && self.liveness.nodes().any(|node| !self.liveness.has_sent(node));
        if is_needed != self.receives_all {
            let filters = if is_needed { Filters::All } else { self.filters() };
            // If this fails, the reasons are less exact, but the recording does not fail.
            self.receives_all = master.listen(&filters).is_ok() && is_needed;
        }
    }

    fn on_emergency(&mut self, node: NodeId, emergency: Emergency, at: Stamp, observer: &mut dyn Observer) {
        match self.emergencies.overload(node, emergency) {
            Some(OverloadChange::Begins(channel)) => self.decoder.begin_overload(node, channel),
            Some(OverloadChange::Ends) => self.decoder.end_overload(node),
            None => {}
        }
        if self.emergencies.is_repetition(node, emergency) {
            return;
        }
        self.tally.emergencies += 1;
        if emergency.code != 0 {
            self.observed.entry(node).or_default().emergency = Some(emergency.code);
        }
        if !self.emergencies.is_new(node, emergency, at.mono) {
            return;
        }
        observer.event(&LogEvent::Emergency(node, emergency, self.emergencies.meaning(node, emergency)), at);
    }

    /// Reports once that the heartbeats of a node have a wrong length.
    fn wrong_heartbeat_length(&mut self, node: NodeId, length: usize, at: Stamp, observer: &mut dyn Observer) {
        if self.liveness.has(node) && self.heartbeat_length_reported.insert(node) {
            observer.event(&LogEvent::HeartbeatLength(node, length), at);
        }
    }

    /// Reports how often emergencies and faults were repeated.
    pub(super) fn report_repeated(&mut self, at: Stamp, at_end: bool, observer: &mut dyn Observer) {
        while let Some((fault, count)) = self.faults.next(at.mono, at_end) {
            observer.event(&LogEvent::FaultRepeated(fault, count), at);
        }
        while let Some((node, emergency, count)) = self.emergencies.next_repeated(at.mono, at_end) {
            let meaning = self.emergencies.meaning(node, emergency);
            observer.event(&LogEvent::EmergencyRepeated(node, emergency, meaning, count), at);
        }
    }

    /// Handles a heartbeat or boot-up message.
    fn on_life(
        &mut self,
        node: NodeId,
        life: ErrorControlMessage,
        at: Stamp,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) {
        let is_boot_up = life == ErrorControlMessage::BootUp;
        if is_boot_up {
            self.decoder.end_overload(node);
        }
        if let Some(listener) = self.listener.as_mut().filter(|_| is_boot_up) {
            listener.forget(node, &mut self.decoder);
            self.update_sources();
        }
        // In a passive recording, a boot-up message is no restart if it is the first message of the node.
        let is_unseen = !self.observed.contains_key(&node) && !self.has_sent(node) && self.early.is_empty();
        let is_first_message = self.listener.is_some() && is_unseen;
        let observed = self.observed.entry(node).or_default();
        (observed.booted, observed.heartbeat_stopped) = (is_boot_up, false);
        observed.commanded = observed.commanded.filter(|_| !is_boot_up);
        observed.state = match life {
            ErrorControlMessage::State(state) => Some(state),
            ErrorControlMessage::BootUp => None,
        };
        observed.was_operational |= observed.state == Some(NmtState::Operational);
        if !self.liveness.has(node) {
            return;
        }
        match self.liveness.on_life(node, life, at.mono) {
            HeartbeatChange::None => {}
            HeartbeatChange::Back => {
                observer.event(&LogEvent::HeartbeatBack(node), at);
                self.request_reread(node, RereadReason::HeartbeatPaused, at.mono, master);
            }
            // This is the expected state.
            HeartbeatChange::State(NmtState::Operational) => {}
            HeartbeatChange::State(state) => observer.event(&LogEvent::State(node, state), at),
        }
        if is_boot_up && !is_first_message {
            self.on_restart(node, at, master, observer);
        }
    }

    fn on_restart(&mut self, node: NodeId, at: Stamp, master: &mut Master<'_>, observer: &mut dyn Observer) {
        self.tally.events.restarts += 1;
        observer.event(&LogEvent::Restarted(node), at);
        self.request_reread(node, RereadReason::Disconnected, at.mono, master);
    }

    /// Handles nodes that restarted between their survey and the recording.
    pub(in crate::tasks::log) fn restarted_before_start(
        &mut self,
        nodes: &BTreeSet<NodeId>,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) {
        let at = master.bus().now();
        for &node in nodes {
            if self.liveness.has(node) {
                self.on_restart(node, at, master, observer);
            }
        }
    }

    /// Requests that the setup of a node is read again. Until then its frames are ignored. A passive recording sends no
    /// reads.
    fn request_reread(&mut self, node: NodeId, why: RereadReason, now: Mono, master: &mut Master<'_>) {
        let is_recorded = self.listener.is_none() && self.nodes.iter().any(|known| known.id == node);
        if !is_recorded || !self.rereads.request(node, why, now, master) {
            return;
        }
        // After a wrong length, frames with the right length are still recorded, because they fit the known mapping.
        if !matches!(why, RereadReason::WrongLength | RereadReason::FramesLost) {
            self.decoder.pause(node);
            if let Some(poll) = &mut self.poll {
                poll.pause(node);
            }
        }
    }

    fn request_all_rereads(&mut self, why: RereadReason, now: Mono, master: &mut Master<'_>) {
        let nodes: Vec<NodeId> = self.nodes.iter().map(|node| node.id).collect();
        nodes.into_iter().for_each(|node| self.request_reread(node, why, now, master));
    }

    /// Handles the end of a time without reception. Boot-up messages may be lost.
    fn reception_resumed(&mut self, now: Mono, master: &mut Master<'_>) {
        self.liveness.restart_all(now);
        self.request_all_rereads(RereadReason::Disconnected, now, master);
    }

    /// Handles frames that the kernel dropped.
    pub(super) fn on_dropped(&mut self, count: u32, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let at = master.bus().now();
        self.tally.dropped += u64::from(count);
        self.synced.on_lost_frames();
        observer.event(&LogEvent::Dropped(count), at);
        self.request_all_rereads(RereadReason::FramesLost, at.mono, master);
    }

    /// Counts a TPDO of a node whose setup is uncertain.
    pub(super) fn on_paused_tpdo(&mut self, node: NodeId, now: Mono) {
        self.tally.events.not_recorded += 1;
        self.liveness.restart(node, now);
    }

    /// Handles a TPDO that arrived more than once per SYNC. If the values differ, the TPDO is ignored from now on.
    pub(super) fn on_surplus(&mut self, surplus: Surplus, at: Stamp, observer: &mut dyn Observer) -> ControlFlow<()> {
        let Surplus { node, number, differs, is_new } = surplus;
        if !is_new {
            return ControlFlow::Continue(());
        }
        if !differs {
            self.remark(Remark::RepeatedTpdo(node, number), at, observer);
            return ControlFlow::Continue(());
        }
        self.remark(Remark::TwoSenders(node, number), at, observer);
        self.exclude(node, Failure::at(node, LogFailure::TwoSenders(number)))
    }

    /// Handles two answers to one request of another master. If their difference makes the setup uncertain, the TPDOs
    /// of the node are ignored from now on.
    pub(super) fn on_second_answer(
        &mut self,
        node: NodeId,
        object: ObjectId,
        answers: SecondAnswer,
        at: Stamp,
        observer: &mut dyn Observer,
    ) -> ControlFlow<()> {
        self.remark(Remark::SecondAnswer(node, answers), at, observer);
        if !answers.differs() || !is_constant(object) {
            return ControlFlow::Continue(());
        }
        let failure = SdoFailure::TwoDevices(Some(answers));
        self.exclude(node, SdoError { node, object, operation: Operation::Read, failure }.into())
    }

    /// Ignores the values of a node from now on. Without another node, the recording ends.
    pub(super) fn exclude(&mut self, node: NodeId, failure: Failure) -> ControlFlow<()> {
        self.two_devices.entry(node).or_insert(failure);
        let sources = self.decoder.sources();
        self.early.retain(|samples| samples.iter().all(|sample| sources[sample.source].node != node));
        self.liveness.remove(node);
        let has_others = match &mut self.listener {
            Some(listener) => listener.exclude(node, &mut self.decoder),
            None => {
                self.decoder.pause(node);
                self.poll.iter_mut().for_each(|poll| poll.pause(node));
                self.liveness.nodes().next().is_some()
            }
        };
        if has_others { ControlFlow::Continue(()) } else { ControlFlow::Break(()) }
    }

    /// Handles a TPDO whose length differs from its mapping.
    pub(super) fn on_wrong_length(
        &mut self,
        node: NodeId,
        at: Stamp,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) {
        self.tally.events.wrong_lengths += 1;
        self.request_reread(node, RereadReason::WrongLength, at.mono, master);
        // A longer TPDO may be used after its mapping was read again.
        let may_be_used = |mapped, received| received > mapped && self.rereads.is_pending(node);
        if let Some((mapped, received)) = self.decoder.wrong_length(node)
            && !may_be_used(mapped, received)
            && self.wrong_length_reported.insert(node)
        {
            observer.event(&LogEvent::WrongLength(node, mapped, received), at);
        }
    }

    /// Handles the result of a transfer of a reread.
    pub(super) fn read_again(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        match self.rereads.on_answer(ticket, result, master) {
            None => Ok(()),
            Some(Ok(reread)) => self.apply_reread(reread, master, observer),
            Some(Err((node, error))) => {
                observer.event(&LogEvent::Unreadable(node, Box::new(error.into())), master.bus().now());
                Ok(())
            }
        }
    }

    /// Continues the recording with the new setup of a node.
    fn apply_reread(
        &mut self,
        reread: Reread,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        let Reread { node, may_need_start, recorded_since } = reread;
        let (id, at) = (node.id, master.bus().now());
        let Some(place) = self.nodes.iter().position(|known| known.id == id) else { return Ok(()) };
        let changes = changes(&self.nodes[place], &node);
        self.decoder.set_overload(id, node.has_overload);
        match &mut self.poll {
            Some(poll) => {
                if let Err(failure) = poll.set_node(&node, &self.options.wanted, &mut self.decoder) {
                    observer.event(&LogEvent::Unreadable(id, Box::new(failure)), at);
                }
            }
            None => {
                let seen = self.decoder.lengths_seen(id);
                self.decoder.replace(node.layout(), &node.all_wanted(&self.options.wanted));
                if changes.is_empty() {
                    for (_, mapped, received) in self.decoder.use_longer(id, &seen) {
                        observer.event(&LogEvent::LongerTpdo(id, mapped, received), at);
                    }
                }
            }
        }
        self.update_sources();
        self.emergencies.watch(&node);
        self.liveness.watch_heartbeat(&node, self.options.mode, at.mono);
        self.liveness.restart(id, at.mono);
        self.nodes[place] = node;
        self.due.set_up(&self.nodes, &self.decoder, self.options.mode);
        self.synced.set_up(&self.nodes[place]);
        master.listen(&self.filters())?;
        if may_need_start {
            self.states.start_again(id, master);
        }
        if changes.iter().any(|change| matches!(change, Change::Device(..))) {
            self.replaced.insert(id);
        }
        if !changes.is_empty() {
            self.tally.events.changes += 1;
            self.rereads.forget_wrong_length(id);
            self.wrong_length_reported.remove(&id);
            if let Some(since) = recorded_since {
                self.remark(Remark::ChangedWhileFramesLost(id, at.mono.since(since)), at, observer);
            }
        }
        observer.event(&LogEvent::ReadAgain(id, changes), at);
        self.report_shared_cob_ids(at, observer);
        Ok(())
    }

    /// Handles an answer of a silent node. After the last answer, the reasons are reported.
    pub(super) fn on_finding(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) {
        let Some(open) = &mut self.questions.open else { return };
        let Some(findings) = open.take(ticket, result, master) else { return };
        (self.questions.open, self.questions.findings) = (None, findings);
        let at = master.bus().now();
        for remark in self.silence_remarks() {
            observer.event(&LogEvent::Remark(remark), at);
        }
    }

    /// Handles a fault of the controller.
    pub(super) fn on_fault(&mut self, fault: Fault, at: Stamp, master: &mut Master<'_>, observer: &mut dyn Observer) {
        if self.faults.is_new(fault, |&other| other == fault, at.mono) {
            observer.event(&LogEvent::Fault(fault), at);
        }
        match fault {
            Fault::BusOff => self.tally.events.bus_offs += 1,
            Fault::Restarted => self.reception_resumed(at.mono, master),
            Fault::ControllerOverflow => self.request_all_rereads(RereadReason::FramesLost, at.mono, master),
            _ => {}
        }
    }

    /// Handles a change of the link: the interface went down or came back.
    pub(super) fn on_link(&mut self, up: bool, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let at = master.bus().now();
        self.link_is_up = up;
        observer.event(&LogEvent::Link(up), at);
        if up {
            self.reception_resumed(at.mono, master);
        } else {
            self.tally.events.link_losses += 1;
        }
    }

    /// Reports nodes that stopped sending samples, and heartbeats that stopped. Each is reported once.
    pub(super) fn report_losses(&mut self, now: Mono, master: &Master<'_>, observer: &mut dyn Observer) {
        while let Some((node, silence)) = self.liveness.next_silent(now) {
            self.tally.events.silences += 1;
            observer.event(&LogEvent::Silent(node, silence), master.bus().now());
        }
        while let Some((node, silence)) = self.liveness.next_lost_heartbeat(now) {
            self.tally.events.heartbeat_losses += 1;
            self.observed.entry(node).or_default().heartbeat_stopped = true;
            observer.event(&LogEvent::HeartbeatLost(node, silence), master.bus().now());
        }
    }
}
