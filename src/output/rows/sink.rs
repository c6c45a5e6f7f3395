//! Where blocks of whole lines go: at once, or by a thread of its own, so that a disk that is slow and a pipe
//! that nobody reads do not keep the program from receiving.

use super::series::Series;
use std::collections::VecDeque;
use std::fs::File;
use std::io::{self, Seek, Write};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Where lines go.
#[derive(Debug)]
pub enum Target {
    /// A file. Of a regular one the first `keep` bytes stay and the rest goes with the first line; a line that
    /// could not be written whole is cut off again.
    File {
        /// Open for writing.
        file: File,
        /// How many of its bytes stay.
        keep: u64,
    },
    /// stdout, a pipe, a device.
    Stream(Box<dyn WriteDebug>),
}

/// A stream.
pub trait WriteDebug: Write + std::fmt::Debug + Send {}

impl<T: Write + std::fmt::Debug + Send> WriteDebug for T {}

/// How much may wait for a target that is slow, in bytes.
pub const CAPACITY: usize = 12 * 1024 * 1024;

/// How often it is asked whether to wait on.
const PULSE: Duration = Duration::from_millis(100);

/// What is to be done, in this order.
#[derive(Debug)]
enum Job {
    /// Lines before the first row: of the next file of the series, or where the last one ended.
    Head { next: bool, bytes: Vec<u8> },
    /// So many rows.
    Rows { bytes: Vec<u8>, rows: u64 },
}

/// Takes lines.
#[derive(Debug)]
pub struct Sink(Way);

#[derive(Debug)]
enum Way {
    /// Whoever hands lines over waits until they are written.
    Direct { writer: Writer, failed: bool, lost: u64 },
    /// A thread writes.
    Queued { queue: Arc<Queue>, capacity: usize, late: u64, lost: u64 },
}

#[derive(Debug, Default)]
struct Queue {
    state: Mutex<State>,
    /// Something has come or gone.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct State {
    jobs: VecDeque<Job>,
    /// Bytes in the jobs, and in the one under way.
    bytes: usize,
    /// Rows in them.
    rows: u64,
    error: Option<io::Error>,
    failed: bool,
    /// Rows that failed.
    lost: u64,
    /// No job will follow.
    closed: bool,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, State> {
        // Nothing here leaves a state half changed.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Does what is to be done until the end.
    fn work(&self, mut writer: Writer) {
        loop {
            let mut state = self.lock();
            let job = loop {
                match state.jobs.pop_front() {
                    Some(job) => break job,
                    None if state.closed => return,
                    None => state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                }
            };
            let failed = state.failed;
            drop(state);
            let result =
                if failed { Err((None, job.rows())) } else { writer.take(&job).map_err(|(e, l)| (Some(e), l)) };
            let mut state = self.lock();
            // Who was in a hurry at the end has counted them already.
            state.bytes = state.bytes.saturating_sub(job.bytes().len());
            state.rows = state.rows.saturating_sub(job.rows());
            if let Err((error, lost)) = result {
                state.failed = true;
                state.lost += lost;
                state.error = state.error.take().or(error);
            }
            drop(state);
            self.changed.notify_all();
        }
    }
}

impl Job {
    fn bytes(&self) -> &[u8] {
        match self {
            Job::Head { bytes, .. } | Job::Rows { bytes, .. } => bytes,
        }
    }

    fn rows(&self) -> u64 {
        match self {
            Job::Head { .. } => 0,
            Job::Rows { rows, .. } => *rows,
        }
    }
}

impl Sink {
    /// Everything is written as it is handed over: for a bus that waits.
    pub fn direct(target: Target, series: Option<Series>) -> Sink {
        Sink(Way::Direct { writer: Writer::new(target, series), failed: false, lost: 0 })
    }

    /// A thread writes, up to `capacity` bytes behind; what comes then is lost.
    ///
    /// # Errors
    /// No thread is to be had.
    pub fn queued(target: Target, series: Option<Series>, capacity: usize) -> io::Result<Sink> {
        let queue = Arc::new(Queue::default());
        let theirs = Arc::clone(&queue);
        let writer = Writer::new(target, series);
        std::thread::Builder::new().name("rows".to_owned()).spawn(move || theirs.work(writer))?;
        Ok(Sink(Way::Queued { queue, capacity, late: 0, lost: 0 }))
    }

    /// Takes a head; it is never left out, so that rows always stand under their own. With `next` it is that of
    /// the next file of the series.
    pub(in crate::output) fn head(&mut self, next: bool, bytes: Vec<u8>) -> io::Result<()> {
        self.put(Job::Head { next, bytes })
    }

    /// Takes so many rows and leaves an empty block.
    pub(in crate::output) fn rows(&mut self, block: &mut Vec<u8>, rows: u64) -> io::Result<()> {
        if block.is_empty() {
            return self.check();
        }
        if let Way::Direct { writer, failed: failed @ false, lost } = &mut self.0 {
            // The same block again and again.
            let result = writer.rows(block, rows);
            block.clear();
            return result.map_err(|(error, left)| {
                *failed = true;
                *lost += left;
                error
            });
        }
        let size = block.capacity();
        let bytes = std::mem::replace(block, Vec::with_capacity(size));
        self.put(Job::Rows { bytes, rows })
    }

