//! The result of a configuration service (CiA 305, 7.4).

use super::Service;
use std::fmt;

/// The two bytes of an acknowledgement. 0 means success; FFh means that the manufacturer-specific code is used.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct ErrorCode {
    /// The error code, whose meaning depends on the service.
    pub code: u8,
    /// The manufacturer-specific code, used if `code` is FFh.
    pub specific: u8,
}

impl ErrorCode {
    /// Manufacturer-specific error.
    pub const SPECIFIC: u8 = 0xff;

    /// Whether the service was carried out.
    pub fn is_success(self) -> bool {
        self.code == 0
    }

    /// Returns the meaning of the code for this service, if CiA 305 defines it.
    pub fn meaning(self, service: Service) -> Option<&'static str> {
        Some(match (service, self.code) {
            (_, 0) => "done",
            (Service::ConfigureNodeId, 1) => "node-ID out of range",
            (Service::ConfigureBitTiming, 1) => "bit rate not supported",
            (Service::Store, 1) => "storing not supported",
            (Service::Store, 2) => "the memory cannot be written",
            (_, ErrorCode::SPECIFIC) => "manufacturer-specific error",
            _ => return None,
        })
    }

    /// Describes the code: `error 1, node-ID out of range`, `error 255, manufacturer-specific error: 3`.
    pub fn describe(self, service: Service) -> impl fmt::Display {
        Description { code: self, service }
    }
}

struct Description {
    code: ErrorCode,
    service: Service,
}

impl fmt::Display for Description {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "error {}", self.code.code)?;
        if let Some(meaning) = self.code.meaning(self.service) {
            write!(f, ", {meaning}")?;
        }
        if self.code.code == ErrorCode::SPECIFIC { write!(f, ": {}", self.code.specific) } else { Ok(()) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_meaning_of_a_code_depends_on_the_service() {
        for (code, specific, service, words) in [
            (1, 0, Service::ConfigureNodeId, "error 1, node-ID out of range"),
            (1, 0, Service::ConfigureBitTiming, "error 1, bit rate not supported"),
            (1, 0, Service::Store, "error 1, storing not supported"),
            (2, 0, Service::Store, "error 2, the memory cannot be written"),
            (2, 0, Service::ConfigureNodeId, "error 2"),
            (255, 3, Service::Store, "error 255, manufacturer-specific error: 3"),
        ] {
            assert_eq!(ErrorCode { code, specific }.describe(service).to_string(), words);
        }
    }
}
