//! The texts of TLS: certificates that are not accepted, and certificates of authorities that cannot be used.

use super::super::failure::ErrorMessage;
use crate::bus::Wall;
use crate::publish::sink::{CertificateFault, TlsFault};
use crate::publish::tls::TrustError;
use crate::tasks::Kind;

pub(super) fn certificate_text(fault: &CertificateFault) -> String {
    match fault {
        CertificateFault::OtherName(names) if names.is_empty() => {
            "the certificate of the server is for another name than that in the address".to_owned()
        }
        CertificateFault::OtherName(names) => {
            format!("the certificate of the server is for {}, not for the name in the address", names.join(", "))
        }
        CertificateFault::UnknownAuthority => {
            "the certificate of the server is not signed by a trusted authority".to_owned()
        }
        CertificateFault::IsAuthority => {
            "the server presents the certificate of an authority (CA:TRUE) as its own".to_owned()
        }
        CertificateFault::Expired(time) => format!("the certificate of the server has expired{}", day(*time)),
        CertificateFault::NotYetValid(time) => format!("the certificate of the server is not valid yet{}", day(*time)),
        CertificateFault::Other(words) => format!("the certificate of the server is not accepted: {words}"),
    }
}

/// The date of a time, in parentheses.
fn day(time: Option<Wall>) -> String {
    let text = time.map(|time| humantime::format_rfc3339_seconds(time.system_time()).to_string());
    text.map(|text| format!(" ({})", &text[..10])).unwrap_or_default()
}

pub(super) fn certificate_hint(fault: &CertificateFault) -> &'static str {
    match fault {
        CertificateFault::OtherName(_) => "use a name of the certificate in --to, or renew the certificate",
        CertificateFault::UnknownAuthority => "name the file with the certificate of the authority: --ca FILE",
        CertificateFault::IsAuthority => {
            "give the server a certificate with CA:FALSE; if it is self-signed, name it with --ca FILE"
        }
        CertificateFault::Expired(_) | CertificateFault::NotYetValid(_) => {
            "renew the certificate of the server, or set the clock of this computer"
        }
        CertificateFault::Other(_) => "check the certificate of the server: openssl s_client -connect HOST:PORT",
    }
}

pub(super) fn fault_text(fault: &TlsFault) -> String {
    match fault {
        TlsFault::NotTls => "the server does not use TLS at this port".to_owned(),
        TlsFault::Refused(words) => format!("no connection with TLS: {words}"),
    }
}

/// The failure if there are no certificates to trust.
pub fn trust_error(error: TrustError) -> ErrorMessage {
    let own = "name the file with the certificate of the authority: --ca FILE";
    match error {
        TrustError::Unsupported => ErrorMessage::usage("--to needs TLS, which this program does not contain")
            .hint("build it with --features tls, or use influx:// or mqtt:// through a tunnel (ssh -L)"),
        TrustError::NoneInSystem(words) => {
            let words = words.map(|words| format!(": {words}")).unwrap_or_default();
            ErrorMessage::new(Kind::Io, format!("this computer has no certificates of authorities{words}"))
                .hint(format!("install ca-certificates, or {own}"))
        }
        TrustError::Read(file, error) => ErrorMessage::new(Kind::Io, format!("read {}: {error}", file.display())),
        TrustError::NoCertificate(file) => {
            let message = format!("{} does not contain certificates, or a damaged one", file.display());
            ErrorMessage::usage(message).hint("the file must have the format PEM or DER")
        }
    }
}
