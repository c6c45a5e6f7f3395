//! A byte stream to an adapter or a server: a serial port or a TCP connection. Reads and writes never wait.

use super::interrupt::Interrupts;
use serial2::SerialPort;
use socket2::{Domain, Protocol, SockAddr, Socket, TcpKeepalive, Type};
use std::fmt;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::Duration;

/// The address of a byte stream.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Place {
    /// A serial port and its speed in bit/s.
    Serial(PathBuf, u32),
    /// A host and a TCP port.
    Tcp(String, u16),
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Place::Serial(path, _) => path.display().fmt(f),
            Place::Tcp(host, port) if host.contains(':') => write!(f, "[{host}]:{port}"),
            Place::Tcp(host, port) => write!(f, "{host}:{port}"),
        }
    }
}

/// An open byte stream.
#[derive(Debug)]
pub(super) enum Port {
    Serial(SerialPort),
    Tcp(Socket),
}

impl Port {
    /// Opens a serial port and locks it, because two programs at one adapter would disturb each other.
    pub(super) fn serial(path: &PathBuf, speed: u32) -> io::Result<Port> {
        let mut port = SerialPort::open(path, speed)?;
        port.set_read_timeout(Duration::ZERO)?;
        port.set_write_timeout(Duration::ZERO)?;
        #[cfg(unix)]
        {
            let file = std::fs::File::from(std::os::fd::AsFd::as_fd(&port).try_clone_to_owned()?);
            if let Err(std::fs::TryLockError::WouldBlock) = file.try_lock() {
                return Err(io::Error::new(io::ErrorKind::ResourceBusy, "another program uses it"));
            }
        }
        Ok(Port::Serial(port))
    }

    /// Starts a TCP connection. The connection is complete when the port is writable, see [`Port::connected`].
    pub(super) fn tcp(address: SocketAddr) -> io::Result<Port> {
        let socket = Socket::new(Domain::for_address(address), Type::STREAM, Some(Protocol::TCP))?;
        socket.set_nonblocking(true)?;
        socket.set_tcp_nodelay(true)?;
        // Detects a host without power or network within half a minute.
        let keepalive = TcpKeepalive::new().with_time(Duration::from_secs(10)).with_interval(Duration::from_secs(5));
        socket.set_tcp_keepalive(&keepalive)?;
        match socket.connect(&SockAddr::from(address)) {
            Err(error) if !is_pending(&error) => Err(error),
            _ => Ok(Port::Tcp(socket)),
        }
    }

    /// Whether the port is connected.
    pub(super) fn connected(&self) -> io::Result<bool> {
        let Port::Tcp(socket) = self else { return Ok(true) };
        match socket.take_error()? {
            Some(error) => Err(error),
            None => Ok(socket.peer_addr().is_ok()),
        }
    }

    /// Reads available bytes; 0 if no bytes are available yet.
    ///
    /// # Errors
    /// The connection ended.
    pub(super) fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        let read = match self {
            Port::Serial(port) => port.read(buffer),
            Port::Tcp(socket) => socket.read(buffer),
        };
        match read {
            Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the connection was closed")),
            Err(error) if is_pending(&error) => Ok(0),
            result => result,
        }
    }

    /// Writes as many bytes as fit.
    pub(super) fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = match self {
            Port::Serial(port) => port.write(bytes),
            Port::Tcp(socket) => socket.write(bytes),
        };
        written.or_else(|error| if is_pending(&error) { Ok(0) } else { Err(error) })
    }
}

/// A serial port that may be an adapter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SerialAdapter {
    /// The device: `/dev/ttyACM0`.
    pub path: String,
    /// The product name in the USB descriptor.
    pub product: Option<String>,
}

/// Lists the serial ports of USB adapters, sorted.
pub fn adapters() -> Vec<SerialAdapter> {
    let ports = SerialPort::available_ports().unwrap_or_default();
    let mut found: Vec<SerialAdapter> =
        ports.iter().filter_map(|path| adapter(path, Path::new("/sys/class/tty"))).collect();
    found.sort_by(|a, b| (a.path.len(), &a.path).cmp(&(b.path.len(), &b.path)));
    found
}

