//! The identity of a device (1018h) in reports: the same columns everywhere.

use super::report::{Cell, Column};
use crate::device::catalog::{self, Model};

/// 1018h:1, as a number.
pub const VENDOR: Column = Column::new("vendor").data_only();
/// The name of the vendor, if a description contains it.
pub const VENDOR_NAME: Column = Column::new("vendor_name").heading("VENDOR");
/// 1018h:2.
pub const PRODUCT: Column = Column::new("product");
/// 1018h:3.
pub const REVISION: Column = Column::new("revision");
/// 1018h:4.
pub const SERIAL: Column = Column::new("serial");

/// The cells of the columns [`VENDOR`], [`VENDOR_NAME`], [`PRODUCT`], [`REVISION`] and [`SERIAL`].
///
/// `identity` contains 1018h:1 to 4; `model` is the description of the device.
pub fn cells(identity: [Option<u32>; 4], model: Option<&Model>) -> [Cell; 5] {
    let [vendor, product, revision, serial] = identity;
    let code = |number: Option<u32>| Cell::from(number.map(Cell::Code));
    let name = vendor.and_then(|vendor| vendor_name(vendor, model));
    // If the name is unknown, the table shows the number.
    let shown = name.clone().unwrap_or_else(|| code(vendor).shown());
    [code(vendor), Cell::from(name).shown_as(shown), code(product), code(revision), serial.into()]
}

/// The name of a vendor: from the description of the device, otherwise from a built-in description with this vendor-ID.
/// If the description does not state the vendor-ID, the built-in one has priority.
pub fn vendor_name(vendor: u32, model: Option<&Model>) -> Option<String> {
    // A description that the user named may be for another device.
    let is_own = |model: &&Model| model.made_for.iter().all(|device| device.fits(Some(vendor), None));
    let named = model.filter(is_own).map(|model| &model.description.vendor).filter(|name| !name.is_empty());
    let states_vendor = model.is_some_and(|model| model.made_for.iter().any(|device| device.vendor == Some(vendor)));
    let built_in = || {
        let mut all = catalog::all().map(|model| &model.description);
        all.find(|description| description.identify.vendor_id == Some(vendor)).map(|description| &description.vendor)
    };
    let name = if states_vendor { named.or_else(built_in) } else { built_in().or(named) };
    name.cloned()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vendor_name_follows_the_vendor_number() {
        let [vendor, name, product, ..] = cells([Some(71), Some(1), None, None], None);
        assert_eq!((vendor.plain(), name.plain(), product.shown()), ("71".into(), "WIKA".into(), "0x00000001".into()));
        let [vendor, name, ..] = cells([Some(0xdead), None, None, None], None);
        assert_eq!((vendor.plain(), name.plain(), name.shown()), ("57005".into(), String::new(), "0x0000DEAD".into()));
    }
}
