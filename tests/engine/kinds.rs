//! The kinds of devices that stand on a bench: those that are built in, and one that keeps large things.

use cangauge::canopen::object::ObjectId;
use cangauge::device::catalog::{Model, by_name};
use std::sync::{Arc, LazyLock};

/// The kind that keeps large things.
pub(crate) const ATTIC: &str = "attic";

/// What it keeps, and how many bytes of it at the beginning.
pub(crate) const KEPT: [(ObjectId, usize); 3] =
    [(ObjectId::new(0x2100, 0), 100), (ObjectId::new(0x2101, 0), 2000), (ObjectId::new(0x2102, 0), 900)];

static ATTIC_MODEL: LazyLock<Arc<Model>> =
    LazyLock::new(|| Arc::new(Model::from_toml(include_str!("attic.toml")).expect("a description")));

/// The description of a kind.
pub(crate) fn model(kind: &str) -> Arc<Model> {
    if kind == ATTIC { Arc::clone(&ATTIC_MODEL) } else { by_name(kind).expect("built in") }
}

/// So many bytes that are printable text, no signature, and told from others by `seed`.
pub(crate) fn stuff(length: usize, seed: u64) -> Vec<u8> {
    let mut random = crate::random::Random::new(seed);
    (0..length).map(|_| random.byte(b'0'..=b'9')).collect()
}
