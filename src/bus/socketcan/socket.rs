//! Opens CAN sockets that lose as few frames as possible and report the loss.

use crate::bus::{BusError, Filters, ReceiveBuffer, TimestampSource};
use crate::canopen::id::CanId;
use socketcan::{CanAddr, CanSocket, Socket, SocketOptions};
use std::collections::BTreeSet;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::time::Duration;

/// The largest number of filters that the kernel accepts (`CAN_RAW_FILTER_MAX`).
const MAX_FILTERS: usize = 512;
/// The requested receive buffer in bytes; the kernel doubles it. A frame takes about 800 bytes, so the buffer holds
/// 40,000 frames: five seconds of a full bus at 1 Mbit/s.
const RECEIVE_BUFFER: i32 = 16 << 20;

/// A socket that is bound to an interface.
pub(super) struct Bound {
    pub(super) socket: CanSocket,
    /// The identifiers to deliver, if they are too many for the kernel.
    pub(super) wanted: Option<BTreeSet<CanId>>,
    /// The timestamp source, until the interface delivers hardware times.
    pub(super) timestamps: TimestampSource,
}

/// Opens a socket on the interface `name`. Reads block for at most `limit`. If the interface is down, `bind` succeeds,
/// and `take_error` of the socket returns `ENETDOWN`.
pub(super) fn bind(name: &str, filters: &Filters, limit: Duration) -> Result<Bound, BusError> {
    let socket = new(limit)?;
    let failed = |what: &str, source| BusError::Io { what: format!("{what} {name}"), source };
    let address = CanAddr::from_iface(name).map_err(|_| BusError::NoInterface(name.to_owned()))?;
    socket.set_error_filter_accept_all().map_err(|error| failed("set the error filter of", error))?;
    // These options improve measurements only. A kernel without one of them still delivers frames.
    let timestamps = match socket.set_recv_timestamp(true) {
        Ok(()) => TimestampSource::Kernel,
        Err(_) => TimestampSource::Program,
    };
    let own_times = libc::SOF_TIMESTAMPING_RX_HARDWARE | libc::SOF_TIMESTAMPING_RAW_HARDWARE;
    let _ = socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_TIMESTAMPING, own_times.cast_signed());
    let _ = socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, 1);
    if socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RCVBUFFORCE, RECEIVE_BUFFER).is_err() {
        let _ = socket.set_socket_option_int(libc::SOL_SOCKET, libc::SO_RCVBUF, RECEIVE_BUFFER);
    }
    let wanted = set_filters(&socket, filters).map_err(|error| failed("set the filters of", error))?;
    socket.as_raw_socket().bind(&address.into_sock_addr()).map_err(|error| match error.raw_os_error() {
        Some(libc::ENODEV) => BusError::NotCan(name.to_owned()),
        _ => failed("open", error),
    })?;
    Ok(Bound { socket, wanted, timestamps })
}

fn new(limit: Duration) -> Result<CanSocket, BusError> {
    let domain = socket2::Domain::from(libc::AF_CAN);
    let protocol = socket2::Protocol::from(libc::CAN_RAW);
    let socket = socket2::Socket::new(domain, socket2::Type::RAW, Some(protocol))
        .and_then(|socket| socket.set_read_timeout(Some(limit)).map(|()| socket))
        .and_then(|socket| socket.set_write_timeout(Some(Duration::from_millis(1))).map(|()| socket));
    match socket {
        Ok(socket) => Ok(CanSocket::from(OwnedFd::from(socket))),
        Err(source) => Err(match source.raw_os_error() {
            Some(libc::EAFNOSUPPORT | libc::EPROTONOSUPPORT) => {
                BusError::Unsupported("this kernel has no CAN support".to_owned())
            }
            Some(libc::EPERM | libc::EACCES) => BusError::Permission("open a CAN socket".to_owned()),
            _ => BusError::Io { what: "open a CAN socket".to_owned(), source },
        }),
    }
}

/// Sets the filters of the kernel. Returns the identifiers if they are too many for the kernel.
pub(super) fn set_filters(socket: &CanSocket, filters: &Filters) -> io::Result<Option<BTreeSet<CanId>>> {
    let ids: BTreeSet<CanId> = match filters {
        Filters::All => return socket.set_filter_accept_all().map(|()| None),
        Filters::Only(ids) => ids.iter().copied().collect(),
    };
    if ids.is_empty() {
        return socket.set_filter_drop_all().map(|()| None);
    }
    if ids.len() > MAX_FILTERS {
        return socket.set_filter_accept_all().map(|()| Some(ids));
    }
    let filters: Vec<(u32, u32)> = ids.iter().map(|&id| filter(id)).collect();
    socket.set_filters(&filters).map(|()| None)
}

/// Returns the filter for data frames and remote frames with exactly this identifier.
fn filter(id: CanId) -> (u32, u32) {
    match id {
        CanId::Standard(id) => (u32::from(id), libc::CAN_SFF_MASK | libc::CAN_EFF_FLAG),
        CanId::Extended(id) => (id | libc::CAN_EFF_FLAG, libc::CAN_EFF_MASK | libc::CAN_EFF_FLAG),
    }
}

/// Returns the size of the receive buffer, and the requested size.
pub(super) fn receive_buffer(socket: &CanSocket) -> Option<ReceiveBuffer> {
    let bytes = socket.as_raw_socket().recv_buffer_size().ok()?;
    Some(ReceiveBuffer { bytes, wanted: usize::try_from(RECEIVE_BUFFER).ok()? * 2 })
}

/// Returns the kernel's present count of frames lost by this socket. The count that comes with a frame is older. `None`
/// before Linux 4.12.
pub(super) fn lost(socket: &CanSocket) -> Option<u32> {
    // The last value of `SO_MEMINFO` (`SK_MEMINFO_DROPS`).
    const DROPS: usize = 8;
    read_memory_info(socket.as_fd()).ok()?.get(DROPS).copied()
}

/// Reads `SO_MEMINFO`: the memory use of a socket and its drops. The kernel decides the number of values.
#[expect(unsafe_code, reason = "neither socket2 nor the socketcan crate reads SO_MEMINFO")]
fn read_memory_info(socket: BorrowedFd<'_>) -> io::Result<Vec<u32>> {
    /// `SO_MEMINFO` of linux/socket.h; libc defines it only on some architectures.
    const SO_MEMINFO: libc::c_int = 55;
    let mut numbers = [0u32; 16];
    let mut length = libc::socklen_t::try_from(size_of_val(&numbers)).unwrap_or(0);
    // SAFETY: `numbers` has the length `length` and outlives the call, every pattern of bits is a u32, and the
    // descriptor is borrowed and so is open.
    let result = unsafe {
        libc::getsockopt(socket.as_raw_fd(), libc::SOL_SOCKET, SO_MEMINFO, numbers.as_mut_ptr().cast(), &raw mut length)
    };
    if result < 0 {
        return Err(io::Error::last_os_error());
    }
    let known = usize::try_from(length).unwrap_or(0) / size_of::<u32>();
    Ok(numbers.iter().copied().take(known).collect())
}
