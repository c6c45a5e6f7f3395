use super::*;

const HEAD: &str = "time,elapsed_s,node,signal,value,unit,status,raw\n";

fn read(files: &[&str], base: TimeBase) -> (Recording, Vec<Omitted>) {
    let mut recording = Recording::new(base);
    let omitted = files.iter().map(|file| recording.read(&mut file.as_bytes()).expect("a recording")).collect();
    recording.finish();
    (recording, omitted)
}

/// `1.pressure [bar] 0: 1.5; 10: NaN invalid`, with times in milliseconds.
fn curves(recording: &Recording) -> Vec<String> {
    let point = |point: &Point| {
        let status = point.status.map_or(String::new(), |status| format!(" {}", status.as_str()));
        format!("{}: {}{status}", point.at / 1000 % 100_000, point.value)
    };
    let curve = |curve: &Curve| {
        let points: Vec<String> = curve.points.iter().map(point).collect();
        format!("{}.{} [{}] {}", curve.node, curve.signal, curve.unit, points.join("; "))
    };
    recording.curves.iter().map(curve).collect()
}

#[test]
fn both_layouts_in_both_formats_and_all_dialects_are_the_same() {
    let expected = [
        "1.pressure [bar] 1010: 1.5; 1110: NaN invalid; 1210: -2 overload-low",
        "2.pressure.status [code] 1010: 0; 1110: 1",
    ];
    let long = "\u{feff}time;elapsed_s;node;signal;value;unit;status;raw\r\n\
        2023-11-14T22:16:41.010000Z;0,000000;1;pressure;1,5;bar;ok;0x00\r\n\
        2023-11-14T22:16:41.010000Z;0,000000;2;pressure.status;0;code;;0x00\r\n\
        2023-11-14T22:16:41.110000Z;0,100000;1;pressure;;bar;invalid;0x00\r\n\
        2023-11-14T22:16:41.110000Z;0,100000;2;pressure.status;1;code;;0x00\r\n\
        2023-11-14T22:16:41.210000Z;0,200000;1;pressure;-2,0;bar;overload-low;0x00\r\n";
    let wide = "time,elapsed_s,1.pressure [bar],1.pressure.status,2.pressure.status [code],2.pressure.status.status\n\
        1700000201.010000,0.000000,1.5,ok,0,\n1700000201.110000,0.1,,invalid,1,\n1700000201.210000,0.2,-2.0,overload-low,,\n";
    let json_long =
        [(1.01, "1.5", "\"ok\"", "0"), (1.11, "null", "\"invalid\"", "1")].map(|(at, value, status, code)| {
            format!(
                "{{\"time\":\"2023-11-14T22:16:4{at}0000Z\",\"elapsed_s\":0.1,\"node\":1,\"signal\":\"pressure\",\
             \"value\":{value},\"unit\":\"bar\",\"status\":{status},\"raw\":\"0x00\"}}\n{{\"time\":17000002{:.6},\
             \"elapsed_s\":0.1,\"node\":2,\"signal\":\"pressure.status\",\"value\":{code},\"unit\":\"code\",\
             \"status\":null,\"raw\":\"0x00\"}}\n",
                format!("0{at}")
            )
        });
    let json_last = "{\"time\":1700000201.21,\"elapsed_s\":0.2,\"1.pressure.status\":\"overload-low\",\
        \"1.pressure [bar]\":-2.0,\"2.pressure.status [code]\":null,\"2.pressure.status.status\":null}\n";
    for file in [long.to_owned(), wide.to_owned(), json_long.concat() + json_last] {
        let (recording, omitted) = read(&[&file], TimeBase::Clock);
        assert_eq!(curves(&recording), expected, "{file}");
        assert_eq!(omitted, [Omitted::default()]);
    }
}

#[test]
fn columns_and_units_may_change_within_a_file() {
    let file = "time,elapsed_s,1.pressure [bar],1.pressure.status\n0.000001,0,1,ok\n\n\
                time,elapsed_s,1.pressure [Pa],1.pressure.status\n0.001,0.001,100000,ok\n";
    let (recording, _) = read(&[&file.replace("\n0.0", "\n1700000000.0")], TimeBase::Clock);
    assert_eq!(curves(&recording), ["1.pressure [bar] 0: 1", "1.pressure [Pa] 1: 100000"]);
}

#[test]
fn cut_off_and_foreign_lines_are_reported() {
    let row = "1700000000.0,0,1,pressure,5,bar,ok,0x00\n";
    let (recording, omitted) =
        read(&[&format!("{HEAD}{row}hello\n{row}x\n{}", &row[..row.len() - 9])], TimeBase::Clock);
    assert_eq!(recording.curves[0].points.len(), 2);
    assert_eq!(omitted, [Omitted { lines: 2, first: 3, is_cut: true }]);
    let mut recording = Recording::new(TimeBase::Clock);
    for other in
        ["(1.0) can0 123#00\n", "hello", "{\"a\":1}\n", "time,id\n1,2\n", "\u{1}\u{2}\n", "time,elapsed_s,5,6\n"]
    {
        let read = recording.read(&mut other.as_bytes());
        assert!(matches!(read, Err(RecordingError::OtherKind)), "{other} {read:?}");
    }
    for empty in ["", "\n\n"] {
        assert!(matches!(recording.read(&mut empty.as_bytes()), Err(RecordingError::Empty)));
    }
    assert_eq!(recording.read(&mut HEAD.as_bytes()).expect("no rows"), Omitted::default());
}

