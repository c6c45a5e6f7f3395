//! Fastscan over a bus. In fastscan, a missing answer means "no", so the time-outs decide the duration.

use super::{Lss, LssError, RETRY_PAUSE};
use crate::bus::Mono;
use crate::canopen::lss::{Fastscan, LssAddress, Mode, Progress, Request, Step, Wait};
use std::time::Duration;

/// The shortest wait for an answer. Most steps of a scan take this time. If an answer arrives later, a part of the scan
/// is repeated.
const MIN_STEP_TIMEOUT: Duration = Duration::from_millis(4);

/// The shortest wait for an expected answer.
const MIN_CHECK_TIMEOUT: Duration = Duration::from_millis(50);

/// The time that program, host and bus take in addition to the device.
const HOST_MARGIN: Duration = Duration::from_millis(2);

/// The time for further slaves to answer after the first answer.
const GATHERING_TIME: Duration = Duration::from_millis(20);

/// The number of recent answers that determine the usual time.
const RECENT_ANSWERS: usize = 16;

/// The measured answer time of the slaves.
#[derive(Clone, Debug)]
struct Pace {
    /// The times of the recent answers. A new time replaces the oldest one.
    recent: [Duration; RECENT_ANSWERS],
    /// The number of answers.
    count: usize,
    timeout: Duration,
    /// The shortest time between two frames.
    pause: Duration,
}

impl Pace {
    fn new(timeout: Duration, pause: Duration) -> Pace {
        Pace { recent: [Duration::ZERO; RECENT_ANSWERS], count: 0, timeout, pause }
    }

    /// Records the time of an answer.
    fn record(&mut self, latency: Duration) {
        self.recent[self.count % RECENT_ANSWERS] = latency;
        self.count += 1;
    }

    /// Returns the time of the slowest recent answer. If there are more than two answers, the slowest one is ignored.
    fn slowest(&self) -> Duration {
        let mut sorted = self.recent;
        sorted.sort_unstable();
        sorted[RECENT_ANSWERS - if self.count > 2 { 2 } else { 1 }]
    }

    /// Returns the time-out of a step: 1.5 times the slowest answer plus a margin, doubled for each earlier time-out
    /// that was too short.
    fn step_timeout(&self, extensions: u8) -> Duration {
        self.extended(MIN_STEP_TIMEOUT.max(self.pause).max(self.slowest() * 3 / 2 + HOST_MARGIN), extensions)
    }

    /// Returns the time-out for an expected answer.
    fn check_timeout(&self, extensions: u8) -> Duration {
        self.extended(MIN_CHECK_TIMEOUT.max(self.step_timeout(0) * 4), extensions)
    }

    fn extended(&self, length: Duration, extensions: u8) -> Duration {
        length.saturating_mul(2u32.saturating_pow(extensions.into())).min(self.timeout.max(MIN_STEP_TIMEOUT))
    }
}

impl Lss<'_, '_> {
    /// Finds a slave without a node-ID and switches it to configuration state (51h); `None` if there is none. To find
    /// several slaves, give each one a node-ID before the next scan, or use [`Lss::fastscan_excluding`].
    ///
    /// All slaves are switched to waiting state first. The found address is confirmed by inquiry. If the slave does not
    /// support this, the address is confirmed by selective addressing.
    ///
    /// # Errors
    /// Slaves answer, but no address can be confirmed; the bus failed or the user interrupted.
    pub fn fastscan(&mut self) -> Result<Option<LssAddress>, LssError> {
        self.fastscan_excluding(&[], None)
    }

    /// Switches all slaves to waiting state, and asks the slaves without a node-ID to answer. Does not wait for the
    /// answer: see [`Lss::has_unconfigured_slave`]. Returns the moment of the request.
    ///
    /// # Errors
    /// The bus failed or the user interrupted.
    pub fn ask_unconfigured(&mut self) -> Result<Mono, LssError> {
        self.discard_received()?;
        self.switch_global(Mode::Waiting)?;
        self.send_now(Request::ANY_UNCONFIGURED.frame())
    }

    /// Whether a slave without a node-ID has answered since [`Lss::ask_unconfigured`], or answers within `timeout`
    /// after that moment. If no slave answers within 200 ms, the request is repeated, because some slaves need pauses.
    /// The wait for the second answer is at least 100 ms.
    ///
    /// # Errors
    /// The bus failed or the user interrupted.
    pub fn has_unconfigured_slave(&mut self, asked: Mono, timeout: Duration) -> Result<bool, LssError> {
        let mut until = asked + timeout;
        if self.master.timing.retries > 0 {
            if self.has_fastscan_answer(asked, asked + RETRY_PAUSE)? {
                return Ok(true);
            }
            let again = self.send_now(Request::ANY_UNCONFIGURED.frame())?;
            until = until.max(again + RETRY_PAUSE / 2);
        }
        self.has_fastscan_answer(asked, until)
    }

