//! `cangauge publish`.

use super::args::{Tag, tag_pairs};
use super::exit::{FileError, Messages};
use super::{ErrorMessage, Global};
use cangauge::bus::claim::Claim;
use cangauge::bus::host::host_name;
use cangauge::bus::interrupt::Interrupts;
use cangauge::bus::time::{HostClock, Mono};
use cangauge::output::publish::{self as texts, PublishState};
use cangauge::output::report::Stream;
use cangauge::publish::influx::Influx;
use cangauge::publish::mqtt::Mqtt;
use cangauge::publish::position::{Stored, all_of, file_name};
use cangauge::publish::publisher::{Options, Progress, PublishEvent, Publisher};
use cangauge::publish::service::Service;
use cangauge::publish::sink::{Sink, Trouble};
use cangauge::publish::spool::{Spool, Start};
use cangauge::publish::target::{Scheme, Secret, Target};
use cangauge::publish::tls::Trust;
use cangauge::tasks::Kind;
use clap::{Args, ValueEnum};
use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The longest time of a request.
const REQUEST_TIMEOUT: Duration = Duration::from_secs(10);

/// Without --follow: the longest wait for a server that acknowledges nothing.
const GIVE_UP: Duration = Duration::from_secs(30);

/// The interval of the line about the progress.
const LINE_INTERVAL: Duration = Duration::from_secs(60);

/// The interval at which events are printed.
const TICK: Duration = Duration::from_millis(100);

/// The longest wait for present requests after Ctrl-C. Without their acknowledgement, the rows are sent again later.
const END_TIMEOUT: Duration = Duration::from_secs(3);

/// The environment variable with the token.
const TOKEN: &str = "CANGAUGE_TOKEN";

/// Send recordings of log to a time-series database or an MQTT broker
///
/// The recording itself is the send buffer: publish reads its files, sends the rows in batches, and saves its position
/// only after the server has acknowledged them. It continues there after a restart of the server, of the program or of
/// the computer.
#[derive(Debug, Args)]
#[command(after_help = "\
Servers:
  influx://HOST[:8086]/DATABASE    InfluxDB 1 and databases with its protocol
  influx://HOST[:8086]/ORG/BUCKET  InfluxDB 2
  mqtt://HOST[:1883][/PREFIX]      MQTT 3.1.1, QoS 1 [default prefix: cangauge]
  influx+https://, mqtts://        the same with TLS (ports 8086 and 8883)

Files:
  run.csv.SERVER.pos       the position (see --status)
  run.csv.SERVER.rejected  rows that the server rejected, and its error messages

Examples:
  cangauge publish run.csv --to influx://lab1/benches
  cangauge publish run.csv --to influx://lab1/benches --follow --tag bench=3
  cangauge publish run.csv --to mqtt://broker1 --follow
  cangauge publish run.csv --status")]
pub(crate) struct Publish {
    /// Recordings of log: CSV or JSON Lines. For run.csv, also run-0001.csv, run-0002.csv and so on are sent
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// The server (see below). Its address must not contain a password
    #[arg(long, value_name = "URL", required_unless_present = "status")]
    to: Option<String>,
    /// Wait for further rows, and for the server, until Ctrl-C or SIGTERM
    #[arg(long)]
    follow: bool,
    /// Where to begin if the recording was not published before
    #[arg(long, value_name = "PLACE", default_value = "start")]
    from: From,
    /// Add a tag to each row: bench=3, part=P107. Can be repeated
    #[arg(long, value_name = "K=V")]
    tag: Vec<Tag>,
    /// Add the serial number and the name of the node as the tags serial and name
    #[arg(long)]
    identity: bool,
    /// File with a token or with USER:PASSWORD [default: the environment variable CANGAUGE_TOKEN]
    #[arg(long, value_name = "FILE")]
    token_file: Option<PathBuf>,
    /// With TLS: trust only the certificates in this file [default: the authorities that the system trusts]
    #[arg(long, value_name = "FILE")]
    ca: Option<PathBuf>,
    /// Show how far the recordings are published, and send nothing
    #[arg(long, conflicts_with_all = ["to", "follow", "tag", "identity", "token_file", "ca"])]
    status: bool,
}

