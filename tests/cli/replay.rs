//! Commands on a recording (`replay:FILE`).

use super::{Bench, Done};
use std::fs;

/// Runs a command on a recording: `replay(&bench, "t.log", "log 1")`.
fn replay(bench: &Bench, file: &str, line: &str) -> Done {
    let bus = format!("replay:{file}");
    let words: Vec<&str> = ["--bus", &bus].into_iter().chain(line.split_whitespace()).collect();
    bench.finish(&mut bench.command(&words))
}

/// Keeps the trace of the last command as a recording.
fn keep(bench: &Bench) {
    fs::rename(bench.path("trace"), bench.path("t.log")).expect("the trace");
}

#[test]
fn replay_gives_the_rows_of_the_live_log() {
    let bench = Bench::of("mh4@1,d20@2,mc1609@3,dps@127");
    let live = bench.run("log 1-3,127 --sync 20ms --count 200").exit(0).stdout;
    keep(&bench);
    assert_eq!(live.lines().count(), 201);
    let replayed = replay(&bench, "t.log", "log 1-3,127 --count 200").exit(0).stdout;
    assert_eq!(replayed, live);
    // The log ends with the recording.
    let all = replay(&bench, "t.log", "log all").exit(0);
    assert_eq!(all.stdout, live);
    assert!(all.stderr.contains("200 rows in"), "{}", all.stderr);
    assert!(all.stderr.contains("recorded timestamps"), "{}", all.stderr);
}

/// `t.log` has four cycles of SYNC and these frames.
fn cycles(bench: &Bench, frames: &[&str]) {
    let all = (0..4).flat_map(|_| ["080#"].iter().chain(frames)).zip(100..);
    let lines: String = all.map(|(frame, at)| format!("({at}.000000) can0 {frame}\n")).collect();
    fs::write(bench.path("t.log"), lines).expect("written");
}

#[test]
fn second_sender_of_a_tpdo_is_found_in_a_recording() {
    let bench = Bench::of("mh4@5");
    let log = "log 5 pressure --device mh4";
    cycles(&bench, &["185#0000A03F00", "185#0000204000"]);
    replay(&bench, "t.log", "check 5 pressure<100 --device mh4").exit(6);
    let done = replay(&bench, "t.log", log).exit(6);
    assert!(done.stderr.contains("node 5: TPDO1 arrives twice at a SYNC, with different values"), "{}", done.stderr);
    cycles(&bench, &["185#0000A03F00", "185#0000A03F00"]);
    let done = replay(&bench, "t.log", log).exit(0);
    assert!(done.stderr.contains("TPDO1 arrives twice at a SYNC: two devices send it"), "{}", done.stderr);
    cycles(&bench, &["185#0000A03F00", "285#0000A03F00"]);
    assert!(!replay(&bench, "t.log", log).exit(0).stderr.contains("twice"));
}

/// Writes `t.log`: another master reads the setup of node 5 without its transmission type, and starts it. Then these
/// frames follow, with the time in microseconds.
fn set_up_by_master(bench: &Bench, extra: &[(u32, &str)]) {
    let setup = [
        "605#4000100000000000",
        "585#4300100094010200",
        "605#4000180100000000",
        "585#4300180185010000",
        "605#40001A0000000000",
        "585#4F001A0002000000",
        "605#40001A0100000000",
        "585#43001A0120013061",
        "605#40001A0200000000",
        "585#43001A0208015061",
        "605#4031610100000000",
        "585#4331610100004E00",
        "605#4032610100000000",
        "585#4F32610102000000",
        "000#0105",
    ];
    let mut frames: Vec<(u32, &str)> = (0..).step_by(1000).zip(setup).chain(extra.iter().copied()).collect();
    frames.sort_by_key(|&(at, _)| at);
    let lines = frames.iter().map(|(at, frame)| format!("(100.{at:06}) can0 {frame}\n"));
    fs::write(bench.path("t.log"), lines.collect::<String>()).expect("written");
}

const VALUES: [(u32, &str); 3] =
    [(100_000, "185#0000A03F00"), (200_000, "185#0000C03F00"), (300_000, "185#0000E03F00")];

