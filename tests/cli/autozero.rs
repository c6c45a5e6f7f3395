//! `cangauge autozero`.

use super::{ALL, Bench};

/// An MH-4, a D-20-9 and a DPS with constant readings.
fn constant(mh4: f64, d20: f64, dps: f64) -> Bench {
    let device = |kind: &str, node: u8, base: f64| {
        format!(
            "[[device]]\nkind = \"{kind}\"\nnode = {node}\n[[device.channel]]\nchannel = 1\nbase = {base:?}\n\
             amplitude = 0.0\nnoise = 0.0\n"
        )
    };
    Bench::described(&[device("mh4", 1, mh4), device("d20", 2, d20), device("dps", 127, dps)].concat())
}

#[test]
fn each_device_is_zeroed_by_its_own_object() {
    let bench = constant(0.0625, -0.125, 0.5);
    let done = bench.run("autozero 1,2,127").exit(0);
    assert_eq!(
        done.stdout,
        "1    pressure  0.062 -> 0.000 bar   shift -0.062 bar  offset 0 -> -0.0625\n\
         2    pressure  -0.125 -> 0.000 bar  shift 0.125 bar   offset 0 -> 0.125\n\
         127  pressure  0.50 -> 0.00 psi     shift -0.50 psi   offset 0.000 -> -0.500\n"
    );
    assert_eq!(
        done.stderr,
        "node 1: the previous offset is known; undo: cangauge sdo write 1 0x6127:1 0 --type r32\n\
         node 1: not stored: lost at power off; store it: cangauge store 1 --group app\n\
         node 2: the previous offset is known; undo: cangauge sdo write 2 0x6124:1 0 --type r32\n\
         node 2: not stored: lost at power off; store it: cangauge store 2 --group all\n\
         node 127: the previous offset is known; undo: cangauge sdo write 127 0x6124:1 0 --type i32\n\
         node 127: not stored: lost at power off; store it: cangauge store 127 --group all\n"
    );
    // MH-4: 2.5 (23h); D-20-9: 22h; DPS: table 30.
    for (id, signature) in [("601", "232561017A65726F"), ("602", "222561017A65726F"), ("67F", "222561017A65726F")] {
        let frames = done.frames_of(id);
        assert_eq!(frames.iter().filter(|frame| frame[2..6] == *"2561").collect::<Vec<_>>(), [&signature]);
        assert_eq!(frames.iter().filter(|frame| frame.starts_with('2')).count(), 1, "{frames:?}");
    }
    let done = constant(0.0625, 0.0, 0.0).run("autozero 1 --store -f json").exit(0);
    assert!(
        done.stdout.starts_with(
            "{\"node\":1,\"channel\":1,\"signal\":\"pressure\",\"unit\":\"bar\",\"before\":0.0625,\"after\":0.0,\"offset_before\":0.0,\
             \"offset\":-0.0625,\"stored\":true,\"notes\":[{\"code\":\"undo\","
        ),
        "{}",
        done.stdout
    );
    assert!(done.frames_of("601").contains(&"2310100373617665"), "the application settings: {:?}", done.frames);
    assert!(done.stderr.contains("--type r32 && cangauge store 1 --group app\n"), "{}", done.stderr);
    let done = bench.run("autozero 127 -f csv --dry-run").exit(0);
    assert_eq!(
        done.stdout,
        "node,channel,signal,unit,before,after,offset_before,offset,stored\n127,1,pressure,psi,0.5000,,0.000,,false\n"
    );
}

/// Checks that a command was refused, and that no frame to node 1 changed anything.
#[track_caller]
fn refuses(bench: &Bench, line: &str, stderr: &str) {
    let done = bench.run(line).exit(1);
    assert_eq!((done.stdout.as_str(), done.stderr.as_str()), ("", stderr));
    assert!(done.frames_of("601").iter().all(|request| request.starts_with(['4', '6', '7'])), "{:?}", done.frames);
}

