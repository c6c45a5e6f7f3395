//! The words for findings.

use crate::bus::time::format_duration;
use crate::device::scalar::Scalar;
use crate::output::failure::ErrorMessage;
use crate::output::text::spaced_bytes;
use crate::tasks::conform::{Expected, Figure, Finding, LssSetting, Seen, Statistic, StimulusFailure, WhyNot};
use std::time::Duration;

/// A finding in one line: the object, what was expected, and what was seen.
pub fn finding(finding: &Finding) -> String {
    let object = finding.object.map(|object| format!("{object}: ")).unwrap_or_default();
    format!("{object}expected {}; seen: {}", expected(&finding.expected), seen(&finding.seen))
}

/// The figures of a case in one line: `min 0.3 ms, median 0.4 ms, 99 % 0.6 ms, max 0.9 ms`.
pub(super) fn figures(figures: &[Figure]) -> String {
    let word = |figure: &Figure| format!("{} {}", statistic(figure.statistic), figure_time(figure.time));
    figures.iter().map(word).collect::<Vec<_>>().join(", ")
}

/// The word for a figure.
pub(super) fn statistic(statistic: Statistic) -> &'static str {
    match statistic {
        Statistic::P99 => "99 %",
        other => other.name(),
    }
}

/// A measured time with microseconds if it is short.
pub(super) fn figure_time(time: Duration) -> String {
    if time < Duration::from_millis(10) {
        return format!("{:.3} ms", time.as_secs_f64() * 1000.0);
    }
    duration(time)
}

/// Where the manual states a deviation: `known: the manual states it (page 7)`.
pub(super) fn page(page: &str) -> String {
    let place = match () {
        () if page.contains(char::is_alphabetic) => "",
        () if page.contains('.') => "section ",
        () => "page ",
    };
    format!("known: the manual states it ({place}{page})")
}

fn codes(codes: &[u32]) -> String {
    codes.iter().map(|code| format!("0x{code:08X}")).collect::<Vec<_>>().join(" or ")
}

/// A duration with at most one decimal digit of a millisecond.
fn duration(length: Duration) -> String {
    if length < Duration::from_secs(1) {
        let milliseconds = (length.as_secs_f64() * 10_000.0).round() / 10.0;
        return format!("{milliseconds} ms");
    }
    format_duration(length)
}

/// A value with at most six digits: `14.5038`, `0.00012`.
fn short(value: f64) -> String {
    format!("{value:.5e}").parse().unwrap_or(value).to_string()
}

fn expected(expected: &Expected) -> String {
    match expected {
        Expected::Abort(list) => format!("abort {}", codes(list)),
        Expected::Command(list) => {
            let list: Vec<String> = list.iter().map(|command| format!("{command:02X}h")).collect();
            format!("command specifier {}", list.join(" or "))
        }
        Expected::Segment => "a segment with the toggle bit of the request".to_owned(),
        Expected::EightBytes => "eight bytes".to_owned(),
        Expected::NoAnswer => "no answer".to_owned(),
        Expected::Answer => "an answer for this object".to_owned(),
        Expected::Entry => "an entry, because sub-index 0 names it as the highest".to_owned(),
        Expected::Bytes(bytes) => format!("the bytes {}", spaced_bytes(bytes)),
        Expected::OtherBytes(bytes) => format!("other bytes than {}", spaced_bytes(bytes)),
        Expected::OtherCanId => "another CAN-ID".to_owned(),
        Expected::ZeroPadding => "zeros in the unused bytes".to_owned(),
        Expected::Size(1) => "1 byte".to_owned(),
        Expected::Size(size) => format!("{size} bytes"),
        Expected::Crc(crc) => format!("CRC 0x{crc:04X}"),
        Expected::Refused => "an abort or an error code".to_owned(),
        Expected::Acknowledged => "an acknowledgement".to_owned(),
        Expected::Service(service) => format!("an answer with service {service:02X}h"),
        Expected::LssErrorCode => "an answer with service 13h and error code 0, 1 or 255".to_owned(),
        Expected::RateCode { code, is_accepted: true } => format!("an acknowledgement of bit rate code {code}"),
        Expected::RateCode { code, is_accepted: false } => format!("a rejection of bit rate code {code}"),
        Expected::Number(number) => format!("{number} (0x{number:X})"),
        Expected::AtLeast(time) => format!("at least {}", duration(*time)),
        Expected::NoError => "an emergency with code 0000h".to_owned(),
        Expected::Range(low, high) => format!("{low} to {high}"),
        Expected::Text => "printable text".to_owned(),
        Expected::State(state) => state.to_string(),
        Expected::StateAfterBoot => "pre-operational, or operational if the node starts by itself".to_owned(),
        Expected::BootUp => "one boot-up message with one byte 00h".to_owned(),
        Expected::OneByte => "one byte with bit 7 clear".to_owned(),
        Expected::Frames(count) => format!("{count} frames"),
        Expected::Period(period) => format!("a period of {}", duration(*period)),
        Expected::Within(time) => format!("a frame within {}", duration(*time)),
        Expected::AlternatingToggle => "the state, with a toggle bit that alternates".to_owned(),
        Expected::FirstToggle => "the state, with the toggle bit 0".to_owned(),
        Expected::LifeGuardingEvent => "emergency 8130h, or pre-operational".to_owned(),
        Expected::Cia306 => "a file as in CiA 306".to_owned(),
        Expected::InFile => "the object in the EDS file".to_owned(),
        Expected::Exists => "the object of the EDS file".to_owned(),
        Expected::Type(data_type) => format!("the data type {data_type} in the EDS file"),
        Expected::Limits(low, high) => limits(low.as_ref(), high.as_ref()),
        Expected::Mapped => "an accepted mapping".to_owned(),
        Expected::GenericErrorBit => "bit 0 set".to_owned(),
        Expected::BitsSet(bits) => format!("the bits 0x{bits:X}"),
        Expected::BitsClear(bits) => format!("none of the bits 0x{bits:X}"),
        Expected::Marker => "NaN or the smallest integer".to_owned(),
        Expected::Emergency(code) => format!("an emergency with code {code:04X}h"),
        Expected::Above(value) => format!("more than {}", short(*value)),
        Expected::Step { percent, from, until } => {
            format!("{percent} % of the step after {} to {}", duration(*from), duration(*until))
        }
        Expected::OneMean => "at most one value between the old and the new one".to_owned(),
        Expected::UnitLike(unit) => format!("a unit that can be converted to {unit}"),
        Expected::Measured { value, tolerance } => format!("{} (+/- {})", short(*value), short(*tolerance)),
    }
}