#[test]
fn second_answer_to_a_recorded_request_is_reported() {
    let bench = Bench::of("mh4@5");
    // The second answer may come after the next request. A unit, a mapping entry, the vendor, an abort.
    for (at, answer) in [
        (11_500, "585#43316101000000AB"),
        (12_500, "585#43316101000000AB"),
        (7_500, "585#43001A0110013071"),
        (13_500, "585#8032610100000206"),
    ] {
        set_up_by_master(&bench, &[&VALUES[..], &[(at, answer)]].concat());
        let done = replay(&bench, "t.log", "log 5").exit(6);
        assert_eq!(done.stdout.lines().count(), 0, "{answer}: {}", done.stdout);
        let reason = "two devices have this node-ID: one request got the answers 585#";
        assert!(done.stderr.contains(reason) && done.stderr.contains(answer), "{}", done.stderr);
        replay(&bench, "t.log", "check 5 ch1<100").exit(6);
        replay(&bench, "t.log", "pdo watch 5").exit(6);
    }
    // The same answer twice.
    set_up_by_master(&bench, &[&VALUES[..], &[(11_500, "585#4331610100004E00")]].concat());
    let done = replay(&bench, "t.log", "log 5").exit(0);
    assert!(done.stderr.contains("node 5: answers arrive twice: two devices have node-ID 5"), "{}", done.stderr);
    assert_eq!(done.stdout.lines().count(), 4);
    // A repeated request has two answers, and a measured value changes.
    let polled = [
        (20_000, "605#4030610100000000"),
        (21_000, "605#4030610100000000"),
        (22_000, "585#433061010000A03F"),
        (23_000, "585#433061010000C03F"),
    ];
    set_up_by_master(&bench, &[&VALUES[..], &polled].concat());
    assert!(!replay(&bench, "t.log", "log 5").exit(0).stderr.contains("two devices"));
    let twice = [polled[0], polled[2], polled[3]];
    set_up_by_master(&bench, &[&VALUES[..], &twice].concat());
    assert!(replay(&bench, "t.log", "log 5").exit(0).stderr.contains("two devices have this node-ID"));
}

#[test]
fn pairs_of_tpdos_at_sync_have_no_rows() {
    let bench = Bench::of("mh4@5");
    let cycles = |second: [&'static str; 2]| {
        let frames = (1..=5).flat_map(move |cycle: u32| {
            [(0, "080#"), (200, "185#0000A03F00"), (900, second[cycle as usize % 2])]
                .map(|(at, it)| (cycle * 100_000 + at, it))
        });
        frames.collect::<Vec<_>>()
    };
    set_up_by_master(&bench, &cycles(["185#0000F04000", "185#0000E84000"]));
    for line in ["log 5", "check 5 ch1<100"] {
        let done = replay(&bench, "t.log", line).exit(6);
        assert!(!done.stdout.contains("ok"), "{}", done.stdout);
        let reason = "node 5: TPDO1 arrives twice at a SYNC, with different values: two devices";
        assert!(done.stderr.contains(reason), "{}", done.stderr);
    }
    set_up_by_master(&bench, &cycles(["185#0000A03F00"; 2]));
    let done = replay(&bench, "t.log", "log 5").exit(0);
    assert!(done.stderr.contains("TPDO1 arrives twice at a SYNC: two devices send it"), "{}", done.stderr);
}

#[test]
fn tpdos_of_a_wrong_length_are_the_reason_for_no_rows() {
    let bench = Bench::of("mh4@5");
    for (frame, length) in [("185#0000A03F0000", 6), ("185#0000A0", 3)] {
        cycles(&bench, &[frame]);
        let done = replay(&bench, "t.log", "log 5 --device mh4").exit(3);
        let reason = format!("node 5: its TPDOs have {length} bytes, but their mapping has 5\n");
        assert!(done.stderr.contains(&reason) && done.stderr.contains("--device 5=FILE"), "{}", done.stderr);
    }
}

#[test]
fn truncated_answer_is_not_used_as_mapping() {
    let bench = Bench::of("mh4@5,dps@127");
    bench.run("log 5,127 --sync 20ms --duration 1s").exit(0);
    keep(&bench);
    let trace = fs::read_to_string(bench.path("t.log")).expect("the trace");
    for answer in ["585#43001A01", "585#43001801"] {
        let is_cut = |line: &&str| line.contains(answer);
        assert_eq!(trace.lines().filter(is_cut).count(), 1, "{trace}");
        let cut = |line: &str| if is_cut(&line) { line[..line.len() - 2].to_owned() } else { line.to_owned() };
        let lines: String = trace.lines().map(|line| cut(line) + "\n").collect();
        fs::write(bench.path("cut.log"), lines).expect("written");
        let done = replay(&bench, "cut.log", "log 5,127").exit(7);
        assert!(done.stdout.lines().skip(1).all(|line| line.split(',').nth(2) == Some("127")), "{}", done.stdout);
        let note = "node 5: TPDOs with COB-ID 185 are ignored: their mapping is unknown";
        assert!(done.stderr.contains(note), "{}", done.stderr);
    }
}

