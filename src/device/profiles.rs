//! Types of the objects that a device profile defines: CiA 401, 404, 406 and 410.
//!
//! The profile is the low word of the device type (1000h). A description or an EDS file has priority: devices deviate
//! from their profile (6130h of the DPS is INTEGER32).
//!
//! Sources: CiA 401-1 V3.1, CiA 404-1 V2.1.0, CiA 406 V4.1, CiA 410 V2.0.

use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;

/// Digital and analogue inputs and outputs.
pub const GENERIC_IO: u32 = 401;
/// Measuring devices and closed-loop controllers.
pub const MEASURING: u32 = 404;
/// Encoders.
pub const ENCODER: u32 = 406;
/// Inclinometers.
pub const INCLINOMETER: u32 = 410;

const BOOL: DataType = DataType::Boolean;
const U8: DataType = DataType::Unsigned(1);
const U16: DataType = DataType::Unsigned(2);
const U32: DataType = DataType::Unsigned(4);
const I8: DataType = DataType::Integer(1);
const I16: DataType = DataType::Integer(2);
const I24: DataType = DataType::Integer(3);
const I32: DataType = DataType::Integer(4);
const R32: DataType = DataType::Real32;

/// The first and the last index of objects with one type.
type Row = (u16, u16, DataType);

const GENERIC_IO_OBJECTS: &[Row] = &[
    // Inputs: 8, 1, 16 and 32 digital lines an object; analogue inputs. The type of 6404h is the manufacturer's.
    (0x6000, 0x6000, U8),
    (0x6020, 0x6027, BOOL),
    (0x6100, 0x6100, U16),
    (0x6120, 0x6120, U32),
    (0x6400, 0x6400, I8),
    (0x6401, 0x6401, I16),
    (0x6402, 0x6402, I32),
    (0x6403, 0x6403, R32),
    // Outputs.
    (0x6200, 0x6200, U8),
    (0x6220, 0x6227, BOOL),
    (0x6300, 0x6300, U16),
    (0x6320, 0x6320, U32),
    (0x6410, 0x6410, I8),
    (0x6411, 0x6411, I16),
    (0x6412, 0x6412, I32),
    (0x6413, 0x6413, R32),
];

const ENCODER_OBJECTS: &[Row] = &[
    (0x6000, 0x6000, U16),
    (0x6004, 0x6004, U32),
    (0x6008, 0x6008, DataType::Unsigned(8)),
    (0x600c, 0x600c, U32),
    (0x6020, 0x6020, I32),
    (0x6030, 0x6030, I16),
    (0x6040, 0x6040, I16),
    (0x6050, 0x6050, I16),
    (0x6300, 0x6300, U8),
    (0x6500, 0x6500, U16),
    (0x6501, 0x6502, U32),
    (0x6503, 0x6503, U16),
];

const INCLINOMETER_OBJECTS: &[Row] = &[
    (0x6000, 0x6000, U16),
    // Longitudinal and lateral slope, 16 bits: value, operating parameter, preset, offset, differential offset.
    (0x6010, 0x6010, I16),
    (0x6011, 0x6011, U8),
    (0x6012, 0x6014, I16),
    (0x6020, 0x6020, I16),
    (0x6021, 0x6021, U8),
    (0x6022, 0x6024, I16),
    // The same with 32 bits.
    (0x6110, 0x6110, I32),
    (0x6111, 0x6111, U8),
    (0x6112, 0x6114, I32),
    (0x6120, 0x6120, I32),
    (0x6121, 0x6121, U8),
    (0x6122, 0x6124, I32),
];

/// CiA 404: the analogue inputs of one family. The first digit of the index is the family and gives the type: 6 REAL32,
/// 7 INTEGER16, 8 INTEGER24, 9 INTEGER32. The table has the index without its first digit.
const FAMILY_OBJECTS: &[(u16, Meaning)] = &[
    (0x100, Meaning::Field),
    (0x120, Meaning::Field),
    (0x121, Meaning::Process),
    (0x122, Meaning::Field),
    (0x123, Meaning::Process),
    (0x124, Meaning::Process),
    (0x126, Meaning::Factor),
    (0x127, Meaning::Process),
    (0x130, Meaning::Process),
    (0x133, Meaning::Process),
    (0x134, Meaning::Process),
    (0x135, Meaning::Process),
    (0x136, Meaning::Process),
    (0x138, Meaning::Process),
    (0x139, Meaning::Process),
    (0x140, Meaning::Process),
    (0x148, Meaning::Process),
    (0x149, Meaning::Process),
];

