//! The files of `log` if a disk is full, and if a pipe is not read.

use crate::program::{Done, command};
use crate::{Can, run};
use cangauge::bus::{Bus, BusError};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use std::io::{BufRead, BufReader, Read};
use std::path::Path;
use std::process::{Child, Stdio};
use std::time::{Duration, Instant};

/// A disk of 64 KiB.
struct Disk(tempfile::TempDir);

impl Disk {
    fn mount() -> Disk {
        let folder = tempfile::tempdir().unwrap();
        run("mount", &["-t", "tmpfs", "-o", "size=64k", "none", folder.path().to_str().unwrap()]);
        Disk(folder)
    }

    fn path(&self, name: &str) -> String {
        self.0.path().join(name).display().to_string()
    }
}

impl Drop for Disk {
    fn drop(&mut self) {
        run("umount", &[self.0.path().to_str().unwrap()]);
    }
}

/// Starts a recording of node 5 and waits until it listens.
fn start(can: &Can, more: &str) -> Child {
    let line = format!("--bus {} log 5 pressure --passive --device mh4 {more}", can.name);
    let child = command(&line).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let listening = || {
        let all = std::fs::read_to_string("/proc/net/can/rcvlist_all").unwrap();
        all.lines().any(|line| line.split_whitespace().next() == Some(&can.name))
    };
    let until = Instant::now() + Duration::from_secs(60);
    while !listening() {
        assert!(Instant::now() < until, "it does not listen");
        std::thread::sleep(Duration::from_millis(10));
    }
    child
}

/// Sends `count` TPDOs of an MH-4 with increasing pressure, or until the recording has ended. Returns the number sent.
fn send(can: &Can, child: &mut Child, count: u32) -> u32 {
    let mut bus = can.open();
    for number in 0..count {
        let mut data = [0; 5];
        data[..4].copy_from_slice(&(number as f32).to_le_bytes());
        let frame = Frame::new(CanId::Standard(0x185), &data).unwrap();
        while let Err(error) = bus.send(&frame) {
            assert!(matches!(error, BusError::QueueFull), "{error:?}");
            std::thread::sleep(Duration::from_millis(1));
        }
        if number % 100 == 99 {
            // Limits the load, as a real bus does.
            std::thread::sleep(Duration::from_millis(10));
            if child.try_wait().unwrap().is_some() {
                return number;
            }
        }
    }
    count
}

/// The values of the rows. The last line must be complete.
fn values(text: &str) -> Vec<u32> {
    assert!(text.ends_with('\n'), "{text}");
    let rows = text.lines().skip(1).map(|line| line.split(',').collect::<Vec<_>>());
    rows.map(|cells| {
        assert_eq!(cells.len(), 8, "{cells:?}");
        cells[4].parse().unwrap()
    })
    .collect()
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_full_disk_ends_with_complete_rows_and_counts_the_lost_ones() {
    let can = Can::get();
    let disk = Disk::mount();
    let path = disk.path("run.csv");
    let mut child = start(&can, &format!("-o {path}"));
    let sent = send(&can, &mut child, 100_000);
    assert!(sent < 100_000, "a disk of 64 KiB holds no 100,000 rows");
    let done: Done = child.wait_with_output().unwrap().into();
    assert_eq!(done.code, Some(8), "{}", done.stderr);
    let text = std::fs::read_to_string(Path::new(&path)).unwrap();
    let written = values(&text);
    assert!(written.len() > 500, "{}", written.len());
    assert!(written.iter().zip(0..).all(|(value, number)| *value == number), "the first values, without gaps");
    let said = done.stderr.lines().find(|line| line.ends_with(" could not be written")).unwrap();
    let lost: usize = said.split(' ').nth(1).unwrap().parse().unwrap();
    assert!(lost > 0 && written.len() + lost <= sent as usize + 1, "{lost} of {sent}");
    assert!(done.stderr.ends_with("No space left on device (os error 28)\n"), "{}", done.stderr);
}

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn a_pipe_that_is_not_read_for_a_while_loses_nothing() {
    const COUNT: u32 = 5_000;
    let can = Can::get();
    let mut child = start(&can, &format!("--count {COUNT}"));
    let mut reader = BufReader::with_capacity(100, child.stdout.take().unwrap());
    // Six times the size of the pipe.
    assert_eq!(send(&can, &mut child, COUNT), COUNT, "it waits for its reader");
    let mut text = String::new();
    reader.read_line(&mut text).unwrap();
    reader.read_to_string(&mut text).unwrap();
    assert!(values(&text).into_iter().eq(0..COUNT));
    let done: Done = child.wait_with_output().unwrap().into();
    assert_eq!(done.code, Some(0), "{}", done.stderr);
    assert!(done.stderr.contains(", 0 frames dropped, "), "{}", done.stderr);
}
