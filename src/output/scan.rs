//! The report of `scan`.

use super::identity;
use super::report::{Cell, Column, Report};
use super::text;
use crate::tasks::scan::Found;

impl Report for Found {
    const COLUMNS: &'static [Column] = &[
        Column::new("node").right(),
        Column::new("state"),
        Column::new("device_type").json_only(),
        Column::new("profile").json_only(),
        Column::new("device"),
        Column::new("name"),
        identity::VENDOR,
        identity::VENDOR_NAME,
        identity::PRODUCT,
        identity::REVISION,
        identity::SERIAL.right(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let identity = &self.device.identity;
        let model = self.device.model.as_deref();
        let name = identity.name.as_deref().map(|name| Cell::from(name).shown_as(shown_name(name)));
        let mut cells: Vec<Cell> = vec![
            self.node.into(),
            self.state.map(|state| state.to_string()).into(),
            identity.device_type.map(|device_type| Cell::hex(device_type, 8)).into(),
            identity.profile().into(),
            model.map(|model| model.description.name.clone()).into(),
            name.into(),
        ];
        cells.extend(identity::cells([identity.vendor, identity.product, identity.revision, identity.serial], model));
        cells
    }
}

/// The name in the table.
fn shown_name(name: &str) -> String {
    if name.is_empty() { "-".to_owned() } else { text::safe(name) }
}
