//! `cangauge scan`.

use super::args::Nodes;
use super::exit::{IntoFailure, several, stdout};
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::output::{csv, json, table, text};
use crate::tasks::scan::{Found, listen, scan};
use crate::tasks::{Failure, Kind};
use clap::Args;
use std::io::{self, Write};
use std::time::Duration;

/// How long `--passive` listens: a heartbeat of once a second is heard three times.
const LISTEN: Duration = Duration::from_secs(3);

/// The wait after the last request.
pub(super) const SCAN_TIMEOUT: Duration = Duration::from_millis(200);

/// List every node that answers, with its state, identity and recognised device
///
/// Every node is asked for its device type, all side by side; the silent ones once more. The state is
/// what a heartbeat tells; "-" where nothing tells it.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge -b sim scan\n  cangauge -b sim scan 1-16 --format json")]
pub(crate) struct Scan {
    /// Which nodes: 5, 0x7f, 1-16, 1,5, all
    #[arg(default_value = "1-127")]
    nodes: Nodes,
    /// Send nothing: list who shows itself within 3 s
    #[arg(long)]
    passive: bool,
}

impl Scan {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        if self.passive { Claim::Nothing } else { self.nodes.claim() }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        let nodes: Vec<NodeId> = match &self.nodes {
            Nodes::All => NodeId::all().collect(),
            Nodes::These(nodes) => nodes.clone(),
        };
        let overrides = open::overrides(global, &nodes)?;
        let (found, took) = global.with_master(|master| {
            let begun = master.now();
            let found = if self.passive {
                // A recording is listened to as a whole.
                let long = if master.bus().is_live() { LISTEN } else { Duration::MAX };
                listen(master, &nodes, global.timeout.map_or(long, |timeout| timeout.0)).or_fail()?
            } else {
                let wait = global.timing(SCAN_TIMEOUT).timeout;
                let rounds = 1 + global.timing(SCAN_TIMEOUT).retries;
                scan(master, &nodes, wait, rounds, &overrides).or_fail()?
            };
            Ok((found, master.now().since(begun)))
        })?;
        if found.is_empty() {
            return Err(nobody(self.passive).into());
        }
        print(&found, global.format).map_err(stdout)?;
        self.say(&found, took, global);
        let failures: Vec<Failure> = found.iter().filter_map(|found| found.failure.clone()).collect();
        Ok(several(found.len(), failures)?)
    }

    fn say(&self, found: &[Found], took: Duration, global: &Global) {
        let nodes = if found.len() == 1 { "node" } else { "nodes" };
        let mut line = format!("{} {nodes} in {:.2} s.", found.len(), took.as_secs_f64());
        if found.iter().any(|found| found.state.is_none()) && !self.passive {
            line.push_str(" State \"-\": no heartbeat tells it.");
        }
        global.console().note(&line);
    }
}

fn nobody(passive: bool) -> Failure {
    if passive {
        return Failure::new(Kind::NoAnswer, "no node sent anything")
            .hint("a node without heartbeat and TPDOs sends nothing; ask it: cangauge scan");
    }
    Failure::new(Kind::NoAnswer, "no node answered").hint(
        "check the sensor's power, the bit rate, the wiring and the 120 ohm terminators; without hardware: --bus sim",
    )
}

fn print(found: &[Found], format: Format) -> io::Result<()> {
    let mut out = io::stdout().lock();
    match format {
        Format::Json => found.iter().try_for_each(|found| json::found(&mut out, found)),
        Format::Csv => {
            let head = HEAD.map(str::to_ascii_lowercase);
            let head = head.each_ref().map(String::as_str);
            csv::write(&mut out, &head, found.iter().map(|found| row(found, "")))
        }
        Format::Text => {
            let mut rows = vec![HEAD.map(str::to_owned).to_vec()];
            rows.extend(found.iter().map(|found| row(found, "-")));
            let mut align = vec![table::Align::Left; HEAD.len()];
            align[0] = table::Align::Right;
            align[7] = table::Align::Right;
            table::write(&mut out, &align, &rows)
        }
    }?;
    out.flush()
}

const HEAD: [&str; 8] = ["NODE", "STATE", "DEVICE", "NAME", "VENDOR", "PRODUCT", "REVISION", "SERIAL"];

fn row(found: &Found, missing: &str) -> Vec<String> {
    let identity = &found.instrument.identity;
    let description = found.instrument.model.as_ref().map(|model| &model.description);
    let hex = |value: Option<u32>| value.map(|value| format!("0x{value:08X}"));
    let vendor = description.map(|description| description.vendor.clone());
    [
        Some(found.node.to_string()),
        found.state.map(|state| state.to_string()),
        description.map(|description| description.name.clone()),
        identity.name.as_deref().filter(|name| !name.is_empty()).map(text::safe),
        vendor.or_else(|| hex(identity.vendor)),
        hex(identity.product),
        hex(identity.revision),
        identity.serial.map(|serial| serial.to_string()),
    ]
    .map(|cell| cell.unwrap_or_else(|| missing.to_owned()))
    .to_vec()
}
