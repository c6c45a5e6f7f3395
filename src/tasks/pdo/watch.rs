//! TPDOs as they come, decoded.

use crate::bus::{BusError, Filters, Mono, Stamp};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::Life;
use crate::canopen::pdo::TpdoNumber;
use crate::master::{Error, Happening, Master};
use crate::measure::decode::{Decoded, Decoder};
use crate::measure::sample::{Sample, Source};
use crate::node::Overrides;
use crate::node::survey::survey_nodes;
use crate::tasks::{Failure, Kind};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// When nothing comes for this long after the start, it is said.
const PATIENCE: Duration = Duration::from_secs(5);

/// Something that was seen.
#[derive(Clone, Copy, Debug)]
pub enum Line<'a> {
    /// A TPDO: its samples and what each is of.
    Pdo {
        /// When it was received.
        at: Stamp,
        /// Who sent it.
        node: NodeId,
        /// Which one.
        number: TpdoNumber,
        /// What it carried, in the order of its bytes.
        samples: &'a [Sample],
        /// The sources of samples, by their numbers.
        sources: &'a [Source],
    },
    /// A TPDO whose length is not that of its mapping.
    WrongLength {
        /// When it was received.
        at: Stamp,
        /// Who sent it.
        node: NodeId,
        /// Which one.
        number: TpdoNumber,
        /// How many bytes it had.
        length: usize,
    },
    /// A node restarted: its mapping may be another one now.
    Restarted(NodeId),
    /// Nothing has come so far.
    Nothing,
}

/// Shows the TPDOs of the nodes until `until`, or until the user or `tell` ends it. NMT is left alone.
///
/// # Errors
/// A node that does not answer, what stops everything, and not one TPDO until the end.
pub fn watch(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    overrides: &Overrides,
    duration: Option<Duration>,
    tell: &mut dyn FnMut(&Line<'_>) -> ControlFlow<()>,
) -> Result<(), Failure> {
    master.listen_to(nodes)?;
    let instruments = survey_nodes(master, nodes, overrides)?;
    let mut decoder = Decoder::default();
    let mut numbers: BTreeMap<CanId, TpdoNumber> = BTreeMap::new();
    for instrument in &instruments {
        decoder.add(instrument.layout(), &[]);
        let valid = instrument.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
        numbers.extend(valid.map(|tpdo| (tpdo.cob_id.can_id(), tpdo.number)));
    }
    let nothing = || {
        let are = if nodes.len() == 1 { "is it" } else { "are they" };
        let all = nodes.iter().map(NodeId::to_string).collect::<Vec<_>>().join(",");
        let first = nodes.first().map(NodeId::to_string).unwrap_or_default();
        let hint =
            format!("{are} started, and does somebody send SYNC? cangauge pdo show {first}; cangauge nmt start {all}");
        Failure::new(Kind::NoAnswer, "not one TPDO came").hint(hint)
    };
    let ids = numbers.keys().copied().chain(nodes.iter().map(|&node| CanId::heartbeat(node)));
    master.listen(&Filters::Only(ids.collect()))?;
    let begun = master.now();
    let end = duration.map_or(Mono::at(Duration::MAX), |duration| begun + duration);
    let (mut came, mut samples) = (false, Vec::new());
    let mut next = end.min(begun + PATIENCE);
    loop {
        let flow = match master.next(next)? {
            Happening::Frame(received) => {
                let (at, id) = (received.at, received.frame.id());
                samples.clear();
                match (decoder.decode(&received, &mut samples), numbers.get(&id)) {
                    (Decoded::Tpdo(node), Some(&number)) => {
                        came = true;
                        tell(&Line::Pdo { at, node, number, samples: &samples, sources: decoder.sources() })
                    }
                    (Decoded::WrongLength(node), Some(&number)) => {
                        came = true;
                        tell(&Line::WrongLength { at, node, number, length: received.frame.data().len() })
                    }
                    _ => match Life::parse(&received.frame) {
                        Some((node, Life::BootUp)) if nodes.contains(&node) => tell(&Line::Restarted(node)),
                        _ => ControlFlow::Continue(()),
                    },
                }
            }
            Happening::Ended => return if came { Ok(()) } else { Err(nothing()) },
            Happening::Deadline if next == end => return if came { Ok(()) } else { Err(nothing()) },
            Happening::Deadline => {
                next = end;
                if came { ControlFlow::Continue(()) } else { tell(&Line::Nothing) }
            }
            Happening::Interrupted if came => return Ok(()),
            Happening::Interrupted => return Err(Error::Interrupted.into()),
            Happening::Link(false) => return Err(BusError::Down(master.bus().name().to_owned()).into()),
            Happening::Sdo(..) | Happening::Fault(..) | Happening::Dropped(_) | Happening::Link(true) => {
                ControlFlow::Continue(())
            }
        };
        if flow.is_break() {
            return Ok(());
        }
    }
}
