//! A plot as SVG. Texts stay texts, so they can be searched and edited.

use super::Plot;
use super::scene::{Anchor, Color, Position, Scene, Shape};
use std::fmt::Write;

/// Draws the plot as an SVG file.
pub fn svg(plot: &Plot) -> String {
    let Scene { title, width, height, shapes } = Scene::new(plot);
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" width=\"{width}\" height=\"{height}\" viewBox=\"0 0 {width} {height}\" \
         font-family=\"DejaVu Sans, Verdana, Arial, sans-serif\" font-size=\"11\">\n<title>{}</title>\n\
         <rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\n",
        escaped(&title)
    );
    for shape in &shapes {
        // Writing to a String cannot fail.
        let _ = match shape {
            Shape::Line { points, color, width } => writeln!(
                out,
                "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-width=\"{width}\" stroke-linecap=\"round\" \
                 stroke-linejoin=\"round\"/>",
                path(points),
                hex(*color)
            ),
            Shape::Area { points, color } => {
                writeln!(out, "<path d=\"{}Z\" fill=\"{}\"/>", path(points), hex(*color))
            }
            Shape::Text { at: (x, y), anchor, text } => {
                let anchor = match anchor {
                    Anchor::Start => "start",
                    Anchor::Middle => "middle",
                    Anchor::End => "end",
                };
                writeln!(out, "<text x=\"{x:.1}\" y=\"{y:.1}\" text-anchor=\"{anchor}\">{}</text>", escaped(text))
            }
        };
    }
    out + "</svg>\n"
}

/// Returns the data of a path. A single point becomes a line of length 0: its round ends look like a dot.
fn path(points: &[Position]) -> String {
    let mut path = String::new();
    for (at, (x, y)) in points.iter().enumerate() {
        let _ = write!(path, "{}{x:.1} {y:.1}", if at == 0 { 'M' } else { 'L' });
    }
    if points.len() == 1 { path + "h0" } else { path }
}

fn hex([red, green, blue]: Color) -> String {
    format!("#{red:02x}{green:02x}{blue:02x}")
}

fn escaped(text: &str) -> String {
    crate::output::text::safe(text)
        .replace('&', "&amp;")
        .replace('<', "&lt;")
        .replace('>', "&gt;")
        .replace('"', "&quot;")
}
