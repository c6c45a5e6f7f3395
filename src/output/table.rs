//! Aligned columns. Each cell is made safe for a terminal, because it may contain text from a device.

use super::text::safe;
use std::io::{self, Write};

/// The alignment of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Align {
    /// Text.
    Left,
    /// Numbers.
    Right,
}

/// Writes rows in aligned columns with two spaces between them. Lines have no trailing spaces.
pub fn write(out: &mut dyn Write, align: &[Align], rows: &[Vec<String>]) -> io::Result<()> {
    let rows: Vec<Vec<String>> = rows.iter().map(|row| row.iter().map(|cell| safe(cell)).collect()).collect();
    let width = |column: usize| rows.iter().filter_map(|row| row.get(column)).map(|cell| cell.chars().count()).max();
    let widths: Vec<usize> = (0..align.len()).map(|column| width(column).unwrap_or(0)).collect();
    for row in &rows {
        let mut line = String::new();
        for ((cell, &width), align) in row.iter().zip(&widths).zip(align) {
            if !line.is_empty() {
                line.push_str("  ");
            }
            match align {
                Align::Left => line.push_str(&format!("{cell:<width$}")),
                Align::Right => line.push_str(&format!("{cell:>width$}")),
            }
        }
        writeln!(out, "{}", line.trim_end())?;
    }
    Ok(())
}

/// Adds spaces so that the decimal points of left-aligned numbers are below each other.
pub fn align_decimals(cells: &mut [String]) {
    let split = |cell: &str| {
        let point = cell.find('.').unwrap_or(cell.len());
        (point, cell.len() - point)
    };
    let before = cells.iter().map(|cell| split(cell).0).max().unwrap_or(0);
    for cell in cells {
        *cell = format!("{}{cell}", " ".repeat(before - split(cell).0));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimal_points_are_aligned() {
        let mut cells = ["1.234", "-17.8", "25", "-"].map(str::to_owned);
        align_decimals(&mut cells);
        assert_eq!(cells, ["  1.234", "-17.8", " 25", "  -"]);
    }

    #[test]
    fn columns_are_aligned() {
        let rows = [
            vec!["NODE".into(), "NAME".into()],
            vec!["1".into(), "MH-4-CAN".into()],
            vec!["127".into(), String::new()],
        ];
        let mut out = Vec::new();
        write(&mut out, &[Align::Right, Align::Left], &rows).expect("memory");
        assert_eq!(String::from_utf8_lossy(&out), "NODE  NAME\n   1  MH-4-CAN\n 127\n");
    }
}
