//! Two programs that talk to one node on one bus of this machine disturb each other. Who comes first claims it;
//! whoever comes next waits for it, or says who is in the way.
//!
//! A claim is a name in the abstract namespace of Unix sockets (`@cangauge/can0/5`): it belongs to the same network
//! namespace as the interface, lies in no folder, ends with the process however that ends, and tells who holds it.
//! It binds nobody who does not ask for it. Elsewhere than on Linux nothing is claimed.

use crate::canopen::id::NodeId;
use std::time::Duration;

/// What a command needs for itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Claim {
    /// Nothing: it only listens, or its bus is its own.
    #[default]
    Nothing,
    /// The SDO servers and NMT states of these nodes.
    Nodes(Vec<NodeId>),
    /// The whole bus: LSS reaches every node.
    Bus,
}

impl Claim {
    /// Every node.
    pub fn every_node() -> Claim {
        Claim::Nodes(NodeId::all().collect())
    }

    /// Its names, `None` for LSS. Everybody takes them in this order, so nobody waits in a circle.
    fn names(&self) -> Vec<Option<NodeId>> {
        match self {
            Claim::Nothing => Vec::new(),
            Claim::Nodes(nodes) => {
                let mut nodes = nodes.clone();
                nodes.sort_unstable();
                nodes.dedup();
                nodes.into_iter().map(Some).collect()
            }
            Claim::Bus => std::iter::once(None).chain(NodeId::all().map(Some)).collect(),
        }
    }
}

/// Why a claim was not got.
#[derive(Debug, thiserror::Error)]
pub enum ClaimError {
    /// Another process holds it and went on holding it.
    #[error("{} is in use by another cangauge{}", name(*.0), process(*.1))]
    InUse(Option<NodeId>, Option<u32>),
    /// The user asked to stop.
    #[error("interrupted")]
    Interrupted,
}

fn name(node: Option<NodeId>) -> String {
    node.map_or("the bus".to_owned(), |node| format!("node {node}"))
}

fn process(id: Option<u32>) -> String {
    id.map(|id| format!(" (process {id})")).unwrap_or_default()
}

#[cfg(target_os = "linux")]
pub use linux::Claims;

#[cfg(not(target_os = "linux"))]
pub use elsewhere::Claims;

#[cfg(not(target_os = "linux"))]
mod elsewhere {
    use super::{Claim, ClaimError, Duration};

    /// What has been claimed: nothing.
    #[derive(Debug, Default)]
    pub struct Claims;

    impl Claims {
        /// Claims nothing.
        ///
        /// # Errors
        /// None.
        pub fn take(_: &str, _: &Claim, _: Duration, _: &mut dyn FnMut(&ClaimError)) -> Result<Claims, ClaimError> {
            Ok(Claims)
        }
    }
}

#[cfg(target_os = "linux")]
mod linux {
    use super::{Claim, ClaimError, Duration, NodeId};
    use crate::bus::interrupt::Interrupts;
    use crate::bus::poll;
    use std::io::{self, ErrorKind};
    use std::os::fd::{AsFd, AsRawFd};
    use std::os::linux::net::SocketAddrExt;
    use std::os::unix::net::{SocketAddr, UnixListener, UnixStream};
    use std::time::Instant;

    /// Most commands are over sooner: a wait that is shorter than this is not worth a word.
    const SHORT: Duration = Duration::from_millis(500);
    /// How often is looked for a holder that cannot be waited for.
    const LOOK: Duration = Duration::from_millis(20);

    /// What has been claimed, until this is dropped or the process ends.
    #[derive(Debug, Default)]
    pub struct Claims(#[expect(dead_code, reason = "a name is held by its socket being open")] Vec<UnixListener>);

    impl Claims {
        /// Claims what `claim` says on the interface `bus`, and waits for others as long as `patience` in all. A
        /// wait that takes longer than a moment is told through `waiting`.
        ///
        /// # Errors
        /// Who is in the way; the wish to stop.
        pub fn take(
            bus: &str,
            claim: &Claim,
            patience: Duration,
            waiting: &mut dyn FnMut(&ClaimError),
        ) -> Result<Claims, ClaimError> {
            let mut wait = Wait { begun: Instant::now(), patience, interrupts: None, told: false, waiting };
            let mut claims = Vec::new();
            for node in claim.names() {
                // A system that has no such sockets, or forbids them, has no claims: they are an offer.
                claims.extend(bind(bus, node, &mut wait)?);
            }
            Ok(Claims(claims))
        }
    }

    fn bind(bus: &str, node: Option<NodeId>, wait: &mut Wait<'_>) -> Result<Option<UnixListener>, ClaimError> {
        let part = node.map_or("lss".to_owned(), |node| node.to_string());
        let Ok(address) = SocketAddr::from_abstract_name(format!("cangauge/{bus}/{part}")) else { return Ok(None) };
        loop {
            match UnixListener::bind_addr(&address) {
                Ok(listener) => return Ok(Some(listener)),
                Err(error) if error.kind() == ErrorKind::AddrInUse => wait.for_holder(node, &address)?,
                Err(_) => return Ok(None),
            }
        }
    }

    struct Wait<'a> {
        begun: Instant,
        patience: Duration,
        /// From the first wait on: Ctrl-C ends it.
        interrupts: Option<Interrupts>,
        told: bool,
        waiting: &'a mut dyn FnMut(&ClaimError),
    }

