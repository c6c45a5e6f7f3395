//! Reads many frames with one system call, each with the kernel's timestamp and drop counter.
//!
//! `recvmmsg` is called directly. The `socketcan` crate reads one frame per call and ignores the drop counter. The
//! `nix` crate loses control messages when its buffers are reused (nix-rust/nix pull request 2813).

use std::io;
use std::os::fd::{AsRawFd, BorrowedFd};
use std::time::Duration;

/// The largest number of frames per system call.
pub(super) const BATCH: usize = 64;
/// The size for the control messages of one frame in bytes: two timestamps and a counter take 120.
const CONTROL: usize = 128;

/// A buffer with the alignment of the kernel's control message header.
#[repr(C, align(8))]
#[derive(Clone, Copy)]
struct Control([u8; CONTROL]);

/// The buffer for one frame.
#[derive(Clone, Copy)]
struct Slot {
    frame: libc::can_frame,
    control: Control,
    /// The numbers of bytes that the kernel wrote to `frame` and to `control`.
    filled: usize,
    control_filled: usize,
}

/// A frame as received from the kernel.
#[derive(Clone, Copy)]
pub(super) struct Message {
    /// The frame, not parsed yet.
    pub(super) frame: libc::can_frame,
    /// When the kernel received it, as time since 1970.
    pub(super) wall: Option<Duration>,
    /// When the interface received it, on the clock of the interface.
    pub(super) own: Option<Duration>,
    /// The total number of frames lost by this socket when this frame was queued.
    pub(super) lost: Option<u32>,
}

/// The frames of the last system call that were not returned yet.
pub(super) struct Batch {
    slots: Box<[Slot; BATCH]>,
    next: usize,
    count: usize,
}

impl Batch {
    pub(super) fn new() -> Batch {
        let frame = socketcan::frame::can_frame_default();
        let empty = Slot { frame, control: Control([0; CONTROL]), filled: 0, control_filled: 0 };
        Batch { slots: Box::new([empty; BATCH]), next: 0, count: 0 }
    }

    /// Returns the next frame of the batch.
    pub(super) fn next(&mut self) -> Option<Message> {
        while self.next < self.count {
            let slot = &self.slots[self.next];
            self.next += 1;
            // A frame of another length is not a classic frame. The socket does not request such frames.
            if slot.filled == size_of::<libc::can_frame>() {
                let info = parse_control(&slot.control.0[..slot.control_filled.min(CONTROL)]);
                return Some(Message { frame: slot.frame, wall: info.wall, own: info.own, lost: info.lost });
            }
        }
        None
    }

    /// Reads the waiting frames, up to `limit` (at most [`BATCH`]), and returns their number, which is never 0. If
    /// `wait` is set, waits up to the socket's `SO_RCVTIMEO` for the first frame.
    ///
    /// # Errors
    /// No frame is waiting, or the socket failed.
    #[expect(unsafe_code, reason = "no safe interface to recvmmsg delivers the drop counter")]
    pub(super) fn fill(&mut self, socket: BorrowedFd<'_>, wait: bool, limit: usize) -> io::Result<usize> {
        let flags = if wait { libc::MSG_WAITFORONE } else { libc::MSG_DONTWAIT };
        (self.next, self.count) = (0, 0);
        // SAFETY: all-zero bytes are a valid iovec and mmsghdr: lengths of 0 and null pointers.
        let mut parts: [libc::iovec; BATCH] = unsafe { std::mem::zeroed() };
        // SAFETY: as above.
        let mut headers: [libc::mmsghdr; BATCH] = unsafe { std::mem::zeroed() };
        let mut header_count: libc::c_uint = 0;
        for ((slot, part), header) in self.slots.iter_mut().zip(&mut parts).zip(&mut headers).take(limit) {
            header_count += 1;
            part.iov_base = (&raw mut slot.frame).cast();
            part.iov_len = size_of::<libc::can_frame>();
            header.msg_hdr.msg_iov = part;
            header.msg_hdr.msg_iovlen = 1;
            header.msg_hdr.msg_control = slot.control.0.as_mut_ptr().cast();
            header.msg_hdr.msg_controllen = CONTROL as _;
        }
        // SAFETY: each header points to one part and one control buffer, with their actual lengths. `parts` and the
        // slots outlive the call and are not used elsewhere during it. Any bytes are a valid can_frame.
        let received = unsafe {
            libc::recvmmsg(socket.as_raw_fd(), headers.as_mut_ptr(), header_count, flags as _, std::ptr::null_mut())
        };
        let count = usize::try_from(received).map_err(|_| io::Error::last_os_error())?;
        for (slot, header) in self.slots.iter_mut().zip(&headers).take(count) {
            slot.filled = usize::try_from(header.msg_len).unwrap_or(0);
            slot.control_filled = header.msg_hdr.msg_controllen as _;
        }
        self.count = count;
        Ok(count)
    }
}

/// The content of the control messages of a frame; see [`Message`].
#[derive(Debug, Default, PartialEq, Eq)]
struct ControlInfo {
    wall: Option<Duration>,
    own: Option<Duration>,
    lost: Option<u32>,
}

