//! The command that a scenario runs, with its arguments.

use cangauge::canopen::nmt::NmtCommand;
use cangauge::canopen::object::ObjectId;
use cangauge::master::BlockMode;
use cangauge::tasks::lss::Via;
use std::fmt;

#[derive(Clone, Debug)]
pub(crate) enum Target {
    Node(u8),
    /// The identity of the device at this place of the bench.
    Identity(usize),
    Only,
    Unconfigured,
}

/// The options of an SDO transfer.
#[derive(Clone, Copy, Debug)]
pub(crate) struct How {
    pub(crate) blocks: BlockMode,
    /// Whether the user names the device description.
    pub(crate) described: bool,
}

/// An expression: the signal's value must be within the limits, inclusive.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Expected {
    pub(crate) signal: &'static str,
    pub(crate) low: f64,
    pub(crate) high: f64,
}

impl fmt::Display for Expected {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} in {}..{}", self.signal, self.low, self.high)
    }
}

/// The source of the values for `check`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Measuring {
    /// One reading by SDO.
    Once,
    AsSent {
        for_ms: u64,
    },
    Sync {
        ms: u64,
        for_ms: u64,
    },
    Poll {
        ms: u64,
        for_ms: u64,
    },
}

#[derive(Clone, Debug)]
pub(crate) enum Command {
    Scan {
        nodes: Vec<u8>,
    },
    Read {
        nodes: Vec<u8>,
    },
    Info {
        node: u8,
    },
    PdoShow {
        node: u8,
    },
    SdoRead {
        node: u8,
        object: ObjectId,
        how: How,
    },
    SdoWrite {
        node: u8,
        object: ObjectId,
        bytes: Vec<u8>,
        how: How,
    },
    Nmt {
        what: NmtCommand,
        nodes: Vec<u8>,
        all: bool,
    },
    NmtState {
        nodes: Vec<u8>,
    },
    NmtWatch {
        nodes: Vec<u8>,
        ask: bool,
        for_ms: u64,
    },
    NmtProbe {
        node: u8,
    },
    Startup {
        node: u8,
        auto: bool,
    },
    LssScan,
    LssInquire {
        target: Target,
    },
    LssStore {
        target: Target,
        force: bool,
    },
    /// Without a target: all slaves.
    LssActivate {
        target: Option<Target>,
        delay_ms: u16,
        force: bool,
    },
    /// Looks for the device at this place. The range of serial numbers extends this far around its own.
    LssIdentify {
        place: usize,
        around: u32,
    },
    Assign {
        target: Target,
        id: Option<u8>,
        rate: Option<u32>,
        store: bool,
        retime: bool,
        via: Via,
        force: bool,
    },
    Map {
        node: u8,
        number: u16,
        items: Vec<&'static str>,
        code: Option<u8>,
        timer_ms: Option<u16>,
        cob_id: Option<u16>,
        keep: bool,
    },
    /// `config apply` with these settings.
    Configure {
        node: u8,
        heartbeat_ms: u16,
        timer_ms: Option<u16>,
        digits: Option<u8>,
    },
    Autozero {
        node: u8,
        channel: Option<u8>,
        force: bool,
        store: bool,
        dry_run: bool,
    },
    Store {
        node: u8,
        group: u8,
        verify: bool,
    },
    Restore {
        node: u8,
        group: u8,
        reset: bool,
    },
    Unit {
        node: u8,
        signal: Option<&'static str>,
        unit: u32,
    },
    Filter {
        node: u8,
        kind: u8,
        constant: Option<u16>,
    },
    Limits {
        node: u8,
        lower: f64,
        upper: f64,
    },
    Errors {
        node: u8,
        clear: bool,
    },
    Minmax {
        node: u8,
    },
    PdoWatch {
        nodes: Vec<u8>,
        for_ms: u64,
    },
    Check {
        nodes: Vec<u8>,
        expected: Vec<Expected>,
        how: Measuring,
        excuse: bool,
    },
    /// Finds the bit rate of the bus.
    Detect {
        ask: bool,
        each_ms: u64,
    },
    Log {
        nodes: Vec<u8>,
        sync_ms: Option<u64>,
        poll_ms: Option<u64>,
        duration_ms: u64,
        count: Option<u64>,
        nmt: bool,
    },
}

impl Command {
    /// The nodes of a command that takes several.
    pub(crate) fn nodes_mut(&mut self) -> Option<&mut Vec<u8>> {
        match self {
            Command::Scan { nodes }
            | Command::Read { nodes }
            | Command::Nmt { nodes, .. }
            | Command::NmtState { nodes }
            | Command::NmtWatch { nodes, .. }
            | Command::PdoWatch { nodes, .. }
            | Command::Check { nodes, .. }
            | Command::Log { nodes, .. } => Some(nodes),
            _ => None,
        }
    }

    /// Whether the command names a device by its place on the bench.
    pub(crate) fn counts_places(&self) -> bool {
        let target = match self {
            Command::LssIdentify { .. } => return true,
            Command::LssInquire { target } | Command::LssStore { target, .. } | Command::Assign { target, .. } => {
                target
            }
            Command::LssActivate { target: Some(target), .. } => target,
            _ => return false,
        };
        matches!(target, Target::Identity(_))
    }

    pub(crate) fn is_lss(&self) -> bool {
        matches!(
            self,
            Command::LssScan
                | Command::LssInquire { .. }
                | Command::LssStore { .. }
                | Command::LssActivate { .. }
                | Command::LssIdentify { .. }
                | Command::Assign { .. }
        )
    }
}
