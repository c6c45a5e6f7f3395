use super::*;
use crate::measure::sample::Number;

struct Reading {
    node: u8,
    value: Option<Number>,
    history: Vec<(u16, &'static str)>,
}

impl Report for Reading {
    const COLUMNS: &'static [Column] = &[
        Column::new("node").right(),
        Column::new("value").heading("PRESSURE"),
        Column::new("vendor"),
        Column::new("id").json_only(),
        Column::nested("history", &[Column::new("number").csv_only(), Column::new("code"), Column::new("text")]),
    ];

    fn cells(&self) -> Vec<Cell> {
        let history = self.history.iter().zip(1u8..);
        let history = history.map(|((code, text), at)| vec![at.into(), Cell::hex(*code, 4), (*text).into()]);
        let history = Cell::Rows(history.collect());
        vec![self.node.into(), self.value.into(), Cell::Code(71), Cell::cob_id(0x181), history]
    }
}

fn all() -> [Reading; 2] {
    let value = Number::Decimal { mantissa: 50_000, digits: 3 };
    [
        Reading { node: 127, value: Some(value), history: vec![(0x1000, "generic, with a comma"), (0x8130, "")] },
        Reading { node: 5, value: None, history: vec![] },
    ]
}

fn rendered(format: Format) -> String {
    let mut out = Vec::new();
    render(&all(), format, &mut out).expect("memory");
    String::from_utf8(out).expect("text")
}

#[test]
fn json_has_every_field_and_null_for_unknown_values() {
    assert_eq!(
        rendered(Format::Json),
        "{\"node\":127,\"value\":50.0,\"vendor\":71,\"id\":\"0x181\",\"history\":[{\"code\":\"0x1000\",\
         \"text\":\"generic, with a comma\"},{\"code\":\"0x8130\",\"text\":null}]}\n\
         {\"node\":5,\"value\":null,\"vendor\":71,\"id\":\"0x181\",\"history\":[]}\n"
    );
}

#[test]
fn csv_has_one_line_per_nested_row() {
    assert_eq!(
        rendered(Format::Csv),
        "node,value,vendor,number,code,text\n127,50.000,71,1,0x1000,\"generic, with a comma\"\n\
         127,50.000,71,2,0x8130,\n"
    );
}

#[test]
fn text_is_an_aligned_table() {
    assert_eq!(
        rendered(Format::Text),
        "NODE  PRESSURE  VENDOR\n 127  50.000    0x00000047\n   5  -         0x00000047\n"
    );
}

#[test]
fn a_stream_prints_the_same_data_row_by_row() {
    for format in [Format::Json, Format::Csv] {
        let mut out = Vec::new();
        let mut stream = Stream::new(format, &mut out).expect("memory");
        all().iter().try_for_each(|report| stream.push(report)).expect("memory");
        assert_eq!(String::from_utf8(out).expect("text"), rendered(format));
    }
    let mut out = Vec::new();
    let mut stream = Stream::new(Format::Text, &mut out).expect("memory");
    all().iter().try_for_each(|report| stream.push(report)).expect("memory");
    assert_eq!(String::from_utf8(out).expect("text"), "127  50.000  0x00000047\n5  -  0x00000047\n");
}

#[test]
fn text_from_a_device_starts_no_formula() {
    for formula in ["=HYPERLINK(1)", "+1+cmd", "-2+3", "@SUM(A1)", "\t=1"] {
        assert_eq!(Cell::from(formula).in_csv(), format!("'{formula}"));
        assert_eq!(Cell::List(vec![formula.into()]).in_csv(), format!("'{formula}"));
        assert_eq!(Cell::from(formula).plain(), formula, "only in CSV");
    }
    assert_eq!(Cell::from("MH-4-CAN").in_csv(), "MH-4-CAN");
    assert_eq!(
        [Cell::from("-5").in_csv(), Cell::from("-1.5e3").in_csv(), Cell::Integer(-5).in_csv()],
        ["-5", "-1.5e3", "-5"]
    );
}