// The variants have no doc comments, because clap would print each one on its own line.

#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum From {
    Start,
    End,
}

impl Publish {
    /// No node is used.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        if self.status {
            return self.print_status(global);
        }
        let target = Target::parse(self.to.as_deref().unwrap_or_default()).map_err(texts::target_error)?;
        if self.ca.is_some() && !target.tls {
            return Err(ErrorMessage::usage("--ca needs an address with TLS: influx+https:// or mqtts://").into());
        }
        let secret = self.secret()?;
        let trust = target.tls.then(|| Trust::load(self.ca.as_deref())).transpose().map_err(texts::trust_error)?;
        let options = Options {
            follow: self.follow,
            start: if self.from == From::End { Start::End } else { Start::Start },
            give_up: global.wait.map_or(GIVE_UP, |wait| wait.0),
            tags: tag_pairs(&self.tag).map_err(ErrorMessage::usage)?,
            identity: self.identity,
            bench: host_name(),
        };
        let timeout = global.timeout.map_or(REQUEST_TIMEOUT, |timeout| timeout.0);
        let failed = |source| FileError { what: "watch for signals".to_owned(), source };
        let mut interrupts = Interrupts::new().map_err(failed)?;
        let clock = HostClock::new();
        let open = |file: &PathBuf| {
            let sink = sink(&target, secret.as_ref(), timeout, trust.as_ref());
            let opened =
                Publisher::open(file, &target.name(), &target.to_string(), sink, options.clone(), clock.now().wall);
            let about = Progress { file: file.display().to_string(), url: target.to_string(), ..Progress::default() };
            opened.map_err(|error| texts::failure(&about, &error))
        };
        let publishers = self.files.iter().map(open).collect::<Result<Vec<_>, ErrorMessage>>()?;
        let rejects = self.files.iter().map(|file| file_name(file, &target.name(), "rejected")).collect();
        let failed = |source| FileError { what: "start a thread".to_owned(), source };
        let service = Service::start(publishers, clock).map_err(failed)?;
        let mut view = View { global, url: target.to_string(), rejects, troubles: BTreeSet::new(), stream: None };
        if !global.prints_text() {
            view.stream = Some(global.stream()?);
        }
        view.watch(&service, &mut interrupts, clock)
    }

    /// The token, from its file or from the environment.
    fn secret(&self) -> anyhow::Result<Option<Secret>> {
        let text = match &self.token_file {
            Some(path) => {
                let read = |source| FileError { what: format!("read {}", path.display()), source };
                Some(std::fs::read_to_string(path).map_err(read)?)
            }
            None => std::env::var(TOKEN).ok(),
        };
        let secret = text.as_deref().and_then(Secret::new);
        if self.token_file.is_some() && secret.is_none() || secret.as_ref().is_some_and(|secret| !secret.is_printable())
        {
            return Err(ErrorMessage::usage("the token is empty, or contains other than ASCII characters").into());
        }
        Ok(secret)
    }

    fn print_status(&self, global: &Global) -> anyhow::Result<()> {
        let mut states = Vec::new();
        for file in &self.files {
            let failed = |source| FileError { what: format!("read {}", file.display()), source };
            let found = all_of(file).map_err(failed)?;
            if found.is_empty() {
                return Err(texts::no_position(file, None).into());
            }
            for (_, stored) in &found {
                let Stored::Position(position) = stored else {
                    return Err(texts::no_position(file, Some(stored)).into());
                };
                let spool = Spool::open(file, Some(position), Start::Start).map_err(failed)?;
                let behind = spool.place().map_or(0, |place| spool.bytes_after(place));
                states.push(PublishState::stored(file, position, behind));
            }
        }
        global.print(&states)
    }
}

