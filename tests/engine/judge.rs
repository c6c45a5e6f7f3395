//! What must always hold, whatever went wrong.

use crate::run::{Holds, Run, Said, group, hex, holds};
use crate::spec::{Act, Command, Fault, Spec, Target, Vagary};
use crate::station::Unruly;
use cangauge::bus::Mono;
use cangauge::canopen::id::{CanId, NodeId};
use cangauge::canopen::nmt::NmtState;
use cangauge::canopen::object::ObjectId;
use cangauge::sim::State;
use cangauge::tasks::Kind;
use cangauge::tasks::lss::Via;
use cangauge::tasks::pdo::Settings;
use cangauge::tasks::sdo::is_signature;
use cangauge::tasks::store::Group;
use std::collections::{BTreeMap, BTreeSet};

/// A rule that was broken, and how.
pub(crate) type Broken = (&'static str, String);

pub(crate) fn judge(spec: &Spec, run: &mut Run) -> Vec<Broken> {
    let mut broken = Vec::new();
    ends(run, &mut broken);
    frames(spec, run, &mut broken);
    let after: Vec<Holds> = run.bus.bus.inner().stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect();
    others_unchanged(spec, run, &after, &mut broken);
    put_back(spec, run, &after, &mut broken);
    kinds(spec, run, &mut broken);
    rows(spec, run, &mut broken);
    signatures(spec, run, &mut broken);
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

/// The nodes that a command names.
fn named(spec: &Spec) -> BTreeSet<u8> {
    let of = |target: &Target| match target {
        Target::Node(node) => vec![*node],
        Target::Identity(place) => spec.devices[*place].node.into_iter().collect(),
        Target::Only
            if spec.devices.len() == 1
                || spec.devices.iter().any(|device| device.node.is_none())
                || !spec.is_clean() =>
        {
            spec.devices.iter().filter_map(|device| device.node).collect()
        }
        Target::Only | Target::Unconfigured => Vec::new(),
    };
    match &spec.command {
        Command::Scan { nodes }
        | Command::Read { nodes }
        | Command::Nmt { nodes, .. }
        | Command::NmtState { nodes }
        | Command::Log { nodes, .. } => nodes.iter().copied().collect(),
        Command::Info { node }
        | Command::PdoShow { node }
        | Command::SdoRead { node, .. }
        | Command::SdoWrite { node, .. }
        | Command::NmtProbe { node }
        | Command::Startup { node, .. }
        | Command::Map { node, .. }
        | Command::Autozero { node, .. }
        | Command::Store { node, .. }
        | Command::Restore { node, .. }
        | Command::Unit { node, .. }
        | Command::Filter { node, .. }
        | Command::Limits { node, .. }
        | Command::Errors { node, .. }
        | Command::Minmax { node } => [*node].into(),
        Command::LssScan => BTreeSet::new(),
        Command::LssInquire { target } | Command::LssStore { target } => of(target).into_iter().collect(),
        Command::Assign { target, id, rate, .. } => {
            let new = id.or(rate.is_none().then_some(9));
            of(target).into_iter().chain(new).collect()
        }
    }
}

fn is_lss(command: &Command) -> bool {
    matches!(command, Command::LssScan | Command::LssInquire { .. } | Command::LssStore { .. } | Command::Assign { .. })
}

/// Whether a command may write anything by SDO.
fn writes(command: &Command) -> bool {
    !matches!(
        command,
        Command::Scan { .. }
            | Command::Read { .. }
            | Command::Info { .. }
            | Command::PdoShow { .. }
            | Command::SdoRead { .. }
            | Command::Nmt { .. }
            | Command::NmtState { .. }
            | Command::LssScan
            | Command::LssInquire { .. }
            | Command::LssStore { .. }
            | Command::Errors { clear: false, .. }
            | Command::Log { .. }
            | Command::Autozero { dry_run: true, .. }
    )
}

/// No frame that could change a device that was not meant.
fn frames(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let named = named(spec);
    let lss = is_lss(&spec.command);
    let resets = |command: &Command| match command {
        Command::Store { verify, .. } => *verify,
        Command::Restore { reset, .. } => *reset,
        Command::Log { nmt, sync_ms: _, poll_ms, .. } => *nmt && poll_ms.is_none(),
        Command::Assign { .. } | Command::Map { .. } | Command::LssInquire { .. } | Command::LssStore { .. } => true,
        _ => false,
    };
    for (at, frame) in run.bus.all_sent() {
        let allowed = match frame.id() {
            CanId::Standard(0) => match (&spec.command, frame.data()) {
                (Command::Nmt { what, nodes, all }, &[specifier, node]) => {
                    specifier == what.specifier() && if *all { node == 0 } else { nodes.contains(&node) }
                }
                (command, &[_, node]) => resets(command) && named.contains(&node),
                _ => false,
            },
            CanId::Standard(0x080) => {
                matches!(spec.command, Command::Log { sync_ms: Some(_), .. }) && !frame.is_remote()
            }
            CanId::Standard(0x7e5) => lss && !frame.is_remote(),
            id if frame.is_remote() => {
                let guards = matches!(
                    spec.command,
                    Command::Nmt { .. }
                        | Command::NmtState { .. }
                        | Command::NmtProbe { .. }
                        | Command::Map { .. }
                        | Command::Store { .. }
                        | Command::Restore { .. }
                );
                (guards || lss) && id.heartbeat_node().is_some_and(|node| named.contains(&node.get()))
            }
            id => match (id.sdo_request_node().map(NodeId::get), frame.all_eight()) {
                (Some(node), Some(data)) => {
                    let reads = matches!(data[0] >> 5, 2..=5);
                    let meant = named.contains(&node);
                    // A block of a long download begins with a number; only short ones are written here.
                    // Whether an identifier is free is seen by asking who there is.
                    let asks = lss || matches!(spec.command, Command::Map { cob_id: Some(_), .. });
                    if reads { meant || asks } else { meant && writes(&spec.command) }
                }
                _ => false,
            },
        };
        if !allowed {
            broken.push(("touches nobody else", format!("{:?}: {frame}", at.since_start())));
            return;
        }
    }
}

/// Whether a device is the one that is meant.
fn is_meant(spec: &Spec, place: usize) -> bool {
    let node = spec.devices[place].node;
    match &spec.command {
        Command::Assign { target, .. } | Command::LssStore { target } | Command::LssInquire { target } => {
            match target {
                Target::Node(id) => node == Some(*id),
                Target::Identity(meant) => {
                    let same = |at: usize| (spec.devices[at].kind, spec.devices[at].serial);
                    same(*meant) == same(place)
                }
                // Who has no node-ID and knows none of the inquiries cannot be seen, and takes what the only one takes.
                Target::Only => {
                    spec.devices.len() == 1
                        || node.is_none()
                        || spec.devices.iter().any(|device| device.node.is_none())
                        || !spec.is_clean()
                }
                Target::Unconfigured => node.is_none(),
            }
        }
        _ => node.is_some_and(|node| named(spec).contains(&node)),
    }
}

fn others_unchanged(spec: &Spec, run: &Run, after: &[Holds], broken: &mut Vec<Broken>) {
    let written_by_others = spec.acts().any(|act| matches!(act, Act::Nmt { .. }));
    let own = |holds: &Holds| (holds.node, holds.bit_rate, holds.stored);
    for (place, (before, after)) in run.before.iter().zip(after).enumerate() {
        if !is_meant(spec, place) && own(before) != own(after) {
            broken.push(("changes nobody else", format!("device {place}: {before:?} became {after:?}")));
        }
        let meddled = written_by_others
            || spec.devices[place]
                .vagaries
                .iter()
                .any(|vagary| matches!(vagary, Vagary::ResetAt { .. } | Vagary::Hang { .. }));
        let broadcast = matches!(spec.command, Command::Nmt { all: true, .. });
        // Who has no node-ID of its own may stand where the new one is.
        if !is_meant(spec, place) && !meddled && !broadcast && before.state != after.state {
            let shares = named(spec).iter().any(|node| before.node == Some(*node));
            if !shares {
                broken.push(("switches nobody else", format!("device {place}: {before:?} became {after:?}")));
            }
        }
    }
}

/// What was switched on the way is put back.
fn put_back(spec: &Spec, run: &mut Run, after: &[Holds], broken: &mut Vec<Broken>) {
    let cannot = spec.loses_sent()
        || spec.vagaries().any(|vagary| matches!(vagary, Vagary::Hang { .. }))
        || spec.devices.iter().any(|device| device.bit_rate.is_some());
    if cannot || run.bus.overran {
        return;
    }
    for (place, holds) in after.iter().enumerate() {
        if holds.configuring {
            broken.push(("leaves configuration state", format!("device {place}: {holds:?}")));
        }
    }
    if spec.is_meddled_with() || spec.lies() || spec.is_disordered() || spec.shares_node_ids() {
        return;
    }
    // A state that heartbeats told is what it was.
    let clean_answers = spec.faults.is_empty() && spec.vagaries().all(|vagary| matches!(vagary, Vagary::Refuse { .. }));
    let keeps = match &spec.command {
        Command::Log { .. } => true,
        Command::Map { .. } | Command::Store { .. } | Command::Restore { .. } => clean_answers,
        _ => false,
    };
    if keeps && clean_answers {
        for (place, (before, after)) in run.before.iter().zip(after).enumerate() {
            let device = &spec.devices[place];
            let told = device.heartbeat_ms.is_some_and(|time| time <= 200) && device.unsaved_heartbeat.is_none();
            let refuses = device.vagaries.iter().any(|vagary| matches!(vagary, Vagary::Refuse { index: 0x1017, .. }));
            let shared = spec.shares_node_ids();
            if told
                && !refuses
                && !shared
                && device.kind != "jumo"
                && before.state != after.state
                && heartbeats(run, before)
            {
                let remarks = match &run.result {
                    Ok(said) => format!("{said:?}"),
                    Err(failure) => failure.message.clone(),
                };
                if !remarks.contains("not put back") && !remarks.contains("stays") && !remarks.contains("state") {
                    broken
                        .push(("puts states back", format!("device {place}: {before:?} became {after:?}: {remarks}")));
                }
            }
        }
    }
    // So is the heartbeat after a probe.
    if let Command::NmtProbe { node } = spec.command
        && !matches!(run.result, Ok(Said::Probed(_, false)))
        && clean_answers
    {
        for unruly in run.bus.bus.inner_mut().stations_mut::<Unruly>() {
            let device = &spec.devices[unruly.place];
            if device.node != Some(node) {
                continue;
            }
            let first = unruly.device.value(ObjectId::new(0x1017, 0), run.settled);
            let period = u16::from_le_bytes(first.unwrap_or_default().try_into().unwrap_or([0; 2]));
            let expected = device.unsaved_heartbeat.or(device.heartbeat_ms);
            if expected.is_some_and(|expected| expected != period) || expected.is_none() && period == 100 {
                broken.push(("puts the heartbeat back", format!("{period} ms, not {expected:?}")));
            }
        }
    }
}

/// Whether heartbeats of a device were seen.
fn heartbeats(run: &Run, before: &Holds) -> bool {
    run.bus.bus.inner().stations::<Unruly>().any(|unruly| {
        holds(&unruly.device).node == before.node
            && unruly
                .sent
                .iter()
                .filter(|(_, frame)| frame.id().heartbeat_node().map(NodeId::get) == before.node)
                .count()
                > 1
    })
}

/// The kind of a failure is its real cause.
fn kinds(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let Err(failure) = &run.result else { return };
    if run.bus.overran {
        return;
    }
    let told = || format!("{:?}: {failure} (hint: {:?})", failure.kind, failure.hint);
    let tap = &run.bus;
    if tap.interrupted && !tap.was_down && !tap.was_off {
        // What went wrong before the interruption may be the reason.
        if failure.kind == Kind::Bus {
            broken.push(("names the cause", format!("interrupted: {}", told())));
        }
        let quiet = spec.faults.is_empty() && spec.others.is_empty() && spec.vagaries().next().is_none();
        if quiet && failure.kind == Kind::NoAnswer && all_there(spec) {
            broken.push(("names the cause", format!("interrupted: {}", told())));
        }
        return;
    }
    if failure.kind == Kind::Interrupted && !tap.interrupted {
        broken.push(("names the cause", format!("nobody interrupted: {}", told())));
    }
    if tap.was_down && !tap.interrupted && !matches!(spec.command, Command::Log { .. }) && failure.kind != Kind::Bus {
        // It may have failed before.
        let down_at = spec.faults.iter().filter_map(|fault| match fault {
            Fault::Down { at_us, .. } => Some(*at_us),
            _ => None,
        });
        if down_at.min() == Some(0)
            || spec.faults.len() == 1 && !matches!(failure.kind, Kind::Usage | Kind::Refused) && quiet(spec)
        {
            broken.push(("names the cause", format!("the interface was down: {}", told())));
        }
    }
    let bus_is_well = spec.faults.iter().all(|fault| !matches!(fault, Fault::Down { .. } | Fault::BusOff { .. }));
    if failure.kind == Kind::Bus && bus_is_well && spec.devices.iter().all(|device| device.bit_rate.is_none()) {
        let sharing = spec.shares_node_ids() || !spec.others.is_empty();
        let answered = run.bus.frames.iter().any(|(_, passed)| matches!(passed, crate::tap::Passed::Received(_)));
        let retimes = matches!(spec.command, Command::Assign { rate: Some(_), .. });
        if answered && !sharing && !retimes && !spec.vagaries().any(|vagary| matches!(vagary, Vagary::Hang { .. })) {
            broken.push(("names the cause", format!("the bus works: {}", told())));
        }
    }
    if !spec.is_clean() {
        return;
    }
    // Nothing is wrong: who is there answers, and breaks no rule.
    if failure.kind == Kind::NoAnswer && all_there(spec) && !may_be_silent(spec) {
        broken.push(("names the cause", format!("everybody answers: {}", told())));
    }
    if failure.kind == Kind::Unexpected && !may_be_odd(spec, &failure.message) {
        broken.push(("names the cause", format!("nothing is odd: {}", told())));
    }
    if failure.kind == Kind::Refused
        && matches!(spec.command, Command::Scan { .. } | Command::Info { .. } | Command::Nmt { .. })
    {
        broken.push(("names the cause", format!("nobody refuses: {}", told())));
    }
}

fn quiet(spec: &Spec) -> bool {
    spec.others.is_empty() && spec.vagaries().next().is_none() && all_there(spec) && spec.is_clean_but_for_faults()
}

fn all_there(spec: &Spec) -> bool {
    let there: BTreeSet<u8> = spec.devices.iter().filter_map(|device| device.node).collect();
    !is_lss(&spec.command) && named(spec).is_subset(&there)
}

/// TPDOs that wait for something bring no rows; a device with a long latency is silent at a short time-out.
fn may_be_silent(spec: &Spec) -> bool {
    matches!(spec.command, Command::Log { .. })
        // Its table of bit rates has not that of this bus, and what it stores is that it works at another one.
        || matches!(spec.command, Command::Store { .. }) && spec.devices.iter().any(|device| device.kind == "baumer")
        || spec.devices.iter().any(|device| device.latency_us * 2 >= spec.timeout_ms * 1000)
}

fn may_be_odd(spec: &Spec, message: &str) -> bool {
    // Devices that have no measured value, no such object; what a description does not know.
    matches!(spec.devices.len(), 0)
        || [
            "it has no",
            "no source",
            "no object",
            "tells no",
            "no measured",
            "has no",
            "multiplexed",
            "not known",
            "it keeps no",
        ]
        .iter()
        .any(|part| message.contains(part))
        || matches!(spec.command, Command::Assign { store: false, via: Via::Sdo, .. })
            && message.contains("it has been reset and is still")
        || is_lss(&spec.command) && spec.devices.iter().any(|device| device.latency_us * 2 >= spec.timeout_ms * 1000)
}

/// Every row is a value that was sent; none twice, none invented.
fn rows(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let Command::Log { poll_ms, count, .. } = &spec.command else { return };
    if spec.lies() || spec.shares_node_ids() {
        return;
    }
    if poll_ms.is_some() {
        let answers = answers(run);
        for row in &run.rows {
            let mut cells = row.split(',').skip(1);
            let node: u8 = cells.next().and_then(|node| node.parse().ok()).unwrap_or(0);
            let raw = hex(row.rsplit(',').next().unwrap_or(""));
            if !answers.iter().any(|((from, _), values)| *from == node && values.contains(&raw)) {
                broken.push(("invents no row", row.clone()));
                return;
            }
        }
        return;
    }
    let late = spec.faults.iter().any(|fault| matches!(fault, Fault::Delay(..)));
    // What was not to be read is not known: a unit, and the digits with it.
    let refuses = spec.vagaries().any(|vagary| matches!(vagary, Vagary::Refuse { .. }));
    let key = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        let time = if late { "" } else { cells[0] };
        let rest = if refuses { [cells[1], cells[6]].join(",") } else { cells[1..].join(",") };
        format!("{time},{rest}")
    };
    let mut left: BTreeMap<String, usize> = BTreeMap::new();
    run.truth.iter().for_each(|row| *left.entry(key(row)).or_default() += 1);
    let mut twice = spec.faults.iter().filter(|fault| matches!(fault, Fault::Duplicate(_))).count() * 8;
    for row in &run.rows {
        match left.get_mut(&key(row)) {
            Some(count) if *count > 0 => *count -= 1,
            Some(_) if twice > 0 => twice -= 1,
            Some(_) => {
                broken.push(("no row twice", row.clone()));
                return;
            }
            None => {
                // A unit that somebody changes in between shows in the record at once.
                let raw = row.rsplit(',').next().unwrap_or("");
                let same = run.truth.iter().find(|other| other.rsplit(',').next() == Some(raw));
                broken.push(("invents no row", format!("{row} (sent: {same:?})")));
                return;
            }
        }
    }
    // Where nothing is lost nothing is missing between the first row and the last one.
    if !spec.is_clean() || count.is_some() {
        return;
    }
    let time = |row: &str| row.split(',').next().and_then(|time| time.parse::<u64>().ok()).unwrap_or(0);
    let node = |row: &str| row.split(',').nth(1).and_then(|node| node.parse::<u8>().ok()).unwrap_or(0);
    if let (Some(first), Some(last)) = (run.rows.first(), run.rows.last()) {
        let named = named(spec);
        let between = run.truth.iter().filter(|row| (time(first)..=time(last)).contains(&time(row)));
        let sent = between.filter(|row| named.contains(&node(row))).count();
        if sent != run.rows.len() {
            broken.push(("loses no row", format!("{} rows of {sent}", run.rows.len())));
        }
    }
}

/// What every node really answered by expedited upload.
fn answers(run: &Run) -> BTreeMap<(u8, ObjectId), BTreeSet<Vec<u8>>> {
    let mut all: BTreeMap<_, BTreeSet<Vec<u8>>> = BTreeMap::new();
    for unruly in run.bus.bus.inner().stations::<Unruly>() {
        for (_, frame) in &unruly.sent {
            let (Some(node), Some(data)) = (frame.id().sdo_response_node(), frame.all_eight()) else { continue };
            if data[0] & 0x02 == 0 || data[0] >> 5 == 4 {
                continue;
            }
            let length = if data[0] & 1 == 1 { 4 - usize::from(data[0] >> 2 & 3) } else { 4 };
            let key = (node.get(), ObjectId::from_multiplexer([data[1], data[2], data[3]]));
            let values = all.entry(key).or_default();
            (1..=length).for_each(|length| drop(values.insert(data[4..4 + length].to_vec())));
        }
    }
    all
}

/// What a command that ended well says is true.
fn claims(spec: &Spec, run: &mut Run, said: &Said, after: &[Holds], broken: &mut Vec<Broken>) {
    let settled = run.settled;
    match (said, &spec.command) {
        (Said::Found(found), _) if !spec.lies() && !spec.shares_node_ids() => {
            let there: BTreeMap<u8, u32> =
                spec.devices.iter().filter_map(|device| Some((device.node?, device.serial))).collect();
            for (node, serial) in found {
                match (there.get(node), serial) {
                    (None, _) => broken.push(("finds who is there", format!("nobody has node {node}"))),
                    (Some(right), Some(serial)) if right != serial && has_serial(spec, *node) => {
                        broken.push(("finds who is there", format!("node {node} is {right}, not {serial}")));
                    }
                    _ => {}
                }
            }
            if let Command::Scan { nodes } = &spec.command
                && spec.is_clean()
                && spec.timeout_ms >= 100
            {
                let expected = nodes.iter().filter(|node| there.contains_key(node)).count();
                if expected != found.len() {
                    broken.push(("finds who is there", format!("{found:?} of {there:?}")));
                }
            }
        }
        (Said::Values(values), _) if !spec.lies() => {
            let sent = answers(run);
            for (node, object, raw) in values {
                let expedited = sent.get(&(*node, *object)).is_some_and(|all| all.contains(raw));
                let mut holders = run.bus.bus.inner_mut().stations_mut::<Unruly>();
                let held = holders.any(|unruly| {
                    let value = unruly.device.value(*object, settled);
                    value.is_some_and(|value| value == *raw || value.starts_with(raw) && !raw.is_empty())
                });
                if !expedited && !held {
                    broken.push(("reads what is there", format!("node {node} {object}: {raw:02X?}")));
                }
            }
        }
        (Said::States(states), command)
            if !spec.is_meddled_with() && !spec.lies() && !spec.is_disordered() && !spec.shares_node_ids() =>
        {
            let hangs = spec.vagaries().any(|vagary| matches!(vagary, Vagary::Hang { .. } | Vagary::Lose { .. }));
            // What proves that a node is stopped is that it is silent, and so is one that is deaf.
            let stops = matches!(command, Command::Nmt { what, .. } if what.target() == NmtState::Stopped);
            let fails = !spec.faults.is_empty() || hangs || run.before.iter().any(|holds| holds.bit_rate.is_some());
            for (node, state) in states {
                let Some(state) = state else { continue };
                if stops && fails {
                    continue;
                }
                let really = after.iter().find(|holds| holds.node == Some(*node)).and_then(|holds| holds.state);
                let right = matches!(
                    (state, really),
                    (NmtState::Operational, Some(State::Operational))
                        | (NmtState::PreOperational, Some(State::PreOperational))
                        | (NmtState::Stopped, Some(State::Stopped))
                );
                // A boot-up says PRE-OPERATIONAL, also of one that starts by itself.
                let starts = *state == NmtState::PreOperational && really == Some(State::Operational);
                if !right && !starts {
                    broken.push(("tells the real state", format!("node {node}: {state:?}, and it is {really:?}")));
                }
            }
        }
        // Another bit rate comes into force with power, and so does what was set with it.
        (Said::Assigned { rate: Some(_), retimed: false, .. }, _) => {}
        (Said::Assigned { new, stored, rate, .. }, Command::Assign { id, .. }) => {
            // Who was given another node-ID by somebody else's reset is none of this command's business.
            let meant: Vec<&Holds> =
                after.iter().enumerate().filter(|(place, _)| is_meant(spec, *place)).map(|(_, holds)| holds).collect();
            let wanted = id.or(rate.is_none().then_some(9));
            let right = |holds: &&Holds| {
                (wanted.is_none() || holds.node == wanted && *new == wanted)
                    && (!stored || wanted.is_none() || holds.stored.0 == wanted)
                    && rate.flatten().is_none_or(|rate| !stored || holds.stored.1 == Some(rate))
            };
            if !spec.lies() && !meant.iter().any(right) && !(spec.is_meddled_with() && !stored) {
                broken.push(("holds what was asked", format!("{said:?}, and it is {meant:?}")));
            }
        }
        (Said::Mapped(settings), Command::Map { node, .. })
            if !spec.is_meddled_with() && !spec.lies() && !spec.shares_node_ids() =>
        {
            for unruly in run.bus.bus.inner_mut().stations_mut::<Unruly>() {
                if spec.devices[unruly.place].node == Some(*node)
                    && let Some(difference) = mapped_otherwise(unruly, settings, settled)
                {
                    broken.push(("holds what was asked", difference));
                }
            }
        }
        (Said::Nothing, Command::SdoWrite { node, object, bytes }) if !spec.lies() => {
            // Nothing tells the acknowledge of somebody else's write to the same object from that of ours.
            let acknowledged_by_others =
                spec.acts().any(|act| matches!(act, Act::Write { index, .. } if *index == object.index));
            let mut stations = run.bus.bus.inner_mut().stations_mut::<Unruly>();
            let held = stations.any(|unruly| {
                let there = spec.devices[unruly.place].node == Some(*node);
                let now = unruly.device.value(*object, settled);
                there && (unruly.held.contains(bytes) && spec.is_meddled_with() || now.as_deref() == Some(bytes))
            });
            if !held && !acknowledged_by_others && !becomes_another(spec, *node, *object) {
                broken.push(("holds what was asked", format!("node {node} {object} is not {bytes:02X?}")));
            }
        }
        _ => {}
    }
}

/// What acts is sent once, and a command that says it acted has reached the device.
fn signatures(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let mut sent: BTreeMap<(u8, [u8; 8]), u32> = BTreeMap::new();
    for (_, frame) in run.bus.all_sent() {
        if let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.all_eight())
            && data[0] >> 5 == 1
            && is_signature(&data[4..8])
        {
            *sent.entry((node.get(), data)).or_default() += 1;
        }
    }
    if let Some((what, times)) = sent.iter().find(|(_, times)| **times > 1) {
        broken.push(("signs once", format!("{what:?} {times} times")));
    }
    let acts = matches!(
        spec.command,
        Command::Minmax { .. }
            | Command::Autozero { dry_run: false, .. }
            | Command::Store { .. }
            | Command::Restore { .. }
    );
    let mut devices = run.bus.bus.inner().stations::<Unruly>();
    if acts && run.result.is_ok() && !spec.lies() && !devices.any(|unruly| !unruly.signed.is_empty()) {
        broken.push(("holds what was asked", "no signature reached the device".to_owned()));
    }
}

