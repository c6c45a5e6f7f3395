//! Types and names of the objects that a device profile defines: CiA 401, 402, 404, 406 and 410.
//!
//! The profile is the low word of the device type (1000h). A description or an EDS file has priority: devices deviate
//! from their profile (6130h of the DPS is INTEGER32).
//!
//! Sources: CiA 401-1 V3.1, CiA 402-2 V3.0, CiA 404-1 V2.1.0, CiA 406 V4.1, CiA 410 V2.0.

use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;

/// Digital and analogue inputs and outputs.
pub const GENERIC_IO: u32 = 401;
/// Drives and motion control.
pub const DRIVES: u32 = 402;
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

/// An object with its name: index, type, name.
type Named = (u16, DataType, &'static str);

const DRIVE_OBJECTS: &[Named] = &[
    (0x603f, U16, "error-code"),
    (0x6040, U16, "controlword"),
    (0x6041, U16, "statusword"),
    (0x6060, I8, "modes-of-operation"),
    (0x6061, I8, "modes-of-operation-display"),
    (0x6062, I32, "position-demand-value"),
    (0x6063, I32, "position-actual-internal-value"),
    (0x6064, I32, "position-actual-value"),
    (0x6065, U32, "following-error-window"),
    (0x6067, U32, "position-window"),
    (0x606b, I32, "velocity-demand-value"),
    (0x606c, I32, "velocity-actual-value"),
    (0x6071, I16, "target-torque"),
    (0x6072, U16, "max-torque"),
    (0x6074, I16, "torque-demand-value"),
    (0x6077, I16, "torque-actual-value"),
    (0x6078, I16, "current-actual-value"),
    (0x6079, U32, "dc-link-circuit-voltage"),
    (0x607a, I32, "target-position"),
    (0x6081, U32, "profile-velocity"),
    (0x6083, U32, "profile-acceleration"),
    (0x6084, U32, "profile-deceleration"),
    (0x60f4, I32, "following-error-actual-value"),
    (0x60fd, U32, "digital-inputs"),
    (0x60ff, I32, "target-velocity"),
    (0x6502, U32, "supported-drive-modes"),
];

/// An object with a measured value, and whether it is an array: one sub-index per input.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measured {
    /// Its index.
    pub index: u16,
    /// Its name: `slope-long16`, `analogue-input-16`.
    pub name: &'static str,
    /// Whether sub-index 0 is the number of entries.
    pub is_array: bool,
}

const fn one(index: u16, name: &'static str) -> Measured {
    Measured { index, name, is_array: false }
}

const fn array(index: u16, name: &'static str) -> Measured {
    Measured { index, name, is_array: true }
}

/// Returns the measured values of a profile, in the order in which they are shown.
pub fn measured(profile: u32) -> &'static [Measured] {
    const GENERIC_IO_INPUTS: &[Measured] = &[
        array(0x6000, "digital-input-8"),
        array(0x6401, "analogue-input-16"),
        array(0x6400, "analogue-input-8"),
        array(0x6402, "analogue-input-32"),
        array(0x6403, "analogue-input-float"),
    ];
    const ENCODER_VALUES: &[Measured] =
        &[one(0x6004, "position-value"), array(0x6020, "position-value-multi"), array(0x6030, "speed-value")];
    const SLOPES: &[Measured] = &[
        one(0x6010, "slope-long16"),
        one(0x6020, "slope-lateral16"),
        one(0x6110, "slope-long32"),
        one(0x6120, "slope-lateral32"),
    ];
    match profile {
        GENERIC_IO => GENERIC_IO_INPUTS,
        ENCODER => ENCODER_VALUES,
        INCLINOMETER => SLOPES,
        _ => &[],
    }
}

/// Returns the named objects of a profile that are not measured values.
fn settings(profile: u32) -> &'static [Measured] {
    const ENCODER_SETTINGS: &[Measured] = &[
        one(0x6000, "operating-parameters"),
        one(0x6001, "units-per-revolution"),
        one(0x6002, "total-measuring-range"),
        one(0x6003, "preset-value"),
        array(0x6005, "linear-encoder-step-settings"),
        one(0x6200, "cyclic-timer"),
        one(0x6500, "operating-status"),
        one(0x6501, "single-turn-resolution"),
        one(0x6502, "distinguishable-revolutions"),
        one(0x6503, "alarms"),
        one(0x6505, "warnings"),
    ];
    const SLOPE_SETTINGS: &[Measured] = &[
        one(0x6000, "resolution"),
        one(0x6011, "slope-long16-operating-parameter"),
        one(0x6012, "slope-long16-preset-value"),
        one(0x6013, "slope-long16-offset"),
        one(0x6014, "differential-slope-long16-offset"),
        one(0x6021, "slope-lateral16-operating-parameter"),
        one(0x6022, "slope-lateral16-preset-value"),
        one(0x6023, "slope-lateral16-offset"),
        one(0x6024, "differential-slope-lateral16-offset"),
    ];
    match profile {
        ENCODER => ENCODER_SETTINGS,
        INCLINOMETER => SLOPE_SETTINGS,
        _ => &[],
    }
}

