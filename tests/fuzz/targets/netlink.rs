//! The kernel's description of an interface. The module is private, so its two files are included here.
#![no_main]
#![allow(dead_code, missing_docs, unreachable_pub)]

use libfuzzer_sys::fuzz_target;

#[path = "../../../src/bus/socketcan"]
mod socketcan {
    pub(super) mod netlink {
        mod link;
        mod message;

        /// Reads one answer.
        pub(crate) fn read(data: &[u8]) {
            match message::reply(data, 1) {
                Some(message::Reply::Link(header, attributes)) => {
                    let link = link::Link::read(header, attributes);
                    assert!(link.bit_rate().is_none_or(|rate| rate > 0));
                }
                Some(message::Reply::Refused(code, words)) => {
                    assert_ne!(code, 0);
                    assert!(words.is_none_or(|words| !words.contains('\0')));
                }
                Some(message::Reply::Done) | None => {}
            }
        }
    }
}

fuzz_target!(|data: &[u8]| socketcan::netlink::read(data));
