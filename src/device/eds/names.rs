//! Names of the objects in an EDS file.
//!
//! A name is the `ParameterName` in lower case, with one hyphen for all characters between letters and digits:
//! "Producer Heartbeat Time" is `producer-heartbeat-time`. Rules:
//!
//! - An object without sub-objects has its own name.
//! - An element of an array is `object:1`, as in device descriptions: `ai-input-pv:1`.
//! - A member of a record has its own name if that is unique in the file (`vendor-id`), else `object:1`
//!   (`tpdo-1-parameter:1`; every PDO has a "COB-ID"). Sub-index 0, the count, is always `object:0`.
//! - The index is appended to a name that two objects have, or that reads as an address ("6130"): `reserved-2005`.
//! - A sub-object has a second name if that is unique: `identity-object:1`, and `ai-input-pv-1` in an array. An object
//!   with a user's name in a DCF (`Denotation`) also has a second name.
//!
//! - The spelling of the file is a name too if it is unique: [`Dictionary::insert_spelling`].
//!
//! No two entries have the same name, and [`Dictionary::find`] finds each by its [`Entry::full_name`].

use crate::canopen::object::ObjectId;
use crate::device::dictionary::{Dictionary, Entry};
use std::collections::{BTreeMap, HashMap, HashSet};

/// Longest name in characters, as for `ParameterName` in CiA 306.
const LONGEST: usize = 241;

/// An entry without its final name.
#[derive(Clone, Debug)]
pub(super) struct Described {
    /// The entry; its name is the sub-object's own name in the file, or empty.
    pub(super) entry: Entry,
    /// The kind of its object.
    pub(super) kind: Kind,
    /// The name that the user gave the object (`Denotation`).
    pub(super) denotation: Option<String>,
}

/// The kind of an object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    /// Without sub-objects.
    Variable,
    /// With equal elements.
    Array,
    /// With members of different kinds.
    Record,
}

/// Gives each entry its final name. `objects` contains the names of the objects in the file.
pub(super) fn dictionary(objects: &BTreeMap<u16, String>, described: Vec<Described>) -> Dictionary {
    let titles = objects;
    let subs = described.iter().map(|described| described.entry.object).filter(|object| object.sub > 0);
    let with_subs: HashSet<u16> = subs.map(|object| object.index).collect();
    let slugs: BTreeMap<u16, String> = objects.iter().map(|(index, name)| (*index, slug(name))).collect();
    let objects = object_names(&slugs);
    let mut taken: HashSet<String> = slugs.into_values().chain(objects.values().cloned()).collect();
    let own = count(described.iter().filter(|described| has_own_name(described)).map(|one| one.entry.name.as_str()));
    let users = count(described.iter().filter_map(|one| one.denotation.as_deref()));

    let mut dictionary = Dictionary::new();
    let mut denotations = Vec::new();
    for described in described {
        let Described { mut entry, kind, denotation } = described;
        let object = entry.object;
        let own_name = Some(slug(&entry.name)).filter(|_| kind != Kind::Variable && object.sub > 0);
        let own_name = own_name.filter(|name| own.get(name) == Some(&1) && is_free(name, &taken));
        let parent = objects.get(&object.index).cloned().unwrap_or_else(|| nameless(object.index));
        let mut alias = None;
        dictionary.insert_spelling(&entry.name, object);
        if let Some(title) = titles.get(&object.index).filter(|_| object.sub > 0 || !with_subs.contains(&object.index))
        {
            dictionary.insert_spelling(title, object);
        }
        match (kind, own_name) {
            (Kind::Variable, _) => (entry.name, entry.numbered) = (parent, false),
            (Kind::Record, Some(name)) => {
                alias = Some(format!("{parent}:{}", object.sub));
                (entry.name, entry.numbered) = (name, false);
            }
            (_, own_name) => {
                alias = own_name;
                (entry.name, entry.numbered) = (parent, true);
            }
        }
        if let Some(alias) = alias {
            dictionary.insert_alias(alias, object);
        }
        denotations.extend(denotation.map(|name| (slug(&name), object)));
        dictionary.insert(entry);
    }
    taken.extend(own.into_keys());
    for (name, object) in denotations {
        if users.get(&name) == Some(&1) && is_free(&name, &taken) {
            dictionary.insert_alias(name, object);
        }
    }
    dictionary
}

fn has_own_name(described: &Described) -> bool {
    described.kind != Kind::Variable && described.entry.object.sub > 0
}

fn count<'a>(names: impl Iterator<Item = &'a str>) -> HashMap<String, u32> {
    let mut counts: HashMap<String, u32> = HashMap::new();
    for name in names {
        let times = counts.entry(slug(name)).or_default();
        *times = times.saturating_add(1);
    }
    counts
}

/// Whether a sub-object can have this name: it is not empty, no object has it, and it does not read as an address.
fn is_free(name: &str, taken: &HashSet<String>) -> bool {
    !name.is_empty() && !taken.contains(name) && !ObjectId::looks_like_address(name)
}

/// Returns a unique name for every object: its own name, with the index appended if necessary.
fn object_names(slugs: &BTreeMap<u16, String>) -> BTreeMap<u16, String> {
    let counts = count(slugs.values().map(String::as_str));
    let mut names = BTreeMap::new();
    for (index, slug) in slugs {
        let nameless = slug.is_empty();
        let mut name = if nameless { self::nameless(*index) } else { slug.clone() };
        let others = counts.get(&name).copied().unwrap_or_default().saturating_sub(u32::from(!nameless));
        let mut clashes = others > 0 || ObjectId::looks_like_address(&name);
        // Only a name in the file that already ends with this index can clash again.
        while clashes {
            name = format!("{name}-{index:04x}");
            clashes = counts.contains_key(&name);
        }
        names.insert(*index, name);
    }
    names
}

