//! Recorded values were sent, and actions are sent once.

use super::*;

/// The source of the rows of a command, and whether it records every value.
fn recording(command: &Command) -> Option<(bool, bool)> {
    match command {
        Command::Log { poll_ms, count, .. } => Some((poll_ms.is_some(), count.is_none())),
        Command::PdoWatch { .. } => Some((false, true)),
        Command::Check { how: Measuring::Poll { .. }, .. } => Some((true, false)),
        Command::Check { how: Measuring::AsSent { .. } | Measuring::Sync { .. }, .. } => Some((false, false)),
        _ => None,
    }
}

/// Whether a row is a mapped status of a device that is not recognised, perhaps because of a fault. The simulator's
/// record has no row for it.
fn is_unnamed_status(spec: &Spec, row: &str) -> bool {
    let mut cells = row.split(',').skip(2);
    !spec.is_clean() && cells.next().is_some_and(|signal| signal.starts_with("0x")) && cells.next() == Some("")
}

/// Every row is a value that was sent, and no value has two rows.
pub(super) fn rows(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let Some((polls, keeps_all)) = recording(&spec.command) else { return };
    if spec.falsifies_data() || spec.shares_node_ids() {
        return;
    }
    if polls {
        let answers = answers(run);
        for row in &run.observed.rows {
            let mut cells = row.split(',').skip(1);
            let node: u8 = cells.next().and_then(|node| node.parse().ok()).unwrap_or(0);
            let raw = hex(row.rsplit(',').next().unwrap_or(""));
            if !answers.iter().any(|((from, _), values)| *from == node && values.contains(&raw)) {
                violations.push(("invents no row", row.clone()));
                return;
            }
        }
        return;
    }
    let late = spec.faults.iter().any(|fault| matches!(fault, Fault::Delay(..)));
    let key = |row: &str| {
        let cells: Vec<&str> = row.split(',').collect();
        let time = if late { "" } else { cells[0] };
        if spec.is_clean() { format!("{time},{}", cells[1..].join(",")) } else { [time, cells[1], cells[6]].join(",") }
    };
    let mut left: BTreeMap<String, Vec<&String>> = BTreeMap::new();
    run.truth.iter().for_each(|row| left.entry(key(row)).or_default().push(row));
    let mut twice = spec.faults.iter().filter(|fault| matches!(fault, Fault::Duplicate(_))).count() * 8;
    for row in run.observed.rows.iter().filter(|row| !is_unnamed_status(spec, row)) {
        let was_sent = if left.contains_key(&key(row)) { key(row) } else { key(&without_overload(spec, row)) };
        let Some(sent) = left.get_mut(&was_sent) else {
            // If the unit is changed during the run, the simulator's record shows the new one at once.
            let raw = row.rsplit(',').next().unwrap_or("");
            let same = run.truth.iter().find(|other| other.rsplit(',').next() == Some(raw));
            violations.push(("invents no row", format!("{row} (sent: {same:?})")));
            return;
        };
        match sent.iter().position(|truth| agrees(spec, row, truth)) {
            Some(place) => drop(sent.swap_remove(place)),
            None if twice > 0 => twice -= 1,
            None if sent.is_empty() => {
                violations.push(("no value has two rows", row.clone()));
                return;
            }
            None => {
                violations.push(("shows sent values", format!("{row} (sent: {sent:?})")));
                return;
            }
        }
    }
    // If nothing is lost, no value is missing between the first row and the last one.
    if !spec.is_clean() || !keeps_all {
        return;
    }
    let time = |row: &str| row.split(',').next().and_then(|time| time.parse::<u64>().ok()).unwrap_or(0);
    let node = |row: &str| row.split(',').nth(1).and_then(|node| node.parse::<u8>().ok()).unwrap_or(0);
    if let (Some(first), Some(last)) = (run.observed.rows.first(), run.observed.rows.last()) {
        let named = named(spec);
        let between = run.truth.iter().filter(|row| (time(first)..=time(last)).contains(&time(row)));
        let sent = between.filter(|row| named.contains(&node(row))).count();
        if sent != run.observed.rows.len() {
            violations.push(("loses no row", format!("{} rows of {sent}", run.observed.rows.len())));
        }
    }
}

