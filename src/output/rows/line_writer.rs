//! Writes whole lines, directly or in a thread. With the thread, a slow disk or a blocked pipe does not stop the
//! reception of frames.

use super::series::Series;
use super::target::{FileChange, HeaderPlace, OutputTarget, TargetWriter, WriteFailure};
use std::collections::VecDeque;
use std::io;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// The largest number of bytes that wait for a slow target. Further rows are lost.
pub const QUEUE_CAPACITY: usize = 12 * 1024 * 1024;

/// The interval at which [`LineWriter::finish`] asks whether to stop waiting.
const GIVE_UP_INTERVAL: Duration = Duration::from_millis(100);

/// Lines to be written.
#[derive(Debug)]
enum Job {
    /// The lines before the first row.
    Header { place: HeaderPlace, bytes: Vec<u8> },
    /// This many rows.
    Rows { bytes: Vec<u8>, rows: u64 },
}

impl Job {
    fn bytes(&self) -> &[u8] {
        match self {
            Job::Header { bytes, .. } | Job::Rows { bytes, .. } => bytes,
        }
    }

    /// The size of the job in the queue. An empty job also has a size, because the writer waits for it.
    fn cost(&self) -> usize {
        self.bytes().len() + 1
    }

    fn rows(&self) -> u64 {
        match self {
            Job::Header { .. } => 0,
            Job::Rows { rows, .. } => *rows,
        }
    }

    fn run(&self, writer: &mut TargetWriter) -> Result<(), WriteFailure> {
        match self {
            Job::Header { place, bytes } => writer.set_header(*place, bytes),
            Job::Rows { bytes, .. } if bytes.is_empty() => writer.check_file().map_err(|error| (error, 0)),
            Job::Rows { bytes, rows } => writer.write_rows(bytes, *rows),
        }
    }
}

/// Writes lines.
#[derive(Debug)]
pub struct LineWriter(Inner);

#[derive(Debug)]
enum Inner {
    /// The caller waits until the lines are written.
    Direct { writer: TargetWriter, has_failed: bool, lost: u64 },
    /// A thread writes.
    Queued { queue: Arc<Queue>, capacity: usize, overflowed: u64, lost: u64 },
}

#[derive(Debug, Default)]
struct Queue {
    state: Mutex<QueueState>,
    /// Notified if a job was added or done.
    changed: Condvar,
}

#[derive(Debug, Default)]
struct QueueState {
    jobs: VecDeque<Job>,
    /// Total size of the jobs, including the job being written.
    bytes: usize,
    /// Rows in these jobs.
    rows: u64,
    error: Option<io::Error>,
    changes: Vec<FileChange>,
    has_failed: bool,
    /// Rows that could not be written.
    lost: u64,
    /// Whether the queue is closed for new jobs.
    is_closed: bool,
}

impl Queue {
    fn lock(&self) -> MutexGuard<'_, QueueState> {
        // A poisoned lock is harmless, because a panic cannot interrupt a change of the state.
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The thread: writes jobs until the queue is closed and empty.
    fn work(&self, mut writer: TargetWriter) {
        loop {
            let mut state = self.lock();
            let job = loop {
                match state.jobs.pop_front() {
                    Some(job) => break job,
                    None if state.is_closed => return,
                    None => state = self.changed.wait(state).unwrap_or_else(PoisonError::into_inner),
                }
            };
            let has_failed = state.has_failed;
            drop(state);
            let result = if has_failed {
                Err((None, job.rows()))
            } else {
                job.run(&mut writer).map_err(|(error, lost)| (Some(error), lost))
            };
            let mut state = self.lock();
            // `finish` may have stopped waiting and counted these rows as lost.
            state.bytes = state.bytes.saturating_sub(job.cost());
            state.changes.append(&mut writer.take_changes());
            state.rows = state.rows.saturating_sub(job.rows());
            if let Err((error, lost)) = result {
                state.has_failed = true;
                state.lost += lost;
                state.error = state.error.take().or(error);
            }
            drop(state);
            self.changed.notify_all();
        }
    }
}

impl LineWriter {
    /// Writes each block before the call returns. For a bus that waits for the program.
    pub fn direct(target: OutputTarget, series: Option<Series>) -> LineWriter {
        LineWriter(Inner::Direct { writer: TargetWriter::new(target, series), has_failed: false, lost: 0 })
    }

