//! What is recorded was sent, and what acts is sent once.

use super::*;

/// How a command comes to its rows, and whether it keeps all that comes.
fn recording(command: &Command) -> Option<(bool, bool)> {
    match command {
        Command::Log { poll_ms, count, .. } => Some((poll_ms.is_some(), count.is_none())),
        Command::PdoWatch { .. } => Some((false, true)),
        Command::Check { how: Measuring::Poll { .. }, .. } => Some((true, false)),
        Command::Check { how: Measuring::AsSent { .. } | Measuring::Sync { .. }, .. } => Some((false, false)),
        _ => None,
    }
}

/// Every row is a value that was sent; none twice, none invented.
pub(super) fn rows(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let Some((polls, keeps_all)) = recording(&spec.command) else { return };
    if spec.lies() || spec.shares_node_ids() {
        return;
    }
    if polls {
        let answers = answers(run);
        for row in &run.heard.rows {
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
    for row in &run.heard.rows {
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
    if !spec.is_clean() || !keeps_all {
        return;
    }
    let time = |row: &str| row.split(',').next().and_then(|time| time.parse::<u64>().ok()).unwrap_or(0);
    let node = |row: &str| row.split(',').nth(1).and_then(|node| node.parse::<u8>().ok()).unwrap_or(0);
    if let (Some(first), Some(last)) = (run.heard.rows.first(), run.heard.rows.last()) {
        let named = named(spec);
        let between = run.truth.iter().filter(|row| (time(first)..=time(last)).contains(&time(row)));
        let sent = between.filter(|row| named.contains(&node(row))).count();
        if sent != run.heard.rows.len() {
            broken.push(("loses no row", format!("{} rows of {sent}", run.heard.rows.len())));
        }
    }
}

/// What every node really answered by expedited upload.
pub(super) fn answers(run: &Run) -> BTreeMap<(u8, ObjectId), BTreeSet<Vec<u8>>> {
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
            values.extend((1..=length).map(|length| data[4..4 + length].to_vec()));
        }
    }
    all
}

/// What acts is sent once, and a command that says it acted has reached the device.
pub(super) fn signatures(spec: &Spec, run: &Run, broken: &mut Vec<Broken>) {
    let mut sent: BTreeMap<(u8, [u8; 8]), u32> = BTreeMap::new();
    for (_, frame) in run.bus.all_sent() {
        if let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.all_eight())
            && data[0] >> 5 == 1
            && is_signature(&data[4..8])
        {
            *sent.entry((node.get(), data)).or_default() += 1;
        }
    }
    // What the device had already is written once more to put it back.
    let once = if matches!(spec.command, Command::Assign { .. }) && run.result.is_err() { 2 } else { 1 };
    if let Some((what, times)) = sent.iter().find(|(_, times)| **times > once) {
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
