//! `conform` on the simulated devices, with one deviation each, and interrupted.

mod deviant;
mod eds_text;
mod interrupted;
mod table;
mod table_404;
mod table_eds;
mod table_more;

use super::pdo_map::{Fault, FaultyBus};
use cangauge::bus::memory::{Clock, MemoryBus};
use cangauge::bus::{Bus, Event, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::device::catalog::{Model, by_name};
use cangauge::device::eds::Eds;
use cangauge::device::scalar::Scalar;
use cangauge::master::{Master, Timing};
use cangauge::node::Overrides;
use cangauge::output::conform::finding;
use cangauge::output::failure::ErrorMessage;
use cangauge::sim::{Device, Setup, State};
use cangauge::tasks::config::{Journal, Snapshot};
use cangauge::tasks::conform::{
    Area, Case, ConformOptions, ConformReport, Input, LssSetting, Needs, Statistic, Verdict, WhyNot, cases, conform,
};
use cangauge::tasks::{Failure, Kind};
use deviant::{Deviant, Deviation, NODE, Switch};
use eds_text::eds_text;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, LazyLock};
use std::time::Duration;

struct NoJournal;

impl Journal for NoJournal {
    fn begin(&mut self, _: &Snapshot) -> Result<(), Failure> {
        Ok(())
    }

    fn finish(&mut self) {}
}

fn node() -> NodeId {
    NodeId::new(NODE).expect("a node-ID")
}

/// A device with block transfer.
static LARGE: LazyLock<Arc<Model>> =
    LazyLock::new(|| Arc::new(Model::from_toml(include_str!("../engine/large.toml")).expect("a description")));

fn model(kind: &str) -> Arc<Model> {
    if kind == "large" { Arc::clone(&LARGE) } else { by_name(kind).expect("built in") }
}

fn bus(kind: &str, deviation: Option<Deviation>) -> MemoryBus {
    bus_at(250_000, kind, deviation)
}

fn bus_at(bit_rate: u32, kind: &str, deviation: Option<Deviation>) -> MemoryBus {
    Switch::reset();
    let mut bus = MemoryBus::new(Clock::Virtual).with_bit_rate(bit_rate);
    let mut setup = Setup::new(model(kind), node());
    if kind == "large" {
        setup.set.push((ObjectId::new(0x1018, 1), Scalar::Integer(71)));
    }
    bus.attach(Deviant::new(model(kind), Device::new(setup).expect("a device"), deviation));
    while bus.receive(Mono::at(Duration::from_millis(20))).expect("the bus works") != Event::Timeout {}
    bus
}

fn run(bus: &mut dyn Bus, kind: &str, options: &ConformOptions) -> Result<ConformReport, Failure> {
    let mut master = Master::new(bus, Timing { timeout: Duration::from_millis(100), retries: 1 });
    let overrides: Overrides = if kind == "large" { [(node(), model(kind))].into() } else { Overrides::new() };
    conform(&mut master, node(), &overrides, options, Some(&mut Switch), &mut NoJournal, &mut |_| {})
}

/// The EDS file of a device, with some texts replaced.
fn eds(kind: &str, changes: &[(&str, &str)]) -> Arc<Eds> {
    let mut text = eds_text(&model(kind));
    // The maker of the test device has another number.
    let vendor: &[(&str, &str)] = &[("DefaultValue=2130706433", "DefaultValue=71")];
    for (old, new) in changes.iter().chain(vendor.iter().filter(|_| kind == "large")) {
        assert!(text.contains(old), "{old} in {text}");
        text = text.replacen(old, new, 1);
    }
    Arc::new(cangauge::device::eds::read(text.as_bytes()).expect("an EDS file"))
}

/// Runs the cases, also those that store settings.
fn checked(bus: &mut dyn Bus, kind: &str, options: ConformOptions) -> ConformReport {
    run(bus, kind, &ConformOptions { store: true, ..options }).unwrap_or_else(|failure| panic!("{kind}: {failure}"))
}

/// The cases with a deviation that the manual does not state, with their findings.
fn deviations(report: &ConformReport) -> Vec<(&'static str, Vec<String>)> {
    let new = report.results.iter().filter(|result| result.is_new_deviation());
    new.map(|result| match &result.verdict {
        Verdict::Deviates(findings) => (result.case.id, findings.iter().map(finding).collect()),
        _ => (result.case.id, Vec::new()),
    })
    .collect()
}

/// The value of each writable object, the NMT state, and the stored node-ID and bit rate.
type Contents = (BTreeMap<ObjectId, Vec<u8>>, Option<State>, (Option<NodeId>, Option<u32>));

