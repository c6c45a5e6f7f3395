//! Claims: only one cangauge process at a time uses a node.
//!
//! Two programs that send SDO requests to one node at the same time disturb each other. So each command claims its
//! nodes. The next command waits for the nodes, or fails with an error that shows the holder.
//!
//! A claim is a name in the abstract namespace of Unix sockets, `@cangauge/can0/5`. The name belongs to the network
//! namespace of the interface and needs no directory. It is released when the process ends. Other programs are not
//! affected. Claims exist only on Linux.

#[cfg(all(target_os = "linux", not(without_socketcan)))]
mod holder;
#[cfg(all(target_os = "linux", not(without_socketcan)))]
mod linux;
#[cfg(all(test, target_os = "linux", not(without_socketcan)))]
mod tests;

use crate::canopen::id::NodeId;
use std::fmt;
use std::time::Duration;

#[cfg(all(target_os = "linux", not(without_socketcan)))]
pub use linux::Claims;

/// The part of the bus that no other process may use while a command runs.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Claim {
    /// No claim: the command only listens, or its bus belongs to this process.
    #[default]
    Nothing,
    /// The SDO servers and NMT states of these nodes. More than 16 nodes are claimed as all nodes.
    Nodes(Vec<NodeId>),
    /// The whole bus, because LSS reaches every node.
    Bus,
}

impl Claim {
    /// All nodes.
    pub fn every_node() -> Claim {
        Claim::Nodes(NodeId::all().collect())
    }
}

/// A part of the bus that a process can hold. Each part has its own socket name.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Part {
    /// The LSS services.
    Lss,
    /// All nodes.
    EveryNode,
    /// One node.
    Node(NodeId),
}

impl fmt::Display for Part {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Part::Lss => f.write_str("the bus"),
            Part::EveryNode => f.write_str("every node"),
            Part::Node(node) => write!(f, "node {node}"),
        }
    }
}

/// The reaction if another process holds a part of the claim.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum IfHeld {
    /// Wait for the holder, up to this time for the whole claim.
    Wait(Duration),
    /// Report the holder and continue.
    Continue,
}

/// The process that holds a claim. Unknown parts are `None`. The displayed text is safe for a terminal.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Holder {
    /// The process ID.
    pub process: Option<u32>,
    /// The user name, or the user ID if it has no name.
    pub user: Option<String>,
    /// The name of the program.
    pub program: Option<String>,
}

/// `cangauge (process 1234, user root)`.
impl fmt::Display for Holder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.program.as_deref().unwrap_or("another program"))?;
        match (self.process, &self.user) {
            (Some(process), Some(user)) => write!(f, " (process {process}, user {user})"),
            (Some(process), None) => write!(f, " (process {process})"),
            (None, Some(user)) => write!(f, " (user {user})"),
            (None, None) => Ok(()),
        }
    }
}

/// Why a claim failed.
#[derive(Debug, thiserror::Error)]
pub enum ClaimError {
    /// Another process holds a part of the claim, and did not release it in time.
    #[error("{0} is in use by {1}")]
    InUse(Part, Holder),
    /// The user asked to stop (Ctrl-C, SIGTERM).
    #[error("interrupted")]
    Interrupted,
    /// The operating system cannot create the socket, for example because too many files are open.
    #[error("claim {0}: {1}")]
    System(Part, std::io::Error),
}

/// Claims on systems other than Linux: always granted.
#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
#[derive(Debug, Default)]
pub struct Claims;

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
impl Claims {
    /// Claims nothing.
    ///
    /// # Errors
    /// None.
    pub fn take(_: &str, _: &Claim, _: IfHeld, _: &mut dyn FnMut(&ClaimError)) -> Result<Claims, ClaimError> {
        Ok(Claims)
    }
}
