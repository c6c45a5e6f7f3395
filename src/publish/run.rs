//! Reads the file of the run beside a recording: `run.csv.run.json`.

use super::series;
use serde::Deserialize;
use std::ffi::OsString;
use std::fs;
use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// A run of `log`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
pub struct Run {
    /// The identifier.
    pub run: String,
    /// The bench.
    #[serde(default)]
    pub bench: String,
    /// The first file, without its folder.
    #[serde(default)]
    file: String,
    /// The place of the first row in the first file.
    #[serde(default)]
    offset: u64,
    /// The nodes.
    #[serde(default)]
    pub nodes: Vec<RunNode>,
}

/// The identity of a node.
#[derive(Clone, Debug, Default, PartialEq, Eq, Deserialize)]
pub struct RunNode {
    /// The node-ID.
    pub node: u8,
    /// 1018h:4.
    #[serde(default)]
    pub serial: Option<u32>,
    /// The device name (1008h).
    #[serde(default)]
    pub name: Option<String>,
}

/// The runs of a recording, in the order of their start.
#[derive(Debug, Default)]
pub struct Runs {
    base: PathBuf,
    runs: Vec<Run>,
    /// Length and time of the file when it was read.
    version: Option<(u64, Option<SystemTime>)>,
}

impl Runs {
    /// The runs of a recording: of the file itself, otherwise of the series to which it belongs. Nothing is read yet.
    pub fn of(recording: &Path) -> Runs {
        Runs { base: recording.to_owned(), ..Runs::default() }
    }

    /// Reads the file again if it has changed. A file that cannot be read has no runs.
    pub fn refresh(&mut self) {
        let own = file_name(&self.base);
        let path = match series::base_of(&self.base) {
            Some(base) if !own.exists() => file_name(&base),
            _ => own,
        };
        let version = fs::metadata(&path).ok().map(|metadata| (metadata.len(), metadata.modified().ok()));
        if version != self.version {
            let text = fs::read_to_string(&path).unwrap_or_default();
            self.runs = text.lines().filter_map(|line| serde_json::from_str(line).ok()).collect();
            self.version = version;
        }
    }

    /// The run of the row at `offset` of a file. `None` if the file of the run does not contain it.
    pub fn at(&self, file: &Path, offset: u64) -> Option<&Run> {
        let base = series::base_of(file).unwrap_or_else(|| file.to_owned());
        let place = |name: &Path, offset: u64| (series::number(&base, name).unwrap_or(0), offset);
        let wanted = place(file, offset);
        self.runs.iter().rev().find(|run| place(Path::new(&run.file), run.offset) <= wanted)
    }
}

fn file_name(recording: &Path) -> PathBuf {
    let mut name = recording.file_name().map(OsString::from).unwrap_or_default();
    name.push(".run.json");
    recording.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn run_of_a_row() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = |name: &str| folder.path().join(name);
        let text = "{\"run\":\"a\",\"file\":\"run-0001.csv\",\"offset\":0}\n{\"run\":\"b\",\"file\":\"run-0003.csv\"}\n\
                    {\"run\":\"c\",\"file\":\"run-0003.csv\",\"offset\":100}\n";
        fs::write(path("run.csv.run.json"), text).expect("written");
        for recording in ["run.csv", "run-0002.csv"] {
            let mut runs = Runs::of(&path(recording));
            runs.refresh();
            let run = |file: &str, offset| runs.at(&path(file), offset).map(|run| run.run.clone()).unwrap_or_default();
            assert_eq!([run("run-0001.csv", 0), run("run-0002.csv", 50)], ["a", "a"]);
            assert_eq!([run("run-0003.csv", 99), run("run-0003.csv", 100), run("run-0004.csv", 0)], ["b", "c", "c"]);
            assert_eq!(run("run.csv", 0), "", "before the first run");
        }
        let mut none = Runs::of(&path("other.csv"));
        none.refresh();
        assert_eq!(none.at(&path("other.csv"), 0), None);
    }
}