/// Whether a device keeps the serial number that it was given.
fn has_serial(spec: &Spec, node: u8) -> bool {
    let device = spec.devices.iter().find(|device| device.node == Some(node));
    device.is_some_and(|device| crate::run::identity(device).serial == device.serial)
}

/// Objects in which a value stands for another one.
fn becomes_another(spec: &Spec, node: u8, object: ObjectId) -> bool {
    let device = spec.devices.iter().find(|device| device.node == Some(node));
    let model = device.and_then(|device| cangauge::device::catalog::by_name(device.kind));
    let described = model.as_ref().and_then(|model| model.description.object(object));
    // MH-4: 0 brings back the identifier as delivered.
    described.is_none() || object.index & 0x0fff == 0x1a0 || object.index == 0x1014
}

fn number(bytes: &[u8]) -> u32 {
    bytes.iter().rev().fold(0u32, |number, byte| number << 8 | u32::from(*byte))
}

fn mapped_otherwise(unruly: &mut Unruly, settings: &Settings, now: Mono) -> Option<String> {
    let mut value = |object: ObjectId| unruly.device.value(object, now).map(|bytes| number(&bytes));
    let mut expected = vec![
        (settings.number.communication(1), settings.cob_id.0),
        (settings.number.communication(2), settings.transmission.into()),
        (settings.number.mapping(0), u32::try_from(settings.mapping.len()).unwrap_or(0)),
    ];
    expected.extend(settings.event_timer_ms.map(|timer| (settings.number.communication(5), timer.into())));
    for (sub, entry) in (1u8..).zip(&settings.mapping) {
        expected.push((settings.number.mapping(sub), entry.word()));
    }
    expected.into_iter().find_map(|(object, wanted)| {
        let found = value(object);
        (found.is_some_and(|found| found != wanted)).then(|| format!("{object} is {found:08X?}, not {wanted:08X}"))
    })
}

