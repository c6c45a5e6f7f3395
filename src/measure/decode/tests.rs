//! Tests of the decoder.

use super::*;
use crate::bus::Stamp;
use crate::canopen::pdo::{CobId, MappingEntry, TpdoNumber};
use crate::device::unit::Unit;
use crate::measure::layout::MeasuringRange;
use crate::measure::sample::Status;

#[derive(Clone)]
struct Node {
    id: NodeId,
    model: Option<Arc<Model>>,
    signals: Vec<Signal>,
    tpdos: Vec<Tpdo>,
}

impl Node {
    fn layout(&self) -> Layout<'_> {
        Layout {
            node: self.id,
            profile: Some(404),
            model: self.model.as_deref(),
            signals: &self.signals,
            tpdos: &self.tpdos,
        }
    }
}

fn node((object, data_type): (ObjectId, DataType), words: &[u32], signal: impl Fn(&mut Signal)) -> Node {
    let id = NodeId::new(1).expect("a node-ID");
    let mut pressure = Signal {
        name: "pressure".into(),
        channel: 1,
        value_object: (object, Some(data_type)),
        other_objects: vec![ObjectId::new(0x2090, 0)],
        status: None,
        has_marker: false,
        unit: Some(Unit(0x004e_0000)),
        digits: Some(3),
        lacks_scale: false,
        rules: crate::measure::layout::Rules::default(),
        range: MeasuringRange::Unknown,
    };
    signal(&mut pressure);
    let tpdo = Tpdo {
        number: TpdoNumber::new(1).expect("a number"),
        cob_id: CobId(0x4000_0181),
        transmission: None,
        event_timer_ms: None,
        mapping: words.iter().map(|&word| MappingEntry::from_word(word)).collect(),
    };
    Node { id, model: None, signals: vec![pressure], tpdos: vec![tpdo] }
}

fn rows(node: &Node, wanted: &[Wanted], frame: &str) -> Vec<(String, String, &'static str)> {
    let mut decoder = Decoder::default();
    decoder.add(node.layout(), wanted);
    let received = Received { frame: frame.parse().expect("a frame"), at: Stamp::default() };
    let mut samples = Vec::new();
    decoder.decode(&received, &mut samples);
    samples
        .iter()
        .map(|sample| {
            let value = sample.value.map(|value| value.to_string()).unwrap_or_default();
            let source = &decoder.sources()[sample.source];
            (source.signal.to_string(), value, sample.status.map_or("", Status::as_str))
        })
        .collect()
}

fn row(signal: &str, value: &str, status: &'static str) -> (String, String, &'static str) {
    (signal.into(), value.into(), status)
}

const REAL: (ObjectId, DataType) = (ObjectId::new(0x6130, 1), DataType::Real32);

#[test]
fn mh4_real_with_status() {
    let mh4 = node(REAL, &[0x6130_0120, 0x6150_0108], |signal| {
        signal.status = Some(ObjectId::new(0x6150, 1));
        signal.has_marker = true;
    });
    assert_eq!(rows(&mh4, &[], "181#0000803F00"), [row("pressure", "1", "ok")]);
    assert_eq!(rows(&mh4, &[], "181#0000C07F03"), [row("pressure", "", "overload-high")]);
    assert_eq!(rows(&mh4, &[], "181#0000C07F05"), [row("pressure", "", "overload-low")]);
    assert_eq!(rows(&mh4, &[], "181#0000C07F00"), [row("pressure", "", "invalid")]);
    assert_eq!(rows(&mh4, &[], "181#0000803F01"), [row("pressure", "", "invalid")]);
    // A frame yields no row if its length differs from the mapping, it is a remote request, or it has 29 bits.
    for other in ["181#", "181#0000803F", "181#0000803F0000", "181#R5", "00000181#0000803F00", "182#0000803F00"] {
        assert_eq!(rows(&mh4, &[], other), [], "{other}");
    }
    let asked = [Wanted::Status("pressure".into()), Wanted::Object(ObjectId::new(0x6150, 1), None)];
    assert_eq!(rows(&mh4, &asked, "181#0000C07F03"), [row("pressure.status", "3", ""), row("0x6150:1", "3", "")]);
}

#[test]
fn each_channel_has_its_own_status() {
    let words = [0x6150_0108, 0x6130_0220, 0x6150_0208];
    let second = node((ObjectId::new(0x6130, 2), DataType::Real32), &words, |signal| {
        signal.status = Some(ObjectId::new(0x6150, 2));
    });
    assert_eq!(rows(&second, &[], "181#030000803F00"), [row("ai-status:1", "3", ""), row("pressure", "1", "ok")]);
    assert_eq!(rows(&second, &[], "181#000000803F01"), [row("ai-status:1", "0", ""), row("pressure", "", "invalid")]);
}

