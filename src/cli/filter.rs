//! `cangauge filter`.

use super::Global;
use super::args::Duration;
use super::nodes::{on_channels, print_notes};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::tasks::settings::filter::{FilterRequest, FilterType, has_filter, set, show};
use clap::{Args, ValueEnum};

/// Show or set the filter of a signal: type (61A0h) and constant (61A1h)
///
/// The meaning of a filter type depends on the device: on some devices, 0 is a filter. After a change, the filter is
/// read back. The device does not return the damping. It returns the filter constant that it calculated from the
/// damping.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim filter 1\n  cangauge -b sim filter 1 pressure --type moving --constant 8\n  cangauge -b sim filter 1 --type moving --damping 100ms"
)]
pub(crate) struct Filter {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Signal: pressure, temperature, ch1 to ch16; several: ch1-ch4, ch1,ch3, all [default: all]. To set
    /// a filter, SIGNAL is needed if several signals have a filter
    signal: Option<String>,
    /// Filter type
    #[arg(long = "type", value_name = "TYPE")]
    kind: Option<Type>,
    /// Filter constant: number of samples
    #[arg(long, value_name = "N")]
    constant: Option<u16>,
    /// Settling time after a step; the device calculates the constant from it
    #[arg(long, value_name = "DUR", conflicts_with = "constant")]
    damping: Option<Duration>,
}

// No doc comments on the variants: clap would print each on its own lines.
#[derive(Clone, Copy, Debug, ValueEnum)]
enum Type {
    None,
    Moving,
    Repeating,
}

impl Filter {
    /// The node that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn writes(&self) -> bool {
        self.kind.is_some() || self.constant.is_some() || self.damping.is_some()
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let wanted = FilterRequest {
            kind: self.kind.map(|kind| match kind {
                Type::None => FilterType::None,
                Type::Moving => FilterType::Moving,
                Type::Repeating => FilterType::Repeating,
            }),
            constant: self.constant,
            damping: self.damping.map(|damping| damping.0),
        };
        let signal = self.signal.as_deref();
        let each = on_channels(global, self.node, signal, has_filter, |master, node, signal| {
            match wanted == FilterRequest::default() {
                true => show(master, node, signal),
                false => Ok(vec![set(master, node, signal, wanted)?]),
            }
        })?;
        let (reports, end) = each.into_parts();
        let reports = reports.concat();
        global.print(&reports)?;
        print_notes(global, reports.iter().flat_map(|report| &report.notes));
        end.end()
    }
}
