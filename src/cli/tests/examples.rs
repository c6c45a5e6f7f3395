//! The examples of the help and of the README. `tests/cli` uses this file too, to run them.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

fn folder() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

pub(crate) fn readme() -> String {
    fs::read_to_string(folder().join("README.md")).expect("the README")
}

/// The examples of the help texts, from the manual pages, which contain every help text.
fn helps() -> String {
    let pages = fs::read_dir(folder().join("man")).expect("the folder").map(|entry| entry.expect("an entry").path());
    let pages = pages.filter(|page| page.extension().is_some_and(|section| section == "1"));
    let texts = pages.map(|page| {
        let page = fs::read_to_string(page).expect("a page");
        let examples = page.split(".SH \"EXAMPLES\"\n").nth(1).and_then(|rest| rest.split(".fi\n").next());
        examples.unwrap_or_default().replace("\\-", "-").replace("\\e", "\\")
    });
    texts.collect()
}

/// The lines of the help and the README that start with the name of the program, without the explanation beside them.
/// A command that must fail (`||`) is tested with the README.
pub(crate) fn examples() -> BTreeSet<String> {
    let text = helps() + &readme();
    let lines = text.lines().map(|line| line.trim().trim_start_matches("- "));
    let has_placeholder = |line: &str| line.contains("CHANNEL") || line.contains('<');
    let examples =
        lines.filter(|line| line.starts_with("cangauge ") && !has_placeholder(line) && !line.contains(" || "));
    examples.map(|line| line.split("  ").next().unwrap_or_default().trim_end_matches(" &").to_owned()).collect()
}

/// Splits a line into words as a shell does, as far as examples need it: at blanks, except in single quotes.
pub(crate) fn words(line: &str) -> Vec<String> {
    let mut words = vec![String::new()];
    for (at, part) in line.split('\'').enumerate() {
        let mut pieces = if at % 2 == 1 { vec![part] } else { part.split(' ').collect() }.into_iter();
        if let Some(last) = words.last_mut() {
            last.push_str(pieces.next().unwrap_or_default());
        }
        words.extend(pieces.map(str::to_owned));
    }
    words.retain(|word| !word.is_empty());
    words
}

pub(crate) fn without_redirection(example: &str) -> &str {
    if example.contains('\'') { example } else { example.split(" > ").next().unwrap_or_default() }
}
