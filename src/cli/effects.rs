//! The effects of the commands on the devices and the bus.

use super::Command;
use cangauge::master::OnTwoDevices;

impl Command {
    /// Whether the command only reads objects.
    pub(super) fn only_reads(&self) -> bool {
        match self {
            Command::Scan(_) | Command::Read(_) | Command::Info(_) | Command::Doctor(_) => true,
            Command::Objects(_) | Command::Devices(_) | Command::Export(_) | Command::Health(_) => true,
            Command::Sdo(sdo) => sdo.only_reads(),
            _ => false,
        }
    }

    /// Whether the command only listens. An adapter then sends no acknowledgement.
    pub(super) fn listens_only(&self) -> bool {
        match self {
            Command::Scan(scan) => scan.passive,
            Command::Info(info) => info.passive,
            Command::Log(log) => log.passive,
            Command::Doctor(doctor) => doctor.passive,
            Command::Monitor(_) => true,
            Command::Health(health) => health.passive,
            _ => false,
        }
    }

    /// Returns the reaction if two devices have the same node-ID.
    pub(super) fn on_two_devices(&self) -> OnTwoDevices {
        let writes = match self {
            Command::Scan(_) => return OnTwoDevices::Report,
            Command::Sdo(sdo) => !sdo.only_reads(),
            Command::Unit(unit) => unit.writes(),
            Command::Filter(filter) => filter.writes(),
            Command::Limits(limits) => limits.writes(),
            Command::Minmax(minmax) => minmax.reset,
            Command::Errors(errors) => errors.clear,
            Command::Pdo(pdo) => pdo.writes(),
            Command::Nmt(nmt) => nmt.writes(),
            Command::Config(config) => !config.only_reads(),
            Command::Conform(conform) => !conform.only_reads(),
            Command::Lss(_) | Command::Autozero(_) | Command::Tare(_) | Command::Store(_) | Command::Restore(_) => true,
            _ => false,
        };
        if writes { OnTwoDevices::RefuseWrites } else { OnTwoDevices::Fail }
    }

    /// Whether the command changes devices in a way that affects later commands.
    pub(super) fn changes_devices(&self) -> bool {
        match self {
            Command::Lss(lss) => lss.changes_devices(),
            Command::Nmt(nmt) => nmt.changes_devices(),
            Command::Autozero(autozero) => !autozero.dry_run,
            Command::Conform(_) => false,
            _ => self.on_two_devices() == OnTwoDevices::RefuseWrites,
        }
    }
}
