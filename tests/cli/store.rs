//! `cangauge store` and `cangauge restore`.

use super::{ALL, Bench};
use serde_json::json;

#[test]
fn capability_is_read_and_the_signature_is_sent_once() {
    let done = Bench::of(ALL).run("store 1").prints("1  all  ack\n");
    let to_1010: Vec<&str> = done.frames_of("601").into_iter().filter(|frame| frame[2..6] == *"1010").collect();
    assert_eq!(to_1010, ["4010100100000000", "2310100173617665"]);
    // The frames in the manuals of D-20-9 and DPS contain no size.
    let done = Bench::of(ALL).run("store 2,127 -f json").exit(0);
    assert_eq!(
        done.stdout,
        "{\"node\":2,\"stored\":\"all\",\"verified\":\"ack\",\"notes\":[]}\n\
         {\"node\":127,\"stored\":\"all\",\"verified\":\"ack\",\"notes\":[]}\n"
    );
    assert!(done.frames_of("602").contains(&"2210100173617665"), "{:?}", done.frames);
    assert!(done.frames_of("67F").contains(&"2210100173617665"), "{:?}", done.frames);
    let done = Bench::of(ALL).run("restore 2 -f csv").prints("node,restored,verified\n2,all,ack\n");
    assert!(done.frames_of("602").contains(&"221110016C6F6164"), "{:?}", done.frames);
    assert_eq!(done.frames_of("000"), [""; 0]);
}

#[test]
fn restore_without_reset_names_the_command_that_completes_it() {
    let done = Bench::of(ALL).run("restore 2").prints("2  all  ack\n");
    let note = "the defaults are used after the next reset; a store before that may keep the old values";
    assert_eq!(done.stderr, format!("node 2: {note}; reset and compare: cangauge restore 2 --reset\n"));
    // JSON contains the note as well.
    let done = Bench::of(ALL).run("restore 1 --group app -f json").exit(0);
    let command = "cangauge restore 1 --group app --reset";
    let noted = json!({"code": "after-reset", "message": note, "command": command});
    assert_eq!(done.json(), [json!({"node": 1, "restored": "app", "verified": "ack", "notes": [noted]})]);
    assert_eq!(done.stderr, format!("node 1: {note}; reset and compare: {command}\n"));
    assert!(!Bench::of(ALL).run("restore 1 --reset").exit(0).stderr.contains(note));
}

#[test]
fn signature_is_not_sent_to_a_device_without_the_capability() {
    // Bit 0: on command; bit 1: by itself.
    let bench =
        Bench::described("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1010:1\" = 2, \"0x1011:1\" = 0 }\n");
    let why = "the device stores automatically, not on command (0x1010:1 reads 0x00000002)";
    let done = bench.run("store 5").fails(4, &format!("cangauge: node 5: {why}: nothing was stored\n"));
    assert!(!done.frames_of("605").contains(&"2310100173617665"), "{:?}", done.frames);
    let why = "the device does not restore on command (0x1011:1 reads 0x00000000)";
    let done = bench.run("restore 5").fails(4, &format!("cangauge: node 5: {why}: nothing was restored\n"));
    assert!(!done.frames_of("605").contains(&"231110016C6F6164"), "{:?}", done.frames);
}

#[test]
fn missing_group_is_named() {
    Bench::of(ALL).run("store 127 --group comm").fails(
        4,
        "cangauge: node 127: the device cannot store group comm (no 0x1010:2): nothing was stored\n\
         hint: store everything: cangauge store 127\n",
    );
    let done = Bench::of(ALL).run("restore 2 --group app -f json").exit(4);
    assert_eq!((done.error()["error"]["abort"].as_str(), done.frames_of("000").len()), (Some("0x06090011"), 0));
    let done = Bench::of(ALL).run("store 1,9").exit(7);
    assert_eq!(done.stdout, "1  all  ack\n");
}

#[test]
fn custom_cob_ids_are_not_lost_by_a_store() {
    let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1800:1\" = 0x400001AA }\n");
    let done = bench.run("store 5 --verify").prints("5  comm+app  reset\n");
    let saves: Vec<&str> = done.frames_of("605").into_iter().filter(|frame| frame.starts_with("231010")).collect();
    assert_eq!(saves, ["2310100273617665", "2310100373617665"]);
    assert_eq!(
        done.stderr,
        "node 5: stored comm and app, because storing all would reset these COB-IDs: \
         0x1800:1 (0x400001AA)\n\
         node 5: only group \"all\" stores these; they were not saved: node-id, bit-rate\n\
         node 5: the state before the reset is unknown; the node is in the state in which it boots\n"
    );
}

#[test]
fn settings_that_the_device_does_not_store_are_named() {
    let bench = Bench::described("[[device]]\nkind = \"dps\"\nnode = 127\nset = { \"0x1800:5\" = 1000 }\n");
    let done = bench.run("store 127").prints("127  all  ack\n");
    assert_eq!(
        done.stderr,
        "node 127: the device does not store these; they return to their defaults at power off: \
         0x1800:5 tpdo1-event-timer (1000)\n"
    );
}

#[test]
fn reset_verifies_and_the_previous_state_is_restored() {
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\nset = { \"0x1017\" = 100, \"0x6132:1\" = 2 }\n";
    let done = Bench::described(device).run("store 5 --verify").prints("5  all  reset\n");
    assert_eq!(done.frames_of("000"), ["8105", "0105"]);
    assert_eq!(done.stderr, "node 5: the node was operational and is operational again\n");
    let done = Bench::described(device).run("restore 5 --reset --group app").prints("5  app  reset\n");
    assert_eq!(done.frames_of("000"), ["8105", "0105"]);
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 100 }\n";
    let done = Bench::described(device).run("restore 5 --reset").prints("5  all  reset\n");
    assert_eq!(done.frames_of("000"), ["8105"]);
}
