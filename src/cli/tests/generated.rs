//! `completions/` and `man/` are generated from the command line and from `src/cli/man/`.
//!
//! `UPDATE_GENERATED=1 cargo test --bin cangauge generated` rewrites them.

use crate::cli::completions::script;
use crate::cli::program;
use cangauge::device::description;
use cangauge::sim::Bench;
use cangauge::tasks::conform::{Area, cases};
use clap::Command;
use clap_complete::Shell;
use clap_mangen::Man;
use std::collections::BTreeMap;
use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The date in the manual pages. Change it with the release.
const DATE: &str = "2026-11-28";

/// Hand-written pages, and sections that are added to a generated page of the same name. `@DATE@` and `@VERSION@` are
/// replaced.
const HAND_WRITTEN: &str = "src/cli/man";

/// The files of a folder by name.
type Files = BTreeMap<String, Vec<u8>>;

fn completions() -> Files {
    let names = [(Shell::Bash, "cangauge.bash"), (Shell::Zsh, "_cangauge"), (Shell::Fish, "cangauge.fish")];
    names.into_iter().map(|(shell, name)| (name.to_owned(), script(shell))).collect()
}

fn man() -> Files {
    let mut root = program().disable_help_subcommand(true);
    root.build();
    let mut pages = Files::new();
    let mut hand_written = hand_written();
    hand_written.entry("cangauge-conform.1".to_owned()).or_default().insert_str(0, &conform_cases());
    let mut waiting = vec![root];
    while let Some(command) = waiting.pop() {
        waiting.extend(command.get_subcommands().filter(|command| !command.is_hide_set()).cloned());
        let name = Man::new(command.clone()).get_filename();
        let page = page(command, hand_written.remove(&name).as_ref()).expect("memory");
        pages.insert(name, page);
    }
    // The other hand-written texts are complete pages.
    pages.extend(hand_written.into_iter().map(|(name, text)| (name, text.into_bytes())));
    pages
}

fn version() -> String {
    format!("cangauge {}", env!("CARGO_PKG_VERSION"))
}

/// The hand-written pages and sections by file name.
fn hand_written() -> BTreeMap<String, String> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join(HAND_WRITTEN);
    let entries = fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").path());
    entries
        .map(|path| {
            let name = path.file_name().expect("a name").to_string_lossy().into_owned();
            let text = fs::read_to_string(&path).expect("a text");
            (name, text.replace("@DATE@", DATE).replace("@VERSION@", &version()))
        })
        .collect()
}

/// The section with all cases of `conform`, from the table that runs them.
fn conform_cases() -> String {
    let mut section = String::from(
        ".SH CASES\nEach case states the consequence of a deviation and its severity (high, medium, low).\n",
    );
    for area in Area::ALL {
        section += &format!(".SS \"{} ({})\"\n", escape(area.title()), escape(area.name()));
        for case in cases().filter(|case| case.area == area) {
            let needs = case.needs.name().map(|needs| format!(" Needs: {needs}.")).unwrap_or_default();
            let severity = case.severity.name();
            let deviation = match case.meaning {
                "" => String::new(),
                meaning => format!("\n.br\nIf it deviates (severity {severity}): {meaning}"),
            };
            let text = format!("{}. {}.{needs}{deviation}", case.sentence, case.clause);
            section += &format!(".TP\n\\fB{}\\fR\n{}\n", escape(case.id), escape(&text));
        }
    }
    section
}

/// Escapes a text for roff.
fn escape(text: &str) -> String {
    text.replace('\\', "\\e").replace('-', "\\-")
}

