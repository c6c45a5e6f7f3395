//! The built-in device descriptions, and the recognition of a device by what it answers.

use super::description::Description;
use super::dictionary::Dictionary;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::eds::Eds;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

/// A description with its object dictionary laid out.
#[derive(Clone, Debug)]
pub struct Model {
    /// What the file says.
    pub description: Description,
    /// Its objects.
    pub dictionary: Dictionary,
    /// Objects whose type the description leaves open: they read as bytes.
    pub untyped: BTreeSet<ObjectId>,
}

/// What a device says of itself; what it did not answer is `None`.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Traits {
    /// 1000h.
    pub device_type: Option<u32>,
    /// 1018h:1.
    pub vendor_id: Option<u32>,
    /// 1018h:2.
    pub product_code: Option<u32>,
    /// 1008h.
    pub device_name: Option<String>,
    /// What else was read, because [`to_ask`] wanted it.
    pub answers: BTreeMap<ObjectId, Vec<u8>>,
}

/// A description that cannot be used.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct DescriptionError(String);

impl Model {
    /// Reads a description.
    ///
    /// # Errors
    /// TOML errors with their line, unknown keys, addresses that are none.
    pub fn from_toml(text: &str) -> Result<Model, DescriptionError> {
        let description: Description =
            toml::from_str(text).map_err(|error| DescriptionError(error.to_string().trim_end().to_owned()))?;
        let mut dictionary = Dictionary::new();
        for object in &description.objects {
            dictionary.insert_described(object).map_err(DescriptionError)?;
        }
        for entry in dictionary.iter() {
            for (what, scalar) in [("default", &entry.default), ("low", &entry.low), ("high", &entry.high)] {
                if let Some(Err(error)) = scalar.as_ref().map(|scalar| scalar.encode(entry.data_type, NodeId::MIN)) {
                    return Err(DescriptionError(format!("{what} of {}: {error}", entry.object)));
                }
            }
        }
        Ok(Model { description, dictionary, untyped: BTreeSet::new() })
    }

    /// What an EDS or DCF file tells: objects and their types. What the device measures is found out from
    /// the objects of CiA 404.
    pub fn from_eds(eds: &Eds) -> Model {
        let description = Description {
            name: "eds".to_owned(),
            title: eds.info.product_name.clone().unwrap_or_else(|| "the EDS file".to_owned()),
            vendor: eds.info.vendor_name.clone().unwrap_or_default(),
            ..Description::default()
        };
        Model { description, dictionary: eds.configured(), untyped: eds.untyped.clone() }
    }

    /// Whether the identity is as the description asks, so far as it needs no further reading.
    fn looks_like(&self, traits: &Traits) -> bool {
        fn agrees<T: PartialEq>(wanted: &Option<T>, found: &Option<T>) -> bool {
            wanted.is_none() || wanted == found
        }
        let wanted = &self.description.identify;
        !wanted.is_empty()
            && agrees(&wanted.device_type, &traits.device_type)
            && agrees(&wanted.vendor_id, &traits.vendor_id)
            && agrees(&wanted.product_code, &traits.product_code)
            && agrees(&wanted.device_name, &traits.device_name)
    }

    /// Whether the objects that confirm the identity hold what they must. Bytes beyond the type's
    /// width do not count: a server that omits the size sends four.
    fn is_confirmed(&self, traits: &Traits) -> bool {
        self.description.identify.confirm.iter().all(|(&object, value)| {
            let wanted = self.dictionary.get(object).and_then(|entry| value.encode(entry.data_type, NodeId::MIN).ok());
            match (wanted, traits.answers.get(&object)) {
                (Some(wanted), Some(found)) => found.starts_with(&wanted),
                _ => false,
            }
        })
    }

    /// Whether everything that the description asks for is answered so.
    fn fits(&self, traits: &Traits) -> bool {
        self.looks_like(traits) && self.is_confirmed(traits)
    }
}

macro_rules! built_in {
    ($($name:literal),* $(,)?) => {
        [$(($name, include_str!(concat!("devices/", $name, ".toml")))),*]
    };
}

