//! TLS: the certificates that are trusted, and the faults of a connection.
//!
//! Without the feature `tls`, no [`Trust`] can be made.

#[cfg(not(feature = "tls"))]
mod absent;
#[cfg(feature = "tls")]
mod present;

use std::io;
use std::path::PathBuf;

#[cfg(not(feature = "tls"))]
pub use absent::Trust;
#[cfg(not(feature = "tls"))]
pub(super) use absent::trouble;
#[cfg(feature = "tls")]
pub use present::Trust;
#[cfg(feature = "tls")]
pub(super) use present::trouble;

/// Why there are no certificates to trust.
#[derive(Debug)]
pub enum TrustError {
    /// The program was built without TLS.
    Unsupported,
    /// The system has no certificates of authorities: the words of the library, if there are any.
    NoneInSystem(Option<String>),
    /// The file cannot be read.
    Read(PathBuf, io::Error),
    /// The file contains no certificate.
    NoCertificate(PathBuf),
}
