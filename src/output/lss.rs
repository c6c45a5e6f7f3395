//! The reports of the LSS commands, and the texts of their events.

use super::failure::host::up_by_hand;
use super::identity;
use super::notes::NoteText;
use super::report::{Cell, Column, Report};
use crate::canopen::id::NodeId;
use crate::device::assign::short_bit_rate;
use crate::tasks::lss::{
    AnotherSlave, Assigned, DuplicateSign, FoundSlave, InquireReport, LssAddress, LssEvent, LssFact, LssRange,
    PlannedRate, Progress, Reason, Stage, UnansweredService,
};
use std::io::{self, Write};

/// The four numbers of an identity.
fn numbers(address: Option<LssAddress>) -> [Option<u32>; 4] {
    address.map_or([None; 4], |address| address.parts().map(Some))
}

impl Report for FoundSlave {
    const COLUMNS: &'static [Column] = &[
        Column::new("node").right(),
        identity::VENDOR,
        identity::VENDOR_NAME,
        identity::PRODUCT,
        identity::REVISION,
        identity::SERIAL.right(),
        Column::new("device"),
    ];

    fn cells(&self) -> Vec<Cell> {
        let mut cells = vec![Cell::from(self.node)];
        cells.extend(identity::cells(numbers(self.address), self.model.as_deref()));
        cells.push(self.model.as_ref().map(|model| model.description.name.clone()).into());
        cells
    }
}

impl Report for InquireReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("target").data_only(),
        Column::new("node"),
        Column::new("unconfigured").data_only(),
        identity::VENDOR,
        identity::VENDOR_NAME,
        identity::PRODUCT,
        identity::REVISION,
        identity::SERIAL,
    ];

    fn cells(&self) -> Vec<Cell> {
        let unconfigured = self.node.map(|node| node.is_none());
        let mut cells = vec![self.target.to_string().into(), self.node.flatten().into(), unconfigured.into()];
        cells.extend(identity::cells(numbers(self.address), None));
        cells
    }

    /// `0x47:0x1:0x1:10001  node 1`.
    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        for inquired in reports {
            let node = inquired.node.map(|node| match node {
                Some(node) => format!("node {node}"),
                None => "no node-ID".to_owned(),
            });
            let parts: Vec<String> =
                inquired.address.map(|address| address.to_string()).into_iter().chain(node).collect();
            writeln!(out, "{}", parts.join("  "))?;
        }
        Ok(())
    }
}

/// The answer to `lss identify`.
#[derive(Clone, Debug)]
pub struct Identified {
    /// The requested range.
    pub range: LssRange,
}

impl Report for Identified {
    const COLUMNS: &'static [Column] = &[Column::new("range").data_only(), Column::new("answered")];

    fn cells(&self) -> Vec<Cell> {
        vec![self.range.to_string().into(), Cell::Bool(true).shown_as("yes")]
    }

    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        super::report::rows_only(reports, out)
    }
}

/// The result of `set-id`, `set-bitrate` and `set`, with the remaining steps on the host.
#[derive(Clone, Debug)]
pub struct AssignReport {
    /// The result.
    pub assigned: Assigned,
    /// The interface, if its bit rate can be set with the tools of the system.
    pub interface: Option<String>,
}

const STALE: &[Column] = &[Column::new("object"), Column::new("cob_id"), Column::new("expected")];

impl Report for AssignReport {
    const COLUMNS: &'static [Column] = &[
        Column::new("target"),
        Column::new("old"),
        Column::new("new"),
        Column::new("stored"),
        Column::new("confirmed"),
        identity::VENDOR,
        identity::VENDOR_NAME,
        identity::PRODUCT,
        identity::REVISION,
        identity::SERIAL,
        Column::new("device"),
        Column::new("bit_rate"),
        Column::new("table_index"),
        Column::new("retimed"),
        Column::nested("stale", STALE).json_only(),
        Column::new("notes").json_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let assigned = &self.assigned;
        let mut cells = vec![
            Cell::from(assigned.target.to_string()),
            assigned.old.into(),
            assigned.new.or(assigned.old).into(),
            assigned.stored.into(),
            assigned.confirmed.as_str().into(),
        ];
        cells.extend(identity::cells(numbers(assigned.address), assigned.model.as_deref()));
        cells.push(assigned.model.as_ref().map(|model| model.description.name.clone()).into());
        cells.push(assigned.rate.and_then(|rate| rate.bits).into());
        cells.push(assigned.rate.map(|rate| rate.index).into());
        cells.push(assigned.retimed.into());
        cells.push(assigned.cob_ids.as_ref().map_or(Cell::Null, |ids| {
            let row = |stale: &crate::tasks::lss::StaleCobId| {
                vec![stale.object.into(), Cell::cob_id(stale.cob_id.0), Cell::cob_id(stale.expected)]
            };
            Cell::Rows(ids.stale.iter().map(row).collect())
        }));
        cells.push(Cell::List(self.notes().iter().map(NoteText::cell).collect()));
        cells
    }

    /// The new node-ID and bit rate: `12 500000`.
    fn text(reports: &[Self], out: &mut dyn Write) -> io::Result<()> {
        for AssignReport { assigned, .. } in reports {
            let plain_rate = |rate: PlannedRate| rate.bits.map_or_else(|| self::rate(rate), |bits| bits.to_string());
            let node = assigned.new.map(|new| new.to_string());
            let parts: Vec<String> = node.into_iter().chain(assigned.rate.map(plain_rate)).collect();
            writeln!(out, "{}", parts.join(" "))?;
        }
        Ok(())
    }

    fn line(&self, out: &mut dyn Write) -> io::Result<()> {
        AssignReport::text(std::slice::from_ref(self), out)
    }
}

