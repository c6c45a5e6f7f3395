use super::*;

const HEAD: &str = "name = \"x\"\ntitle = \"X\"\nvendor = \"V\"\n";

/// Returns the mistakes of a description that begins with [`HEAD`], which has three lines.
fn mistakes(text: &str) -> Vec<String> {
    match read(&format!("{HEAD}{text}")) {
        Ok(_) => Vec::new(),
        Err(mistakes) => {
            mistakes.iter().map(|found| format!("x.toml:{}: {}", found.place.line, found.message)).collect()
        }
    }
}

#[test]
fn source_and_identify_are_optional() {
    let description = read(HEAD).expect("a description");
    assert_eq!((description.name.as_str(), description.source.as_str()), ("x", ""));
    assert!(description.identify.is_empty());
}

#[test]
fn unknown_keys_are_listed_with_their_line() {
    let known = "signal, name, title, vendor, source, unconfirmed, quirks, error_history, error_counters, repeating_average_ms, \
                 auto_bit_rate, identify, bit_rates, factory, sdo, pdo, startup, assign, autozero, object, emcy, deviation";
    let expected = format!("x.toml:4: unknown key \"signals\" (known: {known})");
    assert_eq!(mistakes("signals = 1"), [expected]);
    let below = mistakes(
        "[sdo]\nsize = \"omitted\"\nsizes = 1\n[[signal]]\nname = \"p\"\nchannel = 1\nvalue = \"0x6130:1\"\nx = 1",
    );
    assert_eq!(below[0], "x.toml:6: unknown key \"sizes\" (known: size, expedited_only, block, aborts)");
    assert!(below[1].starts_with("x.toml:11: unknown key \"x\" (known: name, channel, value, type, "), "{below:?}");
}

#[test]
fn syntax_errors_have_their_line() {
    let [error] = &mistakes("[sdo]\nsize = \n")[..] else { panic!("one mistake") };
    assert!(error.starts_with("x.toml:5: ") && !error.contains('\n'), "{error}");
    let place = |text: &str| read(&format!("{HEAD}{text}")).map(drop).map_err(|found| found[0].in_file("x.toml"));
    assert_eq!(
        place("auto_bit_rate = 300").unwrap_err(),
        "x.toml:4:17: auto_bit_rate: 300 is not in the range 0 to 255"
    );
    assert!(place("source = \"\u{e4}\" @").unwrap_err().starts_with("x.toml:4:14: "), "characters count, not bytes");
}

#[test]
fn every_mistake_is_reported() {
    let text =
        "auto_bit_rate = 300\nquirks = [\"odd\"]\n[factory]\nnode_id = 200\nbit_rate = \"fast\"\n[sdo]\nsize = 1";
    assert_eq!(
        mistakes(text),
        [
            "x.toml:4: auto_bit_rate: 300 is not in the range 0 to 255",
            "x.toml:5: quirks: \"odd\" is not one of: upload-answered60, save-all-resets-cob-ids, \
             cob-id-zero-is-default, emergency-repeats",
            &format!("x.toml:7: node_id: {}", NodeId::new(200).expect_err("too large")),
            "x.toml:8: bit_rate: \"fast\" is not a number",
            "x.toml:10: size: an integer instead of text in quotes",
        ]
    );
}

#[test]
fn a_missing_key_has_the_line_of_its_table() {
    assert_eq!(mistakes("[[signal]]\nname = \"p\"\nchannel = 1"), ["x.toml:4: missing key \"value\""]);
    let misspelt = mistakes("[[signal]]\nname = \"p\"\nchanel = 1\nvalue = \"0x6130:1\"");
    assert!(
        matches!(misspelt.as_slice(), [only] if only.starts_with("x.toml:6: unknown key \"chanel\"")),
        "{misspelt:?}"
    );
}

#[test]
fn timer_is_a_type_with_an_event_timer() {
    for wrong in [0, 253] {
        let mistakes = mistakes(&format!("[pdo]\ntimer = {wrong}\n"));
        assert!(mistakes[0].ends_with(&format!(": timer: {wrong} is neither 254 nor 255")), "{mistakes:?}");
    }
    assert_eq!(mistakes("[pdo]\ntimer = 254\n"), [""; 0]);
}

#[test]
fn signals_differ_in_name_and_channel() {
    let signal =
        |name: &str, channel: u8| format!("[[signal]]\nname = \"{name}\"\nchannel = {channel}\nvalue = \"0x6130:1\"\n");
    let two = |first: String, second: String| mistakes(&(first + &second));
    assert_eq!(
        two(signal("pressure", 1), signal("temperature", 1)),
        ["x.toml:10: channel: two signals have the channel 1"]
    );
    assert_eq!(two(signal("p", 1), signal("p", 2)), ["x.toml:9: name: two signals have the name \"p\""]);
    assert_eq!(mistakes(&signal("p", 0)), ["x.toml:6: channel: 0 is not in the range 1 to 199"]);
    let name = mistakes(&signal("Druck 1", 1));
    assert_eq!(name, ["x.toml:5: name: \"Druck 1\" has other characters than a to z, 0 to 9 and -"]);
    assert_eq!(mistakes(&signal("ch1", 2)), ["x.toml:5: name: \"ch1\" is channel 1, and this is channel 2"]);
    assert_eq!(mistakes(&signal("ch2", 2)), [""; 0]);
    assert_eq!(mistakes(&signal("6130", 1)), ["x.toml:5: name: \"6130\" would be read as an address"]);
}

