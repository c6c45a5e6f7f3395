//! `objects` and `devices`: what descriptions and EDS files know, without a bus.

use super::Bench;
use cangauge::device::catalog;
use std::fs;

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
        .fails(2, "cangauge: the EDS file has no object \"ofset\"\nhint: similar names: offset\n");
    bench.run("objects 200").refuses("\"200\" is not a node-ID (1 to 127)");
    bench.run("objects nothing").refuses("no built-in device \"nothing\"");
}

#[test]
fn shown_descriptions_pass_the_check_and_give_the_same_device() {
    let bench = Bench::of("mh4@1");
    let listed = bench.run("devices --format json").exit(0).json();
    let names: Vec<&str> = catalog::names().collect();
    assert_eq!(listed.iter().filter_map(|device| device["name"].as_str()).collect::<Vec<_>>(), names);
    for name in names {
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
    assert!(done.stdout.contains("own.toml:8:11: channel: 0 is not in the range 1 to 199\n"), "{}", done.stdout);
    bench.run("devices check missing.toml").exit(8);
}

#[test]
fn a_new_description_of_a_device_passes_the_check_and_gives_the_same_values() {
    let bench = Bench::described("[[device]]\nkind = \"mh4\"\nnode = 5\n[[device]]\nkind = \"d20\"\nnode = 6\n");
    for node in ["5", "6"] {
        let new = bench.run(&format!("devices new {node}")).exit(0).stdout;
        fs::write(bench.path("new.toml"), &new).expect("written");
        bench.run("devices check new.toml").exit(0);
        let signals = |line: &str| {
            let done = bench.run(line).exit(0).json();
            done.iter().map(|row| (row["signal"].clone(), row["unit"].clone())).collect::<Vec<_>>()
        };
        assert_eq!(
            signals(&format!("--device new.toml read {node} --format json")).len(),
            signals(&format!("read {node} --format json")).len(),
            "{new}"
        );
        let simulated =
            bench.command(&["-b", "sim:new.toml@5", "--device", "new.toml", "read", "5"]).output().expect("run");
        assert!(simulated.status.success(), "{}", String::from_utf8_lossy(&simulated.stderr));
    }
}

#[test]
fn new_description_has_no_guessed_fields() {
    let bench = Bench::described("[[device]]\nkind = \"own.toml\"\nnode = 5\n");
    let text = "name = \"own\"\ntitle = \"T\"\nvendor = \"V\"\n\
                [[object]]\nat = \"0x1000\"\nname = \"device-type\"\ntype = \"u32\"\naccess = \"ro\"\ndefault = 0\n\
                [[object]]\nat = \"0x2000:1\"\nname = \"v\"\ntype = \"r32\"\naccess = \"ro\"\npdo = true\ndefault = 1.5\n\
                [[object]]\nat = \"0x1800:1\"\nname = \"c\"\ntype = \"u32\"\naccess = \"rw\"\ndefault = \"$NODEID+0x180\"\n\
                [[object]]\nat = \"0x1A00:0\"\nname = \"n\"\ntype = \"u8\"\naccess = \"rw\"\ndefault = 1\n\
                [[object]]\nat = \"0x1A00:1\"\nname = \"m\"\ntype = \"u32\"\naccess = \"rw\"\ndefault = 0x20000120\n";
    let text = text.replace("name = \"c\"", "name = \"cob\"");
    fs::write(bench.path("own.toml"), text).expect("written");
    let new = bench.run("devices new 5").exit(0).stdout;
    fs::write(bench.path("new.toml"), &new).expect("written");
    bench.run("devices check new.toml").exit(0);
    assert!(
        new.contains("# fill in the type of these 4 bytes: 00 00 C0 3F\n# [[object]]\n# at = \"0x2000:1\""),
        "{new}"
    );
    let eds = "[ManufacturerObjects]\nSupportedObjects=1\n1=0x2000\n[2000]\nParameterName=Values\nObjectType=8\nSubNumber=2\n\
               [2000sub0]\nParameterName=Count\nDataType=5\nAccessType=ro\n\
               [2000sub1]\nParameterName=Oil Temp\nDataType=8\nAccessType=ro\nPDOMapping=1\n";
    fs::write(bench.path("x.eds"), eds).expect("written");
    let new = bench.run("--eds x.eds devices new 5").exit(0).stdout;
    fs::write(bench.path("new.toml"), &new).expect("written");
    bench.run("devices check new.toml").exit(0);
    assert!(new.contains("name = \"values\"\ntype = \"r32\""), "{new}");
}

/// A description in the folder of the user.
fn user_file(bench: &Bench, name: &str, text: &str) {
    let folder = bench.path("config/cangauge/devices");
    fs::create_dir_all(&folder).expect("a folder");
    fs::write(folder.join(name), text).expect("written");
}

/// The command with the folder of the user.
fn run_as_user(bench: &Bench, line: &str) -> super::Done {
    let config = bench.path("config");
    let words: Vec<&str> = line.split_whitespace().collect();
    bench.finish(bench.traced(&words).env("XDG_CONFIG_HOME", config))
}

#[test]
fn descriptions_of_the_user_are_found_and_have_priority() {
    let bench = Bench::of("mh4@1");
    let mh4 = catalog::text("mh4").expect("built in").replace("title = \"WIKA MH-4-CAN\"", "title = \"My sensor\"");
    user_file(&bench, "a.toml", &mh4.replace("name = \"mh4\"", "name = \"my-mh4\""));
    let listed = run_as_user(&bench, "devices --format json").exit(0).json();
    assert!(listed.iter().any(|device| device["name"] == "my-mh4" && device["file"].is_string()), "{listed:?}");
    let found = run_as_user(&bench, "scan 1 --format json").exit(0).json();
    assert_eq!(found[0]["device"], "my-mh4");
    run_as_user(&bench, "--device my-mh4 read 1").exit(0);
    // Two for one device.
    user_file(&bench, "b.toml", &mh4.replace("name = \"mh4\"", "name = \"my-other\""));
    let done = run_as_user(&bench, "scan 1").exit(2);
    assert!(
        done.stderr.contains("two descriptions for the same device") && done.stderr.contains("b.toml"),
        "{}",
        done.stderr
    );
    // One that replaces a built-in description, and a broken one.
    fs::remove_file(bench.path("config/cangauge/devices/a.toml")).expect("removed");
    user_file(&bench, "b.toml", &mh4);
    user_file(&bench, "broken.toml", "name = 1\n");
    let done = run_as_user(&bench, "scan 1 --format json").exit(0);
    assert_eq!(done.json()[0]["device"], "mh4");
    assert!(
        done.stderr.contains("b.toml replaces the built-in description \\\"mh4\\\"")
            || done.stderr.contains("b.toml replaces the built-in description \"mh4\""),
        "{}",
        done.stderr
    );
    assert!(done.stderr.contains("not used: ") && done.stderr.contains("broken.toml:1:1: "), "{}", done.stderr);
    assert!(run_as_user(&bench, "objects mh4 1008").exit(0).stdout.contains("device-name"));
}

#[test]
fn description_without_a_manual_page_allows_reading_only() {
    let refusal = |name: &str, unchanged: &str| {
        format!(
            "cangauge: node 1: the description {name} is not confirmed by a manual{unchanged}\n\
             hint: if it is the right description, add: --device {name}\n"
        )
    };
    for (name, signal) in [("hydronautics", "pressure"), ("epson-a552", "acceleration-x"), ("epson-g552", "")] {
        let bench = Bench::of(&format!("{name}@1"));
        bench.run(&format!("read 1 {signal}")).exit(0);
        for line in ["store 1", "autozero 1", "tare 1", "lss set-id 1 9", "lss set-bitrate 1 250k"] {
            // LSS reaches only devices with a serial number.
            if line.starts_with("lss") && name != "hydronautics" {
                continue;
            }
            let done = bench.run(line).exit(2);
            let unchanged = if line.starts_with("lss") { "; nothing was changed" } else { "" };
            assert_eq!(done.stderr, refusal(name, unchanged), "{line}");
            let done = bench.run(&format!("{line} --device {name}"));
            assert!(!done.stderr.contains("not confirmed by a manual"), "{line}: {}", done.stderr);
        }
        let info = bench.run("info 1 -f json").exit(0).json();
        assert_eq!((info[0]["device"].as_str(), info[0]["source"].as_str()), (Some(name), Some("built-in")));
    }
    Bench::of("mh4@1").run("store 1").exit(0);
}

#[test]
fn info_names_the_file_of_a_description() {
    let bench = Bench::of("mh4@1");
    let text = bench.run("devices show mh4").exit(0).stdout;
    std::fs::write(bench.path("mine.toml"), text.replacen("name = \"mh4\"", "name = \"mine\"", 1)).expect("a file");
    let done = bench.run("info 1 --device mine.toml").exit(0);
    assert!(done.stdout.contains("description  mine (mine.toml)\n"), "{}", done.stdout);
    let info = bench.run("info 1 --device mine.toml -f json").exit(0).json();
    assert_eq!(info[0]["source"], "mine.toml");
}
