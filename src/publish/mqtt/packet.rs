//! The packets of MQTT 3.1.1 that a publisher sends and receives.

use std::io::{self, Read};

/// A longer packet is not an answer to a publisher.
const LONGEST_BODY: usize = 2;

/// The settings of a connection.
#[derive(Clone, Debug)]
pub(super) struct Connect<'a> {
    /// The name of the client.
    pub(super) client: &'a str,
    /// The user name.
    pub(super) user: Option<&'a str>,
    /// The password. It needs a user name.
    pub(super) password: Option<&'a str>,
    /// The topic and the message that the broker publishes (retained) if the client is lost.
    pub(super) will: (&'a str, &'a str),
    /// The longest time between two packets of the client, in seconds.
    pub(super) keep_alive_s: u16,
}

/// A received packet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Received {
    /// The answer to CONNECT, with its return code.
    ConnAck(u8),
    /// The acknowledgement of a message.
    PubAck(u16),
    /// The answer to PINGREQ.
    PingResp,
}

/// PINGREQ.
pub(super) const PING: [u8; 2] = [0xC0, 0];

/// DISCONNECT.
pub(super) const DISCONNECT: [u8; 2] = [0xE0, 0];

/// CONNECT with a new session.
pub(super) fn connect(settings: &Connect<'_>) -> Vec<u8> {
    // Clean session, will with QoS 1, will retained.
    let mut flags = 0b0010_1110;
    let mut body = Vec::new();
    push_text(&mut body, "MQTT");
    body.push(4);
    let flags_at = body.len();
    body.push(0);
    body.extend_from_slice(&settings.keep_alive_s.to_be_bytes());
    push_text(&mut body, settings.client);
    push_text(&mut body, settings.will.0);
    push_text(&mut body, settings.will.1);
    if let Some(user) = settings.user {
        flags |= 0b1000_0000;
        push_text(&mut body, user);
        if let Some(password) = settings.password {
            flags |= 0b0100_0000;
            push_text(&mut body, password);
        }
    }
    body[flags_at] = flags;
    packet(0x10, &body)
}

/// Appends a PUBLISH with QoS 1.
pub(super) fn push_publish(out: &mut Vec<u8>, id: u16, topic: &str, payload: &[u8], retain: bool) {
    let mut body = Vec::with_capacity(topic.len() + payload.len() + 4);
    push_text(&mut body, topic);
    body.extend_from_slice(&id.to_be_bytes());
    body.extend_from_slice(payload);
    out.extend(packet(0b0011_0010 | u8::from(retain), &body));
}

fn packet(first: u8, body: &[u8]) -> Vec<u8> {
    let mut packet = vec![first];
    let mut left = body.len();
    loop {
        let digit = u8::try_from(left % 128).unwrap_or(0);
        left /= 128;
        packet.push(if left > 0 { digit | 128 } else { digit });
        if left == 0 {
            break;
        }
    }
    packet.extend_from_slice(body);
    packet
}

/// Appends a text with its length. A longer text is cut at 65535 bytes.
fn push_text(out: &mut Vec<u8>, text: &str) {
    let bytes = &text.as_bytes()[..text.len().min(usize::from(u16::MAX))];
    out.extend_from_slice(&u16::try_from(bytes.len()).unwrap_or(u16::MAX).to_be_bytes());
    out.extend_from_slice(bytes);
}

/// Reads one packet.
///
/// # Errors
/// Those of `input`; [`io::ErrorKind::InvalidData`] for a packet that no broker sends to a publisher.
pub(super) fn read(input: &mut dyn Read) -> io::Result<Received> {
    let mut byte = [0];
    input.read_exact(&mut byte)?;
    let first = byte[0];
    // Other packets are not for a publisher. Their length is not awaited.
    if !matches!(first, 0x20 | 0x40 | 0xD0) {
        return Err(io::ErrorKind::InvalidData.into());
    }
    input.read_exact(&mut byte)?;
    let mut body = vec![0; usize::from(byte[0])];
    if body.len() > LONGEST_BODY {
        return Err(io::ErrorKind::InvalidData.into());
    }
    input.read_exact(&mut body)?;
    match (first, body.as_slice()) {
        (0x20, [_, code]) => Ok(Received::ConnAck(*code)),
        (0x40, [high, low]) => Ok(Received::PubAck(u16::from_be_bytes([*high, *low]))),
        (0xD0, []) => Ok(Received::PingResp),
        _ => Err(io::ErrorKind::InvalidData.into()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packets_of_the_standard() {
        let settings =
            Connect { client: "c", user: Some("u"), password: Some("p"), will: ("t", "off"), keep_alive_s: 60 };
        let expected = b"\x10\x1d\0\x04MQTT\x04\xee\0\x3c\0\x01c\0\x01t\0\x03off\0\x01u\0\x01p";
        let mut expected = expected.to_vec();
        expected[1] = u8::try_from(expected.len() - 2).expect("short");
        assert_eq!(connect(&settings), expected);
        let mut out = Vec::new();
        push_publish(&mut out, 10, "a/b", b"x", true);
        assert_eq!(out, b"\x33\x08\0\x03a/b\0\x0ax");
        out.clear();
        push_publish(&mut out, 1, "t", &[0; 200], false);
        assert_eq!((&out[..3], out.len()), (&b"\x32\xcd\x01"[..], 208));
    }

    #[test]
    fn answers_are_read_and_garbage_is_an_error() {
        let read = |bytes: &[u8]| read(&mut &bytes[..]).map_err(|error| error.kind());
        assert_eq!(read(b"\x20\x02\0\x05"), Ok(Received::ConnAck(5)));
        assert_eq!(read(b"\x40\x02\x01\x02"), Ok(Received::PubAck(0x102)));
        assert_eq!(read(b"\xd0\0"), Ok(Received::PingResp));
        for bytes in
            [&b"HTTP/1.1 400 Bad Request\r\n\r\n"[..], b"\x40\x01\0", b"\x20\xff\xff\xff\xff\x01", b"\xd0\xff\xff\x7f"]
        {
            assert!(read(bytes).is_err(), "{bytes:?}");
        }
        assert_eq!(read(b"\x40\x02\0"), Err(io::ErrorKind::UnexpectedEof));
    }
}
