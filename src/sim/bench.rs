//! Benches: the simulated devices on a bus, and their settings.
//!
//! `mh4@5,dps@127,dps@unconfigured`, `mh4@5:pressure=0bar` with a constant value, `FILE.eds@5`, or a TOML file:
//!
//! ```toml
//! clock = "virtual"          # default: "real"
//! bit_rate = 125000          # bit rate of the bus at the start, in bit/s; default: 250000
//! retime = false             # whether the program may change the bit rate; default: true
//! seed = 7                   # seed of the noise; default: 0
//! record = "truth.csv"       # record of the values sent, in the folder of this file
//! state = "state.toml"       # file with the stored settings and the node-IDs, for the next run
//!
//! [[device]]
//! kind = "mh4"               # a built-in description, or a description file in the folder of this file
//! node = 5                   # node-ID; without it the device is unconfigured
//! duplicate_id = true        # another device may have the same node-ID
//! bit_rate = 125000          # at a different bit rate than the bus, the device neither receives nor sends
//! latency = "300us"          # response time
//! offline_after = ["reset"]  # after this, the device is offline until a power cycle; or "activate"
//! connected = { from = "2s", until = "9s" }    # plugged in and unplugged; default: always connected
//! answers_only = ["0x1000"]  # no answer to SDO requests for any other object
//! serial = 4711
//! start = true               # becomes OPERATIONAL by itself
//! set = { "0x1017" = 100, "0x1800:5" = 100 }   # stored values
//!
//! [device.lss]               # keys are services, by the command specifier of the request
//! lose = [0x17]              # the next answer is lost, once per entry
//! late = { "0x11" = "2s" }   # the next answer is late
//! refuse = { "0x17" = 1 }    # always rejected, with this error code: 11h, 13h, 17h
//! endless_fastscan = true    # answers every fastscan frame in configuration state
//!
//! [[device.channel]]         # a measured quantity; if a key is missing, its default is used
//! channel = 1
//! base = 5.0
//! amplitude = 1.0
//! period_s = 10.0
//! noise = 0.0
//! form = "ramp"              # from base - amplitude to base + amplitude in each period; default: "sine"
//! csv = "course.csv"         # replaces the keys above: lines of SECONDS,VALUE
//!
//! [[device.overload]]
//! channel = 1
//! from = "1s"
//! until = "2s"               # default: no end
//! direction = "high"         # or "low"
//! ```

mod file;
mod values;

use super::device::Device;
use super::record::Recorder;
use super::state::StateFile;
use crate::bus::memory::{BIT_RATE, Clock, MemoryBus};
use crate::device::config_file::SyntaxError;
pub(super) use file::value_in;
use file::{BenchFile, DeviceEntry};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

/// The word that replaces the node-ID of an unconfigured device.
const UNCONFIGURED: &str = "unconfigured";

/// The bench of `sim` without arguments.
const DEFAULT: &str = "mh4@1,d20@2,mc1609@3,dps@127";

/// Devices that can be attached to a bus.
pub struct Bench {
    clock: Clock,
    bit_rate: u32,
    retime: bool,
    record: Option<PathBuf>,
    state: Option<PathBuf>,
    devices: Vec<Device>,
}

/// A bench that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// A mistake in the bench; nothing was opened.
    #[error("{0}")]
    Usage(String),
    /// A file cannot be opened.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        source: std::io::Error,
    },
}

