//! Receives and decodes TPDOs.

use super::failure::PdoFailure;
use crate::bus::{BusError, Filters, Mono, Received, Stamp};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::nmt::Life;
use crate::canopen::pdo::TpdoNumber;
use crate::master::{Error, Happening, Master};
use crate::measure::decode::{Decoded, Decoder};
use crate::measure::layout::Tpdo;
use crate::measure::sample::{Sample, Source};
use crate::node::Overrides;
use crate::node::survey::{SETUP_TIMEOUT, survey_each};
use crate::node::wait::{Policy, Until, Waiter, run};
use crate::tasks::Failure;
use crate::tasks::log::{LogFailure, SetupListener};
use std::collections::BTreeMap;
use std::ops::ControlFlow;
use std::time::Duration;

/// After this time without a TPDO, that is reported once.
const FIRST_TPDO_TIMEOUT: Duration = Duration::from_secs(5);

/// An event while TPDOs are received.
#[derive(Clone, Copy, Debug)]
pub enum WatchEvent<'a> {
    /// A TPDO, decoded.
    Tpdo {
        /// When it was received.
        at: Stamp,
        /// The node that sent it.
        node: NodeId,
        /// The TPDO.
        number: TpdoNumber,
        /// Its values, in the order of its bytes.
        samples: &'a [Sample],
        /// The sources of the decoder: each sample contains the number of its source.
        sources: &'a [Source],
    },
    /// A TPDO with a length different from its mapping.
    WrongLength {
        /// When it was received.
        at: Stamp,
        /// The node that sent it.
        node: NodeId,
        /// The TPDO.
        number: TpdoNumber,
        /// Its length in bytes.
        length: usize,
    },
    /// A node restarted: its mapping may have changed.
    Restarted(NodeId),
    /// The mapping of a node could not be read: its TPDOs are not shown.
    Failed(&'a Failure),
    /// No TPDO was received so far.
    NothingYet,
}

/// Shows the TPDOs of the nodes until the time has passed, or until Ctrl-C or `on_event` ends it. Sends no NMT command.
/// Returns the failures of the nodes whose mapping could not be read; the other nodes are shown. In a recording, the
/// mapping comes from its SDO traffic or from a description that the user named.
///
/// # Errors
/// [`PdoFailure::NothingReceived`]; bus errors, and Ctrl-C before the first TPDO.
pub fn watch(
    master: &mut Master<'_>,
    nodes: &[NodeId],
    overrides: &Overrides,
    duration: Option<Duration>,
    on_event: &mut dyn FnMut(&WatchEvent<'_>) -> ControlFlow<()>,
) -> Result<Vec<Failure>, Failure> {
    let end_after = |start: Mono| duration.map_or(Mono::at(Duration::MAX), |duration| start + duration);
    if !master.bus().is_live() {
        let setup = SetupListener::new(nodes, overrides, &[]);
        let mut watcher = Watcher::new(nodes.to_vec(), end_after(master.now()), on_event);
        watcher.learn(setup, overrides);
        run(master, Policy::Record, &mut watcher)?;
        return Ok(Vec::new());
    }
    master.listen_to(nodes)?;
    let (mut surveyed, mut failures) = (Vec::new(), Vec::new());
    master.limit_transfers(duration.map(|duration| duration.saturating_add(SETUP_TIMEOUT)));
    let results = survey_each(master, nodes, overrides)?;
    master.limit_transfers(None);
    for result in results {
        match result {
            Ok(node) => surveyed.push(node),
            Err(error) => failures.push(Failure::from(error)),
        }
    }
    if surveyed.is_empty() {
        return Ok(failures);
    }
    for failure in &failures {
        if on_event(&WatchEvent::Failed(failure)).is_break() {
            return Ok(failures);
        }
    }
    let nodes: Vec<NodeId> = surveyed.iter().map(|node| node.id).collect();
    let start = master.now();
    let mut watcher = Watcher::new(nodes, end_after(start), on_event);
    watcher.next = watcher.end.min(start + FIRST_TPDO_TIMEOUT);
    for node in &surveyed {
        watcher.decoder.add(node.layout(), &[]);
        watcher.number(&node.tpdos);
    }
    let ids = watcher.numbers.keys().copied().chain(watcher.nodes.iter().map(|&node| CanId::heartbeat(node)));
    master.listen(&Filters::Only(ids.collect()))?;
    run(master, Policy::Record, &mut watcher)?;
    Ok(failures)
}

struct Watcher<'a> {
    nodes: Vec<NodeId>,
    /// Reads the mappings from a recording.
    setup: Option<SetupListener>,
    decoder: Decoder,
    numbers: BTreeMap<CanId, TpdoNumber>,
    samples: Vec<Sample>,
    end: Mono,
    /// The end, or the time to report that nothing was received.
    next: Mono,
    has_received: bool,
    on_event: &'a mut dyn FnMut(&WatchEvent<'_>) -> ControlFlow<()>,
}

