//! Benches on which all is well: `doctor` finds nothing, and `conform` no deviation.

#[path = "../scenarios/conform/eds_text.rs"]
mod eds_text;

use crate::bench::{bench, identity};
use crate::env_number;
use crate::kinds::LARGE_KIND;
use crate::random::Random;
use crate::spec::{Act, DeviceSpec, Other, Spec};
use cangauge::bus::Bus;
use cangauge::bus::coded::TextRoundTrip;
use cangauge::device::{catalog, eds};
use cangauge::master::{Master, Timing};
use cangauge::node::Overrides;
use cangauge::sim::Recorder;
use cangauge::tasks::Failure;
use cangauge::tasks::config::{Journal, Snapshot};
use cangauge::tasks::conform::{ConformOptions, conform};
use cangauge::tasks::doctor::{DoctorOptions, examine};
use std::sync::Arc;
use std::time::Duration;

/// The number of benches of a plain `cargo test`; others: `ENGINE_HEALTHY=1000`.
const BENCHES: u64 = 60;

/// The number of devices that a plain `cargo test` checks with `conform`.
const CHECKED: u64 = 16;

/// The devices of a scenario without its faults. They enter OPERATIONAL by themselves, and a master sends SYNC.
fn healthy(seed: u64) -> Spec {
    let mut spec = Spec::of(seed);
    let random = &mut Random::new(seed);
    for (at, device) in (0u8..).zip(&mut spec.devices) {
        let node = device.node.unwrap_or(60) % 120 + 1 + at;
        // These have no TPDO in their dictionary, which is a finding.
        let has_tpdos = !matches!(device.kind, LARGE_KIND | "hydac-old");
        *device = DeviceSpec {
            kind: if has_tpdos { device.kind } else { "dps" },
            node: Some(node),
            start: true,
            bit_rate: None,
            unsaved_heartbeat: None,
            overload: false,
            device_faults: Vec::new(),
            deviation: None,
            ..device.clone()
        };
    }
    let taken = |spec: &Spec| spec.shares_node_ids();
    if taken(&spec) {
        (0u8..).zip(&mut spec.devices).for_each(|(at, device)| device.node = Some(10 + 3 * at));
    }
    let every_ms = *random.pick(&[20, 100, 500]);
    let plan = (0..60_000 / every_ms).map(|count| (count * every_ms * 1000, Act::Sync)).collect();
    Spec { others: vec![Other::Master { plan }], faults: Vec::new(), interrupts: Vec::new(), kill: None, ..spec }
}

#[test]
fn doctor_finds_nothing_where_all_is_well() {
    let mut wrong = Vec::new();
    for seed in 1..=env_number("ENGINE_HEALTHY").unwrap_or(BENCHES) {
        let spec = healthy(seed);
        let recorder = Recorder::new(Box::new(std::io::sink())).expect("no file");
        let mut bus = TextRoundTrip::new(bench(&spec, &recorder), spec.codec);
        let until = bus.mono() + Duration::from_millis(20);
        while matches!(bus.receive(until), Ok(cangauge::bus::Event::Frame(_))) {}
        let timing = Timing { timeout: Duration::from_millis(500), retries: 1 };
        let options = DoctorOptions {
            node: spec.devices[0].node.filter(|_| seed % 3 == 0).map(crate::carry_out::node),
            passive: false,
            lss: seed % 5 == 0,
            timeout: Duration::from_millis(200),
            rounds: 2,
            overrides: Overrides::new(),
        };
        let found = examine(&mut Master::new(&mut bus, timing), &options).expect("no Ctrl-C");
        if !found.findings.is_empty() || found.nodes.is_empty() {
            wrong.push(format!("seed {seed}: {found:?}\n{:?}", spec.devices));
        }
    }
    assert!(wrong.is_empty(), "{} benches\n{}", wrong.len(), wrong[..wrong.len().min(5)].join("\n"));
}

/// A device without a fault, alone on its bus. Descriptions that lack the vendor-ID are incomplete: another kind is used.
fn alone(seed: u64) -> Spec {
    let mut spec = healthy(seed);
    spec.others.clear();
    spec.devices.truncate(1);
    for device in &mut spec.devices {
        // The object for the start (1F80h, 2330h) has its default.
        device.start = false;
        // Some devices reject a shorter time, so that it could not be restored.
        device.event_timer_ms = device.event_timer_ms.filter(|time| *time >= 100);
        if identity(device).vendor == 0 {
            device.kind = "mc1609";
        }
    }
    spec
}

struct NoJournal;

impl Journal for NoJournal {
    fn begin(&mut self, _: &Snapshot) -> Result<(), Failure> {
        Ok(())
    }

    fn finish(&mut self) {}
}

#[test]
fn conform_finds_no_deviation_on_a_device_without_a_fault() {
    let mut wrong = Vec::new();
    for seed in 1..=env_number("ENGINE_HEALTHY").unwrap_or(CHECKED) {
        let spec = alone(seed);
        let recorder = Recorder::new(Box::new(std::io::sink())).expect("no file");
        let mut bus = TextRoundTrip::new(bench(&spec, &recorder), spec.codec);
        let until = bus.mono() + Duration::from_millis(20);
        while matches!(bus.receive(until), Ok(cangauge::bus::Event::Frame(_))) {}
        let node = crate::carry_out::node(spec.devices[0].node.expect("a node-ID"));
        let model = catalog::by_name(spec.devices[0].kind).expect("built in");
        let file = eds::read(eds_text::eds_text(&model).as_bytes()).expect("an EDS file");
        let options = ConformOptions { store: seed % 2 == 0, eds: Some(Arc::new(file)), ..ConformOptions::default() };
        let mut master = Master::new(&mut bus, Timing { timeout: Duration::from_millis(100), retries: 1 });
        let result = conform(&mut master, node, &Overrides::new(), &options, None, &mut NoJournal, &mut |_| {});
        match result {
            Ok(report) => {
                let deviations = report.results.iter().filter(|result| result.is_new_deviation());
                let found: Vec<String> =
                    deviations.map(|result| format!("{} {:?}", result.case.id, result.verdict)).collect();
                if !found.is_empty() || !report.not_restored.is_empty() {
                    let left = &report.not_restored;
                    wrong.push(format!("seed {seed}: {found:?} not restored {left:?}\n{:?}", spec.devices));
                }
            }
            Err(failure) => wrong.push(format!("seed {seed}: {failure}\n{:?}", spec.devices)),
        }
    }
    assert!(wrong.is_empty(), "{} devices\n{}", wrong.len(), wrong[..wrong.len().min(5)].join("\n"));
}
