//! Finds the sections of each object: `[1018]`, `[1018sub1]`, `[6130Name]`, `[6130Value]`, `[6130Denotation]`.

use super::ini::{Ini, Section};
use super::text::quoted;
use super::{Warning, value};
use std::collections::BTreeMap;

/// Lower indices define data types; they are not objects of a device.
const FIRST_INDEX: u16 = 0x1000;

/// The sections of one object.
#[derive(Default)]
pub(super) struct Parts<'a> {
    /// The section of the object itself.
    pub(super) main: Option<&'a Section>,
    /// The sections of its sub-objects.
    pub(super) subs: BTreeMap<u8, &'a Section>,
    /// The list of element names.
    pub(super) names: Option<&'a Section>,
    /// The list of element values.
    pub(super) values: Option<&'a Section>,
    /// The list of the user's names for elements.
    pub(super) denotations: Option<&'a Section>,
}

impl<'a> Parts<'a> {
    /// The section of the object or of its first sub-object; without these, the first list.
    pub(super) fn first(&self) -> Option<&'a Section> {
        let described = self.main.or_else(|| self.subs.values().min_by_key(|sub| sub.line).copied());
        described.or(self.names).or(self.values).or(self.denotations)
    }
}

enum Role {
    Object(u16),
    Sub(u16, u8),
    Names(u16),
    Values(u16),
    Denotations(u16),
    /// A malformed section of an object.
    Broken,
    Other,
}

/// Finds the objects of a file with their sections; unlisted objects are included.
pub(super) fn objects<'a>(ini: &'a Ini, warnings: &mut Vec<Warning>) -> BTreeMap<u16, Parts<'a>> {
    let mut objects: BTreeMap<u16, Parts> = BTreeMap::new();
    for section in &ini.sections {
        match role(&section.name) {
            Role::Object(index) => objects.entry(index).or_default().main = Some(section),
            Role::Names(index) => objects.entry(index).or_default().names = Some(section),
            Role::Values(index) => objects.entry(index).or_default().values = Some(section),
            Role::Denotations(index) => objects.entry(index).or_default().denotations = Some(section),
            Role::Sub(index, sub) => {
                // [1018sub1] and [1018sub01] are the same sub-object but different sections.
                let first = *objects.entry(index).or_default().subs.entry(sub).or_insert(section);
                if first.line != section.line {
                    let text =
                        format!("[{}] is [{}] of line {} again and is ignored", section.shown, first.shown, first.line);
                    warnings.push(Warning::new(section.line, text));
                }
            }
            Role::Broken => {
                let text = format!("[{}] is neither an object nor a sub-object and is ignored", section.shown);
                warnings.push(Warning::new(section.line, text));
            }
            Role::Other => {}
        }
    }
    let objects = objects.split_off(&FIRST_INDEX);
    check_lists(ini, &objects, warnings);
    objects
}

fn role(name: &str) -> Role {
    if let Some(index) = name.strip_suffix("denotation").and_then(four_digits) {
        return Role::Denotations(index);
    }
    let name = name.strip_prefix("0x").unwrap_or(name);
    let digits = name.bytes().take_while(u8::is_ascii_hexdigit).count();
    let (index, rest) = name.split_at(digits);
    let Some(index) = four_digits(index) else {
        let too_long = digits > 4 && (rest.is_empty() || rest.starts_with("sub"));
        return if too_long { Role::Broken } else { Role::Other };
    };
    match (rest, rest.strip_prefix("sub")) {
        ("", _) => Role::Object(index),
        ("name", _) => Role::Names(index),
        ("value", _) => Role::Values(index),
        (_, Some(sub)) if sub.bytes().all(|digit| digit.is_ascii_hexdigit()) => {
            u8::from_str_radix(sub, 16).map_or(Role::Broken, |sub| Role::Sub(index, sub))
        }
        (_, Some(_)) => Role::Broken,
        _ => Role::Other,
    }
}

fn four_digits(index: &str) -> Option<u16> {
    let is_index = index.len() == 4 && index.bytes().all(|digit| digit.is_ascii_hexdigit());
    is_index.then(|| u16::from_str_radix(index, 16).ok()).flatten()
}

/// Warns about objects that are listed but not described, or described but not listed.
fn check_lists(ini: &Ini, objects: &BTreeMap<u16, Parts>, warnings: &mut Vec<Warning>) {
    let mut listed: BTreeMap<u16, usize> = BTreeMap::new();
    for section in
        ["mandatoryobjects", "optionalobjects", "manufacturerobjects"].iter().filter_map(|name| ini.section(name))
    {
        for (_, item) in section.numbered() {
            match value::integer(&item.value).and_then(|index| u16::try_from(index.value).ok()) {
                Some(index) => {
                    listed.entry(index).or_insert(item.line);
                }
                None => {
                    let text = format!("[{}] lists {}, which is not an index", section.shown, quoted(&item.value));
                    warnings.push(Warning::new(item.line, text));
                }
            }
        }
    }
    for (index, line) in listed.range(FIRST_INDEX..).filter(|(index, _)| !objects.contains_key(index)) {
        warnings.push(Warning::new(*line, format!("object {index:04X}h is listed, but not described")));
    }
    let unlisted = objects.iter().filter(|(index, _)| !listed.contains_key(index));
    let mut unlisted = unlisted.filter_map(|(index, parts)| Some((*index, parts.main?.line)));
    if listed.is_empty() {
        warnings.extend(unlisted.next().map(|(_, line)| {
            Warning::new(line, "the file has no list of its objects; all that are described are used")
        }));
    } else {
        warnings.extend(unlisted.map(|(index, line)| {
            Warning::new(line, format!("object {index:04X}h is described, but not listed; it is used"))
        }));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_sections() {
        let text = |name: &str| match role(name) {
            Role::Object(index) => format!("{index:x}"),
            Role::Sub(index, sub) => format!("{index:x}:{sub}"),
            Role::Names(index) => format!("{index:x} names"),
            Role::Values(index) => format!("{index:x} values"),
            Role::Denotations(index) => format!("{index:x} denotations"),
            Role::Broken => "broken".to_owned(),
            Role::Other => String::new(),
        };
        for (name, expected) in [
            ("1018", "1018"),
            ("60fe", "60fe"),
            ("1018sub1", "1018:1"),
            ("0x1018", "1018"),
            ("0x1018sub1", "1018:1"),
            ("1a00sub0a", "1a00:10"),
            ("1a00subff", "1a00:255"),
            ("1f80name", "1f80 names"),
            ("1f80value", "1f80 values"),
            ("60fedenotation", "60fe denotations"),
            ("1018sub", "broken"),
            ("1018sub100", "broken"),
            ("1018sub+1", "broken"),
            ("1018subx", "broken"),
            ("10180", "broken"),
            ("10180sub1", "broken"),
            ("1018objectlinks", ""),
            ("deviceinfo", ""),
            ("dummyusage", ""),
            ("a0", ""),
            ("+101", ""),
            ("", ""),
            ("\u{e4}\u{e4}", ""),
        ] {
            assert_eq!(text(name), expected, "{name}");
        }
    }
}
