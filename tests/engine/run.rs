//! Builds what a [`Spec`] says, lets the command run, and keeps everything that can be judged afterwards.

use crate::spec::{Command, DeviceSpec, Fault, Other, Spec, Target, Vagary};
use crate::station::{Babbler, Rival, Unruly, ms, write};
use crate::tap::{Passed, Tap};
use cangauge::bus::faults::{FaultPlan, Faulty};
use cangauge::bus::memory::{BIT_RATE, Clock, MemoryBus};
use cangauge::bus::{Bus, Mono, Stamp};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::pdo::TpdoNumber;
use cangauge::device::catalog;
use cangauge::device::description::Scalar;
use cangauge::device::unit::Unit;
use cangauge::master::{Master, Timing};
use cangauge::measure::sample::{Sample, Source};
use cangauge::measure::survey::Overrides;
use cangauge::sim::{Device, Direction, GoneAfter, Overload, Recorder, Setup, State};
use cangauge::tasks::log::{Mode, Note, Observer, Plan, log};
use cangauge::tasks::lss::{self, Job, LssAddress, Rate};
use cangauge::tasks::pdo::{self, Item, Send, Settings, Wish};
use cangauge::tasks::sdo::{Knowledge, Options, SizeMode};
use cangauge::tasks::settings::{self, errors, filter, info, limits, minmax, unit};
use cangauge::tasks::store::Group;
use cangauge::tasks::{Failure, autozero, nmt, read, restore, scan, sdo, store};
use std::io::Write;
use std::ops::ControlFlow;
use std::sync::{Arc, Mutex};
use std::time::Duration;

/// What a command claims when it ends well.
#[derive(Clone, Debug)]
pub(crate) enum Said {
    Nothing,
    /// Node and serial number.
    Found(Vec<(u8, Option<u32>)>),
    /// Node, object and bytes as they were sent.
    Values(Vec<(u8, ObjectId, Vec<u8>)>),
    States(Vec<(u8, Option<NmtState>)>),
    /// Whether all went well.
    Probed(bool),
    Assigned {
        new: Option<u8>,
        stored: bool,
        rate: Option<Option<u32>>,
        retimed: bool,
    },
    Mapped(Settings),
    Stored,
}

/// What a device holds.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Holds {
    pub(crate) node: Option<u8>,
    pub(crate) bit_rate: Option<u32>,
    pub(crate) stored: (Option<u8>, Option<u32>),
    pub(crate) state: Option<State>,
    pub(crate) configuring: bool,
}

pub(crate) struct Run {
    pub(crate) result: Result<Said, Failure>,
    pub(crate) bus: Tap<Faulty<MemoryBus>>,
    pub(crate) before: Vec<Holds>,
    /// When the command had ended, and when it had settled.
    pub(crate) ended: Mono,
    pub(crate) settled: Mono,
    pub(crate) bound: Duration,
    /// Rows of a recording, as the simulator's own record writes them.
    pub(crate) rows: Vec<String>,
    pub(crate) truth: Vec<String>,
}

#[derive(Clone, Default)]
struct Memory(Arc<Mutex<Vec<u8>>>);

impl Write for Memory {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        self.0.lock().expect("nobody panicked").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}

pub(crate) fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

fn nodes(ids: &[u8]) -> Vec<NodeId> {
    ids.iter().copied().map(node).collect()
}

pub(crate) fn group(number: u8) -> Group {
    [Group::All, Group::Communication, Group::Application][usize::from(number % 3)]
}

