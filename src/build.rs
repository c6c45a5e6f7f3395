//! Lists the folders of data files, so that a new device or simulator model needs no entry in a list. Chooses linker
//! options for a quick start of the program.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;
use std::{env, fs, io};

/// Pairs of a folder with one TOML file per entry, and the generated file that lists their names and texts.
const LISTS: [(&str, &str); 2] = [("src/device/devices", "devices.rs"), ("src/sim/models", "models.rs")];

/// A linker script with the functions of `sdo read` in the order of their first use. `.ci/order` writes it.
const ORDER: &str = "src/order.ld";

fn main() -> io::Result<()> {
    let root = env::var("CARGO_MANIFEST_DIR").map_err(io::Error::other)?;
    let out = env::var("OUT_DIR").map_err(io::Error::other)?;
    for (folder, list) in LISTS {
        rerun_if_changed(folder);
        fs::write(Path::new(&out).join(list), entries(&Path::new(&root).join(folder))?)?;
    }
    rerun_if_changed("src/build.rs");
    rerun_if_changed(ORDER);
    link_for_quick_start(&Path::new(&root).join(ORDER), Path::new(&out))
}

#[allow(clippy::print_stdout, reason = "this is how a build script speaks to cargo")]
fn rerun_if_changed(path: &str) {
    println!("cargo::rerun-if-changed={path}");
}

/// Sets linker options that avoid page faults, which take most of the start-up time. The first option places the
/// functions of a simple command side by side. The second one packs the addresses that the dynamic linker relocates;
/// the C library supports this from version 2.36 on. An option is used only if a test program links with it, and runs.
#[allow(clippy::print_stdout, reason = "this is how a build script speaks to cargo")]
fn link_for_quick_start(order: &Path, out: &Path) -> io::Result<()> {
    let has_value = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    // A program for another system cannot be run here.
    let is_native = env::var_os("HOST") == env::var_os("TARGET");
    if !has_value("PROFILE", "release") || !has_value("CARGO_CFG_TARGET_OS", "linux") || !is_native {
        return Ok(());
    }
    for option in [format!("-Wl,-T,{}", order.display()), "-Wl,-z,pack-relative-relocs".to_owned()] {
        if can_link(&option, out)? {
            println!("cargo::rustc-link-arg-bins={option}");
        }
    }
    Ok(())
}

/// Whether a program can be linked with this option, and runs.
fn can_link(option: &str, out: &Path) -> io::Result<bool> {
    let (source, program) = (out.join("probe.rs"), out.join("probe"));
    fs::write(&source, "fn main() {}\n")?;
    let mut compile = Command::new(env::var_os("RUSTC").unwrap_or_else(|| OsString::from("rustc")));
    let flags = env::var("CARGO_ENCODED_RUSTFLAGS").unwrap_or_default();
    compile.args(flags.split('\x1f').filter(|flag| !flag.is_empty()));
    if let Some(linker) = env::var_os("RUSTC_LINKER") {
        let mut argument = OsString::from("-Clinker=");
        argument.push(linker);
        compile.arg(argument);
    }
    compile.arg(format!("-Clink-arg={option}")).arg("-o").arg(&program).arg(&source);
    let is_linked = compile.output().is_ok_and(|output| output.status.success());
    Ok(is_linked && Command::new(&program).output().is_ok_and(|output| output.status.success()))
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