/// Whether a row shows a sent value. A device that was not recognised has the names of its profile or its objects, and
/// an unknown value or unit is empty.
fn agrees(spec: &Spec, row: &str, truth: &str) -> bool {
    let [row, truth] = [row, truth].map(|line| line.split(',').collect::<Vec<_>>());
    let device = spec.devices.iter().find(|device| device.node.is_some_and(|node| node.to_string() == truth[1]));
    let signal = device.and_then(|device| {
        let signals = &crate::kinds::model(device.kind).description.signals;
        signals.iter().find(|signal| signal.name == truth[2]).map(|signal| format!("ch{}", signal.channel))
    });
    let is_named =
        row[2] == truth[2] || Some(row[2]) == signal.as_deref() || row[2].starts_with("0x") && row[3].is_empty();
    let has_unit = row[4].is_empty() || row[4] == truth[4];
    // Without a unit, the decimal digits may be unknown as well.
    let refuses = spec.device_faults().any(|device_fault| matches!(device_fault, DeviceFault::Refuse { .. }));
    let has_value = row[3].is_empty() || row[3] == truth[3] || refuses && row[4].is_empty();
    let is_bad = truth[5].starts_with("overload") || truth[5] == "invalid";
    is_named && has_unit && has_value && !(is_bad && row[5] == "ok")
}

/// The row without the status that shows a value outside the measuring range, if its device is overloaded. The
/// simulator's record has the status objects of the devices only.
fn without_overload(spec: &Spec, row: &str) -> String {
    let overloaded = |node: &str| {
        spec.devices.iter().any(|device| device.overload && device.node.is_some_and(|id| id.to_string() == node))
    };
    let mut cells: Vec<&str> = row.split(',').collect();
    if cells[5].starts_with("overload-") && overloaded(cells[1]) {
        cells[5] = "";
    }
    cells.join(",")
}

/// The values that each node answered by expedited upload.
pub(super) fn answers(run: &Run) -> BTreeMap<(u8, ObjectId), BTreeSet<Vec<u8>>> {
    let mut all: BTreeMap<_, BTreeSet<Vec<u8>>> = BTreeMap::new();
    for station in run.bus.bus.inner().inner().stations::<FaultyDevice>() {
        for (_, frame) in &station.sent {
            let (Some(node), Some(data)) = (frame.id().sdo_response_node(), frame.as_eight_bytes()) else { continue };
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

/// A signature is sent once, and a command that reports success has reached the device.
pub(super) fn signatures(spec: &Spec, run: &Run, violations: &mut Vec<Violation>) {
    let mut sent: BTreeMap<(u8, [u8; 8]), u32> = BTreeMap::new();
    for (_, frame) in run.bus.all_sent() {
        if let (Some(node), Some(data)) = (frame.id().sdo_request_node(), frame.as_eight_bytes())
            && data[0] >> 5 == 1
            && is_signature(&data[4..8])
        {
            *sent.entry((node.get(), data)).or_default() += 1;
        }
    }
    // A value that the device had before may be written once more to restore it.
    let once = if matches!(spec.command, Command::Assign { .. }) && run.result.is_err() { 2 } else { 1 };
    if let Some((what, times)) = sent.iter().find(|(_, times)| **times > once) {
        violations.push(("sends a signature once", format!("{what:?} {times} times")));
    }
    let acts = matches!(
        spec.command,
        Command::Minmax { .. }
            | Command::Autozero { dry_run: false, .. }
            | Command::Store { .. }
            | Command::Restore { .. }
    );
    let mut devices = run.bus.bus.inner().inner().stations::<FaultyDevice>();
    if acts && run.result.is_ok() && !spec.falsifies_data() && !devices.any(|station| !station.signed.is_empty()) {
        violations.push(("has the requested settings", "no signature reached the device".to_owned()));
    }
}
