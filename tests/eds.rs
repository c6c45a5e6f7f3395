//! The files of `tests/data/eds` with their expected contents and warnings.

#![cfg(test)]

use cangauge::canopen::id::NodeId;
use cangauge::canopen::object::ObjectId;
use cangauge::canopen::value::DataType;
use cangauge::device::description::Access;
use cangauge::device::dictionary::{Dictionary, Entry};
use cangauge::device::eds::{self, Eds};
use cangauge::device::scalar::Scalar;
use std::collections::BTreeSet;
use std::path::PathBuf;

fn data() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("tests/data/eds")
}

/// A usable file with exactly these warnings.
fn load(name: &str, warnings: &[&str]) -> Eds {
    let bytes = std::fs::read(data().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let eds = eds::read(&bytes).unwrap_or_else(|error| panic!("{name}: {error}"));
    let found: Vec<String> = eds.warnings.iter().map(ToString::to_string).collect();
    assert_eq!(found, warnings, "{name}");
    for entry in eds.dictionary.iter() {
        let name = entry.full_name();
        assert_eq!(eds.dictionary.find(&name).map(|found| found.object), Some(entry.object), "{name}");
    }
    eds
}

fn entry<'a>(eds: &'a Eds, name: &str) -> &'a Entry {
    eds.dictionary.find(name).unwrap_or_else(|| panic!("no object is called {name}"))
}

fn default(eds: &Eds, name: &str) -> Option<Scalar> {
    entry(eds, name).default.clone()
}

fn text(text: &str) -> Option<Scalar> {
    Some(Scalar::from(text))
}

fn integer(number: i64) -> Option<Scalar> {
    Some(Scalar::Integer(number))
}

fn node(id: u8) -> NodeId {
    NodeId::new(id).expect("a node-ID")
}

/// A default as a number, as passive logging reads mapping, unit and digits from a file.
fn number(dictionary: &Dictionary, index: u16, sub: u8, id: u8) -> Option<u64> {
    let entry = dictionary.get(ObjectId::new(index, sub))?;
    entry.data_type.decode(&entry.default_bytes(node(id))?).ok()?.as_u64()
}

/// Index and sub-index of the objects in the default mapping of a TPDO.
fn mapping(dictionary: &Dictionary, pdo: u16) -> Vec<(u64, u64, u64)> {
    let count = number(dictionary, 0x1a00 + pdo - 1, 0, 1).unwrap_or(0);
    let subs = 1..=u8::try_from(count).expect("a count");
    let entries = subs.filter_map(|sub| number(dictionary, 0x1a00 + pdo - 1, sub, 1));
    entries.map(|entry| (entry >> 16, entry >> 8 & 0xff, entry & 0xff)).collect()
}

#[test]
fn every_file_is_tested_and_names_its_origin() {
    let source = include_str!("eds.rs");
    let readme = include_str!("data/eds/README.md");
    let mut files = 0;
    for folder in ["", "refused"] {
        for file in std::fs::read_dir(data().join(folder)).expect("a folder") {
            let name = file.expect("a file").file_name().to_string_lossy().into_owned();
            if name.ends_with(".eds") || name.ends_with(".dcf") {
                assert!(source.contains(&format!("{name}\"")), "{name} is not tested");
                assert!(readme.contains(&format!("`{name}`")), "{name} is not in the README");
                files += usize::from(folder.is_empty());
            }
        }
    }
    assert_eq!(files, 37);
}

#[test]
fn unusable_files_give_line_and_reason() {
    for (name, expected) in [
        ("empty.eds", "line 1: the file is empty"),
        ("xdd.eds", "line 2: this is XML, perhaps an XDD or XDC file; expected an EDS or DCF file"),
        ("text.eds", "line 1: this is not an EDS or DCF file: it has no section such as [DeviceInfo]"),
        ("binary.eds", "line 1: this is not an EDS or DCF file: it has no section such as [DeviceInfo]"),
        ("no-objects.eds", "line 51: the file has no object: a section such as [1000] is missing"),
    ] {
        let bytes = std::fs::read(data().join("refused").join(name)).expect("a file");
        let error = eds::read(&bytes).expect_err(name);
        assert_eq!(error.to_string(), expected, "{name}");
    }
    for (start, expected) in [
        ("PK\x03\x04\x14\0", "line 1: this is a zip archive: unpack it, and use the EDS file in it"),
        ("%PDF-1.4\n", "line 1: this is a PDF document, perhaps the manual; expected an EDS or DCF file"),
        ("\n<!DOCTYPE html>\n", "line 1: this is a web page: download the EDS file itself"),
        (
            "name = \"flow\"\n[identify]\n[[signal]]\n",
            "line 1: this is a device description in TOML: use --device instead of --eds",
        ),
    ] {
        assert_eq!(eds::read(start.as_bytes()).expect_err(start).to_string(), expected);
    }
}

