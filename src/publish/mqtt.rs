//! MQTT 3.1.1 with QoS 1: one message for each row, on the topic `PREFIX/BENCH/NODE/SIGNAL`.
//!
//! The payload is JSON with run, file and line, so that a subscriber can drop repeated messages. The last value of a
//! topic is retained if it is fresh. `PREFIX/BENCH/status` is `online` or `offline` (birth and will message, retained).

mod packet;

use super::sink::{Record, SendError, Sink, Trouble, io_trouble};
use super::stream::{self, Stream};
use super::target::{Secret, Target};
use super::tls::Trust;
use crate::bus::host::random_word;
use crate::bus::time::HostClock;
use crate::bus::{Mono, Wall};
use packet::{Connect, Received};
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet};
use std::io;
use std::time::Duration;

/// The prefix of topics if the address has no path.
const PREFIX: &str = "cangauge";

/// The most rows in one request: without an acknowledgement, this many messages are repeated.
const MOST_ROWS: usize = 500;

/// The most messages without an acknowledgement.
const WINDOW: usize = 64;

/// The broker expects a packet within this time.
const KEEP_ALIVE: Duration = Duration::from_secs(60);

/// Without rows, a packet is sent after this time.
const PING_INTERVAL: Duration = Duration::from_secs(20);

/// An older row is not retained: it is not the present value.
const FRESH: Duration = Duration::from_secs(10);

/// A broker.
pub struct Mqtt {
    target: Target,
    secret: Option<Secret>,
    trust: Option<Trust>,
    timeout: Duration,
    clock: HostClock,
    prefix: String,
    client: String,
    bench: Option<String>,
    connection: Option<Connection>,
}

/// An open connection.
struct Connection {
    stream: Box<dyn Stream>,
    clock: HostClock,
    timeout: Duration,
    status_topic: String,
    last_id: u16,
    last_sent: Mono,
}

/// The payload of a message.
#[derive(Serialize)]
struct Payload<'a> {
    run: Option<&'a str>,
    file: &'a str,
    line: u64,
    time: String,
    node: u8,
    signal: &'a str,
    value: Option<serde_json::Number>,
    unit: Option<&'a str>,
    status: Option<&'a str>,
    #[serde(skip_serializing_if = "BTreeMap::is_empty")]
    tags: BTreeMap<&'a str, &'a str>,
}

impl Mqtt {
    /// A broker at this address. `timeout` is the longest wait for an answer. With `trust`, the connection uses TLS.
    pub fn new(target: &Target, secret: Option<&Secret>, timeout: Duration, trust: Option<&Trust>) -> Mqtt {
        let prefix = if target.path.is_empty() { PREFIX.to_owned() } else { target.path.join("/") };
        Mqtt {
            target: target.clone(),
            secret: secret.cloned(),
            trust: trust.cloned(),
            timeout,
            clock: HostClock::new(),
            prefix,
            client: format!("cangauge{}", random_word()),
            bench: None,
            connection: None,
        }
    }

    /// The connection. It is opened if necessary.
    fn connected(&mut self) -> Result<&mut Connection, Trouble> {
        if self.connection.is_none() {
            let bench = self.bench.as_deref().unwrap_or_default();
            let status_topic = format!("{}/{}/status", self.prefix, level(bench));
            let (clock, timeout) = (self.clock, self.timeout);
            let stream = stream::open(&self.target, self.trust.as_ref(), timeout, clock)?;
            let mut connection =
                Connection { stream, clock, timeout, status_topic, last_id: 0, last_sent: clock.now().mono };
            connection.start(&self.client, self.secret.as_ref())?;
            self.connection = Some(connection);
        }
        self.connection.as_mut().ok_or(Trouble::Closed)
    }
}

impl Sink for Mqtt {
    fn most_rows(&self) -> usize {
        MOST_ROWS
    }

    fn announce(&mut self, bench: &str) {
        if self.bench.as_deref() != Some(bench) {
            self.close();
            self.bench = Some(bench.to_owned());
        }
    }