const OBJECT: &str = "[[object]]\nat = \"0x2000\"\nname = \"o\"\ntype = \"u8\"\naccess = \"rw\"\n";

#[test]
fn objects_that_are_used_must_be_described() {
    let text = format!("{OBJECT}[[signal]]\nname = \"p\"\nchannel = 1\nvalue = \"0x2000\"\nunit = \"0x6131:1\"\n");
    assert_eq!(mistakes(&text), ["x.toml:13: unit: there is no [[object]] 0x6131:1"]);
    let autozero = format!("[[autozero]]\nchannel = 1\nobject = \"0x6125:1\"\n{OBJECT}");
    assert_eq!(mistakes(&autozero), ["x.toml:6: object: there is no [[object]] 0x6125:1"]);
}

#[test]
fn a_description_without_objects_leaves_them_to_the_device() {
    let text = "[[signal]]\nname = \"p\"\nchannel = 1\nvalue = \"0x6130:1\"\nunit = \"0x6131:1\"\n";
    assert_eq!(mistakes(text), Vec::<String>::new());
}

#[test]
fn values_of_an_object_fit_its_type_and_limits() {
    let with = |line: &str| mistakes(&format!("{OBJECT}{line}"));
    assert_eq!(with("default = 255"), Vec::<String>::new());
    assert_eq!(with("default = 256"), ["x.toml:9: default: 256 does not fit u8 (0 to 255)"]);
    assert_eq!(with("low = \"x\""), ["x.toml:9: low: \"x\" is not a value of type u8"]);
    assert_eq!(with("allow = [\"1-2\"]\ndefault = 3"), ["x.toml:10: default: 3 is not allowed by low, high and allow"]);
    assert_eq!(with("allow = [\"300\"]"), ["x.toml:9: allow: 300 does not fit u8"]);
    assert_eq!(with("values = { \"0x100\" = \"many\" }"), ["x.toml:9: values: 256 is not a value of the object"]);
    assert_eq!(with("signature = \"save\""), ["x.toml:9: signature: the object is not a writable u32"]);
    assert_eq!(with(OBJECT).len(), 2, "an address and a name twice");
}

#[test]
fn the_layout_of_the_error_history() {
    assert_eq!(ErrorHistory::CodeLow.read(0x1234_5030), (0x5030, None));
    assert_eq!(ErrorHistory::CodeLowBytesSwapped.read(0x0103_f001), (0xf001, Some([1, 3])));
    assert_eq!(ErrorHistory::CodeHigh.read(0x5030_0000), (0x5030, None));
}

#[test]
fn tpdos_have_parameters_and_map_described_objects() {
    let mapping = |at: &str, default: &str| {
        format!("[[object]]\nat = \"{at}\"\nname = \"m{at}\"\ntype = \"u32\"\naccess = \"rw\"\ndefault = {default}\n")
            .replace("m0x1A00:1", "mapping")
            .replace("m0x1800:1", "cob-id")
    };
    let value = "[[object]]\nat = \"0x2000:1\"\nname = \"v\"\ntype = \"i16\"\naccess = \"ro\"\npdo = true\n";
    let with =
        |default: &str| mistakes(&(value.to_owned() + &mapping("0x1800:1", "384") + &mapping("0x1A00:1", default)));
    assert_eq!(with("0x20000110"), Vec::<String>::new());
    assert_eq!(with("0x20000120"), ["x.toml:21: default: it maps 32 bits of 0x2000:1, which has the type i16"]);
    assert_eq!(with("0x20000210"), ["x.toml:21: default: it maps 0x2000:2, and there is no such [[object]]"]);
    let alone = mistakes(&(value.to_owned() + &mapping("0x1A00:1", "0")));
    assert_eq!(alone, ["x.toml:11: at: there is no [[object]] 0x1800 of the same TPDO"]);
    let hidden =
        value.replace("pdo = true", "pdo = false") + &mapping("0x1800:1", "384") + &mapping("0x1A00:1", "0x20000110");
    assert_eq!(mistakes(&hidden), ["x.toml:21: default: it maps 0x2000:1, and [[object]] 0x2000:1 has no pdo = true"]);
}

#[test]
fn notes_name_what_may_be_a_mistake() {
    let signal = "[[signal]]\nname = \"p\"\nchannel = 1\nvalue = \"0x6130:1\"\n";
    let notes = |text: &str| -> Vec<usize> {
        read_with_notes(&format!("{HEAD}{text}")).1.iter().map(|note| note.place.line).collect()
    };
    assert_eq!(notes(signal), [1, 5], "no [identify], no TPDO");
    assert_eq!(notes(&format!("[identify]\nvendor_id = 1\n{signal}")), [7]);
}

