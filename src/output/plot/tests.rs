use super::*;
use crate::measure::sample::Status;
use crate::output::recording::TimeBase;

const SECOND: i64 = 1_000_000;

/// A value each second from 2023-11-14 22:13:20 UTC.
fn curve(node: u8, signal: &str, unit: &str, values: &[f64]) -> Curve {
    let at = |second: usize| (1_700_000_000 + i64::try_from(second).expect("small")) * SECOND;
    let point = |(second, value): (usize, &f64)| Point { at: at(second), value: *value, status: None };
    let points = values.iter().enumerate().map(point).collect();
    Curve { node, signal: signal.into(), unit: unit.into(), run: 1, points }
}

fn plot(curves: Vec<Curve>, events: &[(i64, &str)]) -> Plot {
    let mut recording = Recording::new(TimeBase::Clock);
    recording.curves = curves;
    recording.events = events
        .iter()
        .map(|(second, event)| EventMark {
            at: (1_700_000_000 + second) * SECOND,
            node: Some(1),
            event: (*event).into(),
        })
        .collect();
    Plot::new(recording, "run.csv".into(), TimeAxis::Clock(|_| 0), [None; 2]).expect("values")
}

fn headings(plot: &Plot) -> Vec<(&str, Vec<&str>)> {
    plot.panels
        .iter()
        .map(|panel| (panel.heading.as_str(), panel.curves.iter().map(|curve| curve.label.as_str()).collect()))
        .collect()
}

#[test]
fn one_panel_for_each_unit() {
    let one = [1.0, 2.0];
    let curves = vec![
        curve(1, "pressure", "bar", &one),
        curve(1, "temperature", "degC", &one),
        curve(2, "pressure", "bar", &one),
        curve(3, "ch1", "degC", &one),
        curve(1, "pressure.status", "code", &one),
        curve(1, "counter", "", &one),
    ];
    let plot = plot(curves, &[]);
    let expected = [
        ("pressure [bar]", vec!["node 1", "node 2"]),
        ("[degC]", vec!["1.temperature", "3.ch1"]),
        ("node 1 pressure.status", vec!["node 1"]),
        ("node 1 counter", vec!["node 1"]),
    ];
    assert_eq!(headings(&plot), expected);
}

#[test]
fn curves_of_one_node_have_the_names_of_their_signals() {
    let one = [1.0, 2.0];
    let plot = plot(vec![curve(3, "ch1", "degC", &one), curve(3, "ch2", "degC", &one)], &[]);
    assert_eq!(headings(&plot), [("node 3 [degC]", vec!["ch1", "ch2"])]);
}

#[test]
fn values_outside_the_chosen_time_are_omitted() {
    let mut recording = Recording::new(TimeBase::Clock);
    recording.curves = vec![curve(1, "pressure", "bar", &[1.0, 2.0, 3.0, 100.0])];
    let at = |second: i64| Some((1_700_000_000 + second) * SECOND);
    let plot = Plot::new(recording, String::new(), TimeAxis::Clock(|_| 0), [at(1), at(2)]).expect("values");
    assert_eq!(plot.span, (at(1).expect("set"), at(2).expect("set")));
    assert!(plot.panels[0].range.1 < 4.0);
    let empty = Recording::new(TimeBase::Clock);
    assert!(Plot::new(empty, String::new(), TimeAxis::Elapsed, [None; 2]).is_none());
}

#[test]
fn svg_has_text_curves_marks_and_events() {
    let mut first = curve(1, "pressure<", "bar", &[1.0, 2.0, 3.0, 2.0, 1.0, 1.0]);
    first.points[2].status = Some(Status::OverloadHigh);
    (first.points[4].value, first.points[4].status) = (f64::NAN, Some(Status::Invalid));
    let svg = svg(&plot(vec![first], &[(2, "emcy"), (2, "emcy"), (5, "gap")]));
    for text in [
        ">node 1 pressure&lt; [bar]<",
        ">2023-11-14 22 h, UTC<",
        ">overload-high<",
        ">invalid<",
        ">emcy 1<",
        ">events: 2 emcy, 1 gap<",
        "#0072b2",
    ] {
        assert!(svg.contains(text), "{text}\n{svg}");
    }
    assert!(!svg.contains("clipped") && !svg.contains("NaN"), "{svg}");
}

#[test]
fn png_has_the_size_of_the_scene() {
    let png = png(&plot(vec![curve(1, "pressure", "bar", &[1.0, 2.0])], &[])).expect("a picture");
    assert!(png.starts_with(b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\0\x07\xd0"), "{:?}", &png[..30]);
    assert!(png.ends_with(b"IEND\xae\x42\x60\x82"));
}

fn lines(plot: &Plot, width: usize) -> Vec<String> {
    let mut out = Vec::new();
    terminal(plot, width, &mut out).expect("memory");
    let text = anstream::adapter::strip_str(&String::from_utf8(out).expect("text")).to_string();
    text.lines().map(str::to_owned).collect()
}

#[test]
fn terminal_plot_fits_every_width() {
    let wave = |phase: usize| -> Vec<f64> { (0..50).map(|at| ((at + phase) as f64 / 5.0).sin()).collect() };
    let curves = |count: u8| {
        (1..=count).map(|node| curve(node, "a-rather-long-signal-name", "bar", &wave(node.into()))).collect()
    };
    for count in [1, 2, 16, 40] {
        let plot = plot(curves(count), &[(3, "emcy"), (9, "gap")]);
        for width in [40, 60, 80, 120, 200] {
            let lines = lines(&plot, width);
            let longest = lines.iter().map(|line| line.chars().count()).max();
            assert!(longest < Some(width), "{longest:?} of {width}\n{}", lines.join("\n"));
        }
    }
    let lines = lines(&plot(curves(2), &[(3, "emcy")]), 80);
    assert_eq!(lines[2], "a-rather-long-signal-name [bar]");
    assert_eq!(lines.iter().filter(|line| line.ends_with(" 1 node 1") || line.ends_with(" 2 node 2")).count(), 2);
    assert_eq!(lines[lines.len() - 1], "▾ 1 emcy");
}

#[test]
fn constant_single_and_invalid_values_are_drawn() {
    let mut invalid = curve(1, "pressure", "bar", &[f64::NAN; 3]);
    invalid.points.iter_mut().for_each(|point| point.status = Some(Status::Invalid));
    for curves in
        [vec![curve(1, "pressure", "bar", &[5.0])], vec![curve(1, "pressure", "bar", &[0.0; 9])], vec![invalid]]
    {
        let plot = plot(curves, &[]);
        assert!(!svg(&plot).contains("NaN") && png(&plot).is_ok(), "{plot:?}");
        let drawn = lines(&plot, 80).concat();
        assert!(drawn.chars().any(|dot| ('\u{2801}'..='\u{28ff}').contains(&dot) || dot == '×'), "{drawn}");
    }
}

#[test]
fn labels_keep_their_distance() {
    assert_eq!(spread(&[5.0, 5.0, 1.0], 2.0, 20.0), [5.0, 7.0, 1.0]);
    assert_eq!(spread(&[9.0, 10.0], 2.0, 10.0), [8.0, 10.0]);
    assert!(spread(&[], 2.0, 10.0).is_empty());
}
