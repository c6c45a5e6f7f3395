//! Switches interfaces on and off and sets their bit rates. What is not asked for stays as it is, what could not
//! be done is undone, and what is reported as done has been read back.

use super::netlink::{self, BitTiming, Link, Refusal};
use crate::bus::{BusError, Mode};
use std::fs;

/// `CAP_NET_ADMIN`, the right to set interfaces.
const NET_ADMIN: u32 = 12;
/// How far the rate that the hardware makes may be off, in parts per thousand: both sides of a bus share what
/// its bits can bear, some 1 %.
const TOLERANCE: u64 = 5;

/// What was done.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Change {
    /// The interface before.
    pub before: Link,
    /// And now; the same where nothing had to be done.
    pub after: Link,
}

/// The CAN interface of that name as it is now.
///
/// # Errors
/// There is none of that name, or it is no CAN interface.
pub fn link(name: &str) -> Result<Link, BusError> {
    let link = netlink::get(name).map_err(|refusal| refusal.into_error(&format!("ask about {name}"), name))?;
    if link.is_can { Ok(link) } else { Err(BusError::NotCan(name.to_owned())) }
}

/// Switches an interface on; with a rate and a mode where they are given, for which one that is up goes down
/// for a moment.
///
/// # Errors
/// What the kernel says; the interface is then as it was.
pub fn bring_up(name: &str, bit_rate: Option<u32>, mode: Mode) -> Result<Change, BusError> {
    let before = link(name)?;
    let after = match bit_rate {
        Some(bit_rate) => {
            is_possible(name, &before, bit_rate)?;
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
/// What the kernel says.
pub fn bring_down(name: &str) -> Result<Change, BusError> {
    let before = link(name)?;
    let after = if before.up { switch(name, &before, false)? } else { before.clone() };
    Ok(Change { before, after })
}

/// Whether the bit rate of this interface can be set from here.
///
/// # Errors
/// Why not.
pub(super) fn can_set_bit_rate(name: &str) -> Result<(), BusError> {
    is_controller(name, &link(name)?)?;
    // Where the system does not tell, the kernel will when it comes to it.
    if fs::read_to_string("/proc/self/status").is_ok_and(|status| has_net_admin(&status) == Some(false)) {
        return Err(BusError::Permission(format!("set the bit rate of {name}")));
    }
    Ok(())
}

/// Takes an interface to another bit rate and mode and leaves it up. `while_down` is called while it is down.
///
/// # Errors
/// What the kernel says; the interface is then as it was, or the error says that it is not.
pub(super) fn retime(
    name: &str,
    before: &Link,
    bit_rate: u32,
    mode: Mode,
    while_down: &mut dyn FnMut(),
) -> Result<Link, BusError> {
    is_possible(name, before, bit_rate)?;
    let listens = mode == Mode::ListenOnly;
    if listens && before.can_listen_only == Some(false) {
        return Err(no_listening(name));
    }
    // A controller that knows no such mode is not asked to leave it.
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
        let made = now.bit_rate().unwrap_or(0);
        if !is_near(made, bit_rate) {
            let why = format!("it comes no nearer than {made} bit/s");
            return Err(BusError::BitRate { name: name.to_owned(), bit_rate, why });
        }
        if listens_only(&now) != listens {
            return Err(if listens { no_listening(name) } else { unchanged(name, "it still only listens") });
        }
        Ok(now)
    };
    work(while_down).map_err(|error| match put_back(name, before, &mut || ()) {
        Ok(()) => error,
        Err(worse) => not_put_back(error, &worse),
    })
}

/// Makes an interface what it was.
///
/// # Errors
/// What the kernel says, and what the interface now is.
pub(super) fn put_back(name: &str, before: &Link, while_down: &mut dyn FnMut()) -> Result<(), BusError> {
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
    // One that had no rate keeps the last one: the kernel has no way back to none.
    if differs && let Some(timing) = timing {
        let set = |timing| netlink::configure(&now, timing, before.listen_only);
        // Quanta give the very same bits; a driver that takes none gets the rate.
        set(timing.again())
            .or_else(|_| set(BitTiming::of_rate(timing.bit_rate)))
            .map_err(|refusal| refusal.into_error(&format!("put {name} back to {} bit/s", timing.bit_rate), name))?;
    }
    now = if before.up { switch(name, &now, true)? } else { link(name)? };
    if now.bit_rate() == timing.map(|timing| timing.bit_rate) && now.listen_only == before.listen_only {
        Ok(())
    } else {
        Err(unchanged(name, "it is not what it was"))
    }
}

/// Switches an interface on or off, and reads it back.
fn switch(name: &str, link: &Link, up: bool) -> Result<Link, BusError> {
    let direction = if up { "up" } else { "down" };
    netlink::switch(link, up).map_err(|refusal| refusal.into_error(&format!("bring {name} {direction}"), name))?;
    let now = self::link(name)?;
    if now.up == up { Ok(now) } else { Err(unchanged(name, &format!("it did not go {direction}"))) }
}

/// Whether an interface that makes one rate is at the other, which was asked for.
fn is_near(made: u32, bit_rate: u32) -> bool {
    u64::from(made.abs_diff(bit_rate)) * 1000 <= u64::from(bit_rate) * TOLERANCE
}

fn is_possible(name: &str, link: &Link, bit_rate: u32) -> Result<(), BusError> {
    is_controller(name, link)?;
    let why = match &link.fixed_rates {
        Some(rates) if !rates.is_empty() && !rates.contains(&bit_rate) => {
            let rates: Vec<String> = rates.iter().map(u32::to_string).collect();
            format!("it has {}", rates.join(", "))
        }
        _ => match link.rate_max {
            Some(most) if bit_rate > most => format!("its highest is {most} bit/s"),
            _ => return Ok(()),
        },
    };
    Err(BusError::BitRate { name: name.to_owned(), bit_rate, why })
}

fn is_controller(name: &str, link: &Link) -> Result<(), BusError> {
    if link.is_controller() {
        return Ok(());
    }
    Err(BusError::Unsupported(match &link.kind {
        Some(kind) => format!("{name} is virtual ({kind}): it has no bit rate"),
        None => format!("{name} has no bit rate that could be set"),
    }))
}

fn listens_only(link: &Link) -> bool {
    link.listen_only.unwrap_or(false)
}

fn no_listening(name: &str) -> BusError {
    BusError::Unsupported(format!("{name} cannot only listen: its driver has no such mode"))
}

fn unchanged(name: &str, what: &str) -> BusError {
    let source = std::io::Error::other(what.to_owned());
    BusError::Io { what: format!("{name} was told, and said yes"), source }
}

/// What the kernel's refusal of a bit rate means.
fn explain(refusal: Refusal, doing: &str, name: &str, bit_rate: u32, listens: bool) -> BusError {
    match refusal.code() {
        Some(libc::EINVAL | libc::EDOM | libc::ERANGE) => {
            let why = refusal.words.unwrap_or_else(|| refusal.error.to_string());
            BusError::BitRate { name: name.to_owned(), bit_rate, why }
        }
        Some(libc::EOPNOTSUPP) if listens => no_listening(name),
        _ => refusal.into_error(doing, name),
    }
}

/// An error, and a worse one that came of it.
fn not_put_back(error: BusError, worse: &BusError) -> BusError {
    let what = format!("{error}; and it could not be put back as it was");
    BusError::Io { what, source: std::io::Error::other(worse.to_string()) }
}

/// Whether a process may set interfaces, by its `/proc/PID/status`.
fn has_net_admin(status: &str) -> Option<bool> {
    let effective = status.lines().find_map(|line| line.strip_prefix("CapEff:"))?;
    Some(u64::from_str_radix(effective.trim(), 16).ok()? >> NET_ADMIN & 1 != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_right_to_set_interfaces() {
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
