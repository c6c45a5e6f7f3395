//! Lists the folders of data files, so that a new device or simulator model needs no entry in a list.

use std::fmt::Write as _;
use std::path::Path;
use std::{env, fs, io};

/// Pairs of a folder with one TOML file per entry, and the generated file that lists their names and texts.
const LISTS: [(&str, &str); 2] = [("src/device/devices", "devices.rs"), ("src/sim/models", "models.rs")];

fn main() -> io::Result<()> {
    let root = env::var("CARGO_MANIFEST_DIR").map_err(io::Error::other)?;
    let out = env::var("OUT_DIR").map_err(io::Error::other)?;
    for (folder, list) in LISTS {
        rerun_if_changed(folder);
        fs::write(Path::new(&out).join(list), entries(&Path::new(&root).join(folder))?)?;
    }
    rerun_if_changed("src/build.rs");
    Ok(())
}

#[allow(clippy::print_stdout, reason = "this is how a build script speaks to cargo")]
fn rerun_if_changed(path: &str) {
    println!("cargo::rerun-if-changed={path}");
}

/// Returns a Rust array expression with the name and the text of each file, sorted by name.
fn entries(folder: &Path) -> io::Result<String> {
    let mut paths =
        fs::read_dir(folder)?.map(|entry| entry.map(|entry| entry.path())).collect::<io::Result<Vec<_>>>()?;
    paths.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    paths.sort_by_key(|path| path.file_stem().map(ToOwned::to_owned));
    let mut list = "&[\n".to_owned();
    for path in paths {
        let name = path.file_stem().unwrap_or_default();
        let _ = writeln!(list, "    ({:?}, include_str!({:?})),", name.to_string_lossy(), path.to_string_lossy());
    }
    list.push_str("]\n");
    Ok(list)
}
