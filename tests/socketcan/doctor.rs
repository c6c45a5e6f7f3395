//! `doctor` names the cause of prepared faults on real SocketCAN.

use super::program::{Devices, cangauge, command};
use super::run;
use serde_json::Value;
use std::fs;
use std::process::{Child, Command, Stdio};

/// A device that enters OPERATIONAL by itself and sends each TPDO every 100 ms, with these other values.
fn sending(set: &str) -> String {
    format!(
        "[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\nset = {{ \"0x1800:2\" = 254, \"0x1800:5\" = 100, \
         \"0x1801:5\" = 100, \"0x1017\" = 100{set} }}\n"
    )
}

/// The words of the findings, with the node.
fn findings(child: Child) -> (Option<i32>, Vec<String>) {
    let done = child.wait_with_output().unwrap();
    let word = |line: &str| {
        let finding: Value = serde_json::from_str(line).unwrap();
        let node = finding["node"].as_u64().map(|node| format!("{node} ")).unwrap_or_default();
        format!("{node}{}", finding["finding"].as_str().unwrap())
    };
    (done.status.code(), String::from_utf8(done.stdout).unwrap().lines().map(word).collect())
}

/// Sends a frame every 50 ms until the value is dropped.
struct Repeated(Child);

impl Repeated {
    fn new(interface: &str, frame: &str) -> Repeated {
        let line = format!("while cansend {interface} {frame}; do sleep 0.05; done");
        Repeated(Command::new("sh").args(["-c", &line]).spawn().unwrap())
    }
}

impl Drop for Repeated {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A fault: the bench, the frame that is repeated (an error frame starts with 2000), the arguments of `doctor`, and the
/// findings.
type Fault<'a> = (&'a str, String, &'a str, &'a str, &'a [&'a str]);

#[test]
#[ignore = "SKIPPED: needs root and virtual CAN interfaces, see tests/socketcan/run"]
fn each_fault_has_its_finding() {
    let off = ", \"0x1801:1\" = 0xC0000285";
    let faults: [Fault<'_>; 12] = [
        ("all is well", sending(""), "", "5", &[]),
        ("no device", String::new(), "", "", &["no-frame"]),
        ("another node only", sending(""), "", "9", &["9 absent"]),
        ("no node-ID", "[[device]]\nkind = \"mh4\"\n".to_owned(), "", "all", &["unconfigured"]),
        ("stopped", sending(""), "000#0205", "5", &["5 stopped"]),
        ("pre-operational", sending(""), "000#8005", "5", &["5 not-operational"]),
        (
            "waits for SYNC",
            sending(off).replace("\"0x1800:2\" = 254", "\"0x1800:2\" = 1"),
            "",
            "5",
            &["5 waits-for-sync"],
        ),
        ("disabled", sending(&format!("{off}, \"0x1800:1\" = 0xC0000185")), "", "5", &["5 tpdo-disabled"]),
        ("bus-off", String::new(), "20000040#0000000000000000", "", &["bus-off"]),
        ("no node acknowledges", String::new(), "20000020#0000000000000000", "5", &["no-acknowledge"]),
        ("errors at a wrong bit rate", String::new(), "20000088#0000040000000000", "5", &["bus-errors"]),
        ("errors, but nodes answer", sending(""), "20000004#0020000000000000", "", &["bus-errors"]),
    ];
    let folder = tempfile::tempdir().unwrap();
    let mut running = Vec::new();
    for (number, (name, bench, frame, arguments, expected)) in faults.iter().enumerate() {
        let interface = format!("fault{number}");
        run("ip", &["link", "add", "dev", &interface, "type", "vcan"]);
        run("ip", &["link", "set", &interface, "up"]);
        let file = folder.path().join(format!("{interface}.toml"));
        fs::write(&file, bench).unwrap();
        let devices = (!bench.is_empty()).then(|| Devices::new(&interface, &file.display().to_string()));
        let repeated = (!frame.is_empty()).then(|| Repeated::new(&interface, frame));
        // All at once: most of the time they wait.
        let child = command(&format!("-b {interface} --format json doctor {arguments}"));
        let child = { child }.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().unwrap();
        running.push((name, expected, child, devices, repeated, interface));
    }
    let mut wrong = Vec::new();
    for (name, expected, child, devices, repeated, interface) in running {
        let found = findings(child);
        drop((devices, repeated));
        run("ip", &["link", "del", &interface]);
        let code = Some(i32::from(!expected.is_empty()));
        if (found.0, found.1.iter().map(String::as_str).collect::<Vec<_>>().as_slice()) != (code, *expected) {
            wrong.push(format!("{name}: {found:?}, expected {expected:?}"));
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
#[ignore = "SKIPPED: needs root and virtual CAN interfaces, see tests/socketcan/run"]
fn absent_interface_and_interface_that_is_down_are_findings() {
    run("ip", &["link", "add", "dev", "down0", "type", "vcan"]);
    for (name, seen) in [("nosuchcan", "nosuchcan"), ("down0", "down0 is down"), ("lo", "lo")] {
        let done = cangauge(&format!("-b {name} doctor --format json"));
        let finding: Value = serde_json::from_str(&done.stdout).unwrap();
        assert_eq!((done.code, finding["finding"].as_str()), (Some(1), Some("bus")), "{done:?}");
        assert!(finding["message"].as_str().unwrap().contains(seen), "{done:?}");
        assert!(finding["hint"].is_string(), "{done:?}");
    }
    run("ip", &["link", "del", "down0"]);
}
