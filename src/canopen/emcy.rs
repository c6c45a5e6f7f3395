//! Emergency messages (CiA 301, 7.2.7) and the error register (7.5.2.2).

use super::frame::Frame;
use std::fmt;

/// An emergency message (EMCY). It may have fewer than eight bytes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Emergency {
    /// The emergency error code; 0000h means that an error was reset.
    pub code: u16,
    /// The error register (1001h), if the message contains it.
    pub register: Option<ErrorRegister>,
    /// The manufacturer-specific bytes 3 to 7; missing bytes are 0.
    pub manufacturer: [u8; 5],
}

impl Emergency {
    /// Parses the data of an emergency frame; `None` if it has fewer than two bytes. The caller finds the node by the
    /// COB-ID (1014h, or the predefined identifier).
    pub fn parse(frame: &Frame) -> Option<Emergency> {
        let [low, high, rest @ ..] = frame.data() else { return None };
        let mut manufacturer = [0; 5];
        if let Some((_, bytes)) = rest.split_first() {
            manufacturer[..bytes.len()].copy_from_slice(bytes);
        }
        let register = rest.first().copied().map(ErrorRegister);
        Some(Emergency { code: u16::from_le_bytes([*low, *high]), register, manufacturer })
    }

    /// Returns the meaning of an error code or its class (CiA 301, table 26). Used if the device description has none.
    pub fn class(code: u16) -> &'static str {
        match code {
            0x8110 => "CAN overrun",
            0x8120 => "CAN error passive",
            0x8130 => "life guard or heartbeat error",
            0x8140 => "recovered from bus-off",
            0x8150 => "CAN-ID collision",
            0x8210 => "PDO not processed because of its length",
            0x8220 => "PDO length exceeded",
            0x8230 => "DAM MPDO not processed",
            0x8240 => "unexpected SYNC length",
            0x8250 => "RPDO time-out",
            _ => match code >> 8 {
                0x00 => "no error",
                0x10 => "generic error",
                0x20 => "current",
                0x21 => "current, input side",
                0x22 => "current inside the device",
                0x23 => "current, output side",
                0x30 => "voltage",
                0x31 => "mains voltage",
                0x32 => "voltage inside the device",
                0x33 => "output voltage",
                0x40 => "temperature",
                0x41 => "ambient temperature",
                0x42 => "device temperature",
                0x50..=0x5f => "device hardware",
                0x60 => "device software",
                0x61 => "internal software",
                0x62 => "user software",
                0x63 => "data set",
                0x70..=0x7f => "additional modules",
                0x80 => "monitoring",
                0x81 => "communication",
                0x82 => "protocol error",
                0x90..=0x9f => "external error",
                0xf0 => "additional functions",
                0xff => "device specific",
                _ => "unknown error class",
            },
        }
    }
}

/// The error register, 1001h.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorRegister(pub u8);

impl fmt::Display for ErrorRegister {
    /// The names of the set bits, or `no error`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        const NAMES: [&str; 8] =
            ["generic", "current", "voltage", "temperature", "communication", "profile", "reserved", "manufacturer"];
        if self.0 == 0 {
            return f.write_str("no error");
        }
        let mut separator = "";
        for (bit, name) in NAMES.iter().enumerate() {
            if self.0 >> bit & 1 != 0 {
                write!(f, "{separator}{name}")?;
                separator = ", ";
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overload_of_the_mh4() {
        let frame: Frame = "081#01F0810103000000".parse().expect("a frame");
        let emergency = Emergency::parse(&frame).expect("an emergency");
        assert_eq!(emergency.code, 0xf001);
        assert_eq!(emergency.register.map(|register| register.to_string()).as_deref(), Some("generic, manufacturer"));
        assert_eq!(emergency.manufacturer, [1, 3, 0, 0, 0]);
        assert_eq!(Emergency::class(emergency.code), "additional functions");
    }

    #[test]
    fn short_ones_are_read_as_far_as_they_go() {
        let parse = |text: &str| Emergency::parse(&text.parse().expect("a frame"));
        assert_eq!(parse("081#"), None);
        assert_eq!(parse("081#01"), None);
        assert_eq!(parse("081#0000").map(|emergency| (emergency.code, emergency.register)), Some((0, None)));
        assert_eq!(parse("081#0150810102").map(|emergency| emergency.manufacturer), Some([1, 2, 0, 0, 0]));
    }
}
