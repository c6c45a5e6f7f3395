//! The node under test, and the requests that the cases use.

use super::lss::PendingSettings;
use super::settings::Settings;
use super::stimulus::{Stimulus, StimulusFailure};
use crate::bus::Received;
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use crate::canopen::nmt::{ErrorControlMessage, NmtCommand, NmtState};
use crate::canopen::object::ObjectId;
use crate::canopen::sdo::AbortCode;
use crate::device::description::SizeIndication;
use crate::device::eds::Eds;
use crate::master::{Master, MasterEvent, Request, SdoFailure};
use crate::node::state::{BOOT_TIMEOUT, HEARTBEAT_TIME};
use crate::node::wait::{Policy, wait};
use crate::node::{Error, Node};
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Duration;

/// The heartbeat time while states are observed.
pub(super) const STATE_PERIOD: Duration = Duration::from_millis(50);

/// The time that a device may take to change its state after a command, besides its heartbeat time.
const REACTION: Duration = Duration::from_millis(200);

/// The time to send a frame and to execute it, on a bus with 50 kbit/s or more.
pub(super) const SETTLE: Duration = Duration::from_millis(20);

/// The node under test.
pub(super) struct Session<'s, 'bus> {
    pub(super) master: &'s mut Master<'bus>,
    pub(super) node: Node,
    /// The EDS file that is compared with the device.
    pub(super) eds: Option<Arc<Eds>>,
    /// Changes the input of the device.
    pub(super) stimulus: Option<&'s mut dyn Stimulus>,
    /// Whether the input may not be the normal one.
    pub(super) is_input_changed: bool,
    /// Why the normal input could not be set again.
    pub(super) input_failure: Option<StimulusFailure>,
    /// Whether no other node is on the bus.
    pub(super) is_alone: bool,
    /// The settings before the first case.
    pub(super) settings: Settings,
    /// The NMT state before the first case, if it is known.
    pub(super) initial_state: Option<NmtState>,
    /// Whether an NMT command was sent.
    pub(super) used_nmt: bool,
    /// Whether the node may be in another state than PRE-OPERATIONAL, or restarting, because of the present case.
    pub(super) state_open: bool,
    /// Whether guarding requests were sent, so that life guarding may have failed.
    pub(super) guarded: bool,
    /// Whether a SYNC with a wrong length was sent, so that an error may be pending.
    pub(super) wrong_sync: bool,
    /// Whether the node may be in LSS configuration state.
    pub(super) lss_open: bool,
    /// The NMT command after which the node has answered LSS.
    pub(super) lss_command: Option<NmtCommand>,
    /// The node-ID and the bit rate that LSS may have changed.
    pub(super) lss_pending: PendingSettings,
    /// Whether only a reset of the node restores its settings.
    pub(super) needs_reset: bool,
    /// The sub-indices of 1010h whose stored settings the present case has changed.
    pub(super) stored: Vec<ObjectId>,
    /// Whether the last request may still be answered.
    pub(super) is_answer_open: bool,
    /// The object of a raw transfer that may be unfinished.
    pub(super) open_transfer: Option<ObjectId>,
}

/// The bytes of a request: command, multiplexer, data.
pub(super) fn request(command: u8, object: ObjectId, data: [u8; 4]) -> [u8; 8] {
    let [a, b, c] = object.multiplexer();
    let [d, e, f, g] = data;
    [command, a, b, c, d, e, f, g]
}

impl<'s, 'bus> Session<'s, 'bus> {
    pub(super) fn new(
        master: &'s mut Master<'bus>,
        node: Node,
        is_alone: bool,
        eds: Option<Arc<Eds>>,
        stimulus: Option<&'s mut dyn Stimulus>,
    ) -> Session<'s, 'bus> {
        Session {
            master,
            node,
            eds,
            stimulus,
            is_input_changed: false,
            input_failure: None,
            is_alone,
            settings: Settings::default(),
            initial_state: None,
            used_nmt: false,
            state_open: false,
            guarded: false,
            wrong_sync: false,
            lss_open: false,
            lss_command: None,
            lss_pending: PendingSettings::default(),
            needs_reset: false,
            stored: Vec::new(),
            is_answer_open: false,
            open_transfer: None,
        }
    }
}