    fn encode(&mut self, record: &Record<'_>, out: &mut Vec<u8>) {
        let (row, origin) = (record.row, record.origin);
        let topic = format!("{}/{}/{}/{}", self.prefix, level(&origin.bench), row.node, level(&row.signal));
        let time = Wall::at(Duration::from_micros(u64::try_from(row.time_us).unwrap_or(0)));
        let tags = origin.tags.iter().chain(origin.identity(row.node));
        let payload = Payload {
            run: origin.run.as_deref(),
            file: &origin.file,
            line: record.line,
            time: humantime::format_rfc3339_micros(time.system_time()).to_string(),
            node: row.node,
            signal: &row.signal,
            value: row.value.as_deref().and_then(number),
            unit: Some(&*row.unit).filter(|unit| !unit.is_empty()),
            status: Some(&*row.status).filter(|status| !status.is_empty()),
            tags: tags.map(|(key, value)| (key.as_str(), value.as_str())).collect(),
        };
        let payload = serde_json::to_vec(&payload).unwrap_or_default();
        Message { time_us: row.time_us, topic: topic.as_bytes(), payload: &payload }.push(out);
    }

    fn send(&mut self, rows: &[u8], now: Wall) -> Result<(), SendError> {
        let messages = Message::all(rows);
        let last: BTreeMap<&[u8], usize> =
            messages.iter().enumerate().map(|(at, message)| (message.topic, at)).collect();
        let retains = |at: usize, message: &Message<'_>| last.get(message.topic) == Some(&at) && message.is_fresh(now);
        let connection = self.connected()?;
        let sent = connection.publish(messages.iter().enumerate().map(|(at, message)| Publication {
            topic: str::from_utf8(message.topic).unwrap_or_default(),
            payload: message.payload,
            retain: retains(at, message),
        }));
        if let Err(trouble) = sent {
            self.connection = None;
            return Err(trouble.into());
        }
        Ok(())
    }

    /// Keeps the connection open, so that the broker does not publish the will.
    fn idle(&mut self, _probe: bool) -> Result<(), Trouble> {
        if self.bench.is_none() {
            return Ok(());
        }
        let result = self.connected().and_then(Connection::keep_alive);
        if result.is_err() {
            self.connection = None;
        }
        result
    }

    fn close(&mut self) {
        if let Some(connection) = self.connection.take() {
            connection.end();
        }
    }
}

/// A message to send.
struct Publication<'a> {
    topic: &'a str,
    payload: &'a [u8],
    retain: bool,
}

impl Connection {
    /// Connects to the broker, and publishes the birth message.
    fn start(&mut self, client: &str, secret: Option<&Secret>) -> Result<(), Trouble> {
        let pair = secret.and_then(Secret::user_and_password);
        let topic = self.status_topic.clone();
        let connect = packet::connect(&Connect {
            client,
            user: pair.map(|(user, _)| user).or(secret.map(Secret::text)),
            password: pair.map(|(_, password)| password),
            will: (&topic, "offline"),
            keep_alive_s: u16::try_from(KEEP_ALIVE.as_secs()).unwrap_or(u16::MAX),
        });
        self.write(&connect)?;
        match self.read()? {
            Received::ConnAck(0) => {}
            Received::ConnAck(code @ (4 | 5)) => return Err(Trouble::Unauthorized(code.into())),
            Received::ConnAck(code) => return Err(Trouble::Refused(code)),
            _ => return Err(Trouble::Garbage),
        }
        self.publish([Publication { topic: &topic, payload: b"online", retain: true }].into_iter())
    }

