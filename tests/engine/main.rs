//! Generated scenarios: a seed gives devices, faults, a command and an interruption. Then the test checks the rules
//! that must always hold. The same seed always gives the same scenario.
//!
//! ```text
//! cargo test --test engine                                        some hundred fixed seeds
//! ENGINE_RUNS=100000 cargo test --release --test engine           that many, from a new seed
//! ENGINE_SECONDS=120 cargo test --release --test engine           for that time, from a new seed
//! ENGINE_SEED=123 cargo test --test engine -- --nocapture         one seed, with its transcript
//! ENGINE_FROM=1 ENGINE_RUNS=1000 cargo test --test engine         a range of seeds
//! ```
//!
//! A failing scenario is reduced as long as it breaks the same rule, and printed with its frames.

mod bench;
mod carry_out;
mod command;
mod deviation;
mod healthy;
mod kinds;
mod make;
mod random;
mod rules;
mod run;
mod shrink;
mod spec;
mod station;
mod tap;
mod time;

use rules::{Violation, check_rules};
use spec::Spec;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// The number of scenarios of a plain `cargo test`.
const DEFAULT_SCENARIOS: u64 = 400;

/// The test stops after this number of failures.
const MAX_FAILURES: usize = 12;

fn env_number<T: std::str::FromStr>(name: &str) -> Option<T> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text} is not a number")))
}

/// Prints a line. A closed stdout is not an error.
fn print_line(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// Runs a scenario. Returns the violated rules and the transcript.
fn run_and_check(spec: &Spec) -> (Vec<Violation>, String) {
    let tried = catch_unwind(AssertUnwindSafe(|| {
        let mut run = run::run(spec);
        let end = format!("{:?} at {:?}\n", run.result, run.ended.since_start());
        let devices = run.bus.bus.inner().inner().stations::<station::FaultyDevice>();
        let devices: Vec<_> = devices.map(|station| bench::device_state(&station.device)).collect();
        let end = end + &format!("before {:?}\nafter {devices:?}", run.before);
        let violations = check_rules(spec, &mut run);
        (violations, run::transcript(&run) + &end)
    }));
    tried.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        (vec![("does not panic", text.unwrap_or_default())], String::new())
    })
}

/// Removes everything that is not needed to break the same rule.
fn shrink(mut spec: Spec, rule: &str) -> Spec {
    loop {
        let breaks = |smaller: &Spec| run_and_check(smaller).0.iter().any(|(violations, _)| *violations == rule);
        match spec.smaller().into_iter().find(breaks) {
            Some(smaller) => spec = smaller,
            None => return spec,
        }
    }
}

fn report(seed: u64, violations: &[Violation], whole: bool) -> String {
    let mut text = format!("\n=== seed {seed}\n");
    for (rule, how) in violations {
        text += &format!("  {rule}: {how}\n");
    }
    if let (Some((rule, _)), true) = (violations.first(), whole) {
        let small = shrink(Spec::of(seed), rule);
        let (violations, transcript) = run_and_check(&small);
        text += &format!("  smallest: {small:#?}\n  {violations:?}\n{transcript}\n");
    }
    text
}

#[test]
fn no_rule_is_broken() {
    if let Some(seed) = env_number("ENGINE_SEED") {
        let spec = Spec::of(seed);
        let (violations, transcript) = run_and_check(&spec);
        print_line(&format!("{spec:#?}\n{transcript}"));
        assert!(violations.is_empty(), "{}", report(seed, &violations, true));
        return;
    }
    let (runs, seconds): (Option<u64>, Option<u64>) = (env_number("ENGINE_RUNS"), env_number("ENGINE_SECONDS"));
    let fresh = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |now| now.as_secs() << 24);
    let first = env_number("ENGINE_FROM").unwrap_or_else(|| if runs.or(seconds).is_some() { fresh() } else { 1 });
    let most = runs.unwrap_or(if seconds.is_some() { u64::MAX } else { DEFAULT_SCENARIOS });
    let started = Instant::now();
    let until = seconds.map(|seconds| started + Duration::from_secs(seconds));
    let next = AtomicU64::new(0);
    let failures: Mutex<Vec<(u64, Vec<Violation>)>> = Mutex::new(Vec::new());
    print_line(&format!("scenarios from seed {first}"));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let enough =
                failures.lock().expect("no thread panicked").len() >= env_number("ENGINE_MOST").unwrap_or(MAX_FAILURES);
            if number >= most || enough || until.is_some_and(|until| Instant::now() >= until) {
                next.fetch_sub(1, Ordering::Relaxed);
                return;
            }
            let seed = first.wrapping_add(number);
            let (violations, _) = run_and_check(&Spec::of(seed));
            if !violations.is_empty() {
                failures.lock().expect("no thread panicked").push((seed, violations));
            }
        }
    };
    std::thread::scope(|scope| {
        let threads = env_number("ENGINE_THREADS").unwrap_or(2);
        (0..threads).for_each(|_| drop(scope.spawn(work)));
    });
    let count = next.load(Ordering::Relaxed);
    print_line(&format!("{count} scenarios from seed {first} in {:.1} s", started.elapsed().as_secs_f64()));
    let failures = failures.into_inner().expect("no thread panicked");
    let brief = env_number::<u8>("ENGINE_BRIEF").is_some();
    let reports: String = failures.iter().map(|(seed, violations)| report(*seed, violations, !brief)).collect();
    assert!(failures.is_empty(), "{} of {count} scenarios from seed {first}:\n{reports}", failures.len());
}