fn nameless(index: u16) -> String {
    format!("object-{index:04x}")
}

/// Converts a name of a file to lower case with hyphens.
pub(in crate::device) fn slug(name: &str) -> String {
    let mut slug = String::new();
    let mut gap = false;
    for character in name.chars().flat_map(char::to_lowercase).take(LONGEST) {
        if character.is_alphanumeric() {
            if gap && !slug.is_empty() {
                slug.push('-');
            }
            gap = false;
            slug.push(character);
        } else {
            gap = true;
        }
    }
    slug
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::canopen::value::DataType;
    use crate::device::description::Access;

    fn described(index: u16, sub: u8, kind: Kind, name: &str) -> Described {
        let entry = Entry {
            object: ObjectId::new(index, sub),
            name: name.to_owned(),
            numbered: false,
            data_type: DataType::Unsigned(1),
            access: Access::Rw,
            default: None,
            low: None,
            high: None,
            pdo: false,
        };
        Described { entry, kind, denotation: None }
    }

    fn names(objects: &[(u16, &str)], described: Vec<Described>) -> (Dictionary, Vec<String>) {
        let objects = objects.iter().map(|(index, name)| (*index, (*name).to_owned())).collect();
        let dictionary = dictionary(&objects, described);
        let names = dictionary.iter().map(Entry::full_name).collect();
        (dictionary, names)
    }

    #[test]
    fn slugs() {
        for (name, expected) in [
            ("Producer Heartbeat Time", "producer-heartbeat-time"),
            ("AI Input PV_1", "ai-input-pv-1"),
            ("  1st - (max.) value; [bar]  ", "1st-max-value-bar"),
            ("Überdruck °C", "überdruck-c"),
            ("COB-ID SYNC", "cob-id-sync"),
            ("---", ""),
            ("", ""),
        ] {
            assert_eq!(slug(name), expected, "{name}");
        }
        assert_eq!(slug(&"x".repeat(1000)).len(), LONGEST);
    }

    #[test]
    fn records_arrays_and_variables() {
        let (dictionary, names) = names(
            &[(0x1000, "Device type"), (0x1018, "Identity object"), (0x6130, "AI Input PV")],
            vec![
                described(0x1000, 0, Kind::Variable, ""),
                described(0x1018, 0, Kind::Record, "Highest sub-index supported"),
                described(0x1018, 1, Kind::Record, "Vendor-ID"),
                described(0x6130, 0, Kind::Array, "Highest sub-index"),
                described(0x6130, 1, Kind::Array, "AI Input PV_1"),
            ],
        );
        assert_eq!(names, ["device-type", "identity-object:0", "vendor-id", "ai-input-pv:0", "ai-input-pv:1"]);
        let find = |name: &str| dictionary.find(name).map(|entry| entry.object);
        assert_eq!(find("identity-object:1"), Some(ObjectId::new(0x1018, 1)));
        assert_eq!(find("AI-Input-PV-1"), Some(ObjectId::new(0x6130, 1)));
        assert_eq!(find("highest-sub-index"), None);
        assert_eq!(find("ai-input-pv"), None);
    }

    #[test]
    fn ambiguous_names_get_the_index() {
        let (dictionary, names) = names(
            &[
                (0x1800, "TPDO parameter"),
                (0x1801, "TPDO parameter"),
                (0x2000, "Limit"),
                (0x2001, "6130"),
                (0x2002, ""),
            ],
            vec![
                described(0x1800, 1, Kind::Record, "COB-ID"),
                described(0x1800, 2, Kind::Record, "Type"),
                described(0x1801, 1, Kind::Record, "COB-ID"),
                described(0x2000, 0, Kind::Variable, ""),
                described(0x2001, 1, Kind::Record, "Limit"),
                described(0x2001, 2, Kind::Record, "1A00"),
                described(0x2002, 0, Kind::Variable, ""),
            ],
        );
        assert_eq!(
            names,
            [
                "tpdo-parameter-1800:1",
                "type",
                "tpdo-parameter-1801:1",
                "limit",
                "6130-2001:1",
                "6130-2001:2",
                "object-2002"
            ]
        );
        assert_eq!(dictionary.find("cob-id"), None);
        assert_eq!(dictionary.find("limit").map(|entry| entry.object), Some(ObjectId::new(0x2000, 0)));
    }

    #[test]
    fn names_that_already_end_with_an_index() {
        let objects = [
            (0x2005, "Reserved"),
            (0x2006, "Reserved"),
            (0x2007, "Reserved 2005"),
            (0x2008, ""),
            (0x2009, "object-2008"),
        ];
        let described = objects.iter().map(|(index, _)| described(*index, 0, Kind::Variable, "")).collect();
        let (_, names) = names(&objects, described);
        assert_eq!(names, ["reserved-2005-2005", "reserved-2006", "reserved-2005", "object-2008-2008", "object-2008"]);
    }

    #[test]
    fn user_names_in_a_dcf() {
        let mut level = described(0x2000, 0, Kind::Variable, "");
        level.denotation = Some("Tank 5".to_owned());
        let mut other = described(0x2001, 0, Kind::Variable, "");
        other.denotation = Some("Level".to_owned());
        let (dictionary, names) = names(&[(0x2000, "Level"), (0x2001, "Volume")], vec![level, other]);
        assert_eq!(names, ["level", "volume"]);
        assert_eq!(dictionary.find("tank-5").map(|entry| entry.object), Some(ObjectId::new(0x2000, 0)));
        assert_eq!(dictionary.find("level").map(|entry| entry.object), Some(ObjectId::new(0x2000, 0)));
    }
}
