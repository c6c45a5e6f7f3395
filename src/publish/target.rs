//! The address of a server: `influx://HOST[:8086]/DATABASE`, `influx://HOST[:8086]/ORGANISATION/BUCKET`,
//! `mqtt://HOST[:1883][/PREFIX]`. With TLS: `influx+https://` (also port 8086) and `mqtts://` (port 8883).

use std::fmt;

/// The port of InfluxDB, with and without TLS.
const INFLUX_PORT: u16 = 8086;

/// The port of MQTT.
const MQTT_PORT: u16 = 1883;

/// The port of MQTT with TLS.
const MQTTS_PORT: u16 = 8883;

/// The longest short name, in characters.
const LONGEST_NAME: usize = 100;

/// A server, without credentials.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Target {
    /// The kind of the server.
    pub scheme: Scheme,
    /// Whether the connection uses TLS.
    pub tls: bool,
    /// The host name or address. An IPv6 address has brackets.
    pub host: String,
    /// The TCP port.
    pub port: u16,
    /// The parts of the path.
    pub path: Vec<String>,
}

/// A kind of server.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scheme {
    /// InfluxDB line protocol over HTTP.
    Influx,
    /// MQTT.
    Mqtt,
}

/// Why an address cannot be used. It is not shown, because it may contain a secret.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum TargetError {
    /// It contains a user name, a password or a token.
    Credentials,
    /// Its scheme is unknown.
    Scheme,
    /// Its host or port is missing or wrong.
    Host,
    /// It names no database.
    Database,
    /// Its topic contains a wildcard.
    Topic,
    /// It has parts that are not known: a query or a fragment.
    Query,
}

impl Target {
    /// Parses an address.
    ///
    /// # Errors
    /// The mistake in the address.
    pub fn parse(text: &str) -> Result<Target, TargetError> {
        let (scheme, rest) = text.split_once("://").ok_or(TargetError::Scheme)?;
        let (authority, path) = rest.split_once('/').unwrap_or((rest, ""));
        if rest.contains('@') {
            return Err(TargetError::Credentials);
        }
        if rest.contains(['?', '#']) {
            return Err(TargetError::Query);
        }
        let (scheme, tls, port) = match scheme {
            "influx" => (Scheme::Influx, false, INFLUX_PORT),
            "influx+https" => (Scheme::Influx, true, INFLUX_PORT),
            "mqtt" => (Scheme::Mqtt, false, MQTT_PORT),
            "mqtts" => (Scheme::Mqtt, true, MQTTS_PORT),
            _ => return Err(TargetError::Scheme),
        };
        let (host, port) = host_and_port(authority, port).ok_or(TargetError::Host)?;
        let path: Vec<String> = path.split('/').filter(|part| !part.is_empty()).map(str::to_owned).collect();
        match scheme {
            Scheme::Influx if !matches!(path.len(), 1 | 2) => return Err(TargetError::Database),
            Scheme::Mqtt if path.iter().any(|part| part.contains('+')) => return Err(TargetError::Topic),
            Scheme::Influx | Scheme::Mqtt => {}
        }
        Ok(Target { scheme, tls, host, port, path })
    }

    /// A short name for files: `influx-lab1-8086-benches`.
    pub fn name(&self) -> String {
        let full = self.to_string().replace("://", "-");
        let plain = |letter: char| if letter.is_ascii_alphanumeric() || ".-_".contains(letter) { letter } else { '-' };
        full.chars().map(plain).take(LONGEST_NAME).collect()
    }
}

impl fmt::Display for Target {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let scheme = match (self.scheme, self.tls) {
            (Scheme::Influx, false) => "influx",
            (Scheme::Influx, true) => "influx+https",
            (Scheme::Mqtt, false) => "mqtt",
            (Scheme::Mqtt, true) => "mqtts",
        };
        write!(f, "{scheme}://{}:{}", self.host, self.port)?;
        self.path.iter().try_for_each(|part| write!(f, "/{part}"))
    }
}

