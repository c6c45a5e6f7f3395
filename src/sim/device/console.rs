//! The non-volatile memory of a device in a file, and the commands of a user while the simulation runs.

use super::*;
use crate::sim::state::{StateFile, Stored};

/// The file with the stored settings of a device.
pub(super) struct Remembered {
    file: StateFile,
    last: Stored,
}

impl Device {
    /// Loads the non-volatile memory of the device from a file. The device then stores its settings to this file.
    pub(in crate::sim) fn remembering(mut self, file: StateFile) -> Device {
        let Memory { settings, objects, .. } = &mut self.memory;
        if let Some(stored) = file.get(&self.setup.model.description.name, self.setup.serial) {
            for pair in [&mut settings.active, &mut settings.pending, &mut settings.persistent] {
                pair.node = stored.node;
                pair.rate = stored.bit_rate.map_or(pair.rate, BitRate::At);
            }
            self.setup.bit_rate = stored.bit_rate.or(self.setup.bit_rate);
            objects.set_saved(stored.objects);
        }
        let last = Stored::of(settings, objects);
        self.remembered = Some(Remembered { file, last });
        self
    }

    /// Writes the settings that were stored since the last call.
    pub(super) fn remember(&mut self) {
        let Some(remembered) = &mut self.remembered else { return };
        let now = Stored::of(&self.memory.settings, &self.memory.objects);
        if now != remembered.last {
            let kind = &self.setup.model.description.name;
            // If the disk is full, the device keeps its memory in this run. The next change tries again.
            if remembered.file.set(kind, self.setup.serial, &now).is_ok() {
                remembered.last = now;
            }
        }
    }

    /// Executes a command of the user. `words` has no node-ID: `pressure 5.2bar`, `silent`, `talk`, `emcy F001`,
    /// `unplug`, `plug`.
    pub(in crate::sim) fn command(&mut self, words: &[&str], now: Mono, out: &mut Outbox) -> Result<(), String> {
        match *words {
            ["silent"] => self.is_silent = true,
            ["talk"] => self.is_silent = false,
            ["unplug"] => {
                self.drop_pending(out);
                self.phase = Phase::Off;
            }
            ["plug"] if self.phase == Phase::Off => crate::bus::memory::Station::power_on(self, now, out),
            ["plug"] => return Err("the device is not unplugged".to_owned()),
            ["emcy", code] => {
                let code = u16::from_str_radix(code.trim_start_matches("0x"), 16)
                    .map_err(|_| format!("\"{code}\" is not an emergency code (F001; 0000 ends it)"))?;
                match code {
                    0 => self.memory.emergencies.end(&mut self.memory.objects),
                    code => self.memory.emergencies.raise(&mut self.memory.objects, code, 0, 0),
                }
                self.send_emergencies(now, out);
            }
            [signal, value] => self.hold(signal, value, now, out)?,
            _ => return Err("unknown command".to_owned()),
        }
        Ok(())
    }

    /// Sets a signal to a constant value from now on: `pressure`, `5.2bar`.
    ///
    /// # Errors
    /// The device has no such signal, or the value has no unit of the signal.
    pub fn hold(&mut self, signal: &str, value: &str, now: Mono, out: &mut Outbox) -> Result<(), String> {
        self.memory.channels.hold(signal, value, now.since_start())?;
        if self.phase != Phase::Off {
            self.update_overloads(now);
            self.send_emergencies(now, out);
        }
        Ok(())
    }
}
