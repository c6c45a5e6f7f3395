//! Switches interfaces on and off and sets their bit rates. Other settings stay unchanged. Each change is checked by
//! reading the state back, and undone if it failed.

use super::netlink::{self, BitTiming, Link, Refusal};
use crate::bus::{BusError, Mode};
use std::fs;

/// The number of `CAP_NET_ADMIN`, the privilege to configure interfaces.
const NET_ADMIN: u32 = 12;
/// The accepted deviation of the actual bit rate, in parts per thousand. The bit rates of two nodes may differ by about
/// 1 % in total.
const TOLERANCE_PER_MILLE: u64 = 5;

/// A change of an interface.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The interface before the change.
    pub before: Link,
    /// The interface after the change; equal to `before` if there was nothing to do.
    pub after: Link,
}

/// Reads the present state of a CAN interface.
///
/// # Errors
/// There is no interface of that name, or it is not a CAN interface.
pub fn link(name: &str) -> Result<Link, BusError> {
    let link = netlink::get(name).map_err(|refusal| refusal.into_error(&format!("read the state of {name}"), name))?;
    if link.is_can { Ok(link) } else { Err(BusError::NotCan(name.to_owned())) }
}

/// Switches an interface on. If `bit_rate` is given, also sets bit rate and mode: an interface that is up then goes
/// down for a moment.
///
/// # Errors
/// The kernel rejects the change. The interface is then unchanged.
pub fn bring_up(name: &str, bit_rate: Option<u32>, mode: Mode) -> Result<Change, BusError> {
    let before = link(name)?;
    let after = match bit_rate {
        Some(bit_rate) => {
            check_possible(name, &before, bit_rate)?;
            if before.up
                && before.bit_rate().is_some_and(|now| is_near(now, bit_rate))
                && listens_only(&before) == (mode == Mode::ListenOnly)
            {
                before.clone()
            } else {
                retime(name, &before, bit_rate, mode, &mut || ())?
            }
        }
        None if before.up => before.clone(),
        None => switch(name, &before, true)?,
    };
    Ok(Change { before, after })
}

/// Switches an interface off.
///
/// # Errors
/// The kernel rejects the change.
pub fn bring_down(name: &str) -> Result<Change, BusError> {
    let before = link(name)?;
    let after = if before.up { switch(name, &before, false)? } else { before.clone() };
    Ok(Change { before, after })
}

/// Checks whether this process can set the bit rate of the interface.
///
/// # Errors
/// The interface is not a controller, or the privilege is missing.
pub(super) fn can_set_bit_rate(name: &str) -> Result<(), BusError> {
    check_controller(name, &link(name)?)?;
    // If the privilege is unknown, the kernel decides later.
    if fs::read_to_string("/proc/self/status").is_ok_and(|status| has_net_admin(&status) == Some(false)) {
        return Err(BusError::Permission(format!("set the bit rate of {name}")));
    }
    Ok(())
}

/// Sets bit rate and mode of an interface and switches it on. `while_down` is called while the interface is down.
///
/// # Errors
/// The kernel rejects the change. The interface is then restored; if this also fails, the error reports it.
pub(super) fn retime(
    name: &str,
    before: &Link,
    bit_rate: u32,
    mode: Mode,
    while_down: &mut dyn FnMut(),
) -> Result<Link, BusError> {
    check_possible(name, before, bit_rate)?;
    let listens = mode == Mode::ListenOnly;
    if listens && before.can_listen_only == Some(false) {
        return Err(listen_only_unsupported(name));
    }
    // The mode is not set on a controller that does not support it.
    let listen_only = (listens || before.listen_only.is_some()).then_some(listens);
    let doing = format!("set the bit rate of {name} to {bit_rate} bit/s");
    let work = |while_down: &mut dyn FnMut()| {
        if before.up {
            switch(name, before, false)?;
        }
        while_down();
        netlink::configure(before, BitTiming::of_rate(bit_rate), listen_only)
            .map_err(|refusal| explain(refusal, &doing, name, bit_rate, listens))?;
        let now = switch(name, before, true)?;
        let actual = now.bit_rate().unwrap_or(0);
        if !is_near(actual, bit_rate) {
            let why = format!("the nearest possible is {actual} bit/s");
            return Err(BusError::BitRate { name: name.to_owned(), bit_rate, why });
        }
        if listens_only(&now) != listens {
            return Err(if listens {
                listen_only_unsupported(name)
            } else {
                unchanged(name, "it is still in listen-only mode")
            });
        }
        Ok(now)
    };
    work(while_down).map_err(|error| match restore(name, before, &mut || ()) {
        Ok(()) => error,
        Err(restore_error) => not_restored(error, &restore_error),
    })
}

