//! The rules for a program that was killed and could restore nothing.

use super::*;
use crate::run::run;
use cangauge::tasks::Failure;

/// A device has its old node-ID and bit rate or the new ones, and the same command completes the work.
pub(super) fn killed(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let Some(killed) = &run.killed else { return };
    if let Command::Assign { id, rate, .. } = &spec.command
        && !spec.falsifies_data()
    {
        let wanted = id.or(rate.is_none().then_some(9));
        for (place, (before, after)) in killed.before.iter().zip(&killed.after).enumerate() {
            let (old, new) = (before.stored, after.stored);
            let node = new.0 == old.0 || new.0 == wanted;
            let bit_rate = new.1 == old.1 || rate.is_some() && new.1 == *rate;
            if !node || !bit_rate {
                violations
                    .push(("old or new settings after a kill", format!("device {place}: {old:?} became {new:?}")));
            }
        }
    }
    // A device that has its new node-ID or bit rate is no longer found by the same command.
    let moves = matches!(spec.command, Command::Assign { .. } | Command::LssActivate { .. } | Command::Detect { .. });
    let whole = Spec { kill: None, ..spec.clone() };
    if moves || !whole.is_clean() {
        return;
    }
    // A transfer that was still running may disturb the second program, which then must not report success. A slave
    // left in configuration state does not answer once; a server in a block transfer is silent until its time-out.
    let again_ms = spec.kill.map_or(0, |kill| kill.again_ms);
    let moves_data = matches!(spec.command, Command::SdoRead { .. } | Command::SdoWrite { .. });
    let at_once = spec.command.is_lss() && (again_ms < 100 || spec.retries == 0) || moves_data && again_ms < 2000;
    // Whether frames arrive while the program listens does not depend on the program.
    let listens = matches!(spec.command, Command::PdoWatch { .. } | Command::Log { .. } | Command::Check { .. });
    let may_fail = |failure: &Failure| at_once || listens && failure.kind() == Kind::NoAnswer;
    if let Err(failure) = &run.result
        && !may_fail(failure)
        && self::run(&whole).result.is_ok()
    {
        violations.push(("completes after a kill", format!("{:?}: {failure}", failure.kind())));
    }
}
