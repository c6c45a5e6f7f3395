//! Byte transcripts: what the client sends and what comes back, case by case, from `tests/wire/*.can`.
//!
//! ```text
//! # where it is printed
//! upload node=127 object=0x6131:1 type=u32
//! > 67F#4031610100000000     what the client must send next
//! < 5FF#423161010000AB00     what the bus delivers
//! ! timeout                  nothing more comes in time
//! ~ early answer             what has not been sent yet is dropped, because an answer comes before
//! = 11206656                 the value, "done", or the error in words
//! ```
//! After the last line nothing else may have been sent.
//!
//! Block transfers have long runs of segments. `fill=LENGTH` names bytes 0, 1, … 250, 0, 1, …, `zeros=LENGTH`
//! zeros. `segments 605 1-127 at 889` stands for the frames with these sequence numbers that carry the fill
//! from byte 889 on; with `last` at the end, the last of them says so. As a value, `fill` is just these bytes.

use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{
    BlockDownload, BlockSize, BlockUpload, Download, DownloadSize, Progress, TransferError, Upload, Uploaded, fit,
};
use cangauge::canopen::value::{DataType, parse_hex};
use std::collections::{HashMap, VecDeque};

enum Machine {
    Upload(Upload, Option<DataType>),
    Download(Download),
    BlockUpload(BlockUpload, Option<DataType>),
    BlockDownload(BlockDownload),
}

struct Case {
    machine: Machine,
    fill: Vec<u8>,
    sent: VecDeque<Frame>,
    outcome: Option<String>,
}

impl Case {
    fn start(line: &str) -> Case {
        let mut words = line.split_whitespace();
        let kind = words.next().expect("a kind");
        let keys: HashMap<&str, &str> = words.filter_map(|word| word.split_once('=')).collect();
        let node: NodeId = keys["node"].parse().expect("a node-ID");
        let object: ObjectId = keys["object"].parse().expect("an object");
        let data_type: Option<DataType> = keys.get("type").map(|name| name.parse().expect("a type"));
        let length = |key| keys.get(key).map_or(0, |length| length.parse().expect("a length"));
        let pattern = (0..=250).cycle().take(length("fill"));
        let fill: Vec<u8> = pattern.chain(std::iter::repeat_n(0, length("zeros"))).collect();
        let size = match keys.get("size") {
            Some(&"omit") => DownloadSize::Omitted,
            _ => DownloadSize::Indicated,
        };
        let data = || match keys.get("hex") {
            Some(hex) => parse_hex(hex).expect("bytes"),
            None if keys.contains_key("fill") => fill.clone(),
            None => data_type.expect("a type").encode_text(keys["value"]).expect("a value"),
        };
        let (machine, request) = match kind {
            "upload" => {
                let upload = Upload::new(node, object, keys.contains_key("accept60"));
                let request = upload.request();
                (Machine::Upload(upload, data_type), request)
            }
            "download" => {
                let download = Download::new(node, object, data(), size);
                let request = download.request();
                (Machine::Download(download), request)
            }
            "block-upload" => {
                let threshold = keys.get("threshold").map_or(0, |text| text.parse().expect("a threshold"));
                let mut upload = BlockUpload::new(node, object, threshold, keys.contains_key("accept60"));
                if let Some(size) = keys.get("blksize") {
                    let size = BlockSize::new(size.parse().expect("a number")).expect("a block size");
                    upload = upload.with_block_size(size);
                }
                let request = upload.request();
                (Machine::BlockUpload(upload, data_type), request)
            }
            "block-download" => {
                let download = BlockDownload::new(node, object, data(), size);
                let request = download.request();
                (Machine::BlockDownload(download), request)
            }
            other => panic!("no such case: {other}"),
        };
        Case { machine, fill, sent: VecDeque::from([request]), outcome: None }
    }