#[test]
fn clean_file_is_sufficient_for_passive_logging() {
    let eds = load("01-clean-4.0.eds", &[]);
    assert_eq!(eds.info.eds_version, "4.0");
    assert_eq!(eds.info.vendor_name.as_deref(), Some("Example Instruments"));
    assert_eq!(eds.info.product_name.as_deref(), Some("PX-1"));
    assert_eq!(eds.info.order_code.as_deref(), Some("PX-1-C"));
    assert_eq!(eds.info.vendor_number, Some(0xabc));
    assert_eq!(eds.info.product_number, Some(0x101));
    assert_eq!(eds.info.revision_number, Some(0x0001_0002));
    assert_eq!(eds.info.lss_supported, Some(true));
    assert_eq!(eds.info.bit_rates, [20_000, 50_000, 125_000, 250_000, 500_000, 800_000, 1_000_000]);
    assert_eq!(eds.commissioning, None);
    assert!(eds.parameter_values.is_empty() && eds.flags.is_empty() && eds.untyped.is_empty());

    let dictionary = &eds.dictionary;
    assert_eq!(number(dictionary, 0x1800, 1, 5), Some(0x185));
    assert_eq!(number(dictionary, 0x1800, 2, 5), Some(254));
    assert_eq!(mapping(dictionary, 1), [(0x6130, 1, 16), (0x6130, 2, 16)]);
    assert_eq!(number(dictionary, 0x6131, 1, 5), Some(0x004e_0000));
    assert_eq!(number(dictionary, 0x6131, 2, 5), Some(0x002d_0000));
    assert_eq!([number(dictionary, 0x6132, 1, 5), number(dictionary, 0x6132, 2, 5)], [Some(3), Some(1)]);

    let pressure = entry(&eds, "ai-input-pv:1");
    assert_eq!((pressure.object, pressure.data_type), (ObjectId::new(0x6130, 1), DataType::Integer(2)));
    assert_eq!((pressure.access, pressure.pdo, &pressure.default), (Access::Ro, true, &None));
    let heartbeat = entry(&eds, "Producer-Heartbeat-Time");
    assert_eq!((heartbeat.object, heartbeat.access), (ObjectId::new(0x1017, 0), Access::Rw));
    assert_eq!(entry(&eds, "vendor-id").object, ObjectId::new(0x1018, 1));
    assert_eq!(entry(&eds, "identity-object:1").object, ObjectId::new(0x1018, 1));
}

#[test]
fn eds_3_0() {
    let eds = load("02-clean-3.0.eds", &[]);
    assert_eq!(eds.info.eds_version, "3.0");
    assert_eq!(entry(&eds, "store-eds").data_type, DataType::Domain);
    assert_eq!(default(&eds, "manufacturer-device-name"), text("PX-1"));
    assert!(eds.untyped.is_empty());
}

#[test]
fn a_configured_device() {
    let eds = load("03-configured.dcf", &[]);
    let commissioning = eds.commissioning.clone().expect("a DCF");
    assert_eq!(commissioning.node_id, Some(node(12)));
    assert_eq!(commissioning.node_name.as_deref(), Some("Tank 3"));
    assert_eq!(commissioning.bit_rate, Some(250_000));
    assert_eq!(commissioning.net_number, Some(1));
    assert_eq!(commissioning.network_name.as_deref(), Some("Plant"));
    assert_eq!(commissioning.manager, Some(false));
    assert_eq!(commissioning.lss_serial, Some(20002));

    let objects: Vec<String> = eds.parameter_values.keys().map(ToString::to_string).collect();
    assert_eq!(objects, ["0x1017:0", "0x1800:1", "0x6131:1"]);
    assert_eq!(default(&eds, "producer-heartbeat-time"), integer(0));
    assert_eq!(eds.value(ObjectId::new(0x1017, 0)), Some(&Scalar::Integer(1000)));
    assert_eq!(eds.value(ObjectId::new(0x1800, 2)), Some(&Scalar::Integer(254)));
    assert_eq!(eds.value(ObjectId::new(0x6130, 1)), None);
    let configured = eds.configured();
    assert_eq!(number(&configured, 0x1800, 1, 12), Some(0x28c));
    assert_eq!(number(&configured, 0x6131, 1, 12), Some(0x00ab_0000));
    assert_eq!(number(&configured, 0x6131, 2, 12), Some(0x002d_0000));
    assert_eq!(configured.find("level-of-tank-3").map(|entry| entry.full_name()).as_deref(), Some("ai-input-pv:1"));
}

