//! EDS and DCF files.
#![no_main]

use cangauge::device::catalog::Model;
use cangauge::device::eds;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|data: &[u8]| {
    let Ok(eds) = eds::read(data) else { return };
    // Each warning names an existing line.
    let lines = data.split(|byte| *byte == b'\n' || *byte == b'\r').count();
    assert!(eds.warnings.iter().all(|warning| warning.line <= lines + 1));
    let configured = eds.configured();
    let model = Model::from_eds(&eds);
    let _ = (format!("{:?}", configured), model.description.name.len());
    assert_eq!(eds::read(data).map(|again| format!("{again:?}")), Ok(format!("{eds:?}")));
});
