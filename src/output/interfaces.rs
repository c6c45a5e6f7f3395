//! Text and reports of CAN interfaces and of the search for a bit rate.

use super::report::{Cell, Column, Report};
use crate::tasks::detect::{Detection, Evidence, Method, RateResult};
use std::io::{self, Write};

/// An interface. A field is `None` if it is unknown or does not apply.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Interface {
    /// The name.
    pub interface: String,
    /// Whether it is up.
    pub up: bool,
    /// The driver of its hardware.
    pub driver: Option<String>,
    /// Its kind in the kernel: `can`, `vcan`.
    pub kind: Option<String>,
    /// The bit rate in bit/s.
    pub bit_rate: Option<u32>,
    /// The sample point as a part of a bit, 0 to 1.
    pub sample_point: Option<f64>,
    /// The state of the controller.
    pub state: Option<&'static str>,
    /// Whether it is listen-only.
    pub listen_only: Option<bool>,
    /// The time in milliseconds until an automatic restart after bus-off; 0: no automatic restart.
    pub restart_ms: Option<u32>,
    /// The transmit error counter.
    pub tx_errors: Option<u16>,
    /// The receive error counter.
    pub rx_errors: Option<u16>,
    /// The bit rates in bit/s, if only these can be set.
    pub bit_rates: Option<Vec<u32>>,
}

impl Report for Interface {
    const COLUMNS: &'static [Column] = &[
        Column::new("interface"),
        Column::new("up").json_only(),
        Column::new("link").not_json(),
        Column::new("driver").json_only(),
        Column::new("kind").json_only(),
        Column::new("bit_rate").right(),
        Column::new("sample_point").json_only(),
        Column::new("state"),
        Column::new("listen_only").json_only(),
        Column::new("mode").not_json(),
        Column::new("restart_ms").json_only(),
        Column::new("tx_errors").right(),
        Column::new("rx_errors").right(),
        Column::new("driver").not_json(),
        Column::new("bit_rates").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let link = if self.up { "up" } else { "down" };
        let mode = self.listen_only.map(|listens| if listens { "listen-only" } else { "normal" });
        vec![
            self.interface.clone().into(),
            self.up.into(),
            link.into(),
            self.driver.clone().into(),
            self.kind.clone().into(),
            self.bit_rate.into(),
            self.sample_point.map_or(Cell::Null, |point| Cell::Real(point, 3)),
            self.state.into(),
            self.listen_only.into(),
            mode.into(),
            self.restart_ms.into(),
            self.tx_errors.into(),
            self.rx_errors.into(),
            self.driver.clone().or_else(|| self.kind.clone()).into(),
            self.bit_rates.as_ref().map_or(Cell::Null, |rates| Cell::list(rates.iter().copied())),
        ]
    }
}

/// A change: `can0 is up at 250000 bit/s; it was up at 125000 bit/s`.
pub fn change(before: &Interface, after: &Interface) -> String {
    let (name, now, was) = (&after.interface, link_text(after), link_text(before));
    match (before == after, now == was) {
        (true, _) => format!("{name} is {now} already: nothing was changed"),
        (false, true) => format!("{name} is {now}"),
        (false, false) => format!("{name} is {now}; it was {was}"),
    }
}

fn link_text(interface: &Interface) -> String {
    let link = if interface.up { "up" } else { "down" };
    let rate = interface.bit_rate.map_or_else(String::new, |rate| format!(" at {rate} bit/s"));
    let mode = if interface.listen_only == Some(true) { ", listen-only" } else { "" };
    format!("{link}{rate}{mode}")
}

/// The result of a search for the bit rate of a bus.
#[derive(Clone, Debug)]
pub struct BitRateReport {
    /// The interface.
    pub interface: String,
    /// The result.
    pub detection: Detection,
}

impl Report for BitRateReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("interface"),
        Column::new("bit_rate"),
        Column::new("by"),
        Column::nested(
            "tried",
            &[
                Column::new("bit_rate"),
                Column::new("active"),
                Column::new("frames"),
                Column::new("errors"),
                Column::new("acknowledged"),
                Column::new("impossible"),
            ],
        )
        .json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let Detection { found, tried } = &self.detection;
        let by = found.map(|(_, by)| match by {
            Evidence::Frames => "frames",
            Evidence::Acknowledge => "acknowledge",
        });
        vec![
            self.interface.clone().into(),
            found.map(|(bit_rate, _)| bit_rate).into(),
            by.into(),
            Cell::Rows(tried.iter().map(tried_cells).collect()),
        ]
    }

    /// Prints only the bit rate.
    fn text(reports: &[BitRateReport], out: &mut dyn Write) -> io::Result<()> {
        let mut found = reports.iter().filter_map(|report| report.detection.found);
        found.try_for_each(|(bit_rate, _)| writeln!(out, "{bit_rate}"))
    }
}

fn tried_cells(tried: &RateResult) -> Vec<Cell> {
    let is_active = tried.how == Method::Asking;
    let is_possible = tried.impossible.is_none();
    vec![
        tried.bit_rate.into(),
        is_active.into(),
        is_possible.then_some(tried.frames).into(),
        is_possible.then_some(tried.errors).into(),
        (is_possible && is_active).then_some(tried.acknowledged).into(),
        tried.impossible.clone().into(),
    ]
}

/// One line about a bit rate that was tried.
pub fn tried_line(tried: &RateResult) -> String {
    let counted = |count: u32, what: &str| format!("{count} {what}{}", if count == 1 { "" } else { "s" });
    let result = match &tried.impossible {
        Some(reason) => format!("the interface cannot be set to it: {reason}"),
        None => format!("{}, {}", counted(tried.frames, "valid frame"), counted(tried.errors, "error")),
    };
    let acknowledged = if tried.acknowledged { ", acknowledged" } else { "" };
    format!("{} bit/s: {result}{acknowledged}", tried.bit_rate)
}
