//! The settings of a device as JSON Lines.

use super::json::{JsonNumber, line};
use crate::canopen::id::NodeId;
use crate::tasks::settings::Quantity;
use crate::tasks::settings::errors::{Errors, PastError};
use crate::tasks::settings::filter::FilterOf;
use crate::tasks::settings::limits::{Limit, Limits};
use crate::tasks::settings::minmax::Extremes;
use crate::tasks::settings::unit::{UnitChange, UnitOf};
use serde::Serialize;
use std::io::{self, Write};

fn number(quantity: Option<Quantity>) -> JsonNumber {
    JsonNumber(quantity.map(|quantity| quantity.number))
}

fn unit_name(quantity: Option<Quantity>) -> Option<String> {
    quantity?.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty())
}

/// The unit of a signal.
pub fn unit(out: &mut dyn Write, node: NodeId, unit: &UnitOf) -> io::Result<()> {
    #[derive(Serialize)]
    struct Unit<'a> {
        node: u8,
        signal: &'a str,
        unit: String,
        code: String,
        takes: Vec<String>,
        fixed: bool,
    }
    line(
        out,
        &Unit {
            node: node.get(),
            signal: &unit.signal,
            unit: unit.unit.to_string(),
            code: format!("0x{:08X}", unit.unit.0),
            takes: unit.takes.iter().map(ToString::to_string).collect(),
            fixed: unit.fixed,
        },
    )
}

/// A unit that was set, with what it rescaled.
pub fn unit_change(out: &mut dyn Write, node: NodeId, change: &UnitChange) -> io::Result<()> {
    #[derive(Serialize)]
    struct Rescaled<'a> {
        object: String,
        name: &'a str,
        before: JsonNumber,
        after: JsonNumber,
        stale: bool,
    }
    #[derive(Serialize)]
    struct Change<'a> {
        node: u8,
        signal: &'a str,
        before: String,
        unit: String,
        code: String,
        rescaled: Vec<Rescaled<'a>>,
    }
    let rescaled = change.rescaled.iter().map(|item| Rescaled {
        object: item.object.to_string(),
        name: &item.name,
        before: number(item.before),
        after: number(item.after),
        stale: item.stale,
    });
    line(
        out,
        &Change {
            node: node.get(),
            signal: &change.now.signal,
            before: change.before.to_string(),
            unit: change.now.unit.to_string(),
            code: format!("0x{:08X}", change.now.unit.0),
            rescaled: rescaled.collect(),
        },
    )
}

/// The filter of a signal; after a change with whether the damping showed.
pub fn filter(out: &mut dyn Write, node: NodeId, filter: &FilterOf, damping_shown: Option<bool>) -> io::Result<()> {
    #[derive(Serialize)]
    struct Filter<'a> {
        node: u8,
        signal: &'a str,
        code: Option<u64>,
        #[serde(rename = "type")]
        kind: &'a str,
        constant: Option<u64>,
        #[serde(skip_serializing_if = "Option::is_none")]
        damping_shown: Option<bool>,
    }
    let (signal, kind) = (filter.signal.as_str(), filter.kind.as_str());
    let (node, code, constant) = (node.get(), filter.code, filter.constant);
    line(out, &Filter { node, signal, code, kind, constant, damping_shown })
}

/// The limits of a signal; `null` for those that the device has not.
pub fn limits(out: &mut dyn Write, node: NodeId, limits: &Limits) -> io::Result<()> {
    #[derive(Serialize)]
    struct Json<'a> {
        node: u8,
        signal: &'a str,
        delta: JsonNumber,
        lower: JsonNumber,
        upper: JsonNumber,
        hysteresis: JsonNumber,
        unit: Option<String>,
        silent: &'a [String],
    }
    let of = |limit: Limit| limits.values.iter().find(|(other, ..)| *other == limit).map(|&(_, _, quantity)| quantity);
    line(
        out,
        &Json {
            node: node.get(),
            signal: &limits.signal,
            delta: number(of(Limit::Delta)),
            lower: number(of(Limit::Lower)),
            upper: number(of(Limit::Upper)),
            hysteresis: number(of(Limit::Hysteresis)),
            unit: unit_name(limits.values.first().map(|&(_, _, quantity)| quantity)),
            silent: &limits.silent,
        },
    )
}

/// The lowest and highest value of a signal; after a reset with those before.
pub fn extremes(out: &mut dyn Write, node: NodeId, now: &Extremes, before: Option<&Extremes>) -> io::Result<()> {
    #[derive(Serialize)]
    struct Json<'a> {
        node: u8,
        signal: &'a str,
        min: JsonNumber,
        max: JsonNumber,
        unit: Option<String>,
        #[serde(skip_serializing_if = "Option::is_none")]
        before: Option<Before>,
    }
    #[derive(Serialize)]
    struct Before {
        min: JsonNumber,
        max: JsonNumber,
    }
    let before = before.map(|before| Before { min: number(before.lowest), max: number(before.highest) });
    let (min, max) = (number(now.lowest), number(now.highest));
    line(out, &Json { node: node.get(), signal: &now.signal, min, max, unit: unit_name(now.lowest), before })
}

/// An entry of the error history.
#[derive(Serialize)]
pub(super) struct Past<'a> {
    code: String,
    text: &'a str,
    detail: Option<&'a str>,
    raw: String,
}

impl<'a> Past<'a> {
    pub(super) fn new(error: &'a PastError) -> Past<'a> {
        Past {
            code: format!("0x{:04X}", error.code),
            text: &error.text,
            detail: Some(error.detail.as_str()).filter(|detail| !detail.is_empty()),
            raw: format!("0x{:08X}", error.raw),
        }
    }
}

/// Register and history; after they were cleared with how many errors there were.
pub fn errors(out: &mut dyn Write, node: NodeId, errors: &Errors, cleared: Option<u64>) -> io::Result<()> {
    #[derive(Serialize)]
    struct Json<'a> {
        node: u8,
        register: Option<String>,
        register_text: Option<&'a str>,
        count: Option<u64>,
        history: Vec<Past<'a>>,
        #[serde(skip_serializing_if = "Option::is_none")]
        cleared: Option<u64>,
    }
    line(
        out,
        &Json {
            node: node.get(),
            register: errors.register.map(|bits| format!("0x{bits:02X}")),
            register_text: errors.register.map(|_| errors.register_text.as_str()),
            count: errors.count,
            history: errors.history.iter().map(Past::new).collect(),
            cleared,
        },
    )
}
