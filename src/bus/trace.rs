//! A wrapper around a bus that writes each sent and received frame, in the format of `candump -L` or pcapng.

use super::{BitRateControl, Bus, BusError, Event, Mono, Received, Stamp, Wall, delegate_bus, pcapng};
use crate::canopen::frame::Frame;
use std::io::{self, BufWriter, Write};
use std::time::Duration;

/// The longest time that a line stays in the buffer. So a trace can be read while the program runs, or after
/// it was killed.
const FLUSH_INTERVAL: Duration = Duration::from_secs(1);

/// A bus that writes a trace, one line per frame: `(1436509052.249713) can0 044#2A366C2BBA`. A file `*.pcapng` is
/// written in the pcapng format instead.
///
/// If writing fails, [`Bus::receive`] returns the error once, between two frames, and the trace ends. The bus keeps
/// working, so that the caller can clean up.
pub struct Traced<B> {
    bus: B,
    name: String,
    file: String,
    is_capture: bool,
    out: Option<BufWriter<Box<dyn Write>>>,
    /// The time of the oldest line in the buffer.
    buffered_since: Option<Mono>,
    failed: Option<BusError>,
}

impl<B: Bus> Traced<B> {
    /// Writes the traffic of `bus` to `out`. `file` is the name for error messages; its extension selects the format.
    pub fn new(bus: B, out: Box<dyn Write>, file: &str) -> Traced<B> {
        let name = bus.name().to_owned();
        let is_capture = file.ends_with(".pcapng");
        let (file, out) = (file.to_owned(), Some(BufWriter::new(out)));
        let mut traced = Traced { bus, name, file, is_capture, out, buffered_since: None, failed: None };
        if let (true, Some(out)) = (is_capture, &mut traced.out) {
            let written = out.write_all(&pcapng::header(&traced.name));
            traced.check_written(written);
        }
        traced
    }

    fn write_frame(&mut self, at: Stamp, frame: &Frame, is_sent: bool) {
        let Some(out) = &mut self.out else { return };
        let written = if self.is_capture {
            out.write_all(&pcapng::packet(at.wall, frame, is_sent))
        } else {
            write_line(out, at.wall, &self.name, frame)
        };
        let since = *self.buffered_since.get_or_insert(at.mono);
        self.check_written(written);
        if at.mono.since(since) >= FLUSH_INTERVAL {
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.buffered_since = None;
        if let Some(out) = &mut self.out {
            let flushed = out.flush();
            self.check_written(flushed);
        }
    }

    fn check_written(&mut self, written: io::Result<()>) {
        if let Err(source) = written {
            self.failed = Some(BusError::File { what: format!("write trace {}", self.file), source });
            // If the writer were dropped here, it would try to write the rest again.
            if let Some(out) = self.out.take() {
                let _ = out.into_parts();
            }
        }
    }
}

/// Writes one frame in the format of `candump -L`.
///
/// # Errors
/// The output cannot be written.
pub fn write_line(out: &mut dyn Write, wall: Wall, bus: &str, frame: &Frame) -> io::Result<()> {
    let at = wall.since_epoch();
    writeln!(out, "({:010}.{:06}) {bus} {frame}", at.as_secs(), at.subsec_micros())
}

impl<B: Bus> BitRateControl for Traced<B> {
    delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl<B: Bus> Bus for Traced<B> {
    delegate_bus!(self, self.bus => timestamps is_live sends_remote_frames waits now mono listen receive_buffer unreported_drops);

    fn name(&self) -> &str {
        &self.name
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        // The clock is read before sending, because an answer may arrive before a later reading.
        let at = self.bus.now();
        self.bus.send(frame)?;
        self.write_frame(at, frame, true);
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            if let Some(error) = self.failed.take() {
                return Err(error);
            }
            // On a quiet bus, the last lines must not stay in the buffer.
            let until = self.buffered_since.map_or(deadline, |since| deadline.min(since + FLUSH_INTERVAL));
            match self.bus.receive(until)? {
                Event::Timeout if until < deadline => self.flush(),
                event => {
                    if let Event::Frame(Received { frame, at }) = &event {
                        self.write_frame(*at, frame, false);
                    }
                    return Ok(event);
                }
            }
        }
    }

