//! Which frames a command may send, and to which node.

use super::*;
use cangauge::canopen::frame::Frame;

/// Whether a command may send this LSS request.
fn may_configure(command: &Command, request: &[u8]) -> bool {
    match request.first() {
        Some(0x11 | 0x13) => matches!(command, Command::Assign { .. }),
        Some(0x15) => matches!(command, Command::Assign { .. } | Command::LssActivate { .. }),
        Some(0x17) => matches!(command, Command::Assign { .. } | Command::LssStore { .. }),
        Some(_) => true,
        None => false,
    }
}

/// Whether a command may write objects.
fn writes(command: &Command) -> bool {
    !matches!(
        command,
        Command::Scan { .. }
            | Command::Read { .. }
            | Command::Info { .. }
            | Command::PdoShow { .. }
            | Command::SdoRead { .. }
            | Command::Nmt { .. }
            | Command::NmtState { .. }
            | Command::NmtWatch { .. }
            | Command::PdoWatch { .. }
            | Command::Check { .. }
            | Command::Detect { .. }
            | Command::LssScan
            | Command::LssInquire { .. }
            | Command::LssStore { .. }
            | Command::LssActivate { .. }
            | Command::LssIdentify { .. }
            | Command::Errors { clear: false, .. }
            | Command::Log { .. }
            | Command::Autozero { dry_run: true, .. }
    )
}

/// No frame may change a device that the command does not address.
pub(super) fn frames(spec: &Spec, sent: impl Iterator<Item = (Mono, Frame)>, violations: &mut Vec<Violation>) {
    let named = named(spec);
    let lss = spec.command.is_lss();
    let resets = |command: &Command| match command {
        Command::Store { verify, .. } => *verify,
        Command::Restore { reset, .. } => *reset,
        Command::Log { nmt, sync_ms: _, poll_ms, .. } => *nmt && poll_ms.is_none(),
        Command::Check { how, .. } => matches!(how, Measuring::AsSent { .. } | Measuring::Sync { .. }),
        Command::Assign { .. }
        | Command::Map { .. }
        | Command::Configure { .. }
        | Command::LssInquire { .. }
        | Command::LssActivate { .. }
        | Command::LssStore { .. } => true,
        _ => false,
    };
    let syncs = matches!(
        spec.command,
        Command::Log { sync_ms: Some(_), .. } | Command::Check { how: Measuring::Sync { .. }, .. }
    );
    for (at, frame) in sent {
        let allowed = match frame.id() {
            // A SYNC with the COB-ID that the device reported.
            id if id != CanId::Standard(0)
                && syncs
                && spec.falsifies_data()
                && frame.data().is_empty()
                && !frame.is_remote() =>
            {
                true
            }
            CanId::Standard(0) => match (&spec.command, frame.data()) {
                (Command::Nmt { what, nodes, all }, &[specifier, node]) => {
                    specifier == what.specifier() && if *all { node == 0 } else { nodes.contains(&node) }
                }
                (command, &[_, node]) => resets(command) && named.contains(&node),
                _ => false,
            },
            CanId::Standard(0x080) => syncs && !frame.is_remote(),
            CanId::Standard(0x7e5) => lss && !frame.is_remote() && may_configure(&spec.command, frame.data()),
            id if frame.is_remote() => {
                let guards = matches!(
                    spec.command,
                    Command::Nmt { .. }
                        | Command::NmtState { .. }
                        | Command::NmtProbe { .. }
                        | Command::Map { .. }
                        | Command::Configure { .. }
                        | Command::Store { .. }
                        | Command::Restore { .. }
                        // The state of a silent node.
                        | Command::PdoWatch { .. }
                        | Command::Log { .. }
                        | Command::Check { .. }
                );
                (guards || lss) && id.heartbeat_node().is_some_and(|node| named.contains(&node.get()))
            }
            id => match (id.sdo_request_node().map(NodeId::get), frame.as_eight_bytes()) {
                (Some(node), Some(data)) => {
                    let reads = matches!(data[0] >> 5, 2..=5);
                    let meant = named.contains(&node);
                    // A segment of a block download begins with its number; only short blocks are written here.
                    // Whether a COB-ID is free is checked by reading from all nodes.
                    let asks = lss
                        || matches!(
                            spec.command,
                            Command::Map { cob_id: Some(_), .. } | Command::Detect { ask: true, .. }
                        );
                    if reads { meant || asks } else { meant && writes(&spec.command) }
                }
                _ => false,
            },
        };
        if !allowed {
            violations.push(("addresses no other device", format!("{:?}: {frame}", at.since_start())));
            return;
        }
    }
}
