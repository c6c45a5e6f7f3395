//! The built-in device descriptions, and the recognition of a device by its answers.

mod recognition;

use super::config_file::Place;
use super::description::{self, Description, DescriptionError, Identify};
use super::dictionary::Dictionary;
use crate::canopen::object::ObjectId;
use crate::device::eds::Eds;
use crate::device::profiles;
pub use recognition::{by_identity, objects_to_read, recognise};
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

/// The name and the text of every file in `devices/`, listed by the build script.
const FILES: &[(&str, &str)] = include!(concat!(env!("OUT_DIR"), "/devices.rs"));

/// A description with its object dictionary.
#[derive(Clone, Debug)]
pub struct Model {
    /// The contents of the file.
    pub description: Description,
    /// Its objects by address and by name.
    pub dictionary: Dictionary,
    /// Objects without a data type in the description; they are read as bytes.
    pub untyped: BTreeSet<ObjectId>,
    /// The device of the description, and the device of each EDS file that was merged into it.
    pub made_for: Vec<TargetDevice>,
    /// Warnings about objects: the index of the object and the text.
    pub warnings: Vec<(u16, String)>,
}

/// The device that a description or an EDS file is for.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct TargetDevice {
    /// The file, or the name of a built-in description.
    pub file: String,
    /// Vendor-ID (1018h:1). It is not compared if it is 0 or `None`.
    pub vendor: Option<u32>,
    /// Product code (1018h:2). It is not compared if it is 0 or `None`.
    pub product: Option<u32>,
    /// Revision number (1018h:3). It is not compared if it is 0 or `None`.
    pub revision: Option<u32>,
}

impl TargetDevice {
    /// Whether vendor and product of a device agree. Unknown numbers are not compared.
    pub fn fits(&self, vendor: Option<u32>, product: Option<u32>) -> bool {
        agree_if_known(self.vendor, vendor) && agree_if_known(self.product, product)
    }

    /// Whether the revision of a device agrees. Unknown numbers are not compared.
    pub fn has_revision(&self, revision: Option<u32>) -> bool {
        agree_if_known(self.revision, revision)
    }
}

fn agree_if_known(wanted: Option<u32>, found: Option<u32>) -> bool {
    match (wanted.filter(|&number| number != 0), found.filter(|&number| number != 0)) {
        (Some(wanted), Some(found)) => wanted == found,
        _ => true,
    }
}

/// The identity that a device reports; `None` for an object that it did not answer.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct IdentityAnswers {
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:1.
    pub vendor_id: Option<u32>,
    /// 1018h:2.
    pub product_code: Option<u32>,
    /// 1008h.
    pub device_name: Option<String>,
    /// The received bytes of the objects that [`objects_to_read`] returned.
    pub answers: BTreeMap<ObjectId, Vec<u8>>,
}

impl Model {
    /// Whether all process values have the data types of CiA 404. Only then may the description be used for a similar
    /// device of another vendor.
    pub fn has_standard_values(&self) -> bool {
        let mut entries = self.dictionary.iter();
        entries.all(|entry| {
            let is_process =
                profiles::meaning(entry.object) == Some(profiles::Meaning::Process) && entry.object.sub > 0;
            let standard = profiles::data_type(profiles::MEASURING, entry.object);
            !is_process || standard.is_none_or(|data_type| data_type == entry.data_type)
        })
    }

    /// Reads a description.
    ///
    /// # Errors
    /// The first mistake: TOML syntax, an unknown key, a value of the wrong form, or a contradiction.
    /// [`description::read`] returns all of them.
    pub fn from_toml(text: &str) -> Result<Model, DescriptionError> {
        let description = description::read(text).map_err(|mistakes| {
            let none =
                || DescriptionError { place: Place { line: 1, column: 1 }, message: "not a description".to_owned() };
            mistakes.into_iter().next().unwrap_or_else(none)
        })?;
        let mut dictionary = Dictionary::new();
        description.objects.iter().for_each(|object| dictionary.insert_described(object));
        let made_for = TargetDevice {
            file: description.name.clone(),
            vendor: description.identify.vendor_id,
            product: description.identify.product_code,
            revision: None,
        };
        Ok(Model { description, dictionary, untyped: BTreeSet::new(), made_for: vec![made_for], warnings: Vec::new() })
    }

