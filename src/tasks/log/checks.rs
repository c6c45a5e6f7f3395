//! Checks before a recording changes anything.

use super::{Mode, Plan};
use crate::bus::BusError;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::booted;
use crate::canopen::pdo::Transmission;
use crate::master::{Error, Happening, Master};
use crate::measure::decode::Wanted;
use crate::node::Node;
use crate::tasks::{Failure, Kind};
use std::collections::BTreeSet;
use std::time::Duration;

/// Every requested signal must exist, and must be mapped into a TPDO unless it is polled.
pub(super) fn check_wanted(instruments: &[Node], plan: &Plan) -> Result<(), Failure> {
    let polled = matches!(plan.mode, Mode::Poll(_));
    for item in &plan.wanted {
        let carried = |instrument: &Node| {
            let entries = || {
                let valid = instrument.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
                valid.flat_map(|tpdo| &tpdo.mapping)
            };
            match item {
                Wanted::Signal(name) => instrument.mapped_signals().any(|signal| signal.name == *name),
                Wanted::Object(object) => entries().any(|entry| entry.object == *object),
                Wanted::Status(name) => instrument
                    .signals
                    .iter()
                    .filter(|signal| signal.name == *name)
                    .any(|signal| entries().any(|entry| Some(entry.object) == signal.status)),
            }
        };
        if !instruments.iter().any(carried) {
            let has = |name: &str, told: bool| {
                let signals = instruments.iter().flat_map(|instrument| &instrument.signals);
                signals.filter(|signal| signal.name == name).any(|signal| !told || signal.status.is_some())
            };
            let name = match item {
                Wanted::Signal(name) | Wanted::Status(name) if !has(name, false) => {
                    let mut names: Vec<&str> = Vec::new();
                    for signal in instruments.iter().flat_map(|instrument| &instrument.signals) {
                        if !names.contains(&signal.name.as_str()) {
                            names.push(&signal.name);
                        }
                    }
                    return Err(Failure::new(Kind::Usage, format!("no node has a signal \"{name}\""))
                        .hint(format!("there are: {}", names.join(", "))));
                }
                Wanted::Status(name) if !has(name, true) => {
                    let message = format!("no node has an object that tells the status of {name}");
                    return Err(Failure::new(Kind::Usage, message));
                }
                Wanted::Signal(name) => name.clone(),
                Wanted::Status(name) => format!("{name}.status"),
                Wanted::Object(object) => object.to_string(),
            };
            if polled {
                continue;
            }
            return Err(Failure::new(Kind::Unexpected, format!("no TPDO carries {name}"))
                .hint("read it by SDO instead: add --poll 100ms"));
        }
    }
    Ok(())
}

/// Refuses if another node sends SYNC: two SYNC producers would double every synchronous TPDO. Adds nodes that restart
/// meanwhile to `restarted`.
pub(super) fn refuse_second_sync(
    master: &mut Master<'_>,
    instruments: &[Node],
    period: Duration,
    restarted: &mut BTreeSet<NodeId>,
) -> Result<(), Failure> {
    let ids: BTreeSet<CanId> = instruments.iter().map(|instrument| instrument.sync).collect();
    if ids.len() > 1 {
        return Err(Failure::new(Kind::CheckFailed, "the nodes listen to different SYNC identifiers (1005h)"));
    }
    let length = (period * 3).clamp(Duration::from_millis(200), Duration::from_secs(2));
    let until = master.now() + length;
    loop {
        match master.next(until)? {
            Happening::Frame(received) if ids.contains(&received.frame.id()) && !received.frame.is_remote() => {
                return Err(Failure::new(
                    Kind::CheckFailed,
                    "somebody else sends SYNC on this bus: nothing was started",
                )
                .hint("leave --sync out: the nodes send on the SYNC that is there"));
            }
            Happening::Frame(received) => restarted.extend(booted(&received.frame)),
            Happening::Deadline => return Ok(()),
            Happening::Interrupted => return Err(Error::Interrupted.into()),
            Happening::Link(false) => return Err(BusError::Down(master.bus().name().to_owned()).into()),
            _ => {}
        }
    }
}

/// The share of the bus (0 to 1) that SYNC at this interval and the TPDOs after it take, at the greatest frame length;
/// `None` if the bit rate is unknown.
pub(super) fn sync_share(master: &Master<'_>, instruments: &[Node], period: Duration) -> Option<f64> {
    let bit_rate = master.bus().bit_rate()?;
    let tpdos = instruments.iter().flat_map(|instrument| &instrument.tpdos).filter(|tpdo| tpdo.cob_id.is_valid());
    let answers = tpdos.filter_map(|tpdo| match tpdo.transmission? {
        Transmission::AcyclicSync => Some(MAX_FRAME_BITS),
        Transmission::Sync(every) => Some(MAX_FRAME_BITS / f64::from(every)),
        _ => None,
    });
    Some((SYNC_BITS + answers.sum::<f64>()) / f64::from(bit_rate) / period.as_secs_f64())
}

/// A frame with eight bytes, all stuff bits, and the interframe space.
const MAX_FRAME_BITS: f64 = 135.0;

/// A frame without data, some stuff bits, and the interframe space.
const SYNC_BITS: f64 = 50.0;
