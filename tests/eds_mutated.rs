//! Ten thousand damaged EDS files: the reader neither panics nor hangs, its memory is limited, and its result is
//! consistent. The same seed gives the same files; a failure names the file.

#![cfg(test)]

use cangauge::canopen::id::NodeId;
use cangauge::device::eds::{self, Eds};
use std::collections::HashSet;
use std::fmt::Write as _;
use std::ops::Range;
use std::panic::catch_unwind;
use std::path::Path;
use std::thread;
use std::time::{Duration, Instant};

const FILES: u64 = 10_000;

/// Time limit for one file of a few kB in a debug build, while two other crates are tested.
const LONGEST: Duration = Duration::from_secs(5);

/// Texts that are difficult for parsers, inserted anywhere.
const TOKENS: &[&[u8]] = &[
    b"CompactSubObj=0xFFFFFFFF\n",
    b"CompactSubObj=254\n",
    b"SubNumber=0xFFFFFFFF\n",
    b"NrOfEntries=4294967295\n",
    b"ParameterName=\n",
    b"ParameterName=1018\n",
    b"ParameterName=Vendor-ID\n",
    b"ObjectType=8\n",
    b"ObjectType=5\n",
    b"DataType=0x0001\n",
    b"DataType=0x00A0\n",
    b"DefaultValue=$NODEID+$NODEID+0x\n",
    b"DefaultValue=0x180+$NODEID ; x\n",
    b"DefaultValue=-170141183460469231731687303715884105728\n",
    b"DefaultValue=1e400\n",
    b"LowLimit=0x80000000\n",
    b"[1018sub1]\n",
    b"[6130Value]\n1=5\n255=0\n",
    b"[6130Name]\n1=\n2=Pressure\n",
    b"[6130Denotation]\n1=Tank\n",
    b"[1018subFF]\n",
    b"[FFFF]\n",
    b"[FFFFFFFFF]\n",
    b"[",
    b"]",
    b"=",
    b";",
    b"$NODEID",
    b"0x",
    b"00",
    b"\xef\xbb\xbf",
    b"\xff\xfe",
    b"\xc3",
    b"\0",
    b"\x1a",
    b"\r",
    b"\n",
    b" ",
    b"\xe2\x80\xae",
    b"99999999999999999999999999999999999999999999999999",
];

/// Marsaglia's xorshift64.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    fn below(&mut self, limit: usize) -> usize {
        usize::try_from(self.next() % u64::try_from(limit.max(1)).expect("a limit")).expect("below the limit")
    }
}

fn originals() -> Vec<Vec<u8>> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data/eds");
    let mut paths: Vec<_> =
        std::fs::read_dir(folder).expect("a folder").map(|file| file.expect("a file").path()).collect();
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "eds" || extension == "dcf"));
    paths.sort();
    paths.iter().map(|path| std::fs::read(path).expect("a file")).collect()
}

fn mutated(originals: &[Vec<u8>], seed: u64) -> Vec<u8> {
    let mut random = Random(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1);
    let mut file = originals[random.below(originals.len())].clone();
    for _ in 0..=random.below(12) {
        let at = random.below(file.len() + 1);
        let end = (at + random.below(200)).min(file.len());
        match random.below(8) {
            0 if at < file.len() => file[at] ^= 1 << random.below(8),
            1 if at < file.len() => file[at] = u8::try_from(random.below(256)).expect("a byte"),
            2 => drop(file.drain(at..end)),
            3 => {
                let piece = file[at..end].to_vec();
                let to = random.below(file.len() + 1);
                file.splice(to..to, piece);
            }
            4 => file.truncate(at),
            5 => {
                let other = &originals[random.below(originals.len())];
                let from = random.below(other.len());
                let piece = other[from..(from + random.below(600)).min(other.len())].to_vec();
                file.splice(at..at, piece);
            }
            _ => {
                let token = TOKENS[random.below(TOKENS.len())].to_vec();
                file.splice(at..at, token);
            }
        }
    }
    file
}

