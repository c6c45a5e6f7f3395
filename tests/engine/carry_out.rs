//! Runs a command as the command line does, and keeps its result.

use crate::bench::identity;
use crate::command::{Command, How, Measuring, Target};
use crate::kinds::model;
use crate::rules::group;
use crate::spec::Spec;
use cangauge::bus::{Bus, Stamp};
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::pdo::TpdoNumber;
use cangauge::device::config_file::Document;
use cangauge::device::unit::Unit;
use cangauge::master::{Master, Timing};
use cangauge::measure::expression::Expression;
use cangauge::measure::expression::verdict::Verdict;
use cangauge::measure::sample::{Sample, Source};
use cangauge::node::Overrides;
use cangauge::node::{Node, WriteOptions};
use cangauge::tasks::journal::NoJournal;
use cangauge::tasks::log::{LogEvent, LogOptions, Mode, Observer, log};
use cangauge::tasks::lss::{self, Descriptions, Job, LssAddress, LssRange, RequestedRate};
use cangauge::tasks::nmt::StateEvent;
use cangauge::tasks::pdo::{self, Item, PdoRequest, Settings, Trigger, WatchEvent};
use cangauge::tasks::settings::{self, errors, filter, info, limits, minmax, unit};
use cangauge::tasks::{Failure, autozero, check, config, detect, nmt, read, restore, scan, sdo, store};
use std::ops::ControlFlow;
use std::time::Duration;

/// The state that a successful command claims.
#[derive(Clone, Debug)]
pub(crate) enum Claim {
    Nothing,
    /// Node and serial number.
    Found(Vec<(u8, Option<u32>)>),
    /// Node, object, and the bytes as received.
    Values(Vec<(u8, ObjectId, Vec<u8>)>),
    States(Vec<(u8, Option<NmtState>)>),
    /// Whether the probe succeeded.
    Probed(bool),
    Assigned {
        new: Option<u8>,
        stored: bool,
        rate: Option<Option<u32>>,
        retimed: bool,
    },
    Mapped(Settings),
    /// The objects of the settings with their values.
    Configured(Vec<(ObjectId, Vec<u8>)>),
    Stored,
    /// The bit rate of the bus.
    Detected(Option<u32>),
    /// Whether a slave answers.
    Identified(bool),
    /// All expressions are satisfied.
    Satisfied,
}

/// The reports of a running command.
#[derive(Default)]
pub(crate) struct Observations {
    /// Rows of a recording, in the format of the simulator's own record.
    pub(crate) rows: Vec<String>,
    /// Changes of nodes.
    pub(crate) seen: Vec<StateEvent>,
    /// Results of expressions.
    pub(crate) verdicts: Vec<Verdict>,
}

impl Observations {
    fn take(&mut self, samples: &[Sample], sources: &[Source]) {
        for sample in samples {
            let source = &sources[sample.source];
            let value = sample.value.map(|value| value.to_string()).unwrap_or_default();
            let status = sample.status.map_or("", |status| status.as_str());
            let at = sample.at.mono.since_start().as_micros();
            let Source { node, signal, unit, .. } = source;
            self.rows.push(format!("{at},{node},{signal},{value},{unit},{status},{}", sample.raw));
        }
    }
}