    fn put(&mut self, job: Job) -> io::Result<()> {
        match &mut self.0 {
            Way::Direct { failed: true, lost, .. } => *lost += job.rows(),
            Way::Direct { writer, failed, lost } => {
                return writer.take(&job).map_err(|(error, left)| {
                    *failed = true;
                    *lost += left;
                    error
                });
            }
            Way::Queued { queue, capacity, late, lost } => {
                let mut state = queue.lock();
                let full = state.bytes > 0 && state.bytes + job.bytes().len() > *capacity;
                if state.failed {
                    *lost += job.rows();
                } else if full && matches!(job, Job::Rows { .. }) {
                    *late += job.rows();
                } else {
                    state.bytes += job.bytes().len();
                    state.rows += job.rows();
                    state.jobs.push_back(job);
                    queue.changed.notify_all();
                }
                return state.error.take().map_or(Ok(()), Err);
            }
        }
        Ok(())
    }

    /// Whether something has failed since it was last asked.
    pub(in crate::output) fn check(&mut self) -> io::Result<()> {
        match &self.0 {
            Way::Direct { .. } => Ok(()),
            Way::Queued { queue, .. } => queue.lock().error.take().map_or(Ok(()), Err),
        }
    }

    /// Waits until everything is written. While that does not go on, `give_up` is asked every [`PULSE`]; once it
    /// says so, what is left is lost.
    pub(in crate::output) fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        let Way::Queued { queue, lost, .. } = &mut self.0 else { return Ok(()) };
        let mut state = queue.lock();
        state.closed = true;
        queue.changed.notify_all();
        while state.bytes > 0 {
            let before = state.bytes;
            let waited = queue.changed.wait_timeout(state, PULSE);
            let (next, timed_out) = waited.unwrap_or_else(PoisonError::into_inner);
            state = next;
            if timed_out.timed_out() && state.bytes == before && give_up() {
                *lost += std::mem::take(&mut state.rows);
                state.jobs.clear();
                break;
            }
        }
        state.error.take().map_or(Ok(()), Err)
    }

    /// Rows that were lost: they came too fast, or could not be written.
    pub fn lost(&self) -> u64 {
        match &self.0 {
            Way::Direct { lost, .. } => *lost,
            Way::Queued { queue, late, lost, .. } => *late + *lost + queue.lock().lost,
        }
    }

    /// Those that came too fast.
    pub(super) fn late(&self) -> u64 {
        match &self.0 {
            Way::Direct { .. } => 0,
            Way::Queued { late, .. } => *late,
        }
    }
}

/// Writes lines.
#[derive(Debug)]
struct Writer {
    target: Target,
    series: Option<Series>,
    begun: bool,
}

/// What failed, and how many rows with it.
type Failed = (io::Error, u64);

impl Writer {
    fn new(target: Target, series: Option<Series>) -> Writer {
        Writer { target, series, begun: false }
    }

    fn take(&mut self, job: &Job) -> Result<(), Failed> {
        match job {
            Job::Head { next, bytes } => {
                self.begin().map_err(|error| (error, 0))?;
                if let (true, Some(series)) = (next, &mut self.series) {
                    let file = series.create().map_err(|error| (error, 0))?;
                    self.target = Target::File { file, keep: 0 };
                }
                self.rows(bytes, 0)
            }
            Job::Rows { bytes, rows } => self.rows(bytes, *rows),
        }
    }

    /// Writes whole lines. On failure the file ends with a whole one.
    fn rows(&mut self, bytes: &[u8], rows: u64) -> Result<(), Failed> {
        self.begin().map_err(|error| (error, rows))?;
        write_whole(&mut self.target, bytes).map_err(|(error, kept)| {
            let lines = bytes[kept..].iter().filter(|&&byte| byte == b'\n').count() as u64;
            (error, lines.min(rows))
        })
    }

    /// Before the first line: what stands in the file and is not to stay goes.
    fn begin(&mut self) -> io::Result<()> {
        if std::mem::replace(&mut self.begun, true) {
            return Ok(());
        }
        if let Some(series) = &mut self.series {
            series.mend()?;
        }
        if let Target::File { file, keep } = &mut self.target
            && file.metadata()?.is_file()
        {
            file.set_len(*keep)?;
            file.seek(io::SeekFrom::End(0))?;
        }
        Ok(())
    }
}