/// Restores the former state of an interface.
///
/// # Errors
/// The kernel rejects the change; the error describes the present state.
pub(super) fn restore(name: &str, before: &Link, while_down: &mut dyn FnMut()) -> Result<(), BusError> {
    let mut now = link(name)?;
    let timing = before.bit_timing.or(now.bit_timing);
    let differs = now.bit_timing != timing || now.listen_only != before.listen_only;
    if !differs && now.up == before.up {
        return Ok(());
    }
    if now.up {
        now = switch(name, &now, false)?;
    }
    while_down();
    // An interface without a former bit rate keeps the last one: the kernel cannot clear it.
    if differs && let Some(timing) = timing {
        let set = |timing| netlink::configure(&now, timing, before.listen_only);
        // Time quanta give exactly the same bit timing. If the driver rejects them, the bit rate is used.
        set(timing.to_request())
            .or_else(|_| set(BitTiming::of_rate(timing.bit_rate)))
            .map_err(|refusal| refusal.into_error(&format!("restore {name} to {} bit/s", timing.bit_rate), name))?;
    }
    now = if before.up { switch(name, &now, true)? } else { link(name)? };
    if now.bit_rate() == timing.map(|timing| timing.bit_rate) && now.listen_only == before.listen_only {
        Ok(())
    } else {
        Err(unchanged(name, "its former state is not restored"))
    }
}

/// Switches an interface on or off, and reads its state back.
fn switch(name: &str, link: &Link, up: bool) -> Result<Link, BusError> {
    let direction = if up { "up" } else { "down" };
    netlink::switch(link, up).map_err(|refusal| refusal.into_error(&format!("bring {name} {direction}"), name))?;
    let now = self::link(name)?;
    if now.up == up { Ok(now) } else { Err(unchanged(name, &format!("it did not go {direction}"))) }
}

/// Whether an actual bit rate is close enough to the requested bit rate.
fn is_near(actual: u32, bit_rate: u32) -> bool {
    u64::from(actual.abs_diff(bit_rate)) * 1000 <= u64::from(bit_rate) * TOLERANCE_PER_MILLE
}

fn check_possible(name: &str, link: &Link, bit_rate: u32) -> Result<(), BusError> {
    check_controller(name, link)?;
    let why = match &link.fixed_rates {
        Some(rates) if !rates.is_empty() && !rates.contains(&bit_rate) => {
            let rates: Vec<String> = rates.iter().map(u32::to_string).collect();
            format!("it supports {}", rates.join(", "))
        }
        _ => match link.rate_max {
            Some(highest) if bit_rate > highest => format!("its highest is {highest} bit/s"),
            _ => return Ok(()),
        },
    };
    Err(BusError::BitRate { name: name.to_owned(), bit_rate, why })
}

fn check_controller(name: &str, link: &Link) -> Result<(), BusError> {
    if link.is_controller() {
        return Ok(());
    }
    Err(BusError::Unsupported(match &link.kind {
        Some(kind) => format!("{name} is virtual ({kind}): it has no bit rate"),
        None => format!("{name}: the bit rate of this interface cannot be set"),
    }))
}

fn listens_only(link: &Link) -> bool {
    link.listen_only.unwrap_or(false)
}

fn listen_only_unsupported(name: &str) -> BusError {
    BusError::Unsupported(format!("{name} has no listen-only mode: its driver does not support it"))
}

fn unchanged(name: &str, what: &str) -> BusError {
    let source = std::io::Error::other(what.to_owned());
    BusError::Io { what: format!("the change of {name} had no effect"), source }
}

/// Explains why the kernel rejected a bit rate.
fn explain(refusal: Refusal, doing: &str, name: &str, bit_rate: u32, listens: bool) -> BusError {
    match refusal.code() {
        Some(libc::EINVAL | libc::EDOM | libc::ERANGE) => {
            let why = refusal.words.unwrap_or_else(|| refusal.error.to_string());
            BusError::BitRate { name: name.to_owned(), bit_rate, why }
        }
        Some(libc::EOPNOTSUPP) if listens => listen_only_unsupported(name),
        _ => refusal.into_error(doing, name),
    }
}

/// Combines an error with a second one that occurred while restoring.
fn not_restored(error: BusError, restore_error: &BusError) -> BusError {
    let what = format!("{error}; the former state could not be restored");
    BusError::Io { what, source: std::io::Error::other(restore_error.to_string()) }
}

/// Whether a process may configure interfaces, according to its `/proc/PID/status`.
fn has_net_admin(status: &str) -> Option<bool> {
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    Some(u64::from_str_radix(effective.trim(), 16).ok()? >> NET_ADMIN & 1 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_privilege_is_read_from_the_process_status() {
        let status =
            |effective: &str| format!("Name:\tcat\nCapPrm:\t000001ffffffffff\nCapEff:\t{effective}\nCapBnd:\t0\n");
        assert_eq!(has_net_admin(&status("000001ffffffffff")), Some(true));
        assert_eq!(has_net_admin(&status("0000000000001000")), Some(true));
        assert_eq!(has_net_admin(&status("0000000000000000")), Some(false));
        assert_eq!(has_net_admin(&status("000001ffffffefff")), Some(false));
        assert_eq!(has_net_admin(&status("?")), None);
        assert_eq!(has_net_admin(""), None);
    }
}