/// The page of a command. It differs from `Man::render`: the synopsis is short, the text after the options keeps its
/// lines, each of its paragraphs begins with `Heading:`, hand-written sections follow, and the last section lists
/// related pages.
fn page(command: Command, hand_written: Option<&String>) -> io::Result<Vec<u8>> {
    let notes = command.get_after_help().map(ToString::to_string).unwrap_or_default();
    let has_subcommands = command.has_subcommands();
    let (synopsis, see_also) = (synopsis(&command), see_also(&command));
    let title = command.get_display_name().unwrap_or(command.get_name()).to_uppercase();
    let man = Man::new(command).title(title).date(DATE).source(version()).manual("cangauge");
    let mut page = Vec::new();
    man.render_title(&mut page)?;
    man.render_name_section(&mut page)?;
    page.extend(synopsis.as_bytes());
    man.render_description_section(&mut page)?;
    man.render_options_section(&mut page)?;
    if has_subcommands {
        man.render_subcommands_section(&mut page)?;
    }
    for paragraph in notes.split("\n\n").filter(|paragraph| !paragraph.is_empty()) {
        let (heading, _) = paragraph.split_once(':').expect("a heading");
        assert!(!heading.contains(['.', ',', '(', '\n']), "no heading, or a heading with a text: {heading}");
        let text = paragraph.strip_prefix(heading).and_then(|text| text.strip_prefix(":\n")).unwrap_or(paragraph);
        writeln!(page, ".SH \"{}\"\n.nf", heading.to_uppercase())?;
        for line in text.lines() {
            // Commands may be longer: they cannot be broken.
            assert!(line.len() <= 80 || line.starts_with("  cangauge "), "a line of more than 80 characters: {line}");
            // A point or an apostrophe at the start of a line would be a macro.
            let guard = if line.starts_with(['.', '\'']) { "\\&" } else { "" };
            writeln!(page, "{guard}{}", escape(line))?;
        }
        writeln!(page, ".fi")?;
    }
    page.extend(hand_written.map(String::as_bytes).unwrap_or_default());
    page.extend(see_also.as_bytes());
    // Each section starts with the definition of the apostrophe: once is enough.
    let text = String::from_utf8_lossy(&page);
    let preamble: String = text.split_inclusive('\n').take(2).collect();
    let body = text.replace(&preamble, "").replace(".br\n\n.br\n", ".sp\n");
    let body: Vec<&str> = body.lines().map(str::trim_end).collect();
    Ok((preamble + &body.join("\n") + "\n").into_bytes())
}

/// The usage line of the help, with the names of the arguments in italics.
fn synopsis(command: &Command) -> String {
    let usage = command.clone().render_usage().to_string();
    let mut text = String::from(".SH SYNOPSIS\n.nf\n");
    for line in usage.trim_start_matches("Usage: ").lines().map(str::trim).filter(|line| !line.is_empty()) {
        let name = line.find(" [").into_iter().chain(line.find(" <")).min().unwrap_or(line.len());
        let (name, arguments) = line.split_at(name);
        let arguments = escape(arguments).replace('<', "\\fI").replace('>', "\\fR");
        text.push_str(&format!("\\fB{}\\fR{arguments}\n", escape(name)));
    }
    text + ".fi\n"
}

