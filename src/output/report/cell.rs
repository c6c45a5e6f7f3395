//! One value of a report, with its form in JSON, CSV and a table.

use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::Value;
use crate::device::unit::Unit;
use crate::measure::sample::{Number, Raw, Status};
use crate::output::json::JsonNumber;
use serde::ser::{Serialize, SerializeMap, Serializer};

/// One value of a report.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Unknown, or not applicable: `null`, an empty cell, `-`.
    Null,
    /// `true` or `false`.
    Bool(bool),
    /// A whole number.
    Integer(i128),
    /// A measured number, exactly as sent by the device. `null` if it is not finite.
    Number(Number),
    /// A computed number with this many decimal digits. `null` if it is not finite.
    Real(f64, usize),
    /// A number of an identity: decimal in JSON and CSV, hexadecimal in a table.
    Code(u32),
    /// Text.
    Text(String),
    /// Data that a table shows as other text, for example a duration with its unit.
    Shown(Box<Cell>, String),
    /// Several values: an array in JSON; separated by blanks in CSV, by commas in a table.
    List(Vec<Cell>),
    /// A nested JSON object.
    Object(Vec<(&'static str, Cell)>),
    /// Nested rows, one cell per nested column of the [`Column`](super::Column).
    Rows(Vec<Vec<Cell>>),
}

impl Cell {
    /// A bit field, a unit code, a device type: `0x004E0000`, with at least `digits` digits.
    pub fn hex(number: impl Into<u64>, digits: usize) -> Cell {
        Cell::Text(format!("0x{:0digits$X}", number.into()))
    }

    /// A COB-ID or CAN identifier without its flags: `0x181`.
    pub fn cob_id(id: u32) -> Cell {
        Cell::hex(id, 1)
    }

    /// The same cell, shown as `text` in a table.
    #[must_use]
    pub fn shown_as(self, text: impl Into<String>) -> Cell {
        Cell::Shown(Box::new(self), text.into())
    }

    /// A list of values.
    pub fn list<C: Into<Cell>>(items: impl IntoIterator<Item = C>) -> Cell {
        Cell::List(items.into_iter().map(Into::into).collect())
    }

    /// The text of the cell in CSV. An apostrophe is put before text that a spreadsheet could read as a formula.
    pub(super) fn in_csv(&self) -> String {
        let text = self.plain();
        let is_number = || text.parse::<f64>().is_ok();
        let may_be_formula = self.is_text() && text.starts_with(['=', '+', '-', '@', '\t', '\r']);
        if may_be_formula && text.len() > 1 && !is_number() { format!("'{text}") } else { text }
    }

    fn is_text(&self) -> bool {
        match self {
            Cell::Text(_) => true,
            Cell::Shown(cell, _) => cell.is_text(),
            Cell::List(cells) => cells.first().is_some_and(Cell::is_text),
            _ => false,
        }
    }

    /// The text of the cell. Empty if there is no value.
    pub fn plain(&self) -> String {
        match self {
            Cell::Null | Cell::Object(_) | Cell::Rows(_) => String::new(),
            Cell::Bool(bit) => bit.to_string(),
            Cell::Integer(number) => number.to_string(),
            Cell::Number(number) if number.is_finite() => number.to_string(),
            Cell::Real(number, decimals) if number.is_finite() => format!("{number:.decimals$}"),
            Cell::Number(_) | Cell::Real(..) => String::new(),
            Cell::Code(number) => number.to_string(),
            Cell::Text(text) => text.clone(),
            Cell::Shown(cell, _) => cell.plain(),
            Cell::List(cells) => cells.iter().map(Cell::plain).collect::<Vec<_>>().join(" "),
        }
    }

    /// The text of the cell in a table. `-` if there is no value.
    pub fn shown(&self) -> String {
        let text = match self {
            Cell::Code(number) => format!("0x{number:08X}"),
            Cell::Shown(_, text) => return text.clone(),
            Cell::List(cells) => cells.iter().map(Cell::shown).collect::<Vec<_>>().join(", "),
            cell => cell.plain(),
        };
        if text.is_empty() { "-".to_owned() } else { text }
    }
}

impl Serialize for Cell {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        match self {
            Cell::Bool(bit) => serializer.serialize_bool(*bit),
            Cell::Integer(number) => match (i64::try_from(*number), u64::try_from(*number)) {
                (Ok(number), _) => serializer.serialize_i64(number),
                (_, Ok(number)) => serializer.serialize_u64(number),
                _ => JsonNumber(Some(Number::Decimal { mantissa: *number, digits: 0 })).serialize(serializer),
            },
            Cell::Number(number) => JsonNumber(Some(*number)).serialize(serializer),
            Cell::Real(number, decimals) => {
                let rounded = format!("{number:.decimals$}").parse().unwrap_or(*number);
                JsonNumber(Some(Number::Real64(rounded))).serialize(serializer)
            }
            Cell::Code(number) => serializer.serialize_u32(*number),
            Cell::Text(text) => serializer.serialize_str(text),
            Cell::Shown(cell, _) => cell.serialize(serializer),
            Cell::List(cells) => serializer.collect_seq(cells),
            Cell::Object(fields) => {
                let mut map = serializer.serialize_map(Some(fields.len()))?;
                for (name, cell) in fields {
                    map.serialize_entry(name, cell)?;
                }
                map.end()
            }
            // The columns of nested rows are stored elsewhere, so `Object` in `report.rs` writes nested rows.
            Cell::Null | Cell::Rows(_) => serializer.serialize_none(),
        }
    }
}