#[test]
fn reading_beyond_the_limit_is_refused() {
    refuses(
        &constant(3.204, 0.0, 0.0),
        "autozero 1",
        "cangauge: node 1: pressure is 3.204 bar, limit 0.100 bar (1 % of the range): \
         nothing was changed\n\
         hint: vent or isolate the line; if the limit is too low: cangauge autozero 1 --limit 3.4bar\n",
    );
    let done = constant(3.204, 0.0, 0.0).run("autozero 1 --limit 3.4").exit(0);
    assert_eq!(done.stdout, "1  pressure  3.204 -> 0.000 bar  shift -3.204 bar  offset 0 -> -3.204\n");
    constant(0.15, 0.0, 0.0).run("autozero 1 --limit 2%").exit(0);
    constant(0.15, 0.0, 0.0).run("autozero 1 --limit 2psi").exit(1);
    constant(0.15, 0.0, 0.0).run("autozero 1 --limit 1e-1bar").exit(1);
    // The limit also applies below zero.
    let done = constant(0.0, -3.25, 0.0).run("autozero 2").exit(1);
    assert!(done.stderr.starts_with("cangauge: node 2: pressure is -3.250 bar, limit "), "{}", done.stderr);
    // The previous offset is part of the total offset.
    let device = "[[device]]\nkind = \"mh4\"\nnode = 1\nset = { \"0x6127:1\" = -0.45 }\n[[device.channel]]\n\
                  channel = 1\nbase = 0.5125\namplitude = 0.0\nnoise = 0.0\n";
    refuses(
        &Bench::described(device),
        "autozero 1",
        "cangauge: node 1: the offset is already -0.450 bar and would become -0.513 bar, limit 0.500 bar: \
         nothing was changed\n\
         hint: several small offsets have added up: check the sensor, or use --force\n",
    );
    let done = Bench::described(device).run("autozero 1 --force").exit(0);
    assert!(done.stderr.starts_with("node 1: forced: the offset is already -0.450 bar"), "{}", done.stderr);
    assert!(done.stderr.contains("undo: cangauge sdo write 1 0x6127:1 -0.45 --type r32\n"), "{}", done.stderr);
}

#[test]
fn unsteady_or_invalid_reading_is_refused() {
    let restless = "[[device]]\nkind = \"mh4\"\nnode = 1\n[[device.channel]]\nchannel = 1\nbase = 0.0\namplitude = 0.0\n\
                    noise = 0.09\n";
    let done = Bench::described(restless).run("autozero 1").exit(1);
    assert!(done.stderr.contains("(limit 0.050 bar, 0.5 % of the range): the value is not steady"), "{}", done.stderr);
    let overloaded = "[[device]]\nkind = \"mh4\"\nnode = 1\n[[device.overload]]\nchannel = 1\nfrom = \"0s\"\n\
                      direction = \"low\"\n";
    refuses(
        &Bench::described(overloaded),
        "autozero 1",
        "cangauge: node 1: pressure has no valid value: overload-low: nothing was changed\n\
         hint: show the errors of the device: cangauge errors 1\n",
    );
    // With --force, the reading afterwards is still not zero: an error.
    let done = Bench::described(overloaded).run("autozero 1 --force").exit(6);
    assert!(
        done.stderr.contains("pressure has no valid value afterwards; the offset went from 0 to"),
        "{}",
        done.stderr
    );
}

#[test]
fn absolute_pressure_is_refused() {
    let device = "[[device]]\nkind = \"dps\"\nnode = 1\nset = { \"0x200D\" = 1 }\n[[device.channel]]\nchannel = 1\n\
                  base = 0.1\namplitude = 0.0\nnoise = 0.0\n";
    refuses(
        &Bench::described(device),
        "autozero 1",
        "cangauge: node 1: the sensor measures absolute pressure: if it is vented, it reads the air pressure, not zero: \
         nothing was changed\n\
         hint: apply a vacuum and use --force\n",
    );
    Bench::described(device).run("autozero 1 --force").exit(0);
}

#[test]
fn device_without_autozero_is_refused() {
    Bench::of(ALL).run("autozero 3").fails(4, "cangauge: node 3: HBM SomatXR MC1609 has no autozero\n");
    Bench::of(ALL)
        .run("autozero 1 --channel 2")
        .fails(2, "cangauge: node 1: WIKA MH-4-CAN has no autozero of channel 2\nhint: use one of: 1\n");
    // Without its description, the device itself rejects the object.
    let bench = Bench::of("mc1609@3");
    std::fs::write(bench.path("none.eds"), "[FileInfo]\nFileName=none.eds\n[1000]\nDataType=7\nAccessType=ro\n")
        .expect("a file");
    let done = bench.run("autozero 3 --eds none.eds --channel 1").exit(4);
    assert!(done.stderr.contains("it has no autozero of channel 1 (no 0x6125:1)"), "{}", done.stderr);
    // `all` zeroes the devices that have autozero.
    let done = Bench::of("mc1609@3,mh4@1").run("autozero all --limit 2bar --samples 2").exit(0);
    assert!(done.stdout.starts_with("1  pressure"), "{}", done.stdout);
    assert!(done.stderr.contains("node 3: HBM SomatXR MC1609 has no autozero\n"), "{}", done.stderr);
}

