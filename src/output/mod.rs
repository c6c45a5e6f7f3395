//! Rows and text for stdout, stderr and files. This layer does not use the bus or the command line.

pub mod autozero;
pub mod check_progress;
pub mod config;
pub mod config_record;
pub mod conform;
pub mod console;
pub mod csv;
pub mod dbc;
pub mod dcf;
pub mod devices;
pub mod diagnosis;
pub mod doctor;
pub mod doubt;
pub mod draft;
mod elapsed;
pub mod events;
pub mod failure;
pub mod github;
pub mod health;
pub mod identity;
pub mod info;
mod info_report;
pub mod interfaces;
pub mod json;
pub mod junit;
pub mod live;
pub mod lss;
pub mod monitor;
pub mod nmt;
pub mod notes;
pub mod objects;
pub mod pdo;
pub mod plot;
pub mod progress;
#[cfg(feature = "publish")]
pub mod publish;
pub mod read;
pub mod recording;
pub mod replay;
pub mod report;
pub mod rows;
pub mod run_file;
pub mod scan;
pub mod sdo;
pub mod settings;
pub mod store;
pub mod summary;
pub mod table;
pub mod text;
pub mod verdict;

/// The width of the terminal on stdout in characters.
pub fn stdout_width() -> Option<usize> {
    terminal_size::terminal_size_of(std::io::stdout()).map(|(width, _)| usize::from(width.0))
}

/// The width and height of the terminal on stderr in characters.
pub fn stderr_size() -> Option<(usize, usize)> {
    let size = terminal_size::terminal_size_of(std::io::stderr());
    size.map(|(width, height)| (usize::from(width.0), usize::from(height.0)))
}
