//! What happens on the way, and how the recording goes on by itself.

use super::{Recording, Rhythm};
use crate::bus::time::spoken;
use crate::bus::{Fault, Mono, Received, Stamp};
use crate::canopen::emcy::Emergency;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{Life, NmtState};
use crate::device::quirk::Quirk;
use crate::master::{Answer, Error, Master, SdoError, Ticket};
use crate::node::Node;
use crate::tasks::log::changes::changes;
use crate::tasks::log::hearts::Beat;
use crate::tasks::log::renewal::{Doubt, Renewed, writes_setup};
use crate::tasks::log::{Note, Observer, Plan};
use std::collections::BTreeSet;

impl Recording {
    /// Learns what an instrument says of its services.
    pub(super) fn know(&mut self, instrument: &Node) {
        let node = instrument.id;
        self.emergencies_of.retain(|_, of| *of != node);
        self.emergencies_of.insert(instrument.emergency, node);
        self.meanings.retain(|(of, _), _| *of != node);
        let described = instrument.model.as_ref().map_or(&[][..], |model| &model.description.emergencies);
        self.meanings.extend(described.iter().map(|entry| ((node, entry.code), entry.text.clone())));
        let quirks = instrument.model.as_ref().map_or(&[][..], |model| &model.description.quirks);
        self.repeating.remove(&node);
        if quirks.contains(&Quirk::EmergencyRepeats) {
            self.repeating.insert(node, None);
        }
    }

    /// Says whose TPDOs cannot be told apart.
    pub(in crate::tasks::log) fn tell_contested(&mut self, at: Stamp, observer: &mut dyn Observer) {
        for (id, (one, other)) in self.decoder.take_contested() {
            let text = format!("nodes {one} and {other} both send TPDOs as {id}: no row is made of them");
            observer.note(&Note::Remark(text.clone()), at);
            self.remarks.push(text);
        }
    }

    /// A frame that is no TPDO.
    pub(super) fn other_frame(&mut self, received: &Received, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let (frame, at) = (&received.frame, received.at);
        if let (Some(&node), Some(emergency)) = (self.emergencies_of.get(&frame.id()), Emergency::parse(frame)) {
            self.emergency(node, emergency, at, observer);
        } else if let Some((node, life)) = Life::parse(frame) {
            self.life(node, life, at, master, observer);
        } else if let Some(node) = writes_setup(frame) {
            self.doubt(node, Doubt::Written, at.mono, master);
        }
    }

    fn emergency(&mut self, node: NodeId, emergency: Emergency, at: Stamp, observer: &mut dyn Observer) {
        if self.repeating.get_mut(&node).is_some_and(|last| last.replace(emergency) == Some(emergency)) {
            return;
        }
        self.emergencies += 1;
        let meaning = self.meanings.get(&(node, emergency.code));
        let meaning = meaning.map_or_else(|| Emergency::class(emergency.code), String::as_str);
        observer.note(&Note::Emergency(node, emergency, meaning.to_owned()), at);
    }

    fn life(&mut self, node: NodeId, life: Life, at: Stamp, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let is_boot_up = life == Life::BootUp;
        if let Some(learner) = self.learner.as_mut().filter(|_| is_boot_up) {
            learner.forget(node, &mut self.decoder);
            self.expect_sources();
        }
        if !self.pulses.contains_key(&node) {
            return;
        }
        match self.hearts.take(node, life, at.mono) {
            Beat::AsBefore => {}
            Beat::Back => {
                observer.note(&Note::HeartbeatBack(node), at);
                self.doubt(node, Doubt::Away, at.mono, master);
            }
            // That it is operational is what everybody expects of a node that is recorded.
            Beat::State(NmtState::Operational) => {}
            Beat::State(state) => observer.note(&Note::State(node, state), at),
        }
        if is_boot_up {
            self.events.restarts += 1;
            observer.note(&Note::Restarted(node), at);
            self.doubt(node, Doubt::Away, at.mono, master);
        }
    }

    /// These have restarted since they were read.
    pub(in crate::tasks::log) fn doubt_restarted(
        &mut self,
        nodes: &BTreeSet<NodeId>,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) {
        let at = master.bus().now();
        let recorded: Vec<NodeId> = nodes.iter().copied().filter(|node| self.pulses.contains_key(node)).collect();
        for node in recorded {
            self.events.restarts += 1;
            observer.note(&Note::Restarted(node), at);
            self.doubt(node, Doubt::Away, at.mono, master);
        }
    }

    /// No row is made of what this node sends until it has been read again. Who only listens cannot.
    fn doubt(&mut self, node: NodeId, why: Doubt, now: Mono, master: &mut Master<'_>) {
        let is_recorded = self.learner.is_none() && self.instruments.iter().any(|known| known.id == node);
        if !is_recorded || !self.renewals.doubt(node, why, now, master) {
            return;
        }
        // What has the right length although another has not is what it was: the other is garbage.
        if !matches!(why, Doubt::Length | Doubt::Missed) {
            self.decoder.hold(node);
            if let Some(poll) = &mut self.poll {
                poll.hold(node);
            }
        }
    }

    fn doubt_all(&mut self, why: Doubt, now: Mono, master: &mut Master<'_>) {
        let nodes: Vec<NodeId> = self.instruments.iter().map(|instrument| instrument.id).collect();
        nodes.into_iter().for_each(|node| self.doubt(node, why, now, master));
    }

