//! What a publisher needs from a server: to encode rows, to send them, and to know the answer.

use super::row::Row;
use super::tls;
use crate::bus::Wall;
use std::io;
use std::time::Duration;

/// What the rows of a recording have in common.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Origin {
    /// A number that differs for each origin of a publisher.
    pub id: u64,
    /// The identifier of the run; `None` if the recording has no file of the run.
    pub run: Option<String>,
    /// The bench.
    pub bench: String,
    /// The file, without its folder.
    pub file: String,
    /// The tags without `bench`, in alphabetical order.
    pub tags: Vec<(String, String)>,
    /// Further tags of each node: its serial number and its name.
    pub identities: Vec<(u8, Vec<(String, String)>)>,
}

impl Origin {
    /// The further tags of a node.
    pub fn identity(&self, node: u8) -> &[(String, String)] {
        let own = self.identities.iter().find(|(known, _)| *known == node);
        own.map_or(&[], |(_, tags)| tags.as_slice())
    }
}

/// A row with its place.
#[derive(Clone, Copy, Debug)]
pub struct Record<'a> {
    /// The row.
    pub row: &'a Row<'a>,
    /// The number of its line, counted from 1.
    pub line: u64,
    /// The tags that it shares with other rows.
    pub origin: &'a Origin,
}

/// A server.
pub trait Sink: Send {
    /// The most rows in one request.
    fn most_rows(&self) -> usize {
        usize::MAX
    }

    /// The bench of the next rows.
    fn announce(&mut self, _bench: &str) {}

    /// Appends the form in which a row is sent.
    fn encode(&mut self, record: &Record<'_>, out: &mut Vec<u8>);

    /// Sends encoded rows, and waits for the acknowledgement.
    ///
    /// # Errors
    /// The server did not acknowledge all rows. It may have stored some of them.
    fn send(&mut self, rows: &[u8], now: Wall) -> Result<(), SendError>;

    /// How long the server may have acknowledged rows only in its memory. They are sent again if it is restarted.
    fn grace(&self) -> Duration {
        Duration::ZERO
    }

    /// Whether the last answer is a sign that the server was restarted.
    fn has_restarted(&self) -> bool {
        false
    }

    /// Nothing is to be sent at present. With `probe`, the server is asked for an answer, so that a restart is noticed.
    ///
    /// # Errors
    /// The connection was lost.
    fn idle(&mut self, _probe: bool) -> Result<(), Trouble> {
        Ok(())
    }

    /// The publisher ends.
    fn close(&mut self) {}
}

/// Why rows are not acknowledged.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SendError {
    /// The server rejects at least one row.
    Rejected(Rejection),
    /// The server does not accept as many bytes at once.
    TooLarge,
    /// The rows can be sent again, after this time if the server states it.
    Trouble(Trouble, Option<Duration>),
}

impl From<Trouble> for SendError {
    fn from(trouble: Trouble) -> SendError {
        SendError::Trouble(trouble, None)
    }
}

/// A rejection of rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Rejection {
    /// The words of the server.
    pub reason: String,
    /// Whether the words are about the contents of rows. Otherwise, the server may reject everything.
    pub is_about_rows: bool,
    /// The number of rejected rows, if the server states it.
    pub dropped: Option<u64>,
}

/// Why a server does not accept rows at present.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// There is no connection: the words of the operating system.
    NoConnection(String),
    /// The server did not answer in time.
    Timeout,
    /// The server closed the connection before its answer.
    Closed,
    /// The answer is not in the protocol of the server.
    Garbage,
    /// The answer is not the acknowledgement of a database: its HTTP status.
    NotDatabase(u16),
    /// The server redirects to another address: its HTTP status. A redirection is not followed.
    Redirect(u16),
    /// The server rejects the credentials: its HTTP status or its MQTT return code.
    Unauthorized(u16),
    /// The server reports a failure: HTTP status and words.
    Status(u16, String),
    /// The server rejects every row, and accepted none so far: its words.
    RejectsEverything(String),
    /// The MQTT broker rejects the connection: its return code.
    Refused(u8),
    /// The certificate of the server is not accepted.
    Certificate(CertificateFault),
    /// There is no connection with TLS.
    Tls(TlsFault),
}

/// Why a certificate is not accepted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum CertificateFault {
    /// It is for these names, and not for the host in the address.
    OtherName(Vec<String>),
    /// No trusted authority has signed it.
    UnknownAuthority,
    /// It is that of an authority (CA:TRUE), and not that of a server.
    IsAuthority,
    /// It has expired, at this time if it is known.
    Expired(Option<Wall>),
    /// It is not valid yet, until this time if it is known.
    NotYetValid(Option<Wall>),
    /// Another fault, in the words of the library.
    Other(String),
}

/// Why a connection with TLS fails, except for the certificate.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum TlsFault {
    /// The answer is not TLS.
    NotTls,
    /// The server refuses, in the words of the library.
    Refused(String),
}

impl Trouble {
    /// The word in the position file.
    pub fn word(&self) -> &'static str {
        match self {
            Trouble::NoConnection(_) => "no-connection",
            Trouble::Timeout => "timeout",
            Trouble::Closed => "closed",
            Trouble::Garbage => "garbage",
            Trouble::NotDatabase(_) => "not-a-database",
            Trouble::Redirect(_) => "redirect",
            Trouble::Unauthorized(_) => "unauthorized",
            Trouble::Status(..) => "server-error",
            Trouble::RejectsEverything(_) => "rejects-everything",
            Trouble::Refused(_) => "refused",
            Trouble::Certificate(_) => "certificate",
            Trouble::Tls(_) => "tls",
        }
    }

    /// Whether another attempt is pointless without a change of the command or of the server.
    pub fn is_lasting(&self) -> bool {
        match self {
            Trouble::NoConnection(_) | Trouble::Timeout | Trouble::Closed | Trouble::Garbage => false,
            Trouble::Status(code, _) => !matches!(code, 408 | 425 | 429 | 500..),
            Trouble::Refused(code) => *code != 3,
            _ => true,
        }
    }
}

/// Why a connection failed.
pub(super) fn io_trouble(error: &io::Error) -> Trouble {
    if let Some(trouble) = tls::trouble(error) {
        return trouble;
    }
    match error.kind() {
        io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock => Trouble::Timeout,
        io::ErrorKind::UnexpectedEof
        | io::ErrorKind::ConnectionReset
        | io::ErrorKind::ConnectionAborted
        | io::ErrorKind::BrokenPipe => Trouble::Closed,
        _ => Trouble::NoConnection(error.to_string()),
    }
}
