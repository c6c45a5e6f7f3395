//! What the program is made of besides its own code: where it comes from, under which licence, each thing once.
//!
//! By `Cargo.lock` and `cargo metadata`, without a network: nothing is asked but what has been fetched to build.

use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::process::Command;

/// Licences that ask for nothing more than being named.
const LICENCES: [&str; 7] =
    ["MIT", "Apache-2.0", "Apache-2.0 WITH LLVM-exception", "BSD-2-Clause", "Unicode-3.0", "Unlicense", "Zlib"];

/// Of these there are two versions in the program, for the reason given.
const TWICE: &[(&str, &str)] = &[];

/// Every package that is linked into the program on some system: its description, and no tests' dependencies.
fn packages() -> Vec<Value> {
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--offline", "--filter-platform"])
        .arg("x86_64-unknown-linux-gnu")
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    let nodes = metadata["resolve"]["nodes"].as_array().expect("nodes");
    let by_id: BTreeMap<&str, &Value> = nodes.iter().map(|node| (node["id"].as_str().expect("an id"), node)).collect();
    let mut open = vec![metadata["resolve"]["root"].as_str().expect("the program")];
    let mut seen = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !seen.insert(id) {
            continue;
        }
        for dependency in by_id[id]["deps"].as_array().expect("deps") {
            let mut kinds = dependency["dep_kinds"].as_array().expect("kinds").iter();
            if kinds.any(|kind| kind["kind"] != "dev") {
                open.push(dependency["pkg"].as_str().expect("an id"));
            }
        }
    }
    assert!(seen.len() > 20, "{seen:?}");
    let packages = metadata["packages"].as_array().expect("packages");
    packages.iter().filter(|package| package["id"].as_str().is_some_and(|id| seen.contains(id))).cloned().collect()
}

/// `(MIT OR Apache-2.0) AND Unicode-3.0`: of each part that has to be kept one way to keep it is known.
fn is_allowed(expression: &str) -> bool {
    let plain = expression.replace('/', " OR ").replace(['(', ')'], "");
    plain.split(" AND ").all(|part| part.split(" OR ").any(|licence| LICENCES.contains(&licence.trim())))
}

#[test]
fn licences_are_known_ones() {
    assert!(is_allowed("(MIT OR GPL-3.0) AND Unicode-3.0") && !is_allowed("MIT AND GPL-3.0") && !is_allowed(""));
    for package in packages() {
        let licence = package["license"].as_str().unwrap_or("");
        assert!(is_allowed(licence), "{} is under \"{licence}\"", package["name"]);
    }
}

#[test]
fn everything_comes_from_the_registry() {
    let lock = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.lock")).expect("Cargo.lock");
    let sources: BTreeSet<&str> = lock.lines().filter_map(|line| line.strip_prefix("source = ")).collect();
    assert_eq!(Vec::from_iter(sources), ["\"registry+https://github.com/rust-lang/crates.io-index\""]);
    let (named, summed) = (lock.matches("\nname = ").count(), lock.matches("\nchecksum = ").count());
    assert_eq!(named, summed + 1, "all but the program itself have a checksum");
}

#[test]
fn nothing_is_there_twice() {
    let mut versions: BTreeMap<String, Vec<String>> = BTreeMap::new();
    for package in packages() {
        let text = |key: &str| package[key].as_str().unwrap_or("").to_owned();
        versions.entry(text("name")).or_default().push(text("version"));
    }
    versions.retain(|name, versions| versions.len() > 1 && !TWICE.iter().any(|(known, _)| known == name));
    assert!(versions.is_empty(), "{versions:?}");
}
