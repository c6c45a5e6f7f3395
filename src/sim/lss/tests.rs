use super::*;
use crate::device::catalog;
use crate::sim::objects::Objects;
use crate::sim::settings::{BitRate, Pair};

const IDENTITY: Identity = [0x362, 0x443150, 0x10000, 20002];

struct TestBed {
    slave: Slave,
    settings: Settings,
    identity: Identity,
}

impl TestBed {
    fn new(kind: &str, node: Option<u8>, supported: SimLss) -> TestBed {
        let model = catalog::by_name(kind).expect("built in");
        let node = node.map(|node| NodeId::new(node).expect("a node-ID"));
        let objects = Objects::new(&model, NodeId::MIN);
        let settings = Settings::new(&model.description, &objects, Pair { node, rate: BitRate::At(250_000) });
        TestBed { slave: Slave::new(supported, BTreeMap::new(), false), settings, identity: IDENTITY }
    }

    fn ask(&mut self, request: &str) -> Reply {
        let frame: crate::canopen::frame::Frame = format!("7E5#{request}").parse().expect("a frame");
        let mut bytes = [0; 8];
        bytes.iter_mut().zip(frame.data()).for_each(|(to, from)| *to = *from);
        self.slave.request(bytes, self.identity, &mut self.settings)
    }

    /// Sends requests and checks their answers, without trailing zeros; `-` means no answer.
    fn play(&mut self, lines: &[(&str, &str)]) {
        for (request, expected) in lines {
            let reply = self.ask(request);
            let bytes = reply.answer.map(|answer| answer.map(|byte| format!("{byte:02X}")).concat());
            let expected = (*expected != "-").then(|| format!("{expected:0<16}"));
            assert_eq!(bytes, expected, "after {request}");
        }
    }
}

fn all() -> SimLss {
    SimLss::default()
}

#[test]
fn waiting_state_ignores_configuration_and_inquiry() {
    let mut bed = TestBed::new("mh4", Some(5), all());
    for request in ["1107", "130004", "15E803", "17", "5A", "5B", "5C", "5D", "5E", "4C", "5100000000800000", "0402"] {
        assert_eq!(bed.ask(request), Reply::default(), "{request}");
    }
    assert_eq!(bed.settings.pending, bed.settings.persistent);
}

#[test]
fn configuration_state_supports_every_service() {
    let mut bed = TestBed::new("mh4", Some(5), all());
    bed.play(&[
        ("0401", "-"),
        ("5A", "5A62030000"),
        ("5B", "5B50314400"),
        ("5C", "5C00000100"),
        ("5D", "5D224E0000"),
        ("5E", "5E05"),
        ("1100", "1101"),
        ("1180", "1101"),
        ("117F", "11"),
        ("5E", "5E05"),
        ("130005", "1301"),
        ("130104", "1301"),
        ("130004", "13"),
        ("5100000000800000", "-"),
        ("4C", "-"),
    ]);
    assert_eq!(bed.settings.persistent.node, NodeId::new(5).ok(), "not stored yet");
    bed.play(&[("17", "17")]);
    assert_eq!(bed.settings.persistent, Pair { node: NodeId::new(127).ok(), rate: BitRate::At(125_000) });
    assert_eq!(bed.ask("15E803").then, DeviceAction::Activate(Duration::from_secs(1)));
    bed.play(&[("11FF", "11"), ("0400", "-"), ("5A", "-")]);
    assert_eq!(bed.settings.pending.node, None);
}

#[test]
fn bit_rate_codes_follow_the_device_table() {
    let mut bed = TestBed::new("dps", Some(5), all());
    bed.play(&[("0401", "-"), ("130005", "13"), ("130001", "1301"), ("130009", "1301")]);
    assert_eq!(bed.settings.pending.rate, BitRate::At(100_000));
    let mut bed = TestBed::new("mh4", Some(5), all());
    bed.play(&[("0401", "-"), ("130009", "13")]);
    assert_eq!(bed.settings.pending.rate, BitRate::Auto);
    // If the table is unknown, the table of CiA 305 is used.
    let mut bed = TestBed::new("d20", Some(5), all());
    bed.play(&[("0401", "-"), ("130008", "13"), ("130005", "1301"), ("130009", "1301")]);
    assert_eq!(bed.settings.pending.rate, BitRate::At(10_000));
}

#[test]
fn only_the_complete_address_in_order_selects() {
    let address = ["4062030000", "4150314400", "4200000100", "43224E0000"];
    let mut bed = TestBed::new("mh4", Some(5), all());
    bed.play(&[(address[0], "-"), (address[1], "-"), (address[2], "-"), (address[3], "44"), ("5E", "5E05")]);
    // In configuration state the slave ignores addresses, even those of other devices.
    bed.play(&[(address[0], "-"), (address[1], "-"), (address[2], "-"), (address[3], "-"), ("5E", "5E05")]);
    for (part, wrong) in [(0, "4061030000"), (1, "4150314401"), (2, "4201000100"), (3, "43234E0000")] {
        bed.play(&[("0400", "-")]);
        for (index, right) in address.iter().enumerate() {
            bed.play(&[(if index == part { wrong } else { right }, "-")]);
        }
    }
    // The address sequence can restart at any time.
    bed.play(&[(address[0], "-"), (address[1], "-"), (address[0], "-"), (address[1], "-")]);
    bed.play(&[(address[2], "-"), (address[3], "44"), ("0400", "-")]);
    // A part is missing, repeated or interrupted.
    for order in [&[0, 1, 3][..], &[0, 1, 1, 2, 3], &[1, 2, 3], &[0, 2, 1, 3]] {
        order.iter().for_each(|&part| bed.play(&[(address[part], "-")]));
    }
    bed.play(&[(address[0], "-"), (address[1], "-"), ("0400", "-"), (address[2], "-"), (address[3], "-")]);
    assert!(!bed.slave.is_configuring());
}

