use super::*;
use crate::canopen::id::NodeId;
use crate::device::catalog;
use crate::sim::Overload;

fn id(text: &str) -> ObjectId {
    text.parse().expect("an object")
}

const AT: Duration = Duration::from_millis(500);

/// Creates a device whose channels are constant at `base` in their own units.
fn still(name: &str, base: f64, overloads: &[(u8, Overload)]) -> (Objects, Channels) {
    let mut setup = Setup::new(catalog::by_name(name).expect("built in"), NodeId::new(5).expect("a node-ID"));
    for channel in &mut setup.channels {
        (channel.base, channel.amplitude, channel.noise) = (base, 0.0, 0.0);
    }
    setup.overloads = overloads.to_vec();
    let objects = Objects::new(&setup.model, NodeId::new(5).expect("a node-ID"));
    let channels = Channels::new(&setup, &objects);
    (objects, channels)
}

fn real(bytes: &[u8]) -> f32 {
    f32::from_le_bytes(bytes.try_into().expect("four bytes"))
}

#[test]
fn one_quantity_in_every_family() {
    let (objects, mut channels) = still("mh4", 5.25, &[]);
    assert_eq!(real(&channels.read(&objects, id("6130:1"), AT).expect("shown")), 5.25);
    assert_eq!(channels.read(&objects, id("7130:1"), AT), Some(5250i16.to_le_bytes().to_vec()));
    assert_eq!(channels.read(&objects, id("9130:1"), AT), Some(5250i32.to_le_bytes().to_vec()));
    // 0 to 10 bar are 0 to 10000.
    assert_eq!(channels.read(&objects, id("7100:1"), AT), Some(5250i16.to_le_bytes().to_vec()));
    assert_eq!(channels.read(&objects, id("6150:1"), AT), Some(vec![0]));
    assert_eq!(channels.read(&objects, id("1000"), AT), None);
    assert_eq!(channels.read(&objects, id("6130:0"), AT), None);
}

#[test]
fn field_values_of_the_mc1609_manual() {
    // FV 40000 is 798.5 degC.
    let (objects, mut channels) = still("mc1609", 798.5, &[]);
    assert_eq!(channels.read(&objects, id("7130:2"), AT), Some(7985i16.to_le_bytes().to_vec()));
    let field = channels.read(&objects, id("7100:2"), AT).expect("shown");
    assert_eq!(u16::from_le_bytes(field.try_into().expect("two bytes")), 40002, "40000 is 798.45");
}

#[test]
fn the_dps_manual_changes_psi_to_bar() {
    // Table 19: 50.000 psi, then 3.448 bar (3.447 by exact conversion).
    let (mut objects, mut channels) = still("dps", 50.0, &[]);
    assert_eq!(channels.read(&objects, id("6130:1"), AT), Some(vec![0x50, 0xc3, 0, 0]));
    assert!(channels.change_unit(&mut objects, id("6131:1"), Unit(0x4e_0000)));
    assert_eq!(channels.read(&objects, id("6130:1"), AT), Some(3447i32.to_le_bytes().to_vec()));
    // Table 18: the span is also converted; 100 psi are 6.895 bar.
    assert_eq!(objects.real(id("6149:1")), Some(6895.0));
    assert_eq!(objects.real(id("2006")), Some(6895.0));
    // A pressure cannot change to a temperature; nothing is changed.
    assert!(!channels.change_unit(&mut objects, id("6131:1"), Unit(0x2d_0000)));
    assert_eq!(objects.number(id("6131:1")), 0x4e_0000);
}

#[test]
fn old_unit_restores_the_numbers_without_rounding() {
    let (mut objects, mut channels) = still("dps", 50.0, &[]);
    for code in [0x4e_0000, 0xab_0000] {
        assert!(channels.change_unit(&mut objects, id("6131:1"), Unit(code)));
    }
    // 6.895 bar are 100.004 psi.
    assert_eq!(objects.real(id("2006")), Some(100_000.0));
    // A number that was written meanwhile is converted.
    assert!(channels.change_unit(&mut objects, id("6131:1"), Unit(0x4e_0000)));
    objects.put(id("2006"), 6000i32.to_le_bytes().to_vec());
    assert!(channels.change_unit(&mut objects, id("6131:1"), Unit(0xab_0000)));
    assert_eq!(objects.real(id("2006")), Some(87_023.0));
}

