//! Converts the bytes of one value to a sample: type, decimal digits, status, and missing values.

use super::layout::{Layout, MeasuringRange, Rules, Scaling as Rule, Signal};
use super::sample::{Doubt, Number, Raw, Sample, Status};
use crate::bus::Stamp;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value};
use crate::device::scale::{Decimal, Scale};

/// How the bytes of one value become a sample.
#[derive(Clone, Debug)]
pub struct Reading {
    /// The number of the source.
    pub source: usize,
    /// The channel of a measured signal; `None` for other numbers.
    channel: Option<u8>,
    data_type: Option<DataType>,
    scaling: Scaling,
    has_marker: bool,
    has_status: bool,
    range: MeasuringRange,
    rules: Rules,
}

/// Whether a number has decimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Scaling {
    /// The number is used as sent.
    Plain,
    /// The number is a measured value with these decimal digits (6132h); `None` if they are unknown.
    Digits(Option<u8>),
    /// The number has a factor and an offset.
    Fixed(Scale),
    /// The decimal digits, or the step, could not be read.
    Unread,
}

impl Scaling {
    fn of(signal: &Signal) -> Scaling {
        match signal.rules.scaling {
            _ if signal.lacks_scale => Scaling::Unread,
            Rule::Digits => Scaling::Digits(signal.digits),
            Rule::Plain => Scaling::Plain,
            Rule::Fixed(scale) => Scaling::Fixed(scale),
        }
    }
}

/// More decimal digits are impossible: CiA 404 has 0 to 9.
const MAX_DIGITS: u8 = 9;

/// A REAL32 nearer to zero than this is not a measured value: it is probably an INTEGER32 up to 2.3e8.
const SMALLEST_REAL: f32 = 1e-30;

/// A value is an overload if it is outside the measuring range by more than this share of the range (CiA 404 devices:
/// 3.125 %).
const OVERLOAD_MARGIN: f64 = 0.03125;

impl Reading {
    /// Creates the reading for the process value of a signal. `source` is the number of the source.
    pub fn of_signal(signal: &Signal, data_type: Option<DataType>, source: usize) -> Reading {
        Reading {
            source,
            channel: Some(signal.channel),
            data_type,
            scaling: Scaling::of(signal),
            rules: signal.rules.clone(),
            has_marker: signal.has_marker,
            has_status: signal.status.is_some(),
            range: signal.range,
        }
    }

    /// Creates the reading for an object by its address. The process value and the net value of a signal are read as
    /// the signal. Other values of a channel (limits) have the decimal digits of the channel.
    pub fn of_object(layout: Layout<'_>, object: ObjectId, data_type: Option<DataType>, source: usize) -> Reading {
        if let Some(signal) = layout.measured_signal(object) {
            // The net value is not compared with the measuring range, because a tare shifts it.
            let has_status = signal.status.is_some() || !signal.is_value(object);
            return Reading { has_status, ..Reading::of_signal(signal, data_type, source) };
        }
        let scaling = match layout.signal_of(object) {
            Some(signal) if signal.lacks_scale => Scaling::Unread,
            Some(signal) => Scaling::Digits(signal.digits),
            None => Scaling::Plain,
        };
        Reading { scaling, ..Reading::plain(data_type, source) }
    }

    /// Creates the reading for a number without unit and decimal digits.
    pub fn plain(data_type: Option<DataType>, source: usize) -> Reading {
        let range = MeasuringRange::Unknown;
        let rules = Rules::default();
        Reading {
            source,
            channel: None,
            data_type,
            scaling: Scaling::Plain,
            has_marker: false,
            has_status: true,
            range,
            rules,
        }
    }

    /// The data type of the value; `None` if no source states it.
    pub fn data_type(&self) -> Option<DataType> {
        self.data_type
    }

    /// The scale from the number to the value; `None` if the type or the decimal digits are unknown.
    pub fn scale(&self) -> Option<Scale> {
        let plain = Scale { factor: Decimal::ONE, offset: Decimal::ZERO };
        let data_type = self.data_type.filter(|data_type| data_type.is_number())?;
        let is_integer = matches!(data_type, DataType::Integer(_) | DataType::Unsigned(_));
        match self.scaling {
            Scaling::Fixed(scale) => Some(scale),
            Scaling::Digits(digits) if is_integer => {
                let digits = digits.filter(|digits| *digits <= MAX_DIGITS)?;
                Some(Scale { factor: Decimal::new(1, digits), ..plain })
            }
            Scaling::Unread if is_integer => None,
            Scaling::Plain | Scaling::Digits(_) | Scaling::Unread => Some(plain),
        }
    }

