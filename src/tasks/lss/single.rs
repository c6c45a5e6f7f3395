//! The services one by one: inquire, activate, store.

use super::only::agreed;
use super::session::{prepared, put_back};
use super::subject::{Knowledge, Subject, subject};
use super::ways::way;
use super::{Target, Tell, Via};
use crate::canopen::id::NodeId;
use crate::canopen::lss::{LssAddress, Mode};
use crate::device::catalog::Model;
use crate::master::{Lss, LssError, Master};
use crate::node::Overrides;
use crate::tasks::{Failure, Kind};
use std::sync::Arc;

/// What a slave says of itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Inquired {
    /// Its identity; `None` where it does not know the question.
    pub address: Option<LssAddress>,
    /// Its node-ID; `Some(None)` of one that has none, `None` where it does not know the question.
    pub node: Option<Option<NodeId>>,
}

/// What the user says of descriptions: for nodes, and for whichever device is meant.
pub type Named<'a> = (&'a Overrides, Option<&'a Arc<Model>>);

fn find(
    master: &mut Master<'_>,
    target: &Target,
    (overrides, given): Named<'_>,
    force: bool,
    tell: Tell<'_>,
) -> Result<Subject, Failure> {
    subject(master, target, &Knowledge { overrides, given }, (Via::Lss, force), tell)
}

/// Asks a slave for its identity and node-ID by LSS.
///
/// # Errors
/// As of [`super::assign`]; a slave that knows neither question.
pub fn inquire(
    master: &mut Master<'_>,
    target: &Target,
    named: Named<'_>,
    tell: Tell<'_>,
) -> Result<Inquired, Failure> {
    let subject = find(master, target, named, false, tell)?;
    let way = way(&subject, Via::Lss, true, tell)?;
    let session = prepared(master, &subject, &way, tell, |lss| {
        let failed = |error| subject.lss_failure(error);
        let address = unless_silent(lss.inquire_address()).map_err(failed)?;
        let node = unless_silent(lss.inquire_node_id()).map_err(failed)?;
        let node = node.and_then(|told| told.answers.first().copied());
        Ok(Inquired { address, node })
    })?;
    put_back(master, session.before, tell);
    let told = session.done;
    if told.address.is_none() && told.node.is_none() {
        let message = "it does not know the LSS inquiries (5Ah to 5Eh)";
        return Err(subject.failure(Kind::NoAnswer, message).hint("its identity by SDO: cangauge scan"));
    }
    Ok(told)
}

fn unless_silent<T>(result: Result<T, LssError>) -> Result<Option<T>, LssError> {
    match result {
        Ok(told) => Ok(Some(told)),
        Err(LssError::NoAnswer { .. }) => Ok(None),
        Err(error) => Err(error),
    }
}

/// Makes the bit rate that is configured and the node-ID that is configured last.
///
/// # Errors
/// As of [`super::assign`].
pub fn store(
    master: &mut Master<'_>,
    target: &Target,
    named: Named<'_>,
    force: bool,
    tell: Tell<'_>,
) -> Result<(), Failure> {
    service(master, target, named, force, tell, |lss| agreed(lss.store(), force))
}

/// Brings the configured bit rate into force, after `delay` and as long again of silence. `None` is everybody: each
/// that has one configured takes it.
///
/// # Errors
/// As of [`super::assign`]; nobody answers it.
pub fn activate(
    master: &mut Master<'_>,
    target: Option<&Target>,
    delay_ms: u16,
    named: Named<'_>,
    force: bool,
    tell: Tell<'_>,
) -> Result<(), Failure> {
    match target {
        Some(target) => service(master, target, named, force, tell, |lss| lss.activate(delay_ms)),
        None => {
            let mut lss = master.lss();
            let sent = lss.switch_global(Mode::Configuration).and_then(|()| lss.activate(delay_ms));
            let left = lss.leave();
            sent?;
            Ok(left?)
        }
    }
}

fn service(
    master: &mut Master<'_>,
    target: &Target,
    named: Named<'_>,
    force: bool,
    tell: Tell<'_>,
    mut work: impl FnMut(&mut Lss<'_, '_>) -> Result<(), LssError>,
) -> Result<(), Failure> {
    let subject = find(master, target, named, force, tell)?;
    let way = way(&subject, Via::Lss, true, tell)?;
    let session = prepared(master, &subject, &way, tell, |lss| work(lss).map_err(|error| subject.lss_failure(error)))?;
    put_back(master, session.before, tell);
    Ok(())
}
