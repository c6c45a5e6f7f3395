//! Sends recordings to other programs: time-series databases and brokers.
//!
//! The recorded file is the spool: `log` never uses the network. A [`publisher::Publisher`] reads whole lines
//! ([`spool`]), encodes and sends them ([`sink::Sink`]), and moves the position file ([`position`]) only after the
//! server has acknowledged them. So it can end at any moment, and continues without a loss.
//!
//! The names of rotated files, the cells of CSV and line protocol are also used without the feature `publish`.

#[cfg(feature = "publish")]
pub mod batch;
pub mod cells;
#[cfg(feature = "publish")]
pub mod influx;
pub mod line_protocol;
#[cfg(feature = "publish")]
pub mod mqtt;
#[cfg(feature = "publish")]
pub mod position;
#[cfg(feature = "publish")]
pub mod publisher;
#[cfg(feature = "publish")]
pub mod row;
#[cfg(feature = "publish")]
pub mod run;
pub mod series;
#[cfg(feature = "publish")]
pub mod service;
#[cfg(feature = "publish")]
pub mod sink;
#[cfg(feature = "publish")]
pub mod spool;
#[cfg(feature = "publish")]
pub mod state;
#[cfg(feature = "publish")]
mod stream;
#[cfg(feature = "publish")]
pub mod target;
#[cfg(feature = "publish")]
pub mod tls;
