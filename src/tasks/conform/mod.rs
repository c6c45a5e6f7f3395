//! Checks a device against CiA 301, CiA 305 and CiA 404.
//!
//! One table of [`Case`]s runs the cases, lists them and is printed in the manual page. Each case returns a
//! [`Verdict`]. What a case changes is restored after it.

mod alone;
mod case;
mod cia404;
mod codes;
mod eds;
mod emcy;
mod error_control;
mod failure;
mod figure;
mod finding;
mod history;
mod lss;
mod nmt;
mod od;
mod pdo;
mod sdo;
mod session;
mod settings;
mod stimulus;
mod store;
mod timing;

pub use case::{Area, Case, Needs, Severity};
pub use failure::{ConformEffect, ConformFailure};
pub use figure::{Figure, Statistic};
pub use finding::{Expected, Finding, Seen, Verdict, WhyNot};
pub use history::{ErrorEntries, HistoryChange};
pub use lss::LssSetting;
pub use stimulus::{Input, Stimulus, StimulusFailure};

use crate::bus::{Filters, Stamp};
use crate::canopen::id::NodeId;
use crate::canopen::nmt::{NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::device::description::Deviation;
use crate::device::eds::Eds;
use crate::master::Master;
pub use crate::master::{RecordedFrame, Transcript};
use crate::node::{Error, Node, Overrides, state};
use crate::tasks::config::{self, Journal};
use crate::tasks::settings::open;
use crate::tasks::{Failure, Kind};
use session::Session;
use std::sync::Arc;
use std::time::Duration;

/// All cases, in the order in which they run.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    let sdo = [sdo::CASES, sdo::segments::CASES, sdo::general::CASES, sdo::blocks::CASES];
    let others = [od::CASES, nmt::CASES, error_control::CASES, pdo::CASES, pdo::mapping::CASES, pdo::locks::CASES];
    let lower = [emcy::CASES, store::CASES, lss::CASES];
    let cia404 = [
        cia404::values::CASES,
        cia404::unit::CASES,
        cia404::digits::CASES,
        cia404::filter::CASES,
        cia404::step::CASES,
        cia404::autozero::CASES,
        cia404::events::CASES,
        cia404::overload::CASES,
    ];
    sdo.into_iter().chain(others).chain(lower).chain(cia404).chain([eds::CASES, timing::CASES]).flatten()
}

/// What to check.
#[derive(Clone, Debug, Default)]
pub struct ConformOptions {
    /// Run only the cases of these areas. All areas if empty.
    pub only: Vec<Area>,
    /// The numbers of cases that are not run.
    pub skip: Vec<String>,
    /// Also run the cases that write to non-volatile memory, set the node-ID or the bit rate, or execute autozero.
    pub store: bool,
    /// The EDS file that is compared with the device.
    pub eds: Option<Arc<Eds>>,
}

impl ConformOptions {
    /// The cases to run.
    pub fn selected(&self) -> impl Iterator<Item = &'static Case> + '_ {
        cases()
            .filter(|case| self.only.is_empty() || self.only.contains(&case.area))
            .filter(|case| !self.skip.iter().any(|id| id == case.id))
    }
}

/// The result of one case.
#[derive(Clone, Debug)]
pub struct CaseResult {
    /// The case.
    pub case: &'static Case,
    /// The verdict.
    pub verdict: Verdict,
    /// The page of the manual that documents this deviation.
    pub known: Option<String>,
    /// The frames of the case.
    pub transcript: Transcript,
    /// How long it took.
    pub length: Duration,
    /// Settings that do not have the values from before the case.
    pub not_restored: Vec<ObjectId>,
}

impl CaseResult {
    /// Whether the device deviates in a way that its manual does not state.
    pub fn is_new_deviation(&self) -> bool {
        matches!(self.verdict, Verdict::Deviates(_)) && self.known.is_none()
    }
}

/// The NMT state after the check.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StateAfter {
    /// No NMT command was sent.
    Unchanged,
    /// The state from before.
    Restored(NmtState),
    /// The state from before is unknown; the node is PRE-OPERATIONAL.
    Unknown,
}

