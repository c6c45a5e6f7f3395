use super::bind::Offers;
use super::judge::Jury;
use super::tree::{At, Comparison, Condition, Function, Operator, Quantity, SignalName};
use super::verdict::{Ruling, Silence, Verdict};
use super::{Expression, ExpressionError};
use crate::bus::{Mono, Stamp, Wall};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use crate::measure::sample::{Number, Raw, Sample, Source, Status};
use proptest::prelude::*;
use std::time::Duration;

fn parse(text: &str) -> Expression {
    Expression::parse(text).unwrap_or_else(|error| panic!("{text}: {error} at {}", error.column()))
}

fn refused(text: &str) -> (usize, String) {
    let error = Expression::parse(text).expect_err(text);
    (error.column(), error.message)
}

#[test]
fn what_people_write_is_understood() {
    for (text, shown) in [
        ("pressure in 9.95..10.05 bar", "pressure in 9.95 bar..10.05 bar"),
        ("pressure in -0.5..0.5", "pressure in -0.5..0.5"),
        ("temperature<60", "temperature < 60"),
        ("|pressure| < 0.01", "|pressure| < 0.01"),
        ("mean(pressure) == 1", "mean(pressure) == 1"),
        ("noise( pressure )<0.01bar", "noise(pressure) < 0.01 bar"),
        ("rate(pressure) >= 95", "rate(pressure) >= 95"),
        ("pressure < 1.2 psi", "pressure < 1.2 psi"),
        ("temperature < 20 \u{b0}C", "temperature < 20 degC"),
        ("pressure \u{2264} 3", "pressure <= 3"),
        ("5.pressure - 6.pressure < 1.5e-3", "5.pressure - 6.pressure < 0.0015"),
        ("0x7f.pressure>1", "127.pressure > 1"),
        ("5.pressure-6.pressure<1", "5.pressure - 6.pressure < 1"),
        ("pressure-1<1", "pressure - 1 < 1"),
        ("oil-pressure < 1", "oil-pressure < 1"),
        ("pressure.status == 0x0", "pressure.status == 0"),
        ("5.pressure.status == 0", "5.pressure.status == 0"),
        ("6130:1 > 2", "0x6130:1 > 2"),
        ("5.0x6130:1 > 2", "5.0x6130:1 > 2"),
        ("5.6130h:1 > 2", "5.0x6130:1 > 2"),
        ("(a + b) * c - d / (e - f) > -2", "(a + b) * c - d / (e - f) > -2"),
        ("a - (b - c) > 0", "a - (b - c) > 0"),
        ("||a| - |b|| < 1", "||a| - |b|| < 1"),
        ("not (a < 1 or b > 2) or c in 1..2", "not (a < 1 or b > 2) or c in 1..2"),
        ("(a < 1 and b > 2) and c != 3", "a < 1 and b > 2 and c != 3"),
        ("a in b - 1..b + 1", "a in b - 1..b + 1"),
        ("a in 1..2 min", "a in 1 min..2 min"),
        ("min(a) > 1 min", "min(a) > 1 min"),
    ] {
        assert_eq!(parse(text).to_string(), shown, "{text}");
    }
    assert_eq!(parse("a < 1 and (b < 1 and c < 1)").parts().len(), 3);
}

