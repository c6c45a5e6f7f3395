//! The contents of one section: type, access, default, limits, flags.

use super::ini::{Item, Section};
use super::names::Described;
use super::objects::Reader;
use super::text::quoted;
use super::value::Reading;
use super::{ObjectFlags, Warning, value};
use crate::canopen::id::NodeId;
use crate::canopen::value::DataType;
use crate::device::description::Access;
use crate::device::scalar::Scalar;

/// The object type DOMAIN (CiA 301, table 42).
const DOMAIN: i128 = 2;

/// The contents of a section, for one entry or for all elements of an array.
pub(super) struct Content {
    pub(super) data_type: DataType,
    pub(super) is_typed: bool,
    pub(super) access: Access,
    pub(super) default: Option<Scalar>,
    pub(super) low: Option<Scalar>,
    pub(super) high: Option<Scalar>,
    pub(super) pdo: bool,
    pub(super) parameter_value: Option<Scalar>,
    pub(super) flags: ObjectFlags,
}

impl Content {
    /// Creates sub-index 0 of an array or record, if it has no section. The type comes from CiA 301.
    pub(super) fn count(highest: Option<u8>) -> Content {
        Content {
            data_type: DataType::Unsigned(1),
            is_typed: true,
            access: Access::Ro,
            default: highest.map(|count| Scalar::Integer(i64::from(count))),
            low: None,
            high: None,
            pdo: false,
            parameter_value: None,
            flags: ObjectFlags::default(),
        }
    }

    /// Creates an unsigned setting with this number of bytes.
    pub(super) fn setting(bytes: u8, default: Option<Scalar>) -> Content {
        let data_type = DataType::Unsigned(bytes);
        Content { data_type, access: Access::Rw, default, ..Content::count(None) }
    }

    /// An estimate of the memory of an entry, without its names.
    pub(super) fn bytes(&self) -> usize {
        let texts = [&self.default, &self.low, &self.high, &self.parameter_value];
        let length = |scalar: &Option<Scalar>| match scalar {
            Some(Scalar::Text(text)) => text.len(),
            _ => 0,
        };
        size_of::<Described>() + texts.into_iter().map(length).sum::<usize>()
    }
}

