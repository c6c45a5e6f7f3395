//! What holds even where the program vanished in the middle and could put nothing back.

use super::*;
use crate::run::run;
use cangauge::tasks::Failure;

/// A device holds the old node-ID and bit rate or the new ones, and the same command brings everything to its end.
pub(super) fn killed(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let Some(killed) = &run.killed else { return };
    if let Command::Assign { id, rate, .. } = &spec.command
        && !spec.lies()
    {
        let wanted = id.or(rate.is_none().then_some(9));
        for (place, (before, after)) in killed.before.iter().zip(&killed.after).enumerate() {
            let (old, new) = (before.stored, after.stored);
            let node = new.0 == old.0 || new.0 == wanted;
            let bit_rate = new.1 == old.1 || rate.is_some() && new.1 == *rate;
            if !node || !bit_rate {
                broken.push(("old or new after a kill", format!("device {place}: {old:?} became {new:?}")));
            }
        }
    }
    // Who was given another node-ID or bit rate is no longer where the same command looks for him.
    let moves = matches!(spec.command, Command::Assign { .. } | Command::LssActivate { .. } | Command::Detect { .. });
    let whole = Spec { kill: None, ..spec.clone() };
    if moves || !whole.is_clean() {
        return;
    }
    // Of what was still under way the next one may make what it likes, as long as it is no success. A slave that was
    // left in configuration state is silent once, and a server in the middle of blocks until it gives up.
    let again_ms = spec.kill.map_or(0, |kill| kill.again_ms);
    let moves_data = matches!(spec.command, Command::SdoRead { .. } | Command::SdoWrite { .. });
    let at_once = spec.command.is_lss() && (again_ms < 100 || spec.retries == 0) || moves_data && again_ms < 2000;
    // Whether anything comes while it is listened for is not the program's doing.
    let listens = matches!(spec.command, Command::PdoWatch { .. } | Command::Log { .. } | Command::Check { .. });
    let may_fail = |failure: &Failure| at_once || listens && failure.kind() == Kind::NoAnswer;
    if let Err(failure) = &run.result
        && !may_fail(failure)
        && self::run(&whole).result.is_ok()
    {
        broken.push(("comes to its end after a kill", format!("{:?}: {failure}", failure.kind())));
    }
}
