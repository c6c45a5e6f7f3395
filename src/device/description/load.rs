//! Reads the TOML file of a description.

use super::check::{FIRST_WITHOUT_CHANNEL, NO_CHANNEL};
use super::table::{Source, Table, UnitEntry};
use super::*;
use crate::device::assign::AssignObject;
use crate::device::scale::{Bad, Decimal};
use toml::de::DeTable;

/// Reads a description.
///
/// # Errors
/// All mistakes, in the order of the lines. A TOML syntax error is reported alone.
pub fn read(text: &str) -> Result<Description, Vec<DescriptionError>> {
    read_with_notes(text).0
}

/// Reads a description. Also returns possible mistakes that do not prevent its use, in the order of the
/// lines.
pub fn read_with_notes(text: &str) -> (Result<Description, Vec<DescriptionError>>, Vec<DescriptionError>) {
    let source = Source::new(text);
    let description = match DeTable::parse(text) {
        Ok(document) => description(&mut Table::new(document.get_ref(), 0, &source)),
        Err(error) => {
            source.mistake(error.span().map_or(0, |span| span.start), error.message());
            None
        }
    };
    let [mistakes, notes] = source.into_findings();
    let result = match description {
        Some(description) if mistakes.is_empty() => Ok(description),
        _ => Err(mistakes),
    };
    (result, notes)
}

/// Reads only the table `[identify]`, which must precede the arrays of tables. This is much faster than reading a
/// whole description. `None` if the table has mistakes, and an empty value if it is missing.
pub(in crate::device) fn read_identify(text: &str) -> Option<Identify> {
    let start = text.split("\n[[").next()?;
    let source = Source::new(start);
    let document = DeTable::parse(start).ok()?;
    let mut table = Table::new(document.get_ref(), 0, &source).table("identify");
    let identify = table.as_mut().map(identify_entry).unwrap_or_default();
    drop(table);
    let [mistakes, _] = source.into_findings();
    mistakes.is_empty().then_some(identify)
}

/// Reads every table of the file, then checks their references to each other.
fn description<'t>(file: &mut Table<'t>) -> Option<Description> {
    let (name, title, vendor) = (file.required("name"), file.required("title"), file.required("vendor"));
    let (source, unconfirmed) = (file.or_default("source"), file.or_default("unconfirmed"));
    let (quirks, error_history) = (file.list("quirks"), file.or_default("error_history"));
    let (error_counters, repeating_average_ms) = (file.list("error_counters"), file.optional("repeating_average_ms"));
    let auto_bit_rate = file.optional("auto_bit_rate");
    let mut identify = file.table("identify");
    let mut bit_rates = file.table("bit_rates");
    let (factory, sdo, pdo) =
        (optional_table(file, "factory", factory), optional_table(file, "sdo", sdo), optional_table(file, "pdo", pdo));
    let mut startup = file.table("startup");
    let (assign, assign_tables) = entries(file, "assign", assign_entry);
    let (autozero, autozero_tables) = entries(file, "autozero", autozero_entry);
    let (mut signals, signal_tables) = entries(file, "signal", signal);
    let (objects, object_tables) = entries(file, "object", object);
    let (emergencies, emergency_tables) = entries(file, "emcy", emergency);
    let (deviations, _) = entries(file, "deviation", deviation);
    file.finish();
    number_signals(&mut signals);
    let description = Description {
        identify: identify.as_mut().map(identify_entry).unwrap_or_default(),
        bit_rates: bit_rates.as_mut().map(|rates| rates.entries("bit_rates")).unwrap_or_default(),
        startup: startup.as_mut().and_then(startup_entry),
        name: name?,
        title: title?,
        vendor: vendor?,
        source,
        unconfirmed,
        factory,
        sdo,
        pdo,
        quirks,
        error_history,
        error_counters,
        repeating_average_ms,
        auto_bit_rate,
        assign,
        autozero,
        signals,
        objects,
        emergencies,
        deviations,
    };
    check::check(
        &description,
        &check::Tables {
            file,
            identify: identify.as_ref(),
            bit_rates: bit_rates.as_ref(),
            startup: startup.as_ref(),
            assign: assign_tables,
            autozero: autozero_tables,
            signals: signal_tables,
            objects: object_tables,
            emergencies: emergency_tables,
        },
    );
    Some(description)
}