/// The limits of the file for a default.
fn limits(low: Option<&Scalar>, high: Option<&Scalar>) -> String {
    match (low, high) {
        (Some(low), Some(high)) => format!("a default of {low} to {high}"),
        (Some(low), None) => format!("a default of {low} or more"),
        (None, Some(high)) => format!("a default of at most {high}"),
        (None, None) => "a default".to_owned(),
    }
}

fn seen(seen: &Seen) -> String {
    match seen {
        Seen::Abort(code) => format!("abort {code}"),
        Seen::Frame(frame) => frame.to_string(),
        Seen::Nothing(time) => format!("nothing within {}", duration(*time)),
        Seen::Bytes(bytes) if bytes.is_empty() => "no bytes".to_owned(),
        Seen::Bytes(bytes) => format!("the bytes {}", spaced_bytes(bytes)),
        Seen::Number(number) => number.to_string(),
        Seen::State(Some(state)) => state.to_string(),
        Seen::State(None) => "no state".to_owned(),
        Seen::Frames(count) => format!("{count} frames"),
        Seen::Period(period) => duration(*period),
        Seen::Crc(crc) => format!("CRC 0x{crc:04X}"),
        Seen::Line(line, text) => format!("line {line}: {text}"),
        Seen::NotInFile => "no such object in the file".to_owned(),
        Seen::Type(data_type) => data_type.to_string(),
        Seen::Value(value) => format!("a default of {value}"),
        Seen::Acknowledged => "it was accepted".to_owned(),
        Seen::After(time) => format!("a frame after {}", duration(*time)),
        Seen::StepAfter(Some(time)) => format!("after {}", duration(*time)),
        Seen::StepAfter(None) => "not reached".to_owned(),
        Seen::Values(count) => format!("{count} values"),
        Seen::Unit(unit) => unit.to_string(),
        Seen::Measured(value) => short(*value),
    }
}

