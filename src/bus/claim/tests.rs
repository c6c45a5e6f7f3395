//! Tests with several holders in one process, and with full queues.

use super::*;
use socket2::{Domain, SockAddr, Socket, Type};
use std::io;
use std::os::linux::net::SocketAddrExt;
use std::os::unix::net::{SocketAddr, UnixListener};
use std::time::Instant;

fn nodes(nodes: &[u8]) -> Claim {
    Claim::Nodes(nodes.iter().map(|&node| NodeId::new(node).expect("a node-ID")).collect())
}

/// A bus name that no other test uses.
fn bus(test: &str) -> String {
    format!("test-{}-{test}", std::process::id())
}

fn take(bus: &str, claim: &Claim, timeout: u64) -> Result<Claims, ClaimError> {
    Claims::take(bus, claim, IfHeld::Wait(Duration::from_millis(timeout)), &mut |_| {})
}

fn address(bus: &str, part: &str) -> SocketAddr {
    SocketAddr::from_abstract_name(format!("cangauge/{bus}/{part}")).expect("a short name")
}

/// The text that describes this process as a holder.
fn this_process() -> String {
    let user = std::fs::read_to_string("/proc/self/status").expect("procfs");
    let user = user.lines().find_map(|line| line.strip_prefix("Uid:")?.split_ascii_whitespace().next()).unwrap();
    let users = std::fs::read_to_string("/etc/passwd").expect("a list of users");
    let name = users.lines().find(|line| line.split(':').nth(2) == Some(user)).map(|line| line.split(':').next());
    let program = std::fs::read_to_string("/proc/self/comm").expect("procfs");
    format!("{} (process {}, user {})", program.trim(), std::process::id(), name.flatten().unwrap_or(user))
}

#[test]
fn one_node_has_one_holder_and_each_bus_its_own_nodes() {
    let bus = bus("one");
    let held = take(&bus, &nodes(&[5, 3, 5]), 0).expect("free");
    let refused = take(&bus, &nodes(&[5, 7]), 0).expect_err("held");
    assert_eq!(refused.to_string(), format!("node 5 is in use by {}", this_process()));
    let others = [take(&bus, &nodes(&[4, 6, 7]), 0), take(&format!("{bus}x"), &nodes(&[5]), 0)];
    assert!(others.iter().all(Result::is_ok), "{others:?}");
    assert!(matches!(take(&bus, &Claim::Bus, 0), Err(ClaimError::InUse(Part::Node(node), _)) if node.get() == 3));
    assert!(take(&bus, &Claim::Nothing, 0).is_ok());
    drop((held, others));
    assert!(take(&bus, &Claim::Bus, 0).is_ok());
}

#[test]
fn lss_and_every_node_exclude_all_others() {
    let bus = bus("lss");
    let all = take(&bus, &Claim::Bus, 0).expect("free");
    for claim in [Claim::every_node(), nodes(&[127]), nodes(&[1, 2])] {
        let refused = take(&bus, &claim, 0).expect_err("held");
        assert!(matches!(refused, ClaimError::InUse(Part::EveryNode, _)), "{refused}");
    }
    let refused = take(&bus, &Claim::Bus, 0).expect_err("held");
    assert!(matches!(refused, ClaimError::InUse(Part::Lss, _)), "{refused}");
    drop(all);
    let _all = take(&bus, &Claim::every_node(), 0).expect("free");
    assert!(take(&bus, &nodes(&[5]), 0).is_err());
}

#[test]
fn a_claim_takes_few_descriptors() {
    assert_eq!(take(&bus("few"), &Claim::every_node(), 0).expect("free").names(), 1);
    assert_eq!(take(&bus("few"), &nodes(&[1, 2, 3]), 0).expect("free").names(), 3);
}

#[test]
fn a_waiting_claim_reports_the_holder_once_and_gets_the_node() {
    for claim in [nodes(&[9]), Claim::every_node()] {
        let bus = bus("wait");
        let held = take(&bus, &claim, 0).expect("free");
        let started = Instant::now();
        let holder = std::thread::spawn(move || {
            std::thread::sleep(Duration::from_millis(700));
            drop(held);
        });
        let mut reports = Vec::new();
        let wait = IfHeld::Wait(Duration::from_secs(60));
        let got = Claims::take(&bus, &nodes(&[9]), wait, &mut |what| reports.push(what.to_string()));
        assert!(got.is_ok() && started.elapsed() < Duration::from_secs(50));
        assert_eq!(reports.len(), 1, "{reports:?}");
        assert!(holder.join().is_ok());
        let started = Instant::now();
        assert!(take(&bus, &nodes(&[9]), 50).is_err());
        assert!(started.elapsed() >= Duration::from_millis(50));
    }
}