#[test]
fn identification_by_range() {
    let mut bed = TestBed::new("mh4", Some(5), all());
    let ask = |bed: &mut TestBed, low: u32, high: u32, last: &str| {
        let text = |service: u8, number: u32| {
            format!("{service:02X}{}", number.to_le_bytes().map(|b| format!("{b:02X}")).concat())
        };
        for (service, number) in [(0x46, 0x362), (0x47, 0x443150), (0x48, 0), (0x49, u32::MAX), (0x4a, low)] {
            bed.play(&[(&text(service, number), "-")]);
        }
        bed.play(&[(&text(0x4b, high), last)]);
    };
    ask(&mut bed, 20002, 20002, "4F");
    ask(&mut bed, 0, u32::MAX, "4F");
    ask(&mut bed, 20003, u32::MAX, "-");
    ask(&mut bed, 0, 20001, "-");
    // Also in configuration state.
    bed.play(&[("0401", "-")]);
    ask(&mut bed, 0, 20002, "4F");
}

/// Searches as in CiA 305. Finds each part bit by bit, from the highest bit. Then confirms the whole part, with the
/// number of the next part in the same request.
fn fastscan(bed: &mut TestBed) -> Identity {
    let mut found = [0; 4];
    bed.play(&[("5100000000800000", "4F")]);
    for part in 0..4u8 {
        let mut number = 0u32;
        let request = |number: u32, check: u8, next: u8| {
            let [a, b, c, d] = number.to_le_bytes();
            [0x51, a, b, c, d, check, part, next].map(|byte| format!("{byte:02X}")).concat()
        };
        for bit in (0..32u8).rev() {
            if bed.ask(&request(number, bit, part)).answer.is_none() {
                number |= 1 << bit;
            }
        }
        bed.play(&[(&request(number, 0, (part + 1) % 4), "4F")]);
        found[usize::from(part)] = number;
    }
    found
}

#[test]
fn fastscan_finds_an_unconfigured_device() {
    for identity in [IDENTITY, [0, 0, 0, 0], [u32::MAX; 4], [1, 0x8000_0000, 0x7fff_ffff, 0xaaaa_5555]] {
        let mut bed = TestBed { identity, ..TestBed::new("mh4", None, all()) };
        bed.play(&[("4C", "50")]);
        assert_eq!(fastscan(&mut bed), identity);
        assert!(bed.slave.is_configuring());
        // After it was found, the slave is silent. Its new node-ID takes effect when it returns to waiting state.
        bed.play(&[("5100000000800000", "-"), ("4C", "50"), ("5E", "5EFF"), ("110C", "11"), ("4C", "-")]);
        assert_eq!(bed.ask("0400").then, DeviceAction::Boot);
        bed.play(&[("5100000000800000", "-")]);
    }
}

#[test]
fn fastscan_skips_devices_that_do_not_match() {
    let mut bed = TestBed::new("mh4", None, all());
    // The second part before the first; a part and a bit that do not exist.
    bed.play(&[
        ("5100000000800000", "4F"),
        ("5150314400000102", "-"),
        ("5162030000000401", "-"),
        ("5162030000200001", "-"),
    ]);
    bed.play(&[("5163030000000001", "-"), ("5162030000000001", "4F"), ("5150314400000102", "4F")]);
    bed.play(&[("5100000100000203", "4F"), ("51234E0000000300", "-"), ("51224E0000000300", "4F")]);
    assert!(bed.slave.is_configuring());
}

#[test]
fn endless_fastscan_answers_every_frame() {
    let mut bed = TestBed::new("mh4", None, all());
    bed.slave = Slave::new(all(), BTreeMap::new(), true);
    fastscan(&mut bed);
    bed.play(&[("5163030000000001", "4F"), ("0400", "-")]);
}

#[test]
fn unsupported_services_are_not_answered() {
    let model = catalog::by_name("dps").expect("built in");
    let mut bed = TestBed::new("dps", Some(127), crate::sim::data::SimData::of(&model).lss);
    bed.play(&[("0401", "-"), ("5A", "-"), ("5E", "-"), ("46", "-"), ("4C", "-"), ("117E", "11"), ("17", "17")]);
}

#[test]
fn services_can_be_refused() {
    let mut bed = TestBed::new("mh4", Some(5), all());
    bed.slave = Slave::new(all(), BTreeMap::from([(0x11, 0xff), (0x17, 1)]), false);
    bed.play(&[("0401", "-"), ("1107", "11FF"), ("130004", "13"), ("17", "1701")]);
    assert_eq!(bed.settings.pending.node, NodeId::new(5).ok());
    assert_eq!(bed.settings.persistent.rate, BitRate::At(250_000));
}
