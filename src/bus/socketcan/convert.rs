//! Converts frames to and from the form of the kernel.

use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use socketcan::CanFrame;

/// Converts a frame for the kernel.
pub(super) fn to_kernel(frame: &Frame) -> CanFrame {
    let mut raw = socketcan::frame::can_frame_default();
    raw.can_id = match frame.id() {
        CanId::Standard(id) => u32::from(id),
        CanId::Extended(id) => id | libc::CAN_EFF_FLAG,
    };
    if frame.is_remote() {
        raw.can_id |= libc::CAN_RTR_FLAG;
    }
    raw.can_dlc = frame.len();
    raw.data[..frame.data().len()].copy_from_slice(frame.data());
    CanFrame::from(raw)
}

/// Converts a frame of the kernel. Returns `None` if `raw` is not a classic data or remote frame.
pub(super) fn from_kernel(raw: &libc::can_frame) -> Option<Frame> {
    let id = if raw.can_id & libc::CAN_EFF_FLAG != 0 {
        CanId::extended(raw.can_id & libc::CAN_EFF_MASK)?
    } else {
        CanId::standard(u16::try_from(raw.can_id & libc::CAN_SFF_MASK).ok()?)?
    };
    if raw.can_id & libc::CAN_RTR_FLAG != 0 {
        return Frame::remote(id, raw.can_dlc).ok();
    }
    Frame::new(id, raw.data.get(..usize::from(raw.can_dlc))?).ok()
}
