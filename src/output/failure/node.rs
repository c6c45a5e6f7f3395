//! Messages and hints if a read or a write of a node failed.

use super::{CauseText, below};
use crate::canopen::value::Value;
use crate::node::Error;
use crate::output::text;
use crate::tasks::Failure;

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &Error) -> CauseText {
    match cause {
        // These errors have their own causes, see `From<node::Error> for Failure`.
        Error::Bus(error) => below::bus(error),
        Error::Interrupted => CauseText::new("interrupted"),
        Error::Sdo(error) | Error::Unknown(error) => below::sdo(error),
        Error::ReadBackDiffers { object, written, found, .. } => {
            let (found, written) = (shown(found), shown(written));
            CauseText::new(format!(
                "the write of {object} was acknowledged, but its value is {found} instead of {written}"
            ))
        }
        Error::Width { object, width, given, .. } => CauseText::new(format!(
            "write {object}: the object has {width} bytes, the value {given}, and the device accepts no size"
        )),
        Error::Value { object, error, .. } => CauseText::new(format!("write {object}: {error}")),
        Error::TypeUnknown { node, object } => CauseText::new(format!("write {object}: its type is unknown"))
            .hint(format!("add the type: cangauge sdo write {node} {object} VALUE --type u32 (or i16, r32, vs)")),
        Error::Name(error) => {
            let source = error.title.as_deref().unwrap_or("the standard");
            no_such_object(source, &error.name, &error.nearest, error.is_shared)
        }
        Error::Restarted(_) => CauseText::new("the device restarted"),
        Error::NoBootUp(_) => {
            CauseText::new("no boot-up message after the reset").hint(below::check_node(failure.node))
        }
    }
}

/// Returns the message for a name that no object has, or that several objects share. `alike`: similar or full names.
fn no_such_object(source: &str, name: &str, alike: &[String], is_shared: bool) -> CauseText {
    let names = alike.iter().take(MAX_NAMES).map(String::as_str).collect::<Vec<_>>().join(", ");
    let more = if alike.len() > MAX_NAMES { ", ..." } else { "" };
    match (alike.is_empty(), is_shared) {
        (true, _) => CauseText::new(format!("{source} has no object \"{name}\"")),
        (_, false) => {
            CauseText::new(format!("{source} has no object \"{name}\"")).hint(format!("similar names: {names}"))
        }
        (_, true) => {
            CauseText::new(format!("several objects have the name \"{name}\"")).hint(format!("name one: {names}{more}"))
        }
    }
}

/// The largest number of names in a hint.
const MAX_NAMES: usize = 5;

/// Formats a value. Bytes are in wire order.
pub(super) fn shown(value: &Value) -> String {
    match value {
        Value::Bytes(bytes) => text::spaced_bytes(bytes),
        value => value.to_string(),
    }
}
