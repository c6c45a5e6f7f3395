//! `cangauge unit`.

use super::Global;
use super::nodes::{on_channels, print_notes};
use super::read::parse_unit;
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::device::unit::Unit as Code;
use cangauge::measure::layout::Signal;
use cangauge::node::Node;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::settings::unit::{is_alike, set, show};
use clap::Args;

/// Show or set the physical unit of a signal (6131h)
///
/// After a change, the unit is read back. All values that the device converts are also read back: measuring range,
/// offset, limits, process value. For a single signal, only the unit is printed.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim unit 1\n  cangauge -b sim unit 1 temperature K\n  cangauge -b sim unit 1 pressure 0x06220000"
)]
pub(crate) struct Unit {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Signal (pressure, temperature, ch1 to ch16; several: ch1-ch4, ch1,ch3, all), and the unit to set (bar, psi, MPa,
    /// kPa, mbar, degC, K, or the code 0x004E0000)
    #[arg(value_names = ["SIGNAL", "UNIT"], num_args = 0..=2)]
    words: Vec<String>,
}

impl Unit {
    /// The node that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn writes(&self) -> bool {
        self.signal_and_unit().is_ok_and(|(_, unit)| unit.is_some())
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let (signal, unit) = self.signal_and_unit().map_err(ErrorMessage::usage)?;
        let Some(unit) = unit else {
            let each = on_channels(
                global,
                self.node,
                signal,
                |_, signal| signal.unit.is_some(),
                |_, node, signal| show(node, signal),
            )?;
            let (units, end) = each.into_parts();
            global.print(&units.concat())?;
            return end.end();
        };
        let is_alike = |_: &Node, signal: &Signal| is_alike(signal, unit);
        let each =
            on_channels(global, self.node, signal, is_alike, |master, node, signal| set(master, node, signal, unit))?;
        let (changes, end) = each.into_parts();
        global.print(&changes)?;
        print_notes(global, changes.iter().flat_map(|change| &change.notes));
        end.end()
    }

    /// Returns signal and unit. A single word is a unit if it is the name of a unit, otherwise a signal.
    fn signal_and_unit(&self) -> Result<(Option<&str>, Option<Code>), String> {
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
