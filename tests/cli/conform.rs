//! `cangauge conform`. The cases themselves: `tests/scenarios/conform.rs`.

use super::Bench;
use cangauge::tasks::conform::cases;
use serde_json::json;

#[test]
fn known_deviations_are_named_with_their_page_and_are_no_failure() {
    let done = Bench::of("mh4@1").run("conform 1").exit(0);
    assert!(
        done.stdout.contains("known: the manual states it (section 4.1.8, 4.1.9, 4.2.4, 4.2.5)"),
        "{}",
        done.stdout
    );
    assert!(done.stdout.starts_with("SDO-01  pass        A read of 1000h"), "{}", done.stdout);
    let skipped = "not applicable: SDO-30 to SDO-36 (the device has no block transfer)\n";
    assert!(done.stdout.contains(skipped) && !done.stdout.contains("not-applicable"), "{}", done.stdout);
    let without_eds = "not applicable: EDS-01 to EDS-17, EDS-19 to EDS-21 (not run without --eds)\n";
    assert!(done.stdout.contains(without_eds), "{}", done.stdout);
    let count = format!("node 1: {} cases in", cases().count());
    assert!(done.stderr.contains(&count), "{}", done.stderr);
}

#[test]
fn deviation_is_a_failed_check() {
    // Another program set a restricted COB-ID.
    let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"0x1014\" = 0x701 }\n");
    let done = bench.run("conform 1 --only od --format json").exit(1);
    let rows = done.json();
    let row = rows.iter().find(|row| row["case"] == "OD-09").expect("the case");
    assert_eq!((&row["verdict"], &row["severity"], &row["known"]), (&json!("deviates"), &json!("high"), &json!(null)));
    assert_eq!(row["details"], json!(["0x1014:0: expected another CAN-ID; seen: the bytes 01 07 00 00"]));
    assert!(row["frames"].as_array().is_some_and(|frames| frames.contains(&json!("> 601#4014100000000000"))), "{row}");
    assert!(done.stderr.ends_with("{\"error\":{\"kind\":\"check-failed\",\"exit\":1,\"message\":\"1 deviation\",\"node\":null,\"object\":null,\"abort\":null,\"hint\":null}}\n"), "{}", done.stderr);
}

#[test]
fn other_nodes_are_a_reason_to_refuse() {
    let bench = Bench::of("mh4@1,dps@127");
    let done = bench.run("conform 1").exit(1);
    assert_eq!(
        done.stderr,
        "cangauge: node 1: node 127 is on the bus, too: nothing was changed\n\
         hint: disconnect them, or check only areas other than pdo and lss: cangauge conform 1 --only sdo,nmt\n"
    );
    bench.run("conform 1 --only sdo,nmt").exit(0);
    bench.run("conform 1 --only sdo,pdo").exit(1);
}

#[test]
fn several_areas_and_cases_are_selected() {
    let bench = Bench::of("mh4@1");
    let cases = |options: &str| {
        let rows = bench.run(&format!("conform 1 {options} --dry-run --format json")).exit(0).json();
        rows.iter().map(|row| row["case"].as_str().expect("a case").to_owned()).collect::<Vec<_>>()
    };
    let areas = |options: &str| -> Vec<String> {
        let mut areas: Vec<String> = cases(options).iter().map(|case| case[..3].to_owned()).collect();
        areas.dedup();
        areas
    };
    assert_eq!(areas("--only nmt,sdo"), ["SDO", "NMT"]);
    assert_eq!(areas("--only sdo --only nmt"), ["SDO", "NMT"]);
    let skipped = cases("--only nmt --skip NMT-01,nmt-02 --skip NMT-04");
    assert_eq!(skipped[..2], ["NMT-03", "NMT-05"]);
    bench.run("conform 1 --only sdo,everything").exit(2);
    bench.run("conform 1 --skip SDO-01,SDO-99").exit(2);
}

#[test]
fn dry_run_lists_the_cases_and_uses_no_bus() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("conform 1 --only sdo --skip sdo-07 --dry-run").exit(0);
    assert_eq!(done.frames, [""; 0]);
    assert!(
        done.stdout.starts_with("CASE    AREA  NEEDS          WHAT\nSDO-01  sdo   -              A read of"),
        "{}",
        done.stdout
    );
    assert!(!done.stdout.contains("SDO-07") && !done.stdout.contains("NMT-01"), "{}", done.stdout);
    bench.run("conform 1 --skip SDO-99").exit(2);
    bench.run("conform 1,2").exit(2);
    bench.run("conform 1 --only everything").exit(2);
}

