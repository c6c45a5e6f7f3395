//! InfluxDB line protocol over HTTP: InfluxDB 1 (`/write`) and 2 (`/api/v2/write`), and databases that accept the same.

use super::line_protocol::{Line, head, push_line};
use super::sink::{Record, Rejection, SendError, Sink, TlsFault, Trouble, io_trouble};
use super::target::{Secret, Target, percent_encoded};
use super::tls::Trust;
use crate::bus::Wall;
use std::io::Read;
use std::time::Duration;
use ureq::Agent;
use ureq::http::StatusCode;

/// The most bytes of an answer that are read.
const LONGEST_ANSWER: u64 = 4096;

/// The longest words of a server, in characters.
const LONGEST_REASON: usize = 300;

/// The number of lines with different numbers below a microsecond.
const LINES_PER_US: u64 = 1000;

/// A database.
pub struct Influx {
    agent: Agent,
    url: String,
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
            .user_agent(concat!("cangauge/", env!("CARGO_PKG_VERSION")));
        if let Some(trust) = trust {
            config = trust.configure(config);
        }
        let scheme = if trust.is_some() { "https" } else { "http" };
        let (place, path) = (format!("{scheme}://{}:{}", target.host, target.port), target.path.as_slice());
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
        Influx { agent: Agent::new_with_config(config.build()), url, authorization, heads: Vec::new() }
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
    /// The recording has microseconds. The last three digits of the time are those of the line number, so that two rows
    /// with the same microsecond remain two points, and a repeated row remains one.
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

    fn send(&mut self, rows: &[u8], _now: Wall) -> Result<(), SendError> {
        let mut request = self.agent.post(&self.url).content_type("text/plain; charset=utf-8");
        if let Some(authorization) = &self.authorization {
            request = request.header("Authorization", authorization);
        }
        let mut response = request.send(rows).map_err(|error| trouble(&error))?;
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
