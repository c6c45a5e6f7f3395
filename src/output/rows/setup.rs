//! The form that rows have, and what stands above them.

use super::cells::{BOM, Dialect, TimeForm, push_texts};
use super::wide::Wide;
use std::collections::BTreeMap;
use std::time::Duration;

/// The columns of layout `long`.
pub(super) const LONG: [&str; 8] = ["time", "elapsed_s", "node", "signal", "value", "unit", "status", "raw"];

/// The form of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// CSV.
    #[default]
    Csv,
    /// JSON Lines.
    Json,
}

/// What makes a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layout {
    /// One value.
    #[default]
    Long,
    /// All values of one cycle.
    Wide,
}

/// When the next file begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rotation {
    /// Each holds the rows of so much of `elapsed_s`.
    Every(Duration),
    /// Each has at most so many bytes, or one row.
    Size(u64),
}

/// How rows are written.
#[derive(Clone, Debug, Default)]
pub struct Setup {
    /// The form of a row.
    pub form: Form,
    /// What makes a row.
    pub layout: Layout,
    /// How CSV is written.
    pub dialect: Dialect,
    /// How times are written.
    pub time: TimeForm,
    /// When the next file begins.
    pub rotation: Option<Rotation>,
    /// At most this many rows.
    pub limit: Option<u64>,
    /// Whether columns that change begin a new file; otherwise they begin behind an empty line.
    pub has_series: bool,
    /// Whether the first file has its header already.
    pub continues: bool,
    /// The first line of the file that is continued, or of the one before in the series.
    pub before: Option<String>,
}

/// A file that is to be continued has other columns.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct OtherHead {
    /// Its own.
    pub found: String,
    /// Those of the rows to come.
    pub wanted: String,
}

impl Setup {
    /// What stands above the rows: nothing above those of JSON Lines.
    pub(super) fn head(&self, wide: Option<&Wide>) -> Vec<u8> {
        let mut head = Vec::new();
        if self.form == Form::Csv {
            if self.dialect.bom {
                head.extend_from_slice(BOM);
            }
            let columns = columns(wide);
            push_texts(&mut head, columns.iter().map(String::as_str), self.dialect.delimiter);
        }
        head
    }

    /// Whether rows of the long layout may follow those that stand in the file.
    ///
    /// # Errors
    /// They may not.
    pub fn fits(&self) -> Result<(), OtherHead> {
        self.fits_with(None)
    }

    pub(super) fn fits_with(&self, wide: Option<&Wide>) -> Result<(), OtherHead> {
        let Some(found) = &self.before else { return Ok(()) };
        let other = |wanted| Err(OtherHead { found: found.clone(), wanted });
        match self.form {
            Form::Csv => {
                let head = Setup { dialect: Dialect { bom: false, ..self.dialect }, ..self.clone() }.head(wide);
                let wanted = String::from_utf8_lossy(&head).trim_end_matches('\n').to_owned();
                if *found.trim_end_matches('\r') == wanted { Ok(()) } else { other(wanted) }
            }
            Form::Json => {
                // The order of keys means nothing.
                let keys = serde_json::from_str::<BTreeMap<String, serde_json::Value>>(found);
                let found: Vec<String> = keys.unwrap_or_default().into_keys().collect();
                let (mut wanted, columns) = (columns(wide), columns(wide));
                wanted.sort_unstable();
                if found == wanted { Ok(()) } else { other(columns.join(",")) }
            }
        }
    }
}

fn columns(wide: Option<&Wide>) -> Vec<String> {
    match wide {
        None => LONG.map(str::to_owned).to_vec(),
        Some(wide) => LONG[..2].iter().map(|&name| name.to_owned()).chain(wide.names().flatten()).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn continues(form: Form, found: &str) -> Result<(), OtherHead> {
        Setup { form, before: Some(found.to_owned()), ..Setup::default() }.fits()
    }

    #[test]
    fn the_same_columns_may_follow() {
        let long = "time,elapsed_s,node,signal,value,unit,status,raw";
        assert_eq!(continues(Form::Csv, long), Ok(()));
        let other = continues(Form::Csv, "a;b").expect_err("others");
        assert_eq!((other.found.as_str(), other.wanted.as_str()), ("a;b", long));
        let keys: Vec<String> = LONG.iter().rev().map(|key| format!("\"{key}\":1")).collect();
        assert_eq!(continues(Form::Json, &format!("{{{}}}", keys.join(","))), Ok(()));
        assert!(continues(Form::Json, "{\"time\":1}").is_err());
        assert!(continues(Form::Json, long).is_err() && continues(Form::Csv, "{}").is_err());
        assert_eq!(Setup::default().fits(), Ok(()), "a new file");
    }
}