/// An EDS file of three objects. The type of 1017h is wrong, and the device has no 6200h.
const EDS: &str = "[DeviceInfo]\nVendorNumber=71\n\n[MandatoryObjects]\nSupportedObjects=2\n1=0x1000\n2=0x1001\n\n\
    [OptionalObjects]\nSupportedObjects=2\n1=0x1017\n2=0x6200\n\n\
    [1000]\nParameterName=Device type\nObjectType=7\nDataType=7\nAccessType=ro\nPDOMapping=0\n\n\
    [1001]\nParameterName=Error register\nObjectType=7\nDataType=5\nAccessType=ro\nPDOMapping=0\n\n\
    [1017]\nParameterName=Heartbeat\nObjectType=7\nDataType=5\nAccessType=rw\nPDOMapping=0\n\n\
    [6200]\nParameterName=Output\nObjectType=7\nDataType=5\nAccessType=rw\nPDOMapping=0\n";

#[test]
fn eds_file_is_compared_with_the_device() {
    let bench = Bench::of("mh4@1");
    let path = bench.path("sensor.eds");
    std::fs::write(&path, EDS).expect("the file");
    let eds = path.display();
    let done = bench.run(&format!("conform 1 --only eds --eds {eds}")).exit(1);
    for line in [
        "EDS-01  pass        The file follows CiA 306\n",
        "        0x1018:0: expected the object in the EDS file; seen: no such object in the file\n",
        "        0x1017:0: expected the data type u16 in the EDS file; seen: u8\n",
        "        0x6200:0: expected the object of the EDS file; seen: abort 0x06020000, the object does not exist\n",
        "        0x1017:0: expected 1 byte; seen: 581#4B17100000000000\n",
        "EDS-13  pass        Objects that the file calls ro or const reject a write of their present value\n",
        "not applicable: EDS-18 (not run without --store)\n",
    ] {
        assert!(done.stdout.contains(line), "{line}{}", done.stdout);
    }
    // Another device: nothing is written.
    std::fs::write(&path, EDS.replace("VendorNumber=71", "VendorNumber=72")).expect("the file");
    bench.run(&format!("conform 1 --only eds --eds {eds}")).exit(2);
    let done = bench.run(&format!("conform 1 --only eds --eds {eds} --accept-mismatch")).exit(1);
    assert!(done.stdout.contains("        0x1018:1: expected 72 (0x48); seen: 71\n"), "{}", done.stdout);
    let done = bench.run("conform 1 --only eds").exit(0);
    done.prints(
        "not applicable: EDS-01 to EDS-17, EDS-19 to EDS-21 (not run without --eds)\n\
         not applicable: EDS-18 (not run without --store)\n",
    );
}

#[test]
fn measured_times_are_figures_and_no_verdict() {
    let bench = Bench::of("mh4@1");
    let (html, json) = (bench.path("r.html").display().to_string(), bench.path("r.json").display().to_string());
    let done = bench.run(&format!("conform 1 --only timing --report {html} --report {json}")).exit(0);
    assert!(done.stdout.starts_with("TIM-01  measured    The time to answer a read\n        min "), "{}", done.stdout);
    assert!(done.stderr.ends_with(": 7 measured\n"), "{}", done.stderr);
    let page = std::fs::read_to_string(&html).expect("the page");
    assert!(page.contains("<h2>Timing profile</h2>\n<table><tr><th>Case</th><th>What</th><th>min</th>"), "{page}");
    let text = std::fs::read_to_string(&json).expect("the file");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let heartbeat = report["cases"].as_array().and_then(|cases| cases.iter().find(|case| case["case"] == "TIM-03"));
    let mean = heartbeat.and_then(|case| case["figures"]["mean"].as_f64()).expect("a mean");
    assert!((mean - 0.1).abs() < 0.001, "{mean}");
    // Another run of the same device differs only by noise.
    let again = bench.path("again.json").display().to_string();
    bench.run(&format!("conform 1 --only timing --report {again}")).exit(0);
    bench.run(&format!("conform diff {json} {again}")).prints("");
}

#[test]
fn reports_are_written_and_compared() {
    let bench = Bench::of("mh4@1");
    let file = |name: &str| bench.path(name).display().to_string();
    let (html, junit, old, new) = (file("r.html"), file("r.xml"), file("old.json"), file("new.json"));
    bench.run(&format!("conform 1 --only od --report {html} --report {old} --junit {junit}")).exit(0);
    let page = std::fs::read_to_string(&html).expect("the page");
    assert!(page.contains("<h2>Deviations that the manual states</h2>\n<h3>OD-05:"), "{page}");
    assert!(page.contains("&gt; 601#4010100000000000"), "{page}");
    let xml = std::fs::read_to_string(&junit).expect("the file");
    assert!(xml.contains("tests=\"10\" failures=\"0\" errors=\"0\" skipped=\"0\""), "{xml}");
    let other = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"0x1014\" = 0x701 }\n");
    other.run(&format!("conform 1 --only od --report {new} --junit {junit}")).exit(1);
    assert!(std::fs::read_to_string(&junit).expect("the file").contains("<failure type=\"deviates\""));
    let done = bench.run(&format!("conform diff {old} {new}")).exit(1);
    assert_eq!(
        done.stdout,
        "CASE   BEFORE  AFTER     WHAT\nOD-09  pass    deviates  1005h, 1012h and 1014h contain allowed CAN-IDs\n"
    );
    bench.run(&format!("conform diff {old} {old}")).prints("");
    bench.run(&format!("conform diff {old} {html}")).exit(2);
    bench.run("conform diff missing.json missing.json").exit(8);
    bench.run("conform 1 --report r.txt").exit(2);
}

