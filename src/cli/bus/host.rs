//! The interfaces of this machine, as `cangauge bus` shows and sets them.

use crate::output::interfaces::Interface;
use crate::tasks::Failure;

#[cfg(target_os = "linux")]
mod linux {
    use super::{Failure, Interface};
    use crate::bus::socketcan::{Change, Link, State, bring_down, bring_up, interfaces, link};
    use crate::bus::{BusError, Mode};
    use crate::tasks::Kind;
    use crate::tasks::host::{by_hand, not_set};

    /// The interfaces of this machine.
    pub(in super::super) fn list() -> Vec<Interface> {
        let described = |found: crate::bus::socketcan::Interface| {
            // One that is gone by now is told as far as it was seen.
            let about = link(&found.name).ok();
            let up = about.as_ref().map_or(found.up, |link| link.up);
            describe(found.name, up, found.driver, about.as_ref())
        };
        interfaces().into_iter().map(described).collect()
    }

    /// Switches an interface on; what it is then, and what was done.
    pub(in super::super) fn up(
        name: &str,
        bit_rate: Option<u32>,
        listen_only: bool,
    ) -> Result<(Interface, String), Failure> {
        let refused = |error: BusError| match error {
            BusError::Unsupported(message) if bit_rate.is_some() && !listen_only => {
                Failure::new(Kind::Bus, message).hint(format!("switch it on without one: cangauge bus up {name}"))
            }
            error => not_set(error, &by_hand(name, bit_rate)),
        };
        let now = link(name).map_err(refused)?;
        if bit_rate.is_none() && now.is_controller() && !now.up && now.bit_rate().is_none() {
            let message = format!("{name} has no bit rate yet");
            return Err(Failure::new(Kind::Bus, message).hint(format!("give it one: cangauge bus up {name} 250k")));
        }
        let mode = if listen_only { Mode::ListenOnly } else { Mode::Normal };
        let change = bring_up(name, bit_rate, mode).map_err(refused)?;
        Ok((described(name, &change), said(name, &change)))
    }

    /// Switches an interface off; what it is then, and what was done.
    pub(in super::super) fn down(name: &str) -> Result<(Interface, String), Failure> {
        let change = bring_down(name).map_err(|error| not_set(error, &format!("sudo ip link set {name} down")))?;
        Ok((described(name, &change), said(name, &change)))
    }

    fn described(name: &str, change: &Change) -> Interface {
        let driver = interfaces().into_iter().find(|found| found.name == name).and_then(|found| found.driver);
        describe(name.to_owned(), change.after.up, driver, Some(&change.after))
    }

    /// `can0 is up at 250000 bit/s; it was up at 125000 bit/s`.
    fn said(name: &str, change: &Change) -> String {
        let now = state(&change.after);
        let before = state(&change.before);
        match (change.before == change.after, now == before) {
            (true, _) => format!("{name} is {now} already: nothing was changed"),
            (false, true) => format!("{name} is {now}"),
            (false, false) => format!("{name} is {now}; it was {before}"),
        }
    }

    fn state(link: &Link) -> String {
        let mut text = if link.up { "up" } else { "down" }.to_owned();
        if let Some(rate) = link.bit_rate() {
            text.push_str(&format!(" at {rate} bit/s"));
        }
        if link.listen_only == Some(true) {
            text.push_str(", listen-only");
        }
        text
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

#[cfg(target_os = "linux")]
pub(super) use linux::{down, list, up};

#[cfg(not(target_os = "linux"))]
pub(super) fn list() -> Vec<Interface> {
    Vec::new()
}

#[cfg(not(target_os = "linux"))]
pub(super) fn up(name: &str, _: Option<u32>, _: bool) -> Result<(Interface, String), Failure> {
    Err(elsewhere(name))
}

#[cfg(not(target_os = "linux"))]
pub(super) fn down(name: &str) -> Result<(Interface, String), Failure> {
    Err(elsewhere(name))
}

#[cfg(not(target_os = "linux"))]
fn elsewhere(name: &str) -> Failure {
    Failure::new(crate::tasks::Kind::Bus, format!("{name}: this system has no SocketCAN"))
}
