//! Opens stdout, or reports that it was closed when the program started.
//!
//! Before `main`, the standard library replaces a closed stdout with `/dev/null`. It also ignores errors of writing to
//! a closed stdout. So this module checks stdout before the standard library starts.

use std::io;
use std::sync::atomic::{AtomicBool, Ordering};

static IS_CLOSED: AtomicBool = AtomicBool::new(false);

/// Runs before `main` and before the start of the standard library.
#[cfg(target_os = "linux")]
#[used]
#[expect(unsafe_code, reason = "std has no function that runs before it opens the closed descriptors")]
#[unsafe(link_section = ".init_array")]
static CHECK_STDOUT: extern "C" fn() = {
    extern "C" fn check_stdout() {
        // SAFETY: F_GETFD only reads, and any descriptor is allowed.
        let flags = unsafe { libc::fcntl(libc::STDOUT_FILENO, libc::F_GETFD) };
        IS_CLOSED.store(flags == -1, Ordering::Relaxed);
    }
    check_stdout
};

/// Returns stdout.
///
/// # Errors
/// stdout was closed when the program started. The error kind differs from `BrokenPipe`, the kind for a closed pipe.
pub fn stdout() -> io::Result<io::Stdout> {
    if IS_CLOSED.load(Ordering::Relaxed) { Err(io::Error::other("it is closed")) } else { Ok(io::stdout()) }
}
