//! `cangauge sim`.

use super::exit::IntoFailure;
use super::{Global, open};
use crate::sim;
use crate::tasks::{Failure, Kind};
use clap::Args;

/// Simulate devices on a bus until Ctrl-C
///
/// The devices answer, send and fail as their manuals say, so that other programs can be tried against
/// them.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b vcan0 sim mh4@5 dps@127\n  cangauge -b vcan0 sim bench.toml")]
pub struct Sim {
    /// mh4@5 d20@2 dps@127 mc1609@3, or a bench description in TOML
    #[arg(required = true, value_name = "DEVICE@NODE|FILE.toml")]
    devices: Vec<String>,
}

impl Sim {
    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let usage = |message: String| Failure::new(Kind::Usage, message);
        let bench = sim::Bench::parse(&self.devices.join(",")).map_err(|error| usage(error.to_string()))?;
        let mut bus = open::open(global)?;
        let mut stations = bench.stations().map_err(|error| usage(error.to_string()))?;
        global.console().note("simulating; Ctrl-C ends");
        Ok(sim::host::run(&mut *bus, &mut stations, None).or_fail()?)
    }
}
