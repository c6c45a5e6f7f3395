//! The info page as one JSON object.

use super::info::name_of;
use super::json::{JsonNumber, line, value};
use super::settings::Past;
use crate::measure::sample::Status;
use crate::tasks::settings::info::{Info, Setting};
use serde::Serialize;
use std::io::{self, Write};

#[derive(Serialize)]
struct JsonSetting<'a> {
    object: String,
    name: &'a str,
    value: serde_json::Value,
    text: String,
}

impl<'a> JsonSetting<'a> {
    fn all(settings: &'a [Setting]) -> Vec<JsonSetting<'a>> {
        let one = |setting: &'a Setting| JsonSetting {
            object: setting.object.to_string(),
            name: &setting.name,
            value: value(&setting.value),
            text: setting.text.clone(),
        };
        settings.iter().map(one).collect()
    }
}

#[derive(Serialize)]
struct JsonIdentity<'a> {
    name: Option<&'a str>,
    device_type: Option<String>,
    profile: Option<u32>,
    vendor: Option<u32>,
    product: Option<u32>,
    revision: Option<u32>,
    serial: Option<u32>,
    hardware: Option<&'a str>,
    software: Option<&'a str>,
}

#[derive(Serialize)]
struct JsonErrors<'a> {
    register: Option<String>,
    register_text: &'a str,
    count: Option<u64>,
    history: Vec<Past<'a>>,
}

#[derive(Serialize)]
struct JsonSignal<'a> {
    signal: &'a str,
    channel: u8,
    value: JsonNumber,
    unit: Option<String>,
    status: Option<&'a str>,
    range: Option<[JsonNumber; 2]>,
    settings: Vec<JsonSetting<'a>>,
}

#[derive(Serialize)]
struct JsonTpdo {
    pdo: u16,
    cob_id: String,
    valid: bool,
    rtr: bool,
    transmission: Option<String>,
    event_timer_ms: Option<u16>,
    inhibit_us: Option<u64>,
    mapping: Vec<JsonMapped>,
}

#[derive(Serialize)]
struct JsonMapped {
    object: String,
    bits: u8,
    signal: Option<String>,
}

#[derive(Serialize)]
struct JsonStore<'a> {
    groups: Vec<JsonGroup>,
    kept: &'a [String],
    not_kept: &'a [String],
}

#[derive(Serialize)]
struct JsonGroup {
    object: String,
    capability: u32,
}

#[derive(Serialize)]
struct JsonInfo<'a> {
    node: u8,
    device: Option<&'a str>,
    title: Option<&'a str>,
    identity: JsonIdentity<'a>,
    bit_rate: Option<u32>,
    state: Option<String>,
    monitoring: &'a str,
    communication: Vec<JsonSetting<'a>>,
    errors: Option<JsonErrors<'a>>,
    signals: Vec<JsonSignal<'a>>,
    tpdos: Vec<JsonTpdo>,
    calibrated: Option<&'a str>,
    produced: Option<&'a str>,
    own: Vec<JsonSetting<'a>>,
    store: JsonStore<'a>,
}

/// The page as one object.
pub fn object(out: &mut dyn Write, info: &Info) -> io::Result<()> {
    let instrument = &info.instrument;
    let described = instrument.model.as_ref().map(|model| &model.description);
    let identity = &instrument.identity;
    let signals = info.channels.iter().map(|channel| {
        let sample = channel.sample.as_ref();
        JsonSignal {
            signal: &channel.signal.name,
            channel: channel.signal.channel,
            value: JsonNumber(sample.and_then(|sample| sample.value)),
            unit: channel.signal.unit.map(|unit| unit.to_string()).filter(|unit| !unit.is_empty()),
            status: sample.and_then(|sample| sample.status).map(Status::as_str),
            range: channel.range.map(|(start, end)| [start, end].map(|end| JsonNumber(Some(end.number)))),
            settings: JsonSetting::all(&channel.settings),
        }
    });
    let tpdos = instrument.tpdos.iter().zip(&info.inhibit_100us).map(|(tpdo, inhibit)| JsonTpdo {
        pdo: tpdo.number.get(),
        cob_id: format!("0x{:X}", tpdo.cob_id.can_id().number()),
        valid: tpdo.cob_id.is_valid(),
        rtr: tpdo.cob_id.allows_rtr(),
        transmission: tpdo.transmission.map(|kind| kind.to_string()),
        event_timer_ms: tpdo.event_timer_ms,
        inhibit_us: inhibit.map(|inhibit| inhibit * 100),
        mapping: tpdo
            .mapping
            .iter()
            .map(|entry| {
                let object = entry.object.to_string();
                JsonMapped { signal: name_of(info, &object), object, bits: entry.bits }
            })
            .collect(),
    });
    let errors = info.errors.as_ref().map(|errors| JsonErrors {
        register: errors.register.map(|bits| format!("0x{bits:02X}")),
        register_text: &errors.register_text,
        count: errors.count,
        history: errors.history.iter().map(Past::new).collect(),
    });
    let groups = info.store.groups.iter();
    line(
        out,
        &JsonInfo {
            node: instrument.id.get(),
            device: described.map(|description| description.name.as_str()),
            title: described.map(|description| description.title.as_str()),
            identity: JsonIdentity {
                name: identity.name.as_deref(),
                device_type: identity.device_type.map(|device_type| format!("0x{device_type:08X}")),
                profile: identity.profile(),
                vendor: identity.vendor,
                product: identity.product,
                revision: identity.revision,
                serial: identity.serial,
                hardware: info.hardware.as_deref(),
                software: info.software.as_deref(),
            },
            bit_rate: info.bit_rate,
            state: info.state.map(|state| state.to_string()),
            monitoring: &info.monitoring,
            communication: JsonSetting::all(&info.communication),
            errors,
            signals: signals.collect(),
            tpdos: tpdos.collect(),
            calibrated: info.calibrated.as_deref(),
            produced: info.produced.as_deref(),
            own: JsonSetting::all(&info.own),
            store: JsonStore {
                groups: groups
                    .map(|&(sub, capability)| JsonGroup { object: format!("0x1010:{sub}"), capability })
                    .collect(),
                kept: &info.store.kept,
                not_kept: &info.store.lost,
            },
        },
    )
}
