//! Facts about measuring devices: descriptions as data, units, and the objects of CiA 404.

pub mod assign;
pub mod catalog;
pub mod config_file;
pub mod description;
pub mod dictionary;
pub mod eds;
pub mod nearest;
pub mod profiles;
pub mod quirk;
pub mod scalar;
pub mod scale;
pub mod search;
pub mod sensor;
pub mod standard;
pub mod unit;
