//! `cangauge completions`.

use super::args::Override;
use super::exit::{FileError, open_stdout, stdout};
use super::file::ReportFile;
use super::{Cli, Global, descriptions, open, program};
use cangauge::bus::claim::Claim;
use cangauge::bus::remote::adapters;
use cangauge::canopen::id::NodeId;
use cangauge::device::catalog::{self, Model};
use cangauge::device::dictionary::Entry;
use cangauge::device::standard;
use cangauge::node::offline::offline;
use cangauge::output::failure::ErrorMessage;
use clap::builder::PossibleValue;
use clap::{Arg, Args, Command, CommandFactory, ValueEnum};
use clap_complete::Shell;
use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::io::Write;
use std::path::PathBuf;
use std::sync::Arc;

/// Print or install the completion script for a shell
///
/// "install" writes the script for bash, zsh or fish to the folder where this shell looks for it, and prints its path.
///
/// The script completes commands, options, buses, and the names of devices, units, signals and objects. Signals and
/// objects are taken from --device and --eds, or from the built-in descriptions if neither option is given. The script
/// uses no bus.
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
    /// No node is locked: other cangauge processes may use all nodes.
    pub(super) fn claim(&self) -> Claim {
        Claim::Nothing
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        // The script is generated in memory, because the generator panics on a closed pipe.
        let text = match (self.action, self.shell) {
            (Some(Action::Install), shell) => install(shell, global)?,
            (Some(Action::Print(_)), Some(shell)) => {
                let message = format!("a second shell name ({shell}) is allowed only after \"install\"");
                return Err(ErrorMessage::usage(message).hint("cangauge completions install bash").into());
            }
            (Some(Action::Print(shell)), None) => script(shell),
            (None, _) => {
                let line = |(name, about): (String, String)| format!("{name}\t{about}").trim_end().to_owned() + "\n";
                names(&self.line, global).into_iter().map(line).collect::<String>().into_bytes()
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

/// The scripts for bash, zsh and fish call `cangauge completions -- WORDS`, which prints the matching words.
const BASH: &str = r#"# COMP_WORDS would split sim:mh4@5 and ai-input-pv:1.
_cangauge() {
    local -a line
    local text="${COMP_LINE:0:COMP_POINT}" word name
    read -ra line <<< "$text"
    [[ "$text" == *[[:space:]] ]] && line+=("")
    word="${line[${#line[@]} - 1]}"
    COMPREPLY=()
    while IFS=$'\t' read -r name _; do
        COMPREPLY+=("${name#"${word%"${word##*[:=@]}"}"}")
    done < <(cangauge completions -- "${line[@]:1}" 2>/dev/null)
}

complete -F _cangauge -o bashdefault -o default cangauge
"#;

const ZSH: &str = r#"#compdef cangauge

_cangauge() {
    local -a found
    found=("${(@f)$(cangauge completions -- "${(@)words[2,CURRENT]}" 2>/dev/null)}")
    if [[ -z "$found" ]]; then
        _files
        return
    fi
    found=("${(@)found//:/\\:}")
    found=("${(@)found/$'\t'/:}")
    _describe cangauge found
}

if [ "$funcstack[1]" = "_cangauge" ]; then
    _cangauge "$@"
else
    compdef _cangauge cangauge
fi
"#;

const FISH: &str = r"function __cangauge
    set -l word (commandline -ct)
    set -l found (cangauge completions -- (commandline -opc)[2..-1] $word 2>/dev/null)
    if set -q found[1]
        string join \n -- $found
    else
        __fish_complete_path $word
    end
end

complete -c cangauge -f -a '(__cangauge)'
";

/// The completion script for a shell.
pub fn script(shell: Shell) -> Vec<u8> {
    match shell {
        Shell::Bash => BASH.into(),
        Shell::Zsh => ZSH.into(),
        Shell::Fish => FISH.into(),
        _ => {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut Cli::command(), "cangauge", &mut script);
            script
        }
    }
}

/// Units that are offered for `--in` and `unit`.
const UNITS: &[&str] = &["bar", "mbar", "Pa", "hPa", "kPa", "MPa", "psi", "degC", "degF", "K", "deg", "mm"];

/// The kinds of words that can be completed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum WordKind {
    Bus,
    /// A CAN interface of this computer.
    Interface,
    Device,
    Words(&'static [&'static str]),
    /// A signal; objects are also allowed if the flag is set.
    Name(bool),
    Other,
}