fn differences(bus: &mut MemoryBus, before: &Contents) -> Vec<String> {
    let (values, state, stored) = contents(bus);
    let changed = values.into_iter().filter(|(object, value)| before.0.get(object) != Some(value));
    let state = (state != before.1).then(|| format!("{state:?}"));
    let stored = (stored != before.2).then(|| format!("stored: {stored:?}"));
    changed.map(|(object, value)| format!("{object} {value:02x?}")).chain(state).chain(stored).collect()
}

fn contents(bus: &mut MemoryBus) -> Contents {
    let now = bus.mono();
    let station = bus.stations_mut::<Deviant>().next().expect("the device");
    let writable = station.model.dictionary.iter().filter(|entry| entry.access.is_writable());
    let objects: Vec<ObjectId> = writable.map(|entry| entry.object).collect();
    let values = objects.into_iter().filter_map(|object| Some((object, station.device.value(object, now)?))).collect();
    (values, station.device.state(), station.device.stored())
}

#[test]
fn simulated_devices_have_only_the_deviations_of_their_manuals() {
    let known = [
        ("mh4", &[("OD-05", "4.1.8, 4.1.9, 4.2.4, 4.2.5")][..]),
        ("d20", &[("SDO-08", "7"), ("SDO-09", "7"), ("OD-05", "16"), ("PDO-20", "6")]),
        ("mc1609", &[("404-33", "2.2, Filter")]),
        ("dps", &[("SDO-08", "table 23"), ("SDO-09", "table 23"), ("LSS-26", "table 7")]),
        ("hydac", &[]),
        ("large", &[]),
    ];
    for (kind, expected) in known {
        let mut bus = bus(kind, None);
        let before = contents(&mut bus);
        let report = checked(&mut bus, kind, ConformOptions { eds: Some(eds(kind, &[])), ..ConformOptions::default() });
        assert_eq!(deviations(&report), [], "{kind}");
        let found = report.results.iter().filter_map(|result| Some((result.case.id, result.known.as_deref()?)));
        assert_eq!(found.collect::<Vec<_>>(), expected, "{kind}");
        assert_eq!((report.not_restored, report.history), (vec![], None), "{kind}");
        let is_pass = |id: &&str| report.results.iter().any(|one| one.case.id == *id && one.verdict.name() == "pass");
        let stimulated = cases().filter(|case| case.needs == Needs::Stimulus).map(|case| case.id).filter(is_pass);
        let shown: &[&str] = match kind {
            "mh4" => &["404-32", "404-33", "404-70", "404-71", "404-72", "404-74"],
            "d20" => &["404-32", "404-33", "404-35"],
            "mc1609" => &["404-32"],
            "dps" => &["404-70", "404-71", "404-73", "404-74"],
            "hydac" => &["404-32", "404-33", "404-35", "404-70", "404-71", "404-74"],
            _ => &[],
        };
        assert_eq!(stimulated.collect::<Vec<_>>(), shown, "{kind}");
        assert!(report.length < Duration::from_secs(60), "{kind}: {:?}", report.length);
        assert_eq!(differences(&mut bus, &before), [""; 0], "{kind}");
    }
}

#[test]
fn each_deviation_is_found_by_its_case() {
    each_deviation_is_found(|case| vec![case.area]);
}

#[test]
#[ignore = "takes half a minute: .ci/run"]
fn each_deviation_is_found_by_no_other_case() {
    each_deviation_is_found(|_| Vec::new());
}