/// The built-in descriptions, in the order in which they are tried.
pub fn built_in() -> &'static [Arc<Model>] {
    static MODELS: OnceLock<Vec<Arc<Model>>> = OnceLock::new();
    MODELS.get_or_init(|| {
        built_in!("mh4", "d20", "dps", "mc1609", "hydac-old", "baumer", "hydac", "jumo")
            .into_iter()
            .filter_map(|(_, text)| Model::from_toml(text).ok().map(Arc::new))
            .collect()
    })
}

/// The built-in description of a name.
pub fn by_name(name: &str) -> Option<Arc<Model>> {
    built_in().iter().find(|model| model.description.name == name).cloned()
}

/// The built-in description of a device of which only vendor-ID and product code are known: one that asks for both.
pub fn by_identity(vendor: u32, product: u32) -> Option<Arc<Model>> {
    let wanted = (Some(vendor), Some(product));
    let fits = |model: &&Arc<Model>| {
        let identify = &model.description.identify;
        (identify.vendor_id, identify.product_code) == wanted
    };
    built_in().iter().find(fits).cloned()
}

/// What has still to be read to tell which description a device's answers fit: empty when one fits,
/// and when none can. Read these, put the bytes into [`Traits::answers`], then [`recognise`].
pub fn to_ask(traits: &Traits) -> Vec<ObjectId> {
    if recognise(traits).is_some() {
        return Vec::new();
    }
    let candidates = built_in().iter().filter(|model| model.looks_like(traits));
    let mut objects: Vec<ObjectId> = candidates
        .flat_map(|model| model.description.identify.confirm.keys().copied())
        .filter(|object| !traits.answers.contains_key(object))
        .collect();
    objects.sort_unstable();
    objects.dedup();
    objects
}

