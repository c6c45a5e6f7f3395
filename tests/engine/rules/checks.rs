//! The results of `check` follow from the values.

use super::*;
use cangauge::canopen::value::DataType;
use cangauge::measure::expression::verdict::{Outcome, Verdict};
use cangauge::output::failure::ErrorMessage;

/// Every result follows from the rows or from the answers of the devices, and the exit code from the results.
pub(super) fn checks(spec: &Spec, run: &mut Run, violations: &mut Vec<Violation>) {
    let Command::Check { nodes, expected, how, excuse } = &spec.command else { return };
    let verdicts = run.observed.verdicts.clone();
    let count = |ruling: Outcome| verdicts.iter().filter(|verdict| verdict.outcome == ruling).count();
    // Equal expressions give one result.
    let asked: BTreeSet<String> = expected.iter().map(ToString::to_string).collect();
    let complete = *excuse && !verdicts.is_empty() || verdicts.len() == nodes.len() * asked.len();
    let right = match &run.result {
        Ok(_) => complete && count(Outcome::Ok) == verdicts.len(),
        // Nodes with different SYNC COB-IDs are not measured.
        Err(failure) if failure.kind() == Kind::CheckFailed && spec.falsifies_data() && verdicts.is_empty() => {
            ErrorMessage::of(failure).message.contains("(1005h)")
        }
        Err(failure) if failure.kind() == Kind::CheckFailed => count(Outcome::Fail) > 0,
        Err(_) => count(Outcome::Fail) == 0,
    };
    if !right {
        violations.push(("exit code follows from the results", format!("{:?} after {verdicts:?}", run.result)));
    }
    // If two devices share a node-ID, the values of one do not prove the result of the other.
    for verdict in verdicts.iter().filter(|_| !spec.shares_node_ids()) {
        let Some(limits) = expected.iter().find(|one| one.to_string() == verdict.text) else {
            violations.push(("evaluates every expression", verdict.text.clone()));
            continue;
        };
        let Some(node) = verdict.node else { continue };
        let is_satisfied = |value: f64| limits.low <= value && value <= limits.high;
        if *how == Measuring::Once {
            once(spec, run, (node, verdict), is_satisfied, violations);
            continue;
        }
        let of_node = run.observed.rows.iter().map(|row| row.split(',').collect::<Vec<_>>());
        let of_node = of_node.filter(|cells| cells[1] == node.to_string() && cells[2] == limits.signal);
        let is_valid = |cells: &Vec<&str>| !cells[5].starts_with("overload");
        let values: Vec<Option<f64>> =
            of_node.map(|cells| cells[3].parse().ok().filter(|_| is_valid(&cells))).collect();
        let ruling = match values.as_slice() {
            [] => Outcome::NoData,
            values if values.iter().all(|value| value.is_some_and(is_satisfied)) => Outcome::Ok,
            _ => Outcome::Fail,
        };
        if verdict.outcome != ruling || verdict.count != values.len() as u64 {
            violations.push(("uses every value", format!("{verdict:?} of {values:?}")));
        }
    }
}

/// The value of a single reading was answered by the device, and the result follows from it.
fn once(
    spec: &Spec,
    run: &mut Run,
    (node, verdict): (NodeId, &Verdict),
    is_satisfied: impl Fn(f64) -> bool,
    violations: &mut Vec<Violation>,
) {
    let shown = verdict.values.first().and_then(|shown| shown.value);
    let right = match (verdict.outcome, shown) {
        (Outcome::Ok, Some(value)) => is_satisfied(value),
        (Outcome::Fail, Some(value)) => !is_satisfied(value),
        // A missing value satisfies no expression.
        (Outcome::Fail, None) => true,
        (Outcome::Ok | Outcome::NoData, _) => verdict.outcome == Outcome::NoData && shown.is_none(),
    };
    if !right {
        violations.push(("uses every value", format!("{verdict:?}")));
    }
    let digits_are_known = !spec.device_faults().any(|device_fault| matches!(device_fault, DeviceFault::Refuse { .. }));
    let (Some(value), true) = (shown, !spec.falsifies_data() && digits_are_known) else { return };
    let all = answered_values(spec, run, node);
    if !all.iter().any(|answered| (answered - value).abs() <= 1e-9 * value.abs()) {
        violations.push(("uses the answered value", format!("{value} of node {node}, and it answered {all:?}")));
    }
}

/// The process values that a node answered, in its own unit.
fn answered_values(spec: &Spec, run: &mut Run, node: NodeId) -> Vec<f64> {
    let answers = rows::answers(run);
    let settled = run.settled;
    let mut values = Vec::new();
    for station in run.bus.bus.inner_mut().inner_mut().stations_mut::<FaultyDevice>() {
        if spec.devices[station.place].node != Some(node.get()) {
            continue;
        }
        let model = crate::kinds::model(spec.devices[station.place].kind);
        for ((_, object), raws) in answers.iter().filter(|((from, _), _)| *from == node.get()) {
            let digits = station.device.value(ObjectId::new(0x6132, object.sub), settled);
            let scale = 10f64.powi(digits.and_then(|bytes| bytes.first().copied()).unwrap_or(0).into());
            let is_real = model.dictionary.get(*object).is_some_and(|entry| entry.data_type == DataType::Real32);
            values.extend(raws.iter().filter_map(|raw| match *raw.as_slice() {
                [a, b, c, d] if is_real => f32::from_le_bytes([a, b, c, d]).to_string().parse().ok(),
                [a, b] => Some(f64::from(i16::from_le_bytes([a, b])) / scale),
                [a, b, c, d] => Some(f64::from(i32::from_le_bytes([a, b, c, d])) / scale),
                _ => None,
            }));
        }
    }
    values
}
