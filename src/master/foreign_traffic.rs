//! Detects another master on the same SDO channel.
//!
//! An SDO server carries out one transfer at a time. If another master starts a segmented transfer during our transfer,
//! the server continues with the new transfer. A segment does not identify its transfer. So our next seven bytes may
//! come from another object, or from the start of the object.
//!
//! Two kinds of frames show such a transfer. Each received request is foreign, because a bus does not return our own
//! frames. And the server announces each segmented transfer that it starts.
//!
//! If such frames are received, our transfer waits until the foreign transfer has ended, and then restarts. A foreign
//! expedited transfer between two of our segments is harmless: the server continues or aborts our transfer.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::sdo::{AbortCode, TransferError};
use std::time::Duration;

/// A foreign transfer without frames for this time has ended.
const IDLE_TIMEOUT: Duration = Duration::from_millis(50);

/// The foreign traffic on the channel during one of our transfers.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct ForeignTraffic {
    /// Whether any foreign frame was received.
    seen: bool,
    /// Whether a request of another master was received.
    requested: bool,
    /// Whether the node answered a request of another master.
    answered: bool,
    /// Whether a segmented or block transfer was seen.
    in_segments: bool,
    /// Whether a block transfer was seen.
    in_blocks: bool,
    /// When our transfer first backed off.
    since: Option<Mono>,
    /// Until when our transfer waits.
    back_off_until: Option<Mono>,
}

/// The kind of foreign transfer that a frame shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum FrameKind {
    Expedited,
    Segments,
    Blocks,
    /// The last segment of an upload, or an abort.
    End,
}

impl FrameKind {
    fn from_frame(frame: &Frame) -> Option<FrameKind> {
        let &command = frame.data().first()?;
        let expedited = if command & 0x02 != 0 { FrameKind::Expedited } else { FrameKind::Segments };
        let is_request = frame.id().sdo_request_node().is_some();
        Some(match (is_request, command >> 5) {
            // Initiate download.
            (true, 1) => expedited,
            // Initiate upload. The answer shows the kind of transfer.
            (true, 2) => FrameKind::Expedited,
            (true, 0 | 3) => FrameKind::Segments,
            (_, 4) => FrameKind::End,
            (true, _) => FrameKind::Blocks,
            (false, 2) => expedited,
            (false, 0) if command & 0x01 != 0 => FrameKind::End,
            (false, 0 | 1) => FrameKind::Segments,
            (false, 5 | 6) => FrameKind::Blocks,
            (false, _) => FrameKind::Expedited,
        })
    }
}

impl ForeignTraffic {
    /// Records a frame on the channel that does not answer our transfer.
    pub(super) fn record(&mut self, frame: &Frame, now: Mono) {
        let Some(kind) = FrameKind::from_frame(frame) else { return };
        self.seen = true;
        let is_request = frame.id().sdo_request_node().is_some();
        self.answered |= self.requested && !is_request;
        self.requested |= is_request;
        self.in_blocks |= kind == FrameKind::Blocks;
        self.in_segments |= matches!(kind, FrameKind::Segments | FrameKind::Blocks);
        if let Some(until) = &mut self.back_off_until {
            match kind {
                // In a block transfer, any segment number could look like an end.
                FrameKind::End if !self.in_blocks => *until = now,
                FrameKind::Segments | FrameKind::Blocks | FrameKind::End => *until = now + IDLE_TIMEOUT,
                FrameKind::Expedited => {}
            }
        }
    }

    /// Whether another master certainly uses the channel.
    pub(super) fn is_requested(self) -> bool {
        self.requested
    }

    /// Whether the node answers another master, and is therefore not silent.
    pub(super) fn is_served(self) -> bool {
        self.answered
    }

    /// Whether segments can no longer be assigned to our transfer.
    pub(super) fn conflicts(self) -> bool {
        self.in_segments
    }

    /// Whether a finished segmented transfer may contain foreign segments.
    ///
    /// `announced` and `delivered` are sizes in bytes.
    pub(super) fn is_suspect(self, announced: Option<u32>, delivered: usize) -> bool {
        let as_announced = announced.is_none_or(|size| usize::try_from(size) == Ok(delivered));
        // A master that interfered once may still use the channel, even if no further request was received.
        self.in_segments || (self.seen || self.since.is_some()) && !as_announced
    }

    /// Whether foreign traffic may have caused this failure. Abort codes about the object itself (other than 05xx)
    /// do not depend on other masters.
    pub(super) fn explains(self, error: TransferError) -> bool {
        (self.seen || self.since.is_some())
            && match error {
                TransferError::Aborted(AbortCode(code)) => code >> 24 == 0x05,
                TransferError::Violation(..) | TransferError::NoAnswer => true,
            }
    }