fn setup(spec: &DeviceSpec) -> Setup {
    let model = catalog::by_name(spec.kind).expect("built in");
    let mut setup = Setup::new(Arc::clone(&model), node(spec.node.unwrap_or(1)));
    setup.node = spec.node.map(node);
    setup.serial = spec.serial;
    setup.start = spec.start;
    setup.bit_rate = spec.bit_rate;
    setup.seed = u64::from(spec.serial);
    let mut set = |object: ObjectId, value: Option<u16>| {
        let writable = model.dictionary.get(object).is_some_and(|entry| entry.access.is_writable());
        setup.set.extend(value.filter(|_| writable).map(|value| (object, Scalar::Integer(value.into()))));
    };
    set(ObjectId::new(0x1017, 0), spec.heartbeat_ms);
    set(ObjectId::new(0x1800, 5), spec.event_timer_ms);
    if spec.overload {
        let (from, until) = (Duration::from_millis(5), Duration::from_millis(400));
        let channel = setup.channels.first().map_or(1, |channel| channel.channel);
        setup.overloads = vec![(channel, Overload { from, until, direction: Direction::High })];
    }
    setup.oddities.latency = Duration::from_micros(spec.latency_us);
    for vagary in &spec.vagaries {
        match vagary {
            Vagary::LoseLss(service) => setup.oddities.lose.push(*service),
            Vagary::LateLss(service, ms) => drop(setup.oddities.late.insert(*service, Duration::from_millis(*ms))),
            Vagary::RefuseLss(service) => drop(setup.oddities.refuse.insert(*service, 1)),
            Vagary::ScansForEver => setup.oddities.scans_for_ever = true,
            Vagary::GoneAfterReset => setup.oddities.gone_after.push(GoneAfter::Reset),
            _ => {}
        }
    }
    setup
}

fn plan(faults: &[Fault]) -> FaultPlan {
    let mut plan = FaultPlan::default();
    for fault in faults {
        match *fault {
            Fault::Lose(number) => drop(plan.lose.insert(number)),
            Fault::LoseSent(number) => drop(plan.lose_sent.insert(number)),
            Fault::Duplicate(number) => drop(plan.duplicate.insert(number)),
            Fault::Delay(number, late) => drop(plan.delay.insert(number, Duration::from_millis(late))),
            Fault::Garble(number, place, turned) => drop(plan.garble.insert(number, (place, turned))),
            Fault::Truncate(number, length) => drop(plan.truncate.insert(number, length)),
            Fault::QueueFull(number) => drop(plan.queue_full.insert(number)),
            Fault::Down { at_us, for_ms } => {
                plan.down = Some((Mono::at(Duration::from_micros(at_us)), for_ms.map(Duration::from_millis)));
            }
            Fault::BusOff { at_us } => plan.bus_off = Some(Mono::at(Duration::from_micros(at_us))),
        }
    }
    plan
}

pub(crate) fn holds(device: &Device) -> Holds {
    let number = |node: Option<NodeId>| node.map(NodeId::get);
    let (node, rate) = device.stored();
    Holds {
        node: number(device.node()),
        bit_rate: device.bit_rate(),
        stored: (number(node), rate),
        state: device.state(),
        configuring: device.is_configuring(),
    }
}

/// The time that a command may take by what was asked for.
fn bound(spec: &Spec) -> Duration {
    let unit = Duration::from_millis(spec.timeout_ms) * (spec.retries + 1);
    match &spec.command {
        // Segments and answers that come just in time; what a device is, and the other way to say a size.
        Command::SdoRead { .. } | Command::SdoWrite { .. } => Duration::from_secs(1) + unit * 60,
        Command::Log { duration_ms, .. } => Duration::from_secs(60) + unit * 300 + Duration::from_millis(*duration_ms),
        _ => Duration::from_secs(60) + unit * 300,
    }
}

