//! InfluxDB line protocol over HTTP: InfluxDB 1 (`/write`) and 2 (`/api/v2/write`), and databases that accept the same.

use super::line_protocol::{Line, head, push_line};
use super::sink::{Record, Rejection, SendError, Sink, TlsFault, Trouble, io_trouble};
use super::target::{Secret, Target, percent_encoded};
use super::tls::Trust;
use crate::bus::Wall;
use std::io::{self, Read};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::time::Duration;
use ureq::http::{HeaderValue, Response, StatusCode, Version};
use ureq::unversioned::resolver::DefaultResolver;
use ureq::unversioned::transport::{ConnectionDetails, Connector, DefaultConnector, Transport};
use ureq::{Agent, Body};

/// The most bytes of an answer that are read.
const LONGEST_ANSWER: u64 = 4096;

/// The longest words of a server, in characters.
const LONGEST_REASON: usize = 300;

/// The number of lines with different numbers below a microsecond.
const LINES_PER_US: u64 = 1000;

/// VictoriaMetrics writes rows to its disk some seconds after their acknowledgement.
const GRACE: Duration = Duration::from_secs(15);

/// The longest time without a request over the same connection. Servers close it earlier or later.
const LONGEST_IDLE: Duration = Duration::from_secs(300);

/// A server that needs this many new connections in a row closes each one after its answer.
const MOST_CONNECTIONS: u32 = 3;

/// A database.
pub struct Influx {
    agent: Agent,
    connections: Connections,
    url: String,
    /// Each of the databases answers here, in a few bytes.
    ping: String,
    /// The value of the header `Authorization`.
    authorization: Option<String>,
    /// The start of the lines of each origin and node.
    heads: Vec<((u64, u8), Vec<u8>)>,
}

impl Influx {
    /// A database at this address. `timeout` is the longest time of a request. With `trust`, the connection uses TLS.
    pub fn new(target: &Target, secret: Option<&Secret>, timeout: Duration, trust: Option<&Trust>) -> Influx {
        let mut config = Agent::config_builder()
            .http_status_as_error(false)
            // A redirection could take the token to another server.
            .max_redirects(0)
            .max_redirects_will_error(false)
            .timeout_global(Some(timeout))
            .proxy(None)
            .max_idle_age(LONGEST_IDLE)
            .user_agent(concat!("cangauge/", env!("CARGO_PKG_VERSION")));
        if let Some(trust) = trust {
            config = trust.configure(config);
        }
        let scheme = if trust.is_some() { "https" } else { "http" };
        let (place, path) = (format!("{scheme}://{}:{}", target.host, target.port), target.path.as_slice());
        let ping = format!("{place}/ping");
        let url = match path {
            [org, bucket] => format!(
                "{place}/api/v2/write?org={}&bucket={}&precision=ns",
                percent_encoded(org),
                percent_encoded(bucket)
            ),
            _ => {
                let database = path.first().map(String::as_str).unwrap_or_default();
                format!("{place}/write?db={}&precision=ns", percent_encoded(database))
            }
        };
        let authorization = secret.map(|secret| match secret.user_and_password() {
            Some(_) => format!("Basic {}", base64(secret.text().as_bytes())),
            None => format!("Token {}", secret.text()),
        });
        let connections = Connections::default();
        let connector = DefaultConnector::new().chain(Counter(Arc::clone(&connections.opened)));
        let agent = Agent::with_parts(config.build(), connector, DefaultResolver::default());
        Influx { agent, connections, url, ping, authorization, heads: Vec::new() }
    }

    fn head(&mut self, record: &Record<'_>) -> &[u8] {
        let (origin, node) = (record.origin, record.row.node);
        let key = (origin.id, node);
        let known = self.heads.iter().position(|(of, _)| *of == key);
        let at = known.unwrap_or_else(|| {
            self.heads.retain(|((id, _), _)| *id == origin.id);
            let identity = origin.identity(node);
            let tags = origin.tags.iter().chain(identity).map(|(key, value)| (key.as_str(), value.as_str()));
            let own = [("bench", origin.bench.as_str()), ("run", origin.run.as_deref().unwrap_or_default())];
            self.heads.push((key, head(own.into_iter().chain(tags))));
            self.heads.len() - 1
        });
        &self.heads[at].1
    }
}

