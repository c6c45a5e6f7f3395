//! The kinds of devices on a bench: the built-in ones, and one with large objects.

use cangauge::canopen::object::ObjectId;
use cangauge::device::catalog::{Model, by_name};
use std::sync::{Arc, LazyLock};

/// The kind with large objects.
pub(crate) const LARGE_KIND: &str = "large";

/// Its large objects, and their initial number of bytes.
pub(crate) const LARGE_OBJECTS: [(ObjectId, usize); 3] =
    [(ObjectId::new(0x2100, 0), 100), (ObjectId::new(0x2101, 0), 2000), (ObjectId::new(0x2102, 0), 900)];

static LARGE_MODEL: LazyLock<Arc<Model>> =
    LazyLock::new(|| Arc::new(Model::from_toml(include_str!("large.toml")).expect("a description")));

/// The description of a kind.
pub(crate) fn model(kind: &str) -> Arc<Model> {
    if kind == LARGE_KIND { Arc::clone(&LARGE_MODEL) } else { by_name(kind).expect("built in") }
}

/// Printable text of this length. It depends on `seed` and is never a signature.
pub(crate) fn filler(length: usize, seed: u64) -> Vec<u8> {
    let mut random = crate::random::Random::new(seed);
    (0..length).map(|_| random.byte(b'0'..=b'9')).collect()
}