/// Returns the settings of a profile. Only the first two entries of an array are included.
pub fn settings_of(profile: u32) -> impl Iterator<Item = ObjectId> {
    let subs = |row: &Measured| if row.is_array { 1..=2 } else { 0..=0 };
    settings(profile).iter().flat_map(move |row| subs(row).map(|sub| ObjectId::new(row.index, sub)))
}

/// Returns the name of an object of a profile.
pub fn name(profile: u32, object: ObjectId) -> Option<String> {
    if profile == DRIVES && object.sub == 0 {
        return DRIVE_OBJECTS.iter().find(|(index, ..)| *index == object.index).map(|(.., name)| (*name).to_owned());
    }
    let row = measured(profile).iter().chain(settings(profile)).find(|row| row.index == object.index)?;
    match (row.is_array, object.sub) {
        (false, 0) => Some(row.name.to_owned()),
        (true, sub) => Some(format!("{}:{sub}", row.name)),
        (false, _) => None,
    }
}

/// Returns the object of a profile with this name. Letter case is ignored.
pub fn find(profile: u32, text: &str) -> Option<ObjectId> {
    let text = text.to_ascii_lowercase();
    let (bare, sub) = text.split_once(':').unwrap_or((&text, "0"));
    let sub = sub.parse().ok()?;
    let rows = measured(profile).iter().chain(settings(profile)).map(|row| (row.index, row.name));
    let drives = DRIVE_OBJECTS.iter().filter(|_| profile == DRIVES).map(|(index, _, name)| (*index, *name));
    let (index, _) = rows.chain(drives).find(|(_, name)| *name == bare)?;
    let object = ObjectId::new(index, sub);
    name(profile, object).filter(|name| *name == text).map(|_| object)
}

/// The step (resolution) of an integer: the object that contains it, its unit and its decimal digits.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The object with the step.
    pub object: ObjectId,
    /// The symbol of the unit.
    pub unit: &'static str,
    /// The decimal digits of the step.
    pub digits: u8,
}

/// Returns the step of a measured value. `device_type` is 1000h with all 32 bits. `None` if the number needs no step.
pub fn step(device_type: u32, object: ObjectId) -> Option<Step> {
    // CiA 406: absolute linear encoders, also with cyclic coding.
    let is_linear = matches!(device_type >> 16, 8 | 9);
    match (device_type & 0xffff, object.index) {
        // CiA 410: the step is in 0.001 deg.
        (INCLINOMETER, 0x6010 | 0x6020 | 0x6110 | 0x6120) => {
            Some(Step { object: ObjectId::new(0x6000, 0), unit: "deg", digits: 3 })
        }
        // CiA 406: the steps are in nm and in 0.01 mm/s.
        (ENCODER, 0x6004 | 0x6020) if is_linear => {
            Some(Step { object: ObjectId::new(0x6005, 1), unit: "mm", digits: 6 })
        }
        (ENCODER, 0x6030) if is_linear => Some(Step { object: ObjectId::new(0x6005, 2), unit: "mm/s", digits: 2 }),
        _ => None,
    }
}

/// First index, last index and type of objects in a row.
type Row = (u16, u16, DataType);

const GENERIC_IO_OBJECTS: &[Row] = &[
    // Inputs: objects with 8, 1, 16 and 32 digital lines, then analogue inputs. The type of 6404h is
    // manufacturer-specific.
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
    (0x6001, 0x6004, U32),
    (0x6005, 0x6005, U32),
    (0x6008, 0x6008, DataType::Unsigned(8)),
    (0x600c, 0x600c, U32),
    (0x6020, 0x6020, I32),
    (0x6030, 0x6030, I16),
    (0x6040, 0x6040, I16),
    (0x6050, 0x6050, I16),
    (0x6200, 0x6200, U16),
    (0x6300, 0x6300, U8),
    (0x6500, 0x6500, U16),
    (0x6501, 0x6502, U32),
    (0x6503, 0x6506, U16),
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
    // Longitudinal and lateral slope, 32 bits.
    (0x6110, 0x6110, I32),
    (0x6111, 0x6111, U8),
    (0x6112, 0x6114, I32),
    (0x6120, 0x6120, I32),
    (0x6121, 0x6121, U8),
    (0x6122, 0x6124, I32),
];

/// CiA 404: the analogue inputs of one family. The first digit of the index is the family: 6 is REAL32, 7 INTEGER16, 8
/// INTEGER24, 9 INTEGER32. The table contains the other three digits.
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
    (0x140, Meaning::Process),
    (0x148, Meaning::Process),
    (0x149, Meaning::Process),
];

