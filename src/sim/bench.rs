//! Benches: which simulated devices are on the bus, and how they are set up.
//!
//! `mh4@5,dps@127,dps@unconfigured`, or a TOML file:
//!
//! ```toml
//! clock = "virtual"          # "real" unless given
//! bit_rate = 125000          # of the bus as the program finds it; 250000 unless given
//! retime = false             # the program may not change it; it may unless this is given
//! seed = 7                   # 0 unless given
//! record = "truth.csv"       # what was sent; beside this file
//!
//! [[device]]
//! kind = "mh4"               # a built-in description, or a description file beside this one
//! node = 5                   # without it the device is unconfigured
//! twin = true                # another device may have the same node-ID
//! bit_rate = 125000          # at another one than the bus's the device is deaf and mute
//! latency = "300us"          # how long it thinks before it answers
//! gone_after = ["reset"]     # does not come back after it until power on; or "activate"
//! serial = 4711
//! start = true               # becomes OPERATIONAL by itself
//! set = { "0x1017" = 100, "0x1800:5" = 100 }   # as if written and saved before
//!
//! [device.lss]               # by the service in the request
//! lose = [0x17]              # the next answer is lost; once each
//! late = { "0x11" = "2s" }   # the next answer is late
//! refuse = { "0x17" = 1 }    # always refused, with this error code: 11h, 13h, 17h
//! scans_for_ever = true      # answers every fastscan frame in configuration state
//!
//! [[device.channel]]         # what is not given is as described
//! channel = 1
//! base = 5.0
//! amplitude = 1.0
//! period_s = 10.0
//! noise = 0.0
//!
//! [[device.overload]]
//! channel = 1
//! from = "1s"
//! until = "2s"               # for ever unless given
//! direction = "high"         # or "low"
//! ```

use super::device::Device;
use super::model::{Direction, Overload};
use super::record::Recorder;
use super::setup::{GoneAfter, Oddities, Setup};
use crate::bus::memory::{BIT_RATE, Clock, MemoryBus};
use crate::canopen::id::{NodeId, parse_u32};
use crate::canopen::object::ObjectId;
use crate::device::catalog::{self, Model};
use crate::device::description::{Scalar, SimChannel};
use serde::{Deserialize, Deserializer};
use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Duration;

/// What stands in the place of the node-ID of a device that has none.
const UNCONFIGURED: &str = "unconfigured";

/// The bench when none is described.
const DEFAULT: &str = "mh4@1,d20@2,mc1609@3,dps@127";

/// Devices that are ready to be put on a bus.
pub struct Bench {
    clock: Clock,
    bit_rate: u32,
    retime: bool,
    record: Option<PathBuf>,
    devices: Vec<Device>,
}

/// A bench that cannot be built.
#[derive(Debug, thiserror::Error)]
pub enum BenchError {
    /// What was asked for makes no sense; nothing has been opened.
    #[error("{0}")]
    Usage(String),
    /// A file cannot be opened.
    #[error("{path}: {source}", path = path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the operating system says.
        source: std::io::Error,
    },
}

