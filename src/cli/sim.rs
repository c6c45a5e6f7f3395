//! `cangauge sim`.

use super::args::BusSpec;
use super::exit::{FileError, IntoFailure};
use super::{Global, open};
use cangauge::bus::Bus;
use cangauge::bus::claim::Claim;
use cangauge::bus::interrupt::lines_with_interrupts;
use cangauge::bus::memory::Station;
use cangauge::bus::server::{Address, Server};
use cangauge::output::failure::ErrorMessage;
use cangauge::sim;
use clap::Args;
use std::path::PathBuf;

/// Simulate devices on a bus until Ctrl-C
///
/// The devices behave as described in their manuals, including known deviations and error messages. Use them to test
/// other programs.
///
/// Lines on standard input change values and cause faults: `pressure 1 5.2bar` holds a value, `silent 1` and `talk 1`
/// stop and resume all traffic of a node, `emcy 1 F001` sends an emergency (0000 ends it), `unplug 1` and `plug 1`
/// switch a device off and on.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b vcan0 sim mh4@5 dps@127\n  cangauge -b vcan0 sim bench.toml\n  \
                  cangauge sim mh4@5 --listen 29536      then: cangauge -b socketcand://localhost/can0 scan")]
pub(crate) struct Sim {
    /// Devices: mh4@5 dps@127; mh4@unconfigured is a device without a node-ID; mh4@5:pressure=0bar:temperature=20degC
    /// has constant values; FILE.eds@5 is a device from its EDS. Or a bench file in TOML
    #[arg(required = true, value_name = "DEVICE@NODE|FILE.toml")]
    devices: Vec<String>,
    /// Serve the devices to other programs at this TCP port as a socketcand server, instead of a bus. Without an
    /// address, only programs on this computer can connect
    #[arg(long, value_name = "[ADDR:]PORT")]
    listen: Option<Address>,
    /// Keep the stored settings of the devices and their node-IDs in this file for the next run
    #[arg(long, value_name = "FILE")]
    state: Option<PathBuf>,
}

impl Sim {
    /// No node is locked: other cangauge processes may use all nodes.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let bench = open::bench(&self.devices.join(","))?.with_state(self.state.clone());
        let mut bus = match self.listen {
            Some(address) => serve(global, address)?,
            None => open_bus(global)?,
        };
        let devices = bench.into_devices().map_err(open::bench_error)?;
        let stations = devices.into_iter().map(|device| Box::new(device) as Box<dyn Station>).collect();
        global.console().note("simulation is running; press Ctrl-C to end");
        let mut refuse = |why: &str| global.console().warn(why);
        let console = sim::host::Console { lines: lines_with_interrupts(), refuse: &mut refuse };
        sim::host::run(&mut *bus, stations, None, Some(console)).or_fail()?;
        Ok(bus.finish().or_fail()?)
    }
}

/// Starts a server. Its clients reach the devices as if on a bus.
fn serve(global: &Global, address: Address) -> anyhow::Result<Box<dyn Bus>> {
    if global.bus.is_some() {
        return Err(ErrorMessage::usage("--listen serves the devices in place of a bus: omit --bus").into());
    }
    let server = Server::listen(address).or_fail()?;
    let address = server.address().map_err(|source| FileError { what: "listen".to_owned(), source })?;
    let (console, port) = (global.console(), address.port());
    console.note(&format!("serving at {address}: cangauge -b socketcand://localhost:{port}/can0 scan"));
    if !address.is_local() {
        console.warn(&format!("any computer that reaches {address} can use the simulated devices"));
    }
    open::traced(global, Box::new(server))
}

fn open_bus(global: &Global) -> anyhow::Result<Box<dyn Bus>> {
    if let Some(BusSpec::Sim(_)) = global.bus {
        let message = "no other program can reach the simulated bus: it is inside this program";
        let hint = "name an interface (cangauge -b vcan0 sim mh4@5), or serve it: cangauge sim mh4@5 --listen 29536";
        return Err(ErrorMessage::usage(message).hint(hint).into());
    }
    open::open(global)
}