/// References to the pages of the subcommands, of the parent commands and of the formats.
fn see_also(command: &Command) -> String {
    let page = command.get_display_name().unwrap_or(command.get_name());
    let mut pages: Vec<(String, u8)> = command
        .get_subcommands()
        .filter(|sub| !sub.is_hide_set())
        .map(|sub| (format!("{page}-{}", sub.get_name()), 1))
        .collect();
    pages.extend(page.match_indices('-').map(|(at, _)| (page[..at].to_owned(), 1)));
    if ["cangauge", "cangauge-log", "cangauge-check"].contains(&page) {
        pages.push(("cangauge-recording".to_owned(), 5));
    }
    if ["cangauge", "cangauge-devices", "cangauge-objects"].contains(&page) {
        pages.push(("cangauge-device".to_owned(), 5));
    }
    if ["cangauge", "cangauge-sim"].contains(&page) {
        pages.push(("cangauge-bench".to_owned(), 5));
    }
    pages.push(("cangauge-concepts".to_owned(), 7));
    let lines: Vec<String> = pages.iter().map(|(name, section)| format!(".BR {} ({section})", escape(name))).collect();
    format!(".SH SEE ALSO\n{}\n", lines.join(",\n"))
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
    assert!(wrong.is_empty(), "{}\nUPDATE_GENERATED=1 cargo test --bin cangauge generated", wrong.join("\n"));
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

/// The error for an unknown key lists all keys that the parser knows.
#[test]
fn every_key_of_a_bench_file_has_an_entry_in_its_page() {
    let page = &hand_written()["cangauge-bench.5"];
    let device = "[[device]]\nkind = \"mh4\"\nnode = 5\n";
    let channel = format!("{device}[[device.channel]]\nchannel = 1\n");
    let overload = format!("{device}[[device.overload]]\nchannel = 1\nfrom = \"1s\"\ndirection = \"low\"\n");
    for table in ["", device, &format!("{device}[device.lss]\n"), &channel, &overload] {
        let error = Bench::from_toml(&format!("{table}unknown = 1\n"), Path::new("")).err().expect(table).to_string();
        let names: Vec<&str> = error.split('`').skip(3).step_by(2).collect();
        assert!(names.len() > 3, "{error}");
        for name in names {
            let entry = format!("\\fB{name}\\fR");
            assert!(
                page.contains(&entry)
                    || page.contains(&format!("\\fB[[device.{name}]]\\fR"))
                    || page.contains(&format!("\\fB[[{name}]]\\fR")),
                "{name} is not in cangauge-bench.5"
            );
        }
    }
}

#[test]
fn the_example_of_the_bench_page_is_a_bench() {
    let page = &hand_written()["cangauge-bench.5"];
    let example = page.split(".EX\n").nth(1).and_then(|rest| rest.split(".EE").next()).expect("an example");
    if let Err(error) = Bench::from_toml(&example.replace("\\-", "-"), Path::new("")) {
        panic!("{error}");
    }
}

/// The mistake about an unknown key lists all keys that the parser knows.
#[test]
fn every_key_of_a_description_has_an_entry_in_its_page() {
    let page = &hand_written()["cangauge-device.5"];
    for table in [
        "",
        "[identify]",
        "[factory]",
        "[sdo]",
        "[pdo]",
        "[startup]",
        "[[assign]]",
        "[[autozero]]",
        "[[signal]]",
        "[[object]]",
        "[[emcy]]",
        "[[deviation]]",
    ] {
        let mistakes = description::read(&format!("{table}\nno_such_key = 1\n")).expect_err("an unknown key");
        let mistake = mistakes.iter().find(|mistake| mistake.message.contains("no_such_key")).expect(table);
        let known = mistake.message.split_once("known: ").and_then(|(_, known)| known.strip_suffix(')')).expect("keys");
        let section = if table.is_empty() { ".SH THE FILE\n".to_owned() } else { format!(".SS {table}\n") };
        let text = page.split(&section).nth(1).unwrap_or_else(|| panic!("no section {table}"));
        let text = if table.is_empty() { text } else { text.split("\n.SS").next().unwrap_or_default() };
        for key in known.split(", ") {
            let entry = text.contains(&format!("\\fB{key}\\fR"));
            assert!(entry || text.contains(&format!("[{key}]")), "{key} of {table} is not in cangauge-device.5");
        }
    }
}

#[test]
fn the_example_of_the_description_page_is_a_description() {
    let page = &hand_written()["cangauge-device.5"];
    let example = page.split(".SH EXAMPLE").nth(1).and_then(|rest| rest.split(".EX\n").nth(1)).expect("an example");
    let example = example.split(".EE").next().unwrap_or_default().replace("\\-", "-");
    let (result, notes) = description::read_with_notes(&example);
    assert!(result.is_ok() && notes.is_empty(), "{:?} {notes:?}", result.err());
}
