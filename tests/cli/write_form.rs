//! Every command sends the form that the description of the device says: a DPS accepts no size (22h).

use super::{Bench, Done};

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

#[test]
fn settings_send_the_described_form() {
    sends_no_size("unit 127 pressure bar");
}