/// Checks that each deviation is found by its case, and by no other case of these areas (all areas if empty).
fn each_deviation_is_found(areas: fn(&Case) -> Vec<Area>) {
    let rows = [
        table::SDO,
        table::OD,
        table::NMT,
        table::ERROR_CONTROL,
        table_more::PDO,
        table_more::EMCY,
        table_more::STORE,
        table_more::LSS,
        table_404::ROWS,
    ]
    .concat();
    // Without a file: it contains some of the facts that the other cases check.
    let of_device = rows.into_iter().map(|(kind, case, deviation)| (kind, case, None, Some(deviation)));
    let of_eds = table_eds::EDS.iter().map(|(kind, case, changes, one)| (*kind, *case, Some(*changes), *one));
    let judging: BTreeMap<&str, &Case> =
        cases().filter(|case| case.area != Area::Timing).map(|case| (case.id, case)).collect();
    let (mut wrong, mut found) = (Vec::new(), BTreeSet::new());
    for (kind, id, changes, deviation) in of_device.chain(of_eds) {
        let mut bus = bus(kind, deviation);
        let only = areas(judging[id]);
        let eds = changes.map(|changes| eds(kind, changes));
        let deviations =
            deviations(&checked(&mut bus, kind, ConformOptions { only, eds, ..ConformOptions::default() }));
        if deviations.len() != 1 || deviations[0].0 != id {
            wrong.push(format!("{kind} {id}: {deviations:?}"));
        }
        found.insert(id);
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    let missing: Vec<&&str> = judging.keys().filter(|id| !found.contains(*id)).collect();
    assert!(missing.is_empty(), "cases without a deviation: {missing:?}");
}

#[test]
fn measured_times_are_those_of_the_device() {
    let mut late = bus(
        "mh4",
        Some(Deviation::Ignores(|memory, _, frame| {
            // Each tenth request gets no answer.
            memory.count += u32::from(frame.id().number() == 0x605);
            frame.id().number() == 0x605 && memory.count % 10 == 0
        })),
    );
    let options = ConformOptions { only: vec![Area::Timing], ..ConformOptions::default() };
    let figure = |report: &ConformReport, id: &str, wanted: Statistic| {
        let result = report.results.iter().find(|result| result.case.id == id).expect("the case");
        let Verdict::Measured(figures) = &result.verdict else { panic!("{id}: {:?}", result.verdict) };
        figures.iter().find(|figure| figure.statistic == wanted).expect("the figure").time
    };
    for kind in ["mh4", "d20", "mc1609", "dps"] {
        let mut bus = bus(kind, None);
        let before = contents(&mut bus);
        let report = run(&mut bus, kind, &options).expect("a report");
        let of = |id, wanted| figure(&report, id, wanted);
        let answer = of("TIM-01", Statistic::Max);
        assert!(answer < Duration::from_millis(10) && of("TIM-01", Statistic::Min) > Duration::ZERO, "{answer:?}");
        assert!(of("TIM-02", Statistic::Median) < Duration::from_millis(10));
        for id in ["TIM-03", "TIM-04"] {
            let mean = of(id, Statistic::Mean);
            assert!(mean.abs_diff(Duration::from_millis(100)) < Duration::from_millis(1), "{kind} {id} {mean:?}");
        }
        assert!(of("TIM-05", Statistic::Max) < Duration::from_millis(20));
        assert!(of("TIM-06", Statistic::Max) < Duration::from_secs(1));
        assert_eq!(report.not_restored, [], "{kind}");
        assert_eq!(differences(&mut bus, &before), [""; 0], "{kind}");
    }
    let report = run(&mut late, "mh4", &options).expect("a report");
    assert!(figure(&report, "TIM-05", Statistic::Max) >= Duration::from_millis(40));
}

/// The writes of this device take so long that the process value crosses a limit meanwhile.
#[test]
fn value_that_crosses_a_limit_by_itself_is_no_deviation() {
    let (_, _, deviation) = *table::SDO.iter().find(|(_, case, _)| *case == "SDO-20").expect("the row");
    let options = ConformOptions { only: vec![Area::Cia404], ..ConformOptions::default() };
    for start in [0, 5, 9] {
        let mut bus = bus("mh4", Some(deviation));
        let until = Mono::at(Duration::from_secs(start));
        while bus.receive(until).expect("the bus works") != Event::Timeout {}
        assert_eq!(deviations(&run(&mut bus, "mh4", &options).expect("a report")), [], "from {start} s");
    }
}

#[test]
fn other_nodes_are_a_reason_to_refuse() {
    let mut bus = bus("mh4", None);
    let other = Setup::new(model("d20"), NodeId::new(9).expect("a node-ID"));
    bus.attach(Device::new(other).expect("a device"));
    let failure = run(&mut bus, "mh4", &ConformOptions::default()).expect_err("another node");
    assert_eq!(failure.kind(), Kind::CheckFailed);
    let message = ErrorMessage::of(&failure).message;
    assert_eq!(message, "node 5: node 9 is on the bus, too: nothing was changed");
    let only = ConformOptions { only: vec![Area::Sdo], ..ConformOptions::default() };
    let report = run(&mut bus, "mh4", &only).expect("only SDO");
    let alone = report.results.iter().find(|result| result.case.id == "SDO-24").expect("the case");
    assert!(matches!(alone.verdict, Verdict::NotApplicable(_)), "{:?}", alone.verdict);
    assert_eq!(deviations(&report), []);
}

#[test]
fn lss_setting_that_could_not_be_restored_is_named_and_never_active() {
    // The device accepts the node-ID 128, and no other one afterwards.
    let deviation = Deviation::Sends(|memory, frame| {
        let is_answer = frame.id() == CanId::LSS_SLAVE && frame.data().first() == Some(&0x11);
        if !is_answer || memory.count == 0 && memory.lss[1] != 128 {
            return vec![frame];
        }
        memory.count += 1;
        vec![Frame::full(frame.id(), [0x11, u8::from(memory.count > 1), 0, 0, 0, 0, 0, 0])]
    });
    let mut bus = FaultyBus::new(bus("mh4", Some(deviation)), Fault::None, 0);
    let options = ConformOptions { only: vec![Area::Lss, Area::Timing], store: true, ..ConformOptions::default() };
    let report = run(&mut bus, "mh4", &options).expect("a report");
    assert_eq!(report.lss_not_restored, [LssSetting::NodeId]);
    assert_eq!(deviations(&report).iter().map(|(case, _)| *case).collect::<Vec<_>>(), ["LSS-20"]);
    let later = report.results.iter().skip_while(|result| result.case.id != "LSS-21");
    assert!(later.clone().count() > 10);
    for result in later {
        assert!(matches!(&result.verdict, Verdict::NotJudged(why) if matches!(**why, WhyNot::LssNotRestored(_))));
    }
    let left =
        "the old node-ID could not be set again by LSS: a reset may activate another one, a power cycle restores it";
    assert_eq!(cangauge::output::conform::left(&report).as_deref(), Some(left));
    let accepted =
        bus.sent.iter().rposition(|frame| frame.data() == [0x11, 128, 0, 0, 0, 0, 0, 0]).expect("the request");
    let is_reset = |frame: &Frame| frame.id() == CanId::NMT && matches!(frame.data(), [0x81 | 0x82, ..]);
    assert!(!bus.sent[accepted..].iter().any(is_reset));
}

#[test]
fn bit_rate_that_could_not_be_set_again_is_not_changed() {
    let accepts_detection = Deviation::Sends(|memory, frame| {
        let is_answer = frame.id() == CanId::LSS_SLAVE && memory.lss[..3] == [0x13, 0, 9];
        let answer = Frame::full(CanId::LSS_SLAVE, [0x13, 0, 0, 0, 0, 0, 0, 0]);
        vec![if is_answer { answer } else { frame }]
    });
    let options = ConformOptions { only: vec![Area::Lss], store: true, ..ConformOptions::default() };
    let sent_and_why = |bit_rate, kind, deviation| {
        let mut bus = FaultyBus::new(bus_at(bit_rate, kind, deviation), Fault::None, 0);
        let report = run(&mut bus, kind, &options).expect("a report");
        let result = report.results.into_iter().find(|result| result.case.id == "LSS-27").expect("the case");
        let codes = bus.sent.iter().filter_map(|frame| match frame.data() {
            [0x13, 0, code, ..] if frame.id() == CanId::LSS_MASTER => Some(*code),
            _ => None,
        });
        let reason = match result.verdict {
            Verdict::NotApplicable(why) => format!("{why:?}"),
            Verdict::NotJudged(why) => format!("{why:?}"),
            other => format!("{other:?}"),
        };
        (codes.collect::<Vec<_>>(), reason)
    };
    // The MH-4 can detect the bit rate; 100 kbit/s has no code. The reserved codes come from LSS-26 and LSS-29.
    let detects = |was_set| format!("DetectsBitRate {{ was_set: {was_set} }}");
    assert_eq!(sent_and_why(250_000, "mh4", None), (vec![5, 10, 255], detects(false)));
    assert_eq!(sent_and_why(100_000, "mc1609", None), (vec![], "UnknownBitRate".to_owned()));
    let (codes, why) = sent_and_why(250_000, "mc1609", Some(accepts_detection));
    assert_eq!((codes, why), (vec![5, 9, 3, 10, 255], detects(true)));
}

#[test]
fn fixed_bit_rate_that_ends_automatic_detection_is_not_stored() {
    let accepts_reserved = Deviation::Sends(|memory, frame| {
        let is_answer = frame.id() == CanId::LSS_SLAVE && memory.lss[..2] == [0x13, 1];
        vec![if is_answer { Frame::full(CanId::LSS_SLAVE, [0x13, 0, 0, 0, 0, 0, 0, 0]) } else { frame }]
    });
    let options = ConformOptions { only: vec![Area::Lss], store: true, ..ConformOptions::default() };
    // The MH-4 can detect the bit rate.
    for (kind, deviation, is_stored) in
        [("mh4", None, true), ("mh4", Some(accepts_reserved), false), ("mc1609", Some(accepts_reserved), true)]
    {
        let mut bus = FaultyBus::new(bus_at(250_000, kind, deviation), Fault::None, 0);
        run(&mut bus, kind, &options).expect("a report");
        let is_store = |frame: &Frame| frame.id() == CanId::LSS_MASTER && frame.data()[0] == 0x17;
        assert_eq!(bus.sent.iter().any(is_store), is_stored, "{kind}");
    }
}
