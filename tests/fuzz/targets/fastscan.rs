//! Fastscan with arbitrary answers: it ends, and each found address was confirmed.
#![no_main]

use cangauge::canopen::lss::{Fastscan, Progress, Request};
use cangauge_fuzz::Bytes;
use libfuzzer_sys::fuzz_target;

/// The largest number of steps for any answers.
const STEPS: usize = 20_000;

fuzz_target!(|data: &[u8]| {
    let mut bytes = Bytes(data);
    let retries = u32::from(bytes.byte() % 8);
    let mut scan = Fastscan::new(retries);
    for _ in 0..STEPS {
        let step = scan.step();
        let Request::Fastscan { bit_check, .. } = step.request else { panic!("{step:?}") };
        assert!(bit_check < 32 || bit_check == Request::ALL_SLAVES);
        // Two bits for each step. The answers repeat after the end.
        if bytes.is_empty() {
            bytes = Bytes(data);
        }
        let answers = bytes.byte();
        match scan.on_end(usize::from(answers % 3)) {
            Progress::Continue => {}
            Progress::Found(_) => {
                assert!(answers % 3 > 0, "found without an answer");
                return;
            }
            Progress::NoneFound | Progress::Failed(_) => return,
        }
    }
    panic!("no end");
});
