//! Every break of `tests/breaks` still applies: the text that it replaces stands once in its file, and nowhere twice.
//! That it is noticed shows `tests/breaks/run`, which takes long.

use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct File {
    r#break: Vec<Break>,
}

#[derive(serde::Deserialize)]
#[serde(deny_unknown_fields)]
struct Break {
    name: String,
    what: String,
    file: String,
    old: String,
    new: String,
    by: String,
}

#[test]
fn every_break_applies() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let runner = fs::read_to_string(root.join("tests/breaks/run")).expect("the runner");
    let is_known = |by: &str| by.split(' ').next().is_some_and(|test| runner.contains(&format!("\"{test}\"")));
    let (mut names, mut wrong) = (BTreeSet::new(), Vec::new());
    for entry in fs::read_dir(root.join("tests/breaks")).expect("a folder") {
        let path = entry.expect("an entry").path();
        if path.extension().is_none_or(|extension| extension != "toml") {
            continue;
        }
        let file: File = toml::from_str(&fs::read_to_string(&path).expect("text")).expect("breaks");
        for Break { name, what, file, old, new, by } in file.r#break {
            let source = fs::read_to_string(root.join(&file)).unwrap_or_default();
            let times = source.matches(&old).count();
            if times != 1 {
                wrong.push(format!("{name}: its text stands {times} times in {file}"));
            }
            if old == new || what.is_empty() || !is_known(&by) || !file.starts_with("src/") {
                wrong.push(format!("{name}: it changes nothing, says nothing, or nobody notices"));
            }
            if !names.insert(name.clone()) {
                wrong.push(format!("{name}: there are two of this name"));
            }
        }
    }
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
    assert!(names.len() >= 45, "{} breaks", names.len());
}
