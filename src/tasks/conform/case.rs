//! The cases: what each one checks, and what it needs.

use super::finding::Verdict;
use super::session::Session;
use crate::node::Error;
use std::fmt;
use std::str::FromStr;

/// A group of cases.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Area {
    /// SDO transfers.
    Sdo,
    /// The mandatory objects, and the rules for all objects.
    Od,
    /// NMT commands and states, boot-up.
    Nmt,
    /// Heartbeat and node guarding.
    ErrorControl,
    /// TPDOs and their mapping.
    Pdo,
    /// Emergencies and the error history.
    Emcy,
    /// Storing settings and restoring factory defaults.
    Store,
    /// LSS services.
    Lss,
    /// The analogue inputs of CiA 404.
    Cia404,
    /// The EDS file of the device.
    Eds,
    /// Answer times, jitter, boot-up times: figures without a verdict.
    Timing,
}

impl Area {
    /// All areas, in the order in which they run.
    pub const ALL: [Area; 11] = [
        Area::Sdo,
        Area::Od,
        Area::Nmt,
        Area::ErrorControl,
        Area::Pdo,
        Area::Emcy,
        Area::Store,
        Area::Lss,
        Area::Cia404,
        Area::Eds,
        Area::Timing,
    ];

    /// The name on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Area::Sdo => "sdo",
            Area::Od => "od",
            Area::Nmt => "nmt",
            Area::ErrorControl => "error-control",
            Area::Pdo => "pdo",
            Area::Emcy => "emcy",
            Area::Store => "store",
            Area::Lss => "lss",
            Area::Cia404 => "404",
            Area::Eds => "eds",
            Area::Timing => "timing",
        }
    }

    /// One line that describes the area.
    pub fn title(self) -> &'static str {
        match self {
            Area::Sdo => "SDO transfers",
            Area::Od => "object dictionary",
            Area::Nmt => "NMT states and boot-up",
            Area::ErrorControl => "heartbeat and node guarding",
            Area::Pdo => "TPDOs and mapping",
            Area::Emcy => "emergencies and error history",
            Area::Store => "store and restore",
            Area::Lss => "LSS services",
            Area::Cia404 => "analogue inputs of CiA 404",
            Area::Eds => "EDS file (--eds)",
            Area::Timing => "timing profile: figures without a verdict",
        }
    }

    /// Whether the frames of the area are addressed to the node alone. Other nodes are then not affected.
    pub fn is_local(self) -> bool {
        match self {
            Area::Sdo
            | Area::Od
            | Area::Nmt
            | Area::ErrorControl
            | Area::Emcy
            | Area::Store
            | Area::Cia404
            | Area::Eds
            | Area::Timing => true,
            Area::Pdo | Area::Lss => false,
        }
    }
}

impl fmt::Display for Area {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

impl FromStr for Area {
    type Err = String;

    fn from_str(text: &str) -> Result<Area, String> {
        let names = || Area::ALL.map(Area::name).join(", ");
        Area::ALL
            .into_iter()
            .find(|area| area.name() == text)
            .ok_or_else(|| format!("\"{text}\" is not an area (it is one of: {})", names()))
    }
}

/// How much a deviation matters to users of the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Severity {
    /// Wrong data, or the device cannot be used with other devices.
    High,
    /// Some tools or masters fail, or need a special setting.
    Medium,
    /// It is rarely noticed.
    Low,
}

impl Severity {
    /// The word in reports.
    pub fn name(self) -> &'static str {
        match self {
            Severity::High => "high",
            Severity::Medium => "medium",
            Severity::Low => "low",
        }
    }
}

/// What a case needs besides the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Needs {
    /// Nothing.
    Nothing,
    /// The node is alone on the bus.
    SoleNode,
    /// The option `--store`.
    Store,
    /// Both.
    SoleNodeAndStore,
    /// The option `--stimulus`.
    Stimulus,
}

impl Needs {
    /// The word in lists.
    pub fn name(self) -> Option<&'static str> {
        match self {
            Needs::Nothing => None,
            Needs::SoleNode => Some("no other node"),
            Needs::Store => Some("--store"),
            Needs::SoleNodeAndStore => Some("no other node, --store"),
            Needs::Stimulus => Some("--stimulus"),
        }
    }

    /// Whether the node must be alone on the bus.
    pub fn needs_sole_node(self) -> bool {
        matches!(self, Needs::SoleNode | Needs::SoleNodeAndStore)
    }

    /// Whether the case needs `--store`.
    pub fn needs_store(self) -> bool {
        matches!(self, Needs::Store | Needs::SoleNodeAndStore)
    }
}

/// Runs a case.
pub(super) type Run = fn(&mut Session<'_, '_>) -> Result<Verdict, Error>;

/// One case. The table of all cases runs them, lists them and is printed in the manual page.
#[derive(Clone, Copy)]
pub struct Case {
    /// The number: `SDO-07`.
    pub id: &'static str,
    /// The group.
    pub area: Area,
    /// What the case checks, in one sentence.
    pub sentence: &'static str,
    /// The document and its part.
    pub clause: &'static str,
    /// How much a deviation matters.
    pub severity: Severity,
    /// What a deviation means to users of the device. Empty if the case has no verdict.
    pub meaning: &'static str,
    /// What the case needs.
    pub needs: Needs,
    pub(super) run: Run,
}

impl Case {
    pub(super) const fn new(
        area: Area,
        id: &'static str,
        sentence: &'static str,
        clause: &'static str,
        run: Run,
    ) -> Case {
        Case { id, area, sentence, clause, severity: Severity::Medium, meaning: "", needs: Needs::Nothing, run }
    }

    /// How much a deviation matters, and what it means to users.
    pub(super) const fn matters(self, severity: Severity, meaning: &'static str) -> Case {
        Case { severity, meaning, ..self }
    }

    /// The case sends frames that concern all nodes.
    pub(super) const fn alone(self) -> Case {
        let needs = match self.needs {
            Needs::Nothing | Needs::SoleNode => Needs::SoleNode,
            Needs::Store | Needs::SoleNodeAndStore => Needs::SoleNodeAndStore,
            Needs::Stimulus => Needs::Stimulus,
        };
        Case { needs, ..self }
    }

    /// The case needs another input of the device.
    pub(super) const fn stimulated(self) -> Case {
        Case { needs: Needs::Stimulus, ..self }
    }

    /// The case writes to non-volatile memory, sets a node-ID or a bit rate, or executes autozero.
    pub(super) const fn stores(self) -> Case {
        let needs = match self.needs {
            Needs::Nothing | Needs::Store => Needs::Store,
            Needs::SoleNode | Needs::SoleNodeAndStore => Needs::SoleNodeAndStore,
            Needs::Stimulus => Needs::Stimulus,
        };
        Case { needs, ..self }
    }
}

impl fmt::Debug for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.id)
    }
}