#[test]
fn unknown_device_is_zeroed_as_in_cia_404() {
    let bench = constant(0.0625, 0.0, 0.0);
    std::fs::write(bench.path("none.eds"), "[FileInfo]\nFileName=none.eds\n[1000]\nDataType=7\nAccessType=ro\n")
        .expect("a file");
    let done = bench.run("autozero 1 --eds none.eds --channel 1 --store").exit(0);
    assert_eq!(done.stdout, "1  ch1  0.062 -> 0.000 bar  shift -0.062 bar  offset 0 -> -0.0625\n");
    assert!(done.stderr.contains("undo: cangauge sdo write 1 0x6127:1 0 --type r32 && "), "{}", done.stderr);
    assert!(done.frames_of("601").contains(&"2310100373617665"), "{:?}", done.frames);
    let done = bench.run("autozero 1 --eds none.eds").exit(2);
    assert!(done.stderr.contains("the device has several channels: choose one"), "{}", done.stderr);
}

#[test]
fn arguments_are_checked_before_the_bus_is_opened() {
    let bench = Bench::of("mh4@1");
    bench.run("autozero 1 --limit 1x").refuses("\"1x\" is not a limit (0.1, 100mbar, 2%)");
    bench.run("autozero 1 --limit 0").refuses("\"0\": a limit must be greater than 0");
    bench.run("autozero 1 --samples 1").exit(2);
    let done = bench.run("autozero 1 --limit 5degC").exit(2);
    assert!(done.stderr.contains("the limit in degC cannot be converted: pressure is in bar"), "{}", done.stderr);
}

/// A load cell with a tare on each of `channels`, in the family of REAL32 (6xxxh) or INTEGER32 (9xxxh).
fn load_cell(family: u16, channels: u8) -> String {
    let data_type = if family == 0x6000 { "r32" } else { "i32" };
    let mut text = "name = \"cell\"\ntitle = \"Load cell\"\nvendor = \"Maker\"\n".to_owned();
    let mut object = |at: String, name: &str, data_type: &str, rest: &str| {
        text += &format!("[[object]]\nat = \"{at}\"\nname = \"{name}\"\ntype = \"{data_type}\"\n{rest}\n");
    };
    object("0x1000".to_owned(), "device-type", "u32", "access = \"ro\"\ndefault = 0x020194");
    let count = format!("access = \"ro\"\ndefault = {channels}");
    object(format!("{:#06x}:0", family | 0x130), "ai-input-pv-entries", "u8", &count);
    let at = |index: u16| format!("{index:#06x}:1-{channels}");
    object(at(family | 0x130), "ai-input-pv", data_type, "access = \"ro\"");
    object(at(family | 0x140), "ai-net-pv", data_type, "access = \"ro\"");
    object(at(family | 0x100), "ai-input-fv", data_type, "access = \"ro\"");
    object(at(family | 0x138), "ai-tare-zero", data_type, "access = \"rw\"\ndefault = 0");
    object(at(0x6131), "ai-physical-unit-pv", "u32", "access = \"rw\"\ndefault = 0x00020000");
    object(at(0x6132), "ai-decimal-digits-pv", "u8", "access = \"rw\"\ndefault = 2");
    object(at(0x6139), "ai-autotare", "u32", "access = \"wo\"\nsignature = \"tara\"");
    for channel in 1..=channels {
        let at = |index: u16| format!("\"{index:#06x}:{channel}\"");
        text += &format!(
            "[[signal]]\nname = \"load{channel}\"\nchannel = {channel}\nvalue = {}\nunit = {}\ndigits = {}\n",
            at(family | 0x130),
            at(0x6131),
            at(0x6132)
        );
    }
    text
}

/// A bench with load cells that show a constant 50 kg.
fn load_cells(family: u16, channels: u8) -> Bench {
    let mut text = "[[device]]\nkind = \"cell.toml\"\nnode = 5\n".to_owned();
    for channel in 1..=channels {
        text += &format!("[[device.channel]]\nchannel = {channel}\nbase = 50.0\namplitude = 0.0\nnoise = 0.0\n");
    }
    let bench = Bench::described(&text);
    std::fs::write(bench.path("cell.toml"), load_cell(family, channels)).expect("a file");
    bench
}

#[test]
fn tare_sets_the_net_value_to_zero_and_back() {
    for (family, zero, one) in [(0x6000, "0x6138:1", "0x6138:2"), (0x9000, "0x9138:1", "0x9138:2")] {
        let state = "--device cell.toml";
        let bench = load_cells(family, 2);
        let done = bench.run(&format!("{state} tare 5")).exit(2);
        assert!(
            done.stderr.contains("several channels: choose one\nhint: --channel with one of 1, 2\n"),
            "{}",
            done.stderr
        );
        let done = bench.run(&format!("{state} tare 5 --channel 3")).exit(2);
        assert!(done.stderr.contains("no tare of channel 3\nhint: use one of: 1, 2\n"), "{}", done.stderr);
        let done = bench.run(&format!("{state} tare 5 --channel 2")).exit(0);
        assert!(done.stdout.starts_with("5  load2  50.00"), "{}", done.stdout);
        assert!(done.stdout.contains(" -> 0.00"), "{}", done.stdout);
        let data_type = if family == 0x6000 { "r32" } else { "i32" };
        let undo = format!("undo: cangauge sdo write 5 {one} 0 --type {data_type}\n");
        assert_eq!(done.stderr, format!("node 5: the previous offset is known; {undo}"), "{zero}");
        let frames = done.frames_of("605");
        assert_eq!(frames.iter().filter(|frame| frame[2..] == *"39610274617261").count(), 1, "{frames:?}");
        assert_eq!(frames.iter().filter(|frame| frame.starts_with('2')).count(), 1, "nothing is stored: {frames:?}");
    }
}

