//! Writes the DCF of `config dump --dcf` (CiA 306), for other tools.

use super::text::safe;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::device::scalar::Scalar;
use crate::tasks::config::Snapshot;
use std::collections::BTreeSet;
use std::io::{self, Write};

/// Writes the settings of a device.
///
/// # Errors
/// `out` cannot be written.
pub fn write_dcf(snapshot: &Snapshot, out: &mut dyn Write) -> io::Result<()> {
    let (node, objects) = (&snapshot.node, snapshot.dcf_objects());
    let identity = &node.identity;
    let description = node.model.as_ref().map(|model| &model.description);
    writeln!(out, "; Settings of node {}, written by cangauge config dump --dcf. It has no calibration.", node.id)?;
    writeln!(out, "[FileInfo]\nEDSVersion=4.0\nCreatedBy=cangauge\n\n[DeviceInfo]")?;
    let vendor = description.map_or("", |description| description.vendor.as_str());
    let product = description.map_or("", |description| description.title.as_str());
    writeln!(out, "VendorName={}\nProductName={}", safe(vendor), safe(product))?;
    let numbers =
        [("VendorNumber", identity.vendor), ("ProductNumber", identity.product), ("RevisionNumber", identity.revision)];
    for (key, number) in numbers {
        number.map_or(Ok(()), |number| writeln!(out, "{key}=0x{number:X}"))?;
    }
    writeln!(out, "\n[DeviceComissioning]\nNodeID={}", node.id)?;
    snapshot.bit_rate().map_or(Ok(()), |rate| writeln!(out, "Baudrate={}", rate / 1000))?;
    identity.serial.map_or(Ok(()), |serial| writeln!(out, "LSS_SerialNumber={serial}"))?;
    let indices: BTreeSet<u16> = objects.keys().map(|object| object.index).collect();
    let is_manufacturer = |index: &&u16| (0x2000..0x6000).contains(*index);
    let (manufacturer, others): (Vec<&u16>, Vec<&u16>) = indices.iter().partition(is_manufacturer);
    for (section, list) in [("Mandatory", Vec::new()), ("Optional", others), ("Manufacturer", manufacturer)] {
        writeln!(out, "\n[{section}Objects]\nSupportedObjects={}", list.len())?;
        (1..).zip(list).try_for_each(|(at, index)| writeln!(out, "{at}=0x{index:04X}"))?;
    }
    for index in indices {
        let of_index = objects.iter().filter(|(object, _)| object.index == index);
        let subs: Vec<(&ObjectId, &(DataType, Scalar))> = of_index.collect();
        let is_variable = matches!(subs[..], [(object, _)] if object.sub == 0);
        if !is_variable {
            let count = subs.len() + usize::from(subs[0].0.sub != 0);
            let name = node.entry(ObjectId::new(index, 1)).map_or_else(|| format!("{index:04X}h"), |entry| entry.name);
            writeln!(out, "\n[{index:04X}]\nParameterName={}\nObjectType=0x9\nSubNumber={count}", safe(&name))?;
            if let (true, Some((last, _))) = (subs[0].0.sub != 0, subs.last()) {
                writeln!(out, "\n[{index:04X}sub0]\nParameterName=entries\nObjectType=0x7\nDataType=0x0005")?;
                writeln!(out, "AccessType=ro\nDefaultValue={}\nPDOMapping=0", last.sub)?;
            }
        }
        for (object, (data_type, value)) in subs {
            let section = if is_variable { String::new() } else { format!("sub{:X}", object.sub) };
            writeln!(out, "\n[{index:04X}{section}]\nParameterName={}", safe(&node.name_of(*object)))?;
            let code = (1..=0x1b).find(|code| DataType::from_code(*code) == Some(*data_type)).unwrap_or(0x0f);
            writeln!(out, "ObjectType=0x7\nDataType=0x{code:04X}\nAccessType=rw\nPDOMapping=0")?;
            writeln!(out, "ParameterValue={}", text(*data_type, value))?;
        }
    }
    Ok(())
}

/// Formats a value as in CiA 306, with unsigned integers in hexadecimal.
fn text(data_type: DataType, value: &Scalar) -> String {
    match value {
        Scalar::Integer(number) if matches!(data_type, DataType::Unsigned(_)) => format!("0x{number:X}"),
        Scalar::Text(text) => safe(text),
        other => other.to_string(),
    }
}
