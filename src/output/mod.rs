//! Rows and text: what goes to stdout, stderr and files. Knows no bus and no command line.

pub mod check_progress;
pub mod console;
pub mod csv;
mod elapsed;
pub mod events;
pub mod failure;
pub mod identity;
pub mod info;
mod info_report;
pub mod interfaces;
pub mod json;
pub mod json_lss;
pub mod junit;
pub mod nmt;
pub mod notes;
pub mod pdo;
pub mod progress;
pub mod replay;
pub mod report;
pub mod rows;
pub mod scan;
pub mod sdo;
pub mod settings;
pub mod summary;
pub mod table;
pub mod text;
pub mod verdict;
