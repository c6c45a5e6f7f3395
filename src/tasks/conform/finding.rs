//! Verdicts: what was expected, and what was seen. The texts are in `output`.

use super::figure::Figure;
use super::lss::LssSetting;
use super::stimulus::{Input, StimulusFailure};
use crate::canopen::frame::Frame;
use crate::canopen::nmt::NmtState;
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::canopen::value::DataType;
use crate::device::scalar::Scalar;
use crate::device::unit::Unit;
use crate::tasks::Failure;
use std::time::Duration;

/// The result of a case.
#[derive(Clone, Debug)]
pub enum Verdict {
    /// The device behaves as required.
    Pass,
    /// The device deviates. There is at least one finding.
    Deviates(Vec<Finding>),
    /// The case measures times, without a verdict.
    Measured(Vec<Figure>),
    /// The case was run or tried, without a result.
    NotJudged(Box<WhyNot>),
    /// The device does not have the feature, or the case was not allowed to run.
    NotApplicable(WhyNot),
}

/// A deviation: what was expected, and what was seen instead.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// The object of the request.
    pub object: Option<ObjectId>,
    /// What was expected.
    pub expected: Expected,
    /// What was seen.
    pub seen: Seen,
}

/// What the standard requires.
#[derive(Clone, Debug, PartialEq)]
pub enum Expected {
    /// One of these abort codes.
    Abort(&'static [u32]),
    /// An SDO answer with one of these command specifiers for the object of the request.
    Command(&'static [u8]),
    /// A segment with the toggle bit of the request.
    Segment,
    /// A frame with eight bytes.
    EightBytes,
    /// No answer.
    NoAnswer,
    /// Any answer.
    Answer,
    /// An entry with this sub-index, because sub-index 0 names it as the highest.
    Entry,
    /// These bytes.
    Bytes(Vec<u8>),
    /// Other bytes than these.
    OtherBytes(Vec<u8>),
    /// A CAN-ID that is not restricted.
    OtherCanId,
    /// Zeros in the unused bytes.
    ZeroPadding,
    /// A size of this many bytes.
    Size(usize),
    /// This CRC.
    Crc(u16),
    /// An abort with any code.
    Refused,
    /// An acknowledgement.
    Acknowledged,
    /// An LSS answer with this service.
    Service(u8),
    /// An answer of LSS service 13h with an error code of CiA 305.
    LssErrorCode,
    /// The result of setting a bit rate by LSS.
    RateCode {
        /// The code in table 0.
        code: u8,
        /// Whether the device accepts it.
        is_accepted: bool,
    },
    /// This number.
    Number(u64),
    /// A number in this range.
    Range(u64, u64),
    /// Printable text.
    Text,
    /// This NMT state.
    State(NmtState),
    /// PRE-OPERATIONAL, or OPERATIONAL if the device starts by itself.
    StateAfterBoot,
    /// One boot-up message with one byte 00h.
    BootUp,
    /// A heartbeat or guarding answer of one byte.
    OneByte,
    /// This many frames.
    Frames(usize),
    /// This period.
    Period(Duration),
    /// At least this interval.
    AtLeast(Duration),
    /// A frame within this time.
    Within(Duration),
    /// An emergency with code 0000h.
    NoError,
    /// The state, with a toggle bit that alternates.
    AlternatingToggle,
    /// The state, with the toggle bit 0.
    FirstToggle,
    /// PRE-OPERATIONAL, or an emergency with code 8130h.
    LifeGuardingEvent,
    /// Bit 0 is set if another bit is set.
    GenericErrorBit,
    /// A file that follows CiA 306.
    Cia306,
    /// The object is in the file.
    InFile,
    /// The object exists in the device.
    Exists,
    /// This data type in the file.
    Type(DataType),
    /// A default between these limits of the file.
    Limits(Option<Scalar>, Option<Scalar>),
    /// An accepted mapping of the object.
    Mapped,
    /// A number with all of these bits.
    BitsSet(u64),
    /// A number without these bits.
    BitsClear(u64),
    /// The marker of an overload: NaN, or the smallest integer.
    Marker,
    /// An emergency with this code.
    Emergency(u16),
    /// A value above this one.
    Above(f64),
    /// This share of a step of the input between these times.
    Step {
        /// The share in per cent.
        percent: u8,
        /// The earliest time.
        from: Duration,
        /// The latest time.
        until: Duration,
    },
    /// At most one value between the values before and after a step of the input.
    OneMean,
    /// A unit that can be converted to this one.
    UnitLike(Unit),
    /// A value in the unit of its channel.
    Measured {
        /// The value.
        value: f64,
        /// The largest difference.
        tolerance: f64,
    },
}

/// What was seen.
#[derive(Clone, Debug, PartialEq)]
pub enum Seen {
    /// An abort code.
    Abort(AbortCode),
    /// A frame.
    Frame(Frame),
    /// Nothing within this time.
    Nothing(Duration),
    /// These bytes.
    Bytes(Vec<u8>),
    /// A number.
    Number(u64),
    /// This state; `None` if no state was received.
    State(Option<NmtState>),
    /// This many frames.
    Frames(usize),
    /// This mean period.
    Period(Duration),
    /// A CRC.
    Crc(u16),
    /// A first frame after this time.
    After(Duration),
    /// A line of the file, counted from 1, and what is wrong.
    Line(usize, String),
    /// The object is not in the file.
    NotInFile,
    /// This data type in the file.
    Type(DataType),
    /// This value in the file.
    Value(Scalar),
    /// The device accepted it.
    Acknowledged,
    /// This share of the step after this time; `None` if it was not reached.
    StepAfter(Option<Duration>),
    /// This many different values.
    Values(usize),
    /// A unit.
    Unit(Unit),
    /// A value in the unit of its channel.
    Measured(f64),
}

/// Why a case has no verdict.
#[derive(Clone, Debug)]
pub enum WhyNot {
    /// The device does not have the object.
    NoObject(ObjectId),
    /// No object of the device is suitable, as far as its objects are known.
    NoSuitableObject,
    /// The device does not support this kind of transfer.
    NoSegments,
    /// The device does not support block transfer.
    NoBlocks,
    /// The device rejects another value of this object, so that nothing can be changed.
    NotWritable(ObjectId),
    /// The node does not send heartbeats, and has no node guarding.
    NoState,
    /// The device does not answer node guarding.
    NoGuarding,
    /// Life guarding is on: guard time and life time factor are not 0.
    LifeGuarding,
    /// The error history has entries, which the case would change.
    ErrorHistory,
    /// The device has no TPDO with a mapping and this transmission type.
    NoTpdo,
    /// The device has no event timer.
    NoEventTimer,
    /// The TPDO is not sent.
    NoTpdoSent,
    /// The device does not answer remote requests, which CiA 301 allows.
    NoRemoteAnswer,
    /// The mapping is fixed.
    FixedMapping,
    /// The device has no error, and a wrong SYNC causes none.
    NoError,
    /// The device does not answer LSS.
    NoLss,
    /// The device does not answer this LSS service.
    NoService(u8),
    /// The device rejects this LSS service.
    LssRejected(u8),
    /// The bit rate of the bus or its code for LSS is unknown, so that the bit rate could not be set again.
    UnknownBitRate,
    /// The device can detect the bit rate. Whether detection is active cannot be read, so it could not be set again.
    DetectsBitRate {
        /// Whether the case has set the present bit rate. It then replaces the detection until the next power-on.
        was_set: bool,
    },
    /// The EDS file names no bit rates.
    NoBitRates,
    /// An earlier case could not set this setting of LSS again.
    LssNotRestored(LssSetting),
    /// There is no EDS file.
    NoEds,
    /// The case needs `--store`.
    NeedsStore,
    /// The bus carries no remote frames.
    NoRemoteFrames,
    /// Other nodes are on the bus.
    NotAlone,
    /// The device has no analogue input of CiA 404.
    NoChannel,
    /// The meaning of the number in this object is unknown.
    UnknownCode(ObjectId),
    /// The device rejected the value of this object, as it may.
    Rejected(ObjectId, AbortCode),
    /// The process value has not moved far enough.
    NotMoved(ObjectId),
    /// With the normal input, the process value has not returned to its value before the step.
    NotReturned(ObjectId),
    /// The step of the input takes longer than the response that it causes.
    StepTooSlow,
    /// The process value has crossed the limit by itself, before the case moved it.
    MovedEarly(ObjectId),
    /// The process value is so small that both expected values are the same.
    NearZero(ObjectId),
    /// The process value is not valid, or at the end of its range.
    NoValidValue(ObjectId),
    /// The input of the device cannot be changed, because there is no stimulus.
    NoStimulus,
    /// The input could not be set.
    Stimulus(Input, StimulusFailure),
    /// A request failed.
    Failed(Box<Failure>),
}

impl Verdict {
    /// Pass, or a deviation with these findings.
    pub(super) fn of(findings: impl IntoIterator<Item = Finding>) -> Verdict {
        let findings: Vec<Finding> = findings.into_iter().collect();
        if findings.is_empty() { Verdict::Pass } else { Verdict::Deviates(findings) }
    }

    pub(super) fn not_judged(why: WhyNot) -> Verdict {
        Verdict::NotJudged(Box::new(why))
    }

    /// The word in reports.
    pub fn name(&self) -> &'static str {
        match self {
            Verdict::Pass => "pass",
            Verdict::Deviates(_) => "deviates",
            Verdict::Measured(_) => "measured",
            Verdict::NotJudged(_) => "not-judged",
            Verdict::NotApplicable(_) => "not-applicable",
        }
    }
}

impl Finding {
    pub(super) fn new(expected: Expected, seen: Seen) -> Finding {
        Finding { object: None, expected, seen }
    }

    pub(super) fn at(object: ObjectId, expected: Expected, seen: Seen) -> Finding {
        Finding { object: Some(object), expected, seen }
    }

    /// The finding if a value differs from the expected one by more than `tolerance`. All are in the unit of the
    /// channel.
    pub(super) fn measured(object: ObjectId, expected: f64, tolerance: f64, seen: f64) -> Option<Finding> {
        let is_wrong = (seen - expected).abs() > tolerance;
        let expected = Expected::Measured { value: expected, tolerance };
        is_wrong.then(|| Finding::at(object, expected, Seen::Measured(seen)))
    }
}

impl Seen {
    /// An answer, or nothing within the time.
    pub(super) fn answer(answer: Option<Frame>, timeout: Duration) -> Seen {
        match answer {
            Some(frame) => abort_code(&frame).map_or(Seen::Frame(frame), Seen::Abort),
            None => Seen::Nothing(timeout),
        }
    }
}

/// The abort code of an SDO answer.
pub(super) fn abort_code(frame: &Frame) -> Option<AbortCode> {
    match frame.data() {
        [0x80, _, _, _, a, b, c, d] => Some(AbortCode(u32::from_le_bytes([*a, *b, *c, *d]))),
        _ => None,
    }
}