#[test]
fn errors_point_at_the_character() {
    for (text, column, message) in [
        ("", 1, "something is missing at the end"),
        ("pressure", 9, "a comparison is missing here: < <= > >= == != or in"),
        ("pressure <", 11, "something is missing at the end"),
        ("pressure < 3 furlong", 14, "\"furlong\" is not a known unit"),
        ("pressure in 9.95", 17, "\"..\" is missing here: a range is 9.95..10.05"),
        ("pressure in 10..9", 17, "the range counts backwards: 9 is less than 10"),
        ("pressure in -9..-10 bar", 17, "the range counts backwards: -10 is less than -9"),
        ("1 < pressure < 3", 14, "\"<\" is not expected here"),
        ("pressure = 3", 10, "\"=\" means nothing here; write =="),
        ("a < 1 && b < 1", 7, "\"&&\" means nothing here; write and"),
        ("pressure < 3 #", 14, "\"#\" means nothing here"),
        ("\u{b0} < \u{20ac}", 5, "\"\u{20ac}\" means nothing here"),
        ("median(pressure) < 3", 1, "there is no function median()"),
        ("mean(pressure < 3", 15, "\")\" is missing here"),
        ("mean(3) < 3", 6, "mean() wants something measured"),
        ("mean(max(pressure)) < 3", 6, "a function of a function is not known here"),
        (
            "pressure < mean(pressure)",
            12,
            "what is known with every sample and what is known at the end cannot stand together",
        ),
        (
            "a < 1 or mean(b) < 1",
            10,
            "what is known with every sample and what is known at the end cannot stand together",
        ),
        ("1 < 2", 3, "nothing in this comparison is measured"),
        ("0x1001 == 0", 8, "nothing in this comparison is measured"),
        ("(a < 3) + 1 < 2", 1, "a value is wanted here, and this is a condition"),
        ("a + 1 or b < 2", 7, "a comparison is missing here: < <= > >= == != or in"),
        ("200.pressure < 1", 1, "\"200\" is not a node-ID: they go from 1 to 127"),
        ("0.pressure < 1", 1, "\"0\" is not a node-ID: they go from 1 to 127"),
        ("a < 1e999", 5, "1e999 is too large"),
        ("a < 1 2", 7, "2 is not expected here"),
        ("a < 1)", 6, "\")\" is not expected here"),
        ("a < * 2", 5, "a value is missing before \"*\""),
    ] {
        assert_eq!(refused(text), (column, message.to_owned()), "{text}");
    }
    let deep = format!("{}a{} < 1", "(".repeat(100), ")".repeat(100));
    assert_eq!(refused(&deep), (52, "this is nested too deep".to_owned()));
    assert_eq!(refused(&format!("{}a < 1", "-".repeat(900))), (52, "this is nested too deep".to_owned()));
    assert_eq!(refused(&"a".repeat(1001)), (1001, "an expression has at most 1000 characters".to_owned()));
    assert_eq!(
        refused(&format!("a{} < 1", "+1".repeat(101))),
        (202, "an expression has at most 100 operators".to_owned())
    );
    // As long as it may be, it is read, shown, judged and let go.
    let long = format!("a{} < 1", "+1".repeat(100));
    assert_eq!(ruling(&long, &[("a", "", &[1.0])]), Ruling::Fail);
}

fn signal() -> impl Strategy<Value = Quantity> {
    let what = prop_oneof![
        "[a-z]{1,3}(-[a-z])?"
            .prop_filter("no keyword", |name| !["in", "and", "or", "not"].contains(&name.as_str()))
            .prop_map(Wanted::Signal),
        "z[a-z]{0,3}".prop_map(Wanted::Status),
        (any::<u16>(), any::<u8>()).prop_map(|(index, sub)| Wanted::Object(ObjectId::new(index, sub))),
    ];
    (proptest::option::of(1u8..=127), what).prop_map(|(node, what)| {
        Quantity::Signal(SignalName { node: node.and_then(|node| NodeId::new(node).ok()), what, at: At(0) })
    })
}

fn measured() -> impl Strategy<Value = Quantity> {
    let unit = proptest::option::of(proptest::sample::select(vec!["bar", "psi", "degC", "mV", "ms"]));
    let number = (0u32..100_000, 0i32..6, unit).prop_map(|(number, power, unit)| {
        let unit = unit.and_then(Unit::from_symbol);
        Quantity::Number(f64::from(number) / 10f64.powi(power), unit, At(0))
    });
    let operator =
        proptest::sample::select(vec![Operator::Add, Operator::Subtract, Operator::Multiply, Operator::Divide]);
    prop_oneof![signal(), number].prop_recursive(4, 12, 2, move |inner| {
        prop_oneof![
            inner.clone().prop_map(|inner| Quantity::Negative(Box::new(inner), At(0))),
            inner.clone().prop_map(|inner| Quantity::Absolute(Box::new(inner), At(0))),
            (inner.clone(), operator.clone(), inner).prop_map(|(left, operator, right)| Quantity::Arithmetic(
                Box::new(left),
                operator,
                Box::new(right),
                At(0)
            )),
        ]
    })
}

