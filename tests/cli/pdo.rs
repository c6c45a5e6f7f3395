//! `pdo show`, `pdo map`, `pdo watch`: the frames of the manuals, the checks before the first write, and the messages.

use super::{ALL, Bench, Done};
use serde_json::json;

/// Requests to write and NMT commands of a run, with the device's answers to the writes.
fn steps(done: &Done, node: u8) -> Vec<&str> {
    let request = format!("{:03X}#2", 0x600 + u16::from(node));
    let answer = format!("{:03X}#60", 0x580 + u16::from(node));
    let is_step =
        |frame: &&String| frame.starts_with(&request) || frame.starts_with(&answer) || frame.starts_with("000#");
    done.frames.iter().filter(is_step).map(String::as_str).collect()
}

#[test]
fn show() {
    let bench = Bench::of(ALL);
    let text = "PDO  COB-ID  SENT    TIMER  INHIBIT  MAPPING\n  \
                1  0x181   sync:1      0        -  0x6130:1/32 pressure [bar], 0x6150:1/8 pressure.status\n  \
                2  0x281   timer       0        -  0x6130:2/32 temperature [degC], 0x6150:2/8 temperature.status\n";
    bench.run("pdo show 1").prints(text);
    let line = bench.run("pdo show 1 1 --format json").exit(0).json();
    let pdo = json!({
        "node": 1, "pdo": 1, "cob_id": "0x181", "valid": true, "rtr": false, "transmission": "sync:1",
        "event_timer_ms": 0, "inhibit_us": null,
        "mapping": [
            { "object": "0x6130:1", "bits": 32, "signal": "pressure", "unit": "bar" },
            { "object": "0x6150:1", "bits": 8, "signal": "pressure.status", "unit": null },
        ],
    });
    assert_eq!(line, [pdo]);
    bench.run("pdo show 127 -f csv").prints(
        "node,pdo,cob_id,valid,rtr,transmission,event_timer_ms,inhibit_us,mapping\n\
         127,1,0x1FF,true,false,timer,100,,0x6130:1/32\n",
    );
    assert_eq!(bench.run("pdo show 3 -f json").exit(0).json().len(), 4);
    bench.run("pdo show 1 3").fails(
        4,
        "cangauge: node 1: read 0x1802:1: refused by the device (0x06020000, the object does not exist)\n\
         hint: it has the TPDOs 1, 2\n",
    );
    bench.run("pdo show 9").exit(3);
    bench.run("pdo show 1 0").refuses("\"0\" is not the number of a TPDO (1 to 512)");
}

/// MH-4, 3.4.2: TPDO1 carries the pressure alone.
#[test]
fn mh4_is_remapped_as_in_its_manual() {
    let done = Bench::of("mh4@1").run("pdo map 1 1 pressure -v").exit(0);
    assert_eq!(
        steps(&done, 1),
        [
            "601#23001801810100C0",
            "581#6000180100000000",
            "601#2F001A0000000000",
            "581#60001A0000000000",
            "601#23001A0120013061",
            "581#60001A0100000000",
            "601#2F001A0001000000",
            "581#60001A0000000000",
            "601#2300180181010040",
            "581#6000180100000000",
        ]
    );
    assert_eq!(done.stderr, "node 1: 5 writes, read back\nnode 1: TPDO1 waits for SYNC\n");
    let shown = "PDO  COB-ID  SENT    TIMER  INHIBIT  MAPPING\n  \
                 1  0x181   sync:1      0        -  0x6130:1/32 pressure [bar]\n";
    assert_eq!(done.stdout, shown);
}

/// DPS, tables 26 and 22 (there the value is in wire order).
#[test]
fn dps_is_remapped_as_in_its_manual() {
    let table_26 = |word: &str| {
        [
            "67F#22001801FF0100C0".to_owned(),
            "5FF#6000180100000000".to_owned(),
            "67F#22001A0000000000".to_owned(),
            "5FF#60001A0000000000".to_owned(),
            format!("67F#22001A01{word}"),
            "5FF#60001A0100000000".to_owned(),
            // Printed with 2Fh, which the device's other answers and requests do not use.
            "67F#22001A0001000000".to_owned(),
            "5FF#60001A0000000000".to_owned(),
            "67F#22001801FF010040".to_owned(),
            "5FF#6000180100000000".to_owned(),
        ]
    };
    let done = Bench::of("dps@127").run("pdo map 127 1 0x7100:1").exit(0);
    assert_eq!(steps(&done, 127), table_26("10010071"));
    let raw = Bench::described("[[device]]\nkind = \"dps\"\nnode = 127\nset = { \"1A00:1\" = 0x71000110 }\n");
    assert_eq!(steps(&raw.run("pdo map 127 1 pressure").exit(0), 127), table_26("20013061"));
}