#[test]
fn the_other_spelling_of_commissioning() {
    let eds = load(
        "04-commissioning.dcf",
        &[
            "line 55: Baudrate: 500000 kbit/s is not a CAN bit rate; read as bit/s",
            "line 56: [DeviceCommissioning] NetNumber: \"010\" begins with 0 and is octal by CiA 306, so 8",
            "line 58: [DeviceCommissioning] CANopenManager: \"perhaps\" is neither 0 nor 1",
            "line 59: [DeviceCommissioning] LSS_SerialNumber: \"none\" is not a 32-bit number",
        ],
    );
    let commissioning = eds.commissioning.expect("a DCF");
    assert_eq!(commissioning.node_id, Some(node(31)));
    assert_eq!(commissioning.node_name, None);
    assert_eq!(commissioning.bit_rate, Some(500_000));
    assert_eq!((commissioning.net_number, commissioning.manager, commissioning.lss_serial), (Some(8), None, None));
}

#[test]
fn encodings() {
    let eds = load("05-cp1252.eds", &[]);
    assert_eq!(eds.info.vendor_name.as_deref(), Some("Müller Meßgeräte – Köln"));
    assert_eq!(entry(&eds, "ÜBERDRUCK").object, ObjectId::new(0x2000, 0));
    assert_eq!(default(&eds, "temperatur-c"), integer(-40));
    assert_eq!(default(&eds, "prüfer"), text("Größe 5 µm"));

    let eds = load("06-utf8-bom.eds", &[]);
    assert_eq!((eds.info.eds_version.as_str(), eds.info.vendor_name.as_deref()), ("4.0", Some("Müller Meßgeräte")));
    assert_eq!(entry(&eds, "überdruck").object, ObjectId::new(0x2000, 0));

    let eds = load("32-utf16-without-mark.eds", &[]);
    assert_eq!(eds.info.vendor_name.as_deref(), Some("Müller"));
    let eds = load("07-utf16.eds", &[]);
    assert_eq!(eds.info.vendor_name.as_deref(), Some("Müller"));
    assert_eq!(default(&eds, "vendor-id"), integer(0xabc));
}

#[test]
fn line_ends_blanks_and_letter_case() {
    let eds = load("08-line-ends.eds", &[]);
    assert_eq!(default(&eds, "device-type"), integer(0x0002_0194));
    assert_eq!(default(&eds, "revision-number"), integer(0x0001_0002));

    let eds = load("09-blanks.eds", &[]);
    assert_eq!(default(&eds, "device-type"), integer(0x0002_0194));
    assert_eq!(default(&eds, "vendor-id"), integer(0xabc));
    assert_eq!(entry(&eds, "producer-heartbeat-time").access, Access::Rw);

    let eds = load("10-letter-case.eds", &[]);
    assert_eq!(eds.info.lss_supported, Some(true));
    assert_eq!(default(&eds, "vendor-id"), integer(0xabc));
    let tenth = entry(&eds, "tenth");
    assert_eq!((tenth.object, tenth.access), (ObjectId::new(0x1a00, 10), Access::Rw));
}

#[test]
fn access_types() {
    let eds = load(
        "11-access-types.eds",
        &[
            "line 183: [2007] AccessType: \"rx\" is unknown; read as rw",
            "line 187: [2008] has no AccessType; read as rw",
        ],
    );
    let expected = ["Ro", "Rw", "Wo", "Ro", "Rw", "Rw", "Const", "Rw", "Rw", "Ro"];
    for (setting, expected) in expected.iter().enumerate() {
        assert_eq!(format!("{:?}", entry(&eds, &format!("setting-{setting}")).access), *expected, "{setting}");
    }
}

#[test]
fn comments_behind_values() {
    let eds = load("12-comments.eds", &[]);
    assert_eq!((eds.info.vendor_number, eds.info.lss_supported), (Some(0xabc), Some(true)));
    let device_type = entry(&eds, "device-type");
    assert_eq!((device_type.data_type, device_type.access), (DataType::Unsigned(4), Access::Ro));
    assert_eq!((&device_type.default, device_type.pdo), (&integer(0x0002_0194), false));
    assert_eq!(default(&eds, "producer-heartbeat-time"), None);
    assert_eq!(default(&eds, "channel-2-temperature"), text("A;B # C // D"));
}

