//! Why nothing comes, and what helps.

use super::recording::Recording;
use super::{Mode, PATIENCE, Plan};
use crate::bus::time::spoken;
use crate::measure::layout::Tpdo;
use crate::node::Node;
use crate::tasks::{Failure, Kind};

/// Why a recording has not one row.
pub(super) fn why_nothing(instruments: &[Node], plan: &Plan, recording: &Recording) -> Failure {
    let waited = plan.duration.unwrap_or(PATIENCE).min(PATIENCE);
    let within = spoken(waited);
    if let Some(node) = recording.learner.as_ref().and_then(|learner| learner.not_understood.first()) {
        let message = "its TPDOs come, and nothing told their mapping: no guess is made";
        return Failure::of_node(Kind::Usage, *node, message).hint(format!(
            "name the device: --device {node}=mh4 (or a file), or record from the start of a log that reads it"
        ));
    }
    let Some(first) = instruments.first() else {
        return Failure::new(Kind::NoAnswer, format!("no measurements within {within}: no TPDO came")).hint(match plan
            .nodes
            .as_slice()
        {
            [only] => format!("who only listens starts nobody: leave --passive out, or: cangauge nmt start {only}"),
            _ => "who only listens starts nobody: leave --passive out, or: cangauge nmt start all".to_owned(),
        });
    };
    let (why, hint) = match recording.decoder.wrong_lengths(first.id) {
        0 => why_silent(first, plan.mode),
        _ => ("its TPDOs have not the length of their mapping".to_owned(), None),
    };
    let message = format!("no measurements within {within}: {why}");
    let failure = match instruments {
        [only] => Failure::of_node(Kind::NoAnswer, only.id, message),
        _ => Failure::new(
            Kind::NoAnswer,
            format!("no measurements from any node within {within}; node {}: {why}", first.id),
        ),
    };
    match hint {
        Some(hint) => failure.hint(hint),
        None => failure,
    }
}

/// Why a node that is set up as it is sends nothing, and what helps.
pub(super) fn why_silent(instrument: &Node, mode: Mode) -> (String, Option<String>) {
    let node = instrument.id;
    if matches!(mode, Mode::Poll(_)) {
        return ("it does not answer".to_owned(), None);
    }
    let poll = || Some("read by SDO instead: add --poll 100ms".to_owned());
    let valid: Vec<&Tpdo> = instrument.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()).collect();
    if instrument.tpdos.is_empty() {
        return ("it has no TPDO".to_owned(), poll());
    }
    if valid.is_empty() {
        return ("all its TPDOs are switched off (bit 31 of 1800h:1)".to_owned(), poll());
    }
    if valid.iter().all(|tpdo| tpdo.mapping.is_empty()) {
        return ("nothing is mapped into its TPDOs".to_owned(), poll());
    }
    if let Some(tpdo) = valid.iter().find(|tpdo| tpdo.transmission.is_some_and(|kind| kind.needs_sync()))
        && !matches!(mode, Mode::Sync(_))
    {
        let why = format!("{} waits for SYNC and nobody sends it", tpdo.number);
        return (why, Some(format!("add --sync 100ms, or read by SDO: --poll 100ms (node {node})")));
    }
    if let Some(tpdo) = valid.iter().find(|tpdo| tpdo.event_timer_ms == Some(0)) {
        return (
            format!("{} has no event timer (1800h:5 is 0) and its value does not change enough", tpdo.number),
            poll(),
        );
    }
    ("its TPDOs should be coming; is it started?".to_owned(), Some(format!("cangauge nmt state {node}")))
}