    /// Creates a model from an EDS or DCF file. It has no signals: they are derived from the objects of CiA 404.
    pub fn from_eds(eds: &Eds) -> Model {
        let description = Description {
            name: "eds".to_owned(),
            title: eds.info.product_name.clone().unwrap_or_else(|| "the EDS file".to_owned()),
            vendor: eds.info.vendor_name.clone().unwrap_or_default(),
            ..Description::default()
        };
        let made_for = TargetDevice {
            file: description.name.clone(),
            vendor: eds.info.vendor_number,
            product: eds.info.product_number,
            revision: eds.info.revision_number,
        };
        let warnings = eds.warnings.iter().filter_map(|warning| Some((warning.index?, warning.to_string())));
        Model {
            description,
            dictionary: eds.configured(),
            untyped: eds.untyped.clone(),
            made_for: vec![made_for],
            warnings: warnings.collect(),
        }
    }

    /// Adds the objects of an EDS file of the same device. If both have an object, the description has priority.
    #[must_use]
    pub fn with_eds(&self, eds: &Model) -> Model {
        let mut merged = self.clone();
        merged.dictionary = eds.dictionary.clone();
        self.dictionary.iter().for_each(|entry| merged.dictionary.insert(entry.clone()));
        merged.untyped.extend(eds.untyped.iter().filter(|object| self.dictionary.get(**object).is_none()));
        merged.made_for.extend(eds.made_for.iter().cloned());
        merged.warnings.extend(eds.warnings.iter().cloned());
        merged
    }

    /// Whether both descriptions recognise the same devices.
    pub fn is_for_the_same_device(&self, other: &Model) -> bool {
        let identify = &self.description.identify;
        !identify.is_empty() && *identify == other.description.identify
    }
}

/// The descriptions of the user, in the order of their folders and names.
static OWN: OnceLock<Vec<Arc<Model>>> = OnceLock::new();

/// Adds the descriptions of the user. They have priority over the built-in ones. Only the first call has an effect, and
/// only before the first search for a description.
pub fn add_own(models: Vec<Arc<Model>>) {
    let _ = OWN.set(models);
}

/// The descriptions of the user.
pub fn own() -> &'static [Arc<Model>] {
    OWN.get().map_or(&[], Vec::as_slice)
}

/// Every description: the user's, then the built-in ones with other names.
pub fn all() -> impl Iterator<Item = &'static Arc<Model>> {
    let is_replaced = |model: &&Arc<Model>| own().iter().any(|own| own.description.name == model.description.name);
    own().iter().chain(built_in().iter().filter(move |model| !is_replaced(model)))
}

/// The built-in descriptions, in the order of their names.
pub fn built_in() -> &'static [Arc<Model>] {
    static MODELS: OnceLock<Vec<Arc<Model>>> = OnceLock::new();
    MODELS.get_or_init(|| (0..FILES.len()).filter_map(file).collect())
}

/// Returns one built-in description. It is parsed at its first use, because most commands need only one.
fn file(index: usize) -> Option<Arc<Model>> {
    static MODELS: [OnceLock<Option<Arc<Model>>>; FILES.len()] = [const { OnceLock::new() }; FILES.len()];
    let (_, text) = FILES.get(index)?;
    MODELS.get(index)?.get_or_init(|| Model::from_toml(text).ok().map(Arc::new)).clone()
}

/// Returns the identity in a built-in description.
fn identify(index: usize) -> &'static Identify {
    static IDENTITIES: [OnceLock<Identify>; FILES.len()] = [const { OnceLock::new() }; FILES.len()];
    IDENTITIES[index].get_or_init(|| description::read_identify(FILES[index].1).unwrap_or_default())
}

/// The names of the built-in descriptions, in ascending order.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|(name, _)| *name)
}

/// Returns the text of the built-in description with this name, including its comments.
pub fn text(name: &str) -> Option<&'static str> {
    FILES.iter().find(|(other, _)| *other == name).map(|(_, text)| *text)
}

/// Returns the description with this name: the user's, else the built-in one.
pub fn by_name(name: &str) -> Option<Arc<Model>> {
    if let Some(own) = own().iter().find(|model| model.description.name == name) {
        return Some(Arc::clone(own));
    }
    file(names().position(|other| other == name)?)
}