    /// Writes in a thread. At most `capacity` bytes wait; further rows are lost.
    ///
    /// # Errors
    /// The thread cannot be started.
    pub fn queued(target: OutputTarget, series: Option<Series>, capacity: usize) -> io::Result<LineWriter> {
        let queue = Arc::new(Queue::default());
        let shared = Arc::clone(&queue);
        let writer = TargetWriter::new(target, series);
        std::thread::Builder::new().name("rows".to_owned()).spawn(move || shared.work(writer))?;
        Ok(LineWriter(Inner::Queued { queue, capacity, overflowed: 0, lost: 0 }))
    }

    /// Starts the next file of the series with this header. A header is never lost.
    pub(super) fn start_file(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.put(Job::Header { place: HeaderPlace::NextFile, bytes })
    }

    /// Sets the header of the file. The file contains it already, or it is written with the first row. It is written
    /// again if another program truncates the file.
    pub(in crate::output) fn keep_header(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.put(Job::Header { place: HeaderPlace::Present, bytes })
    }

    /// Writes lines before further rows in the current file. These lines are never lost.
    pub(in crate::output) fn put_header(&mut self, bytes: Vec<u8>) -> io::Result<()> {
        self.put(Job::Header { place: HeaderPlace::CurrentFile, bytes })
    }

    /// Writes this many rows, and empties the block.
    pub(in crate::output) fn put_rows(&mut self, block: &mut Vec<u8>, rows: u64) -> io::Result<()> {
        if block.is_empty() {
            return self.check();
        }
        if let Inner::Direct { writer, has_failed: has_failed @ false, lost } = &mut self.0 {
            // The caller uses the block again, without an allocation.
            let result = writer.write_rows(block, rows);
            block.clear();
            return result.map_err(|(error, lost_rows)| {
                *has_failed = true;
                *lost += lost_rows;
                error
            });
        }
        let size = block.capacity();
        let bytes = std::mem::replace(block, Vec::with_capacity(size));
        self.put(Job::Rows { bytes, rows })
    }

    fn put(&mut self, job: Job) -> io::Result<()> {
        match &mut self.0 {
            Inner::Direct { has_failed: true, lost, .. } => {
                *lost += job.rows();
                Ok(())
            }
            Inner::Direct { writer, has_failed, lost } => job.run(writer).map_err(|(error, lost_rows)| {
                *has_failed = true;
                *lost += lost_rows;
                error
            }),
            Inner::Queued { queue, capacity, overflowed, lost } => {
                let mut state = queue.lock();
                let is_full = state.bytes > 0 && state.bytes + job.cost() > *capacity;
                if state.has_failed {
                    *lost += job.rows();
                } else if is_full && matches!(job, Job::Rows { .. }) {
                    *overflowed += job.rows();
                } else {
                    state.bytes += job.cost();
                    state.rows += job.rows();
                    state.jobs.push_back(job);
                    queue.changed.notify_all();
                }
                state.error.take().map_or(Ok(()), Err)
            }
        }
    }

    /// Returns the error of the thread, once.
    pub(in crate::output) fn check(&mut self) -> io::Result<()> {
        match &self.0 {
            Inner::Direct { .. } => Ok(()),
            Inner::Queued { queue, .. } => queue.lock().error.take().map_or(Ok(()), Err),
        }
    }

