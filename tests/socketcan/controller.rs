//! Interfaces with bit rates: two controllers on one bus, emulated by QEMU (`tests/socketcan/qemu`). There, frames pass
//! at any bit rate.

use crate::program::{Devices, cangauge, command, setting, shown, without_the_right};
use crate::{assert_nothing_more, frame, next, next_frame, run};
use cangauge::bus::socketcan::SocketCan;
use cangauge::bus::{BitRateControl, Bus, BusError, Event, Mode};
use serde_json::{Value, json};
use std::process::Stdio;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::thread;
use std::time::{Duration, Instant};

/// Sets can0 to 125 kbit/s and down, and can1 up, for one test at a time.
fn controllers() -> MutexGuard<'static, ()> {
    static ALONE: Mutex<()> = Mutex::new(());
    let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    ip("can0 down");
    ip("can0 type can bitrate 125000 listen-only off restart-ms 100");
    ip("can1 down");
    ip("can1 up type can bitrate 125000 listen-only off");
    alone
}

fn ip(line: &str) {
    let words: Vec<&str> = ["link", "set"].into_iter().chain(line.split_whitespace()).collect();
    run("ip", &words);
}

/// The bit rate of an interface that is up, from `ip`.
fn rate_of(name: &str) -> Value {
    let (up, timing, _) = setting(name);
    assert!(up, "{name}");
    timing["bitrate"].clone()
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn an_interface_goes_up_at_a_bit_rate_and_down() {
    let _alone = controllers();
    let before = setting("can0");
    cangauge("bus up can0 250k").is(0, "", "can0 is up at 250000 bit/s; it was down at 125000 bit/s\n");
    assert_eq!((rate_of("can0"), setting("can0").2), (json!(250_000), before.2.clone()), "and nothing else");

    let mut bus = SocketCan::open("can0").unwrap();
    cangauge("bus up can0 250k").is(0, "", "can0 is up at 250000 bit/s already: nothing was changed\n");
    cangauge("bus up can0").is(0, "", "can0 is up at 250000 bit/s already: nothing was changed\n");
    assert_nothing_more(&mut bus);
    cangauge("bus up can0 500k").is(0, "", "can0 is up at 500000 bit/s; it was up at 250000 bit/s\n");
    assert_eq!(rate_of("can0"), 500_000);

    let listens = "can0 is up at 500000 bit/s, listen-only; it was up at 500000 bit/s\n";
    cangauge("bus up can0 500k --listen-only").is(0, "", listens);
    assert_eq!(setting("can0").2[0], json!(["LISTEN-ONLY"]));
    let back = "can0 is up at 500000 bit/s; it was up at 500000 bit/s, listen-only\n";
    cangauge("bus up can0 500000").is(0, "", back);
    assert_eq!(setting("can0").2, before.2);

    cangauge("bus down can0").is(0, "", "can0 is down at 500000 bit/s; it was up at 500000 bit/s\n");
    assert!(!setting("can0").0);
    cangauge("bus up can0").is(0, "", "can0 is up at 500000 bit/s; it was down at 500000 bit/s\n");
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn the_list_shows_the_data_of_the_driver() {
    let _alone = controllers();
    let text = cangauge("bus list").stdout;
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[1], ["can0", "down", "125000", "stopped", "normal", "0", "0", "kvaser_pci"]);
    assert_eq!(rows[2], ["can1", "up", "125000", "error-active", "normal", "0", "0", "kvaser_pci"]);
    let done = cangauge("bus up can0 1M --format json");
    let object: Value = serde_json::from_str(&done.stdout).unwrap();
    assert_eq!(
        object,
        json!({"interface": "can0", "up": true, "driver": "kvaser_pci", "kind": "can", "bit_rate": 1_000_000,
            "sample_point": 0.75, "state": "error-active", "listen_only": false, "restart_ms": 100, "tx_errors": 0,
            "rx_errors": 0, "bit_rates": null})
    );
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn without_the_privilege_the_commands_to_type_are_printed() {
    let _alone = controllers();
    let before = setting("can0");
    let by_hand = "hint: by hand: sudo ip link set can0 down; sudo ip link set can0 type can bitrate 250000; \
                   sudo ip link set can0 up\n";
    let done = without_the_right("bus up can0 250k");
    assert_eq!((done.code, done.stdout.as_str()), (Some(5), ""));
    assert!(done.stderr.starts_with("cangauge: no permission to set the bit rate of can0"), "{}", done.stderr);
    assert!(done.stderr.ends_with(by_hand), "{}", done.stderr);
    let done = without_the_right("bus detect can0");
    let refused = "cangauge: no permission to set the bit rate of can0\nhint: by hand: sudo cangauge bus detect can0\n";
    done.is(5, "", refused);
    assert_eq!(setting("can0"), before);
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn many_requests_stay_below_the_bus_load_of_the_option() {
    let _alone = controllers();
    ip("can0 up");
    let mut other = SocketCan::open("can1").unwrap();
    let done = cangauge("--bus can0 --retries 0 scan --max-load 10%");
    assert_eq!((done.code, done.stdout.as_str()), (Some(3), ""), "{}", done.stderr);
    let mut times = Vec::new();
    for _ in 0..127 {
        let Event::Frame(received) = next(&mut other) else { panic!("only {} requests", times.len()) };
        times.push(received.at.mono);
    }
    assert_nothing_more(&mut other);
    // The first 16 requests are sent at once. A request of 8 bytes has about 110 bits.
    let took = times[126].since(times[15]);
    let busy = Duration::from_micros(111 * 110 * 8);
    assert!(took > busy.mul_f64(9.0), "{took:?} for frames of {busy:?}");
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn an_open_bus_changes_its_bit_rate_and_restores_it() {
    let _alone = controllers();
    ip("can0 up");
    let before = setting("can0");
    let (mut bus, mut other) = (SocketCan::open("can0").unwrap(), SocketCan::open("can1").unwrap());
    assert_eq!(bus.bit_rate(), Some(125_000));
    bus.can_set_bit_rate().unwrap();
    other.send(&frame("181#01")).unwrap();
    thread::sleep(Duration::from_millis(100));
    bus.set_bit_rate(250_000, Mode::Normal).unwrap();
    assert_eq!((rate_of("can0"), bus.bit_rate()), (json!(250_000), Some(250_000)));
    assert_eq!(setting("can0").2, before.2, "and nothing else");
    // The short time down is not reported, and frames from before are discarded.
    assert_nothing_more(&mut bus);
    other.send(&frame("182#02")).unwrap();
    assert_eq!(next_frame(&mut bus), "182#02");
    bus.send(&frame("183#03")).unwrap();
    assert_eq!(next_frame(&mut other), "183#03");

    bus.set_bit_rate(500_000, Mode::ListenOnly).unwrap();
    assert_eq!((rate_of("can0"), setting("can0").2[0].clone()), (json!(500_000), json!(["LISTEN-ONLY"])));
    other.send(&frame("184#04")).unwrap();
    assert_eq!(next_frame(&mut bus), "184#04");

    bus.restore_bit_rate().unwrap();
    assert_eq!((setting("can0"), bus.bit_rate()), (before.clone(), Some(125_000)));
    bus.restore_bit_rate().unwrap();
    other.send(&frame("185#05")).unwrap();
    assert_eq!(next_frame(&mut bus), "185#05");
    assert_eq!(setting("can0"), before);
    // Changes by other programs are reported as before.
    ip("can0 down");
    assert_eq!(next(&mut bus), cangauge::bus::Event::Link(false));
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn an_unsupported_bit_rate_leaves_the_interface_unchanged() {
    let _alone = controllers();
    ip("can0 up");
    let before = setting("can0");
    let (mut bus, mut other) = (SocketCan::open("can0").unwrap(), SocketCan::open("can1").unwrap());
    for rate in [0, 3_000_000, u32::MAX] {
        let error = bus.set_bit_rate(rate, Mode::ListenOnly).unwrap_err();
        assert!(matches!(error, BusError::BitRate { bit_rate, .. } if bit_rate == rate), "{error:?}");
        assert_eq!((setting("can0"), bus.bit_rate()), (before.clone(), Some(125_000)));
    }
    assert_nothing_more(&mut bus);
    other.send(&frame("181#01")).unwrap();
    assert_eq!(next_frame(&mut bus), "181#01");
    let done = cangauge("bus up can0 1k");
    assert_eq!((done.code, done.stdout.as_str()), (Some(5), ""));
    assert!(done.stderr.starts_with("cangauge: can0 does not support 1000 bit/s: "), "{}", done.stderr);
    assert_eq!(setting("can0"), before);
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn a_bit_timing_set_by_hand_is_restored() {
    let _alone = controllers();
    ip("can0 type can tq 500 prop-seg 5 phase-seg1 5 phase-seg2 5 sjw 2");
    for direction in ["down", "up"] {
        ip(&format!("can0 {direction}"));
        let before = setting("can0");
        assert_eq!((before.0, &before.1["bitrate"], &before.1["sjw"]), (direction == "up", &json!(125_000), &json!(2)));
        let mut bus = SocketCan::open_even_down("can0").unwrap();
        bus.set_bit_rate(1_000_000, Mode::ListenOnly).unwrap();
        assert_eq!(rate_of("can0"), 1_000_000);
        bus.restore_bit_rate().unwrap();
        assert_eq!(setting("can0"), before);
    }
}

/// Sends frames from can1 during `work`, and records the modes of can0.
fn with_traffic<T>(work: impl FnOnce() -> T) -> (T, Vec<Value>) {
    let over = AtomicBool::new(false);
    let mut other = SocketCan::open("can1").unwrap();
    thread::scope(|scope| {
        let traffic = scope.spawn(|| {
            let mut seen = Vec::new();
            while !over.load(Ordering::Relaxed) {
                // The queue may be full if no node acknowledges.
                let _ = other.send(&frame("705#05"));
                seen.push(shown("can0")["linkinfo"]["info_data"]["ctrlmode"].clone());
            }
            seen
        });
        let result = work();
        over.store(true, Ordering::Relaxed);
        (result, traffic.join().unwrap())
    })
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn detection_only_listens_on_a_busy_bus() {
    let _alone = controllers();
    for direction in ["down", "up"] {
        ip(&format!("can0 {direction}"));
        let before = setting("can0");
        let (done, seen) = with_traffic(|| cangauge("bus detect can0 --for 10s"));
        assert_eq!((done.code, done.stdout.as_str()), (Some(0), "125000\n"), "{}", done.stderr);
        assert!(done.stderr.starts_with("125000 bit/s: 3 valid frames, 0 errors\n"), "{}", done.stderr);
        assert!(seen.contains(&json!(["LISTEN-ONLY"])), "listen-only: {seen:?}");
        assert_eq!(setting("can0"), before);
    }
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn the_bit_rate_of_a_silent_bus_is_unknown() {
    let _alone = controllers();
    let before = setting("can0");
    let done = cangauge("bus detect can0 --for 50ms --format json -q");
    assert_eq!(done.code, Some(3), "{}", done.stderr);
    let found: Value = serde_json::from_str(&done.stdout).unwrap();
    let tried: Vec<&Value> = found["tried"].as_array().unwrap().iter().map(|tried| &tried["bit_rate"]).collect();
    assert_eq!(
        tried,
        [125_000, 250_000, 500_000, 1_000_000, 100_000, 50_000, 20_000, 10_000, 800_000]
            .map(|rate| json!(rate))
            .each_ref()
    );
    assert_eq!(found["bit_rate"], Value::Null);
    assert_eq!(setting("can0"), before);
    // Here the other controller acknowledges at each bit rate, so an acknowledge proves nothing.
    let done = cangauge("bus detect can0 --active --for 50ms -q");
    assert_eq!((done.code, done.stdout.as_str()), (Some(3), ""), "{}", done.stderr);
    assert_eq!(setting("can0"), before);
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn an_interrupted_detection_restores_the_interface() {
    let _alone = controllers();
    let before = setting("can0");
    let child = command("bus detect can0 --for 60s").stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let deadline = Instant::now() + Duration::from_secs(60);
    while setting("can0").2[0] != json!(["LISTEN-ONLY"]) || !setting("can0").0 {
        assert!(Instant::now() < deadline, "it does not start");
    }
    run("kill", &["-INT", &child.id().to_string()]);
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(130));
    assert_eq!(setting("can0"), before);
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn doctor_names_the_state_of_the_controller() {
    let _alone = controllers();
    let finding = || {
        let done = cangauge("-b can0 doctor 5 --format json");
        let finding: Value = serde_json::from_str(&done.stdout).unwrap_or_default();
        let text = |name: &str| finding[name].as_str().unwrap_or_default().to_owned();
        (done.code, text("message"), text("hint"))
    };
    let found = |message: &str, hint: &str| (Some(1), message.to_owned(), hint.to_owned());
    let bring_up = "bring it up: sudo cangauge bus up can0 250k (use the sensors' bit rate)";
    assert_eq!(finding(), found("interface can0 is down", bring_up));
    ip("can0 up type can bitrate 125000 listen-only on");
    let leave = "leave this mode: sudo cangauge bus up can0 250k (use the sensors' bit rate)";
    assert_eq!(finding(), found("can0 is in listen-only mode: it can only receive", leave));
    // Listening works.
    assert_eq!(cangauge("-b can0 -t 100ms scan --passive").code, Some(3));
    cangauge("bus up can0 125k");
    let _devices = Devices::new("can1", "mh4@5");
    assert!(finding().1.starts_with("TPDO1 waits for SYNC"), "{:?}", finding());
}

#[test]
#[ignore = "SKIPPED: needs CAN controllers, see tests/socketcan/run"]
fn health_reads_the_error_counters() {
    let _alone = controllers();
    ip("can0 up");
    let done = cangauge("-b can0 health --passive --for 1s --format csv");
    for row in [",bus.state,", ",bus.tx-errors,0,", ",bus.rx-errors,0,", ",bus.bitrate,125000,"] {
        assert!(done.stdout.lines().any(|line| line.contains(row)), "{row}: {done:?}");
    }
    assert!(done.stdout.contains("error-active"), "{done:?}");
}
