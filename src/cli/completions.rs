//! `cangauge completions`.

use super::exit::{open_stdout, stdout};
use super::{Cli, Global};
use crate::bus::claim::Claim;
use clap::{Args, CommandFactory};
use clap_complete::Shell;
use std::io::Write;

/// Print the completion script for a shell
#[derive(Debug, Args)]
#[command(after_help = "Example:\n  cangauge completions bash > ~/.local/share/bash-completion/completions/cangauge")]
pub(crate) struct Completions {
    /// Shell: bash, zsh, fish, elvish or powershell
    shell: Shell,
}

impl Completions {
    /// No claim: other cangauges may use all nodes.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, _: &Global) -> anyhow::Result<()> {
        // Generated in memory first, because the generator panics on a closed pipe.
        let mut script = Vec::new();
        clap_complete::generate(self.shell, &mut Cli::command(), "cangauge", &mut script);
        open_stdout()?.write_all(&script).map_err(stdout)
    }
}
