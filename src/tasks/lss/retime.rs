//! Device and host to a new bit rate together, with a way back: nothing is stored before the device has been heard
//! at the new rate, so that without power it returns to the old one.

use super::assign::{Job, stage_of};
use super::objects::by_objects;
use super::presence::{LISTEN, Presence, next, presence};
use super::progress::{Done, Stage};
use super::session::{Before, Reach, configured, prepared, put_back};
use super::subject::{Subject, everybody};
use super::ways::PlannedRate;
use super::{Note, Tell};
use crate::bus::{Filters, Mono};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtCommand;
use crate::device::assign::{Applies, AssignEntry, AssignKind, RateTable, short_bit_rate};
use crate::master::{Happening, Master};
use crate::tasks::host::{HostAction, not_set};
use crate::tasks::{Effect, Failure, Kind};
use std::time::Duration;

/// The delay of 15h: so long the device goes on at the old rate, and so long again it is silent. As in table 8 of
/// the DPS manual.
const DELAY_MS: u16 = 1000;
const DELAY: Duration = Duration::from_millis(DELAY_MS as u64);

/// What clocks and the interface take beside it.
const MARGIN: Duration = Duration::from_millis(50);

/// How long a device is looked for at a bit rate.
const PROBE: Duration = Duration::from_secs(4);

/// The host's bit rate and the device's new one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Host {
    old: Option<u32>,
    new: Option<PlannedRate>,
}

impl Host {
    /// As it is before anything is changed.
    pub(super) fn of(master: &Master<'_>, new: Option<PlannedRate>) -> Host {
        Host { old: master.bus().bit_rate(), new }
    }

    /// Whether the device goes to a bit rate that is not the host's, or may.
    pub(super) fn is_left_behind(self) -> bool {
        self.new.is_some_and(|new| new.bits.is_none() || new.bits != self.old)
    }
}

/// Device and host to a new bit rate.
pub(super) struct Retiming<'a> {
    job: &'a Job<'a>,
    subject: &'a Subject,
    way: &'a AssignEntry,
    index: u8,
    /// In bit/s.
    old: u32,
    /// In bit/s.
    new: u32,
}