/// Writes all of `bytes`, or up to a line end. On failure it tells how many bytes of whole lines were kept.
fn write_whole(target: &mut Target, bytes: &[u8]) -> Result<(), (io::Error, usize)> {
    let mut done = 0;
    while done < bytes.len() {
        let result = match target {
            Target::File { file, .. } => file.write(&bytes[done..]),
            Target::Stream(stream) => stream.write(&bytes[done..]),
        };
        match result {
            Ok(0) => return Err((io::ErrorKind::WriteZero.into(), cut(target, bytes, done))),
            Ok(count) => done += count,
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err((error, cut(target, bytes, done))),
        }
    }
    if let Target::Stream(stream) = target {
        stream.flush().map_err(|error| (error, bytes.len()))?;
    }
    Ok(())
}

/// Cuts a file back to the last whole line.
fn cut(target: &mut Target, bytes: &[u8], done: usize) -> usize {
    let whole = bytes[..done].iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    if let Target::File { file, .. } = target {
        let excess = (done - whole) as u64;
        if let Ok(metadata) = file.metadata()
            && metadata.is_file()
            && excess > 0
        {
            // What the disk refuses here it has refused before; the cause is reported by the caller.
            let _ = file.set_len(metadata.len().saturating_sub(excess));
        }
    }
    whole
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// Takes so many bytes, then its disk is full.
    #[derive(Debug)]
    struct Small(usize);

    impl Write for Small {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let room = self.0.min(bytes.len());
            self.0 -= room;
            if room == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(room) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Writes each block only when it is told to.
    #[derive(Debug)]
    struct Gate {
        go: Receiver<()>,
        written: Sender<String>,
    }

    impl Write for Gate {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.go.recv().map_err(io::Error::other)?;
            self.written.send(String::from_utf8_lossy(bytes).into_owned()).map_err(io::Error::other)?;
            Ok(bytes.len())
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn gate() -> (Target, Sender<()>, Receiver<String>) {
        let ((go, gone), (written, read)) = (channel(), channel());
        (Target::Stream(Box::new(Gate { go: gone, written })), go, read)
    }

    fn put(sink: &mut Sink, text: &str) -> io::Result<()> {
        let rows = text.lines().count() as u64;
        sink.rows(&mut text.as_bytes().to_vec(), rows)
    }

    #[test]
    fn what_does_not_fit_is_counted_whole_lines_stay() {
        for queued in [false, true] {
            let target = Target::Stream(Box::new(Small(9)));
            let mut sink =
                if queued { Sink::queued(target, None, 1000).expect("a thread") } else { Sink::direct(target, None) };
            // 4 + 4 + 1 bytes of 20 fit: the head, which is no row, and one row of four.
            let mut kinds = vec![sink.head(false, b"hea\n".to_vec()), put(&mut sink, "aaa\nbbb\nccc\n")];
            kinds.push(put(&mut sink, "ddd\n"));
            kinds.push(sink.finish(&mut || false));
            let failed: Vec<io::ErrorKind> = kinds.into_iter().filter_map(|kind| Some(kind.err()?.kind())).collect();
            assert_eq!(failed, [io::ErrorKind::StorageFull], "said once");
            assert_eq!(sink.lost(), 3, "two did not fit, one came later");
        }
    }

    #[test]
    fn a_row_that_was_written_in_part_is_taken_back() {
        let mut file = tempfile::tempfile().expect("a file");
        file.write_all(b"head\naaa\nbb").expect("written");
        let mut target = Target::File { file: file.try_clone().expect("a file"), keep: 0 };
        assert_eq!(cut(&mut target, b"aaa\nbbb\n", 6), 4);
        assert_eq!(file.metadata().expect("a file").len(), 9, "head and the first row");
        assert_eq!(cut(&mut target, b"ccc\n", 0), 0);
        assert_eq!(file.metadata().expect("a file").len(), 9);
    }

    #[test]
    fn a_stalled_target_loses_what_is_more_than_the_capacity_but_no_head() {
        let (target, go, written) = gate();
        let mut sink = Sink::queued(target, None, 12).expect("a thread");
        for text in ["aaa\n", "bbb\n", "ccc\n", "ddd\neee\n"] {
            put(&mut sink, text).expect("nothing fails");
        }
        assert_eq!(sink.lost(), 2, "12 bytes wait");
        sink.head(false, b"head\n".to_vec()).expect("nothing fails");
        assert_eq!(sink.lost(), 2);
        (0..4).for_each(|_| go.send(()).expect("it writes"));
        sink.finish(&mut || false).expect("nothing fails");
        assert_eq!(written.try_iter().collect::<Vec<_>>(), ["aaa\n", "bbb\n", "ccc\n", "head\n"]);
        assert_eq!(sink.lost(), 2);
    }

    #[test]
    fn who_is_in_a_hurry_does_not_wait_for_ever() {
        let (target, _go, written) = gate();
        let mut sink = Sink::queued(target, None, 100).expect("a thread");
        put(&mut sink, "aaa\nbbb\n").expect("nothing fails");
        put(&mut sink, "ccc\n").expect("nothing fails");
        let mut asked = 0;
        let mut give_up = || {
            asked += 1;
            asked == 2
        };
        sink.finish(&mut give_up).expect("nothing fails");
        assert_eq!((sink.lost(), written.try_iter().count()), (3, 0));
    }
}