impl Bench {
    /// Reads what stands behind `sim:`; nothing at all is the bench of plain `sim`.
    ///
    /// # Errors
    /// Everything that is wrong with it, before anything is opened for writing.
    pub fn parse(spec: &str) -> Result<Bench, BenchError> {
        if spec.is_empty() {
            Bench::from_list(DEFAULT)
        } else if Path::new(spec).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            let path = Path::new(spec);
            let beside = path.parent().unwrap_or(Path::new(""));
            Bench::from_toml(&read(path)?, beside).map_err(|error| match error {
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
                BenchError::Usage(format!("\"{text}\" is not DEVICE@NODE ({DEFAULT}) and no file FILE.toml"))
            })?;
            let node = match node {
                UNCONFIGURED => None,
                number => Some(number.parse().map_err(|error| BenchError::Usage(format!("{text}: {error}")))?),
            };
            Ok(DeviceEntry { kind: kind.to_owned(), node, ..DeviceEntry::default() })
        });
        let file =
            BenchFile { device: entries.collect::<Result<_, BenchError>>()?, retime: true, ..BenchFile::default() };
        Bench::build(file, Path::new(""))
    }

    /// Reads a bench description; files that it names stand in the folder `beside`.
    ///
    /// # Errors
    /// TOML errors with their line, unknown keys, devices and objects that do not exist.
    pub fn from_toml(text: &str, beside: &Path) -> Result<Bench, BenchError> {
        let file = toml::from_str(text).map_err(|error| {
            let before = error.span().and_then(|span| text.get(..span.start)).unwrap_or("");
            BenchError::Usage(format!("line {}: {}", before.matches('\n').count() + 1, error.message()))
        })?;
        Bench::build(file, beside)
    }

    fn build(file: BenchFile, beside: &Path) -> Result<Bench, BenchError> {
        if file.device.is_empty() {
            return Err(BenchError::Usage("no device".to_owned()));
        }
        let bit_rate = check_rate(file.bit_rate.unwrap_or(BIT_RATE))?;
        let mut taken = BTreeSet::new();
        let mut of_kind: BTreeMap<String, u32> = BTreeMap::new();
        let mut devices = Vec::new();
        for entry in &file.device {
            if let Some(node) = entry.node.filter(|node| !taken.insert(*node) && !entry.twin) {
                return Err(BenchError::Usage(format!("two devices with node-ID {node}")));
            }
            let before = of_kind.entry(entry.kind.clone()).or_default();
            let setup = entry.setup(file.seed, *before, beside)?;
            *before += 1;
            devices.push(Device::new(setup).map_err(|error| BenchError::Usage(format!("{}: {error}", entry.name())))?);
        }
        let record = file.record.map(|path| beside.join(path));
        Ok(Bench { clock: file.clock.into(), bit_rate, retime: file.retime, record, devices })
    }

    /// The clock that it goes by.
    pub fn clock(&self) -> Clock {
        self.clock
    }

    /// The devices, recording if the bench says so.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn into_devices(self) -> Result<Vec<Device>, BenchError> {
        let Some(path) = self.record else { return Ok(self.devices) };
        let recorder = std::fs::File::create(&path)
            .and_then(|file| Recorder::new(Box::new(file)))
            .map_err(|source| BenchError::Io { path, source })?;
        Ok(self.devices.into_iter().map(|device| device.recording(recorder.clone())).collect())
    }

    /// A bus with the devices on it, their power just switched on.
    ///
    /// # Errors
    /// When the record cannot be written.
    pub fn open(self) -> Result<MemoryBus, BenchError> {
        let mut bus = MemoryBus::new(self.clock).with_bit_rate(self.bit_rate).with_retiming(self.retime);
        self.into_devices()?.into_iter().for_each(|device| bus.attach(device));
        Ok(bus)
    }
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