    fn has_fastscan_answer(&mut self, since: Mono, until: Mono) -> Result<bool, LssError> {
        let until = until.max(self.master.now());
        while !self.master.has_fastscan_answer_since(since) {
            if self.next(until)?.is_none() {
                return Ok(false);
            }
        }
        Ok(true)
    }

    /// Like [`Lss::fastscan`], but ignores the slaves in `excluded`. They are switched to configuration state: slaves
    /// in this state do not take part in fastscan (CiA 305, 7.5.3.5). Their settings do not change. A slave that takes
    /// part anyway is found again.
    ///
    /// `all_slaves` is the wait for an answer of any slave, for example if the slaves answered quickly before. If it is
    /// `None`, the time-out is used, and a scan without an answer is repeated with pauses.
    ///
    /// # Errors
    /// As [`Lss::fastscan`], or a slave in `excluded` does not answer.
    pub fn fastscan_excluding(
        &mut self,
        excluded: &[LssAddress],
        all_slaves: Option<Duration>,
    ) -> Result<Option<LssAddress>, LssError> {
        match self.scan_with_pauses(excluded, Duration::ZERO, all_slaves)? {
            None if self.master.timing.retries > 0 && all_slaves.is_none() => {
                self.scan_with_pauses(excluded, RETRY_PAUSE, None)
            }
            found => Ok(found),
        }
    }

    /// Runs a fastscan with at least `pause` between two frames.
    fn scan_with_pauses(
        &mut self,
        excluded: &[LssAddress],
        pause: Duration,
        all_slaves: Option<Duration>,
    ) -> Result<Option<LssAddress>, LssError> {
        let mut scan = Fastscan::new(self.master.timing.retries);
        let mut pace = Pace::new(self.master.timing.timeout, pause);
        self.is_configuring = true;
        self.discard_received()?;
        loop {
            let step = scan.step();
            if step.wait == Wait::AllSlaves {
                self.switch_global(Mode::Waiting)?;
                self.is_configuring = true;
                for address in excluded {
                    self.switch_selective(address)?;
                }
                self.pause(pause)?;
            }
            let next_at = self.master.now() + pause;
            let answers = self.step(step, &mut pace, all_slaves)?;
            self.pause(next_at.since(self.master.now()))?;
            match scan.on_end(answers) {
                Progress::Continue => {}
                Progress::NoneFound => {
                    self.is_configuring = !excluded.is_empty();
                    return Ok(None);
                }
                Progress::Found(address) if excluded.is_empty() => {
                    return self.confirm(address, &pace).map(|()| Some(address));
                }
                Progress::Found(address) => return self.readdress(address).map(|()| Some(address)),
                Progress::Failed(error) => return Err(LssError::Fastscan(error)),
            }
        }
    }

    /// Carries out one step, and returns the number of answers. `all_slaves` is as in [`Lss::fastscan_excluding`].
    fn step(&mut self, step: Step, pace: &mut Pace, all_slaves: Option<Duration>) -> Result<usize, LssError> {
        let sent = self.send_now(step.request.frame())?;
        let usual = sent + pace.step_timeout(step.extensions);
        let mut deadline = match step.wait {
            Wait::AllSlaves => sent + all_slaves.unwrap_or(pace.timeout),
            Wait::Advance => sent + pace.timeout,
            Wait::Check => sent + pace.check_timeout(step.extensions),
            Wait::Bit => usual,
        };
        let mut answers = 0;
        while let Some(received) = self.next(deadline)? {
            if !Fastscan::is_answer(&received.frame) {
                continue;
            }
            let at = received.at.mono;
            answers += 1;
            pace.record(at.since(sent));
            deadline = match step.wait {
                Wait::AllSlaves => deadline.min(end_of_gathering(sent, at)),
                _ if step.until_timeout => deadline.min(usual.max(at)),
                _ => return Ok(answers),
            };
        }
        Ok(answers)
    }

    fn confirm(&mut self, found: LssAddress, pace: &Pace) -> Result<(), LssError> {
        match self.inquire_address_within(pace.check_timeout(0), 0) {
            Ok(reported) if reported == found => Ok(()),
            Ok(reported) => Err(LssError::AddressMismatch { found, reported }),
            // The service is optional, and the answer may be lost or late. So selective addressing decides.
            Err(LssError::NoAnswer { .. }) => self.readdress(found),
            Err(error) => Err(error),
        }
    }

    /// Selects the found slave by its address. If it answers, it has this address and is the only one in configuration
    /// state.
    fn readdress(&mut self, found: LssAddress) -> Result<(), LssError> {
        self.switch_global(Mode::Waiting)?;
        self.switch_selective(&found)
    }
}

/// Estimates when all slaves have answered, from the slowest answer so far.
fn end_of_gathering(sent: Mono, answered: Mono) -> Mono {
    answered + GATHERING_TIME.max(answered.since(sent))
}