/// DPS, tables 27 to 29 (the acknowledges printed with seven bytes).
#[test]
fn dps_transmission_is_set_as_in_its_manual() {
    let bench = Bench::of("dps@127");
    let one = |line: &str, frames: &[&str]| assert_eq!(steps(&bench.run(line).exit(0), 127), frames, "{line}");
    let answer = "5FF#6000180200000000";
    one("pdo map 127 1 --transmission acyclic", &["67F#2200180200000000", answer]);
    one("pdo map 127 1 --transmission sync:3", &["67F#2200180203000000", answer]);
    one("pdo map 127 1 --transmission event", &["67F#22001802FF000000", answer]);
    one("pdo map 127 1 --transmission timer", &[]);
    one("pdo map 127 1 --event-timer 1s", &["67F#22001805E8030000", "5FF#6000180500000000"]);
}

#[test]
fn a_rejected_number_is_explained_by_the_description() {
    let bench = Bench::of("mc1609@3,dps@127,d20@2");
    for (line, text) in [
        ("pdo map 127 1 --event-timer 2ms", "0x1800:5 accepts 0, 4-65535 ms (manual: 10.4, table 29)"),
        ("pdo map 127 1 --transmission 241", "0x1800:2 accepts 0-240, 254, 255 (manual: table 17, 10.4)"),
        ("pdo map 3 1 --event-timer 50ms", "0x1800:5 accepts from 100 ms (manual: 2.1.4)"),
        ("sdo write 3 0x1800:5 50", "0x1800:5 accepts from 100 ms (manual: 2.1.4)"),
        (
            "sdo write 2 0x100C=100 0x1017=1000",
            "0x1017:0 can be set only while 0x100C:0 and 0x100D:0 are 0 (manual: 14)",
        ),
        ("sdo write 2 0x1017=100 0x100C=10", "0x100C:0 can be set only while 0x1017:0 is 0"),
    ] {
        let done = bench.run(line);
        assert!(done.code != Some(0) && done.stderr.contains(text), "{line}: {}", done.stderr);
    }
    let done = bench.run("sdo write 2 0x100C=100 0x1017=1000");
    assert!(done.stderr.ends_with("switch the other off first: cangauge sdo write 2 0x100C:0=0 0x100D:0=0\n"));
    // A number that the rule allows is rejected for another reason.
    let done = bench.run("sdo write 127 0x1000 5").exit(4);
    assert!(!done.stderr.contains("accepts") && !done.stderr.contains("only while"), "{}", done.stderr);
}

#[test]
fn settings_that_the_device_does_not_store_are_noted() {
    let text = "node 127: the device does not store the settings of TPDO1: they are lost at power off\n";
    assert_eq!(Bench::of("dps@127").run("pdo map 127 1 --event-timer 20ms").exit(0).stderr, text);
    let done = Bench::of("mh4@1").run("pdo map 1 1 --event-timer 20ms").exit(0);
    assert!(!done.stderr.contains("does not store"), "{}", done.stderr);
    let done = Bench::of("dps@127").run("pdo map 127 1 --event-timer 100ms").exit(0);
    assert!(!done.stderr.contains("does not store"), "nothing was changed: {}", done.stderr);
}

/// D-20-9, page 6: no invalidation, in PRE-OPERATIONAL. The node is operational before (shown by node guarding) and
/// afterwards; while the mapping is changed, its PDO would have no bytes.
#[test]
fn d20_is_remapped_as_in_its_manual() {
    let bench = Bench::described("[[device]]\nkind = \"d20\"\nnode = 2\nstart = true\n");
    let done = bench.run("pdo map 2 1 pressure -q").exit(0);
    let frames = [
        "000#8002",
        "602#22001A0000000000",
        "582#60001A0000000000",
        "602#22001A0120013061",
        "582#60001A0100000000",
        "602#22001A0001000000",
        "582#60001A0000000000",
        "000#0102",
    ];
    assert_eq!((steps(&done, 2), done.stderr.as_str()), (frames.to_vec(), ""));
    assert_eq!(
        done.frames_of("702").iter().filter(|data| **data == "R1").count(),
        3,
        "each state by one guarding request"
    );
    // Back to the integer, in PRE-OPERATIONAL already: no NMT command.
    let done = Bench::of("d20@2").run("pdo map 2 1 0x2090/32").exit(0);
    assert_eq!(steps(&done, 2), [""; 0]);
    assert!(
        done.stderr.starts_with("node 2: TPDO1 has these settings already: nothing was written\n"),
        "{}",
        done.stderr
    );
}

