//! Encodes and decodes rtnetlink messages: a header, a fixed part, attributes (linux/netlink.h, linux/rtnetlink.h), in
//! host byte order. Invalid parts are skipped without an error.

/// `NLMSG_ERROR`: an acknowledgement (0) or an error.
const ERROR: u16 = 2;
/// `RTM_NEWLINK`: describes or sets an interface.
const NEW_LINK: u16 = 16;
/// `RTM_GETLINK`.
const GET_LINK: u16 = 18;
/// `NLM_F_REQUEST`.
const REQUEST: u16 = 1;
/// `NLM_F_ACK`: requests an acknowledgement.
const ACK: u16 = 4;
/// `NLM_F_CAPPED`: an error repeats only the header of the request.
const CAPPED: u16 = 0x100;
/// `NLM_F_ACK_TLVS`: attributes follow an error.
const EXPLAINED: u16 = 0x200;
/// `NLMSGERR_ATTR_MSG`: the message of the kernel.
const MESSAGE: u16 = 1;
/// `IFLA_IFNAME`.
pub(super) const NAME: u16 = 3;
/// The bits of an attribute's type without its flags (nested, network byte order).
const KIND_MASK: u16 = 0x3fff;
/// The length of `nlmsghdr` and of `ifinfomsg` in bytes.
const HEADER_LENGTH: usize = 16;

/// A request under construction.
#[derive(Debug)]
pub(super) struct Request(Vec<u8>);

impl Request {
    /// Returns a request for the description of an interface, by one of its names.
    pub(super) fn get(name: &str) -> Request {
        let mut request = Request::new(GET_LINK, REQUEST, 0, 0, 0);
        request.attribute(NAME, &[name.as_bytes(), &[0]].concat());
        request
    }

    /// Returns a request that sets an interface: the flags in the mask `change`, and the attributes added later.
    pub(super) fn set(index: i32, flags: u32, change: u32) -> Request {
        Request::new(NEW_LINK, REQUEST | ACK, index, flags, change)
    }

    fn new(kind: u16, message_flags: u16, index: i32, flags: u32, change: u32) -> Request {
        // `finish` sets the length and the sequence number, the kernel sets the port.
        let mut bytes = vec![0; HEADER_LENGTH];
        bytes[4..6].copy_from_slice(&kind.to_ne_bytes());
        bytes[6..8].copy_from_slice(&message_flags.to_ne_bytes());
        // Any address family and hardware type.
        bytes.extend_from_slice(&[0; 4]);
        bytes.extend_from_slice(&index.to_ne_bytes());
        bytes.extend_from_slice(&flags.to_ne_bytes());
        bytes.extend_from_slice(&change.to_ne_bytes());
        Request(bytes)
    }

    /// Adds an attribute.
    pub(super) fn attribute(&mut self, kind: u16, data: &[u8]) {
        self.nest(kind, |request| request.0.extend_from_slice(data));
    }

    /// Adds a nested attribute.
    pub(super) fn nest(&mut self, kind: u16, fill: impl FnOnce(&mut Request)) {
        let start = self.0.len();
        self.0.extend_from_slice(&[0, 0]);
        self.0.extend_from_slice(&kind.to_ne_bytes());
        fill(self);
        // Requests are short, so the length fits.
        let length = u16::try_from(self.0.len() - start).unwrap_or(u16::MAX);
        self.0[start..start + 2].copy_from_slice(&length.to_ne_bytes());
        self.0.resize(self.0.len().next_multiple_of(4), 0);
    }

    /// Completes the message.
    pub(super) fn finish(mut self, sequence: u32) -> Vec<u8> {
        let length = u32::try_from(self.0.len()).unwrap_or(u32::MAX);
        self.0[..4].copy_from_slice(&length.to_ne_bytes());
        self.0[8..12].copy_from_slice(&sequence.to_ne_bytes());
        self.0
    }
}