/// Checks that the result is consistent for any file.
fn check(eds: &Eds, file: &[u8]) {
    let mut names = HashSet::new();
    let node = NodeId::new(5).expect("a node-ID");
    for entry in eds.dictionary.iter() {
        let name = entry.full_name();
        assert!(!name.is_empty() && !name.chars().any(|one| one.is_control() || one.is_whitespace()), "{name:?}");
        assert!(entry.default.is_none() || entry.default_bytes(node).is_some(), "{name}: {:?}", entry.default);
        assert!(names.insert(name), "{} is called like another", entry.object);
    }
    for entry in eds.dictionary.iter().take(3) {
        assert_eq!(eds.dictionary.find(&entry.full_name()).map(|found| found.object), Some(entry.object));
    }
    assert!(!eds.dictionary.is_empty());
    // A section gives 255 entries at most.
    let sections = file.iter().filter(|&&byte| byte == b'[').count();
    assert!(eds.dictionary.iter().count() <= 255 * sections);
    for object in eds.parameter_values.keys().chain(eds.flags.keys()).chain(&eds.untyped) {
        assert!(eds.dictionary.get(*object).is_some(), "{object} is not in the dictionary");
    }
    let mut last = 1;
    for warning in &eds.warnings {
        assert!((last..=file.len()).contains(&warning.line), "{warning}");
        assert!(!warning.text.chars().any(char::is_control), "{warning}");
        assert!(warning.text.chars().count() < 400, "{warning}");
        last = warning.line;
    }
}

#[test]
fn damaged_files_cause_no_panic_and_no_hang() {
    let originals = originals();
    let (used, warned) = thread::scope(|scope| {
        let halves = [0..FILES / 2, FILES / 2..FILES];
        let threads = halves.map(|seeds| scope.spawn(|| read_damaged(&originals, seeds)));
        threads.into_iter().fold((0, 0), |(used, warned), thread| {
            let (more_used, more_warned) = thread.join().expect("no panic");
            (used + more_used, warned + more_warned)
        })
    });
    // Most damaged files must still be usable and have warnings, else the test proves nothing.
    assert!(used > 7_000 && warned > 6_000, "{used} files used, {warned} with warnings");
}

/// Reads the damaged files of these seeds. Returns how many are usable, and how many of these have warnings.
fn read_damaged(originals: &[Vec<u8>], seeds: Range<u64>) -> (usize, usize) {
    let (mut used, mut warned) = (0, 0);
    for seed in seeds {
        let file = mutated(originals, seed);
        let start = Instant::now();
        let result = catch_unwind(|| {
            let result = eds::read(&file);
            match &result {
                Ok(eds) => check(eds, &file),
                Err(error) => assert!(error.line >= 1 && error.line <= file.len() + 1, "{error}"),
            }
            result
        });
        let result = result.unwrap_or_else(|_| panic!("seed {seed} makes the reader panic"));
        assert!(start.elapsed() < LONGEST, "seed {seed} took {:?}", start.elapsed());
        used += usize::from(result.is_ok());
        warned += usize::from(result.is_ok_and(|eds| !eds.warnings.is_empty()));
    }
    (used, warned)
}

#[test]
fn memory_is_limited() {
    let mut file = String::from("[DeviceInfo]\n");
    for index in 0x1000..0x2000 {
        let _ = write!(
            file,
            "[{index:04X}]\nParameterName=A\nDataType=9\nAccessType=ro\nDefaultValue={}\nCompactSubObj=254\n",
            "x".repeat(100)
        );
    }
    let start = Instant::now();
    let eds = eds::read(file.as_bytes()).expect("objects");
    assert!(eds.dictionary.iter().count() < 200_000, "{} entries", eds.dictionary.iter().count());
    let left_out = eds.warnings.iter().filter(|warning| warning.text.contains("too much memory")).count();
    assert_eq!(left_out, 1);
    assert!(start.elapsed() < 2 * LONGEST, "{:?}", start.elapsed());
}

#[test]
fn time_grows_linearly_with_the_length() {
    for piece in ["[", "[1018sub1]\n", "x\n", "x=1\n", "[1000]\n=", "[6130Name]\n1=a\n", "\r", "=", ";", "[a]\nx=1\n"] {
        let file =
            format!("[1000]\nParameterName=A\nDataType=7\nAccessType=ro\n{}", piece.repeat(500_000 / piece.len()));
        let start = Instant::now();
        assert!(eds::read(file.as_bytes()).is_ok(), "{piece:?}");
        assert!(start.elapsed() < 2 * LONGEST, "{piece:?}: {:?}", start.elapsed());
    }
}
