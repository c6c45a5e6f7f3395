//! A plot in a terminal: curves of Braille dots, two columns and four rows in each character.

use super::axis::value_ticks;
use super::marks::marks;
use super::path::paths;
use super::scene::shortened;
use super::{Panel, Plot, spread};
use crate::measure::sample::Status;
use anstyle::{Ansi256Color, AnsiColor, Style};
use std::io::{self, Write};

/// The possible widths of a plot in characters.
const WIDTHS: std::ops::RangeInclusive<usize> = 40..=400;

/// The rows of a single panel, and of each panel if there are several.
const ROWS: [usize; 2] = [12, 8];

/// The longest label of a curve.
const MAX_LABEL: usize = 20;

/// The one-character names of the curves in the plot.
const NAMES: &[u8] = b"123456789abcdefghijklmnopqrstuvwxyz";

/// Colours that are visible on a light and on a dark background, and that colour-blind people can distinguish.
const COLORS: [u8; 7] = [32, 166, 35, 169, 136, 37, 97];

/// One character of a panel.
#[derive(Clone, Copy, Default)]
struct Character {
    dots: u8,
    /// A character that is shown instead of the dots.
    mark: Option<char>,
    style: Style,
}

/// The characters of one panel.
struct Canvas {
    columns: usize,
    rows: usize,
    characters: Vec<Character>,
}

/// The bits of the dots of a Braille character, by column and row.
const DOTS: [[u8; 4]; 2] = [[0x01, 0x02, 0x04, 0x40], [0x08, 0x10, 0x20, 0x80]];

impl Canvas {
    fn at(&mut self, column: usize, row: usize) -> Option<&mut Character> {
        if column >= self.columns || row >= self.rows {
            return None;
        }
        self.characters.get_mut(row * self.columns + column)
    }

    fn dot(&mut self, x: usize, y: usize, style: Style) {
        if let Some(character) = self.at(x / 2, y / 4) {
            character.dots |= DOTS[x % 2][y % 4];
            character.style = style;
        }
    }

    /// Draws a line from dot to dot.
    fn line(&mut self, from: (f64, f64), to: (f64, f64), style: Style) {
        let steps = (to.0 - from.0).abs().max((to.1 - from.1).abs()).ceil().max(1.0);
        for step in 0..=whole(steps) {
            let share = step as f64 / steps;
            let (x, y) = (from.0 + (to.0 - from.0) * share, from.1 + (to.1 - from.1) * share);
            self.dot(whole(x), whole(y), style);
        }
    }

    fn mark(&mut self, column: usize, row: usize, mark: char, style: Style) {
        if let Some(character) = self.at(column, row) {
            (character.mark, character.style) = (Some(mark), style);
        }
    }
}

/// The sign of a status.
fn sign(status: Status) -> char {
    match status {
        Status::OverloadHigh => '▲',
        Status::OverloadLow => '▼',
        Status::Clipped => '□',
        Status::Invalid | Status::Ok => '×',
    }
}

#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn whole(number: f64) -> usize {
    // The cast saturates.
    number as usize
}

/// The widths of a line: value labels (`left`), curves (`columns`), and names of curves (`label`).
struct Frame {
    left: usize,
    columns: usize,
    label: usize,
}

/// Writes the plot for a terminal of this width.
///
/// # Errors
/// `out` cannot be written.
pub fn terminal(plot: &Plot, width: usize, out: &mut dyn Write) -> io::Result<()> {
    let width = width.clamp(*WIDTHS.start(), *WIDTHS.end());
    let rows = ROWS[usize::from(plot.panels.len() > 1)];
    let ticks: Vec<Vec<(f64, String)>> = plot.panels.iter().map(|panel| value_ticks(panel.range, rows / 2)).collect();
    let left = ticks.iter().flatten().map(|(_, label)| label.len()).max().unwrap_or(0);
    let several = plot.panels.iter().filter(|panel| panel.curves.len() > 1).flat_map(|panel| &panel.curves);
    let label = several.map(|curve| curve.label.chars().count()).max().unwrap_or(0).min(MAX_LABEL).min(width / 4);
    // Before the label are a space, the one-character name of the curve, and another space.
    let label_columns = if label > 0 { label + 3 } else { 0 };
    let frame = Frame { left, columns: (width - 1).saturating_sub(left + 2 + label_columns), label };
    if !plot.title.is_empty() {
        writeln!(out, "{}", shortened(&plot.title, width - 1))?;
    }
    if !plot.events.is_empty() {
        let mut line = vec![' '; frame.columns];
        for event in &plot.events {
            line[whole(plot.place(event.at) * frame.columns as f64).min(frame.columns - 1)] = '▾';
        }
        let line: String = line.into_iter().collect();
        writeln!(out, "{}{}", " ".repeat(left + 2), line.trim_end())?;
    }
    for (panel, ticks) in plot.panels.iter().zip(&ticks) {
        writeln!(out, "{}", shortened(&panel.heading, width - 1))?;
        self::panel(plot, panel, ticks, rows.max(panel.curves.len()), &frame, out)?;
    }
    time_axis(plot, &frame, out)?;
    let signs: Vec<String> =
        plot.statuses().into_iter().map(|status| format!("{} {}", sign(status), status.as_str())).collect();
    let events = (!plot.events.is_empty()).then(|| format!("▾ {}", plot.event_counts()));
    let legend = [signs.join("   "), events.unwrap_or_default()];
    legend.iter().filter(|line| !line.is_empty()).try_for_each(|line| writeln!(out, "{}", shortened(line, width - 1)))
}