#[test]
fn claims_that_meet_do_not_wait_for_each_other_for_ever() {
    let bus = bus("meet");
    let workers: Vec<_> = [nodes(&[1, 2]), Claim::every_node(), nodes(&[2, 3]), Claim::Bus]
        .into_iter()
        .map(|claim| {
            let bus = bus.clone();
            std::thread::spawn(move || (0..20).all(|_| take(&bus, &claim, 60_000).is_ok()))
        })
        .collect();
    assert!(workers.into_iter().all(|worker| worker.join().expect("no panic")));
}

#[test]
fn continuing_beside_a_holder_reports_it_and_takes_the_rest() {
    let bus = bus("beside");
    let _held = take(&bus, &nodes(&[5]), 0).expect("free");
    for (claim, names) in [(nodes(&[4, 5]), 1), (Claim::every_node(), 1)] {
        let mut reports = Vec::new();
        let report = &mut |what: &ClaimError| reports.push(what.to_string());
        let claims = Claims::take(&bus, &claim, IfHeld::Continue, report).expect("beside the holder");
        assert_eq!((claims.names(), reports), (names, vec![format!("node 5 is in use by {}", this_process())]));
    }
}

/// A process that holds a name, and whose queue is full.
fn holder_with_full_queue(bus: &str, part: &str) -> (UnixListener, Vec<Socket>) {
    let listener = UnixListener::bind_addr(&address(bus, part)).expect("free");
    let path = format!("\0cangauge/{bus}/{part}");
    let mut connections = Vec::new();
    // Sets a short queue, because the default length is the limit of the system.
    socket2::SockRef::from(&listener).listen(2).expect("a shorter queue");
    loop {
        let socket = Socket::new(Domain::UNIX, Type::STREAM.nonblocking(), None).expect("a socket");
        match socket.connect(&SockAddr::unix(&path).expect("a short name")) {
            Ok(()) => connections.push(socket),
            Err(error) if error.kind() == io::ErrorKind::WouldBlock => return (listener, connections),
            Err(error) => panic!("{error}"),
        }
    }
}

#[test]
fn a_full_queue_does_not_block_others() {
    let bus = bus("full");
    for (part, claim) in [("5", nodes(&[5])), ("5", Claim::every_node()), ("all", nodes(&[5])), ("lss", Claim::Bus)] {
        let holder = holder_with_full_queue(&bus, part);
        let started = Instant::now();
        let refused = take(&bus, &claim, 100).expect_err("held");
        assert!(started.elapsed() < Duration::from_secs(5), "{:?}", started.elapsed());
        assert!(refused.to_string().ends_with(&format!(" is in use by {}", this_process())), "{refused}");
        drop(holder);
        // A program that another test starts has a copy of the socket until its first instruction.
        take(&bus, &claim, 2000).expect("free");
    }
}

#[test]
fn a_name_without_a_listener_is_held_too() {
    let bus = bus("bound");
    let socket = Socket::new(Domain::UNIX, Type::STREAM, None).expect("a socket");
    socket.bind(&SockAddr::unix(format!("\0cangauge/{bus}/5")).expect("a short name")).expect("free");
    let refused = take(&bus, &nodes(&[5]), 0).expect_err("held");
    assert_eq!(refused.to_string(), format!("node 5 is in use by {}", this_process()));
}

#[test]
fn holder_is_described_as_far_as_known() {
    let holder = |process, user: Option<&str>, program: Option<&str>| {
        Holder { process, user: user.map(str::to_owned), program: program.map(str::to_owned) }.to_string()
    };
    assert_eq!(holder(Some(7), Some("root"), Some("python3")), "python3 (process 7, user root)");
    assert_eq!(holder(Some(7), None, Some("python3")), "python3 (process 7)");
    assert_eq!(holder(None, Some("1000"), None), "another program (user 1000)");
    assert_eq!(holder(None, None, None), "another program");
}
