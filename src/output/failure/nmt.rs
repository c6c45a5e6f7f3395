//! Messages and hints if an NMT state was not reached or not confirmed.

use super::{CauseText, below};
use crate::tasks::Failure;
use crate::tasks::nmt::NmtFailure;

/// The message and the hint for a cause.
pub(super) fn words(failure: &Failure, cause: &NmtFailure) -> CauseText {
    let node = failure.node.map_or_else(|| "NODE".to_owned(), |node| node.to_string());
    match cause {
        NmtFailure::OtherState { state, wanted } => CauseText::new(format!("the node is {state}, not {wanted}")),
        NmtFailure::NoSign => CauseText::new("command sent, but no heartbeat, boot-up or SDO answer was received")
            .hint(below::check_node(failure.node)),
        NmtFailure::NoBootUp => {
            CauseText::new("command sent, but no boot-up message was received").hint(below::check_node(failure.node))
        }
        NmtFailure::NotConfirmed => {
            CauseText::new("command sent, not confirmed: the node sends no heartbeat (1017h is 0)")
                .hint(format!("set a heartbeat: cangauge sdo write {node} producer-heartbeat-time 1000"))
        }
        NmtFailure::Absent => CauseText::new("no heartbeat and no SDO answer")
            .hint(failure.node.map_or_else(|| below::check_node(None), below::check_silent_node)),
        NmtFailure::NotRecorded(error) => {
            CauseText::new(format!("{}; nothing was changed", below::not_recorded(error)))
                .hint("choose a writable folder: XDG_STATE_HOME=/tmp/state cangauge …")
        }
        NmtFailure::NoStartupObject => CauseText::new("the object that decides how this device starts is unknown")
            .hint(format!("many devices have 1F80h; read it: cangauge sdo read {node} 0x1F80")),
    }
}
