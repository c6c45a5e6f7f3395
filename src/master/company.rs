//! Another master on the same SDO channel.
//!
//! A server has one transfer at a time. When somebody else begins one in segments while ours is under way,
//! the server goes on with theirs, and nothing in a segment tells whose it is: what we asked for as the next
//! seven bytes of our string comes out of another object, or from the start again. Seen from here, such a
//! transfer leaves traces: every request on the channel that we hear is somebody else's, since a bus does not
//! return what was sent on it; and a server says itself that it begins a transfer in segments.
//!
//! Then ours stands back until theirs is over, and begins anew. An expedited exchange of somebody else between
//! two of our segments does no harm by itself: servers either go on with ours or break it off.

use crate::bus::Mono;
use crate::canopen::frame::Frame;
use crate::canopen::sdo::{AbortCode, TransferError};
use std::time::Duration;

/// A transfer that has not moved for so long is taken for dead.
const IDLE: Duration = Duration::from_millis(50);

/// What was heard of others while a transfer of ours was under way.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Company {
    /// Somebody uses the channel.
    seen: bool,
    /// Somebody has a transfer in segments or blocks.
    in_segments: bool,
    in_blocks: bool,
    /// When ours was first in the way of theirs.
    since: Option<Mono>,
    /// Until when ours stands back.
    back_until: Option<Mono>,
}

/// What a frame on the channel says of somebody else's transfer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Sign {
    Expedited,
    Segments,
    Blocks,
    /// The last segment of a read, or an abort.
    End,
}

impl Sign {
    fn of(frame: &Frame) -> Option<Sign> {
        let &command = frame.data().first()?;
        let expedited = if command & 0x02 != 0 { Sign::Expedited } else { Sign::Segments };
        let is_request = frame.id().sdo_request_node().is_some();
        Some(match (is_request, command >> 5) {
            // The start of a write.
            (true, 1) => expedited,
            // The start of a read: how it goes tells the answer.
            (true, 2) => Sign::Expedited,
            (true, 0 | 3) => Sign::Segments,
            (_, 4) => Sign::End,
            (true, _) => Sign::Blocks,
            (false, 2) => expedited,
            (false, 0) if command & 0x01 != 0 => Sign::End,
            (false, 0 | 1) => Sign::Segments,
            (false, 5 | 6) => Sign::Blocks,
            (false, _) => Sign::Expedited,
        })
    }
}

impl Company {
    /// Notes what a frame that is on the channel, and no answer to us, tells of others.
    pub(super) fn hear(&mut self, frame: &Frame, now: Mono) {
        let Some(sign) = Sign::of(frame) else { return };
        self.seen = true;
        self.in_blocks |= sign == Sign::Blocks;
        self.in_segments |= matches!(sign, Sign::Segments | Sign::Blocks);
        if let Some(until) = &mut self.back_until {
            match sign {
                // In blocks every number of a segment would look like an end.
                Sign::End if !self.in_blocks => *until = now,
                Sign::Segments | Sign::Blocks | Sign::End => *until = now + IDLE,
                Sign::Expedited => {}
            }
        }
    }

    /// Whether nothing that comes in segments can be taken for ours any more.
    pub(super) fn is_in_the_way(self) -> bool {
        self.in_segments
    }

    /// Whether a transfer in segments that has come to its end may be somebody else's in part.
    pub(super) fn casts_doubt(self, announced: Option<u32>, delivered: usize) -> bool {
        let as_announced = announced.is_none_or(|size| usize::try_from(size) == Ok(delivered));
        // Who was in the way once shares the channel, heard or not.
        self.in_segments || (self.seen || self.since.is_some()) && !as_announced
    }

    /// Whether somebody else may be the reason of a failure. What a device says of the object itself it says
    /// to everybody.
    pub(super) fn explains(self, error: TransferError) -> bool {
        (self.seen || self.since.is_some())
            && match error {
                TransferError::Aborted(AbortCode(code)) => code >> 24 == 0x05,
                TransferError::Violation(..) | TransferError::NoAnswer => true,
            }
    }