impl Session<'_, '_> {
    pub(super) fn timeout(&self) -> Duration {
        self.master.timing().timeout
    }

    /// Sends an SDO frame as it is. Returns the first answer.
    pub(super) fn raw(&mut self, data: [u8; 8]) -> Result<Option<Frame>, Error> {
        self.raw_within(data, self.timeout())
    }

    /// The same with another time-out.
    pub(super) fn raw_within(&mut self, data: [u8; 8], timeout: Duration) -> Result<Option<Frame>, Error> {
        Ok(self.raw_received(data, timeout)?.map(|received| received.frame))
    }

    /// The same with the time of the answer.
    pub(super) fn raw_received(&mut self, data: [u8; 8], timeout: Duration) -> Result<Option<Received>, Error> {
        let id = self.node.id;
        let frame = Frame::full(CanId::sdo_request(id), data);
        self.is_answer_open = true;
        let answer = self.master.exchange(frame, CanId::sdo_response(id), timeout)?;
        self.is_answer_open = answer.is_none();
        Ok(answer)
    }

    /// Sends an initiate upload. Returns the answer.
    pub(super) fn upload(&mut self, object: ObjectId) -> Result<Option<Frame>, Error> {
        self.open_transfer = Some(object);
        self.raw(request(0x40, object, [0; 4]))
    }

    /// Sends an expedited download in the form that the device uses. The object is restored after the case.
    pub(super) fn download(&mut self, object: ObjectId, bytes: &[u8]) -> Result<Option<Frame>, Error> {
        self.touch(object)?;
        self.raw(self.download_request(object, bytes))
    }

    /// An expedited download in the form that the device uses.
    pub(super) fn download_request(&self, object: ObjectId, bytes: &[u8]) -> [u8; 8] {
        let mut data = [0; 4];
        let length = bytes.len().min(4);
        data[..length].copy_from_slice(&bytes[..length]);
        let unused = u8::try_from(4 - length).unwrap_or(0);
        let command = if self.omits_sizes() { 0x22 } else { 0x23 | unused << 2 };
        request(command, object, data)
    }

    /// Whether the device expects downloads without a size.
    pub(super) fn omits_sizes(&self) -> bool {
        let description = self.node.model.as_ref().map(|model| &model.description);
        description.is_some_and(|description| description.sdo.size == SizeIndication::Omitted)
    }

    /// Aborts a raw transfer that may be unfinished.
    pub(super) fn end_transfer(&mut self) -> Result<(), Error> {
        if let Some(object) = self.open_transfer.take() {
            self.raw_within(request(0x80, object, AbortCode::GENERAL.0.to_le_bytes()), SETTLE)?;
        }
        Ok(())
    }

    /// Aborts the transfer that this answer has started. An expedited answer or an abort has ended it already.
    pub(super) fn end_transfer_of(&mut self, answer: Option<&Frame>) -> Result<(), Error> {
        if answer.is_some_and(|frame| matches!(frame.data(), [0x40 | 0x41, ..])) {
            return self.end_transfer();
        }
        self.open_transfer = None;
        Ok(())
    }

    /// Reads an object. `None` if the device rejects the read.
    pub(super) fn read(&mut self, object: ObjectId) -> Result<Option<Vec<u8>>, Error> {
        match self.master.transfer_one(Request::read(self.node.id, object))? {
            Ok(answer) => {
                let mut uploaded =
                    answer.uploaded.unwrap_or_else(|| crate::canopen::sdo::Uploaded::complete(Vec::new()));
                let width = self.node.known_type(object).and_then(|data_type| data_type.width());
                if let Some(width) = width.filter(|_| !uploaded.indicated) {
                    uploaded.bytes.truncate(width);
                }
                Ok(Some(uploaded.bytes))
            }
            Err(error) if matches!(error.failure, SdoFailure::Refused(_)) => Ok(None),
            Err(error) => Err(error.into()),
        }
    }

