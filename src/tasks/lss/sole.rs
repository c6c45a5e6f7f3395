//! Finds the only device on the bus. First, all services that can show a second device are used.

use super::Notify;
use super::device::{Descriptions, LssDevice, Reach};
use super::event::{AnotherSlave, LssEvent, UnansweredService};
use super::failure::LssCause;
use super::node_id::{AnsweringDevices, answering_devices};
use super::nodes;
use super::session::in_configuration_state;
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, Part};
use crate::master::lss::{GatheredAnswers, Others};
use crate::master::{Lss, LssError, Master};
use crate::tasks::Failure;

/// The answers to requests to all slaves.
#[derive(Default)]
struct SlaveAnswers {
    address: Option<LssAddress>,
    /// The node-ID; `Some(None)` for a slave without a node-ID.
    node: Option<Option<NodeId>>,
    /// The evidence of more than one slave.
    another: Option<AnotherSlave>,
    /// Whether the slave does not answer the identify service (46h to 4Bh), so other slaves are not excluded.
    is_unproven: bool,
}

/// Finds the only device on the bus.
///
/// # Errors
/// [`LssCause::NotTheOnly`] unless `force`; [`LssCause::NoDevice`]; bus errors and Ctrl-C.
pub(super) fn only_device(
    master: &mut Master<'_>,
    descriptions: &Descriptions<'_>,
    force: bool,
    notify: Notify<'_>,
) -> Result<LssDevice, Failure> {
    let (mut device, mut another) = by_sdo(master)?;
    refuse(&device, another.as_ref(), force)?;
    let by_sdo = device.address;
    let answers =
        in_configuration_state(master, &device, |lss| ask_all(lss, by_sdo).map_err(|error| device.lss_failure(error)))?
            .result;
    another = another.or(answers.another);
    if let (Some(by_sdo), Some(by_lss)) = (by_sdo, answers.address)
        && by_sdo != by_lss
    {
        another.get_or_insert(AnotherSlave::Identities { by_sdo, by_lss });
    }
    refuse(&device, another.as_ref(), force)?;
    device.address = answers.address.or(by_sdo);
    device.is_unconfigured = answers.node == Some(None);
    device.is_alone &= another.is_none();
    let is_sole = another.is_none();
    if let Some(another) = another {
        notify(device.note(LssEvent::AllSlavesChange(another)));
    } else if device.node.is_none() {
        device.node = answers.node.flatten();
        device.is_alone = device.node.is_some();
    }
    if is_sole && device.address.is_none() && device.node.is_none() {
        return Err(device.failure(LssCause::NoDevice));
    }
    if is_sole && (answers.address.is_none() || answers.is_unproven) {
        let service = match answers.address {
            None => UnansweredService::Inquire,
            Some(_) => UnansweredService::Identify,
        };
        notify(device.note(LssEvent::CannotExcludeOthers(service)));
    }
    device.model = descriptions.model_of(master, &device)?;
    Ok(device)
}

/// Returns the only device found by SDO, and evidence of another device.
fn by_sdo(master: &mut Master<'_>) -> Result<(LssDevice, Option<AnotherSlave>), Failure> {
    let nodes = nodes::find_ids(master)?;
    let (node, mut another) = match nodes[..] {
        [] => (None, None),
        [node] => (Some(node), None),
        _ => (None, Some(AnotherSlave::Nodes(nodes))),
    };
    let mut address = None;
    if let Some(node) = node {
        match answering_devices(master, node)? {
            AnsweringDevices::Device(found) => address = Some(found),
            AnsweringDevices::Several(sign) => another = Some(AnotherSlave::SharedNodeId(node, sign)),
            AnsweringDevices::Unidentified | AnsweringDevices::None(_) => {}
        }
    }
    let is_alone = node.is_some() && another.is_none();
    Ok((LssDevice { address, node, is_unconfigured: false, is_alone, model: None, reach: Reach::Global }, another))
}

/// Sends requests to all slaves. `known` is the identity by SDO, for slaves that do not answer inquiries.
fn ask_all(lss: &mut Lss<'_, '_>, known: Option<LssAddress>) -> Result<SlaveAnswers, LssError> {
    let several = |another| Ok(SlaveAnswers { another: Some(another), ..SlaveAnswers::default() });
    let mut numbers = Vec::new();
    for part in Part::ALL {
        let Some(gathered) = unless_silent(lss.inquire(part))? else { break };
        match gathered.answers[..] {
            [number] if gathered.is_one() => numbers.push(number),
            [first, second, ..] => return several(AnotherSlave::Answers(first, second)),
            _ => return several(AnotherSlave::Collision),
        }
    }
    let address = <[u32; 4]>::try_from(numbers).ok().map(LssAddress::new);
    let mut answers = SlaveAnswers { address, ..SlaveAnswers::default() };
    // On the bus, equal answers merge and different answers collide. So the LSS service "identify" searches for slaves
    // with other numbers.
    if let Some(address) = address.or(known) {
        match lss.others(&address)? {
            Others::None => {}
            Others::Unproven => answers.is_unproven = true,
            Others::Within(_) => {
                answers.another = Some(AnotherSlave::OtherSerial(address.serial));
                return Ok(answers);
            }
        }
    }
    if address.is_some()
        && let Some(node) = unless_silent(lss.inquire_node_id())?
    {
        if !node.is_one() {
            answers.another = Some(AnotherSlave::NodeIds);
        }
        answers.node = node.answers.first().copied();
    }
    Ok(answers)
}

/// Returns `None` if no slave answers, because not every slave supports every service.
fn unless_silent<T>(gathered: Result<GatheredAnswers<T>, LssError>) -> Result<Option<GatheredAnswers<T>>, LssError> {
    match gathered {
        Ok(gathered) => Ok(Some(gathered)),
        Err(LssError::NoAnswer { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn refuse(device: &LssDevice, another: Option<&AnotherSlave>, force: bool) -> Result<(), Failure> {
    match another.filter(|_| !force) {
        Some(another) => Err(Failure { node: None, ..device.failure(LssCause::NotTheOnly(another.clone())) }),
        None => Ok(()),
    }
}
