//! `cangauge sdo`.

use super::args::ObjectArg;
use super::exit::{FileError, IntoFailure, stdout};
use super::file::OutFile;
use super::{Format, Global, open};
use crate::bus::claim::Claim;
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::{DataType, Value, parse_hex};
use crate::master::Master;
use crate::master::transfer::BlockMode;
use crate::output::progress::Transfer;
use crate::output::{csv, json, text};
use crate::tasks::sdo::{Knowledge, Options, ReadValue, SizeMode, encode, is_signature, read, write};
use crate::tasks::{Failure, Kind};
use clap::{Args, Subcommand, ValueEnum};
use std::fs::File;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// Read and write objects of the object dictionary
///
/// OBJECT is 0x6130:1, 6130:1, 6130h:1 or 6130.1 (the index is always hexadecimal, the sub-index
/// decimal), or a name: vendor-id, producer-heartbeat-time, ai-input-pv:1.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  cangauge -b sim sdo read 1 0x1018:1\n  cangauge -b sim sdo read 1 vendor-id serial-number\n  cangauge -b sim sdo write 1 producer-heartbeat-time 1000 --verify"
)]
pub(crate) struct Sdo {
    #[command(subcommand)]
    action: Action,
}

#[derive(Debug, Subcommand)]
#[command(defer = true)]
enum Action {
    /// Read objects: the value as it is, never scaled; several print "OBJECT VALUE" lines
    Read(ReadArgs),
    /// Write an object, or several OBJECT=VALUE
    Write(WriteArgs),
}

#[derive(Debug, Args)]
struct ReadArgs {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// Which objects
    #[arg(required = true)]
    objects: Vec<ObjectArg>,
    /// Take the bytes for this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex
    #[arg(long = "type", value_name = "TYPE")]
    data_type: Option<DataType>,
    /// Print the bytes in wire order
    #[arg(long)]
    hex: bool,
    /// Write the bytes to a file; - for stdout
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long, requires = "output")]
    force: bool,
    /// Whether to use block transfer: auto where it pays and the device offers it
    #[arg(long, value_name = "HOW", default_value = "auto")]
    block: Block,
}

#[derive(Debug, Args)]
struct WriteArgs {
    /// Which node: 5, 0x7f
    node: NodeId,
    /// OBJECT VALUE, or several OBJECT=VALUE: decimal, 0x1F, -5, 1.25e3, or text
    #[arg(required = true, allow_negative_numbers = true, value_name = "OBJECT VALUE")]
    items: Vec<String>,
    /// Take the value for this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex
    #[arg(long = "type", value_name = "TYPE")]
    data_type: Option<DataType>,
    /// Whether the write says how many bytes it carries: auto asks the description, and tries the other
    /// way where the device takes it amiss
    #[arg(long, value_name = "HOW", default_value = "auto")]
    sdo_size: SdoSize,
    /// Read back and compare
    #[arg(long)]
    verify: bool,
    /// Take the bytes from a file; - for stdin
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// Whether to use block transfer: auto where it pays and the device offers it
    #[arg(long, value_name = "HOW", default_value = "auto")]
    block: Block,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Block {
    /// For everything
    Always,
    /// For nothing
    Never,
    /// Where it pays
    Auto,
}

impl From<Block> for BlockMode {
    fn from(block: Block) -> BlockMode {
        match block {
            Block::Always => BlockMode::Always,
            Block::Never => BlockMode::Never,
            Block::Auto => BlockMode::Auto,
        }
    }
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum SdoSize {
    /// 2Fh, 2Bh, 27h, 23h
    Indicated,
    /// 22h
    Omit,
    /// As the device wants it
    Auto,
}

impl From<SdoSize> for SizeMode {
    fn from(size: SdoSize) -> SizeMode {
        match size {
            SdoSize::Indicated => SizeMode::Indicated,
            SdoSize::Omit => SizeMode::Omitted,
            SdoSize::Auto => SizeMode::Auto,
        }
    }
}

impl Sdo {
    /// What it does not share with another cangauge.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Action::Read(ReadArgs { node, .. }) | Action::Write(WriteArgs { node, .. }) => Claim::Nodes(vec![*node]),
        }
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::Read(args) => args.run(global),
            Action::Write(args) => args.run(global),
        }
    }
}

