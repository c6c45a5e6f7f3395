//! The lines, areas and texts of a plot on paper. SVG and PNG draw the same scene.

use super::axis::value_ticks;
use super::marks::marks;
use super::path::{dashes, paths};
use super::{Panel, Plot, spread};
use crate::measure::sample::Status;

/// Red, green and blue.
pub(super) type Color = [u8; 3];

pub(super) type Position = (f64, f64);

/// The part of a text that is at the given position.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Anchor {
    Start,
    Middle,
    End,
}

/// Something to draw.
#[derive(Debug)]
pub(super) enum Shape {
    Line { points: Vec<Position>, color: Color, width: f64 },
    Area { points: Vec<Position>, color: Color },
    Text { at: Position, anchor: Anchor, text: String },
}

/// A drawing with its size.
#[derive(Debug)]
pub(super) struct Scene {
    pub(super) title: String,
    pub(super) width: f64,
    pub(super) height: f64,
    pub(super) shapes: Vec<Shape>,
}

/// The assumed width of a character: its width in the widest font in use. The font is unknown when a text is placed.
pub(super) const CHARACTER: f64 = 7.0;

/// The distance of two lines of text.
const LINE: f64 = 16.0;

const WIDTH: f64 = 1000.0;
const EDGE: f64 = 12.0;

/// The height of a panel if the plot has one, two, or more panels.
const HEIGHTS: [f64; 3] = [360.0, 240.0, 170.0];

/// The length of the line from a curve to its label, and of the line sample before the label.
const LEADER: f64 = 12.0;
const SAMPLE: f64 = 30.0;

/// The longest label in characters.
const MAX_LABEL: usize = 28;

/// The distance of two marks of the same kind.
const MARK_DISTANCE: f64 = 10.0;

const BLACK: Color = [0, 0, 0];
const GREY: Color = [120, 120, 120];
const PALE: Color = [225, 225, 225];
const MARK: Color = [190, 0, 0];

/// Colours that colour-blind people can distinguish (Okabe and Ito), without the yellow one.
const COLORS: [Color; 7] =
    [[0, 114, 178], [213, 94, 0], [0, 158, 115], [204, 121, 167], [0, 0, 0], [86, 180, 233], [230, 159, 0]];

/// The lengths of dashes and spaces, so that curves can be distinguished without colours.
const PATTERNS: [&[f64]; 4] = [&[], &[7.0, 3.0], &[1.5, 3.5], &[9.0, 3.0, 1.5, 3.0]];

/// A rectangle in which curves are drawn.
#[derive(Clone, Copy)]
struct Frame {
    left: f64,
    right: f64,
    top: f64,
    bottom: f64,
}

impl Frame {
    fn x(self, share: f64) -> f64 {
        self.left + share * (self.right - self.left)
    }

    fn y(self, share: f64) -> f64 {
        self.bottom - share.clamp(-0.1, 1.1) * (self.bottom - self.top)
    }
}

/// A number without its fraction. Negative numbers become 0.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(number: f64) -> usize {
    number as usize
}

/// Shortens a text to at most `max_length` characters.
pub(super) fn shortened(text: &str, max_length: usize) -> String {
    let text = crate::output::text::safe(text);
    if text.chars().count() <= max_length {
        return text;
    }
    text.chars().take(max_length.saturating_sub(1)).chain(['~']).collect()
}