impl<'a> Retiming<'a> {
    /// What has to be so before anything is changed.
    ///
    /// # Errors
    /// A bit rate that is not known, no privilege, somebody else on the bus.
    pub(super) fn new(
        master: &mut Master<'_>,
        job: &'a Job<'a>,
        subject: &'a Subject,
        way: &'a AssignEntry,
        rate: PlannedRate,
    ) -> Result<Retiming<'a>, Failure> {
        let refuse = |why: &str| {
            subject
                .failure(Kind::CheckFailed, format!("{why}, so that this side cannot follow: nothing was changed"))
                .hint("without --retime, and the interface by hand")
        };
        let new = rate.bits.ok_or_else(|| refuse("what bit rate that is, is not known"))?;
        let old = master.bus().bit_rate().ok_or_else(|| refuse("the interface has no bit rate"))?;
        let name = master.bus().name().to_owned();
        master.bus().can_set_bit_rate().map_err(|error| not_set(error, set_rate(name, new)))?;
        if way.way == AssignKind::Objects && (way.applies == Applies::Power || !job.store) {
            let why =
                if job.store { "it takes the new rate at power on" } else { "it takes the new rate after storing" };
            return Err(refuse(why));
        }
        nobody_else(master, subject)?;
        Ok(Retiming { job, subject, way, index: rate.index, old, new })
    }

    /// Takes the device and the host to the new bit rate. Returns whether that was all there was to do: a device that
    /// has to store first stores the node-ID, too.
    ///
    /// # Errors
    /// A device that is not heard at the new rate. The host is then back at the old one.
    pub(super) fn carry_out(&self, master: &mut Master<'_>, done: &mut Done, tell: Tell<'_>) -> Result<bool, Failure> {
        match self.way.way {
            AssignKind::Lss => self.by_lss(master, done, tell)?,
            AssignKind::Objects => self.by_storing(master, done, tell)?,
        }
        Ok(self.job.id.is_none() || self.way.way == AssignKind::Objects)
    }

    fn by_lss(&self, master: &mut Master<'_>, done: &mut Done, tell: Tell<'_>) -> Result<(), Failure> {
        let subject = self.subject;
        let mut activated = None;
        let session = prepared(master, subject, self.way, tell, |lss| {
            let result = lss.configure_bit_timing(0, self.index);
            if let Some((_, stage)) = &mut done.rate {
                *stage = stage_of(&result);
            }
            result.map_err(|error| subject.lss_failure(error))?;
            lss.activate(DELAY_MS).map_err(|error| subject.lss_failure(error))?;
            activated = Some(lss.master().now());
            Ok(())
        });
        let before = match (session, activated) {
            (Ok(session), Some(_)) => session.before,
            (Ok(_), None) => return Err(subject.failure(Kind::Unexpected, "it was not activated")),
            (Err(failure), None) => return Err(failure),
            (Err(failure), Some(_)) => return Err(self.go_back(master, failure, (master.now(), None), done, tell)),
        };
        let begun = activated.unwrap_or_else(|| master.now());
        let (name, new) = (subject.name(), short_bit_rate(self.new));
        tell(Note::Step(format!("{name} goes to {new} in {DELAY_MS} ms, this side too")));
        let followed = self.follow(master, begun);
        let followed = followed.map_err(|failure| self.go_back(master, failure, (begun, before), done, tell));
        master.set_tolerates_outages(false);
        followed?;
        done.retimed = true;
        tell(Note::Step(format!("{name} answers at {new}")));
        if self.job.id.is_some() {
            return Ok(());
        }
        let stored = if self.job.store { self.store(master, done) } else { Ok(()) };
        put_back(master, before, tell);
        stored
    }

    /// Stores what has been proved. The device stays at its new rate in any case.
    fn store(&self, master: &mut Master<'_>, done: &mut Done) -> Result<(), Failure> {
        configured(master, self.subject, |lss| {
            let result = lss.store();
            done.stored = stage_of(&result);
            result.map_err(|error| self.subject.lss_failure(error))
        })
        .map(|_| ())
    }

    /// Follows the device to the new rate, and looks for it there.
    fn follow(&self, master: &mut Master<'_>, begun: Mono) -> Result<(), Failure> {
        // Where the device is not, nobody acknowledges.
        master.set_tolerates_outages(true);
        wait(master, begun + DELAY + MARGIN)?;
        set(master, self.new)?;
        wait(master, begun + DELAY * 2 + MARGIN)?;
        if is_there(master, self.subject, self.subject.node)? {
            return Ok(());
        }
        let message = format!("it does not answer at {}", short_bit_rate(self.new));
        Err(self.subject.failure(Kind::NoAnswer, message))
    }

    /// The host back to the old rate; what became of the device, and what brings it back.
    fn go_back(
        &self,
        master: &mut Master<'_>,
        failure: Failure,
        (begun, before): (Mono, Option<Before>),
        done: &mut Done,
        tell: Tell<'_>,
    ) -> Failure {
        let (subject, old, new) = (self.subject, short_bit_rate(self.old), short_bit_rate(self.new));
        if master.bus().bit_rate() != Some(self.old)
            && let Err(error) = master.set_bit_rate(self.old)
        {
            let (interface, bit_rate) = (master.bus().name().to_owned(), Some(self.old));
            let mut failure = failure;
            failure.effects.push(Effect::InterfaceNotRestored { interface, bit_rate, reason: error.to_string() });
            return failure;
        }
        // Until then it may be at the old rate and on its way to the new one. A second Ctrl-C ends the waiting.
        let _ = wait(master, begun + DELAY * 2 + MARGIN);
        if !matches!(is_there(master, subject, subject.node), Ok(true)) {
            let hint = format!("nothing was stored: power off and on brings the device back to {old}");
            return failure.and(format!("this side is back at {old}")).hint(hint);
        }
        // It has stayed. What waits in it would come with the next reset.
        let description = subject.model.as_ref().map(|model| &model.description);
        let index = RateTable::of(description).index_of(self.old);
        let undone = index.is_some_and(|index| {
            let undo = configured(master, subject, |lss| {
                lss.configure_bit_timing(0, index).map_err(|error| subject.lss_failure(error))
            });
            undo.is_ok()
        });
        put_back(master, before, tell);
        if let (true, Some((_, stage))) = (undone, &mut done.rate) {
            *stage = Stage::Undone;
        }
        let failure = failure.and(format!("it answers at {old} still, and this side is back there"));
        failure.hint(format!("whether it has {new} at all, its manual tells"))
    }

    /// The way of devices that have to store before the new rate is in force.
    fn by_storing(&self, master: &mut Master<'_>, done: &mut Done, tell: Tell<'_>) -> Result<(), Failure> {
        let (subject, new) = (self.subject, short_bit_rate(self.new));
        tell(Note::Warning(format!(
            "{} stores before it goes to {new}: there is no way back from here",
            subject.name()
        )));
        by_objects(master, subject, self.way, true, done)?;
        master.send(NmtCommand::ResetNode.frame(subject.node));
        let settled = master.now() + MARGIN;
        wait(master, settled)?;
        set(master, self.new)?;
        done.retimed = true;
        master.set_tolerates_outages(true);
        let found = is_there(master, subject, self.job.id.or(subject.node));
        master.set_tolerates_outages(false);
        if found? {
            return Ok(());
        }
        let back = match set(master, self.old) {
            Ok(()) => format!("this side is back at {}", short_bit_rate(self.old)),
            Err(error) => format!("this side is at {new}: {error}"),
        };
        done.retimed = false;
        let message = format!("stored and reset, and it does not answer at {new}; {back}");
        let hint = format!("find its rate: cangauge bus detect {} --active", master.bus().name());
        Err(subject.failure(Kind::NoAnswer, message).hint(hint))
    }
}

