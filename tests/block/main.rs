//! Block transfers of the client with an independent server, over a line that loses, repeats and swaps frames. A
//! transfer that reports success is complete, each transfer ends, and the server is idle afterwards.

mod server;
mod through_master;

use cangauge::canopen::frame::Frame;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::sdo::{BlockDownload, BlockSize, BlockUpload, DownloadSize, Progress, TransferError, Uploaded};
use proptest::prelude::*;
use server::{Server, ServerBehaviour};
use std::collections::VecDeque;

const OBJECT: ObjectId = ObjectId::new(0x2000, 1);

fn node() -> NodeId {
    NodeId::new(5).unwrap()
}

/// The fault of one frame on the line.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Fate {
    Arrives,
    Lost,
    Doubled,
    /// Arrives after the next one.
    Swapped,
}

/// A line that applies the n-th fate to the n-th frame. Frames after the last fate arrive.
struct Line {
    fates: VecDeque<Fate>,
    spare_aborts: bool,
    swapped: Option<Frame>,
    at_server: VecDeque<Frame>,
    at_client: VecDeque<Frame>,
}

impl Line {
    fn new(fates: Vec<Fate>, spare_aborts: bool) -> Line {
        let fates = fates.into();
        Line { fates, spare_aborts, swapped: None, at_server: VecDeque::new(), at_client: VecDeque::new() }
    }

    fn carry(&mut self, frame: Frame, to_server: bool) {
        let is_abort = frame.data()[0] == 0x80;
        let fate = match self.fates.pop_front() {
            Some(fate) if !(is_abort && self.spare_aborts) => fate,
            _ => Fate::Arrives,
        };
        let end = if to_server { &mut self.at_server } else { &mut self.at_client };
        match fate {
            Fate::Lost => {}
            Fate::Arrives => end.push_back(frame),
            Fate::Doubled => end.extend([frame, frame]),
            Fate::Swapped => {
                if let Some(earlier) = self.swapped.replace(frame) {
                    end.push_back(earlier);
                }
                return;
            }
        }
        // Only frames of the same sender are swapped.
        if self.swapped.is_some_and(|swapped| swapped.id() == frame.id())
            && let Some(swapped) = self.swapped.take()
        {
            end.push_back(swapped);
        }
    }

    /// Delivers a frame that waits for a later one to overtake it.
    fn settle(&mut self) {
        if let Some(frame) = self.swapped.take() {
            let to_server = frame.id().sdo_request_node().is_some();
            if to_server { self.at_server.push_back(frame) } else { self.at_client.push_back(frame) }
        }
    }
}

