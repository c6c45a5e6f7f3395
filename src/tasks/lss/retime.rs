//! Device and host to a new bit rate together, with a way back: nothing is stored before the device has been heard
//! at the new rate, so that without power it returns to the old one.

use super::assign::{Job, stage_of};
use super::objects::by_objects;
use super::presence::{LISTEN, Presence, next, presence};
use super::progress::{Done, Stage};
use super::session::{Before, configured, prepared, put_back};
use super::subject::{Subject, everybody};
use super::ways::PlannedRate;
use super::{Note, Tell};
use crate::bus::{Filters, Mono};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::NmtCommand;
use crate::device::assign::{Applies, AssignEntry, AssignWay, RateTable, spoken_rate};
use crate::master::{Happening, Master};
use crate::tasks::host::{by_hand, not_set};
use crate::tasks::{Failure, Kind};
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
    pub fn of(master: &Master<'_>, new: Option<PlannedRate>) -> Host {
        Host { old: master.bus().bit_rate(), new }
    }

    /// Whether the device goes to a bit rate that is not the host's, or may.
    pub fn is_left_behind(self) -> bool {
        self.new.is_some_and(|new| new.bits.is_none() || new.bits != self.old)
    }
}

/// The two bit rates in bit/s.
#[derive(Clone, Copy, Debug)]
struct Rates {
    old: u32,
    new: u32,
}

/// Takes the device and the host to a new bit rate. Returns whether that was all there was to do: a device that has to
/// store first stores the node-ID, too.
///
/// # Errors
/// Somebody else on the bus, no privilege, a device that is not heard at the new rate. The host is then back at the
/// old one.
pub(super) fn retime(
    master: &mut Master<'_>,
    job: &Job<'_>,
    subject: &Subject,
    way: &AssignEntry,
    rate: PlannedRate,
    done: &mut Done,
    tell: Tell<'_>,
) -> Result<bool, Failure> {
    let rates = check(master, subject, rate)?;
    nobody_else(master, subject)?;
    match way.way {
        AssignWay::Lss => {
            by_lss(master, job, subject, way, rate, rates, done, tell)?;
            Ok(job.id.is_none())
        }
        AssignWay::Objects => {
            by_storing(master, job, subject, way, rates, done, tell)?;
            Ok(true)
        }
    }
}

