//! The session of the README on a virtual CAN interface.

use super::Can;
use super::program::Done;
use std::path::Path;
use std::process::Command;

#[test]
#[ignore = "SKIPPED: needs a CAN interface, see tests/socketcan/run"]
fn session_on_a_virtual_interface_works_as_printed() {
    let can = Can::get();
    let readme = include_str!("../../README.md");
    let session = readme.split("```").find(|block| block.contains("-b vcan0 sim ")).expect("the session");
    // The interface is there already.
    let session: Vec<&str> = session.lines().skip(1).filter(|line| !line.starts_with("sudo ")).collect();
    let folder = Path::new(env!("CARGO_BIN_EXE_cangauge")).parent().expect("a folder");
    let path = format!("{}:{}", folder.display(), std::env::var("PATH").unwrap_or_default());
    let mut shell = Command::new("sh");
    shell.env("PATH", path).args(["-e", "-c", &session.join("\n").replace("vcan0", &can.name)]);
    let done = Done::from(shell.output().unwrap());
    assert_eq!(done.code, Some(0), "{done:?}");
    let rows = done.stdout.lines().filter(|line| line.contains(",pressure,"));
    assert_eq!(rows.count(), 20, "{}", done.stdout);
}