#[test]
fn defaults_that_do_not_fit() {
    let eds = load(
        "13-defaults.eds",
        &[
            "line 140: [2000] DefaultValue: \"0.0\" is not an integer; read as 0",
            "line 156: [2002] DefaultValue: \"256\" does not fit u8 (0 to 255); ignored",
            "line 164: [2003] DefaultValue: \"-1\" does not fit u16 (0 to 65535); ignored",
            "line 196: [2007] DefaultValue: \"0x3F800000\" is read as the bit pattern of 1",
            "line 204: [2008] DefaultValue: \"1,5\" has a decimal comma; read as 1.5",
            "line 212: [2009] DefaultValue: \"n/a\" is not a value of type r32; ignored",
            "line 228: [200B] DefaultValue: \"2\" is not a value of type b; ignored",
            "line 260: [200F] DefaultValue: \"0\" is not a value of type d; ignored",
            "line 276: [2011] DefaultValue: \"1e3\" is not an integer; read as 1000",
            "line 300: [2014] DefaultValue: \"-\" is not a value of type u32; ignored",
        ],
    );
    let real = |number| Some(Scalar::Real(number));
    for (value, expected) in [
        (0, integer(0)),
        (1, None),
        (2, None),
        (3, None),
        (4, integer(-32768)),
        (5, integer(-1)),
        (6, real(1.5)),
        (7, real(1.0)),
        (8, real(1.5)),
        (9, None),
        (10, integer(1)),
        (11, None),
        (12, integer(-1)),
        (13, text("18446744073709551615")),
        (14, text("01a1053c45aabb")),
        (15, None),
        (16, text("0.0")),
        (17, integer(1000)),
        (18, text("1984-01-01T00:00:00.000Z")),
        (19, text("0s")),
        (20, None),
        (21, integer(0xff_ffff)),
    ] {
        assert_eq!(default(&eds, &format!("value-{value}")), expected, "{value}");
    }
    assert_eq!(entry(&eds, "value-4").default_bytes(node(1)), Some(vec![0, 0x80]));
    assert_eq!(entry(&eds, "value-13").default_bytes(node(1)), Some(vec![0xff; 8]));
}

#[test]
fn node_id_formulas() {
    let eds = load(
        "14-nodeid.eds",
        &[
            "line 186: [2007] DefaultValue: \"0600\" begins with 0 and is octal by CiA 306, so 384",
            "line 194: [2008] DefaultValue: \"$NODEID-1\" is not a value of type u32; ignored",
            "line 202: [2009] DefaultValue: \"$NODEID+\" is not a value of type u32; ignored",
            "line 210: [200A] DefaultValue: \"$NODEID+0x200000000\" is not a value of type u32; ignored",
        ],
    );
    for cob in [0, 1, 2, 3, 6, 7, 11] {
        assert_eq!(number(&eds.dictionary, 0x2000 + cob, 0, 5), Some(0x185), "{cob}");
    }
    assert_eq!(number(&eds.dictionary, 0x2004, 0, 127), Some(127));
    assert_eq!(number(&eds.dictionary, 0x2005, 0, 5), Some(0x4000_0185));
    assert_eq!(default(&eds, "cob-8"), None);
}

#[test]
fn leading_zeros() {
    let eds = load(
        "15-octal.eds",
        &[
            "line 14: [DeviceInfo] VendorNumber: \"00000044\" begins with 0 and is octal by CiA 306, so 36",
            "line 139: [2002] DefaultValue: \"0100\" begins with 0 and is octal by CiA 306, so 64",
            "line 147: [2003] DefaultValue: \"0089\" begins with 0, but is not octal; read as 89",
            "line 153: [2004] DataType: \"0010\" begins with 0 and is octal by CiA 306, so 8",
        ],
    );
    assert_eq!(eds.info.vendor_number, Some(36));
    assert_eq!([default(&eds, "zero"), default(&eds, "seven")], [integer(0), integer(7)]);
    assert_eq!([default(&eds, "octal"), default(&eds, "not-octal")], [integer(64), integer(89)]);
    assert_eq!((entry(&eds, "real").data_type, default(&eds, "real")), (DataType::Real32, Some(Scalar::Real(10.0))));
}

#[test]
fn devices_of_other_profiles() {
    for (name, profile, value, entries) in [
        ("33-inclinometer.eds", 410, "slope-long16", 2),
        ("34-encoder.eds", 406, "speed-value-channel-1", 2),
        ("35-inputs.eds", 401, "oil-temperature", 3),
        ("36-drive.eds", 402, "statusword", 2),
        ("37-transmitter.eds", 404, "ai-status-1", 3),
    ] {
        let eds = load(name, &[]);
        assert_eq!(number(&eds.dictionary, 0x1000, 0, 5).map(|device_type| device_type & 0xffff), Some(profile));
        assert_eq!(mapping(&eds.dictionary, 1).len(), entries, "{name}");
        assert!(entry(&eds, value).pdo, "{name}");
    }
}