impl Sink for Influx {
    /// The recording has microseconds. The last three digits of the line number are added as nanoseconds, so that two
    /// rows with the same microsecond remain two points, and a repeated row remains one.
    fn encode(&mut self, record: &Record<'_>, out: &mut Vec<u8>) {
        let row = record.row;
        let line = Line {
            node: row.node,
            signal: &row.signal,
            unit: &row.unit,
            status: &row.status,
            value: row.value.as_deref(),
            time_ns: i128::from(row.time_us) * 1000 + i128::from(record.line % LINES_PER_US),
        };
        push_line(out, self.head(record), &line);
    }

    fn grace(&self) -> Duration {
        GRACE
    }

    fn has_restarted(&self) -> bool {
        self.connections.has_restarted
    }

    fn idle(&mut self, probe: bool) -> Result<(), Trouble> {
        if probe {
            let mut response = self.connections.answered(self.agent.get(&self.ping).call())?;
            // The connection can be used again after the whole answer.
            let _ = io::copy(&mut response.body_mut().as_reader().take(LONGEST_ANSWER), &mut io::sink());
        }
        Ok(())
    }

    fn send(&mut self, rows: &[u8], _now: Wall) -> Result<(), SendError> {
        let mut request = self.agent.post(&self.url).content_type("text/plain; charset=utf-8");
        if let Some(authorization) = &self.authorization {
            request = request.header("Authorization", authorization);
        }
        let mut response = self.connections.answered(request.send(rows))?;
        let status = response.status();
        if status == StatusCode::NO_CONTENT {
            return Ok(());
        }
        let wait = response.headers().get("retry-after").and_then(|value| value.to_str().ok()?.parse().ok());
        let mut body = Vec::new();
        // An answer that is cut off or late still has its status.
        let _ = response.body_mut().as_reader().take(LONGEST_ANSWER).read_to_end(&mut body);
        Err(answer(status.as_u16(), &String::from_utf8_lossy(&body), wait.map(Duration::from_secs)))
    }
}

/// Counts connections that are opened.
#[derive(Debug)]
struct Counter(Arc<AtomicU64>);

impl<In: Transport> Connector<In> for Counter {
    type Out = In;

    fn connect(&self, _details: &ConnectionDetails, chained: Option<In>) -> Result<Option<In>, ureq::Error> {
        self.0.fetch_add(1, Ordering::Relaxed);
        Ok(chained)
    }
}

/// Whether answers come over the same connection. A new connection is a sign that the server was restarted.
#[derive(Debug, Default)]
struct Connections {
    /// The number of connections that were opened.
    opened: Arc<AtomicU64>,
    /// This number at the last answer.
    known: u64,
    /// The last answers that each came over a new connection.
    new_in_row: u32,
    /// Whether the present connection ends without a restart.
    is_end_expected: bool,
    has_restarted: bool,
}

impl Connections {
    /// Notes which connection the answer came over.
    fn answered(&mut self, answer: Result<Response<Body>, ureq::Error>) -> Result<Response<Body>, Trouble> {
        let response = answer.map_err(|error| {
            let trouble = trouble(&error);
            // The client itself has closed the connection.
            self.is_end_expected |= trouble == Trouble::Timeout;
            self.has_restarted = false;
            trouble
        })?;
        self.used();
        let connection = response.headers().get("connection").map(HeaderValue::as_bytes).unwrap_or_default();
        let is_last = connection.eq_ignore_ascii_case(b"close") || response.version() == Version::HTTP_10;
        self.is_end_expected |= is_last;
        Ok(response)
    }

    fn used(&mut self) {
        let opened = self.opened.load(Ordering::Relaxed);
        let (is_first, is_new) = (self.known == 0, opened != self.known);
        self.known = opened;
        self.new_in_row = if is_new { self.new_in_row.saturating_add(1) } else { 0 };
        let is_expected = is_new && std::mem::take(&mut self.is_end_expected);
        self.has_restarted = is_new && !is_first && !is_expected && self.new_in_row <= MOST_CONNECTIONS;
    }
}

/// Why a request has no answer.
fn trouble(error: &ureq::Error) -> Trouble {
    match error {
        ureq::Error::Timeout(_) => Trouble::Timeout,
        ureq::Error::HostNotFound => Trouble::NoConnection("the host is unknown".to_owned()),
        ureq::Error::ConnectionFailed => Trouble::NoConnection("the connection failed".to_owned()),
        ureq::Error::Io(error) => io_trouble(error),
        ureq::Error::Tls(words) => Trouble::Tls(TlsFault::Refused((*words).to_owned())),
        _ => Trouble::Garbage,
    }
}

