//! Byte transcripts: what the client sends and what comes back, case by case, from `tests/wire/*.can`.
//!
//! ```text
//! # where it is printed
//! upload node=127 object=0x6131:1 type=u32
//! > 67F#4031610100000000     what the client must send next
//! < 5FF#423161010000AB00     what the bus delivers
//! ! timeout                  nothing more comes in time
//! = 11206656                 the value, "done", or the error in words
//! ```
//! After the last line nothing else may have been sent.

use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{Download, DownloadSize, Progress, TransferError, Upload, Uploaded, fit};
use cangauge::canopen::value::{DataType, parse_hex};
use std::collections::{HashMap, VecDeque};

enum Machine {
    Upload(Upload, Option<DataType>),
    Download(Download),
}

struct Case {
    machine: Machine,
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
        let (machine, request) = match kind {
            "upload" => {
                let upload = Upload::new(node, object, keys.contains_key("accept60"));
                let request = upload.request();
                (Machine::Upload(upload, data_type), request)
            }
            "download" => {
                let size = match keys.get("size") {
                    Some(&"omit") => DownloadSize::Omitted,
                    _ => DownloadSize::Indicated,
                };
                let data = match keys.get("hex") {
                    Some(hex) => parse_hex(hex).expect("bytes"),
                    None => data_type.expect("a type").encode_text(keys["value"]).expect("a value"),
                };
                let download = Download::new(node, object, data, size);
                let request = download.request();
                (Machine::Download(download), request)
            }
            other => panic!("no such case: {other}"),
        };
        Case { machine, sent: VecDeque::from([request]), outcome: None }
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
        };
        self.sent.extend(out);
        self.outcome = progress;
    }

    fn time_out(&mut self) {
        let mut out = Vec::new();
        let error = match &mut self.machine {
            Machine::Upload(upload, _) => upload.on_timeout(&mut out),
            Machine::Download(download) => download.on_timeout(&mut out),
        };
        self.sent.extend(out);
        self.outcome = Some(failure(error));
    }
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
            let frame = || -> Frame {
                let text = rest.split_whitespace().next().unwrap_or_default();
                text.parse().unwrap_or_else(|error| panic!("{place}: {error}"))
            };
            match mark {
                "" | "#" => {}
                ">" => {
                    let case = case.as_mut().expect("a case");
                    assert_eq!(case.sent.pop_front(), Some(frame()), "{place}: sent");
                }
                "<" => {
                    let case = case.as_mut().expect("a case");
                    assert_eq!(case.outcome, None, "{place}: ended too early");
                    case.receive(&frame());
                }
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