    fn finish(&mut self) -> Result<(), BusError> {
        self.flush();
        let finished = self.bus.finish();
        self.failed.take().map_or(finished, Err)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::script::Script;
    use std::cell::RefCell;
    use std::rc::Rc;

    /// A file for tests that may be full.
    #[derive(Clone, Default)]
    struct Disk {
        text: Rc<RefCell<Vec<u8>>>,
        full: bool,
    }

    impl Write for Disk {
        fn write(&mut self, buf: &[u8]) -> io::Result<usize> {
            if self.full {
                return Err(io::ErrorKind::StorageFull.into());
            }
            self.text.borrow_mut().extend_from_slice(buf);
            Ok(buf.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    impl Disk {
        fn text(&self) -> String {
            String::from_utf8_lossy(&self.text.borrow()).into_owned()
        }
    }

    fn frame(text: &str) -> Frame {
        text.parse().unwrap()
    }

    fn at(micros: u64) -> Mono {
        Mono::at(Duration::from_micros(micros))
    }

    #[test]
    fn frames_in_both_directions() -> Result<(), BusError> {
        let disk = Disk::default();
        let script = Script::new().frame(at(249_713), "044#2A366C2BBA").frame(at(300_000), "1FFFFFFF#R2");
        let mut bus = Traced::new(script, Box::new(disk.clone()), "t.log");
        bus.send(&frame("601#4000100000000000"))?;
        for _ in 0..2 {
            assert!(matches!(bus.receive(at(400_000))?, Event::Frame(_)));
        }
        assert_eq!(disk.text(), "");
        bus.finish()?;
        assert_eq!(
            disk.text(),
            "(1436509052.000000) script 601#4000100000000000\n\
             (1436509052.249713) script 044#2A366C2BBA\n\
             (1436509052.300000) script 1FFFFFFF#R2\n"
        );
        Ok(())
    }

    #[test]
    fn name_of_the_file_chooses_the_form() -> Result<(), BusError> {
        let disk = Disk::default();
        let mut bus = Traced::new(Script::new(), Box::new(disk.clone()), "t.pcapng");
        bus.send(&frame("080#"))?;
        bus.finish()?;
        let expected = [pcapng::header("script"), pcapng::packet(bus.now().wall, &frame("080#"), true)].concat();
        assert_eq!(*disk.text.borrow(), expected);
        Ok(())
    }

    #[test]
    fn on_a_quiet_bus_the_buffer_is_flushed() -> Result<(), BusError> {
        let disk = Disk::default();
        let mut bus = Traced::new(Script::new().frame(at(5), "080#"), Box::new(disk.clone()), "t.log");
        assert!(matches!(bus.receive(at(9))?, Event::Frame(_)));
        assert_eq!(bus.receive(at(900_000))?, Event::Timeout);
        assert_eq!(disk.text(), "");
        assert_eq!(bus.receive(at(5_000_000))?, Event::Timeout);
        assert_eq!(bus.now().mono, at(5_000_000));
        assert_eq!(disk.text(), "(1436509052.000005) script 080#\n");
        Ok(())
    }

    #[test]
    fn on_a_full_disk_all_frames_are_still_delivered() -> Result<(), BusError> {
        let disk = Disk { full: true, ..Disk::default() };
        let script = Script::new().frame(at(5), "080#").frame(at(2_000_000), "081#").frame(at(3_000_000), "082#");
        let mut bus = Traced::new(script, Box::new(disk), "t.log");
        let mut seen = Vec::new();
        let mut errors = Vec::new();
        loop {
            match bus.receive(at(4_000_000)) {
                Ok(Event::Frame(received)) => seen.push(received.frame.to_string()),
                Ok(_) => break,
                Err(error) => errors.push(error.to_string()),
            }
        }
        assert_eq!(seen, ["080#", "081#", "082#"]);
        assert_eq!(errors.len(), 1, "{errors:?}");
        assert!(errors[0].starts_with("write trace t.log: "), "{errors:?}");
        bus.send(&frame("000#8000"))?;
        bus.finish()
    }
}
