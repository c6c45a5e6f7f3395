//! The names of rotated files: `run-0001.csv`, `run-0002.csv` and so on for `run.csv`.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

/// The file with this number.
pub fn name(base: &Path, number: u32) -> PathBuf {
    let mut name = base.file_stem().map_or_else(OsString::new, OsString::from);
    name.push(format!("-{number:04}"));
    if let Some(extension) = base.extension() {
        name.push(".");
        name.push(extension);
    }
    base.with_file_name(name)
}

/// The numbers of the existing files, in ascending order.
///
/// # Errors
/// The folder cannot be read.
pub fn existing(base: &Path) -> io::Result<Vec<u32>> {
    let mut numbers = Vec::new();
    for entry in fs::read_dir(folder(base))? {
        numbers.extend(number(base, Path::new(&entry?.file_name())));
    }
    numbers.sort_unstable();
    Ok(numbers)
}

/// The folder of a file.
pub fn folder(file: &Path) -> &Path {
    file.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// The number of a file in the series of `base`; `None` if it does not belong to the series.
pub fn number(base: &Path, file: &Path) -> Option<u32> {
    let number = file.file_stem()?.to_str()?.rsplit_once('-')?.1.parse().ok()?;
    // `run-1.csv` and `run-+0001.csv` do not belong to the series.
    (name(base, number).file_name() == file.file_name()).then_some(number)
}

/// The base of a file of a series: `run.csv` for `run-0003.csv`. `None` if the name has no number.
pub fn base_of(file: &Path) -> Option<PathBuf> {
    let mut base = OsString::from(file.file_stem()?.to_str()?.rsplit_once('-')?.0);
    if let Some(extension) = file.extension() {
        base.push(".");
        base.push(extension);
    }
    let base = file.with_file_name(base);
    number(&base, file).is_some().then_some(base)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names() {
        let name = |base: &str, number| name(Path::new(base), number).display().to_string();
        assert_eq!(name("run.csv", 1), "run-0001.csv");
        assert_eq!(name("a.b/run.tar.gz", 12), "a.b/run.tar-0012.gz");
        assert_eq!(name("a.b/run", 12345), "a.b/run-12345");
    }

    #[test]
    fn bases_of_files() {
        let base = |file: &str| base_of(Path::new(file)).map(|base| base.display().to_string());
        assert_eq!(base("a/run-0001.csv").as_deref(), Some("a/run.csv"));
        assert_eq!(base("run-x-12345").as_deref(), Some("run-x"));
        assert_eq!((base("run-1.csv"), base("run.csv")), (None, None));
    }
}
