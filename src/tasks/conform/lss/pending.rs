//! Node-ID and bit rate that a case has set. The device would use them after a reset, so the old values are set again.

use super::super::session::Session;
use super::is_accepted;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::device::assign::{AssignKind, RateTable};
use crate::node::Error;
use std::collections::BTreeMap;

/// A setting that LSS can change.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum LssSetting {
    /// The node-ID (11h).
    NodeId,
    /// The bit rate (13h).
    BitRate,
}

impl LssSetting {
    /// The word in reports.
    pub fn name(self) -> &'static str {
        match self {
            LssSetting::NodeId => "node-ID",
            LssSetting::BitRate => "bit rate",
        }
    }
}

/// The settings that a case has sent.
#[derive(Clone, Debug, Default)]
pub(in super::super) struct PendingSettings {
    /// The settings that may have a new value, and whether the device has acknowledged a new value.
    sent: BTreeMap<LssSetting, bool>,
    /// Whether the present bit rate was set again. This ends automatic detection.
    was_rate_set: bool,
    /// The settings that could not be set again.
    pub(in super::super) failed: Vec<LssSetting>,
}

impl Session<'_, '_> {
    /// Sends a node-ID (11h) or a bit rate (13h). After the case, the old value is set again, unless the device has
    /// rejected the new value.
    pub(super) fn configure(&mut self, setting: LssSetting, request: &[u8]) -> Result<Option<Frame>, Error> {
        // Noted before the answer: it may get lost, or Ctrl-C may end the wait.
        let before = self.lss_pending.sent.get(&setting).copied();
        self.lss_pending.sent.insert(setting, before == Some(true));
        let answer = self.lss(request)?;
        match (&answer, before) {
            (Some(frame), _) if is_accepted(frame, request[0]) => {
                self.lss_pending.sent.insert(setting, true);
            }
            (Some(_), None) => {
                self.lss_pending.sent.remove(&setting);
            }
            (Some(_), Some(_)) | (None, _) => {}
        }
        Ok(answer)
    }

    /// The code of the present bit rate; `None` if the bit rate of the bus or its code is unknown.
    pub(super) fn present_rate_code(&self) -> Option<u8> {
        self.rate_table().index_of(self.master.bus().bit_rate()?)
    }

    /// Whether a store could end automatic detection of the bit rate for good.
    pub(super) fn may_store_fixed_rate(&self) -> bool {
        self.lss_pending.was_rate_set && (self.node.model.is_none() || self.rate_table().auto().is_some())
    }

    /// The bit rates of the device for LSS.
    pub(super) fn rate_table(&self) -> RateTable {
        RateTable::of(self.node.model.as_ref().map(|model| &model.description), AssignKind::Lss)
    }

    /// Sets the old node-ID and bit rate again, and switches to waiting state.
    pub(in super::super) fn leave_lss(&mut self) -> Result<(), Error> {
        if !self.lss_pending.sent.is_empty() {
            self.switch(1)?;
        }
        while let Some((&setting, &was_accepted)) = self.lss_pending.sent.first_key_value() {
            let request = match setting {
                LssSetting::NodeId => Some([0x11, self.node.id.get(), 0]),
                LssSetting::BitRate => self.present_rate_code().map(|code| [0x13, 0, code]),
            };
            self.lss_pending.was_rate_set |= setting == LssSetting::BitRate;
            let answer = request.map(|request| self.lss(&request)).transpose()?.flatten();
            let is_set = request.zip(answer).is_some_and(|(request, frame)| is_accepted(&frame, request[0]));
            // A device that answers neither request does not have the service.
            if !is_set && (was_accepted || answer.is_some()) {
                self.lss_pending.failed.push(setting);
            }
            self.lss_pending.sent.remove(&setting);
        }
        if self.lss_open {
            let frame = Frame::full(CanId::LSS_MASTER, [0x04, 0, 0, 0, 0, 0, 0, 0]);
            self.send(frame)?;
            self.lss_open = false;
        }
        Ok(())
    }
}
