//! The facts in `[device]`: the kind of device, its measuring ranges, relative or absolute pressure.

use super::snapshot::Snapshot;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::unit::Unit;
use crate::measure::sample::Number;
use crate::node::Node;

/// A measuring range.
#[derive(Clone, Debug, PartialEq)]
pub struct Range {
    /// The signal.
    pub signal: String,
    /// Its start; `None` if only its width is known.
    pub start: Option<Number>,
    /// Its end, or its width.
    pub end: Number,
    /// The unit of both ends.
    pub unit: Option<Unit>,
    /// The step to which the device rounds both ends after a change of the unit.
    pub step: f64,
}

/// The facts that identify the kind of a device.
#[derive(Clone, Debug, PartialEq)]
pub struct Kind {
    /// The name of its description.
    pub name: Option<String>,
    /// The name on its label.
    pub title: Option<String>,
    /// The measuring ranges that cannot be changed.
    pub ranges: Vec<Range>,
    /// `absolute`, `gauge` …
    pub reference: Option<String>,
    /// The dates of calibration and production.
    pub dates: Vec<(&'static str, String)>,
}

/// The meaning of each date, and the names of its three objects.
const DATES: [(&str, [&str; 3]); 2] = [
    ("calibrated", ["calibration-year", "calibration-month", "calibration-day"]),
    ("produced", ["production-year", "production-month", "production-day"]),
];

/// The objects of a measuring range: start, end, and unit if it differs from the unit of the signal.
struct RangeObjects {
    signal: usize,
    /// `None` if the device has only the width of the range. The object of the width is then in `end`.
    start: Option<ObjectId>,
    end: ObjectId,
    unit: Option<ObjectId>,
}

/// Returns the measuring ranges: from the description, from spans that cannot be changed, or from the scaling.
fn ranges(node: &Node) -> Vec<RangeObjects> {
    let Some(model) = &node.model else { return Vec::new() };
    let description = &model.description;
    let has = |object: ObjectId| model.dictionary.get(object).map(|entry| entry.object);
    let mut all = Vec::new();
    for (at, signal) in node.signals.iter().enumerate() {
        let places = |start, end, unit| RangeObjects { signal: at, start, end, unit };
        let zero = description.autozero.iter().find(|zero| zero.channel == signal.channel);
        let range = zero.and_then(|zero| zero.range.as_ref());
        let entry = description.signals.iter().find(|entry| entry.name == signal.name);
        let span = entry.and_then(|entry| entry.span_start.zip(entry.span_end));
        // A span that can be changed is a setting, not a measuring range.
        let span = span.filter(|(_, end)| node.is_read_only(*end));
        let width = node.object_of(signal, "pressure-span").filter(|object| node.is_read_only(*object));
        let [first, last] = [0x121, 0x123].map(|low| has(node.object_in_family(signal, low)));
        all.extend(match (range, span, width, first.zip(last)) {
            (Some(range), ..) => Some(places(Some(range.start), range.end, Some(range.unit))),
            (_, Some((start, end)), ..) => Some(places(Some(start), end, None)),
            (.., Some(width), _) => Some(places(None, width, None)),
            (.., Some((start, end))) => Some(places(Some(start), end, None)),
            _ => None,
        });
    }
    all
}

/// Returns the objects that contain kind, measuring range and dates.
pub(super) fn objects(node: &Node) -> Vec<ObjectId> {
    let mut objects: Vec<ObjectId> =
        ranges(node).into_iter().flat_map(|places| [places.start, Some(places.end), places.unit]).flatten().collect();
    let Some(model) = &node.model else { return objects };
    let absolute = model.description.autozero.iter().filter_map(|zero| zero.absolute.as_ref());
    objects.extend(absolute.map(|absolute| absolute.object));
    let dates = DATES.iter().flat_map(|(_, names)| names);
    objects.extend(dates.filter_map(|name| model.dictionary.find(name)).map(|entry| entry.object));
    objects
}

impl Snapshot {
    fn value(&self, object: ObjectId) -> Option<Value> {
        self.node.data_type(object).decode(self.bytes(object)?).ok()
    }

    /// Returns the facts that identify the kind of the device.
    pub fn kind(&self) -> Kind {
        let model = self.node.model.as_ref();
        let description = model.map(|model| &model.description).filter(|description| description.name != "eds");
        let range = |places: RangeObjects| {
            let signal = self.node.signals.get(places.signal)?;
            let digits = signal.digits.unwrap_or(0);
            let unit = match places.unit {
                Some(object) => self.value(object)?.as_u64().and_then(|code| u32::try_from(code).ok()).map(Unit),
                None => signal.unit,
            };
            let number = |object| Number::from_value(&self.value(object)?, digits).filter(|number| number.is_finite());
            let (start, end) = (places.start.map(number), number(places.end)?);
            let start = if places.start.is_some() { Some(start??) } else { None };
            let step = match end {
                Number::Decimal { digits, .. } => 10f64.powi(-i32::from(digits)),
                _ => 0.0,
            };
            Some(Range { signal: signal.name.clone(), start, end, unit, step })
        };
        let absolute =
            description.and_then(|description| description.autozero.iter().find_map(|zero| zero.absolute.as_ref()));
        let reference = absolute.and_then(|absolute| {
            let number = self.value(absolute.object)?.as_u64()?;
            let meaning = self.node.described(absolute.object).and_then(|entry| entry.meaning(number));
            Some(meaning.map_or_else(|| number.to_string(), str::to_owned))
        });
        let date = |(what, names): &(&'static str, [&str; 3])| {
            let numbers = names.map(|name| self.value(model?.dictionary.find(name)?.object)?.as_u64());
            let [Some(year), Some(month), Some(day)] = numbers else { return None };
            Some((*what, format!("{year}-{month:02}-{day:02}")))
        };
        Kind {
            name: description.map(|description| description.name.clone()),
            title: model.map(|model| model.description.title.clone()),
            ranges: ranges(&self.node).into_iter().filter_map(range).collect(),
            reference,
            dates: DATES.iter().filter_map(date).collect(),
        }
    }
}