#[test]
fn compact_pdos() {
    let text = "[DeviceInfo]\nCompactPDO=0x13\nNrOfRXPDO=1\nNrOfTXPDO=5\n[OptionalObjects]\nSupportedObjects=2\n\
                1=0x1801\n2=0x6000\n[1801]\nParameterName=Second\nObjectType=9\nSubNumber=1\n[1801sub1]\n\
                ParameterName=Identifier\nDataType=7\nAccessType=ro\nDefaultValue=0x333\n[6000]\nParameterName=Value\n\
                DataType=5\nAccessType=ro\nPDOMapping=1\n";
    let eds = eds::read(text.as_bytes()).expect("an EDS");
    assert_eq!(eds.warnings, []);
    let subs = |index| {
        eds.dictionary.iter().map(|entry| entry.object).filter(move |object| object.index == index).map(|it| it.sub)
    };
    assert_eq!(subs(0x1800).collect::<Vec<_>>(), [0, 1, 2, 5], "bits 0, 1 and 4");
    assert_eq!(subs(0x1400).collect::<Vec<_>>(), [0, 1, 2, 5]);
    assert_eq!(subs(0x1801).collect::<Vec<_>>(), [1], "as the file describes it");
    assert_eq!((subs(0x1805).count(), subs(0x1A04).count(), subs(0x1A05).count()), (0, 9, 0));
    let cob_ids = [0x1800, 0x1801, 0x1802, 0x1804, 0x1400].map(|index| number(&eds.dictionary, index, 1, 5));
    assert_eq!(cob_ids, [0x185, 0x333, 0x385, 0x8000_0000, 0x205].map(Some));
    assert_eq!(entry(&eds, "tpdo-3-communication-parameter:5").data_type, DataType::Unsigned(2));
    assert_eq!(entry(&eds, "tpdo-5-mapping-parameter:8").data_type, DataType::Unsigned(4));
    let none = eds::read(text.replace("0x13", "0").as_bytes()).expect("an EDS");
    assert_eq!(none.dictionary.iter().count(), 2);
}

#[test]
fn compact_arrays() {
    let eds = load("16-compact.eds", &[]);
    let count = |index| eds.dictionary.iter().filter(|entry| entry.object.index == index).count();
    assert_eq!([count(0x6130), count(0x6131), count(0x6132)], [17; 3]);
    let total = entry(&eds, "ai-input-pv:0");
    assert_eq!((total.data_type, total.access, &total.default), (DataType::Unsigned(1), Access::Ro, &integer(16)));
    assert!(entry(&eds, "ai-input-pv:16").pdo && !total.pdo);
    assert_eq!(default(&eds, "ai-physical-unit-pv:9"), integer(0x002d_0000));
    let digits = entry(&eds, "ai-decimal-digits-pv:16");
    assert_eq!((&digits.default, &digits.low, &digits.high), (&integer(1), &integer(0), &integer(3)));
    assert_eq!(entry(&eds, "pressure").full_name(), "ai-input-pv:1");
    assert_eq!(entry(&eds, "cold-junction").full_name(), "ai-input-pv:16");
    assert_eq!(entry(&eds, "ai-input-pv2").full_name(), "ai-input-pv:2");
}

#[test]
fn compact_arrays_of_a_configured_device() {
    let eds = load(
        "17-compact.dcf",
        &[
            "line 157: [6131Value] 17: there is no such sub-index",
            "line 162: [6132Value] 2: \"300\" does not fit u8 (0 to 255); ignored",
            "line 175: [7130Name] belongs to no object",
        ],
    );
    let configured = eds.configured();
    assert_eq!(number(&configured, 0x6131, 1, 10), Some(0x004e_0000));
    assert_eq!(number(&configured, 0x6131, 2, 10), Some(11));
    assert_eq!(number(&configured, 0x6131, 3, 10), Some(0x002d_0000));
    assert_eq!([1, 2, 5].map(|sub| number(&configured, 0x6132, sub, 10)), [Some(3), Some(1), Some(0)]);
    assert_eq!(entry(&eds, "digits-of-channel-5").access, Access::Ro);
    assert_eq!(entry(&eds, "bearing-left").full_name(), "ai-input-pv:3");
    assert_eq!(eds.commissioning.and_then(|commissioning| commissioning.bit_rate), Some(1_000_000));
}

#[test]
fn sub_objects_without_an_object_and_the_reverse() {
    let eds = load(
        "18-orphans.eds",
        &["line 114: [2022sub0] has no section of its object; the object gets the name object-2022"],
    );
    assert_eq!(entry(&eds, "filter-constant").object, ObjectId::new(0x2022, 2));
    assert_eq!(entry(&eds, "object-2022:1").full_name(), "filter-type");
    assert_eq!(default(&eds, "object-2022:0"), integer(2));

    let eds = load(
        "19-incomplete.eds",
        &[
            "line 75: [1018] SubNumber is 5, but the file describes 1",
            "line 83: [1003] has no sub-objects; only the count at sub-index 0 is known",
            "line 90: [1010] has no sub-objects; only the count at sub-index 0 is known",
            "line 94: [2000] is a variable, but has sub-objects; they are used",
        ],
    );
    let errors = entry(&eds, "pre-defined-error-field:0");
    assert_eq!((errors.object, errors.data_type), (ObjectId::new(0x1003, 0), DataType::Unsigned(1)));
    assert_eq!(entry(&eds, "vendor-id").object, ObjectId::new(0x1018, 1));
    assert_eq!(entry(&eds, "offset-channel-1").object, ObjectId::new(0x2000, 1));
    assert_eq!(entry(&eds, "type-by-default").data_type, DataType::Unsigned(1));
}

