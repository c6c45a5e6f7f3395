use super::*;
use crate::bus::time::Mono;
use crate::bus::{BitRateControl, Bus, Event};
use crate::canopen::id::{CanId, NodeId};
use crate::canopen::object::ObjectId;
use std::time::Duration;

fn nodes(bench: &Bench) -> Vec<u8> {
    bench.devices.iter().filter_map(|device| Some(device.node()?.get())).collect()
}

fn refusal(bench: Result<Bench, BenchError>) -> String {
    match bench {
        Ok(_) => "accepted".to_owned(),
        Err(error) => error.to_string(),
    }
}

#[test]
fn plain_sim_has_the_default_bench() {
    let bench = Bench::parse("").expect("the default");
    assert_eq!(nodes(&bench), [1, 2, 3, 127]);
    assert_eq!((bench.clock(), bench.bit_rate), (Clock::Real, 250_000));
}

#[test]
fn lists_of_devices() {
    let bench = Bench::parse("mh4@5,dps@0x7f,mh4@6").expect("a list");
    assert_eq!(nodes(&bench), [5, 127, 6]);
    let names: Vec<&str> = crate::device::catalog::names().collect();
    for (spec, message) in [
        ("mh4", "\"mh4\" is neither DEVICE@NODE (mh4@1,d20@2,mc1609@3,dps@127) nor a file (FILE.toml)"),
        ("mh4@200", "mh4@200: \"200\" is not a node-ID (1 to 127)"),
        ("mh4@0", "mh4@0: \"0\" is not a node-ID (1 to 127)"),
        ("mh4@5,", "\"\" is neither DEVICE@NODE (mh4@1,d20@2,mc1609@3,dps@127) nor a file (FILE.toml)"),
        ("mh4@5,dps@5", "two devices with node-ID 5"),
        ("mh5@5", &format!("no device \"mh5\" ({}, FILE.toml or FILE.eds)", names.join(", "))),
    ] {
        assert_eq!(refusal(Bench::parse(spec)), message);
    }
    assert!(matches!(Bench::parse("no-such-file.toml"), Err(BenchError::Io { .. })));
}

#[test]
fn devices_without_a_node_id() {
    let bench = Bench::parse("mh4@unconfigured,dps@5,mh4@unconfigured").expect("a list");
    assert_eq!(bench.devices.iter().map(Device::node).collect::<Vec<_>>(), [None, NodeId::new(5).ok(), None]);
    assert_eq!(
        refusal(Bench::parse("mh4@UNCONFIGURED")),
        "mh4@UNCONFIGURED: \"UNCONFIGURED\" is not a node-ID (1 to 127)"
    );
    let text = "[[device]]\nkind = \"mh4\"\n[[device.channel]]\nchannel = 3\n";
    assert_eq!(refusal(Bench::from_toml(text, Path::new(""))), "mh4@unconfigured has no channel 3");
}

