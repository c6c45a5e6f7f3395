//! An object dictionary as a description or an EDS file tells it: names, types, access, limits, defaults.

use super::description::{Access, ObjectEntry, Scalar};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, ValueError};
use std::collections::BTreeMap;

/// One entry of the object dictionary.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    /// Where it stands.
    pub object: ObjectId,
    /// In lower case with hyphens, without the sub-index of a run: `ai-input-pv`.
    pub name: String,
    /// Whether the name stands for several sub-indices, so that `name:1` is needed to tell them apart.
    pub numbered: bool,
    /// Its data type.
    pub data_type: DataType,
    /// Access by SDO.
    pub access: Access,
    /// As delivered.
    pub default: Option<Scalar>,
    /// Lowest value allowed.
    pub low: Option<Scalar>,
    /// Highest value allowed.
    pub high: Option<Scalar>,
    /// Whether a TPDO may carry it.
    pub pdo: bool,
}

impl Entry {
    /// The name that finds this entry and no other: `vendor-id`, `ai-input-pv:1`.
    pub fn full_name(&self) -> String {
        if self.numbered { format!("{}:{}", self.name, self.object.sub) } else { self.name.clone() }
    }

    /// The default in wire order, with `node` put in for `$NODEID`; `None` when no default is known.
    pub fn default_bytes(&self, node: NodeId) -> Option<Vec<u8>> {
        self.default.as_ref()?.encode(self.data_type, node).ok()
    }
}

impl Scalar {
    /// The bytes of this value in `data_type`, with `node` put in for `$NODEID`.
    ///
    /// # Errors
    /// Text that is no value of the type, and numbers that it cannot hold.
    pub fn encode(&self, data_type: DataType, node: NodeId) -> Result<Vec<u8>, ValueError> {
        match self {
            Scalar::Integer(number) => data_type.encode_text(&number.to_string()),
            Scalar::Real(number) => data_type.encode_text(&number.to_string()),
            Scalar::Text(text) => match node_formula(text, node) {
                Some(number) => data_type.encode_text(&number.to_string()),
                None => data_type.encode_text(text),
            },
        }
    }
}

/// `$NODEID+0x180`, with the node-ID on either side (CiA 306 wants it first, real files do not care).
fn node_formula(text: &str, node: NodeId) -> Option<u32> {
    let folded = text.to_ascii_uppercase().replace(' ', "");
    if folded == "$NODEID" {
        return Some(u32::from(node.get()));
    }
    let number = folded.strip_prefix("$NODEID+").or_else(|| folded.strip_suffix("+$NODEID"))?;
    crate::canopen::id::parse_u32(&number.replace("0X", "0x"))?.checked_add(u32::from(node.get()))
}

/// Everything a description or EDS file says about the objects of a device.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Dictionary {
    entries: BTreeMap<ObjectId, Entry>,
    aliases: BTreeMap<String, ObjectId>,
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

    /// Lets an entry be found under a second name, in lower case; full names go before.
    pub fn insert_alias(&mut self, name: String, object: ObjectId) {
        self.aliases.insert(name, object);
    }

    /// The entry at `object`.
    pub fn get(&self, object: ObjectId) -> Option<&Entry> {
        self.entries.get(&object)
    }

    /// Every entry in ascending order.
    pub fn iter(&self) -> impl Iterator<Item = &Entry> {
        self.entries.values()
    }

    /// Whether nothing is known.
    pub fn is_empty(&self) -> bool {
        self.entries.is_empty()
    }

    /// Whether any sub-index of `index` is known.
    pub fn has_index(&self, index: u16) -> bool {
        self.entries.range(ObjectId::new(index, 0)..=ObjectId::new(index, 255)).next().is_some()
    }

    /// The entry of a name: `vendor-id`, `ai-input-pv:1`. Letter case does not count.
    pub fn find(&self, name: &str) -> Option<&Entry> {
        let name = name.to_lowercase();
        let alias = || self.get(*self.aliases.get(&name)?);
        self.iter().find(|entry| entry.full_name() == name).or_else(alias)
    }

    /// Adds an entry of a device description, every sub-index of a run.
    ///
    /// # Errors
    /// An address that is none, in words.
    pub fn insert_described(&mut self, described: &ObjectEntry) -> Result<(), String> {
        for object in described.objects()? {
            self.insert(Entry {
                object,
                name: described.name.clone(),
                numbered: described.is_run(),
                data_type: described.data_type,
                access: described.access,
                default: described.default.clone(),
                low: described.low.clone(),
                high: described.high.clone(),
                pdo: described.pdo,
            });
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn node() -> NodeId {
        NodeId::new(5).expect("a node-ID")
    }

    #[test]
    fn node_id_formulas() {
        for text in ["$NODEID+0x180", "0x180+$NODEID", "$nodeid + 384", "384 + $NODEID"] {
            assert_eq!(node_formula(text, node()), Some(0x185), "{text}");
        }
        assert_eq!(node_formula("$NODEID", node()), Some(5));
        assert_eq!(node_formula("MH-4-CAN", node()), None);
        assert_eq!(node_formula("$NODEID+x", node()), None);
    }

    #[test]
    fn runs_have_numbered_names() {
        let described: ObjectEntry = toml::from_str(
            "at = \"0x6130:1-16\"\nname = \"ai-input-pv\"\ntype = \"i16\"\naccess = \"ro\"\ndefault = 0\npdo = true",
        )
        .expect("an entry");
        let mut dictionary = Dictionary::new();
        dictionary.insert_described(&described).expect("a run");
        assert_eq!(dictionary.iter().count(), 16);
        assert_eq!(dictionary.find("AI-input-pv:16").map(|entry| entry.object), Some(ObjectId::new(0x6130, 16)));
        assert_eq!(dictionary.find("ai-input-pv"), None);
    }

    #[test]
    fn full_names_go_before_aliases() {
        let described: ObjectEntry =
            toml::from_str("at = \"0x2000:1-2\"\nname = \"überdruck\"\ntype = \"i16\"\naccess = \"ro\"")
                .expect("an entry");
        let mut dictionary = Dictionary::new();
        dictionary.insert_described(&described).expect("a run");
        dictionary.insert_alias("vent".to_owned(), ObjectId::new(0x2000, 2));
        dictionary.insert_alias("überdruck:1".to_owned(), ObjectId::new(0x2000, 2));
        dictionary.insert_alias("gone".to_owned(), ObjectId::new(0x2001, 0));
        let find = |name: &str| dictionary.find(name).map(|entry| entry.object.sub);
        assert_eq!(find("Vent"), Some(2));
        assert_eq!(find("ÜBERDRUCK:1"), Some(1));
        assert_eq!(find("gone"), None);
    }
}
