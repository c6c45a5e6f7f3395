//! `cangauge completions`.

use super::args::Override;
use super::exit::{FileError, open_stdout, stdout};
use super::file::ReportFile;
use super::{Cli, Global, descriptions, program};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::device::catalog::{self, Model};
use crate::device::dictionary::Entry;
use crate::device::standard;
use crate::node::offline::offline;
use crate::output::failure::ErrorMessage;
use clap::builder::PossibleValue;
use clap::{Args, Command, CommandFactory, ValueEnum};
use clap_complete::Shell;
use std::collections::BTreeSet;
use std::env;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

/// Print or install the completion script for a shell
///
/// "install" writes the script to the user's folder of bash, zsh or fish, and prints its path. The script completes commands, options, device names, units, and the names of signals and objects: those in --device
/// and --eds, else those of the built-in descriptions. It uses no bus.
#[derive(Debug, Args)]
#[command(after_help = "Examples:\n  cangauge completions install\n  cangauge completions bash > cangauge.bash")]
pub(crate) struct Completions {
    /// Shell: bash, zsh, fish, elvish or powershell; or install
    #[arg(required_unless_present = "line", value_name = "SHELL|install", hide_possible_values = true)]
    action: Option<Action>,
    /// Shell for install: bash, zsh or fish [default: the shell in $SHELL]
    #[arg(value_name = "SHELL", hide_possible_values = true)]
    shell: Option<Shell>,
    /// For the scripts: print the names that fit after these words of a command line; the last word is incomplete
    #[arg(last = true, hide = true, allow_hyphen_values = true)]
    line: Vec<String>,
}

#[derive(Clone, Copy, Debug)]
enum Action {
    Print(Shell),
    Install,
}

impl ValueEnum for Action {
    fn value_variants<'a>() -> &'a [Action] {
        &[
            Action::Print(Shell::Bash),
            Action::Print(Shell::Elvish),
            Action::Print(Shell::Fish),
            Action::Print(Shell::PowerShell),
            Action::Print(Shell::Zsh),
            Action::Install,
        ]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        match self {
            Action::Print(shell) => shell.to_possible_value(),
            Action::Install => Some(PossibleValue::new("install")),
        }
    }
}

impl Completions {
    /// No claim: other cangauges may use all nodes.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        // Generated in memory first, because the generator panics on a closed pipe.
        let text = match (self.action, self.shell) {
            (Some(Action::Install), shell) => install(shell, global)?,
            (Some(Action::Print(_)), Some(shell)) => {
                return Err(ErrorMessage::usage(format!("{shell} follows only \"install\"")).into());
            }
            (Some(Action::Print(shell)), None) => script(shell),
            (None, _) => {
                names(&self.line, global).into_iter().flat_map(|name| format!("{name}\n").into_bytes()).collect()
            }
        };
        open_stdout()?.write_all(&text).map_err(stdout)
    }
}

/// Writes the script to the folder from which the shell loads completions. Returns its path as a line.
fn install(shell: Option<Shell>, global: &Global) -> anyhow::Result<Vec<u8>> {
    let usage = |message: &str| ErrorMessage::usage(message).hint("name the shell: cangauge completions install bash");
    let shell = shell.or_else(Shell::from_env).ok_or_else(|| usage("the shell in $SHELL is unknown"))?;
    let variable = |name: &str| env::var_os(name).filter(|value| !value.is_empty()).map(PathBuf::from);
    let home = variable("HOME").ok_or_else(|| ErrorMessage::usage("the home folder is unknown: $HOME is not set"))?;
    let folder = |name: &str, default: &str| variable(name).unwrap_or_else(|| home.join(default));
    let path = match shell {
        Shell::Bash => folder("XDG_DATA_HOME", ".local/share").join("bash-completion/completions/cangauge"),
        Shell::Fish => folder("XDG_CONFIG_HOME", ".config").join("fish/completions/cangauge.fish"),
        Shell::Zsh => folder("ZDOTDIR", "").join(".zfunc/_cangauge"),
        other => return Err(usage(&format!("{other} has no folder for completions")).into()),
    };
    let parent = path.parent().unwrap_or(&home);
    fs::create_dir_all(parent).map_err(|source| FileError { what: format!("create {}", parent.display()), source })?;
    ReportFile::create(&path, false, None)?.write(&script(shell))?;
    if shell == Shell::Zsh {
        let line = format!("fpath=({} $fpath)", parent.display());
        global.console().note(&format!("zsh loads it if .zshrc has this line before compinit: {line}"));
    }
    Ok(format!("{}\n", path.display()).into_bytes())
}

/// The names after the generated functions: a function that asks the program for names.
const BASH: &str = r#"
# Names of signals, objects, devices and units come from the program. COMP_WORDS would split ai-input-pv:1.
_cangauge_names() {
    _cangauge "$@"
    local -a line
    local text="${COMP_LINE:0:COMP_POINT}" word name
    read -ra line <<< "$text"
    [[ "$text" == *[[:space:]] ]] && line+=("")
    word="${line[${#line[@]} - 1]}"
    while IFS= read -r name; do
        COMPREPLY+=("${name#"${word%"${word##*:}"}"}")
    done < <(cangauge completions -- "${line[@]:1}" 2>/dev/null)
}

complete -F _cangauge_names -o bashdefault -o default cangauge
"#;

