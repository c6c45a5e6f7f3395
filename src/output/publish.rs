//! The state of publishers, and the texts of their events and failures.

mod tls;

use super::failure::ErrorMessage;
use super::report::{Cell, Column, Report};
use super::text::grouped;
use crate::publish::position::{Position, PositionError, Stored};
use crate::publish::publisher::{Progress, PublishError, PublishEvent};
use crate::publish::sink::Trouble;
use crate::publish::spool::SpoolEvent;
use crate::publish::target::TargetError;
use crate::tasks::Kind;
use std::path::Path;

pub use tls::trust_error;

/// The state of one recording at one server.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct PublishState {
    file: String,
    url: String,
    sent: u64,
    rejected: u64,
    behind: u64,
    last_row: Option<String>,
    state: String,
    updated: Option<String>,
}

impl From<&Progress> for PublishState {
    fn from(progress: &Progress) -> PublishState {
        PublishState {
            file: progress.file.clone(),
            url: progress.url.clone(),
            sent: progress.sent,
            rejected: progress.rejected,
            behind: progress.behind,
            last_row: progress.last_row.clone(),
            state: progress.trouble.as_ref().map_or("ok", Trouble::word).to_owned(),
            updated: None,
        }
    }
}

impl PublishState {
    /// The state in a position file; `behind` is the number of bytes after the position.
    pub fn stored(recording: &Path, position: &Position, behind: u64) -> PublishState {
        PublishState {
            file: recording.display().to_string(),
            url: position.url.clone(),
            sent: position.sent,
            rejected: position.rejected,
            behind,
            last_row: position.last_row.clone(),
            state: position.state.clone(),
            updated: Some(position.updated.clone()),
        }
    }
}

impl Report for PublishState {
    const COLUMNS: &'static [Column] = &[
        Column::new("file"),
        Column::new("url"),
        Column::new("sent").right(),
        Column::new("rejected").right(),
        Column::new("behind_bytes").heading("BEHIND").right(),
        Column::new("last_row"),
        Column::new("state"),
        Column::new("updated"),
    ];

    fn cells(&self) -> Vec<Cell> {
        vec![
            self.file.as_str().into(),
            self.url.as_str().into(),
            Cell::from(self.sent).shown_as(grouped(self.sent)),
            Cell::from(self.rejected).shown_as(grouped(self.rejected)),
            Cell::from(self.behind).shown_as(size(self.behind)),
            self.last_row.clone().into(),
            self.state.as_str().into(),
            self.updated.clone().into(),
        ]
    }
}

/// One line about all recordings of a publisher.
pub fn progress_line(all: &[Progress]) -> String {
    let sum = |of: fn(&Progress) -> u64| all.iter().map(of).sum::<u64>();
    let (sent, rejected, behind) = (sum(|one| one.sent_now), sum(|one| one.rejected_now), sum(|one| one.behind));
    let name = match all {
        [one] => one.file.clone(),
        all => format!("{} recordings", all.len()),
    };
    let mut line = format!("{name}: {} sent", rows(sent));
    if rejected > 0 {
        line.push_str(&format!(", {} rejected", grouped(rejected)));
    }
    line.push_str(&if behind == 0 { ", up to date".to_owned() } else { format!(", {} behind", size(behind)) });
    if let [Progress { last_row: Some(last), .. }] = all
        && behind > 0
    {
        line.push_str(&format!(" (last row: {last})"));
    }
    let waiting = all.iter().filter_map(|one| one.trouble.as_ref()).collect::<Vec<_>>();
    match (waiting.as_slice(), all) {
        ([], _) => {}
        ([trouble], [_]) => line.push_str(&format!("; waiting: {}", trouble_text(trouble))),
        (waiting, _) => line.push_str(&format!("; {} of them are waiting for the server", waiting.len())),
    }
    line
}

fn rows(count: u64) -> String {
    format!("{} {}", grouped(count), if count == 1 { "row" } else { "rows" })
}

/// A number of bytes for users: `512 B`, `1.5 MB`.
fn size(bytes: u64) -> String {
    let units = [("GB", 1e9), ("MB", 1e6), ("kB", 1e3)];
    let unit = units.into_iter().find(|(_, factor)| bytes as f64 >= *factor);
    unit.map_or_else(|| format!("{bytes} B"), |(unit, factor)| format!("{:.1} {unit}", bytes as f64 / factor))
}

