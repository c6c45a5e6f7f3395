//! JSON Lines of the LSS commands.

use super::json::line;
use crate::canopen::id::NodeId;
use crate::tasks::lss::{Inquired, LssAddress, Report, Slave};
use serde::Serialize;
use std::io::{self, Write};

/// The four numbers of an identity, or null.
#[derive(Default, Serialize)]
struct Identity {
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
}

impl From<Option<LssAddress>> for Identity {
    fn from(address: Option<LssAddress>) -> Identity {
        address.map_or_else(Identity::default, |LssAddress { vendor, product, revision, serial }| Identity {
            vendor: Some(vendor),
            product: Some(product),
            revision: Some(revision),
            serial: Some(serial),
        })
    }
}

/// A device that `lss scan` found.
pub fn slave(out: &mut dyn Write, slave: &Slave) -> io::Result<()> {
    #[derive(Serialize)]
    struct Found<'a> {
        node: Option<u8>,
        #[serde(flatten)]
        identity: Identity,
        device: Option<&'a str>,
    }
    let device = slave.model.as_ref().map(|model| model.description.name.as_str());
    line(out, &Found { node: slave.node.map(NodeId::get), identity: slave.address.into(), device })
}

/// What a device says of itself. `node` is null of one that has none and of one that does not tell.
pub fn inquired(out: &mut dyn Write, target: &str, told: &Inquired) -> io::Result<()> {
    #[derive(Serialize)]
    struct Told<'a> {
        target: &'a str,
        node: Option<u8>,
        unconfigured: Option<bool>,
        #[serde(flatten)]
        identity: Identity,
    }
    let unconfigured = told.node.map(|node| node.is_none());
    let node = told.node.flatten().map(NodeId::get);
    line(out, &Told { target, node, unconfigured, identity: told.address.into() })
}

/// That somebody answers within a range.
pub fn identified(out: &mut dyn Write, range: &str) -> io::Result<()> {
    #[derive(Serialize)]
    struct Answered<'a> {
        range: &'a str,
        answered: bool,
    }
    line(out, &Answered { range, answered: true })
}

/// What became of `set-id`, `set-bitrate` and `set`.
pub fn report(out: &mut dyn Write, report: &Report) -> io::Result<()> {
    #[derive(Serialize)]
    struct Stale {
        object: String,
        cob_id: String,
        expected: String,
    }
    #[derive(Serialize)]
    struct Rate {
        bit_rate: Option<u32>,
        table_index: u8,
        retimed: bool,
    }
    #[derive(Serialize)]
    struct Done<'a> {
        target: String,
        old: Option<u8>,
        new: Option<u8>,
        stored: bool,
        confirmed: &'a str,
        #[serde(flatten)]
        identity: Identity,
        device: Option<&'a str>,
        #[serde(flatten)]
        rate: Option<Rate>,
        #[serde(skip_serializing_if = "Option::is_none")]
        stale: Option<Vec<Stale>>,
    }
    let stale = report.cob_ids.as_ref().map(|ids| {
        let stale = ids.stale.iter().map(|stale| Stale {
            object: stale.object.to_string(),
            cob_id: format!("0x{:X}", stale.cob_id.0),
            expected: format!("0x{:X}", stale.expected),
        });
        stale.collect()
    });
    let rate = report.rate.map(|rate| Rate { bit_rate: rate.bits, table_index: rate.index, retimed: report.retimed });
    let done = Done {
        target: report.target.to_string(),
        old: report.old.map(NodeId::get),
        new: report.new.or(report.old).map(NodeId::get),
        stored: report.stored,
        confirmed: report.confirmed.as_str(),
        identity: report.address.into(),
        device: report.device(),
        rate,
        stale,
    };
    line(out, &done)
}