impl Reader<'_> {
    /// Reads a section.
    pub(super) fn content(&mut self, section: &Section) -> Content {
        let (data_type, is_typed) = self.data_type(section);
        let mut scalar = |key: &str| {
            let item = section.get(&key.to_ascii_lowercase())?;
            self.scalar(&format!("[{}] {key}", section.shown), item.line, &item.value, data_type)
        };
        // The form of a value depends on its type, so a value of unknown type is not checked. Text and bytes have no
        // limits.
        let has_limits = data_type.width().is_some();
        let default = if is_typed { scalar("DefaultValue") } else { None };
        let parameter_value = if is_typed { scalar("ParameterValue") } else { None };
        let low = if has_limits { scalar("LowLimit") } else { None };
        let high = if has_limits { scalar("HighLimit") } else { None };
        let access = self.access(section);
        if let (None, Some(item), true) = (&parameter_value, section.get("parametervalue"), access.is_writable()) {
            self.unread(&format!("[{}] ParameterValue", section.shown), item, data_type, is_typed);
        }
        let [low, high] = self.limits(section, data_type, access, [low, high]);
        let flags = number(section, "objflags").unwrap_or_default();
        Content {
            data_type,
            is_typed,
            access,
            default,
            low,
            high,
            pdo: self.pdo(section),
            parameter_value,
            flags: ObjectFlags { skip_write: flags & 1 != 0, skip_read: flags & 2 != 0 },
        }
    }

    /// Drops limits that allow no value, or only 0, for a writable object: they must be a mistake. Only 0 may be written
    /// to the error count 1003h:0.
    fn limits(
        &mut self,
        section: &Section,
        data_type: DataType,
        access: Access,
        [low, high]: [Option<Scalar>; 2],
    ) -> [Option<Scalar>; 2] {
        let number = |limit: &Option<Scalar>| {
            let bytes = limit.as_ref()?.encode(data_type, NodeId::MIN).ok()?;
            data_type.decode(&bytes).ok()?.as_f64()
        };
        let what = match (number(&low), number(&high)) {
            (Some(low), Some(high)) if low > high => "LowLimit is above HighLimit",
            (Some(0.0), Some(0.0)) if access.is_writable() && !section.name.starts_with("1003") => {
                "LowLimit and HighLimit are 0"
            }
            _ => return [low, high],
        };
        self.warn(section.line, format!("[{}] {what}; ignored", section.shown));
        [None, None]
    }

    /// Records a parameter value that cannot be read, with the reason.
    pub(super) fn unread(&mut self, place: &str, item: &Item, data_type: DataType, is_typed: bool) {
        let reason = match value::scalar(&item.value, data_type) {
            _ if !is_typed => "the data type is unknown".to_owned(),
            Err(error) => error,
            Ok(_) => return,
        };
        self.objects.unread_values.push(Warning::new(item.line, format!("{place}: {reason}")));
    }

    pub(super) fn scalar(&mut self, place: &str, line: usize, text: &str, data_type: DataType) -> Option<Scalar> {
        match value::scalar(text, data_type) {
            Ok(reading) => {
                let reading = reading?;
                if let Some(doubt) = reading.doubt {
                    self.warn(line, format!("{place}: {doubt}"));
                }
                Some(reading.value)
            }
            Err(error) => {
                self.warn(line, format!("{place}: {error}; ignored"));
                None
            }
        }
    }

    /// Returns the data type, and whether it is known. An unknown type becomes DOMAIN, and the value is read as bytes.
    fn data_type(&mut self, section: &Section) -> (DataType, bool) {
        let Some(item) = section.get("datatype") else {
            if number(section, "objecttype") != Some(DOMAIN) {
                self.warn(section.line, format!("[{}] has no DataType; its value is read as bytes", section.shown));
                return (DataType::Domain, false);
            }
            return (DataType::Domain, true);
        };
        let code = self.checked(section, "DataType", value::type_code).and_then(|code| u16::try_from(code).ok());
        let known = code.and_then(|code| DataType::from_code(code).or_else(|| self.defined_type(code)));
        match known {
            Some(data_type) => (data_type, true),
            None => {
                let text = format!(
                    "[{}] DataType: {} is unknown; its value is read as bytes",
                    section.shown,
                    quoted(&item.value)
                );
                self.warn(item.line, text);
                (DataType::Domain, false)
            }
        }
    }

    /// Finds a type that the file itself defines: CANFestival's editor writes `[A0]`, and the base type as the default
    /// of `[A0sub1]`.
    fn defined_type(&self, code: u16) -> Option<DataType> {
        let section =
            self.ini.section(&format!("{code:x}sub1")).or_else(|| self.ini.section(&format!("{code:04x}sub1")))?;
        DataType::from_code(u16::try_from(number(section, "defaultvalue")?).ok()?)
    }

    /// Reads the access type. If it is missing or unknown, reading and writing are allowed.
    fn access(&mut self, section: &Section) -> Access {
        let item = section.get("accesstype");
        if let Some(access) = item.and_then(|item| value::access(&item.value)) {
            return access;
        }
        let (line, what) = match item {
            Some(item) => (item.line, format!("AccessType: {} is unknown", quoted(&item.value))),
            None => (section.line, "has no AccessType".to_owned()),
        };
        self.warn(line, format!("[{}] {what}; read as rw", section.shown));
        Access::Rw
    }

    /// Reads an integer, and warns if it is doubtful.
    pub(super) fn integer(&mut self, section: &Section, key: &str) -> Option<i128> {
        self.checked(section, key, value::integer)
    }

    fn checked(&mut self, section: &Section, key: &str, parse: impl Fn(&str) -> Option<Reading<i128>>) -> Option<i128> {
        let item = section.get(&key.to_ascii_lowercase())?;
        let reading = parse(&item.value)?;
        if let Some(doubt) = reading.doubt {
            self.warn(item.line, format!("[{}] {key}: {doubt}", section.shown));
        }
        Some(reading.value)
    }

    fn pdo(&mut self, section: &Section) -> bool {
        let Some(item) = section.get("pdomapping") else { return false };
        value::switch(&item.value).unwrap_or_else(|| {
            let text = format!("[{}] PDOMapping: {} is neither 0 nor 1", section.shown, quoted(&item.value));
            self.warn(item.line, text);
            false
        })
    }
}

/// Reads an integer without a warning.
pub(super) fn number(section: &Section, key: &str) -> Option<i128> {
    value::integer(&section.get(key)?.value).map(|number| number.value)
}
