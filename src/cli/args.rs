//! Types of arguments: nodes, signals, objects, durations. Arguments are checked here, before a bus is opened.

use cangauge::bus::claim::Claim;
use cangauge::bus::remote::Remote;
use cangauge::canopen::id::{CanId, NodeId, bit_rate, parse_u32};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::DataType;
use cangauge::measure::decode::Wanted;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use std::collections::BTreeSet;
use std::fmt;
use std::str::FromStr;

/// A duration: `500ms`, `10s`, `1h30m`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Duration(pub std::time::Duration);

impl FromStr for Duration {
    type Err = String;

    fn from_str(text: &str) -> Result<Duration, String> {
        match humantime::parse_duration(text) {
            Ok(duration) if duration.is_zero() => Err("a duration must be longer than 0".to_owned()),
            Ok(duration) => Ok(Duration(duration)),
            Err(_) if text.parse::<f64>().is_ok() => Err(format!("\"{text}\" has no unit (500ms, 10s, 1h30m)")),
            Err(_) => Err(format!("\"{text}\" is not a duration (500ms, 10s, 1h30m)")),
        }
    }
}

/// A bus load in percent, 5 to 100: `50%`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Load(pub u8);

impl FromStr for Load {
    type Err = String;

    fn from_str(text: &str) -> Result<Load, String> {
        let number = text.strip_suffix('%').map(str::trim_end).and_then(|number| number.parse().ok());
        let load = number.filter(|load| (5..=100).contains(load)).map(Load);
        load.ok_or_else(|| "not a bus load (5% to 100%)".to_owned())
    }
}

/// A bit rate in bit/s: `250k`, `1M`, `125000`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BitRate(pub u32);

impl FromStr for BitRate {
    type Err = String;

    fn from_str(text: &str) -> Result<BitRate, String> {
        bit_rate(text).map(BitRate)
    }
}

/// Nodes: `5`, `0x7f`, `1-16`, `1,5,0x10-0x1f`, `all`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Nodes {
    /// All nodes on the bus.
    All,
    /// These nodes, in ascending order.
    These(Vec<NodeId>),
}

impl Nodes {
    /// The nodes to lock.
    pub(super) fn claim(&self) -> Claim {
        match self {
            Nodes::All => Claim::every_node(),
            Nodes::These(nodes) => Claim::Nodes(nodes.clone()),
        }
    }
}

impl FromStr for Nodes {
    type Err = String;

    fn from_str(text: &str) -> Result<Nodes, String> {
        if text == "all" {
            return Ok(Nodes::All);
        }
        let mut nodes = BTreeSet::new();
        for part in text.split(',') {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let node = |text: &str| {
                text.parse::<NodeId>().map_err(|_| {
                    format!("\"{text}\" is not a valid node-ID (1 to 127; examples: 5, 0x7f, 1-16, 1,5, all)")
                })
            };
            let (first, last) = (node(first)?, node(last)?);
            if first > last {
                return Err(format!("\"{part}\" is in the wrong order: {last}-{first}"));
            }
            nodes.extend(NodeId::all().filter(|node| (first..=last).contains(node)));
        }
        Ok(Nodes::These(nodes.into_iter().collect()))
    }
}

/// A signal or an object: `pressure`, `pressure.status`, `0x6130:1`, `0x6010:0/i16`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SignalArg(pub Wanted);

impl FromStr for SignalArg {
    type Err = String;

    fn from_str(text: &str) -> Result<SignalArg, String> {
        if let Some(name) = text.strip_suffix(".status")
            && is_name(name)
        {
            return Ok(SignalArg(Wanted::Status(name.to_owned())));
        }
        // `6130:1` is an object; a hexadecimal word that starts with a letter, such as `face`, is a name.
        if text.starts_with(|first: char| first.is_ascii_digit()) {
            let (object, data_type) = match text.split_once('/') {
                Some((object, data_type)) if object.parse::<ObjectId>().is_ok() => {
                    (object, Some(data_type.parse::<DataType>().map_err(|error| error.to_string())?))
                }
                _ => (text, None),
            };
            if let Some(data_type) = data_type.filter(|data_type| !data_type.is_number()) {
                return Err(format!("\"{text}\": {data_type} is not a number type (i16, u32, r32)"));
            }
            match object.parse::<ObjectId>() {
                Ok(object) => return Ok(SignalArg(Wanted::Object(object, data_type))),
                Err(error) if data_type.is_some() || ObjectId::looks_like_address(text) => {
                    return Err(error.to_string());
                }
                Err(_) => {}
            }
        }
        if !text.trim().is_empty() {
            return Ok(SignalArg(Wanted::Signal(text.trim().to_owned())));
        }
        Err(format!("\"{text}\" is neither a signal (pressure, temperature, ch1) nor an object (0x6130:1)"))
    }
}

