//! The entries of the object dictionary in a description.

use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::scalar::{NumberRange, Scalar};
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// One entry of the object dictionary, or a run of equal sub-indices.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectEntry {
    /// The address, or a run of sub-indices.
    pub at: ObjectRun,
    /// In lower case with hyphens: `producer-heartbeat-time`.
    pub name: String,
    /// Data type.
    pub data_type: DataType,
    /// Access by SDO.
    pub access: Access,
    /// Factory default, checked to fit the type.
    pub default: Option<Scalar>,
    /// Lowest value allowed, checked to fit the type.
    pub low: Option<Scalar>,
    /// Highest value allowed, checked to fit the type.
    pub high: Option<Scalar>,
    /// The allowed values and ranges, if `low` and `high` cannot express them.
    pub allow: Vec<NumberRange>,
    /// Meanings of numbers: 004E0000h is bar.
    pub values: BTreeMap<u64, String>,
    /// The signature that must be written to the object.
    pub signature: Option<Signature>,
    /// Objects that must all be 0 before this object accepts a number other than 0. On some devices heartbeat and node
    /// guarding exclude each other in this way.
    pub only_if_zero: Vec<ObjectId>,
    /// Whether a TPDO can contain the object.
    pub pdo: bool,
    /// Unit of the number if it is fixed: `ms`, `100us`.
    pub unit: Option<String>,
    /// The channel whose physical unit (6131h) applies to the number, for objects outside of CiA 404.
    pub follows_unit: Option<u8>,
    /// The object with the code of the unit (as in 6131h), if the number does not use the present unit of the channel.
    pub unit_at: Option<ObjectId>,
    /// The group of 1010h that stores the object; `None` if 1010h does not store it.
    pub stored: Option<StoreGroup>,
    /// Its meaning, in one or two sentences.
    pub text: String,
    /// Page or table of the manual.
    pub page: String,
    /// Contradictions and gaps in the manual.
    pub doubt: String,
}

impl ObjectEntry {
    /// Every object that the entry describes.
    pub fn objects(&self) -> impl Iterator<Item = ObjectId> + use<> {
        self.at.objects()
    }

    /// Returns the meaning of a number in this object, if the description gives one.
    pub fn meaning(&self, number: u64) -> Option<&str> {
        self.values.get(&number).map(String::as_str)
    }

    /// Whether `number` is within the limits and, if values are listed, one of them.
    pub fn allows(&self, number: f64) -> bool {
        let limit = |scalar: &Option<Scalar>| scalar.as_ref().and_then(Scalar::as_f64);
        limit(&self.low).is_none_or(|low| low <= number)
            && limit(&self.high).is_none_or(|high| number <= high)
            && (self.allow.is_empty() || self.allow.iter().any(|range| range.contains(number)))
    }
}

/// One object, or the same index with several sub-indices in a row: `0x6130:1-16`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ObjectRun {
    /// The first object.
    pub first: ObjectId,
    /// The last sub-index.
    pub last_sub: u8,
    /// Whether the description states a run, even if it has one object. The objects of a run have numbered names.
    pub is_run: bool,
}

impl ObjectRun {
    /// Every object of the run, in ascending order.
    pub fn objects(self) -> impl Iterator<Item = ObjectId> + use<> {
        (self.first.sub..=self.last_sub).map(move |sub| self.first.with_sub(sub))
    }

    /// Whether the run contains `object`.
    pub fn contains(self, object: ObjectId) -> bool {
        object.index == self.first.index && (self.first.sub..=self.last_sub).contains(&object.sub)
    }
}

impl FromStr for ObjectRun {
    type Err = String;

    fn from_str(text: &str) -> Result<ObjectRun, String> {
        let run = text.split_once(':').and_then(|(_, subs)| subs.split_once('-'));
        let first = text.split('-').next().filter(|_| run.is_some()).unwrap_or(text);
        let first: ObjectId = first.parse().map_err(|error| format!("{error}"))?;
        let last_sub = run.map_or(Some(first.sub), |(_, last)| last.parse().ok().filter(|last| *last >= first.sub));
        let last_sub = last_sub.ok_or_else(|| format!("\"{text}\" is not a run of sub-indices (0x6130:1-16)"))?;
        Ok(ObjectRun { first, last_sub, is_run: run.is_some() })
    }
}

impl fmt::Display for ObjectRun {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.is_run {
            true => write!(f, "{}-{}", self.first, self.last_sub),
            false => write!(f, "{}", self.first),
        }
    }
}

/// Access to an object by SDO.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// Read only.
    Ro,
    /// Write only.
    Wo,
    /// Read and write.
    Rw,
    /// Read only, and never changes.
    Const,
}

impl Access {
    /// The word in description files.
    pub fn as_str(self) -> &'static str {
        match self {
            Access::Ro => "ro",
            Access::Wo => "wo",
            Access::Rw => "rw",
            Access::Const => "const",
        }
    }

    /// Whether an SDO upload is allowed.
    pub fn is_readable(self) -> bool {
        self != Access::Wo
    }

    /// Whether an SDO download is allowed.
    pub fn is_writable(self) -> bool {
        matches!(self, Access::Rw | Access::Wo)
    }
}

/// The signature that an object requires.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Signature {
    /// "save": stores parameters (CiA 301, 1010h).
    Save,
    /// "load": restores factory defaults (CiA 301, 1011h).
    Load,
    /// "zero": autozero (CiA 404, 6125h), or a reset of minimum and maximum.
    Zero,
    /// "tara": autotare (CiA 404, 6139h).
    Tare,
    /// "set" after the value: node-ID and bit rate of some devices. Byte 0 is the value.
    Set,
}

impl Signature {
    /// The word of the signature; with [`Signature::Set`] byte 0 of the object is the value.
    pub fn as_str(self) -> &'static str {
        match self {
            Signature::Save => "save",
            Signature::Load => "load",
            Signature::Zero => "zero",
            Signature::Tare => "tara",
            Signature::Set => "set",
        }
    }
}

/// The parameters that one sub-index of 1010h stores.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum StoreGroup {
    /// Sub-index 1 only.
    All,
    /// Communication parameters: sub-indices 1 and 2.
    Communication,
    /// Application parameters: sub-indices 1 and 3.
    Application,
}

impl StoreGroup {
    /// The word in description files and for `--group`.
    pub fn as_str(self) -> &'static str {
        match self {
            StoreGroup::All => "all",
            StoreGroup::Communication => "comm",
            StoreGroup::Application => "app",
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_read_and_printed() {
        let run = |text: &str| text.parse::<ObjectRun>();
        let sixteen = run("0x6130:1-16").expect("a run");
        assert_eq!(
            (sixteen.objects().count(), sixteen.is_run, sixteen.to_string().as_str()),
            (16, true, "0x6130:1-16")
        );
        assert!(sixteen.contains(ObjectId::new(0x6130, 16)) && !sixteen.contains(ObjectId::new(0x6130, 17)));
        let one = run("0x1000").expect("an object");
        assert_eq!((one.objects().count(), one.is_run, one.to_string().as_str()), (1, false, "0x1000:0"));
        assert!(run("0x6130:3-1").is_err() && run("0x6130:1-300").is_err() && run("x").is_err());
    }
}
