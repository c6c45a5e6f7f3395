//! The only device on the bus: whatever can show that there is another is asked.

use super::presence::{Presence, presence};
use super::session::{Reach, configured};
use super::subject::{Knowledge, Subject, everybody};
use super::{Note, Tell};
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, Part};
use crate::master::lss::{Gathered, Others};
use crate::master::{Lss, LssError, Master};
use crate::tasks::{Failure, Kind};

/// What the slaves tell when all of them are asked at once.
#[derive(Default)]
struct Told {
    address: Option<LssAddress>,
    node: Option<Option<NodeId>>,
    /// What shows that there is more than one.
    another: Option<String>,
    /// The slave does not know the question whether there are others.
    unproven: bool,
}

/// The only device on the bus.
///
/// # Errors
/// [`Kind::CheckFailed`] where more than one shows itself, unless `force`; nobody.
pub(super) fn only(
    master: &mut Master<'_>,
    knowledge: &Knowledge<'_>,
    force: bool,
    tell: Tell<'_>,
) -> Result<Subject, Failure> {
    let nodes = everybody(master)?;
    let mut another = match nodes[..] {
        [] | [_] => None,
        _ => Some(format!("nodes {} are there", list(&nodes))),
    };
    let node = match nodes[..] {
        [node] => Some(node),
        _ => None,
    };
    let by_sdo = match node.map(|node| presence(master, node)).transpose()? {
        Some(Presence::One(address)) => Some(address),
        Some(Presence::Several(sign)) => {
            another.get_or_insert(format!("node {}: {sign}", list(&nodes)));
            None
        }
        Some(Presence::Nameless | Presence::Nobody(_)) | None => None,
    };
    let alone = node.is_some() && another.is_none();
    let mut subject = Subject { address: by_sdo, node, unconfigured: false, alone, model: None, reach: Reach::Global };
    refuse(&subject, another.as_deref(), force)?;
    let told = configured(master, &subject, |lss| {
        inquire(lss, by_sdo).map_err(|error| match error {
            LssError::Master(error) => error.into(),
            error => Failure::from(error),
        })
    })?
    .done;
    another = another.or(told.another);
    if let (Some(by_sdo), Some(by_lss)) = (by_sdo, told.address)
        && by_sdo != by_lss
    {
        another.get_or_insert(format!("{by_sdo} answers by SDO and {by_lss} by LSS"));
    }
    refuse(&subject, another.as_deref(), force)?;
    if let Some(another) = &another {
        tell(Note::Warning(format!("{another}: all of them will take it")));
    }
    subject.alone &= another.is_none();
    subject.address = told.address.or(by_sdo);
    subject.unconfigured = told.node == Some(None);
    if subject.node.is_none() && another.is_none() {
        subject.node = told.node.flatten();
        subject.alone = subject.node.is_some();
    }
    if subject.address.is_none() && subject.node.is_none() && another.is_none() {
        return Err(Failure::new(Kind::NoAnswer, "nobody answers, neither by SDO nor by LSS: nothing was changed")
            .hint("check power, wiring and bit rate: cangauge scan"));
    }
    if another.is_none() && (told.address.is_none() || told.unproven) {
        let what = if told.address.is_none() { "inquiries (5Ah to 5Dh)" } else { "question for others (46h to 4Bh)" };
        tell(Note::Warning(format!(
            "the device does not know the LSS {what}: that no other slave is there rests on what answers SDO, and a \
             device that is stopped or has no node-ID does not"
        )));
    }
    subject.model = knowledge.model(master, &subject)?;
    Ok(subject)
}

/// Asks everybody at once. `known` is the identity by SDO, for slaves that do not know the inquiries.
fn inquire(lss: &mut Lss<'_, '_>, known: Option<LssAddress>) -> Result<Told, LssError> {
    let several = |what: String| Some(format!("more than one LSS slave answers ({what})"));
    let mut numbers = Vec::new();
    for part in Part::ALL {
        let Some(told) = known_service(lss.inquire(part))? else { break };
        match told.answers[..] {
            [number] if told.is_one() => numbers.push(number),
            [first, second, ..] => {
                return Ok(Told { another: several(format!("{part:?} {first} and {second}")), ..Told::default() });
            }
            _ => return Ok(Told { another: several("their answers collide".to_owned()), ..Told::default() }),
        }
    }
    let address = <[u32; 4]>::try_from(numbers).ok().map(LssAddress::new);
    let mut told = Told { address, ..Told::default() };
    // What is the same merges on the wire, what differs collides: who else is there is asked for by its number.
    if let Some(address) = address.or(known) {
        match lss.others(&address)? {
            Others::None => {}
            Others::Unproven => told.unproven = true,
            Others::Within(_) => {
                told.another = several(format!("serial number {} and another", address.serial));
                return Ok(told);
            }
        }
    }
    if address.is_some()
        && let Some(node) = known_service(lss.inquire_node_id())?
    {
        if !node.is_one() {
            told.another = several("their node-IDs differ".to_owned());
        }
        told.node = node.answers.first().copied();
    }
    Ok(told)
}

/// Several slaves that all say yes are what `force` was asked for.
pub(super) fn agreed(result: Result<(), LssError>, force: bool) -> Result<(), LssError> {
    match result {
        Err(LssError::Several { frames, .. })
            if force && frames.iter().all(|frame| frame.data().get(1) == Some(&0)) =>
        {
            Ok(())
        }
        result => result,
    }
}

/// A question that not every slave knows.
pub(super) fn known_service<T>(told: Result<Gathered<T>, LssError>) -> Result<Option<Gathered<T>>, LssError> {
    match told {
        Ok(told) => Ok(Some(told)),
        Err(LssError::NoAnswer { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

fn refuse(subject: &Subject, another: Option<&str>, force: bool) -> Result<(), Failure> {
    let Some(another) = another.filter(|_| !force) else { return Ok(()) };
    let hint = match subject.node {
        Some(node) => format!("name the one you mean, by its node-ID ({node}) or its identity, or connect one alone"),
        None => "name the one you mean, by its node-ID or its identity: cangauge lss scan".to_owned(),
    };
    Err(Failure::new(Kind::CheckFailed, format!("{another}: nothing was changed")).hint(hint))
}

fn list(nodes: &[NodeId]) -> String {
    nodes.iter().map(NodeId::to_string).collect::<Vec<_>>().join(", ")
}
