//! Who answers under a node-ID: one device, none, or more than one.

use crate::bus::{BusError, Fault, Filters};
use crate::canopen::id::NodeId;
use crate::canopen::lss::LssAddress;
use crate::canopen::nmt::Life;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::master::{Error, Happening, Master, Request, SdoError, SdoFailure};
use crate::tasks::{Failure, Kind};
use std::time::Duration;

const DEVICE_TYPE: ObjectId = ObjectId::new(0x1000, 0);
const IDENTITY: u16 = 0x1018;

/// How often an identity is read: answers of two devices that merge once do not merge each time.
const ROUNDS: usize = 3;

/// How long after an identity was read a second answer to it is waited for.
const ECHO: Duration = Duration::from_millis(50);

/// How long signs of life are waited for under a node-ID that shall be free: the usual heartbeat comes once a second.
pub(super) const LISTEN: Duration = Duration::from_millis(1100);

/// What is found under a node-ID.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Presence {
    /// One device, with this identity.
    One(LssAddress),
    /// One device, as far as can be seen, that has no identity to tell it from another.
    Nameless,
    /// More than one device, and what shows it.
    Several(String),
    /// Nobody answers.
    Nobody(Duration),
}

/// Reads the identity (1018h) of a node several times, and looks for every sign that two devices answer: answers
/// that come twice, that differ from one time to the next, or that collide.
///
/// # Errors
/// What stops everything, and a device that does not tell its identity for another reason than not to have one.
pub(super) fn presence(master: &mut Master<'_>, node: NodeId) -> Result<Presence, Failure> {
    master.listen(&Filters::All)?;
    let mut found: Option<[Option<u32>; 4]> = None;
    for _ in 0..ROUNDS {
        let mut parts = [None; 4];
        for (part, sub) in parts.iter_mut().zip(1..) {
            let mut ear = Ear::default();
            *part = match ear.read(master, node, ObjectId::new(IDENTITY, sub))? {
                Ok(number) => Some(number),
                Err(SdoError { failure: SdoFailure::Refused(_) | SdoFailure::Fit(_), .. }) => None,
                Err(SdoError { failure: SdoFailure::NoAnswer { waited, .. }, .. }) => {
                    return Ok(match ear.collided {
                        true => Presence::Several("its answers collide".to_owned()),
                        false => Presence::Nobody(waited),
                    });
                }
                Err(error) => return Err(error.into()),
            };
            if sub == 4 {
                ear.listen(master, node, ECHO)?;
            }
            if let Some(sign) = ear.sign() {
                return Ok(Presence::Several(sign.to_owned()));
            }
        }
        if found.is_some_and(|found| found != parts) {
            return Ok(Presence::Several("its answers differ from one time to the next".to_owned()));
        }
        found = Some(parts);
    }
    Ok(match found.unwrap_or_default() {
        [Some(vendor), Some(product), Some(revision), Some(serial)] if serial != 0 => {
            Presence::One(LssAddress { vendor, product, revision, serial })
        }
        _ => Presence::Nameless,
    })
}

/// What is heard on a node's SDO channel beside the answers that were asked for.
#[derive(Default)]
struct Ear {
    doubled: bool,
    others: bool,
    collided: bool,
}

impl Ear {
    fn sign(&self) -> Option<&'static str> {
        match self {
            Ear { others: true, .. } => Some("another master talks to it, so that answers cannot be told apart"),
            Ear { doubled: true, .. } => Some("its answers come twice"),
            Ear { collided: true, .. } => Some("its answers collide"),
            Ear { doubled: false, others: false, collided: false } => None,
        }
    }

    fn take(&mut self, happening: &Happening, node: NodeId) {
        match happening {
            Happening::Frame(received) => {
                let id = received.frame.id();
                self.doubled |= id.sdo_response_node() == Some(node);
                self.others |= id.sdo_request_node() == Some(node);
            }
            Happening::Fault(fault, _) => self.collided |= is_collision(*fault),
            _ => {}
        }
    }

    fn read(
        &mut self,
        master: &mut Master<'_>,
        node: NodeId,
        object: ObjectId,
    ) -> Result<Result<u32, SdoError>, Failure> {
        let mine = master.start(Request::read(node, object));
        let far = master.now() + Duration::from_secs(3600);
        loop {
            let happening = next(master, far)?;
            if let Happening::Sdo(ticket, result) = happening {
                if ticket == mine {
                    let value = result.and_then(|answer| answer.value(node, object, Some(DataType::Unsigned(4))));
                    let number = value.map(|(value, _)| value.as_u64().and_then(|number| u32::try_from(number).ok()));
                    return Ok(number.map(Option::unwrap_or_default));
                }
            } else {
                self.take(&happening, node);
            }
        }
    }

    fn listen(&mut self, master: &mut Master<'_>, node: NodeId, length: Duration) -> Result<(), Failure> {
        let until = master.now() + length;
        loop {
            match next(master, until)? {
                Happening::Deadline => return Ok(()),
                happening => self.take(&happening, node),
            }
        }
    }
}

