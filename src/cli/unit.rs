//! `cangauge unit`.

use super::Global;
use super::each::on_node;
use super::read::parse_unit;
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::device::unit::Unit as Code;
use crate::output::failure::ErrorMessage;
use crate::output::notes;
use crate::tasks::settings::unit::{set, show};
use clap::Args;

/// Show or set the physical unit of a signal (6131h)
///
/// After a change, the unit is read back. All values that the device converts are read back as well: measuring range,
/// offset, limits, process value. The unit of a single signal is printed without its name.
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

    pub(super) fn writes(&self) -> bool {
        self.words().is_ok_and(|(_, unit)| unit.is_some())
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (signal, unit) = self.words().map_err(ErrorMessage::usage)?;
        match unit {
            None => global.print(&on_node(global, self.node, |_, node| show(node, signal))?),
            Some(unit) => {
                let change = on_node(global, self.node, |master, node| set(master, node, signal, unit))?;
                global.print(std::slice::from_ref(&change))?;
                change.notes.iter().for_each(|note| notes::print(&global.console(), note));
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
}