fn is_name(text: &str) -> bool {
    text.starts_with(|first: char| first.is_ascii_alphabetic())
        && text.chars().all(|character| character.is_ascii_alphanumeric() || character == '-' || character == '_')
}

/// An object by address or by name.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ObjectArg {
    /// `0x6130:1`.
    Address(ObjectId),
    /// `producer-heartbeat-time`, `ai-input-pv:1`.
    Name(String),
}

impl FromStr for ObjectArg {
    type Err = String;

    fn from_str(text: &str) -> Result<ObjectArg, String> {
        if let Ok(object) = text.parse() {
            return Ok(ObjectArg::Address(object));
        }
        if !text.trim().is_empty() && !ObjectId::looks_like_address(text) {
            return Ok(ObjectArg::Name(text.trim().to_owned()));
        }
        Err(format!("\"{text}\" is neither an object (0x1018:1) nor a name (vendor-id, ai-input-pv:1)"))
    }
}

impl fmt::Display for ObjectArg {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ObjectArg::Address(object) => object.fmt(f),
            ObjectArg::Name(name) => f.write_str(name),
        }
    }
}

/// The value of `--bus`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum BusSpec {
    /// A SocketCAN interface.
    SocketCan(String),
    /// The simulated bus, with the text after `sim:`.
    Sim(Option<String>),
    /// A recording: `FILE`, `FILE:CHANNEL`, or `-`.
    Replay(String),
    /// A serial adapter, or a socketcand server.
    Remote(Remote),
}

impl FromStr for BusSpec {
    type Err = String;

    fn from_str(text: &str) -> Result<BusSpec, String> {
        if let Some(remote) = Remote::parse(text) {
            return remote.map(BusSpec::Remote);
        }
        match text.split_once(':') {
            None if text == "sim" => Ok(BusSpec::Sim(None)),
            Some(("sim", rest)) => Ok(BusSpec::Sim(Some(rest.to_owned()))),
            Some(("socketcan", name)) => interface(name),
            Some(("replay", file)) if !file.is_empty() => Ok(BusSpec::Replay(file.to_owned())),
            None => interface(text),
            Some(_) => Err(format!(
                "\"{text}\" is not a bus (can0, socketcan:can0, socketcand://HOST/can0, slcan:/dev/ttyACM0@250k, sim, \
                 sim:mh4@5,dps@127, sim:FILE.toml, replay:FILE)"
            )),
        }
    }
}

impl BusSpec {
    /// Returns a short name for the bench: `can0`, `sim`, `replay`. For an adapter, it is the last part of its name.
    pub(super) fn short_name(&self) -> String {
        match self {
            BusSpec::SocketCan(name) => name.clone(),
            BusSpec::Sim(_) => "sim".to_owned(),
            BusSpec::Replay(_) => "replay".to_owned(),
            BusSpec::Remote(remote) => {
                let name = remote.to_string();
                let name = name.split('@').next().unwrap_or_default();
                name.rsplit('/').next().unwrap_or_default().to_owned()
            }
        }
    }
}

impl fmt::Display for BusSpec {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            BusSpec::SocketCan(name) => f.write_str(name),
            BusSpec::Sim(None) => f.write_str("sim"),
            BusSpec::Sim(Some(bench)) => write!(f, "sim:{bench}"),
            BusSpec::Replay(file) => write!(f, "replay:{file}"),
            BusSpec::Remote(remote) => remote.fmt(f),
        }
    }
}

/// Returns a parser for one of these values. The help and the completions list their names.
pub(super) fn one_of<T>(values: &'static [T], name: fn(T) -> &'static str) -> impl TypedValueParser<Value = T>
where
    T: Copy + Send + Sync + 'static,
{
    let names = PossibleValuesParser::new(values.iter().map(|value| name(*value)));
    names.try_map(move |text| values.iter().copied().find(|value| name(*value) == text).ok_or("an unknown name"))
}

