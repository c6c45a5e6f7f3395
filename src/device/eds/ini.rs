//! The syntax of an EDS file (CiA 306, clause 4): sections, keys, values, comments, each with its line.
//!
//! CiA 306 has no escapes, no quotes and no comments after a value: everything after the first `=` is the value. Letter
//! case and blanks in names are ignored: `[1018 Sub 1]`, `Supported Objects`.
//!
//! If a key or section occurs twice, the first one is used; a second section only adds missing keys. Other tools
//! differ: the INI function of Windows uses the first, CANchkEDS the last. The warning contains both lines.

use super::Warning;
use super::text::{quoted, shown};
use std::collections::HashMap;

/// The value of a key.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Item {
    /// The line, counted from 1.
    pub(super) line: usize,
    /// Everything after the `=`, without blanks around it.
    pub(super) value: String,
}

/// A section and its keys.
#[derive(Clone, Debug)]
pub(super) struct Section {
    /// The name as in the file, shortened and safe for messages.
    pub(super) shown: String,
    /// The name in lower case and without blanks.
    pub(super) name: String,
    /// The line of its header, counted from 1.
    pub(super) line: usize,
    items: HashMap<String, Item>,
}

impl Section {
    /// Returns the value of a key; `None` if it is missing or empty. `key` must be in lower case and without blanks.
    pub(super) fn get(&self, key: &str) -> Option<&Item> {
        self.items.get(key).filter(|item| !item.value.is_empty())
    }

    /// The keys that are numbers (in lists: `1=0x1000`), in ascending order.
    pub(super) fn numbered(&self) -> Vec<(u32, &Item)> {
        let mut list: Vec<(u32, &Item)> = self
            .items
            .iter()
            .filter(|(_, item)| !item.value.is_empty())
            .filter_map(|(key, item)| Some((crate::canopen::id::parse_u32(key)?, item)))
            .collect();
        list.sort_by_key(|(number, item)| (*number, item.line));
        list
    }
}

/// A file as a list of sections.
#[derive(Clone, Debug, Default)]
pub(super) struct Ini {
    /// In the order of the file.
    pub(super) sections: Vec<Section>,
    /// The number of lines of the file.
    pub(super) lines: usize,
    places: HashMap<String, usize>,
}

impl Ini {
    /// Reads the sections and keys; other lines give warnings.
    pub(super) fn read(text: &str, warnings: &mut Vec<Warning>) -> Ini {
        let mut ini = Ini::default();
        let mut place = None;
        let mut repeated = false;
        for (line, content) in (1..).zip(text.lines()) {
            ini.lines = line;
            let content = content.trim();
            if content.is_empty() || is_comment(content) {
                continue;
            }
            if let Some(header) = content.strip_prefix('[') {
                let (at, again) = ini.open(header, line, warnings);
                place = Some(at);
                repeated = again;
                continue;
            }
            let Some(section) = place.and_then(|at: usize| ini.sections.get_mut(at)) else {
                warnings.push(Warning::new(line, format!("{} is before the first section", quoted(content))));
                continue;
            };
            match content.split_once('=') {
                Some((key, value)) if !key.trim().is_empty() => {
                    let value = value.trim();
                    let first =
                        section.items.entry(fold(key)).or_insert_with(|| Item { line, value: value.to_owned() });
                    if first.line != line && first.value != value && !repeated {
                        let text = format!(
                            "[{}] has {} twice; line {} is used",
                            section.shown,
                            quoted(key.trim()),
                            first.line
                        );
                        warnings.push(Warning::new(line, text));
                    }
                }
                _ if is_prose(&section.name) => {}
                _ => warnings.push(Warning::new(
                    line,
                    format!("{} is not a section, a key with a value or a comment", quoted(content)),
                )),
            }
        }
        ini
    }

    /// Opens the section of a header line. Returns its position, and whether it existed before.
    fn open(&mut self, header: &str, line: usize, warnings: &mut Vec<Warning>) -> (usize, bool) {
        let (name, rest) = header.split_once(']').unwrap_or_else(|| {
            warnings.push(Warning::new(line, format!("the section {} has no closing bracket", quoted(header))));
            (header, "")
        });
        let rest = rest.trim();
        if !rest.is_empty() && !is_comment(rest) {
            warnings.push(Warning::new(line, format!("{} after a section is ignored", quoted(rest))));
        }
        let shown = shown(name.trim());
        let name = fold(name);
        if let Some((at, first)) = self.places.get(&name).and_then(|at| Some((*at, self.sections.get(*at)?))) {
            let text = format!("[{shown}] occurs twice; [{}] in line {} has priority", first.shown, first.line);
            warnings.push(Warning::new(line, text));
            return (at, true);
        }
        let at = self.sections.len();
        self.sections.push(Section { shown, name: name.clone(), line, items: HashMap::new() });
        self.places.insert(name, at);
        (at, false)
    }