    /// Sends messages, and waits until all are acknowledged.
    fn publish<'a>(&mut self, mut messages: impl Iterator<Item = Publication<'a>>) -> Result<(), Trouble> {
        let mut waiting = BTreeSet::new();
        loop {
            let mut bytes = Vec::new();
            while waiting.len() < WINDOW
                && let Some(message) = messages.next()
            {
                self.last_id = if self.last_id == u16::MAX { 1 } else { self.last_id + 1 };
                packet::push_publish(&mut bytes, self.last_id, message.topic, message.payload, message.retain);
                waiting.insert(self.last_id);
            }
            if waiting.is_empty() {
                return Ok(());
            }
            if !bytes.is_empty() {
                self.write(&bytes)?;
            }
            match self.read()? {
                Received::PubAck(id) if waiting.remove(&id) => {}
                // An acknowledgement of a message that was not sent.
                Received::PubAck(_) | Received::ConnAck(_) => return Err(Trouble::Garbage),
                Received::PingResp => {}
            }
        }
    }

    fn keep_alive(&mut self) -> Result<(), Trouble> {
        if self.clock.now().mono.since(self.last_sent) < PING_INTERVAL {
            return Ok(());
        }
        self.write(&packet::PING)?;
        match self.read()? {
            Received::PingResp => Ok(()),
            _ => Err(Trouble::Garbage),
        }
    }

    fn end(mut self) {
        let topic = self.status_topic.clone();
        let farewell = [Publication { topic: &topic, payload: b"offline", retain: true }];
        // If the broker is gone, it publishes the will itself.
        if self.publish(farewell.into_iter()).is_ok() {
            let _ = self.write(&packet::DISCONNECT);
        }
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), Trouble> {
        self.last_sent = self.clock.now().mono;
        self.stream.set_deadline(self.last_sent + self.timeout);
        self.stream.write_all(bytes).and_then(|()| self.stream.flush()).map_err(|error| io_trouble(&error))
    }

    /// Reads a packet before the time-out.
    fn read(&mut self) -> Result<Received, Trouble> {
        self.stream.set_deadline(self.clock.now().mono + self.timeout);
        packet::read(&mut self.stream).map_err(|error| match error.kind() {
            io::ErrorKind::InvalidData => Trouble::Garbage,
            _ => io_trouble(&error),
        })
    }
}

/// A level of a topic: without separators and wildcards.
fn level(text: &str) -> String {
    text.chars().map(|letter| if letter.is_control() || "/+#".contains(letter) { '_' } else { letter }).collect()
}

/// A number of a recording in JSON.
fn number(text: &[u8]) -> Option<serde_json::Number> {
    let parsed = serde_json::from_slice(text).ok();
    parsed.or_else(|| serde_json::Number::from_f64(str::from_utf8(text).ok()?.parse().ok()?))
}

/// An encoded row: its time, topic and payload, with their lengths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Message<'a> {
    time_us: i64,
    topic: &'a [u8],
    payload: &'a [u8],
}

impl<'a> Message<'a> {
    fn push(&self, out: &mut Vec<u8>) {
        out.extend_from_slice(&self.time_us.to_be_bytes());
        for part in [self.topic, self.payload] {
            out.extend_from_slice(&(part.len() as u64).to_be_bytes());
            out.extend_from_slice(part);
        }
    }

