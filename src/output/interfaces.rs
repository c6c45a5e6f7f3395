//! CAN interfaces, and what came of looking for a bit rate.

use super::json::line;
use super::table::Align;
use super::{csv, table};
use crate::tasks::detect::{By, Detection, How};
use serde::Serialize;
use std::io::{self, Write};

/// An interface; what nothing tells is missing.
#[derive(Clone, Debug, Default, Serialize)]
pub struct Interface {
    /// Its name.
    pub interface: String,
    /// Whether it is switched on.
    pub up: bool,
    /// The driver of its hardware.
    pub driver: Option<String>,
    /// What it is to the kernel: `can`, `vcan`.
    pub kind: Option<String>,
    /// In bit/s.
    pub bit_rate: Option<u32>,
    /// Where in a bit it is sampled, 0 to 1.
    pub sample_point: Option<f64>,
    /// The controller's state.
    pub state: Option<&'static str>,
    /// Whether it only listens.
    pub listen_only: Option<bool>,
    /// After how many milliseconds it is restarted after bus-off; 0: never.
    pub restart_ms: Option<u32>,
    /// Error counter of sending.
    pub tx_errors: Option<u16>,
    /// Error counter of receiving.
    pub rx_errors: Option<u16>,
    /// The only bit rates that it has, in bit/s.
    pub bit_rates: Option<Vec<u32>>,
}

const HEAD: [&str; 8] = ["INTERFACE", "LINK", "BIT_RATE", "STATE", "MODE", "TX_ERRORS", "RX_ERRORS", "DRIVER"];

impl Interface {
    fn row(&self, missing: &str) -> Vec<String> {
        let mode = |listens| if listens { "listen-only" } else { "normal" };
        [
            Some(self.interface.clone()),
            Some(if self.up { "up" } else { "down" }.to_owned()),
            self.bit_rate.map(|rate| rate.to_string()),
            self.state.map(str::to_owned),
            self.listen_only.map(|listens| mode(listens).to_owned()),
            self.tx_errors.map(|count| count.to_string()),
            self.rx_errors.map(|count| count.to_string()),
            self.driver.clone().or_else(|| self.kind.clone()),
        ]
        .map(|cell| cell.unwrap_or_else(|| missing.to_owned()))
        .to_vec()
    }
}

/// Interfaces as JSON Lines.
pub fn json(out: &mut dyn Write, interfaces: &[Interface]) -> io::Result<()> {
    interfaces.iter().try_for_each(|interface| line(out, interface))
}

/// Interfaces as CSV.
pub fn csv(out: &mut dyn Write, interfaces: &[Interface]) -> io::Result<()> {
    let head = HEAD.map(str::to_ascii_lowercase);
    csv::write(out, &head.each_ref().map(String::as_str), interfaces.iter().map(|interface| interface.row("")))
}

/// Interfaces as a table; nothing where there are none.
pub fn text(out: &mut dyn Write, interfaces: &[Interface]) -> io::Result<()> {
    if interfaces.is_empty() {
        return Ok(());
    }
    let mut rows = vec![HEAD.map(str::to_owned).to_vec()];
    rows.extend(interfaces.iter().map(|interface| interface.row("-")));
    let mut align = [Align::Left; HEAD.len()];
    (align[2], align[5], align[6]) = (Align::Right, Align::Right, Align::Right);
    table::write(out, &align, &rows)
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
