//! Gives a device back its settings as delivered: "load" written to 1011h. Node-ID and bit rate stay.

use crate::canopen::object::ObjectId;
use crate::master::{Master, SdoFailure};
use crate::node::Node;
use crate::tasks::kept::{self, Held};
use crate::tasks::signature::{STORE_TIMEOUT, may_have_acted, sign};
use crate::tasks::store::{Done, Group, Verified, answers, check_capability};
use crate::tasks::{Failure, Kind};

/// 1011h.
const RESTORE: u16 = 0x1011;

/// Restores a group of settings. They come into force at the next reset: with `reset` the device is reset at once,
/// compared with its description, and put back into the NMT state that it was in.
///
/// # Errors
/// A device that does not restore on command, refusals, silence, settings that are not as delivered after the
/// reset, and what stops everything. Each says what was done by then, so far as it is known.
pub fn restore(master: &mut Master<'_>, device: &Node, group: Group, reset: bool) -> Result<Done, Failure> {
    let node = device.id;
    check_capability(master, device, RESTORE, group)?;
    let objects = kept::objects(device, &[group]);
    let (before, state) = match reset {
        true => (kept::hold(master, device, &objects)?, kept::state(master, node)?),
        false => (Vec::new(), None),
    };
    load(master, device, group)?;
    let mut done = Done { groups: vec![group], verified: Verified::Ack, notes: Vec::new() };
    if !reset {
        done.notes.push(format!(
            "the defaults hold only after its next reset, and a store before that may keep the old values; to finish: \
             cangauge nmt reset {node}, or cangauge restore {node}{} --reset, which compares, too",
            match group {
                Group::All => String::new(),
                _ => format!(" --group {}", group.as_str()),
            }
        ));
        return Ok(done);
    }
    let look = |master: &mut Master<'_>| kept::hold(master, device, &objects);
    let (held, note) = kept::reset(master, node, state, look).map_err(|failure| {
        failure.knowing(node, "the restore was acknowledged, and whether it is in force is not proven")
    })?;
    done.notes.extend(note);
    let compared = compare(device, &before, &held)?;
    if compared.doubtful.is_empty() && compared.agree > 0 {
        done.verified = Verified::Reset;
    } else if compared.doubtful.is_empty() {
        done.notes.push("it was reset and booted; its defaults are not known here, so nothing was compared".to_owned());
    } else {
        done.notes.push(format!(
            "reset, and these are as before, which may be how this one was delivered, or not restored: {}",
            compared.doubtful.join(", ")
        ));
    }
    Ok(done)
}

/// Sends "load" once.
fn load(master: &mut Master<'_>, device: &Node, group: Group) -> Result<(), Failure> {
    let node = device.id;
    let object = ObjectId::new(RESTORE, group.sub());
    let unknown = format!(
        "\"load\" went to {object} once and is not repeated; whether its next reset brings the defaults is not known"
    );
    let result = sign(master, device, object, b"load", STORE_TIMEOUT);
    let error = match result.map_err(|error| Failure::from(error).knowing(node, &unknown))? {
        Ok(()) => return Ok(()),
        Err(error) => error,
    };
    if !may_have_acted(&error) {
        return Err(error.into());
    }
    let silent = matches!(error.failure, SdoFailure::NoAnswer { .. });
    let failure = Failure::from(error).knowing(node, unknown);
    let failure = if silent { failure.knowing(node, answers(master, device)?) } else { failure };
    Err(failure.hint(format!("once more, and proven: cangauge restore {node} --group {} --reset", group.as_str())))
}

/// What the comparison with the description came to.
struct Compared {
    /// How many objects hold their default.
    agree: usize,
    /// Objects that hold what they held before and not the likely default, which is not printed or depends on the
    /// piece.
    doubtful: Vec<String>,
}

/// That everything is as delivered, so far as the manual prints it.
fn compare(device: &Node, before: &[Held], after: &[Held]) -> Result<Compared, Failure> {
    let (mut agree, mut wrong, mut doubtful) = (0, Vec::new(), Vec::new());
    for held in after {
        match kept::default(device, held.object) {
            None => {}
            Some(default) if default == held.bytes => agree += 1,
            Some(default) if kept::default_is_sure(device, held.object) => {
                wrong.push(format!("{} is {}, not {}", held.name(), held.show(&held.bytes), held.show(&default)));
            }
            Some(_) if before.contains(held) => doubtful.push(format!("{} ({})", held.name(), held.show(&held.bytes))),
            Some(_) => {}
        }
    }
    if wrong.is_empty() {
        return Ok(Compared { agree, doubtful });
    }
    let message = format!("restored and reset, but not as delivered: {}", wrong.join(", "));
    Err(Failure::of_node(Kind::Unexpected, device.id, message))
}