    /// Nothing could be heard until now, boot-ups neither.
    fn nothing_was_heard(&mut self, now: Mono, master: &mut Master<'_>) {
        self.pulses.values_mut().for_each(|pulse| pulse.excuse(now));
        self.hearts.excuse(now);
        self.doubt_all(Doubt::Away, now, master);
    }

    pub(super) fn dropped(&mut self, count: u32, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let at = master.bus().now();
        self.dropped += u64::from(count);
        observer.note(&Note::Dropped(count), at);
        self.doubt_all(Doubt::Missed, at.mono, master);
    }

    pub(super) fn not_recorded(&mut self, node: NodeId, now: Mono) {
        self.events.not_recorded += 1;
        if let Some(pulse) = self.pulses.get_mut(&node) {
            pulse.excuse(now);
        }
    }

    pub(super) fn wrong_length(
        &mut self,
        node: NodeId,
        at: Stamp,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) {
        self.events.wrong_lengths += 1;
        if self.wrong_length_said.insert(node) {
            observer.note(&Note::WrongLength(node), at);
        }
        self.doubt(node, Doubt::Length, at.mono, master);
    }

    /// Takes an answer of a node that is read again.
    pub(super) fn read_again(
        &mut self,
        ticket: Ticket,
        result: &Result<Answer, SdoError>,
        plan: &Plan,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        match self.renewals.take(ticket, result, master) {
            None => Ok(()),
            Some(Ok(renewed)) => self.renew(renewed, plan, master, observer),
            Some(Err((node, error))) => {
                observer.note(&Note::Unreadable(node, error.to_string()), master.bus().now());
                Ok(())
            }
        }
    }

    /// Goes on with a node as it is set up now.
    fn renew(
        &mut self,
        renewed: Renewed,
        plan: &Plan,
        master: &mut Master<'_>,
        observer: &mut dyn Observer,
    ) -> Result<(), Error> {
        let Renewed { instrument, was_away, unheld_since } = renewed;
        let (node, at) = (instrument.id, master.bus().now());
        let Some(place) = self.instruments.iter().position(|known| known.id == node) else { return Ok(()) };
        let changes = changes(&self.instruments[place], &instrument);
        match &mut self.poll {
            Some(poll) => {
                if let Err(failure) = poll.renew(&instrument, &plan.wanted, &mut self.decoder) {
                    observer.note(&Note::Unreadable(node, failure.message), at);
                }
            }
            None => self.decoder.renew(instrument.layout(), &plan.wanted),
        }
        self.expect_sources();
        self.know(&instrument);
        self.hearts.expect(&instrument, at.mono);
        if let Some(pulse) = self.pulses.get_mut(&node) {
            pulse.excuse(at.mono);
        }
        self.instruments[place] = instrument;
        master.listen(&self.filters())?;
        if was_away {
            self.states.start_again(node, master);
        }
        if !changes.is_empty() {
            self.events.changes += 1;
            self.renewals.forget_lengths(node);
            self.wrong_length_said.remove(&node);
        }
        if let Some(since) = unheld_since.filter(|_| !changes.is_empty()) {
            let length = spoken(at.mono.since(since));
            let remark =
                format!("node {node} changed while frames were lost: its rows of the {length} before are in doubt");
            observer.note(&Note::Remark(remark.clone()), at);
            self.remarks.push(remark);
        }
        observer.note(&Note::ReadAgain(node, changes), at);
        self.tell_contested(at, observer);
        Ok(())
    }

    pub(super) fn fault(&mut self, fault: Fault, at: Stamp, master: &mut Master<'_>, observer: &mut dyn Observer) {
        observer.note(&Note::Fault(fault), at);
        match fault {
            Fault::BusOff => self.events.bus_offs += 1,
            Fault::Restarted => self.nothing_was_heard(at.mono, master),
            Fault::ControllerOverflow => self.doubt_all(Doubt::Missed, at.mono, master),
            _ => {}
        }
    }

    pub(super) fn link(&mut self, up: bool, master: &mut Master<'_>, observer: &mut dyn Observer) {
        let at = master.bus().now();
        self.link_is_up = up;
        observer.note(&Note::Link(up), at);
        if up {
            self.nothing_was_heard(at.mono, master);
        } else {
            self.events.link_losses += 1;
        }
    }

    /// Says once when a node that used to give something gives nothing any more, and when a heartbeat stops.
    pub(super) fn watch_pulses(&mut self, now: Mono, master: &Master<'_>, observer: &mut dyn Observer) {
        for (&node, pulse) in &mut self.pulses {
            if let (Some(silence), false) = (pulse.silence(now), pulse.silent) {
                pulse.silent = true;
                self.events.silences += 1;
                observer.note(&Note::Silent(node, silence), master.bus().now());
            }
        }
        while let Some((node, silence)) = self.hearts.lost(now) {
            self.events.heartbeat_losses += 1;
            observer.note(&Note::HeartbeatLost(node, silence), master.bus().now());
        }
    }

    /// Whether a node gives nothing, or nothing any more.
    pub(super) fn lost(&self) -> Vec<NodeId> {
        let is_lost = |pulse: &Rhythm| pulse.is_lost(self.end);
        self.pulses.iter().filter(|(_, pulse)| is_lost(pulse)).map(|(&node, _)| node).collect()
    }
}