    impl Wait<'_> {
        /// Waits until the holder of a name may be gone.
        fn for_holder(&mut self, node: Option<NodeId>, address: &SocketAddr) -> Result<(), ClaimError> {
            // Nobody is ever let in: that the connection breaks says that the holder has gone.
            let holder = UnixStream::connect_addr(address).ok();
            let process = holder.as_ref().and_then(|holder| process(holder).ok()).filter(|&id| id > 0);
            let in_use = ClaimError::InUse(node, process);
            let left = self.patience.saturating_sub(self.begun.elapsed());
            if left.is_zero() {
                return Err(in_use);
            }
            let limit = if self.told { left } else { left.min(SHORT) };
            if self.interrupts.is_none() {
                self.interrupts = Interrupts::new().ok();
            }
            let gone = match (&holder, &mut self.interrupts) {
                (Some(holder), Some(interrupts)) => {
                    let [gone, _] = poll::readable([holder.as_fd(), interrupts.fd()], limit).unwrap_or_default();
                    gone
                }
                _ => {
                    std::thread::sleep(LOOK.min(limit));
                    true
                }
            };
            if self.interrupts.as_mut().is_some_and(|interrupts| interrupts.wait_until(Instant::now())) {
                return Err(ClaimError::Interrupted);
            }
            if !gone && !self.told {
                self.told = true;
                (self.waiting)(&in_use);
            }
            Ok(())
        }
    }

    /// The process on the other side.
    #[expect(unsafe_code, reason = "the standard library does not tell the credentials of a peer")]
    fn process(stream: &UnixStream) -> io::Result<u32> {
        let mut peer = libc::ucred { pid: 0, uid: 0, gid: 0 };
        let mut length = libc::socklen_t::try_from(size_of::<libc::ucred>()).map_err(io::Error::other)?;
        // SAFETY: `peer` is plain numbers, `length` is its length, and both outlive the call.
        let result = unsafe {
            let (level, option) = (libc::SOL_SOCKET, libc::SO_PEERCRED);
            libc::getsockopt(stream.as_raw_fd(), level, option, (&raw mut peer).cast(), &raw mut length)
        };
        if result != 0 {
            return Err(io::Error::last_os_error());
        }
        u32::try_from(peer.pid).map_err(io::Error::other)
    }
}

#[cfg(test)]
#[cfg(target_os = "linux")]
mod tests {
    use super::*;
    use std::time::Instant;

    fn nodes(nodes: &[u8]) -> Claim {
        Claim::Nodes(nodes.iter().map(|&node| NodeId::new(node).expect("a node-ID")).collect())
    }

    /// A bus that no other test has.
    fn bus(test: &str) -> String {
        format!("test-{}-{test}", std::process::id())
    }

    fn take(bus: &str, claim: &Claim, patience: u64) -> Result<Claims, ClaimError> {
        Claims::take(bus, claim, Duration::from_millis(patience), &mut |_| {})
    }

    #[test]
    fn one_node_has_one_holder_and_each_bus_its_own_nodes() {
        let bus = bus("one");
        let held = take(&bus, &nodes(&[5, 3, 5]), 0).expect("free");
        let refused = take(&bus, &nodes(&[5, 7]), 0).expect_err("held");
        let me = std::process::id();
        assert_eq!(refused.to_string(), format!("node 5 is in use by another cangauge (process {me})"));
        let others = [take(&bus, &nodes(&[4, 6, 7]), 0), take(&format!("{bus}x"), &nodes(&[5]), 0)];
        assert!(others.iter().all(Result::is_ok), "{others:?}");
        assert!(matches!(take(&bus, &Claim::Bus, 0), Err(ClaimError::InUse(Some(node), _)) if node.get() == 3));
        assert!(take(&bus, &Claim::Nothing, 0).is_ok());
        drop((held, others));
        assert!(take(&bus, &Claim::Bus, 0).is_ok());
    }

    #[test]
    fn lss_is_claimed_first_and_with_every_node() {
        let bus = bus("lss");
        let all = take(&bus, &Claim::Bus, 0).expect("free");
        assert!(take(&bus, &Claim::every_node(), 0).is_err());
        let refused = take(&bus, &Claim::Bus, 0).expect_err("held");
        assert!(matches!(refused, ClaimError::InUse(None, Some(_))), "{refused}");
        drop(all);
    }

    #[test]
    fn who_waits_is_woken_and_who_waits_long_says_so() {
        let bus = bus("wait");
        let held = take(&bus, &nodes(&[9]), 0).expect("free");
        let begun = Instant::now();
        let holder = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(700));
            drop(held);
        });
        let mut told = Vec::new();
        let got = Claims::take(&bus, &nodes(&[9]), Duration::from_secs(60), &mut |what| told.push(what.to_string()));
        assert!(got.is_ok() && begun.elapsed() < Duration::from_secs(50));
        assert_eq!(told.len(), 1, "{told:?}");
        assert!(holder.join().is_ok());
        let begun = Instant::now();
        assert!(take(&bus, &nodes(&[9]), 50).is_err());
        assert!(begun.elapsed() >= Duration::from_millis(50));
    }
}