#[test]
fn error_during_the_check_is_named_at_the_end() {
    let bench = Bench::described(
        "[[device]]\nkind = \"mh4\"\nnode = 1\n[[device.overload]]\nchannel = 1\nfrom = \"2.5s\"\nuntil = \"2.6s\"\n\
         direction = \"high\"\n",
    );
    let path = bench.path("r.json").display().to_string();
    let done = bench.run(&format!("conform 1 --only sdo --report {path}")).exit(0);
    let history = "node 1: the error history (0x1003) has 1 entry (0 before), the newest is 0x0103F001\n";
    assert!(done.stderr.ends_with(history), "{}", done.stderr);
    let text = std::fs::read_to_string(&path).expect("the file");
    let report: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    assert_eq!(report["error_history"], json!({ "before": 0, "after": 1, "newest": 0x0103_f001 }));
}

#[test]
fn autozero_is_executed_only_with_store() {
    let bench = Bench::of("mh4@1");
    let has_autozero = |options: &str| {
        let done = bench.run(&format!("conform 1 --only 404 {options}")).exit(0);
        done.frames.iter().any(|frame| frame.contains("601#23256101"))
    };
    assert!(!has_autozero("") && has_autozero("--store"));
}

#[test]
fn life_guarding_of_the_device_is_not_started() {
    let bench =
        Bench::described("[[device]]\nkind = \"mc1609\"\nnode = 1\nset = { \"0x100C\" = 100, \"0x100D\" = 3 }\n");
    let done = bench.run("conform 1 --only error-control").exit(0);
    let reason = "        not run, because life guarding is on (0x100C and 0x100D are not 0)\n";
    assert_eq!(done.stdout.matches(reason).count(), 4, "{}", done.stdout);
    assert!(!done.frames.iter().any(|frame| frame.contains("081#3081")), "{:?}", done.frames);
}

#[test]
fn stimulus_is_run_for_each_input_and_for_the_normal_one_at_the_end() {
    let bench = Bench::of("mh4@1");
    let log = bench.path("inputs").display().to_string();
    let run = |stimulus: &str| {
        let arguments = ["conform", "1", "--only", "404", "--stimulus", stimulus];
        bench.run_words(&arguments)
    };
    // The pressure of the simulated device does not change.
    let done = run(&format!("echo noise; printf '%s\\n' >>{log}")).exit(0);
    let moved = "404-70  not-judged  A positive overload sets bit 1 of the status (6150h), or the bits of 1001h in the \
                 manual\n        0x6130:1 did not change enough\n";
    assert!(done.stdout.contains(moved) && !done.stdout.contains("noise"), "{}", done.stdout);
    let inputs = std::fs::read_to_string(&log).expect("the file");
    let expected = ["high", "low", "high", "high"].map(|side| format!("overload-{side}\nnormal\n"));
    assert_eq!(inputs, "normal\nstep\nnormal\n".repeat(2) + &expected.concat());
    let done = run("exit 3; ").exit(0);
    assert!(
        done.stdout.contains("        --stimulus overload-low: the command ended with exit code 3\n"),
        "{}",
        done.stdout
    );
    let left = "the input of the device may not be normal: --stimulus normal: the command ended with exit code 3";
    assert!(done.stderr.contains(left), "{}", done.stderr);
    let done = bench.run("conform 1 --only 404").exit(0);
    let skipped = "not judged: 404-32, 404-33, 404-70 to 404-72, 404-74 (not run without --stimulus)\n";
    assert!(done.stdout.contains(skipped), "{}", done.stdout);
}

#[test]
fn interrupted_stimulus_is_followed_by_the_normal_one() {
    let bench = Bench::of("mh4@1");
    let log = bench.path("inputs").display().to_string();
    let stimulus = format!("f() {{ echo $1 >>{log}; [ $1 = normal ] || {{ kill -INT $PPID; exec sleep 60; }}; }}; f");
    bench.run_words(&["conform", "1", "--only", "404", "--stimulus", &stimulus]).exit(130);
    assert_eq!(std::fs::read_to_string(&log).expect("the file"), "normal\nstep\nnormal\n");
}