/// Refuses where anybody else shows himself: he would be left alone at the old rate, and disturbed at the new one.
fn nobody_else(master: &mut Master<'_>, subject: &Subject) -> Result<(), Failure> {
    let refuse = |who: String| {
        let message = format!("{who} on the bus, too: --retime is for a device alone; nothing was changed");
        Err(subject.failure(Kind::CheckFailed, message).hint("connect it alone, or leave --retime out"))
    };
    if let Some(other) = everybody(master)?.into_iter().find(|&node| subject.node != Some(node)) {
        return refuse(format!("node {other} is"));
    }
    if !subject.unconfigured && master.lss().identify_unconfigured()? {
        return refuse("a device without a node-ID is".to_owned());
    }
    let until = master.now() + LISTEN;
    loop {
        match next(master, until)? {
            Happening::Frame(received) if !is_of(received.frame.id(), subject.node) => {
                return refuse(format!("somebody who sends {} is", received.frame.id()));
            }
            Happening::Deadline => return Ok(()),
            _ => {}
        }
    }
}

/// Whether a frame with this identifier can be the device's own, by the predefined connection set.
fn is_of(id: CanId, node: Option<NodeId>) -> bool {
    let CanId::Standard(number) = id else { return false };
    let own = node.is_some_and(|node| number & 0x7f == u16::from(node.get()) && number >= 0x080);
    own || id == CanId::LSS_SLAVE
}

fn set_rate(interface: String, bit_rate: u32) -> HostAction {
    HostAction::Up { interface, bit_rate: Some(bit_rate), listen_only: false }
}

fn set(master: &mut Master<'_>, bit_rate: u32) -> Result<(), Failure> {
    let name = master.bus().name().to_owned();
    master.set_bit_rate(bit_rate).map_err(|error| not_set(error, set_rate(name, bit_rate)))
}

/// Lets time pass. The interface may go down and come back meanwhile.
fn wait(master: &mut Master<'_>, until: Mono) -> Result<(), Failure> {
    loop {
        match master.next(until)? {
            Happening::Deadline => return Ok(()),
            Happening::Interrupted => return Err(crate::master::Error::Interrupted.into()),
            _ => {}
        }
    }
}

/// Whether the device answers at the bit rate that the bus has now: by SDO, or where it is stopped and has none by LSS.
fn is_there(master: &mut Master<'_>, subject: &Subject, node: Option<NodeId>) -> Result<bool, Failure> {
    let until = master.now() + PROBE;
    master.listen(&Filters::All)?;
    loop {
        let by_sdo = node.map(|node| presence(master, node));
        let by_lss = |master: &mut Master<'_>| {
            let Some(address) = subject.address else { return Ok(false) };
            let named = Subject { reach: Reach::Selective(address), ..subject.clone() };
            configured(master, &named, |_| Ok(())).map(|_| true)
        };
        let found = match by_sdo {
            Some(Ok(Presence::One(found))) => Ok(subject.address.is_none_or(|address| address == found)),
            Some(Ok(Presence::Nameless)) => Ok(subject.address.is_none()),
            Some(Ok(Presence::Several(_))) => Ok(false),
            Some(Err(failure)) => Err(failure),
            Some(Ok(Presence::Nobody(_))) | None => by_lss(master),
        };
        match found {
            Ok(true) => return Ok(true),
            Ok(false) => {}
            // Nobody acknowledges at this rate, or the interface is not up yet.
            Err(failure) if matches!(failure.kind(), Kind::Bus | Kind::NoAnswer) => {}
            Err(failure) => return Err(failure),
        }
        let now = master.now();
        if now >= until {
            return Ok(false);
        }
        wait(master, now + MARGIN)?;
    }
}
