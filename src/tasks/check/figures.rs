//! Checks the figures of the bus and of nodes: `bus.load < 60 %`.

use super::CheckReport;
use crate::canopen::id::NodeId;
use crate::master::Master;
use crate::measure::expression::Expression;
use crate::measure::expression::evaluator::Evaluator;
use crate::measure::sample::{Number, Raw, Sample, Source};
use crate::tasks::Failure;
use crate::tasks::health::{HealthOptions, figures, health};
use std::time::Duration;

/// Measures the figures as `health` does, and evaluates the expressions. A figure without a value is missing data.
///
/// # Errors
/// Units that cannot be compared, and failures of the bus.
pub fn check_figures(
    master: &mut Master<'_>,
    expressions: &[Expression],
    options: &HealthOptions,
) -> Result<CheckReport, Failure> {
    let measured = health(master, options)?;
    let at = master.bus().now();
    let bus_node = options.nodes.first().or(measured.nodes.keys().next()).copied().unwrap_or(NodeId::MIN);
    let (mut sources, mut samples) = (Vec::new(), Vec::new());
    for figure in figures(&measured) {
        let (node, signal, unit) = (figure.node.unwrap_or(bus_node), figure.name.as_str().into(), figure.unit.into());
        let value = figure.value.map(Number::Real64);
        let (source, raw) = (sources.len(), Raw::new(&[]));
        samples.extend(value.map(|_| Sample { at, source, value, status: None, raw, doubt: None }));
        sources.push(Source { node, signal, unit });
    }
    let mut evaluator = Evaluator::new(expressions);
    evaluator.bind_recorded(&sources)?;
    evaluator.add_missing_nodes(&options.nodes);
    evaluator.add(&samples, &sources);
    let mut verdicts = evaluator.verdicts(None, &[]);
    // A figure of the bus belongs to no node.
    let of_bus = |text: &str| {
        let expression = expressions.iter().find(|expression| expression.text() == text);
        expression.is_some_and(|expression| expression.figures().iter().all(|name| name.starts_with("bus.")))
    };
    verdicts.retain(|verdict| !of_bus(&verdict.text) || verdict.node == Some(bus_node));
    verdicts.iter_mut().filter(|verdict| of_bus(&verdict.text)).for_each(|verdict| verdict.node = None);
    let started = Some(at);
    Ok(CheckReport { verdicts, started, length: Duration::ZERO, failures: Vec::new(), remarks: Vec::new() })
}
