//! The SocketCAN transport on a real kernel.
//!
//! These tests need root and a separate virtual CAN interface, which they take down and flood.
//! `tests/socketcan/vcan` provides both on any Linux machine:
//!
//! ```text
//! tests/socketcan/run
//! ```
#![cfg(target_os = "linux")]

mod controller;
mod doctor;
mod frames;
mod link;
mod load;
mod log;
mod log_files;
mod lss;
mod program;
mod readme;
mod two;
mod virtual_interfaces;

use cangauge::bus::socketcan::SocketCan;
use cangauge::bus::{Bus, Event, Mono};
use cangauge::canopen::frame::Frame;
use std::process::Command;
use std::sync::{Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The interface of these tests, for one test at a time.
struct Can {
    name: String,
    _alone: MutexGuard<'static, ()>,
}

impl Can {
    fn get() -> Can {
        static ALONE: Mutex<()> = Mutex::new(());
        let alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
        let name = std::env::var("CANGAUGE_TEST_CAN")
            .expect("CANGAUGE_TEST_CAN names the CAN interface to test with; tests/socketcan/run sets it");
        // A failed test may have left it down.
        run("ip", &["link", "set", &name, "up"]);
        Can { name, _alone: alone }
    }

    fn open(&self) -> SocketCan {
        SocketCan::open(&self.name).unwrap()
    }

    fn switch(&self, direction: &str) {
        run("ip", &["link", "set", &self.name, direction]);
    }

    /// Sends a frame with can-utils, for frames that the program cannot send.
    fn cansend(&self, frame: &str) {
        run("cansend", &[&self.name, frame]);
    }
}

fn run(program: &str, arguments: &[&str]) {
    let status = Command::new(program).args(arguments).status().unwrap();
    assert!(status.success(), "{program} {arguments:?}: {status}");
}

fn frame(text: &str) -> Frame {
    text.parse().unwrap()
}

/// A deadline this many milliseconds ahead.
fn ahead(bus: &dyn Bus, millis: u64) -> Mono {
    bus.now().mono + Duration::from_millis(millis)
}

/// The next event. The time-out is long enough for a slow machine.
fn next(bus: &mut dyn Bus) -> Event {
    let deadline = ahead(bus, 20_000);
    bus.receive(deadline).unwrap()
}

/// The text of the next frame. Another event is a failure.
fn next_frame(bus: &mut dyn Bus) -> String {
    match next(bus) {
        Event::Frame(received) => received.frame.to_string(),
        event => panic!("{event:?} instead of a frame"),
    }
}

/// Checks that no event arrives. On a virtual bus, frames that were sent before are already there.
fn assert_nothing_more(bus: &mut dyn Bus) {
    let deadline = ahead(bus, 30);
    assert_eq!(bus.receive(deadline).unwrap(), Event::Timeout);
}