/// Why a server does not accept rows.
pub fn trouble_text(trouble: &Trouble) -> String {
    match trouble {
        Trouble::NoConnection(words) => format!("no connection: {words}"),
        Trouble::Timeout => "no answer in time".to_owned(),
        Trouble::Closed => "the server closed the connection without an answer".to_owned(),
        Trouble::Garbage => "the answer is not in the protocol of the server".to_owned(),
        Trouble::NotDatabase(status) => format!("the answer is not that of a database (HTTP status {status})"),
        Trouble::Redirect(status) => format!("the server redirects to another address (HTTP status {status})"),
        Trouble::Unauthorized(code) => format!("the server rejects the credentials (status {code})"),
        Trouble::Status(404, words) => format!("the database does not exist: {words} (HTTP status 404)"),
        Trouble::Status(status, words) if words.is_empty() => format!("HTTP status {status}"),
        Trouble::Status(status, words) => format!("{words} (HTTP status {status})"),
        Trouble::RejectsEverything(words) => format!("the server rejects every row: {words}"),
        Trouble::Refused(code) => format!("the broker refuses the connection (return code {code})"),
        Trouble::Certificate(fault) => tls::certificate_text(fault),
        Trouble::Tls(fault) => tls::fault_text(fault),
    }
}

/// The warning when a server does not accept rows.
pub fn waiting_text(url: &str, trouble: &Trouble) -> String {
    // A service has no failure with a hint.
    let hint = trouble_hint(trouble).filter(|_| trouble.is_lasting());
    let hint = hint.map(|hint| format!(" ({hint})")).unwrap_or_default();
    format!("{url}: {}{hint}; trying again", trouble_text(trouble))
}

/// The note when it accepts rows again.
pub fn recovered_text(url: &str) -> String {
    format!("{url}: rows are accepted again")
}

fn trouble_hint(trouble: &Trouble) -> Option<&'static str> {
    Some(match trouble {
        Trouble::NoConnection(_) | Trouble::Timeout | Trouble::Closed => {
            "check the address and the server; --follow waits for the server"
        }
        Trouble::Redirect(_) => "use the address of the server itself: a redirection is not followed",
        Trouble::Unauthorized(_) => "set the environment variable CANGAUGE_TOKEN, or use --token-file FILE",
        Trouble::Status(404, _) => "create the database, or correct the address",
        Trouble::NotDatabase(_) | Trouble::Garbage | Trouble::RejectsEverything(_) => {
            "check the address: it must be the port of the database"
        }
        Trouble::Certificate(fault) => tls::certificate_hint(fault),
        Trouble::Tls(_) => "check the port: without TLS, the address begins with influx:// or mqtt://",
        _ => return None,
    })
}

fn trouble_kind(trouble: &Trouble) -> Kind {
    match trouble {
        Trouble::NoConnection(_) | Trouble::Timeout | Trouble::Closed => Kind::NoAnswer,
        Trouble::Garbage | Trouble::NotDatabase(_) | Trouble::Certificate(_) | Trouble::Tls(_) => Kind::Unexpected,
        _ => Kind::Refused,
    }
}

/// The warning for an event. `None` for events of the server, which concern all recordings.
pub fn event_text(recording: &str, event: &PublishEvent, rejects: &Path) -> Option<String> {
    Some(match event {
        PublishEvent::Spool(SpoolEvent::Truncated(file)) => {
            format!("{}: another program truncated or replaced the file: it is sent from its start", file.display())
        }
        PublishEvent::Spool(SpoolEvent::Gone(file, next)) => {
            format!("{} does not exist any more: continuing with {}", file.display(), next.display())
        }
        PublishEvent::PositionDamaged => {
            format!("{recording}: the position file is damaged: the recording is sent from its start")
        }
        PublishEvent::Rejected(count, file, line, reason) => {
            let lines = if *count == 1 { "line is" } else { "lines are" };
            let reason = reason.as_deref().unwrap_or("not a row");
            let rejects = rejects.display();
            format!("{file}: {count} {lines} never accepted, first line {line}: {reason}; saved in {rejects}")
        }
        PublishEvent::Trouble(_) | PublishEvent::Recovered => return None,
    })
}

