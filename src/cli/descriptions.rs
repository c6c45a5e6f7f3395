//! Reads the descriptions and EDS files named by the user, and checks that they are for the devices on the bus.

use super::Global;
use super::exit::{FileError, IntoFailure};
use super::file::read_input;
use cangauge::bus::claim::Claim;
use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::{DataType, Value};
use cangauge::device::catalog::{self, Model, TargetDevice};
use cangauge::device::eds;
use cangauge::master::{Master, OnTwoDevices};
use cangauge::node::Overrides;
use cangauge::node::read::read_values;
use cangauge::node::survey::revisions;
use cangauge::output::failure::ErrorMessage;
use std::collections::BTreeSet;
use std::fs::File;
use std::path::Path;
use std::sync::Arc;

/// A description or EDS that the user named.
#[derive(Clone, Debug)]
pub(crate) struct Named {
    /// The node of the description; `None` for every matching node.
    node: Option<NodeId>,
    is_eds: bool,
    model: Arc<Model>,
}

impl Named {
    fn is_for(&self, node: NodeId) -> bool {
        self.node.is_none_or(|own| own == node)
    }

    fn is_built_in(&self) -> bool {
        !self.is_eds && catalog::by_name(self.file()).is_some()
    }

    fn file(&self) -> &str {
        self.model.made_for.first().map_or("", |device| device.file.as_str())
    }
}

/// Each entry: the position of a file in the list, and a node that has a different device.
type Mismatches = BTreeSet<(usize, NodeId)>;

/// Reads the descriptions that the user named, for `nodes`. For a single node, [`check_pending`] compares the device
/// with the files when the bus is opened.
pub(super) fn overrides(global: &Global, nodes: &[NodeId]) -> anyhow::Result<Overrides> {
    let named = named(global)?;
    let overrides = combine(&named, nodes, &Mismatches::new());
    if nodes.len() == 1 && !named.is_empty() {
        global.pending.replace(Some((named, nodes.to_vec())));
    }
    Ok(overrides)
}

/// Reads the descriptions that the user named, and assigns them to the matching `nodes`.
///
/// # Errors
/// A file is not for the device of its node. A file without a node does not match any node.
pub(super) fn overrides_on(master: &mut Master<'_>, global: &Global, nodes: &[NodeId]) -> anyhow::Result<Overrides> {
    let named = named(global)?;
    let mismatches = mismatches(master, global, &named, nodes)?;
    Ok(combine(&named, nodes, &mismatches))
}

/// Compares the device with the files that were read before the bus was opened.
pub(super) fn check_pending(master: &mut Master<'_>, global: &Global) -> anyhow::Result<()> {
    match global.pending.take() {
        Some((named, nodes)) => mismatches(master, global, &named, &nodes).map(drop),
        None => Ok(()),
    }
}

/// Chooses one description for each node. A description for this node has priority over a description for all nodes. A
/// description has priority over an EDS.
fn combine(named: &[Named], nodes: &[NodeId], mismatches: &Mismatches) -> Overrides {
    let mut overrides = Overrides::new();
    for &node in nodes {
        let find = |is_eds: bool| {
            let fitting = named.iter().enumerate().filter(|(at, named)| {
                named.is_eds == is_eds && named.is_for(node) && !mismatches.contains(&(*at, node))
            });
            fitting.max_by_key(|(_, named)| named.node.is_some()).map(|(_, named)| &named.model)
        };
        let model = match (find(false), find(true)) {
            (Some(description), Some(eds)) => Some(Arc::new(description.with_eds(eds))),
            (description, eds) => description.or(eds).cloned(),
        };
        overrides.extend(model.map(|model| (node, model)));
    }
    overrides
}