/// The last value that was written to each object, where writing keeps it.
fn last_writes(spec: &Spec, run: &mut Run, broken: &mut Vec<Broken>) {
    let resets = match spec.command {
        Command::Store { .. } | Command::Restore { .. } | Command::Assign { .. } | Command::Startup { .. } => true,
        Command::Autozero { .. } | Command::Errors { .. } | Command::Minmax { .. } => true,
        _ => false,
    };
    if resets || spec.is_meddled_with() || spec.lies() || spec.loses_sent() || spec.shares_node_ids() {
        return;
    }
    let mut last: BTreeMap<(u8, ObjectId), Vec<u8>> = BTreeMap::new();
    for (_, frame) in run.bus.all_sent() {
        let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.all_eight()) else { continue };
        if data[0] >> 5 == 1 && data[0] & 3 == 3 && !is_signature(&data[4..8]) {
            let length = 4 - usize::from(data[0] >> 2 & 3);
            let object = ObjectId::from_multiplexer([data[1], data[2], data[3]]);
            last.insert((node.get(), object), data[4..4 + length].to_vec());
        }
    }
    let settled = run.settled;
    for unruly in run.bus.bus.inner_mut().stations_mut::<Unruly>() {
        let device = &spec.devices[unruly.place];
        for ((node, object), bytes) in &last {
            if device.node != Some(*node) || becomes_another(spec, *node, *object) {
                continue;
            }
            let found = unruly.device.value(*object, settled);
            if found.as_ref().is_some_and(|found| found != bytes) {
                broken
                    .push(("holds what was written", format!("node {node} {object}: {found:02X?}, not {bytes:02X?}")));
            }
        }
    }
}

