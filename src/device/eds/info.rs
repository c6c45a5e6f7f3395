//! `[DeviceInfo]`, `[FileInfo]` and `[DeviceCommissioning]`.

use super::ini::{Ini, Section};
use super::text::{quoted, shown};
use super::{Commissioning, Info, Warning, value};
use crate::canopen::id::NodeId;

/// The bit rates of CiA 301 in kbit/s, as in the keys `BaudRate_10` …
const BIT_RATES: [u32; 8] = [10, 20, 50, 125, 250, 500, 800, 1000];

pub(super) fn info(ini: &Ini, warnings: &mut Vec<Warning>) -> Info {
    let version = ini.section("fileinfo").and_then(|section| section.get("edsversion"));
    let mut info =
        Info { eds_version: version.map_or_else(|| "3.0".to_owned(), |item| shown(&item.value)), ..Info::default() };
    let Some(section) = ini.section("deviceinfo") else {
        return info;
    };
    info.vendor_name = text(section, "VendorName");
    info.vendor_number = number(section, "VendorNumber", warnings);
    info.product_name = text(section, "ProductName");
    info.product_number = number(section, "ProductNumber", warnings);
    info.revision_number = number(section, "RevisionNumber", warnings);
    info.order_code = text(section, "OrderCode");
    info.lss_supported = switch(section, "LSS_Supported", warnings);
    info.bit_rates = BIT_RATES
        .into_iter()
        .filter(|rate| switch(section, &format!("BaudRate_{rate}"), warnings) == Some(true))
        .map(|rate| rate * 1000)
        .collect();
    info
}

pub(super) fn commissioning(ini: &Ini, warnings: &mut Vec<Warning>) -> Option<Commissioning> {
    let spellings = ["devicecomissioning", "devicecommissioning", "devicecommisioning"];
    let section = spellings.iter().find_map(|name| ini.section(name))?;
    Some(Commissioning {
        node_id: node_id(section, warnings),
        node_name: text(section, "NodeName"),
        bit_rate: bit_rate(section, warnings),
        net_number: number(section, "NetNumber", warnings),
        network_name: text(section, "NetworkName"),
        manager: switch(section, "CANopenManager", warnings),
        lss_serial: number(section, "LSS_SerialNumber", warnings),
    })
}

fn node_id(section: &Section, warnings: &mut Vec<Warning>) -> Option<NodeId> {
    let number = number(section, "NodeID", warnings)?;
    let node = u8::try_from(number).ok().and_then(|id| NodeId::new(id).ok());
    if let (None, Some(item)) = (node, section.get("nodeid")) {
        warnings.push(Warning::new(item.line, format!("NodeID: {number} is not a node-ID (1 to 127)")));
    }
    node
}

/// Returns the bit rate in bit/s. The unit in the file is kbit/s; numbers above 1000 are bit/s, as some tools write
/// them.
fn bit_rate(section: &Section, warnings: &mut Vec<Warning>) -> Option<u32> {
    let number = number(section, "Baudrate", warnings)?;
    if number <= 1000 {
        return (number > 0).then_some(number * 1000);
    }
    let line = section.get("baudrate").map_or(section.line, |item| item.line);
    if number.is_multiple_of(1000) && number <= 1_000_000 {
        warnings.push(Warning::new(line, format!("Baudrate: {number} kbit/s is not a CAN bit rate; read as bit/s")));
        return Some(number);
    }
    warnings.push(Warning::new(line, format!("Baudrate: {number} kbit/s is not a CAN bit rate")));
    None
}

fn text(section: &Section, key: &str) -> Option<String> {
    section.get(&key.to_ascii_lowercase()).map(|item| item.value.clone())
}

fn number(section: &Section, key: &str, warnings: &mut Vec<Warning>) -> Option<u32> {
    let item = section.get(&key.to_ascii_lowercase())?;
    let reading = value::integer(&item.value);
    let number = reading.as_ref().and_then(|reading| u32::try_from(reading.value).ok());
    let doubt = match (number, reading.and_then(|reading| reading.doubt)) {
        (Some(_), doubt) => doubt,
        (None, _) => Some(format!("{} is not a 32-bit number", quoted(&item.value))),
    };
    warnings.extend(doubt.map(|doubt| Warning::new(item.line, format!("[{}] {key}: {doubt}", section.shown))));
    number
}

fn switch(section: &Section, key: &str, warnings: &mut Vec<Warning>) -> Option<bool> {
    let item = section.get(&key.to_ascii_lowercase())?;
    let on = value::switch(&item.value);
    if on.is_none() {
        let text = format!("[{}] {key}: {} is neither 0 nor 1", section.shown, quoted(&item.value));
        warnings.push(Warning::new(item.line, text));
    }
    on
}
