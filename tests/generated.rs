//! `completions/` and `man/` are what the definition of the command line says, to the byte.
//!
//! `UPDATE_GENERATED=1 cargo test --test generated` writes them anew.

use cangauge::cli::{Cli, program};
use clap::{Command, CommandFactory};
use clap_complete::Shell;
use clap_mangen::Man;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// A folder's files by name.
type Files = BTreeMap<String, Vec<u8>>;

fn completions() -> Files {
    let names = [
        (Shell::Bash, "cangauge.bash"),
        (Shell::Zsh, "_cangauge"),
        (Shell::Fish, "cangauge.fish"),
        (Shell::PowerShell, "_cangauge.ps1"),
    ];
    let script = |shell| {
        let mut script = Vec::new();
        clap_complete::generate(shell, &mut Cli::command(), "cangauge", &mut script);
        script
    };
    names.into_iter().map(|(shell, name)| (name.to_owned(), script(shell))).collect()
}

fn man() -> Files {
    let mut root = program().disable_help_subcommand(true);
    root.build();
    let mut pages = Files::new();
    let mut waiting = vec![root];
    while let Some(command) = waiting.pop() {
        waiting.extend(command.get_subcommands().filter(|command| !command.is_hide_set()).cloned());
        let name = Man::new(command.clone()).get_filename();
        pages.insert(name, page(command).expect("memory"));
    }
    pages
}

/// A page as `Man::render` makes it, but with the paragraphs below the options under headings of their own
/// and line by line, as they are in the help.
fn page(command: Command) -> io::Result<Vec<u8>> {
    let notes = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let has_subcommands = command.has_subcommands();
    let version = format!("cangauge {}", env!("CARGO_PKG_VERSION"));
    let man = Man::new(command).source(version).manual("cangauge");
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    man.render_synopsis_section(&mut page)?;
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if has_subcommands {
        man.render_subcommands_section(&mut page)?;
    }
    for paragraph in notes.split("\n\n").filter(|paragraph| !paragraph.is_empty()) {
        let heading = paragraph.split([':', ',']).next().unwrap_or_default();
        let text = paragraph.strip_prefix(heading).and_then(|text| text.strip_prefix(':')).unwrap_or(paragraph);
        writeln!(page, ".SH \"{}\"\n.nf", heading.to_uppercase())?;
        for line in text.strip_prefix('\n').unwrap_or(text.trim_start()).lines() {
            let line = line.replace('\\', "\\e").replace('-', "\\-");
            // A point or an apostrophe at its begin would be a command.
            let guard = if line.starts_with(['.', '\'']) { "\\&" } else { "" };
            writeln!(page, "{guard}{line}")?;
        }
        writeln!(page, ".fi")?;
    }
    // Each section brings the definition of the apostrophe: once is enough.
    let text = String::from_utf8_lossy(&page);
    let preamble: String = text.split_inclusive('\n').take(2).collect();
    let body = text.replace(&preamble, "");
    Ok((preamble + &body).into_bytes())
}

fn check(folder: &str, wanted: &Files) {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(folder);
    let there: Vec<PathBuf> =
        fs::read_dir(&folder).into_iter().flatten().map(|entry| entry.expect("an entry").path()).collect();
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    if std::env::var_os("UPDATE_GENERATED").is_some_and(|value| value == "1") {
        fs::create_dir_all(&folder).expect("the folder");
        for path in there.iter().filter(|path| !wanted.contains_key(&name(path))) {
            fs::remove_file(path).expect("removed");
        }
        for (name, bytes) in wanted {
            fs::write(folder.join(name), bytes).expect("written");
        }
        return;
    }
    let mut wrong: Vec<String> = there
        .iter()
        .filter(|path| !wanted.contains_key(&name(path)))
        .map(|path| format!("{} is left over", path.display()))
        .collect();
    for (name, bytes) in wanted {
        let path = folder.join(name);
        match fs::read(&path) {
            Ok(found) if found == *bytes => {}
            Ok(_) => wrong.push(format!("{} is stale", path.display())),
            Err(error) => wrong.push(format!("{}: {error}", path.display())),
        }
    }
    assert!(wrong.is_empty(), "{}\nUPDATE_GENERATED=1 cargo test --test generated", wrong.join("\n"));
}

#[test]
fn the_command_line_is_sound() {
    program().debug_assert();
}

#[test]
fn completions_are_up_to_date() {
    check("completions", &completions());
}

#[test]
fn man_pages_are_up_to_date() {
    let pages = man();
    for page in ["cangauge.1", "cangauge-log.1", "cangauge-sdo-read.1", "cangauge-nmt-reset-comm.1"] {
        assert!(pages.contains_key(page), "{page}: {:?}", pages.keys());
    }
    for (name, page) in &pages {
        assert!(page.is_ascii(), "{name} is for any terminal");
    }
    check("man", &pages);
}