/// A tag: `part=P107`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Tag {
    /// The name.
    pub key: String,
    /// The value.
    pub value: String,
}

/// The longest name and the longest value of a tag, in bytes.
const LONGEST_TAG: (usize, usize) = (64, 256);

/// Names that recordings, or the programs that receive them, use for other data.
const RESERVED_TAGS: [&str; 12] =
    ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw", "run", "row", "serial", "name"];

impl FromStr for Tag {
    type Err = String;

    fn from_str(text: &str) -> Result<Tag, String> {
        let (key, value) = text.split_once('=').ok_or_else(|| format!("\"{text}\" is not a tag (part=P107)"))?;
        let is_name = key.starts_with(|first: char| first.is_ascii_alphabetic())
            && key.len() <= LONGEST_TAG.0
            && key.bytes().all(|byte| byte.is_ascii_alphanumeric() || byte == b'_' || byte == b'-');
        if !is_name {
            return Err(format!("\"{key}\" is not a name of a tag (a letter, then letters, digits, _ or -)"));
        }
        if RESERVED_TAGS.contains(&key) {
            return Err(format!("the name \"{key}\" has another meaning in recordings: choose another tag"));
        }
        if value.is_empty() || value.len() > LONGEST_TAG.1 {
            return Err(format!("the value of the tag \"{key}\" must have 1 to {} bytes", LONGEST_TAG.1));
        }
        if value.contains(|letter: char| letter.is_control() || letter == '\\') {
            return Err(format!("the value of the tag \"{key}\" must not contain \\ or control characters"));
        }
        Ok(Tag { key: key.to_owned(), value: value.to_owned() })
    }
}

/// Converts tags to pairs of name and value.
///
/// # Errors
/// A name occurs twice.
pub(super) fn tag_pairs(tags: &[Tag]) -> Result<Vec<(String, String)>, String> {
    let mut pairs: Vec<(String, String)> = Vec::new();
    for Tag { key, value } in tags {
        if pairs.iter().any(|(known, _)| known == key) {
            return Err(format!("the tag \"{key}\" is given twice"));
        }
        pairs.push((key.clone(), value.clone()));
    }
    Ok(pairs)
}

/// The name of an interface: `can0`, `socketcan:can0`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct InterfaceName(pub String);

impl FromStr for InterfaceName {
    type Err = String;

    fn from_str(text: &str) -> Result<InterfaceName, String> {
        match text.parse()? {
            BusSpec::SocketCan(name) => Ok(InterfaceName(name)),
            BusSpec::Sim(_) | BusSpec::Replay(_) | BusSpec::Remote(_) => {
                Err(format!("\"{text}\" is not a CAN interface of this computer (can0)"))
            }
        }
    }
}

fn interface(name: &str) -> Result<BusSpec, String> {
    let is_valid = (1..16).contains(&name.len()) && !name.contains(['/', ' ', '\0']);
    if is_valid {
        Ok(BusSpec::SocketCan(name.to_owned()))
    } else {
        Err(format!("\"{name}\" is not the name of an interface"))
    }
}

/// A description named by the user: `mh4`, `FILE.toml`, `5=mh4`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Override {
    /// The node of the description; `None` for all nodes.
    pub node: Option<NodeId>,
    /// A built-in name or a file.
    pub what: String,
}

impl FromStr for Override {
    type Err = String;

    fn from_str(text: &str) -> Result<Override, String> {
        match text.split_once('=') {
            Some((node, what)) => {
                let node = node.parse().map_err(|error| format!("{error}"))?;
                Ok(Override { node: Some(node), what: what.to_owned() })
            }
            None => Ok(Override { node: None, what: text.to_owned() }),
        }
    }
}

/// An SDO channel named by the user: `0x645:0x5C5`, `5=0x645:0x5C5`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel {
    /// The node; `None` for the only node of the command.
    pub node: Option<NodeId>,
    /// The COB-ID of requests.
    pub request: CanId,
    /// The COB-ID of answers.
    pub response: CanId,
}

impl FromStr for Channel {
    type Err = String;