#[test]
fn files_in_any_order_are_one_recording() {
    let file = |second: u32| format!("{HEAD}170000000{second}.0,{second},1,pressure,{second},bar,ok,0x00\n");
    let (recording, _) = read(&[&file(2), &file(0), &file(1)], TimeBase::Clock);
    assert_eq!(curves(&recording), ["1.pressure [bar] 0: 0; 1000: 1; 2000: 2"]);
}

#[test]
fn elapsed_times_compare_the_runs() {
    let run = |start: u64, value: u32| -> String {
        let row = |at: u64| format!("{}.0,{at},1,pressure,{value},bar,ok,0x00\n", start + at);
        (0..2).map(row).collect()
    };
    let appended = format!("{HEAD}{}{}", run(1_700_000_000, 1), run(1_700_000_100, 2));
    let (recording, _) = read(&[&appended, &format!("{HEAD}{}", run(1_700_000_200, 3))], TimeBase::Elapsed);
    let runs: Vec<(usize, f64)> = recording.curves.iter().map(|curve| (curve.run, curve.points[1].value)).collect();
    assert_eq!(runs, [(1, 1.0), (2, 2.0), (3, 3.0)]);
    assert_eq!(read(&[&appended], TimeBase::Clock).0.curves.len(), 1);
}

#[test]
fn events_have_their_node_if_any() {
    let file = "time,elapsed_s,node,event,text\n1700000001.0,,1,emcy,\"a, b\"\n1700000000.0,1.0,,link-down,x\n";
    let event = |at, node, event: &str| EventMark { at, node, event: event.to_owned() };
    let second = 1_000_000;
    let expected = [event(1_700_000_000 * second, None, "link-down"), event(1_700_000_001 * second, Some(1), "emcy")];
    assert_eq!(read(&[file], TimeBase::Clock).0.events, expected);
    assert_eq!(read(&[file], TimeBase::Elapsed).0.events, [event(second, None, "link-down")]);
}

/// Reads a recording with a row at each of these seconds. Returns the values: `1 gap 2`.
fn with_gaps(seconds: &[u64]) -> String {
    let row = |second: &u64| format!("{}.0,0,1,pressure,{second},bar,ok,0x00\n", 1_700_000_000 + second);
    let (recording, _) = read(&[&format!("{HEAD}{}", seconds.iter().map(row).collect::<String>())], TimeBase::Clock);
    let text = |point: &Point| if point.value.is_nan() { "gap".to_owned() } else { point.value.to_string() };
    recording.curves[0].points.iter().map(text).collect::<Vec<_>>().join(" ")
}

#[test]
fn long_intervals_are_gaps() {
    assert_eq!(with_gaps(&[0, 1, 2, 3, 20, 21, 22]), "0 1 2 3 gap 20 21 22");
    // If a sender becomes slower and stays slower, its intervals are not gaps.
    assert_eq!(with_gaps(&[0, 1, 2, 4, 6, 9, 12, 15]), "0 1 2 4 6 9 12 15");
}

#[test]
fn running_recording_keeps_extreme_values_gaps_and_statuses() {
    let source = Source { node: crate::canopen::id::NodeId::MIN, signal: "pressure".into(), unit: "bar".into() };
    let mut recording = Recording::new(TimeBase::Clock);
    let mut push = |at: u64, value: f64, status: Status| {
        let since = Duration::from_micros(at);
        let at = Stamp { mono: Mono::at(since), wall: crate::bus::Wall::at(since) };
        let value = Some(crate::measure::sample::Number::Real64(value));
        let raw = crate::measure::sample::Raw::new(&[]);
        recording.push(&Sample { at, source: 0, value, status: Some(status), raw, doubt: None }, &source);
    };
    let count = 200_000;
    for at in 0..count {
        let at = if at > 100_000 { at + 50_000 } else { at };
        let value = if at == 5_555 { 99.0 } else { (at % 7) as f64 };
        push(at * 1000, value, if at == 6_666 { Status::OverloadHigh } else { Status::Ok });
    }
    let points = &recording.curves[0].points;
    assert!(points.len() < MAX_POINTS, "{}", points.len());
    assert!(points.contains(&Point { at: 5_555_000, value: 99.0, status: None }));
    assert!(points.iter().any(|point| point.at == 6_666_000 && point.status == Some(Status::OverloadHigh)));
    assert!(points.iter().any(|point| point.value.is_nan() && point.at == 150_001_000));
    assert!(points.is_sorted_by_key(|point| point.at));
    let last = i64::try_from((count + 49_999) * 1000).expect("small");
    assert_eq!((points[0].at, points[points.len() - 1].at), (0, last));
}
