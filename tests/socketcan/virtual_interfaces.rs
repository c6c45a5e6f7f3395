//! `cangauge bus` on a virtual interface.

use crate::program::{cangauge, shown, without_the_right};
use crate::{Can, run};
use cangauge::bus::{BitRateControl, BusError, Mode};
use serde_json::json;

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_virtual_interface_goes_down_and_up_and_has_no_bit_rate() {
    let can = Can::get();
    let name = &can.name;
    cangauge(&format!("bus down {name}")).is(0, "", &format!("{name} is down; it was up\n"));
    assert_eq!(shown(name)["operstate"], "DOWN");
    cangauge(&format!("bus down {name}")).is(0, "", &format!("{name} is down already: nothing was changed\n"));
    let refused = format!(
        "cangauge: {name} is virtual (vcan): it has no bit rate\n\
         hint: bring it up without a bit rate: cangauge bus up {name}\n"
    );
    cangauge(&format!("bus up {name} 250k")).is(5, "", &refused);
    assert_eq!(shown(name)["operstate"], "DOWN", "a rejection changes nothing");
    let refused = format!("cangauge: no permission to bring {name} up\nhint: by hand: sudo ip link set {name} up\n");
    without_the_right(&format!("bus up {name}")).is(5, "", &refused);
    cangauge(&format!("bus up {name} -q")).is(0, "", "");
    assert_eq!(shown(name)["operstate"], "UNKNOWN");
    cangauge(&format!("bus up {name}")).is(0, "", &format!("{name} is up already: nothing was changed\n"));
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn interfaces_are_listed() {
    let can = Can::get();
    run("ip", &["link", "add", "dev", "listed0", "type", "vcan"]);
    let listed = cangauge("bus list --format json").stdout;
    run("ip", &["link", "del", "listed0"]);
    let objects: Vec<serde_json::Value> = listed.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let one = |name: &str, up: bool| {
        json!({"interface": name, "up": up, "driver": null, "kind": "vcan", "bit_rate": null, "sample_point": null,
            "state": null, "listen_only": null, "restart_ms": null, "tx_errors": null, "rx_errors": null,
            "bit_rates": null})
    };
    assert!(objects.contains(&one("listed0", false)) && objects.contains(&one(&can.name, true)), "{listed}");
    let text = cangauge("bus list").stdout;
    let rows: Vec<Vec<&str>> = text.lines().map(|line| line.split_whitespace().collect()).collect();
    assert_eq!(rows[0], ["INTERFACE", "LINK", "BIT_RATE", "STATE", "MODE", "TX_ERRORS", "RX_ERRORS", "DRIVER"]);
    assert!(rows.contains(&vec![can.name.as_str(), "up", "-", "-", "-", "-", "-", "vcan"]), "{text}");
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn other_interfaces_are_not_changed() {
    let can = Can::get();
    for command in ["up", "down"] {
        let done = cangauge(&format!("bus {command} lo"));
        assert_eq!((done.code, done.stderr.lines().next()), (Some(5), Some("cangauge: lo is not a CAN interface")));
        let done = cangauge(&format!("bus {command} nosuchcan"));
        let first = Some("cangauge: there is no CAN interface \"nosuchcan\"");
        assert_eq!((done.code, done.stderr.lines().next()), (Some(5), first));
    }
    let lo = shown("lo");
    assert!(lo["flags"].as_array().unwrap().iter().any(|flag| flag == "UP"), "{lo}");
    let refused = format!("cangauge: {} is virtual (vcan): it has no bit rate\n", can.name);
    for active in ["", "--active"] {
        cangauge(&format!("bus detect {} {active}", can.name)).is(5, "", &refused);
    }
    let mut bus = can.open();
    assert!(matches!(bus.can_set_bit_rate(), Err(BusError::Unsupported(_))));
    assert!(matches!(bus.set_bit_rate(250_000, Mode::Normal), Err(BusError::Unsupported(_))));
    assert!(bus.restore_bit_rate().is_ok());
    crate::assert_nothing_more(&mut bus);
}
