//! The built-in device descriptions, and the recognition of a device by what it answers.

use super::description::Description;
use super::dictionary::Dictionary;
use std::sync::{Arc, OnceLock};

/// A description with its object dictionary laid out.
#[derive(Clone, Debug)]
pub struct Model {
    /// What the file says.
    pub description: Description,
    /// Its objects.
    pub dictionary: Dictionary,
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
        Ok(Model { description, dictionary })
    }

    /// Whether everything that the description asks for is answered so.
    fn fits(&self, traits: &Traits) -> bool {
        fn agrees<T: PartialEq>(wanted: &Option<T>, found: &Option<T>) -> bool {
            wanted.is_none() || wanted == found
        }
        let wanted = &self.description.identify;
        agrees(&wanted.device_type, &traits.device_type)
            && agrees(&wanted.vendor_id, &traits.vendor_id)
            && agrees(&wanted.product_code, &traits.product_code)
            && agrees(&wanted.device_name, &traits.device_name)
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
        built_in!("mh4", "d20", "dps", "mc1609")
            .into_iter()
            .filter_map(|(_, text)| Model::from_toml(text).ok().map(Arc::new))
            .collect()
    })
}

/// The built-in description of a name.
pub fn by_name(name: &str) -> Option<Arc<Model>> {
    built_in().iter().find(|model| model.description.name == name).cloned()
}

/// The built-in description that a device's answers fit.
pub fn recognise(traits: &Traits) -> Option<Arc<Model>> {
    built_in().iter().find(|model| model.fits(traits)).cloned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_built_in_description_loads() {
        for (name, text) in built_in!("mh4", "d20", "dps", "mc1609") {
            let model = Model::from_toml(text).unwrap_or_else(|error| panic!("{name}: {error}"));
            assert_eq!(model.description.name, name);
        }
        assert_eq!(built_in().len(), 4);
    }
}