    /// Reads an unsigned number of at most eight bytes.
    pub(super) fn number(&mut self, object: ObjectId) -> Result<Option<u64>, Error> {
        Ok(self.read(object)?.filter(|bytes| bytes.len() <= 8).map(|bytes| number(&bytes)))
    }

    /// Sends an NMT command to the node, and waits until it is on the bus.
    pub(super) fn command(&mut self, command: NmtCommand) -> Result<(), Error> {
        self.queue_command(command);
        self.pause(SETTLE)
    }

    /// Sends an NMT command to the node, without waiting.
    pub(super) fn queue_command(&mut self, command: NmtCommand) {
        (self.used_nmt, self.state_open) = (true, true);
        self.master.send(command.frame(Some(self.node.id)));
    }

    /// Sends a frame and waits until it is on the bus.
    pub(super) fn send(&mut self, frame: Frame) -> Result<(), Error> {
        self.master.send(frame);
        self.pause(SETTLE)
    }

    pub(super) fn pause(&mut self, time: Duration) -> Result<(), Error> {
        self.collect(time).map(drop)
    }

    /// All frames within this time.
    pub(super) fn collect(&mut self, time: Duration) -> Result<Vec<Received>, Error> {
        let mut frames = Vec::new();
        self.collect_until(time, |received| {
            frames.push(*received);
            false
        })?;
        Ok(frames)
    }

    /// Receives frames until `is_last`, or until the time has passed.
    pub(super) fn collect_until(
        &mut self,
        time: Duration,
        mut is_last: impl FnMut(&Received) -> bool,
    ) -> Result<bool, Error> {
        let until = self.master.now() + time;
        let waited = wait(self.master, until, Policy::Command, |_, event| match event {
            MasterEvent::Frame(received) if is_last(&received) => ControlFlow::Break(()),
            _ => ControlFlow::Continue(()),
        })?;
        Ok(waited.done().is_some())
    }

    /// The frames with COB-ID 700h + node-ID within this time.
    pub(super) fn lives(&mut self, time: Duration) -> Result<Vec<Received>, Error> {
        let id = CanId::heartbeat(self.node.id);
        let frames = self.collect(time)?;
        Ok(frames.into_iter().filter(|received| received.frame.id() == id && !received.frame.is_remote()).collect())
    }

    /// Switches on the heartbeat. `false` if the device does not allow it.
    pub(super) fn show_states(&mut self) -> Result<bool, Error> {
        let period = u16::try_from(STATE_PERIOD.as_millis()).unwrap_or(u16::MAX);
        Ok(self.number(HEARTBEAT_TIME)?.is_some() && self.try_write(HEARTBEAT_TIME, &period.to_le_bytes())?.is_none())
    }

    /// Waits for a heartbeat with this state. Returns the last state that was received.
    pub(super) fn await_state(&mut self, wanted: NmtState) -> Result<Option<NmtState>, Error> {
        let (node, mut last) = (self.node.id, None);
        self.collect_until(STATE_PERIOD * 3 + REACTION, |received| {
            match ErrorControlMessage::parse(&received.frame) {
                Some((id, ErrorControlMessage::State(state))) if id == node => {
                    last = Some(state);
                    state == wanted
                }
                _ => false,
            }
        })?;
        Ok(last)
    }

    /// Sends a reset and waits for the boot-up message. Returns the frames with COB-ID 700h + node-ID until then.
    pub(super) fn reset(&mut self, command: NmtCommand) -> Result<Vec<Received>, Error> {
        (self.used_nmt, self.state_open) = (true, true);
        self.settings.all_changed();
        let (id, timeout) = (self.node.id, BOOT_TIMEOUT.max(self.timeout()));
        let heartbeat = CanId::heartbeat(id);
        self.master.send(command.frame(Some(id)));
        let mut lives = Vec::new();
        self.collect_until(timeout, |received| {
            if received.frame.id() == heartbeat && !received.frame.is_remote() {
                lives.push(*received);
            }
            matches!(ErrorControlMessage::parse(&received.frame), Some((node, ErrorControlMessage::BootUp)) if node == id)
        })?;
        Ok(lives)
    }
}

/// A little-endian number.
pub(super) fn number(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte))
}
