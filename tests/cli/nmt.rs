//! `cangauge nmt`.

use super::{ALL, Bench};

const HEARTBEAT: &str = "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 100 }\n";

#[test]
fn heartbeat_confirms_a_command() {
    let bench = Bench::described(HEARTBEAT);
    let done = bench.run("nmt start 5").prints("5  operational  heartbeat\n");
    assert_eq!((done.frames_of("000"), done.stderr.as_str()), (vec!["0105"], ""));
    bench.run("nmt preop 5").prints("5  pre-operational  heartbeat\n");
    bench.run("nmt stop 5").prints("5  stopped  heartbeat\n");
    bench.run("nmt state 5").prints("5  pre-operational  heartbeat\n");
    let done = bench.run("nmt start 5 -f json").prints("{\"node\":5,\"state\":\"operational\",\"by\":\"heartbeat\"}\n");
    assert_eq!(done.json()[0]["state"], "operational");
    bench.run("nmt start 5 -f csv").prints("node,state,by\n5,operational,heartbeat\n");
}

#[test]
fn boot_up_confirms_a_reset() {
    let bench = Bench::of(ALL);
    let done = bench.run("nmt reset 1").prints("1  -  boot-up\n");
    assert_eq!((done.frames_of("000"), done.frames_of("701")), (vec!["8101"], vec!["00", "00"]));
    let done = bench.run("nmt reset-comm 127").prints("127  -  boot-up\n");
    assert_eq!(done.frames_of("000"), ["827F"]);
}

#[test]
fn guarding_confirms_if_it_is_harmless() {
    // D-20-9 and MC1609 have 100Ch and 100Dh, both 0; DPS and MH-4 have no guarding.
    let done = Bench::of(ALL).run("nmt start 1-3,127").exit(0);
    assert_eq!(
        done.stdout,
        "  1  -            none\n  2  operational  guarding\n  3  operational  guarding\n127  -            none\n"
    );
    assert_eq!(
        done.stderr,
        "node 1: command sent, not confirmed: the node sends no heartbeat (1017h is 0)\n\
         node 127: command sent, not confirmed: the node sends no heartbeat (1017h is 0)\n"
    );
    assert_eq!(done.frames_of("000"), ["0101", "0102", "0103", "017F"]);
    // If 100Ch or 100Dh is not 0, the first RTR would start life guarding: no RTR is sent.
    for (time, factor) in [(100, 3), (100, 0), (0, 3)] {
        let set = format!("{{ \"0x100C\" = {time}, \"0x100D\" = {factor} }}");
        let guarded = format!("[[device]]\nkind = \"d20\"\nnode = 2\nset = {set}\n");
        let done = Bench::described(&guarded).run("nmt start 2").prints("2  -  none\n");
        assert_eq!(done.frames_of("702"), ["00"], "the boot-up, and no RTR");
    }
}

#[test]
fn missing_sdo_answer_proves_stopped() {
    let done = Bench::of(ALL).run("nmt stop 127").prints("127  stopped  sdo\n");
    assert_eq!(done.frames_of("000"), ["027F"]);
}

#[test]
fn unconfirmed_state_is_a_note_or_exit_3() {
    let bench = Bench::of(ALL);
    let done = bench.run("nmt start 127 -f json").prints("{\"node\":127,\"state\":null,\"by\":\"none\"}\n");
    assert_eq!(done.stderr, "node 127: command sent, not confirmed: the node sends no heartbeat (1017h is 0)\n");
    let done = bench.run("nmt start 127 --confirm").exit(3);
    assert_eq!(
        done.stderr,
        "cangauge: node 127: command sent, not confirmed: the node sends no heartbeat (1017h is 0)\n\
         hint: set a heartbeat: cangauge sdo write 127 producer-heartbeat-time 1000\n"
    );
}

#[test]
fn all_is_one_broadcast() {
    let done = Bench::of(ALL).run("nmt reset all").exit(0);
    assert_eq!(done.frames_of("000"), ["8100"]);
    assert_eq!(done.stdout.lines().filter(|line| line.ends_with("boot-up")).count(), 4, "{}", done.stdout);
}

#[test]
fn no_wait_only_sends() {
    let done = Bench::of(ALL).run("nmt start 1,2 --no-wait").prints("");
    assert_eq!(
        done.frames.iter().filter(|frame| !frame.ends_with("#00")).collect::<Vec<_>>(),
        ["000#0101", "000#0102"]
    );
    let done = Bench::of(ALL).run("nmt stop all --no-wait").prints("");
    assert_eq!(done.frames_of("000"), ["0200"]);
}