impl Bench {
    /// Reads the text after `sim:`; empty text means the default bench.
    ///
    /// # Errors
    /// Any mistake in the text, before a file is opened for writing.
    pub fn parse(spec: &str) -> Result<Bench, BenchError> {
        if spec.is_empty() {
            Bench::from_list(DEFAULT)
        } else if Path::new(spec).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            let path = Path::new(spec);
            let folder = path.parent().unwrap_or(Path::new(""));
            let file = parse_file(&read(path)?)
                .map_err(|SyntaxError { place, message }| BenchError::Usage(format!("{spec}:{place}: {message}")))?;
            Bench::build(file, folder).map_err(|error| match error {
                BenchError::Usage(message) => BenchError::Usage(format!("{spec}: {message}")),
                io @ BenchError::Io { .. } => io,
            })
        } else {
            Bench::from_list(spec)
        }
    }

    fn from_list(spec: &str) -> Result<Bench, BenchError> {
        let entries = spec.split(',').map(|text| {
            let (kind, node) = text.rsplit_once('@').ok_or_else(|| {
                BenchError::Usage(format!("\"{text}\" is neither DEVICE@NODE ({DEFAULT}) nor a file (FILE.toml)"))
            })?;
            let mut parts = node.split(':');
            let node = match parts.next().unwrap_or_default() {
                UNCONFIGURED => None,
                number => Some(number.parse().map_err(|error| BenchError::Usage(format!("{text}: {error}")))?),
            };
            Ok(DeviceEntry::new(kind, node, parts.map(str::to_owned).collect()))
        });
        let file =
            BenchFile { device: entries.collect::<Result<_, BenchError>>()?, retime: true, ..BenchFile::default() };
        Bench::build(file, Path::new(""))
    }

    /// Reads a bench file; `folder` is the folder of the files named in it.
    ///
    /// # Errors
    /// TOML errors with their place, unknown keys, devices and objects that do not exist.
    pub fn from_toml(text: &str, folder: &Path) -> Result<Bench, BenchError> {
        let file = parse_file(text)
            .map_err(|SyntaxError { place, message }| BenchError::Usage(format!("{place}: {message}")))?;
        Bench::build(file, folder)
    }

    fn build(file: BenchFile, folder: &Path) -> Result<Bench, BenchError> {
        if file.device.is_empty() {
            return Err(BenchError::Usage("no device".to_owned()));
        }
        let bit_rate = check_rate(file.bit_rate.unwrap_or(BIT_RATE))?;
        let mut taken = BTreeSet::new();
        let mut count_by_kind: BTreeMap<String, u32> = BTreeMap::new();
        let mut devices = Vec::new();
        for entry in &file.device {
            let may_share = entry.duplicate_id || entry.is_partly_connected();
            if let Some(node) = entry.node.filter(|node| !taken.insert(*node) && !may_share) {
                return Err(BenchError::Usage(format!("two devices with node-ID {node}")));
            }
            let before = count_by_kind.entry(entry.kind.clone()).or_default();
            let setup = entry.setup(file.seed, *before, folder)?;
            *before += 1;
            devices.push(Device::new(setup).map_err(|error| BenchError::Usage(format!("{}: {error}", entry.name())))?);
        }
        let record = file.record.map(|path| folder.join(path));
        let state = file.state.map(|path| folder.join(path));
        Ok(Bench { clock: file.clock.into(), bit_rate, retime: file.retime, record, state, devices })
    }

    /// Uses this file for the stored settings of the devices, if it is given.
    pub fn with_state(self, path: Option<PathBuf>) -> Bench {
        Bench { state: path.or(self.state), ..self }
    }

    /// The clock of the bench.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// Returns the devices. With `state`, they have the settings stored in the last run. With `record`, they have a
    /// recorder.
    ///
    /// # Errors
    /// The record cannot be written; the state file has another format, or another process uses it.
    pub fn into_devices(mut self) -> Result<Vec<Device>, BenchError> {
        if let Some(path) = &self.state {
            let file = StateFile::open(path)?;
            self.devices = self.devices.into_iter().map(|device| device.remembering(file.clone())).collect();
        }
        let Some(path) = self.record else { return Ok(self.devices) };
        let recorder = std::fs::File::create(&path)
            .and_then(|file| Recorder::new(Box::new(file)))
            .map_err(|source| BenchError::Io { path, source })?;
        Ok(self.devices.into_iter().map(|device| device.recording(recorder.clone())).collect())
    }

    /// Creates a bus with the devices attached and switched on.
    ///
    /// # Errors
    /// The record cannot be written.
    pub fn open(self) -> Result<MemoryBus, BenchError> {
        let mut bus = MemoryBus::new(self.clock).with_bit_rate(self.bit_rate).with_bit_rate_changes(self.retime);
        self.into_devices()?.into_iter().for_each(|device| bus.attach(device));
        Ok(bus)
    }
}

fn parse_file(text: &str) -> Result<BenchFile, SyntaxError> {
    toml::from_str(text).map_err(|error| SyntaxError::new(text, &error))
}

fn check_rate(bit_rate: u32) -> Result<u32, BenchError> {
    if (1..=1_000_000).contains(&bit_rate) {
        return Ok(bit_rate);
    }
    Err(BenchError::Usage(format!("{bit_rate} bit/s is not a bit rate of CAN (1 to 1000000)")))
}

fn read(path: &Path) -> Result<String, BenchError> {
    std::fs::read_to_string(path).map_err(|source| BenchError::Io { path: path.to_owned(), source })
}

#[cfg(test)]
mod tests;
