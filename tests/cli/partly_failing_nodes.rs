//! Commands for several nodes report each node. Node 1 works, node 5 answers only 1000h, node 9 is absent.

use super::Bench;

const BENCH: &str = "[[device]]\nkind = \"mh4\"\nnode = 1\n\
                     [[device]]\nkind = \"mh4\"\nnode = 5\nanswers_only = [\"0x1000\"]\n";

/// Every command for several nodes, as words separated by `;`.
const COMMANDS: &[&str] = &[
    "read;NODES;pressure",
    "store;NODES",
    "restore;NODES",
    "check;NODES;pressure < 1000 bar",
    "check;NODES;pressure < 1000 bar;--for;300ms;--sync;50ms",
    "log;NODES;--sync;100ms;--count;3",
    "log;NODES;--poll;100ms;--count;3",
    "nmt;state;NODES",
    "nmt;start;NODES",
    "nmt;preop;NODES",
    "autozero;NODES;--limit;1000bar;--force;--dry-run",
];

#[track_caller]
fn names(failed: &[u8], nodes: &str, command: &str) {
    let command = command.replace("NODES", nodes);
    let done = Bench::described(BENCH).run_words(&command.split(';').collect::<Vec<_>>());
    assert_eq!(done.code, Some(7), "{command}: {}{}", done.stdout, done.stderr);
    for node in failed {
        assert!(done.stderr.contains(&format!("cangauge: node {node}: ")), "{command}: {}", done.stderr);
    }
    assert!(!done.stderr.contains("cangauge: node 1: "), "{command}: {}", done.stderr);
    assert!(done.stdout.contains('1'), "{command}: the result of node 1: {}", done.stdout);
}

#[test]
fn target_all_reports_a_node_that_answers_only_some_requests() {
    COMMANDS.iter().for_each(|command| names(&[5], "all", command));
}

#[test]
fn each_listed_node_that_fails_is_reported() {
    COMMANDS.iter().for_each(|command| names(&[5, 9], "1,5,9", command));
}

/// Node 1 sends a TPDO, so that there is something to receive.
const SENDING: &str = "[[device]]\nkind = \"mh4\"\nnode = 1\nstart = true\n\
                       set = { \"0x1800:2\" = 254, \"0x1800:5\" = 100 }\n\
                       [[device]]\nkind = \"mh4\"\nnode = 5\nanswers_only = [\"0x1000\"]\n";

#[test]
fn pdo_watch_continues_and_reports_the_node_that_fails() {
    for (nodes, failed) in [("all", &[5][..]), ("1,5,9", &[5, 9])] {
        let done = Bench::described(SENDING).run(&format!("pdo watch {nodes} --duration 1s")).exit(7);
        assert!(done.stdout.contains("pressure"), "{}{}", done.stdout, done.stderr);
        for node in failed {
            assert!(done.stderr.contains(&format!("cangauge: node {node}: ")), "{}", done.stderr);
        }
    }
    // Nothing received from node 1, and node 9 is absent: both failures have the same kind.
    let done = Bench::described(BENCH).run("pdo watch 1,9 --duration 1s").exit(3);
    assert!(done.stderr.contains("no TPDO"), "{}", done.stderr);
}

#[test]
fn single_node_that_fails_sets_its_own_exit_code() {
    for command in COMMANDS.iter().filter(|command| !command.starts_with("nmt")) {
        let command = command.replace("NODES", "9");
        let done = Bench::described(BENCH).run_words(&command.split(';').collect::<Vec<_>>());
        assert_eq!(done.code, Some(3), "{command}: {}{}", done.stdout, done.stderr);
    }
}

#[test]
fn failed_expression_sets_the_exit_code_even_if_a_node_fails() {
    let done = Bench::described(BENCH).run_words(&["check", "all", "pressure > 1000 bar"]);
    assert_eq!(done.code, Some(1), "{}{}", done.stdout, done.stderr);
    assert!(done.stdout.contains("no data: node 5: "), "{}", done.stdout);
}

#[test]
fn scan_lists_a_node_that_answers_only_some_requests() {
    let done = Bench::described(BENCH).run("scan").exit(0);
    assert!(done.stdout.lines().any(|line| line.trim_start().starts_with("5 ")), "{}", done.stdout);
}
