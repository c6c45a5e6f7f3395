use super::*;

const DEVICE: &str = r#"
        name = "t"
        title = ""
        vendor = ""
        source = ""
        [identify]
        [[object]]
        at = "0x1010:1"
        name = "store-all"
        type = "u32"
        access = "rw"
        signature = "save"
        default = 1
        [[object]]
        at = "0x1017"
        name = "producer-heartbeat-time"
        type = "u16"
        access = "rw"
        default = 0
        stored = "comm"
        only_if_zero = ["0x100C"]
        [[object]]
        at = "0x100C"
        name = "guard-time"
        type = "u16"
        access = "rw"
        default = 0
        [[object]]
        at = "0x1800:1"
        name = "tpdo1-cob-id"
        type = "u32"
        access = "rw"
        default = "$NODEID+0x40000180"
        stored = "comm"
        [[object]]
        at = "0x1A00:0"
        name = "tpdo1-mapping"
        type = "u8"
        access = "ro"
        [[object]]
        at = "0x6131:1"
        name = "unit"
        type = "u32"
        access = "rw"
        default = 0x4E0000
        allow = ["0x4E0000", "0xAB0000"]
        stored = "app"
        [[object]]
        at = "0x6132:1-2"
        name = "digits"
        type = "u8"
        access = "rw"
        low = 1
        high = 5
        stored = "app"
        [[object]]
        at = "0x6127:1"
        name = "offset"
        type = "r32"
        access = "ro"
        [[object]]
        at = "0x6125:1"
        name = "autozero"
        type = "u32"
        access = "wo"
        signature = "zero"
        [[object]]
        at = "0x2320"
        name = "node-id"
        type = "u32"
        access = "rw"
        signature = "set"
        default = "$NODEID"
        stored = "all"
    "#;

fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

fn objects() -> Objects {
    Objects::new(&Model::from_toml(DEVICE).expect("a description"), node(5))
}

fn id(text: &str) -> ObjectId {
    text.parse().expect("an object")
}

fn refusal(objects: &Objects, object: &str, bytes: &[u8]) -> Option<u32> {
    objects.check_write(id(object), bytes).err().map(|Abort(code)| code)
}

#[test]
fn new_device_has_factory_defaults() {
    let objects = objects();
    assert_eq!(objects.number(id("0x1800:1")), 0x4000_0185);
    assert_eq!(objects.bytes(id("0x6127:1")), Some([0; 4].as_slice()));
    assert_eq!(objects.bytes(id("0x6127:2")), None);
}

#[test]
fn each_refusal_has_its_abort_code() {
    let objects = objects();
    for (object, bytes, code) in [
        ("0x2000", &[0][..], 0x0602_0000),
        ("0x6132:3", &[2], 0x0609_0011),
        ("0x6127:1", &[0; 4], 0x0601_0002),
        ("0x6132:1", &[2, 0], 0x0607_0010),
        ("0x6132:2", &[6], 0x0609_0031),
        ("0x6132:2", &[0], 0x0609_0032),
        ("0x6131:1", &[0, 0, 0x4f, 0], 0x0609_0030),
        ("0x1010:1", b"evas", 0x0800_0020),
        ("0x6125:1", b"load", 0x0800_0020),
        ("0x2320", &[3, 0, 0, 0], 0x0800_0020),
    ] {
        assert_eq!(refusal(&objects, object, bytes), Some(code), "{object} {bytes:x?}");
    }
    for (object, bytes) in [
        ("0x6132:2", &[5][..]),
        ("0x6131:1", &[0, 0, 0xab, 0]),
        ("0x1010:1", b"save"),
        ("0x6125:1", b"zero"),
        ("0x2320", b"\x03set"),
    ] {
        assert_eq!(refusal(&objects, object, bytes), None, "{object} {bytes:x?}");
    }
    assert_eq!(objects.check_readable(id("0x6125:1")).err(), Some(Abort::WRITE_ONLY));
    assert!(objects.check_readable(id("0x6127:1")).is_ok());
}

#[test]
fn writable_only_while_another_is_zero() {
    let mut objects = objects();
    assert_eq!(refusal(&objects, "0x1017", &[100, 0]), None);
    objects.put(id("0x100C"), vec![50, 0]);
    assert_eq!(refusal(&objects, "0x1017", &[100, 0]), Some(0x0800_0020));
    assert_eq!(refusal(&objects, "0x1017", &[0, 0]), None, "off is off");
}

#[test]
fn save_stores_the_requested_group_only() {
    let mut objects = objects();
    let change = |objects: &mut Objects| {
        objects.put(id("0x1017"), vec![100, 0]);
        objects.put(id("0x6131:1"), vec![0, 0, 0xab, 0]);
        objects.put(id("0x100C"), vec![7, 0]);
    };
    change(&mut objects);
    objects.save(Group::Application, node(5));
    objects.reset(Area::All, node(5));
    assert_eq!(objects.number(id("0x6131:1")), 0xab_0000);
    assert_eq!(objects.number(id("0x1017")), 0, "not of the group");
    assert_eq!(objects.number(id("0x100C")), 0, "not marked as stored");
    change(&mut objects);
    objects.save(Group::All, node(5));
    objects.reset(Area::All, node(9));
    assert_eq!(objects.number(id("0x1017")), 100);
    assert_eq!(objects.number(id("0x1800:1")), 0x4000_0189, "the default follows the node-ID");
    // Restoring takes effect after the reset.
    objects.restore(Group::Communication);
    assert_eq!(objects.number(id("0x1017")), 100);
    objects.reset(Area::All, node(9));
    assert_eq!(objects.number(id("0x1017")), 0);
    assert_eq!(objects.number(id("0x6131:1")), 0xab_0000);
}

#[test]
fn communication_reset_keeps_other_objects() {
    let mut objects = objects();
    objects.put(id("0x1017"), vec![100, 0]);
    objects.put(id("0x6131:1"), vec![0, 0, 0xab, 0]);
    objects.reset(Area::Communication, node(5));
    assert_eq!(objects.number(id("0x1017")), 0);
    assert_eq!(objects.number(id("0x6131:1")), 0xab_0000);
}

#[test]
fn restore_keeps_node_id_and_bit_rate() {
    let mut objects = objects();
    objects.put(id("0x2320"), vec![9, 0, 0, 0]);
    objects.save(Group::All, node(5));
    objects.restore(Group::All);
    objects.reset(Area::All, node(5));
    assert_eq!(objects.number(id("0x2320")), 9);
}
