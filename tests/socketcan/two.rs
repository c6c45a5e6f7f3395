//! Two programs and one node.

use super::program::{Done, cangauge, command};
use super::{Can, run};
use std::io::{BufRead, BufReader};
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// Simulated devices on the interface, until dropped.
struct Devices(Child);

impl Devices {
    fn new(can: &Can) -> Devices {
        let mut child = command(&format!("sim mh4@5,dps@6 -b {}", can.name)).stderr(Stdio::piped()).spawn().unwrap();
        // It says when they are there.
        let mut line = String::new();
        BufReader::new(child.stderr.take().unwrap()).read_line(&mut line).unwrap();
        Devices(child)
    }
}

impl Drop for Devices {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A program that polls node 5 until it is stopped, and has begun to.
fn poller(can: &Can) -> Child {
    let mut child =
        command(&format!("log 5 pressure --poll 100ms -b {}", can.name)).stdout(Stdio::piped()).spawn().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap());
    for _ in 0..2 {
        rows.read_line(&mut String::new()).unwrap();
    }
    // The pipe stays open and is read no more; it holds what little comes.
    std::mem::forget(rows);
    child
}

fn end(mut child: Child) -> Done {
    child.wait().unwrap();
    child.wait_with_output().unwrap().into()
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn the_second_waits_and_then_works() {
    let can = Can::get();
    let _devices = Devices::new(&can);
    let first = poller(&can);
    // Another node is nobody's.
    cangauge(&format!("sdo read 6 0x1018:1 -b {}", can.name)).is(0, "866\n", "");
    let mut second = command(&format!("sdo read 5 0x1018:1 -b {}", can.name));
    let mut second = second.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = BufReader::new(second.stderr.take().unwrap());
    let mut line = String::new();
    told.read_line(&mut line).unwrap();
    let waiting = format!("node 5 is in use by another cangauge (process {}); waiting for it to end\n", first.id());
    assert_eq!(line, waiting);
    // However it ends, what it had claimed is free again.
    run("kill", &["-KILL", &first.id().to_string()]);
    end(first);
    let done = end(second);
    assert_eq!((done.code, done.stdout.as_str()), (Some(0), "71\n"), "{done:?}");
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn who_waits_too_long_says_who_is_in_the_way_and_ctrl_c_ends_the_wait() {
    let can = Can::get();
    let _devices = Devices::new(&can);
    let first = poller(&can);
    let begun = Instant::now();
    let done = cangauge(&format!("lss inquire 5 -q -b {}", can.name));
    let holder = first.id();
    let message = format!("cangauge: node 5 is in use by another cangauge (process {holder})\n");
    assert!(done.code == Some(5) && done.stderr.starts_with(&message), "{done:?}");
    assert!(begun.elapsed() >= Duration::from_secs(10));

    let mut second = command(&format!("autozero 5 -b {}", can.name)).stderr(Stdio::piped()).spawn().unwrap();
    let mut told = BufReader::new(second.stderr.take().unwrap());
    told.read_line(&mut String::new()).unwrap();
    run("kill", &["-INT", &second.id().to_string()]);
    let mut rest = String::new();
    told.read_line(&mut rest).unwrap();
    assert_eq!((second.wait().unwrap().code(), rest.as_str()), (Some(130), "cangauge: interrupted\n"));
    run("kill", &["-INT", &holder.to_string()]);
    end(first);
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn a_recording_leaves_the_node_to_others() {
    let can = Can::get();
    let _devices = Devices::new(&can);
    let mut recording = command(&format!("log 5 --sync 50ms -b {}", can.name)).stdout(Stdio::piped()).spawn().unwrap();
    let mut rows = BufReader::new(recording.stdout.take().unwrap());
    for _ in 0..2 {
        rows.read_line(&mut String::new()).unwrap();
    }
    cangauge(&format!("sdo read 5 0x1018:1 -b {}", can.name)).is(0, "71\n", "");
    drop(rows);
    recording.kill().unwrap();
    recording.wait().unwrap();
}
