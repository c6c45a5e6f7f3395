//! A change under way: from the old settings to the new ones, or back.

use super::device::{Device, Trouble, Write};
use super::nmt::Switched;
use super::plan;
use super::settings::Settings;
use crate::canopen::sdo::AbortCode;
use crate::device::description::Remap;
use crate::master::{Error, SdoError, SdoFailure};
use crate::node::Node;
use crate::tasks::Failure;
use std::time::Duration;

/// The longest wait for a device that has restarted.
const BOOT_TIME: Duration = Duration::from_secs(3);

/// How often Ctrl-C is not listened to while the old settings are put back. Each costs one exchange.
const DEAF: u32 = 5;

/// A change under way.
pub(super) struct Change<'a, 'm, 'bus> {
    pub(super) device: Device<'m, 'bus>,
    pub(super) instrument: &'a Node,
    pub(super) old: Settings,
    pub(super) wanted: Settings,
    pub(super) remap: Remap,
    /// A description lists the device's objects.
    pub(super) known: bool,
    /// The device takes no bit 31.
    pub(super) never_off: bool,
    pub(super) state: Switched,
    /// The write under way.
    pub(super) at: Option<Write>,
    /// The write at which the change failed.
    pub(super) failed_at: Option<Write>,
    /// The last write that was confirmed.
    pub(super) done: Option<Write>,
    pub(super) remarks: Vec<String>,
    pub(super) warnings: Vec<String>,
}

/// Where an attempt to put things back has led.
enum Left {
    Old,
    New,
}

impl Change<'_, '_, '_> {
    /// Makes the change, or takes it back.
    pub(super) fn run(&mut self) -> Result<(), Failure> {
        match self.attempt() {
            Ok(()) => {}
            Err(trouble) => self.undo(trouble)?,
        }
        let said = self.put_state_back();
        self.warnings.extend(said);
        self.advise();
        Ok(())
    }

    fn writes(&self, now: &Settings, wanted: &Settings) -> Vec<Write> {
        plan::writes(now, wanted, self.remap, self.never_off)
    }

    /// From the old settings to those asked for, and reads them back.
    fn attempt(&mut self) -> Result<(), Trouble> {
        let (old, wanted) = (self.old.clone(), self.wanted.clone());
        if self.writes(&old, &wanted).is_empty() {
            return Ok(());
        }
        if self.remap == Remap::CountOnly && old.mapping != wanted.mapping {
            self.state.enter(&mut self.device)?;
        }
        let mut writes = self.writes(&old, &wanted);
        let off = writes.first().filter(|write| **write == self.off()).cloned();
        if let Some(off) = off {
            writes.remove(0);
            match self.step(&off) {
                Err(Trouble::Refused(error)) if self.goes_without_off(&error) => {
                    self.warnings.push(format!(
                        "node {}: {error}: {} is changed while it stays on",
                        self.device.node, old.number
                    ));
                    self.never_off = true;
                    self.remap = Remap::CountOnly;
                    if old.mapping != wanted.mapping {
                        self.state.enter(&mut self.device)?;
                    }
                    writes = self.writes(&old, &wanted);
                }
                result => result?,
            }
        }
        for write in &writes {
            self.step(write)?;
        }
        self.read_back(&wanted)
    }

    /// The write that switches the PDO off.
    fn off(&self) -> Write {
        Write::new(self.old.number.communication(1), self.old.cob_id.switched_off().0, 4)
    }

    /// Whether a refusal of bit 31 may be passed over: some devices do not know it and change their mapping
    /// without it. Of a device that is described it is known.
    fn goes_without_off(&self, error: &SdoError) -> bool {
        let unknown = matches!(
            error.failure,
            SdoFailure::Refused(AbortCode::VALUE | AbortCode::READ_ONLY | AbortCode::DEVICE_STATE)
        );
        unknown && (!self.known || self.remap == Remap::CountOnly)
    }

    /// One write. A device that is not in the state for it is put in PRE-OPERATIONAL, once.
    fn step(&mut self, write: &Write) -> Result<(), Trouble> {
        self.at = Some(write.clone());
        match self.device.write(write) {
            Err(Trouble::Refused(SdoError { failure: SdoFailure::Refused(AbortCode::DEVICE_STATE), .. }))
                if !self.state.is_switched() && *write != self.off() =>
            {
                self.state.enter(&mut self.device)?;
                self.device.write(write)?;
            }
            result => result?,
        }
        self.done = Some(write.clone());
        Ok(())
    }

    /// That the device holds these settings.
    fn read_back(&mut self, wanted: &Settings) -> Result<(), Trouble> {
        let found = Settings::read(&mut self.device, wanted.number, wanted.inhibit_100us.is_some())?;
        match found.difference(wanted) {
            Some((object, reads, wrote)) => Err(Trouble::NotKept(object, reads, wrote)),
            None if self.device.restarted => Err(Trouble::Restarted),
            None => Ok(()),
        }
    }

    /// Something went wrong: the old settings are put back. Success where the device turns out to have the new
    /// ones, completely.
    fn undo(&mut self, trouble: Trouble) -> Result<(), Failure> {
        self.failed_at = self.at.take();
        let (mut deaf, mut waited) = (DEAF, false);
        let last = loop {
            match self.put_back(&trouble) {
                Ok(Left::New) => {
                    self.warnings.extend(self.in_spite_of(&trouble));
                    return Ok(());
                }
                Ok(Left::Old) => {
                    let said = self.put_state_back().map(|said| format!("; {said}")).unwrap_or_default();
                    let end = format!("{} has its old mapping and parameters{said}", self.old.number);
                    return Err(self.failure(&trouble, &end));
                }
                Err(Trouble::Stopped(Error::Interrupted)) if deaf > 0 => deaf -= 1,
                Err(last @ (Trouble::Lost(_) | Trouble::Restarted)) if !waited => {
                    waited = true;
                    // Seen or not, it is tried once more: most devices without heartbeat boot for so long.
                    if !self.device.restarted && self.device.wait_for_life(BOOT_TIME).is_err() {
                        break last;
                    }
                }
                Err(last) => break last,
            }
        };
        Err(self.left(&trouble, &last))
    }

    fn put_back(&mut self, trouble: &Trouble) -> Result<Left, Trouble> {
        self.device.restarted = false;
        self.device.clear_the_air()?;
        let (old, wanted) = (self.old.clone(), self.wanted.clone());
        let now = Settings::read(&mut self.device, old.number, old.inhibit_100us.is_some())?;
        if now.difference(&wanted).is_none() {
            return Ok(Left::New);
        }
        let restarted = matches!(trouble, Trouble::Restarted);
        if restarted && self.remap == Remap::CountOnly && now.mapping != old.mapping {
            self.state.enter(&mut self.device)?;
        }
        for write in self.writes(&now, &old) {
            self.step(&write)?;
        }
        self.read_back(&old)?;
        Ok(Left::Old)
    }

    /// The NMT state before, where it was known; what is to be said about it.
    fn put_state_back(&mut self) -> Option<String> {
        let before = self.state.clone();
        for _ in 0..=DEAF {
            match self.state.put_back(&mut self.device) {
                Err(Trouble::Stopped(Error::Interrupted)) => self.state = before.clone(),
                Ok(remark) => return remark,
                Err(_) => break,
            }
        }
        Some(format!("the state of node {} was not put back", self.device.node))
    }
}
