//! Messages and hints if measured values could not be read.

use super::CauseText;
use crate::measure::sample::Status;
use crate::output::doubt::{type_remedy, unknown_type};
use crate::output::text::spaced_bytes;
use crate::tasks::Failure;
use crate::tasks::read::ReadFailure;

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &ReadFailure) -> CauseText {
    match cause {
        ReadFailure::NoMeasuredValue => {
            let cause_text = CauseText::new("no measured value of CiA 404");
            match failure.node {
                Some(node) => cause_text.hint(format!("read an object: cangauge sdo read {node} 0x1000")),
                None => cause_text,
            }
        }
        ReadFailure::NoSignal { name, available } if available.is_empty() => {
            CauseText::new(format!("no signal \"{name}\""))
        }
        ReadFailure::NoSignal { name, available } => {
            CauseText::new(format!("no signal \"{name}\" (it has: {})", available.join(", ")))
        }
        ReadFailure::NoStatus { signal } => CauseText::new(format!("{signal} has no status object")),
        ReadFailure::NotConvertible { signal, from: None, .. } => {
            CauseText::new(format!("{signal} has no unit: it cannot be converted"))
        }
        ReadFailure::NotConvertible { signal, from: Some(from), to } => {
            CauseText::new(format!("{signal} is in {from}, which does not convert to {to}"))
        }
        ReadFailure::NotNumber { signal } => {
            let cause_text = CauseText::new(format!("{signal} is text or bytes, not a number"));
            match failure.node {
                Some(node) => cause_text.hint(format!("cangauge sdo read {node} {signal}")),
                None => cause_text,
            }
        }
        ReadFailure::TypeUnknown { signal, raw } => {
            let cause_text =
                CauseText::new(format!("{} (received {})", unknown_type(signal), spaced_bytes(raw.bytes())));
            match failure.node {
                Some(node) => cause_text.hint(type_remedy(node, signal)),
                None => cause_text,
            }
        }
        ReadFailure::Invalid { signal, status } => {
            CauseText::new(format!("{signal} has no valid value: {}", status.map_or("invalid", Status::as_str)))
        }
    }
}