/// Decodes the frames; after the first `before` frames the mapping is read again. Returns the values of the later
/// frames.
fn after_reread(words: &[u32], before: usize, frames: &[&str]) -> Vec<String> {
    let node = node(REAL, words, |_| {});
    let mut decoder = Decoder::default();
    decoder.add(node.layout(), &[]);
    let mut samples = Vec::new();
    for (at, frame) in frames.iter().enumerate() {
        if at == before {
            let seen = decoder.lengths_seen(node.id);
            decoder.replace(node.layout(), &[]);
            decoder.use_longer(node.id, &seen);
            samples.clear();
        }
        let received = Received { frame: frame.parse().expect("a frame"), at: Stamp::default() };
        decoder.decode(&received, &mut samples);
    }
    samples.iter().filter_map(|sample| Some(sample.value?.to_string())).collect()
}

#[test]
fn longer_tpdo_is_used_after_a_reread_if_its_length_is_constant() {
    let long = "181#0000803F00000000";
    assert_eq!(after_reread(&[0x6130_0120], 1, &[long, long, long]), ["1", "1"]);
    assert_eq!(after_reread(&[0x7130_0110], 1, &["181#640000", "181#650000"]), ["0.101"]);
    let none: [&str; 0] = [];
    assert_eq!(after_reread(&[0x6130_0120], 9, &[long, long]), none, "not read again");
    assert_eq!(after_reread(&[0x6130_0120], 1, &["181#0000", "181#0000"]), none, "shorter");
    assert_eq!(after_reread(&[0x6130_0120], 2, &[long, "181#0000803F00", long]), none, "two lengths");
    assert_eq!(after_reread(&[0x6130_0120], 1, &[long, "181#0000803F00", long]), none, "two lengths, later");
    assert_eq!(after_reread(&[0x6130_0120], 2, &["181#0000803F", long, long]), none, "the mapped length, too");
}

#[test]
fn highest_bit_of_a_mapped_length_is_ignored() {
    let odd = node(REAL, &[0x7130_0190], |_| {});
    assert_eq!(rows(&odd, &[], "181#85FF"), [row("pressure", "-0.123", "")]);
    let real = node(REAL, &[0x6130_01a0], |_| {});
    assert_eq!(rows(&real, &[], "181#0000803F"), [row("pressure", "1", "")]);
}

#[test]
fn shared_cob_id_yields_no_samples() {
    let one = node(REAL, &[0x6130_0120], |_| {});
    let other = Node { id: NodeId::new(2).expect("a node-ID"), ..one.clone() };
    let mut decoder = Decoder::default();
    decoder.add(one.layout(), &[]);
    decoder.add(other.layout(), &[]);
    let received = Received { frame: "181#0000803F".parse().expect("a frame"), at: Stamp::default() };
    let mut samples = Vec::new();
    assert!(matches!(decoder.decode(&received, &mut samples), Decoded::Paused(_)) && samples.is_empty());
    let number = |number| TpdoNumber::new(number).expect("a number");
    let tpdos = [(one.id, number(1)), (other.id, number(1))];
    assert_eq!(decoder.take_shared_cob_ids().into_values().collect::<Vec<_>>(), [tpdos]);
    // Two TPDOs of one node, with mappings of the same and of another length.
    for mapping in [vec![0x7130_0110, 0x6150_0110], vec![0x6130_0120]] {
        let mut twice = one.clone();
        let mapping: Vec<MappingEntry> = mapping.into_iter().map(MappingEntry::from_word).collect();
        twice.tpdos.push(Tpdo { number: number(2), mapping, ..one.tpdos[0].clone() });
        let mut decoder = Decoder::default();
        decoder.add(twice.layout(), &[]);
        assert!(matches!(decoder.decode(&received, &mut samples), Decoded::Paused(_)) && samples.is_empty());
        assert_eq!(decoder.shared_cob_id(CanId::Standard(0x181)), Some([(one.id, number(1)), (one.id, number(2))]));
    }
    // A TPDO without a mapping is not a second sender.
    let mut empty = one.clone();
    empty.tpdos.insert(0, Tpdo { number: number(2), mapping: Vec::new(), ..one.tpdos[0].clone() });
    let mut decoder = Decoder::default();
    decoder.add(empty.layout(), &[]);
    assert_eq!((decoder.decode(&received, &mut samples), samples.len()), (Decoded::Tpdo(one.id), 1));
}

