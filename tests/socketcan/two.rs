//! Two programs that use the same node.

use super::program::{Devices, Done, cangauge, command};
use super::{Can, run};
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

/// A program that polls node 5 until it is stopped. It has already started.
fn poller(can: &Can) -> Child {
    let mut child =
        command(&format!("log 5 pressure --poll 100ms -b {}", can.name)).stdout(Stdio::piped()).spawn().unwrap();
    let mut rows = BufReader::new(child.stdout.take().unwrap());
    for _ in 0..2 {
        rows.read_line(&mut String::new()).unwrap();
    }
    // The pipe stays open and is not read any more; it is large enough for the rest.
    std::mem::forget(rows);
    child
}

/// The message about a program of this user that uses node 5.
fn in_use_by(holder: &Child) -> String {
    let user = Command::new("id").arg("-un").output().unwrap();
    let user = String::from_utf8(user.stdout).unwrap();
    format!("node 5 is in use by cangauge (process {}, user {})", holder.id(), user.trim())
}

fn end(mut child: Child) -> Done {
    child.wait().unwrap();
    child.wait_with_output().unwrap().into()
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn a_second_program_waits_and_then_works() {
    let can = Can::get();
    let _devices = Devices::new(&can.name, "mh4@5,dps@6");
    let first = poller(&can);
    // Another node is free.
    cangauge(&format!("sdo read 6 0x1018:1 -b {}", can.name)).is(0, "866\n", "");
    let mut second = command(&format!("sdo read 5 0x1018:1 -b {}", can.name));
    let mut second = second.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let mut stderr = BufReader::new(second.stderr.take().unwrap());
    let mut line = String::new();
    stderr.read_line(&mut line).unwrap();
    assert_eq!(line, format!("{}; waiting for it to end\n", in_use_by(&first)));
    // The node is free again, even if its holder is killed.
    run("kill", &["-KILL", &first.id().to_string()]);
    end(first);
    let done = end(second);
    assert_eq!((done.code, done.stdout.as_str()), (Some(0), "71\n"), "{done:?}");
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn a_wait_ends_after_ten_seconds_or_with_ctrl_c() {
    let can = Can::get();
    let _devices = Devices::new(&can.name, "mh4@5,dps@6");
    let first = poller(&can);
    let started = Instant::now();
    let done = cangauge(&format!("lss inquire 5 -q -b {}", can.name));
    let message = format!("cangauge: {}\n", in_use_by(&first));
    assert!(done.code == Some(5) && done.stderr.starts_with(&message), "{done:?}");
    assert!(started.elapsed() >= Duration::from_secs(10));

    let mut second = command(&format!("autozero 5 -b {}", can.name)).stderr(Stdio::piped()).spawn().unwrap();
    let mut stderr = BufReader::new(second.stderr.take().unwrap());
    stderr.read_line(&mut String::new()).unwrap();
    run("kill", &["-INT", &second.id().to_string()]);
    let mut rest = String::new();
    stderr.read_line(&mut rest).unwrap();
    assert_eq!((second.wait().unwrap().code(), rest.as_str()), (Some(130), "cangauge: interrupted\n"));
    run("kill", &["-INT", &first.id().to_string()]);
    end(first);
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn a_recording_of_tpdos_leaves_the_node_to_others() {
    let can = Can::get();
    let _devices = Devices::new(&can.name, "mh4@5,dps@6");
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

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn an_interface_is_one_claim_under_each_of_its_names() {
    let can = Can::get();
    let _devices = Devices::new(&can.name, "mh4@5,dps@6");
    run("ip", &["link", "property", "add", "dev", &can.name, "altname", "gauge-alt"]);
    let first = poller(&can);
    for bus in [can.name.as_str(), &format!("socketcan:{}", can.name), "gauge-alt"] {
        let mut second = command(&format!("sdo read 5 0x1018:1 -b {bus}")).stderr(Stdio::piped()).spawn().unwrap();
        let mut line = String::new();
        BufReader::new(second.stderr.take().unwrap()).read_line(&mut line).unwrap();
        second.kill().unwrap();
        second.wait().unwrap();
        assert_eq!(line, format!("{}; waiting for it to end\n", in_use_by(&first)), "{bus}");
    }
    // Only with this option, the command continues although the nodes are locked.
    let note = format!("{}; continuing (--ignore-lock)\n", in_use_by(&first));
    cangauge(&format!("sdo read 5 0x1018:1 --ignore-lock -b {}", can.name)).is(0, "71\n", &note);
    run("kill", &["-INT", &first.id().to_string()]);
    end(first);
    run("ip", &["link", "property", "del", "dev", &can.name, "altname", "gauge-alt"]);
}

#[test]
#[ignore = "needs a CAN interface: tests/socketcan/run"]
fn a_scan_needs_no_more_than_64_descriptors() {
    let can = Can::get();
    let _devices = Devices::new(&can.name, "mh4@5,dps@6");
    // Seven of the 64 descriptors are in use.
    let script = "ulimit -n 64; exec 5</dev/null 6</dev/null 7</dev/null 8</dev/null; exec \"$@\"";
    for line in ["scan", "-f json scan 1-127", "read all"] {
        let mut shell = Command::new("bash");
        shell.env_clear().args(["-c", script, "bash", env!("CARGO_BIN_EXE_cangauge"), "-b", &can.name]);
        let done: Done = shell.args(line.split_whitespace()).stdin(Stdio::null()).output().unwrap().into();
        assert_eq!(done.code, Some(0), "{line}: {done:?}");
        assert!(done.stdout.contains('5') && done.stdout.contains('6'), "{line}: {done:?}");
    }
}