trait Client {
    type Result;
    fn request(&self) -> Frame;
    fn take(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Self::Result>;
    fn on_sent(&mut self);
    fn time_out(&mut self, out: &mut Vec<Frame>) -> Option<TransferError>;
}

impl Client for BlockDownload {
    type Result = ();
    fn request(&self) -> Frame {
        BlockDownload::request(self)
    }
    fn take(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<()> {
        self.on_frame(frame, out)
    }
    fn on_sent(&mut self) {
        BlockDownload::on_sent(self);
    }
    fn time_out(&mut self, out: &mut Vec<Frame>) -> Option<TransferError> {
        Some(self.on_timeout(out))
    }
}

impl Client for BlockUpload {
    type Result = Uploaded;
    fn request(&self) -> Frame {
        BlockUpload::request(self)
    }
    fn take(&mut self, frame: &Frame, out: &mut Vec<Frame>) -> Progress<Uploaded> {
        self.on_frame(frame, out)
    }
    fn on_sent(&mut self) {}
    fn time_out(&mut self, out: &mut Vec<Frame>) -> Option<TransferError> {
        self.on_timeout(out)
    }
}

/// Runs the transfer until the client has a result and the line is idle. The client sends one frame at a time and
/// receives the answers of the server in between.
fn run<C: Client>(client: &mut C, server: &mut Server, mut line: Line) -> Result<C::Result, TransferError> {
    let mut waiting = VecDeque::from([client.request()]);
    let mut result = None;
    for _ in 0..100_000 {
        let mut out = Vec::new();
        if let Some(frame) = line.at_client.pop_front() {
            if result.is_some() {
                continue;
            }
            match client.take(&frame, &mut out) {
                Progress::NotOurs => {}
                Progress::Continue if out.is_empty() => {}
                Progress::Continue => waiting.clear(),
                Progress::Done(done) => {
                    waiting.clear();
                    result = Some(Ok(done));
                }
                Progress::Failed(error) => {
                    waiting.clear();
                    result = Some(Err(error));
                }
            }
            waiting.extend(out);
        } else if let Some(frame) = line.at_server.pop_front() {
            for answer in server.on_frame(&frame) {
                line.carry(answer, false);
            }
        } else if let Some(frame) = waiting.pop_front() {
            client.on_sent();
            line.carry(frame, true);
        } else if line.swapped.is_some() {
            line.settle();
        } else if let Some(result) = result {
            return result;
        } else {
            let error = client.time_out(&mut out);
            result = error.map(Err);
            waiting.extend(out);
        }
    }
    panic!("no end");
}

fn data() -> impl Strategy<Value = Vec<u8>> {
    // Sizes near the ends of segments and sub-blocks, and repeated contents.
    let sizes = prop_oneof![0..40usize, 880..900usize, 1770..1790usize, 0..3000usize];
    (sizes, any::<u8>(), any::<bool>()).prop_map(|(size, first, constant)| {
        (0..size).map(|at| if constant { first } else { first.wrapping_add((at % 251).to_le_bytes()[0]) }).collect()
    })
}

fn behaviour(crc: impl Strategy<Value = bool>) -> impl Strategy<Value = ServerBehaviour> {
    let block_size = prop_oneof![1..=8u8, Just(127), 1..=127u8];
    (crc, any::<bool>(), prop::collection::vec(block_size, 1..4), any::<bool>())
        .prop_map(|(crc, announces, block_sizes, hasty)| ServerBehaviour { crc, announces, block_sizes, hasty })
}

fn fates(kinds: &'static [Fate]) -> impl Strategy<Value = Vec<Fate>> {
    let fate = prop_oneof![12 => Just(Fate::Arrives), 1 => prop::sample::select(kinds)];
    // Sometimes the faults start late, so that they hit the end of the transfer too.
    (0..400usize, prop::collection::vec(fate, 0..80))
        .prop_map(|(quiet, fates)| std::iter::repeat_n(Fate::Arrives, quiet / 2).chain(fates).collect())
}

const LOSSES: &[Fate] = &[Fate::Lost];
const EVERYTHING: &[Fate] = &[Fate::Lost, Fate::Doubled, Fate::Swapped];

fn download(
    data: &[u8],
    size: DownloadSize,
    behaviour: ServerBehaviour,
    line: Line,
) -> (Result<(), TransferError>, Server) {
    let mut server = Server::new(node(), b"before".to_vec(), behaviour);
    let mut client = BlockDownload::new(node(), OBJECT, data.to_vec(), size);
    let result = run(&mut client, &mut server, line);
    (result, server)
}

fn upload(
    data: &[u8],
    block_size: u8,
    behaviour: ServerBehaviour,
    line: Line,
) -> (Result<Uploaded, TransferError>, Server) {
    let mut server = Server::new(node(), data.to_vec(), behaviour);
    let mut client = BlockUpload::new(node(), OBJECT, 0, false);
    client = client.with_block_size(BlockSize::new(block_size).unwrap());
    let result = run(&mut client, &mut server, line);
    (result, server)
}

/// Whether the object has the size that the server announced, if it announced one.
fn has_announced_size(uploaded: &Uploaded) -> bool {
    uploaded.announced.is_none_or(|size| usize::try_from(size) == Ok(uploaded.bytes.len()))
}

/// Repeated frames can cause the loss of segments of zeros. The CRC of zeros is 0, so it does not show this.
#[test]
fn size_of_an_upload_shows_lost_zeros() {
    let data = vec![0; 1770];
    let behaviour = ServerBehaviour { crc: true, announces: true, block_sizes: vec![1], hasty: false };
    let mut fates = vec![Fate::Arrives; 39];
    (fates[6], fates[37], fates[38]) = (Fate::Doubled, Fate::Doubled, Fate::Swapped);
    let uploaded = upload(&data, 3, behaviour, Line::new(fates, true)).0.expect("an object");
    assert_eq!((uploaded.bytes.len(), uploaded.announced), (1749, Some(1770)));
    assert!(!has_announced_size(&uploaded));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn transfers_without_faults_succeed(data in data(), behaviour in behaviour(any::<bool>()), block_size in 1..=127u8) {
        for size in [DownloadSize::Indicated, DownloadSize::Omitted] {
            let (result, server) = download(&data, size, behaviour.clone(), Line::new(Vec::new(), false));
            prop_assert_eq!(result, Ok(()));
            prop_assert!(server.is_idle());
            prop_assert!(server.object == data);
        }
        let (result, server) = upload(&data, block_size, behaviour, Line::new(Vec::new(), false));
        prop_assert!(result.map(|uploaded| uploaded.bytes) == Ok(data));
        prop_assert!(server.is_idle());
    }

    /// Lost frames never cause a false success, even without a CRC or size. (A server that acknowledges early cannot
    /// assign a segment to a sub-block if its acknowledge was lost; it needs the size.)
    #[test]
    fn a_download_that_loses_frames_is_right_or_fails(
        data in data(), mut behaviour in behaviour(any::<bool>()), omit in any::<bool>(), fates in fates(LOSSES)
    ) {
        behaviour.hasty &= !omit;
        let size = if omit { DownloadSize::Omitted } else { DownloadSize::Indicated };
        let (result, server) = download(&data, size, behaviour, Line::new(fates, true));
        match result {
            Ok(()) => prop_assert!(server.object == data),
            // The answer to the last frame may be lost.
            Err(TransferError::NoAnswer) => prop_assert!(server.object == b"before" || server.object == data),
            Err(_) => prop_assert!(server.object == b"before"),
        }
    }

    #[test]
    fn an_upload_that_loses_frames_is_right_or_fails(
        data in data(), behaviour in behaviour(any::<bool>()), block_size in 1..=127u8, fates in fates(LOSSES)
    ) {
        let (result, _) = upload(&data, block_size, behaviour, Line::new(fates, true));
        if let Ok(uploaded) = result {
            prop_assert!(uploaded.bytes == data);
        }
    }

    /// Any faults, with a CRC. The CRC does not detect the number of leading zeros; the size does.
    #[test]
    fn a_download_over_a_bad_line_is_right_or_fails(
        data in data(), behaviour in behaviour(Just(true)), fates in fates(EVERYTHING)
    ) {
        let (result, server) = download(&data, DownloadSize::Indicated, behaviour, Line::new(fates, true));
        if result.is_ok() {
            prop_assert!(server.object == data);
        } else {
            prop_assert!(server.object == b"before" || server.object == data);
        }
    }

    #[test]
    fn an_upload_over_a_bad_line_is_right_or_fails(
        data in data(), behaviour in behaviour(Just(true)), block_size in 2..=127u8, fates in fates(EVERYTHING)
    ) {
        prop_assume!(behaviour.announces || data.first() != Some(&0));
        let (result, _) = upload(&data, block_size, behaviour, Line::new(fates, true));
        // The master reads the object once more if the size differs.
        if let Ok(uploaded) = result.as_ref() && has_announced_size(uploaded) {
            prop_assert!(uploaded.bytes == data);
        }
    }

    /// Segments lost within a sub-block only cost time.
    #[test]
    fn segments_lost_within_a_sub_block_are_repeated(
        segments in 3..500usize, crc in any::<bool>(), hasty in any::<bool>(), lost in 0..126usize
    ) {
        let data: Vec<u8> = (0..7 * segments).map(|at| (at % 251).to_le_bytes()[0]).collect();
        let lost = lost % (segments.min(127) - 1);
        let behaviour = ServerBehaviour { crc, announces: true, block_sizes: vec![127], hasty };
        let fates = |before: usize| {
            let mut fates = vec![Fate::Arrives; before + lost];
            fates.push(Fate::Lost);
            fates
        };
        // The first segment follows two frames in a download and three in an upload.
        let (result, server) = download(&data, DownloadSize::Indicated, behaviour.clone(), Line::new(fates(2), false));
        prop_assert_eq!(result, Ok(()));
        prop_assert!(server.object == data);
        let (result, server) = upload(&data, 127, behaviour, Line::new(fates(3), false));
        prop_assert!(result.map(|uploaded| uploaded.bytes) == Ok(data));
        prop_assert!(server.is_idle());
    }

    /// Arbitrary frames at any time: the state machines do not panic, and they end.
    #[test]
    fn decoding_is_total(
        frames in prop::collection::vec(prop::collection::vec(any::<u8>(), 0..=8), 0..60),
        heads in prop::collection::vec(prop::sample::select(&[
            0xc6, 0xc4, 0xa4, 0xa0, 0xa2, 0xa1, 0xc1, 0xd9, 0x01, 0x02, 0x81, 0x82, 0x83, 0x80, 0x43, 0x41u8,
        ][..]), 60),
        length in 0..2000usize,
    ) {
        let mut upload = BlockUpload::new(node(), OBJECT, 28, true);
        let mut write = BlockDownload::new(node(), OBJECT, vec![7; length], DownloadSize::Indicated);
        let (mut reads, mut writes) = (true, true);
        for (mut bytes, head) in frames.into_iter().zip(heads) {
            if let Some(first) = bytes.first_mut() && *first % 4 != 0 {
                *first = head;
            }
            if bytes.len() >= 4 && bytes[0] % 3 != 0 {
                bytes[1..4].copy_from_slice(&OBJECT.multiplexer());
            }
            let frame = Frame::new(cangauge::canopen::id::CanId::sdo_response(node()), &bytes).unwrap();
            let mut out = Vec::new();
            if reads {
                reads = !matches!(upload.on_frame(&frame, &mut out), Progress::Done(_) | Progress::Failed(_));
                prop_assert!(out.len() <= 1);
            }
            out.clear();
            if writes {
                writes = !matches!(write.on_frame(&frame, &mut out), Progress::Done(()) | Progress::Failed(_));
                out.iter().for_each(|_| write.on_sent());
                prop_assert!(out.len() <= 127);
            }
        }
        let mut silences = 0;
        while upload.on_timeout(&mut Vec::new()).is_none() {
            silences += 1;
            prop_assert!(silences <= 3);
        }
    }
}