#[test]
fn timer_is_the_transmission_type_of_the_device() {
    let done = Bench::of("mc1609@3").run("pdo map 3 2 --transmission timer --event-timer 1s -f json").exit(0);
    assert_eq!(steps(&done, 3), ["603#2B011805E8030000", "583#6001180500000000"]);
    let pdo = &done.json()[0];
    assert_eq!((&pdo["transmission"], &pdo["event_timer_ms"]), (&json!("event"), &json!(1000)));
    let done = Bench::of("mh4@1").run("pdo map 1 1 --transmission timer").exit(0);
    assert_eq!(steps(&done, 1)[0], "601#2F001802FE000000");
    assert!(done.stderr.contains("TPDO1 is sent only if a value changes"), "{}", done.stderr);
}

#[test]
fn a_rejected_write_is_named_and_the_old_mapping_is_restored() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("pdo map 1 1 pressure 0x6132:1/8 --format json").exit(4);
    let error = &done.error()["error"];
    assert_eq!(
        (&error["kind"], &error["object"], &error["abort"]),
        (&json!("refused"), &json!("0x1A00:2"), &json!("0x06040041"))
    );
    let message = "node 1: write 0x1A00:2 (0x6132:1/8): refused by the device (0x06040041, the object cannot be mapped \
                   to a PDO); TPDO1 has its old mapping and parameters";
    assert_eq!(error["message"], message);
    assert!(
        error["hint"].as_str().is_some_and(
            |hint| hint.starts_with("it can map: 0x6130:1/32") && hint.ends_with("0x9130:1/32 0x9130:2/32")
        ),
        "{error}"
    );
    // Each entry is restored, and the PDO is switched on.
    let all = steps(&done, 1);
    assert_eq!(all.last(), Some(&"581#6000180100000000"));
    assert!(all.ends_with(&["601#2300180181010040", "581#6000180100000000"]), "{all:?}");
    assert!(all.contains(&"601#23001A0208015061"), "{all:?}");
    // A parameter.
    bench.run("pdo map 1 1 --transmission 250").fails(
        4,
        "cangauge: node 1: write 0x1800:2 (250): refused by the device (0x06090030, value outside its range); \
         0x1800:2 accepts 0-240, 254, 255 (manual: 4.1.14, 3.4.3); TPDO1 has its old mapping and parameters\n",
    );
}

#[test]
fn wrong_requests_are_rejected_before_the_first_write() {
    let bench = Bench::of(ALL);
    let refuses = |line: &str, message: &str| bench.run(line).refuses(message);
    refuses("pdo map 1 1", "nothing to set: add signals, or use --transmission, --event-timer, --inhibit or --cob-id");
    refuses("pdo map 1 1 0x1:1/64 0x2:1/8", "node 1: the mapping has 9 bytes; a PDO has at most 8 bytes");
    refuses("pdo map 1 1 pressure/65", "\"pressure/65\": \"65\" is not a number of bits (1 to 64)");
    refuses(
        "pdo map 1 1 6130:300",
        "\"6130:300\" is neither a signal (pressure, ch1, pressure.status) nor an object (0x6130:1, 0x9130:1/32)",
    );
    refuses("pdo map 1 513 pressure", "\"513\" is not the number of a TPDO (1 to 512)");
    for wrong in ["sync:0", "sync:241", "256", "sync", "timers"] {
        let message =
            format!("\"{wrong}\" is not a transmission type (acyclic, sync:1 to sync:240, event, timer, 0 to 255)");
        refuses(&format!("pdo map 1 1 --transmission {wrong}"), &message);
    }
    refuses("pdo map 1 1 --event-timer 66s", "\"66s\" is not a duration in whole milliseconds (0ms to 65535ms)");
    refuses("pdo map 1 1 --event-timer 1500us", "\"1500us\" is not a duration in whole milliseconds (0ms to 65535ms)");
    refuses(
        "pdo map 1 1 --event-timer 100",
        "\"100\" has no unit (100ms): it must be a duration in whole milliseconds (0ms to 65535ms)",
    );
    refuses("pdo map 1 1 --inhibit 50us", "\"50us\" is not a duration in steps of 100us (0us to 6553500us)");
    for restricted in ["0", "0x7f", "0x101", "0x180", "0x581", "0x601", "0x6e0", "0x701", "0x7ff"] {
        let done = bench.run(&format!("pdo map 1 1 --cob-id {restricted}")).exit(2);
        assert!(done.frames.is_empty() && done.stderr.contains("is not for PDOs"), "{restricted}: {}", done.stderr);
    }
    // MH-4, 3.4.1 prints the mapping at 1800h. It is not a valid COB-ID.
    let word = "is not an 11-bit identifier (0x181 to 0x57F, without the flags of the COB-ID)";
    refuses("pdo map 1 1 --cob-id 0x61300120", &format!("\"0x61300120\" {word}"));
    refuses("pdo map 1 1 --cob-id 0x40000181", &format!("\"0x40000181\" {word}"));
    // Known only from the description: nothing is written either.
    let reads_only = |line: &str, code: i32, stderr: &str| {
        let done = bench.run(line).fails(code, stderr);
        assert_eq!(steps(&done, 1), [""; 0], "{line}");
    };
    reads_only(
        "pdo map 1 1 pressure temperature pressure.status",
        2,
        "cangauge: node 1: the mapping has 9 bytes; a PDO has at most 8 bytes\n",
    );
    reads_only(
        "pdo map 1 1 presure",
        2,
        "cangauge: node 1: no object or signal \"presure\"\nhint: similar names: pressure\n",
    );
    reads_only(
        "pdo map 1 1 --inhibit 1ms",
        4,
        "cangauge: node 1: TPDO1 has no inhibit time (0x1800:3 does not exist)\n",
    );
    reads_only("pdo map 127 1 pressure.status", 2, "cangauge: node 127: pressure has no status object\n");
}