    /// Creates the sample from the bytes of a value and its status bits, if there are any. `None` if the bytes do not
    /// fit the type.
    pub fn sample(&self, at: Stamp, bytes: &[u8], status_bits: Option<u64>) -> Option<Sample> {
        let without_value =
            |status, doubt| Sample { at, source: self.source, value: None, status, raw: Raw::new(bytes), doubt };
        let Some(data_type) = self.data_type else { return Some(without_value(None, Some(Doubt::UnknownType))) };
        if !data_type.is_number() {
            return Some(without_value(None, Some(Doubt::NotNumber)));
        }
        let value = data_type.decode(bytes).ok()?;
        let is_integer = matches!(value, Value::Integer(_) | Value::Unsigned(_));
        let (digits, mut doubt) = match self.scaling {
            Scaling::Digits(Some(digits)) if digits > MAX_DIGITS && is_integer => {
                return Some(without_value(Some(Status::Invalid), Some(Doubt::ImpossibleDigits(digits))));
            }
            Scaling::Unread if is_integer => return Some(without_value(None, Some(Doubt::UnreadScale))),
            Scaling::Digits(None) if is_integer => (0, Some(Doubt::UnknownDigits)),
            Scaling::Digits(digits) => (digits.unwrap_or(0), None),
            Scaling::Plain | Scaling::Fixed(_) | Scaling::Unread => (0, None),
        };
        let unscaled = Number::from_value(&value, digits)?;
        let number = if let Scaling::Fixed(scale) = self.scaling { unscaled.scaled(scale)? } else { unscaled };
        if let (Number::Real32(real), Scaling::Digits(_)) = (number, self.scaling)
            && real != 0.0
            && real.abs() < SMALLEST_REAL
        {
            return Some(without_value(Some(Status::Invalid), Some(Doubt::LooksLikeInteger)));
        }
        let status_bits = status_bits.map(|bits| self.rules.status_bits.to_cia_404(bits));
        let marker = if let Value::Integer(_) | Value::Unsigned(_) = value { self.marker_bits(&value) } else { None };
        let reported = marker.or(status_bits).map(Status::from_bits);
        let is_marked = !number.is_finite() || self.has_marker && is_smallest(&value, data_type);
        let mut status = match reported {
            Some((Status::Ok, _)) if is_marked => Some(Status::Invalid),
            Some((status, _)) => Some(status),
            None if is_marked => Some(Status::Invalid),
            None if self.has_marker => Some(Status::Ok),
            None => None,
        };
        let mut valid = !is_marked && reported.is_none_or(|(_, valid)| valid);
        if valid && matches!(self.scaling, Scaling::Digits(_)) && is_at_end(&value, data_type) {
            if self.range == MeasuringRange::Unknown {
                doubt = doubt.or(Some(Doubt::EndOfType));
            }
            if self.range_goes_beyond(number.as_f64()) {
                valid = false;
                status = status.filter(|status| *status != Status::Ok).or(Some(Status::Clipped));
            }
        }
        if doubt == Some(Doubt::UnknownDigits) {
            status = status.filter(|status| *status != Status::Ok);
        }
        if valid && status.is_none() && !self.has_status && doubt.is_none() {
            status = self.range.overload(number.as_f64());
        }
        Some(Sample { value: valid.then_some(number), ..without_value(status, doubt) })
    }

    /// Returns the status of an integer that is a marker, as bits of 6150h.
    fn marker_bits(&self, value: &Value) -> Option<u64> {
        let number = match value {
            Value::Integer(number) => *number,
            value => i64::try_from(value.as_u64()?).ok()?,
        };
        self.rules.markers.status_bits(number)
    }

    /// Sets the status of a sample from an overload that the device reports by an emergency or its error register.
    /// `channel: None` means all channels. A signal with its own status keeps it.
    pub fn report_overload(&self, sample: &mut Sample, channel: Option<u8>) {
        let applies = self.channel.is_some_and(|own| channel.is_none_or(|channel| channel == own));
        if let Some(value) = sample.value.filter(|_| applies && !self.has_status && !self.has_marker) {
            sample.status = Some(sample.status.unwrap_or(self.range.nearer_end(value.as_f64())));
        }
    }

    /// Whether the measuring range goes beyond a value at the limit of its type.
    fn range_goes_beyond(&self, value: f64) -> bool {
        match self.range {
            MeasuringRange::Known(start, end) if value > 0.0 => start.max(end) > value,
            MeasuringRange::Known(start, end) => start.min(end) < value,
            MeasuringRange::MayClip => true,
            MeasuringRange::Unknown => false,
        }
    }
}

impl MeasuringRange {
    /// Returns the overload if the value is outside the measuring range and the margin.
    pub fn overload(self, value: f64) -> Option<Status> {
        let MeasuringRange::Known(start, end) = self else { return None };
        let margin = (end - start).abs() * OVERLOAD_MARGIN;
        if value > start.max(end) + margin {
            Some(Status::OverloadHigh)
        } else if value < start.min(end) - margin {
            Some(Status::OverloadLow)
        } else {
            None
        }
    }

