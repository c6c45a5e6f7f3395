//! An object dictionary from a description or an EDS file: names, types, access, limits, defaults.

use super::description::{Access, ObjectEntry};
use super::eds::names::slug;
use super::scalar::Scalar;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use std::collections::{BTreeMap, BTreeSet};

/// One entry of the object dictionary.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Its address.
    pub object: ObjectId,
    /// In lower case with hyphens, without the sub-index of a run: `ai-input-pv`.
    pub name: String,
    /// Whether several sub-indices have this name, so that the sub-index is part of the full name: `name:1`.
    pub numbered: bool,
    /// Its data type.
    pub data_type: DataType,
    /// Access by SDO.
    pub access: Access,
    /// Factory default.
    pub default: Option<Scalar>,
    /// Lowest value allowed.
    pub low: Option<Scalar>,
    /// Highest value allowed.
    pub high: Option<Scalar>,
    /// Whether a TPDO can contain the object.
    pub pdo: bool,
}

impl Entry {
    /// The unique name of the entry: `vendor-id`, `ai-input-pv:1`.
    pub fn full_name(&self) -> String {
        if self.numbered { format!("{}:{}", self.name, self.object.sub) } else { self.name.clone() }
    }

    /// Whether `name` is the full name. Compares without building the name, because look-ups compare all entries.
    fn has_full_name(&self, name: &str) -> bool {
        match name.strip_prefix(&self.name) {
            Some(rest) if self.numbered => rest.strip_prefix(':').is_some_and(|sub| sub == self.object.sub.to_string()),
            Some(rest) => rest.is_empty(),
            None => false,
        }
    }

    /// Returns the default in wire order; `node` is the node-ID in `$NODEID`. `None` if no default is known.
    pub fn default_bytes(&self, node: NodeId) -> Option<Vec<u8>> {
        self.default.as_ref()?.encode(self.data_type, node).ok()
    }
}

/// The objects of a device by address and by name.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dictionary {
    entries: BTreeMap<ObjectId, Entry>,
    aliases: BTreeMap<String, ObjectId>,
    spellings: BTreeMap<String, BTreeSet<ObjectId>>,
}

impl Dictionary {
    /// An empty dictionary.
    pub fn new() -> Dictionary {
        Dictionary::default()
    }

    /// Adds or replaces an entry.
    pub fn insert(&mut self, entry: Entry) {
        self.entries.insert(entry.object, entry);
    }

    /// Adds a second name for an entry, in lower case. Full names have priority.
    pub fn insert_alias(&mut self, name: String, object: ObjectId) {
        self.aliases.insert(name, object);
    }

    /// Adds a name as spelled in the file. Several objects can have it; letter case and number of blanks are ignored.
    pub fn insert_spelling(&mut self, name: &str, object: ObjectId) {
        let name = folded(name);
        if !name.is_empty() {
            self.spellings.entry(name).or_default().insert(object);
        }
    }

    /// Returns the full names of the objects that share this name in the file, if there are several.
    pub fn namesakes(&self, name: &str) -> Vec<String> {
        let alike = self.spellings.iter().filter(|(known, _)| **known == folded(name) || slug(known) == slug(name));
        let objects: BTreeSet<ObjectId> = alike.flat_map(|(_, objects)| objects.iter().copied()).collect();
        if objects.len() < 2 {
            return Vec::new();
        }
        objects.into_iter().filter_map(|object| Some(self.get(object)?.full_name())).collect()
    }

    /// Returns the entry at `object`.
    pub fn get(&self, object: ObjectId) -> Option<&Entry> {
        self.entries.get(&object)
    }