/// Whether a built-in description is for a device of this vendor (1018h:1).
pub fn has_vendor(vendor: u32) -> bool {
    (0..FILES.len()).any(|index| identify(index).vendor_id == Some(vendor))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::id::NodeId;
    use crate::canopen::value::DataType;
    use crate::device::scalar::Scalar;

    fn node() -> NodeId {
        NodeId::new(127).expect("a node-ID")
    }

    /// Returns the answers of a device with this description.
    fn traits_of(model: &Model) -> IdentityAnswers {
        let bytes = |object: ObjectId| model.dictionary.get(object).and_then(|entry| entry.default_bytes(node()));
        let number = |index, sub| {
            bytes(ObjectId::new(index, sub)).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes)
        };
        IdentityAnswers {
            device_type: number(0x1000, 0),
            vendor_id: number(0x1018, 1),
            product_code: number(0x1018, 2),
            device_name: bytes(ObjectId::new(0x1008, 0)).and_then(|bytes| String::from_utf8(bytes).ok()),
            answers: BTreeMap::new(),
        }
    }

    #[test]
    fn only_two_descriptions_have_other_types_than_cia_404() {
        let others: Vec<&str> =
            names().filter(|name| !by_name(name).expect("built in").has_standard_values()).collect();
        assert_eq!(others, ["dps", "mc1609"]);
    }

    #[test]
    fn descriptions_agree_with_the_standard() {
        for model in built_in() {
            for entry in model.dictionary.iter() {
                let Some(standard) = crate::device::standard::entry(entry.object) else { continue };
                let name = &model.description.name;
                assert_eq!(entry.data_type, standard.data_type, "{name} {}", entry.object);
                assert_eq!(entry.full_name(), standard.full_name(), "{name} {}", entry.object);
            }
        }
    }

    #[test]
    fn every_built_in_description_loads() {
        for (name, text) in FILES {
            let description = description::read(text).unwrap_or_else(|mistakes| panic!("{name}: {mistakes:?}"));
            assert_eq!(description.name, *name, "the file has the name of the device");
        }
        assert_eq!(built_in().len(), FILES.len());
        for (index, model) in built_in().iter().enumerate() {
            let name = &model.description.name;
            let early = "[identify] precedes the arrays of tables";
            assert_eq!(*identify(index), model.description.identify, "{name}: {early}");
        }
        assert!(names().eq(built_in().iter().map(|model| model.description.name.as_str())));
    }

    #[test]
    fn full_names_are_unique() {
        for model in built_in() {
            let mut names = BTreeSet::new();
            for entry in model.dictionary.iter() {
                let name = entry.full_name();
                assert!(names.insert(name.clone()), "{}: {name} twice", model.description.name);
                assert_eq!(model.dictionary.find(&name), Some(entry), "{}: {name}", model.description.name);
            }
        }
    }

    #[test]
    fn one_different_answer_is_not_recognised() {
        for model in built_in() {
            let wanted = &model.description.identify;
            let own = IdentityAnswers {
                device_type: wanted.device_type,
                vendor_id: wanted.vendor_id,
                product_code: wanted.product_code,
                device_name: wanted.device_name.clone(),
                answers: BTreeMap::new(),
            };
            // A description without an identity is used only if the user names it.
            assert_eq!(wanted.agrees_with(&own), !wanted.is_empty(), "{}", model.description.name);
            let other = |number: Option<u32>| number.map(|number| number ^ 1);
            let others = [
                IdentityAnswers { device_type: other(own.device_type), ..own.clone() },
                IdentityAnswers { vendor_id: other(own.vendor_id), ..own.clone() },
                IdentityAnswers { product_code: other(own.product_code), ..own.clone() },
                IdentityAnswers { device_name: own.device_name.clone().map(|name| name + "!"), ..own.clone() },
            ];
            let wrong: Vec<_> = others.iter().filter(|other| **other != own && wanted.agrees_with(other)).collect();
            assert!(wrong.is_empty(), "{}: {wrong:?}", model.description.name);
        }
    }

    #[test]
    fn another_value_of_a_confirming_object_is_not_recognised() {
        let mut count = 0;
        for model in built_in() {
            let identify = &model.description.identify;
            let mut own = IdentityAnswers {
                device_type: identify.device_type,
                vendor_id: identify.vendor_id,
                product_code: identify.product_code,
                device_name: identify.device_name.clone(),
                answers: BTreeMap::new(),
            };
            for (&object, value) in &identify.confirm {
                let data_type = model.dictionary.get(object).unwrap().data_type;
                own.answers.insert(object, value.encode(data_type, NodeId::MIN).unwrap());
            }
            let name = &model.description.name;
            for object in identify.confirm.keys() {
                let is_this =
                    |answers: &IdentityAnswers| recognise(answers).is_some_and(|found| found.description.name == *name);
                assert!(is_this(&own), "{name}");
                let mut other = own.clone();
                other.answers.get_mut(object).unwrap()[0] ^= 1;
                assert!(!is_this(&other), "{name} {object}");
                count += 1;
            }
        }
        assert!(count >= 3, "{count} confirming objects");
    }

    #[test]
    fn real_defaults_have_a_point() {
        for model in built_in() {
            for object in &model.description.objects {
                for scalar in [&object.default, &object.low, &object.high].into_iter().flatten() {
                    let real = matches!(scalar, Scalar::Real(_));
                    assert_eq!(real, object.data_type == DataType::Real32, "{} {}", model.description.name, object.at);
                }
            }
        }
    }

    #[test]
    fn default_mappings_contain_mappable_objects_with_their_width() {
        for model in built_in() {
            let mappings = model.dictionary.iter().filter(|entry| (0x1a00..0x1c00).contains(&entry.object.index));
            for mapping in mappings.filter(|entry| entry.object.sub > 0) {
                let Some(Scalar::Integer(number)) = mapping.default else { continue };
                let [bits, sub, low, high, ..] = number.to_le_bytes();
                if number == 0 {
                    continue;
                }
                let object = ObjectId::new(u16::from_le_bytes([low, high]), sub);
                let entry =
                    model.dictionary.get(object).unwrap_or_else(|| panic!("{object} is mapped and not described"));
                assert!(entry.pdo, "{} {object}", model.description.name);
                assert_eq!(entry.data_type.width(), Some(usize::from(bits / 8)), "{} {object}", model.description.name);
            }
        }
    }

    #[test]
    fn each_device_is_recognised_by_its_own_answers() {
        for model in built_in() {
            let mut traits = traits_of(model);
            if model.description.identify.is_empty() {
                assert_eq!(recognise(&traits).map(|found| found.description.name.clone()), None);
                continue;
            }
            for object in objects_to_read(&traits) {
                // The device rejects objects that only other descriptions contain.
                let Some(entry) = model.dictionary.get(object) else { continue };
                let mut bytes = entry.default_bytes(node()).expect("a default");
                bytes.resize(4, 0xff);
                traits.answers.insert(object, bytes);
            }
            assert_eq!(
                recognise(&traits).map(|found| found.description.name.clone()).as_ref(),
                Some(&model.description.name)
            );
            assert_eq!(objects_to_read(&traits), []);
        }
    }

    #[test]
    fn another_device_of_the_same_profile_is_not_recognised() {
        // Many devices have the type 0x00020194; the other answers decide.
        let mut traits =
            IdentityAnswers { device_type: Some(0x0002_0194), vendor_id: Some(0x99), ..IdentityAnswers::default() };
        assert_eq!(recognise(&traits).map(|model| model.description.name.clone()), None);
        let asked = objects_to_read(&traits);
        let scaling = [0x7121, 0x7122, 0x7123].map(|index| ObjectId::new(index, 16));
        let fixed_mapping = [0x1a00, 0x1a04].map(|index| ObjectId::new(index, 1));
        assert_eq!(asked, [&fixed_mapping[..], &scaling[..]].concat());
        // A wrong value at 7122h, and an empty answer for 7121h.
        traits.answers.insert(scaling[1], vec![0xff, 0xff]);
        traits.answers.insert(scaling[0], Vec::new());
        traits.answers.insert(fixed_mapping[0], vec![0x20, 0x01, 0x30, 0x61]);
        assert_eq!(recognise(&traits).map(|model| model.description.name.clone()), None);
        assert_eq!(objects_to_read(&traits), [fixed_mapping[1], scaling[2]]);
        // If a device does not answer, no further objects are read.
        assert_eq!(objects_to_read(&IdentityAnswers::default()), []);
        assert_eq!(recognise(&IdentityAnswers::default()).map(|model| model.description.name.clone()), None);
    }
}