/// The result of a check.
#[derive(Clone, Debug)]
pub struct ConformReport {
    /// The node.
    pub node: Node,
    /// When the first case started.
    pub started: Stamp,
    /// How long the cases took.
    pub length: Duration,
    /// The results, in the order of the cases.
    pub results: Vec<CaseResult>,
    /// Settings that do not have the values from before.
    pub not_restored: Vec<ObjectId>,
    /// The error history, if it is not as before.
    pub history: Option<HistoryChange>,
    /// Settings that LSS has changed, and whose old values could not be set again.
    pub lss_not_restored: Vec<LssSetting>,
    /// The NMT state.
    pub state: StateAfter,
    /// Why the input of the device may not be as before.
    pub input_failure: Option<StimulusFailure>,
}

/// Runs the cases on a node, and restores its settings and its NMT state.
///
/// # Errors
/// - Other nodes are on the bus.
/// - The node does not answer.
/// - Bus errors and Ctrl-C. The failure names the settings that could not be restored.
pub fn conform(
    master: &mut Master<'_>,
    id: NodeId,
    overrides: &Overrides,
    options: &ConformOptions,
    stimulus: Option<&mut dyn Stimulus>,
    journal: &mut dyn Journal,
    observe: &mut dyn FnMut(&CaseResult),
) -> Result<ConformReport, Failure> {
    let (node, before) = read_node(master, id, overrides)?;
    master.listen(&Filters::All)?;
    let is_alone = is_alone(master, &node, options)?;
    if let Some(before) = &before {
        journal.begin(before)?;
    }
    // A shorter lifetime, that of the session.
    let stimulus = stimulus.map(|stimulus| stimulus as &mut dyn Stimulus);
    let mut session = Session::new(master, node, is_alone, options.eds.clone(), stimulus);
    session.read_settings(options.store)?;
    let started = session.master.bus().now();
    let run = session.begin().map_err(Failure::from).and_then(|()| session.run(options, observe));
    session.is_answer_open |= run.is_err();
    let restored = session.restore();
    let history = session.history_change();
    let state = session.restore_state();
    let length = session.master.now().since(started.mono);
    if restored.as_ref().is_ok_and(Vec::is_empty) {
        journal.finish();
    }
    let Session { node, input_failure, lss_pending, .. } = session;
    let of_history = match &history {
        Ok(change) => change.map(ConformEffect::HistoryChanged),
        Err(_) => Some(ConformEffect::HistoryUnknown),
    };
    let failure = match (run, restored, state, history) {
        (Ok(results), Ok(not_restored), Ok(state), Ok(history)) => {
            return Ok(ConformReport {
                node,
                started,
                length,
                results,
                not_restored,
                history,
                lss_not_restored: lss_pending.failed,
                state,
                input_failure,
            });
        }
        (Ok(_), Ok(_), Ok(_), Err(error)) => Failure::from(error),
        (Ok(_), Err(error), ..) | (Ok(_), Ok(_), Err(error), _) => {
            Failure::from(error).with(id, ConformEffect::Unknown)
        }
        (Err(failure), Ok(objects), ..) if objects.is_empty() => failure,
        (Err(failure), Ok(objects), ..) => failure.with(id, ConformEffect::NotRestored(objects)),
        (Err(failure), Err(_), ..) => failure.with(id, ConformEffect::Unknown),
    };
    let of_lss = (!lss_pending.failed.is_empty()).then_some(ConformEffect::LssNotRestored(lss_pending.failed));
    let effects = of_history.into_iter().chain(of_lss).chain(input_failure.map(ConformEffect::InputNotNormal));
    Err(effects.fold(failure, |failure, effect| failure.with(id, effect)))
}

/// Whether no other node is on the bus.
///
/// # Errors
/// There are other nodes, and cases that concern them are selected.
fn is_alone(master: &mut Master<'_>, node: &Node, options: &ConformOptions) -> Result<bool, Failure> {
    let is_local = options.selected().all(|case| case.area.is_local());
    match alone::others(master, node)? {
        None => Ok(true),
        Some(_) if is_local && !options.only.is_empty() => Ok(false),
        Some(failure) => Err(Failure::at(node.id, failure)),
    }
}