fn yes() -> bool {
    true
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct BenchFile {
    #[serde(default)]
    clock: ClockName,
    bit_rate: Option<u32>,
    #[serde(default = "yes")]
    retime: bool,
    #[serde(default)]
    seed: u64,
    record: Option<PathBuf>,
    #[serde(default)]
    device: Vec<DeviceEntry>,
}

#[derive(Clone, Copy, Default, Deserialize)]
#[serde(rename_all = "lowercase")]
enum ClockName {
    #[default]
    Real,
    Virtual,
}

impl From<ClockName> for Clock {
    fn from(name: ClockName) -> Clock {
        match name {
            ClockName::Real => Clock::Real,
            ClockName::Virtual => Clock::Virtual,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct DeviceEntry {
    kind: String,
    node: Option<NodeId>,
    #[serde(default)]
    twin: bool,
    bit_rate: Option<u32>,
    #[serde(default, deserialize_with = "duration")]
    latency: Duration,
    #[serde(default)]
    gone_after: Vec<GoneName>,
    #[serde(default)]
    lss: LssEntry,
    serial: Option<u32>,
    #[serde(default)]
    start: bool,
    #[serde(default)]
    set: BTreeMap<ObjectId, Scalar>,
    #[serde(default)]
    channel: Vec<ChannelEntry>,
    #[serde(default)]
    overload: Vec<OverloadEntry>,
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum GoneName {
    Reset,
    Activate,
}

impl From<GoneName> for GoneAfter {
    fn from(name: GoneName) -> GoneAfter {
        match name {
            GoneName::Reset => GoneAfter::Reset,
            GoneName::Activate => GoneAfter::Activate,
        }
    }
}

#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct LssEntry {
    #[serde(default)]
    lose: Vec<u8>,
    #[serde(default)]
    late: BTreeMap<Service, Late>,
    #[serde(default)]
    refuse: BTreeMap<Service, u8>,
    #[serde(default)]
    scans_for_ever: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Deserialize)]
#[serde(try_from = "String")]
struct Service(u8);

impl TryFrom<String> for Service {
    type Error = String;

    fn try_from(text: String) -> Result<Service, String> {
        let number = parse_u32(&text).and_then(|number| u8::try_from(number).ok());
        number.map(Service).ok_or_else(|| format!("\"{text}\" is not a service (\"0x17\")"))
    }
}

#[derive(Clone, Copy, Deserialize)]
struct Late(#[serde(deserialize_with = "duration")] Duration);

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct ChannelEntry {
    channel: u8,
    base: Option<f64>,
    amplitude: Option<f64>,
    period_s: Option<f64>,
    noise: Option<f64>,
    start: Option<f64>,
    end: Option<f64>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct OverloadEntry {
    channel: u8,
    #[serde(deserialize_with = "duration")]
    from: Duration,
    #[serde(default = "for_ever", deserialize_with = "duration")]
    until: Duration,
    direction: DirectionName,
}

fn for_ever() -> Duration {
    Duration::MAX
}

#[derive(Clone, Copy, Deserialize)]
#[serde(rename_all = "lowercase")]
enum DirectionName {
    High,
    Low,
}

fn duration<'de, D: Deserializer<'de>>(deserializer: D) -> Result<Duration, D::Error> {
    humantime::parse_duration(&String::deserialize(deserializer)?).map_err(serde::de::Error::custom)
}

impl DeviceEntry {
    /// As people write it: `mh4@5`.
    fn name(&self) -> String {
        match self.node {
            Some(node) => format!("{}@{node}", self.kind),
            None => format!("{}@{UNCONFIGURED}", self.kind),
        }
    }

    /// `before`: how many devices of this kind come before it; each has its own serial number.
    fn setup(&self, seed: u64, before: u32, beside: &Path) -> Result<Setup, BenchError> {
        let mut setup = Setup::new(self.model(beside)?, self.node.unwrap_or(NodeId::MIN));
        setup.node = self.node;
        setup.bit_rate = self.bit_rate.map(check_rate).transpose()?;
        setup.oddities = Oddities {
            latency: self.latency,
            lose: self.lss.lose.clone(),
            late: self.lss.late.iter().map(|(service, late)| (service.0, late.0)).collect(),
            refuse: self.lss.refuse.iter().map(|(service, code)| (service.0, *code)).collect(),
            scans_for_ever: self.lss.scans_for_ever,
            gone_after: self.gone_after.iter().map(|name| GoneAfter::from(*name)).collect(),
        };
        setup.serial = self.serial.unwrap_or(setup.serial.wrapping_add(before));
        setup.start = self.start;
        setup.set = self.set.iter().map(|(object, value)| (*object, value.clone())).collect();
        setup.seed = seed;
        for changed in &self.channel {
            changed.apply(self.find(&mut setup.channels, changed.channel)?);
        }
        for overload in &self.overload {
            self.find(&mut setup.channels, overload.channel)?;
            if overload.from >= overload.until {
                return Err(BenchError::Usage(format!("{}: an overload that ends before it begins", self.name())));
            }
            let direction = match overload.direction {
                DirectionName::High => Direction::High,
                DirectionName::Low => Direction::Low,
            };
            let scripted = Overload { from: overload.from, until: overload.until, direction };
            setup.overloads.push((overload.channel, scripted));
        }
        Ok(setup)
    }

    fn find<'a>(&self, channels: &'a mut [SimChannel], number: u8) -> Result<&'a mut SimChannel, BenchError> {
        channels
            .iter_mut()
            .find(|channel| channel.channel == number)
            .ok_or_else(|| BenchError::Usage(format!("{} has no channel {number}", self.name())))
    }

    fn model(&self, beside: &Path) -> Result<Arc<Model>, BenchError> {
        if Path::new(&self.kind).extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml")) {
            let path = beside.join(&self.kind);
            let model = Model::from_toml(&read(&path)?);
            return model.map(Arc::new).map_err(|error| BenchError::Usage(format!("{}: {error}", path.display())));
        }
        catalog::by_name(&self.kind).ok_or_else(|| {
            let known: Vec<&str> = catalog::built_in().iter().map(|model| model.description.name.as_str()).collect();
            BenchError::Usage(format!("there is no device \"{}\" ({}, or FILE.toml)", self.kind, known.join(", ")))
        })
    }
}

impl ChannelEntry {
    fn apply(&self, channel: &mut SimChannel) {
        let SimChannel { base, amplitude, period_s, noise, start, end, .. } = channel;
        for (given, value) in [
            (self.base, base),
            (self.amplitude, amplitude),
            (self.period_s, period_s),
            (self.noise, noise),
            (self.start, start),
            (self.end, end),
        ] {
            *value = given.unwrap_or(*value);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::time::Mono;
    use crate::bus::{Bus, Event};

    fn nodes(bench: &Bench) -> Vec<u8> {
        bench.devices.iter().filter_map(|device| Some(device.node()?.get())).collect()
    }

    fn refusal(bench: Result<Bench, BenchError>) -> String {
        match bench {
            Ok(_) => "accepted".to_owned(),
            Err(error) => error.to_string(),
        }
    }

    #[test]
    fn plain_sim_is_the_bench_of_the_contract() {
        let bench = Bench::parse("").expect("the default");
        assert_eq!(nodes(&bench), [1, 2, 3, 127]);
        assert_eq!((bench.clock(), bench.bit_rate), (Clock::Real, 250_000));
    }

    #[test]
    fn lists_of_devices() {
        let bench = Bench::parse("mh4@5,dps@0x7f,mh4@6").expect("a list");
        assert_eq!(nodes(&bench), [5, 127, 6]);
        for (spec, message) in [
            ("mh4", "\"mh4\" is not DEVICE@NODE (mh4@1,d20@2,mc1609@3,dps@127) and no file FILE.toml"),
            ("mh4@200", "mh4@200: \"200\" is not a node-ID (1 to 127)"),
            ("mh4@0", "mh4@0: \"0\" is not a node-ID (1 to 127)"),
            ("mh4@5,", "\"\" is not DEVICE@NODE (mh4@1,d20@2,mc1609@3,dps@127) and no file FILE.toml"),
            ("mh4@5,dps@5", "two devices with node-ID 5"),
            (
                "mh5@5",
                "there is no device \"mh5\" (mh4, d20, dps, mc1609, hydac-old, baumer, hydac, jumo, or FILE.toml)",
            ),
        ] {
            assert_eq!(refusal(Bench::parse(spec)), message);
        }
        assert!(matches!(Bench::parse("no-such-file.toml"), Err(BenchError::Io { .. })));
    }

    #[test]
    fn what_is_wrong_with_a_file_is_told_with_its_line() {
        let text = |text: &str| refusal(Bench::from_toml(text, Path::new("")));
        let device = "[[device]]\nkind = \"mh4\"\nnode = 5\n";
        assert!(text("seed = 1\nsped = 2\n").starts_with("line 2: unknown field `sped`"));
        assert!(text(&format!("{device}nod = 5\n")).starts_with("line 4: unknown field `nod`"));
        assert!(text(&format!("clock = \"unreal\"\n{device}")).starts_with("line 1: unknown variant `unreal`"));
        assert_eq!(text("[[device]]\nkind = \"mh4\"\nnode = 128\n"), "line 3: \"128\" is not a node-ID (1 to 127)");
        assert_eq!(text(&format!("bit_rate = 0\n{device}")), "0 bit/s is not a bit rate of CAN (1 to 1000000)");
        assert_eq!(text("seed = 1\n"), "no device");
        assert_eq!(text(&format!("{device}set = {{ \"0x5000\" = 1 }}\n")), "mh4@5: mh4 has no object 0x5000:0");
        assert_eq!(
            text(&format!("{device}set = {{ \"1017\" = 70000 }}\n")),
            "mh4@5: 0x1017:0: 70000 does not fit u16 (0 to 65535)"
        );
        assert!(text(&format!("{device}set = {{ \"x\" = 1 }}\n")).starts_with("line 4: \"x\" is not an object"));
        assert_eq!(text(&format!("{device}[[device.channel]]\nchannel = 3\n")), "mh4@5 has no channel 3");
        let overload = "[[device.overload]]\nchannel = 1\nfrom = \"2s\"\nuntil = \"1s\"\ndirection = \"high\"\n";
        assert_eq!(text(&format!("{device}{overload}")), "mh4@5: an overload that ends before it begins");
        assert!(text(&format!("{device}{}", overload.replace("2s", "2 parsecs"))).starts_with("line 6: "));
    }

    /// Frames up to `until`.
    fn hear(bus: &mut MemoryBus, until: Duration) -> Vec<String> {
        let mut heard = Vec::new();
        while let Ok(Event::Frame(received)) = bus.receive(Mono::at(until)) {
            heard.push(received.frame.to_string());
        }
        heard
    }

    #[test]
    fn everything_that_a_file_can_say() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("bench.toml");
        let text = r#"
            clock = "virtual"
            bit_rate = 125000
            seed = 7
            record = "truth.csv"

            [[device]]
            kind = "mh4"
            node = 5
            serial = 4711
            start = true
            set = { "0x1017" = 100, "1800:2" = 254, "0x1800:5" = 150 }

            [[device.channel]]
            channel = 1
            base = 5.0
            amplitude = 0.0
            noise = 0.0

            [[device.overload]]
            channel = 1
            from = "200ms"
            direction = "low"

            [[device]]
            kind = "dps"
            node = 127
        "#;
        std::fs::write(&path, text).expect("written");
        let mut bus = Bench::parse(path.to_str().expect("text")).expect("a bench").open().expect("opened");
        assert_eq!(bus.bit_rate(), Some(125_000));
        assert_eq!(
            hear(&mut bus, Duration::from_millis(310)),
            [
                "705#00",
                "77F#00",
                "705#05",
                "185#0000A04000",
                "705#05",
                "085#01F0810105000000",
                "185#0000C07F05",
                "705#05",
            ]
            .map(str::to_owned)
        );
        let serial: ObjectId = "1018:4".parse().expect("an object");
        let now = bus.now().mono;
        let device: &mut Device = bus.stations_mut().next().expect("a device");
        assert_eq!(device.value(serial, now), Some(4711u32.to_le_bytes().to_vec()));
        drop(bus);
        let record = std::fs::read_to_string(folder.path().join("truth.csv")).expect("the record");
        let values: Vec<&str> =
            record.lines().skip(1).filter_map(|line| line.split_once(',')).map(|(_, rest)| rest).collect();
        assert_eq!(values, ["5,pressure,5,bar,ok,0x0000A040", "5,pressure,,bar,overload-low,0x0000C07F"]);
    }

    #[test]
    fn a_record_that_cannot_be_written_is_an_error_of_the_file() {
        let text = "record = \"no/such/folder/truth.csv\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
        let bench = Bench::from_toml(text, Path::new("")).expect("a bench");
        assert!(matches!(bench.open(), Err(BenchError::Io { .. })));
    }

    #[test]
    fn devices_of_a_kind_have_serial_numbers_of_their_own() {
        let mut bus = Bench::parse("mh4@5,dps@6,mh4@7").expect("a list").open().expect("opened");
        let serial: ObjectId = "1018:4".parse().expect("an object");
        let serials: Vec<Option<Vec<u8>>> =
            bus.stations_mut::<Device>().map(|device| device.value(serial, Mono::START)).collect();
        assert_ne!(serials[0], serials[2]);
        assert!(serials.iter().all(|serial| serial.as_deref().is_some_and(|bytes| bytes != [0; 4])));
    }

    #[test]
    fn a_description_of_the_users_own() {
        let folder = tempfile::tempdir().expect("a folder");
        let model = "name = \"own\"\ntitle = \"\"\nvendor = \"\"\nsource = \"\"\n[identify]\n[[object]]\nat = \"0x1000\"\n\
                     name = \"device-type\"\ntype = \"u32\"\naccess = \"ro\"\ndefault = 404\n";
        std::fs::write(folder.path().join("own.toml"), model).expect("written");
        let text = "clock = \"virtual\"\n[[device]]\nkind = \"own.toml\"\nnode = 9\n";
        let mut bus = Bench::from_toml(text, folder.path()).expect("a bench").open().expect("opened");
        bus.send(&"609#4000100000000000".parse().expect("a frame")).expect("room");
        assert_eq!(hear(&mut bus, Duration::from_secs(1)), ["709#00", "589#4300100094010000"]);
    }
}