#[test]
fn occupied_identifier_is_refused() {
    let bench = Bench::of(ALL);
    for (id, who) in [
        ("0x281", "its TPDO2"),
        ("0x081", "its EMCY"),
        ("0x80", "SYNC"),
        ("0x100", "TIME"),
        ("0x1ff", "TPDO1 of node 127"),
        ("0x483", "TPDO4 of node 3"),
        ("0x0ff", "EMCY of node 127"),
    ] {
        let done = bench.run(&format!("pdo map 1 1 --cob-id {id}")).exit(1);
        assert!(done.stderr.contains(&format!("is used by {who}: nothing was changed")), "{id}: {}", done.stderr);
        assert_eq!(steps(&done, 1), [""; 0], "{id}");
    }
    // Bit 30 stays; the PDO is off while it moves.
    let done = bench.run("pdo map 1 1 --cob-id 0x3a5").exit(0);
    let moves = ["601#23001801810100C0", "581#6000180100000000", "601#23001801A5030040", "581#6000180100000000"];
    assert_eq!(steps(&done, 1), moves);
    // The present identifier is accepted, even if other nodes are present.
    let done = bench.run("pdo map 1 1 --cob-id 0x181").exit(0);
    assert_eq!(steps(&done, 1), [""; 0]);
}

#[test]
fn the_recovery_command_restores_the_settings() {
    // The device as it was left: off, without entries.
    let half =
        "[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"1800:1\" = 0xC0000181, \"1A00:0\" = 0, \"1800:5\" = 9 }\n";
    let recovery = "pdo map 1 1 0x6130:1/32 0x6150:1/8 --transmission sync:1 --event-timer 0ms --cob-id 0x181 -f json";
    let done = Bench::described(half).run(recovery).exit(0);
    let of_new = Bench::of("mh4@1").run("pdo show 1 1 -f json").exit(0);
    let (mut mapped, shown) = (done.json(), of_new.json());
    for field in ["writes", "stored", "notes"] {
        assert!(mapped[0].as_object_mut().is_some_and(|report| report.remove(field).is_some()), "{field}");
    }
    assert_eq!(mapped, shown);
    // A TPDO that was off is restored with plain writes.
    let writes = "sdo write 1 0x1800:1=0xC0000181 0x1A00:0=0x0 0x1A00:1=0x61300120 0x1A00:2=0x61500108 0x1A00:0=0x2 \
                  0x1800:2=0x1 0x1800:5=0x0";
    let done = Bench::described(half).run(writes).exit(0);
    assert_eq!(steps(&done, 1).len(), 14);
}

