//! The non-volatile memory of simulated devices in a file, so that it lasts from one run to the next.

use super::bench::BenchError;
use super::objects::Objects;
use super::settings::{BitRate, Settings};
use crate::bus::file::lock;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use serde::Deserialize;
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, Read, Seek, Write};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

/// The version of the file. Any other version is an error.
const VERSION: u32 = 1;

/// The settings that a device keeps without power.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Stored {
    pub(super) node: Option<NodeId>,
    /// The bit rate in bit/s, if it differs from the bit rate of the bus.
    pub(super) bit_rate: Option<u32>,
    pub(super) objects: BTreeMap<ObjectId, Vec<u8>>,
}

impl Stored {
    pub(super) fn of(settings: &Settings, objects: &Objects) -> Stored {
        let bit_rate = match settings.persistent.rate {
            BitRate::At(rate) if settings.bus_bit_rate != Some(rate) => Some(rate),
            _ => None,
        };
        Stored { node: settings.persistent.node, bit_rate, objects: objects.saved().clone() }
    }
}

/// The file, locked for this run. Clones are the same file.
#[derive(Clone)]
pub(super) struct StateFile {
    inner: Arc<Mutex<Inner>>,
}

struct Inner {
    file: File,
    /// The stored settings by kind and serial number. Devices of other benches stay in the file.
    devices: BTreeMap<(String, u32), Stored>,
}

