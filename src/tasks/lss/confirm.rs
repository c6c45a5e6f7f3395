//! Whether the device holds what it acknowledged: it is reset, and shows itself under its new node-ID.

use super::presence::{Presence, next, presence};
use super::subject::Subject;
use crate::bus::Filters;
use crate::bus::time::spoken;
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{Life, NmtCommand};
use crate::master::{Happening, Master};
use crate::tasks::{Failure, Kind};
use std::time::Duration;

/// The longest wait for a boot-up: no manual gives a time, and what is stored may be written before it.
const BOOT_TIME: Duration = Duration::from_secs(5);

/// What confirms the new setting.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Confirmed {
    /// The boot-up under the new node-ID, and the identity read under it.
    BootUp,
    /// The identity read under the new node-ID, or at the new bit rate.
    Identity,
    /// The device has acknowledged it; it comes into force later.
    Acknowledge,
}

impl Confirmed {
    /// As it stands in the output.
    pub fn as_str(self) -> &'static str {
        match self {
            Confirmed::BootUp => "boot-up",
            Confirmed::Identity => "identity",
            Confirmed::Acknowledge => "ack",
        }
    }
}

/// Resets `reset`, where that is asked for, and waits for the device to show itself as `new`. Returns what confirms
/// it, and how long the boot-up took.
///
/// # Errors
/// A device that does not come back, comes back as it was, or shares its new node-ID with another one.
pub(super) fn confirm(
    master: &mut Master<'_>,
    subject: &Subject,
    new: NodeId,
    reset: Option<NodeId>,
    booted_already: bool,
) -> Result<(Confirmed, Option<Duration>), Failure> {
    master.listen(&Filters::All)?;
    let begun = master.now();
    if let Some(old) = reset {
        master.send(NmtCommand::ResetNode.frame(Some(old)));
    }
    let after = if booted_already { Some(Duration::ZERO) } else { boot_up(master, new, begun)? };
    let by = if after.is_some() { Confirmed::BootUp } else { Confirmed::Identity };
    let failed = |kind, message: String| Err(Failure::of_node(kind, new, message));
    match presence(master, new)? {
        Presence::One(found) if subject.address.is_none_or(|address| address == found) => Ok((by, after)),
        Presence::One(found) => failed(Kind::Unexpected, format!("{found} answers there, another device")),
        Presence::Nameless if subject.address.is_none() && after.is_some() => Ok((by, after)),
        Presence::Nameless => failed(Kind::Unexpected, "whoever answers there does not tell who it is".to_owned()),
        Presence::Several(sign) => failed(Kind::Unexpected, format!("{sign}: more than one device has this node-ID")),
        Presence::Nobody(waited) if after.is_some() => {
            failed(Kind::NoAnswer, format!("boot-up seen, and then no answer within {}", spoken(waited)))
        }
        Presence::Nobody(_) => Err(lost(master, subject, new, reset)?),
    }
}

fn boot_up(master: &mut Master<'_>, new: NodeId, begun: crate::bus::Mono) -> Result<Option<Duration>, Failure> {
    let until = begun + BOOT_TIME.max(master.timing().timeout);
    loop {
        match next(master, until)? {
            Happening::Frame(received) if Life::parse(&received.frame) == Some((new, Life::BootUp)) => {
                return Ok(Some(received.at.mono.since(begun)));
            }
            Happening::Deadline => return Ok(None),
            _ => {}
        }
    }
}

/// Where a device is that does not show itself as `new`.
fn lost(master: &mut Master<'_>, subject: &Subject, new: NodeId, reset: Option<NodeId>) -> Result<Failure, Failure> {
    if let Some(old) = reset.filter(|old| *old != new)
        && let Presence::One(found) = presence(master, old)?
        && subject.address.is_none_or(|address| address == found)
    {
        let message = format!("it has been reset and is still node {old}, not {new}");
        return Ok(subject.failure(Kind::Unexpected, message));
    }
    Ok(subject.failure(Kind::NoAnswer, format!("no boot-up and no answer as node {new} within {}", spoken(BOOT_TIME))))
}