#[test]
fn settings_that_the_device_stores_are_stored() {
    // 1010h:1 would put a custom COB-ID back: the communication settings are stored alone.
    let done = Bench::of("mh4@1").run("pdo map 1 1 --cob-id 0x3a5 --store").exit(0);
    assert!(steps(&done, 1).contains(&"601#2310100273617665"), "{:?}", done.frames);
    assert!(done.stderr.contains("node 1: stored (comm), acknowledged"), "{}", done.stderr);
    let done = Bench::of("d20@2").run("pdo map 2 1 pressure --store").exit(0);
    assert!(steps(&done, 2).contains(&"602#2210100173617665"), "{:?}", done.frames);
    // Set already, but not stored yet: only stored.
    let done = Bench::of("mh4@1").run("pdo map 1 1 --transmission sync:1 --store").exit(0);
    assert_eq!(steps(&done, 1), ["601#2310100273617665", "581#6010100200000000"]);
    // The DPS does not store its PDO settings.
    let done = Bench::of("dps@127").run("pdo map 127 1 0x7100:1 --store").fails(
        1,
        "cangauge: node 127: it does not store the settings of TPDO1: nothing was changed\n\
         hint: omit --store, and set the TPDO after every power-on\n",
    );
    assert_eq!(steps(&done, 127), [""; 0]);
}

/// The reason is that of `log`, with commands that can be typed.
#[test]
fn watch_gives_the_reason_for_silence() {
    let bench = |more: &str| Bench::described(&format!("[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\n{more}"));
    for (set, reason, hint) in [
        ("", "TPDO1 waits for SYNC", "cangauge log 5 --sync 100ms"),
        (
            "set = { \"0x1800:1\" = 0xC0000185, \"0x1801:1\" = 0xC0000285 }",
            "its TPDOs are disabled (bit 31",
            "cangauge log 5 --poll",
        ),
        (
            "set = { \"0x1800:2\" = 254, \"0x1800:5\" = 60000 }",
            "the event timer of TPDO1 is longer",
            "--event-timer 100ms",
        ),
        ("set = { \"0x1017\" = 100, \"0x1800:2\" = 240 }", "TPDO1 waits for SYNC", "cangauge log 5"),
    ] {
        let done = bench(set).run("pdo watch 5 --duration 2s").exit(3);
        assert!(done.stderr.contains(reason) && done.stderr.contains(hint), "{set}: {}", done.stderr);
    }
}

#[test]
fn watch() {
    let bench = Bench::described(
        "[[device]]\nkind = \"dps\"\nnode = 127\nstart = true\n\
         [[device.channel]]\nchannel = 1\nbase = 50.0\namplitude = 0.0\nnoise = 0.0\n",
    );
    let done = bench.run("pdo watch 127 --duration 350ms").exit(0);
    let lines: Vec<&str> = done.stdout.lines().collect();
    assert!(lines.len() == 3 || lines.len() == 4, "{}", done.stdout);
    let rest = |line: &str| line.split_once("Z  ").map(|(_, rest)| rest.to_owned());
    assert!(lines.iter().all(|line| rest(line).as_deref() == Some("127  TPDO1  pressure 50.000 psi")), "{lines:?}");
    assert_eq!(done.frames_of("000"), [""; 0], "no NMT command");
    let pdo = &bench.run("pdo watch 127 --duration 350ms -f json").exit(0).json()[0];
    assert_eq!((&pdo["node"], &pdo["pdo"]), (&json!(127), &json!(1)));
    let value = json!({ "signal": "pressure", "value": 50.0, "unit": "psi", "status": null, "raw": "0x50C30000" });
    assert_eq!(pdo["values"], json!([value]));
    let csv = bench.run("pdo watch 127 --duration 350ms -f csv").exit(0).stdout;
    assert_eq!(csv.lines().next(), Some("time,node,pdo,signal,value,unit,status,raw"));
    assert!(csv.lines().nth(1).is_some_and(|line| line.ends_with(",127,1,pressure,50.000,psi,,0x50C30000")), "{csv}");
    let silent = Bench::of("dps@127").run("pdo watch 127 --duration 8s").exit(3);
    let reason = "node 127: TPDO1 is due every 100 ms (1800h:5), and no TPDO1 was received: the node answers SDO, and is \
                  probably not operational";
    assert_eq!(
        silent.stderr.lines().skip(1).collect::<Vec<_>>(),
        [&format!("cangauge: no TPDO was received; {reason}"), "hint: cangauge nmt state 127 --probe"],
        "{}",
        silent.stderr
    );
    assert!(silent.stderr.starts_with(&format!("no TPDO yet; {reason}\n")), "{}", silent.stderr);
}
