//! The rules that must always hold, with any faults.

mod addressed;
mod causes;
mod checks;
mod claims;
mod deviation;
mod frames;
mod kept;
mod killed;
mod restored;
mod rows;
mod silence;
mod watched;

use addressed::{is_meant, named, others_unchanged};
use causes::kinds;
use checks::checks;
use claims::{claims, last_writes};
use deviation::deviation;
use frames::frames;
use kept::after_power;
use killed::killed;
use restored::restored;
use rows::{rows, signatures};
use silence::check_cause;
use watched::watched;

use crate::bench::{DeviceState, device_state};
use crate::carry_out::{Claim, hex};
use crate::command::{Command, Measuring, Target};
use crate::run::Run;
use crate::spec::{Act, DeviceFault, Fault, Spec};
use crate::station::FaultyDevice;
use crate::tap::Passed;
use cangauge::bus::Mono;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::node::write::is_signature;
use cangauge::sim::State;
use cangauge::tasks::Kind;
use cangauge::tasks::pdo::Settings;
use cangauge::tasks::store::Group;
use std::collections::{BTreeMap, BTreeSet};

/// A violated rule, and the details of the violation.
pub(crate) type Violation = (&'static str, String);

pub(crate) fn check_rules(spec: &Spec, run: &mut Run) -> Vec<Violation> {
    let mut violations = Vec::new();
    ends(run, &mut violations);
    frames(spec, run.sent_by_killed(), &mut violations);
    frames(spec, run.bus.all_sent().into_iter(), &mut violations);
    let after: Vec<DeviceState> =
        run.bus.bus.inner().inner().stations::<FaultyDevice>().map(|station| device_state(&station.device)).collect();
    others_unchanged(spec, run, &after, &mut violations);
    restored(spec, run, &after, &mut violations);
    kinds(spec, run, &mut violations);
    check_cause(spec, run, &mut violations);
    rows(spec, run, &mut violations);
    watched(spec, run, &mut violations);
    checks(spec, run, &mut violations);
    signatures(spec, run, &mut violations);
    killed(spec, run, &mut violations);
    deviation(spec, run, &mut violations);
    if let Ok(said) = run.result.clone() {
        claims(spec, run, &said, &after, &mut violations);
        last_writes(spec, run, &mut violations);
    }
    after_power(spec, run, &mut violations);
    violations
}

fn ends(run: &Run, violations: &mut Vec<Violation>) {
    if run.bus.overran {
        violations.push(("ends in time", format!("not ended after {:?}", run.bound)));
    }
}

/// The group of settings (1010h) with this number.
pub(crate) fn group(number: u8) -> Group {
    [Group::All, Group::Communication, Group::Application][usize::from(number % 3)]
}
