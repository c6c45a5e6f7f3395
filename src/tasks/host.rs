//! The host's side of a bus: what to type where the program may not set the interface itself.

use super::{Failure, Kind};
use crate::bus::BusError;

/// What a person types to take the interface `name` up, at a bit rate in bit/s where one is given.
pub fn by_hand(name: &str, bit_rate: Option<u32>) -> String {
    match bit_rate {
        None => format!("sudo ip link set {name} up"),
        Some(bit_rate) => format!(
            "sudo ip link set {name} down; sudo ip link set {name} type can bitrate {bit_rate}; \
             sudo ip link set {name} up"
        ),
    }
}

/// Why the interface was not set, with `way_out` where only the privilege was missing.
pub fn not_set(error: BusError, way_out: &str) -> Failure {
    match &error {
        BusError::Permission(_) => Failure::from(error).hint(format!("by hand: {way_out}")),
        // The bus that does not need any of this is no way out here.
        BusError::Unsupported(message) => Failure::new(Kind::Bus, message),
        _ => error.into(),
    }
}
