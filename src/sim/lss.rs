//! The LSS slave of a simulated device, written from the tables of CiA 305, without the code of the master.

use super::settings::Settings;
use crate::canopen::id::NodeId;
use crate::sim::data::SimLss;
use std::collections::BTreeMap;
use std::time::Duration;

/// Vendor-ID, product code, revision number and serial number: 1018h:1 to 4.
pub(super) type Identity = [u32; 4];

/// The number of parts of an identity.
const PARTS: u8 = 4;

/// The state of the slave between two requests.
#[derive(Clone, Debug)]
pub(super) struct Slave {
    supported: SimLss,
    /// Services that are rejected, with their error codes.
    refuses: BTreeMap<u8, u8>,
    /// Whether every fastscan frame is answered in configuration state, as CANopenNode does.
    endless_fastscan: bool,
    is_configuring: bool,
    /// The number of matching parts of a selective address so far.
    selected: u8,
    /// The number of matching parts of an identification so far.
    identified: u8,
    /// The next part of the identity in a fastscan.
    scanned: u8,
}

/// The result of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Reply {
    pub(super) answer: Option<[u8; 8]>,
    pub(super) then: DeviceAction,
}

/// The action of the device after a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum DeviceAction {
    #[default]
    Nothing,
    /// The device was unconfigured and now has a node-ID.
    Boot,
    /// The device is silent for this time, changes its bit rate, and is silent for this time again.
    Activate(Duration),
}

impl Reply {
    fn with(bytes: &[u8]) -> Reply {
        let mut answer = [0; 8];
        answer.iter_mut().zip(bytes).for_each(|(to, from)| *to = *from);
        Reply { answer: Some(answer), then: DeviceAction::Nothing }
    }

    fn then(then: DeviceAction) -> Reply {
        Reply { answer: None, then }
    }
}

impl Slave {
    pub(super) fn new(supported: SimLss, refuses: BTreeMap<u8, u8>, endless_fastscan: bool) -> Slave {
        Slave { supported, refuses, endless_fastscan, is_configuring: false, selected: 0, identified: 0, scanned: 0 }
    }

    pub(super) fn is_configuring(&self) -> bool {
        self.is_configuring
    }

    /// Returns to waiting state, as at power-on and after every reset.
    pub(super) fn reset(&mut self) {
        (self.is_configuring, self.selected, self.identified, self.scanned) = (false, 0, 0, 0);
    }

    /// Handles one request of eight bytes.
    pub(super) fn request(&mut self, request: [u8; 8], identity: Identity, settings: &mut Settings) -> Reply {
        let [service, first, second, third, fourth, ..] = request;
        let number = u32::from_le_bytes([first, second, third, fourth]);
        // The parts of an address must follow each other directly, so every request resets the counts.
        let selected = std::mem::take(&mut self.selected);
        let identified = std::mem::take(&mut self.identified);
        let is_known = self.supported.services.is_empty() || self.supported.services.contains(&service);
        if !is_known {
            return Reply::default();
        }
        let is_unconfigured = settings.active.node.is_none() && settings.pending.node.is_none();
        match service {
            0x04 => self.switch(first, settings),
            0x40..=0x43 if !self.is_configuring => self.select(service - 0x40, selected, number, identity),
            0x46..=0x4b => self.identify(service - 0x46, identified, number, identity),
            0x4c if is_unconfigured => Reply::with(&[0x50]),
            0x51 if self.is_configuring && self.endless_fastscan => Reply::with(&[0x4f]),
            0x51 if is_unconfigured && !self.is_configuring => self.scan(request, number, identity),
            _ if !self.is_configuring => Reply::default(),
            0x11 | 0x13 | 0x17 if self.refuses.contains_key(&service) => {
                Reply::with(&[service, self.refuses.get(&service).copied().unwrap_or_default()])
            }
            0x11 => Reply::with(&[service, u8::from(!settings.configure_node(first))]),
            0x13 => Reply::with(&[service, u8::from(first != 0 || !settings.configure_rate(second))]),
            0x15 => {
                Reply::then(DeviceAction::Activate(Duration::from_millis(u16::from_le_bytes([first, second]).into())))
            }
            0x17 => {
                settings.persistent = settings.pending;
                Reply::with(&[service])
            }
            0x5a..=0x5d => {
                let [a, b, c, d] = identity[usize::from(service - 0x5a)].to_le_bytes();
                Reply::with(&[service, a, b, c, d])
            }
            0x5e => Reply::with(&[service, settings.active.node.map_or(0xff, NodeId::get)]),
            _ => Reply::default(),
        }
    }

    /// The service "switch state global".
    fn switch(&mut self, mode: u8, settings: &mut Settings) -> Reply {
        match mode {
            0 if self.is_configuring => {
                self.is_configuring = false;
                if settings.active.node.is_none() && settings.pending.node.is_some() {
                    return Reply::then(DeviceAction::Boot);
                }
            }
            1 => self.is_configuring = true,
            _ => {}
        }
        Reply::default()
    }

    /// The service "switch state selective": vendor-ID, product code, revision number and serial number must all match.
    fn select(&mut self, part: u8, so_far: u8, number: u32, identity: Identity) -> Reply {
        if part != 0 && part != so_far || identity[usize::from(part)] != number {
            return Reply::default();
        }
        self.selected = part + 1;
        if self.selected < PARTS {
            return Reply::default();
        }
        self.selected = 0;
        self.is_configuring = true;
        Reply::with(&[0x44, u8::from(self.supported.reports_mode)])
    }

    /// The service "identify remote slaves": vendor-ID and product code must match. Revision number and serial number
    /// must be in a range; the lower end is sent first.
    fn identify(&mut self, step: u8, so_far: u8, number: u32, identity: Identity) -> Reply {
        let [vendor, product, revision, serial] = identity;
        let fits = match step {
            0 => number == vendor,
            1 => number == product,
            2 => number <= revision,
            3 => revision <= number,
            4 => number <= serial,
            _ => serial <= number,
        };
        if step != 0 && step != so_far || !fits {
            return Reply::default();
        }
        self.identified = step + 1;
        if step == 5 { Reply::with(&[0x4f]) } else { Reply::default() }
    }

    /// Fastscan: compares one part of the identity from bit 31 down to bit `check`.
    fn scan(&mut self, request: [u8; 8], number: u32, identity: Identity) -> Reply {
        let [_, _, _, _, _, check, part, next] = request;
        if check == 0x80 {
            self.scanned = 0;
            return Reply::with(&[0x4f]);
        }
        if check > 31 || part >= PARTS || next >= PARTS || part != self.scanned {
            return Reply::default();
        }
        if identity[usize::from(part)] >> check != number >> check {
            return Reply::default();
        }
        if check == 0 {
            // After the last part the slave is found, and the scan restarts.
            self.is_configuring = next < part;
        }
        self.scanned = next;
        Reply::with(&[0x4f])
    }
}

#[cfg(test)]
mod tests;
