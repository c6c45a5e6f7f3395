//! `cangauge scan`.

use super::{ALL, Bench};
use serde_json::json;

#[test]
fn table_lists_every_node() {
    let done = Bench::of(ALL).run("scan").prints(
        "NODE  STATE  DEVICE  NAME      VENDOR     PRODUCT     REVISION    SERIAL\n\
         \u{20}  1  -      mh4     MH-4-CAN  WIKA       0x00000001  0x00000001   10001\n\
         \u{20}  2  -      d20     D2X9      WIKA       0x00000001  0x00010001   30003\n\
         \u{20}  3  -      mc1609  -         HBM        0x00001609  0x00020001   40003\n\
         \u{20}127  -      dps     DPS       Honeywell  0x00443150  0x00010000   20002\n",
    );
    assert!(done.stderr.starts_with("4 nodes in 0."), "{}", done.stderr);
}

#[test]
fn silent_nodes_are_asked_again_in_parallel() {
    let done = Bench::of("mh4@5").run("scan").exit(0);
    for node in 1..=127u8 {
        let asked: Vec<u64> = (done.frames.iter().zip(&done.times))
            .filter(|(frame, _)| {
                let id = 0x600 + u16::from(node);
                ["4000100000000000", "4018100100000000"].iter().any(|data| **frame == format!("{id:03X}#{data}"))
            })
            .map(|(_, time)| *time)
            .collect();
        assert!(node == 5 || asked.len() == 2, "node {node}: {asked:?}");
    }
    assert_eq!(done.frames_of("000"), [""; 0], "a scan sends no NMT");
    // Of which 65 ms are the first requests, and 200 ms the wait after them.
    let seconds: f64 = done.stderr.split(' ').nth(3).and_then(|text| text.parse().ok()).expect("how long it took");
    assert!((0.2..0.36).contains(&seconds), "{}", done.stderr);
}

#[test]
fn unknown_fields_are_null_in_json() {
    let done = Bench::of("mc1609@3,mh4@5").run("scan 1-16 --format json").exit(0);
    assert_eq!(
        done.json(),
        [
            json!({"node": 3, "state": null, "device_type": "0x00020194", "profile": 404, "vendor": 285, "vendor_name": "HBM",
                "product": 5641, "revision": 131_073, "serial": 40_003, "name": null, "device": "mc1609"}),
            json!({"node": 5, "state": null, "device_type": "0x00820194", "profile": 404, "vendor": 71, "vendor_name": "WIKA",
                "product": 1, "revision": 1, "serial": 10_001, "name": "MH-4-CAN", "device": "mh4"}),
        ]
    );
    let keys = done.stdout.lines().next().expect("a line");
    assert!(
        keys.starts_with(
            r#"{"node":3,"state":null,"device_type":"0x00020194","profile":404,"device":"mc1609","name":null,"vendor":"#
        ),
        "{keys}"
    );
}

#[test]
fn csv() {
    Bench::of("mh4@5").run("scan 5 -f csv").prints(
        "node,state,device,name,vendor,vendor_name,product,revision,serial\n\
         5,,mh4,MH-4-CAN,71,WIKA,1,1,10001\n",
    );
}

#[test]
fn state_comes_from_the_heartbeat() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 50 }\n\
         [[device]]\nkind = \"dps\"\nnode = 6\nstart = true\nset = { \"0x1017\" = 50 }\n",
    );
    let states: Vec<_> = bench.run("scan -f json").exit(0).json().iter().map(|node| node["state"].clone()).collect();
    assert_eq!(states, ["pre-operational", "operational"]);
}

#[test]
fn two_devices_of_a_kind_have_their_own_serial_numbers() {
    let done = Bench::of("mh4@5,mh4@6").run("scan -f json").exit(0);
    let serials: Vec<_> = done.json().iter().map(|node| node["serial"].clone()).collect();
    assert_eq!(serials, [10_001, 10_002]);
}

#[test]
fn no_node_is_exit_3() {
    let bench = Bench::of("mh4@5");
    bench.run("scan 6-9").fails(
        3,
        "cangauge: no node answered\n\
         hint: check the power, the bit rate, the wiring and the 120 ohm terminators; stopped nodes do not answer: \
         cangauge nmt preop all; without hardware: --bus sim\n",
    );
    let error = bench.run("scan 6-9 --format json").exit(3).error();
    assert_eq!((&error["error"]["kind"], &error["error"]["exit"]), (&json!("no-answer"), &json!(3)));
}

#[test]
fn all_is_every_node() {
    let done = Bench::of("mh4@1,dps@127").run("scan all -f csv -q").exit(0);
    assert_eq!((done.stdout.lines().count(), done.stderr.as_str()), (3, ""));
}

#[test]
fn timeout_option_is_used() {
    let done = Bench::of("mh4@5").run("scan 5,6 -t 1s --retries 3").exit(0);
    assert_eq!(done.frames_of("606").len(), 4);
    assert!(done.stderr.starts_with("1 node in 1."), "{}", done.stderr);
}

#[test]
fn passive_sends_nothing() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nset = { \"0x1017\" = 500 }\n\
         [[device]]\nkind = \"dps\"\nnode = 6\nstart = true\n[[device]]\nkind = \"mh4\"\nnode = 7\n",
    );
    let done = bench.run("scan --passive -f json").exit(0);
    let states: Vec<_> = done.json().iter().map(|node| node["state"].clone()).collect();
    let unknown = serde_json::Value::Null;
    assert_eq!(states, [json!("pre-operational"), unknown.clone(), unknown], "only a heartbeat shows a state");
    let foreign =
        done.frames.iter().filter(|frame| !["705#", "706#", "707#", "186#"].iter().any(|id| frame.starts_with(id)));
    assert_eq!(foreign.collect::<Vec<_>>(), [""; 0]);
}
