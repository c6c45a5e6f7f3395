//! Several expressions of one signal.

use super::*;

/// Expressions share the statistics of a signal. Each of them has the result that it would have alone.
#[test]
fn expressions_of_one_signal_do_not_affect_each_other() {
    let signals: &[Signal<'_>] = &[("p", "bar", &[1.0, NAN, 1.5, 2.5, 0.5]), ("q", "bar", &[4.0, 3.0])];
    let texts = [
        "p < 2",
        "p in 900..1600 mbar",
        "|p| < 3",
        "p - 1 < 0.2",
        "q - p > 0",
        "mean(p) < 2",
        "mean(p) < 2000 mbar",
        "noise(p) > 0.1 and noise(|p|) < 1",
        "max(p) == 2.5",
        "count(p) == 5",
        "invalid(p) == 1",
        "max(q) - min(q) > 0",
        "p < q or p > 0",
    ];
    let all: Vec<Expression> = texts.iter().map(|text| parse(text)).collect();
    let available = AvailableSignals::from_sources(&sources(signals));
    let mut evaluator = Evaluator::new(&all);
    evaluator.bind(&available.nodes(), &available, true, &[]).expect("bound");
    for at in 0..5 {
        for (source, (.., values)) in signals.iter().enumerate().filter(|(_, (.., values))| at < values.len()) {
            let value = Some(values[at]).filter(|value| !value.is_nan());
            evaluator.add(&[sample(10 * at as u64, source, value)], &sources(signals));
        }
    }
    let expected: Vec<Verdict> = texts.iter().map(|text| verdict(text, signals)).collect();
    assert_eq!(evaluator.verdicts(None, &[]), expected);
}

#[test]
fn expression_that_is_bound_later_has_only_the_samples_since_then() {
    let all = sources(&[("p", "bar", &[]), ("q", "bar", &[])]);
    let mut evaluator = Evaluator::new(&[parse("count(p) == 3"), parse("count(p) - count(q) == 0")]);
    evaluator.bind_recorded(&all[..1]).expect("bound");
    evaluator.add(&[sample(0, 0, Some(1.0)), sample(10, 0, Some(1.0))], &all);
    evaluator.bind_recorded(&all).expect("bound");
    evaluator.add(&[sample(20, 0, Some(1.0)), sample(20, 1, Some(1.0))], &all);
    let outcomes: Vec<Outcome> = evaluator.verdicts(None, &[]).into_iter().map(|verdict| verdict.outcome).collect();
    assert_eq!(outcomes, [Outcome::Ok, Outcome::Ok]);
}
