//! `cangauge sdo`.

use super::args::ObjectArg;
use super::exit::{FileError, IntoFailure, open_stdout, stdout};
use super::file::OutFile;
use super::{Global, descriptions};
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::{DataType, parse_hex};
use cangauge::master::transfer::BlockMode;
use cangauge::master::{Master, TEXT_LIMIT};
use cangauge::node::write::is_signature;
use cangauge::node::{Form, Node, WriteOptions, Written, names};
use cangauge::output::failure::ErrorMessage;
use cangauge::output::notes;
use cangauge::output::progress::TransferProgress;
use cangauge::output::sdo::{ObjectValue, ValueForm};
use cangauge::output::text;
use cangauge::tasks::sdo::{FILE_LIMIT, ReadOptions, clipping, encode, find_form, read, write};
use cangauge::tasks::{Failure, Note};
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
    /// Read objects and print their unscaled values
    Read(ReadArgs),
    /// Write an object, or several OBJECT=VALUE
    Write(WriteArgs),
}

#[derive(Debug, Args)]
struct ReadArgs {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// Objects. For a single object, only the value is printed; for several objects, lines "OBJECT VALUE"
    #[arg(required = true)]
    objects: Vec<ObjectArg>,
    /// Decode the bytes as this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex
    #[arg(long = "type", value_name = "TYPE")]
    data_type: Option<DataType>,
    /// Print a hexadecimal number
    #[arg(long, conflicts_with = "bytes")]
    hex: bool,
    /// Print the bytes in wire order: 47 00 00 00
    #[arg(long)]
    bytes: bool,
    /// Write the bytes to a file; - for stdout
    #[arg(long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Overwrite the file
    #[arg(long, requires = "output")]
    force: bool,
    /// When to use block transfer; auto: for long objects, if the device supports it
    #[arg(long, value_name = "HOW", default_value = "auto")]
    block: Block,
}

#[derive(Debug, Args)]
struct WriteArgs {
    /// Node-ID: 5, 0x7f
    node: NodeId,
    /// OBJECT VALUE, or several OBJECT=VALUE: decimal, 0x1F, -5, 1.25e3, text, or a word (save, Pt100)
    #[arg(required = true, allow_negative_numbers = true, value_name = "OBJECT VALUE")]
    items: Vec<String>,
    /// Encode the value as this type: b, u8 to u64, i8 to i64, r32, r64, vs, os, us, t, td, d, hex
    #[arg(long = "type", value_name = "TYPE")]
    data_type: Option<DataType>,
    /// Whether the request contains the data size. With auto, if the device rejects one form, the other form is sent
    #[arg(long, value_name = "HOW", default_value = "auto")]
    sdo_size: SdoSize,
    /// Read back and compare
    #[arg(long)]
    verify: bool,
    /// Write the bytes of a file; - for stdin
    #[arg(long, value_name = "FILE")]
    input: Option<PathBuf>,
    /// When to use block transfer; auto: for long objects, if the device supports it
    #[arg(long, value_name = "HOW", default_value = "auto")]
    block: Block,
}

#[derive(Clone, Copy, Debug, ValueEnum)]
enum Block {
    /// For every object
    Always,
    /// Never
    Never,
    /// For long objects
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
    /// With the size: 2Fh, 2Bh, 27h, 23h
    Indicated,
    /// Without the size: 22h
    Omit,
    /// As in the description of the device
    Auto,
}

impl From<SdoSize> for Form {
    fn from(size: SdoSize) -> Form {
        match size {
            SdoSize::Indicated => Form::Indicated,
            SdoSize::Omit => Form::Omitted,
            SdoSize::Auto => Form::Auto,
        }
    }
}

impl Sdo {
    /// The nodes that no other cangauge may use at the same time.
    pub(super) fn claim(&self) -> Claim {
        match &self.action {
            Action::Read(ReadArgs { node, .. }) | Action::Write(WriteArgs { node, .. }) => Claim::Nodes(vec![*node]),
        }
    }

    /// Whether the command is `sdo read`.
    pub(super) fn only_reads(&self) -> bool {
        matches!(self.action, Action::Read(_))
    }

    pub(super) fn run(&self, global: &Global) -> anyhow::Result<()> {
        match &self.action {
            Action::Read(args) => args.run(global),
            Action::Write(args) => args.run(global),
        }
    }
}

fn resolve(node: &mut Node, master: &mut Master<'_>, object: &ObjectArg) -> Result<ObjectId, Failure> {
    match object {
        ObjectArg::Address(object) => Ok(*object),
        ObjectArg::Name(name) => Ok(names::resolve(master, node, name)?),
    }
}

impl ReadArgs {
    fn form(&self) -> ValueForm {
        match (self.hex, self.bytes) {
            (true, _) => ValueForm::Hexadecimal,
            (_, true) => ValueForm::Bytes,
            _ => ValueForm::Usual,
        }
    }