/// Compares vendor and product in the files with 1018h of the devices. Returns the files that are not used, each with
/// its node.
fn mismatches(
    master: &mut Master<'_>,
    global: &Global,
    named: &[Named],
    nodes: &[NodeId],
) -> anyhow::Result<Mismatches> {
    let mut mismatches = Mismatches::new();
    let is_compared = |device: &TargetDevice| device.vendor.or(device.product).is_some();
    let can_ask = master.bus().is_live() && !matches!(global.claim, Claim::Nothing);
    if !can_ask || !named.iter().any(|named| named.model.made_for.iter().any(is_compared)) {
        return Ok(mismatches);
    }
    master.listen_to(nodes).or_fail()?;
    for (node, model) in combine(named, nodes, &mismatches) {
        master.set_quirks(node, &model.description.quirks);
    }
    let devices = revisions(master, nodes).or_fail()?;
    for (at, named) in named.iter().enumerate() {
        let Some(device) = named.model.made_for.first() else { continue };
        let own: Vec<_> = devices.iter().filter(|(node, _)| named.is_for(**node)).collect();
        let (fitting, others): (Vec<_>, Vec<_>) =
            own.into_iter().partition(|(_, [vendor, product, _])| device.fits(*vendor, *product));
        for (node, [.., revision]) in &fitting {
            if !device.has_revision(*revision) {
                let text = format!("node {node}: {} is for another revision of the device", named.file());
                global.console().note(&text);
            }
        }
        let Some((node, [vendor, product, _])) = others.first() else { continue };
        if !fitting.is_empty() && named.node.is_none() {
            mismatches.extend(others.iter().map(|(node, _)| (at, **node)));
            continue;
        }
        let message = mismatch(named.file(), **node, device, *vendor, *product);
        // No description exists for this vendor, so the user names the most similar description.
        let is_nearest = named.is_built_in()
            && !vendor.is_some_and(catalog::has_vendor)
            && named.model.has_standard_values()
            && has_profile_of(master, **node, &named.model)?;
        let writes = global.on_two_devices == OnTwoDevices::RefuseWrites;
        if !global.only_reads && (writes || !is_nearest) {
            let hint = "choose the file of this device, or add --accept-mismatch";
            return Err(ErrorMessage::usage(message).hint(hint).into());
        }
        global.console().warn(&message);
    }
    Ok(mismatches)
}

/// Whether the device and the description have the same profile (1000h). True if one of the profiles is unknown.
fn has_profile_of(master: &mut Master<'_>, node: NodeId, model: &Model) -> anyhow::Result<bool> {
    let object = ObjectId::DEVICE_TYPE;
    let described = model.dictionary.get(object).and_then(|entry| entry.default_bytes(node));
    let described = described.and_then(|bytes| DataType::Unsigned(4).decode(&bytes).ok());
    let found = read_values(master, &[(node, object, DataType::Unsigned(4))]).or_fail()?.pop().and_then(Result::ok);
    let profile = |value: Option<Value>| value?.as_u64().map(|number| number & 0xffff).filter(|&profile| profile != 0);
    Ok(profile(described).zip(profile(found)).is_none_or(|(described, found)| described == found))
}

fn mismatch(file: &str, node: NodeId, device: &TargetDevice, vendor: Option<u32>, product: Option<u32>) -> String {
    let code = |number: Option<u32>| number.map_or_else(|| "unknown".to_owned(), |number| format!("0x{number:X}"));
    format!(
        "node {node}: {file} is for another device: vendor {}, product {}; the device has vendor {}, product {}",
        code(device.vendor),
        code(device.product),
        code(vendor),
        code(product)
    )
}

/// Reads the files given by the options.
fn named(global: &Global) -> anyhow::Result<Vec<Named>> {
    let mut named: Vec<Named> = Vec::new();
    let devices = global.device.iter().map(|given| (given, false));
    for (given, is_eds) in devices.chain(global.eds.iter().map(|given| (given, true))) {
        if named.iter().any(|other| other.node == given.node && other.is_eds == is_eds) {
            let kind = if is_eds { "EDS files" } else { "device descriptions" };
            let whom = given.node.map_or_else(|| "the same nodes".to_owned(), |node| format!("node {node}"));
            let hint = "choose one, or one for each node: NODE=FILE";
            return Err(ErrorMessage::usage(format!("two {kind} for {whom}")).hint(hint).into());
        }
        named.push(Named { node: given.node, is_eds, model: model(&given.what, is_eds, global)? });
    }
    Ok(named)
}

/// The built-in description with this name, or the contents of a file.
pub(super) fn model(what: &str, is_eds: bool, global: &Global) -> anyhow::Result<Arc<Model>> {
    if !is_eds {
        if let Some(model) = catalog::by_name(what) {
            if !global.accept_mismatch && !model.description.unconfirmed {
                return Ok(model);
            }
            let mut model = Model::clone(&model);
            model.description.unconfirmed = false;
            if global.accept_mismatch {
                model.made_for.clear();
            }
            return Ok(Arc::new(model));
        }
        if !what.contains(['.', '/']) {
            return Err(unknown(what).into());
        }
    }
    let bytes = read_file(what)?;
    let extension = Path::new(what).extension().map(|extension| extension.to_ascii_lowercase());
    let mut model = if is_eds || extension.is_some_and(|extension| extension == "eds" || extension == "dcf") {
        Model::from_eds(&eds_of(what, &bytes, global)?)
    } else {
        Model::from_toml(&text(what, bytes)?).map_err(|error| ErrorMessage::usage(error.in_file(what)))?
    };
    model.made_for.iter_mut().for_each(|device| what.clone_into(&mut device.file));
    model.description.unconfirmed = false;
    if global.accept_mismatch {
        model.made_for.clear();
    }
    model.warnings.iter_mut().for_each(|(_, text)| *text = format!("{what}: {text}"));
    Ok(Arc::new(model))
}