/// Returns the kind of the word to complete. `command`: the commands before it. `count`: the number of positional
/// arguments before it. `option`: the option directly before it.
fn word_kind(command: &[&str], count: usize, option: Option<&str>) -> WordKind {
    match (option, command) {
        (Some("bus"), _) => WordKind::Bus,
        (Some("device"), _) | (None, ["devices", "show"] | ["sim"]) => WordKind::Device,
        (Some("in"), _) => WordKind::Words(UNITS),
        (Some("transmission"), _) => WordKind::Words(&["acyclic", "event", "sync:1", "timer"]),
        (Some(_), _) => WordKind::Other,
        (None, ["bus", "detect"]) if count == 0 => WordKind::Bus,
        (None, ["bus", _]) if count == 0 => WordKind::Interface,
        (None, ["objects"]) if count == 0 => WordKind::Device,
        (None, ["pdo", "show" | "map"]) if count == 1 => WordKind::Words(&["1", "2", "3", "4"]),
        (None, ["unit"]) if count == 2 => WordKind::Words(UNITS),
        (None, ["objects"] | ["sdo", "read" | "write"]) if count > 0 => WordKind::Name(true),
        (None, ["log" | "read" | "check"]) if count > 0 => WordKind::Name(true),
        (None, ["pdo", "map"]) if count > 1 => WordKind::Name(true),
        (None, ["unit" | "filter" | "limits"]) if count == 1 => WordKind::Name(false),
        _ => WordKind::Other,
    }
}

/// Returns the words that complete the last word, each with a description or "". Empty if it is a file name.
fn names(line: &[String], global: &Global) -> BTreeMap<String, String> {
    let Some((last, before)) = line.split_last() else { return BTreeMap::new() };
    let mut program = program();
    // Without `build`, clap has not yet created the arguments of nested commands.
    program.build();
    let mut command = &program;
    let (mut path, mut positional, mut option) = (Vec::new(), Vec::new(), None::<&Arg>);
    let mut sources = Vec::new();
    for word in before {
        if let Some(option) = option.take() {
            sources.extend(named_file(option.get_long().unwrap_or_default(), word));
        } else if let Some((name, value)) = word.strip_prefix("--").and_then(|word| word.split_once('=')) {
            sources.extend(named_file(name, value));
        } else if word.len() > 1 && word.starts_with('-') {
            option = find_option(&program, command, word).filter(|option| option.get_action().takes_values());
        } else if let Some(sub) = command.find_subcommand(word).filter(|_| positional.is_empty()) {
            path.push(sub.get_name());
            command = sub;
        } else {
            positional.push(word.as_str());
        }
    }
    let split = last.starts_with("--").then(|| last.split_once('=')).flatten();
    let prefix = split.map_or("", |(name, _)| &last[..=name.len()]);
    let option = split.map_or(option, |(name, _)| find_option(&program, command, name));
    let argument = option.or_else(|| command.get_positionals().nth(positional.len()));
    let plain = |names: Vec<String>| names.into_iter().map(|name| (name, String::new())).collect();
    let mut found: Vec<(String, String)> =
        match word_kind(&path, positional.len(), option.and_then(|option| option.get_long())) {
            WordKind::Bus => plain(buses()),
            WordKind::Interface => plain(open::interfaces().into_iter().map(|(name, _)| name).collect()),
            WordKind::Device => plain(device_names().collect()),
            WordKind::Words(words) => plain(words.iter().map(ToString::to_string).collect()),
            WordKind::Name(with_objects) => {
                let device_argument = positional.first().filter(|_| path == ["objects"]).map(|device| (*device, false));
                let sources = device_argument.into_iter().chain(sources);
                let models: Vec<_> = sources.filter_map(|(file, is_eds)| model(file, is_eds, global)).collect();
                plain(names_of(&models, with_objects))
            }
            WordKind::Other => argument.map(values).unwrap_or_default(),
        };
    if option.is_none() && positional.is_empty() {
        found.extend(visible(command.get_subcommands()));
    }
    let takes_file = argument.is_some_and(|argument| {
        argument.get_value_names().is_some_and(|names| names.iter().any(|name| name.contains("FILE")))
    });
    let has_no_candidates = last.is_empty() && found.is_empty() && !takes_file;
    if option.is_none() && (last.starts_with('-') || has_no_candidates) {
        found.extend(options(command).chain(options(&program)));
    }
    let found = found.into_iter().map(|(name, about)| (format!("{prefix}{name}"), about));
    found.filter(|(name, _)| name.starts_with(last.as_str())).collect()
}

