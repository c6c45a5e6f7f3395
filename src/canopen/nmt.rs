//! Network management (NMT): commands, states, heartbeat and boot-up (CiA 301, 7.2.8).

use super::frame::Frame;
use super::id::{CanId, NodeId};
use std::fmt;

/// An NMT command (CiA 301, 7.2.8.3.1).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum NmtCommand {
    /// 01h: change to OPERATIONAL.
    Start,
    /// 02h: change to STOPPED.
    Stop,
    /// 80h: change to PRE-OPERATIONAL.
    EnterPreOperational,
    /// 81h: restart the node.
    ResetNode,
    /// 82h: restart the communication.
    ResetCommunication,
}

impl NmtCommand {
    /// All commands.
    pub const ALL: [NmtCommand; 5] = [
        NmtCommand::Start,
        NmtCommand::Stop,
        NmtCommand::EnterPreOperational,
        NmtCommand::ResetNode,
        NmtCommand::ResetCommunication,
    ];

    /// The command specifier: the first byte of the frame.
    pub fn specifier(self) -> u8 {
        match self {
            NmtCommand::Start => 0x01,
            NmtCommand::Stop => 0x02,
            NmtCommand::EnterPreOperational => 0x80,
            NmtCommand::ResetNode => 0x81,
            NmtCommand::ResetCommunication => 0x82,
        }
    }

    /// The frame that sends the command to `node`, or to all nodes (`None`).
    pub fn frame(self, node: Option<NodeId>) -> Frame {
        Frame::pair(CanId::NMT, self.specifier(), node.map_or(0, NodeId::get))
    }

    /// The state of a node after the command. A reset ends in PRE-OPERATIONAL, unless the device starts itself.
    pub fn target(self) -> NmtState {
        match self {
            NmtCommand::Start => NmtState::Operational,
            NmtCommand::Stop => NmtState::Stopped,
            NmtCommand::EnterPreOperational | NmtCommand::ResetNode | NmtCommand::ResetCommunication => {
                NmtState::PreOperational
            }
        }
    }

    /// Whether the node sends a boot-up message after the command.
    pub fn is_reset(self) -> bool {
        matches!(self, NmtCommand::ResetNode | NmtCommand::ResetCommunication)
    }

    /// Parses an NMT frame: the command and its node. `None` means all nodes.
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

/// The NMT state of a node, from a heartbeat or a node guarding answer (CiA 301, 7.2.8.3.2).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum NmtState {
    /// 04h: only NMT, heartbeat, node guarding and LSS.
    Stopped,
    /// 05h: all services.
    Operational,
    /// 7Fh: all services except PDOs.
    PreOperational,
    /// A code that CiA 301 does not define.
    Other(u8),
}

impl NmtState {
    /// The state with this code. Bit 7, the toggle bit of node guarding, is ignored.
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

/// The content of a frame with COB-ID 700h + node-ID.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ErrorControlMessage {
    /// The boot-up message: one byte 00h. The node was started or reset.
    BootUp,
    /// A heartbeat or a node guarding answer.
    State(NmtState),
}

impl ErrorControlMessage {
    /// Parses a heartbeat, boot-up message or node guarding answer. `None` for any other frame, including remote
    /// frames (guarding requests).
    ///
    /// Some devices send more than one byte; only the first is used. A frame of 0 bytes on 700h + node-ID is ignored.
    /// It is usually a guarding request whose RTR bit was lost. A frame of 0 bytes on 080h + node-ID is the boot-up
    /// message of devices older than CiA 301 version 4.
    pub fn parse(frame: &Frame) -> Option<(NodeId, ErrorControlMessage)> {
        if let (Some(node), []) = (frame.id().emergency_node(), frame.data()) {
            return (!frame.is_remote()).then_some((node, ErrorControlMessage::BootUp));
        }
        let node = frame.id().heartbeat_node()?;
        match frame.data() {
            [0x00, ..] => Some((node, ErrorControlMessage::BootUp)),
            [code, ..] => Some((node, ErrorControlMessage::State(NmtState::from_code(*code)))),
            [] => None,
        }
    }

    /// Returns the node and the length of a frame on 700h + node-ID; `None` if it has one byte, as CiA 301 requires.
    pub fn unusual_length(frame: &Frame) -> Option<(NodeId, usize)> {
        let node = frame.id().heartbeat_node().filter(|_| !frame.is_remote())?;
        let length = frame.data().len();
        (length != 1).then_some((node, length))
    }
}

/// Returns the node that sent this boot-up message; `None` for other frames.
pub fn booted(frame: &Frame) -> Option<NodeId> {
    ErrorControlMessage::parse(frame).filter(|(_, life)| *life == ErrorControlMessage::BootUp).map(|(node, _)| node)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn frame(text: &str) -> Frame {
        text.parse().expect("a frame")
    }

    #[test]
    fn commands_match_tables_9_to_14_of_the_dps_manual() {
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
    fn first_byte_of_a_heartbeat_is_the_state() {
        let node = NodeId::MAX;
        assert_eq!(ErrorControlMessage::parse(&frame("77F#00")), Some((node, ErrorControlMessage::BootUp)));
        for (text, state) in [
            ("77F#04", NmtState::Stopped),
            ("77F#05", NmtState::Operational),
            ("77F#7F", NmtState::PreOperational),
            ("77F#FF", NmtState::PreOperational),
            ("77F#85", NmtState::Operational),
            ("77F#01", NmtState::Other(1)),
            ("77F#0500000000000000", NmtState::Operational),
            ("77F#7F01", NmtState::PreOperational),
        ] {
            assert_eq!(
                ErrorControlMessage::parse(&frame(text)),
                Some((node, ErrorControlMessage::State(state))),
                "{text}"
            );
        }
        for text in ["77F#", "77F#R1", "080#", "0FF#R0", "0FF#00", "700#00", "7FF#7F", "0000077F#00"] {
            assert_eq!(ErrorControlMessage::parse(&frame(text)), None, "{text}");
        }
        assert_eq!(ErrorControlMessage::parse(&frame("77F#0000")), Some((node, ErrorControlMessage::BootUp)));
        assert_eq!(
            ErrorControlMessage::parse(&frame("0FF#")),
            Some((node, ErrorControlMessage::BootUp)),
            "before CiA 301 version 4"
        );
        let unusual = |text| ErrorControlMessage::unusual_length(&frame(text)).map(|(_, length)| length);
        assert_eq!(
            (unusual("77F#"), unusual("77F#05"), unusual("77F#0500"), unusual("77F#R1")),
            (Some(0), None, Some(2), None)
        );
    }
}
