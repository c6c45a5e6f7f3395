//! CAN interfaces, and the result of a bit rate detection.

use super::csv;
use super::json::line;
use super::report::{Cell, Column, Report};
use crate::tasks::detect::{By, Detection, How};
use serde::Serialize;
use std::io::{self, Write};

/// A CAN interface. What is unknown is `None`.
#[derive(Clone, Debug, Default)]
pub struct Interface {
    /// The name.
    pub interface: String,
    /// Whether it is up.
    pub up: bool,
    /// The driver of its hardware.
    pub driver: Option<String>,
    /// The kind of link: `can`, `vcan`.
    pub kind: Option<String>,
    /// In bit/s.
    pub bit_rate: Option<u32>,
    /// Position of the sample point within a bit, 0 to 1.
    pub sample_point: Option<f64>,
    /// The controller's state.
    pub state: Option<&'static str>,
    /// Whether it is in listen-only mode.
    pub listen_only: Option<bool>,
    /// Restart delay after bus-off in milliseconds; 0: no restart.
    pub restart_ms: Option<u32>,
    /// Transmit error counter.
    pub tx_errors: Option<u16>,
    /// Receive error counter.
    pub rx_errors: Option<u16>,
    /// The only bit rates that it supports, in bit/s.
    pub bit_rates: Option<Vec<u32>>,
}

impl Report for Interface {
    const COLUMNS: &'static [Column] = &[
        Column::new("interface"),
        Column::new("up").heading("LINK"),
        Column::new("bit_rate").right(),
        Column::new("state"),
        Column::new("listen_only").heading("MODE"),
        Column::new("tx_errors").right(),
        Column::new("rx_errors").right(),
        Column::new("driver"),
        Column::new("kind").data_only(),
        Column::new("sample_point").data_only(),
        Column::new("restart_ms").data_only(),
        Column::new("bit_rates").data_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let mode = |listen_only| if listen_only { "listen-only" } else { "normal" };
        let driver = Cell::from(self.driver.as_ref());
        vec![
            self.interface.as_str().into(),
            Cell::from(self.up).shown_as(if self.up { "up" } else { "down" }),
            self.bit_rate.into(),
            self.state.into(),
            self.listen_only.map(|listen_only| Cell::from(listen_only).shown_as(mode(listen_only))).into(),
            self.tx_errors.into(),
            self.rx_errors.into(),
            // A virtual interface has no driver.
            if driver == Cell::Null { driver.shown_as(Cell::from(self.kind.as_ref()).shown()) } else { driver },
            self.kind.as_ref().into(),
            self.sample_point.map(|point| Cell::Real(point, 3)).into(),
            self.restart_ms.into(),
            self.bit_rates.as_ref().map(|rates| Cell::list(rates.iter().copied())).into(),
        ]
    }
}

/// What a detection found, as one object.
pub fn detection_json(out: &mut dyn Write, name: &str, detection: &Detection) -> io::Result<()> {
    #[derive(Serialize)]
    struct Found<'a> {
        interface: &'a str,
        bit_rate: Option<u32>,
        by: Option<&'a str>,
        tried: Vec<Tried<'a>>,
    }
    #[derive(Serialize)]
    struct Tried<'a> {
        bit_rate: u32,
        active: bool,
        frames: Option<u32>,
        errors: Option<u32>,
        acknowledged: Option<bool>,
        impossible: Option<&'a str>,
    }
    let tried = detection.tried.iter().map(|tried| {
        let active = tried.how == How::Asking;
        let possible = tried.impossible.is_none();
        Tried {
            bit_rate: tried.bit_rate,
            active,
            frames: possible.then_some(tried.frames),
            errors: possible.then_some(tried.errors),
            acknowledged: (possible && active).then_some(tried.acknowledged),
            impossible: tried.impossible.as_deref(),
        }
    });
    let found = Found {
        interface: name,
        bit_rate: detection.found.map(|(rate, _)| rate),
        by: detection.found.map(|(_, by)| by_name(by)),
        tried: tried.collect(),
    };
    line(out, &found)
}

/// What a detection found, as CSV.
pub fn detection_csv(out: &mut dyn Write, name: &str, detection: &Detection) -> io::Result<()> {
    let (rate, by) = detection.found.map(|(rate, by)| (rate.to_string(), by_name(by))).unwrap_or_default();
    csv::write(out, &["interface", "bit_rate", "by"], [vec![name.to_owned(), rate, by.to_owned()]])
}

fn by_name(by: By) -> &'static str {
    match by {
        By::Frames => "frames",
        By::Acknowledge => "acknowledge",
    }
}
