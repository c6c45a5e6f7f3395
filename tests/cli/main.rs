//! Runs the binary on the simulated bus in a cleared environment. Checks stdout, stderr, exit code and, by `--trace`,
//! the frames. Benches use the virtual clock, so waiting takes no time.

mod args;
mod autozero;
mod bus;
mod check;
mod config;
mod config_series;
mod conform;
mod descriptions;
mod devices;
mod doctor;
mod examples;
mod export;
mod health;
mod hostile;
mod info;
mod log;
mod log_append;
mod log_end;
mod log_events;
mod log_file;
mod log_layout;
mod log_rotate;
mod log_stall;
mod log_tags;
mod lss;
mod monitor;
mod nmt;
mod output;
mod partly_failing_nodes;
mod pdo;
mod plot;
mod profiles;
#[cfg(feature = "publish")]
mod publish;
#[cfg(feature = "tls")]
mod publish_tls;
mod read;
mod readme;
mod replay;
mod scan;
mod sdo;
mod settings;
mod sim;
mod store;
mod write_form;

use std::fs;
use std::io::{self, Read};
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::sync::mpsc;
use std::thread;
use std::time::Duration;
use tempfile::TempDir;

/// No command takes longer, even on a slow machine. One that does is hanging.
const COMMAND_TIMEOUT: Duration = Duration::from_secs(120);

/// The default bench, on the virtual clock.
const ALL: &str = "mh4@1,d20@2,mc1609@3,dps@127";

/// The result of a command.
#[derive(Debug)]
struct Done {
    code: Option<i32>,
    stdout: String,
    stderr: String,
    /// The frames on the bus (`601#4000100000000000`); empty if the bus was not opened.
    frames: Vec<String>,
    /// The times of the frames in microseconds since the bus was opened (virtual clock).
    times: Vec<u64>,
}

impl Done {
    /// Checks the exit code.
    #[track_caller]
    fn exit(self, code: i32) -> Done {
        assert_eq!(self.code, Some(code), "stdout:\n{}stderr:\n{}", self.stdout, self.stderr);
        self
    }

    /// Checks that the command succeeded and printed exactly this text.
    #[track_caller]
    fn prints(self, stdout: &str) -> Done {
        let done = self.exit(0);
        assert_eq!(done.stdout, stdout, "stderr:\n{}", done.stderr);
        done
    }

    /// Checks that the command failed, with exactly this text on stderr and nothing on stdout.
    #[track_caller]
    fn fails(self, code: i32, stderr: &str) -> Done {
        let done = self.exit(code);
        assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", stderr));
        done
    }

    /// Checks that the command was refused before the bus was opened.
    #[track_caller]
    fn refuses(self, message: &str) -> Done {
        let done = self.exit(2);
        let first = done.stderr.lines().next().unwrap_or("");
        assert_eq!((done.stdout.as_str(), first), ("", format!("cangauge: {message}").as_str()));
        assert_eq!(done.frames, [""; 0], "the bus was used");
        done
    }

    /// The frames with this identifier, `000` for NMT.
    fn frames_of(&self, id: &str) -> Vec<&str> {
        self.frames.iter().filter_map(|frame| frame.strip_prefix(id)?.strip_prefix('#')).collect()
    }

    /// stdout as JSON Lines.
    #[track_caller]
    fn json(&self) -> Vec<serde_json::Value> {
        self.stdout.lines().map(|line| serde_json::from_str(line).expect(line)).collect()
    }

    /// The one error object on stderr.
    #[track_caller]
    fn error(&self) -> serde_json::Value {
        assert_eq!(self.stderr.lines().count(), 1, "{}", self.stderr);
        serde_json::from_str(&self.stderr).expect("an object")
    }
}

/// A folder with a bench.
struct Bench {
    folder: TempDir,
    bus: String,
}

impl Bench {
    /// A bench with these devices on the virtual clock: `mh4@1,dps@127`.
    fn of(devices: &str) -> Bench {
        let device = |text: &str| {
            let (kind, node) = text.split_once('@').expect("kind@node");
            format!("[[device]]\nkind = \"{kind}\"\nnode = {node}\n")
        };
        Bench::described(&devices.split(',').map(device).collect::<String>())
    }