    /// Lets the others come to their end first, unless that has been going on for longer than `patience`.
    pub(super) fn stand_back(&mut self, now: Mono, patience: Duration) -> bool {
        let since = *self.since.get_or_insert(now);
        let others = Company { seen: false, in_segments: false, ..*self };
        *self = Company { back_until: Some(now + IDLE), ..others };
        now.since(since) < patience
    }

    /// Until when ours stands back, if it does.
    pub(super) fn back_until(self) -> Option<Mono> {
        self.back_until
    }

    /// Ours begins; what was heard so far was before.
    pub(super) fn begin(&mut self) {
        *self = Company { since: self.since, ..Company::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const PATIENCE: Duration = Duration::from_millis(1000);

    fn ms(millis: u64) -> Mono {
        Mono::at(Duration::from_millis(millis))
    }

    fn after(texts: &[&str]) -> Company {
        let mut company = Company::default();
        texts.iter().for_each(|text| company.hear(&text.parse().expect("a frame"), ms(0)));
        company
    }

    #[test]
    fn expedited_company_does_no_harm() {
        let company =
            after(&["605#4018100100000000", "585#4318100147000000", "605#2317100001000000", "585#6017100000000000"]);
        assert!(!company.is_in_the_way());
        assert!(!company.casts_doubt(Some(8), 8) && !company.casts_doubt(None, 8));
        assert!(company.casts_doubt(Some(8), 15), "the server began anew in the middle");
    }

    #[test]
    fn segments_and_blocks_are_in_the_way() {
        for sign in [
            "585#4108100023000000",
            "585#4008100000000000",
            "605#6000000000000000",
            "605#7000000000000000",
            "605#0041424344454647",
            "605#2101200014000000",
            "605#A408100020000000",
            "605#C601200014000000",
        ] {
            assert!(after(&[sign]).is_in_the_way(), "{sign}");
            assert!(after(&[sign]).casts_doubt(Some(8), 8), "{sign}");
        }
        assert!(!after(&["605#", "585#", "605#8008100000000405"]).is_in_the_way());
    }

    #[test]
    fn which_failures_others_explain() {
        let (refused, toggle) = (AbortCode(0x0602_0000), AbortCode(0x0503_0000));
        for company in [Company::default(), after(&["605#4018100100000000"])] {
            assert!(!company.explains(TransferError::Aborted(refused)));
            assert_eq!(company.explains(TransferError::Aborted(toggle)), company != Company::default());
            assert_eq!(company.explains(TransferError::NoAnswer), company != Company::default());
        }
    }

    #[test]
    fn standing_back_ends_with_their_transfer_or_when_it_is_dead() {
        let hear = |company: &mut Company, text: &str, at| company.hear(&text.parse().expect("a frame"), ms(at));
        let mut company = after(&["585#4108100023000000"]);
        assert!(company.stand_back(ms(100), PATIENCE));
        assert_eq!(company.back_until(), Some(ms(150)));
        hear(&mut company, "585#0041424344454647", 140);
        assert_eq!(company.back_until(), Some(ms(190)));
        hear(&mut company, "605#4018100100000000", 150);
        assert_eq!(company.back_until(), Some(ms(190)));
        hear(&mut company, "585#1141424344454647", 160);
        assert_eq!(company.back_until(), Some(ms(160)));
        company.begin();
        assert!(company.back_until().is_none() && !company.is_in_the_way());
        assert!(company.casts_doubt(Some(10), 8) && !company.casts_doubt(Some(8), 8));
        // Again and again, but not for ever.
        assert!(company.stand_back(ms(1099), PATIENCE) && !company.stand_back(ms(1100), PATIENCE));

        let mut company = after(&["605#A408100020000000"]);
        assert!(company.stand_back(ms(100), PATIENCE));
        hear(&mut company, "585#0141424344454647", 120);
        assert_eq!(company.back_until(), Some(ms(170)), "the first segment of a block is no end");
    }
}