#[test]
fn unusual_heartbeats_are_reported_once() {
    let bench = Bench::of("mh4@1");
    let frames = ["705#0500", "706#05", "708#7F00000000000000", "705#0500", "707#", "707#", "709#R1", "706#7F"];
    let lines = frames.iter().zip(1..).map(|(frame, second)| format!("(10{second}.000000) can0 {frame}\n"));
    fs::write(bench.path("t.log"), lines.collect::<String>()).expect("written");
    for line in ["nmt watch", "scan --passive"] {
        let done = replay(&bench, "t.log", line).exit(0);
        let warnings: Vec<&str> = done.stderr.lines().filter(|line| line.starts_with("warning")).collect();
        assert_eq!(
            warnings,
            [
                "warning: node 5: its heartbeats have 2 bytes, not 1: the first byte is the state",
                "warning: node 7: frames of 0 bytes on its heartbeat COB-ID are ignored",
                "warning: node 8: its heartbeats have 8 bytes, not 1: the first byte is the state",
            ],
            "{line}"
        );
    }
}

/// Another master guards nodes without a heartbeat.
#[test]
fn guarded_nodes_are_watched() {
    let bench = Bench::of("mh4@1");
    let frames = ["705#R1", "705#7F", "705#R1", "705#FF", "705#R1", "705#05", "705#R1", "705#85", "706#R", "706#84"];
    let lines = frames.iter().zip(10..).map(|(frame, second)| format!("(1{second}.000000) can0 {frame}\n"));
    fs::write(bench.path("t.log"), lines.collect::<String>()).expect("written");
    let done = replay(&bench, "t.log", "nmt watch -f json").exit(0);
    let states: Vec<_> = done.json().iter().map(|event| (event["node"].clone(), event["state"].clone())).collect();
    let expected = [(5, "pre-operational"), (5, "operational"), (6, "stopped")];
    assert_eq!(states, expected.map(|(node, state)| (node.into(), state.into())), "{}", done.stdout);
}

#[test]
fn recording_without_the_setup_needs_a_description() {
    let bench = Bench::of("mh4@1");
    bench.run("log 1 --sync 20ms --count 20").exit(0);
    keep(&bench);
    let text = bench.text("t.log");
    let tail: Vec<&str> = text.lines().filter(|line| line.contains(" 181#")).collect();
    fs::write(bench.path("tail.log"), tail.join("\n") + "\n").expect("written");
    replay(&bench, "tail.log", "log 1").exit(2);
    let done = replay(&bench, "tail.log", "log 1 --device mh4").exit(0);
    assert_eq!(done.stdout.lines().count(), 21, "{}", done.stdout);
}

/// A recording in which another program reads these objects of node 5; `None` is an object that does not exist. Then
/// node 5 sends two INTEGER32 in TPDO1, 1234 and -5678.
fn asked(objects: &[(u16, u8, Option<u32>)]) -> String {
    let mut lines = String::new();
    for (at, (index, sub, value)) in objects.iter().enumerate() {
        let [low, high] = index.to_le_bytes();
        let (command, word) = value.map_or((0x80, 0x0602_0000), |value| (0x43, value));
        let word: String = word.to_le_bytes().iter().map(|byte| format!("{byte:02X}")).collect();
        lines += &format!("(1700000000.{at:03}000) can0 605#40{low:02X}{high:02X}{sub:02X}00000000\n");
        lines += &format!("(1700000000.{at:03}500) can0 585#{command:02X}{low:02X}{high:02X}{sub:02X}{word}\n");
    }
    lines + "(1700000001.000000) can0 185#D2040000D2E9FFFF\n"
}