    fn run(&self, global: &Global) -> anyhow::Result<()> {
        if self.output.is_some() && self.objects.len() > 1 {
            return Err(ErrorMessage::usage("--output takes one object").into());
        }
        let mut node = Node::with_overrides(self.node, &descriptions::overrides(global, &[self.node])?);
        let to_stdout = self.output.as_deref() == Some(Path::new("-"));
        let path = self.output.as_deref().filter(|_| !to_stdout);
        let mut file = path.map(|path| OutFile::create(path, self.force)).transpose()?;
        let bar = TransferProgress::new(global.shows_progress());
        let mut values = Vec::new();
        let longest = if self.output.is_some() { FILE_LIMIT } else { TEXT_LIMIT };
        let result = global.with_master(|master| {
            master.listen_to(&[self.node]).or_fail()?;
            for object in &self.objects {
                let at = resolve(&mut node, master, object)?;
                descriptions::warn_about(global, node.model.as_ref(), at.index);
                let mut progress = |moved| bar.show_bytes(moved);
                let (blocks, is_exact) = (self.block.into(), self.output.is_some());
                let mut options = ReadOptions { blocks, longest, is_exact, progress: &mut progress };
                let read = read(master, &mut node, at, self.data_type, &mut options)?;
                bar.finish();
                if let Some(note) = read.note {
                    global.console().warn(&format!("node {}: {at}: {note}", self.node));
                }
                match &mut file {
                    Some(file) => file.write(&read.raw)?,
                    None if to_stdout => open_stdout()?.write_all(&read.raw).map_err(stdout)?,
                    None => {
                        let (typed, is_single) = (object.to_string(), self.objects.len() == 1);
                        values.push(ObjectValue { read, typed, is_single, form: self.form() });
                    }
                }
            }
            Ok(())
        });
        // Values that were read before a failure are also printed.
        let printed = global.print(&values);
        result.and(printed)
    }
}

impl WriteArgs {
    /// Parses the objects and values: `OBJECT VALUE`, or several `OBJECT=VALUE`.
    fn pairs(&self) -> Result<Vec<(ObjectArg, String)>, ErrorMessage> {
        let usage = |message: String| ErrorMessage::usage(message);
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

    /// Reads the bytes of the file or stream in `--input`.
    fn input(&self) -> Result<Option<Vec<u8>>, FileError> {
        let Some(path) = &self.input else { return Ok(None) };
        let what = format!("read {}", path.display());
        let mut bytes = Vec::new();
        let result = if path == Path::new("-") {
            io::stdin().read_to_end(&mut bytes)
        } else {
            File::open(path).and_then(|mut file| file.read_to_end(&mut bytes))
        };
        result.map_err(|source| FileError { what, source })?;
        Ok(Some(bytes))
    }

    /// Checks values whose type is known before the bus is opened.
    fn check_values(&self, node: &Node, pairs: &[(ObjectArg, String)]) -> Result<(), ErrorMessage> {
        for (object, value) in pairs {
            let entry = match object {
                ObjectArg::Address(object) => node.entry(*object),
                ObjectArg::Name(name) => node.entry_by_name(name),
            };
            if let Some(data_type) = self.data_type.or(entry.as_ref().map(|entry| entry.data_type)) {
                // The description of the device is still unknown here, and may define the word.
                let may_be_word = |object: ObjectId| {
                    let is_open = !node.is_identified && object.index >= 0x2000;
                    is_open && value.starts_with(char::is_alphabetic)
                        || names::word(node, object, data_type, value).is_some()
                };
                if entry.is_some_and(|entry| may_be_word(entry.object)) {
                    continue;
                }
                check(data_type, value).map_err(|error| ErrorMessage::usage(format!("{object}: {error}")))?;
            }
        }
        Ok(())
    }

    fn run(&self, global: &Global) -> anyhow::Result<()> {
        let pairs = self.pairs()?;
        let mut node = Node::with_overrides(self.node, &descriptions::overrides(global, &[self.node])?);
        let file = self.input()?;
        if file.is_none() {
            self.check_values(&node, &pairs)?;
        }
        global.with_master(|master| {
            master.listen_to(&[self.node]).or_fail()?;
            let mut encoded = Vec::new();
            for (object, value) in &pairs {
                let at = resolve(&mut node, master, object)?;
                encoded.push(match &file {
                    Some(bytes) => (at, bytes.clone(), DataType::Domain),
                    None => {
                        let (bytes, data_type) = encode(master, &mut node, at, self.data_type, value)?;
                        (at, bytes, data_type)
                    }
                });
            }
            let form = self.sdo_size.into();
            // The first SDO to a node is a read. An unfinished transfer of another master then does not disturb the
            // write.
            find_form(master, &mut node)?;
            let bar = TransferProgress::new(global.shows_progress());
            let (mut progress, mut watch) = (|moved| bar.show_bytes(moved), |_: &_| {});
            let mut options =
                WriteOptions { form, blocks: self.block.into(), ..WriteOptions::new(&mut progress, &mut watch) };
            for (at, bytes, data_type) in encoded {
                let is_verifiable = self.verify && !is_signature(&bytes);
                let verify = is_verifiable.then_some(data_type);
                if let Written::ReadBack(received) = write(master, &node, at, &bytes, verify, &mut options)? {
                    let received = received.map(|frame| format!("; received {frame}")).unwrap_or_default();
                    let message =
                        format!("node {}: no answer to {at}{received}; it was read back and has the value", self.node);
                    global.console().note(&message);
                }
                if self.verify && !is_verifiable {
                    let message =
                        format!("node {}: {at} acknowledged the signature, which cannot be read back", self.node);
                    global.console().note(&message);
                }
                bar.finish();
                let written = text::spaced_bytes(&bytes);
                global.console().detail(&format!("node {}: {at} written: {written}", self.node));
                let doubts = Note::out_of_range(&node, at, &bytes).into_iter().chain(clipping(master, &node, at));
                doubts.for_each(|note| notes::print(&global.console(), &note));
            }
            Ok(())
        })
    }
}

fn check(data_type: DataType, text: &str) -> Result<(), String> {
    if data_type == DataType::Domain && parse_hex(text).is_none() {
        return Err(format!("\"{text}\" is not hexadecimal"));
    }
    data_type.encode_text(text).map(drop).map_err(|error| error.to_string())
}
