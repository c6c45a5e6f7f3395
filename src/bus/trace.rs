//! A wrapper around any bus that writes every frame sent and received, as `candump -L` does.

use super::{BitRateControl, Bus, BusError, Event, Mono, Received, Stamp, Wall, delegate_bus};
use crate::canopen::frame::Frame;
use std::io::{self, BufWriter, Write};
use std::time::Duration;

/// How long a line may stay in the buffer: a trace is read while the program runs, and after it was
/// killed.
const FLUSH_EVERY: Duration = Duration::from_secs(1);

/// A bus whose traffic is written down, one line a frame: `(1436509052.249713) can0 044#2A366C2BBA`.
///
/// A frame that cannot be written is still delivered: the error comes once, between two frames, and
/// the trace ends there. A bus keeps working for whoever has to tidy up.
pub struct Traced<B> {
    bus: B,
    name: String,
    file: String,
    out: Option<BufWriter<Box<dyn Write>>>,
    /// Since when something is waiting in the buffer.
    dirty: Option<Mono>,
    failed: Option<BusError>,
}

impl<B: Bus> Traced<B> {
    /// Writes the traffic of `bus` to `out`, which error messages call `file`.
    pub fn new(bus: B, out: Box<dyn Write>, file: &str) -> Traced<B> {
        let name = bus.name().to_owned();
        Traced { bus, name, file: file.to_owned(), out: Some(BufWriter::new(out)), dirty: None, failed: None }
    }

    fn line(&mut self, at: Stamp, frame: &Frame) {
        let Some(out) = &mut self.out else { return };
        let written = write_line(out, at.wall, &self.name, frame);
        let since = *self.dirty.get_or_insert(at.mono);
        self.check(written);
        if at.mono.since(since) >= FLUSH_EVERY {
            self.flush();
        }
    }

    fn flush(&mut self) {
        self.dirty = None;
        if let Some(out) = &mut self.out {
            let flushed = out.flush();
            self.check(flushed);
        }
    }

    fn check(&mut self, written: io::Result<()>) {
        if let Err(source) = written {
            self.failed = Some(BusError::File { what: format!("write trace {}", self.file), source });
            // Dropping the writer would try to write the rest once more.
            if let Some(out) = self.out.take() {
                let _ = out.into_parts();
            }
        }
    }
}

/// One frame in the format of `candump -L`.
pub fn write_line(out: &mut dyn Write, wall: Wall, bus: &str, frame: &Frame) -> io::Result<()> {
    let at = wall.since_epoch();
    writeln!(out, "({:010}.{:06}) {bus} {frame}", at.as_secs(), at.subsec_micros())
}

impl<B: Bus> BitRateControl for Traced<B> {
    delegate_bus!(self, self.bus => bit_rate can_set_bit_rate set_bit_rate restore_bit_rate);
}

impl<B: Bus> Bus for Traced<B> {
    delegate_bus!(self, self.bus => timestamps is_live waits now mono listen receive_buffer late_drops);

    fn name(&self) -> &str {
        &self.name
    }

    fn send(&mut self, frame: &Frame) -> Result<(), BusError> {
        // Before it is handed over: an answer may come before the program comes to look at the clock.
        let at = self.bus.now();
        self.bus.send(frame)?;
        self.line(at, frame);
        Ok(())
    }

    fn receive(&mut self, deadline: Mono) -> Result<Event, BusError> {
        loop {
            if let Some(error) = self.failed.take() {
                return Err(error);
            }
            // Not longer than the buffer may wait, or a quiet bus would keep the last lines in it.
            let until = self.dirty.map_or(deadline, |since| deadline.min(since + FLUSH_EVERY));
            match self.bus.receive(until)? {
                Event::Timeout if until < deadline => self.flush(),
                event => {
                    if let Event::Frame(Received { frame, at }) = &event {
                        self.line(*at, frame);
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

    /// A file that can be looked into and can be full.
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
    fn a_quiet_bus_does_not_keep_lines_in_the_buffer() -> Result<(), BusError> {
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
    fn a_full_disk_loses_no_frame() -> Result<(), BusError> {
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
