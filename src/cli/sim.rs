//! `cangauge sim`.

use super::args::BusSpec;
use super::exit::IntoFailure;
use super::{Global, open};
use crate::bus::claim::Claim;
use crate::bus::memory::Station;
use crate::output::failure::ErrorMessage;
use crate::sim;
use clap::Args;

/// Simulate devices on a bus until Ctrl-C
///
/// The devices answer, send and fail as described in their manuals. Use them to test other programs.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b vcan0 sim mh4@5 dps@127\n  cangauge -b vcan0 sim bench.toml")]
pub(crate) struct Sim {
    /// Devices: mh4@5 dps@127, mh4@unconfigured for one without a node-ID, mh4@5:pressure=0bar with a constant value,
    /// FILE.eds@5 from an EDS; or a bench file in TOML
    #[arg(required = true, value_name = "DEVICE@NODE|FILE.toml")]
    devices: Vec<String>,
}

impl Sim {
    /// Nothing: other cangauges may use every node.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let bench = open::bench(&self.devices.join(","))?;
        if let Some(BusSpec::Sim(_)) = global.bus {
            let message = "no other program can reach the simulated bus: it is inside this program";
            let hint = "name an interface, for example a virtual one: cangauge -b vcan0 sim mh4@5";
            return Err(ErrorMessage::usage(message).hint(hint).into());
        }
        let mut bus = open::open(global)?;
        let devices = bench.into_devices().map_err(open::bench_error)?;
        let stations = devices.into_iter().map(|device| Box::new(device) as Box<dyn Station>).collect();
        global.console().note("simulation is running; press Ctrl-C to end");
        sim::host::run(&mut *bus, stations, None).or_fail()?;
        Ok(bus.finish().or_fail()?)
    }
}