/// The failure of a publisher.
pub fn failure(progress: &Progress, error: &PublishError) -> ErrorMessage {
    let Progress { file, url, .. } = progress;
    match error {
        PublishError::NoRecording => ErrorMessage::new(Kind::Io, format!("{file}: no such recording"))
            .hint("record first, or wait for the recording with --follow"),
        PublishError::Position(path, PositionError::Locked(locked)) => {
            let process = locked.process.map(|process| format!(" (process {process})")).unwrap_or_default();
            let message = if locked.is_own {
                format!("{file} is given twice")
            } else {
                format!("another publisher{process} sends {file} to {url}")
            };
            ErrorMessage::usage(message).hint(format!("its position file is {}", path.display()))
        }
        PublishError::Position(path, PositionError::Other(other)) => {
            ErrorMessage::usage(format!("{} is the position for another server: {other}", path.display()))
                .hint("rename this file")
        }
        PublishError::Position(path, PositionError::Io(error)) => {
            ErrorMessage::new(Kind::Io, format!("write {}: {error}", path.display()))
        }
        PublishError::Panicked => ErrorMessage::new(Kind::Unexpected, format!("{file}: the publisher failed"))
            .hint("start it again: it continues at its position"),
        PublishError::Read(error) => ErrorMessage::new(Kind::Io, format!("read {file}: {error}")),
        PublishError::Rejects(path, error) => ErrorMessage::new(Kind::Io, format!("write {}: {error}", path.display())),
        PublishError::Server(trouble) => {
            let message = ErrorMessage::new(trouble_kind(trouble), format!("{url}: {}", trouble_text(trouble)));
            match trouble_hint(trouble) {
                Some(hint) => message.hint(hint),
                None => message,
            }
        }
    }
}

/// The failure if rows were rejected.
pub fn rejected(progress: &Progress, rejects: &Path) -> Option<ErrorMessage> {
    let Progress { file, rejected_now, sent_now, .. } = progress;
    let kind = if *sent_now == 0 { Kind::Refused } else { Kind::Partial };
    let lines = if *rejected_now == 1 { "line was" } else { "lines were" };
    let message = format!("{file}: {} {lines} rejected: see {}", grouped(*rejected_now), rejects.display());
    (*rejected_now > 0).then(|| ErrorMessage::new(kind, message))
}

/// A wrong address. The address is not shown, because it may contain a secret.
pub fn target_error(error: TargetError) -> ErrorMessage {
    let forms = "use influx://HOST/DATABASE, influx://HOST/ORGANISATION/BUCKET or mqtt://HOST; with TLS, influx+https:// \
                 or mqtts://";
    let (message, hint) = match error {
        TargetError::Credentials => (
            "--to must not contain a user name or a password: other users can see the command line",
            "set the environment variable CANGAUGE_TOKEN, or use --token-file FILE",
        ),
        TargetError::Query => {
            ("--to must not contain ? or #", "put a token into CANGAUGE_TOKEN, or use --token-file FILE")
        }
        TargetError::Scheme => ("--to has an unknown kind of server", forms),
        TargetError::Host => ("--to has no valid host and port", forms),
        TargetError::Database => ("--to names no database", forms),
        TargetError::Topic => ("--to contains a wildcard of MQTT", forms),
    };
    ErrorMessage::usage(message).hint(hint)
}

/// The failure of `--status` for a recording without a position file, or with a damaged one.
pub fn no_position(recording: &Path, stored: Option<&Stored>) -> ErrorMessage {
    let file = recording.display();
    match stored {
        Some(Stored::Damaged) => ErrorMessage::new(Kind::Io, format!("{file}: the position file is damaged")),
        _ => ErrorMessage::new(Kind::Io, format!("{file}: no position file: the recording was not published")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn line_about_the_progress() {
        let one = Progress { file: "run.csv".to_owned(), sent_now: 12_345, ..Progress::default() };
        assert_eq!(progress_line(std::slice::from_ref(&one)), "run.csv: 12,345 rows sent, up to date");
        let last_row = Some("2026-11-29T15:01:02Z".to_owned());
        let late = Progress {
            behind: 1_250_000,
            sent_now: 1,
            rejected_now: 2,
            last_row,
            trouble: Some(Trouble::Timeout),
            ..one.clone()
        };
        assert_eq!(
            progress_line(std::slice::from_ref(&late)),
            "run.csv: 1 row sent, 2 rejected, 1.2 MB behind (last row: 2026-11-29T15:01:02Z); waiting: no answer in time"
        );
        let both = "2 recordings: 12,346 rows sent, 2 rejected, 1.2 MB behind; 1 of them are waiting for the server";
        assert_eq!(progress_line(&[one, late]), both);
    }
}
