//! Messages and hints if a CAN interface of this computer cannot be set.

use super::CauseText;
use crate::tasks::host::{HostAction, HostFailure};

/// The commands that bring an interface up by hand, at a bit rate in bit/s if one is given.
pub fn up_by_hand(interface: &str, bit_rate: Option<u32>) -> String {
    match bit_rate {
        None => format!("sudo ip link set {interface} up"),
        Some(bit_rate) => format!(
            "sudo ip link set {interface} down; sudo ip link set {interface} type can bitrate {bit_rate}; \
             sudo ip link set {interface} up"
        ),
    }
}

/// The message and the hint for a cause.
pub(super) fn words(cause: &HostFailure) -> CauseText {
    match cause {
        HostFailure::NotPermitted { what, action } => {
            CauseText::new(format!("no permission to {what}")).hint(format!("by hand: {}", by_hand(action)))
        }
        HostFailure::Unsupported { reason, action } => match action {
            HostAction::Up { interface, bit_rate: Some(_), listen_only: false } => CauseText::new(reason.clone())
                .hint(format!("bring it up without a bit rate: cangauge bus up {interface}")),
            HostAction::Up { .. } | HostAction::Down { .. } | HostAction::Detect { .. } => {
                CauseText::new(reason.clone())
            }
        },
        HostFailure::NoBitRate { interface } => CauseText::new(format!("{interface} has no bit rate yet"))
            .hint(format!("set one: cangauge bus up {interface} 250k")),
    }
}

fn by_hand(action: &HostAction) -> String {
    match action {
        HostAction::Up { interface, bit_rate, .. } => up_by_hand(interface, *bit_rate),
        HostAction::Down { interface } => format!("sudo ip link set {interface} down"),
        HostAction::Detect { interface } => format!("sudo cangauge bus detect {interface}"),
    }
}