impl Scene {
    pub(super) fn new(plot: &Plot) -> Scene {
        let mut scene = Scene { title: plot.title.clone(), width: WIDTH, height: 0.0, shapes: Vec::new() };
        let height = HEIGHTS[plot.panels.len().min(HEIGHTS.len()) - 1];
        let ticks: Vec<Vec<(f64, String)>> =
            plot.panels.iter().map(|panel| value_ticks(panel.range, whole(height / 45.0))).collect();
        let widest = ticks.iter().flatten().map(|(_, label)| label.len()).max().unwrap_or(0);
        let left = EDGE + widest as f64 * CHARACTER + 8.0;
        let labels = plot.panels.iter().filter(|panel| panel.curves.len() > 1).flat_map(|panel| &panel.curves);
        let label = labels.map(|curve| shortened(&curve.label, MAX_LABEL).chars().count()).max();
        let right_margin = label.map_or(2.0 * EDGE, |label| LEADER + SAMPLE + 6.0 + label as f64 * CHARACTER + EDGE);
        let mut top = EDGE + LINE;
        scene.text((left, top - 4.0), Anchor::Start, &shortened(&plot.title, whole((WIDTH - left) / CHARACTER)));
        if !plot.events.is_empty() {
            top += LINE;
        }
        let first = top + LINE + 4.0;
        for (panel, ticks) in plot.panels.iter().zip(&ticks) {
            top += LINE + 4.0;
            let bottom = top + height.max(panel.curves.len() as f64 * LINE);
            let frame = Frame { left, right: WIDTH - right_margin, top, bottom };
            scene.text((left, top - 5.0), Anchor::Start, &shortened(&panel.heading, 100));
            scene.panel(plot, panel, ticks, frame);
            top = bottom + 8.0;
        }
        let frame = Frame { left, right: WIDTH - right_margin, top: first, bottom: top - 8.0 };
        scene.time_axis(plot, frame);
        scene.events(plot, frame);
        scene.height = scene.legend(plot, (left, frame.bottom + 3.0 * LINE)) + EDGE;
        scene
    }

    fn text(&mut self, at: Position, anchor: Anchor, text: &str) {
        self.shapes.push(Shape::Text { at, anchor, text: text.to_owned() });
    }

    fn line(&mut self, points: &[Position], color: Color, width: f64) {
        self.shapes.push(Shape::Line { points: points.to_vec(), color, width });
    }

    fn panel(&mut self, plot: &Plot, panel: &Panel, ticks: &[(f64, String)], frame: Frame) {
        for (value, label) in ticks {
            let y = frame.y(panel.place(*value));
            self.line(&[(frame.left, y), (frame.right, y)], PALE, 1.0);
            self.text((frame.left - 7.0, y + 4.0), Anchor::End, label);
        }
        for (at, _) in Self::times(plot, frame) {
            let x = frame.x(plot.place(at));
            self.line(&[(x, frame.top), (x, frame.bottom)], PALE, 1.0);
        }
        let corners = [(frame.left, frame.top), (frame.left, frame.bottom), (frame.right, frame.bottom)];
        self.line(&corners, BLACK, 1.0);
        let x = |at: i64| frame.x(plot.place(at));
        let mut ends = Vec::new();
        for (number, curve) in panel.curves.iter().enumerate() {
            let color = COLORS[number % COLORS.len()];
            let paths = paths(&curve.points, x);
            // A dense line has no room for a pattern.
            let is_dense = paths.iter().map(Vec::len).sum::<usize>() as f64 > 2.0 * (frame.right - frame.left);
            let pattern = if is_dense { PATTERNS[0] } else { PATTERNS[number % PATTERNS.len()] };
            for path in &paths {
                let path: Vec<Position> = path.iter().map(|(x, value)| (*x, frame.y(panel.place(*value)))).collect();
                dashes(&path, pattern).iter().for_each(|part| self.line(part, color, 1.5));
            }
            let last = paths.last().and_then(|path| path.last());
            ends.push(last.map_or(frame.bottom, |last| frame.y(panel.place(last.1))));
        }
        for curve in &panel.curves {
            for (status, x, value) in marks(&curve.points, x, MARK_DISTANCE) {
                // An invalid value has no number, so its mark is at the bottom.
                let y = if status == Status::Invalid { frame.bottom - 6.0 } else { frame.y(panel.place(value)) };
                self.mark(status, (x, y));
            }
        }
        if panel.curves.len() > 1 {
            self.labels(panel, &ends, frame);
        }
    }

