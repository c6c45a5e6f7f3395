//! Scenarios without number: a seed gives a bench, what goes wrong on it, a command and an interruption; afterwards it
//! is judged what must always hold. Each is repeatable from its seed alone.
//!
//! ```text
//! cargo test --test engine                                        a few hundred fixed seeds
//! ENGINE_RUNS=100000 cargo test --release --test engine           so many, from a fresh seed
//! ENGINE_SECONDS=120 cargo test --release --test engine           for so long, from a fresh seed
//! ENGINE_SEED=123 cargo test --test engine -- --nocapture         this one, with its transcript
//! ENGINE_FROM=1 ENGINE_RUNS=1000 cargo test --test engine         these
//! ```
//!
//! A scenario that breaks a rule is made smaller as long as it still breaks it, and printed with its frames.

mod bench;
mod carry_out;
mod command;
mod judge;
mod kinds;
mod make;
mod random;
mod run;
mod shrink;
mod spec;
mod station;
mod tap;
mod time;

use judge::{Broken, judge};
use spec::Spec;
use std::io::Write;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Mutex;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

/// So many of them without being asked for more.
const FIXED: u64 = 400;

/// So many failures are made smaller and printed.
const MOST: usize = 12;

fn asked<T: std::str::FromStr>(name: &str) -> Option<T> {
    let text = std::env::var(name).ok()?;
    Some(text.parse().unwrap_or_else(|_| panic!("{name}={text} is no number")))
}

/// For people who look on; nobody may be there.
fn say(text: &str) {
    let _ = writeln!(std::io::stdout(), "{text}");
}

/// What a scenario breaks, and its transcript.
fn try_out(spec: &Spec) -> (Vec<Broken>, String) {
    let tried = catch_unwind(AssertUnwindSafe(|| {
        let mut run = run::run(spec);
        let end = format!("{:?} at {:?}\n", run.result, run.ended.since_start());
        let devices = run.bus.bus.inner().stations::<station::Unruly>();
        let devices: Vec<_> = devices.map(|unruly| bench::holds(&unruly.device)).collect();
        let end = end + &format!("before {:?}\nafter {devices:?}", run.before);
        let broken = judge(spec, &mut run);
        (broken, run::transcript(&run) + &end)
    }));
    tried.unwrap_or_else(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        let text = text.or_else(|| panic.downcast_ref::<&str>().map(|text| (*text).to_owned()));
        (vec![("does not panic", text.unwrap_or_default())], String::new())
    })
}

/// Takes away what is not needed to break the same rule.
fn shrink(mut spec: Spec, rule: &str) -> Spec {
    loop {
        let breaks = |smaller: &Spec| try_out(smaller).0.iter().any(|(broken, _)| *broken == rule);
        match spec.smaller().into_iter().find(breaks) {
            Some(smaller) => spec = smaller,
            None => return spec,
        }
    }
}

fn report(seed: u64, broken: &[Broken], whole: bool) -> String {
    let mut text = format!("\n=== seed {seed}\n");
    for (rule, how) in broken {
        text += &format!("  {rule}: {how}\n");
    }
    if let (Some((rule, _)), true) = (broken.first(), whole) {
        let small = shrink(Spec::of(seed), rule);
        let (broken, transcript) = try_out(&small);
        text += &format!("  smallest: {small:#?}\n  {broken:?}\n{transcript}\n");
    }
    text
}

#[test]
fn nothing_that_must_hold_is_ever_broken() {
    if let Some(seed) = asked("ENGINE_SEED") {
        let spec = Spec::of(seed);
        let (broken, transcript) = try_out(&spec);
        say(&format!("{spec:#?}\n{transcript}"));
        assert!(broken.is_empty(), "{}", report(seed, &broken, true));
        return;
    }
    let (runs, seconds): (Option<u64>, Option<u64>) = (asked("ENGINE_RUNS"), asked("ENGINE_SECONDS"));
    let fresh = || SystemTime::now().duration_since(UNIX_EPOCH).map_or(1, |now| now.as_secs() << 24);
    let first = asked("ENGINE_FROM").unwrap_or_else(|| if runs.or(seconds).is_some() { fresh() } else { 1 });
    let most = runs.unwrap_or(if seconds.is_some() { u64::MAX } else { FIXED });
    let begun = Instant::now();
    let until = seconds.map(|seconds| begun + Duration::from_secs(seconds));
    let next = AtomicU64::new(0);
    let failures: Mutex<Vec<(u64, Vec<Broken>)>> = Mutex::new(Vec::new());
    say(&format!("scenarios from seed {first}"));
    let work = || {
        loop {
            let number = next.fetch_add(1, Ordering::Relaxed);
            let enough = failures.lock().expect("nobody panicked").len() >= asked("ENGINE_MOST").unwrap_or(MOST);
            if number >= most || enough || until.is_some_and(|until| Instant::now() >= until) {
                next.fetch_sub(1, Ordering::Relaxed);
                return;
            }
            let seed = first.wrapping_add(number);
            let (broken, _) = try_out(&Spec::of(seed));
            if !broken.is_empty() {
                failures.lock().expect("nobody panicked").push((seed, broken));
            }
        }
    };
    std::thread::scope(|scope| {
        let threads = asked("ENGINE_THREADS").unwrap_or(2);
        (0..threads).for_each(|_| drop(scope.spawn(work)));
    });
    let count = next.load(Ordering::Relaxed);
    say(&format!("{count} scenarios from seed {first} in {:.1} s", begun.elapsed().as_secs_f64()));
    let failures = failures.into_inner().expect("nobody panicked");
    let brief = asked::<u8>("ENGINE_BRIEF").is_some();
    let reports: String = failures.iter().map(|(seed, broken)| report(*seed, broken, !brief)).collect();
    assert!(failures.is_empty(), "{} of {count} scenarios from seed {first}:\n{reports}", failures.len());
}
