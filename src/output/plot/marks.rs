//! Marks for values that are not ok, and their legend.

use super::{Plot, Point};
use crate::measure::sample::Status;
use crate::output::recording::MARKED;

/// Returns status, column and value of the marks. Marks of the same status are at least `distance` columns apart. A
/// mark without a value gets the previous value.
pub(super) fn marks(points: &[Point], x: impl Fn(i64) -> f64, distance: f64) -> Vec<(Status, f64, f64)> {
    let mut marks = Vec::new();
    let mut last = MARKED.map(|_| f64::NEG_INFINITY);
    let mut value = points.iter().map(|point| point.value).find(|value| value.is_finite()).unwrap_or(0.0);
    for point in points {
        value = if point.value.is_finite() { point.value } else { value };
        let Some(status) = point.status else { continue };
        let at = x(point.at);
        for (marked, last) in MARKED.iter().zip(&mut last) {
            if *marked == status && at - *last >= distance {
                *last = at;
                marks.push((status, at, value));
            }
        }
    }
    marks
}

impl Plot {
    /// The statuses that are marked.
    pub(super) fn statuses(&self) -> Vec<Status> {
        let points = || self.panels.iter().flat_map(|panel| &panel.curves).flat_map(|curve| &curve.points);
        MARKED.into_iter().filter(|status| points().any(|point| point.status == Some(*status))).collect()
    }
}
