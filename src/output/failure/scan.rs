//! Messages and hints if a scan did not find nodes.

use super::CauseText;
use crate::tasks::Failure;
use crate::tasks::scan::ScanFailure;

/// The message and the hint for a cause.
pub(super) fn words(_failure: &Failure, cause: &ScanFailure) -> CauseText {
    match cause {
        ScanFailure::NoAnswer => CauseText::new("no node answered").hint(
            "check the power, the bit rate, the wiring and the 120 ohm terminators; stopped nodes do not answer: \
             cangauge nmt preop all; without hardware: --bus sim",
        ),
        ScanFailure::NoFrame => CauseText::new("no node sent anything")
            .hint("a node without heartbeat and TPDOs sends nothing; ask the nodes: cangauge doctor"),
    }
}