#[test]
fn tare_without_a_description_of_it_is_refused() {
    for bench in [Bench::of("mh4@1"), Bench::of("jumo@1")] {
        bench.run("tare 1").fails(
            2,
            "cangauge: node 1: no description or EDS of it has a tare (0x6139) and a net value (0x6140)\n\
             hint: use a description with both: --device FILE or --eds FILE\n",
        );
    }
}

#[test]
fn tare_is_undone() {
    let text = load_cells(0x6000, 1);
    let with_default =
        load_cell(0x6000, 1).replace("access = \"rw\"\ndefault = 0\n[", "access = \"rw\"\ndefault = 20.0\n[");
    std::fs::write(text.path("cell.toml"), with_default).expect("a file");
    let done = text.run("--device cell.toml tare 5 --undo -f json").exit(0);
    let row = &done.json()[0];
    assert_eq!((row["before"].as_f64(), row["after"].as_f64()), (Some(30.0), Some(50.0)));
    assert_eq!((row["offset_before"].as_f64(), row["offset"].as_f64()), (Some(20.0), Some(0.0)));
    assert_eq!(row["notes"][0]["command"], "cangauge sdo write 5 0x6138:1 20 --type r32");
    // Net value and field value are parts of the signal.
    text.run("--device cell.toml read 5 load1.net").prints("30\n");
    text.run("--device cell.toml read 5 load1.field").prints("5000\n");
    text.run("--device cell.toml check 5 load1.net>29.9kg").exit(0);
    let done = text.run("--device cell.toml log 5 load1.field load1.net --poll 100ms --count 2").exit(0);
    assert!(
        done.stdout.contains(",5,load1.net,30,kg,") && done.stdout.contains(",5,load1.field,5000,,"),
        "{}",
        done.stdout
    );
}

#[test]
fn tare_works_with_an_eds_and_refuses_an_unsteady_value() {
    let noisy = load_cells(0x6000, 1);
    let bench =
        std::fs::read_to_string(noisy.path("bench.toml")).expect("a file").replace("noise = 0.0", "noise = 3.0");
    std::fs::write(noisy.path("bench.toml"), bench).expect("a file");
    let mut eds = "[DeviceInfo]\nVendorName=Maker\n".to_owned();
    for (index, name, data_type, access) in [
        (0x6130, "AI input PV", 8, "ro"),
        (0x6140, "AI net PV", 8, "ro"),
        (0x6138, "AI tare zero", 8, "rw"),
        (0x6139, "AI autotare", 7, "wo"),
        (0x6148, "AI span start", 8, "ro"),
        (0x6149, "AI span end", 8, "ro"),
    ] {
        eds += &format!("[{index:04X}]\nParameterName={name}\nObjectType=8\nSubNumber=2\n");
        eds += &format!("[{index:04X}sub0]\nParameterName=entries\nDataType=5\nAccessType=ro\n");
        eds += &format!("[{index:04X}sub1]\nParameterName={name}\nDataType={data_type}\nAccessType={access}\n");
    }
    std::fs::write(noisy.path("cell.eds"), &eds).expect("a file");
    let done = noisy.run("--eds cell.eds tare 5").exit(0);
    assert!(done.stdout.starts_with("5  ch1  "), "without a range, the readings may vary: {}", done.stdout);
    let spans = "[[object]]\nat = \"0x6148:1-1\"\nname = \"start\"\ntype = \"r32\"\naccess = \"ro\"\ndefault = 0.0\n\
                 [[object]]\nat = \"0x6149:1-1\"\nname = \"end\"\ntype = \"r32\"\naccess = \"ro\"\ndefault = 100.0\n";
    let cell = load_cell(0x6000, 1).replacen("[[signal]]", &format!("{spans}[[signal]]"), 1);
    std::fs::write(noisy.path("cell.toml"), cell).expect("a file");
    let done = noisy.run("--eds cell.eds tare 5").exit(1);
    assert!(done.stderr.contains("the value is not steady"), "{}", done.stderr);
    assert!(done.stderr.contains("hint: wait until the value is steady\n"), "{}", done.stderr);
}
