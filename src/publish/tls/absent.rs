//! Stands for TLS in a program that was built without it.

use super::TrustError;
use crate::publish::sink::Trouble;
use crate::publish::stream::{Socket, Stream};
use std::io;
use std::path::Path;
use ureq::config::ConfigBuilder;
use ureq::typestate::AgentScope;

/// The certificates of authorities that are trusted. It cannot be made.
#[derive(Clone, Copy, Debug)]
pub enum Trust {}

impl Trust {
    /// Fails: this program has no TLS.
    ///
    /// # Errors
    /// Always.
    pub fn load(_file: Option<&Path>) -> Result<Trust, TrustError> {
        Err(TrustError::Unsupported)
    }

    pub(in crate::publish) fn configure(&self, _config: ConfigBuilder<AgentScope>) -> ConfigBuilder<AgentScope> {
        match *self {}
    }

    pub(in crate::publish) fn connect(&self, _socket: Socket, _host: &str) -> Result<Box<dyn Stream>, Trouble> {
        match *self {}
    }
}

/// A failed connection was no failure of TLS.
pub(in crate::publish) fn trouble(_error: &io::Error) -> Option<Trouble> {
    None
}
