mod shared;

use super::bind::AvailableSignals;
use super::evaluator::Evaluator;
use super::tree::{Condition, Function, Operator, Position, Quantity, Relation, SignalName};
use super::verdict::{MissingData, Outcome, Reason, Verdict};
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
fn expressions_parse() {
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
fn errors_have_a_position() {
    for (text, column, message) in [
        ("", 1, "the expression is incomplete"),
        ("pressure", 9, "expected a comparison: < <= > >= == != or in"),
        ("pressure <", 11, "the expression is incomplete"),
        ("pressure < 3 furlong", 14, "unknown unit \"furlong\""),
        ("pressure in 9.95", 17, "expected \"..\""),
        ("pressure in 10..9", 17, "the range is reversed: 9 is less than 10"),
        ("pressure in -9..-10 bar", 17, "the range is reversed: -10 is less than -9"),
        ("1 < pressure < 3", 14, "unexpected \"<\""),
        ("pressure = 3", 10, "\"=\" is not supported here; use =="),
        ("a < 1 && b < 1", 7, "\"&&\" is not supported here; use and"),
        ("pressure < 3 #", 14, "unexpected character \"#\""),
        ("\u{b0} < \u{20ac}", 5, "unexpected character \"\u{20ac}\""),
        ("median(pressure) < 3", 1, "unknown function median()"),
        ("mean(pressure < 3", 15, "expected \")\""),
        ("mean(3) < 3", 6, "mean() needs a signal"),
        ("mean(max(pressure)) < 3", 6, "functions cannot be nested"),
        ("pressure < mean(pressure)", 12, "values of single samples and functions of all samples cannot be mixed"),
        ("a < 1 or mean(b) < 1", 10, "values of single samples and functions of all samples cannot be mixed"),
        ("1 < 2", 3, "this comparison contains no signal"),
        ("0x0F01 == 0", 8, "this comparison contains no signal"),
        ("0x1001 bar == 0", 12, "this comparison contains no signal"),
        ("(a < 3) + 1 < 2", 1, "expected a value, found a condition"),
        ("a + 1 or b < 2", 7, "expected a comparison: < <= > >= == != or in"),
        ("200.pressure < 1", 1, "200 is not a valid node-ID (1 to 127)"),
        ("0.pressure < 1", 1, "0 is not a valid node-ID (1 to 127)"),
        ("a < 1e999", 5, "1e999 is too large"),
        ("a < 1 2", 7, "unexpected 2"),
        ("a < 1)", 6, "unexpected \")\""),
        ("a < * 2", 5, "expected a value before \"*\""),
    ] {
        assert_eq!(refused(text), (column, message.to_owned()), "{text}");
    }
    let deep = format!("{}a{} < 1", "(".repeat(100), ")".repeat(100));
    assert_eq!(refused(&deep), (52, "nested too deeply (at most 50 levels)".to_owned()));
    assert_eq!(refused(&format!("{}a < 1", "-".repeat(900))), (52, "nested too deeply (at most 50 levels)".to_owned()));
    assert_eq!(refused(&"a".repeat(1001)), (1001, "the expression is too long (at most 1000 characters)".to_owned()));
    assert_eq!(refused(&format!("a{} < 1", "+1".repeat(101))), (202, "too many operators (at most 100)".to_owned()));
    // The longest expression is parsed, printed, evaluated and dropped.
    let long = format!("a{} < 1", "+1".repeat(100));
    assert_eq!(outcome(&long, &[("a", "", &[1.0])]), Outcome::Fail);
}

fn signal() -> impl Strategy<Value = Quantity> {
    let what = prop_oneof![
        // The names are not units: "bar / a" would be read as bar per year.
        "x[abc]{0,2}(-[a-z])?".prop_map(Wanted::Signal),
        "z[a-z]{0,3}".prop_map(Wanted::Status),
        (any::<u16>(), any::<u8>()).prop_map(|(index, sub)| Wanted::Object(ObjectId::new(index, sub), None)),
    ];
    (proptest::option::of(1u8..=127), what).prop_map(|(node, what)| {
        Quantity::Signal(SignalName { node: node.and_then(|node| NodeId::new(node).ok()), what, at: Position(0) })
    })
}

fn measured() -> impl Strategy<Value = Quantity> {
    let unit = proptest::option::of(proptest::sample::select(vec!["bar", "psi", "degC", "mV", "ms"]));
    let number = (0u32..100_000, 0i32..6, unit).prop_map(|(number, power, unit)| {
        let unit = unit.and_then(Unit::from_symbol);
        Quantity::Number(f64::from(number) / 10f64.powi(power), unit, Position(0))
    });
    let operator =
        proptest::sample::select(vec![Operator::Add, Operator::Subtract, Operator::Multiply, Operator::Divide]);
    prop_oneof![signal(), number].prop_recursive(4, 12, 2, move |inner| {
        prop_oneof![
            inner.clone().prop_map(|inner| Quantity::Negative(Box::new(inner), Position(0))),
            inner.clone().prop_map(|inner| Quantity::Absolute(Box::new(inner), Position(0))),
            (inner.clone(), operator.clone(), inner).prop_map(|(left, operator, right)| Quantity::Arithmetic(
                Box::new(left),
                operator,
                Box::new(right),
                Position(0)
            )),
        ]
    })
}

/// Generates a quantity that contains a signal.
fn quantity(aggregate: bool) -> impl Strategy<Value = Quantity> {
    (measured(), signal(), proptest::sample::select(Function::ALL.to_vec())).prop_map(
        move |(inner, signal, function)| {
            let sum = Quantity::Arithmetic(Box::new(inner), Operator::Add, Box::new(signal), Position(0));
            if aggregate { Quantity::Aggregate(function, Box::new(sum), Position(0)) } else { sum }
        },
    )
}

fn condition() -> impl Strategy<Value = Condition> {
    let relation = proptest::sample::select(vec![
        Relation::Less,
        Relation::AtMost,
        Relation::Greater,
        Relation::AtLeast,
        Relation::Equal,
        Relation::Unequal,
    ]);
    any::<bool>().prop_flat_map(move |aggregate| {
        let leaf = prop_oneof![
            (quantity(aggregate), relation.clone(), quantity(aggregate))
                .prop_map(|(left, relation, right)| Condition::Compare(left, relation, right, Position(0))),
            (quantity(aggregate), quantity(aggregate), quantity(aggregate))
                .prop_map(|(value, low, high)| Condition::Within(value, low, high, Position(0))),
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
    fn any_text_is_an_expression_or_an_error_with_a_position(text in "\\PC{0,60}") {
        check_parse(&text)?;
    }

    #[test]
    fn any_tokens_are_an_expression_or_an_error_with_a_position(
        words in proptest::collection::vec(proptest::sample::select(vec![
            "pressure", "5.", "in", "..", "1", "9.95", "e3", "0x", "6130:1", ".status", "(", ")", "|", "-", "<", ">=",
            "mean(", "not", "and", "or", " ", "bar", "degC", "*", "/", "\u{b0}", ":", ".",
        ]), 0..20)
    ) {
        check_parse(&words.concat())?;
        check_parse(&words.join(" "))?;
    }

    #[test]
    fn printed_expressions_parse_to_the_same_tree(condition in condition()) {
        let text = condition.to_string();
        prop_assume!(text.len() <= 1000);
        let read = parse(&text);
        let mut parts = Vec::new();
        super::split(condition, &mut parts);
        prop_assert_eq!(read.parts(), &parts, "{}", text);
        prop_assert_eq!(parse(&read.to_string()), Expression { text: read.to_string(), parts });
    }
}

/// Checks that a printed expression parses to the same tree, and that an error has a position in the text.
fn check_parse(text: &str) -> Result<(), TestCaseError> {
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

fn bound(text: &str, signals: &[Signal<'_>]) -> Result<Evaluator, ExpressionError> {
    let available = AvailableSignals::from_sources(&sources(signals));
    let mut evaluator = Evaluator::new(&[parse(text)]);
    evaluator.bind(&available.nodes(), &available, true, &[])?;
    Ok(evaluator)
}

fn sample(at_ms: u64, source: usize, value: Option<f64>) -> Sample {
    let since = Duration::from_millis(at_ms);
    let at = Stamp { mono: Mono::at(since), wall: Wall::at(since) };
    let status = Some(if value.is_some() { Status::Ok } else { Status::OverloadHigh });
    Sample { at, source, value: value.map(Number::Real64), status, raw: Raw::new(&[]), doubt: None }
}

/// Returns the verdict on these values. NaN is an invalid value.
fn verdict(text: &str, signals: &[Signal<'_>]) -> Verdict {
    let mut evaluator = bound(text, signals).unwrap_or_else(|error| panic!("{text}: {error}"));
    let longest = signals.iter().map(|(.., values)| values.len()).max().unwrap_or(0);
    for at in 0..longest {
        for (source, (.., values)) in signals.iter().enumerate() {
            if let Some(value) = values.get(at) {
                let value = Some(*value).filter(|value| !value.is_nan());
                evaluator.add(&[sample(10 * at as u64, source, value)], &sources(signals));
            }
        }
    }
    let mut verdicts = evaluator.verdicts(None, &[]);
    assert_eq!(verdicts.len(), 1, "{verdicts:?}");
    verdicts.remove(0)
}

fn outcome(text: &str, signals: &[Signal<'_>]) -> Outcome {
    verdict(text, signals).outcome
}

const NAN: f64 = f64::NAN;

#[test]
fn each_sample_must_satisfy() {
    let pressure = |values| [("pressure", "bar", values)];
    for (text, values, expected) in [
        ("pressure in 9.95..10.05 bar", &[9.95, 10.0, 10.05][..], Outcome::Ok),
        ("pressure in 9.95..10.05 bar", &[10.0, 10.051, 10.0], Outcome::Fail),
        ("pressure < 10", &[10.0], Outcome::Fail),
        ("pressure <= 10", &[10.0], Outcome::Ok),
        ("pressure > 10", &[10.0], Outcome::Fail),
        ("pressure >= 10", &[10.0], Outcome::Ok),
        ("pressure != 10", &[10.0], Outcome::Fail),
        ("10 > pressure", &[9.0], Outcome::Ok),
        ("|pressure| < 0.01", &[-0.009, 0.009], Outcome::Ok),
        ("|pressure| < 0.01", &[-0.011], Outcome::Fail),
        ("pressure > 1 and pressure < 3", &[2.0, 3.0], Outcome::Fail),
        ("pressure < 1 or pressure > 3", &[0.0, 4.0], Outcome::Ok),
        ("pressure < 1 or pressure > 3", &[2.0], Outcome::Fail),
        ("not pressure < 3", &[3.0], Outcome::Ok),
        // An invalid value fails every expression, even a negation.
        ("pressure < 3", &[1.0, NAN], Outcome::Fail),
        ("not pressure < 3", &[NAN], Outcome::Fail),
        ("pressure < 1 or not pressure < 1", &[NAN], Outcome::Fail),
        ("1 bar / pressure < 3", &[0.0], Outcome::Fail),
        ("not 1 bar / pressure < 3", &[0.0], Outcome::Fail),
        ("pressure < 3", &[], Outcome::NoData),
    ] {
        assert_eq!(outcome(text, &pressure(values)), expected, "{text} of {values:?}");
    }
    let mut overloaded = bound("pressure < 3", &pressure(&[])).expect("bound");
    let sample = Sample { status: Some(Status::OverloadLow), ..sample(0, 0, Some(-5.0)) };
    overloaded.add(&[sample], &sources(&pressure(&[])));
    assert_eq!(overloaded.verdicts(None, &[])[0].outcome, Outcome::Fail, "outside the measuring range");
    let verdict = verdict("pressure < 3", &pressure(&[1.0, 4.0, 5.0, NAN]));
    assert_eq!((verdict.count, verdict.violations, verdict.invalid), (4, 2, 1));
    let first = verdict.first.expect("a violation");
    assert_eq!((first.elapsed, first.values), (Duration::from_millis(10), vec![Some(4.0)]));
    let shown = &verdict.values[0];
    assert_eq!((shown.range, shown.unit.map(|unit| unit.to_string())), (Some((1.0, 5.0)), Some("bar".to_owned())));
}

#[test]
fn functions_are_evaluated_at_the_end() {
    // With such a large offset, a naive sum of squares has no correct digit.
    let far = [1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0];
    for (text, values, expected) in [
        ("noise(p) in 5.4772..5.4773", &far[..], Outcome::Ok),
        ("mean(p) == 1000000010", &far, Outcome::Ok),
        ("min(p) == 1000000004 and max(p) == 1000000016", &far, Outcome::Ok),
        ("max(p) - min(p) <= 12", &far, Outcome::Ok),
        ("max(p) - min(p) < 12", &far, Outcome::Fail),
        ("rate(p) in 99..101", &far, Outcome::Ok),
        ("rate(p) > 101 Hz", &far, Outcome::Fail),
        ("gap(p) <= 10 ms", &far, Outcome::Ok),
        ("gap(p) < 10 ms", &far, Outcome::Fail),
        ("count(p) == 4", &far, Outcome::Ok),
        ("noise(p) < 1", &[3.0], Outcome::NoData),
        ("rate(p) > 1", &[3.0], Outcome::NoData),
        ("mean(p) < 5", &[3.0], Outcome::Ok),
        ("mean(|p|) > 2", &[-3.0, 3.0], Outcome::Ok),
        ("|mean(p)| < 1", &[-3.0, 3.0], Outcome::Ok),
        ("mean(p) < 5 or max(p) < 1", &[3.0, 4.0], Outcome::Ok),
        // An invalid sample fails, except inside invalid().
        ("mean(p) < 5", &[3.0, NAN], Outcome::Fail),
        ("rate(p) > 5", &[3.0, NAN], Outcome::Fail),
        ("mean(p) < 5", &[NAN], Outcome::Fail),
        ("invalid(p) <= 1", &[3.0, NAN], Outcome::Ok),
        ("invalid(p) == 0", &[3.0, NAN], Outcome::Fail),
        ("invalid(p) == 0", &[], Outcome::NoData),
        ("count(p) == 0", &[], Outcome::NoData),
    ] {
        assert_eq!(outcome(text, &[("p", "", values)]), expected, "{text} of {values:?}");
    }
}

#[test]
fn real32_values_are_compared_as_printed() {
    // 9.95 is not exact in REAL32. The nearest number is printed as 9.95.
    let available = sources(&[("p", "bar", &[])]);
    for (text, expected) in [("p >= 9.95", Outcome::Ok), ("p > 9.95", Outcome::Fail), ("p in 9.95..9.95", Outcome::Ok)]
    {
        let mut evaluator = bound(text, &[("p", "bar", &[])]).expect("bound");
        let value = Some(Number::Real32(9.95));
        evaluator.add(&[Sample { value, ..sample(0, 0, Some(0.0)) }], &available);
        assert_eq!(evaluator.verdicts(None, &[])[0].outcome, expected, "{text}");
    }
}

#[test]
fn units_are_converted() {
    for (text, unit, value, expected) in [
        ("p < 1.2 psi", "bar", 0.08, Outcome::Ok),
        ("p < 1.2 psi", "bar", 0.083, Outcome::Fail),
        ("p <= 1100 mbar", "bar", 1.1, Outcome::Ok),
        ("p >= 1100 mbar", "bar", 1.1, Outcome::Ok),
        ("p < 1100 mbar", "bar", 1.1, Outcome::Fail),
        ("p in 1..20 psi", "bar", 1.0, Outcome::Ok),
        ("p in 0.5 bar..20 psi", "kPa", 100.0, Outcome::Ok),
        ("p > 300 K", "degC", 27.0, Outcome::Ok),
        ("p > 300 K", "degC", 26.0, Outcome::Fail),
        ("p < 100 degF", "degC", 37.7, Outcome::Ok),
        ("p - p < 1 K", "degC", 20.0, Outcome::Ok),
        ("(p + p) / 2 < 293.2 K", "degC", 20.0, Outcome::Ok),
        ("(p + p) / 2 > 293.1 K", "degC", 20.0, Outcome::Ok),
        ("p / 2 bar == 5", "mbar", 10_000.0, Outcome::Ok),
        ("p * 2 < 3 bar", "bar", 1.4, Outcome::Ok),
        ("p + 100 mbar < 1.5 bar", "bar", 1.45, Outcome::Fail),
        ("p - 20 < 5", "degC", 24.0, Outcome::Ok),
        ("p < 7", "0x00F10000", 6.0, Outcome::Ok),
    ] {
        assert_eq!(outcome(text, &[("p", unit, &[value])]), expected, "{text} of {value} {unit}");
    }
    let verdict = verdict("p < 20 psi", &[("p", "bar", &[1.0])]);
    assert_eq!(verdict.values[0].unit, Unit::from_symbol("psi"), "the unit of the limit");
    // The noise and the difference of temperatures are converted without the offset of the scale.
    assert_eq!(outcome("noise(t) in 1.7..1.9 degF", &[("t", "degC", &[20.0, 21.0, 22.0])]), Outcome::Ok);
    let two = [("5.t", "degC", &[20.0][..]), ("6.t", "degF", &[68.0])];
    assert_eq!(outcome("|5.t - 6.t| < 0.001", &two), Outcome::Ok);
    assert_eq!(outcome("|5.t - 6.t| < 0.001 degF", &two), Outcome::Ok);
    assert_eq!(outcome("5.t == 6.t", &two), Outcome::Ok);
}

#[test]
fn mismatched_units_are_refused() {
    for (text, unit, column, message) in [
        ("p < 20 degC", "bar", 5, "units do not match: p is in bar, 20 degC is in degC"),
        ("p in 1 bar..20 degC", "bar", 13, "units do not match: p is in bar, 20 degC is in degC"),
        ("20 degC > p", "bar", 1, "units do not match: p is in bar, 20 degC is in degC"),
        ("p + 1 K < 3", "bar", 5, "units do not match: 1 K is in K, p is in bar"),
        ("p < 20 bar", "", 5, "units do not match: p has no unit, 20 bar is in bar"),
        ("p < 20 bar", "0x00F10000", 5, "units do not match: p is in 0x00F10000, 20 bar is in bar"),
        ("p * p < 20", "bar", 3, "cannot multiply bar by bar: the result has no known unit"),
        ("1 / p < 20", "bar", 3, "cannot divide a value without a unit by bar: the result has no known unit"),
        ("count(p) < 20 bar", "bar", 12, "units do not match: count(p) has no unit, 20 bar is in bar"),
        ("rate(p) < 20 bar", "bar", 11, "units do not match: rate(p) is in Hz, 20 bar is in bar"),
        ("p - 2 K > 20", "degC", 5, "2 K is ambiguous: a temperature or a temperature difference"),
        ("p - 2 > 20 K", "degC", 9, "20 K is ambiguous: a temperature or a temperature difference"),
        ("|p| < 60 degF", "degC", 7, "60 degF is ambiguous: a temperature or a temperature difference"),
        ("presure < 3", "bar", 1, "node 5: no signal \"presure\" (it has: p)"),
        ("1 < 6.p", "bar", 5, "node 6 is not one of the given nodes"),
    ] {
        let error = bound(text, &[("p", unit, &[])]).expect_err(text);
        assert_eq!((error.column(), error.message.as_str()), (column, message), "{text}");
    }
}

#[test]
fn several_signals_are_compared_when_each_has_a_new_value() {
    // Both signals rise. Within a cycle one signal is received before the other; this must not count as a difference.
    let rising: Vec<f64> = (0..100).map(f64::from).collect();
    let two = [("5.p", "bar", &rising[..]), ("6.p", "bar", &rising)];
    let result = verdict("5.p - 6.p == 0", &two);
    assert_eq!((result.outcome, result.count), (Outcome::Ok, 100));
    assert_eq!(verdict("mean(5.p - 6.p) == 0", &two).count, 100);
    // Each sample of the faster signal is also compared.
    let quick = [1.0, 1.0, 9.0, 1.0, 1.0];
    let uneven = [("5.p", "bar", &quick[..]), ("6.p", "bar", &[1.0])];
    assert_eq!(verdict("5.p - 6.p < 1", &uneven).violations, 1);
    let at_the_end = [("5.p", "bar", &[1.0, 9.0][..]), ("6.p", "bar", &[1.0])];
    assert_eq!(verdict("5.p - 6.p < 1", &at_the_end).violations, 1);
    assert_eq!(verdict("5.p < 2 or 6.p > 5", &uneven).violations, 1);
    let invalid = [("5.p", "bar", &[1.0][..]), ("6.p", "bar", &[NAN])];
    assert_eq!(
        verdict("5.p < 2 or 6.p > 5", &invalid).outcome,
        Outcome::Fail,
        "an invalid value fails although the other side is true"
    );
    let not_received = Reason::NotReceived { node: NodeId::new(6).expect("a node-ID"), signal: "p".to_owned() };
    let missing = [("5.p", "bar", &[1.0, 9.0][..]), ("6.p", "bar", &[])];
    let result = verdict("5.p - 6.p < 1", &missing);
    assert_eq!((result.outcome, result.reason), (Outcome::NoData, Some(not_received)));
    assert_eq!(verdict("5.p < 2 and 6.p < 2", &missing).outcome, Outcome::Fail);
}

#[test]
fn expressions_without_node_apply_to_each_node() {
    let signals = sources(&[("5.p", "bar", &[]), ("6.p", "psi", &[]), ("7.t", "degC", &[])]);
    let available = AvailableSignals::from_sources(&signals);
    let evaluator = |text: &str, skip_unsupported| {
        let mut evaluator = Evaluator::new(&[parse(text), parse(text)]);
        evaluator.bind(&available.nodes(), &available, skip_unsupported, &[]).map(|()| evaluator)
    };
    let mut both = evaluator("p < 2 bar", true).expect("bound");
    assert_eq!(both.wanted_of(signals[1].node), [Wanted::Signal("p".into())]);
    both.add(&[sample(0, 0, Some(1.9)), sample(1, 1, Some(29.1)), sample(2, 2, Some(99.0))], &signals);
    let verdicts = both.verdicts(None, &[]);
    let outcomes: Vec<_> = verdicts.iter().map(|verdict| (verdict.node.map(NodeId::get), verdict.outcome)).collect();
    assert_eq!(outcomes, [(Some(5), Outcome::Ok), (Some(6), Outcome::Fail)]);
    assert_eq!(evaluator("p < 2", false).expect_err("7 has no p").message, "node 7: no signal \"p\" (it has: t)");
    assert!(evaluator("q < 2", true).is_err(), "no node has it");
    // A node that failed has no verdict, even if all samples before are good.
    let mut one = evaluator("5.p < 2", true).expect("bound");
    one.add(&[sample(0, 0, Some(1.0))], &signals);
    let missing = [MissingData { node: signals[0].node, signal: None, reason: Reason::NodeStopped(signals[0].node) }];
    let verdict = one.clone().verdicts(None, &missing).remove(0);
    assert_eq!((verdict.outcome, verdict.reason), (Outcome::NoData, Some(Reason::NodeStopped(signals[0].node))));
    assert_eq!(one.verdicts(None, &[])[0].outcome, Outcome::Ok);
}

#[test]
fn a_signal_that_stops_has_no_verdict() {
    let two = [("5.p", "bar", &[1.0, 1.0, 1.0][..]), ("5.t", "degC", &[])];
    let mut evaluator = bound("p < 2", &two).expect("bound");
    for at in 0..100 {
        evaluator.add(&[sample(at * 300, 0, Some(1.0))], &sources(&two));
    }
    let outcome = |evaluator: &Evaluator, end_ms| {
        evaluator.clone().verdicts(Some(Mono::at(Duration::from_millis(end_ms))), &[]).remove(0).outcome
    };
    // Five intervals are 1.5 s. The last sample was received at 29.7 s.
    assert_eq!((outcome(&evaluator, 31_200), outcome(&evaluator, 31_201)), (Outcome::Ok, Outcome::NoData));
    evaluator.add(&[sample(29_800, 0, Some(3.0))], &sources(&two));
    assert_eq!(outcome(&evaluator, 60_000), Outcome::Fail, "a failure stays a failure");
}

#[test]
fn a_unit_may_change_during_a_recording() {
    let before = sources(&[("p", "bar", &[])]);
    let mut evaluator = bound("p < 2", &[("p", "bar", &[])]).expect("bound");
    evaluator.add(&[sample(0, 0, Some(1.0))], &before);
    let mut after = before.clone();
    after.extend(sources(&[("p", "mbar", &[]), ("p", "degC", &[])]));
    evaluator.add(&[sample(10, 1, Some(1999.0))], &after);
    assert_eq!(evaluator.clone().verdicts(None, &[])[0].outcome, Outcome::Ok);
    let mut lost = evaluator.clone();
    evaluator.add(&[sample(20, 1, Some(2001.0))], &after);
    assert_eq!(evaluator.verdicts(None, &[])[0].violations, 1);
    lost.add(&[sample(20, 2, Some(1.0))], &after);
    assert_eq!(lost.verdicts(None, &[])[0].invalid, 1);
}