fn panel(
    plot: &Plot,
    panel: &Panel,
    ticks: &[(f64, String)],
    rows: usize,
    frame: &Frame,
    out: &mut dyn Write,
) -> io::Result<()> {
    let (canvas, ends) = draw(plot, panel, rows, frame.columns);
    let row_of = |value: f64| whole((1.0 - panel.place(value)) * rows as f64).min(rows - 1);
    let places = spread(&ends, 1.0, rows as f64 - 1.0);
    for row in 0..rows {
        let tick = ticks.iter().find(|(value, _)| row_of(*value) == row);
        let (label, corner) = tick.map_or(("", '│'), |(_, label)| (label, '┤'));
        write!(out, "{label:>width$} {corner}", width = frame.left)?;
        let mut line = String::new();
        for character in &canvas.characters[row * canvas.columns..][..canvas.columns] {
            let shown = match (character.mark, character.dots) {
                (Some(mark), _) => mark,
                (None, 0) => ' ',
                (None, dots) => char::from_u32(0x2800 + u32::from(dots)).unwrap_or(' '),
            };
            let style = character.style;
            if shown == ' ' { line.push(' ') } else { line.push_str(&format!("{style}{shown}{style:#}")) }
        }
        let place = places.iter().position(|place| whole(place.round()) == row).filter(|_| panel.curves.len() > 1);
        match place {
            None => writeln!(out, "{}", line.trim_end())?,
            Some(number) => {
                let (style, name) = (style(number), name(number));
                let label = shortened(&panel.curves[number].label, frame.label);
                writeln!(out, "{line} {style}{name}{style:#} {label}")?;
            }
        }
    }
    Ok(())
}

/// Draws the curves. Also returns the row of the last value of each curve.
fn draw(plot: &Plot, panel: &Panel, rows: usize, columns: usize) -> (Canvas, Vec<f64>) {
    let mut canvas = Canvas { columns, rows, characters: vec![Character::default(); columns * rows] };
    let (width, height) = ((2 * columns) as f64 - 0.01, (4 * rows) as f64 - 0.01);
    let x = |at: i64| plot.place(at) * width;
    let y = |value: f64| (1.0 - panel.place(value)).clamp(0.0, 1.0) * height;
    let mut ends = Vec::new();
    let mut names = Vec::new();
    for (number, curve) in panel.curves.iter().enumerate() {
        let style = if panel.curves.len() > 1 { style(number) } else { Style::new() };
        let paths = paths(&curve.points, x);
        for path in &paths {
            let dots: Vec<(f64, f64)> = path.iter().map(|(x, value)| (*x, y(*value))).collect();
            canvas.line(dots[0], dots[0], style);
            dots.windows(2).for_each(|pair| canvas.line(pair[0], pair[1], style));
        }
        let all: Vec<&(f64, f64)> = paths.iter().flatten().collect();
        ends.push(all.last().map_or(0.0, |last| (y(last.1) / 4.0).floor()));
        // The name of each curve is drawn at three places. No two curves use the same place.
        for part in 0..3 {
            let share = (part as f64 + (number as f64 + 0.5) / panel.curves.len() as f64) / 3.0;
            let wanted = share * width;
            let nearest = all.iter().min_by(|a, b| (a.0 - wanted).abs().total_cmp(&(b.0 - wanted).abs()));
            names.extend(nearest.map(|(x, value)| (whole(*x) / 2, whole(y(*value)) / 4, number)));
        }
    }
    if panel.curves.len() > 1 {
        names.iter().for_each(|(column, row, number)| canvas.mark(*column, *row, name(*number), style(*number)));
    }
    for curve in &panel.curves {
        for (status, x, value) in marks(&curve.points, x, 2.0) {
            let row = if status == Status::Invalid { rows - 1 } else { whole(y(value)) / 4 };
            canvas.mark(whole(x) / 2, row, sign(status), AnsiColor::Red.on_default());
        }
    }
    (canvas, ends)
}

fn style(number: usize) -> Style {
    Style::new().fg_color(Some(Ansi256Color(COLORS[number % COLORS.len()]).into()))
}

fn name(number: usize) -> char {
    char::from(NAMES[number % NAMES.len()])
}

fn time_axis(plot: &Plot, frame: &Frame, out: &mut dyn Write) -> io::Result<()> {
    let columns = frame.columns;
    let ticks = plot.axis.ticks(plot.span, |characters| (characters as f64 + 2.0) / columns as f64);
    let (mut line, mut labels) = (vec!['─'; columns], vec![' '; frame.left + 2 + columns]);
    for (at, label) in ticks {
        let column = whole(plot.place(at) * columns as f64).min(columns - 1);
        line[column] = '┬';
        let start =
            (frame.left + 2 + column).saturating_sub(label.len() / 2).min(labels.len().saturating_sub(label.len()));
        for (place, character) in labels[start..].iter_mut().zip(label.chars()) {
            *place = character;
        }
    }
    let (line, labels): (String, String) = (line.into_iter().collect(), labels.into_iter().collect());
    writeln!(out, "{} └{line}\n{}", " ".repeat(frame.left), labels.trim_end())?;
    writeln!(out, "{}{}", " ".repeat(frame.left + 2), plot.axis.caption(plot.span))
}