    /// The frames of one line.
    fn frames(&self, text: &str) -> Vec<Frame> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let ["segments", id, run, "at", offset, end @ ..] = &words[..] else {
            return vec![words.first().copied().unwrap_or_default().parse().expect("a frame")];
        };
        let (first, last) = run.split_once('-').unwrap_or((run, run));
        let (first, last): (u8, u8) = (first.parse().expect("a number"), last.parse().expect("a number"));
        let parts = self.fill[offset.parse().expect("an offset")..].chunks(7).map(Some).chain(std::iter::repeat(None));
        let frames = (first..=last).zip(parts).map(|(sequence, part)| {
            let flag = if end == ["last"] && sequence == last { 0x80 } else { 0 };
            let mut text = format!("{id}#{:02X}", sequence | flag);
            let part = part.unwrap_or_default().iter().copied().chain(std::iter::repeat(0)).take(7);
            part.for_each(|byte| text += &format!("{byte:02X}"));
            text.parse().expect("a frame")
        });
        frames.collect()
    }

    /// The next frame that goes to the bus.
    fn send(&mut self) -> Option<Frame> {
        if let Machine::BlockDownload(download) = &mut self.machine {
            download.on_sent();
        }
        self.sent.pop_front()
    }

    fn receive(&mut self, frame: &Frame) {
        let mut out = Vec::new();
        let progress = match &mut self.machine {
            Machine::Upload(upload, data_type) => match upload.on_frame(frame, &mut out) {
                Progress::Done(uploaded) => Some(value(*data_type, &uploaded)),
                other => outcome(other),
            },
            Machine::Download(download) => match download.on_frame(frame, &mut out) {
                Progress::Done(()) => Some("done".to_owned()),
                other => outcome(other),
            },
            Machine::BlockUpload(upload, data_type) => match upload.on_frame(frame, &mut out) {
                Progress::Done(uploaded) => Some(fill_or_value(&self.fill, *data_type, &uploaded)),
                other => outcome(other),
            },
            Machine::BlockDownload(download) => match download.on_frame(frame, &mut out) {
                Progress::Done(()) => Some("done".to_owned()),
                other => outcome(other),
            },
        };
        self.sent.extend(out);
        self.outcome = progress;
    }

    fn time_out(&mut self) {
        let mut out = Vec::new();
        let error = match &mut self.machine {
            Machine::Upload(upload, _) => Some(upload.on_timeout(&mut out)),
            Machine::Download(download) => Some(download.on_timeout(&mut out)),
            Machine::BlockUpload(upload, _) => upload.on_timeout(&mut out),
            Machine::BlockDownload(download) => Some(download.on_timeout(&mut out)),
        };
        self.sent.extend(out);
        self.outcome = error.map(failure);
    }
}

fn fill_or_value(fill: &[u8], data_type: Option<DataType>, uploaded: &Uploaded) -> String {
    let text = value(data_type, uploaded);
    if fill.is_empty() || uploaded.bytes != fill {
        return text;
    }
    text.replacen(&fit(None, uploaded).expect("bytes").value.to_string(), "fill", 1)
}

fn value(data_type: Option<DataType>, uploaded: &Uploaded) -> String {
    match fit(data_type, uploaded) {
        Ok(fitted) => match fitted.note {
            Some(note) => format!("{} ({note})", fitted.value),
            None => fitted.value.to_string(),
        },
        Err(error) => format!("error: {error}"),
    }
}

fn outcome<T>(progress: Progress<T>) -> Option<String> {
    match progress {
        Progress::NotOurs | Progress::Continue => None,
        Progress::Failed(error) => Some(failure(error)),
        Progress::Done(_) => unreachable!("taken before"),
    }
}

fn failure(error: TransferError) -> String {
    match error {
        TransferError::Aborted(code) => format!("refused: {code}"),
        TransferError::Violation(violation, frame) => format!("violation: {violation}: {frame}"),
        TransferError::NoAnswer => "no answer".to_owned(),
    }
}

#[test]
fn transcripts() {
    let mut cases = 0;
    let mut files: Vec<_> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/wire"))
        .expect("the folder of transcripts")
        .map(|entry| entry.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "can"))
        .collect();
    files.sort();
    for path in files {
        let text = std::fs::read_to_string(&path).expect("a transcript");
        let mut case: Option<Case> = None;
        for (number, line) in text.lines().enumerate() {
            let place = format!("{}:{}", path.display(), number + 1);
            let (mark, rest) = line.split_at(line.len().min(1));
            let rest = rest.trim();
            match mark {
                "" | "#" => {}
                ">" => {
                    let case = case.as_mut().expect("a case");
                    for frame in case.frames(rest) {
                        assert_eq!(case.send(), Some(frame), "{place}: sent");
                    }
                }
                "<" => {
                    let case = case.as_mut().expect("a case");
                    for frame in case.frames(rest) {
                        assert_eq!(case.outcome, None, "{place}: ended too early");
                        case.receive(&frame);
                    }
                }
                "~" => case.as_mut().expect("a case").sent.clear(),
                "!" => case.as_mut().expect("a case").time_out(),
                "=" => {
                    let case = case.take().expect("a case");
                    assert_eq!(case.outcome.as_deref(), Some(rest), "{place}: outcome");
                    assert_eq!(case.sent, [], "{place}: and nothing else was sent");
                    cases += 1;
                }
                _ => {
                    assert!(case.is_none(), "{place}: the case before has no outcome");
                    case = Some(Case::start(line));
                }
            }
        }
        assert!(case.is_none(), "{}: the last case has no outcome", path.display());
    }
    assert!(cases > 30, "only {cases} cases were found");
}
