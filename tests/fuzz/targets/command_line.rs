//! The words of a command line, one for each line. Printed values parse to the same value.
#![no_main]

#[allow(dead_code, reason = "the target runs no command")]
#[path = "../../../src/cli/mod.rs"]
mod cli;

use cangauge::canopen::id::NodeId;
use cangauge::canopen::lss::{LssAddress, LssRange};
use cangauge::canopen::object::ObjectId;
use cangauge::tasks::lss::Target;
use cli::args::{BitRate, BusSpec, Duration, InterfaceName, Nodes, ObjectArg, Override, SignalArg};
use cli::parse::parse;
use libfuzzer_sys::fuzz_target;
use std::ffi::OsString;

/// Options whose values are parsed only by the command line.
const PLACES: &[&[&str]] = &[
    &["read"],
    &["sdo", "write", "5", "0x2000"],
    &["pdo", "map", "5", "1"],
    &["pdo", "map", "5", "1", "--transmission"],
    &["pdo", "map", "5", "1", "--cob-id"],
    &["lss", "set-bitrate", "5"],
    &["lss", "set-id", "5"],
    &["lss", "activate"],
    &["log", "5", "--sync"],
    &["unit", "5", "pressure"],
    &["nmt", "startup", "5"],
    &["check", "5"],
];

fn values(word: &str) {
    if let Ok(node) = word.parse::<NodeId>() {
        assert!((1..=127).contains(&node.get()));
        assert_eq!(node.to_string().parse(), Ok(node));
    }
    if let Ok(Nodes::These(nodes)) = word.parse() {
        assert!(!nodes.is_empty() && nodes.is_sorted() && nodes.len() <= 127);
    }
    if let Ok(object) = word.parse::<ObjectId>() {
        assert_eq!(object.to_string().parse(), Ok(object));
    }
    // A name is printed without its blanks, and may then look like an address.
    if let Ok(object @ ObjectArg::Address(_)) = word.parse() {
        assert_eq!(object.to_string().parse(), Ok(object));
    }
    if let Ok(Duration(duration)) = word.parse() {
        assert!(!duration.is_zero());
    }
    if let Ok(BitRate(rate)) = word.parse() {
        assert!((1_000..=1_000_000).contains(&rate));
    }
    if let Ok(address) = word.parse::<LssAddress>() {
        assert_eq!(address.to_string().parse(), Ok(address));
        assert_eq!(word.parse(), Ok(Target::Address(address)));
    }
    if let Ok(range) = word.parse::<LssRange>() {
        assert_eq!(range.to_string().parse(), Ok(range));
        assert!(range.revision.0 <= range.revision.1 && range.serial.0 <= range.serial.1);
    }
    if let Ok(target) = word.parse::<Target>() {
        assert_eq!(target.to_string().parse(), Ok(target));
    }
    if let Ok(InterfaceName(name)) = word.parse() {
        assert_eq!(format!("socketcan:{name}").parse(), Ok(BusSpec::SocketCan(name)));
    }
    let _ = (word.parse::<SignalArg>(), word.parse::<Override>());
}

fuzz_target!(|data: &[u8]| {
    let Some((&place, rest)) = data.split_first() else { return };
    let Ok(text) = std::str::from_utf8(rest) else { return };
    text.lines().for_each(values);
    // All commands are expensive to set up.
    let words = |place: &[&str]| -> Vec<OsString> {
        ["cangauge"].iter().chain(place).copied().chain(text.lines()).map(OsString::from).collect()
    };
    let words = match PLACES.get(usize::from(place % 16)) {
        Some(place) => words(place),
        None => words(&[]),
    };
    if let Err(error) = parse(words) {
        assert!(!error.to_string().is_empty());
    }
});