#[test]
fn signals_outside_of_cia_404_have_unit_scale_and_status_of_their_own() {
    let text = "[[signal]]\nname = \"flow\"\nvalue = \"0x2000:1\"\ntype = \"i16\"\nunit = \"l/h\"\nfactor = 0.01\noffset = -5\n\
                status = \"0x2001\"\nstatus_bits = { invalid = 0x80, high = 1 }\nmarkers = { invalid = [-32768] }\n\
                [[signal]]\nname = \"load\"\nvalue = \"0x2000:2\"\nunit = \"%\"\n";
    let description = read(&format!("{HEAD}{text}")).expect("a description");
    let [flow, load] = &description.signals[..] else { panic!("two signals") };
    assert_eq!((flow.channel, load.channel), (200, 201), "no channel of CiA 404");
    let scale = flow.scale.expect("a scale");
    assert_eq!((scale.factor.as_f64(), scale.offset.as_f64()), (0.01, -5.0));
    assert_eq!(flow.fixed_unit.map(|unit| unit.to_string()).as_deref(), Some("l/h"));
    assert_eq!(load.fixed_unit.map(|unit| unit.to_string()).as_deref(), Some("%"));
    let bits = flow.status_bits.as_ref().expect("bits");
    assert_eq!((bits.invalid, bits.high, bits.low, flow.markers.invalid.as_slice()), (0x80, 1, 0, &[-32768][..]));
    let wrong = |line: &str| mistakes(&format!("[[signal]]\nname = \"p\"\nvalue = \"0x2000\"\n{line}"));
    assert_eq!(wrong("factor = 0"), ["x.toml:7: factor: it is 0"]);
    assert_eq!(wrong("factor = 2\ndigits = \"0x2001\""), ["x.toml:8: digits: not together with factor or offset"]);
    assert_eq!(wrong("unit = \"furlong\"").len(), 1);
    assert_eq!(wrong("status_bits = { high = 1 }"), ["x.toml:7: status_bits: there is no status object"]);
    let status = |bits: &str| wrong(&format!("status = \"0x2001\"\nstatus_bits = {bits}"));
    assert_eq!(status("{ high = 1, low = 3 }"), ["x.toml:8: status_bits: a bit has two meanings"]);
    assert_eq!(status("{ invalid = 6, low = 4 }"), ["x.toml:8: status_bits: a bit has two meanings"]);
    assert_eq!(status("{ invalid = 4, low = 3 }"), [""; 0]);
    let narrow = "{ high = 0x100 }\n[[object]]\nat = \"0x2000\"\nname = \"pv\"\ntype = \"i16\"\naccess = \"ro\"\n\
                  [[object]]\nat = \"0x2001\"\nname = \"state\"\ntype = \"u8\"\naccess = \"ro\"\n";
    assert_eq!(status(narrow), ["x.toml:8: status_bits: the status object has bits 0 to 7"]);
    assert_eq!(wrong("markers = { high = [5], low = [5] }"), ["x.toml:7: markers: 5 has two meanings"]);
    assert_eq!(wrong("type = \"i8\"\nmarkers = { low = [-128, 200] }"), ["x.toml:8: markers: 200 does not fit i8"]);
    assert_eq!(wrong("type = \"u16\"\nmarkers = { low = [-1] }"), ["x.toml:8: markers: -1 does not fit u16"]);
    assert_eq!(wrong("channel = -1").len(), 1, "one mistake for one value");
    assert_eq!(wrong("channel = 300").len(), 1, "one mistake for one value");
    for name in ["-p", "p-"] {
        let found = mistakes(&format!("[[signal]]\nname = \"{name}\"\nvalue = \"0x2000\"\n"));
        assert_eq!(found, [format!("x.toml:5: name: \"{name}\" begins or ends with a hyphen")]);
    }
    assert!(wrong("markers = { odd = [1] }")[0].starts_with("x.toml:7: unknown key \"odd\""));
}

#[test]
fn contradictions_of_numbers_are_mistakes() {
    let object = |at: &str, data_type: &str, more: &str| {
        format!("[[object]]\nat = \"{at}\"\nname = \"o\"\ntype = \"{data_type}\"\naccess = \"rw\"\n{more}\n")
    };
    let signal = "[[signal]]\nname = \"p\"\nvalue = \"0x2100\"\n";
    for (text, expected) in [
        ("[factory]\nbit_rate = 250\n".to_owned(), "bit_rate: 250 bit/s is not in the range 5000 to 1000000"),
        (object("0x2100", "u8", "low = 9\nhigh = 1\ndefault = 3"), "low: it is greater than high"),
        (signal.to_owned() + &object("0x2100", "vs", ""), "value: [[object]] 0x2100:0 is not a number, but vs"),
        (
            "[identify]\nvendor_id = 7\n".to_owned() + &object("0x1018:1", "u32", "default = 8"),
            "vendor_id: [[object]] 0x1018:1 has the default 0x00000008",
        ),
    ] {
        let found = mistakes(&text);
        assert!(found.len() == 1 && found[0].ends_with(expected), "{text}: {found:?}");
    }
}
