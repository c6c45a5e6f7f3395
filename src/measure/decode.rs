//! Decodes TPDOs into samples, by mapping, data type, decimal digits and status.

use super::layout::{Layout, Signal, Tpdo, fits};
pub use super::reading::{Reading, is_smallest};
use super::sample::{Sample, Source};
use crate::bus::Received;
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use crate::canopen::pdo::{Field, lay_out};
use crate::canopen::value::DataType;
use std::collections::{BTreeMap, HashMap};
use std::sync::Arc;

/// A requested value of a node.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Wanted {
    /// A signal: `pressure`.
    Signal(String),
    /// The status of a signal: `pressure.status`.
    Status(String),
    /// An object by its address, with the type that the user states: `0x6130:1`, `0x6010:0/i16`.
    Object(ObjectId, Option<DataType>),
}

impl Wanted {
    /// The name as in [`Source`]: `pressure`, `pressure.status`, `0x6010:0/i16`.
    pub fn name(&self) -> String {
        match self {
            Wanted::Signal(name) => name.clone(),
            Wanted::Status(name) => format!("{name}.status"),
            Wanted::Object(object, None) => object.to_string(),
            Wanted::Object(object, Some(data_type)) => format!("{object}/{data_type}"),
        }
    }
}

/// One value in a TPDO.
#[derive(Debug)]
struct MappedValue {
    field: Field,
    reading: Reading,
    status: Option<Field>,
}

/// How one TPDO is decoded.
#[derive(Debug)]
struct TpdoDecoder {
    node: NodeId,
    /// Length of the mapping in bytes.
    length: usize,
    values: Vec<MappedValue>,
    /// Makes no samples at present.
    is_held: bool,
    /// TPDOs received with another length.
    wrong_lengths: u64,
    /// The length of the first TPDO with another length.
    other_length: Option<usize>,
    /// TPDOs had more than one length.
    is_mixed: bool,
    /// TPDOs of [`TpdoDecoder::other_length`] are used up to the mapped length.
    uses_longer: bool,
}

/// Decodes the TPDOs of several nodes.
#[derive(Debug, Default)]
pub struct Decoder {
    tpdos: HashMap<CanId, TpdoDecoder>,
    sources: Vec<Source>,
    /// COB-IDs of two nodes that were not reported yet.
    shared: BTreeMap<CanId, (NodeId, NodeId)>,
}

/// Lengths of TPDOs that differ from their mapping: the first one, and whether there were others.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LengthsSeen(BTreeMap<CanId, (usize, bool)>);

/// What a decoder did with a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Decoded {
    /// It is not a known TPDO.
    NotOurs,
    /// It is a TPDO of this node, and its samples were added.
    Tpdo(NodeId),
    /// It is a TPDO of this node that makes no samples at present.
    Held(NodeId),
    /// It is a TPDO of this node with another length than its mapping. It made no samples.
    WrongLength(NodeId),
}

impl Decoder {
    /// Adds a source and returns its number. A known source keeps its number. Polled values use the same numbers.
    pub fn add_source(&mut self, source: Source) -> usize {
        if let Some(at) = self.sources.iter().position(|known| *known == source) {
            return at;
        }
        self.sources.push(source);
        self.sources.len() - 1
    }

    /// Decodes every valid TPDO of a node; with `wanted`, only these values.
    pub fn add(&mut self, layout: Layout<'_>, wanted: &[Wanted]) {
        for tpdo in layout.tpdos.iter().filter(|tpdo| tpdo.cob_id.is_valid()) {
            let mut decoder = self.tpdo_decoder(layout, tpdo, wanted);
            let id = tpdo.cob_id.can_id();
            // Two nodes send with one COB-ID: the sender of a frame is unknown.
            if let Some(other) = self.tpdos.get(&id).filter(|other| other.node != layout.node) {
                decoder.is_held = true;
                self.shared.insert(id, (other.node, layout.node));
            }
            self.tpdos.insert(id, decoder);
        }
    }

    /// Decodes a node that was read again. Its old TPDOs are removed.
    pub fn replace(&mut self, layout: Layout<'_>, wanted: &[Wanted]) {
        self.remove(layout.node);
        self.add(layout, wanted);
    }

    /// Uses the TPDOs of a node that are always longer than their mapping, up to the mapped length. Call it only if the
    /// mapping was read from the device and read again without a difference. `before` has the lengths received before the
    /// mapping was read again. Returns the mapped and the received length of each such TPDO.
    pub fn use_longer(&mut self, node: NodeId, before: &LengthsSeen) -> Vec<(CanId, usize, usize)> {
        let mut used = Vec::new();
        for (&id, tpdo) in self.tpdos.iter_mut().filter(|(_, tpdo)| tpdo.node == node) {
            let Some(&(length, is_mixed)) = before.0.get(&id) else { continue };
            (tpdo.other_length, tpdo.is_mixed) = (Some(length), is_mixed);
            tpdo.uses_longer = !is_mixed && length > tpdo.length;
            if tpdo.uses_longer {
                used.push((id, tpdo.length, length));
            }
        }
        used
    }