#[test]
fn unknown_states_are_never_guessed() {
    let done = Bench::of(ALL).run("nmt state 1-3,127 -f json").exit(0);
    let shown: Vec<_> = done.json().iter().map(|node| (node["state"].clone(), node["by"].clone())).collect();
    let guarding = ("pre-operational".into(), "guarding".into());
    let none = (serde_json::Value::Null, "none".into());
    assert_eq!(shown, [none.clone(), guarding.clone(), guarding, none]);
    assert_eq!(done.frames_of("000"), [""; 0]);
}

#[test]
fn absent_node_is_exit_3() {
    let bench = Bench::of(ALL);
    let done = bench.run("nmt state 9").exit(3);
    assert_eq!(
        done.stderr,
        "cangauge: node 9: no heartbeat and no SDO answer\nhint: check its node-ID, power and cable, and that it is not stopped; find the cause: cangauge doctor 9\n"
    );
    let done = bench.run("nmt state 1,9").exit(7);
    assert_eq!(done.stdout, "1  -  none\n9  -  none\n");
    let done = bench.run("nmt start 9 --confirm").exit(3);
    assert_eq!(
        done.stderr,
        "cangauge: node 9: command sent, but no heartbeat, boot-up or SDO answer was received\n\
         hint: check its node-ID, power and cable; find the cause: cangauge doctor 9\n"
    );
}

#[test]
fn stop_is_confirmed_by_heartbeat_or_missing_sdo() {
    // A stopped node has no SDO: only its heartbeat shows the state.
    let bench = Bench::described(&format!("{HEARTBEAT}[[device]]\nkind = \"dps\"\nnode = 6\n"));
    let done = bench.run("nmt stop 5,6").exit(0);
    assert_eq!(done.stdout, "5  stopped  heartbeat\n6  stopped  sdo\n");
}

#[test]
fn probe_sets_and_restores_the_heartbeat_time() {
    let done = Bench::of("mh4@5").run("nmt state 5 --probe").prints("5  pre-operational  heartbeat\n");
    let writes: Vec<&str> = done.frames_of("605").into_iter().filter(|request| request.starts_with("2B17")).collect();
    assert_eq!(writes.len(), 2, "{:?}", done.frames);
    assert!(writes[0] != writes[1] && writes[1] == "2B17100000000000", "{writes:?}");
    // If the state is known, nothing is set.
    let done = Bench::described(HEARTBEAT).run("nmt state 5 --probe").exit(0);
    assert!(done.frames_of("605").iter().all(|request| request.starts_with('4')), "{:?}", done.frames);
}

#[test]
fn watch_shows_boot_ups_and_states() {
    let bench = Bench::described(&format!("{HEARTBEAT}[[device]]\nkind = \"dps\"\nnode = 6\n"));
    let done = bench.run("nmt watch --duration 1s").exit(0);
    let lines: Vec<String> =
        done.stdout.lines().map(|line| line.split_whitespace().skip(1).collect::<Vec<_>>().join(" ")).collect();
    assert_eq!(lines, ["5 boot-up", "6 boot-up", "5 state pre-operational"]);
    assert_eq!(done.frames.iter().filter(|frame| !frame.starts_with("70")).count(), 0, "{:?}", done.frames);
}

#[test]
fn a_change_of_the_built_in_bench_is_not_kept() {
    let note = "each command starts the simulated devices with default settings: this change is lost";
    for line in ["nmt start 1", "unit 1 pressure psi", "store 127", "lss set-id 1 9", "sdo write 1 0x1017 100"] {
        let done = Bench::real("mh4@1,dps@127").run(line).exit(0);
        assert_eq!(done.stderr.matches(note).count(), 1, "{line}: {}", done.stderr);
    }
    // Nothing was changed.
    Bench::real("mh4@1,dps@127").run("lss set-id 127 1").fails(
        1,
        "cangauge: node 127: node-ID 1 is taken (a node answers); nothing was changed\n\
         hint: list the devices: cangauge lss scan\n",
    );
    for line in ["nmt state 1", "unit 1", "sdo read 1 0x1017", "lss scan", "pdo show 1", "errors 127"] {
        assert!(!Bench::real("mh4@1,dps@127").run(line).stderr.contains(note), "{line}");
    }
}

#[test]
fn startup_shows_and_sets_how_a_device_starts() {
    let bench = Bench::of("mh4@5,dps@6");
    bench.run("nmt startup 5").prints("wait\n");
    let done = bench.run("nmt startup 5 auto").prints("auto\n");
    assert!(done.stderr.contains("to keep them: cangauge store"), "{}", done.stderr);
    assert!(bench.run("nmt startup 6").exit(4).stderr.contains("1F80h"));
}
