//! Lists the CAN interfaces of this host, from sysfs.

use std::fs;
use std::path::Path;

const SYSFS_NET: &str = "/sys/class/net";
/// `ARPHRD_CAN`, the hardware type of CAN interfaces.
const CAN_HARDWARE: &str = "280";
/// `IFF_UP`: the flag of an interface that is up.
const UP: u32 = 1;

/// A CAN interface of this host.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Interface {
    /// The name, for example `can0`.
    pub name: String,
    /// Whether it is up.
    pub up: bool,
    /// The driver, for example `gs_usb`; `None` without hardware (vcan).
    pub driver: Option<String>,
}

/// Lists the CAN interfaces of this host, sorted by name. Empty if there is no sysfs.
pub fn interfaces() -> Vec<Interface> {
    interfaces_in(Path::new(SYSFS_NET))
}

/// Whether the interface is up; `None` if sysfs does not report it.
pub(super) fn is_up(name: &str) -> Option<bool> {
    read_is_up(&Path::new(SYSFS_NET).join(name))
}

fn interfaces_in(net: &Path) -> Vec<Interface> {
    let Ok(entries) = fs::read_dir(net) else { return Vec::new() };
    let mut found: Vec<Interface> = entries
        .flatten()
        .filter(|entry| fs::read_to_string(entry.path().join("type")).is_ok_and(|kind| kind.trim() == CAN_HARDWARE))
        .filter_map(|entry| {
            let driver = fs::read_link(entry.path().join("device/driver")).ok();
            Some(Interface {
                name: entry.file_name().into_string().ok()?,
                up: read_is_up(&entry.path()).unwrap_or(false),
                driver: driver.and_then(|link| Some(link.file_name()?.to_str()?.to_owned())),
            })
        })
        .collect();
    // Numeric order: can2 before can10.
    found.sort_by(|a, b| (a.name.len(), &a.name).cmp(&(b.name.len(), &b.name)));
    found
}

fn read_is_up(interface: &Path) -> Option<bool> {
    let flags = fs::read_to_string(interface.join("flags")).ok()?;
    let flags = u32::from_str_radix(flags.trim().strip_prefix("0x")?, 16).ok()?;
    Some(flags & UP != 0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn can_interfaces_only_and_in_order() {
        let net = tempfile::tempdir().unwrap();
        for (name, kind, flags) in
            [("can10", "280", "0x40080"), ("lo", "772", "0x9"), ("can2", "280", "0x400c1"), ("odd", "280", "?")]
        {
            let dir = net.path().join(name);
            fs::create_dir(&dir).unwrap();
            fs::write(dir.join("type"), format!("{kind}\n")).unwrap();
            fs::write(dir.join("flags"), format!("{flags}\n")).unwrap();
        }
        fs::create_dir(net.path().join("can2/device")).unwrap();
        std::os::unix::fs::symlink("/sys/bus/usb/drivers/gs_usb", net.path().join("can2/device/driver")).unwrap();
        let interface = |name: &str, up, driver: Option<&str>| Interface {
            name: name.to_owned(),
            up,
            driver: driver.map(str::to_owned),
        };
        assert_eq!(
            interfaces_in(net.path()),
            [interface("odd", false, None), interface("can2", true, Some("gs_usb")), interface("can10", false, None)]
        );
        assert_eq!(interfaces_in(&net.path().join("missing")), []);
    }
}