/// The subcommands that are not hidden.
fn visible<'a>(commands: impl Iterator<Item = &'a Command>) -> impl Iterator<Item = (String, String)> {
    let about = |command: &Command| command.get_about().map(ToString::to_string).unwrap_or_default();
    commands
        .filter(|command| !command.is_hide_set())
        .map(move |command| (command.get_name().to_owned(), about(command)))
}

/// The long options of a command that are not hidden.
fn options(command: &Command) -> impl Iterator<Item = (String, String)> {
    let help = |argument: &Arg| {
        let text = argument.get_help().map(ToString::to_string).unwrap_or_default();
        text.split(['(', '[', ';']).next().unwrap_or_default().to_owned()
    };
    let shown = command.get_arguments().filter(|argument| !argument.is_hide_set());
    shown.filter_map(move |argument| Some((format!("--{}", argument.get_long()?), help(argument))))
}

/// Returns the possible values of an argument, with descriptions. Empty if the argument has no fixed set of values.
fn values(argument: &Arg) -> Vec<(String, String)> {
    let shown = argument.get_possible_values().into_iter().filter(|value| !value.is_hide_set());
    shown
        .map(|value| (value.get_name().to_owned(), value.get_help().map(ToString::to_string).unwrap_or_default()))
        .collect()
}

fn device_names() -> impl Iterator<Item = String> {
    catalog::all().map(|model| model.description.name.clone())
}

/// The interfaces of this computer, the simulated devices, and the prefixes of other buses (`slcan:`).
fn buses() -> Vec<String> {
    let mut all: Vec<String> = open::interfaces().into_iter().map(|(name, _)| name).collect();
    all.extend(["sim", "replay:", "slcan:", "socketcand://"].map(str::to_owned));
    all.extend(adapters().into_iter().map(|adapter| format!("slcan:{}@250k", adapter.path)));
    all.extend(device_names().map(|name| format!("sim:{name}@1")));
    all
}

/// Finds an option by its word (for example `-t` or `--timeout`): an option of the command or a global one.
fn find_option<'a>(program: &'a Command, command: &'a Command, word: &str) -> Option<&'a Arg> {
    let mut arguments = command.get_arguments().chain(program.get_arguments());
    match word.strip_prefix("--") {
        Some(long) => arguments.find(|argument| argument.get_long() == Some(long)),
        None => arguments.find(|argument| argument.get_short() == word.chars().nth(1) && word.len() == 2),
    }
}

/// Returns the file named by `--device` or `--eds`, and whether it is an EDS.
fn named_file<'a>(option: &str, value: &'a str) -> Option<(&'a str, bool)> {
    ["device", "eds"].contains(&option).then_some((value, option == "eds"))
}

fn model(file: &str, is_eds: bool, global: &Global) -> Option<Arc<Model>> {
    let what = file.parse::<Override>().map_or_else(|_| file.to_owned(), |given| given.what);
    descriptions::model(&what, is_eds, global).ok()
}

/// Returns the names in `models`. If it is empty, returns all built-in signals and the objects of the standards.
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