/// Why a case has no verdict.
pub(super) fn why_not(why: &WhyNot) -> String {
    match why {
        WhyNot::NoObject(object) => format!("the device does not have {object}"),
        WhyNot::NoSuitableObject => "no known object of the device is suitable".to_owned(),
        WhyNot::NoSegments => "the device has no segmented transfer".to_owned(),
        WhyNot::NoBlocks => "the device has no block transfer".to_owned(),
        WhyNot::NotWritable(object) => format!("{object} cannot be changed"),
        WhyNot::NoState => "the node shows no NMT state: it has no heartbeat (0x1017:0)".to_owned(),
        WhyNot::NoGuarding => "the device does not answer node guarding".to_owned(),
        WhyNot::LifeGuarding => "not run, because life guarding is on (0x100C and 0x100D are not 0)".to_owned(),
        WhyNot::ErrorHistory => "not run, because the error history (0x1003) is not empty".to_owned(),
        WhyNot::NoTpdo => "the device has no TPDO with a mapping and this transmission type".to_owned(),
        WhyNot::NoEventTimer => "the device has no event timer".to_owned(),
        WhyNot::NoTpdoSent => "the TPDO is not sent".to_owned(),
        WhyNot::NoRemoteAnswer => "the device does not answer remote requests, which CiA 301 allows".to_owned(),
        WhyNot::FixedMapping => "the mapping of the device is fixed".to_owned(),
        WhyNot::NoError => "the device has no error, and a SYNC of eight bytes causes none".to_owned(),
        WhyNot::NoLss => "the device does not answer LSS".to_owned(),
        WhyNot::NoService(service) => format!("the device does not answer LSS service {service:02X}h"),
        WhyNot::LssRejected(service) => format!("the device rejects LSS service {service:02X}h"),
        WhyNot::UnknownBitRate => "not run, because the bit rate of the bus is unknown".to_owned(),
        WhyNot::DetectsBitRate { was_set: false } => {
            "not run, because the device can detect the bit rate: this setting cannot be read, and would be lost"
                .to_owned()
        }
        WhyNot::DetectsBitRate { was_set: true } => {
            "the device may have automatic bit rate detection: if it was active, the present bit rate now replaces it \
             until the next power-on"
                .to_owned()
        }
        WhyNot::NoBitRates => "the EDS file names no bit rate".to_owned(),
        WhyNot::LssNotRestored(setting) => format!("not run: {}", lss_setting(*setting)),
        WhyNot::NoEds => "not run without --eds".to_owned(),
        WhyNot::NeedsStore => "not run without --store".to_owned(),
        WhyNot::NoRemoteFrames => "this bus carries no remote frames".to_owned(),
        WhyNot::NotAlone => "not run, because other nodes are on the bus".to_owned(),
        WhyNot::NoChannel => "the device has no analogue input of CiA 404".to_owned(),
        WhyNot::UnknownCode(object) => format!("the meaning of the number in {object} is unknown"),
        WhyNot::Rejected(object, code) => format!("{object}: the device rejected the write: {code}"),
        WhyNot::NotMoved(object) => format!("{object} did not change enough"),
        WhyNot::NotReturned(object) => format!("{object} did not return to its value before the step"),
        WhyNot::StepTooSlow => {
            "no filter constant gives a response that can be judged: the step or the filter is too slow".to_owned()
        }
        WhyNot::MovedEarly(object) => format!("{object} crossed the limit too early, by itself"),
        WhyNot::NearZero(object) => format!("{object} is too close to zero"),
        WhyNot::NoValidValue(object) => format!("{object} is not valid, or at the end of its range"),
        WhyNot::NoStimulus => "not run without --stimulus".to_owned(),
        WhyNot::Stimulus(input, failure) => format!("--stimulus {}: {}", input.name(), stimulus_failure(failure)),
        WhyNot::Failed(failure) => ErrorMessage::of(failure).message,
    }
}

/// The text for a setting that LSS could not set again.
pub(in crate::output) fn lss_setting(setting: LssSetting) -> String {
    let name = setting.name();
    format!("the old {name} could not be set again by LSS: a reset may activate another one, a power cycle restores it")
}

/// Why the command of `--stimulus` failed.
pub(in crate::output) fn stimulus_failure(failure: &StimulusFailure) -> String {
    match failure {
        StimulusFailure::NotStarted(reason) => format!("the command was not started: {reason}"),
        StimulusFailure::Exit(Some(code)) => format!("the command ended with exit code {code}"),
        StimulusFailure::Exit(None) => "a signal ended the command".to_owned(),
        StimulusFailure::TimedOut(time) => format!("the command did not end within {}", duration(*time)),
        StimulusFailure::Interrupted => "the command was interrupted".to_owned(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::object::ObjectId;
    use crate::canopen::sdo::AbortCode;

    #[test]
    fn finding_names_object_expectation_and_observation() {
        let abort = Seen::Abort(AbortCode(0x0504_0001));
        let found = Finding {
            object: Some(ObjectId::new(0x1017, 0)),
            expected: Expected::Abort(&[0x0607_0010, 0x0800_0000]),
            seen: abort,
        };
        let text = "0x1017:0: expected abort 0x06070010 or 0x08000000; seen: abort 0x05040001, ";
        assert!(finding(&found).starts_with(text), "{}", finding(&found));
        assert_eq!(seen(&Seen::Period(Duration::from_micros(100_449))), "100.4 ms");
        let near = Expected::Measured { value: 14.503_774, tolerance: 0.000_12 };
        assert_eq!(expected(&near), "14.5038 (+/- 0.00012)");
    }
}