    /// Makes our transfer wait for the end of the foreign transfer. Returns `false` if our transfer has already waited
    /// for `limit`.
    pub(super) fn back_off(&mut self, now: Mono, limit: Duration) -> bool {
        let since = *self.since.get_or_insert(now);
        let others = ForeignTraffic { seen: false, in_segments: false, ..*self };
        *self = ForeignTraffic { back_off_until: Some(now + IDLE_TIMEOUT), ..others };
        now.since(since) < limit
    }

    /// Returns until when our transfer waits; `None` if it does not wait.
    pub(super) fn back_off_until(self) -> Option<Mono> {
        self.back_off_until
    }

    /// Records that our transfer restarts: earlier frames no longer count.
    pub(super) fn restart(&mut self) {
        *self = ForeignTraffic { since: self.since, requested: self.requested, ..ForeignTraffic::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LIMIT: Duration = Duration::from_millis(1000);

    fn ms(millis: u64) -> Mono {
        Mono::at(Duration::from_millis(millis))
    }

    fn after(texts: &[&str]) -> ForeignTraffic {
        let mut traffic = ForeignTraffic::default();
        texts.iter().for_each(|text| traffic.record(&text.parse().expect("a frame"), ms(0)));
        traffic
    }

    #[test]
    fn foreign_expedited_transfers_are_harmless() {
        let traffic =
            after(&["605#4018100100000000", "585#4318100147000000", "605#2317100001000000", "585#6017100000000000"]);
        assert!(!traffic.conflicts());
        assert!(!traffic.is_suspect(Some(8), 8) && !traffic.is_suspect(None, 8));
        assert!(traffic.is_suspect(Some(8), 15), "the server restarted in the middle");
    }

    #[test]
    fn foreign_segments_and_blocks_conflict() {
        for kind in [
            "585#4108100023000000",
            "585#4008100000000000",
            "605#6000000000000000",
            "605#7000000000000000",
            "605#0041424344454647",
            "605#2101200014000000",
            "605#A408100020000000",
            "605#C601200014000000",
        ] {
            assert!(after(&[kind]).conflicts(), "{kind}");
            assert!(after(&[kind]).is_suspect(Some(8), 8), "{kind}");
        }
        assert!(!after(&["605#", "585#", "605#8008100000000405"]).conflicts());
    }

    #[test]
    fn foreign_traffic_explains_protocol_failures_only() {
        let (refused, toggle) = (AbortCode(0x0602_0000), AbortCode(0x0503_0000));
        for traffic in [ForeignTraffic::default(), after(&["605#4018100100000000"])] {
            assert!(!traffic.explains(TransferError::Aborted(refused)));
            assert_eq!(traffic.explains(TransferError::Aborted(toggle)), traffic != ForeignTraffic::default());
            assert_eq!(traffic.explains(TransferError::NoAnswer), traffic != ForeignTraffic::default());
        }
    }

    #[test]
    fn backing_off_ends_with_the_foreign_transfer_or_after_the_idle_timeout() {
        let record =
            |traffic: &mut ForeignTraffic, text: &str, at| traffic.record(&text.parse().expect("a frame"), ms(at));
        let mut traffic = after(&["585#4108100023000000"]);
        assert!(traffic.back_off(ms(100), LIMIT));
        assert_eq!(traffic.back_off_until(), Some(ms(150)));
        record(&mut traffic, "585#0041424344454647", 140);
        assert_eq!(traffic.back_off_until(), Some(ms(190)));
        record(&mut traffic, "605#4018100100000000", 150);
        assert_eq!(traffic.back_off_until(), Some(ms(190)));
        record(&mut traffic, "585#1141424344454647", 160);
        assert_eq!(traffic.back_off_until(), Some(ms(160)));
        traffic.restart();
        assert!(traffic.back_off_until().is_none() && !traffic.conflicts());
        assert!(traffic.is_suspect(Some(10), 8) && !traffic.is_suspect(Some(8), 8));
        // The limit counts from the first back-off.
        assert!(traffic.back_off(ms(1099), LIMIT) && !traffic.back_off(ms(1100), LIMIT));

        let mut traffic = after(&["605#A408100020000000"]);
        assert!(traffic.back_off(ms(100), LIMIT));
        record(&mut traffic, "585#0141424344454647", 120);
        assert_eq!(traffic.back_off_until(), Some(ms(170)), "the first segment of a block does not end the transfer");
    }
}