#[test]
fn unlisted_objects_are_used() {
    let eds = load(
        "20-unlisted.eds",
        &[
            "line 49: object 1029h is listed, but not described",
            "line 50: [OptionalObjects] lists \"heartbeat\", which is not an index",
            "line 124: object 2000h is described, but not listed; it is used",
            "line 132: object 2001h is described, but not listed; it is used",
        ],
    );
    assert_eq!(default(&eds, "hidden-too"), integer(1));
    assert_eq!(eds.dictionary.find("error-behaviour"), None);

    let eds =
        load("21-no-lists.eds", &["line 5: the file has no list of its objects; all that are described are used"]);
    assert_eq!(entry(&eds, "producer-heartbeat-time").object, ObjectId::new(0x1017, 0));
    assert_eq!((eds.info.vendor_name, eds.info.lss_supported, eds.info.bit_rates), (None, None, vec![]));
}

#[test]
fn data_types() {
    let eds = load(
        "22-data-types.eds",
        &[
            "line 347: [2100] DataType: \"0x0040\" is unknown; its value is read as bytes",
            "line 360: [2102] has no DataType; its value is read as bytes",
            "line 368: [2103] DataType: \"UNSIGNED32\" is unknown; its value is read as bytes",
            "line 376: [2104] DataType: \"0x10007\" is unknown; its value is read as bytes",
        ],
    );
    let types: Vec<String> = (1..=0x1b)
        .filter_map(|code| Some(eds.dictionary.find(&format!("type-{code:02x}"))?.data_type.to_string()))
        .collect();
    let expected = "b i8 i16 i32 u8 u16 u32 r32 vs os us t td d i24 r64 i40 i48 i56 i64 u24 u40 u48 u56 u64";
    assert_eq!(types.join(" "), expected);
    for name in ["vendor-type", "untyped", "words", "huge"] {
        let entry = entry(&eds, name);
        assert_eq!((entry.data_type, &entry.default), (DataType::Domain, &None), "{name}");
        assert!(eds.untyped.contains(&entry.object), "{name}");
    }
    let limited = entry(&eds, "limited");
    assert_eq!((limited.data_type, &limited.default), (DataType::Unsigned(1), &integer(5)));
    assert_eq!(entry(&eds, "program").data_type, DataType::Domain);
    assert_eq!(eds.untyped.len(), 4);
}

#[test]
fn the_second_tpdo_alone() {
    let eds = load("23-tpdo2-only.eds", &[]);
    assert!(!eds.dictionary.has_index(0x1800));
    assert_eq!(number(&eds.dictionary, 0x1801, 1, 3), Some(0x283));
    assert_eq!(mapping(&eds.dictionary, 2), [(0x6130, 1, 16), (0x6130, 2, 16)]);
    assert_eq!(mapping(&eds.dictionary, 1), []);
}

#[test]
fn limits_and_flags() {
    let eds = load(
        "24-limits-and-flags.eds",
        &[
            "line 170: [2002] HighLimit: \"none\" is not a value of type r32; ignored",
            "line 178: [2003] PDOMapping: \"often\" is neither 0 nor 1",
            "line 214: [2005] LowLimit is above HighLimit; ignored",
            "line 224: [2006] LowLimit and HighLimit are 0; ignored",
        ],
    );
    let limits = |name| (entry(&eds, name).low.clone(), entry(&eds, name).high.clone());
    assert_eq!(limits("span"), (integer(-32768), integer(32767)));
    assert_eq!(limits("node-id"), (integer(1), integer(127)));
    assert_eq!(limits("gain"), (Some(Scalar::Real(-1000.0)), None));
    assert_eq!(limits("tag"), (None, None));
    for none in ["reset", "crossed", "nothing"] {
        assert_eq!(limits(none), (None, None), "{none}");
    }
    assert_eq!(limits("fixed"), (integer(0), integer(0)));
    assert_eq!(["gain", "tag", "span"].map(|name| entry(&eds, name).pdo), [true, false, false]);
    let flags: Vec<(String, bool, bool)> =
        eds.flags.iter().map(|(object, flags)| (object.to_string(), flags.skip_write, flags.skip_read)).collect();
    let expected = [("0x1010:1", true, true), ("0x2000:0", true, false), ("0x2004:0", false, true)];
    assert_eq!(flags, expected.map(|(object, write, read)| (object.to_owned(), write, read)));
}