impl AssignReport {
    /// Returns the evidence for the new node-ID, and the COB-IDs of the TPDOs.
    pub fn confirmation(&self) -> Option<String> {
        let (new, ids) = (self.assigned.new?, self.assigned.cob_ids.as_ref()?);
        let boot_up = match self.assigned.boot_time {
            Some(after) => {
                format!("boot-up of node {new} after {:.2} s, identity confirmed", after.as_secs_f64())
            }
            None => format!("node {new} answers, identity confirmed; no boot-up was received"),
        };
        let tpdos = ids.tpdos.iter().map(|(number, id)| format!("TPDO{number} has COB-ID 0x{id}"));
        Some(std::iter::once(boot_up).chain(tpdos).collect::<Vec<_>>().join("; "))
    }

    /// Returns the notes about the remaining steps.
    pub fn notes(&self) -> Vec<NoteText> {
        let assigned = &self.assigned;
        let mut notes = Vec::new();
        let stale = assigned.cob_ids.iter().flat_map(|ids| &ids.stale);
        notes.extend(stale.zip(std::iter::repeat(assigned.new)).filter_map(|(stale, new)| {
            let old = assigned.old.map_or(0, NodeId::get);
            let cob_id = stale.cob_id.can_id().number();
            let message = format!("{} still has the COB-ID 0x{cob_id:03X} of node-ID {old}", stale.object);
            let command = format!("cangauge sdo write {} {} 0x{:X}", new?, stale.object, stale.expected);
            Some(NoteText::new("stale-cob-id", message).command("change it", command))
        }));
        if let Some(rate) = assigned.rate.filter(|_| !assigned.retimed) {
            notes.push(self.host_must_follow(rate));
        }
        if !assigned.stored {
            notes.push(NoteText::new("not-stored", "not stored: a power cycle restores the old values"));
        }
        notes
    }

    fn host_must_follow(&self, planned: PlannedRate) -> NoteText {
        const CODE: &str = "host-must-follow";
        let rate = self::rate(planned);
        if planned.is_auto {
            return NoteText::new(CODE, "the device detects the bit rate after a restart: power it off and on");
        }
        let host = match (&self.interface, planned.bits) {
            (Some(interface), Some(bits)) => up_by_hand(interface, Some(bits)),
            _ => format!("set the host to {rate}"),
        };
        if self.assigned.stored {
            let message = format!("bit rate {rate} takes effect at the next start: power it off; {host}; power it on");
            return NoteText::new(CODE, message);
        }
        let target = &self.assigned.target;
        NoteText::new(CODE, format!("bit rate {rate} takes effect after its activation; then {host}"))
            .command("activate it", format!("cangauge lss activate {target} 1s"))
    }
}

/// The text for an event.
pub(super) fn fact(fact: &LssFact) -> NoteText {
    let text = event(fact);
    match (fact.device.node, fact.device.address, &fact.event) {
        (None, Some(address), event) if !matches!(event, LssEvent::MoreUnconfigured { .. }) => {
            NoteText { message: format!("{address}: {}", text.message), ..text }
        }
        _ => text,
    }
}