#[test]
fn mistakes_in_a_file_have_their_line() {
    let text = |text: &str| refusal(Bench::from_toml(text, Path::new("")));
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\n";
    assert!(text("seed = 1\nsped = 2\n").starts_with("2:1: unknown field `sped`"));
    assert!(text(&format!("{device}nod = 5\n")).starts_with("4:1: unknown field `nod`"));
    assert!(text(&format!("clock = \"unreal\"\n{device}")).starts_with("1:9: unknown variant `unreal`"));
    assert_eq!(text("[[device]]\nkind = \"mh4\"\nnode = 128\n"), "3:8: \"128\" is not a node-ID (1 to 127)");
    assert_eq!(text(&format!("bit_rate = 0\n{device}")), "0 bit/s is not a bit rate of CAN (1 to 1000000)");
    assert_eq!(text("seed = 1\n"), "no device");
    assert_eq!(
        text(&format!("{device}bit_rate = 2000000\n")),
        "mh4@5: 2000000 bit/s is not a bit rate of CAN (1 to 1000000)"
    );
    assert_eq!(text(&format!("{device}{device}")), "two devices with node-ID 5");
    assert!(text(&format!("{device}lss = {{ refuse = {{ \"0x117\" = 1 }} }}\n")).contains("is not a service"));
    assert!(text(&format!("{device}lss = {{ loose = [0x17] }}\n")).contains("unknown field `loose`"));
    assert!(text(&format!("{device}offline_after = [\"lunch\"]\n")).contains("unknown variant `lunch`"));
    assert_eq!(text(&format!("{device}set = {{ \"0x5000\" = 1 }}\n")), "mh4@5: mh4 has no object 0x5000:0");
    assert_eq!(
        text(&format!("{device}set = {{ \"1017\" = 70000 }}\n")),
        "mh4@5: 0x1017:0: 70000 does not fit u16 (0 to 65535)"
    );
    assert!(text(&format!("{device}set = {{ \"x\" = 1 }}\n")).starts_with("4:9: \"x\" is not an object"));
    assert_eq!(text(&format!("{device}[[device.channel]]\nchannel = 3\n")), "mh4@5 has no channel 3");
    let overload = "[[device.overload]]\nchannel = 1\nfrom = \"2s\"\nuntil = \"1s\"\ndirection = \"high\"\n";
    assert_eq!(text(&format!("{device}{overload}")), "mh4@5: an overload that ends before it begins");
    assert!(text(&format!("{device}{}", overload.replace("2s", "2 parsecs"))).starts_with("6:8: "));
}

/// Receives the frames up to `until`.
fn hear(bus: &mut MemoryBus, until: Duration) -> Vec<String> {
    let mut texts = Vec::new();
    while let Ok(Event::Frame(received)) = bus.receive(Mono::at(until)) {
        texts.push(received.frame.to_string());
    }
    texts
}

#[test]
fn every_key_of_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("bench.toml");
    let text = r#"
        clock = "virtual"
        bit_rate = 125000
        seed = 7
        record = "truth.csv"

        [[device]]
        kind = "mh4"
        node = 5
        serial = 4711
        start = true
        set = { "0x1017" = 100, "1800:2" = 254, "0x1800:5" = 150 }

        [[device.channel]]
        channel = 1
        base = 5.0
        amplitude = 0.0
        noise = 0.0

        [[device.overload]]
        channel = 1
        from = "200ms"
        direction = "low"

        [[device]]
        kind = "dps"
        node = 127
    "#;
    std::fs::write(&path, text).expect("written");
    let mut bus = Bench::parse(path.to_str().expect("text")).expect("a bench").open().expect("opened");
    assert_eq!(bus.bit_rate(), Some(125_000));
    assert_eq!(
        hear(&mut bus, Duration::from_millis(310)),
        ["705#00", "77F#00", "705#05", "185#0000A04000", "705#05", "085#01F0810105000000", "185#0000C07F05", "705#05",]
            .map(str::to_owned)
    );
    let serial: ObjectId = "1018:4".parse().expect("an object");
    let now = bus.now().mono;
    let device: &mut Device = bus.stations_mut().next().expect("a device");
    assert_eq!(device.value(serial, now), Some(4711u32.to_le_bytes().to_vec()));
    drop(bus);
    let record = std::fs::read_to_string(folder.path().join("truth.csv")).expect("the record");
    let values: Vec<&str> =
        record.lines().skip(1).filter_map(|line| line.split_once(',')).map(|(_, rest)| rest).collect();
    assert_eq!(values, ["5,pressure,5,bar,ok,0x0000A040", "5,pressure,,bar,overload-low,0x0000C07F"]);
}

