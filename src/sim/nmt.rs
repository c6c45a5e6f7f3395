//! The NMT slave of a simulated device, written from the tables of CiA 301, without the code of the master.

use crate::canopen::frame::Frame;
use crate::canopen::id::{CanId, NodeId};

/// The state of a device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// NMT, heartbeat and guarding only.
    Stopped,
    /// All services.
    Operational,
    /// All services except PDOs.
    PreOperational,
}

impl State {
    /// The state as coded in a heartbeat (CiA 301, 7.2.8.3.2.2).
    pub(super) fn code(self) -> u8 {
        match self {
            State::Stopped => 0x04,
            State::Operational => 0x05,
            State::PreOperational => 0x7f,
        }
    }
}

/// An NMT command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Command {
    Enter(State),
    ResetNode,
    ResetCommunication,
}

impl Command {
    /// Returns the command in `frame`, if it is an NMT command for this node (CiA 301, 7.2.8.3.1).
    pub(super) fn for_node(node: NodeId, frame: &Frame) -> Option<Command> {
        let (id, &[specifier, target]) = (frame.id(), frame.data()) else { return None };
        if id != CanId::NMT || target != 0 && target != node.get() {
            return None;
        }
        match specifier {
            0x01 => Some(Command::Enter(State::Operational)),
            0x02 => Some(Command::Enter(State::Stopped)),
            0x80 => Some(Command::Enter(State::PreOperational)),
            0x81 => Some(Command::ResetNode),
            0x82 => Some(Command::ResetCommunication),
            _ => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn commands_for_one_node_and_for_all() {
        let command = |frame: &str| {
            let node = NodeId::new(5).expect("a node-ID");
            Command::for_node(node, &frame.parse().expect("a frame"))
        };
        assert_eq!(command("000#0105"), Some(Command::Enter(State::Operational)));
        assert_eq!(command("000#0200"), Some(Command::Enter(State::Stopped)));
        assert_eq!(command("000#8005"), Some(Command::Enter(State::PreOperational)));
        assert_eq!(command("000#8105"), Some(Command::ResetNode));
        assert_eq!(command("000#8200"), Some(Command::ResetCommunication));
        for other in ["000#0106", "000#", "000#01", "000#010500", "000#0305", "000#R2", "001#0105", "00000000#0105"] {
            assert_eq!(command(other), None, "{other}");
        }
    }
}
