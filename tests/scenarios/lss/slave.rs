//! An LSS slave that a test can make slow, and that can lose answers, send too many, or send wrong ones.

use cangauge::bus::Mono;
use cangauge::bus::memory::{Outbox, Station};
use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::CanId;
use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

pub(super) struct Slave {
    pub(super) identity: [u32; 4],
    /// FFh: no node-ID.
    pub(super) node: u8,
    pub(super) stored: Option<u8>,
    pub(super) is_configuring: bool,
    /// The delays of its answers, used in turn.
    pub(super) latencies: Vec<Duration>,
    /// Services that it does not support.
    pub(super) unknown: BTreeSet<u8>,
    /// Wrong answers by service; an empty answer is not sent.
    pub(super) answers: BTreeMap<u8, Vec<u8>>,
    /// It answers each fastscan frame: in configuration state (`true`) or in waiting state (`false`).
    pub(super) answers_all_fastscans: Option<bool>,
    /// The numbers of the answers that are lost, counted from 0.
    pub(super) loses: BTreeSet<usize>,
    /// It loses frames that arrive within this time after the previous one.
    pub(super) pause: Duration,
    /// It loses frames that arrive while an answer waits.
    pub(super) drops_while_busy: bool,
    /// When it received the last frame that was not lost.
    received_at: Option<Mono>,
    /// The number of services it received that address one slave.
    pub(super) commands: usize,
    selected: usize,
    identified: usize,
    compares: u8,
    answer_count: usize,
    waiting: VecDeque<(Mono, Frame)>,
}

impl Slave {
    pub(super) fn new(identity: [u32; 4], node: u8) -> Slave {
        Slave {
            identity,
            node,
            stored: None,
            is_configuring: false,
            latencies: vec![Duration::from_micros(300)],
            unknown: BTreeSet::new(),
            answers: BTreeMap::new(),
            answers_all_fastscans: None,
            loses: BTreeSet::new(),
            pause: Duration::ZERO,
            drops_while_busy: false,
            received_at: None,
            commands: 0,
            selected: 0,
            identified: 0,
            compares: 0,
            answer_count: 0,
            waiting: VecDeque::new(),
        }
    }

    /// Sets its latencies in microseconds.
    pub(super) fn slow(mut self, latencies: &[u64]) -> Slave {
        self.latencies = latencies.iter().map(|&latency| Duration::from_micros(latency)).collect();
        self
    }

    /// Removes services. The DPS manual names only 04h, 40h to 44h, 11h, 13h, 15h and 17h.
    pub(super) fn without(mut self, services: impl IntoIterator<Item = u8>) -> Slave {
        self.unknown.extend(services);
        self
    }

    fn fastscan(&mut self, number: u32, [bit_check, sub, next]: [u8; 3]) -> bool {
        if self.answers_all_fastscans == Some(self.is_configuring) {
            return true;
        }
        if self.node != 0xff || self.is_configuring {
            return false;
        }
        if bit_check == 0x80 {
            self.compares = 0;
            return true;
        }
        let fits = (self.identity[usize::from(sub)] ^ number) >> bit_check == 0;
        if sub != self.compares || !fits {
            return false;
        }
        if bit_check == 0 {
            self.is_configuring = next < sub;
            self.compares = next;
        }
        true
    }

    fn answer(&mut self, data: [u8; 8]) -> Option<Vec<u8>> {
        let [service, first, a, b, c, tail @ ..] = data;
        let number = u32::from_le_bytes([first, a, b, c]);
        if self.unknown.contains(&service) {
            return None;
        }
        let for_one = matches!(service, 0x11 | 0x13 | 0x15 | 0x17 | 0x5a..=0x5e);
        if for_one && !self.is_configuring {
            return None;
        }
        if for_one {
            self.commands += 1;
            if let Some(answer) = self.answers.get(&service) {
                return Some(answer.clone()).filter(|answer| !answer.is_empty());
            }
        }
        match service {
            0x04 => {
                self.is_configuring = first == 1;
                None
            }
            0x40..=0x43 => {
                let part = usize::from(service - 0x40);
                let fits = self.identity[part] == number && (part == 0 || self.selected == part);
                self.selected = if fits { part + 1 } else { 0 };
                let is_selected = self.selected == 4 && !self.is_configuring;
                self.is_configuring |= is_selected;
                is_selected.then(|| vec![0x44])
            }
            0x46..=0x4b => {
                let limit = usize::from(service - 0x46);
                let fits = match limit {
                    0 | 1 => self.identity[limit] == number,
                    2 => self.identity[2] >= number,
                    3 => self.identity[2] <= number,
                    4 => self.identity[3] >= number,
                    _ => self.identity[3] <= number,
                };
                self.identified = if fits && (limit == 0 || self.identified == limit) { limit + 1 } else { 0 };
                (self.identified == 6).then(|| vec![0x4f])
            }
            0x4c => (self.node == 0xff).then(|| vec![0x50]),
            0x51 => self.fastscan(number, tail).then(|| vec![0x4f]),
            0x11 => {
                self.node = first;
                Some(vec![service, 0, 0])
            }
            0x17 => {
                self.stored = Some(self.node);
                Some(vec![service, 0, 0])
            }
            0x13 => Some(vec![service, 0, 0]),
            0x5a..=0x5d => {
                let number = self.identity[usize::from(service - 0x5a)].to_le_bytes();
                Some([&[service], &number[..]].concat())
            }
            0x5e => Some(vec![service, self.node]),
            _ => None,
        }
    }
}

impl Station for Slave {
    fn power_on(&mut self, _: Mono, _: &mut Outbox) {}

    fn receive(&mut self, now: Mono, frame: &Frame, _: &mut Outbox) {
        let (true, Some(data)) = (frame.id() == CanId::LSS_MASTER, frame.as_eight_bytes()) else { return };
        let is_busy = self.drops_while_busy && !self.waiting.is_empty();
        if is_busy || self.received_at.is_some_and(|at| now.since(at) < self.pause) {
            return;
        }
        self.received_at = Some(now);
        let Some(mut answer) = self.answer(data) else { return };
        if !self.answers.contains_key(&data[0]) {
            answer.resize(8, 0);
        }
        let latency = self.latencies[self.answer_count % self.latencies.len()];
        let at = self.waiting.back().map_or(now + latency, |(last, _)| (now + latency).max(*last));
        if !self.loses.contains(&self.answer_count) {
            self.waiting.push_back((at, Frame::new(CanId::LSS_SLAVE, &answer).unwrap()));
        }
        self.answer_count += 1;
    }

    fn wake(&mut self, now: Mono, out: &mut Outbox) {
        while self.waiting.front().is_some_and(|(at, _)| *at <= now) {
            out.send(self.waiting.pop_front().unwrap().1);
        }
    }

    fn next_wake(&self) -> Option<Mono> {
        self.waiting.front().map(|(at, _)| *at)
    }

    fn sent(&mut self, _: Mono, _: &Frame) {}
}
