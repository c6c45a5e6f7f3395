//! The lowest and highest value that a device has measured, and their reset (MH-4 2020h to 2022h, D-20-9
//! 2020h and 2021h), by the names that descriptions give them.

use super::{Device, Quantity};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::master::Master;
use crate::measure::layout::Signal;
use crate::tasks::{Failure, Kind};

/// The lowest and highest value of a signal, and those before a reset.
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
    /// The lowest value since power on or the last reset.
    pub lowest: Option<Quantity>,
    /// The highest.
    pub highest: Option<Quantity>,
}

/// The lowest and highest values of every signal that has them.
///
/// # Errors
/// Devices that keep none as far as is known, silence.
pub fn show(master: &mut Master<'_>, device: &Device) -> Result<Vec<MinMax>, Failure> {
    let all = present(master, device)?;
    Ok(all.into_iter().map(|now| MinMax { now, before: None }).collect())
}

fn present(master: &mut Master<'_>, device: &Device) -> Result<Vec<Extremes>, Failure> {
    let mut all = Vec::new();
    for signal in &device.instrument.signals {
        let objects = ["minimum-pv", "maximum-pv"].map(|name| device.of_signal(signal, name));
        let [Some(lowest), Some(highest)] = objects else { continue };
        all.push(extremes(master, device, signal, [lowest, highest])?);
    }
    if all.is_empty() {
        let message = "no object of this device is known to keep minimum and maximum";
        return Err(Failure::of_node(Kind::Unexpected, device.node(), message));
    }
    Ok(all)
}

fn extremes(
    master: &mut Master<'_>,
    device: &Device,
    signal: &Signal,
    objects: [ObjectId; 2],
) -> Result<Extremes, Failure> {
    let values = device.read_each(master, &objects)?;
    let quantity = |value: Option<&Option<Value>>| device.quantity(signal, value?.as_ref()?);
    let (lowest, highest) = (quantity(values.first()), quantity(values.get(1)));
    Ok(Extremes { node: device.node(), signal: signal.name.clone(), lowest, highest })
}

/// Resets minimum and maximum of every signal that has them; the values before and after. The signature is
/// sent once; where no answer comes, what the device then reads decides.
///
/// # Errors
/// Devices of which no object is known that does it, refusals, silence, values that stay.
pub fn reset(master: &mut Master<'_>, device: &Device) -> Result<Vec<MinMax>, Failure> {
    let before = present(master, device)?;
    let mut all = Vec::new();
    for old in before {
        let signal = device.signal(Some(&old.signal))?;
        let Some(object) = device.of_signal(signal, "reset-min-max") else {
            let message = format!("no object of this device is known to reset minimum and maximum of {}", old.signal);
            return Err(Failure::of_node(Kind::Unexpected, device.node(), message));
        };
        let sent = device.write(master, object, b"zero");
        match sent {
            Err(failure) if failure.kind() != Kind::NoAnswer => return Err(failure),
            _ => {}
        }
        let objects = ["minimum-pv", "maximum-pv"].map(|name| device.of_signal(signal, name).unwrap_or(object));
        let now = extremes(master, device, signal, objects)?;
        match has_begun_anew(&old, &now) {
            Some(true) => {}
            // An answer that did not come is the better explanation.
            None | Some(false) if sent.is_err() => sent?,
            None => {}
            Some(false) => {
                let message = format!("{object} was acknowledged, and minimum and maximum of {} stay", old.signal);
                let failure = Failure::of_node(Kind::Unexpected, device.node(), message);
                return Err(Failure { object: Some(object), ..failure });
            }
        }
        all.push(MinMax { now, before: Some(old) });
    }
    Ok(all)
}

/// Whether a reset shows: without one the lowest value only falls and the highest only rises. `None` where nothing
/// tells: nothing had moved before, or by now the values have gone beyond both ends.
fn has_begun_anew(old: &Extremes, now: &Extremes) -> Option<bool> {
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
    fn a_reset_shows_in_a_range_that_became_narrower_at_one_end() {
        let range = |lowest, highest| Extremes {
            node: NodeId::MIN,
            signal: "pressure".to_owned(),
            lowest: Some(Quantity { number: Number::Real64(lowest), unit: None }),
            highest: Some(Quantity { number: Number::Real64(highest), unit: None }),
        };
        let old = range(1.0, 2.0);
        assert_eq!(has_begun_anew(&old, &range(1.5, 1.5)), Some(true));
        assert_eq!(has_begun_anew(&old, &range(1.5, 2.5)), Some(true));
        assert_eq!(has_begun_anew(&old, &range(1.0, 2.0)), Some(false));
        assert_eq!(has_begun_anew(&old, &range(1.0, 2.5)), Some(false));
        assert_eq!(has_begun_anew(&old, &range(0.5, 2.5)), None, "noise since then is more than there was before");
        assert_eq!(has_begun_anew(&range(1.0, 1.0), &range(1.0, 1.0)), None, "stood still all the time");
        assert_eq!(has_begun_anew(&old, &Extremes { lowest: None, ..old.clone() }), Some(false));
    }
}