#[test]
fn decimal_digits_are_learned_per_channel() {
    let bench = Bench::of("mh4@1");
    // Without the profile the types would be unknown.
    let mut objects = vec![
        (0x1000, 0, Some(0x0002_0194)),
        (0x1800, 1, Some(0x185)),
        (0x1a00, 0, Some(2)),
        (0x1a00, 1, Some(0x9130_0120)),
        (0x1a00, 2, Some(0x9130_0220)),
        (0x6131, 1, Some(0x004e_0000)),
        (0x6131, 2, Some(0x002d_0000)),
        (0x6132, 1, Some(3)),
    ];
    let log = |objects: &[_]| {
        fs::write(bench.path("t.log"), asked(objects)).expect("written");
        replay(&bench, "t.log", "log 5")
    };
    let said = log(&objects).exit(2).stderr;
    assert!(said.contains("the mapping of its TPDOs is unknown"), "{said}");
    objects.push((0x6132, 2, Some(1)));
    let done = log(&objects).exit(0);
    let rows: Vec<&str> = done.stdout.lines().skip(1).map(|row| row.splitn(4, ',').last().unwrap_or(row)).collect();
    assert_eq!(rows, ["ch1,1.234,bar,,0xD2040000", "ch2,-567.8,degC,,0xD2E9FFFF"]);
    // A device without this object has no digits.
    objects[8].2 = None;
    let done = log(&objects).exit(0);
    assert!(done.stdout.ends_with("ch2,-5678,degC,,0xD2E9FFFF\n"), "{}", done.stdout);
}

#[test]
fn commands_that_send_are_refused() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("t.log"), "(1700000000.000000) can0 701#00\n").expect("written");
    let done = replay(&bench, "t.log", "read 1").exit(5);
    assert_eq!(
        done.stderr,
        "cangauge: the recording t.log can only receive\n\
         hint: commands that only listen work on it: log, check, monitor, health, pdo watch, scan --passive, nmt watch\n"
    );
    replay(&bench, "t.log", "log 1 --sync 10ms")
        .refuses("a recording (replay:) is receive-only: --sync, --poll and --request send");
    replay(&bench, "t.log", "log 1 --poll 10ms")
        .refuses("a recording (replay:) is receive-only: --sync, --poll and --request send");
}

/// A recording: another program reads the setup of node 5 (pressure in bar, 2 digits), then five values follow. `form`
/// writes a frame at a time in milliseconds.
fn recording(form: impl Fn(usize, u32, &str, &str) -> String) -> String {
    let setup = [
        ("605", "4000100000000000"),
        ("585", "4300100094010200"),
        ("605", "4000180100000000"),
        ("585", "4300180185010000"),
        ("605", "40001A0000000000"),
        ("585", "4F001A0001000000"),
        ("605", "40001A0100000000"),
        ("585", "43001A0120013061"),
        ("605", "4031610100000000"),
        ("585", "4331610100004E00"),
        ("605", "4032610100000000"),
        ("585", "4F32610102000000"),
        ("000", "0105"),
    ];
    let values = ["0000A03F", "0000C03F", "0000E03F", "00000040", "00001040"];
    let setup = setup.into_iter().zip(0..).map(|((id, data), ms)| (ms, id, data));
    let values = values.into_iter().zip(1..).map(|(data, at)| (100 * at, "185", data));
    setup.chain(values).enumerate().map(|(number, (ms, id, data))| form(number, ms, id, data)).collect()
}

/// As `candump -L`.
fn log_form(_: usize, ms: u32, id: &str, data: &str) -> String {
    format!("(1700000000.{ms:03}000) can0 {id}#{data}\n")
}

/// As `candump` without options, with this time in front.
fn screen_form(time: &str, id: &str, data: &str) -> String {
    let bytes: Vec<&str> = (0..data.len()).step_by(2).filter_map(|at| data.get(at..at + 2)).collect();
    format!(" {time} can0  {id}   [{}]  {}\n", bytes.len(), bytes.join(" "))
}

/// Replays a text with `log 5`.
fn log_of(bench: &Bench, text: impl AsRef<[u8]>) -> Done {
    fs::write(bench.path("t.log"), text).expect("written");
    replay(bench, "t.log", "log 5")
}

#[test]
fn forms_of_candump_give_the_same_rows() {
    let bench = Bench::of("mh4@1");
    let plain = recording(log_form);
    let expected = log_of(&bench, &plain).exit(0).stdout;
    assert!(expected.lines().nth(5).is_some_and(|row| row.contains(",5,ch1,2.25,bar,,")), "{expected}");
    assert_eq!(expected.lines().count(), 6);
    let absolute = |_: usize, ms, id: &str, data: &str| screen_form(&format!("(1700000000.{ms:03}000) "), id, data);
    for text in [
        format!("\u{feff}{plain}"),
        format!("# bench 2, after the repair\n{plain}"),
        plain.replace('\n', "\r\n"),
        recording(absolute),
        recording(|number, ms, id, data| absolute(number, ms, id, data).replace('\n', "   '....'\r\n")),
    ] {
        assert_eq!(log_of(&bench, &text).exit(0).stdout, expected, "{text}");
    }
    // The time zone of the machine: 2023-11-14 22:13:20 UTC.
    let dated = recording(|_, ms, id, data| screen_form(&format!("(2023-11-14 23:13:20.{ms:03}000) "), id, data));
    fs::write(bench.path("t.log"), dated).expect("written");
    let mut command = bench.command(&["--bus", "replay:t.log", "log", "5"]);
    assert_eq!(bench.finish(command.env("TZ", "XXX-1")).exit(0).stdout, expected);
}