/// Reads the node and its settings. If the settings cannot be read in the form of a file, there is no journal.
fn read_node(
    master: &mut Master<'_>,
    id: NodeId,
    overrides: &Overrides,
) -> Result<(Node, Option<config::Snapshot>), Failure> {
    match config::read(master, id, overrides, None) {
        Ok(before) => Ok((before.node.clone(), Some(before))),
        Err(failure) if matches!(failure.kind(), Kind::Refused | Kind::Unexpected) => {
            Ok((open(master, id, overrides)?, None))
        }
        Err(failure) => Err(failure),
    }
}

impl Session<'_, '_> {
    /// Finds out the NMT state, so that it can be restored.
    fn begin(&mut self) -> Result<(), Error> {
        self.initial_state = state::state(self.master, self.node.id)?;
        self.master.listen(&Filters::All)?;
        if self.initial_state.is_none() && self.show_states()? {
            self.initial_state = self.await_state(NmtState::PreOperational)?;
        }
        self.restore().map(drop)
    }

    fn run(
        &mut self,
        options: &ConformOptions,
        observe: &mut dyn FnMut(&CaseResult),
    ) -> Result<Vec<CaseResult>, Failure> {
        let mut results = Vec::new();
        for case in options.selected() {
            let started = self.master.now();
            self.master.start_transcript();
            let verdict = if case.needs.needs_sole_node() && !self.is_alone {
                Ok(Verdict::NotApplicable(WhyNot::NotAlone))
            } else if case.needs.needs_store() && !options.store {
                Ok(Verdict::NotApplicable(WhyNot::NeedsStore))
            } else if let Some(setting) = self.lss_pending.failed.first() {
                // A reset would activate the new value.
                Ok(Verdict::not_judged(WhyNot::LssNotRestored(*setting)))
            } else {
                (case.run)(self)
            };
            let transcript = self.master.take_transcript();
            let length = self.master.now().since(started);
            self.is_answer_open |= verdict.is_err();
            let verdict = match verdict {
                Err(error) if error.is_fatal() => return Err(error.into()),
                Err(error) => Verdict::not_judged(WhyNot::Failed(Box::new(error.into()))),
                Ok(verdict) => verdict,
            };
            let not_restored = self.restore()?;
            let known = self.known(case.id, &verdict);
            let result = CaseResult { case, verdict, known, transcript, length, not_restored };
            observe(&result);
            results.push(result);
            self.check_alive()?;
        }
        Ok(results)
    }

    /// The pages of the manual that document all findings of a case.
    fn known(&self, case: &str, verdict: &Verdict) -> Option<String> {
        let Verdict::Deviates(findings) = verdict else { return None };
        let deviations = &self.node.model.as_ref()?.description.deviations;
        let mut pages: Vec<&str> = Vec::new();
        for finding in findings {
            let is_this = |at: &ObjectId| finding.object.is_some_and(|object| object.index == at.index);
            let covers = |known: &&Deviation| {
                known.case == case && (known.objects.is_empty() || known.objects.iter().any(is_this))
            };
            let page = deviations.iter().find(covers)?.page.as_str();
            if !pages.contains(&page) {
                pages.push(page);
            }
        }
        Some(pages.join(", "))
    }

    /// Ends the check if the node does not answer any more.
    fn check_alive(&mut self) -> Result<(), Failure> {
        match self.read(ObjectId::DEVICE_TYPE) {
            Err(Error::Sdo(error)) if Failure::from(error.clone()).kind() == Kind::NoAnswer => Err(error.into()),
            Err(error) if error.is_fatal() => Err(error.into()),
            Ok(_) | Err(_) => Ok(()),
        }
    }

    /// Returns the node to the state from before.
    fn restore_state(&mut self) -> Result<StateAfter, Error> {
        if !self.used_nmt {
            return Ok(StateAfter::Unchanged);
        }
        let command = match self.initial_state {
            Some(NmtState::Operational) => NmtCommand::Start,
            Some(NmtState::Stopped) => NmtCommand::Stop,
            Some(_) | None => NmtCommand::EnterPreOperational,
        };
        let mut sent = self.command(command);
        if matches!(sent, Err(Error::Interrupted)) {
            sent = self.command(command);
        }
        sent.map(|()| self.initial_state.map_or(StateAfter::Unknown, StateAfter::Restored))
    }
}
