//! TLS with rustls.

use super::TrustError;
use crate::bus::{Mono, Wall};
use crate::publish::sink::{CertificateFault, TlsFault, Trouble, io_trouble};
use crate::publish::stream::{Socket, Stream};
use rustls::crypto::{CryptoProvider, ring};
use rustls::pki_types::pem::PemObject;
use rustls::pki_types::{CertificateDer, ServerName, UnixTime};
use rustls::{CertificateError, ClientConfig, ClientConnection, Error, RootCertStore, StreamOwned};
use std::io;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;
use ureq::config::ConfigBuilder;
use ureq::tls::{Certificate, RootCerts, TlsConfig};
use ureq::typestate::AgentScope;

/// The certificates of authorities that are trusted.
#[derive(Clone, Debug)]
pub struct Trust {
    provider: Arc<CryptoProvider>,
    authorities: Vec<CertificateDer<'static>>,
}

impl Trust {
    /// Loads the certificates in a file (PEM or DER), or those of the system. If the environment variable
    /// `SSL_CERT_FILE` or `SSL_CERT_DIR` is set, it replaces the certificates of the system.
    ///
    /// # Errors
    /// There are no certificates.
    pub fn load(file: Option<&Path>) -> Result<Trust, TrustError> {
        let authorities = match file {
            Some(file) => {
                let bytes = std::fs::read(file).map_err(|error| TrustError::Read(file.to_owned(), error))?;
                certificates(bytes).ok_or_else(|| TrustError::NoCertificate(file.to_owned()))?
            }
            None => {
                let found = rustls_native_certs::load_native_certs();
                if found.certs.is_empty() {
                    return Err(TrustError::NoneInSystem(found.errors.first().map(ToString::to_string)));
                }
                found.certs
            }
        };
        Ok(Trust { provider: Arc::new(ring::default_provider()), authorities })
    }

    /// The configuration of an HTTP client that trusts these authorities.
    pub(in crate::publish) fn configure(&self, config: ConfigBuilder<AgentScope>) -> ConfigBuilder<AgentScope> {
        let all: Vec<_> = self.authorities.iter().map(|one| Certificate::from_der(one).to_owned()).collect();
        let tls = TlsConfig::builder()
            .root_certs(RootCerts::Specific(Arc::new(all)))
            .unversioned_rustls_crypto_provider(Arc::clone(&self.provider));
        config.tls_config(tls.build())
    }

    /// Begins TLS on a connection.
    ///
    /// # Errors
    /// The certificate of the server is not accepted, or the connection fails.
    pub(in crate::publish) fn connect(&self, socket: Socket, host: &str) -> Result<Box<dyn Stream>, Trouble> {
        let mut roots = RootCertStore::empty();
        roots.add_parsable_certificates(self.authorities.iter().cloned());
        let fault = |error: Error| fault(&error);
        let config = ClientConfig::builder_with_provider(Arc::clone(&self.provider))
            .with_safe_default_protocol_versions()
            .map_err(fault)?
            .with_root_certificates(roots)
            .with_no_client_auth();
        let name = ServerName::try_from(host.to_owned())
            .map_err(|error| Trouble::Tls(TlsFault::Refused(error.to_string())))?;
        let client = ClientConnection::new(Arc::new(config), name).map_err(fault)?;
        let mut stream = StreamOwned::new(client, socket);
        while stream.conn.is_handshaking() {
            stream.conn.complete_io(&mut stream.sock).map_err(|error| io_trouble(&error))?;
        }
        Ok(Box::new(stream))
    }
}

impl Stream for StreamOwned<ClientConnection, Socket> {
    fn set_deadline(&mut self, end: Mono) {
        self.sock.set_deadline(end);
    }
}

/// The certificates in PEM, or one in DER. `None` if there is none, or one that is damaged.
fn certificates(bytes: Vec<u8>) -> Option<Vec<CertificateDer<'static>>> {
    let pem: Vec<CertificateDer<'static>> = CertificateDer::pem_slice_iter(&bytes).collect::<Result<_, _>>().ok()?;
    let all = if pem.is_empty() { vec![CertificateDer::from(bytes)] } else { pem };
    let mut roots = RootCertStore::empty();
    all.iter().try_for_each(|one| roots.add(one.clone())).ok()?;
    Some(all)
}

/// The failure of TLS in a failed connection.
pub(in crate::publish) fn trouble(error: &io::Error) -> Option<Trouble> {
    Some(fault(error.get_ref()?.downcast_ref()?))
}

fn fault(error: &Error) -> Trouble {
    let wall = |time: &UnixTime| Some(Wall::at(Duration::from_secs(time.as_secs())));
    let Error::InvalidCertificate(certificate) = error else {
        return Trouble::Tls(match error {
            Error::InvalidMessage(_) | Error::InappropriateMessage { .. } => TlsFault::NotTls,
            other => TlsFault::Refused(other.to_string()),
        });
    };
    Trouble::Certificate(match certificate {
        CertificateError::NotValidForName => CertificateFault::OtherName(Vec::new()),
        CertificateError::NotValidForNameContext { presented, .. } => {
            CertificateFault::OtherName(presented.iter().map(|name| plain_name(name)).collect())
        }
        CertificateError::UnknownIssuer | CertificateError::BadSignature => CertificateFault::UnknownAuthority,
        CertificateError::Expired => CertificateFault::Expired(None),
        CertificateError::ExpiredContext { not_after, .. } => CertificateFault::Expired(wall(not_after)),
        CertificateError::NotValidYet => CertificateFault::NotYetValid(None),
        CertificateError::NotValidYetContext { not_before, .. } => CertificateFault::NotYetValid(wall(not_before)),
        other if other.to_string().contains("CaUsedAsEndEntity") => CertificateFault::IsAuthority,
        other => CertificateFault::Other(other.to_string()),
    })
}

/// The library presents a name as `DnsName("lab1")`.
fn plain_name(presented: &str) -> String {
    let name = presented.split_once('(').map_or(presented, |(_, name)| name.trim_end_matches(')'));
    name.trim_matches('"').to_owned()
}
