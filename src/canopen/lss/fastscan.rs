//! Fastscan: finds the address of a slave without a node-ID, bit by bit (CiA 305, 7.5.3.5).
//!
//! Each step asks whether a slave has a number with these upper bits. An answer means yes, no answer means no. A late
//! answer therefore gives two wrong results. So the found bits are checked after every eight bits, and before the next
//! number. If a bit got no answer, the check is made twice, because the answer may be late. If a check fails, the eight
//! bits are searched again with a longer time-out. If it fails again, the whole number is searched again.
//!
//! Several slaves may answer one step, one after the other. The second answer must not count for the next step. So
//! after the first step with two answers, each step waits until its time-out.

use super::{LssAddress, Part, Request};
use crate::canopen::frame::Frame;

/// The scan fails after this number of failed checks of one number.
const MAX_FAILED_CHECKS: u8 = 6;

/// The scan fails after this number of answers to the impossible request. A single answer may be a late one.
const MAX_PROBE_ANSWERS: u8 = 3;

/// The number of bits between two checks.
const CHECK_INTERVAL: u8 = 8;

/// The largest number of restarts because a slave stopped answering.
const MAX_RESTARTS: u8 = 3;

/// A number that no step asks for. No slave that follows the protocol answers it.
const UNUSED_NUMBER: u32 = u32::MAX;

/// The answer that a step waits for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Wait {
    /// An answer from any slave, with the longest time-out. The step measures how fast the slaves answer.
    AllSlaves,
    /// An answer within the usual time, or none.
    Bit,
    /// An expected answer, with a somewhat longer time-out.
    Check,
    /// An expected answer, with the longest time-out. Without an answer, the scan restarts.
    Advance,
}

/// The next step of a scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Step {
    /// The request to send.
    pub request: Request,
    /// The answer to wait for.
    pub wait: Wait,
    /// Whether to wait until the time-out even after an answer.
    pub until_timeout: bool,
    /// How often the usual time-out was too short: 0, 1, 2 …
    pub extensions: u8,
}

/// The result of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Progress {
    /// The next step.
    Continue,
    /// The slave with this address is in configuration state.
    Found(LssAddress),
    /// There is no slave without a node-ID.
    NoneFound,
    /// The scan failed.
    Failed(FastscanError),
}

/// Why a scan with answers found no address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum FastscanError {
    /// A slave answers a request that no slave may answer.
    #[error("a device answers every fastscan request, whether it matches or not")]
    AnswersEverything,
    /// The answers contradict each other.
    #[error("the answers about the {} contradict each other", name(*.0))]
    Contradiction(Part),
}