/// Converts the bytes of a file to text.
///
/// # Errors
/// The text is not UTF-8; the error contains the line.
pub(super) fn text(name: &str, bytes: Vec<u8>) -> Result<String, ErrorMessage> {
    String::from_utf8(bytes).map_err(|error| {
        let good = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let line = good.iter().filter(|&&byte| byte == b'\n').count() + 1;
        ErrorMessage::usage(format!("{name}:{line}: not UTF-8 text"))
    })
}

/// Reads an EDS or DCF file, and prints its warnings.
pub(super) fn eds(name: &str, global: &Global) -> anyhow::Result<eds::Eds> {
    Ok(eds_of(name, &read_file(name)?, global)?)
}

/// The EDS or DCF file that the user named for a node, without printing its warnings.
///
/// # Errors
/// The file cannot be read, or is no EDS file.
pub(super) fn file_of(global: &Global, node: NodeId) -> anyhow::Result<Option<eds::Eds>> {
    let fitting = global.eds.iter().filter(|given| given.node.is_none_or(|of| of == node));
    let Some(given) = fitting.max_by_key(|given| given.node.is_some()) else { return Ok(None) };
    let name = &given.what;
    let eds = eds::read(&read_file(name)?).map_err(|error| ErrorMessage::usage(format!("{name}: {error}")))?;
    Ok(Some(eds))
}

fn eds_of(name: &str, bytes: &[u8], global: &Global) -> Result<eds::Eds, ErrorMessage> {
    let eds = eds::read(bytes).map_err(|error| ErrorMessage::usage(format!("{name}: {error}")))?;
    print_warnings(name, &eds.warnings, global);
    Ok(eds)
}

/// Returns the error for an unknown description.
pub(super) fn unknown(name: &str) -> ErrorMessage {
    let names: Vec<&str> = catalog::all().map(|model| model.description.name.as_str()).collect();
    let hint = format!("built-in devices: {}; or name a file", names.join(", "));
    ErrorMessage::usage(format!("no built-in device \"{name}\"")).hint(hint)
}

/// Reads the bytes of a file that the user named.
pub(super) fn read_file(name: &str) -> Result<Vec<u8>, FileError> {
    File::open(name).and_then(read_input).map_err(|source| FileError { what: format!("read {name}"), source })
}

/// Prints one line for all warnings; with `-v`, prints each warning.
fn print_warnings(file: &str, warnings: &[eds::Warning], global: &Global) {
    let console = global.console();
    match warnings {
        warnings if global.verbose > 0 => {
            warnings.iter().for_each(|warning| console.warn(&format!("{file}:{}: {}", warning.line, warning.text)));
        }
        [] => {}
        [warning] => console.warn(&format!("{file}:{}: {}", warning.line, warning.text)),
        warnings => console.warn(&format!("{file}: {} warnings (-v shows them)", warnings.len())),
    }
}

/// Prints the warnings of a DCF about its parameter values; with `-v` they were printed before.
pub(super) fn warn_about_values(file: &str, dcf: &eds::Eds, global: &Global) {
    let lines: BTreeSet<usize> = dcf.value_lines.values().copied().collect();
    // The warning about a repeated value has the line of the unused value, so it is recognised by its text.
    let is_about = |warning: &&eds::Warning| lines.contains(&warning.line) || warning.text.contains("ParameterValue");
    let about = dcf.warnings.iter().filter(|_| global.verbose == 0 && dcf.warnings.len() > 1).filter(is_about);
    about.for_each(|warning| global.console().warn(&format!("{file}:{}: {}", warning.line, warning.text)));
}

/// Prints the warnings of an EDS about one object; with `-v` they were printed before.
pub(super) fn warn_about(global: &Global, model: Option<&Arc<Model>>, index: u16) {
    let Some(model) = model.filter(|model| global.verbose == 0 && model.warnings.len() > 1) else { return };
    let about = model.warnings.iter().filter(|(of, _)| *of == index);
    about.for_each(|(_, text)| global.console().warn(text));
}