/// `HOST`, `HOST:PORT`, `[::1]:PORT`.
fn host_and_port(text: &str, default_port: u16) -> Option<(String, u16)> {
    let (host, port) = match text.strip_prefix('[') {
        Some(rest) => {
            let (address, port) = rest.split_once(']')?;
            address.parse::<std::net::Ipv6Addr>().ok()?;
            (format!("[{address}]"), port)
        }
        None => {
            let (host, port) = text.split_at(text.find(':').unwrap_or(text.len()));
            (host.to_owned(), port)
        }
    };
    let is_host = |letter: char| letter.is_ascii_alphanumeric() || "-._[]:".contains(letter);
    if host.is_empty() || !host.chars().all(is_host) {
        return None;
    }
    match port.strip_prefix(':') {
        None => Some((host, default_port)),
        Some(port) => port.parse().ok().filter(|port| *port > 0).map(|port| (host, port)),
    }
}

/// A text as a part of a URL.
pub fn percent_encoded(text: &str) -> String {
    let plain = |byte: u8| byte.is_ascii_alphanumeric() || b"-._~".contains(&byte);
    text.bytes().map(|byte| if plain(byte) { char::from(byte).to_string() } else { format!("%{byte:02X}") }).collect()
}

/// A secret: a token, or a user name and a password. It is never printed.
#[derive(Clone, PartialEq, Eq)]
pub struct Secret(String);

impl Secret {
    /// A secret; `None` if the text is blank. Line ends around it are removed.
    pub fn new(text: &str) -> Option<Secret> {
        let text = text.trim();
        (!text.is_empty()).then(|| Secret(text.to_owned()))
    }

    /// Whether it can be sent in a header.
    pub fn is_printable(&self) -> bool {
        self.0.bytes().all(|byte| (b' '..=b'~').contains(&byte))
    }

    /// The text.
    pub(super) fn text(&self) -> &str {
        &self.0
    }

    /// The user name and the password of `USER:PASSWORD`; `None` for a token.
    pub(super) fn user_and_password(&self) -> Option<(&str, &str)> {
        self.0.split_once(':')
    }
}

impl fmt::Debug for Secret {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("Secret")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses() {
        let target = |text: &str| Target::parse(text).map(|target| (target.to_string(), target.name()));
        let both = |url: &str, name: &str| Ok((url.to_owned(), name.to_owned()));
        assert_eq!(target("influx://lab1/benches"), both("influx://lab1:8086/benches", "influx-lab1-8086-benches"));
        assert_eq!(
            target("influx://[::1]:80/org/a%20b/"),
            both("influx://[::1]:80/org/a%20b", "influx----1--80-org-a-20b")
        );
        assert_eq!(target("mqtt://broker/a/b"), both("mqtt://broker:1883/a/b", "mqtt-broker-1883-a-b"));
        assert_eq!(target("influx+https://lab1/db"), both("influx+https://lab1:8086/db", "influx-https-lab1-8086-db"));
        assert_eq!(target("mqtts://broker"), both("mqtts://broker:8883", "mqtts-broker-8883"));
        for (text, error) in [
            ("lab1", TargetError::Scheme),
            ("http://lab1/db", TargetError::Scheme),
            ("influx://user:pass@lab1/db", TargetError::Credentials),
            ("influx://lab1/db?token=x@y", TargetError::Credentials),
            ("influx://lab1/db?token=x", TargetError::Query),
            ("influx:///db", TargetError::Host),
            ("influx://lab1:0/db", TargetError::Host),
            ("influx://lab1:99999/db", TargetError::Host),
            ("influx://[::x]/db", TargetError::Host),
            ("influx://la b/db", TargetError::Host),
            ("influx://lab1", TargetError::Database),
            ("influx://lab1/a/b/c", TargetError::Database),
            ("mqtt://lab1/a+", TargetError::Topic),
        ] {
            assert_eq!(target(text), Err(error), "{text}");
        }
    }

    #[test]
    fn secrets_are_not_printed() {
        let secret = Secret::new(" user:pass word\n").expect("a secret");
        assert_eq!(
            (format!("{secret:?}").as_str(), secret.user_and_password()),
            ("Secret", Some(("user", "pass word")))
        );
        assert!(Secret::new(" \n").is_none() && secret.is_printable());
        assert_eq!(percent_encoded("a b/ü"), "a%20b%2F%C3%BC");
    }
}