pub(crate) fn run(spec: &Spec) -> Run {
    let record = Memory::default();
    let recorder = Recorder::new(Box::new(record.clone())).expect("memory");
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(BIT_RATE).with_queue_length(spec.queue);
    for (place, device) in spec.devices.iter().enumerate() {
        let made = Device::new(setup(device)).expect("a device").recording(recorder.clone());
        let unsaved = device.node.zip(device.unsaved_heartbeat).map(|(id, time)| write(id, 0x1017, 0, time.into(), 2));
        let mut station = Unruly::new(made, place, &device.vagaries, unsaved);
        if let Command::SdoWrite { node, object, .. } = &spec.command {
            station.watched = (device.node == Some(*node)).then_some(*object);
        }
        bus.attach(station);
    }
    for other in &spec.others {
        match other {
            Other::Master { plan } => bus.attach(Rival::new(plan)),
            Other::Babbler { every_us, seed, nasty } => bus.attach(Babbler::new(*every_us, *seed, *nasty)),
        }
    }
    // The boot-ups go over the wire before the program comes.
    let start = ms(20);
    while !matches!(bus.receive(start), Ok(cangauge::bus::Event::Timeout) | Err(_)) {}
    for interrupt in &spec.interrupts {
        bus.interrupt_at(start + Duration::from_micros(*interrupt));
    }
    let before = bus.stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect();
    let bound = bound(spec);
    let mut bus = Tap::new(Faulty::new(bus, plan(&spec.faults)), start + bound);
    let mut rows = Rows::default();
    let timing = Timing { timeout: Duration::from_millis(spec.timeout_ms), retries: spec.retries };
    let mut master = Master::new(&mut bus, timing);
    let result = carry_out(&mut master, spec, &mut rows);
    master.settle();
    drop(master);
    let ended = bus.now().mono;
    if bus.overran {
        bus.overran = ended > bus.deadline || result.is_err();
    }
    // What was handed over last gets there, and who was reset is back.
    let quiet = ended + Duration::from_millis(400);
    while !matches!(bus.bus.inner_mut().receive(quiet), Ok(cangauge::bus::Event::Timeout) | Err(_)) {}
    let settled = bus.now().mono;
    recorder.flush().expect("memory");
    let truth = record.0.lock().expect("nobody panicked").clone();
    let truth = String::from_utf8(truth).expect("text").lines().skip(1).map(str::to_owned).collect();
    Run { result, bus, before, ended, settled, bound, rows: rows.rows, truth }
}

/// Keeps what a recording gives, as the simulator's own record would write it.
#[derive(Default)]
struct Rows {
    rows: Vec<String>,
}

impl Observer for Rows {
    fn samples(&mut self, samples: &[Sample], sources: &[Source]) -> ControlFlow<()> {
        for sample in samples {
            let source = &sources[sample.source];
            let value = sample.value.map(|value| value.to_string()).unwrap_or_default();
            let status = sample.status.map_or("", |status| status.as_str());
            let at = sample.at.mono.since_start().as_micros();
            let Source { node, signal, unit, .. } = source;
            self.rows.push(format!("{at},{node},{signal},{value},{unit},{status},{}", sample.raw));
        }
        ControlFlow::Continue(())
    }

    fn note(&mut self, _: &Note, _: Stamp) {}

