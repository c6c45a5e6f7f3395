//! Text for values that are missing or may be wrong.

use crate::canopen::id::NodeId;
use crate::measure::layout::NarrowValue;
use crate::measure::sample::Doubt;

/// Returns the reason why the value of a signal is missing or may be wrong, and the remedy.
pub fn doubt(node: NodeId, signal: &str, doubt: Doubt) -> String {
    match doubt {
        Doubt::UnknownType => format!("node {node}: {}; {}", unknown_type(signal), type_remedy(node, signal)),
        Doubt::NotNumber => {
            format!("node {node}: {signal}: no value: it is text or bytes; read it: cangauge sdo read {node} {signal}")
        }
        Doubt::ImpossibleDigits(digits) => {
            format!("node {node}: {signal}: no value: 6132h is {digits}; valid are 0 to 9 decimal digits")
        }
        Doubt::UnknownDigits => {
            format!("node {node}: {signal}: the decimal digits (6132h) are unknown: the value is the unscaled integer")
        }
        Doubt::UnreadScale => format!(
            "node {node}: {signal}: no value: its decimal digits (6132h) are unknown, because the device gave no valid \
             answer; try again, or with more --retries"
        ),
        Doubt::LooksLikeInteger => format!(
            "node {node}: {signal}: no value: the REAL32 is almost 0, so the object is probably an integer; name the \
             device: --device dps (or --eds FILE)"
        ),
        Doubt::EndOfType => format!(
            "node {node}: {signal}: the value is the limit of its integer type and may be clipped; read 0x6130 or \
             0x9130 instead"
        ),
        Doubt::UnknownStatus => {
            format!("node {node}: {signal}: the status is unknown: no valid answer to the read of its object")
        }
    }
}

/// The message for an object without a known type.
pub fn unknown_type(signal: &str) -> String {
    match signal.split_once('/') {
        Some((object, stated)) => format!("the stated type {stated} does not fit the width of {object}: no value"),
        None => format!("the type of {signal} is unknown, or has another width: no value"),
    }
}

/// Returns a hint that shows how to state the type of an object.
pub fn type_remedy(node: NodeId, signal: &str) -> String {
    let object = signal.split_once('/').map_or(signal, |(object, _)| object);
    if object.starts_with("0x") {
        format!("state it: {object}/i16 (or u8, i32, r32 ...), --eds {node}=FILE or --device {node}=NAME")
    } else {
        format!("state it: --eds {node}=FILE or --device {node}=NAME")
    }
}

/// Returns the reason why the values of a signal may be clipped, and the remedy.
pub fn may_clip(value: &NarrowValue) -> String {
    let unit = value.unit.map(|unit| format!(" {unit}")).unwrap_or_default();
    let range = value.range_end.map_or_else(
        || "the measuring range may be larger".to_owned(),
        |end| format!("the measuring range extends to {end}{unit}"),
    );
    let (NarrowValue { signal, object, largest, .. }, channel) = (value, value.object.sub);
    format!(
        "{signal}: the largest value of {object} is {largest}{unit}, and {range}: values may be clipped; use \
         0x6130:{channel} or 0x9130:{channel}"
    )
}
