//! Byte transcripts of the client: the frames sent and received, case by case, from `tests/wire/*.can`.
//!
//! ```text
//! # the source of the case
//! upload node=127 object=0x6131:1 type=u32
//! > 67F#4031610100000000     the client must send this frame next
//! < 5FF#423161010000AB00     the client receives this frame
//! ! timeout                  the time-out expires
//! : 3s                       no frame until this time after power on (simulated device)
//! ~ early answer             frames that were not sent yet are dropped, because an answer arrives first
//! = 11206656                 the result: the value, "done", or the error as text
//! ```
//! After the last line the client must not have sent another frame.
//!
//! `nmt` and `sync` only send a frame. `life` and `tpdo` receive frames; the result lists their contents in order. With
//! `after=`, a frame is sent before.
//!
//! After a line `device KIND@NODE KEY=VALUE…` the same lines also run with a simulated device ([`simulated`]).
//!
//! Block transfers have many segments. `fill=LENGTH` stands for the bytes 0, 1, … 250, 0, 1, …, and `zeros=LENGTH` for
//! zeros. `segments 605 1-127 at 889` stands for the frames with these sequence numbers and the fill from byte 889 on.
//! With `last` at the end, the last frame is marked as the last segment. As a value, `fill` stands for these bytes.
//!
//! LSS collects answers until the time is over (`=`). `! ask again` repeats the request. `sent` is the result of a
//! request without an answer. In a fastscan, each `<` and each `!` ends a step.

mod simulated;

use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::lss::{self, Answer, Exchange, ExchangeError, Fastscan, Part, Request};
use cangauge::canopen::nmt::{ErrorControlMessage, NmtCommand};
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::pdo::{Field, MappingEntry, field_layout};
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
    Sent,
    ErrorControlMessage(NodeId),
    Tpdo(CanId, Vec<Field>, Vec<DataType>),
    Lss(Exchange),
    Fastscan(Fastscan),
}

struct Case {
    machine: Machine,
    fill: Vec<u8>,
    sent: VecDeque<Frame>,
    outcome: Option<String>,
    received: Vec<String>,
}

impl Case {
    fn start(line: &str) -> Case {
        let mut words = line.split_whitespace();
        let kind = words.next().expect("a kind");
        let keys: HashMap<&str, &str> = words.filter_map(|word| word.split_once('=')).collect();
        if let Some(case) = Case::start_lss(kind, &keys) {
            return case;
        }
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
        Case { machine, fill, sent: VecDeque::from([request]), outcome: None, received: Vec::new() }
    }

    fn other(machine: Machine, sent: impl Into<VecDeque<Frame>>) -> Case {
        Case { machine, fill: Vec::new(), sent: sent.into(), outcome: None, received: Vec::new() }
    }

    /// Cases other than SDO transfers.
    fn start_lss(kind: &str, keys: &HashMap<&str, &str>) -> Option<Case> {
        let number = |key: &str| keys[key].parse().expect("a number");
        let request = match kind {
            "nmt" => {
                return Some(Case::other(Machine::Sent, [nmt(keys["command"], keys["node"])]));
            }
            "sync" => return Some(Case::other(Machine::Sent, [Frame::empty(CanId::SYNC)])),
            "life" => {
                let node = keys["node"];
                let sent = keys.get("after").map(|command| nmt(command, keys.get("of").unwrap_or(&node)));
                let machine = Machine::ErrorControlMessage(node.parse().expect("a node-ID"));
                return Some(Case::other(machine, sent.into_iter().collect::<VecDeque<_>>()));
            }
            "tpdo" => {
                let id = u16::from_str_radix(keys["id"], 16).expect("an identifier");
                let parts = |key: &str| keys[key].split(',').map(str::to_owned).collect::<Vec<_>>();
                let word = |text: &String| u32::from_str_radix(text, 16).expect("a mapping word");
                let entries: Vec<_> = parts("mapping").iter().map(|text| MappingEntry::from_word(word(text))).collect();
                let types = parts("types").iter().map(|name| name.parse().expect("a type")).collect();
                let id = CanId::standard(id).expect("an identifier");
                let sent = keys.get("after").map(|cause| match *cause {
                    "sync" => Frame::empty(CanId::SYNC),
                    command => nmt(command, keys["node"]),
                });
                let machine = Machine::Tpdo(id, field_layout(&entries), types);
                return Some(Case::other(machine, sent.into_iter().collect::<VecDeque<_>>()));
            }
            "lss-fastscan" => {
                let scan = Fastscan::new(1);
                let sent = [scan.step().request.frame()];
                return Some(Case::other(Machine::Fastscan(scan), sent));
            }
            "lss-select" => return Some(Case::of(Exchange::select(&keys["address"].parse().expect("an address")))),
            "lss-identify" => return Some(Case::of(Exchange::identify(&keys["range"].parse().expect("a range")))),
            "lss-switch" if keys["to"] == "configuration" => Request::SwitchGlobal(lss::Mode::Configuration),
            "lss-switch" => Request::SwitchGlobal(lss::Mode::Waiting),
            "lss-node" => Request::ConfigureNodeId(keys["id"].parse().ok()),
            "lss-bit-timing" => {
                let [table, index] = [number("table"), number("index")];
                Request::ConfigureBitTiming { table, index }
            }
            "lss-activate" => Request::ActivateBitTiming { delay_ms: keys["ms"].parse().expect("a number") },
            "lss-store" => Request::Store,
            "lss-inquire" => match keys["what"] {
                "node" => Request::InquireNodeId,
                part => Request::Inquire(Part::from_number(part.parse().expect("a number")).expect("a part")),
            },
            "lss-unconfigured" => Request::IdentifyUnconfigured,
            _ => return None,
        };
        Some(Case::of(Exchange::new(request)))
    }