impl Observer for Observations {
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        self.take(samples, sources);
        ControlFlow::Continue(())
    }

    fn event(&mut self, _: &LogEvent, _: Stamp) {}

    fn tick(&mut self, _: Stamp, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// A journal of a program that is not continued.
struct NoConfigJournal;

impl config::Journal for NoConfigJournal {
    fn begin(&mut self, _: &config::Snapshot) -> Result<(), Failure> {
        Ok(())
    }

    fn finish(&mut self) {}
}

pub(crate) fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

fn nodes(ids: &[u8]) -> Vec<NodeId> {
    ids.iter().copied().map(node).collect()
}

/// The descriptions that the user names.
fn described(spec: &Spec, id: u8, how: How) -> Overrides {
    let device = spec.devices.iter().find(|device| device.node == Some(id) && how.described);
    device.map(|device| (node(id), model(device.kind))).into_iter().collect()
}

fn target(spec: &Spec, target: &Target) -> lss::Target {
    match target {
        Target::Node(id) => lss::Target::Node(node(*id)),
        Target::Only => lss::Target::Only,
        Target::Unconfigured => lss::Target::Unconfigured,
        Target::Identity(place) => lss::Target::Address(identity(&spec.devices[*place])),
    }
}

/// Runs the command as the command line does, and sends the frames that are still in the transmit queue.
pub(crate) fn carry_out(bus: &mut dyn Bus, spec: &Spec, observed: &mut Observations) -> Result<Claim, Failure> {
    if let Command::Detect { ask, each_ms } = spec.command {
        let found = detect::detect(bus, ask, Duration::from_millis(each_ms), &mut |_| {})?;
        return Ok(Claim::Detected(found.found.map(|(rate, _)| rate)));
    }
    let timing = Timing { timeout: Duration::from_millis(spec.timeout_ms), retries: spec.retries };
    let mut master = Master::new(bus, timing);
    let result = carry_out_with(&mut master, spec, observed);
    master.settle();
    result
}

fn carry_out_with(master: &mut Master<'_>, spec: &Spec, observed: &mut Observations) -> Result<Claim, Failure> {
    let none = Overrides::new();
    let mut quiet = |_: cangauge::tasks::Note| {};
    Ok(match &spec.command {
        Command::Scan { nodes: ids } => {
            let wait = Duration::from_millis(200.min(spec.timeout_ms));
            let found = scan::scan(master, &nodes(ids), wait, spec.retries + 1, &none)?;
            let found = found.into_iter().filter(|found| found.failure.is_none());
            Claim::Found(found.map(|found| (found.node.get(), found.device.identity.serial)).collect())
        }
        Command::Read { nodes: ids } => {
            let mut values = Vec::new();
            for result in read::read(master, &nodes(ids), &[], &none)? {
                for (target, sample) in result? {
                    values.push((target.source.node.get(), target.object, hex(&sample.raw.to_string())));
                }
            }
            Claim::Values(values)
        }
        Command::Info { node: id } => {
            let read = info::read(master, node(*id), &none)?;
            Claim::Found(vec![(*id, read.node.identity.serial)])
        }
        Command::PdoShow { node: id } => {
            let number = TpdoNumber::new(1);
            let shown = pdo::show(master, node(*id), number, &none)?;
            shown.into_iter().next().map_or(Claim::Nothing, |shown| Claim::Mapped(shown.settings))
        }
        Command::SdoRead { node: id, object, how } => {
            let mut node = Node::with_overrides(node(*id), &described(spec, *id, *how));
            let value = {
                let (blocks, longest) = (how.blocks, sdo::FILE_LIMIT);
                let mut options = sdo::ReadOptions { blocks, longest, is_exact: false, progress: &mut |_| {} };
                sdo::read(master, &mut node, *object, None, &mut options)?
            };
            Claim::Values(vec![(*id, *object, value.raw)])
        }
        Command::SdoWrite { node: id, object, bytes, how } => {
            let node = Node::with_overrides(node(*id), &described(spec, *id, *how));
            let (progress, watch) = (&mut |_| {}, &mut |_: &_| {});
            let mut options = WriteOptions { blocks: how.blocks, ..WriteOptions::new(progress, watch) };
            sdo::write(master, &node, *object, bytes, None, &mut options)?;
            Claim::Nothing
        }
        Command::Nmt { what, nodes: ids, all } => {
            let reports = nmt::command(master, *what, &nodes(ids), *all)?;
            Claim::States(reports.iter().map(|report| (report.node.get(), report.state)).collect())
        }
        Command::NmtState { nodes: ids } => {
            let reports = nmt::states(master, &nodes(ids))?;
            Claim::States(reports.iter().map(|report| (report.node.get(), report.state)).collect())
        }
        Command::NmtWatch { nodes: ids, ask, for_ms } => {
            let until = master.now() + Duration::from_millis(*for_ms);
            nmt::watch(master, &nodes(ids), *ask, Some(until), &mut |seen| {
                observed.seen.push(*seen);
                ControlFlow::Continue(())
            })?;
            Claim::Nothing
        }
        Command::NmtProbe { node: id } => {
            let probed = nmt::probe(master, &Node::new(node(*id)), &mut NoJournal)?;
            Claim::Probed(probed.failure.is_none())
        }
        Command::Startup { node: id, auto } => {
            let set = if *auto { nmt::Starts::Auto } else { nmt::Starts::Wait };
            nmt::startup(master, node(*id), &none, Some(set))?;
            Claim::Nothing
        }
        Command::LssScan => {
            let found = lss::scan(master, lss::SearchTimes::default(), &mut quiet)?;
            let serial = |slave: &lss::FoundSlave| slave.address.map(|address| address.serial);
            Claim::Found(found.iter().filter_map(|slave| Some((slave.node?.get(), serial(slave)))).collect())
        }
        Command::LssInquire { target: wanted } => {
            let inquired = lss::inquire(
                master,
                &target(spec, wanted),
                &Descriptions { overrides: &none, given: None },
                &mut quiet,
            )?;
            let node = inquired.node.flatten();
            let serial = inquired.address.map(|address| address.serial);
            Claim::Found(node.map(|node| (node.get(), serial)).into_iter().collect())
        }
        Command::LssStore { target: wanted, force } => {
            lss::store(
                master,
                &target(spec, wanted),
                &Descriptions { overrides: &none, given: None },
                *force,
                &mut quiet,
            )?;
            Claim::Nothing
        }
        Command::LssActivate { target: wanted, delay_ms, force } => {
            let wanted = wanted.as_ref().map(|wanted| target(spec, wanted));
            lss::activate(
                master,
                wanted.as_ref(),
                *delay_ms,
                &Descriptions { overrides: &none, given: None },
                *force,
                &mut quiet,
            )?;
            Claim::Nothing
        }
        Command::LssIdentify { place, around } => {
            let LssAddress { vendor, product, revision, serial } = identity(&spec.devices[*place]);
            let serial = (serial.saturating_sub(*around), serial.saturating_add(*around));
            let range = LssRange { vendor, product, revision: (revision, revision), serial };
            Claim::Identified(lss::identify(master, &range)?)
        }
        Command::Assign { target: wanted, id, rate, store, retime, via, force } => {
            let job = Job {
                target: target(spec, wanted),
                id: id.or((rate.is_none()).then_some(9)).map(node),
                rate: rate.map(RequestedRate::Bits),
                store: *store,
                retime: *retime,
                via: *via,
                force: *force,
                descriptions: Descriptions { overrides: &none, given: None },
            };
            let report = lss::assign(master, &job, &mut quiet)?;
            Claim::Assigned {
                new: report.new.map(NodeId::get),
                stored: report.stored,
                rate: report.rate.map(|rate| rate.bits),
                retimed: report.retimed,
            }
        }
        Command::Map { node: id, number, items, code, timer_ms, cob_id, keep } => {
            let request = PdoRequest {
                node: node(*id),
                number: TpdoNumber::new(*number).expect("a TPDO"),
                items: items.iter().map(|item| Item::Name((*item).to_owned(), None)).collect(),
                trigger: code.map(Trigger::Code),
                event_timer_ms: *timer_ms,
                inhibit_100us: None,
                cob_id: *cob_id,
            };
            Claim::Mapped(pdo::map(master, &request, *keep, &none, &mut NoJournal)?.shown.settings)
        }
        Command::Configure { node: id, heartbeat_ms, timer_ms, digits } => {
            let mut text = format!("[node]\nheartbeat = \"{heartbeat_ms}ms\"\n");
            let mut wanted = vec![(ObjectId::new(0x1017, 0), heartbeat_ms.to_le_bytes().to_vec())];
            if let Some(digits) = digits {
                text += &format!("[signal.pressure]\ndigits = {digits}\n");
                wanted.push((ObjectId::new(0x6132, 1), vec![*digits]));
            }
            if let Some(timer) = timer_ms {
                text += &format!("[tpdo.1]\nevent-timer = \"{timer}ms\"\n");
                wanted.push((ObjectId::new(0x1800, 5), timer.to_le_bytes().to_vec()));
            }
            let document = Document::parse(&text).expect("TOML");
            let before = config::read(master, node(*id), &none, Some(&config::File::Settings(document.clone())))?;
            // The file may contain settings that this device does not have.
            let Ok(file) = before.check(&document) else { return Ok(Claim::Nothing) };
            config::apply(master, before, &file, &config::Options::default(), &none, &mut NoConfigJournal)?;
            Claim::Configured(wanted)
        }
        Command::Autozero { node: id, channel, force, store, dry_run } => {
            let options = autozero::Options {
                target: autozero::ZeroTarget::Autozero,
                channel: *channel,
                limit: autozero::Limit::Default,
                samples: 4,
                force: *force,
                store: *store,
                dry_run: *dry_run,
            };
            autozero::autozero(master, node(*id), &none, &options)?;
            Claim::Nothing
        }
        Command::Store { node: id, group: number, verify } => {
            let device = store::device(master, node(*id), &none)?;
            store::store(master, &device, group(*number), *verify)?;
            Claim::Stored
        }
        Command::Restore { node: id, group: number, reset } => {
            let device = store::device(master, node(*id), &none)?;
            restore::restore(master, &device, group(*number), *reset)?;
            Claim::Stored
        }
        Command::Unit { node: id, signal, unit: code } => {
            let mut device = settings::open(master, node(*id), &none)?;
            let change = unit::set(master, &mut device, *signal, Unit(*code))?;
            let channel = device.signals.iter().find(|signal| signal.name == change.now.signal);
            let described = device.model.iter().flat_map(|model| &model.description.signals);
            let entry = described.into_iter().find(|entry| entry.name == change.now.signal);
            let of_channel = channel.map(|signal| ObjectId::new(0x6131, signal.channel));
            let object = entry.and_then(|entry| entry.unit).or(of_channel);
            object.map_or(Claim::Nothing, |object| Claim::Values(vec![(*id, object, code.to_le_bytes().to_vec())]))
        }
        Command::Filter { node: id, kind, constant } => {
            let device = settings::open(master, node(*id), &none)?;
            let kinds = [
                None,
                Some(filter::FilterType::None),
                Some(filter::FilterType::Moving),
                Some(filter::FilterType::Repeating),
            ];
            let kind = kinds[usize::from(*kind)];
            filter::set(master, &device, None, filter::FilterRequest { kind, constant: *constant, damping: None })?;
            Claim::Nothing
        }
        Command::Limits { node: id, lower, upper } => {
            let device = settings::open(master, node(*id), &none)?;
            let wanted = [(limits::Limit::Lower, *lower), (limits::Limit::Upper, *upper)];
            limits::set(master, &device, "pressure", &wanted)?;
            Claim::Nothing
        }
        Command::Errors { node: id, clear } => {
            let device = settings::open(master, node(*id), &none)?;
            match clear {
                true => drop(errors::clear(master, &device)?),
                false => drop(errors::read(master, &device)?),
            }
            Claim::Nothing
        }
        Command::Minmax { node: id } => {
            let device = settings::open(master, node(*id), &none)?;
            minmax::reset(master, &device)?;
            Claim::Nothing
        }
        Command::PdoWatch { nodes: ids, for_ms } => {
            let duration = Some(Duration::from_millis(*for_ms));
            pdo::watch(master, &nodes(ids), &none, duration, &mut |line| {
                if let WatchEvent::Tpdo { samples, sources, .. } = line {
                    observed.take(samples, sources);
                }
                ControlFlow::Continue(())
            })?;
            Claim::Nothing
        }
        Command::Check { nodes: ids, expected, how, excuse } => {
            let for_ms = |length: u64| Some(Duration::from_millis(length));
            let measuring = match *how {
                Measuring::Once => None,
                Measuring::AsSent { for_ms: length } => Some((Mode::AsSent, for_ms(length))),
                Measuring::Sync { ms, for_ms: length } => Some((Mode::Sync(Duration::from_millis(ms)), for_ms(length))),
                Measuring::Poll { ms, for_ms: length } => Some((Mode::Poll(Duration::from_millis(ms)), for_ms(length))),
            };
            let parsed = expected.iter().map(|one| Expression::parse(&one.to_string()).expect("an expression"));
            let options = check::CheckOptions {
                nodes: nodes(ids),
                skip_unsupported: *excuse,
                expressions: parsed.collect(),
                recording: measuring,
                overrides: none.clone(),
            };
            let report = check::check(master, &options, observed)?;
            let met = check::all_satisfied(&report.verdicts, &report.failures);
            observed.verdicts = report.verdicts;
            met?;
            Claim::Satisfied
        }
        Command::Detect { .. } => Claim::Nothing,
        Command::Log { nodes: ids, sync_ms, poll_ms, duration_ms, count, nmt } => {
            let mode = match (sync_ms, poll_ms) {
                (Some(period), _) => Mode::Sync(Duration::from_millis(*period)),
                (None, Some(period)) => Mode::Poll(Duration::from_millis(*period)),
                (None, None) => Mode::AsSent,
            };
            let plan = LogOptions {
                nodes: nodes(ids),
                wanted: Vec::new(),
                mode,
                duration: Some(Duration::from_millis(*duration_ms)),
                count: *count,
                nmt: *nmt,
                start_all: true,
                max_gap: None,
                overrides: none.clone(),
            };
            let outcome = log(master, &plan, observed)?;
            match outcome.nothing {
                Some(nothing) => return Err(nothing),
                None => Claim::Nothing,
            }
        }
    })
}

/// Parses `0x0102` as bytes.
pub(crate) fn hex(text: &str) -> Vec<u8> {
    let digits = text.trim_start_matches("0x");
    (0..digits.len() / 2).filter_map(|at| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok()).collect()
}
