//! `cangauge store` and `cangauge restore`.

use super::{ALL, Bench};

#[test]
fn the_capability_is_read_and_the_signature_goes_out_once() {
    let done = Bench::of(ALL).run("store 1").prints("1  all  ack\n");
    let to_1010: Vec<&str> = done.frames_of("601").into_iter().filter(|frame| frame[2..6] == *"1010").collect();
    assert_eq!(to_1010, ["4010100100000000", "2310100173617665"]);
    // The D-20-9 and the DPS want their bytes without a size, as their manuals' frames have them.
    let done = Bench::of(ALL).run("store 2,127 -f json").exit(0);
    assert_eq!(
        done.stdout,
        "{\"node\":2,\"stored\":\"all\",\"verified\":\"ack\"}\n{\"node\":127,\"stored\":\"all\",\"verified\":\"ack\"}\n"
    );
    assert!(done.frames_of("602").contains(&"2210100173617665"), "{:?}", done.frames);
    assert!(done.frames_of("67F").contains(&"2210100173617665"), "{:?}", done.frames);
    let done = Bench::of(ALL).run("restore 2 -f csv").prints("node,restored,verified\n2,all,ack\n");
    assert!(done.frames_of("602").contains(&"221110016C6F6164"), "{:?}", done.frames);
    assert_eq!(done.frames_of("000"), [""; 0]);
}

#[test]
fn a_restore_without_reset_says_what_is_left_to_do() {
    let done = Bench::of(ALL).run("restore 2").prints("2  all  ack\n");
    let note =
        "the defaults hold only after its next reset, and a store before that may keep the old values; to finish";
    assert_eq!(
        done.stderr,
        format!("node 2: {note}: cangauge nmt reset 2, or cangauge restore 2 --reset, which compares, too\n")
    );
    // In JSON the same on stderr, and nothing else on stdout.
    let done = Bench::of(ALL).run("restore 1 --group app -f json").exit(0);
    assert_eq!(done.stdout, "{\"node\":1,\"restored\":\"app\",\"verified\":\"ack\"}\n");
    assert_eq!(
        done.stderr,
        format!(
            "node 1: {note}: cangauge nmt reset 1, or cangauge restore 1 --group app --reset, which compares, too\n"
        )
    );
    // With the reset nothing is left, and nothing is said of it.
    assert!(!Bench::of(ALL).run("restore 1 --reset").exit(0).stderr.contains("to finish"));
}

#[test]
fn a_device_that_says_it_cannot_is_believed() {
    // Bit 0: on command; bit 1: by itself.
    let bench =
        Bench::described("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1010:1\" = 2, \"0x1011:1\" = 0 }\n");
    let why = "it stores by itself, and it does not store on command (0x1010:1 reads 0x00000002)";
    let done = bench.run("store 5").fails(4, &format!("cangauge: node 5: {why}: nothing was stored\n"));
    assert!(!done.frames_of("605").contains(&"2310100173617665"), "{:?}", done.frames);
    let why = "it does not restore on command (0x1011:1 reads 0x00000000)";
    let done = bench.run("restore 5").fails(4, &format!("cangauge: node 5: {why}: nothing was restored\n"));
    assert!(!done.frames_of("605").contains(&"231110016C6F6164"), "{:?}", done.frames);
}

#[test]
fn a_group_that_is_not_there_is_named() {
    Bench::of(ALL).run("store 127 --group comm").fails(
        4,
        "cangauge: node 127: it does not store comm by itself (it has no 0x1010:2): nothing was stored\n\
         hint: everything together: cangauge store 127\n",
    );
    let done = Bench::of(ALL).run("restore 2 --group app -f json").exit(4);
    assert_eq!((done.error()["error"]["abort"].as_str(), done.frames_of("000").len()), (Some("0x06090011"), 0));
    let done = Bench::of(ALL).run("store 1,9").exit(7);
    assert_eq!(done.stdout, "1  all  ack\n");
}

#[test]
fn identifiers_of_ones_own_are_not_stored_away() {
    let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1800:1\" = 0x400001AA }\n");
    let done = bench.run("store 5 --verify").prints("5  comm+app  reset\n");
    let saves: Vec<&str> = done.frames_of("605").into_iter().filter(|frame| frame.starts_with("231010")).collect();
    assert_eq!(saves, ["2310100273617665", "2310100373617665"]);
    assert_eq!(
        done.stderr,
        "node 5: comm and app are stored instead of all, which puts these back to their defaults: \
         0x1800:1 (0x400001AA)\n\
         node 5: all alone keeps these, they were not stored: node-id, bit-rate\n\
         node 5: what state it was in is not known: it is as it boots\n"
    );
}

#[test]
fn what_a_device_does_not_keep_is_said() {
    let bench = Bench::described("[[device]]\nkind = \"dps\"\nnode = 127\nset = { \"0x1800:5\" = 1000 }\n");
    let done = bench.run("store 127").prints("127  all  ack\n");
    assert_eq!(
        done.stderr,
        "node 127: it does not keep these, they are as delivered after power off: \
         0x1800:5 tpdo1-event-timer (1000)\n"
    );
}

#[test]
fn a_reset_proves_and_the_state_is_put_back() {
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\nset = { \"0x1017\" = 100, \"0x6132:1\" = 2 }\n";
    let done = Bench::described(device).run("store 5 --verify").prints("5  all  reset\n");
    assert_eq!(done.frames_of("000"), ["8105", "0105"]);
    assert_eq!(done.stderr, "node 5: it was operational and is again\n");
    let done = Bench::described(device).run("restore 5 --reset --group app").prints("5  app  reset\n");
    assert_eq!(done.frames_of("000"), ["8105", "0105"]);
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 100 }\n";
    let done = Bench::described(device).run("restore 5 --reset").prints("5  all  reset\n");
    assert_eq!(done.frames_of("000"), ["8105"]);
}
