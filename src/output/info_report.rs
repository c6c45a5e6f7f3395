//! The info page as one JSON object, or in CSV as one row per object.

use super::identity;
use super::info::{self, name_of};
use super::report::{Cell, Column, Report};
use super::settings::{counters_cell, error_cells};
use crate::measure::layout::Tpdo;
use crate::tasks::settings::errors::Errors;
use crate::tasks::settings::info::{Channel, Info, Setting};
use std::io::{self, Write};

/// The columns of an object in CSV.
const SETTING: &[Column] = &[Column::new("object"), Column::new("name"), Column::new("value"), Column::new("text")];

impl Report for Info {
    const COLUMNS: &'static [Column] = &[
        Column::new("node"),
        Column::new("device").json_only(),
        Column::new("title").json_only(),
        Column::new("source").json_only(),
        Column::new("identity").json_only(),
        Column::new("bit_rate").json_only(),
        Column::new("state").json_only(),
        Column::new("monitoring").json_only(),
        Column::new("communication").json_only(),
        Column::new("errors").json_only(),
        Column::new("signals").json_only(),
        Column::new("tpdos").json_only(),
        Column::new("calibrated").json_only(),
        Column::new("produced").json_only(),
        Column::new("own").json_only(),
        Column::new("store").json_only(),
        Column::nested("settings", SETTING).csv_only(),
    ];

    fn cells(&self) -> Vec<Cell> {
        let node = &self.node;
        let description = node.model.as_ref().map(|model| &model.description);
        let tpdos = node.tpdos.iter().zip(&self.inhibit_100us).map(|(tpdo, inhibit)| tpdo_cell(self, tpdo, *inhibit));
        let of_channels = self.channels.iter().flat_map(|channel| &channel.settings);
        let all = self.communication.iter().chain(of_channels).chain(&self.own);
        vec![
            node.id.into(),
            description.map(|description| &description.name).into(),
            description.map(|description| &description.title).into(),
            info::source(self).into(),
            identity_cell(self),
            self.bit_rate.into(),
            self.state.map(|state| state.to_string()).into(),
            info::monitoring(self.monitoring).into(),
            settings_cell(&self.communication),
            self.errors.as_ref().map(errors_cell).into(),
            Cell::List(self.channels.iter().map(signal_cell).collect()),
            Cell::List(tpdos.collect()),
            self.calibrated.as_ref().map(info::date).into(),
            self.produced.as_ref().map(info::date).into(),
            settings_cell(&self.own),
            store_cell(self),
            Cell::Rows(all.map(|setting| setting_cells(setting).to_vec()).collect()),
        ]
    }

    fn text(pages: &[Info], out: &mut dyn Write) -> io::Result<()> {
        pages.iter().try_for_each(|page| info::text(out, page))
    }
}

fn setting_cells(setting: &Setting) -> [Cell; 4] {
    let Setting { object, name, value, .. } = setting;
    [(*object).into(), name.into(), value.into(), info::meaning(setting).into()]
}

fn settings_cell(settings: &[Setting]) -> Cell {
    let object = |setting: &Setting| {
        let [object, name, value, text] = setting_cells(setting);
        Cell::Object(vec![("object", object), ("name", name), ("value", value), ("text", text)])
    };
    Cell::List(settings.iter().map(object).collect())
}

fn identity_cell(info: &Info) -> Cell {
    let node = &info.node;
    let identity = &node.identity;
    let numbers = [identity.vendor, identity.product, identity.revision, identity.serial];
    let [vendor, vendor_name, product, revision, serial] = identity::cells(numbers, node.model.as_deref());
    Cell::Object(vec![
        ("name", identity.name.as_ref().into()),
        ("device_type", identity.device_type.map(|device_type| Cell::hex(device_type, 8)).into()),
        ("profile", identity.profile().into()),
        ("vendor", vendor),
        ("vendor_name", vendor_name),
        ("product", product),
        ("revision", revision),
        ("serial", serial),
        ("hardware", info.hardware.as_ref().into()),
        ("software", info.software.as_ref().into()),
    ])
}

fn errors_cell(errors: &Errors) -> Cell {
    let [register, register_text, count] = error_cells(errors);
    let history = errors.history.iter().map(|error| {
        Cell::Object(vec![
            ("code", Cell::hex(error.code, 4)),
            ("text", error.text.as_str().into()),
            ("detail", error.detail.as_str().into()),
            ("raw", Cell::hex(error.raw, 8)),
        ])
    });
    let history = Cell::List(history.collect());
    let fields = [("register", register), ("register_text", register_text), ("count", count), ("history", history)];
    Cell::Object(fields.into_iter().chain([("counters", counters_cell(errors))]).collect())
}

fn signal_cell(channel: &Channel) -> Cell {
    let sample = channel.sample.as_ref();
    let range = channel.range.map(|(start, end)| Cell::list([start.number, end.number]));
    Cell::Object(vec![
        ("signal", channel.signal.name.as_str().into()),
        ("channel", channel.signal.channel.into()),
        ("value", sample.and_then(|sample| sample.value).into()),
        ("unit", channel.signal.unit.into()),
        ("status", sample.and_then(|sample| sample.status).into()),
        ("range", range.into()),
        ("settings", settings_cell(&channel.settings)),
    ])
}

fn tpdo_cell(info: &Info, tpdo: &Tpdo, inhibit_100us: Option<u64>) -> Cell {
    let entry = |entry: &crate::canopen::pdo::MappingEntry| {
        let signal = name_of(info, &entry.object.to_string());
        Cell::Object(vec![("object", entry.object.into()), ("bits", entry.bits.into()), ("signal", signal.into())])
    };
    Cell::Object(vec![
        ("pdo", tpdo.number.get().into()),
        ("cob_id", Cell::cob_id(tpdo.cob_id.can_id().number())),
        ("valid", tpdo.cob_id.is_valid().into()),
        ("rtr", tpdo.cob_id.allows_rtr().into()),
        ("transmission", tpdo.transmission.map(|kind| kind.to_string()).into()),
        ("event_timer_ms", tpdo.event_timer_ms.into()),
        ("inhibit_us", inhibit_100us.map(|inhibit| inhibit * 100).into()),
        ("mapping", Cell::List(tpdo.mapping.iter().map(entry).collect())),
    ])
}

fn store_cell(info: &Info) -> Cell {
    let group = |&(sub, capability): &(u8, u32)| {
        Cell::Object(vec![("object", format!("0x1010:{sub}").into()), ("capability", capability.into())])
    };
    Cell::Object(vec![
        ("groups", Cell::List(info.store.groups.iter().map(group).collect())),
        ("kept", Cell::list(&info.store.kept)),
        ("not_kept", Cell::list(&info.store.lost)),
    ])
}