#[test]
fn garbage_between_sections_is_ignored() {
    let eds = load(
        "25-junk.eds",
        &[
            "line 1: \"EDSVersion=9.9\" is before the first section",
            "line 38: the section \"DummyUsage\" has no closing bracket",
            "line 63: \"read only\" is not a section, a key with a value or a comment",
            "line 64: \"= 5\" is not a section, a key with a value or a comment",
            "line 70: \"Error register\" after a section is ignored",
            "line 123: [1018subX] is neither an object nor a sub-object and is ignored",
            "line 126: [10180] is neither an object nor a sub-object and is ignored",
        ],
    );
    assert_eq!(eds.info.eds_version, "4.0");
    assert_eq!(default(&eds, "device-type"), integer(0x0002_0194));
    assert_eq!(entry(&eds, "error-register").object, ObjectId::new(0x1001, 0));
    assert_eq!(eds.dictionary.iter().count(), 7);
}

#[test]
fn the_first_of_two_equal_sections_is_used() {
    let eds = load(
        "26-duplicates.eds",
        &[
            "line 120: [1017] has \"DefaultValue\" twice; line 119 is used",
            "line 124: [1018sub1] occurs twice; [1018sub1] in line 82 has priority",
            "line 129: [1018SUB02] is [1018sub2] of line 90 again and is ignored",
            "line 133: [FileInfo] occurs twice; [FileInfo] in line 2 has priority",
        ],
    );
    assert_eq!(eds.info.eds_version, "4.0");
    assert_eq!(default(&eds, "producer-heartbeat-time"), integer(500));
    let vendor = entry(&eds, "vendor-id");
    assert_eq!((&vendor.default, &vendor.low), (&integer(0xabc), &integer(0)));
    assert_eq!(entry(&eds, "product-code").data_type, DataType::Unsigned(4));
}

#[test]
fn long_lines() {
    let eds = load("27-long-lines.eds", &[]);
    let Some(Scalar::Text(value)) = default(&eds, "text") else { panic!("no text") };
    assert_eq!(value.len(), 2003);
    let names: BTreeSet<String> =
        eds.dictionary.iter().map(Entry::full_name).filter(|name| name.starts_with("long-name")).collect();
    assert_eq!(names.len(), 2);
    assert!(names.iter().all(|name| name.len() <= 246), "{names:?}");
}

#[test]
fn names_are_unique_and_can_be_typed() {
    let eds = load("28-names.eds", &["line 245: [2004] has no ParameterName; the object gets the name object-2004"]);
    let names: Vec<String> =
        eds.dictionary.iter().filter(|entry| entry.object.index >= 0x1800).map(Entry::full_name).collect();
    assert_eq!(
        names,
        [
            "tpdo-communication-parameter-1800:0",
            "tpdo-communication-parameter-1800:1",
            "tpdo-communication-parameter-1800:2",
            "tpdo-communication-parameter-1800:3",
            "tpdo-communication-parameter-1800:5",
            "tpdo-communication-parameter-1801:0",
            "tpdo-communication-parameter-1801:1",
            "tpdo-communication-parameter-1801:2",
            "tpdo-communication-parameter-1801:3",
            "tpdo-communication-parameter-1801:5",
            "reserved-2000-2000",
            "reserved-2001",
            "reserved-2000",
            "add",
            "object-2004",
            "object-2005",
            "größe-µm",
            "calibration:0",
            "date",
            "calibration:2",
            "calibration:3",
        ]
    );
    assert_eq!(entry(&eds, "calibration:1").full_name(), "date");
    assert!(names.iter().all(|name| name.parse::<ObjectId>().is_err()));
}

#[test]
fn huge_numbers_need_no_extra_time_or_memory() {
    let eds = load(
        "29-huge-numbers.eds",
        &[
            "line 75: [1018] SubNumber is 0xFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFFF…, but the file describes 5",
            "line 122: [6130] CompactSubObj: \"0xFFFFFFFF\" is not in the range 1 to 254",
            "line 134: [2000] has no sub-objects; only the count at sub-index 0 is known",
            "line 139: [2000] CompactSubObj: \"255\" is not in the range 1 to 254",
            "line 144: [2001] SubNumber is 4294967295, but the file describes 1",
            "line 150: [2001sub1] DefaultValue: \"9999999999999999999999999999999999999999…\" is not a value of type u32; ignored",
            "line 156: [2002] DefaultValue: \"0xFFFFFFFFFFFFFFFF\" does not fit u32 (0 to 4294967295); ignored",
        ],
    );
    assert_eq!(eds.dictionary.iter().count(), 11);
    assert_eq!(entry(&eds, "first").full_name(), "ai-input-pv:1");
}

