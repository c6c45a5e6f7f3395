//! Ctrl-C, SIGTERM and SIGHUP as events of a bus. Each signal is reported once.

use signal_hook::consts::{SIGINT, SIGTERM};
use signal_hook::{SigId, low_level};
use std::ffi::c_int;
use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::{Duration, Instant};

/// The longest sleep. A longer sleep could overflow an [`Instant`].
const MAX_SLEEP: Duration = Duration::from_secs(100 * 365 * 24 * 3600);

/// Receives the signals SIGINT and SIGTERM.
///
/// Each instance receives each signal that arrives during its lifetime, so two buses in one process both receive it.
/// After the first instance was created, Ctrl-C no longer ends the program. The owner must check for signals.
#[derive(Debug)]
pub struct Interrupts {
    /// Set after the byte of a signal is written to the pipe, so that a busy reader needs only one load.
    raised: Arc<AtomicBool>,
    pending: usize,
    registered: Vec<SigId>,
    #[cfg(unix)]
    pipe: std::os::unix::net::UnixStream,
}

impl Interrupts {
    /// Receives SIGINT and SIGTERM from now on, and SIGHUP unless the program was started to ignore it (`nohup`).
    ///
    /// # Errors
    /// The system has no more descriptors, or rejects the handler.
    pub fn new() -> io::Result<Interrupts> {
        #[cfg(unix)]
        if !ignores_hangup() {
            return Interrupts::for_signals(&[SIGINT, SIGTERM, signal_hook::consts::SIGHUP]);
        }
        Interrupts::for_signals(&[SIGINT, SIGTERM])
    }

    /// Returns whether a signal was not reported yet, and marks it as reported. Fast if there is none.
    pub fn take(&mut self) -> bool {
        if self.raised.load(Ordering::Acquire) {
            self.collect();
        }
        match self.pending.checked_sub(1) {
            Some(left) => {
                self.pending = left;
                true
            }
            None => false,
        }
    }

    /// Sleeps for `length`, or returns `true` at once when a signal arrives. Any length is allowed.
    pub fn wait_for(&mut self, length: Duration) -> bool {
        let now = Instant::now();
        self.wait_until(now.checked_add(length).unwrap_or(now + MAX_SLEEP))
    }
}

/// Reads lines from stdin in a thread. Raises SIGINT after each line, to wake a program that waits on a bus. Call this
/// only after the bus is opened, because SIGINT would end the program.
pub fn lines_with_interrupts() -> std::sync::mpsc::Receiver<String> {
    let (sender, lines) = std::sync::mpsc::channel();
    ignore_background_reads();
    std::thread::spawn(move || {
        for line in io::stdin().lines().map_while(Result::ok) {
            if sender.send(line).is_err() || low_level::raise(SIGINT).is_err() {
                return;
            }
        }
    });
    lines
}

/// Ignores SIGTTIN: reading the terminal in the background then returns an error and does not stop the process.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library cannot set the action of a signal")]
fn ignore_background_reads() {
    // SAFETY: SIG_IGN is a valid action, and this program has no handler for this signal.
    unsafe { libc::signal(libc::SIGTTIN, libc::SIG_IGN) };
}

#[cfg(not(unix))]
fn ignore_background_reads() {}

/// Makes a write beyond the file size limit (SIGXFSZ) fail like a write to a full disk, from now on.
///
/// # Errors
/// The system rejects the handler.
pub fn handle_file_size_limit() -> io::Result<()> {
    #[cfg(unix)]
    signal_hook::flag::register(signal_hook::consts::SIGXFSZ, Arc::default())?;
    Ok(())
}

/// Whether SIGHUP was ignored when the program started (`nohup`). Read only once, because handlers of this program
/// change the result.
#[cfg(unix)]
#[expect(unsafe_code, reason = "the standard library cannot read the action of a signal")]
fn ignores_hangup() -> bool {
    static IGNORED: std::sync::OnceLock<bool> = std::sync::OnceLock::new();
    *IGNORED.get_or_init(|| {
        // SAFETY: an all-zero `sigaction` is a valid value; with a null pointer for the new action, the call only
        // writes the present one.
        unsafe {
            let mut action: libc::sigaction = std::mem::zeroed();
            let result = libc::sigaction(libc::SIGHUP, std::ptr::null(), &raw mut action);
            result == 0 && action.sa_sigaction == libc::SIG_IGN
        }
    })
}

