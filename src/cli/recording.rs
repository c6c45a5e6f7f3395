//! Common functions of `log` and `check`.

use super::Global;
use super::args::{BusSpec, Duration};
use cangauge::measure::expression::verdict::{Outcome, Verdict};
use cangauge::output::console::Console;
use cangauge::output::events::{EventText, Severity};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::verdict;

/// The shortest interval of SYNC, polling and remote requests.
const SHORTEST_INTERVAL: std::time::Duration = std::time::Duration::from_millis(1);

/// Parses an interval of SYNC.
pub(super) fn sync_interval(text: &str) -> Result<Duration, String> {
    interval(text, "SYNC")
}

/// Parses an interval of polling.
pub(super) fn poll_interval(text: &str) -> Result<Duration, String> {
    interval(text, "polling")
}

/// Parses an interval of remote requests.
pub(super) fn request_interval(text: &str) -> Result<Duration, String> {
    interval(text, "remote requests")
}

fn interval(text: &str, purpose: &str) -> Result<Duration, String> {
    let interval: Duration = text.parse()?;
    if interval.0 < SHORTEST_INTERVAL {
        Err(format!("\"{text}\" is too short for {purpose} (1ms or more)"))
    } else {
        Ok(interval)
    }
}

/// Rejects `--sync`, `--poll` and `--request` for a replayed recording, which cannot send.
pub(super) fn refuse_to_send(global: &Global, interval: Option<Duration>) -> Result<(), ErrorMessage> {
    if matches!(global.bus, Some(BusSpec::Replay(_))) && interval.is_some() {
        return Err(ErrorMessage::usage("a recording (replay:) is receive-only: --sync, --poll and --request send"));
    }
    Ok(())
}

/// Prints an event of a recording on stderr.
pub(super) fn print_event(console: &Console, event: &EventText) {
    match event.severity {
        Severity::Warning => console.warn(&event.text),
        Severity::Note => console.note(&event.text),
        Severity::Detail => console.detail(&event.text),
    }
}

/// Prints the verdicts of a recording on stderr, failed ones as warnings.
pub(super) fn print_verdicts(console: &Console, verdicts: &[Verdict]) {
    for verdict in verdicts {
        let node = verdict.node.map(|node| format!("node {node}: ")).unwrap_or_default();
        let line = format!("{node}{}: {}", verdict.text, verdict::findings(verdict, &[]));
        match verdict.outcome {
            Outcome::Ok => console.note(&format!("ok: {line}")),
            Outcome::Fail => console.warn(&format!("failed: {line}")),
            Outcome::NoData => console.warn(&line),
        }
    }
}