    /// Every entry, in ascending order of addresses.
    pub fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.entries.values()
    }

    /// Returns every name in lower case, with its object. Names with a higher priority come later.
    pub fn names(&self) -> impl Iterator<Item = (String, ObjectId)> + '_ {
        let unique = |(name, objects): (&String, &BTreeSet<ObjectId>)| {
            objects.first().filter(|_| objects.len() == 1).map(|object| (name.clone(), *object))
        };
        let aliases = self.aliases.iter().map(|(name, object)| (name.clone(), *object));
        self.spellings
            .iter()
            .filter_map(unique)
            .chain(aliases)
            .chain(self.iter().map(|entry| (entry.full_name(), entry.object)))
    }

    /// Whether the dictionary has no entry.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Whether the dictionary has any sub-index of `index`.
    pub fn has_index(&self, index: u16) -> bool {
        self.entries.range(ObjectId::new(index, 0)..=ObjectId::new(index, 255)).next().is_some()
    }

    /// Finds the entry with a name: `vendor-id`, `ai-input-pv:1`, or `Position Value` as in an EDS. Letter case is
    /// ignored.
    pub fn find(&self, name: &str) -> Option<&Entry> {
        let exact = self.find_exact(&name.to_lowercase());
        exact
            .or_else(|| self.find_spelling(name))
            .or_else(|| spellings(name).into_iter().find_map(|name| self.find_exact(&name)))
    }

    fn find_spelling(&self, name: &str) -> Option<&Entry> {
        let objects = self.spellings.get(&folded(name)).filter(|objects| objects.len() == 1)?;
        self.get(*objects.first()?)
    }

    fn find_exact(&self, name: &str) -> Option<&Entry> {
        let alias = || self.get(*self.aliases.get(name)?);
        self.iter().find(|entry| entry.has_full_name(name)).or_else(alias)
    }

    /// Adds an entry of a device description, with every sub-index of a run.
    pub fn insert_described(&mut self, described: &ObjectEntry) {
        for object in described.objects() {
            self.insert(Entry {
                object,
                name: described.name.clone(),
                numbered: described.at.is_run,
                data_type: described.data_type,
                access: described.access,
                default: described.default.clone(),
                low: described.low.clone(),
                high: described.high.clone(),
                pdo: described.pdo,
            });
        }
    }
}

/// Returns the form of a name that is compared: in lower case, with single blanks.
fn folded(name: &str) -> String {
    name.split_whitespace().collect::<Vec<_>>().join(" ").to_lowercase()
}

/// Returns the hyphenated forms of a name in an EDS: `Position Value:1` is `position-value:1` or `position-value-1`.
pub fn spellings(name: &str) -> Vec<String> {
    let with_sub = name.rsplit_once(':').filter(|(_, sub)| sub.parse::<u8>().is_ok());
    let with_sub = with_sub.map(|(name, sub)| format!("{}:{sub}", slug(name)));
    with_sub.into_iter().chain([slug(name)]).filter(|name| !name.is_empty()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Creates a dictionary with one run of INTEGER16 objects.
    fn dictionary(at: &str, name: &str) -> Dictionary {
        let mut dictionary = Dictionary::new();
        let run: crate::device::description::ObjectRun = at.parse().expect("a run");
        for object in run.objects() {
            dictionary.insert(Entry {
                object,
                name: name.to_owned(),
                numbered: run.is_run,
                data_type: DataType::Integer(2),
                access: Access::Ro,
                default: None,
                low: None,
                high: None,
                pdo: true,
            });
        }
        dictionary
    }

    #[test]
    fn objects_of_a_run_have_numbered_names() {
        let dictionary = dictionary("0x6130:1-16", "ai-input-pv");
        assert_eq!(dictionary.iter().count(), 16);
        assert_eq!(dictionary.find("AI-input-pv:16").map(|entry| entry.object), Some(ObjectId::new(0x6130, 16)));
        assert_eq!(dictionary.find("ai-input-pv"), None);
    }

    #[test]
    fn full_names_have_priority_over_aliases() {
        let mut dictionary = dictionary("0x2000:1-2", "überdruck");
        dictionary.insert_alias("vent".to_owned(), ObjectId::new(0x2000, 2));
        dictionary.insert_alias("überdruck:1".to_owned(), ObjectId::new(0x2000, 2));
        dictionary.insert_alias("gone".to_owned(), ObjectId::new(0x2001, 0));
        let find = |name: &str| dictionary.find(name).map(|entry| entry.object.sub);
        assert_eq!(find("Vent"), Some(2));
        assert_eq!(find("ÜBERDRUCK:1"), Some(1));
        assert_eq!(find("gone"), None);
        assert_eq!(find("\u{dc}berDruck :2"), Some(2));
        assert_eq!(find("VENT !"), Some(2));
    }
}