#[cfg(unix)]
impl Interrupts {
    fn for_signals(signals: &[c_int]) -> io::Result<Interrupts> {
        // Each byte in the pipe is one signal. It also wakes a waiting poll.
        let (pipe, write) = std::os::unix::net::UnixStream::pair()?;
        pipe.set_nonblocking(true)?;
        let raised = Arc::new(AtomicBool::new(false));
        let mut new = Interrupts { raised, pending: 0, registered: Vec::new(), pipe };
        for &signal in signals {
            new.registered.push(low_level::pipe::register(signal, write.try_clone()?)?);
            new.registered.push(signal_hook::flag::register(signal, Arc::clone(&new.raised))?);
        }
        Ok(new)
    }

    /// Sleeps until `deadline`, or returns `true` at once when a signal arrives.
    pub fn wait_until(&mut self, deadline: Instant) -> bool {
        loop {
            if self.take() {
                return true;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            match super::poll::readable([self.fd()], left) {
                Ok([true]) => self.collect(),
                Ok([false]) => {}
                // Polling one descriptor of this process fails only if no memory is left.
                Err(_) => std::thread::sleep(left),
            }
        }
    }

    /// The descriptor that becomes readable when a signal arrives.
    pub(super) fn fd(&self) -> std::os::fd::BorrowedFd<'_> {
        std::os::fd::AsFd::as_fd(&self.pipe)
    }

    /// Reads the pipe. Call this when [`Interrupts::fd`] is readable, because the byte arrives shortly before the flag.
    pub(super) fn collect(&mut self) {
        self.raised.store(false, Ordering::Release);
        let mut bytes = [0; 64];
        while let Ok(count @ 1..) = io::Read::read(&mut self.pipe, &mut bytes) {
            self.pending = self.pending.saturating_add(count);
        }
    }
}

/// Other systems have no pipe to wait on. Signals in quick succession count as one, and a sleep checks for them
/// periodically.
#[cfg(not(unix))]
impl Interrupts {
    fn for_signals(signals: &[c_int]) -> io::Result<Interrupts> {
        let raised = Arc::new(AtomicBool::new(false));
        let mut new = Interrupts { raised, pending: 0, registered: Vec::new() };
        for &signal in signals {
            new.registered.push(signal_hook::flag::register(signal, Arc::clone(&new.raised))?);
        }
        Ok(new)
    }

    /// Sleeps until `deadline`, or returns `true` soon after a signal arrives.
    pub fn wait_until(&mut self, deadline: Instant) -> bool {
        const SLICE: Duration = Duration::from_millis(20);
        loop {
            if self.take() {
                return true;
            }
            let left = deadline.saturating_duration_since(Instant::now());
            if left.is_zero() {
                return false;
            }
            std::thread::sleep(left.min(SLICE));
        }
    }

    fn collect(&mut self) {
        if self.raised.swap(false, Ordering::AcqRel) {
            self.pending = self.pending.saturating_add(1);
        }
    }
}

impl Drop for Interrupts {
    fn drop(&mut self) {
        for &id in &self.registered {
            low_level::unregister(id);
        }
    }
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use signal_hook::consts::{SIGUSR1, SIGUSR2};

    #[test]
    fn each_signal_is_reported_once() -> io::Result<()> {
        let mut first = Interrupts::for_signals(&[SIGUSR1])?;
        let mut second = Interrupts::for_signals(&[SIGUSR1])?;
        assert!(!first.take());
        low_level::raise(SIGUSR1)?;
        low_level::raise(SIGUSR1)?;
        assert_eq!([first.take(), first.take(), first.take()], [true, true, false]);
        low_level::raise(SIGUSR1)?;
        assert_eq!([second.take(), second.take(), second.take(), second.take()], [true, true, true, false]);
        drop(second);
        assert_eq!([first.take(), first.take()], [true, false]);
        Ok(())
    }

    #[test]
    fn a_signal_ends_a_sleep() -> io::Result<()> {
        let mut interrupts = Interrupts::for_signals(&[SIGUSR2])?;
        let start = Instant::now();
        assert!(!interrupts.wait_until(start + Duration::from_millis(20)));
        assert!(start.elapsed() >= Duration::from_millis(20));
        let raiser = std::thread::spawn(|| {
            std::thread::sleep(Duration::from_millis(30));
            low_level::raise(SIGUSR2)
        });
        // The longest sleep must not overflow.
        assert!(interrupts.wait_for(Duration::MAX));
        assert!(start.elapsed() < Duration::from_secs(60));
        assert!(!interrupts.wait_until(Instant::now()));
        assert!(raiser.join().is_ok_and(|raised| raised.is_ok()));
        Ok(())
    }
}