/// What was stored is still there after power off and on; what was not changed is as it was.
fn after_power(spec: &Spec, run: &mut Run, broken: &mut Vec<Broken>) {
    let settled = run.settled;
    let bus = run.bus.bus.inner_mut();
    bus.stations_mut::<Unruly>().for_each(Unruly::tame);
    bus.power_cycle();
    let after: Vec<Holds> = bus.stations::<Unruly>().map(|unruly| holds(&unruly.device)).collect();
    match &run.result {
        Ok(Said::Assigned { new, stored: true, .. }) if !spec.lies() => {
            let meant = (0..after.len()).filter(|place| is_meant(spec, *place)).any(|place| after[place].node == *new);
            if !meant && new.is_some() {
                broken.push(("keeps what was stored", format!("node {new:?}, and it is {after:?}")));
            }
        }
        Ok(Said::Mapped(settings)) if !spec.lies() && !spec.is_meddled_with() && !spec.shares_node_ids() => {
            // What a device is and keeps is known of one that tells its identity.
            let tells = !spec.vagaries().any(|vagary| matches!(vagary, Vagary::Refuse { .. }));
            if let (Command::Map { node, keep: true, .. }, true) = (&spec.command, tells) {
                for unruly in bus.stations_mut::<Unruly>() {
                    if spec.devices[unruly.place].node == Some(*node)
                        && let Some(difference) = mapped_otherwise(unruly, settings, settled)
                    {
                        broken.push(("keeps what was stored", difference));
                    }
                }
            }
        }
        Ok(Said::Stored(_)) if !spec.lies() && !spec.is_meddled_with() && !spec.shares_node_ids() => {
            heartbeat_kept(spec, bus, settled, broken);
        }
        Err(failure) if failure.message.contains("nothing was changed") && !spec.lies() => {
            let own = |holds: &Holds| (holds.stored, holds.node);
            let before = run.before.iter().map(own);
            if is_lss(&spec.command) && !before.eq(after.iter().map(own)) {
                broken.push(("says what was changed", format!("{failure}: {:?} became {after:?}", run.before)));
            }
        }
        _ => {}
    }
}

