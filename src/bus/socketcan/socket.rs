//! The kernel's socket: made so that it loses as little as possible and tells what it loses.

use crate::bus::{BusError, Filters, ReceiveBuffer, TimestampSource};
use crate::canopen::id::CanId;
use socketcan::{CanAddr, CanSocket, Socket, SocketOptions};
use std::collections::BTreeSet;
use std::io;
use std::os::fd::{AsFd, AsRawFd, BorrowedFd, OwnedFd};
use std::time::Duration;

/// More filters than this the kernel does not take (`CAN_RAW_FILTER_MAX`).
const MAX_FILTERS: usize = 512;
/// The receive buffer asked for; the kernel doubles it. A frame takes some 800 bytes of it: 40,000 frames, five
/// seconds of a full bus at 1 Mbit/s.
const RECEIVE_BUFFER: i32 = 16 << 20;

/// A socket that is bound to an interface.
pub(super) struct Bound {
    pub(super) socket: CanSocket,
    /// The identifiers wanted, where they are too many for the kernel.
    pub(super) wanted: Option<BTreeSet<CanId>>,
    /// Where the times of its frames come from, until the interface tells its own.
    pub(super) timestamps: TimestampSource,
}

/// A socket that blocks for `limit` at most, on the interface `name`, which may be down: then that is left as
/// the socket's error.
pub(super) fn bind(name: &str, filters: &Filters, limit: Duration) -> Result<Bound, BusError> {
    let socket = new(limit)?;
    let failed = |what: &str, source| BusError::Io { what: format!("{what} {name}"), source };
    let address = CanAddr::from_iface(name).map_err(|_| BusError::NoInterface(name.to_owned()))?;
    socket.set_error_filter_accept_all().map_err(|error| failed("set the error filter of", error))?;
    // Each of these only improves what is measured; a kernel that lacks one still delivers frames.
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

/// Tells the kernel which frames are wanted. The identifiers are returned where they are too many for it.
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

/// Identifier and mask that let through data frames with exactly this identifier.
fn filter(id: CanId) -> (u32, u32) {
    const EXACT: u32 = libc::CAN_EFF_FLAG | libc::CAN_RTR_FLAG;
    match id {
        CanId::Standard(id) => (u32::from(id), libc::CAN_SFF_MASK | EXACT),
        CanId::Extended(id) => (id | libc::CAN_EFF_FLAG, libc::CAN_EFF_MASK | EXACT),
    }
}

/// What the kernel holds back for this socket at most, beside what was asked for.
pub(super) fn receive_buffer(socket: &CanSocket) -> Option<ReceiveBuffer> {
    let bytes = socket.as_raw_socket().recv_buffer_size().ok()?;
    Some(ReceiveBuffer { bytes, wanted: usize::try_from(RECEIVE_BUFFER).ok()? * 2 })
}

/// The kernel's count of the frames that this socket has lost in all, asked for now: what came with a frame is the
/// count when that one was queued. `None` where the kernel does not tell (before Linux 4.12).
pub(super) fn lost(socket: &CanSocket) -> Option<u32> {
    // The last of what `SO_MEMINFO` gives (`SK_MEMINFO_DROPS`).
    const DROPS: usize = 8;
    read_memory_info(socket.as_fd()).ok()?.get(DROPS).copied()
}

/// `SO_MEMINFO`: how much memory a socket uses, and what did not fit. As many numbers as the kernel knows.
#[expect(unsafe_code, reason = "neither socket2 nor the socketcan crate reads SO_MEMINFO")]
fn read_memory_info(socket: BorrowedFd<'_>) -> io::Result<Vec<u32>> {
    /// `SO_MEMINFO` of linux/socket.h; libc names it on some architectures only.
    const SO_MEMINFO: libc::c_int = 55;
    let mut numbers = [0u32; 16];
    let mut length = libc::socklen_t::try_from(size_of_val(&numbers)).unwrap_or(0);
    // SAFETY: `numbers` is as long as `length` says and outlives the call, every pattern of bits is a u32, and the
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