    fn tick(&mut self, _: Stamp, _: u64) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

fn target(spec: &Spec, target: &Target) -> lss::Target {
    match target {
        Target::Node(id) => lss::Target::Node(node(*id)),
        Target::Only => lss::Target::Only,
        Target::Unconfigured => lss::Target::Unconfigured,
        Target::Identity(place) => lss::Target::Address(identity(&spec.devices[*place])),
    }
}

/// The LSS address of a device, as its own dictionary has it.
pub(crate) fn identity(spec: &DeviceSpec) -> LssAddress {
    let mut device = Device::new(setup(spec)).expect("a device");
    let mut part = |sub| {
        let bytes = device.value(ObjectId::new(0x1018, sub), Mono::START).unwrap_or_default();
        bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
    };
    LssAddress::new([part(1), part(2), part(3), part(4)])
}

fn carry_out(master: &mut Master<'_>, spec: &Spec, rows: &mut Rows) -> Result<Said, Failure> {
    let none = Overrides::new();
    let mut quiet = |_: lss::Note| {};
    let mut options =
        Options { blocks: cangauge::master::BlockMode::Auto, size: SizeMode::Auto, progress: &mut |_| {} };
    Ok(match &spec.command {
        Command::Scan { nodes: ids } => {
            let wait = Duration::from_millis(200.min(spec.timeout_ms));
            let found = scan::scan(master, &nodes(ids), wait, spec.retries + 1, &none)?;
            let found = found.into_iter().filter(|found| found.failure.is_none());
            Said::Found(found.map(|found| (found.node.get(), found.instrument.identity.serial)).collect())
        }
        Command::Read { nodes: ids } => {
            let mut values = Vec::new();
            for result in read::read(master, &nodes(ids), &[], &none)? {
                for (target, sample) in result? {
                    values.push((target.source.node.get(), target.object, hex(&sample.raw.to_string())));
                }
            }
            Said::Values(values)
        }
        Command::Info { node: id } => {
            let device = settings::Device::open(master, node(*id), &none)?;
            let read = info::read(master, &device)?;
            Said::Found(vec![(*id, read.instrument.identity.serial)])
        }
        Command::PdoShow { node: id } => {
            let number = TpdoNumber::new(1);
            let shown = pdo::show(master, node(*id), number, &none)?;
            shown.into_iter().next().map_or(Said::Nothing, |shown| Said::Mapped(shown.settings))
        }
        Command::SdoRead { node: id, object } => {
            let mut knowledge = Knowledge::new(node(*id), &none);
            let value = sdo::read(master, &mut knowledge, *object, None, &mut options)?;
            Said::Values(vec![(*id, *object, value.raw)])
        }
        Command::SdoWrite { node: id, object, bytes } => {
            let knowledge = Knowledge::new(node(*id), &none);
            sdo::write(master, &knowledge, *object, bytes, &mut options)?;
            Said::Nothing
        }
        Command::Nmt { what, nodes: ids, all } => {
            let reports = nmt::command(master, *what, &nodes(ids), *all)?;
            Said::States(reports.iter().map(|report| (report.node.get(), report.state)).collect())
        }
        Command::NmtState { nodes: ids } => {
            let reports = nmt::states(master, &nodes(ids))?;
            Said::States(reports.iter().map(|report| (report.node.get(), report.state)).collect())
        }
        Command::NmtProbe { node: id } => {
            let probed = nmt::probe(master, node(*id))?;
            Said::Probed(probed.trouble.is_none())
        }
        Command::Startup { node: id, auto } => {
            let set = if *auto { nmt::Starts::Auto } else { nmt::Starts::Wait };
            nmt::startup(master, node(*id), &none, Some(set))?;
            Said::Nothing
        }
        Command::LssScan => {
            let found = lss::scan(master, &mut quiet)?;
            let serial = |slave: &lss::Slave| slave.address.map(|address| address.serial);
            Said::Found(found.iter().filter_map(|slave| Some((slave.node?.get(), serial(slave)))).collect())
        }
        Command::LssInquire { target: wanted } => {
            let told = lss::inquire(master, &target(spec, wanted), (&none, None), &mut quiet)?;
            let node = told.node.flatten();
            let serial = told.address.map(|address| address.serial);
            Said::Found(node.map(|node| (node.get(), serial)).into_iter().collect())
        }
        Command::LssStore { target: wanted } => {
            lss::store(master, &target(spec, wanted), (&none, None), false, &mut quiet)?;
            Said::Nothing
        }
        Command::Assign { target: wanted, id, rate, store, retime, via } => {
            let job = Job {
                target: target(spec, wanted),
                id: id.or((rate.is_none()).then_some(9)).map(node),
                rate: rate.map(Rate::Bits),
                store: *store,
                retime: *retime,
                via: *via,
                force: false,
                overrides: &none,
                given: None,
            };
            let report = lss::assign(master, &job, &mut quiet)?;
            Said::Assigned {
                new: report.new.map(NodeId::get),
                stored: report.stored,
                rate: report.rate.map(|rate| rate.bits),
                retimed: report.retimed,
            }
        }
        Command::Map { node: id, number, items, code, timer_ms, cob_id, keep } => {
            let wish = Wish {
                node: node(*id),
                number: TpdoNumber::new(*number).expect("a TPDO"),
                items: items.iter().map(|item| Item::Name((*item).to_owned(), None)).collect(),
                send: code.map(Send::Code),
                event_timer_ms: *timer_ms,
                inhibit_100us: None,
                cob_id: *cob_id,
            };
            Said::Mapped(pdo::map(master, &wish, *keep, &none)?.shown.settings)
        }
        Command::Autozero { node: id, channel, force, store, dry_run } => {
            let options = autozero::Options {
                channel: *channel,
                limit: autozero::Limit::Default,
                samples: 4,
                force: *force,
                store: *store,
                dry_run: *dry_run,
            };
            autozero::autozero(master, node(*id), &none, &options)?;
            Said::Nothing
        }
        Command::Store { node: id, group: number, verify } => {
            let device = store::device(master, node(*id), &none)?;
            store::store(master, &device, group(*number), *verify)?;
            Said::Stored
        }
        Command::Restore { node: id, group: number, reset } => {
            let device = store::device(master, node(*id), &none)?;
            restore::restore(master, &device, group(*number), *reset)?;
            Said::Stored
        }
        Command::Unit { node: id, signal, unit: code } => {
            let mut device = settings::Device::open(master, node(*id), &none)?;
            unit::set(master, &mut device, *signal, Unit(*code))?;
            match device.signal(*signal) {
                Ok(signal) => {
                    let object = ObjectId::new(0x6131, signal.channel);
                    Said::Values(vec![(*id, object, code.to_le_bytes().to_vec())])
                }
                Err(_) => Said::Nothing,
            }
        }
        Command::Filter { node: id, kind, constant } => {
            let device = settings::Device::open(master, node(*id), &none)?;
            let kinds = [
                None,
                Some(filter::FilterType::None),
                Some(filter::FilterType::Moving),
                Some(filter::FilterType::Repeating),
            ];
            let kind = kinds[usize::from(*kind)];
            filter::set(master, &device, None, filter::Wanted { kind, constant: *constant, damping: None })?;
            Said::Nothing
        }
        Command::Limits { node: id, lower, upper } => {
            let device = settings::Device::open(master, node(*id), &none)?;
            let wanted = [(limits::Limit::Lower, *lower), (limits::Limit::Upper, *upper)];
            limits::set(master, &device, "pressure", &wanted)?;
            Said::Nothing
        }
        Command::Errors { node: id, clear } => {
            let device = settings::Device::open(master, node(*id), &none)?;
            match clear {
                true => drop(errors::clear(master, &device)?),
                false => drop(errors::read(master, &device)?),
            }
            Said::Nothing
        }
        Command::Minmax { node: id } => {
            let device = settings::Device::open(master, node(*id), &none)?;
            minmax::reset(master, &device)?;
            Said::Nothing
        }
        Command::Log { nodes: ids, sync_ms, poll_ms, duration_ms, count, nmt } => {
            let mode = match (sync_ms, poll_ms) {
                (Some(period), _) => Mode::Sync(Duration::from_millis(*period)),
                (None, Some(period)) => Mode::Poll(Duration::from_millis(*period)),
                (None, None) => Mode::AsSent,
            };
            let plan = Plan {
                nodes: nodes(ids),
                wanted: Vec::new(),
                mode,
                duration: Some(Duration::from_millis(*duration_ms)),
                count: *count,
                nmt: *nmt,
                max_gap: None,
                overrides: none.clone(),
            };
            let outcome = log(master, &plan, rows)?;
            match outcome.nothing {
                Some(nothing) => return Err(nothing),
                None => Said::Nothing,
            }
        }
    })
}

/// `0x0102` as bytes.
pub(crate) fn hex(text: &str) -> Vec<u8> {
    let digits = text.trim_start_matches("0x");
    (0..digits.len() / 2).filter_map(|at| u8::from_str_radix(digits.get(2 * at..2 * at + 2)?, 16).ok()).collect()
}

/// What is said of a frame in a transcript.
pub(crate) fn transcript(run: &Run) -> String {
    let line = |(at, passed): &(Mono, Passed)| {
        let time = at.since_start();
        let (frame, from): (&Frame, _) = match passed {
            Passed::Sent(frame) => (frame, "T"),
            Passed::Received(frame) => (frame, "R"),
        };
        format!("({}.{:06}) sim {frame} {from}\n", time.as_secs(), time.subsec_micros())
    };
    run.bus.frames.iter().map(line).collect()
}
