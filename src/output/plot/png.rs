//! A plot as PNG, with two pixels for each unit of the scene.

use super::Plot;
use super::scene::{Anchor, Color, Position, Scene, Shape};
use flate2::Compression;
use flate2::Crc;
use flate2::write::ZlibEncoder;
use noto_sans_mono_bitmap::{FontWeight, RasterHeight, get_raster, get_raster_width};
use std::io::{self, Write};

/// Pixels for each unit of the scene.
const SCALE: f64 = 2.0;

const FONT: RasterHeight = RasterHeight::Size24;

/// Pixels from the top of a character to its base line.
const BASE_LINE: f64 = 18.0;

/// Draws the plot as a PNG file.
///
/// # Errors
/// The plot is too large.
pub fn png(plot: &Plot) -> io::Result<Vec<u8>> {
    let scene = Scene::new(plot);
    let mut image = Image::new(pixels(scene.width * SCALE), pixels(scene.height * SCALE));
    for shape in &scene.shapes {
        match shape {
            Shape::Line { points, color, width } => image.line(&scaled(points), *color, width * SCALE),
            Shape::Area { points, color } => image.area(&scaled(points), *color),
            Shape::Text { at, anchor, text } => image.text((at.0 * SCALE, at.1 * SCALE), *anchor, text),
        }
    }
    image.encode()
}

fn scaled(points: &[Position]) -> Vec<Position> {
    points.iter().map(|(x, y)| (x * SCALE, y * SCALE)).collect()
}

/// Rounds a length up to whole pixels.
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
fn pixels(length: f64) -> usize {
    // The cast saturates.
    length.ceil() as usize
}

/// Pixels in rows from the top, each red, green and blue.
struct Image {
    width: usize,
    height: usize,
    pixels: Vec<Color>,
}

impl Image {
    fn new(width: usize, height: usize) -> Image {
        Image { width, height, pixels: vec![[255; 3]; width * height] }
    }

    /// Mixes a colour into a pixel. `share` is from 0 to 1.
    fn mix(&mut self, x: usize, y: usize, color: Color, share: f64) {
        if x >= self.width || y >= self.height {
            return;
        }
        let pixel = &mut self.pixels[y * self.width + x];
        for (pixel, color) in pixel.iter_mut().zip(color) {
            let mixed = f64::from(*pixel) + (f64::from(color) - f64::from(*pixel)) * share;
            #[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
            {
                // The mixture of two bytes is a byte.
                *pixel = mixed.round() as u8;
            }
        }
    }

    /// Draws a line with round corners and ends. The share of the colour in a pixel is that of the nearest segment.
    fn line(&mut self, points: &[Position], color: Color, width: f64) {
        let radius = width / 2.0;
        let Some((left, right)) = bounds(points.iter().map(|point| point.0), radius, self.width) else { return };
        let Some((top, bottom)) = bounds(points.iter().map(|point| point.1), radius, self.height) else { return };
        let row_length = right - left;
        let mut shares = vec![0f32; row_length * (bottom - top)];
        let ends = [points[0], points[0]];
        let segments = points.windows(2).chain((points.len() == 1).then_some(&ends[..]));
        for segment in segments {
            let (from, to) = (segment[0], segment[1]);
            let Some((x0, x1)) = bounds([from.0, to.0].into_iter(), radius, self.width) else { continue };
            let Some((y0, y1)) = bounds([from.1, to.1].into_iter(), radius, self.height) else { continue };
            for y in y0..y1 {
                for x in x0..x1 {
                    let distance = distance((x as f64 + 0.5, y as f64 + 0.5), from, to);
                    #[allow(clippy::cast_possible_truncation)]
                    let share = (radius + 0.5 - distance).clamp(0.0, 1.0) as f32;
                    let kept = &mut shares[(y - top) * row_length + x - left];
                    *kept = kept.max(share);
                }
            }
        }
        for (at, share) in shares.into_iter().enumerate().filter(|(_, share)| *share > 0.0) {
            self.mix(left + at % row_length, top + at / row_length, color, f64::from(share));
        }
    }

