//! The lowest and the highest value that a device has measured, and their reset (MH-4 2020h to 2022h, D-20-9 2020h and
//! 2021h). The objects are found by their names in the description.

use super::{SettingsFailure, ValueWithUnit, find_signal, quantity, read_each};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::node::Node;
use crate::node::write::write;
use crate::tasks::{Failure, Kind};

/// The lowest and highest value of a signal, now and before a reset.
#[derive(Clone, Debug, PartialEq)]
pub struct MinMax {
    /// The values now.
    pub now: Extremes,
    /// The values before the reset; `None` if nothing was reset.
    pub before: Option<Extremes>,
}

/// The lowest and highest value of a signal.
#[derive(Clone, Debug, PartialEq)]
pub struct Extremes {
    /// The node.
    pub node: NodeId,
    /// `pressure`, `temperature` …
    pub signal: String,
    /// The lowest value since the device was switched on or reset; `None` if it cannot be read.
    pub lowest: Option<ValueWithUnit>,
    /// The highest value.
    pub highest: Option<ValueWithUnit>,
}

/// Reads the lowest and the highest value of every signal that has these objects.
///
/// # Errors
/// [`SettingsFailure::NoMinMax`]; no answer.
pub fn show(master: &mut Master<'_>, node: &Node) -> Result<Vec<MinMax>, Failure> {
    let all = read_all(master, node)?;
    Ok(all.into_iter().map(|now| MinMax { now, before: None }).collect())
}

fn read_all(master: &mut Master<'_>, node: &Node) -> Result<Vec<Extremes>, Failure> {
    let mut all = Vec::new();
    for signal in &node.signals {
        let objects = ["minimum-pv", "maximum-pv"].map(|name| node.object_of(signal, name));
        let [Some(lowest), Some(highest)] = objects else { continue };
        all.push(extremes(master, node, signal, [lowest, highest])?);
    }
    if all.is_empty() {
        return Err(Failure::at(node.id, SettingsFailure::NoMinMax));
    }
    Ok(all)
}

fn extremes(
    master: &mut Master<'_>,
    node: &Node,
    signal: &Signal,
    objects: [ObjectId; 2],
) -> Result<Extremes, Failure> {
    let values = read_each(master, node, &objects)?;
    let present = |value: Option<&Option<Value>>| quantity(signal, value?.as_ref()?);
    let (lowest, highest) = (present(values.first()), present(values.get(1)));
    Ok(Extremes { node: node.id, signal: signal.name.clone(), lowest, highest })
}

/// Resets minimum and maximum of every signal with these objects. Returns the values before and after. The signature is
/// sent once. If no answer comes, the values prove whether the device executed it.
///
/// # Errors
/// [`SettingsFailure::NoMinMaxReset`], [`SettingsFailure::MinMaxNotReset`]; the device rejects the signature or does
/// not answer.
pub fn reset(master: &mut Master<'_>, node: &Node) -> Result<Vec<MinMax>, Failure> {
    let before = read_all(master, node)?;
    let mut all = Vec::new();
    for old in before {
        let signal = find_signal(node, Some(&old.signal))?;
        let Some(object) = node.object_of(signal, "reset-min-max") else {
            return Err(Failure::at(node.id, SettingsFailure::NoMinMaxReset { signal: old.signal }));
        };
        let sent = write(master, node, object, b"zero").map_err(Failure::from);
        match sent {
            Err(failure) if failure.kind() != Kind::NoAnswer => return Err(failure),
            _ => {}
        }
        let objects = ["minimum-pv", "maximum-pv"].map(|name| node.object_of(signal, name).unwrap_or(object));
        let now = extremes(master, node, signal, objects)?;
        match is_reset(&old, &now) {
            Some(true) => {}
            // Report the missing answer, which is the better explanation.
            None | Some(false) if sent.is_err() => drop(sent?),
            None => {}
            Some(false) => {
                let cause = SettingsFailure::MinMaxNotReset { signal: old.signal };
                return Err(Failure::at(node.id, cause).of_object(object));
            }
        }
        all.push(MinMax { now, before: Some(old) });
    }
    Ok(all)
}

/// Whether the values prove a reset. Without a reset, the lowest value only falls and the highest value only rises.
/// Returns `None` if there is no proof: the values were equal before, or both were exceeded since then.
fn is_reset(old: &Extremes, now: &Extremes) -> Option<bool> {
    let ends = |extremes: &Extremes| {
        let (lowest, highest) = extremes.lowest.zip(extremes.highest)?;
        Some((lowest.number.as_f64(), highest.number.as_f64()))
    };
    match (ends(old), ends(now)) {
        (Some(old), Some(now)) if now.0 > old.0 || now.1 < old.1 => Some(true),
        (Some(old), Some(now)) if old.0 >= old.1 || now.0 < old.0 && now.1 > old.1 => None,
        _ => Some(false),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::sample::Number;

    #[test]
    fn a_range_that_became_narrower_proves_a_reset() {
        let range = |lowest, highest| Extremes {
            node: NodeId::MIN,
            signal: "pressure".to_owned(),
            lowest: Some(ValueWithUnit { number: Number::Real64(lowest), unit: None }),
            highest: Some(ValueWithUnit { number: Number::Real64(highest), unit: None }),
        };
        let old = range(1.0, 2.0);
        assert_eq!(is_reset(&old, &range(1.5, 1.5)), Some(true));
        assert_eq!(is_reset(&old, &range(1.5, 2.5)), Some(true));
        assert_eq!(is_reset(&old, &range(1.0, 2.0)), Some(false));
        assert_eq!(is_reset(&old, &range(1.0, 2.5)), Some(false));
        assert_eq!(is_reset(&old, &range(0.5, 2.5)), None, "the noise since the reset exceeds the old range");
        assert_eq!(is_reset(&range(1.0, 1.0), &range(1.0, 1.0)), None, "the value never changed");
        assert_eq!(is_reset(&old, &Extremes { lowest: None, ..old.clone() }), Some(false));
    }
}
