//! Parses the names of remote buses, which are reached over a byte stream, and opens them.

use super::port::Place;
pub use super::port::{SerialAdapter, adapters};
use super::slcan::Slcan;
use super::socketcand::Client;
use super::stream::StreamBus;
use super::{Bus, BusError, Mode};
use crate::canopen::id::bit_rate;
use std::fmt;

/// The default TCP port of socketcand.
pub const SOCKETCAND_PORT: u16 = 29536;
/// The default speed of a serial port, in bit/s. Adapters with USB ignore it.
const SERIAL_SPEED: u32 = 115_200;

/// A bus behind a byte stream: `socketcand://HOST[:PORT]/BUS`, `slcan:DEVICE@RATE`, `slcan:tcp://HOST:PORT@RATE`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Remote {
    name: String,
    place: Place,
    transport: Transport,
}

#[derive(Clone, Debug, PartialEq, Eq)]
enum Transport {
    /// The name of the bus on the server.
    Socketcand(String),
    /// The bit rate in bit/s.
    Slcan(u32),
}

/// The purpose of opening a bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Use {
    /// To send and to receive.
    Normal,
    /// To receive only. The adapter does not send acknowledgements.
    Listen,
    /// To set the bit rate first. The channel stays closed.
    Configure,
}

impl Remote {
    /// Parses the name of a bus; `None` for other kinds of buses.
    ///
    /// # Errors
    /// The name is invalid. The text describes the mistake.
    pub fn parse(text: &str) -> Option<Result<Remote, String>> {
        if let Some(rest) = text.strip_prefix("socketcand://") {
            let parsed =
                parse_socketcand(rest).ok_or_else(|| format!("\"{text}\" is not socketcand://HOST[:PORT]/BUS"));
            return Some(parsed.map(|(place, bus)| Remote {
                name: text.to_owned(),
                place,
                transport: Transport::Socketcand(bus),
            }));
        }
        let rest = text.strip_prefix("slcan:")?;
        Some(parse_slcan(rest).map(|(place, bit_rate)| Remote {
            name: text.to_owned(),
            place,
            transport: Transport::Slcan(bit_rate),
        }))
    }

    /// Opens the bus.
    ///
    /// # Errors
    /// The adapter or server cannot be reached, or rejects the request.
    pub fn open(&self, purpose: Use) -> Result<Box<dyn Bus>, BusError> {
        Ok(match &self.transport {
            Transport::Socketcand(bus) => Box::new(StreamBus::open(&self.name, &self.place, Client::new(bus))?),
            Transport::Slcan(bit_rate) => {
                let mode = match purpose {
                    Use::Normal => Some(Mode::Normal),
                    Use::Listen => Some(Mode::ListenOnly),
                    Use::Configure => None,
                };
                Box::new(StreamBus::open(&self.name, &self.place, Slcan::new(*bit_rate, mode))?)
            }
        })
    }
}

impl fmt::Display for Remote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

/// Parses `HOST[:PORT]/BUS`.
fn parse_socketcand(text: &str) -> Option<(Place, String)> {
    let (host, bus) = text.split_once('/')?;
    let is_word =
        |text: &str| !text.is_empty() && text.bytes().all(|byte| byte.is_ascii_graphic() && !b"<>/".contains(&byte));
    let place = parse_tcp(host, Some(SOCKETCAND_PORT))?;
    is_word(bus).then(|| (place, bus.to_owned()))
}

/// Parses `HOST:PORT` and `[::1]:PORT`.
fn parse_tcp(text: &str, default_port: Option<u16>) -> Option<Place> {
    let (host, port) = match text.strip_prefix('[') {
        Some(rest) => {
            let (host, port) = rest.split_once(']')?;
            (host, if port.is_empty() { None } else { Some(port.strip_prefix(':')?) })
        }
        None => text.split_once(':').map_or((text, None), |(host, port)| (host, Some(port))),
    };
    let port = match port {
        Some(port) => port.parse().ok().filter(|port| *port > 0),
        None => default_port,
    };
    (!host.is_empty()).then_some(())?;
    Some(Place::Tcp(host.to_owned(), port?))
}

/// Parses `DEVICE@RATE[,serial=SPEED]` and `tcp://HOST:PORT@RATE`.
fn parse_slcan(text: &str) -> Result<(Place, u32), String> {
    let (text, speed) = match text.rsplit_once(",serial=") {
        Some((text, speed)) => (text, Some(speed)),
        None => (text, None),
    };
    let Some((device, rate)) = text.rsplit_once('@').filter(|(device, rate)| !device.is_empty() && !rate.is_empty())
    else {
        let device = text.trim_end_matches('@');
        return Err(format!("\"slcan:{text}\" has no bit rate; add that of the bus: slcan:{device}@250k"));
    };
    let rate = bit_rate(rate)?;
    let place = match device.strip_prefix("tcp://") {
        Some(host) if speed.is_none() => {
            parse_tcp(host, None).ok_or_else(|| format!("\"slcan:{text}\" is not slcan:tcp://HOST:PORT@RATE"))?
        }
        Some(_) => return Err(format!("\"slcan:{text}\": serial= is for a serial port, not for TCP")),
        None => {
            let speed = match speed {
                Some(speed) => speed.parse().ok().filter(|speed| *speed > 0),
                None => Some(SERIAL_SPEED),
            };
            Place::Serial(device.into(), speed.ok_or("serial= needs a speed in bit/s, for example serial=115200")?)
        }
    };
    Ok((place, rate))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(text: &str) -> Option<(Place, Transport)> {
        let remote = Remote::parse(text).expect("a remote bus").ok()?;
        assert_eq!(remote.to_string(), text);
        Some((remote.place, remote.transport))
    }

    #[test]
    fn names_of_remote_buses() {
        let tcp = |host: &str, port| Place::Tcp(host.to_owned(), port);
        let server = |host, port, bus: &str| Some((tcp(host, port), Transport::Socketcand(bus.to_owned())));
        assert_eq!(place("socketcand://pi/can0"), server("pi", 29536, "can0"));
        assert_eq!(place("socketcand://10.0.0.7:4000/vcan1"), server("10.0.0.7", 4000, "vcan1"));
        assert_eq!(place("socketcand://[::1]:4000/can0"), server("::1", 4000, "can0"));
        let adapter = |path: &str, speed, rate| Some((Place::Serial(path.into(), speed), Transport::Slcan(rate)));
        assert_eq!(place("slcan:/dev/ttyACM0@250k"), adapter("/dev/ttyACM0", 115_200, 250_000));
        assert_eq!(place("slcan:COM3@1M,serial=3000000"), adapter("COM3", 3_000_000, 1_000_000));
        assert_eq!(place("slcan:tcp://wifi:35000@125k"), Some((tcp("wifi", 35000), Transport::Slcan(125_000))));
        for wrong in [
            "socketcand://",
            "socketcand://pi",
            "socketcand://pi/",
            "socketcand:///can0",
            "socketcand://pi:0/can0",
            "socketcand://pi:70000/can0",
            "socketcand://pi/a b",
            "socketcand://pi/> <",
            "slcan:/dev/ttyACM0",
            "slcan:/dev/ttyACM0@",
            "slcan:@250k",
            "slcan:/dev/ttyACM0@250",
            "slcan:/dev/ttyACM0@250k,serial=fast",
            "slcan:tcp://wifi@250k",
            "slcan:tcp://wifi:1@250k,serial=115200",
        ] {
            assert_eq!(place(wrong), None, "{wrong}");
        }
        assert_eq!(Remote::parse("can0"), None);
    }
}