fn sink(target: &Target, secret: Option<&Secret>, timeout: Duration, trust: Option<&Trust>) -> Box<dyn Sink> {
    match target.scheme {
        Scheme::Influx => Box::new(Influx::new(target, secret, timeout, trust)),
        Scheme::Mqtt => Box::new(Mqtt::new(target, secret, timeout, trust)),
    }
}

/// Prints what running publishers report.
struct View<'a> {
    global: &'a Global,
    url: String,
    rejects: Vec<PathBuf>,
    /// The troubles that were printed. They concern all recordings.
    troubles: BTreeSet<String>,
    stream: Option<Stream<PublishState, io::Stdout>>,
}

impl View<'_> {
    /// Prints news until all publishers have ended.
    fn watch(mut self, service: &Service, interrupts: &mut Interrupts, clock: HostClock) -> anyhow::Result<()> {
        let mut failures = Vec::new();
        let mut warned = vec![false; self.rejects.len()];
        let (mut next_line, mut end) = (clock.now().mono + LINE_INTERVAL, None::<Mono>);
        loop {
            let has_ended = service.has_ended();
            let news = service.news();
            let progress: Vec<Progress> = news.iter().map(|news| news.progress.clone()).collect();
            for (at, news) in news.into_iter().enumerate() {
                for event in &news.events {
                    self.print_event(&progress[at], event, &self.rejects[at].clone(), &mut warned[at]);
                }
                failures.extend(news.end.and_then(Result::err).map(|error| texts::failure(&news.progress, &error)));
            }
            self.print_recovery(&progress);
            let now = clock.now().mono;
            let is_late = end.is_some_and(|end| now >= end);
            if has_ended || is_late {
                self.print_progress(&progress)?;
                return self.result(&progress, failures);
            }
            if now >= next_line {
                next_line = now + LINE_INTERVAL;
                self.print_progress(&progress)?;
            }
            if interrupts.wait_for(TICK) {
                service.stop();
                // A second signal ends the program at once: no row is lost.
                end = Some(if end.is_some() { now } else { now + END_TIMEOUT });
            }
        }
    }

    fn print_event(&mut self, progress: &Progress, event: &PublishEvent, rejects: &Path, warned: &mut bool) {
        if let PublishEvent::Trouble(trouble) = event {
            return self.print_trouble(trouble);
        }
        // The line about the progress contains the number of further rejected rows.
        if matches!(event, PublishEvent::Rejected(..)) && std::mem::replace(warned, true) {
            return;
        }
        let text = texts::event_text(&progress.file, event, rejects);
        text.iter().for_each(|text| self.global.console().warn(text));
    }

    fn print_trouble(&mut self, trouble: &Trouble) {
        let text = texts::trouble_text(trouble);
        if self.troubles.insert(text.clone()) {
            self.global.console().warn(&texts::waiting_text(&self.url, trouble));
        }
    }

    fn print_recovery(&mut self, progress: &[Progress]) {
        if !self.troubles.is_empty() && progress.iter().all(|progress| progress.trouble.is_none()) {
            self.troubles.clear();
            self.global.console().note(&texts::recovered_text(&self.url));
        }
    }

    fn print_progress(&mut self, progress: &[Progress]) -> anyhow::Result<()> {
        match &mut self.stream {
            None => self.global.console().note(&texts::progress_line(progress)),
            Some(stream) => {
                for one in progress {
                    stream.push(&PublishState::from(one)).map_err(super::exit::stdout)?;
                }
            }
        }
        Ok(())
    }

    /// Success, or the failures. The exit code is `partial` if only some recordings failed.
    fn result(&self, progress: &[Progress], mut failures: Vec<ErrorMessage>) -> anyhow::Result<()> {
        let failed = failures.len();
        let rejected =
            progress.iter().zip(&self.rejects).filter_map(|(progress, file)| texts::rejected(progress, file));
        failures.extend(rejected);
        let Some(first) = failures.first() else { return Ok(()) };
        let is_partial = failed > 0 && failed < progress.len();
        Err(Messages { kind: if is_partial { Kind::Partial } else { first.kind }, messages: failures }.into())
    }
}