/// What has to be so before anything is changed.
fn check(master: &Master<'_>, subject: &Subject, rate: PlannedRate) -> Result<Rates, Failure> {
    let refuse = |why: &str| {
        subject
            .failure(Kind::CheckFailed, format!("{why}, so that this side cannot follow: nothing was changed"))
            .hint("without --retime, and the interface by hand")
    };
    let new = rate.bits.ok_or_else(|| refuse("what bit rate that is, is not known"))?;
    let old = master.bus().bit_rate().ok_or_else(|| refuse("the interface has no bit rate"))?;
    let name = master.bus().name().to_owned();
    master.bus().can_set_bit_rate().map_err(|error| not_set(error, &by_hand(&name, Some(new))))?;
    Ok(Rates { old, new })
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

#[allow(clippy::too_many_arguments)]
fn by_lss(
    master: &mut Master<'_>,
    job: &Job<'_>,
    subject: &Subject,
    way: &AssignEntry,
    rate: PlannedRate,
    rates: Rates,
    done: &mut Done,
    tell: Tell<'_>,
) -> Result<(), Failure> {
    let mut activated = None;
    let stage = |done: &mut Done, stage: Stage| {
        if let Some((_, _, place)) = &mut done.rate {
            *place = stage;
        }
    };
    let prepared = prepared(master, subject, way, tell, &mut |lss| {
        stage(done, Stage::Sent);
        let result = lss.configure_bit_timing(0, rate.index);
        stage(done, stage_of(&result));
        result.map_err(|error| subject.lss_failure(error))?;
        lss.activate(DELAY_MS).map_err(|error| subject.lss_failure(error))?;
        activated = Some(lss.master().now());
        Ok(())
    });
    let (before, begun) = match (prepared, activated) {
        (Ok(((), before)), Some(begun)) => (before, begun),
        (Ok(_), None) => return Err(subject.failure(Kind::Unexpected, "it was not activated")),
        (Err(failure), None) => return Err(failure),
        (Err(failure), Some(_)) => return Err(go_back(master, subject, rates, failure, done)),
    };
    tell(Note::Step(format!("{} goes to {} in {DELAY_MS} ms, this side too", subject.name(), spoken_rate(rates.new))));
    if let Err(failure) = follow(master, subject, rates, begun) {
        return Err(go_back(master, subject, rates, failure, done));
    }
    done.retimed = true;
    tell(Note::Step(format!("{} answers at {}", subject.name(), spoken_rate(rates.new))));
    if job.id.is_some() {
        return Ok(());
    }
    store(master, job, subject, before, done, tell)
}

/// Stores what has been proved. The device stays at its new rate in any case.
fn store(
    master: &mut Master<'_>,
    job: &Job<'_>,
    subject: &Subject,
    before: Option<Before>,
    done: &mut Done,
    tell: Tell<'_>,
) -> Result<(), Failure> {
    let stored = if job.store {
        configured(master, subject, |lss| {
            done.stored = Stage::Sent;
            let result = lss.store();
            done.stored = stage_of(&result);
            result.map_err(|error| subject.lss_failure(error))
        })
    } else {
        Ok(())
    };
    put_back(master, before, tell);
    stored
}

/// Follows the device to the new rate, and looks for it there.
fn follow(master: &mut Master<'_>, subject: &Subject, rates: Rates, begun: Mono) -> Result<(), Failure> {
    wait(master, begun + DELAY + MARGIN)?;
    set(master, rates.new)?;
    wait(master, begun + DELAY * 2 + MARGIN)?;
    match is_there(master, subject, subject.node)? {
        true => Ok(()),
        false => {
            let message = format!("it does not answer at {}", spoken_rate(rates.new));
            Err(subject.failure(Kind::NoAnswer, message))
        }
    }
}

fn set(master: &mut Master<'_>, bit_rate: u32) -> Result<(), Failure> {
    let name = master.bus().name().to_owned();
    master.set_bit_rate(bit_rate).map_err(|error| not_set(error, &by_hand(&name, Some(bit_rate))))
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

/// Whether the device answers at the bit rate that the bus has now.
fn is_there(master: &mut Master<'_>, subject: &Subject, node: Option<NodeId>) -> Result<bool, Failure> {
    let until = master.now() + PROBE;
    master.listen(&Filters::All)?;
    loop {
        let found = match node {
            Some(node) => presence(master, node).map(|found| match found {
                Presence::One(found) => subject.address.is_none_or(|address| address == found),
                Presence::Nameless => subject.address.is_none(),
                Presence::Several(_) | Presence::Nobody(_) => false,
            }),
            None => configured(master, subject, |_| Ok(())).map(|()| true),
        };
        match found {
            Ok(true) => return Ok(true),
            Ok(false) => {}
            // Nobody acknowledges at this rate, or the interface is not up yet.
            Err(failure) if matches!(failure.kind, Kind::Bus | Kind::NoAnswer) => {}
            Err(failure) => return Err(failure),
        }
        let now = master.now();
        if now >= until {
            return Ok(false);
        }
        wait(master, now + MARGIN)?;
    }
}

/// The host back to the old rate; what became of the device, and what brings it back.
fn go_back(master: &mut Master<'_>, subject: &Subject, rates: Rates, failure: Failure, done: &mut Done) -> Failure {
    let (old, new) = (spoken_rate(rates.old), spoken_rate(rates.new));
    if master.bus().bit_rate() != Some(rates.old)
        && let Err(error) = set(master, rates.old)
    {
        let message = format!("{}; and this side could not be set back to {old}: {}", failure.message, error.message);
        return Failure { message, hint: Some(by_hand(master.bus().name(), Some(rates.old))), ..failure };
    }
    let found = is_there(master, subject, subject.node);
    if !matches!(found, Ok(true)) {
        let message = format!("{}; this side is back at {old}", failure.message);
        let hint = format!("nothing was stored: power off and on brings the device back to {old}");
        return Failure { message, ..failure }.hint(hint);
    }
    // It has stayed. What waits in it would come with the next reset.
    let description = subject.model.as_ref().map(|model| &model.description);
    let index = RateTable::of(description).index_of(rates.old);
    let undone = index.is_some_and(|index| {
        let undo = configured(master, subject, |lss| {
            lss.configure_bit_timing(0, index).map_err(|error| subject.lss_failure(error))
        });
        undo.is_ok()
    });
    if let (true, Some((_, _, stage))) = (undone, &mut done.rate) {
        *stage = Stage::Undone;
    }
    let message = format!("{}: it answers at {old} still, and this side is back there", failure.message);
    Failure { message, ..failure }.hint(format!("whether it has {new} at all, its manual tells"))
}

/// The way of devices that have to store before the new rate is in force.
fn by_storing(
    master: &mut Master<'_>,
    job: &Job<'_>,
    subject: &Subject,
    way: &AssignEntry,
    rates: Rates,
    done: &mut Done,
    tell: Tell<'_>,
) -> Result<(), Failure> {
    let new = spoken_rate(rates.new);
    if way.applies == Applies::Power || !job.store {
        let why = if job.store { "it takes the new rate at power on" } else { "it takes the new rate after storing" };
        return Err(subject
            .failure(Kind::CheckFailed, format!("{why}, which --retime cannot wait for: nothing was changed"))
            .hint("without --retime, and the interface by hand"));
    }
    let message = format!("{} stores before it goes to {new}: there is no way back from here", subject.name());
    tell(Note::Warning(message));
    by_objects(master, subject, way, true, done)?;
    master.send(NmtCommand::ResetNode.frame(subject.node));
    wait(master, master.now() + MARGIN)?;
    set(master, rates.new)?;
    done.retimed = true;
    let node = job.id.or(subject.node);
    if is_there(master, subject, node)? {
        return Ok(());
    }
    let back = set(master, rates.old).err().map_or_else(
        || format!("this side is back at {}", spoken_rate(rates.old)),
        |error| format!("this side is at {new}: {}", error.message),
    );
    done.retimed = false;
    let message = format!("stored and reset, and it does not answer at {new}; {back}");
    let name = master.bus().name().to_owned();
    Err(subject.failure(Kind::NoAnswer, message).hint(format!("find its rate: cangauge bus detect {name} --active")))
}