const ZSH: &str = r#"
    # Names of signals, objects, devices and units come from the program.
    local -a names
    names=(${(f)"$(cangauge completions -- "${(@)words[2,CURRENT]}" 2>/dev/null)"})
    (( ${#names} )) && compadd -a names
"#;

const FISH: &str = r"
# Names of signals, objects, devices and units come from the program.
complete -c cangauge -a '(cangauge completions -- (commandline -opc)[2..-1] (commandline -ct) 2>/dev/null)'
";

/// The completion script for a shell.
pub fn script(shell: Shell) -> Vec<u8> {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut Cli::command(), "cangauge", &mut script);
    let script = String::from_utf8_lossy(&script).into_owned();
    let script = match shell {
        Shell::Bash => script + BASH,
        Shell::Zsh => script.replacen("_cangauge() {\n", &format!("_cangauge() {{{ZSH}\n"), 1),
        Shell::Fish => script + FISH,
        _ => script,
    };
    script.into_bytes()
}

/// Units that are offered for `--in` and `unit`.
const UNITS: [&str; 12] = ["bar", "mbar", "Pa", "hPa", "kPa", "MPa", "psi", "degC", "degF", "K", "deg", "mm"];

/// What a word can be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Place {
    Device,
    Unit,
    /// A signal, or an object if the flag is set.
    Name(bool),
    Other,
}

/// The place of the word after `before`: positional words of a command, and the option whose value it is.
fn place(command: &[&str], count: usize, option: Option<&str>) -> Place {
    match (option, command) {
        (Some("device"), _) | (None, ["devices", "show"] | ["sim"]) => Place::Device,
        (Some("in"), _) => Place::Unit,
        (Some(_), _) => Place::Other,
        (None, ["objects"]) if count == 0 => Place::Device,
        (None, ["unit"]) if count == 2 => Place::Unit,
        (None, ["objects"] | ["sdo", "read" | "write"]) if count > 0 => Place::Name(true),
        (None, ["log" | "read" | "check"]) if count > 0 => Place::Name(true),
        (None, ["pdo", "map"]) if count > 1 => Place::Name(true),
        (None, ["unit" | "filter" | "limits"]) if count == 1 => Place::Name(false),
        _ => Place::Other,
    }
}

/// The names that can complete the last word.
fn names(line: &[String], global: &Global) -> BTreeSet<String> {
    let Some((last, before)) = line.split_last() else { return BTreeSet::new() };
    let program = program();
    let mut command = &program;
    let (mut path, mut positional, mut option) = (Vec::new(), Vec::new(), None);
    let mut sources = Vec::new();
    for word in before {
        if let Some(name) = option.take() {
            sources.extend(source(name, word));
        } else if let Some((name, value)) = word.strip_prefix("--").and_then(|word| word.split_once('=')) {
            sources.extend(source(name, value));
        } else if word.len() > 1 && word.starts_with('-') {
            option = value_option(&program, command, word);
        } else if let Some(sub) = command.find_subcommand(word).filter(|_| positional.is_empty()) {
            path.push(sub.get_name());
            command = sub;
        } else {
            positional.push(word.as_str());
        }
    }
    let split = last.strip_prefix("--").and_then(|word| word.split_once('='));
    let (option, prefix) = split.map_or((option, ""), |(name, _)| (Some(name), &last[..name.len() + 3]));
    let found: Vec<String> = match place(&path, positional.len(), option) {
        Place::Device => catalog::all().map(|model| model.description.name.clone()).collect(),
        Place::Unit => UNITS.map(str::to_owned).to_vec(),
        Place::Name(with_objects) => {
            let own = positional.first().filter(|_| path == ["objects"]).map(|device| (*device, false));
            let models: Vec<_> =
                own.into_iter().chain(sources).filter_map(|(file, is_eds)| model(file, is_eds, global)).collect();
            names_of(&models, with_objects)
        }
        Place::Other => Vec::new(),
    };
    found.into_iter().map(|name| format!("{prefix}{name}")).filter(|name| name.starts_with(last.as_str())).collect()
}

/// The option that takes the next word as its value.
fn value_option<'a>(program: &'a Command, command: &'a Command, word: &str) -> Option<&'a str> {
    let arguments = || command.get_arguments().chain(program.get_arguments());
    let named = match word.strip_prefix("--") {
        Some(long) => arguments().find(|argument| argument.get_long() == Some(long)),
        None => arguments().find(|argument| argument.get_short() == word.chars().nth(1) && word.len() == 2),
    };
    named.filter(|argument| argument.get_action().takes_values()).and_then(|argument| argument.get_long())
}

/// The description or EDS that an option names.
fn source<'a>(option: &str, value: &'a str) -> Option<(&'a str, bool)> {
    ["device", "eds"].contains(&option).then_some((value, option == "eds"))
}

fn model(file: &str, is_eds: bool, global: &Global) -> Option<Arc<Model>> {
    let what = file.parse::<Override>().map_or_else(|_| file.to_owned(), |given| given.what);
    descriptions::model(&what, is_eds, global).ok()
}

/// The names in these descriptions; without one, the signals of all built-in descriptions and the standard's objects.
fn names_of(models: &[Arc<Model>], with_objects: bool) -> Vec<String> {
    let signals = |model: &Arc<Model>| {
        let node = offline(NodeId::MIN, model);
        node.signals.into_iter().map(|signal| signal.name).collect::<Vec<_>>()
    };
    let objects = |model: &Arc<Model>| model.dictionary.iter().map(Entry::full_name).collect::<Vec<_>>();
    let mut names: Vec<String> = match models {
        [] => catalog::all().flat_map(signals).collect(),
        models => models.iter().flat_map(signals).collect(),
    };
    if with_objects {
        names.extend(models.iter().flat_map(objects));
        names.extend(standard::names().filter(|_| models.is_empty()));
    }
    names
}