#[test]
fn each_number_is_converted_once() {
    // The description of this device also states the objects of CiA 404 that follow the unit.
    let (mut objects, mut channels) = still("hydac", 100.0, &[]);
    assert!(channels.change_unit(&mut objects, id("6131:1"), Unit(0xab_0000)));
    assert!((objects.real(id("6149:1")).expect("a number") - 5801.5).abs() < 0.1);
}

#[test]
fn points_and_distances_are_converted_differently() {
    let (mut objects, mut channels) = still("mh4", 25.0, &[]);
    objects.put(id("6133:2"), 10f32.to_le_bytes().to_vec());
    assert!(channels.change_unit(&mut objects, id("6131:2"), Unit(0xac_0000)));
    assert_eq!(objects.real(id("6133:2")), Some(18.0), "a difference of 10 K is one of 18 degF");
    assert_eq!(objects.real(id("6149:2")), Some(257.0), "125 degC are 257 degF");
    assert_eq!(real(&channels.read(&objects, id("6130:2"), AT).expect("shown")), 77.0);
    assert_eq!(objects.real(id("6149:1")), Some(10.0), "the other channel keeps its unit");
}

#[test]
fn autozero_moves_the_value_into_the_offset() {
    let (mut objects, mut channels) = still("mh4", 0.25, &[]);
    assert!(channels.autozero(&mut objects, 1, AT));
    assert_eq!(objects.real(id("6127:1")), Some(-0.25));
    assert_eq!(real(&channels.read(&objects, id("6130:1"), AT).expect("shown")), 0.0);
    // A second autozero at zero changes nothing.
    assert!(channels.autozero(&mut objects, 1, AT));
    assert_eq!(objects.real(id("6127:1")), Some(-0.25));
    let (mut objects, mut channels) = still("dps", 0.5, &[]);
    assert!(channels.autozero(&mut objects, 1, AT));
    assert_eq!(channels.read(&objects, id("6130:1"), AT), Some(vec![0; 4]));
    assert!(!channels.autozero(&mut objects, 2, AT), "no such channel");
}

#[test]
fn overload_has_the_form_of_the_manual() {
    let overload = |direction| [(1, Overload { from: Duration::ZERO, until: Duration::MAX, direction })];
    for (direction, bits) in [(Direction::High, 0x03), (Direction::Low, 0x05)] {
        let (objects, mut channels) = still("mh4", 5.0, &overload(direction));
        assert!(real(&channels.read(&objects, id("6130:1"), AT).expect("shown")).is_nan());
        assert_eq!(channels.read(&objects, id("7130:1"), AT), Some(vec![0, 0x80]));
        assert_eq!(channels.read(&objects, id("9130:1"), AT), Some(vec![0, 0, 0, 0x80]));
        assert_eq!(channels.read(&objects, id("6150:1"), AT), Some(vec![bits]));
        assert_eq!(channels.read(&objects, id("6150:2"), AT), Some(vec![0]), "the other channel is well");
    }
    // Without a marker, the value itself is outside of the range of 100 psi.
    let (objects, mut channels) = still("dps", 5.0, &overload(Direction::High));
    assert_eq!(channels.read(&objects, id("6130:1"), AT), Some(105_000i32.to_le_bytes().to_vec()));
}

#[test]
fn extremes_cover_the_values_read() {
    let model = catalog::by_name("mh4").expect("built in");
    let objects = Objects::new(&model, NodeId::new(5).expect("a node-ID"));
    let mut channels = Channels::new(&Setup::new(model, NodeId::MIN), &objects);
    let mut values = Vec::new();
    for millisecond in 0..200 {
        let at = Duration::from_millis(millisecond * 100);
        values.push(real(&channels.read(&objects, id("6130:1"), at).expect("shown")));
    }
    let last = Duration::from_millis(19_900);
    let lowest = values.iter().copied().fold(f32::INFINITY, f32::min);
    let highest = values.iter().copied().fold(f32::NEG_INFINITY, f32::max);
    assert!(lowest < highest);
    assert_eq!(real(&channels.read(&objects, id("2020:1"), last).expect("shown")), lowest);
    assert_eq!(real(&channels.read(&objects, id("2021:1"), last).expect("shown")), highest);
    channels.reset_extremes(1);
    let now = values.last().copied().expect("values");
    assert_eq!(real(&channels.read(&objects, id("2020:1"), last).expect("shown")), now);
    assert_eq!(real(&channels.read(&objects, id("2021:1"), last).expect("shown")), now);
}