/// CiA 404: objects that exist once for all families.
const MEASURING_OBJECTS: &[Row] = &[
    (0x6110, 0x6110, U16),
    (0x6111, 0x6111, U32),
    (0x6112, 0x6112, U8),
    (0x6114, 0x6114, U32),
    (0x6125, 0x6125, U32),
    (0x6131, 0x6131, U32),
    (0x6132, 0x6132, U8),
    (0x6139, 0x6139, U32),
    (0x6150, 0x6150, U8),
    (0x61a0, 0x61a0, U8),
    (0x61a1, 0x61a1, U16),
];

/// The meaning of an object in a family of CiA 404.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// A field value: the output of the sensor element.
    Field,
    /// A process value: it has the unit (6131h) and the decimal digits (6132h) of its channel.
    Process,
    /// A factor without a unit.
    Factor,
}

/// Returns the type that a profile defines for an object. `None` if the profile does not define it.
pub fn data_type(profile: u32, object: ObjectId) -> Option<DataType> {
    let rows = match profile {
        GENERIC_IO => GENERIC_IO_OBJECTS,
        MEASURING => MEASURING_OBJECTS,
        ENCODER => ENCODER_OBJECTS,
        INCLINOMETER => INCLINOMETER_OBJECTS,
        DRIVES => {
            let found = DRIVE_OBJECTS.iter().find(|(index, ..)| *index == object.index && object.sub == 0);
            return found.map(|&(_, data_type, _)| data_type);
        }
        _ => return None,
    };
    let row = rows.iter().find(|(first, last, _)| (*first..=*last).contains(&object.index));
    let (is_array, known) = match (row, profile) {
        // Sub-index 0 of an array is the number of entries.
        (Some(&(_, _, data_type)), GENERIC_IO | MEASURING) => (true, data_type),
        (Some(&(index, _, data_type)), ENCODER) => (matches!(index, 0x6005 | 0x6020..=0x6050 | 0x6300), data_type),
        (Some(&(_, _, data_type)), _) => (false, data_type),
        (None, MEASURING) => (true, family_type(object).filter(|_| meaning(object).is_some())?),
        (None, _) => return None,
    };
    Some(if is_array && object.sub == 0 { U8 } else { known })
}

/// Returns the meaning of an object in the families of CiA 404. `None` if the object belongs to no family.
pub fn meaning(object: ObjectId) -> Option<Meaning> {
    family_type(object)?;
    FAMILY_OBJECTS.iter().find(|(low, _)| object.index & 0xfff == *low).map(|&(_, meaning)| meaning)
}

/// Returns the type of the CiA 404 family: the first digit of the index decides.
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
            ("6139:1", Some(U32)),
            ("7139:1", None),
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
            (DRIVES, "6041:0", Some(U16)),
            (DRIVES, "6041:1", None),
            (ENCODER, "6005:2", Some(U32)),
        ] {
            assert_eq!(data_type(profile, object(text)), expected, "{profile} {text}");
        }
    }

    #[test]
    fn names_find_their_objects() {
        for profile in [GENERIC_IO, DRIVES, MEASURING, ENCODER, INCLINOMETER] {
            let rows = measured(profile).iter().chain(settings(profile));
            let objects = rows.map(|row| ObjectId::new(row.index, u8::from(row.is_array)));
            let drives = DRIVE_OBJECTS.iter().filter(|_| profile == DRIVES).map(|(index, ..)| ObjectId::new(*index, 0));
            for object in objects.chain(drives) {
                let text = name(profile, object).unwrap_or_else(|| panic!("{profile} {object}"));
                assert_eq!(find(profile, &text), Some(object), "{profile} {text}");
                assert!(data_type(profile, object).is_some(), "{profile} {text} has a type");
            }
        }
        assert_eq!(find(INCLINOMETER, "Slope-Long16"), Some(object("6010:0")));
        assert_eq!(find(INCLINOMETER, "slope-long16:0"), None);
        assert_eq!(find(GENERIC_IO, "analogue-input-16"), None);
        assert_eq!(find(GENERIC_IO, "analogue-input-16:9"), Some(object("6401:9")));
    }

    #[test]
    fn steps_follow_the_kind_of_the_device() {
        let unit = |device_type: u32, text: &str| step(device_type, object(text)).map(|step| (step.unit, step.digits));
        assert_eq!(unit(0x0002_019a, "6010:0"), Some(("deg", 3)));
        assert_eq!(unit(0x0002_019a, "6011:0"), None);
        assert_eq!(unit(0x0008_0196, "6004:0"), Some(("mm", 6)));
        assert_eq!(unit(0x0008_0196, "6030:1"), Some(("mm/s", 2)));
        assert_eq!(unit(0x0002_0196, "6004:0"), None, "rotary");
    }
}
