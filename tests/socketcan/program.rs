//! Runs the program, and reads interfaces with `ip`.

use serde_json::Value;
use std::io::{BufRead, BufReader};
use std::process::{Child, Command, Output, Stdio};

/// The result of a command.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl From<Output> for Done {
    fn from(output: Output) -> Done {
        let text = |bytes| String::from_utf8(bytes).unwrap();
        Done { code: output.status.code(), stdout: text(output.stdout), stderr: text(output.stderr) }
    }
}

impl Done {
    /// Checks the exit code and the complete output.
    #[track_caller]
    pub(crate) fn is(&self, code: i32, stdout: &str, stderr: &str) {
        assert_eq!((self.code, self.stdout.as_str(), self.stderr.as_str()), (Some(code), stdout, stderr));
    }
}

/// The program with these arguments.
pub(crate) fn command(line: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_cangauge"));
    command.env_clear().args(line.split_whitespace()).stdin(Stdio::null());
    command
}

pub(crate) fn cangauge(line: &str) -> Done {
    command(line).output().unwrap().into()
}

/// Runs the program as root without the privilege to set interfaces.
pub(crate) fn without_the_right(line: &str) -> Done {
    let mut command = Command::new("setpriv");
    command.args(["--bounding-set", "-net_admin", "--inh-caps", "-net_admin", env!("CARGO_BIN_EXE_cangauge")]);
    command.args(line.split_whitespace()).stdin(Stdio::null()).output().unwrap().into()
}

/// An interface as `ip` shows it.
pub(crate) fn shown(name: &str) -> Value {
    let output = Command::new("ip").args(["-details", "-json", "link", "show", name]).output().unwrap();
    let mut all: Value = serde_json::from_slice(&output.stdout).unwrap();
    all[0].take()
}

/// Whether it is up, and all data of its controller except state and counters.
pub(crate) fn setting(name: &str) -> (bool, Value, Value) {
    let mut shown = shown(name);
    let up = shown["flags"].as_array().unwrap().iter().any(|flag| flag == "UP");
    let data = &mut shown["linkinfo"]["info_data"];
    (up, data["bittiming"].take(), serde_json::json!([data["ctrlmode"], data["restart_ms"]]))
}

/// Simulated devices on an interface. They end when the value is dropped.
pub(crate) struct Devices(Child);

impl Devices {
    pub(crate) fn new(bus: &str, devices: &str) -> Devices {
        let mut child = command(&format!("sim {devices} -b {bus}")).stderr(Stdio::piped()).spawn().unwrap();
        // It prints a line when the devices are ready.
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