#[test]
fn configured_faults() {
    let text = r#"
        clock = "virtual"
        retime = false

        [[device]]
        kind = "mh4"
        node = 5
        latency = "1ms"
        offline_after = ["reset"]
        lss = { lose = [0x11], late = { "0x13" = "50ms" }, refuse = { "0x17" = 1 } }

        [[device]]
        kind = "mh4"
        node = 5
        duplicate_id = true
        bit_rate = 125000
    "#;
    let bus = Bench::from_toml(text, Path::new("")).expect("a bench").open().expect("opened");
    assert!(bus.can_set_bit_rate().is_err());
    let rates: Vec<Option<u32>> = bus.stations::<Device>().map(Device::bit_rate).collect();
    assert_eq!(rates, [Some(250_000), Some(125_000)]);
    // The bench without the second device of the same node-ID, because it disturbs every answer.
    let alone = &text[..text.rfind("[[device]]").expect("two devices")];
    let mut bus = Bench::from_toml(alone, Path::new("")).expect("a bench").open().expect("opened");
    let lines = [
        ("7E5#0401000000000000", "705#00"),
        ("7E5#110C000000000000", ""),
        ("7E5#1300040000000000", "7E4#1300000000000000"),
        ("7E5#1700000000000000", "7E4#1701000000000000"),
        ("000#8105", ""),
    ];
    for (number, (request, answer)) in (1u32..).zip(lines) {
        bus.send(&request.parse().expect("a frame")).expect("room");
        assert_eq!(hear(&mut bus, Duration::from_millis(100) * number).concat(), answer, "after {request}");
    }
    let device: &Device = bus.stations().next().expect("a device");
    assert_eq!((device.node().map(NodeId::get), device.state()), (Some(12), None));
}

#[test]
fn unwritable_record_is_a_file_error() {
    let text = "record = \"no/such/folder/truth.csv\"\n[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let bench = Bench::from_toml(text, Path::new("")).expect("a bench");
    assert!(matches!(bench.open(), Err(BenchError::Io { .. })));
}

#[test]
fn devices_of_one_kind_have_different_serial_numbers() {
    let mut bus = Bench::parse("mh4@5,dps@6,mh4@7").expect("a list").open().expect("opened");
    let serial: ObjectId = "1018:4".parse().expect("an object");
    let serials: Vec<Option<Vec<u8>>> =
        bus.stations_mut::<Device>().map(|device| device.value(serial, Mono::START)).collect();
    assert_ne!(serials[0], serials[2]);
    assert!(serials.iter().all(|serial| serial.as_deref().is_some_and(|bytes| bytes != [0; 4])));
}

#[test]
fn description_from_a_user_file() {
    let folder = tempfile::tempdir().expect("a folder");
    let model = "name = \"own\"\ntitle = \"\"\nvendor = \"\"\nsource = \"\"\n[identify]\n[[object]]\nat = \"0x1000\"\n\
                 name = \"device-type\"\ntype = \"u32\"\naccess = \"ro\"\ndefault = 404\n";
    std::fs::write(folder.path().join("own.toml"), model).expect("written");
    let text = "clock = \"virtual\"\n[[device]]\nkind = \"own.toml\"\nnode = 9\n";
    let mut bus = Bench::from_toml(text, folder.path()).expect("a bench").open().expect("opened");
    bus.send(&"609#4000100000000000".parse().expect("a frame")).expect("room");
    assert_eq!(hear(&mut bus, Duration::from_secs(1)), ["709#00", "589#4300100094010000"]);
}

#[test]
fn one_line_bench_holds_a_value() {
    let values = |spec: &str, channel| {
        let mut bench = Bench::parse(spec).unwrap_or_else(|error| panic!("{spec}: {error}"));
        [0, 7000].map(|at| {
            let bytes = bench.devices[0].value(ObjectId::new(0x6130, channel), Mono::at(Duration::from_millis(at)));
            bytes.and_then(|bytes| bytes.try_into().ok()).map(f32::from_le_bytes)
        })
    };
    assert_eq!(values("mh4@5:pressure=0bar", 1), [Some(0.0); 2]);
    assert_eq!(values("mh4@5:pressure=250mbar:temperature=-5.5degC", 1), [Some(0.25); 2]);
    assert_eq!(values("mh4@5:pressure=250mbar:temperature=-5.5degC", 2), [Some(-5.5); 2]);
    assert_eq!(values("mh4@5:pressure=1", 1), [Some(1.0); 2]);
    let moving = values("mh4@5:pressure=1", 2);
    assert_ne!(moving[0], moving[1]);
    for wrong in ["mh4@5:", "mh4@5:pressure", "mh4@5:level=1", "mh4@5:pressure=1degC", "mh4@5:pressure=bar"] {
        let error = refusal(Bench::parse(wrong));
        assert!(error.contains("is not SIGNAL=VALUE with a unit of the signal (pressure, temperature)"), "{error}");
    }
}