fn optional_table<'t, T: Default>(file: &mut Table<'t>, key: &'static str, read: fn(&mut Table<'t>) -> T) -> T {
    file.table(key).map(|mut table| read(&mut table)).unwrap_or_default()
}

/// Reads an array of tables. Returns the entries and their tables; both lists omit entries with mistakes.
fn entries<'t, T>(
    file: &mut Table<'t>,
    key: &'static str,
    read: fn(&mut Table<'t>) -> Option<T>,
) -> (Vec<T>, Vec<Table<'t>>) {
    file.tables(key).into_iter().filter_map(|mut table| Some((read(&mut table)?, table))).unzip()
}

fn identify_entry(table: &mut Table<'_>) -> Identify {
    let identify = Identify {
        device_type: table.optional("device_type"),
        vendor_id: table.optional("vendor_id"),
        product_code: table.optional("product_code"),
        device_name: table.optional("device_name"),
        confirm: table.table("confirm").map(|confirm| confirm.entries("confirm")).unwrap_or_default(),
    };
    table.finish();
    identify
}

fn factory(table: &mut Table<'_>) -> Factory {
    let factory = Factory { node_id: table.optional("node_id"), bit_rate: table.optional("bit_rate") };
    if let Some(rate) = factory.bit_rate.filter(|rate| !(5_000..=1_000_000).contains(rate)) {
        table.mistake("bit_rate", format!("bit_rate: {rate} bit/s is not in the range 5000 to 1000000"));
    }
    table.finish();
    factory
}

fn sdo(table: &mut Table<'_>) -> SdoStyle {
    let style = SdoStyle {
        size: table.or_default("size"),
        expedited_only: table.or_default("expedited_only"),
        block: table.or_default("block"),
        aborts: table.list("aborts"),
    };
    table.finish();
    style
}

fn pdo(table: &mut Table<'_>) -> PdoStyle {
    let style = PdoStyle { remap: table.or_default("remap"), timer: table.optional("timer") };
    if let Some(timer) = style.timer.filter(|timer| !matches!(timer, 254 | 255)) {
        table.mistake("timer", format!("timer: {timer} is neither 254 nor 255"));
    }
    table.finish();
    style
}

fn assign_entry(table: &mut Table<'_>) -> Option<AssignEntry> {
    let kind = table.required("way");
    let (state, retry_stopped) = (table.optional("state"), table.or_default("retry_stopped"));
    let node_id = table.table("node_id").map(|mut place| assign_place(&mut place));
    let bit_rate = table.table("bit_rate").map(|mut place| assign_place(&mut place));
    let bit_rates = table.table("bit_rates").map(|rates| rates.entries("bit_rates")).unwrap_or_default();
    let (store, applies) = (table.optional("store"), table.or_default("applies"));
    let unverified = table.or_default("unverified");
    let (page, doubt) = (table.or_default("page"), table.or_default("doubt"));
    table.finish();
    let (node_id, bit_rate) = (node_id.flatten(), bit_rate.flatten());
    let kind = kind?;
    Some(AssignEntry {
        kind,
        state,
        retry_stopped,
        node_id,
        bit_rate,
        bit_rates,
        store,
        applies,
        unverified,
        page,
        doubt,
    })
}

fn assign_place(table: &mut Table<'_>) -> Option<AssignObject> {
    let (object, data_type) = (table.required("object"), table.required("type"));
    let signature = table.or_default("signature");
    table.finish();
    Some(AssignObject { object: object?, data_type: data_type?, signature })
}

fn startup_entry(table: &mut Table<'_>) -> Option<Startup> {
    let (object, wait, auto) = (table.required("object"), table.required("wait"), table.required("auto"));
    let doubt = table.or_default("doubt");
    table.finish();
    Some(Startup { object: object?, wait: wait?, auto: auto?, doubt })
}

fn autozero_entry(table: &mut Table<'_>) -> Option<Autozero> {
    let (channel, object) = (table.required("channel"), table.required("object"));
    let signature: Option<String> = table.optional("signature");
    let offset = table.optional("offset");
    let absolute = table.table("absolute").map(|mut absolute| {
        let (object, value) = (absolute.required("object"), absolute.required("value"));
        absolute.finish();
        Some(Absolute { object: object?, value: value? })
    });
    let range = table.table("range").map(|mut range| {
        let (start, end, unit) = (range.required("start"), range.required("end"), range.required("unit"));
        range.finish();
        Some(Range { start: start?, end: end?, unit: unit? })
    });
    table.finish();
    let signature = signature.map_or_else(|| b"zero".to_vec(), String::into_bytes);
    let (absolute, range) = (absolute.flatten(), range.flatten());
    Some(Autozero { channel: channel?, object: object?, signature, offset, absolute, range })
}