/// What an answer means that is not the acknowledgement.
fn answer(status: u16, body: &str, wait: Option<Duration>) -> SendError {
    let reason = words(&error_text(body).unwrap_or_else(|| body.to_owned()));
    match status {
        400 | 422 => SendError::Rejected(rejection(reason)),
        413 => SendError::TooLarge,
        200..=299 => Trouble::NotDatabase(status).into(),
        300..=399 => Trouble::Redirect(status).into(),
        401 | 403 => Trouble::Unauthorized(status).into(),
        _ => SendError::Trouble(Trouble::Status(status, reason), wait),
    }
}

/// Databases name the mistake: InfluxDB 1 and 2, Telegraf and QuestDB.
const ABOUT_ROWS: [&str; 6] =
    ["partial write", "unable to parse", "failed to parse", "field type conflict", "retention policy", "cast error"];

fn rejection(reason: String) -> Rejection {
    let is_about_rows = ABOUT_ROWS.iter().any(|words| reason.contains(words));
    // "partial write: field type conflict: … dropped=2"
    let dropped = reason.rsplit_once("dropped=").and_then(|(_, count)| {
        let digits = count.bytes().take_while(u8::is_ascii_digit).count();
        count[..digits].parse().ok()
    });
    Rejection { reason, is_about_rows, dropped }
}

/// The text of `{"error":"…"}` (InfluxDB 1) or `{"message":"…"}` (InfluxDB 2).
fn error_text(body: &str) -> Option<String> {
    let object: serde_json::Map<String, serde_json::Value> = serde_json::from_str(body.trim()).ok()?;
    ["error", "message"].iter().find_map(|key| object.get(*key)?.as_str().map(str::to_owned))
}

/// Words of a server in one line.
fn words(text: &str) -> String {
    let line: String = text.chars().map(|letter| if letter.is_control() { ' ' } else { letter }).collect();
    line.split_whitespace().collect::<Vec<_>>().join(" ").chars().take(LONGEST_REASON).collect()
}