    /// Fills a convex area.
    fn area(&mut self, points: &[Position], color: Color) {
        let Some((left, right)) = bounds(points.iter().map(|point| point.0), 0.0, self.width) else { return };
        let Some((top, bottom)) = bounds(points.iter().map(|point| point.1), 0.0, self.height) else { return };
        for y in top..bottom {
            for x in left..right {
                let at = (x as f64 + 0.5, y as f64 + 0.5);
                let sides = points.iter().zip(points.iter().cycle().skip(1));
                let mut turns = sides.map(|(a, b)| (b.0 - a.0) * (at.1 - a.1) - (b.1 - a.1) * (at.0 - a.0));
                let is_left = turns.next().is_some_and(|turn| turn > 0.0);
                if turns.all(|turn| (turn > 0.0) == is_left) {
                    self.mix(x, y, color, 1.0);
                }
            }
        }
        self.line(points, color, 1.0);
    }

    fn text(&mut self, (x, y): Position, anchor: Anchor, text: &str) {
        let width = get_raster_width(FontWeight::Regular, FONT);
        let length = (text.chars().count() * width) as f64;
        let left = match anchor {
            Anchor::Start => x,
            Anchor::Middle => x - length / 2.0,
            Anchor::End => x - length,
        };
        let (left, top) = (pixels(left.max(0.0)), pixels((y - BASE_LINE).max(0.0)));
        for (number, character) in text.chars().enumerate() {
            let known = |character| get_raster(character, FontWeight::Regular, FONT);
            let Some(raster) = known(character).or_else(|| known('?')) else { continue };
            for (row, line) in raster.rows().enumerate() {
                for (column, share) in line.iter().enumerate().filter(|(_, share)| **share > 0) {
                    self.mix(left + number * width + column, top + row, [0; 3], f64::from(*share) / 255.0);
                }
            }
        }
    }

    fn encode(&self) -> io::Result<Vec<u8>> {
        let too_large = |_| io::Error::other("the plot is too large");
        let (width, height) =
            (u32::try_from(self.width).map_err(too_large)?, u32::try_from(self.height).map_err(too_large)?);
        // 8 bits for each of three colours.
        let head = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[8, 2, 0, 0, 0]].concat();
        let mut rows = ZlibEncoder::new(Vec::new(), Compression::default());
        for row in self.pixels.chunks(self.width) {
            rows.write_all(&[0])?;
            rows.write_all(row.as_flattened())?;
        }
        let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
        for (name, data) in [(b"IHDR", head), (b"IDAT", rows.finish()?), (b"IEND", Vec::new())] {
            out.extend(u32::try_from(data.len()).map_err(too_large)?.to_be_bytes());
            out.extend(name);
            out.extend(&data);
            let mut sum = Crc::new();
            sum.update(name);
            sum.update(&data);
            out.extend(sum.sum().to_be_bytes());
        }
        Ok(out)
    }
}

/// Returns the first pixel that a line touches, and the pixel after the last one. `None` if the line is outside.
fn bounds(positions: impl Iterator<Item = f64> + Clone, radius: f64, end: usize) -> Option<(usize, usize)> {
    let (low, high) = (positions.clone().fold(f64::INFINITY, f64::min), positions.fold(f64::NEG_INFINITY, f64::max));
    let first = pixels((low - radius - 1.0).max(0.0)).min(end);
    let last = pixels((high + radius + 1.0).max(0.0)).min(end);
    (low <= high && first < last).then_some((first, last))
}

/// The distance of a point from a line.
fn distance(at: Position, from: Position, to: Position) -> f64 {
    let (dx, dy) = (to.0 - from.0, to.1 - from.1);
    let square = dx * dx + dy * dy;
    let share =
        if square > 0.0 { (((at.0 - from.0) * dx + (at.1 - from.1) * dy) / square).clamp(0.0, 1.0) } else { 0.0 };
    (at.0 - from.0 - share * dx).hypot(at.1 - from.1 - share * dy)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_areas_are_drawn_inside_the_image() {
        let mut image = Image::new(9, 5);
        image.line(&[(-5.0, 2.5), (20.0, 2.5)], [0; 3], 1.0);
        let row = |y: usize| image.pixels[y * 9..][..9].to_vec();
        assert_eq!((row(2), row(0)), (vec![[0; 3]; 9], vec![[255; 3]; 9]));
        let mut image = Image::new(9, 9);
        image.line(&[(4.5, 4.5)], [0; 3], 3.0);
        assert_eq!((image.pixels[4 * 9 + 4], image.pixels[0]), ([0; 3], [255; 3]), "a dot");
        image.area(&[(0.0, 0.0), (2.0, 0.0), (0.0, 40.0)], [1, 2, 3]);
        assert_eq!(image.pixels[0], [1, 2, 3]);
        image.line(&[], [0; 3], 1.0);
    }
}
