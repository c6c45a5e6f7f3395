//! `cangauge unit`.

use super::read::parse_unit;
use super::{Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit as Code;
use crate::output::console::Console;
use crate::tasks::settings::Device;
use crate::tasks::settings::unit::{UnitChange, set, show};
use crate::tasks::{Failure, Kind};
use clap::Args;

/// Show or set the physical unit of a signal (6131h)
///
/// After the unit is set, it is read back, and so is everything that the device rescales: measuring range, offset,
/// limits, process value. The unit of a single signal is printed without its name.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim unit 1\n  cangauge -b sim unit 1 temperature K\n  cangauge -b sim unit 1 pressure 0x06220000"
)]
pub(crate) struct Unit {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Signal (pressure, temperature, ch1 to ch16), and the unit to set (bar, psi, MPa, kPa, mbar, degC, K, or the
    /// code 0x004E0000)
    #[arg(value_names = ["SIGNAL", "UNIT"], num_args = 0..=2)]
    words: Vec<String>,
}

impl Unit {
    /// The node, for this command alone.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (signal, unit) = self.words().map_err(|message| Failure::new(Kind::Usage, message))?;
        let overrides = open::overrides(global, &[self.node])?;
        let console = global.console();
        match unit {
            None => {
                let units = global.with_master(|master| {
                    let device = Device::open(master, self.node, &overrides)?;
                    Ok(show(&device, signal)?)
                })?;
                global.print(&units)
            }
            Some(unit) => {
                let change = global.with_master(|master| {
                    let mut device = Device::open(master, self.node, &overrides)?;
                    Ok(set(master, &mut device, signal, unit)?)
                })?;
                global.print(std::slice::from_ref(&change))?;
                self.comment(&change, &console);
                Ok(())
            }
        }
    }

    /// A single word is a unit if it names one, otherwise a signal.
    fn words(&self) -> Result<(Option<&str>, Option<Code>), String> {
        match self.words.as_slice() {
            [] => Ok((None, None)),
            [word] => match parse_unit(word) {
                Ok(unit) => Ok((None, Some(unit))),
                Err(_) => Ok((Some(word), None)),
            },
            [signal, unit, ..] => Ok((Some(signal), Some(parse_unit(unit)?))),
        }
    }

    /// Notes about the change on stderr.
    fn comment(&self, change: &UnitChange, console: &Console) {
        let node = self.node;
        if change.before == change.now.unit {
            console.note(&format!("node {node}: {} is already in {}", change.now.signal, change.before));
            return;
        }
        for item in change.rescaled.iter().filter(|item| item.stale) {
            let number = item.after.map(|after| after.to_string()).unwrap_or_default();
            console.warn(&format!("node {node}: the device did not convert {}: it is now {number}", item.name));
        }
        console.note(&format!("node {node}: lost at power-off unless stored: cangauge store {node}"));
    }
}
