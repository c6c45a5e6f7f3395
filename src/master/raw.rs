//! Sends requests that no state machine sends: with a wrong command, a wrong toggle bit, a wrong length.

use super::{Error, Master, MasterEvent};
use crate::bus::{BusError, Received};
use crate::canopen::frame::Frame;
use crate::canopen::id::CanId;
use std::time::Duration;

impl Master<'_> {
    /// Sends a frame as it is, and waits for the first data frame with the identifier `answer`. Returns `None` if there
    /// is none within `timeout`. Frames that were received earlier are ignored.
    ///
    /// The SDO client does not receive these frames. No SDO transfer may be in progress.
    ///
    /// # Errors
    /// The bus failed, or the user interrupted.
    pub fn exchange(&mut self, request: Frame, answer: CanId, timeout: Duration) -> Result<Option<Received>, Error> {
        self.exchange_watching(request, answer, timeout, &mut |_| {})
    }

    /// The same. `watch` is called with each frame that arrives until the answer, and with the answer.
    ///
    /// # Errors
    /// The bus failed, or the user interrupted.
    pub fn exchange_watching(
        &mut self,
        request: Frame,
        answer: CanId,
        timeout: Duration,
        watch: &mut dyn FnMut(&Received),
    ) -> Result<Option<Received>, Error> {
        self.outside_sdo(|master| {
            let now = master.now();
            while let Some(event) = master.next_raw(now)? {
                if let MasterEvent::Frame(received) = event {
                    watch(&received);
                }
            }
            master.send(request);
            master.wait_for_frame(answer, timeout, watch)
        })
    }

    /// Receives frames for this time, and ignores late answers to [`Master::exchange`]. The SDO client would treat them
    /// as answers from a second device.
    ///
    /// # Errors
    /// The bus failed, or the user interrupted.
    pub fn discard_answers(&mut self, time: Duration) -> Result<(), Error> {
        let until = self.now() + time;
        self.outside_sdo(|master| {
            while master.next_raw(until)?.is_some() {}
            Ok(())
        })
    }

    fn wait_for_frame(
        &mut self,
        answer: CanId,
        timeout: Duration,
        watch: &mut dyn FnMut(&Received),
    ) -> Result<Option<Received>, Error> {
        let until = self.now() + timeout;
        loop {
            match self.next_raw(until)? {
                Some(MasterEvent::Frame(received)) => {
                    watch(&received);
                    if received.frame.id() == answer && !received.frame.is_remote() {
                        return Ok(Some(received));
                    }
                }
                Some(_) => {}
                None => return Ok(None),
            }
        }
    }

    /// Returns the next event; `None` at the deadline.
    fn next_raw(&mut self, until: crate::bus::Mono) -> Result<Option<MasterEvent>, Error> {
        match self.next(until)? {
            MasterEvent::Deadline | MasterEvent::Ended => Ok(None),
            MasterEvent::Interrupted => Err(Error::Interrupted),
            MasterEvent::Link(false) => Err(Error::Bus(BusError::Down(self.bus.name().to_owned()))),
            event => Ok(Some(event)),
        }
    }

    /// Runs `work` without passing received frames to the SDO client.
    fn outside_sdo<T>(&mut self, work: impl FnOnce(&mut Self) -> Result<T, Error>) -> Result<T, Error> {
        self.bypasses_sdo = true;
        let result = work(self);
        self.bypasses_sdo = false;
        result
    }
}

#[cfg(test)]
mod tests {
    use super::super::Timing;
    use super::*;
    use crate::canopen::id::NodeId;
    use crate::sim::Bench;
    use std::path::Path;

    #[test]
    fn request_is_sent_as_it_is_and_both_frames_are_recorded() -> Result<(), Error> {
        let text = "clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 1\n";
        let mut bus = Bench::from_toml(text, Path::new("")).and_then(Bench::open).expect("a bench");
        let mut master = Master::new(&mut bus, Timing::default());
        let (node, timeout) = (NodeId::MIN, Duration::from_millis(100));
        let id = CanId::sdo_response(node);
        master.start_transcript();
        // E0h is not a command specifier of a client.
        let request = Frame::full(CanId::sdo_request(node), [0xe0, 0x00, 0x10, 0, 0, 0, 0, 0]);
        let answer = master.exchange(request, id, timeout)?.map(|received| received.frame.to_string());
        assert_eq!(answer.as_deref(), Some("581#8000100001000405"));
        // The device does not answer an abort.
        let request = Frame::full(CanId::sdo_request(node), [0x80, 0x00, 0x10, 0, 0, 0, 0, 8]);
        assert_eq!(master.exchange(request, id, timeout)?, None);
        let transcript = master.take_transcript();
        let frames: Vec<(bool, String)> =
            transcript.frames.iter().map(|one| (one.is_sent, one.frame.to_string())).collect();
        let expected = [
            (true, "601#E000100000000000"),
            (false, "701#00"),
            (false, "581#8000100001000405"),
            (true, "601#8000100000000008"),
        ];
        assert_eq!(frames, expected.map(|(is_sent, text)| (is_sent, text.to_owned())));
        Ok(())
    }
}