impl<'a> Watcher<'a> {
    fn new(
        nodes: Vec<NodeId>,
        end: Mono,
        on_event: &'a mut dyn FnMut(&WatchEvent<'_>) -> ControlFlow<()>,
    ) -> Watcher<'a> {
        let (decoder, numbers, samples) = (Decoder::default(), BTreeMap::new(), Vec::new());
        Watcher { nodes, setup: None, decoder, numbers, samples, end, next: end, has_received: false, on_event }
    }

    /// Keeps the numbers of TPDOs for their COB-IDs.
    fn number(&mut self, tpdos: &[Tpdo]) {
        let valid = tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid());
        self.numbers.extend(valid.map(|tpdo| (tpdo.cob_id.can_id(), tpdo.number)));
    }

    /// Reads the mappings from the recording; first from the descriptions that the user named.
    fn learn(&mut self, mut setup: SetupListener, overrides: &Overrides) {
        setup.apply_overrides(&mut self.decoder);
        overrides.keys().for_each(|&node| self.number(&setup.known_node(node).tpdos));
        self.setup = Some(setup);
    }

    fn on_frame(&mut self, received: &Received) -> ControlFlow<()> {
        let at = received.at;
        if let Some(setup) = &mut self.setup {
            if let Some(node) = setup.take(received, &mut self.decoder) {
                let tpdos = setup.known_node(node).tpdos;
                self.number(&tpdos);
            } else if let Some((node, Life::BootUp)) = Life::parse(&received.frame) {
                setup.forget(node, &mut self.decoder);
            }
        }
        self.samples.clear();
        let decoded = self.decoder.decode(received, &mut self.samples);
        match (decoded, self.numbers.get(&received.frame.id())) {
            (Decoded::Tpdo(node), Some(&number)) => {
                self.has_received = true;
                let (samples, sources) = (&self.samples, self.decoder.sources());
                (self.on_event)(&WatchEvent::Tpdo { at, node, number, samples, sources })
            }
            (Decoded::WrongLength(node), Some(&number)) => {
                self.has_received = true;
                let length = received.frame.data().len();
                (self.on_event)(&WatchEvent::WrongLength { at, node, number, length })
            }
            _ => match Life::parse(&received.frame) {
                Some((node, Life::BootUp)) if self.nodes.contains(&node) => {
                    (self.on_event)(&WatchEvent::Restarted(node))
                }
                _ => ControlFlow::Continue(()),
            },
        }
    }

    /// The result at the end.
    fn result(&self) -> Result<ControlFlow<()>, Failure> {
        if self.has_received {
            return Ok(ControlFlow::Break(()));
        }
        if let Some(&node) = self.setup.as_ref().and_then(|setup| setup.not_understood.first()) {
            return Err(Failure::at(node, LogFailure::UnknownMapping));
        }
        // Nothing can be done for the nodes of a recording.
        let nodes = if self.setup.is_some() { Vec::new() } else { self.nodes.clone() };
        Err(Failure::general(PdoFailure::NothingReceived { nodes }))
    }
}

impl Waiter for Watcher<'_> {
    type Output = ();
    type Error = Failure;

    fn until(&self) -> Until {
        Until::Deadline(self.next)
    }

    fn on_event(&mut self, master: &mut Master<'_>, event: Happening) -> Result<ControlFlow<()>, Failure> {
        Ok(match event {
            Happening::Frame(received) => self.on_frame(&received),
            Happening::Ended => return self.result(),
            Happening::Deadline if self.next == self.end => return self.result(),
            Happening::Deadline => {
                self.next = self.end;
                match self.has_received {
                    true => ControlFlow::Continue(()),
                    false => (self.on_event)(&WatchEvent::NothingYet),
                }
            }
            Happening::Interrupted if self.has_received => ControlFlow::Break(()),
            Happening::Interrupted => return Err(Error::Interrupted.into()),
            Happening::Link(false) => return Err(BusError::Down(master.bus().name().to_owned()).into()),
            Happening::Sdo(..) | Happening::Fault(..) | Happening::Dropped(_) | Happening::Link(true) => {
                ControlFlow::Continue(())
            }
        })
    }
}
