//! A TCP connection, with or without TLS. Each read and write ends at a deadline, also if the server sends one byte
//! after the other.

use super::sink::{Trouble, io_trouble};
use super::target::Target;
use super::tls::Trust;
use crate::bus::Mono;
use crate::bus::time::HostClock;
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::time::Duration;

/// A connection with a deadline.
pub(super) trait Stream: Read + Write + Send {
    /// Sets the time at which reads and writes fail.
    fn set_deadline(&mut self, end: Mono);
}

/// A TCP connection.
#[derive(Debug)]
pub(super) struct Socket {
    socket: TcpStream,
    clock: HostClock,
    end: Mono,
}

impl Socket {
    fn left(&self) -> io::Result<Duration> {
        let left = self.end.since(self.clock.now().mono);
        if left.is_zero() { Err(io::ErrorKind::TimedOut.into()) } else { Ok(left) }
    }
}

impl Read for Socket {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        self.socket.set_read_timeout(Some(self.left()?))?;
        self.socket.read(bytes)
    }
}

impl Write for Socket {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.socket.set_write_timeout(Some(self.left()?))?;
        self.socket.write(bytes)
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Stream for Socket {
    fn set_deadline(&mut self, end: Mono) {
        self.end = end;
    }
}

/// Connects to a server. With `trust`, the connection uses TLS.
///
/// # Errors
/// There is no connection, or the certificate of the server is not accepted.
pub(super) fn open(
    target: &Target,
    trust: Option<&Trust>,
    timeout: Duration,
    clock: HostClock,
) -> Result<Box<dyn Stream>, Trouble> {
    let host = target.host.trim_matches(['[', ']']);
    let unknown = || Trouble::NoConnection("the host is unknown".to_owned());
    let addresses = (host, target.port).to_socket_addrs().map_err(|_| unknown())?;
    let mut trouble = unknown();
    for address in addresses {
        match TcpStream::connect_timeout(&address, timeout) {
            Ok(socket) => {
                socket.set_nodelay(true).map_err(|error| io_trouble(&error))?;
                let socket = Socket { socket, clock, end: clock.now().mono + timeout };
                return match trust {
                    Some(trust) => trust.connect(socket, host),
                    None => Ok(Box::new(socket)),
                };
            }
            Err(error) => trouble = io_trouble(&error),
        }
    }
    Err(trouble)
}