/// Returns the adapter at a port; `None` for a built-in port (`ttyS0`) and for a pseudo-terminal (`ttya0`).
fn adapter(path: &Path, sysfs: &Path) -> Option<SerialAdapter> {
    let name = path.file_name()?.to_str()?;
    let is_pseudo = matches!(name.as_bytes(), [b't', b't', b'y', b'a'..=b'z', b'0'..=b'9' | b'a'..=b'f']);
    if name.starts_with("ttyS") || name.starts_with("ttyAMA") || is_pseudo {
        return None;
    }
    // The file `product` is one level above the device folder of ttyACM0, and two levels above it for ttyUSB0.
    let product = ["../product", "../../product"].into_iter().find_map(|up| {
        let text = std::fs::read_to_string(sysfs.join(name).join("device").canonicalize().ok()?.join(up)).ok()?;
        Some(super::stream::printable(text.trim()))
    });
    Some(SerialAdapter { path: path.to_str()?.to_owned(), product })
}

fn is_pending(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    // The connection is not complete yet.
    #[cfg(unix)]
    if error.raw_os_error() == Some(libc::EINPROGRESS) {
        return true;
    }
    // A broken TCP connection also has the kind TimedOut, but with a system error code.
    match error.kind() {
        WouldBlock | Interrupted => true,
        TimedOut => error.raw_os_error().is_none(),
        _ => false,
    }
}

/// Looks up the addresses of a host.
pub(super) fn resolve(host: &str, port: u16) -> io::Result<Vec<SocketAddr>> {
    Ok((host, port).to_socket_addrs()?.collect())
}

#[cfg(unix)]
impl std::os::fd::AsFd for Port {
    fn as_fd(&self) -> std::os::fd::BorrowedFd<'_> {
        match self {
            Port::Serial(port) => port.as_fd(),
            Port::Tcp(socket) => socket.as_fd(),
        }
    }
}

#[cfg(unix)]
pub(super) use std::os::fd::AsFd as Waitable;

/// A placeholder for systems on which [`wait`] does not use descriptors.
#[cfg(not(unix))]
pub(super) trait Waitable {}
#[cfg(not(unix))]
impl<T> Waitable for T {}

/// Waits until a source is readable (or writable, if its flag is set), a signal arrives, or `limit` has passed. Returns
/// which sources are ready.
#[cfg(unix)]
pub(super) fn wait(
    sources: &[(&dyn Waitable, bool)],
    interrupts: &mut Interrupts,
    limit: Duration,
) -> io::Result<Vec<bool>> {
    let signals = interrupts.fd();
    let mut fds: Vec<_> = sources.iter().map(|(source, writes)| (source.as_fd(), *writes)).collect();
    fds.push((signals, false));
    let mut ready = super::poll::ready(&fds, limit)?;
    if ready.pop() == Some(true) {
        interrupts.collect();
    }
    Ok(ready)
}

/// Sleeps for at most 1 ms and returns all sources as ready, because this system cannot wait for sources and signals.
#[cfg(not(unix))]
pub(super) fn wait(sources: &[(&dyn Waitable, bool)], _: &mut Interrupts, limit: Duration) -> io::Result<Vec<bool>> {
    std::thread::sleep(limit.min(Duration::from_millis(1)));
    Ok(vec![true; sources.len()])
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn usb_adapters_have_the_name_of_their_product() {
        let folder = tempfile::tempdir().expect("a folder");
        let sysfs = folder.path().join("class");
        for (name, interface) in [("ttyACM0", "usb1/1-1/1-1:1.0"), ("ttyUSB3", "usb1/1-2/1-2:1.0/ttyUSB3")] {
            let interface = folder.path().join(interface);
            std::fs::create_dir_all(&interface).expect("a folder");
            std::fs::create_dir_all(sysfs.join(name)).expect("a folder");
            std::os::unix::fs::symlink(interface, sysfs.join(name).join("device")).expect("a link");
        }
        std::fs::write(folder.path().join("usb1/1-1/product"), "CANable \x1b b158aa7\n").expect("written");
        std::fs::write(folder.path().join("usb1/1-2/product"), "USB Serial").expect("written");
        let found = |name: &str| adapter(&Path::new("/dev").join(name), &sysfs);
        let adapter = |path: &str, product: Option<&str>| {
            Some(SerialAdapter { path: path.to_owned(), product: product.map(str::to_owned) })
        };
        assert_eq!(found("ttyACM0"), adapter("/dev/ttyACM0", Some("CANable ? b158aa7")));
        assert_eq!(found("ttyUSB3"), adapter("/dev/ttyUSB3", Some("USB Serial")));
        assert_eq!(found("ttyGS0"), adapter("/dev/ttyGS0", None));
        for own in ["ttyS0", "ttya0", "ttyzf"] {
            assert_eq!(found(own), None, "{own}");
        }
    }
}