fn name(part: Part) -> &'static str {
    match part {
        Part::Vendor => "vendor-ID",
        Part::Product => "product code",
        Part::Revision => "revision number",
        Part::Serial => "serial number",
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Phase {
    /// Asks all slaves, which restarts their scans.
    AllSlaves,
    /// Asks for a product code: no slave may answer, because slaves at the start of a scan compare the vendor-ID.
    Probe,
    /// Asks for this bit, 31 to 0.
    Bit(u8),
    /// Checks the bits found so far, down to this one. Slaves do not change their state.
    Check(u8),
    /// Checks the complete number. A matching slave compares the next part; after the last part it is in configuration
    /// state.
    Advance,
}

/// A scan in progress.
#[derive(Clone, Debug)]
pub struct Fastscan {
    phase: Phase,
    /// The number of remaining requests to all slaves.
    retries: u32,
    /// The numbers found so far.
    known: [Option<u32>; 4],
    part: Part,
    number: u32,
    failed_checks: u8,
    restarts: u8,
    /// Whether a step got several answers, or answers may be late.
    has_several_answers: bool,
    /// How often the usual time-out was too short.
    extensions: u8,
    /// Whether the impossible request got no answer.
    has_passed_probe: bool,
    /// The number of answers to the impossible request.
    probe_answers: u8,
    /// Whether a bit since the last check got no answer. The answer may still arrive.
    has_missed_answers: bool,
}

impl Fastscan {
    /// Creates a scan. The first request to all slaves is repeated `retries` times.
    pub fn new(retries: u32) -> Fastscan {
        Fastscan {
            phase: Phase::AllSlaves,
            retries,
            known: [None; 4],
            part: Part::Vendor,
            number: 0,
            failed_checks: 0,
            restarts: 0,
            has_several_answers: false,
            extensions: 0,
            has_passed_probe: false,
            probe_answers: 0,
            has_missed_answers: false,
        }
    }

    /// Whether a frame answers a step.
    pub fn is_answer(frame: &Frame) -> bool {
        super::Answer::parse(frame, super::Service::Fastscan).is_some()
    }

    /// Returns the present step: the frame to send and the answer to wait for.
    pub fn step(&self) -> Step {
        let ask = |number, bit_check, sub, next| Request::Fastscan { number, bit_check, sub, next };
        let (request, wait) = match self.phase {
            Phase::AllSlaves => (Request::ANY_UNCONFIGURED, Wait::AllSlaves),
            Phase::Probe => (ask(UNUSED_NUMBER, 0, Part::Product, Part::Product), Wait::Bit),
            Phase::Bit(bit) => (ask(self.number, bit, self.part, self.part), Wait::Bit),
            Phase::Check(bit) => (ask(self.number, bit, self.part, self.part), Wait::Check),
            Phase::Advance => {
                let next = Part::from_number(self.part.number() + 1).unwrap_or(Part::Vendor);
                (ask(self.number, 0, self.part, next), Wait::Advance)
            }
        };
        Step { request, wait, until_timeout: self.has_several_answers, extensions: self.extensions }
    }

    /// Ends a step that got this number of answers.
    pub fn on_end(&mut self, answers: usize) -> Progress {
        self.has_several_answers |= answers > 1;
        let answered = answers > 0;
        match self.phase {
            Phase::AllSlaves if answered => {
                if self.has_passed_probe {
                    self.start_part(Part::Vendor);
                } else {
                    self.phase = Phase::Probe;
                }
            }
            Phase::AllSlaves if self.retries > 0 => self.retries -= 1,
            Phase::AllSlaves if self.restarts > 0 => return self.contradiction(),
            Phase::AllSlaves => return Progress::NoneFound,
            Phase::Probe if answered => {
                self.probe_answers += 1;
                if self.probe_answers >= MAX_PROBE_ANSWERS {
                    return Progress::Failed(FastscanError::AnswersEverything);
                }
            }
            Phase::Probe => {
                self.has_passed_probe = true;
                self.start_part(Part::Vendor);
            }
            Phase::Bit(bit) => {
                if !answered {
                    self.number |= 1 << bit;
                    self.has_missed_answers = true;
                }
                self.phase = if bit % CHECK_INTERVAL == 0 { Phase::Check(bit) } else { Phase::Bit(bit - 1) };
            }
            // The answer may be a late answer to a bit. A second check then gets no answer.
            Phase::Check(_) if answered && self.has_missed_answers => self.has_missed_answers = false,
            Phase::Check(bit) if answered => self.phase = bit.checked_sub(1).map_or(Phase::Advance, Phase::Bit),
            Phase::Check(bit) => return self.on_failed_check(bit),
            Phase::Advance if answered => {
                self.extensions = 0;
                self.known[usize::from(self.part.number())] = Some(self.number);
                let Some(next) = Part::from_number(self.part.number() + 1) else {
                    return Progress::Found(LssAddress::new(self.known.map(Option::unwrap_or_default)));
                };
                self.start_part(next);
            }
            Phase::Advance => {
                // It is unknown whether the slave continued: restart, and check the numbers found so far in one step
                // each.
                self.restarts += 1;
                if self.restarts > MAX_RESTARTS {
                    return self.contradiction();
                }
                if self.known[usize::from(self.part.number())].take().is_some() {
                    self.known = [None; 4];
                }
                self.extensions = self.restarts;
                self.has_several_answers = true;
                self.phase = Phase::AllSlaves;
            }
        }
        Progress::Continue
    }

    /// Searches the bits from `bit` upwards again, because no slave has the bits found so far.
    fn on_failed_check(&mut self, bit: u8) -> Progress {
        self.has_missed_answers = false;
        self.failed_checks += 1;
        if self.failed_checks >= MAX_FAILED_CHECKS {
            return self.contradiction();
        }
        self.extensions += 1;
        if self.failed_checks % 2 == 1 {
            let (above, top) = (bit + CHECK_INTERVAL, bit + CHECK_INTERVAL - 1);
            self.number &= u32::MAX.checked_shl(above.into()).unwrap_or(0);
            self.phase = Phase::Bit(top);
        } else {
            // A late answer may have made the previous check succeed, or the slaves answer slowly.
            self.has_several_answers = true;
            self.search();
        }
        Progress::Continue
    }

    fn start_part(&mut self, part: Part) {
        self.part = part;
        self.failed_checks = 0;
        match self.known[usize::from(part.number())] {
            Some(number) => {
                self.number = number;
                self.phase = Phase::Advance;
            }
            None => self.search(),
        }
    }

    fn search(&mut self) {
        self.number = 0;
        self.phase = Phase::Bit(31);
    }

    fn contradiction(&self) -> Progress {
        Progress::Failed(FastscanError::Contradiction(self.part))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// A slave according to CiA 305: the part that it compares next, and whether it was found.
    struct Slave {
        address: LssAddress,
        compares: Part,
        found: bool,
    }

    impl Slave {
        fn new(address: LssAddress) -> Slave {
            Slave { address, compares: Part::Vendor, found: false }
        }

        fn receive(&mut self, request: Request) -> bool {
            let Request::Fastscan { number, bit_check, sub, next } = request else { return false };
            if bit_check == Request::ALL_SLAVES {
                (self.compares, self.found) = (Part::Vendor, false);
                return true;
            }
            let fits = (self.address.part(sub) ^ number).checked_shr(bit_check.into()) == Some(0);
            if self.found || sub != self.compares || !fits {
                return false;
            }
            if bit_check == 0 {
                self.found = next < sub;
                self.compares = next;
            }
            true
        }
    }

    /// Simulates a scan. `late` decides for each step whether the answers arrive only in the next step.
    fn scan(slaves: &mut [Slave], late: &mut dyn FnMut(Step) -> bool) -> (Progress, usize) {
        let (mut scan, mut steps, mut left_over) = (Fastscan::new(1), 0, 0);
        loop {
            let step = scan.step();
            steps += 1;
            let answers = slaves.iter_mut().filter_map(|slave| slave.receive(step.request).then_some(())).count();
            let (now, later) = if late(step) { (0, answers) } else { (answers, 0) };
            let answers = now + std::mem::replace(&mut left_over, later);
            let progress = scan.on_end(answers);
            if progress != Progress::Continue {
                return (progress, steps);
            }
            assert!(steps < 10_000);
        }
    }

    #[test]
    fn no_slave_and_a_slave_that_answers_each_frame() {
        assert_eq!(scan(&mut [], &mut |_| false), (Progress::NoneFound, 2));
        let mut probe_answers = Fastscan::new(1);
        let mut ends = (0..1000).map(|_| probe_answers.on_end(1));
        let end = ends.find(|progress| *progress != Progress::Continue);
        assert_eq!(end, Some(Progress::Failed(FastscanError::AnswersEverything)));
    }

    #[test]
    fn slave_that_stops_answering() {
        let address = LssAddress::new([0x362, 0x0044_3150, 0x0001_0000, 20002]);
        for last in 2..150 {
            let mut slave = Slave::new(address);
            let (mut scan, mut step) = (Fastscan::new(1), 0);
            let end = loop {
                step += 1;
                let answered = slave.receive(scan.step().request) && step <= last;
                match scan.on_end(usize::from(answered)) {
                    Progress::Continue => {}
                    end => break end,
                }
            };
            assert!(matches!(end, Progress::Failed(FastscanError::Contradiction(_))), "{last}: {end:?}");
        }
    }

    proptest! {
        #[test]
        fn one_is_found_in_150_steps_and_a_second_check_after_bits_of_1(parts: [u32; 4]) {
            let address = LssAddress::new(parts);
            let found = scan(&mut [Slave::new(address)], &mut |_| false);
            let checked_twice = parts.iter().flat_map(|part| part.to_be_bytes()).filter(|byte| *byte != 0).count();
            prop_assert_eq!(found, (Progress::Found(address), 150 + checked_twice));
        }

        #[test]
        fn one_of_several_is_found(parts in proptest::collection::vec([0u32..8, 0u32..8, 0u32..8, 0u32..99], 1..5)) {
            let mut slaves: Vec<Slave> = parts.into_iter().map(|parts| Slave::new(LssAddress::new(parts))).collect();
            let (end, _) = scan(&mut slaves, &mut |_| false);
            let found: Vec<LssAddress> = slaves.iter().filter(|slave| slave.found).map(|slave| slave.address).collect();
            prop_assert!(found.windows(2).all(|pair| pair[0] == pair[1]));
            prop_assert_eq!(Some(end), found.first().map(|&address| Progress::Found(address)));
        }

        /// Answers that arrive one step late make the scan longer or end it. They never produce a wrong address.
        #[test]
        fn late_answers_never_produce_a_wrong_address(parts: [u32; 4], late in proptest::collection::vec(0u8..40, 1..600)) {
            let address = LssAddress::new(parts);
            let mut slaves = [Slave::new(address)];
            let mut late = late.into_iter().map(|one_in| one_in == 0);
            // A check has a time-out that is long enough.
            let (end, _) = scan(&mut slaves, &mut |step| step.wait == Wait::Bit && late.next().unwrap_or(false));
            match end {
                Progress::Found(found) => prop_assert!(found == address && slaves[0].found),
                // A late answer to the step before the impossible request, or too many late answers.
                end => prop_assert!(matches!(end, Progress::Failed(_)), "{end:?}"),
            }
        }
    }
}