impl<T: Into<Cell>> From<Option<T>> for Cell {
    fn from(value: Option<T>) -> Cell {
        value.map_or(Cell::Null, Into::into)
    }
}

impl From<bool> for Cell {
    fn from(bit: bool) -> Cell {
        Cell::Bool(bit)
    }
}

impl From<&str> for Cell {
    /// Empty text means no value.
    fn from(text: &str) -> Cell {
        if text.is_empty() { Cell::Null } else { Cell::Text(text.to_owned()) }
    }
}

impl From<&String> for Cell {
    fn from(text: &String) -> Cell {
        text.as_str().into()
    }
}

impl From<String> for Cell {
    /// Empty text means no value.
    fn from(text: String) -> Cell {
        if text.is_empty() { Cell::Null } else { Cell::Text(text) }
    }
}

impl From<NodeId> for Cell {
    fn from(node: NodeId) -> Cell {
        Cell::Integer(node.get().into())
    }
}

impl From<Number> for Cell {
    fn from(number: Number) -> Cell {
        Cell::Number(number)
    }
}

impl From<ObjectId> for Cell {
    fn from(object: ObjectId) -> Cell {
        Cell::Text(object.to_string())
    }
}

impl From<Status> for Cell {
    fn from(status: Status) -> Cell {
        status.as_str().into()
    }
}

impl From<Raw> for Cell {
    fn from(raw: Raw) -> Cell {
        Cell::Text(raw.to_string())
    }
}

impl From<Unit> for Cell {
    /// The symbol of the unit; no value if the symbol is empty.
    fn from(unit: Unit) -> Cell {
        unit.to_string().into()
    }
}

impl From<&Value> for Cell {
    /// A value of the object dictionary: numbers as numbers, all other types as text.
    fn from(value: &Value) -> Cell {
        match value {
            Value::Bool(bit) => Cell::Bool(*bit),
            Value::Unsigned(number) => (*number).into(),
            Value::Integer(number) => (*number).into(),
            Value::Real32(number) => Cell::Number(Number::Real32(*number)),
            Value::Real64(number) => Cell::Number(Number::Real64(*number)),
            other => Cell::Text(other.to_string()),
        }
    }
}

macro_rules! integers {
    ($($type:ty),*) => {
        $(impl From<$type> for Cell {
            fn from(number: $type) -> Cell {
                Cell::Integer(number.into())
            }
        })*
    };
}

integers!(u8, u16, u32, u64, i8, i16, i32, i64);

impl From<usize> for Cell {
    fn from(number: usize) -> Cell {
        // usize has at most 64 bits on every platform that the program supports.
        u64::try_from(number).unwrap_or(u64::MAX).into()
    }
}
