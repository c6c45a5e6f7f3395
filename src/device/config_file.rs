//! Reads the settings file of a device (`config dump`, `config apply`): TOML, flattened into keys with their places.
//!
//! The keys are paths: `event-timer` below `[tpdo.1]` is `tpdo.1.event-timer`. This module does not know the meaning of
//! the keys.

use std::fmt;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

/// A place in a text, counted from 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// The line.
    pub line: usize,
    /// The character in the line.
    pub column: usize,
}

impl Place {
    /// Converts a byte offset of a text to line and column.
    pub fn of(text: &str, offset: usize) -> Place {
        let before = text.get(..offset).unwrap_or(text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |line| line.chars().count()) + 1;
        Place { line, column }
    }
}

impl fmt::Display for Place {
    /// `12:5`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.line, self.column)
    }
}

/// A value as written in the file.
#[derive(Clone, Debug, PartialEq)]
pub enum Item {
    /// `"100ms"`.
    Text(String),
    /// `3`, `0x181`.
    Integer(i128),
    /// `0.5`.
    Real(f64),
    /// `true`.
    Flag(bool),
    /// `["pressure", "pressure.status"]`.
    List(Vec<String>),
    /// Any other type, with its name.
    Other(&'static str),
}

impl Item {
    /// The type of the value, for messages: `text`, `an integer`.
    pub fn kind(&self) -> &'static str {
        match self {
            Item::Text(_) => "text",
            Item::Integer(_) => "an integer",
            Item::Real(_) => "a number with a fraction",
            Item::Flag(_) => "true or false",
            Item::List(_) => "a list",
            Item::Other(what) => what,
        }
    }
}

impl fmt::Display for Item {
    /// Writes the value for tables and messages: text without quotes.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Item::Text(text) => f.write_str(text),
            Item::Integer(number) => write!(f, "{number}"),
            Item::Real(number) => write!(f, "{number}"),
            Item::Flag(flag) => write!(f, "{flag}"),
            Item::List(list) if list.is_empty() => f.write_str("none"),
            Item::List(list) => f.write_str(&list.join(", ")),
            Item::Other(what) => f.write_str(what),
        }
    }
}

/// One key with its value.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// The path: `tpdo.1.event-timer`.
    pub key: String,
    /// The value.
    pub value: Item,
    /// The place of the key.
    pub key_at: Place,
    /// The place of the value.
    pub value_at: Place,
}

/// The contents of a file, sorted by the place in the file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Document {
    /// The keys with their values.
    pub entries: Vec<Entry>,
}

/// A file that is not TOML.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SyntaxError {
    /// Where the parser stopped.
    pub place: Place,
    /// Its message.
    pub message: String,
}

impl SyntaxError {
    /// Creates the error of a TOML parser for this text.
    pub fn new(text: &str, error: &toml::de::Error) -> SyntaxError {
        SyntaxError {
            place: Place::of(text, error.span().map_or(0, |span| span.start)),
            message: error.message().lines().collect::<Vec<_>>().join(", "),
        }
    }
}

impl Document {
    /// Reads a file.
    ///
    /// # Errors
    /// The text is not TOML.
    pub fn parse(text: &str) -> Result<Document, SyntaxError> {
        let table = DeTable::parse(text).map_err(|error| SyntaxError::new(text, &error))?;
        let mut document = Document::default();
        document.add(text, "", table.get_ref());
        document.entries.sort_by_key(|entry| entry.key_at);
        Ok(document)
    }

    fn add(&mut self, text: &str, prefix: &str, table: &DeTable<'_>) {
        for (name, value) in table {
            let key =
                if prefix.is_empty() { name.get_ref().to_string() } else { format!("{prefix}.{}", name.get_ref()) };
            match value.get_ref() {
                DeValue::Table(below) => self.add(text, &key, below),
                _ => self.entries.push(Entry {
                    key,
                    value: item(value),
                    key_at: Place::of(text, name.span().start),
                    value_at: Place::of(text, value.span().start),
                }),
            }
        }
    }

