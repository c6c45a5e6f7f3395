//! Reduces a curve to the points that a plot of limited width can show.

use super::Point;

/// The values of one column of pixels: the first, the lowest, the highest and the last, each with its position.
#[derive(Clone, Copy, Debug)]
struct Reduced {
    points: [(f64, f64); 4],
    column: f64,
}

impl Reduced {
    fn new(at: (f64, f64)) -> Reduced {
        Reduced { points: [at; 4], column: at.0.floor() }
    }

    fn add(&mut self, at: (f64, f64)) {
        let [_, low, high, last] = &mut self.points;
        if at.1 < low.1 {
            *low = at;
        }
        if at.1 > high.1 {
            *high = at;
        }
        *last = at;
    }

    fn push_to(mut self, path: &mut Vec<(f64, f64)>) {
        self.points.sort_by(|a, b| a.0.total_cmp(&b.0));
        path.extend(self.points);
        path.dedup();
    }
}

/// Returns the connected parts of a curve. `x` converts a time to a column. A gap or a missing value is shown only if
/// it is at least one column wide.
pub(super) fn paths(points: &[Point], x: impl Fn(i64) -> f64) -> Vec<Vec<(f64, f64)>> {
    let (mut paths, mut path, mut open) = (Vec::new(), Vec::new(), None::<Reduced>);
    let mut is_broken = false;
    for point in points {
        if !point.value.is_finite() {
            is_broken = true;
            continue;
        }
        let at = (x(point.at), point.value);
        let is_visible = open.is_some_and(|open| at.0 - open.points[3].0 >= 1.0);
        if std::mem::take(&mut is_broken) && is_visible {
            if let Some(open) = open.take() {
                open.push_to(&mut path);
            }
            paths.push(std::mem::take(&mut path));
        }
        match &mut open {
            Some(column) if column.column == at.0.floor() => column.add(at),
            _ => {
                if let Some(column) = open.replace(Reduced::new(at)) {
                    column.push_to(&mut path);
                }
            }
        }
    }
    if let Some(open) = open {
        open.push_to(&mut path);
    }
    paths.extend((!path.is_empty()).then_some(path));
    paths
}

/// Returns the drawn parts of a dashed line. `pattern` alternates the lengths of dashes and spaces.
pub(super) fn dashes(path: &[(f64, f64)], pattern: &[f64]) -> Vec<Vec<(f64, f64)>> {
    let Some(&first) = path.first().filter(|_| !pattern.is_empty()) else { return vec![path.to_vec()] };
    let (mut drawn, mut part) = (Vec::new(), vec![first]);
    let (mut index, mut remaining) = (0, pattern[0]);
    for pair in path.windows(2) {
        let (mut from, to) = (pair[0], pair[1]);
        loop {
            let (dx, dy) = (to.0 - from.0, to.1 - from.1);
            let length = dx.hypot(dy);
            if length < remaining {
                remaining -= length;
                part.push(to);
                break;
            }
            from = (from.0 + dx * remaining / length, from.1 + dy * remaining / length);
            part.push(from);
            if index % 2 == 0 {
                drawn.push(std::mem::take(&mut part));
            }
            part = vec![from];
            index = (index + 1) % pattern.len();
            remaining = pattern[index];
        }
    }
    drawn.extend((index % 2 == 0).then_some(part));
    drawn
}

#[cfg(test)]
mod tests {
    use super::*;

    fn points(values: &[(i64, f64)]) -> Vec<Point> {
        values.iter().map(|&(at, value)| Point { at, value, status: None }).collect()
    }

    #[test]
    fn columns_keep_first_lowest_highest_and_last() {
        let many: Vec<(i64, f64)> = (0..1000).map(|at| (at, if at == 501 { 9.0 } else { (at % 7) as f64 })).collect();
        let found = paths(&points(&many), |at| at as f64 / 500.0);
        assert_eq!(found.len(), 1);
        assert!(found[0].len() <= 8, "{found:?}");
        assert!(found[0].contains(&(1.002, 9.0)), "{found:?}");
        assert_eq!((found[0][0], found[0][found[0].len() - 1]), ((0.0, 0.0), (1.998, 5.0)));
    }

    #[test]
    fn gaps_and_missing_values_break_the_line() {
        let curve = points(&[(0, 1.0), (1, f64::NAN), (2, 1.0), (3, 1.0), (20, f64::NAN), (20, 1.0), (21, 1.0)]);
        let lengths =
            |width: f64| -> Vec<usize> { paths(&curve, |at| at as f64 * width).iter().map(Vec::len).collect() };
        assert_eq!(lengths(10.0), [1, 2, 2], "a single value is kept");
        assert_eq!(lengths(0.01).len(), 1, "not visible");
        assert!(paths(&[], |_| 0.0).is_empty());
    }

    #[test]
    fn dashes_follow_the_line() {
        let found = dashes(&[(0.0, 0.0), (10.0, 0.0)], &[4.0, 2.0]);
        assert_eq!(
            found,
            [vec![(0.0, 0.0), (4.0, 0.0)], vec![(6.0, 0.0), (10.0, 0.0)], vec![(10.0, 0.0)]][..2].to_vec()
        );
        let corner = dashes(&[(0.0, 0.0), (3.0, 0.0), (3.0, 3.0)], &[4.0, 9.0]);
        assert_eq!(corner, [vec![(0.0, 0.0), (3.0, 0.0), (3.0, 1.0)]]);
        assert_eq!(dashes(&[(1.0, 2.0)], &[4.0, 2.0]), [[(1.0, 2.0)]]);
        assert_eq!(dashes(&[(1.0, 2.0), (5.0, 2.0)], &[]).len(), 1);
    }
}
