//! Tests of rows in files and streams.

use super::*;
use crate::bus::{Mono, Wall};
use crate::canopen::id::NodeId;
use crate::measure::sample::{Number, Raw, Status};
use crate::publish::series;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::sync::{Arc, Mutex};

#[derive(Clone, Debug, Default)]
struct Shared(Arc<Mutex<Vec<u8>>>);

impl Write for Shared {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.0.lock().expect("not poisoned").extend_from_slice(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

impl Shared {
    fn text(&self) -> String {
        String::from_utf8(self.0.lock().expect("not poisoned").clone()).expect("text")
    }
}

fn stream(setup: Setup) -> (Shared, Rows) {
    let shared = Shared::default();
    let writer = LineWriter::direct(OutputTarget::Stream(Box::new(shared.clone())), None);
    (shared, Rows::new(writer, setup))
}

fn text(setup: Setup, samples: &[(Sample, Source)]) -> String {
    let (shared, mut rows) = stream(setup);
    for (sample, source) in samples {
        rows.put(None, std::slice::from_ref(sample), std::slice::from_ref(source)).expect("memory");
    }
    rows.finish(&mut || false).expect("memory");
    shared.text()
}

fn at(us: u64) -> Stamp {
    let since = Duration::from_micros(us);
    Stamp { mono: Mono::at(since), wall: Wall::at(Duration::from_secs(1_700_000_000) + since) }
}

fn sample(at_us: u64, value: Option<Number>, status: Option<Status>, raw: &[u8]) -> Sample {
    Sample { at: at(at_us), source: 0, value, status, raw: Raw::new(raw), doubt: None }
}

fn source(signal: &str, unit: &str) -> Source {
    Source { node: NodeId::new(5).expect("a node-ID"), signal: signal.into(), unit: unit.into() }
}

fn three() -> [(Sample, Source); 3] {
    [
        (
            sample(1_000_000, Some(Number::Decimal { mantissa: 50_000, digits: 3 }), None, &[0x50, 0xc3, 0, 0]),
            source("pressure", "psi"),
        ),
        (
            sample(1_010_001, Some(Number::Real32(1.1)), Some(Status::Ok), &[0xcd, 0xcc, 0x8c, 0x3f]),
            source("pressure", "bar"),
        ),
        (sample(3_000_000, None, Some(Status::OverloadHigh), &[0, 0, 0xc0, 0x7f]), source("a,\"b", "")),
    ]
}

#[test]
fn csv_rows() {
    assert_eq!(
        text(Setup::default(), &three()),
        "time,elapsed_s,node,signal,value,unit,status,raw\n\
         2023-11-14T22:13:21.000000Z,0.000000,5,pressure,50.000,psi,,0x50C30000\n\
         2023-11-14T22:13:21.010001Z,0.010001,5,pressure,1.1,bar,ok,0xCDCC8C3F\n\
         2023-11-14T22:13:23.000000Z,2.000000,5,\"a,\"\"b\",,,overload-high,0x0000C07F\n"
    );
}

#[test]
fn csv_rows_with_other_separators() {
    let dialect = Dialect { delimiter: b';', decimal: b',', bom: true };
    let setup = Setup { dialect, time: TimeForm::Unix, ..Setup::default() };
    assert_eq!(
        text(setup, &three()),
        "\u{feff}time;elapsed_s;node;signal;value;unit;status;raw\n\
         1700000001,000000;0,000000;5;pressure;50,000;psi;;0x50C30000\n\
         1700000001,010001;0,010001;5;pressure;1,1;bar;ok;0xCDCC8C3F\n\
         1700000003,000000;2,000000;5;\"a,\"\"b\";;;overload-high;0x0000C07F\n"
    );
}

#[test]
fn json_rows() {
    let rows = [
        (
            sample(0, Some(Number::Decimal { mantissa: 17_898, digits: 3 }), None, &[0xea, 0x45, 0, 0]),
            source("pressure", "psi"),
        ),
        (sample(10_000, Some(Number::Real32(1.1)), Some(Status::Ok), &[1]), source("pressure", "bar")),
        (sample(20_000, None, Some(Status::Invalid), &[2]), source("ch1", "")),
    ];
    let json = |time| text(Setup { format: FileFormat::JsonLines, time, ..Setup::default() }, &rows);
    assert_eq!(
        json(TimeForm::Rfc3339),
        "{\"time\":\"2023-11-14T22:13:20.000000Z\",\"elapsed_s\":0.0,\"node\":5,\"signal\":\"pressure\",\"value\":17.898,\"unit\":\"psi\",\"status\":null,\"raw\":\"0xEA450000\"}\n\
         {\"time\":\"2023-11-14T22:13:20.010000Z\",\"elapsed_s\":0.01,\"node\":5,\"signal\":\"pressure\",\"value\":1.1,\"unit\":\"bar\",\"status\":\"ok\",\"raw\":\"0x01\"}\n\
         {\"time\":\"2023-11-14T22:13:20.020000Z\",\"elapsed_s\":0.02,\"node\":5,\"signal\":\"ch1\",\"value\":null,\"unit\":null,\"status\":\"invalid\",\"raw\":\"0x02\"}\n"
    );
    assert!(json(TimeForm::Unix).contains("{\"time\":1700000000.01,\"elapsed_s\":0.01,"), "numbers");
}

#[test]
fn wide_rows_and_changed_columns() {
    for format in [FileFormat::Csv, FileFormat::JsonLines] {
        let (shared, mut rows) = stream(Setup { format, layout: Layout::Wide, ..Setup::default() });
        let sources = [source("pressure", "bar"), source("ch1", ""), source("pressure", "psi")];
        rows.set_sources(&sources[..2]).expect("a new file");
        let value = |us, source, status| Sample { source, ..sample(us, Some(Number::Real32(1.5)), status, &[]) };
        rows.start_cycle(0, at(0)).expect("memory");
        rows.put(None, &[value(10, 0, Some(Status::Ok))], &sources).expect("memory");
        rows.put(None, &[value(20, 1, None)], &sources).expect("memory");
        rows.start_cycle(1, at(1000)).expect("memory");
        rows.put(None, &[value(1010, 2, None)], &sources).expect("memory");
        assert_eq!(rows.elapsed(at(510)), Some(Duration::from_micros(500)));
        rows.finish(&mut || false).expect("memory");
        assert_eq!((rows.count(), rows.column_changes(), rows.left_out()), (2, 1, 0));
        let csv = "time,elapsed_s,5.pressure [bar],5.pressure.status,5.ch1,5.ch1.status\n\
                   2023-11-14T22:13:20.000010Z,0.000000,1.5,ok,1.5,\n\
                   \n\
                   time,elapsed_s,5.pressure [psi],5.pressure.status,5.ch1,5.ch1.status\n\
                   2023-11-14T22:13:20.001010Z,0.001000,1.5,,,\n";
        let json = "{\"time\":\"2023-11-14T22:13:20.000010Z\",\"elapsed_s\":0.0,\"5.pressure [bar]\":1.5,\"5.pressure.status\":\"ok\",\"5.ch1\":1.5,\"5.ch1.status\":null}\n\
                    {\"time\":\"2023-11-14T22:13:20.001010Z\",\"elapsed_s\":0.001,\"5.pressure [psi]\":1.5,\"5.pressure.status\":null,\"5.ch1\":null,\"5.ch1.status\":null}\n";
        assert_eq!(shared.text(), if format == FileFormat::Csv { csv } else { json });
    }
}

/// Writes a row every 250 ms to `run-0001.csv` and so on; returns the text of each file.
fn rotated(rotation: Rotation, count: u64) -> Vec<String> {
    let folder = tempfile::tempdir().expect("a folder");
    let base = folder.path().join("run.csv");
    let file = fs::File::create(series::name(&base, 1)).expect("created");
    let writer = LineWriter::direct(
        OutputTarget::File { file, path: base.clone(), keep: 0 },
        Some(Series::new(&base, 2, false)),
    );
    let mut rows = Rows::new(writer, Setup { rotation: Some(rotation), has_series: true, ..Setup::default() });
    for number in 0..count {
        let row = sample(number * 250_000, Some(Number::Decimal { mantissa: number.into(), digits: 0 }), None, &[]);
        rows.put(None, &[row], &[source("ch1", "")]).expect("written");
    }
    rows.finish(&mut || false).expect("written");
    let read = |number| fs::read_to_string(series::name(Path::new(&base), number)).expect("a file");
    series::existing(&base).expect("the folder").into_iter().map(read).collect()
}

/// The values in the files. Each file must start with the header.
fn values(files: &[String]) -> Vec<Vec<u64>> {
    let values = |text: &String| {
        let mut lines = text.lines();
        assert_eq!(lines.next(), Some("time,elapsed_s,node,signal,value,unit,status,raw"));
        lines.map(|line| line.split(',').nth(4).and_then(|cell| cell.parse().ok()).expect(line)).collect()
    };
    files.iter().map(values).collect()
}

#[test]
fn rows_of_a_device_that_replaces_another_are_in_the_next_file() {
    for (has_series, expected) in [(true, vec![vec![0], vec![1]]), (false, vec![vec![0, 1]])] {
        let folder = tempfile::tempdir().expect("a folder");
        let base = folder.path().join("run.csv");
        let file = fs::File::create(series::name(&base, 1)).expect("created");
        let target = OutputTarget::File { file, path: base.clone(), keep: 0 };
        let writer = LineWriter::direct(target, has_series.then(|| Series::new(&base, 2, false)));
        let mut rows = Rows::new(writer, Setup { has_series, ..Setup::default() });
        // Before the first row, the file is still empty.
        rows.start_file(at(0)).expect("memory");
        for number in 0..2 {
            let row = sample(number * 1000, Some(Number::Decimal { mantissa: number.into(), digits: 0 }), None, &[]);
            rows.put(None, &[row], &[source("ch1", "")]).expect("written");
            if number == 0 {
                rows.start_file(at(1)).expect("the next file");
            }
        }
        rows.finish(&mut || false).expect("written");
        let read = |number| fs::read_to_string(series::name(&base, number)).expect("a file");
        let files: Vec<String> = series::existing(&base).expect("the folder").into_iter().map(read).collect();
        assert_eq!(values(&files), expected);
    }
}

#[test]
fn rotation_by_time_loses_no_row() {
    let files = values(&rotated(Rotation::Every(Duration::from_secs(1)), 10));
    assert_eq!(files, [vec![0, 1, 2, 3], vec![4, 5, 6, 7], vec![8, 9]]);
}

#[test]
fn rotation_by_size_fills_each_file() {
    let files = rotated(Rotation::Size(49 + 3 * 50), 2000);
    assert!(files.iter().all(|file| file.len() <= 49 + 3 * 50));
    let values = values(&files);
    assert!(values[..values.len() - 1].iter().all(|values| (2..=3).contains(&values.len())), "as many as fit");
    assert_eq!(values.concat(), (0..2000).collect::<Vec<_>>());
    let each = self::values(&rotated(Rotation::Size(1), 3));
    assert_eq!(each, [[0], [1], [2]], "a row that never fits gets its own file");
}

#[test]
fn continued_file_keeps_its_whole_lines() {
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("run.csv");
    let head = "time,elapsed_s,node,signal,value,unit,status,raw";
    fs::write(&path, format!("{head}\n1,2\n3,4")).expect("written");
    let mut file = fs::OpenOptions::new().read(true).write(true).open(&path).expect("opened");
    let existing = existing_lines(&mut file).expect("read").expect("lines");
    let setup = Setup { existing_header: Some(existing.header), continues: true, ..Setup::default() };
    assert_eq!(setup.check_long(), Ok(()));
    let mut rows = Rows::new(
        LineWriter::direct(OutputTarget::File { file, path: path.clone(), keep: existing.length }, None),
        setup,
    );
    assert_eq!(fs::read_to_string(&path).expect("read").len(), 48 + 1 + 4 + 3, "nothing before the first row");
    rows.put(None, &[three()[1].0.clone()], &[source("pressure", "bar")]).expect("written");
    rows.finish(&mut || false).expect("written");
    let row = "2023-11-14T22:13:21.010001Z,0.000000,5,pressure,1.1,bar,ok,0xCDCC8C3F";
    assert_eq!(fs::read_to_string(&path).expect("read"), format!("{head}\n1,2\n{row}\n"));
}

#[test]
fn no_row_waits_longer_than_half_a_second() {
    for layout in [Layout::Long, Layout::Wide] {
        let (shared, mut rows) = stream(Setup { layout, ..Setup::default() });
        let sources = [source("ch1", "")];
        rows.set_sources(&sources).expect("a new file");
        for number in 0..200u64 {
            let us = number * 10_000;
            rows.start_cycle(number, at(us)).expect("memory");
            rows.put(None, &[sample(us, Some(Number::Real32(1.5)), None, &[])], &sources).expect("memory");
            rows.advance(at(us)).expect("memory");
            let handed_over = shared.text().lines().skip(1).count() as u64;
            assert!(number + 1 - handed_over <= 50, "{handed_over} of {}", number + 1);
        }
        // The last rows do not wait for further rows.
        rows.advance(at(199 * 10_000 + 500_000)).expect("memory");
        assert_eq!(shared.text().lines().count(), 201);
    }
}