    fn of(mut exchange: Exchange) -> Case {
        let sent = exchange.ask();
        Case::other(Machine::Lss(exchange), sent)
    }

    fn outcome(&self) -> Option<String> {
        match &self.machine {
            Machine::Sent => Some("sent".to_owned()),
            Machine::ErrorControlMessage(_) | Machine::Tpdo(..) => Some(self.received.join("; ")),
            Machine::Lss(exchange) if !exchange.is_answered() => Some("sent".to_owned()),
            Machine::Lss(exchange) => Some(match exchange.one() {
                Ok(Answer::Acknowledge(_) | Answer::Selected | Answer::Here) => "done".to_owned(),
                Ok(Answer::Number(number)) => number.to_string(),
                Ok(Answer::NodeId(node)) => node.map_or("none".to_owned(), |node| node.to_string()),
                Err(ExchangeError::NoAnswer) => "no answer".to_owned(),
                Err(ExchangeError::Several(frames)) => format!("several: {frames:?}"),
                Err(ExchangeError::Refused(code)) => format!("refused: {}", code.describe(exchange.service())),
                Err(ExchangeError::Violation(violation, frame)) => format!("violation: {violation}: {frame}"),
            }),
            _ => self.outcome.clone(),
        }
    }

    /// Ends a step of a fastscan.
    fn end_step(&mut self, answers: usize) {
        let Machine::Fastscan(scan) = &mut self.machine else { return };
        self.outcome = match scan.on_end(answers) {
            lss::Progress::Continue => {
                self.sent.push_back(scan.step().request.frame());
                None
            }
            lss::Progress::Found(address) => Some(address.to_string()),
            lss::Progress::NoneFound => Some("none found".to_owned()),
            lss::Progress::Failed(error) => Some(error.to_string()),
        };
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

    /// The next frame to send.
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
            Machine::Sent => None,
            Machine::ErrorControlMessage(node) => {
                let (of, life) = ErrorControlMessage::parse(frame).expect("a heartbeat or boot-up message");
                assert_eq!(of, *node, "{frame}");
                self.received.push(match life {
                    ErrorControlMessage::BootUp => "boot-up".to_owned(),
                    ErrorControlMessage::State(state) => state.to_string(),
                });
                None
            }
            Machine::Tpdo(id, fields, types) => {
                assert_eq!(frame.id(), *id, "{frame}");
                self.received.push(values(frame, fields, types));
                None
            }
            Machine::Lss(exchange) => {
                exchange.on_frame(frame);
                None
            }
            Machine::Fastscan(_) => {
                assert!(Fastscan::is_answer(frame), "an answer to a step");
                return self.end_step(1);
            }
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
            Machine::Sent | Machine::ErrorControlMessage(_) | Machine::Tpdo(..) => None,
            Machine::Lss(exchange) => {
                out.extend(exchange.ask());
                None
            }
            Machine::Fastscan(_) => return self.end_step(0),
        };
        self.sent.extend(out);
        self.outcome = error.map(failure);
    }
}

/// An NMT command to a node or `all`.
fn nmt(command: &str, node: &str) -> Frame {
    let command = match command {
        "start" => NmtCommand::Start,
        "stop" => NmtCommand::Stop,
        "preop" => NmtCommand::EnterPreOperational,
        "reset" => NmtCommand::ResetNode,
        "reset-comm" => NmtCommand::ResetCommunication,
        other => panic!("no such command: {other}"),
    };
    command.frame((node != "all").then(|| node.parse().expect("a node-ID")))
}

/// The values in a TPDO.
fn values(frame: &Frame, fields: &[Field], types: &[DataType]) -> String {
    let values = fields.iter().zip(types).map(|(field, data_type)| {
        let (bytes, length) = field.bytes(frame.data()).expect("a field");
        data_type.decode(&bytes[..length]).expect("a value").to_string()
    });
    values.collect::<Vec<_>>().join(" ")
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

/// The transcripts, sorted by name.
fn files() -> Vec<std::path::PathBuf> {
    let mut files: Vec<_> = std::fs::read_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/wire"))
        .expect("the folder of transcripts")
        .map(|entry| entry.expect("a file").path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "can"))
        .collect();
    files.sort();
    files
}

#[test]
fn the_client_follows_the_transcripts() {
    let mut cases = 0;
    for path in files() {
        let text = std::fs::read_to_string(&path).expect("a transcript");
        let mut case: Option<Case> = None;
        for (number, line) in text.lines().enumerate() {
            let place = format!("{}:{}", path.display(), number + 1);
            let (mark, rest) = line.split_at(line.len().min(1));
            let rest = rest.trim();
            match mark {
                "" | "#" | ":" => {}
                _ if line.starts_with("device ") => {}
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
                    assert_eq!(case.outcome().as_deref(), Some(rest), "{place}: outcome");
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
