//! `objects` and `devices`: what descriptions and EDS files know, without a bus.

use super::Bench;
use std::fs;

const NAMES: [&str; 8] = ["baumer", "d20", "dps", "hydac", "hydac-old", "jumo", "mc1609", "mh4"];

#[test]
fn objects_of_a_description_need_no_bus() {
    let bench = Bench::of("mh4@1");
    let done = bench.run("objects mh4 6148:1").exit(0);
    assert!(done.stdout.starts_with("0x6148:1  ai-span-start:1\n  r32, r"), "{}", done.stdout);
    assert!(done.stdout.contains("  manual: 4.2."), "{}", done.stdout);
    assert_eq!(done.frames, [""; 0]);
    for line in ["objects mh4 ai-span-start:1", "objects 1 ai-span-start:1 --device mh4"] {
        assert_eq!(bench.run(line).exit(0).stdout, done.stdout, "{line}");
    }
    let node = bench.run("objects 1 ai-span-start:1").exit(0);
    assert_eq!(node.stdout, done.stdout);
    assert!(node.frames.iter().any(|frame| frame.starts_with("601#40")), "{:?}", node.frames);
    let all = bench.run("objects dps --format json").exit(0).json();
    let unit = all.iter().find(|object| object["name"] == "ai-physical-unit-pv:1").expect("6131h:1");
    assert_eq!((unit["type"].as_str(), unit["device"].as_str()), (Some("u32"), Some("dps")));
    assert!(
        unit["values"].as_array().is_some_and(|values| values.iter().any(|value| value == "0x00AB0000 psi")),
        "{unit}"
    );
}

#[test]
fn objects_of_an_eds_need_no_bus() {
    let bench = Bench::of("mh4@1");
    let text = "[ManufacturerObjects]\nSupportedObjects=2\n1=0x2200\n2=0x6010\n[2200]\nParameterName=Offset\nObjectType=7\nDataType=8\nAccessType=rw\nDefaultValue=1.5\n\
                [6010]\nParameterName=Slope long16\nObjectType=7\nDataType=3\nAccessType=ro\nPDOMapping=1\n";
    fs::write(bench.path("x.eds"), text).expect("written");
    for line in ["objects x.eds slope --format csv", "objects --eds x.eds slope-long16 --format csv"] {
        let done = bench.run(line).exit(0);
        assert!(done.stdout.ends_with("\neds,0x6010:0,slope-long16,i16,ro,true,,,,,,,,,,,\n"), "{}", done.stdout);
    }
    let table = bench.run("objects --eds x.eds").exit(0).stdout;
    assert_eq!(table.lines().count(), 3, "{table}");
    bench
        .run("objects --eds x.eds ofset")
        .fails(2, "cangauge: the EDS file has no object \"ofset\"\nhint: nearest: offset\n");
    bench.run("objects 200").refuses("\"200\" is not a node-ID (1 to 127)");
    bench.run("objects nothing").refuses("no built-in device \"nothing\"");
}

#[test]
fn shown_descriptions_pass_the_check_and_give_the_same_device() {
    let bench = Bench::of("mh4@1");
    let listed = bench.run("devices --format json").exit(0).json();
    assert_eq!(listed.iter().filter_map(|device| device["name"].as_str()).collect::<Vec<_>>(), NAMES);
    for name in NAMES {
        let shown = bench.run(&format!("devices show {name}")).exit(0);
        fs::write(bench.path("own.toml"), &shown.stdout).expect("written");
        bench.run("devices check own.toml").exit(0);
        let objects = |what: &str| bench.run(&format!("objects {what} --format csv")).exit(0).stdout;
        assert_eq!(objects("own.toml"), objects(name), "{name}");
    }
    bench.run("devices show mh5").refuses("no built-in device \"mh5\"");
}

#[test]
fn every_mistake_of_a_description_has_its_line() {
    let bench = Bench::of("mh4@1");
    let text = "name = \"Own\"\ntitle = \"T\"\nvendor = \"V\"\nvender = 1\n\n[[signal]]\nname = \"p\"\nchannel = 0\n\
                value = \"0x6130:1\"\n[[signal]]\nname = \"p\"\nchannel = 1\nvalue = \"0x6130:2\"\n[[object]]\n\
                at = \"0x6130:1\"\nname = \"v\"\ntype = \"r32\"\naccess = \"ro\"\n";
    fs::write(bench.path("own.toml"), text).expect("written");
    let done = bench.run("devices check own.toml --format json").exit(2);
    let found: Vec<u64> =
        done.json().iter().filter(|one| one["error"] == true).filter_map(|one| one["line"].as_u64()).collect();
    assert_eq!(found, [1, 4, 8, 11, 13], "{}", done.stdout);
    assert_eq!(done.error()["error"]["message"], "own.toml: 5 mistakes");
    let done = bench.run("devices check own.toml").exit(2);
    assert!(done.stdout.contains("own.toml:8: channel: 0 is not in the range 1 to 199\n"), "{}", done.stdout);
    bench.run("devices check missing.toml").exit(8);
}