/// A quantity in which something is measured.
fn quantity(gathered: bool) -> impl Strategy<Value = Quantity> {
    (measured(), signal(), proptest::sample::select(Function::ALL.to_vec())).prop_map(
        move |(inner, signal, function)| {
            let sum = Quantity::Arithmetic(Box::new(inner), Operator::Add, Box::new(signal), At(0));
            if gathered { Quantity::Aggregate(function, Box::new(sum), At(0)) } else { sum }
        },
    )
}

fn condition() -> impl Strategy<Value = Condition> {
    let comparison = proptest::sample::select(vec![
        Comparison::Less,
        Comparison::AtMost,
        Comparison::Greater,
        Comparison::AtLeast,
        Comparison::Equal,
        Comparison::Unequal,
    ]);
    any::<bool>().prop_flat_map(move |gathered| {
        let leaf = prop_oneof![
            (quantity(gathered), comparison.clone(), quantity(gathered))
                .prop_map(|(left, comparison, right)| Condition::Compare(left, comparison, right, At(0))),
            (quantity(gathered), quantity(gathered), quantity(gathered))
                .prop_map(|(value, low, high)| Condition::Within(value, low, high, At(0))),
        ];
        leaf.prop_recursive(3, 4, 2, |inner| {
            prop_oneof![
                inner.clone().prop_map(|inner| Condition::Not(Box::new(inner))),
                (inner.clone(), inner.clone())
                    .prop_map(|(left, right)| Condition::And(Box::new(left), Box::new(right))),
                (inner.clone(), inner).prop_map(|(left, right)| Condition::Or(Box::new(left), Box::new(right))),
            ]
        })
    })
}

proptest! {
    #[test]
    fn any_text_is_an_expression_or_an_error_inside_it(text in "\\PC{0,60}") {
        whole(&text)?;
    }

    #[test]
    fn and_so_is_any_row_of_words(
        words in proptest::collection::vec(proptest::sample::select(vec![
            "pressure", "5.", "in", "..", "1", "9.95", "e3", "0x", "6130:1", ".status", "(", ")", "|", "-", "<", ">=",
            "mean(", "not", "and", "or", " ", "bar", "degC", "*", "/", "\u{b0}", ":", ".",
        ]), 0..20)
    ) {
        whole(&words.concat())?;
        whole(&words.join(" "))?;
    }

    #[test]
    fn what_is_shown_reads_back(condition in condition()) {
        let text = condition.to_string();
        prop_assume!(text.len() <= 1000);
        let read = parse(&text);
        let mut parts = Vec::new();
        super::split(condition, &mut parts);
        prop_assert_eq!(read.parts(), &parts, "{}", text);
        prop_assert_eq!(parse(&read.to_string()), Expression { text: read.to_string(), parts });
    }
}

/// An expression shows itself as one that reads back; an error points at a character of the text or behind it.
fn whole(text: &str) -> Result<(), TestCaseError> {
    match Expression::parse(text) {
        Ok(expression) => {
            let again = parse(&expression.to_string());
            prop_assert_eq!(again.parts(), expression.parts());
        }
        Err(error) => {
            prop_assert!(error.text.is_char_boundary(error.at), "{}: {}", text, error.at);
            prop_assert!(error.column() <= text.chars().count() + 1);
            prop_assert!(!error.message.is_empty());
        }
    }
    Ok(())
}

/// A signal of node 5 with its unit and its values, 10 ms apart.
type Signal<'a> = (&'a str, &'a str, &'a [f64]);