    fn from_str(text: &str) -> Result<Channel, String> {
        let (node, ids) = match text.split_once('=') {
            Some((node, ids)) => (Some(node.parse().map_err(|error| format!("{error}"))?), ids),
            None => (None, text),
        };
        let id = |text: &str| {
            // 000h is NMT, 001h to 080h are emergency stops and SYNC, 7E4h and 7E5h are LSS.
            let number = parse_u32(text).and_then(|number| u16::try_from(number).ok());
            let id = number.filter(|number| (0x81..0x7e4).contains(number)).and_then(CanId::standard);
            id.ok_or_else(|| format!("\"{text}\" is not a COB-ID for SDO (0x081 to 0x7E3)"))
        };
        let (request, response) = ids.split_once(':').ok_or("an SDO channel is TX:RX, for example 0x645:0x5C5")?;
        let (request, response) = (id(request)?, id(response)?);
        if request == response {
            return Err("requests and answers need different COB-IDs".to_owned());
        }
        Ok(Channel { node, request, response })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nodes(text: &str) -> Result<Vec<u8>, String> {
        match text.parse()? {
            Nodes::All => Ok(Vec::new()),
            Nodes::These(nodes) => Ok(nodes.into_iter().map(NodeId::get).collect()),
        }
    }

    #[test]
    fn nodes_are_never_clamped() {
        assert_eq!(nodes("5"), Ok(vec![5]));
        assert_eq!(nodes("0x7f"), Ok(vec![127]));
        assert_eq!(nodes("1,5,0x10-0x12,5"), Ok(vec![1, 5, 16, 17, 18]));
        assert_eq!(nodes("all"), Ok(vec![]));
        for wrong in ["0", "200", "128", "1-200", "5-1", "", "1,", "-3", "1-", "a", "All"] {
            assert!(nodes(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn signals_objects_and_names() {
        let signal = |text: &str| text.parse::<SignalArg>().map(|signal| signal.0);
        assert_eq!(signal("pressure"), Ok(Wanted::Signal("pressure".into())));
        assert_eq!(signal("pressure.status"), Ok(Wanted::Status("pressure".into())));
        assert_eq!(signal("ch16"), Ok(Wanted::Signal("ch16".into())));
        assert_eq!(signal("6130:1"), Ok(Wanted::Object(ObjectId::new(0x6130, 1), None)));
        assert!(signal("6130:300").is_err() && signal("").is_err() && signal("12345").is_err());

        let object = |text: &str| text.parse::<ObjectArg>();
        assert_eq!(object("1018:1"), Ok(ObjectArg::Address(ObjectId::new(0x1018, 1))));
        assert_eq!(object("Vendor-ID"), Ok(ObjectArg::Name("Vendor-ID".into())));
        assert_eq!(object("ai-input-pv:1"), Ok(ObjectArg::Name("ai-input-pv:1".into())));
        for name in
            ["offset", "Position Value", "4-20-ma-input", "1-transmit-pdo-parameter:2", "\u{fc}berdruck", "4. value"]
        {
            assert_eq!(object(name), Ok(ObjectArg::Name(name.into())), "{name}");
            assert_eq!(signal(name), Ok(Wanted::Signal(name.into())), "{name}");
        }
        assert!(object("").is_err() && object("6130:300").is_err() && object("12345").is_err());
    }

    #[test]
    fn bit_rates() {
        let rate = |text: &str| text.parse::<BitRate>().ok().map(|rate| rate.0);
        assert_eq!(rate("250k"), Some(250_000));
        assert_eq!(rate("1M"), Some(1_000_000));
        assert_eq!(rate("125000"), Some(125_000));
        for wrong in ["", "k", "0", "0k", "2M", "1m", "250", "+250k", "-1", "250 k", "83.3k", "5000000k", "auto"] {
            assert_eq!(rate(wrong), None, "{wrong}");
        }
    }

    #[test]
    fn buses() {
        assert_eq!("can0".parse(), Ok(BusSpec::SocketCan("can0".into())));
        assert_eq!("socketcan:vcan1".parse(), Ok(BusSpec::SocketCan("vcan1".into())));
        assert_eq!("sim".parse(), Ok(BusSpec::Sim(None)));
        assert_eq!("sim:mh4@5,dps@127".parse(), Ok(BusSpec::Sim(Some("mh4@5,dps@127".into()))));
        assert_eq!("replay:a:b.log".parse(), Ok(BusSpec::Replay("a:b.log".into())));
        for wrong in ["", "foo:bar", "replay:", "a/b", "a-name-that-is-too-long"] {
            assert!(wrong.parse::<BusSpec>().is_err(), "{wrong}");
        }
    }
}