/// RFC 4648, with padding.
fn base64(bytes: &[u8]) -> String {
    const LETTERS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let group = |group: &[u8]| {
        let word = group.iter().chain(&[0; 2]).take(3).fold(0usize, |word, &byte| word << 8 | usize::from(byte));
        let letter =
            move |at: usize| if at > group.len() { '=' } else { char::from(LETTERS[word >> (18 - 6 * at) & 63]) };
        [letter(0), letter(1), letter(2), letter(3)]
    };
    bytes.chunks(3).flat_map(group).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::publish::row::Row;
    use crate::publish::sink::Origin;
    use std::io::Write;
    use std::net::TcpListener;
    use std::sync::mpsc;
    use std::thread;

    #[test]
    fn new_connection_is_a_sign_of_a_restart() {
        let mut connections = Connections::default();
        let mut acknowledged = |opened: u64, is_end_expected: bool| {
            connections.opened.store(opened, Ordering::Relaxed);
            connections.is_end_expected |= is_end_expected;
            connections.used();
            connections.has_restarted
        };
        let kept = [1, 1, 2, 2, 2, 4].map(|opened| acknowledged(opened, false));
        assert_eq!(kept, [false, false, true, false, false, true]);
        assert_eq!(
            [(5, true), (5, false), (6, false)].map(|(opened, end)| acknowledged(opened, end)),
            [false, false, true]
        );
        // Each request has its own connection.
        let closing = [7, 8, 9, 10].map(|opened| acknowledged(opened, false));
        assert_eq!(closing, [true, true, false, false]);
    }

    #[test]
    fn probe_uses_the_connection_of_the_rows() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let (closed, is_closed) = mpsc::channel();
        thread::spawn(move || {
            // The second connection is that of a restarted server.
            for requests in [2, 1] {
                let (mut stream, _) = listener.accept().expect("a connection");
                for _ in 0..requests {
                    let mut request = String::new();
                    let is_whole =
                        |text: &str| text.ends_with("row\n") || text.starts_with("GET") && text.ends_with("\r\n\r\n");
                    while !is_whole(&request) {
                        let mut bytes = [0; 1000];
                        let count = stream.read(&mut bytes).expect("readable");
                        request.push_str(&String::from_utf8_lossy(&bytes[..count]));
                    }
                    stream.write_all(b"HTTP/1.1 204 No Content\r\n\r\n").expect("writable");
                }
                drop(stream);
                closed.send(()).expect("a reader");
            }
        });
        let target = Target::parse(&format!("influx://{address}/db")).expect("an address");
        let mut influx = Influx::new(&target, None, Duration::from_secs(10), None);
        assert_eq!(influx.send(b"row\n", Wall::default()), Ok(()));
        assert_eq!((influx.idle(true), influx.has_restarted()), (Ok(()), false));
        is_closed.recv().expect("closed");
        assert_eq!((influx.send(b"row\n", Wall::default()), influx.has_restarted()), (Ok(()), true));
    }

    #[test]
    fn base64_of_rfc_4648() {
        for (text, coded) in
            [("", ""), ("f", "Zg=="), ("fo", "Zm8="), ("foo", "Zm9v"), ("foob", "Zm9vYg=="), ("foobar", "Zm9vYmFy")]
        {
            assert_eq!(base64(text.as_bytes()), coded);
        }
    }

    #[test]
    fn lines_have_the_tags_of_their_origin() {
        let target = Target::parse("influx://lab1/db").expect("an address");
        let mut influx = Influx::new(&target, None, Duration::from_secs(1), None);
        let pair = |key: &str, value: &str| (key.to_owned(), value.to_owned());
        let origin = Origin {
            id: 1,
            run: Some("r1".to_owned()),
            bench: "3".to_owned(),
            tags: vec![pair("part", "P 1")],
            identities: vec![(5, vec![pair("serial", "7")])],
            ..Origin::default()
        };
        let mut out = Vec::new();
        for (node, line) in [(5, 1001), (6, 2)] {
            let row = Row {
                time_us: 10,
                node,
                signal: "p".into(),
                unit: "bar".into(),
                status: "".into(),
                value: Some(b"1"[..].into()),
            };
            influx.encode(&Record { row: &row, line, origin: &origin }, &mut out);
        }
        assert_eq!(
            String::from_utf8(out).expect("text"),
            "cangauge,bench=3,run=r1,part=P\\ 1,serial=7,node=5,signal=p,unit=bar value=1 10001\n\
             cangauge,bench=3,run=r1,part=P\\ 1,node=6,signal=p,unit=bar value=1 10002\n"
        );
    }

    #[test]
    fn paths_of_both_versions() {
        let url = |text: &str| Influx::new(&Target::parse(text).expect(text), None, Duration::from_secs(1), None).url;
        assert_eq!(url("influx://lab1/a b"), "http://lab1:8086/write?db=a%20b&precision=ns");
        assert_eq!(url("influx://[::1]:80/o/b"), "http://[::1]:80/api/v2/write?org=o&bucket=b&precision=ns");
        let secret = |text: &str| {
            let target = Target::parse("influx://lab1/db").expect("an address");
            Influx::new(&target, Secret::new(text).as_ref(), Duration::from_secs(1), None).authorization
        };
        assert_eq!(secret("abc").as_deref(), Some("Token abc"));
        assert_eq!(secret("me:abc").as_deref(), Some("Basic bWU6YWJj"));
    }

    #[test]
    fn meaning_of_answers() {
        let rejected = |body: &str| match answer(400, body, None) {
            SendError::Rejected(rejection) => (rejection.reason, rejection.is_about_rows, rejection.dropped),
            other => panic!("{other:?}"),
        };
        let conflict = r#"{"error":"partial write: field type conflict: input field \"value\" dropped=2"}"#;
        assert_eq!(
            rejected(conflict),
            ("partial write: field type conflict: input field \"value\" dropped=2".to_owned(), true, Some(2))
        );
        let parse = r#"{"code":"invalid","message":"unable to parse 'x': missing fields"}"#;
        assert_eq!(rejected(parse), ("unable to parse 'x': missing fields".to_owned(), true, None));
        assert_eq!(rejected("<h1>Bad\n\u{1b}Request</h1>"), ("<h1>Bad Request</h1>".to_owned(), false, None));
        assert_eq!(rejected(&"x".repeat(5000)).0.len(), LONGEST_REASON);
        let trouble = |status| match answer(status, "{}", Some(Duration::from_secs(7))) {
            SendError::Trouble(trouble, wait) => (trouble.word(), trouble.is_lasting(), wait.is_some()),
            other => panic!("{other:?}"),
        };
        assert_eq!(answer(413, "", None), SendError::TooLarge);
        assert_eq!(trouble(200), ("not-a-database", true, false));
        assert_eq!((trouble(301), trouble(401)), (("redirect", true, false), ("unauthorized", true, false)));
        assert_eq!((trouble(404), trouble(503)), (("server-error", true, true), ("server-error", false, true)));
        assert_eq!(trouble(429), ("server-error", false, true));
    }
}
