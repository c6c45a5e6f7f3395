//! Another master reads the same nodes on the same SDO channels.

use cangauge::bus::memory::{Clock, MemoryBus, Outbox, Station};
use cangauge::bus::{BusError, Mono};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::DownloadSize;
use cangauge::device::catalog::Model;
use cangauge::master::{Error, Master, Request, SdoFailure, Timing};
use cangauge::sim::{Device, Setup};
use std::sync::Arc;
use std::time::Duration;

const NUMBER: ObjectId = ObjectId::new(0x1000, 0);
const NAME: ObjectId = ObjectId::new(0x1008, 0);
const TEXT: ObjectId = ObjectId::new(0x2101, 0);
const SETTING: ObjectId = ObjectId::new(0x2102, 0);

fn device() -> Device {
    let description = r#"
        name = "two-masters"
        title = "a device of the tests"
        vendor = "none"
        source = "none"
        identify = { device_type = 0x00020194 }
        object = [
            { at = "0x1000", name = "device-type", type = "u32", access = "ro", default = 0x00020194 },
            { at = "0x1001", name = "error-register", type = "u8", access = "ro", default = 0 },
            { at = "0x1008", name = "device-name", type = "vs", access = "const", default = "a name of some segments" },
            { at = "0x2101", name = "a-text", type = "vs", access = "rw", default = "THE TEXT, OF THE SAME L" },
            { at = "0x2102", name = "a-setting", type = "vs", access = "rw", default = "factory setting" },
        ]
    "#;
    let model = Arc::new(Model::from_toml(description).unwrap());
    Device::new(Setup::new(model, NodeId::new(5).unwrap())).unwrap()
}

/// Reads objects in a loop, with a pause before each frame.
struct Rival {
    objects: Vec<ObjectId>,
    at: usize,
    toggle: u8,
    pause: Duration,
    /// The next frame, and its time.
    next: Option<(Mono, [u8; 8])>,
    /// When the read times out.
    deadline: Mono,
    read: usize,
}

const SDO_TIMEOUT: Duration = Duration::from_millis(100);

impl Rival {
    fn new(objects: &[ObjectId], start: Duration, pause: Duration) -> Rival {
        let mut rival =
            Rival { objects: objects.to_vec(), at: 0, toggle: 0, pause, next: None, deadline: Mono::START, read: 0 };
        rival.begin(Mono::START + start);
        rival
    }

    fn plan(&mut self, now: Mono, data: [u8; 8]) {
        self.next = Some((now + self.pause, data));
        self.deadline = now + self.pause + SDO_TIMEOUT;
    }

    fn begin(&mut self, now: Mono) {
        let [a, b, c] = self.objects[self.at % self.objects.len()].multiplexer();
        self.toggle = 0;
        self.plan(now, [0x40, a, b, c, 0, 0, 0, 0]);
    }

    fn following(&mut self, now: Mono) {
        self.at += 1;
        self.read += 1;
        self.begin(now);
    }
}

impl Station for Rival {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        if frame.id() != CanId::sdo_response(NodeId::new(5).unwrap()) || self.next.is_some() {
            return;
        }
        match frame.data()[0] {
            command if command >> 5 == 2 && command & 2 == 0 => self.plan(now, [0x60, 0, 0, 0, 0, 0, 0, 0]),
            command if command >> 5 == 0 && command & 1 == 0 => {
                self.toggle ^= 0x10;
                self.plan(now, [0x60 | self.toggle, 0, 0, 0, 0, 0, 0, 0]);
            }
            _ => self.following(now),
        }
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        match self.next {
            Some((at, data)) if at <= now => {
                out.send(Frame::full(CanId::sdo_request(NodeId::new(5).unwrap()), data));
                self.next = None;
            }
            Some(_) => {}
            None if self.deadline <= now => self.following(now),
            None => {}
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        Some(self.next.map_or(self.deadline, |(at, _)| at))
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}

fn bus(rival: Rival) -> MemoryBus {
    let mut bus = MemoryBus::new(Clock::Virtual);
    bus.attach(device());
    bus.attach(rival);
    bus
}

fn read(object: ObjectId) -> Request {
    Request::read(NodeId::new(5).unwrap(), object)
}

/// The bytes that are read, or the failure.
fn outcome(master: &mut Master<'_>, request: Request) -> Result<Vec<u8>, SdoFailure> {
    let answer = match master.transfer_one(request) {
        // Requests of both with the same identifier collide again and again.
        Err(Error::Bus(BusError::QueueFull)) => return Err(SdoFailure::Disturbed),
        answer => answer.unwrap(),
    };
    answer
        .map(|answer| answer.uploaded.map(|uploaded| uploaded.bytes).unwrap_or_default())
        .map_err(|error| error.failure)
}

#[test]
fn reads_are_correct_although_another_master_reads_too() {
    let (mut clean, mut disturbed, mut others) = (0, 0, 0);
    for objects in [&[NUMBER][..], &[NAME], &[TEXT], &[NUMBER, TEXT, NUMBER, NAME]] {
        for start in (0..4000).step_by(130) {
            for pause in [0, 300, 2000] {
                let rival = Rival::new(objects, Duration::from_micros(start), Duration::from_micros(pause));
                let mut bus = bus(rival);
                let mut master = Master::new(&mut bus, Timing::default());
                for object in [NUMBER, NAME, TEXT] {
                    match (object, outcome(&mut master, read(object))) {
                        (NUMBER, Ok(bytes)) => assert_eq!(bytes, [0x94, 0x01, 0x02, 0x00]),
                        (NAME, Ok(bytes)) => assert_eq!(bytes, b"a name of some segments"),
                        (_, Ok(bytes)) => assert_eq!(bytes, b"THE TEXT, OF THE SAME L"),
                        (object, Err(error)) => {
                            // If the other master leaves no time, the read fails and the reason is reported.
                            assert_eq!((error, object == NUMBER), (SdoFailure::Disturbed, false));
                            disturbed += 1;
                            continue;
                        }
                    }
                    clean += 1;
                }
                drop(master);
                others += bus.stations::<Rival>().map(|rival| rival.read).sum::<usize>();
            }
        }
    }
    assert!(
        disturbed * 10 < clean && others > clean / 10,
        "{clean} reads succeeded, {disturbed} failed, the other master made {others}"
    );
}

#[test]
fn segmented_write_is_complete_or_fails() {
    let setting = b"a setting of several segments";
    for start in (0..6000).step_by(170) {
        let mut bus = bus(Rival::new(&[NUMBER, TEXT], Duration::from_micros(start), Duration::from_micros(700)));
        let mut master = Master::new(&mut bus, Timing::default());
        let write = Request::write(NodeId::new(5).unwrap(), SETTING, setting.to_vec(), DownloadSize::Indicated);
        let written = outcome(&mut master, write);
        let held = outcome(&mut master, read(SETTING));
        match written {
            Ok(_) => assert_eq!(held, Ok(setting.to_vec()), "{start}"),
            Err(error) => assert_eq!(error, SdoFailure::Disturbed, "{start}"),
        }
    }
}
