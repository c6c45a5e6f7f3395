//! Claims as Unix sockets in the abstract namespace.
//!
//! Two rules keep processes apart. A process that claims single nodes binds their names and then checks that the name
//! for every node is free. A process that claims every node binds this name and then checks each node. If two processes
//! claim at the same time, at least one detects the other. The process with single nodes then releases them and waits.

use super::holder::identify;
use super::{Claim, ClaimError, IfHeld, Part};
use crate::bus::interrupt::Interrupts;
use crate::bus::socketcan;
use crate::canopen::id::NodeId;
use std::io::{self, ErrorKind};
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener};
use std::time::{Duration, Instant};

/// Shorter waits are not reported, because most commands end sooner.
const SHORT_WAIT: Duration = Duration::from_millis(500);
/// The interval between two attempts to get a name.
const RETRY_INTERVAL: Duration = Duration::from_millis(20);
/// More nodes than this are claimed as every node. Each name needs a file descriptor.
const MAX_SINGLE_NODES: usize = 16;

/// The claims of this process. They are released when the value is dropped or the process ends.
#[derive(Debug, Default)]
pub struct Claims {
    /// No connection is accepted. A process that asks for the holder of a name connects, and the connection stays in the
    /// queue of the socket. If the queue is full (`net.core.somaxconn`, usually 4096), that process searches `/proc`.
    #[cfg_attr(not(test), expect(dead_code, reason = "a name is held while its socket is open"))]
    listeners: Vec<UnixListener>,
}

impl Claims {
    /// Claims the parts of `claim` on the interface `name`. All names of an interface (altname) share its claims.
    /// `report` is called once if the wait is longer than half a second, and for each holder that is ignored.
    ///
    /// # Errors
    /// [`ClaimError::InUse`] after the waiting time; an interrupt; a failure of the system. If the system does not
    /// support or allow such sockets, nothing is claimed; this is not an error.
    pub fn take(
        name: &str,
        claim: &Claim,
        if_held: IfHeld,
        report: &mut dyn FnMut(&ClaimError),
    ) -> Result<Claims, ClaimError> {
        let parts = parts(claim);
        if parts.is_empty() {
            return Ok(Claims::default());
        }
        let key = socketcan::primary_name(name).unwrap_or_else(|| name.to_owned());
        let started = Instant::now();
        let mut attempt =
            Attempt { key, if_held, started, interrupts: None, is_reported: false, report, held: Vec::new() };
        while !attempt.take_all(&parts)? {}
        Ok(Claims { listeners: attempt.held })
    }

    /// The number of names held.
    #[cfg(test)]
    pub(super) fn names(&self) -> usize {
        self.listeners.len()
    }
}

/// The names of a claim. All processes bind them in this order, which prevents a deadlock.
fn parts(claim: &Claim) -> Vec<Part> {
    match claim {
        Claim::Nothing => Vec::new(),
        Claim::Nodes(nodes) => {
            let mut nodes: Vec<Part> = nodes.iter().copied().map(Part::Node).collect();
            nodes.sort_unstable();
            nodes.dedup();
            if nodes.len() > MAX_SINGLE_NODES { vec![Part::EveryNode] } else { nodes }
        }
        Claim::Bus => vec![Part::Lss, Part::EveryNode],
    }
}

/// A claim in progress.
struct Attempt<'a> {
    /// The interface.
    key: String,
    if_held: IfHeld,
    started: Instant,
    /// Set at the first wait. Until then, Ctrl-C ends the program directly.
    interrupts: Option<Interrupts>,
    is_reported: bool,
    report: &'a mut dyn FnMut(&ClaimError),
    held: Vec<UnixListener>,
}

impl Attempt<'_> {
    /// Claims all parts, and waits for parts in use. Returns `false` if all parts were released: then try again.
    fn take_all(&mut self, parts: &[Part]) -> Result<bool, ClaimError> {
        for &part in parts {
            loop {
                match self.bind(part)? {
                    Bound::Acquired(listener) => {
                        self.held.push(listener);
                        break;
                    }
                    Bound::InUse => {
                        if !self.wait_for(part)? {
                            break;
                        }
                    }
                    Bound::Unavailable => return Ok(true),
                }
            }
        }
        if parts.contains(&Part::EveryNode) {
            for node in NodeId::all().map(Part::Node) {
                while self.is_held(node)? && self.wait_for(node)? {}
            }
        } else if self.is_held(Part::EveryNode)? {
            // The holder may be waiting for one of these nodes.
            let held = std::mem::take(&mut self.held);
            if self.if_held == IfHeld::Continue {
                self.held = held;
            } else {
                drop(held);
            }
            return Ok(!self.wait_for(Part::EveryNode)?);
        }
        Ok(true)
    }

    fn address(&self, part: Part) -> io::Result<SocketAddr> {
        let part = match part {
            Part::Lss => "lss".to_owned(),
            Part::EveryNode => "all".to_owned(),
            Part::Node(node) => node.to_string(),
        };
        SocketAddr::from_abstract_name(format!("cangauge/{}/{part}", self.key))
    }

    fn bind(&self, part: Part) -> Result<Bound, ClaimError> {
        let Ok(address) = self.address(part) else { return Ok(Bound::Unavailable) };
        match UnixListener::bind_addr(&address) {
            Ok(listener) => Ok(Bound::Acquired(listener)),
            Err(error) if error.kind() == ErrorKind::AddrInUse => Ok(Bound::InUse),
            Err(error) if matches!(error.kind(), ErrorKind::PermissionDenied | ErrorKind::Unsupported) => {
                Ok(Bound::Unavailable)
            }
            Err(error) if error.raw_os_error() == Some(libc::EAFNOSUPPORT) => Ok(Bound::Unavailable),
            Err(error) => Err(ClaimError::System(part, error)),
        }
    }

    /// Whether another process holds a part that this process does not claim.
    fn is_held(&self, part: Part) -> Result<bool, ClaimError> {
        Ok(matches!(self.bind(part)?, Bound::InUse))
    }

    /// The error that shows the holder of a part.
    fn in_use(&self, part: Part) -> ClaimError {
        let holder = self.address(part).map(|address| identify(&address)).unwrap_or_default();
        ClaimError::InUse(part, holder)
    }

    /// Waits a short time for the holder of a part. Returns `false` if the command continues in spite of the holder.
    fn wait_for(&mut self, part: Part) -> Result<bool, ClaimError> {
        let IfHeld::Wait(limit) = self.if_held else {
            let in_use = self.in_use(part);
            (self.report)(&in_use);
            return Ok(false);
        };
        let waited = self.started.elapsed();
        let left = limit.saturating_sub(waited);
        if left.is_zero() {
            return Err(self.in_use(part));
        }
        if waited >= SHORT_WAIT && !self.is_reported {
            self.is_reported = true;
            let in_use = self.in_use(part);
            (self.report)(&in_use);
        }
        let pause = RETRY_INTERVAL.min(left);
        if self.interrupts.is_none() {
            self.interrupts = Interrupts::new().ok();
        }
        let is_interrupted = match &mut self.interrupts {
            Some(interrupts) => interrupts.wait_for(pause),
            None => {
                std::thread::sleep(pause);
                false
            }
        };
        if is_interrupted { Err(ClaimError::Interrupted) } else { Ok(true) }
    }
}

/// The result of an attempt to bind a name.
enum Bound {
    Acquired(UnixListener),
    InUse,
    /// This system does not support such sockets.
    Unavailable,
}