#[test]
fn limit_in_several_types_is_one_quantity() {
    let (mut objects, channels) = still("mh4", 5.0, &[]);
    let mut write = |written: &str, bytes: &[u8]| {
        objects.put(id(written), bytes.to_vec());
        channels.share(&mut objects, id(written));
        ["6135:1", "7135:1", "9135:1"].map(|object| objects.real(id(object)).expect("a number"))
    };
    assert_eq!(write("6135:1", &7.5f32.to_le_bytes()), [7.5, 7500.0, 7500.0]);
    assert_eq!(write("7135:1", &6000i16.to_le_bytes()), [6.0, 6000.0, 6000.0]);
    // Too large for an INTEGER16; the written number stays exact.
    assert_eq!(write("9135:1", &16_777_217i32.to_le_bytes())[1..], [32767.0, 16_777_217.0]);
    assert_eq!(write("6135:1", &9.5f32.to_le_bytes()), [9.5, 9500.0, 9500.0]);
    assert_eq!(write("6132:1", &[1]), [9.5, 95.0, 95.0], "decimal digits");
    let delta = |objects: &Objects| ["6133:2", "7133:2", "9133:2"].map(|object| objects.real(id(object)));
    objects.put(id("7133:2"), 100i16.to_le_bytes().to_vec());
    channels.share(&mut objects, id("7133:2"));
    assert_eq!(delta(&objects), [Some(10.0), Some(100.0), Some(100.0)]);
    assert_eq!(objects.real(id("6133:1")), Some(0.0), "the other channel keeps its own");
}

#[test]
fn limit_that_was_stored_in_one_type_holds_in_all_after_the_start() {
    let (mut objects, mut channels) = still("mh4", 5.0, &[]);
    objects.preset(id("6135:1"), 4.25f32.to_le_bytes().to_vec());
    channels.begin(&mut objects, AT);
    assert_eq!(objects.real(id("7135:1")), Some(4250.0));
    assert_eq!(objects.real(id("9135:1")), Some(4250.0));
}

/// Writes an object, as an SDO client does.
fn write(objects: &mut Objects, channels: &mut Channels, object: &str, bytes: &[u8]) {
    objects.put(id(object), bytes.to_vec());
    channels.refilter(objects, id(object), AT);
}

/// The time until a repeating average over four samples is complete after a step from 5 to 9 bar.
fn time_of_step(sample_us: u32) -> Option<Duration> {
    let (mut objects, mut channels) = still("d20", 5.0, &[]);
    channels.begin(&mut objects, Duration::ZERO);
    write(&mut objects, &mut channels, "61A1:1", &[4, 0]);
    write(&mut objects, &mut channels, "61A0:1", &[2]);
    write(&mut objects, &mut channels, "6114:1", &sample_us.to_le_bytes());
    // Since the start of the mean that contains the step, no value was read.
    let step = AT + Duration::from_millis(99);
    channels.hold("pressure", "9bar", step).expect("a value");
    let times = (0..200).map(Duration::from_millis);
    times.into_iter().find(|time| {
        let value = channels.read(&objects, id("6130:1"), step + *time).expect("shown");
        real(&value) == 9.0
    })
}

#[test]
fn filter_has_the_sample_time_of_6114h_and_keeps_earlier_samples() {
    let [one, two] = [1000, 2000].map(|sample_us| time_of_step(sample_us).expect("shown"));
    assert!((4..=8).contains(&one.as_millis()) && (8..=16).contains(&two.as_millis()), "{one:?} {two:?}");
}