    fn all(mut bytes: &'a [u8]) -> Vec<Message<'a>> {
        fn part<'a>(bytes: &mut &'a [u8]) -> Option<&'a [u8]> {
            let (length, rest) = bytes.split_first_chunk()?;
            let (part, rest) = rest.split_at_checked(usize::try_from(u64::from_be_bytes(*length)).ok()?)?;
            *bytes = rest;
            Some(part)
        }
        let mut next = || {
            let (time, rest) = bytes.split_first_chunk()?;
            bytes = rest;
            let topic = part(&mut bytes)?;
            Some(Message { time_us: i64::from_be_bytes(*time), topic, payload: part(&mut bytes)? })
        };
        std::iter::from_fn(&mut next).collect()
    }

    /// Whether the row is a present value.
    fn is_fresh(&self, now: Wall) -> bool {
        let row = Duration::from_micros(u64::try_from(self.time_us).unwrap_or(0));
        row.abs_diff(now.since_epoch()) <= FRESH
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::row::Row;
    use crate::publish::sink::Origin;
    use std::io::{Read, Write};
    use std::net::TcpListener;
    use std::thread;

    fn sink(address: &str) -> Mqtt {
        let target = Target::parse(&format!("mqtt://{address}/lab")).expect("an address");
        Mqtt::new(&target, Secret::new("me:pass").as_ref(), Duration::from_millis(300), None)
    }

    fn encoded(sink: &mut Mqtt, time_us: i64, bench: &str) -> Vec<u8> {
        let pair = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        let origin = Origin { bench: bench.to_owned(), tags: vec![pair("part", "P1")], ..Origin::default() };
        let origin = Origin { file: "run.csv".to_owned(), identities: vec![(5, vec![pair("serial", "7")])], ..origin };
        let (signal, unit, status) = ("p".into(), "bar".into(), "".into());
        let row = Row { time_us, node: 5, signal, unit, status, value: Some(b"1.250"[..].into()) };
        let mut out = Vec::new();
        sink.encode(&Record { row: &row, line: 2, origin: &origin }, &mut out);
        out
    }

    #[test]
    fn message_of_a_row() {
        let mut sink = sink("127.0.0.1");
        let bytes = encoded(&mut sink, 1_700_000_001_010_001, "a/b+#");
        let [message] = Message::all(&bytes)[..] else { panic!("{bytes:?}") };
        assert_eq!(message.topic, b"lab/a_b__/5/p");
        assert_eq!(
            String::from_utf8_lossy(message.payload),
            "{\"run\":null,\"file\":\"run.csv\",\"line\":2,\"time\":\"2023-11-14T22:13:21.010001Z\",\"node\":5,\
             \"signal\":\"p\",\"value\":1.25,\"unit\":\"bar\",\"status\":null,\
             \"tags\":{\"part\":\"P1\",\"serial\":\"7\"}}"
        );
        let at = |seconds| Wall::at(Duration::from_secs(seconds));
        let fresh = [1_699_999_992, 1_700_000_011, 1_699_999_990, 1_700_000_012].map(|now| message.is_fresh(at(now)));
        assert_eq!(fresh, [true, true, false, false]);
    }

    /// A broker that answers each packet with the next bytes; an absent answer closes the connection.
    fn broker(answers: &'static [&'static [u8]]) -> (String, thread::JoinHandle<Vec<u8>>) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address").to_string();
        let received = thread::spawn(move || {
            let (mut stream, _) = listener.accept().expect("a connection");
            let mut all = Vec::new();
            for answer in answers {
                let mut bytes = [0; 4096];
                let count = stream.read(&mut bytes).expect("readable");
                all.extend_from_slice(&bytes[..count]);
                stream.write_all(answer).expect("writable");
            }
            let _ = stream.read(&mut [0; 1]);
            all
        });
        (address, received)
    }

    #[test]
    fn rows_are_acknowledged_one_by_one() {
        let (address, received) = broker(&[b"\x20\x02\0\0", b"\x40\x02\0\x01", b"\x40\x02\0\x03\x40\x02\0\x02"]);
        let mut sink = sink(&address);
        sink.announce("3");
        let rows = [encoded(&mut sink, 1, "3"), encoded(&mut sink, 10_000_001, "3")].concat();
        assert_eq!(sink.send(&rows, Wall::at(Duration::from_secs(11))), Ok(()));
        drop(sink);
        let text = String::from_utf8_lossy(&received.join().expect("no panic")).into_owned();
        assert!(text.contains("lab/3/status\0\u{7}offline\0\u{2}me\0\u{4}pass"), "{text:?}");
        assert!(text.contains("lab/3/status\0\u{1}online"), "{text:?}");
        let (old, fresh) = (text.find("1970-01-01T00:00:00.000001Z"), text.find("1970-01-01T00:00:10.000001Z"));
        assert!(old < fresh && old.is_some(), "{text:?}");
    }

    #[test]
    fn brokers_that_fail() {
        let cases: [(&'static [&'static [u8]], Trouble); 6] = [
            (&[b"HTTP/1.1 400\r\n\r\n"], Trouble::Garbage),
            (&[b"\x20\x02\0\x05"], Trouble::Unauthorized(5)),
            (&[b"\x20\x02\0\x03"], Trouble::Refused(3)),
            (&[b"\x20\x02\0\0", b"\x40\x02\0\x09"], Trouble::Garbage),
            (&[b"\x20\x02\0\0", b""], Trouble::Timeout),
            (&[b"\x20"], Trouble::Timeout),
        ];
        for (answers, trouble) in cases {
            let (address, _broker) = broker(answers);
            let mut sink = sink(&address);
            sink.announce("3");
            let rows = encoded(&mut sink, 1, "3");
            assert_eq!(sink.send(&rows, Wall::default()), Err(trouble.into()), "{answers:?}");
        }
    }
}
