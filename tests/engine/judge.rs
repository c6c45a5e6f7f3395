//! What must always hold, whatever went wrong.

mod addressed;
mod causes;
mod checks;
mod claims;
mod frames;
mod kept;
mod killed;
mod put_back;
mod rows;
mod silence;
mod watched;

use addressed::{is_meant, named, others_unchanged};
use causes::kinds;
use checks::checks;
use claims::{claims, last_writes};
use frames::frames;
use kept::after_power;
use killed::killed;
use put_back::put_back;
use rows::{rows, signatures};
use silence::told_causes;
use watched::watched;

use crate::bench::{Holds, holds};
use crate::carry_out::{Said, hex};
use crate::command::{Command, Measuring, Target};
use crate::run::Run;
use crate::spec::{Act, Fault, Spec, Vagary};
use crate::station::Unruly;
use crate::tap::Passed;
use cangauge::bus::Mono;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::sim::State;
use cangauge::tasks::Kind;
use cangauge::tasks::pdo::Settings;
use cangauge::tasks::sdo::is_signature;
use cangauge::tasks::store::Group;
use std::collections::{BTreeMap, BTreeSet};

/// A rule that was broken, and how.
pub(crate) type Broken = (&'static str, String);

pub(crate) fn judge(spec: &Spec, run: &mut Run) -> Vec<Broken> {
    let mut broken = Vec::new();
    ends(run, &mut broken);
    frames(spec, run.sent_by_killed(), &mut broken);
    frames(spec, run.bus.all_sent().into_iter(), &mut broken);
    let after: Vec<Holds> = run.bus.bus.inner().stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect();
    others_unchanged(spec, run, &after, &mut broken);
    put_back(spec, run, &after, &mut broken);
    kinds(spec, run, &mut broken);
    told_causes(spec, run, &mut broken);
    rows(spec, run, &mut broken);
    watched(spec, run, &mut broken);
    checks(spec, run, &mut broken);
    signatures(spec, run, &mut broken);
    killed(spec, run, &mut broken);
    if let Ok(said) = run.result.clone() {
        claims(spec, run, &said, &after, &mut broken);
        last_writes(spec, run, &mut broken);
    }
    after_power(spec, run, &mut broken);
    broken
}

fn ends(run: &Run, broken: &mut Vec<Broken>) {
    if run.bus.overran {
        broken.push(("ends in time", format!("not ended after {:?}", run.bound)));
    }
}

/// The group that a number stands for.
pub(crate) fn group(number: u8) -> Group {
    [Group::All, Group::Communication, Group::Application][usize::from(number % 3)]
}
