//! The descriptions of the user: `$XDG_CONFIG_HOME/cangauge/devices/` and `/usr/share/cangauge/devices/`.

use super::Global;
use super::file::{as_text, read_input};
use cangauge::bus::owner::is_trusted;
use cangauge::device::catalog::{self, Model};
use cangauge::output::failure::ErrorMessage;
use std::env;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Returns the folders; the folder of the user is the first.
fn folders() -> Vec<PathBuf> {
    let path = |name: &str| env::var_os(name).map(PathBuf::from).filter(|path| path.is_absolute());
    let config = path("XDG_CONFIG_HOME").or_else(|| Some(path("HOME")?.join(".config")));
    let user_folder = config.map(|config| config.join("cangauge/devices"));
    user_folder.into_iter().chain([PathBuf::from("/usr/share/cangauge/devices")]).collect()
}

/// Reads the descriptions. Returns the mistakes of unusable files.
///
/// # Errors
/// Two files for the same device.
pub(super) fn load() -> Result<Vec<String>, ErrorMessage> {
    let mut models: Vec<Arc<Model>> = Vec::new();
    let mut broken = Vec::new();
    for file in folders().iter().flat_map(|folder| files(folder)) {
        match read(&file) {
            // A description in the first folder replaces one with the same name in the second folder.
            Ok(model) if models.iter().any(|other| other.description.name == model.description.name) => {}
            Ok(model) => models.push(Arc::new(model)),
            Err(reason) => broken.push(reason),
        }
    }
    for (at, model) in models.iter().enumerate() {
        if let Some(other) = models[..at].iter().find(|other| other.is_for_the_same_device(model)) {
            let message = format!("two descriptions for the same device: {} and {}", file_of(other), file_of(model));
            return Err(ErrorMessage::usage(message).hint("remove one of them, or its [identify]"));
        }
    }
    catalog::add_own(models);
    Ok(broken)
}

/// Returns the file name of a user description.
pub(super) fn file_of(model: &Model) -> &str {
    model.made_for.first().map_or("", |device| device.file.as_str())
}

/// Returns the TOML files of a folder, sorted by name.
fn files(folder: &Path) -> Vec<PathBuf> {
    let Ok(entries) = fs::read_dir(folder) else { return Vec::new() };
    let mut files: Vec<PathBuf> = entries.filter_map(|entry| Some(entry.ok()?.path())).collect();
    files.retain(|file| file.extension().is_some_and(|extension| extension == "toml"));
    files.sort();
    files
}

fn read(path: &Path) -> Result<Model, String> {
    let text = || -> io::Result<Option<String>> {
        let file = File::open(path)?;
        if is_trusted(&file)? { as_text(read_input(file)?).map(Some) } else { Ok(None) }
    };
    let name = path.display().to_string();
    let Some(text) = text().map_err(|error| format!("{name}: {error}"))? else {
        return Err(format!("{name}: as root, only files that belong to root are read"));
    };
    let mut model = Model::from_toml(&text).map_err(|error| error.in_file(&name))?;
    model.made_for.iter_mut().for_each(|device| device.file.clone_from(&name));
    Ok(model)
}

/// Prints notes about files that are not used, and built-in descriptions that are replaced.
pub(super) fn report(broken: &[String], global: &Global) {
    let console = global.console();
    match broken {
        [] => {}
        [one] => console.note(&format!("not used: {}", one)),
        [one, ..] => console.note(&format!("{} descriptions are not used, the first: {}", broken.len(), one)),
    }
    for model in catalog::own().iter().filter(|model| catalog::text(&model.description.name).is_some()) {
        let name = &model.description.name;
        console.note(&format!("{} replaces the built-in description \"{name}\"", file_of(model)));
    }
}