fn resolve(knowledge: &mut Knowledge, master: &mut Master<'_>, object: &ObjectArg) -> Result<ObjectId, Failure> {
    match object {
        ObjectArg::Address(object) => Ok(*object),
        ObjectArg::Name(name) => knowledge.resolve(master, name),
    }
}

fn hex(bytes: &[u8]) -> String {
    bytes.iter().fold("0x".to_owned(), |text, byte| text + &format!("{byte:02X}"))
}

impl ReadArgs {
    fn run(&self, global: &Global) -> anyhow::Result<()> {
        if self.output.is_some() && self.objects.len() > 1 {
            return Err(Failure::new(Kind::Usage, "--output takes one object").into());
        }
        let overrides = open::overrides(global, &[self.node])?;
        let mut knowledge = Knowledge::new(self.node, &overrides);
        let to_stdout = self.output.as_deref() == Some(Path::new("-"));
        let path = self.output.as_deref().filter(|_| !to_stdout);
        let mut file = path.map(|path| OutFile::create(path, self.force)).transpose()?;
        let bar = Transfer::new(global.shows_progress());
        let mut progress = |moved| bar.moved(moved);
        let mut options = Options { blocks: self.block.into(), size: SizeMode::Auto, progress: &mut progress };
        // Many values are one system call, and not one each.
        let mut out = io::BufWriter::with_capacity(1 << 16, io::stdout());
        let result = global.with_master(|master| {
            master.listen_to(&[self.node]).or_fail()?;
            for object in &self.objects {
                let at = resolve(&mut knowledge, master, object)?;
                let value = read(master, &mut knowledge, at, self.data_type, &mut options)?;
                bar.finish();
                if let Some(note) = value.note {
                    global.console().warn(&format!("node {}: {at}: {note}", self.node));
                }
                match &mut file {
                    Some(file) => file.write(&value.raw)?,
                    None if to_stdout => out.write_all(&value.raw).map_err(stdout)?,
                    None => self.print(&mut out, &value, object, global.format).map_err(stdout)?,
                }
            }
            Ok(())
        });
        // What was read before a failure is said before it.
        let flushed = out.flush().map_err(stdout);
        result.and(flushed)
    }

    fn print(&self, out: &mut dyn Write, value: &ReadValue, object: &ObjectArg, format: Format) -> io::Result<()> {
        let raw = hex(&value.raw);
        let shown = match &value.value {
            _ if self.hex => raw.clone(),
            Value::Text(text) => text::safe(text),
            Value::Bytes(_) => raw.clone(),
            value => value.to_string(),
        };
        match format {
            Format::Json => {
                let line = json::ObjectValue {
                    node: self.node.get(),
                    object: value.object.to_string(),
                    name: value.name.clone(),
                    data_type: value.data_type.map(|data_type| data_type.to_string()),
                    value: match &value.value {
                        Value::Bytes(_) => raw.clone().into(),
                        value => json::value(value),
                    },
                    raw: &raw,
                };
                json::object(out, &line)
            }
            Format::Csv => csv::write(out, &[], [vec![self.node.to_string(), value.object.to_string(), shown, raw]]),
            Format::Text if self.objects.len() == 1 => writeln!(out, "{shown}"),
            Format::Text => writeln!(out, "{object} {shown}"),
        }
    }
}

