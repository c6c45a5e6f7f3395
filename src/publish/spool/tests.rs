use super::*;
use std::fs::OpenOptions;
use std::io::Write;
use tempfile::TempDir;

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

fn append(path: &Path, text: &str) {
    let mut file = OpenOptions::new().append(true).create(true).open(path).expect("a file");
    file.write_all(text.as_bytes()).expect("written");
}

/// The lines that can be read now, each with its number.
fn lines(spool: &mut Spool) -> Vec<String> {
    let mut found = Vec::new();
    while let Some(chunk) = spool.next_chunk().expect("read") {
        let text = String::from_utf8_lossy(&chunk.bytes).into_owned();
        found.extend(text.lines().enumerate().map(|(at, line)| format!("{}:{line}", chunk.first_line + at as u64)));
        assert_eq!(chunk.end.line, chunk.first_line + text.lines().count() as u64 - 1);
    }
    found
}

fn position(spool: &Spool) -> Position {
    let mut position = Position::default();
    position.set_place(spool.place().expect("a place"), "h");
    position
}

fn resumed(base: &Path, position: &Position) -> (Vec<String>, Vec<SpoolEvent>) {
    let mut spool = Spool::open(base, Some(position), Start::Start).expect("opened");
    let lines = lines(&mut spool);
    (lines, spool.take_events())
}

#[test]
fn only_whole_lines_are_read() {
    let folder = folder();
    let path = folder.path().join("run.csv");
    let mut spool = Spool::open(&path, None, Start::Start).expect("opened");
    assert!(!spool.exists() && lines(&mut spool).is_empty());
    append(&path, "h\na\nb");
    assert_eq!(lines(&mut spool), ["1:h", "2:a"]);
    assert_eq!(spool.bytes_after(spool.place().expect("a place")), 1);
    append(&path, "b\nc\n");
    assert_eq!(lines(&mut spool), ["3:bb", "4:c"]);
    assert_eq!(resumed(&path, &position(&spool)), (Vec::new(), Vec::new()));
    append(&path, "d\n");
    assert_eq!(resumed(&path, &position(&spool)), (vec!["5:d".to_owned()], Vec::new()));
    let mut at_end = Spool::open(&path, None, Start::End).expect("opened");
    assert_eq!((lines(&mut at_end), at_end.first_line()), (Vec::new(), "h".to_owned()));
    append(&path, "e\n");
    assert_eq!(lines(&mut at_end), ["6:e"]);
}

#[test]
fn long_lines_do_not_stop_the_spool() {
    let folder = folder();
    let path = folder.path().join("run.csv");
    let long = "x".repeat(2 * usize::try_from(CHUNK_SIZE).expect("small"));
    append(&path, &format!("{long}\na\n"));
    let mut spool = Spool::open(&path, None, Start::Start).expect("opened");
    assert_eq!(lines(&mut spool), [format!("1:{long}"), "2:a".to_owned()]);
}

#[test]
fn rotated_files_follow_in_their_order() {
    let folder = folder();
    let (base, path) = (folder.path().join("run.csv"), |number| series::name(&folder.path().join("run.csv"), number));
    append(&path(1), "h\na\n");
    let mut spool = Spool::open(&base, None, Start::Start).expect("opened");
    assert_eq!(lines(&mut spool), ["1:h", "2:a"]);
    // The writer adds a line before it creates the next file. The last line of the first file was cut off by a kill.
    append(&path(1), "b\ncut");
    append(&path(3), "h\nc\n");
    let before = position(&spool);
    assert_eq!(lines(&mut spool), ["3:b", "1:h", "2:c"]);
    assert_eq!(resumed(&base, &before).0, ["3:b", "1:h", "2:c"]);
    // The first file was deleted meanwhile.
    std::fs::remove_file(path(1)).expect("removed");
    let (rest, events) = resumed(&base, &before);
    assert_eq!((rest, events), (vec!["1:h".to_owned(), "2:c".to_owned()], vec![SpoolEvent::Gone(path(1), path(3))]));
    assert_eq!(resumed(&base, &position(&spool)).0, [""; 0]);
    // A file of the series by its own name.
    assert_eq!(lines(&mut Spool::open(&path(3), None, Start::Start).expect("opened")), ["1:h", "2:c"]);
}

#[test]
fn truncated_and_replaced_file_is_read_from_its_start() {
    let folder = folder();
    let path = folder.path().join("run.csv");
    append(&path, "h\na\nb\n");
    let mut spool = Spool::open(&path, None, Start::Start).expect("opened");
    assert_eq!(lines(&mut spool), ["1:h", "2:a", "3:b"]);
    let before = position(&spool);
    for text in ["h\nc\n", "h\nx\nd\ne\nf\n"] {
        // The second file is longer than the first one was.
        std::fs::write(&path, text).expect("written");
        let expected: Vec<String> = text.lines().enumerate().map(|(at, line)| format!("{}:{line}", at + 1)).collect();
        assert_eq!(lines(&mut spool), expected);
        assert_eq!(spool.take_events(), [SpoolEvent::Truncated(path.clone())]);
        assert_eq!(resumed(&path, &before), (expected, vec![SpoolEvent::Truncated(path.clone())]));
    }
}

#[test]
#[cfg(unix)]
fn moved_file_is_read_to_its_end_before_the_new_one() {
    let folder = folder();
    let [path, old] = ["run.csv", "old.csv"].map(|name| folder.path().join(name));
    append(&path, "h\na\n");
    let mut spool = Spool::open(&path, None, Start::Start).expect("opened");
    assert_eq!(lines(&mut spool), ["1:h", "2:a"]);
    let before = position(&spool);
    std::fs::rename(&path, &old).expect("moved");
    append(&old, "b\n");
    assert_eq!(lines(&mut spool), ["3:b"], "the writer continues in the moved file");
    append(&path, "");
    append(&old, "c\n");
    assert_eq!(lines(&mut spool), ["4:c"], "the new file is still empty");
    append(&path, "h\nd\n");
    assert_eq!(lines(&mut spool), ["1:h", "2:d"]);
    assert_eq!(resumed(&path, &before), (["3:b", "4:c", "1:h", "2:d"].map(str::to_owned).to_vec(), Vec::new()));
    std::fs::remove_file(&old).expect("removed");
    assert_eq!(resumed(&path, &before).1, [SpoolEvent::Truncated(path.clone())]);
}