/// Parses timestamps and drop counter from the control messages of one frame. Each message has a header with a length
/// (`size_t`, includes the header), a level and a type. It starts at a multiple of the size of `size_t`.
fn parse_control(mut control: &[u8]) -> ControlInfo {
    const WORD: usize = size_of::<usize>();
    let mut info = ControlInfo::default();
    while let Some((len, rest)) = control.split_first_chunk::<WORD>() {
        let Some((level, rest)) = rest.split_first_chunk::<4>() else { break };
        let Some((kind, _)) = rest.split_first_chunk::<4>() else { break };
        let len = usize::from_ne_bytes(*len);
        let Some(data) = control.get(WORD + 8..len) else { break };
        if i32::from_ne_bytes(*level) == libc::SOL_SOCKET {
            match i32::from_ne_bytes(*kind) {
                libc::SCM_TIMESTAMPNS => info.wall = read_timespec(data),
                // Three times: the kernel time, an unused time, and the hardware time, which is 0 if there is none.
                libc::SCM_TIMESTAMPING => {
                    let own = data.get(data.len() / 3 * 2..).and_then(read_timespec);
                    info.own = own.filter(|own| !own.is_zero());
                }
                libc::SO_RXQ_OVFL => info.lost = data.first_chunk().map(|bytes| u32::from_ne_bytes(*bytes)),
                _ => {}
            }
        }
        control = control.get(len.next_multiple_of(WORD)..).unwrap_or_default();
    }
    info
}

/// Parses a `timespec` with 64-bit or 32-bit fields.
fn read_timespec(data: &[u8]) -> Option<Duration> {
    let (seconds, nanos) = if data.len() >= 16 {
        let (seconds, rest) = data.split_first_chunk()?;
        (u64::from_ne_bytes(*seconds), u64::from_ne_bytes(*rest.first_chunk()?))
    } else {
        let (seconds, rest) = data.split_first_chunk()?;
        (u64::from(u32::from_ne_bytes(*seconds)), u64::from(u32::from_ne_bytes(*rest.first_chunk()?)))
    };
    Some(Duration::new(seconds, u32::try_from(nanos).ok().filter(|&nanos| nanos < 1_000_000_000)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A control message in the layout of the kernel.
    fn message(level: i32, kind: i32, data: &[u8]) -> Vec<u8> {
        let len = size_of::<usize>() + 8 + data.len();
        let mut bytes = [&len.to_ne_bytes()[..], &level.to_ne_bytes(), &kind.to_ne_bytes(), data].concat();
        bytes.resize(len.next_multiple_of(size_of::<usize>()), 0xee);
        bytes
    }

    fn timestamp(seconds: i64, nanos: i64) -> Vec<u8> {
        let data = [seconds.to_ne_bytes(), nanos.to_ne_bytes()].concat();
        message(libc::SOL_SOCKET, libc::SCM_TIMESTAMPNS, &data)
    }

    #[test]
    fn timestamp_and_counter_are_read_in_either_order() {
        let counter = message(libc::SOL_SOCKET, libc::SO_RXQ_OVFL, &1829u32.to_ne_bytes());
        let time = timestamp(1_436_509_052, 249_713_001);
        let expected =
            || ControlInfo { wall: Some(Duration::new(1_436_509_052, 249_713_001)), own: None, lost: Some(1829) };
        assert_eq!(parse_control(&[time.clone(), counter.clone()].concat()), expected());
        assert_eq!(parse_control(&[counter.clone(), time.clone()].concat()), expected());
        let other = message(libc::SOL_SOCKET, 37, &[0; 48]);
        assert_eq!(parse_control(&[other, counter, time].concat()), expected());
        assert_eq!(parse_control(&[]), ControlInfo::default());
    }

    #[test]
    fn the_hardware_time_is_read() {
        let times = |numbers: [i64; 6]| {
            let data: Vec<u8> = numbers.iter().flat_map(|number| number.to_ne_bytes()).collect();
            message(libc::SOL_SOCKET, libc::SCM_TIMESTAMPING, &data)
        };
        let wall = timestamp(1_436_509_052, 5);
        let info = parse_control(&[wall.clone(), times([0, 0, 0, 0, 12, 345])].concat());
        assert_eq!(
            info,
            ControlInfo { wall: Some(Duration::new(1_436_509_052, 5)), own: Some(Duration::new(12, 345)), lost: None }
        );
        assert_eq!(parse_control(&times([7, 7, 7, 7, 0, 0])), ControlInfo::default(), "it has none");
        assert_eq!(parse_control(&times([7, 7, 7, 7, -1, 0])).own, Some(Duration::new(u64::MAX, 0)));
    }

    #[test]
    fn invalid_control_messages_are_ignored() {
        let time = timestamp(1, 2);
        for end in 0..time.len() {
            assert_eq!(parse_control(&time[..end]), ControlInfo::default(), "{end}");
        }
        for len in [0usize, 1, 15, 16, 1000, usize::MAX] {
            let mut wrong = time.clone();
            wrong[..size_of::<usize>()].copy_from_slice(&len.to_ne_bytes());
            assert_eq!(parse_control(&wrong), ControlInfo::default(), "{len}");
        }
        assert_eq!(parse_control(&timestamp(1, 1_000_000_000)), ControlInfo::default());
        assert_eq!(parse_control(&timestamp(1, -1)), ControlInfo::default());
    }

    #[test]
    fn a_32_bit_timespec() {
        let data = [7u32.to_ne_bytes(), 5u32.to_ne_bytes()].concat();
        assert_eq!(read_timespec(&data), Some(Duration::new(7, 5)));
        assert_eq!(read_timespec(&data[..6]), None);
    }
}