impl WriteArgs {
    /// The objects and values: `OBJECT VALUE`, or `OBJECT=VALUE` each.
    fn pairs(&self) -> Result<Vec<(ObjectArg, String)>, Failure> {
        let usage = |message: String| Failure::new(Kind::Usage, message);
        let parse = |text: &str| text.parse::<ObjectArg>().map_err(usage);
        match (self.items.as_slice(), &self.input) {
            ([object], Some(_)) => Ok(vec![(parse(object)?, String::new())]),
            (_, Some(_)) => Err(usage("--input takes one object and no value".to_owned())),
            ([object, value], None) if !object.contains('=') => Ok(vec![(parse(object)?, value.clone())]),
            (items, None) => items
                .iter()
                .map(|item| {
                    let (object, value) = item.split_once('=').ok_or_else(|| {
                        usage(format!("\"{item}\" has no value: give OBJECT VALUE, or OBJECT=VALUE for each"))
                    })?;
                    Ok((parse(object)?, value.to_owned()))
                })
                .collect(),
        }
    }

    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let pairs = self.pairs()?;
        let overrides = open::overrides(global, &[self.node])?;
        let mut knowledge = Knowledge::new(self.node, &overrides);
        let file = match &self.input {
            None => None,
            Some(path) => {
                let what = format!("read {}", path.display());
                let mut bytes = Vec::new();
                let result = if path == Path::new("-") {
                    io::stdin().read_to_end(&mut bytes)
                } else {
                    File::open(path).and_then(|mut file| file.read_to_end(&mut bytes))
                };
                result.map_err(|source| FileError { what, source })?;
                Some(bytes)
            }
        };
        // What can be known to be wrong is known before the bus is opened.
        for (object, value) in pairs.iter().filter(|_| file.is_none()) {
            let entry = match object {
                ObjectArg::Address(object) => knowledge.offline(*object),
                ObjectArg::Name(name) => knowledge.offline_name(name),
            };
            if let Some(data_type) = self.data_type.or(entry.map(|entry| entry.data_type)) {
                check(data_type, value).map_err(|error| Failure::new(Kind::Usage, format!("{object}: {error}")))?;
            }
        }
        global.with_master(|master| {
            master.listen_to(&[self.node]).or_fail()?;
            let mut ready = Vec::new();
            for (object, value) in &pairs {
                let at = resolve(&mut knowledge, master, object)?;
                ready.push(match &file {
                    Some(bytes) => (at, bytes.clone(), DataType::Domain),
                    None => {
                        let (bytes, data_type) = encode(master, &mut knowledge, at, self.data_type, value)?;
                        (at, bytes, data_type)
                    }
                });
            }
            let bar = Transfer::new(global.shows_progress());
            let mut progress = |moved| bar.moved(moved);
            let mut options =
                Options { blocks: self.block.into(), size: self.sdo_size.into(), progress: &mut progress };
            for (at, bytes, data_type) in ready {
                write(master, &knowledge, at, &bytes, &mut options)?;
                if self.verify {
                    self.verify(global, master, &mut knowledge, (at, &bytes, data_type), &mut options)?;
                }
                bar.finish();
                global.console().detail(&format!("node {}: {at} written: {}", self.node, hex(&bytes)));
            }
            Ok(())
        })
    }

    fn verify(
        &self,
        global: &Global,
        master: &mut Master<'_>,
        knowledge: &mut Knowledge,
        (at, bytes, data_type): (ObjectId, &[u8], DataType),
        options: &mut Options<'_>,
    ) -> anyhow::Result<()> {
        if is_signature(bytes) {
            let message =
                format!("node {}: {at} acknowledged the signature; what it reads is something else", self.node);
            global.console().note(&message);
            return Ok(());
        }
        let found = read(master, knowledge, at, Some(data_type), options)?;
        if found.raw != bytes {
            let message = format!("{at} was acknowledged and reads {} instead of {}", hex(&found.raw), hex(bytes));
            return Err(Failure::of_node(Kind::Unexpected, self.node, message).into());
        }
        Ok(())
    }
}

fn check(data_type: DataType, text: &str) -> Result<(), String> {
    if data_type == DataType::Domain && parse_hex(text).is_none() {
        return Err(format!("\"{text}\" is not hexadecimal"));
    }
    data_type.encode_text(text).map(drop).map_err(|error| error.to_string())
}