#[test]
fn broken_lines_are_skipped_counted_and_named() {
    let bench = Bench::of("mh4@1");
    let cut = |is_cut: fn(usize) -> bool| {
        recording(|number, ms, id, data| {
            let line = log_form(number, ms, id, data);
            if is_cut(number) { format!("{}\n", &line[..20]) } else { line }
        })
    };
    let done = log_of(&bench, cut(|number| number == 15)).exit(0);
    assert_eq!(done.stdout.lines().count(), 5, "{}", done.stdout);
    assert!(done.stderr.contains("t.log: 1 line skipped: line 16 is not a line"), "{}", done.stderr);
    let whole = recording(log_form);
    let done = log_of(&bench, &whole[..whole.len() - 8]).exit(0);
    assert_eq!(done.stdout.lines().count(), 5, "{}", done.stdout);
    assert!(
        done.stderr.contains("t.log: the file ends in the middle of line 18, which was skipped"),
        "{}",
        done.stderr
    );
    let done = log_of(&bench, cut(|number| number > 14)).exit(0);
    assert_eq!(done.stdout.lines().count(), 3, "{}", done.stdout);
    assert!(done.stderr.contains("t.log: 3 lines skipped, line 16 first"), "{}", done.stderr);
}

#[test]
fn recordings_without_usable_times_are_refused_with_the_reason() {
    let bench = Bench::of("mh4@1");
    let done = log_of(&bench, recording(|_, _, id, data| screen_form("", id, data))).exit(8);
    assert_eq!(
        done.stderr,
        "cangauge: replay t.log:1: the frames have no times\n\
         hint: record with times: candump -L can0 (or candump -ta can0)\n"
    );
    let intervals = |number: usize| if number < 13 { "0.001000" } else { "0.100000" };
    let log = recording(|number, _, id, data| format!("({}) can0 {id}#{data}\n", intervals(number)));
    let screen = recording(|number, _, id, data| screen_form(&format!("(00{}) ", intervals(number)), id, data));
    for text in [log, screen] {
        let done = log_of(&bench, text).exit(8);
        assert!(done.stderr.contains("t.log:1: the times do not increase"), "{}", done.stderr);
        assert_eq!(done.stdout, "");
    }
    // Times since the start of the recording are accepted.
    let done = log_of(&bench, recording(|_, ms, id, data| format!("(0.{ms:03}000) can0 {id}#{data}\n"))).exit(0);
    assert_eq!(done.stdout.lines().count(), 6, "{}", done.stdout);
    assert!(done.stderr.contains("the times have no date"), "{}", done.stderr);
}

#[test]
fn files_that_are_no_recordings_are_named() {
    let bench = Bench::of("mh4@1");
    for (text, message) in [
        ("", "replay t.log: the file is empty"),
        ("nonsense\n", "replay t.log: not a recording in a known format"),
        ("date Mon Jan 1 10:00:00 2024\n", "replay t.log: this is a Vector ASC file without classic CAN frames"),
        (";$FILEVERSION=1.1\n", "replay t.log: this is a PEAK TRC file without classic CAN frames"),
    ] {
        let done = log_of(&bench, text).exit(8);
        assert!(done.stderr.starts_with(&format!("cangauge: {message}")), "{}", done.stderr);
    }
    for (bytes, hint) in [
        (&b"LOGG\x90\0\0\0"[..], "hint: convert it with python-can: "),
        (b"UnFinMF 4.10    ", "hint: convert it with python-can (pip install 'python-can[mf4]'): "),
        (b"SQLite format 3\0", "python3 -m can.logconvert t.log t.candump.log\n"),
        (b"\x0a\x0d\x0d\x0a\x1c\0\0\0", "hint: convert it: tshark -r t.log "),
    ] {
        let done = log_of(&bench, bytes).exit(8);
        assert!(done.stderr.contains(hint) && done.stderr.contains("replay t.log: this is a"), "{}", done.stderr);
    }
    for (text, hint) in [
        ("***BUSMASTER Ver 3.2.2***\n", "with the format converters of BUSMASTER"),
        ("Chn Identifier Flg   DLC  D0...1...2\n", "with the converter of Kvaser"),
        ("Timestamp: 1.000000    ID: 0181    S Rx\n", "hint: record with: python3 -m can.logger -f run.log ..."),
    ] {
        let done = log_of(&bench, text).exit(8);
        assert!(done.stderr.contains(hint), "{}", done.stderr);
    }
    replay(&bench, "nowhere.log", "log 1").exit(8);
    replay(&bench, "", "log 1").exit(2);
}

