//! The cells of a line of CSV.

use std::borrow::Cow;

/// A cell without its quotes.
pub type CellBytes<'a> = Cow<'a, [u8]>;

/// Iterates over the cells of a line of CSV without its line end.
#[derive(Clone, Debug)]
pub struct Cells<'a> {
    rest: Option<&'a [u8]>,
    delimiter: u8,
}

impl<'a> Cells<'a> {
    /// The cells of `line`.
    pub fn new(line: &'a [u8], delimiter: u8) -> Cells<'a> {
        Cells { rest: Some(line), delimiter }
    }
}

impl<'a> Iterator for Cells<'a> {
    type Item = CellBytes<'a>;

    fn next(&mut self) -> Option<CellBytes<'a>> {
        let rest = self.rest?;
        let Some(mut quoted) = rest.strip_prefix(b"\"") else {
            let end = rest.iter().position(|byte| *byte == self.delimiter);
            self.rest = end.map(|end| &rest[end + 1..]);
            return Some(Cow::Borrowed(&rest[..end.unwrap_or(rest.len())]));
        };
        let mut cell = Vec::new();
        while let Some(end) = quoted.iter().position(|byte| *byte == b'"') {
            cell.extend_from_slice(&quoted[..end]);
            quoted = &quoted[end + 1..];
            if quoted.first() != Some(&b'"') {
                break;
            }
            cell.push(b'"');
            quoted = &quoted[1..];
        }
        self.rest = quoted.first().filter(|byte| **byte == self.delimiter).map(|_| &quoted[1..]);
        Some(Cow::Owned(cell))
    }
}

/// The text of a cell.
pub fn text(cell: &[u8]) -> Cow<'_, str> {
    String::from_utf8_lossy(cell)
}

/// Node, signal and unit of a column of layout `wide`: `5.pressure [bar]`.
pub fn wide_column(name: &str) -> Option<(u8, &str, &str)> {
    let (node, rest) = name.split_once('.')?;
    let (signal, unit) = rest.strip_suffix(']').and_then(|rest| rest.rsplit_once(" [")).unwrap_or((rest, ""));
    Some((node.parse().ok()?, signal, unit))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn cells(line: &str) -> Vec<String> {
        Cells::new(line.as_bytes(), b',').map(|cell| text(&cell).into_owned()).collect()
    }

    #[test]
    fn quoted_cells() {
        assert_eq!(cells("a,,b"), ["a", "", "b"]);
        assert_eq!(cells("\"a,\"\"b\"\"\",c,"), ["a,\"b\"", "c", ""]);
        assert_eq!(cells("\"cut, off"), [""; 1]);
        assert_eq!(cells(""), [""]);
    }
}