    /// Returns the direction of a reported overload: the nearer end of the range or, without a known range, the sign of
    /// the value.
    fn nearer_end(self, value: f64) -> Status {
        let middle = if let MeasuringRange::Known(start, end) = self { f64::midpoint(start, end) } else { 0.0 };
        if value < middle { Status::OverloadLow } else { Status::OverloadHigh }
    }
}

/// Whether an integer of at most 24 bits is the smallest or the largest number of its type.
fn is_at_end(value: &Value, data_type: DataType) -> bool {
    match (value, data_type) {
        (Value::Integer(number), DataType::Integer(width @ 1..=3)) => {
            let largest = i64::MAX >> (64 - 8 * u32::from(width));
            *number == largest || *number == -largest - 1
        }
        _ => false,
    }
}

/// Whether an integer is the smallest number of its type, which marks an overload (MH-4: -32768, -2147483648). Use it
/// only for signals that have this marker.
pub fn is_smallest(value: &Value, data_type: DataType) -> bool {
    match (value, data_type) {
        (Value::Integer(number), DataType::Integer(width)) => {
            *number == i64::MIN >> (64 - 8 * u32::from(width.clamp(1, 8)))
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::device::scale::Bad;

    fn signal(digits: Option<u8>, range: MeasuringRange) -> Signal {
        Signal {
            name: "pressure".into(),
            channel: 1,
            value_object: (ObjectId::new(0x6130, 1), Some(DataType::Real32)),
            other_objects: Vec::new(),
            status: None,
            has_marker: false,
            unit: None,
            digits,
            lacks_scale: false,
            rules: Rules::default(),
            range,
        }
    }

    fn sample(signal: &Signal, data_type: DataType, bytes: &[u8], status: Option<u64>) -> (String, &'static str) {
        let reading = Reading::of_signal(signal, Some(data_type), 0);
        let sample = reading.sample(Stamp::default(), bytes, status).expect("a number");
        assert_eq!(sample.raw.bytes(), bytes);
        (sample.value.map(|value| value.to_string()).unwrap_or_default(), sample.status.map_or("", Status::as_str))
    }

    const I16: DataType = DataType::Integer(2);
    const I24: DataType = DataType::Integer(3);
    const I32: DataType = DataType::Integer(4);
    const UNKNOWN: MeasuringRange = MeasuringRange::Unknown;

    #[test]
    fn integer_at_its_limit_is_clipped_if_the_range_is_larger() {
        let psi = signal(Some(3), MeasuringRange::Known(-50.0, 100.0));
        for status in [None, Some(0)] {
            assert_eq!(sample(&psi, I16, &[0xff, 0x7f], status), (String::new(), "clipped"));
            assert_eq!(sample(&psi, I16, &[0x00, 0x80], status), (String::new(), "clipped"));
        }
        assert_eq!(sample(&psi, I16, &[0xff, 0x7f], Some(2)), (String::new(), "overload-high"));
        assert_eq!(sample(&psi, I16, &[0xfe, 0x7f], Some(0)), ("32.766".into(), "ok"));
        let wide = signal(Some(3), MeasuringRange::Known(0.0, 10_000.0));
        assert_eq!(sample(&wide, I24, &[0xff, 0xff, 0x7f], None), (String::new(), "clipped"));
        let fits = signal(Some(3), MeasuringRange::Known(0.0, 32.0));
        assert_eq!(sample(&fits, I16, &[0xff, 0x7f], Some(0)), ("32.767".into(), "ok"));
        let warned = signal(Some(3), MeasuringRange::MayClip);
        assert_eq!(sample(&warned, I16, &[0xff, 0x7f], Some(0)), (String::new(), "clipped"));
    }

    #[test]
    fn fixed_scale_own_status_bits_and_markers() {
        let scaling = |factor: &str, offset: &str| {
            let [factor, offset] = [factor, offset].map(|text| text.parse().expect("a decimal"));
            Rule::Fixed(Scale { factor, offset })
        };
        let mut signal = signal(None, UNKNOWN);
        signal.rules.scaling = scaling("0.01", "0");
        assert_eq!(sample(&signal, I16, &(-1234i16).to_le_bytes(), None), ("-12.34".into(), ""));
        assert_eq!(sample(&signal, I16, &[0xff, 0x7f], Some(0)), ("327.67".into(), "ok"));
        signal.rules.scaling = scaling("0.25", "-40");
        assert_eq!(sample(&signal, DataType::Unsigned(1), &[255], None), ("23.75".into(), ""));
        assert_eq!(sample(&signal, DataType::Real32, &1.5f32.to_le_bytes(), None), ("-39.625".into(), ""));
        signal.rules.status_bits = Bad { invalid: 0x100, high: 0x10, low: 0x20 };
        assert_eq!(sample(&signal, I16, &[0, 0], Some(0x10)), ("-40.00".into(), "overload-high"));
        assert_eq!(sample(&signal, I16, &[0, 0], Some(0x0f)), ("-40.00".into(), "ok"));
        assert_eq!(sample(&signal, I16, &[0, 0], Some(0x120)), (String::new(), "overload-low"));
        signal.rules.markers = Bad { invalid: vec![0x7ffe], high: vec![0x7fff], low: vec![-0x8000] };
        for (number, status) in [(0x7ffe, "invalid"), (0x7fff, "overload-high"), (-0x8000i16, "overload-low")] {
            assert_eq!(sample(&signal, I16, &number.to_le_bytes(), None), (String::new(), status));
        }
    }

    #[test]
    fn integer_at_its_limit_is_kept_without_a_known_range() {
        let reading = Reading::of_signal(&signal(Some(0), UNKNOWN), Some(I16), 0);
        let found = reading.sample(Stamp::default(), &[0xff, 0x7f], None).expect("a number");
        assert_eq!((found.value.is_some(), found.doubt), (true, Some(Doubt::EndOfType)));
        let plain = Reading::plain(Some(I16), 0).sample(Stamp::default(), &[0xff, 0x7f], None).expect("a number");
        assert_eq!((plain.value.is_some(), plain.doubt), (true, None));
    }

    #[test]
    fn impossible_numbers_are_not_ok() {
        for digits in [10, 255] {
            assert_eq!(sample(&signal(Some(digits), UNKNOWN), I32, &[1, 0, 0, 0], Some(0)), (String::new(), "invalid"));
        }
        assert_eq!(sample(&signal(None, UNKNOWN), I32, &[57, 48, 0, 0], Some(0)), ("12345".into(), ""));
        // 6132h gave no valid answer: an integer is wrong by a power of ten, a REAL32 is not.
        let unread = Signal { lacks_scale: true, ..signal(None, UNKNOWN) };
        assert_eq!(sample(&unread, I32, &[57, 48, 0, 0], Some(0)), (String::new(), ""));
        assert_eq!(sample(&unread, DataType::Real32, &[0, 0, 0x48, 0x41], Some(0)), ("12.5".into(), "ok"));
        // INTEGER32 values read as REAL32: 12345, 12345678.
        for bytes in [[57, 48, 0, 0], [0x4e, 0x61, 0xbc, 0]] {
            let found = sample(&signal(Some(3), UNKNOWN), DataType::Real32, &bytes, Some(0));
            assert_eq!(found, (String::new(), "invalid"));
        }
        assert_eq!(sample(&signal(Some(255), UNKNOWN), DataType::Real32, &[0; 4], Some(0)), ("0".into(), "ok"));
    }

    #[test]
    fn value_beyond_the_range_is_an_overload_if_the_device_has_no_status() {
        let dps = signal(Some(3), MeasuringRange::Known(0.0, 100.0));
        assert_eq!(sample(&dps, I32, &(-5000i32).to_le_bytes(), None), ("-5.000".into(), "overload-low"));
        assert_eq!(sample(&dps, I32, &104_000i32.to_le_bytes(), None), ("104.000".into(), "overload-high"));
        assert_eq!(sample(&dps, I32, &103_000i32.to_le_bytes(), None), ("103.000".into(), ""));
    }

    #[test]
    fn reported_overload_is_the_status_of_a_signal_without_one() {
        let status = |signal: &Signal, mantissa: i32, channel: Option<u8>| {
            let reading = Reading::of_signal(signal, Some(I32), 0);
            let bytes = mantissa.to_le_bytes();
            let mut sample = reading.sample(Stamp::default(), &bytes, None).expect("a number");
            reading.report_overload(&mut sample, channel);
            assert!(sample.value.is_some(), "the value stays");
            sample.status.map_or("", Status::as_str)
        };
        let dps = signal(Some(3), MeasuringRange::Known(0.0, 100.0));
        assert_eq!(status(&dps, 99_000, None), "overload-high");
        assert_eq!(status(&dps, 1_000, Some(1)), "overload-low");
        assert_eq!(status(&dps, 1_000, Some(2)), "", "another channel");
        assert_eq!(status(&signal(Some(3), UNKNOWN), 102_000, None), "overload-high");
        assert_eq!(status(&signal(Some(3), UNKNOWN), -1, None), "overload-low");
        let with_status = Signal { status: Some(ObjectId::new(0x6150, 1)), ..dps.clone() };
        assert_eq!(status(&with_status, 1_000, None), "");
        assert_eq!(status(&Signal { has_marker: true, ..dps }, 1_000, None), "ok");
    }
}