    /// Draws the name of each curve next to the end of the curve.
    fn labels(&mut self, panel: &Panel, ends: &[f64], frame: Frame) {
        let wanted: Vec<f64> = ends.iter().map(|end| end - frame.top).collect();
        let places = spread(&wanted, LINE - 2.0, frame.bottom - frame.top);
        for (number, (curve, (end, place))) in panel.curves.iter().zip(ends.iter().zip(places)).enumerate() {
            let (x, y) = (frame.right + LEADER, frame.top + place);
            let color = COLORS[number % COLORS.len()];
            self.line(&[(frame.right + 2.0, *end), (x, y)], color, 0.7);
            let sample = dashes(&[(x, y), (x + SAMPLE, y)], PATTERNS[number % PATTERNS.len()]);
            sample.iter().for_each(|part| self.line(part, color, 2.0));
            self.text((x + SAMPLE + 6.0, y + 4.0), Anchor::Start, &shortened(&curve.label, MAX_LABEL));
        }
    }

    fn mark(&mut self, status: Status, (x, y): Position) {
        let size = 4.0;
        match status {
            Status::OverloadHigh => {
                let points = vec![(x - size, y - 3.0), (x + size, y - 3.0), (x, y - 3.0 - 2.0 * size)];
                self.shapes.push(Shape::Area { points, color: MARK });
            }
            Status::OverloadLow => {
                let points = vec![(x - size, y + 3.0), (x + size, y + 3.0), (x, y + 3.0 + 2.0 * size)];
                self.shapes.push(Shape::Area { points, color: MARK });
            }
            Status::Clipped => {
                let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)];
                let points: Vec<Position> = corners.iter().map(|(dx, dy)| (x + dx * size, y + dy * size)).collect();
                self.line(&points, MARK, 1.3);
            }
            Status::Invalid => {
                self.line(&[(x - size, y - size), (x + size, y + size)], MARK, 1.3);
                self.line(&[(x - size, y + size), (x + size, y - size)], MARK, 1.3);
            }
            Status::Ok => {}
        }
    }

    fn times(plot: &Plot, frame: Frame) -> Vec<(i64, String)> {
        let width = frame.right - frame.left;
        plot.axis.ticks(plot.span, |characters| (characters as f64 + 4.0) * CHARACTER / width)
    }

    fn time_axis(&mut self, plot: &Plot, frame: Frame) {
        for (at, label) in Self::times(plot, frame) {
            let x = frame.x(plot.place(at));
            self.line(&[(x, frame.bottom), (x, frame.bottom + 4.0)], BLACK, 1.0);
            self.text((x, frame.bottom + LINE), Anchor::Middle, &label);
        }
        let middle = frame.x(0.5);
        self.text((middle, frame.bottom + 2.0 * LINE), Anchor::Middle, &plot.axis.caption(plot.span));
    }

    /// Draws a line through all panels for each event, and the name of the event if there is room.
    fn events(&mut self, plot: &Plot, frame: Frame) {
        let top = frame.top - LINE - 8.0;
        let (mut free_from, mut last) = (0.0, f64::NEG_INFINITY);
        for event in &plot.events {
            let x = frame.x(plot.place(event.at));
            if x - last < 1.0 {
                continue;
            }
            last = x;
            for part in dashes(&[(x, top), (x, frame.bottom)], &[3.0, 3.0]) {
                self.line(&part, GREY, 1.0);
            }
            let label = event.node.map_or_else(|| event.event.clone(), |node| format!("{} {node}", event.event));
            let half = (label.chars().count() as f64 + 1.0) * CHARACTER / 2.0;
            if x - half >= free_from {
                self.text((x, top - 3.0), Anchor::Middle, &label);
                free_from = x + half;
            }
        }
    }

    /// Draws the legend of marks and events. Returns its lower edge.
    fn legend(&mut self, plot: &Plot, (left, y): Position) -> f64 {
        let statuses = plot.statuses();
        let mut x = left;
        for status in &statuses {
            self.mark(
                *status,
                (
                    x + 4.0,
                    y - if *status == Status::OverloadLow { 11.0 } else { 4.0 }
                        + if *status == Status::OverloadHigh { 7.0 } else { 0.0 },
                ),
            );
            self.text((x + 14.0, y), Anchor::Start, status.as_str());
            x += (status.as_str().len() as f64 + 5.0) * CHARACTER;
        }
        if !plot.events.is_empty() {
            self.text((x, y), Anchor::Start, &format!("events: {}", plot.event_counts()));
        }
        if statuses.is_empty() && plot.events.is_empty() { y - LINE } else { y }
    }
}