#[derive(Deserialize)]
struct Head {
    version: u32,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Text {
    #[serde(rename = "version")]
    _version: u32,
    #[serde(default)]
    device: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct Entry {
    kind: String,
    serial: u32,
    node: Option<NodeId>,
    bit_rate: Option<u32>,
    #[serde(default)]
    objects: BTreeMap<ObjectId, String>,
}

impl StateFile {
    /// Opens or creates the file.
    pub(super) fn open(path: &Path) -> Result<StateFile, BenchError> {
        let failed = |source| BenchError::Io { path: PathBuf::from(path), source };
        let file = File::options().read(true).write(true).create(true).truncate(false).open(path).map_err(failed)?;
        if let Err(locked) = lock(&file) {
            let process = locked.process.map_or_else(String::new, |process| format!(" (process {process})"));
            let busy = format!("another simulator uses it{process}");
            return Err(failed(io::Error::new(io::ErrorKind::ResourceBusy, busy)));
        }
        let mut text = String::new();
        (&file).read_to_string(&mut text).map_err(failed)?;
        let devices = parse(&text).map_err(|why| BenchError::Usage(format!("{}: {why}", path.display())))?;
        Ok(StateFile { inner: Arc::new(Mutex::new(Inner { file, devices })) })
    }

    /// Returns the settings that a device has stored in an earlier run.
    pub(super) fn get(&self, kind: &str, serial: u32) -> Option<Stored> {
        self.inner.lock().ok()?.devices.get(&(kind.to_owned(), serial)).cloned()
    }

    /// Writes the stored settings of a device.
    pub(super) fn set(&self, kind: &str, serial: u32, stored: &Stored) -> io::Result<()> {
        let Ok(mut inner) = self.inner.lock() else { return Ok(()) };
        inner.devices.insert((kind.to_owned(), serial), stored.clone());
        let text = text(&inner.devices);
        inner.file.rewind()?;
        inner.file.write_all(text.as_bytes())?;
        inner.file.set_len(u64::try_from(text.len()).unwrap_or(u64::MAX))?;
        inner.file.sync_data()
    }
}

fn parse(text: &str) -> Result<BTreeMap<(String, u32), Stored>, String> {
    if text.is_empty() {
        return Ok(BTreeMap::new());
    }
    let not_one = "this is not a state file of cangauge";
    let Head { version } = toml::from_str(text).map_err(|_| not_one.to_owned())?;
    if version != VERSION {
        return Err(format!("version {version} of the state file is unknown (this program: {VERSION})"));
    }
    let Text { device, .. } = toml::from_str(text).map_err(|error| format!("{not_one}: {}", error.message()))?;
    let stored = device.into_iter().map(|Entry { kind, serial, node, bit_rate, objects }| {
        let objects = objects.into_iter().map(|(object, digits)| Some((object, bytes(&digits)?)));
        let objects = objects.collect::<Option<_>>().ok_or(not_one)?;
        Ok(((kind, serial), Stored { node, bit_rate, objects }))
    });
    stored.collect()
}

fn bytes(digits: &str) -> Option<Vec<u8>> {
    let pairs = (0..digits.len()).step_by(2).map(|at| u8::from_str_radix(digits.get(at..at + 2)?, 16).ok());
    pairs.collect()
}

fn text(devices: &BTreeMap<(String, u32), Stored>) -> String {
    let mut text = format!("# Stored settings of simulated devices (cangauge sim --state)\nversion = {VERSION}\n");
    for ((kind, serial), Stored { node, bit_rate, objects }) in devices {
        let kind = kind.replace('\\', "\\\\").replace('"', "\\\"");
        let _ = write!(text, "\n[[device]]\nkind = \"{kind}\"\nserial = {serial}\n");
        let _ = node.map(|node| writeln!(text, "node = {node}"));
        let _ = bit_rate.map(|rate| writeln!(text, "bit_rate = {rate}"));
        let pair = |(object, bytes): (&ObjectId, &Vec<u8>)| {
            let digits: String = bytes.iter().map(|byte| format!("{byte:02X}")).collect();
            format!("\"{object}\" = \"{digits}\"\n")
        };
        if !objects.is_empty() {
            text += "[device.objects]\n";
            text.extend(objects.iter().map(pair));
        }
    }
    text
}

#[cfg(test)]
mod tests {
    use super::*;

    fn stored(node: u8) -> Stored {
        let objects =
            [(ObjectId::new(0x1017, 0), vec![0xe8, 3]), (ObjectId::new(0x1a00, 1), vec![0x20, 1, 0x30, 0x61])];
        Stored { node: NodeId::new(node).ok(), bit_rate: Some(125_000), objects: objects.into() }
    }

    #[test]
    fn text_round_trips() {
        let mut devices =
            BTreeMap::from([(("mh4".to_owned(), 10001), stored(5)), (("a \"b\\.eds".to_owned(), 1), stored(0))]);
        devices.insert(("dps".to_owned(), 7), Stored { bit_rate: None, objects: BTreeMap::new(), ..stored(127) });
        assert_eq!(parse(&text(&devices)), Ok(devices));
        assert_eq!(parse(""), Ok(BTreeMap::new()));
    }

    #[test]
    fn other_files_are_refused_and_not_changed() {
        for (text, why) in [
            ("version = 2\nnew = true\n", "version 2 of the state file is unknown (this program: 1)"),
            ("time,node\n1,2\n", "this is not a state file of cangauge"),
            ("clock = \"real\"\n", "this is not a state file of cangauge"),
            (
                "version = 1\n[[device]]\nkind = \"mh4\"\nserial = 1\nobjects = { \"0x1017\" = \"E\" }\n",
                "this is not a state file of cangauge",
            ),
        ] {
            assert_eq!(parse(text), Err(why.to_owned()), "{text}");
        }
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state");
        std::fs::write(&path, "version = 9\n").expect("written");
        assert!(matches!(StateFile::open(&path), Err(BenchError::Usage(_))));
        assert_eq!(std::fs::read_to_string(&path).expect("read"), "version = 9\n");
    }

    #[test]
    fn file_has_one_user_and_keeps_other_devices() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("state");
        let file = StateFile::open(&path).expect("opened");
        assert!(matches!(StateFile::open(&path), Err(BenchError::Io { .. })));
        file.set("mh4", 1, &stored(5)).expect("written");
        file.set("dps", 1, &stored(9)).expect("written");
        drop(file);
        let file = StateFile::open(&path).expect("opened again");
        file.set("mh4", 1, &Stored { objects: BTreeMap::new(), ..stored(6) }).expect("written");
        drop(file);
        let file = StateFile::open(&path).expect("opened again");
        assert_eq!(
            (file.get("dps", 1), file.get("mh4", 1).and_then(|it| it.node)),
            (Some(stored(9)), NodeId::new(6).ok())
        );
        assert_eq!(file.get("dps", 2), None);
    }
}
