//! Reads and sets CAN interfaces by rtnetlink.
//!
//! The setters of the `socketcan` crate lose the error number and message of the kernel.

mod link;
mod message;
#[cfg(test)]
mod tests;

use super::super::BusError;
pub use link::{BitTiming, Link, State};
use message::{Reply, Request};
use socketcan::SocketOptions;
use std::io::{self, Read};
use std::os::fd::{AsRawFd, RawFd};
use std::time::Duration;

/// `SOL_NETLINK`, `NETLINK_CAP_ACK` and `NETLINK_EXT_ACK`: errors contain a message and no copy of the request.
const LEVEL: i32 = 270;
const CAPPED: i32 = 10;
const EXPLAINED: i32 = 11;
/// The largest message of the kernel in bytes.
const MAX_MESSAGE: usize = 32 * 1024;
/// The kernel answers immediately. With this limit, a fault cannot block the program.
const ANSWER_TIMEOUT: Duration = Duration::from_secs(5);

/// An error of the kernel.
#[derive(Debug)]
pub(super) struct Refusal {
    /// The error number.
    pub(super) error: io::Error,
    /// The message of the kernel, if there is one.
    pub(super) words: Option<String>,
}

impl From<io::Error> for Refusal {
    fn from(error: io::Error) -> Refusal {
        Refusal { error, words: None }
    }
}

impl Refusal {
    /// Returns the error number.
    pub(super) fn code(&self) -> Option<i32> {
        self.error.raw_os_error()
    }

    /// Converts the error to a bus error for the operation `doing` on the interface `name`.
    pub(super) fn into_error(self, doing: &str, name: &str) -> BusError {
        match self.code() {
            Some(libc::ENODEV | libc::ENXIO) => BusError::NoInterface(name.to_owned()),
            Some(libc::EPERM | libc::EACCES) => BusError::Permission(doing.to_owned()),
            _ => {
                let what = self.words.map_or(doing.to_owned(), |words| format!("{doing} ({words})"));
                BusError::Io { what, source: self.error }
            }
        }
    }
}

/// A connection to the kernel.
struct Kernel(socket2::Socket);

impl AsRawFd for Kernel {
    fn as_raw_fd(&self) -> RawFd {
        self.0.as_raw_fd()
    }
}

impl SocketOptions for Kernel {}

impl Kernel {
    fn open() -> io::Result<Kernel> {
        let domain = socket2::Domain::from(libc::AF_NETLINK);
        let protocol = socket2::Protocol::from(libc::NETLINK_ROUTE);
        let kernel = Kernel(socket2::Socket::new(domain, socket2::Type::RAW, Some(protocol))?);
        kernel.0.set_read_timeout(Some(ANSWER_TIMEOUT))?;
        // Kernels before 4.12 lack these options and give less detail.
        let _ = kernel.set_socket_option_int(LEVEL, CAPPED, 1);
        let _ = kernel.set_socket_option_int(LEVEL, EXPLAINED, 1);
        Ok(kernel)
    }

    /// Sends a request and converts the reply with `convert`.
    fn exchange<T>(
        &self,
        request: Request,
        convert: impl FnOnce(Reply<'_>) -> Result<T, Refusal>,
    ) -> Result<T, Refusal> {
        // One request per connection, so the number is arbitrary.
        const SEQUENCE: u32 = 1;
        self.0.send(&request.finish(SEQUENCE))?;
        let mut bytes = vec![0; MAX_MESSAGE];
        loop {
            let length = match (&self.0).read(&mut bytes) {
                Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
                length => length?,
            };
            match message::reply(&bytes[..length], SEQUENCE) {
                Some(Reply::Refused(code, words)) => {
                    let words = words.map(str::to_owned);
                    return Err(Refusal { error: io::Error::from_raw_os_error(code), words });
                }
                Some(reply) => return convert(reply),
                None => {}
            }
        }
    }
}

/// Reads an interface by name.
pub(super) fn get(name: &str) -> Result<Link, Refusal> {
    Kernel::open()?.exchange(Request::get(name), |reply| match reply {
        Reply::Link(header, attributes) => Ok(Link::read(header, attributes)),
        _ => Err(io::Error::from(io::ErrorKind::InvalidData).into()),
    })
}

/// Switches an interface on or off.
pub(super) fn switch(link: &Link, up: bool) -> Result<(), Refusal> {
    set(link.switch(up))
}

/// Sets the bit timing of an interface that is down, and its listen-only mode.
pub(super) fn configure(link: &Link, timing: BitTiming, listen_only: Option<bool>) -> Result<(), Refusal> {
    set(link.configure(timing, listen_only))
}

fn set(request: Request) -> Result<(), Refusal> {
    Kernel::open()?.exchange(request, |reply| match reply {
        Reply::Done => Ok(()),
        _ => Err(io::Error::from(io::ErrorKind::InvalidData).into()),
    })
}