fn signal(table: &mut Table<'_>) -> Option<SignalEntry> {
    let (name, channel, value) = (table.required("name"), table.optional("channel"), table.required("value"));
    let (data_type, also) = (table.optional("type"), table.list("also"));
    let (unit, digits): (Option<UnitEntry>, _) = (table.optional("unit"), table.optional("digits"));
    let (factor, offset) = (table.optional("factor"), table.optional("offset"));
    let (status, status_bits) = (table.optional("status"), table.table("status_bits"));
    let (marker, markers) = (table.or_default("marker"), table.table("markers"));
    let may_clip = table.or_default("may_clip");
    let (span_start, span_end) = (table.optional("span_start"), table.optional("span_end"));
    let status_bits = status_bits.map(|mut bits| {
        let found =
            Bad { invalid: bits.or_default("invalid"), high: bits.or_default("high"), low: bits.or_default("low") };
        bits.finish();
        found
    });
    let markers = markers.map(|mut numbers| {
        let found = Bad { invalid: numbers.list("invalid"), high: numbers.list("high"), low: numbers.list("low") };
        numbers.finish();
        found
    });
    table.finish();
    let scale = Scale { factor: factor.unwrap_or(Decimal::ONE), offset: offset.unwrap_or(Decimal::ZERO) };
    Some(SignalEntry {
        name: name?,
        channel: channel.unwrap_or(NO_CHANNEL),
        value: value?,
        data_type,
        also,
        unit: unit.and_then(UnitEntry::object),
        fixed_unit: unit.and_then(UnitEntry::fixed),
        scale: (factor.is_some() || offset.is_some()).then_some(scale),
        digits,
        status,
        status_bits,
        marker,
        markers: markers.unwrap_or_default(),
        may_clip,
        span_start,
        span_end,
    })
}

/// Gives the signals without a channel the numbers from 200 on.
fn number_signals(signals: &mut [SignalEntry]) {
    for (signal, number) in
        signals.iter_mut().filter(|signal| signal.channel == NO_CHANNEL).zip(FIRST_WITHOUT_CHANNEL..)
    {
        signal.channel = number;
    }
}

fn object(table: &mut Table<'_>) -> Option<ObjectEntry> {
    let (at, name) = (table.required("at"), table.required("name"));
    let (data_type, access) = (table.required("type"), table.required("access"));
    let (default, low, high) = (table.optional("default"), table.optional("low"), table.optional("high"));
    let (allow, values) = (table.list("allow"), table.table("values"));
    let (signature, only_if_zero) = (table.optional("signature"), table.list("only_if_zero"));
    let (pdo, unit) = (table.or_default("pdo"), table.optional("unit"));
    let (follows_unit, unit_at) = (table.optional("follows_unit"), table.optional("unit_at"));
    let stored = table.optional("stored");
    let (text, page, doubt) = (table.or_default("text"), table.or_default("page"), table.or_default("doubt"));
    let values = values.map(|values| values.entries("values")).unwrap_or_default();
    table.finish();
    Some(ObjectEntry {
        at: at?,
        name: name?,
        data_type: data_type?,
        access: access?,
        default,
        low,
        high,
        allow,
        values,
        signature,
        only_if_zero,
        pdo,
        unit,
        follows_unit,
        unit_at,
        stored,
        text,
        page,
        doubt,
    })
}

fn emergency(table: &mut Table<'_>) -> Option<EmergencyEntry> {
    let (code, text) = (table.required("code"), table.required("text"));
    let (register_bit, register) = (table.optional("register_bit"), table.optional("register"));
    let (bytes, overload) = (table.list("bytes"), table.optional("overload").unwrap_or(false));
    table.finish();
    Some(EmergencyEntry { code: code?, text: text?, register_bit, register, bytes, overload })
}

fn deviation(table: &mut Table<'_>) -> Option<Deviation> {
    let (case, objects) = (table.required("case"), table.list("objects"));
    let (text, page) = (table.required("text"), table.required("page"));
    table.finish();
    Some(Deviation { case: case?, objects, text: text?, page: page? })
}
