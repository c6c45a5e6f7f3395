//! LSS with the simulated devices.

use cangauge::bus::memory::MemoryBus;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::lss::{LssAddress, Mode};
use cangauge::master::{LssError, Master, Timing};
use cangauge::sim::Bench;
use std::path::Path;

fn bus(toml: &str) -> MemoryBus {
    let bench = Bench::from_toml(&format!("clock = \"virtual\"\n{toml}"), Path::new("")).unwrap();
    bench.open().unwrap()
}

#[test]
fn three_unconfigured_devices_are_configured_in_turn() {
    let mut bus = bus(r#"
        device = [
            { kind = "mh4", serial = 99 },
            { kind = "mh4", serial = 100, latency = "2ms" },
            { kind = "mh4", serial = 0x7FFFFFFF, latency = "700us" },
            { kind = "dps", node = 5 },
        ]
    "#);
    let mut master = Master::new(&mut bus, Timing::default());
    let mut lss = master.lss();
    let mut found = Vec::new();
    for node in 20.. {
        let Some(LssAddress { vendor, product, serial, .. }) = lss.fastscan().unwrap() else { break };
        lss.configure_node_id(NodeId::new(node).ok()).unwrap();
        lss.store().unwrap();
        lss.leave().unwrap();
        // The device boots with the new node-ID.
        lss.identify_unconfigured().unwrap();
        assert!(lss.boot_ups().contains_key(&NodeId::new(node).unwrap()), "{node}");
        found.push((vendor, product, serial));
    }
    assert_eq!(found, [(0x47, 1, 99), (0x47, 1, 100), (0x47, 1, 0x7fff_ffff)]);
}

#[test]
fn device_with_endless_fastscan_does_not_hide_another() {
    let mut bus = bus(r#"
        device = [
            { kind = "mh4", serial = 99, lss = { endless_fastscan = true } },
            { kind = "mh4", serial = 100 },
        ]
    "#);
    let mut master = Master::new(&mut bus, Timing::default());
    let mut lss = master.lss();
    // The device was found but not configured: it is found again, with its own serial number.
    for _ in 0..2 {
        assert_eq!(lss.fastscan().unwrap().map(|address| address.serial), Some(99));
    }
    lss.configure_node_id(NodeId::new(20).ok()).unwrap();
    // In configuration state, it does not hide the other device.
    lss.leave().unwrap();
    lss.switch_global(Mode::Configuration).unwrap();
    assert_eq!(lss.fastscan().unwrap().map(|address| address.serial), Some(100));
}

#[test]
fn refused_lost_and_late_answers() {
    for (oddity, expected) in [
        (
            "refuse = { \"0x17\" = 1 }",
            Err("LSS store configuration: refused by the device (error 1, storing not supported)"),
        ),
        ("lose = [0x17]", Err("LSS store configuration: no answer within 3 s")),
        ("late = { \"0x17\" = \"2s\" }", Ok(())),
        ("late = { \"0x11\" = \"700ms\" }", Ok(())),
        ("lose = [0x11]", Ok(())),
        ("lose = [0x43]", Ok(())),
    ] {
        let mut bus = bus(&format!("device = [{{ kind = \"mh4\", node = 5, serial = 99, lss = {{ {oddity} }} }}]"));
        let identity = [0x47, 1, 1, 99];
        let mut master = Master::new(&mut bus, Timing::default());
        let mut lss = master.lss();
        let assign = |lss: &mut cangauge::master::Lss| -> Result<(), LssError> {
            lss.switch_global(Mode::Waiting)?;
            lss.switch_selective(&LssAddress::new(identity))?;
            lss.configure_node_id(NodeId::new(12).ok())?;
            lss.store()
        };
        let result = assign(&mut lss).map_err(|error| error.to_string());
        assert_eq!(result, expected.map_err(str::to_owned), "{oddity}");
    }
}