    /// A bench file with these devices on the virtual clock.
    fn described(devices: &str) -> Bench {
        let folder = tempfile::tempdir().expect("a folder");
        fs::write(folder.path().join("bench.toml"), format!("clock = \"virtual\"\n{devices}")).expect("the bench");
        Bench { folder, bus: "sim:bench.toml".to_owned() }
    }

    /// A bench with these devices on the real clock, for tests with signals and readers.
    fn real(devices: &str) -> Bench {
        Bench { folder: tempfile::tempdir().expect("a folder"), bus: format!("sim:{devices}") }
    }

    fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    #[track_caller]
    fn text(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// The other files in the folder, without the files of runs (`run.csv.run.json`).
    fn files(&self) -> Vec<String> {
        let entries = fs::read_dir(self.folder.path()).expect("the folder");
        let names = entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned());
        let is_other = |name: &String| {
            !["bench.toml", "trace", "truth.csv"].contains(&name.as_str()) && !name.ends_with(".run.json")
        };
        let mut names: Vec<String> = names.filter(is_other).collect();
        names.sort();
        names
    }

    /// The command without a bus.
    fn command(&self, words: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_cangauge"));
        command.env_clear().current_dir(self.folder.path()).args(words).stdin(Stdio::null());
        command
    }

    /// The command on the bench, with --trace.
    fn traced(&self, words: &[&str]) -> Command {
        let mut all = vec!["--bus", &self.bus, "--trace", "trace"];
        all.extend(words);
        let _ = fs::remove_file(self.path("trace"));
        self.command(&all)
    }

    /// Runs a command on the bench: `run("read 1 pressure")`, or with words that contain spaces
    /// `run_words(&["…"])`.
    fn run(&self, line: &str) -> Done {
        self.run_words(&line.split_whitespace().collect::<Vec<_>>())
    }

    fn run_words(&self, words: &[&str]) -> Done {
        self.finish(&mut self.traced(words))
    }

    /// Runs `command` to its end.
    fn finish(&self, command: &mut Command) -> Done {
        let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the binary");
        self.end(child)
    }

    /// Waits for the end of a running command.
    fn end(&self, mut child: Child) -> Done {
        let stdout = drain(child.stdout.take());
        let stderr = drain(child.stderr.take());
        let outputs = [stdout, stderr].map(|output| output.recv_timeout(COMMAND_TIMEOUT));
        if outputs.iter().any(Result::is_err) {
            child.kill().expect("killed");
        }
        let code = child.wait().expect("its end").code();
        let [stdout, stderr] = outputs.map(|output| output.expect("the command hangs"));
        let (times, frames) = self.trace();
        Done { code, stdout, stderr, frames, times }
    }

    fn trace(&self) -> (Vec<u64>, Vec<String>) {
        let Ok(trace) = fs::read_to_string(self.path("trace")) else { return Default::default() };
        let line = |line: &str| {
            let parts: Vec<&str> = line.split(' ').collect();
            let [time, bus, frame] = parts[..] else { panic!("{line}") };
            assert_eq!(bus, "sim");
            let time = time.strip_prefix('(').and_then(|time| time.strip_suffix(')')).expect("a time");
            (since_epoch(time), frame.to_owned())
        };
        trace.lines().map(line).unzip()
    }
}

/// The start of the virtual clock: 2026-01-01 00:00 UTC.
const EPOCH_S: u64 = 1_767_225_600;

/// `1767225600.018668` as microseconds since the virtual clock's start; times of the real clock are larger.
fn since_epoch(time: &str) -> u64 {
    let (seconds, micros) = time.split_once('.').expect("a fraction");
    assert_eq!(micros.len(), 6, "{time}");
    let seconds: u64 = seconds.parse().expect("seconds");
    (seconds - EPOCH_S) * 1_000_000 + micros.parse::<u64>().expect("microseconds")
}

/// Reads a stream to its end in another thread.
fn drain(stream: Option<impl Read + Send + 'static>) -> mpsc::Receiver<String> {
    let (done, result) = mpsc::channel();
    thread::spawn(move || {
        let mut text = Vec::new();
        stream.map(|mut stream| io::copy(&mut stream, &mut text));
        // After a time-out of the test, the text is not needed.
        let _ = done.send(String::from_utf8_lossy(&text).into_owned());
    });
    result
}

/// A pipe whose reader is closed.
fn closed_pipe() -> Stdio {
    let (reader, writer) = io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

/// A full disk.
#[cfg(target_os = "linux")]
fn full_disk() -> Stdio {
    fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full").into()
}
