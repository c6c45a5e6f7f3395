//! Waits until a file descriptor is readable, with nanosecond resolution if the system supports it.

use std::io;
use std::os::fd::{AsRawFd, BorrowedFd};
use std::time::Duration;

/// Waits until one of `fds` is readable or `limit` has passed. An error or hang-up counts as readable. A signal ends
/// the wait early with no descriptor ready; the caller checks its deadline.
pub(super) fn readable<const N: usize>(fds: [BorrowedFd<'_>; N], limit: Duration) -> io::Result<[bool; N]> {
    let mut set = fds.map(|fd| libc::pollfd { fd: fd.as_raw_fd(), events: libc::POLLIN, revents: 0 });
    if wait(&mut set, limit) >= 0 {
        return Ok(set.map(|fd| fd.revents != 0));
    }
    match io::Error::last_os_error() {
        error if error.kind() == io::ErrorKind::Interrupted => Ok([false; N]),
        error => Err(error),
    }
}

/// Polls any number of descriptors. Descriptors with `true` are also ready when they are writable.
pub(super) fn ready(fds: &[(BorrowedFd<'_>, bool)], limit: Duration) -> io::Result<Vec<bool>> {
    let poll = |(fd, writes): &(BorrowedFd<'_>, bool)| {
        let events = if *writes { libc::POLLIN | libc::POLLOUT } else { libc::POLLIN };
        libc::pollfd { fd: fd.as_raw_fd(), events, revents: 0 }
    };
    let mut set: Vec<libc::pollfd> = fds.iter().map(poll).collect();
    if wait(&mut set, limit) >= 0 {
        return Ok(set.iter().map(|fd| fd.revents != 0).collect());
    }
    match io::Error::last_os_error() {
        error if error.kind() == io::ErrorKind::Interrupted => Ok(vec![false; fds.len()]),
        error => Err(error),
    }
}

fn count(set: &[libc::pollfd]) -> libc::nfds_t {
    libc::nfds_t::try_from(set.len()).unwrap_or(libc::nfds_t::MAX)
}

#[cfg(any(target_os = "linux", target_os = "android"))]
#[expect(unsafe_code, reason = "the standard library cannot wait for a descriptor")]
fn wait(set: &mut [libc::pollfd], limit: Duration) -> libc::c_int {
    let limit = libc::timespec {
        tv_sec: libc::time_t::try_from(limit.as_secs()).unwrap_or(libc::time_t::MAX),
        // Below 10^9, so it fits into each width of c_long.
        tv_nsec: limit.subsec_nanos() as libc::c_long,
    };
    // SAFETY: `set` and `limit` outlive the call, the count is the length of `set`, and the descriptors
    // are borrowed by the caller and so are open.
    unsafe { libc::ppoll(set.as_mut_ptr(), count(set), &raw const limit, std::ptr::null()) }
}

#[cfg(not(any(target_os = "linux", target_os = "android")))]
#[expect(unsafe_code, reason = "the standard library cannot wait for a descriptor")]
fn wait(set: &mut [libc::pollfd], limit: Duration) -> libc::c_int {
    // Rounded up: a wait that ends too early would make the caller's loop busy.
    let millis = limit.as_nanos().div_ceil(1_000_000);
    let millis = libc::c_int::try_from(millis).unwrap_or(libc::c_int::MAX);
    // SAFETY: `set` outlives the call, the count is its length, and the descriptors are borrowed by the
    // caller and so are open.
    unsafe { libc::poll(set.as_mut_ptr(), count(set), millis) }
}