/// Frames in a form that cannot be read: joined bytes, a decimal comma.
#[test]
fn frames_that_cannot_be_read_are_not_missing_frames() {
    let bench = Bench::of("mh4@1");
    for (text, message) in [
        (
            "(1700000000.000000)  can0  185   [2]  00`01\n",
            "t.log:1: this looks like a candump log, but none of its lines",
        ),
        ("base hex timestamps absolute\n0,1 1 185 Rx d 1 00\n", "t.log:2: this looks like a Vector ASC file, but none"),
    ] {
        let done = log_of(&bench, text).exit(8);
        assert!(done.stderr.contains(message) && done.stderr.contains("hint: "), "{}", done.stderr);
    }
}

/// A recording of node 5 with one channel.
#[test]
fn requested_signals_and_nodes_that_are_missing_are_named() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("t.log"), recording(|_, ms, id, data| format!("(1700000000.{ms:03}000) can0 {id}#{data}\n")))
        .expect("written");
    let missing = |signal: &str| {
        format!("cangauge: none of the known TPDO mappings contains {signal}\nhint: they contain: ch1\n")
    };
    for line in ["log 5 ch2", "log all ch2", "check 5 ch2<1"] {
        let done = replay(&bench, "t.log", line).exit(3);
        assert!(done.stderr.ends_with(&missing("ch2")), "{line}: {}", done.stderr);
    }
    let done = replay(&bench, "t.log", "log 5 ch1 0x9130:1").exit(7);
    assert!(done.stderr.ends_with(&missing("0x9130:1")) && done.stdout.lines().count() == 6, "{}", done.stderr);
    let done = replay(&bench, "t.log", "log 5,6").exit(7);
    assert!(done.stderr.ends_with("cangauge: node 6 lost: no measurements at the end\n"), "{}", done.stderr);
    replay(&bench, "t.log", "log all").exit(0);
    // MH-4: TPDO2 with the temperature is not in the recording.
    let done = replay(&bench, "t.log", "log 5 temperature --device mh4 --accept-mismatch").exit(3);
    assert_eq!(done.stderr, "cangauge: the recording contains no TPDO with these signals of these nodes\n");
}

#[test]
fn start_of_a_recorded_node_is_no_restart() {
    let bench = Bench::of("mh4@1");
    let boot_up = |ms: u32| format!("(1700000000.{ms:03}000) can0 705#00\n");
    let log = recording(|number, ms, id, data| {
        let again = if number == 14 { boot_up(ms - 1) } else { String::new() };
        format!("{again}(1700000000.{ms:03}000) can0 {id}#{data}\n")
    });
    fs::write(bench.path("t.log"), format!("{}{log}", boot_up(0))).expect("written");
    let done = replay(&bench, "t.log", "log 5");
    assert_eq!(done.stderr.matches("node 5 restarted").count(), 1, "{}", done.stderr);
    let done = replay(&bench, "t.log", "pdo watch 5").exit(0);
    assert!(done.stderr.contains("node 5 restarted; its mapping is unknown until it is read again"), "{}", done.stderr);
}

#[test]
fn doctor_refuses_a_recording_and_nmt_watch_reads_it() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("t.log"), "(1700000000.000000) can0 705#05\n").expect("written");
    let done = replay(&bench, "t.log", "doctor --passive").exit(2);
    assert!(
        done.stderr.starts_with("cangauge: doctor examines nodes on a live bus, not in a recording"),
        "{}",
        done.stderr
    );
    let done = replay(&bench, "t.log", "nmt watch 5 -f json").exit(0);
    assert_eq!(done.json()[0]["state"], "operational", "{}", done.stdout);
}