    /// Returns the section with this name. `name` must be in lower case and without blanks.
    pub(super) fn section(&self, name: &str) -> Option<&Section> {
        self.sections.get(*self.places.get(name)?)
    }
}

/// Returns the form of a name that is compared: lower case, without blanks.
pub(super) fn fold(name: &str) -> String {
    name.chars().filter(|character| !character.is_whitespace()).flat_map(char::to_lowercase).collect()
}

/// CiA 306 has only `;`, but real files also use `#` and `//`.
fn is_comment(text: &str) -> bool {
    text.starts_with([';', '#']) || text.starts_with("//")
}

/// Whether a section contains free text. Its lines cause no warnings.
fn is_prose(section: &str) -> bool {
    matches!(section, "fileinfo" | "comments")
}

/// Removes the comment after a value; `None` if there is no comment. Inside a word, `#` is no comment: `16#180`,
/// `1.#QNAN`.
pub(super) fn without_comment(value: &str) -> Option<&str> {
    let hash = value.char_indices().filter(|&(at, mark)| mark == '#' && !value[..at].ends_with(is_part_of_word));
    let hash = hash.map(|(at, _)| at).next();
    let end = [";", "//"].iter().filter_map(|mark| value.find(mark)).chain(hash).min()?;
    Some(value[..end].trim_end())
}

fn is_part_of_word(character: char) -> bool {
    character.is_alphanumeric() || character == '.'
}

#[cfg(test)]
mod tests {
    use super::*;

    fn read(text: &str) -> (Ini, Vec<String>) {
        let mut warnings = Vec::new();
        let ini = Ini::read(text, &mut warnings);
        (ini, warnings.iter().map(ToString::to_string).collect())
    }

    fn value<'a>(ini: &'a Ini, section: &str, key: &str) -> Option<(usize, &'a str)> {
        ini.section(section)?.get(key).map(|item| (item.line, item.value.as_str()))
    }

    #[test]
    fn sections_keys_and_lines() {
        let (ini, warnings) =
            read("; a comment\n\n [ 1018 Sub1 ] ; two\n\t Parameter Name =  a;b = c \nEmpty=\n#x=1\n//y\n");
        assert_eq!(warnings, [""; 0]);
        assert_eq!(ini.lines, 7);
        assert_eq!(value(&ini, "1018sub1", "parametername"), Some((4, "a;b = c")));
        assert_eq!(value(&ini, "1018sub1", "empty"), None);
        assert_eq!(ini.sections[0].line, 3);
    }

    #[test]
    fn the_first_of_two_equal_keys_is_used() {
        let (ini, warnings) = read("[A]\nx=1\nX=2\nx=1\n[B]\ny=1\n[ a ]\nx=3\nz=4\n");
        assert_eq!(value(&ini, "a", "x"), Some((2, "1")));
        assert_eq!(value(&ini, "a", "z"), Some((9, "4")));
        assert_eq!(
            warnings,
            ["line 3: [A] has \"X\" twice; line 2 is used", "line 7: [a] occurs twice; [A] in line 1 has priority"]
        );
    }

    #[test]
    fn malformed_lines_give_warnings() {
        let (ini, warnings) =
            read("x=1\n[FileInfo]\nrubbish\n[1000\nrubbish\n=5\nx=2\n[1001]x\n[]\n[Comments]\nrubbish");
        assert_eq!(
            warnings,
            [
                "line 1: \"x=1\" is before the first section",
                "line 4: the section \"1000\" has no closing bracket",
                "line 5: \"rubbish\" is not a section, a key with a value or a comment",
                "line 6: \"=5\" is not a section, a key with a value or a comment",
                "line 8: \"x\" after a section is ignored",
            ]
        );
        assert_eq!(value(&ini, "1000", "x"), Some((7, "2")));
    }

    #[test]
    fn lists_are_sorted_by_number() {
        let (ini, _) = read("[Optional Objects]\nSupported Objects=3\n10=0x1A00\n2= 0x1003\n0x3=0x1004\n4=\n");
        let list = ini.section("optionalobjects").map(|section| {
            section.numbered().into_iter().map(|(number, item)| (number, item.value.clone())).collect::<Vec<_>>()
        });
        let expected = [(2, "0x1003"), (3, "0x1004"), (10, "0x1A00")];
        assert_eq!(list, Some(expected.map(|(number, value)| (number, value.to_owned())).to_vec()));
    }

    #[test]
    fn comments_behind_values() {
        assert_eq!(without_comment("0x7 ; VAR"), Some("0x7"));
        assert_eq!(without_comment("5 // five # 5"), Some("5"));
        assert_eq!(without_comment("; nothing"), Some(""));
        assert_eq!(without_comment("10 # ten"), Some("10"));
        assert_eq!(without_comment("# ten"), Some(""));
        for word in ["P1", "16#180", "1.#QNAN"] {
            assert_eq!(without_comment(word), None, "{word}");
        }
    }
}