/// An answer of the kernel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Reply<'a> {
    /// The request was carried out.
    Done,
    /// Rejected: the error number, and the message of the kernel if there is one.
    Refused(i32, Option<&'a str>),
    /// The description of an interface.
    Link(Header, Attributes<'a>),
}

/// The fixed part of the description of an interface: `ifinfomsg`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Header {
    /// `ARPHRD_…`: the kind of hardware.
    pub(super) hardware: u16,
    /// The index in the kernel.
    pub(super) index: i32,
    /// `IFF_…`.
    pub(super) flags: u32,
}

/// Finds the reply with this sequence number; `None` if there is none.
pub(super) fn reply(mut bytes: &[u8], sequence: u32) -> Option<Reply<'_>> {
    while let Some(header) = bytes.first_chunk::<HEADER_LENGTH>() {
        let length = usize::try_from(u32_at(header, 0)?).ok()?;
        let body = bytes.get(HEADER_LENGTH..length)?;
        let (kind, message_flags) = (u16_at(header, 4)?, u16_at(header, 6)?);
        if u32_at(header, 8)? == sequence {
            match kind {
                ERROR => return parse_error(body, message_flags),
                NEW_LINK => {
                    let index = i32::from_ne_bytes(*body.get(4..)?.first_chunk()?);
                    let header = Header { hardware: u16_at(body, 2)?, index, flags: u32_at(body, 8)? };
                    return Some(Reply::Link(header, Attributes(body.get(HEADER_LENGTH..)?)));
                }
                _ => {}
            }
        }
        bytes = bytes.get(length.next_multiple_of(4)..).unwrap_or_default();
    }
    None
}

/// Parses an error: a negative error number, the header or the whole request, and attributes with the message.
fn parse_error(body: &[u8], message_flags: u16) -> Option<Reply<'_>> {
    let code = i32::from_ne_bytes(*body.first_chunk()?);
    if code == 0 {
        return Some(Reply::Done);
    }
    let request_length = if message_flags & CAPPED == 0 {
        usize::try_from(u32_at(body, 4)?).ok()?.next_multiple_of(4)
    } else {
        HEADER_LENGTH
    };
    let attributes = body.get(request_length.saturating_add(4)..).filter(|_| message_flags & EXPLAINED != 0);
    let message = attributes.and_then(|attributes| Attributes(attributes).text(MESSAGE));
    Some(Reply::Refused(code.saturating_neg(), message))
}

/// A sequence of attributes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Attributes<'a>(pub(super) &'a [u8]);

impl<'a> Attributes<'a> {
    /// The data of the first attribute of this kind.
    pub(super) fn get(self, kind: u16) -> Option<&'a [u8]> {
        self.into_iter().find(|(found, _)| *found == kind).map(|(_, data)| data)
    }

    /// The attributes inside an attribute.
    pub(super) fn nested(self, kind: u16) -> Option<Attributes<'a>> {
        self.get(kind).map(Attributes)
    }

    /// A text attribute without its terminating zero.
    pub(super) fn text(self, kind: u16) -> Option<&'a str> {
        let data = self.get(kind)?;
        let text = data.split(|&byte| byte == 0).next().unwrap_or(data);
        std::str::from_utf8(text).ok()
    }

    /// The number at the start of an attribute.
    pub(super) fn u32(self, kind: u16) -> Option<u32> {
        u32_at(self.get(kind)?, 0)
    }
}

impl<'a> Iterator for Attributes<'a> {
    type Item = (u16, &'a [u8]);

    fn next(&mut self) -> Option<(u16, &'a [u8])> {
        let (length, kind) = (u16_at(self.0, 0)?, u16_at(self.0, 2)?);
        let data = self.0.get(4..usize::from(length))?;
        self.0 = self.0.get(usize::from(length).next_multiple_of(4)..).unwrap_or_default();
        Some((kind & KIND_MASK, data))
    }
}

/// The 32-bit number at this offset.
pub(super) fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_ne_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// The 16-bit number at this offset.
pub(super) fn u16_at(bytes: &[u8], at: usize) -> Option<u16> {
    Some(u16::from_ne_bytes(*bytes.get(at..)?.first_chunk()?))
}