fn heartbeat_kept(spec: &Spec, bus: &mut cangauge::bus::memory::MemoryBus, now: Mono, broken: &mut Vec<Broken>) {
    let heartbeat = ObjectId::new(0x1017, 0);
    for unruly in bus.stations_mut::<Unruly>() {
        let device = &spec.devices[unruly.place];
        let model = cangauge::device::catalog::by_name(device.kind).expect("built in");
        let Some(entry) = model.dictionary.get(heartbeat).filter(|entry| entry.access.is_writable()) else { continue };
        let Some(period) = unruly.device.value(heartbeat, now).map(|bytes| number(&bytes)) else { continue };
        let (wanted, group) = match &spec.command {
            Command::Store { node, group: of, .. } if device.node == Some(*node) => {
                (device.unsaved_heartbeat.map(u32::from), group(*of))
            }
            Command::Restore { node, group: of, .. } if device.node == Some(*node) => {
                let default = entry.default_bytes(NodeId::new(*node).expect("a node-ID"));
                (default.map(|bytes| number(&bytes)), group(*of))
            }
            _ => continue,
        };
        if group != Group::Application && wanted.is_some_and(|wanted| wanted != period) {
            broken.push(("keeps what was stored", format!("1017h is {period}, not {wanted:?}")));
        }
    }
}
