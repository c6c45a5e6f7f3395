//! A device description written by a user.
#![no_main]

use cangauge::device::catalog::Model;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(text) = std::str::from_utf8(data) else { return };
    match Model::from_toml(text) {
        Ok(model) => assert!(!model.description.name.is_empty()),
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
