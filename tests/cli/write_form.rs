//! Every command sends the requests in the form of the description: a DPS accepts no size (22h).

use super::{Bench, Done};
use std::fs;

/// Every expedited download of the command to node 127 has no size, and there is at least one.
#[track_caller]
fn sends_no_size(line: &str) -> Done {
    let done = Bench::of("dps@127").run(line);
    let downloads: Vec<&str> = done.frames_of("67F").into_iter().filter(|frame| frame.starts_with('2')).collect();
    assert!(!downloads.is_empty(), "{line}: {}{}", done.stdout, done.stderr);
    assert!(downloads.iter().all(|frame| frame.starts_with("22")), "{line}: {downloads:?}");
    done
}

#[test]
fn sdo_write_sends_the_described_form() {
    sends_no_size("sdo write 127 0x1017 500").exit(0);
}

#[test]
fn store_sends_the_described_form() {
    sends_no_size("store 127").exit(0);
}

#[test]
fn restore_sends_the_described_form() {
    sends_no_size("restore 127").exit(0);
}

#[test]
fn pdo_map_sends_the_described_form() {
    sends_no_size("pdo map 127 1 --event-timer 250ms");
}

#[test]
fn nmt_probe_sends_the_described_form() {
    sends_no_size("nmt state 127 --probe").exit(0);
}

/// An MH-4 with a description that states: it accepts no size.
#[test]
fn lss_by_objects_sends_the_described_form() {
    for line in ["lss set-id 1 3 --via sdo", "lss set-bitrate 1 250k --via sdo"] {
        let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 1\n");
        let description = include_str!("../../src/device/devices/mh4.toml");
        let description = description.replace("size = \"indicated\"", "size = \"omitted\"");
        fs::write(bench.path("omitted.toml"), description).expect("written");
        let done = bench.run(&format!("{line} --device omitted.toml"));
        let downloads: Vec<&str> = done.frames_of("601").into_iter().filter(|frame| frame.starts_with('2')).collect();
        // 2320h or 2321h with the signature, then "save".
        assert!(downloads.len() >= 2, "{line}: {}{}", done.stdout, done.stderr);
        assert!(downloads.iter().all(|frame| frame.starts_with("22")), "{line}: {downloads:?}");
    }
}

#[test]
fn first_request_to_a_node_is_a_read() {
    for line in [
        "sdo write 127 0x1017 500 --type u16",
        "sdo write 127 0x1017 500 --type u16 --sdo-size indicated",
        "store 127",
        "pdo map 127 1 --event-timer 250ms",
        "nmt state 127 --probe",
        "unit 127 pressure bar",
    ] {
        let done = Bench::of("dps@127").run(line);
        assert!(done.frames_of("67F")[0].starts_with('4'), "{line}: {:?}", done.frames_of("67F"));
    }
}

#[test]
fn settings_send_the_described_form() {
    sends_no_size("unit 127 pressure bar");
}
