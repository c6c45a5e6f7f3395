//! Fastscan finds simulated devices in another process.

use crate::Can;
use cangauge::canopen::id::NodeId;
use cangauge::master::{Master, Timing};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};

/// `cangauge sim` with these devices, until it is dropped.
struct Simulation(Child);

impl Simulation {
    fn start(can: &Can, devices: &[&str]) -> Simulation {
        let mut child = Command::new(env!("CARGO_BIN_EXE_cangauge"))
            .args(["-b", &can.name, "sim"])
            .args(devices)
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut line = String::new();
        BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
        assert!(line.contains("simulation is running"), "{line}");
        Simulation(child)
    }
}

impl Drop for Simulation {
    fn drop(&mut self) {
        self.0.kill().unwrap();
        self.0.wait().unwrap();
    }
}

/// Finds the devices without a node-ID and assigns node-IDs from 20 on. Returns the serial numbers in the order of
/// detection.
fn scan(can: &Can) -> Vec<u32> {
    let mut bus = can.open();
    let mut found = Vec::new();
    for node in 20.. {
        let mut master = Master::new(&mut bus, Timing::default());
        let mut lss = master.lss();
        lss.listen().unwrap();
        let Some(address) = lss.fastscan().unwrap() else { return found };
        found.push(address.serial);
        lss.configure_node_id(NodeId::new(node).ok()).unwrap();
        lss.leave().unwrap();
    }
    found
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn fastscan_finds_one_device_and_several() {
    let can = Can::get();
    for devices in [&["mh4@unconfigured"][..], &["mh4@unconfigured", "mh4@unconfigured", "mh4@unconfigured"]] {
        let simulation = Simulation::start(&can, devices);
        let mut serials = scan(&can);
        drop(simulation);
        serials.sort_unstable();
        serials.dedup();
        assert_eq!(serials.len(), devices.len(), "{serials:?}");
    }
}