    /// Returns the entry with this key.
    pub fn get(&self, key: &str) -> Option<&Entry> {
        self.entries.iter().find(|entry| entry.key == key)
    }
}

fn item(value: &Spanned<DeValue<'_>>) -> Item {
    match value.get_ref() {
        DeValue::String(text) => Item::Text(text.to_string()),
        DeValue::Integer(number) => i128::from_str_radix(number.as_str(), number.radix())
            .map_or(Item::Other("an integer that is too large"), Item::Integer),
        DeValue::Float(number) => number.as_str().parse().map_or(Item::Other("a number"), Item::Real),
        DeValue::Boolean(flag) => Item::Flag(*flag),
        DeValue::Array(values) => {
            let texts = values.iter().map(|value| value.get_ref().as_str().map(str::to_owned));
            texts.collect::<Option<_>>().map_or(Item::Other("a list with values that are not text"), Item::List)
        }
        DeValue::Datetime(_) => Item::Other("a date"),
        DeValue::Table(_) => Item::Other("a table"),
    }
}

/// Formats a value as TOML text.
pub fn toml_value(item: &Item) -> String {
    match item {
        Item::Text(text) => quoted(text),
        Item::Real(number) => format!("{number:?}"),
        Item::List(list) => format!("[{}]", list.iter().map(|text| quoted(text)).collect::<Vec<_>>().join(", ")),
        other => other.to_string(),
    }
}

/// Formats a key as TOML text: in quotes unless it is a bare key.
pub fn toml_key(key: &str) -> String {
    let is_bare = |character: char| character.is_ascii_alphanumeric() || character == '-' || character == '_';
    if !key.is_empty() && key.chars().all(is_bare) { key.to_owned() } else { quoted(key) }
}

fn quoted(text: &str) -> String {
    let mut out = String::from("\"");
    for character in text.chars() {
        match character {
            '"' | '\\' => out.extend(['\\', character]),
            character if character.is_control() => out.push_str(&format!("\\u{:04X}", u32::from(character))),
            character => out.push(character),
        }
    }
    out.push('"');
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn keys_are_paths_with_their_places() {
        let text = "[tpdo.1]\nevent-timer = \"100ms\"\n\n[address]\ntpdo.1.cob-id = 0x1A5\n[object]\n\"a:1\" = 0.5\n";
        let document = Document::parse(text).expect("TOML");
        let keys: Vec<_> =
            document.entries.iter().map(|entry| (entry.key.as_str(), entry.value_at.to_string())).collect();
        assert_eq!(
            keys,
            [
                ("tpdo.1.event-timer", "2:15".to_owned()),
                ("address.tpdo.1.cob-id", "5:17".to_owned()),
                ("object.a:1", "7:9".to_owned())
            ]
        );
        assert_eq!(document.get("address.tpdo.1.cob-id").map(|entry| &entry.value), Some(&Item::Integer(0x1a5)));
    }

    #[test]
    fn a_syntax_error_has_its_place() {
        let error = Document::parse("a = 1\nb = \n").expect_err("no value");
        assert_eq!(error.place.line, 2);
        let error = Document::parse("\u{e9} = 1\na = 1\na = 2\n").expect_err("not a bare key");
        assert_eq!(error.place, Place { line: 1, column: 1 });
        assert_eq!(Document::parse("a = 1\na = 2\n").expect_err("twice").place.line, 2);
    }

    #[test]
    fn values_are_written_as_toml_reads_them() {
        for item in [
            Item::Text("a \"b\" \\ \u{1} \u{b0}C".into()),
            Item::Integer(-3),
            Item::Real(1.0),
            Item::Real(6.894_757_3),
            Item::Flag(true),
            Item::List(vec!["pressure".into(), "0x9130:1/32".into()]),
        ] {
            let text = format!("{} = {}\n", toml_key("ai-input:1"), toml_value(&item));
            let document = Document::parse(&text).expect(&text);
            assert_eq!(document.get("ai-input:1").map(|entry| &entry.value), Some(&item), "{text}");
        }
    }
}