/// Whether a fault is what two senders at once look like.
pub(super) fn is_collision(fault: Fault) -> bool {
    matches!(fault, Fault::Protocol | Fault::ErrorPassive | Fault::BusOff)
}

/// The next thing that happens; what ends everything is an error.
pub(super) fn next(master: &mut Master<'_>, until: crate::bus::Mono) -> Result<Happening, Failure> {
    match master.next(until)? {
        Happening::Interrupted => {
            master.cancel();
            Err(Error::Interrupted.into())
        }
        Happening::Link(false) => Err(BusError::Down(master.bus().name().to_owned()).into()),
        happening => Ok(happening),
    }
}

/// What shows that a node-ID is taken: an SDO answer, a heartbeat or a boot-up. A node that is stopped and has no
/// heartbeat shows nothing.
///
/// # Errors
/// What stops everything.
pub(super) fn taken(master: &mut Master<'_>, node: NodeId) -> Result<Option<&'static str>, Failure> {
    master.listen(&Filters::All)?;
    let wait = master.timing().timeout.min(LISTEN / 3);
    let begun = master.now();
    let until = begun + LISTEN;
    // Asked twice: one request or its answer may be lost.
    let requests = [(); 2].map(|()| Request::read(node, DEVICE_TYPE).once().within(wait));
    let tickets = requests.map(|request| master.start(request));
    let mut open = tickets.len();
    while open > 0 || master.now() < until {
        let at_most = if open > 0 { begun + Duration::from_secs(3600) } else { until };
        match next(master, at_most)? {
            Happening::Sdo(ticket, result) if tickets.contains(&ticket) => {
                open -= 1;
                match result {
                    Err(SdoError { failure: SdoFailure::NoAnswer { .. } | SdoFailure::Cancelled, .. }) => {}
                    Ok(_) | Err(_) => {
                        master.forget(tickets.into_iter());
                        return Ok(Some("a node answers there"));
                    }
                }
            }
            Happening::Frame(received) => {
                if let Some((alive, _)) = Life::parse(&received.frame)
                    && alive == node
                {
                    master.forget(tickets.into_iter());
                    return Ok(Some("a node shows itself there"));
                }
            }
            _ => {}
        }
    }
    Ok(None)
}

/// That there is one device under a node-ID.
///
/// # Errors
/// [`Kind::CheckFailed`] where there is more than one, or none that can be told from another.
pub(super) fn only_one(master: &mut Master<'_>, node: NodeId) -> Result<LssAddress, Failure> {
    match presence(master, node)? {
        Presence::One(address) => Ok(address),
        Presence::Nameless => Err(Failure::of_node(
            Kind::CheckFailed,
            node,
            "it has no serial number that tells it from another device: nothing was changed",
        )
        .hint("connect it alone, and name it \"only\"")),
        Presence::Several(sign) => {
            let message = format!("{sign}: more than one device has this node-ID, it seems; nothing was changed");
            Err(Failure::of_node(Kind::CheckFailed, node, message).hint(SEVERAL))
        }
        Presence::Nobody(waited) => {
            let message = format!("no answer within {}: nothing was changed", crate::bus::time::spoken(waited));
            Err(Failure::of_node(Kind::NoAnswer, node, message).hint("who is there: cangauge lss scan"))
        }
    }
}

/// The way out where two devices have one node-ID.
pub(super) const SEVERAL: &str = "connect one at a time, or name each by its identity from the label: \
    cangauge lss set-id VENDOR:PRODUCT:REVISION:SERIAL NEW";