    /// Waits until everything is written. If nothing is written for 100 ms, asks `give_up`; if that returns true,
    /// the remaining rows are lost.
    pub(in crate::output) fn finish(&mut self, give_up: &mut dyn FnMut() -> bool) -> io::Result<()> {
        // Includes changes after the last row.
        self.put(Job::Rows { bytes: Vec::new(), rows: 0 })?;
        let Inner::Queued { queue, lost, .. } = &mut self.0 else { return Ok(()) };
        let mut state = queue.lock();
        state.is_closed = true;
        queue.changed.notify_all();
        while state.bytes > 0 {
            let before = state.bytes;
            let waited = queue.changed.wait_timeout(state, GIVE_UP_INTERVAL);
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

    /// Changes of the files by other programs since the last call.
    pub fn take_changes(&mut self) -> Vec<FileChange> {
        match &mut self.0 {
            Inner::Direct { writer, .. } => writer.take_changes(),
            Inner::Queued { queue, .. } => std::mem::take(&mut queue.lock().changes),
        }
    }

    /// Rows that were lost because writing was too slow or failed.
    pub fn lost(&self) -> u64 {
        match &self.0 {
            Inner::Direct { lost, .. } => *lost,
            Inner::Queued { queue, overflowed, lost, .. } => *overflowed + *lost + queue.lock().lost,
        }
    }

    /// Rows that were lost because writing was too slow.
    pub(super) fn overflowed(&self) -> u64 {
        match &self.0 {
            Inner::Direct { .. } => 0,
            Inner::Queued { overflowed, .. } => *overflowed,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Write;
    use std::sync::mpsc::{Receiver, Sender, channel};

    /// A disk with this many bytes left.
    #[derive(Debug)]
    struct SmallDisk(usize);

    impl Write for SmallDisk {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let room = self.0.min(bytes.len());
            self.0 -= room;
            if room == 0 { Err(io::ErrorKind::StorageFull.into()) } else { Ok(room) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    /// Writes one block per message on `go`.
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

    fn gate() -> (OutputTarget, Sender<()>, Receiver<String>) {
        let ((go, gone), (written, read)) = (channel(), channel());
        (OutputTarget::Stream(Box::new(Gate { go: gone, written })), go, read)
    }

    fn put(writer: &mut LineWriter, text: &str) -> io::Result<()> {
        let rows = text.lines().count() as u64;
        writer.put_rows(&mut text.as_bytes().to_vec(), rows)
    }

    #[test]
    fn full_disk_keeps_whole_lines_and_counts_lost_rows() {
        for queued in [false, true] {
            let target = OutputTarget::Stream(Box::new(SmallDisk(9)));
            let mut writer = if queued {
                LineWriter::queued(target, None, 1000).expect("a thread")
            } else {
                LineWriter::direct(target, None)
            };
            // 4 + 4 + 1 of 20 bytes fit: the header, which is not a row, and one row of four.
            let mut results = vec![writer.put_header(b"hea\n".to_vec()), put(&mut writer, "aaa\nbbb\nccc\n")];
            results.push(put(&mut writer, "ddd\n"));
            results.push(writer.finish(&mut || false));
            let failed: Vec<io::ErrorKind> = results.into_iter().filter_map(|kind| Some(kind.err()?.kind())).collect();
            assert_eq!(failed, [io::ErrorKind::StorageFull], "reported once");
            assert_eq!(writer.lost(), 3, "two did not fit, one came later");
        }
    }

    #[test]
    fn blocked_target_loses_rows_beyond_the_capacity_but_no_header() {
        let (target, go, written) = gate();
        let mut writer = LineWriter::queued(target, None, 15).expect("a thread");
        for text in ["aaa\n", "bbb\n", "ccc\n", "ddd\neee\n"] {
            put(&mut writer, text).expect("nothing fails");
        }
        assert_eq!(writer.lost(), 2, "12 bytes in three blocks wait");
        writer.put_header(b"head\n".to_vec()).expect("nothing fails");
        assert_eq!(writer.lost(), 2);
        (0..4).for_each(|_| go.send(()).expect("it writes"));
        writer.finish(&mut || false).expect("nothing fails");
        assert_eq!(written.try_iter().collect::<Vec<_>>(), ["aaa\n", "bbb\n", "ccc\n", "head\n"]);
        assert_eq!(writer.lost(), 2);
    }

    #[test]
    fn finish_gives_up_on_a_blocked_target() {
        let (target, _go, written) = gate();
        let mut writer = LineWriter::queued(target, None, 100).expect("a thread");
        put(&mut writer, "aaa\nbbb\n").expect("nothing fails");
        put(&mut writer, "ccc\n").expect("nothing fails");
        let mut asked = 0;
        let mut give_up = || {
            asked += 1;
            asked == 2
        };
        writer.finish(&mut give_up).expect("nothing fails");
        assert_eq!((writer.lost(), written.try_iter().count()), (3, 0));
    }
}
