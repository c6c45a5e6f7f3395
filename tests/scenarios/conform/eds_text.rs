//! The EDS file of a described device, as its maker would write it from the manual.

use cangauge::canopen::value::DataType;
use cangauge::device::assign::AssignKind;
use cangauge::device::catalog::Model;
use cangauge::device::dictionary::Entry;
use cangauge::device::scalar::Scalar;
use std::collections::BTreeMap;
use std::fmt::Write;

/// The file.
pub(crate) fn eds_text(model: &Model) -> String {
    let identify = &model.description.identify;
    let mut text = String::from("[FileInfo]\nEDSVersion=4.0\n\n[DeviceInfo]\n");
    let numbers = [("VendorNumber", identify.vendor_id), ("ProductNumber", identify.product_code)];
    for (key, number) in numbers {
        number.into_iter().for_each(|number| writeln!(text, "{key}=0x{number:X}").expect("a string"));
    }
    let known = model.description.bit_rates_of(AssignKind::Lss);
    for rate in [10, 20, 50, 125, 250, 500, 800, 1000].into_iter().filter(|_| !known.is_empty()) {
        let is_known = u8::from(known.values().any(|known| *known == rate * 1000));
        writeln!(text, "BaudRate_{rate}={is_known}").expect("a string");
    }
    let mut objects: BTreeMap<u16, Vec<&Entry>> = BTreeMap::new();
    for entry in model.dictionary.iter().filter(|entry| !model.untyped.contains(&entry.object)) {
        objects.entry(entry.object.index).or_default().push(entry);
    }
    let indices = |wanted: fn(u16) -> bool| objects.keys().copied().filter(|index| wanted(*index)).collect::<Vec<_>>();
    let is_mandatory = |index| matches!(index, 0x1000 | 0x1001 | 0x1018);
    let lists = [
        ("Mandatory", indices(is_mandatory)),
        ("Optional", indices(|index| !matches!(index, 0x1000 | 0x1001 | 0x1018 | 0x2000..=0x5fff))),
        ("Manufacturer", indices(|index| matches!(index, 0x2000..=0x5fff))),
    ];
    for (name, list) in lists {
        writeln!(text, "\n[{name}Objects]\nSupportedObjects={}", list.len()).expect("a string");
        (1..).zip(list).for_each(|(at, index)| writeln!(text, "{at}=0x{index:04X}").expect("a string"));
    }
    for (index, entries) in objects {
        if let [entry] = entries[..]
            && entry.object.sub == 0
        {
            section(&mut text, &format!("{index:04X}"), entry);
            continue;
        }
        let (name, count) = (&entries[0].name, entries.len());
        writeln!(text, "\n[{index:04X}]\nParameterName={name}\nObjectType=0x9\nSubNumber={count}").expect("a string");
        for entry in entries {
            section(&mut text, &format!("{index:04X}sub{:X}", entry.object.sub), entry);
        }
    }
    text
}

fn section(text: &mut String, name: &str, entry: &Entry) {
    let code = (1..=0x1b).find(|code| DataType::from_code(*code) == Some(entry.data_type)).expect("a type");
    let (title, access, pdo) = (&entry.name, entry.access.as_str(), u8::from(entry.pdo));
    write!(text, "\n[{name}]\nParameterName={title}\nObjectType=0x7\nDataType=0x{code:04X}\n").expect("a string");
    writeln!(text, "AccessType={access}\nPDOMapping={pdo}").expect("a string");
    let values = [("DefaultValue", &entry.default), ("LowLimit", &entry.low), ("HighLimit", &entry.high)];
    for (key, value) in values {
        match value {
            Some(Scalar::Text(value)) if value.is_empty() => {}
            Some(value) => writeln!(text, "{key}={value}").expect("a string"),
            None => {}
        }
    }
}