#[test]
fn tpdo_without_a_mapping_has_no_wrong_length() {
    let multiplexed = node(REAL, &[], |_| {});
    let mut decoder = Decoder::default();
    decoder.add(multiplexed.layout(), &[]);
    let received = Received { frame: "181#8530610100000000".parse().expect("a frame"), at: Stamp::default() };
    assert_eq!(decoder.decode(&received, &mut Vec::new()), Decoded::OtherFrame);
    assert_eq!(decoder.wrong_lengths(multiplexed.id), 0);
}

#[test]
fn dps_integer_has_digits_and_no_status() {
    let dps = node((ObjectId::new(0x6130, 1), DataType::Integer(4)), &[0x6130_0120], |_| {});
    let mut dps = dps;
    // Without a description 6130h is REAL32 by the profile, and the integer is not a plausible REAL32.
    assert_eq!(rows(&dps, &[], "181#50C30000"), [row("pressure", "", "invalid")]);
    dps.model = Some(Arc::new(
        Model::from_toml(
            "name='x'\ntitle=''\nvendor=''\nsource=''\n[identify]\n[[object]]\nat='0x6130:1-1'\nname='pv'\ntype='i32'\naccess='ro'",
        )
        .expect("a description"),
    ));
    assert_eq!(rows(&dps, &[], "181#50C30000"), [row("pressure", "50.000", "")]);
    assert_eq!(rows(&dps, &[], "181#00000080"), [row("pressure", "-2147483.648", "")]);
}

use crate::device::catalog::Model;

#[test]
fn markers_count_only_if_the_device_has_them() {
    let marked = node(REAL, &[0x9130_0120], |signal| signal.has_marker = true);
    assert_eq!(rows(&marked, &[], "181#00000080"), [row("pressure", "", "invalid")]);
    assert_eq!(rows(&marked, &[], "181#D2040000"), [row("pressure", "1.234", "ok")]);
    // NaN is invalid on every device.
    let other = node(REAL, &[0x6130_0120], |_| {});
    assert_eq!(rows(&other, &[], "181#0000C07F"), [row("pressure", "", "invalid")]);
    assert_eq!(rows(&other, &[], "181#0000807F"), [row("pressure", "", "invalid")]);
}

#[test]
fn other_objects_of_a_signal_and_objects_without_signal() {
    let d20 = node(REAL, &[0x2090_0020], |_| {});
    // Without a description the type of 2090h is unknown, so the signal has no value.
    assert_eq!(rows(&d20, &[], "181#D2040000"), [row("pressure", "", "")]);
    let raw = node(REAL, &[0x7100_0110, 0x0005_0008], |_| {});
    assert_eq!(rows(&raw, &[], "181#100E00"), [row("0x7100:1", "3600", "")]);
    // The D-20-9 sends no data while its mapping is switched off.
    assert_eq!(rows(&d20, &[], "181#"), []);
}

#[test]
fn unknown_type_has_no_value_and_the_bytes_as_received() {
    let mut other = node(REAL, &[0x6010_0010, 0x2100_0120], |_| {});
    other.signals.clear();
    assert_eq!(rows(&other, &[], "181#2EFB0000AC41"), [row("0x6010:0", "", ""), row("0x2100:1", "", "")]);
    let stated = |object, data_type| Wanted::Object(object, Some(data_type));
    let wanted = [
        stated(ObjectId::new(0x6010, 0), DataType::Integer(2)),
        stated(ObjectId::new(0x2100, 1), DataType::Real32),
        // The type has another width than the mapped bits.
        stated(ObjectId::new(0x6010, 0), DataType::Integer(4)),
        stated(ObjectId::new(0x6010, 0), DataType::Unsigned(4)),
    ];
    let found = rows(&other, &wanted, "181#2EFB0000AC41");
    let expected = [("0x6010:0/i16", "-1234"), ("0x6010:0/i32", ""), ("0x6010:0/u32", ""), ("0x2100:1/r32", "21.5")];
    assert_eq!(found, expected.map(|(signal, value)| row(signal, value, "")));
}

#[test]
fn net_value_has_the_unit_and_digits_of_its_channel() {
    let real = node(REAL, &[0x6140_0120], |_| {});
    assert_eq!(rows(&real, &[], "181#3333C442"), [row("0x6140:1", "98.1", "")]);
    let integer = node(REAL, &[0x9140_0120], |_| {});
    assert_eq!(rows(&integer, &[], "181#D2040000"), [row("0x9140:1", "1.234", "")]);
    let mut decoder = Decoder::default();
    decoder.add(integer.layout(), &[]);
    assert_eq!(&*decoder.sources()[0].unit, "bar");
}
