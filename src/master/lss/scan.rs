//! Fastscan over a bus: how long is waited for an answer that says no by not coming.

use super::{Lss, LssError};
use crate::bus::Mono;
use crate::canopen::lss::{Fastscan, LssAddress, Mode, Progress, Step, Wait};
use std::time::Duration;

/// The shortest wait for an answer. Most of the steps of a scan are this long, and an answer that comes later
/// costs a part of the scan.
const SHORTEST: Duration = Duration::from_millis(4);

/// The shortest wait for an answer that should come.
const CHECK: Duration = Duration::from_millis(50);

/// What the program, its host and the wire take beside the device.
const MARGIN: Duration = Duration::from_millis(2);

/// Everybody has so long after the first answer to answer, too.
const GATHERING: Duration = Duration::from_millis(20);

/// How fast the slaves answer.
#[derive(Clone, Copy, Debug)]
struct Pace {
    /// About the slowest of the latest answers.
    slowest: Duration,
    timeout: Duration,
}

impl Pace {
    /// An answer came after this time. What was slow once is forgotten after some answers.
    fn note(&mut self, latency: Duration) {
        self.slowest = latency.max(self.slowest * 7 / 8);
    }

    /// Half as long again as the slowest answer, and some more; twice as long each time that was too short.
    fn usual(self, impatience: u8) -> Duration {
        self.stretched(SHORTEST.max(self.slowest * 3 / 2 + MARGIN), impatience)
    }

    /// For an answer that should come.
    fn check(self, impatience: u8) -> Duration {
        self.stretched(CHECK.max(self.usual(0) * 4), impatience)
    }

    fn stretched(self, length: Duration, impatience: u8) -> Duration {
        length.saturating_mul(2u32.saturating_pow(impatience.into())).min(self.timeout.max(SHORTEST))
    }
}

impl Lss<'_, '_> {
    /// 51h: finds a slave without a node-ID and takes it to configuration state; `None` where there is none.
    /// Several slaves are found one after the other, each given a node-ID before the next is looked for, or set
    /// aside: see [`Lss::fastscan_beside`].
    ///
    /// Everybody is sent to waiting state first. That the slave in configuration state is the one found is
    /// confirmed by its own words, or where it has none by addressing it.
    ///
    /// # Errors
    /// Slaves that answer and have no address that holds; what stops everything.
    pub fn fastscan(&mut self) -> Result<Option<LssAddress>, LssError> {
        self.fastscan_beside(&[])
    }

    /// The same with slaves set aside: they are addressed and wait in configuration state, where they are not to take
    /// part (CiA 305, 7.5.3.5). Nothing is changed in them. One that takes part all the same is found again.
    ///
    /// # Errors
    /// As [`Lss::fastscan`], and one of `aside` that does not answer.
    pub fn fastscan_beside(&mut self, aside: &[LssAddress]) -> Result<Option<LssAddress>, LssError> {
        let mut scan = Fastscan::new(self.master.timing.retries);
        let mut pace = Pace { slowest: Duration::ZERO, timeout: self.master.timing.timeout };
        self.is_configuring = true;
        self.pass_by()?;
        loop {
            let step = scan.step();
            if step.wait == Wait::Everybody {
                self.switch_global(Mode::Waiting)?;
                self.is_configuring = true;
                for address in aside {
                    self.switch_selective(address)?;
                }
            }
            let answers = self.step(step, &mut pace)?;
            match scan.on_end(answers) {
                Progress::Continue => {}
                Progress::Nobody => {
                    self.is_configuring = !aside.is_empty();
                    return Ok(None);
                }
                Progress::Found(address) if aside.is_empty() => return self.confirm(address).map(|()| Some(address)),
                Progress::Found(address) => return self.readdress(address).map(|()| Some(address)),
                Progress::Failed(error) => return Err(LssError::Fastscan(error)),
            }
        }
    }

    /// Carries out one step: how many answers came.
    fn step(&mut self, step: Step, pace: &mut Pace) -> Result<usize, LssError> {
        let sent = self.put_out(step.request.frame())?;
        let usual = sent + pace.usual(step.impatience);
        let mut deadline = match step.wait {
            Wait::Everybody | Wait::Advance => sent + pace.timeout,
            Wait::Check => sent + pace.check(step.impatience),
            Wait::Bit => usual,
        };
        let mut answers = 0;
        while let Some(received) = self.next(deadline)? {
            if !Fastscan::is_answer(&received.frame) {
                continue;
            }
            answers += 1;
            let at = received.at.mono;
            pace.note(at.since(sent));
            deadline = match step.wait {
                Wait::Everybody => deadline.min(end_of_gathering(sent, at)),
                _ if step.to_the_end => deadline.min(usual.max(at)),
                _ => return Ok(answers),
            };
        }
        Ok(answers)
    }

    fn confirm(&mut self, found: LssAddress) -> Result<(), LssError> {
        match self.inquire_address() {
            Ok(told) if told == found => Ok(()),
            Ok(told) => Err(LssError::Mistaken { found, told }),
            // It need not know the service.
            Err(LssError::NoAnswer { .. }) => self.readdress(found),
            Err(error) => Err(error),
        }
    }

    /// Addresses the slave that was found. An answer is one to this address, and nobody else stays in configuration
    /// state.
    fn readdress(&mut self, found: LssAddress) -> Result<(), LssError> {
        self.switch_global(Mode::Waiting)?;
        self.switch_selective(&found)
    }
}

/// When everybody has answered, counted from the slowest so far.
fn end_of_gathering(sent: Mono, answered: Mono) -> Mono {
    answered + GATHERING.max(answered.since(sent))
}
