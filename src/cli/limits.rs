//! `cangauge limits`.

use super::Global;
use super::nodes::{on_channels, print_notes};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::output::failure::ErrorMessage;
use cangauge::tasks::settings::limits::{Limit, has_limits, set, show};
use clap::Args;

/// Show or set what triggers a TPDO: delta, limits, hysteresis (x133h to x136h)
///
/// Values are in the unit of the signal. They apply to transmission types 254 and 255. If event timer and delta of such
/// a TPDO are both 0, it may never be sent. A warning is printed then.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim limits 1 pressure\n  cangauge -b sim limits 1 temperature --delta 0.5\n  cangauge -b sim limits 1 pressure --lower 0.5 --upper 8 --hysteresis 0.1"
)]
pub(crate) struct Limits {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Signal: pressure, temperature, ch1 to ch16; several: ch1-ch4, ch1,ch3, all
    signal: String,
    /// Delta: send if the value changes by at least this much; 0: off
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    delta: Option<f64>,
    /// Lower limit: send if the value falls below this limit
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    lower: Option<f64>,
    /// Upper limit: send if the value rises above this limit
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    upper: Option<f64>,
    /// Hysteresis before a limit triggers again
    #[arg(long, value_name = "V", allow_negative_numbers = true, value_parser = finite)]
    hysteresis: Option<f64>,
}

fn finite(text: &str) -> Result<f64, String> {
    let number = text.parse::<f64>().ok().filter(|number| number.is_finite());
    number.ok_or_else(|| format!("\"{text}\" is not a number (0.5, -20)"))
}

impl Limits {
    /// The node that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nodes(vec![self.node])
    }

    pub(super) fn writes(&self) -> bool {
        [self.delta, self.lower, self.upper, self.hysteresis].iter().any(Option::is_some)
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let given = [self.delta, self.lower, self.upper, self.hysteresis];
        let wanted: Vec<(Limit, f64)> =
            Limit::ALL.into_iter().zip(given).filter_map(|(limit, number)| Some((limit, number?))).collect();
        for (limit, number) in wanted.iter().filter(|(limit, _)| matches!(limit, Limit::Delta | Limit::Hysteresis)) {
            if *number < 0.0 {
                let message = format!("{} must not be negative: {number}", limit.as_str());
                return Err(ErrorMessage::usage(message).into());
            }
        }
        let each = on_channels(global, self.node, Some(&self.signal), has_limits, |master, node, signal| {
            let signal = signal.unwrap_or(&self.signal);
            match wanted.is_empty() {
                true => show(master, node, signal),
                false => set(master, node, signal, &wanted),
            }
        })?;
        let (reports, end) = each.into_parts();
        global.print(&reports)?;
        print_notes(global, reports.iter().flat_map(|report| &report.notes));
        end.end()
    }
}