    /// The lengths that the TPDOs of a node had, if they differ from the mapping.
    pub fn lengths_seen(&self, node: NodeId) -> LengthsSeen {
        let of_node = self.tpdos.iter().filter(|(_, tpdo)| tpdo.node == node);
        LengthsSeen(of_node.filter_map(|(&id, tpdo)| Some((id, (tpdo.other_length?, tpdo.is_mixed)))).collect())
    }

    /// The mapped and the received length in bytes of the first TPDO of a node whose length differs from its mapping.
    pub fn wrong_length(&self, node: NodeId) -> Option<(usize, usize)> {
        let mut of_node = self.tpdos.values().filter(|tpdo| tpdo.node == node && !tpdo.uses_longer);
        of_node.find_map(|tpdo| Some((tpdo.length, tpdo.other_length?)))
    }

    /// Removes the TPDOs of a node.
    pub fn remove(&mut self, node: NodeId) {
        self.tpdos.retain(|_, tpdo| tpdo.node != node);
    }

    /// The setup of a node may have changed: its TPDOs make no samples until [`Decoder::replace`].
    pub fn hold(&mut self, node: NodeId) {
        self.tpdos.values_mut().filter(|tpdo| tpdo.node == node).for_each(|tpdo| tpdo.is_held = true);
    }

    fn tpdo_decoder(&mut self, layout: Layout<'_>, tpdo: &Tpdo, wanted: &[Wanted]) -> TpdoDecoder {
        let fields = lay_out(&tpdo.mapping);
        let bits: usize = fields.iter().map(|field| usize::from(field.entry.bits)).sum();
        let mut values = Vec::new();
        for field in &fields {
            let object = field.entry.object;
            let data_type = layout.mapped_type(object, field.entry.bits);
            let mut add = |name: &str, unit: String, reading: &dyn Fn(usize) -> Reading, status: Option<Field>| {
                let source = self.add_source(Source { node: layout.node, signal: name.into(), unit: unit.into() });
                values.push(MappedValue { field: *field, reading: reading(source), status });
            };
            let is_wanted = |item: &Wanted| wanted.contains(item);
            if let Some(signal) = layout.signals.iter().find(|signal| signal.is_value(object)) {
                if wanted.is_empty() || is_wanted(&Wanted::Signal(signal.name.clone())) {
                    let status = fields.iter().find(|other| Some(other.entry.object) == signal.status).copied();
                    add(
                        &signal.name,
                        unit_of(Some(signal)),
                        &|source| Reading::of_signal(signal, data_type, source),
                        status,
                    );
                }
            } else if let Some(signal) = layout.signals.iter().find(|signal| signal.status == Some(object)) {
                if is_wanted(&Wanted::Status(signal.name.clone())) {
                    let name = format!("{}.status", signal.name);
                    add(&name, String::new(), &|source| Reading::plain(data_type, source), None);
                }
            } else if wanted.is_empty() && !is_dummy(object) {
                let reading = |source| Reading::of_object(layout, object, data_type, source);
                add(&object.to_string(), unit_of(layout.signal_of(object)), &reading, None);
            }
            for item in wanted {
                if let Wanted::Object(wanted, stated) = item
                    && *wanted == object
                {
                    let reading = |source| match *stated {
                        Some(stated) => {
                            Reading::plain(Some(stated).filter(|stated| fits(*stated, field.entry.bits)), source)
                        }
                        None => Reading::of_object(layout, object, data_type, source),
                    };
                    let signal = layout.signal_of(object).filter(|signal| stated.is_none() && !signal.is_value(object));
                    add(&item.name(), unit_of(signal), &reading, None);
                }
            }
        }
        TpdoDecoder {
            node: layout.node,
            length: bits.div_ceil(8),
            values,
            is_held: false,
            wrong_lengths: 0,
            other_length: None,
            is_mixed: false,
            uses_longer: false,
        }
    }

    /// Every source, in the order of their numbers.
    pub fn sources(&self) -> &[Source] {
        &self.sources
    }

    /// COB-IDs with which two nodes send TPDOs, each returned once. These TPDOs make no samples.
    pub fn take_shared_cob_ids(&mut self) -> BTreeMap<CanId, (NodeId, NodeId)> {
        std::mem::take(&mut self.shared)
    }