/// A controller that is not connected reports hundreds of errors a second.
#[test]
fn repeated_faults_are_counted() {
    let bench = Bench::of("mh4@1");
    let mut log = recording(|_, ms, id, data| format!("(1700000000.{ms:03}000) can0 {id}#{data}\n"));
    for step in 0..1000 {
        log += &format!("(17000000{:02}.{:03}000) can0 20000008#00000A0000000000\n", 1 + step / 500, step % 500 * 2);
    }
    fs::write(bench.path("t.log"), log).expect("written");
    // The values end before the faults.
    replay(&bench, "t.log", "log 5 --events e.csv").exit(3);
    let events = bench.text("e.csv");
    assert!(events.lines().count() < 6, "{events}");
    assert!(events.contains("protocol error on the bus: "), "{events}");
}

#[test]
fn scan_and_watch_read_the_complete_recording() {
    let bench = Bench::of("mh4@1");
    let log = "(1700000000.000000) can0 701#00\n(1700003600.000000) can0 705#05\n";
    fs::write(bench.path("t.log"), log).expect("written");
    let done = replay(&bench, "t.log", "scan --passive --format json").exit(0);
    let nodes: Vec<_> = done.json().iter().map(|line| line["node"].clone()).collect();
    assert_eq!(nodes, [1, 5]);
    let done = replay(&bench, "t.log", "nmt watch").exit(0);
    assert_eq!(done.stdout.lines().count(), 2, "{}", done.stdout);
}

#[test]
fn emergencies_are_recorded() {
    let bench = Bench::of("mh4@1");
    let emergency = "(1700000000.250000) can0 085#0110010000000000\n";
    let moved = "(1700000000.260000) can0 0C5#0110020000000000\n";
    let setup = "(1700000000.013000) can0 605#4014100000000000\n(1700000000.013100) can0 585#43141000C5000000\n";
    let plain = recording(log_form);
    let values = plain.find("(1700000000.300").expect("the third value");
    let text = |more: &str, setup: &str| {
        let (before, after) = plain.split_at(values);
        before.replace("(1700000000.100", &format!("{setup}(1700000000.100")) + more + after
    };
    for (text, count) in [(text(emergency, ""), 1), (text(moved, ""), 0), (text(moved, setup), 1)] {
        fs::write(bench.path("t.log"), text).expect("written");
        let done = replay(&bench, "t.log", "log 5 --events e.csv --force").exit(0);
        assert_eq!(bench.text("e.csv").matches(",5,emcy,").count(), count, "{}", done.stderr);
        assert_eq!(done.stderr.contains("1 emergency message"), count == 1, "{}", done.stderr);
    }
}

#[test]
fn scan_reads_identities_from_the_sdo_traffic() {
    let bench = Bench::of("mh4@1");
    bench.run("scan 1").exit(0);
    keep(&bench);
    let done = replay(&bench, "t.log", "scan --passive --format json").exit(0);
    let node = &done.json()[0];
    assert_eq!((&node["device"], &node["vendor"], &node["name"]), (&"mh4".into(), &71.into(), &"MH-4-CAN".into()));
    let shown = replay(&bench, "t.log", "info 1 --passive --format json").exit(0);
    assert_eq!(shown.json(), done.json());
    replay(&bench, "t.log", "info 2 --passive").exit(3);
    // Refused and unanswered objects are unknown.
    let text = "(1700000000.0) can0 605#4018100100000000\n(1700000000.1) can0 585#8018100100000206\n\
                (1700000000.2) can0 605#4000100000000000\n(1700000000.3) can0 585#4300100094010200\n";
    fs::write(bench.path("t.log"), text).expect("written");
    let done = replay(&bench, "t.log", "scan --passive --format json").exit(0);
    let node = &done.json()[0];
    assert_eq!((&node["device_type"], &node["vendor"]), (&"0x00020194".into(), &serde_json::Value::Null));
}

/// A recording of a DPS without status object: TPDO1 with an integer, and emergencies.
fn dps_with(frames: &[&str]) -> String {
    let line = |(at, frame): (usize, &&str)| format!("(1700000000.{:03}000) can0 {frame}\n", 100 * at);
    frames.iter().enumerate().map(line).collect()
}

