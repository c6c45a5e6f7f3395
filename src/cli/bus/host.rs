//! Lists and sets the interfaces of this computer for `cangauge bus`.

use cangauge::output::interfaces::Interface;
use cangauge::tasks::Failure;

/// An interface before and after it was set.
pub(super) struct Changed {
    pub(super) before: Interface,
    pub(super) after: Interface,
}

#[cfg(all(target_os = "linux", not(without_socketcan)))]
mod linux {
    use super::{Changed, Failure, Interface};
    use cangauge::bus::Mode;
    use cangauge::bus::socketcan::{Change, Link, State, bring_down, bring_up, interfaces, link};
    use cangauge::tasks::host::{HostAction, HostFailure, not_set};

    /// The interfaces of this computer.
    pub(in crate::cli) fn list() -> Vec<Interface> {
        let described = |found: cangauge::bus::socketcan::Interface| {
            // The interface may have been removed in the meantime.
            let link = link(&found.name).ok();
            let up = link.as_ref().map_or(found.up, |link| link.up);
            describe(found.name, up, found.driver, link.as_ref())
        };
        interfaces().into_iter().map(described).collect()
    }

    /// Brings an interface up.
    pub(in super::super) fn up(name: &str, bit_rate: Option<u32>, listen_only: bool) -> Result<Changed, Failure> {
        let interface = name.to_owned();
        let action = HostAction::Up { interface: interface.clone(), bit_rate, listen_only };
        let now = link(name).map_err(|error| not_set(error, action.clone()))?;
        if bit_rate.is_none() && now.is_controller() && !now.up && now.bit_rate().is_none() {
            return Err(Failure::general(HostFailure::NoBitRate { interface }));
        }
        let mode = if listen_only { Mode::ListenOnly } else { Mode::Normal };
        let change = bring_up(name, bit_rate, mode).map_err(|error| not_set(error, action))?;
        Ok(changed(name, &change))
    }

    /// Brings an interface down.
    pub(in super::super) fn down(name: &str) -> Result<Changed, Failure> {
        let action = HostAction::Down { interface: name.to_owned() };
        let change = bring_down(name).map_err(|error| not_set(error, action))?;
        Ok(changed(name, &change))
    }

    fn changed(name: &str, change: &Change) -> Changed {
        let driver = interfaces().into_iter().find(|found| found.name == name).and_then(|found| found.driver);
        let describe = |link: &Link| describe(name.to_owned(), link.up, driver.clone(), Some(link));
        Changed { before: describe(&change.before), after: describe(&change.after) }
    }

    fn describe(interface: String, up: bool, driver: Option<String>, link: Option<&Link>) -> Interface {
        let Some(link) = link else { return Interface { interface, up, driver, ..Interface::default() } };
        Interface {
            interface,
            up,
            driver,
            kind: link.kind.clone(),
            bit_rate: link.bit_rate(),
            sample_point: link.bit_timing.map(|timing| f64::from(timing.sample_point) / 1000.0),
            state: link.state.map(State::as_str),
            listen_only: link.listen_only,
            restart_ms: link.restart_ms,
            tx_errors: link.errors.map(|(sending, _)| sending),
            rx_errors: link.errors.map(|(_, receiving)| receiving),
            bit_rates: link.fixed_rates.clone(),
        }
    }
}

#[cfg(all(target_os = "linux", not(without_socketcan)))]
pub(in crate::cli) use linux::list;
#[cfg(all(target_os = "linux", not(without_socketcan)))]
pub(super) use linux::{down, up};

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
pub(in crate::cli) fn list() -> Vec<Interface> {
    Vec::new()
}

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
pub(super) fn up(name: &str, _: Option<u32>, _: bool) -> Result<Changed, Failure> {
    Err(unsupported(name))
}

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
pub(super) fn down(name: &str) -> Result<Changed, Failure> {
    Err(unsupported(name))
}

#[cfg(not(all(target_os = "linux", not(without_socketcan))))]
fn unsupported(name: &str) -> Failure {
    use cangauge::tasks::host::{HostAction, not_set};
    let error = cangauge::bus::BusError::Unsupported(format!("{name}: this system has no SocketCAN"));
    not_set(error, HostAction::Down { interface: name.to_owned() })
}