fn sources(signals: &[Signal<'_>]) -> Vec<Source> {
    let source = |name: &str, unit: &str| {
        let (node, signal) = name.split_once('.').unwrap_or(("5", name));
        Source { node: node.parse().expect("a node-ID"), signal: signal.into(), unit: unit.into() }
    };
    signals.iter().map(|(name, unit, _)| source(name, unit)).collect()
}

fn bound(text: &str, signals: &[Signal<'_>]) -> Result<Jury, ExpressionError> {
    let offers = Offers::of_sources(&sources(signals));
    let mut jury = Jury::new(&[parse(text)]);
    jury.bind(&offers.nodes(), &offers, true, &[])?;
    Ok(jury)
}

fn sample(at_ms: u64, source: usize, value: Option<f64>) -> Sample {
    let since = Duration::from_millis(at_ms);
    let at = Stamp { mono: Mono::at(since), wall: Wall::at(since) };
    let status = Some(if value.is_some() { Status::Ok } else { Status::OverloadHigh });
    Sample { at, source, value: value.map(Number::Real64), status, raw: Raw::new(&[]) }
}

/// What becomes of the signals' values; NaN is an invalid one.
fn verdict(text: &str, signals: &[Signal<'_>]) -> Verdict {
    let mut jury = bound(text, signals).unwrap_or_else(|error| panic!("{text}: {error}"));
    let longest = signals.iter().map(|(.., values)| values.len()).max().unwrap_or(0);
    for at in 0..longest {
        for (source, (.., values)) in signals.iter().enumerate() {
            if let Some(value) = values.get(at) {
                let value = Some(*value).filter(|value| !value.is_nan());
                jury.take(&[sample(10 * at as u64, source, value)], &sources(signals));
            }
        }
    }
    let mut verdicts = jury.verdicts(None, &[]);
    assert_eq!(verdicts.len(), 1, "{verdicts:?}");
    verdicts.remove(0)
}

fn ruling(text: &str, signals: &[Signal<'_>]) -> Ruling {
    verdict(text, signals).ruling
}

const NAN: f64 = f64::NAN;

#[test]
fn every_sample_has_to_satisfy() {
    let pressure = |values| [("pressure", "bar", values)];
    for (text, values, expected) in [
        ("pressure in 9.95..10.05 bar", &[9.95, 10.0, 10.05][..], Ruling::Ok),
        ("pressure in 9.95..10.05 bar", &[10.0, 10.051, 10.0], Ruling::Fail),
        ("pressure < 10", &[10.0], Ruling::Fail),
        ("pressure <= 10", &[10.0], Ruling::Ok),
        ("pressure > 10", &[10.0], Ruling::Fail),
        ("pressure >= 10", &[10.0], Ruling::Ok),
        ("pressure != 10", &[10.0], Ruling::Fail),
        ("10 > pressure", &[9.0], Ruling::Ok),
        ("|pressure| < 0.01", &[-0.009, 0.009], Ruling::Ok),
        ("|pressure| < 0.01", &[-0.011], Ruling::Fail),
        ("pressure > 1 and pressure < 3", &[2.0, 3.0], Ruling::Fail),
        ("pressure < 1 or pressure > 3", &[0.0, 4.0], Ruling::Ok),
        ("pressure < 1 or pressure > 3", &[2.0], Ruling::Fail),
        ("not pressure < 3", &[3.0], Ruling::Ok),
        // Without a valid value nothing holds, not even that something does not.
        ("pressure < 3", &[1.0, NAN], Ruling::Fail),
        ("not pressure < 3", &[NAN], Ruling::Fail),
        ("pressure < 1 or not pressure < 1", &[NAN], Ruling::Fail),
        ("1 bar / pressure < 3", &[0.0], Ruling::Fail),
        ("not 1 bar / pressure < 3", &[0.0], Ruling::Fail),
        ("pressure < 3", &[], Ruling::NoData),
    ] {
        assert_eq!(ruling(text, &pressure(values)), expected, "{text} of {values:?}");
    }
    let verdict = verdict("pressure < 3", &pressure(&[1.0, 4.0, 5.0, NAN]));
    assert_eq!((verdict.count, verdict.violations, verdict.invalid), (4, 2, 1));
    let first = verdict.first.expect("a violation");
    assert_eq!((first.elapsed, first.values), (Duration::from_millis(10), vec![Some(4.0)]));
    let shown = &verdict.values[0];
    assert_eq!((shown.range, shown.unit.map(|unit| unit.to_string())), (Some((1.0, 5.0)), Some("bar".to_owned())));
}

#[test]
fn functions_are_judged_at_the_end() {
    // As far off as that, a naive sum of squares loses everything.
    let far = [1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0];
    for (text, values, expected) in [
        ("noise(p) in 5.4772..5.4773", &far[..], Ruling::Ok),
        ("mean(p) == 1000000010", &far, Ruling::Ok),
        ("min(p) == 1000000004 and max(p) == 1000000016", &far, Ruling::Ok),
        ("max(p) - min(p) <= 12", &far, Ruling::Ok),
        ("max(p) - min(p) < 12", &far, Ruling::Fail),
        ("rate(p) in 99..101", &far, Ruling::Ok),
        ("rate(p) > 101 Hz", &far, Ruling::Fail),
        ("gap(p) <= 10 ms", &far, Ruling::Ok),
        ("gap(p) < 10 ms", &far, Ruling::Fail),
        ("count(p) == 4", &far, Ruling::Ok),
        ("noise(p) < 1", &[3.0], Ruling::NoData),
        ("rate(p) > 1", &[3.0], Ruling::NoData),
        ("mean(p) < 5", &[3.0], Ruling::Ok),
        ("mean(|p|) > 2", &[-3.0, 3.0], Ruling::Ok),
        ("|mean(p)| < 1", &[-3.0, 3.0], Ruling::Ok),
        ("mean(p) < 5 or max(p) < 1", &[3.0, 4.0], Ruling::Ok),
        // An invalid sample fails, but where it is asked about.
        ("mean(p) < 5", &[3.0, NAN], Ruling::Fail),
        ("rate(p) > 5", &[3.0, NAN], Ruling::Fail),
        ("mean(p) < 5", &[NAN], Ruling::Fail),
        ("invalid(p) <= 1", &[3.0, NAN], Ruling::Ok),
        ("invalid(p) == 0", &[3.0, NAN], Ruling::Fail),
        ("invalid(p) == 0", &[], Ruling::NoData),
        ("count(p) == 0", &[], Ruling::NoData),
    ] {
        assert_eq!(ruling(text, &[("p", "", values)]), expected, "{text} of {values:?}");
    }
}

#[test]
fn a_number_is_the_one_that_its_text_reads_as() {
    // REAL32 has no 9.95: what it has is printed as 9.95, and is judged as that.
    let offers = sources(&[("p", "bar", &[])]);
    for (text, expected) in [("p >= 9.95", Ruling::Ok), ("p > 9.95", Ruling::Fail), ("p in 9.95..9.95", Ruling::Ok)] {
        let mut jury = bound(text, &[("p", "bar", &[])]).expect("bound");
        let value = Some(Number::Real32(9.95));
        jury.take(&[Sample { value, ..sample(0, 0, Some(0.0)) }], &offers);
        assert_eq!(jury.verdicts(None, &[])[0].ruling, expected, "{text}");
    }
}

#[test]
fn units_are_brought_together() {
    for (text, unit, value, expected) in [
        ("p < 1.2 psi", "bar", 0.08, Ruling::Ok),
        ("p < 1.2 psi", "bar", 0.083, Ruling::Fail),
        ("p <= 1100 mbar", "bar", 1.1, Ruling::Ok),
        ("p >= 1100 mbar", "bar", 1.1, Ruling::Ok),
        ("p < 1100 mbar", "bar", 1.1, Ruling::Fail),
        ("p in 1..20 psi", "bar", 1.0, Ruling::Ok),
        ("p in 0.5 bar..20 psi", "kPa", 100.0, Ruling::Ok),
        ("p > 300 K", "degC", 27.0, Ruling::Ok),
        ("p > 300 K", "degC", 26.0, Ruling::Fail),
        ("p < 100 degF", "degC", 37.7, Ruling::Ok),
        ("p - p < 1 K", "degC", 20.0, Ruling::Ok),
        ("(p + p) / 2 < 293.2 K", "degC", 20.0, Ruling::Ok),
        ("(p + p) / 2 > 293.1 K", "degC", 20.0, Ruling::Ok),
        ("p / 2 bar == 5", "mbar", 10_000.0, Ruling::Ok),
        ("p * 2 < 3 bar", "bar", 1.4, Ruling::Ok),
        ("p + 100 mbar < 1.5 bar", "bar", 1.45, Ruling::Fail),
        ("p - 20 < 5", "degC", 24.0, Ruling::Ok),
        ("p < 7", "0x00F10000", 6.0, Ruling::Ok),
    ] {
        assert_eq!(ruling(text, &[("p", unit, &[value])]), expected, "{text} of {value} {unit}");
    }
    let verdict = verdict("p < 20 psi", &[("p", "bar", &[1.0])]);
    assert_eq!(verdict.values[0].unit, Unit::from_symbol("psi"), "in the unit of the limit");
    // The spread and the difference of two temperatures have no zero.
    assert_eq!(ruling("noise(t) in 1.7..1.9 degF", &[("t", "degC", &[20.0, 21.0, 22.0])]), Ruling::Ok);
    let two = [("5.t", "degC", &[20.0][..]), ("6.t", "degF", &[68.0])];
    assert_eq!(ruling("|5.t - 6.t| < 0.001", &two), Ruling::Ok);
    assert_eq!(ruling("|5.t - 6.t| < 0.001 degF", &two), Ruling::Ok);
    assert_eq!(ruling("5.t == 6.t", &two), Ruling::Ok);
}

#[test]
fn what_does_not_go_together_is_said_before() {
    for (text, unit, column, message) in [
        ("p < 20 degC", "bar", 5, "p is in bar, and 20 degC is in degC"),
        ("p in 1 bar..20 degC", "bar", 13, "p is in bar, and 20 degC is in degC"),
        ("20 degC > p", "bar", 1, "p is in bar, and 20 degC is in degC"),
        ("p + 1 K < 3", "bar", 5, "1 K is in K, and p is in bar"),
        ("p < 20 bar", "", 5, "p is without a unit, and 20 bar is in bar"),
        ("p < 20 bar", "0x00F10000", 5, "p is in 0x00F10000, and 20 bar is in bar"),
        ("p * p < 20", "bar", 3, "a value in bar times one in bar has no unit that is known here"),
        ("1 / p < 20", "bar", 3, "a value without a unit divided by one in bar has no unit that is known here"),
        ("count(p) < 20 bar", "bar", 12, "count(p) is without a unit, and 20 bar is in bar"),
        ("rate(p) < 20 bar", "bar", 11, "rate(p) is in Hz, and 20 bar is in bar"),
        ("p - 2 K > 20", "degC", 5, "2 K may be a temperature here or a difference of two"),
        ("p - 2 > 20 K", "degC", 9, "20 K may be a temperature here or a difference of two"),
        ("|p| < 60 degF", "degC", 7, "60 degF may be a temperature here or a difference of two"),
        ("presure < 3", "bar", 1, "node 5 has no signal \"presure\""),
        ("1 < 6.p", "bar", 5, "node 6 is none of those named"),
    ] {
        let error = bound(text, &[("p", unit, &[])]).expect_err(text);
        assert_eq!((error.column(), error.message.as_str()), (column, message), "{text}");
    }
}

#[test]
fn several_signals_are_judged_when_each_has_come() {
    // They rise together: within a cycle the one is ahead of the other, and that is no difference of theirs.
    let rising: Vec<f64> = (0..100).map(f64::from).collect();
    let two = [("5.p", "bar", &rising[..]), ("6.p", "bar", &rising)];
    let judged = verdict("5.p - 6.p == 0", &two);
    assert_eq!((judged.ruling, judged.count), (Ruling::Ok, 100));
    assert_eq!(verdict("mean(5.p - 6.p) == 0", &two).count, 100);
    // Every sample of the quicker one is judged, too.
    let quick = [1.0, 1.0, 9.0, 1.0, 1.0];
    let uneven = [("5.p", "bar", &quick[..]), ("6.p", "bar", &[1.0])];
    assert_eq!(verdict("5.p - 6.p < 1", &uneven).violations, 1);
    let at_the_end = [("5.p", "bar", &[1.0, 9.0][..]), ("6.p", "bar", &[1.0])];
    assert_eq!(verdict("5.p - 6.p < 1", &at_the_end).violations, 1);
    assert_eq!(verdict("5.p < 2 or 6.p > 5", &uneven).violations, 1);
    let invalid = [("5.p", "bar", &[1.0][..]), ("6.p", "bar", &[NAN])];
    assert_eq!(verdict("5.p < 2 or 6.p > 5", &invalid).ruling, Ruling::Fail, "one side that holds does not excuse it");
    let missing = [("5.p", "bar", &[1.0, 9.0][..]), ("6.p", "bar", &[])];
    let judged = verdict("5.p - 6.p < 1", &missing);
    assert_eq!((judged.ruling, judged.reason.as_deref()), (Ruling::NoData, Some("node 6: p did not come")));
    assert_eq!(verdict("5.p < 2 and 6.p < 2", &missing).ruling, Ruling::Fail);
}

#[test]
fn without_a_node_it_is_judged_for_each() {
    let signals = sources(&[("5.p", "bar", &[]), ("6.p", "psi", &[]), ("7.t", "degC", &[])]);
    let offers = Offers::of_sources(&signals);
    let jury = |text: &str, excuse| {
        let mut jury = Jury::new(&[parse(text), parse(text)]);
        jury.bind(&offers.nodes(), &offers, excuse, &[]).map(|()| jury)
    };
    let mut both = jury("p < 2 bar", true).expect("bound");
    assert_eq!(both.wanted_of(signals[1].node), [Wanted::Signal("p".into())]);
    both.take(&[sample(0, 0, Some(1.9)), sample(1, 1, Some(29.1)), sample(2, 2, Some(99.0))], &signals);
    let verdicts = both.verdicts(None, &[]);
    let rulings: Vec<_> = verdicts.iter().map(|verdict| (verdict.node.map(NodeId::get), verdict.ruling)).collect();
    assert_eq!(rulings, [(Some(5), Ruling::Ok), (Some(6), Ruling::Fail)]);
    assert_eq!(jury("p < 2", false).expect_err("7 has no p").message, "node 7 has no signal \"p\"");
    assert!(jury("q < 2", true).is_err(), "nobody has it");
    // Silent at the end: what was good until then is no success.
    let mut one = jury("5.p < 2", true).expect("bound");
    one.take(&[sample(0, 0, Some(1.0))], &signals);
    let silent = [Silence { node: signals[0].node, signal: None, reason: "node 5 is silent".to_owned() }];
    let verdict = one.clone().verdicts(None, &silent).remove(0);
    assert_eq!((verdict.ruling, verdict.reason.as_deref()), (Ruling::NoData, Some("node 5 is silent")));
    assert_eq!(one.verdicts(None, &[])[0].ruling, Ruling::Ok);
}

#[test]
fn a_signal_that_ceases_leaves_no_verdict() {
    let two = [("5.p", "bar", &[1.0, 1.0, 1.0][..]), ("5.t", "degC", &[])];
    let mut jury = bound("p < 2", &two).expect("bound");
    for at in 0..100 {
        jury.take(&[sample(at * 300, 0, Some(1.0))], &sources(&two));
    }
    let ruling = |jury: &Jury, end_ms| {
        jury.clone().verdicts(Some(Mono::at(Duration::from_millis(end_ms))), &[]).remove(0).ruling
    };
    // Five of its intervals are 1.5 s; the last one came at 29.7 s.
    assert_eq!((ruling(&jury, 31_200), ruling(&jury, 31_201)), (Ruling::Ok, Ruling::NoData));
    jury.take(&[sample(29_800, 0, Some(3.0))], &sources(&two));
    assert_eq!(ruling(&jury, 60_000), Ruling::Fail, "what failed has failed");
}

#[test]
fn a_unit_that_changes_while_it_is_recorded() {
    let before = sources(&[("p", "bar", &[])]);
    let mut jury = bound("p < 2", &[("p", "bar", &[])]).expect("bound");
    jury.take(&[sample(0, 0, Some(1.0))], &before);
    let mut after = before.clone();
    after.extend(sources(&[("p", "mbar", &[]), ("p", "degC", &[])]));
    jury.take(&[sample(10, 1, Some(1999.0))], &after);
    assert_eq!(jury.clone().verdicts(None, &[])[0].ruling, Ruling::Ok);
    let mut lost = jury.clone();
    jury.take(&[sample(20, 1, Some(2001.0))], &after);
    assert_eq!(jury.verdicts(None, &[])[0].violations, 1);
    lost.take(&[sample(20, 2, Some(1.0))], &after);
    assert_eq!(lost.verdicts(None, &[])[0].invalid, 1);
}