#[test]
fn emergency_is_the_status_until_it_is_over() {
    let bench = Bench::of("dps@127");
    let setup = "(1699999999.000000) can0 67F#4032610100000000\n(1699999999.001000) can0 5FF#4F32610103000000\n";
    for (end, after) in [("0FF#0000000000000000", ""), ("0FF#0000050000000000", "overload-high"), ("77F#00", "")] {
        let frames = ["1FF#A0860100", "0FF#0132050000000000", "1FF#30750000", "1FF#58920100", end, "1FF#A0860100"];
        fs::write(bench.path("t.log"), setup.to_owned() + &dps_with(&frames)).expect("written");
        let done = replay(&bench, "t.log", "log 127 --device dps").exit(0);
        let statuses: Vec<&str> = done.stdout.lines().skip(1).filter_map(|line| line.split(',').nth(6)).collect();
        assert_eq!(statuses, ["", "overload-high", "overload-high", after], "{end}: {}", done.stdout);
        assert!(done.stderr.contains("emergency 3201h, overflow or underflow\n"), "{}", done.stderr);
        let words = ["-b", "replay:t.log", "check", "127", "pressure < 1000", "--device", "dps"];
        bench.finish(&mut bench.command(&words)).exit(1);
    }
}

/// A recording of the test data: the same frames in the formats of several tools.
fn recorded(name: &str) -> String {
    format!("{}/tests/data/recordings/{name}", env!("CARGO_MANIFEST_DIR"))
}

#[test]
fn recordings_of_all_tools_give_the_same_rows() {
    let bench = Bench::of("mh4@1");
    let log = |name: &str| {
        let bus = format!("replay:{}", recorded(name));
        bench.finish(bench.command(&["--bus", &bus, "log", "5"]).env("TZ", "UTC0")).exit(0).stdout
    };
    let expected = log("candump.log");
    assert_eq!(expected.lines().count(), 6, "{expected}");
    for name in [
        "candump.log.gz",
        "vector-dec-relative.asc",
        "python-can.asc",
        "peak-1.1.trc",
        "peak-2.0.trc",
        "python-can.trc",
        "python-can.csv",
    ] {
        assert_eq!(log(name), expected, "{name}");
    }
}

#[test]
fn channel_follows_the_file() {
    let bench = Bench::of("mh4@1");
    let two = "(1700000000.0) can0 701#05\n(1700000000.1) can1 702#05\n";
    fs::write(bench.path("t.log"), two).expect("written");
    fs::write(bench.path("a:b.log"), two.replace("can1", "can0")).expect("written");
    let nodes = |file: &str, count| {
        let done = replay(&bench, file, "scan --passive --format json").exit(0);
        assert_eq!(done.json().len(), count, "{done:?}");
        done.json()[0]["node"].as_u64()
    };
    assert_eq!(nodes("t.log:can0", 1), Some(1));
    assert_eq!(nodes("t.log:can1", 1), Some(2));
    assert_eq!(nodes("a:b.log", 2), Some(1));
    let done = replay(&bench, "t.log", "scan --passive").exit(8);
    assert_eq!(
        done.stderr,
        "cangauge: replay t.log:2: frames of can0 and of can1: choose one of them\n\
         hint: choose one: -b replay:t.log:can0\n"
    );
    let done = replay(&bench, "t.log:can7", "scan --passive").exit(8);
    assert!(done.stderr.contains("no frames of channel can7 (found: can0, can1)"), "{}", done.stderr);
    bench.run("scan --pace").refuses("--pace plays a recording: -b replay:FILE");
}

#[test]
fn pdo_watch_and_check_read_the_mapping_from_the_recording() {
    let bench = Bench::of("mh4@1");
    fs::write(bench.path("t.log"), recording(log_form)).expect("written");
    for nodes in ["5", "all"] {
        let done = replay(&bench, "t.log", &format!("pdo watch {nodes} --format json")).exit(0);
        let values: Vec<_> = done.json().iter().map(|row| row["values"][0]["value"].as_f64()).collect();
        assert_eq!(values, [1.25, 1.5, 1.75, 2.0, 2.25].map(Some), "{done:?}");
    }
    let words = |nodes, expression| ["-b", "replay:t.log", "check", nodes, expression];
    bench.finish(&mut bench.command(&words("5", "ch1 < 3 bar"))).exit(0);
    bench.finish(&mut bench.command(&words("5", "ch1 < 2 bar"))).exit(1);
    let values: String = recording(log_form).lines().skip(13).map(|line| format!("{line}\n")).collect();
    fs::write(bench.path("t.log"), values).expect("written");
    let done = replay(&bench, "t.log", "pdo watch 5").exit(2);
    assert!(done.stderr.contains("node 5: the mapping of its TPDOs is unknown"), "{}", done.stderr);
    fs::write(bench.path("t.log"), "(1700000000.0) can0 705#05\n").expect("written");
    assert_eq!(replay(&bench, "t.log", "pdo watch 5").exit(3).stderr, "cangauge: no TPDO was received\n");
}