/// CiA 404: objects that exist once, whatever the family.
const MEASURING_OBJECTS: &[Row] = &[
    (0x6110, 0x6110, U16),
    (0x6111, 0x6111, U32),
    (0x6112, 0x6112, U8),
    (0x6114, 0x6114, U32),
    (0x6125, 0x6125, U32),
    (0x6131, 0x6131, U32),
    (0x6132, 0x6132, U8),
    (0x6150, 0x6150, U8),
    (0x61a0, 0x61a0, U8),
    (0x61a1, 0x61a1, U16),
];

/// What a number of a family of CiA 404 means.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// A field value: what the sensor element delivers.
    Field,
    /// A process value: it has the unit (6131h) and the decimal digits (6132h) of its channel.
    Process,
    /// A factor without a unit.
    Factor,
}

/// The type of an object of a profile. `None` if the profile does not define it.
pub fn data_type(profile: u32, object: ObjectId) -> Option<DataType> {
    let rows = match profile {
        GENERIC_IO => GENERIC_IO_OBJECTS,
        MEASURING => MEASURING_OBJECTS,
        ENCODER => ENCODER_OBJECTS,
        INCLINOMETER => INCLINOMETER_OBJECTS,
        _ => return None,
    };
    let row = rows.iter().find(|(first, last, _)| (*first..=*last).contains(&object.index));
    let (is_array, known) = match (row, profile) {
        // Sub-index 0 of an array is the number of entries.
        (Some(&(_, _, data_type)), GENERIC_IO | MEASURING) => (true, data_type),
        (Some(&(index, _, data_type)), ENCODER) => (matches!(index, 0x6020..=0x6050 | 0x6300), data_type),
        (Some(&(_, _, data_type)), _) => (false, data_type),
        (None, MEASURING) => (true, family_type(object).filter(|_| meaning(object).is_some())?),
        (None, _) => return None,
    };
    Some(if is_array && object.sub == 0 { U8 } else { known })
}

/// The meaning of an object of a family of CiA 404. `None` if it belongs to no family.
pub fn meaning(object: ObjectId) -> Option<Meaning> {
    family_type(object)?;
    FAMILY_OBJECTS.iter().find(|(low, _)| object.index & 0xfff == *low).map(|&(_, meaning)| meaning)
}

/// The type of a family of CiA 404 by the first digit of the index.
fn family_type(object: ObjectId) -> Option<DataType> {
    match object.index >> 12 {
        6 => Some(R32),
        7 => Some(I16),
        8 => Some(I24),
        9 => Some(I32),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn object(text: &str) -> ObjectId {
        text.parse().expect("an object")
    }

    #[test]
    fn types_of_the_families_of_cia_404() {
        for (text, expected) in [
            ("6130:1", Some(R32)),
            ("7130:16", Some(I16)),
            ("8140:2", Some(I24)),
            ("9130:1", Some(I32)),
            ("6138:1", Some(R32)),
            ("9149:1", Some(I32)),
            ("7126:1", Some(I16)),
            ("6130:0", Some(U8)),
            ("6131:1", Some(U32)),
            ("6150:1", Some(U8)),
            ("6199:1", None),
            ("7131:1", None),
            ("5130:1", None),
            ("2100:1", None),
        ] {
            assert_eq!(data_type(MEASURING, object(text)), expected, "{text}");
            if !text.starts_with('6') || expected == Some(R32) {
                assert_eq!(data_type(0, object(text)), None, "{text} without a profile");
            }
        }
        assert_eq!(meaning(object("6140:1")), Some(Meaning::Process));
        assert_eq!(meaning(object("7100:1")), Some(Meaning::Field));
    }

    #[test]
    fn types_of_the_other_profiles() {
        for (profile, text, expected) in [
            (INCLINOMETER, "6010:0", Some(I16)),
            (INCLINOMETER, "6020:0", Some(I16)),
            (INCLINOMETER, "6110:0", Some(I32)),
            (INCLINOMETER, "7138:1", None),
            (ENCODER, "6004:0", Some(U32)),
            (ENCODER, "6030:1", Some(I16)),
            (ENCODER, "6030:0", Some(U8)),
            (GENERIC_IO, "6401:1", Some(I16)),
            (GENERIC_IO, "6404:1", None),
            (GENERIC_IO, "6000:1", Some(U8)),
        ] {
            assert_eq!(data_type(profile, object(text)), expected, "{profile} {text}");
        }
    }
}
