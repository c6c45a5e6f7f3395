//! Every example of the help and of the README that uses the simulated bus works.

#[path = "../../src/cli/tests/examples.rs"]
mod texts;

use super::Bench;
use std::collections::BTreeSet;
use std::sync::Mutex;
use std::thread;
use texts::{examples, without_redirection};
pub(super) use texts::{readme, words};

/// Examples that take too long, by name.
const TOO_LONG: [&str; 1] = ["cangauge -b sim log 1-3,127 --sync 10ms --duration 1h -o run.csv"];

#[test]
fn every_example_on_the_simulated_bus_works() {
    let examples: BTreeSet<String> =
        examples().into_iter().filter(|example| example.starts_with("cangauge -b sim ")).collect();
    for example in TOO_LONG {
        assert!(examples.contains(example), "{example} is not an example");
    }
    let run = |example: &str| {
        let bench = Bench::real("mh4@1");
        let words = words(without_redirection(example));
        let words: Vec<&str> = words.iter().skip(1).map(String::as_str).collect();
        let done = bench.finish(&mut bench.command(&words)).exit(0);
        assert!(!done.stdout.is_empty() || !bench.files().is_empty() || example.contains(" sdo write "), "{example}");
    };
    // On the real clock, as for users. Not all at once: on a busy machine, the simulated devices would answer too late.
    let left = Mutex::new(examples.iter().filter(|example| !TOO_LONG.contains(&example.as_str())));
    let next = || left.lock().expect("no panic while locked").next();
    let work = || {
        while let Some(example) = next() {
            run(example);
        }
    };
    thread::scope(|scope| (0..6).for_each(|_| drop(scope.spawn(work))));
}