fn event(fact: &LssFact) -> NoteText {
    match &fact.event {
        LssEvent::Found { title, free } => {
            let serial = fact.device.address.map(|address| format!("serial {}", address.serial));
            let title = title.clone().unwrap_or_else(|| "an unknown device".to_owned());
            let device = std::iter::once(title).chain(serial).collect::<Vec<_>>().join(", ");
            let free = free.map_or_else(String::new, |free| format!("; node-ID {free} is free"));
            NoteText::new("found", format!("{device}{free}"))
        }
        LssEvent::StandardRateTable => {
            NoteText::new("standard-rate-table", "its own bit rate table is unknown; the table of CiA 305 is used")
        }
        LssEvent::Progress(done) => NoteText::new("progress", progress(done)),
        LssEvent::OtherAnswer(reason) => NoteText::new("other-answer", reason.0.to_string()),
        LssEvent::RetryInStopped => NoteText::new("retry-in-stopped", "no LSS answer; tried again in STOPPED"),
        LssEvent::LeftPreOperational => {
            NoteText::new("left-pre-operational", "now in PRE-OPERATIONAL; its state before is unknown")
        }
        LssEvent::ChangingRate { bit_rate, delay_ms } => {
            NoteText::new("changing-rate", format!("device and host change to {} in {delay_ms} ms", short(*bit_rate)))
        }
        LssEvent::AnswersAt { bit_rate } => NoteText::new("answers", format!("it answers at {}", short(*bit_rate))),
        LssEvent::ObjectsInsteadOfLss => {
            NoteText::new("objects-instead-of-lss", "no LSS answer; its objects are used instead (--via sdo)")
        }
        LssEvent::UnverifiedMethod { doubt } => {
            NoteText::new("unverified-method", format!("no document confirms this method: {doubt}"))
        }
        LssEvent::StoreResetsCobIds => NoteText::new(
            "store-resets-cob-ids",
            "1010h:1 stores every present value, and resets the COB-IDs of 1014h and 180xh:1 to their defaults",
        ),
        LssEvent::SharedNodeId(node) => NoteText::new(
            "shared-node-id",
            format!("another device also has node-ID {node}: a reset would also reset that device, so it is not sent"),
        ),
        LssEvent::AllSlavesChange(sign) => {
            NoteText::new("all-slaves-change", format!("{}: all of them accept the change", another(sign)))
        }
        LssEvent::CannotExcludeOthers(service) => cannot_exclude_others(*service),
        LssEvent::MoreUnconfigured { last, reason } => more_unconfigured(*last, reason.as_ref()),
        LssEvent::NoReturn { bit_rate } => NoteText::new(
            "no-return",
            format!(
                "the device uses {} only after it is stored, so it cannot return to the old bit rate",
                short(*bit_rate)
            ),
        ),
    }
}

fn cannot_exclude_others(service: UnansweredService) -> NoteText {
    let service = match service {
        UnansweredService::Inquire => "the LSS inquiries (5Ah to 5Dh)",
        UnansweredService::Identify => "LSS identify (46h to 4Bh)",
    };
    let message = format!(
        "the device does not support {service}: other devices that are stopped or have no node-ID cannot be excluded"
    );
    NoteText::new("cannot-exclude-others", message)
}

fn more_unconfigured(last: LssAddress, reason: Option<&Reason>) -> NoteText {
    let reason = match reason {
        Some(reason) => reason.0.to_string(),
        None => "the same device answered again".to_owned(),
    };
    let message = format!(
        "more devices than {last} may have no node-ID ({reason}): set the node-ID of this device, then scan again"
    );
    NoteText::new("more-unconfigured", message)
}

/// The progress of a change: `node-ID 12 configured, not stored`.
pub(super) fn progress(progress: &Progress) -> String {
    let word = |what: String, stage: Stage| match stage {
        Stage::NotDone => format!("{what} not configured"),
        Stage::Sent => format!("unknown whether {what} was accepted"),
        Stage::Done => format!("{what} configured"),
        Stage::Reverted => format!("{what} restored"),
    };
    let id = progress.id.map(|(id, stage)| word(format!("node-ID {id}"), stage));
    let rate = progress.rate.map(|(rate, stage)| word(format!("bit rate {}", self::rate(rate)), stage));
    let stored = match progress.stored {
        Stage::NotDone | Stage::Reverted => "not stored",
        Stage::Sent => "unknown whether it is stored",
        Stage::Done => "stored",
    };
    id.into_iter().chain(rate).chain([stored.to_owned()]).collect::<Vec<_>>().join(", ")
}

/// Describes the evidence that more than one device is on the bus.
pub(super) fn another(sign: &AnotherSlave) -> String {
    let several = |what: String| format!("more than one LSS slave answers ({what})");
    match sign {
        AnotherSlave::Nodes(nodes) => {
            let nodes = nodes.iter().map(NodeId::to_string).collect::<Vec<_>>().join(", ");
            format!("several nodes are on the bus: {nodes}")
        }
        AnotherSlave::SharedNodeId(node, sign) => format!("node {node}: {}", duplicate(*sign)),
        AnotherSlave::Answers(first, second) => several(format!("numbers {first} and {second}")),
        AnotherSlave::Collision => several("their answers collide".to_owned()),
        AnotherSlave::OtherSerial(serial) => several(format!("serial number {serial} and another")),
        AnotherSlave::NodeIds => several("their node-IDs differ".to_owned()),
        AnotherSlave::Identities { by_sdo, by_lss } => format!("{by_sdo} answers by SDO, {by_lss} by LSS"),
    }
}

/// Describes the evidence that two devices have the same node-ID.
pub(super) fn duplicate(sign: DuplicateSign) -> &'static str {
    match sign {
        DuplicateSign::OtherMaster => "another master sends requests to it",
        DuplicateSign::AnswersTwice => "its answers arrive twice",
        DuplicateSign::AnswersCollide => "its answers collide",
        DuplicateSign::AnswersDiffer => "its answers to the same request differ",
    }
}

/// A bit rate: `500k`, `auto`, `index 9`.
fn rate(rate: PlannedRate) -> String {
    match rate.bits {
        Some(bits) => short(bits),
        None if rate.is_auto => "auto".to_owned(),
        None => format!("index {}", rate.index),
    }
}

/// A bit rate in short form: `500k`.
pub(super) fn short(bit_rate: u32) -> String {
    short_bit_rate(bit_rate)
}
