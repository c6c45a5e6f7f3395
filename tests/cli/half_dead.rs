//! `all` never loses a node: node 5 answers 1000h and nothing else.

use super::{Bench, Done};

const BENCH: &str = "[[device]]\nkind = \"mh4\"\nnode = 1\n\
                     [[device]]\nkind = \"mh4\"\nnode = 5\nanswers_only = [\"0x1000\"]\n";

/// Runs a command with `all`: node 1 succeeds, node 5 is named, the exit code is 7.
#[track_caller]
fn names_node_5(line: &str) -> Done {
    names_node_5_in(Bench::described(BENCH).run(line))
}

#[track_caller]
fn names_node_5_in(done: Done) -> Done {
    assert_eq!(done.code, Some(7), "{}{}", done.stdout, done.stderr);
    assert!(done.stderr.contains("cangauge: node 5: "), "{}", done.stderr);
    done
}

#[test]
fn read_all_names_a_node_that_answers_in_part() {
    assert!(names_node_5("read all pressure").stdout.starts_with('1'));
}

#[test]
fn store_all_names_a_node_that_answers_in_part() {
    names_node_5("store all");
}

#[test]
fn restore_all_names_a_node_that_answers_in_part() {
    names_node_5("restore all");
}

#[test]
fn check_all_names_a_node_that_answers_in_part() {
    let words = ["check", "all", "pressure < 1000 bar", "--for", "300ms", "--sync", "50ms"];
    for length in [3, words.len()] {
        let done = names_node_5_in(Bench::described(BENCH).run_words(&words[..length]));
        assert!(done.stdout.contains("ok    1  pressure < 1000 bar"), "{}", done.stdout);
    }
}

#[test]
fn failed_expression_decides_over_a_node_that_answers_in_part() {
    let done = Bench::described(BENCH).run_words(&["check", "all", "pressure > 1000 bar"]);
    assert_eq!(done.code, Some(1), "{}{}", done.stdout, done.stderr);
    assert!(done.stdout.contains("no data: node 5: "), "{}", done.stdout);
}

#[test]
fn log_all_names_a_node_that_answers_in_part() {
    let done = names_node_5("log all --sync 100ms --count 3");
    assert_eq!(done.stdout.lines().count(), 4, "the heading and three values of node 1: {}", done.stdout);
}

#[test]
fn nmt_state_all_names_a_node_that_answers_in_part() {
    let done = names_node_5("nmt state all");
    assert!(done.stdout.contains('1'), "{}", done.stdout);
}

#[test]
fn nmt_start_all_names_a_node_that_answers_in_part() {
    names_node_5("nmt start all");
}

#[test]
fn pdo_watch_all_names_a_node_that_answers_in_part() {
    let done = Bench::described(BENCH).run("pdo watch all --duration 1s");
    assert_ne!(done.code, Some(0), "{}{}", done.stdout, done.stderr);
    assert!(done.stderr.contains("node 5"), "{}", done.stderr);
}

#[test]
fn autozero_all_names_a_node_that_answers_in_part() {
    names_node_5("autozero all --limit 1000bar --force --dry-run");
}

#[test]
fn scan_lists_a_node_that_answers_in_part() {
    let done = names_node_5("scan");
    assert!(done.stdout.lines().any(|line| line.trim_start().starts_with("5 ")), "{}", done.stdout);
}