    /// The COB-IDs of the decoded TPDOs.
    pub fn can_ids(&self) -> impl Iterator<Item = CanId> + '_ {
        self.tpdos.keys().copied()
    }

    /// The number of values that are decoded from the TPDO with this COB-ID.
    pub fn values_of(&self, id: CanId) -> u64 {
        self.tpdos.get(&id).map_or(0, |tpdo| tpdo.values.len() as u64)
    }

    /// TPDOs of a node that had another length than their mapping.
    pub fn wrong_lengths(&self, node: NodeId) -> u64 {
        self.tpdos.values().filter(|tpdo| tpdo.node == node).map(|tpdo| tpdo.wrong_lengths).sum()
    }

    /// Decodes a frame. Its samples are added to `samples` in the order of the mapping.
    ///
    /// A TPDO with another length than its mapping makes no samples: its mapping was changed, or another device sent it.
    pub fn decode(&mut self, received: &Received, samples: &mut Vec<Sample>) -> Decoded {
        let frame = &received.frame;
        let Some(tpdo) = self.tpdos.get_mut(&frame.id()).filter(|_| !frame.is_remote()) else {
            return Decoded::NotOurs;
        };
        if tpdo.is_held {
            return Decoded::Held(tpdo.node);
        }
        let data = frame.data();
        if data.len() != tpdo.length || tpdo.uses_longer {
            tpdo.wrong_lengths += 1;
            let other = *tpdo.other_length.get_or_insert(data.len());
            if other != data.len() {
                // Two devices send with this COB-ID, or the mapping has changed.
                tpdo.is_mixed = true;
                tpdo.uses_longer = false;
            }
            if !tpdo.uses_longer {
                return Decoded::WrongLength(tpdo.node);
            }
        } else if tpdo.other_length.is_some() {
            tpdo.is_mixed = true;
        }
        for value in &tpdo.values {
            let Some((bytes, len)) = value.field.bytes(data) else { continue };
            let status = value.status.and_then(|status| status.bytes(data)).map(|(bits, _)| u64::from_le_bytes(bits));
            samples.extend(value.reading.sample(received.at, &bytes[..len], status));
        }
        Decoded::Tpdo(tpdo.node)
    }
}

/// Whether a mapped object only fills a gap: indices 0001h to 001Fh (CiA 301, 7.4.7.1).
fn is_dummy(object: ObjectId) -> bool {
    object.index < 0x20
}

/// The source of a value of a node; `signal` gives the unit.
pub fn source(node: NodeId, name: &str, signal: Option<&Signal>) -> Source {
    Source { node, signal: Arc::from(name), unit: Arc::from(unit_of(signal)) }
}

/// The unit of a signal in words; empty if it is unknown.
fn unit_of(signal: Option<&Signal>) -> String {
    signal.and_then(|signal| signal.unit).map(|unit| unit.to_string()).unwrap_or_default()
}

#[cfg(test)]
mod tests {
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
            value: (object, Some(data_type)),
            also: vec![ObjectId::new(0x2090, 0)],
            status: None,
            marker: false,
            unit: Some(Unit(0x004e_0000)),
            digits: Some(3),
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
            signal.marker = true;
        });
        assert_eq!(rows(&mh4, &[], "181#0000803F00"), [row("pressure", "1", "ok")]);
        assert_eq!(rows(&mh4, &[], "181#0000C07F03"), [row("pressure", "", "overload-high")]);
        assert_eq!(rows(&mh4, &[], "181#0000C07F05"), [row("pressure", "", "overload-low")]);
        assert_eq!(rows(&mh4, &[], "181#0000C07F00"), [row("pressure", "", "invalid")]);
        assert_eq!(rows(&mh4, &[], "181#0000803F01"), [row("pressure", "", "invalid")]);
        // Another length than the mapping's, a remote request, a 29-bit identifier: no row.
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
        assert_eq!(rows(&second, &[], "181#030000803F00"), [row("0x6150:1", "3", ""), row("pressure", "1", "ok")]);
        assert_eq!(rows(&second, &[], "181#000000803F01"), [row("0x6150:1", "0", ""), row("pressure", "", "invalid")]);
    }

    /// Decodes the frames; after the first `before` ones the mapping is read again. Returns the values of the later ones.
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
        assert_eq!(after_reread(&[0x6130_0120], 2, &["181#0000803F", long, long]), ["1"], "long since the reread");
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
        assert!(matches!(decoder.decode(&received, &mut samples), Decoded::Held(_)) && samples.is_empty());
        assert_eq!(decoder.take_shared_cob_ids().into_values().collect::<Vec<_>>(), [(one.id, other.id)]);
    }

    #[test]
    fn dps_integer_has_digits_and_no_status() {
        let dps = node((ObjectId::new(0x6130, 1), DataType::Integer(4)), &[0x6130_0120], |_| {});
        let mut dps = dps;
        // Without a description 6130h is REAL32 by the profile, and the integer is no such number.
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
        let marked = node(REAL, &[0x9130_0120], |signal| signal.marker = true);
        assert_eq!(rows(&marked, &[], "181#00000080"), [row("pressure", "", "invalid")]);
        assert_eq!(rows(&marked, &[], "181#D2040000"), [row("pressure", "1.234", "ok")]);
        // NaN is no number on any device.
        let other = node(REAL, &[0x6130_0120], |_| {});
        assert_eq!(rows(&other, &[], "181#0000C07F"), [row("pressure", "", "invalid")]);
        assert_eq!(rows(&other, &[], "181#0000807F"), [row("pressure", "", "invalid")]);
    }

    #[test]
    fn other_objects_of_a_signal_and_objects_without_signal() {
        let d20 = node(REAL, &[0x2090_0020], |_| {});
        // Without a description the type of 2090h is unknown: no value. It is the signal all the same.
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
        ];
        let found = rows(&other, &wanted, "181#2EFB0000AC41");
        let expected = [("0x6010:0/i16", "-1234"), ("0x6010:0/i32", ""), ("0x2100:1/r32", "21.5")];
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
}