#[test]
fn eds_alone_is_a_device() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("x.eds");
    let eds = "[DeviceInfo]\nVendorNumber=0x1234\nProductNumber=7\n[MandatoryObjects]\nSupportedObjects=2\n1=0x1000\n\
               2=0x1018\n[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\nDefaultValue=0x20194\n\
               [1018]\nParameterName=Identity\nObjectType=9\nSubNumber=2\n[1018sub0]\nParameterName=Count\n\
               DataType=5\nAccessType=ro\nDefaultValue=1\n[1018sub1]\nParameterName=Vendor\nDataType=7\n\
               AccessType=ro\nDefaultValue=0x1234\n";
    std::fs::write(&path, eds).expect("written");
    let bench = Bench::parse(&format!("{}@9", path.display())).expect("a bench");
    assert_eq!(nodes(&bench), [9]);
    let mut bus = bench.open().expect("no record");
    let mut answer = |request: &str| {
        bus.send(&request.parse().expect("a frame")).expect("sent");
        loop {
            match bus.receive(Mono::at(Duration::from_secs(5))) {
                Ok(Event::Frame(received)) if received.frame.id() == CanId::Standard(0x589) => {
                    return received.frame.to_string();
                }
                Ok(Event::Frame(_)) => {}
                other => return format!("{other:?}"),
            }
        }
    };
    assert_eq!(answer("609#4000100000000000"), "589#4300100094010200");
    assert_eq!(answer("609#4018100100000000"), "589#4318100134120000");
    assert!(refusal(Bench::parse("missing.eds@5")).starts_with("missing.eds: "));
}

#[test]
fn quantities_follow_a_ramp_or_a_file() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("course.csv"), "seconds,bar\n0,1\n0.01; 3\n\n0.02,2\n").expect("written");
    std::fs::write(folder.path().join("wrong.csv"), "0,1\n1,2\n1,3\n").expect("written");
    let channel = "[[device.channel]]\nchannel = 1\nnoise = 0.0\n";
    let bench = |keys: &str| {
        let text = format!("clock = \"virtual\"\n[[device]]\nkind = \"mh4\"\nnode = 5\nstart = true\n{channel}{keys}");
        Bench::from_toml(&text, folder.path())
    };
    let values = |keys: &str| {
        let mut bus = bench(keys).expect("a bench").open().expect("a bus");
        [1, 5, 10, 15, 505].map(|at| {
            let now = Mono::at(Duration::from_millis(at));
            let value =
                bus.stations_mut::<Device>().next().and_then(|device| device.value(ObjectId::new(0x6130, 1), now));
            f32::from_le_bytes(value.and_then(|bytes| bytes.try_into().ok()).expect("a value"))
        })
    };
    for (found, expected) in [
        (values("csv = \"course.csv\"\n"), [1.2, 2.0, 3.0, 2.5, 2.0]),
        (values("form = \"ramp\"\nbase = 5.0\namplitude = 2.0\nperiod_s = 0.02\n"), [3.2, 4.0, 5.0, 6.0, 4.0]),
        (values("base = 5.0\namplitude = 0.0\n"), [5.0; 5]),
    ] {
        assert!(found.iter().zip(expected).all(|(one, other)| (one - other).abs() < 0.25), "{found:?} {expected:?}");
    }
    let error = |keys: &str| bench(keys).err().expect("an error").to_string();
    assert!(
        error("csv = \"wrong.csv\"\n")
            .ends_with("wrong.csv:3: expected SECONDS,VALUE, with a later time than in the previous line")
    );
    assert!(error("csv = \"absent.csv\"\n").contains("absent.csv"));
    assert!(error("form = \"square\"\n").contains("unknown variant"));
}
