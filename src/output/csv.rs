//! Tables as CSV, for every command with `--format csv` except `log`, whose rows are in [`super::rows`].
//!
//! stdout may be a terminal, so text from devices is made safe in every cell.

use super::text::safe;
use std::io::{self, Write};

/// Writes a header, if there is one, and rows. Unknown cells are empty.
pub fn write(out: &mut dyn Write, head: &[&str], rows: impl IntoIterator<Item = Vec<String>>) -> io::Result<()> {
    let mut csv = csv::Writer::from_writer(out);
    if !head.is_empty() {
        csv.write_record(head)?;
    }
    rows.into_iter().try_for_each(|row| csv.write_record(row.iter().map(|cell| safe(cell))))?;
    csv.flush()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_commas_are_quoted() {
        let mut out = Vec::new();
        write(
            &mut out,
            &["node", "name"],
            [vec!["5".to_owned(), "a,b".to_owned()], vec!["6".to_owned(), String::new()]],
        )
        .expect("memory");
        assert_eq!(String::from_utf8_lossy(&out), "node,name\n5,\"a,b\"\n6,\n");
    }
}