/// The built-in description that a device's answers fit.
pub fn recognise(traits: &Traits) -> Option<Arc<Model>> {
    built_in().iter().find(|model| model.fits(traits)).cloned()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::value::DataType;
    use crate::device::description::{ObjectEntry, Scalar, parse_range};

    fn node() -> NodeId {
        NodeId::new(127).expect("a node-ID")
    }

    /// What a device of this description answers.
    fn traits_of(model: &Model) -> Traits {
        let bytes = |object: ObjectId| model.dictionary.get(object).and_then(|entry| entry.default_bytes(node()));
        let number = |index, sub| {
            bytes(ObjectId::new(index, sub)).and_then(|bytes| bytes.try_into().ok()).map(u32::from_le_bytes)
        };
        Traits {
            device_type: number(0x1000, 0),
            vendor_id: number(0x1018, 1),
            product_code: number(0x1018, 2),
            device_name: bytes(ObjectId::new(0x1008, 0)).and_then(|bytes| String::from_utf8(bytes).ok()),
            answers: BTreeMap::new(),
        }
    }

    #[test]
    fn the_standard_and_the_descriptions_agree() {
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
    fn a_default_that_is_none_of_its_type_is_refused() {
        let text = "name='x'\ntitle=''\nvendor=''\nsource=''\n[identify]\n[[object]]\nat='0x2000'\nname='o'\ntype='u8'\naccess='rw'\n";
        assert!(Model::from_toml(&format!("{text}default=255")).is_ok());
        let error = Model::from_toml(&format!("{text}default=256")).expect_err("too large");
        assert_eq!(error.to_string(), "default of 0x2000:0: 256 does not fit u8 (0 to 255)");
        assert!(Model::from_toml(&format!("{text}low='x'")).is_err());
    }

    #[test]
    fn every_built_in_description_loads() {
        for (name, text) in built_in!("mh4", "d20", "dps", "mc1609", "hydac-old", "baumer", "hydac", "jumo") {
            let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(model.description.name, name);
        }
        assert_eq!(built_in().len(), 8);
    }

    #[test]
    fn names_and_addresses_are_unique() {
        for model in built_in() {
            let device = &model.description.name;
            let mut names = BTreeSet::new();
            for entry in model.dictionary.iter() {
                let name = entry.full_name();
                assert!(names.insert(name.clone()), "{device}: {name} twice");
                assert_eq!(model.dictionary.find(&name), Some(entry), "{device}: {name}");
                let plain = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
                assert!(entry.name.chars().all(plain), "{device}: {name}");
                assert!(entry.name.parse::<ObjectId>().is_err(), "{device}: {name} reads as an address");
            }
            // Runs that overlap would have replaced each other without a word.
            let described: usize = model.description.objects.iter().map(run_length).sum();
            assert_eq!(described, model.dictionary.iter().count(), "{device}: an address twice");
        }
    }

    #[test]
    fn one_answer_that_differs_makes_another_device() {
        for model in built_in() {
            let wanted = &model.description.identify;
            let own = Traits {
                device_type: wanted.device_type,
                vendor_id: wanted.vendor_id,
                product_code: wanted.product_code,
                device_name: wanted.device_name.clone(),
                answers: BTreeMap::new(),
            };
            // Who says nothing of himself is taken when he is named, and never else.
            assert_eq!(model.looks_like(&own), !wanted.is_empty(), "{}", model.description.name);
            let other = |number: Option<u32>| number.map(|number| number ^ 1);
            let others = [
                Traits { device_type: other(own.device_type), ..own.clone() },
                Traits { vendor_id: other(own.vendor_id), ..own.clone() },
                Traits { product_code: other(own.product_code), ..own.clone() },
                Traits { device_name: own.device_name.clone().map(|name| name + "!"), ..own.clone() },
            ];
            let wrong: Vec<_> = others.iter().filter(|other| **other != own && model.looks_like(other)).collect();
            assert!(wrong.is_empty(), "{}: {wrong:?}", model.description.name);
        }
    }

    fn run_length(object: &ObjectEntry) -> usize {
        let mut dictionary = Dictionary::new();
        dictionary.insert_described(object).expect("an address");
        dictionary.iter().count()
    }

    #[test]
    fn defaults_and_limits_fit_the_type_and_each_other() {
        for model in built_in() {
            for object in &model.description.objects {
                let place = format!("{} {} {}", model.description.name, object.at, object.name);
                for scalar in [&object.default, &object.low, &object.high].into_iter().flatten() {
                    let bytes =
                        scalar.encode(object.data_type, node()).unwrap_or_else(|error| panic!("{place}: {error}"));
                    if let Some(number) = object.data_type.decode(&bytes).ok().and_then(|value| value.as_f64()) {
                        assert!(object.allows(number), "{place}: {number} is not allowed");
                    }
                }
                let real = object.data_type == DataType::Real32;
                for scalar in [&object.default, &object.low, &object.high].into_iter().flatten() {
                    assert_eq!(real, matches!(scalar, Scalar::Real(_)), "{place}: REAL32 values have a point");
                }
                for listed in &object.allow {
                    let (low, high) = parse_range(listed).unwrap_or_else(|| panic!("{place}: allow {listed}"));
                    for number in [low, high] {
                        assert!(object.data_type.encode_text(&number.to_string()).is_ok(), "{place}: allow {listed}");
                    }
                }
                for number in object.values.keys() {
                    let bytes = object.data_type.encode_text(number).unwrap_or_else(|error| panic!("{place}: {error}"));
                    let number = object.data_type.decode(&bytes).ok().and_then(|value| value.as_f64());
                    assert!(number.is_some_and(|number| object.allows(number)), "{place}: meaning of {number:?}");
                }
                if let Some(signature) = &object.signature {
                    assert!(["save", "load", "zero", "set"].contains(&signature.as_str()), "{place}: {signature}");
                    assert_eq!(object.data_type, DataType::Unsigned(4), "{place}");
                    assert!(object.access.is_writable(), "{place}");
                }
                if let Some(group) = &object.stored {
                    assert!(["comm", "app", "all"].contains(&group.as_str()), "{place}: {group}");
                }
            }
        }
    }

    #[test]
    fn signals_and_the_simulator_agree_with_the_dictionary() {
        for model in built_in() {
            let Description { name: device, signals, sim, .. } = &model.description;
            for signal in signals {
                let objects = [signal.unit, signal.digits, signal.status, signal.span_start, signal.span_end];
                for object in objects.into_iter().flatten().chain([signal.value]).chain(signal.also.iter().copied()) {
                    assert!(model.dictionary.get(object).is_some(), "{device} {}: {object}", signal.name);
                }
                let quantity = sim.channels.iter().find(|quantity| quantity.channel == signal.channel);
                let quantity = quantity.unwrap_or_else(|| panic!("{device} {}: no simulated quantity", signal.name));
                assert!(quantity.start <= quantity.base - quantity.amplitude, "{device} {}", signal.name);
                assert!(quantity.base + quantity.amplitude <= quantity.end, "{device} {}", signal.name);
                let unit = signal.unit.and_then(|unit| model.dictionary.get(unit)?.default.clone());
                assert_eq!(unit, Some(Scalar::Integer(quantity.unit.into())), "{device} {}", signal.name);
            }
            assert_eq!(sim.channels.len(), signals.len(), "{device}");
            let serial = model.dictionary.find("serial-number").and_then(|entry| entry.default.clone());
            assert_eq!(serial, Some(Scalar::Integer(sim.serial.into())), "{device}");
        }
    }

    #[test]
    fn default_mappings_name_mappable_objects_with_their_width() {
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
    fn emergencies_and_bit_rates_are_unique() {
        for model in built_in() {
            let codes: BTreeSet<u16> = model.description.emergencies.iter().map(|emergency| emergency.code).collect();
            assert_eq!(codes.len(), model.description.emergencies.len(), "{}", model.description.name);
            for emergency in &model.description.emergencies {
                assert!(emergency.bytes.len() <= 5 && emergency.register_bit.is_none_or(|bit| bit < 8));
            }
            let rates: BTreeSet<u32> = model.description.bit_rates.values().copied().collect();
            assert_eq!(rates.len(), model.description.bit_rates.len(), "{}", model.description.name);
            assert!(model.description.bit_rates.keys().all(|index| index.parse::<u8>().is_ok()));
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
            for object in to_ask(&traits) {
                // What another description would like to know it refuses.
                let Some(entry) = model.dictionary.get(object) else { continue };
                let mut bytes = entry.default_bytes(node()).expect("a default");
                bytes.resize(4, 0xff);
                traits.answers.insert(object, bytes);
            }
            assert_eq!(
                recognise(&traits).map(|found| found.description.name.clone()).as_ref(),
                Some(&model.description.name)
            );
            assert_eq!(to_ask(&traits), []);
        }
    }

    #[test]
    fn another_device_of_the_same_profile_is_not_recognised() {
        // 0x00020194 is the device type of many: the rest decides.
        let mut traits = Traits { device_type: Some(0x0002_0194), vendor_id: Some(0x99), ..Traits::default() };
        assert_eq!(recognise(&traits).map(|model| model.description.name.clone()), None);
        let asked = to_ask(&traits);
        let scaling = [0x7121, 0x7122, 0x7123].map(|index| ObjectId::new(index, 16));
        let fixed_mapping = [0x1a00, 0x1a04].map(|index| ObjectId::new(index, 1));
        assert_eq!(asked, [&fixed_mapping[..], &scaling[..]].concat());
        // It has a 7122h and no 7121h; an empty answer is no answer.
        traits.answers.insert(scaling[1], vec![0xff, 0xff]);
        traits.answers.insert(scaling[0], Vec::new());
        traits.answers.insert(fixed_mapping[0], vec![0x20, 0x01, 0x30, 0x61]);
        assert_eq!(recognise(&traits).map(|model| model.description.name.clone()), None);
        assert_eq!(to_ask(&traits), [fixed_mapping[1], scaling[2]]);
        // A silent device is asked nothing.
        assert_eq!(to_ask(&Traits::default()), []);
        assert_eq!(recognise(&Traits::default()).map(|model| model.description.name.clone()), None);
    }
}
