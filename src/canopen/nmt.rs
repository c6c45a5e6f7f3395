//! Network management: commands, states, heartbeat and boot-up (CiA 301, 7.2.8).

use super::frame::Frame;
use super::id::{CanId, NodeId};
use std::fmt;

/// An NMT command (CiA 301, 7.2.8.3.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmtCommand {
    /// 01h, to OPERATIONAL.
    Start,
    /// 02h, to STOPPED.
    Stop,
    /// 80h, to PRE-OPERATIONAL.
    EnterPreOperational,
    /// 81h, restart of the application.
    ResetNode,
    /// 82h, restart of the communication.
    ResetCommunication,
}

impl NmtCommand {
    /// Every command.
    pub const ALL: [NmtCommand; 5] = [
        NmtCommand::Start,
        NmtCommand::Stop,
        NmtCommand::EnterPreOperational,
        NmtCommand::ResetNode,
        NmtCommand::ResetCommunication,
    ];

    /// The command specifier on the wire.
    pub fn specifier(self) -> u8 {
        match self {
            NmtCommand::Start => 0x01,
            NmtCommand::Stop => 0x02,
            NmtCommand::EnterPreOperational => 0x80,
            NmtCommand::ResetNode => 0x81,
            NmtCommand::ResetCommunication => 0x82,
        }
    }

    /// The frame for one node, or with `None` for every node.
    pub fn frame(self, node: Option<NodeId>) -> Frame {
        Frame::pair(CanId::NMT, self.specifier(), node.map_or(0, NodeId::get))
    }

    /// The state a node is in when it has carried the command out; a reset ends in
    /// PRE-OPERATIONAL unless the device starts by itself.
    pub fn target(self) -> NmtState {
        match self {
            NmtCommand::Start => NmtState::Operational,
            NmtCommand::Stop => NmtState::Stopped,
            NmtCommand::EnterPreOperational | NmtCommand::ResetNode | NmtCommand::ResetCommunication => {
                NmtState::PreOperational
            }
        }
    }

    /// Whether the command restarts the node, so that a boot-up message follows.
    pub fn is_reset(self) -> bool {
        matches!(self, NmtCommand::ResetNode | NmtCommand::ResetCommunication)
    }

    /// Reads an NMT frame: the command and its node, `None` for every node.
    pub fn parse(frame: &Frame) -> Option<(NmtCommand, Option<NodeId>)> {
        let [specifier, node] = *frame.data() else { return None };
        if frame.id() != CanId::NMT {
            return None;
        }
        let command = NmtCommand::ALL.into_iter().find(|command| command.specifier() == specifier)?;
        match node {
            0 => Some((command, None)),
            node => NodeId::new(node).ok().map(|node| (command, Some(node))),
        }
    }
}

/// The NMT state of a node as a heartbeat or a guarding answer tells it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtState {
    /// 04h. Only NMT, heartbeat, guarding and LSS.
    Stopped,
    /// 05h. Everything.
    Operational,
    /// 7Fh. Everything but PDOs.
    PreOperational,
    /// A code that CiA 301 does not define.
    Other(u8),
}

impl NmtState {
    /// The state of a code, bit 7 (toggle of node guarding) left out of account.
    pub fn from_code(code: u8) -> NmtState {
        match code & 0x7f {
            0x04 => NmtState::Stopped,
            0x05 => NmtState::Operational,
            0x7f => NmtState::PreOperational,
            other => NmtState::Other(other),
        }
    }
}

impl fmt::Display for NmtState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            NmtState::Stopped => f.pad("stopped"),
            NmtState::Operational => f.pad("operational"),
            NmtState::PreOperational => f.pad("pre-operational"),
            NmtState::Other(code) => f.pad(&format!("0x{code:02X}")),
        }
    }
}

/// What a frame on 700h + node-ID says.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Life {
    /// The node has (re)started: one byte 00h.
    BootUp,
    /// A heartbeat, or the answer to node guarding.
    State(NmtState),
}

impl Life {
    /// Reads a heartbeat, boot-up or guarding answer. A frame that is none of them is `None`: remote
    /// frames (guarding requests), and lengths other than 1.
    pub fn parse(frame: &Frame) -> Option<(NodeId, Life)> {
        let node = frame.id().heartbeat_node()?;
        match frame.data() {
            [0x00] => Some((node, Life::BootUp)),
            [code] => Some((node, Life::State(NmtState::from_code(*code)))),
            _ => None,
        }
    }
}

/// The node that says with this frame that it has (re)started.
pub fn booted(frame: &Frame) -> Option<NodeId> {
    Life::parse(frame).filter(|(_, life)| *life == Life::BootUp).map(|(node, _)| node)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    #[test]
    fn commands_of_the_dps_manual_tables_9_to_14() {
        let node = NodeId::MAX;
        for (command, text) in [
            (NmtCommand::Start, "000#017F"),
            (NmtCommand::Stop, "000#027F"),
            (NmtCommand::EnterPreOperational, "000#807F"),
            (NmtCommand::ResetNode, "000#817F"),
            (NmtCommand::ResetCommunication, "000#827F"),
        ] {
            assert_eq!(command.frame(Some(node)), frame(text));
            assert_eq!(NmtCommand::parse(&frame(text)), Some((command, Some(node))));
        }
        assert_eq!(NmtCommand::Start.frame(None), frame("000#0100"));
        for other in ["000#0380", "000#01", "000#017F00", "000#01FF", "001#017F", "000#R2"] {
            assert_eq!(NmtCommand::parse(&frame(other)), None, "{other}");
        }
    }

    #[test]
    fn heartbeat_boot_up_and_what_is_neither() {
        let node = NodeId::MAX;
        assert_eq!(Life::parse(&frame("77F#00")), Some((node, Life::BootUp)));
        for (text, state) in [
            ("77F#04", NmtState::Stopped),
            ("77F#05", NmtState::Operational),
            ("77F#7F", NmtState::PreOperational),
            ("77F#FF", NmtState::PreOperational),
            ("77F#85", NmtState::Operational),
            ("77F#01", NmtState::Other(1)),
        ] {
            assert_eq!(Life::parse(&frame(text)), Some((node, Life::State(state))), "{text}");
        }
        for text in ["77F#", "77F#R1", "77F#0000", "700#00", "7FF#7F", "0000077F#00"] {
            assert_eq!(Life::parse(&frame(text)), None, "{text}");
        }
    }
}