#[test]
fn sixteen_channels_over_four_tpdos() {
    let eds = load("30-sixteen-channels.eds", &[]);
    assert_eq!(mapping(&eds.dictionary, 4), [(0x7130, 13, 16), (0x7130, 14, 16), (0x7130, 15, 16), (0x7130, 16, 16)]);
    assert_eq!(
        [1, 2, 3, 4].map(|pdo| number(&eds.dictionary, 0x17ff + pdo, 1, 10)),
        [0x18a, 0x28a, 0x38a, 0x48a].map(Some)
    );
    assert_eq!(number(&eds.dictionary, 0x6132, 16, 10), Some(1));
    assert_eq!(entry(&eds, "vendor-id").full_name(), "identity-object:1");
    assert_eq!(entry(&eds, "tpdo-4-mapping-parameter:1").object, ObjectId::new(0x1a03, 1));
}

#[test]
fn objects_are_found_by_their_spelling_in_the_file() {
    let eds = load(
        "31-spellings.eds",
        &[
            "line 299: [2006] DataType: \"0003h\" is read as 0x0003",
            "line 307: [2007] DataType: \"1B\" is read as 0x001B",
        ],
    );
    let object = |name: &str| eds.dictionary.find(name).map(|entry| entry.object.to_string());
    for (name, expected) in [
        ("Pressure / Temperature", Some("0x2000:0")),
        ("value  <  3", Some("0x2001:0")),
        ("Value # 3", Some("0x2002:0")),
        ("+offset", Some("0x2003:0")),
        ("Offset", Some("0x2004:0")),
        ("***", Some("0x2008:0")),
        ("sensor-a:1", Some("0x200A:1")),
        ("Sensor B", Some("0x200B:1")),
        ("Level:2", Some("0x200A:2")),
        ("Value", None),
    ] {
        assert_eq!(object(name).as_deref(), expected, "{name}");
    }
    assert_eq!(eds.dictionary.namesakes("value"), ["sensor-a:1", "sensor-b:1"]);
    assert_eq!(eds.dictionary.namesakes("Sensor A"), ["sensor-a:1", "level-2"]);
    assert!(eds.dictionary.namesakes("Face").is_empty());
    let types =
        [0x2005, 0x2006, 0x2007].map(|index| eds.dictionary.get(ObjectId::new(index, 0)).map(|it| it.data_type));
    assert_eq!(types, [DataType::Integer(2), DataType::Integer(2), DataType::Unsigned(8)].map(Some));
}

/// The names in a file with their objects, read without the parser of the program.
fn names_in(text: &str) -> Vec<(ObjectId, String)> {
    let mut object = None;
    let mut names = Vec::new();
    for line in text.lines().map(str::trim) {
        if let Some(section) = line.strip_prefix('[').and_then(|rest| rest.split(']').next()) {
            let section = section.to_lowercase().replace([' ', '\t'], "").replace("0x", "");
            let (index, sub) = section.split_once("sub").unwrap_or((&section, "0"));
            let index = u16::from_str_radix(index, 16).ok().filter(|_| index.len() == 4);
            object = index.and_then(|index| Some(ObjectId::new(index, u8::from_str_radix(sub, 16).ok()?)));
        } else if let Some((key, name)) = line.split_once('=')
            && key.to_lowercase().replace([' ', '\t'], "") == "parametername"
        {
            names.extend(object.take().map(|object| (object, name.trim().to_owned())));
        }
    }
    names
}

#[test]
fn every_name_in_every_file_can_be_typed() {
    let mut count = 0;
    for file in std::fs::read_dir(data()).expect("a folder") {
        let path = file.expect("a file").path();
        let bytes = std::fs::read(&path).unwrap_or_default();
        let (Ok(eds), Ok(text)) = (eds::read(&bytes), String::from_utf8(bytes)) else { continue };
        let named = |(object, name): &(ObjectId, String)| {
            let is_known = eds.dictionary.get(*object).is_some();
            is_known
                && !path.ends_with("26-duplicates.eds")
                && !name.is_empty()
                && !ObjectId::looks_like_address(name)
                && name.chars().count() <= 241
        };
        for (object, name) in names_in(text.trim_start_matches('\u{feff}')).into_iter().filter(named) {
            // For a name that several objects share, the dictionary returns their full names. The name of a record or
            // array means its sub-objects.
            let mut named = [vec![name.clone()], eds.dictionary.namesakes(&name)].concat().into_iter();
            let is_found =
                named.any(|name| eds.dictionary.find(&name).is_some_and(|it| it.object.index == object.index));
            assert!(is_found, "{}: {object} {name}", path.display());
            count += 1;
        }
    }
    assert!(count > 500, "{count}");
}
