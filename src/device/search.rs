//! Finds objects of a description or an EDS by address, name, or words of their meaning.

use super::catalog::Model;
use super::dictionary::Entry;
use crate::canopen::object::ObjectId;

impl Model {
    /// Finds the objects that match `query`, in ascending order. `query` is an address (`6130:1`), an index (`6130`), a
    /// name, a name that several objects share, or a word in the name, the meaning or the values. Letter case is
    /// ignored.
    pub fn search(&self, query: &str) -> Vec<&Entry> {
        let query = query.trim();
        if let Ok(object) = query.parse::<ObjectId>() {
            let has_no_sub = !query.contains([':', '.']);
            let fits = |entry: &&Entry| entry.object == object || has_no_sub && entry.object.index == object.index;
            let found: Vec<&Entry> = self.dictionary.iter().filter(fits).collect();
            if !found.is_empty() {
                return found;
            }
        }
        if let Some(entry) = self.dictionary.find(query) {
            return vec![entry];
        }
        let shared = self.dictionary.namesakes(query);
        if !shared.is_empty() {
            return shared.iter().filter_map(|name| self.dictionary.find(name)).collect();
        }
        let word = query.to_lowercase();
        self.dictionary.iter().filter(|entry| !word.is_empty() && self.mentions(entry, &word)).collect()
    }

    fn mentions(&self, entry: &Entry, word: &str) -> bool {
        let has = |text: &str| text.to_lowercase().contains(word);
        let described = self.description.object(entry.object);
        let has_text =
            described.is_some_and(|described| has(&described.text) || described.values.values().any(|it| has(it)));
        has(&entry.full_name()) || has_text
    }
}

#[cfg(test)]
mod tests {
    use crate::device::catalog::by_name;
    use crate::device::dictionary::Entry;

    #[test]
    fn objects_are_found_by_address_name_and_word() {
        let model = by_name("mh4").expect("built in");
        let found = |query: &str| model.search(query).into_iter().map(Entry::full_name).collect::<Vec<_>>();
        assert_eq!(found("1018:1"), ["vendor-id"]);
        assert_eq!(found("0x6130"), ["ai-input-pv-entries", "ai-input-pv:1", "ai-input-pv:2"]);
        assert_eq!(found("Vendor-ID"), ["vendor-id"]);
        assert_eq!(found("Pressure Transducer"), ["ai-sensor-type:1", "ai-sensor-type:2"]);
        assert!(found("cob-id").len() > 3);
        assert_eq!((found("6130:9").len(), found("no-such-thing").len(), found(" ").len()), (0, 0, 0));
    }
}
