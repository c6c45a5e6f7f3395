//! Connects an expression to the devices: finds its signals and converts its units.

pub use super::dimension::LimitWithoutUnit;
use super::dimension::{
    Dimension, Offsets, Typed, absolute, calculate, limit_without_unit, negative, to_one_unit, within,
};
use super::formula::{Formula, Rule};
use super::tree::{Condition, Function, Operator, Quantity, SignalName};
use super::{Expression, ExpressionError, LocatedError};
use crate::canopen::id::NodeId;
use crate::device::dictionary::{Dictionary, spellings};
use crate::device::nearest::distance;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use crate::measure::layout::{Layout, PARTS};
use crate::measure::sample::Source;
use std::collections::{BTreeMap, BTreeSet};

/// The largest number of signals listed in an error.
const MAX_LISTED: usize = 8;

/// The largest number of objects with similar names listed in an error.
const MAX_OBJECTS: usize = 3;

/// A signal that a node has.
#[derive(Clone, Debug, PartialEq)]
pub struct AvailableSignal {
    /// The node.
    pub node: NodeId,
    /// The name as in [`Source`].
    pub name: String,
    /// The unit, if known.
    pub unit: Option<Unit>,
}

/// The signals that expressions can use.
#[derive(Clone, Debug, Default)]
pub struct AvailableSignals<'a> {
    signals: Vec<AvailableSignal>,
    /// Nodes whose objects can all be read by address.
    readable: Vec<Layout<'a>>,
    /// Objects by node and name in lower case, each with its name as in [`Source`].
    objects: BTreeMap<(NodeId, String), AvailableSignal>,
}

impl<'a> AvailableSignals<'a> {
    /// Collects all signals of these nodes, and all objects by address.
    pub fn from_layouts(layouts: impl IntoIterator<Item = Layout<'a>>) -> AvailableSignals<'a> {
        let mut available = AvailableSignals::default();
        for layout in layouts {
            available.readable.push(layout);
            available.add_objects(layout);
            for signal in layout.signals {
                let node = layout.node;
                let entry = |name: String, unit| AvailableSignal { node, name, unit };
                available.signals.push(entry(signal.name.clone(), signal.unit));
                if signal.status.is_some() {
                    available.signals.push(entry(format!("{}.status", signal.name), None));
                }
            }
        }
        available
    }

    /// Adds `name` for the object called `known` in [`Source`], unless `name` already exists.
    pub fn name_object(&mut self, node: NodeId, name: &str, known: &str) {
        let signal = AvailableSignal { node, name: known.to_owned(), unit: None };
        self.objects.entry((node, name.to_lowercase())).or_insert(signal);
    }

    /// Adds the parts of signals (`pressure.net`), and every named object of the description or EDS, also by its EDS
    /// name.
    fn add_objects(&mut self, layout: Layout<'_>) {
        for (signal, (part, low)) in layout.signals.iter().flat_map(|signal| PARTS.map(|part| (signal, part))) {
            let (node, name) = (layout.node, format!("{}.{part}", signal.name));
            let unit = layout.find_in_family(signal, low).map(|object| layout.unit_of(object));
            let entry = unit.map(|unit| ((node, name.clone()), AvailableSignal { node, name, unit }));
            self.objects.extend(entry);
        }
        let dictionary = layout.model.map(|model| &model.dictionary);
        for (name, object) in dictionary.into_iter().flat_map(Dictionary::names) {
            let resolved = layout.resolve(&Wanted::Signal(name.to_owned())).name();
            let signal = layout.signals.iter().find(|signal| signal.name == resolved);
            let unit = signal.map_or_else(|| layout.unit_of(object), |signal| signal.unit);
            let signal = AvailableSignal { node: layout.node, name: resolved, unit };
            self.objects.insert((layout.node, name), signal);
        }
    }

    /// Collects the signals of a recording.
    pub fn from_sources(sources: &[Source]) -> AvailableSignals<'a> {
        let entry = |source: &Source| AvailableSignal {
            node: source.node,
            name: source.signal.to_string(),
            unit: unit_of(source),
        };
        AvailableSignals { signals: sources.iter().map(entry).collect(), ..AvailableSignals::default() }
    }

    /// The nodes with at least one signal, without repetitions.
    pub fn nodes(&self) -> Vec<NodeId> {
        let mut nodes: Vec<NodeId> = self.readable.iter().map(|layout| layout.node).collect();
        nodes.extend(self.signals.iter().map(|signal| signal.node));
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Finds a signal of a node. The result has the name as in [`Source`]; `None` if the node has no such signal.
    fn find(&self, node: NodeId, signal: &SignalName) -> Option<AvailableSignal> {
        let name = signal.name();
        let known = self.signals.iter().find(|known| known.node == node && known.name == name).cloned();
        let object = || {
            let names = [name.to_lowercase()].into_iter().chain(spellings(&name));
            names.into_iter().find_map(|name| self.objects.get(&(node, name)).cloned())
        };
        let address = || {
            let layout = self.readable.iter().find(|layout| layout.node == node)?;
            let Wanted::Object(object, stated) = signal.what else { return None };
            let unit = if stated.is_none() { layout.unit_of(object) } else { None };
            Some(AvailableSignal { node, name: name.clone(), unit })
        };
        known.or_else(object).or_else(address)
    }

    /// Whether all signals of an expression exist. Those without a node are searched at `node`.
    pub fn has_all(&self, node: NodeId, expression: &Expression) -> bool {
        expression.signals().iter().all(|signal| self.find(signal.node.unwrap_or(node), signal).is_some())
    }

    /// Returns the names of a node's signals, the most similar to `name` first.
    fn nearest(&self, node: NodeId, name: &str) -> Vec<&str> {
        let mut names: Vec<&str> =
            self.signals.iter().filter(|signal| signal.node == node).map(|signal| signal.name.as_str()).collect();
        names.sort_by_key(|known| distance(name, known));
        let objects = self.objects.iter().filter(|((of, _), _)| *of == node).map(|(_, known)| known.name.as_str());
        let mut near: Vec<&str> = objects.filter(|known| distance(name, known) <= name.len() / 2).collect();
        near.sort_by_key(|known| distance(name, known));
        near.truncate(MAX_OBJECTS);
        let mut seen = BTreeSet::new();
        near.into_iter().chain(names).filter(|name| seen.insert(*name)).collect()
    }
}

/// Returns the unit of a recorded signal, if known.
pub(super) fn unit_of(source: &Source) -> Option<Unit> {
    Unit::from_symbol(&source.unit).filter(|_| !source.unit.is_empty())
}

/// A measured value that an expression needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Input {
    /// The node.
    pub node: NodeId,
    /// The name as in [`Source`].
    pub name: String,
    /// The quantity to measure.
    pub what: Wanted,
    /// The unit, if known.
    pub unit: Option<Unit>,
}

/// A quantity whose value the verdict shows.
#[derive(Clone, Debug)]
pub(super) struct ShownQuantity {
    pub(super) name: String,
    pub(super) formula: Formula,
    pub(super) unit: Option<Unit>,
}

/// A function of all samples.
#[derive(Clone, Debug)]
pub(super) struct Aggregate {
    pub(super) function: Function,
    pub(super) argument: Formula,
    name: String,
}

/// An expression whose signals and units are known.
#[derive(Clone, Debug)]
pub struct BoundExpression {
    /// The expression as entered.
    pub text: String,
    /// The node of all signals without a node. `None` if each signal has one.
    pub node: Option<NodeId>,
    /// The values to measure.
    pub inputs: Vec<Input>,
    /// The limits without a unit.
    pub limits_without_unit: Vec<LimitWithoutUnit>,
    /// The parts that are evaluated with each sample.
    pub(super) sample_rules: Vec<Rule>,
    /// The parts that are evaluated after the last sample.
    pub(super) final_rules: Vec<Rule>,
    pub(super) aggregates: Vec<Aggregate>,
    pub(super) shown: Vec<ShownQuantity>,
}

impl Expression {
    /// Whether the expression applies to each checked node, because one of its signals has no node.
    pub fn applies_to_each_node(&self) -> bool {
        self.signals().iter().any(|signal| signal.node.is_none())
    }

    /// Checks that the expression contains only these nodes.
    ///
    /// # Errors
    /// The first other node.
    pub fn check_nodes(&self, nodes: &[NodeId]) -> Result<(), ExpressionError> {
        for signal in self.signals() {
            if let Some(node) = signal.node.filter(|node| !nodes.contains(node)) {
                return Err(self.error(signal.at, format!("node {node} is not one of the given nodes")));
            }
        }
        Ok(())
    }

    /// Checks that the expression needs only recorded signals.
    ///
    /// # Errors
    /// The first other signal.
    pub fn check_recorded(&self, recorded: &[&Wanted]) -> Result<(), ExpressionError> {
        let missing = |signal: &&SignalName| !recorded.contains(&&signal.what);
        match self.signals().into_iter().find(missing) {
            Some(signal) => Err(self.error(signal.at, format!("{} is not recorded", signal.name()))),
            None => Ok(()),
        }
    }

    /// Finds the signals of the expression. Signals without a node are searched at `node`.
    ///
    /// # Errors
    /// A signal that does not exist, or units that cannot be compared.
    pub fn bind(
        &self,
        node: Option<NodeId>,
        available: &AvailableSignals<'_>,
    ) -> Result<BoundExpression, ExpressionError> {
        let node = node.filter(|_| self.applies_to_each_node());
        let mut binder = Binder {
            available,
            node,
            bound: BoundExpression {
                text: self.text.clone(),
                node,
                inputs: Vec::new(),
                limits_without_unit: Vec::new(),
                sample_rules: Vec::new(),
                final_rules: Vec::new(),
                aggregates: Vec::new(),
                shown: Vec::new(),
            },
        };
        for part in &self.parts {
            let rule = binder.rule(part).map_err(|error| error.in_text(&self.text))?;
            let mut functions = Vec::new();
            part.functions(&mut functions);
            let bound = &mut binder.bound;
            let rules = if functions.is_empty() { &mut bound.sample_rules } else { &mut bound.final_rules };
            rules.push(rule);
        }
        Ok(binder.bound)
    }
}

struct Binder<'a> {
    available: &'a AvailableSignals<'a>,
    node: Option<NodeId>,
    bound: BoundExpression,
}

impl Binder<'_> {
    fn rule(&mut self, condition: &Condition) -> Result<Rule, LocatedError> {
        Ok(match condition {
            Condition::Compare(left, relation, right, _) => {
                let (left, right) = (self.typed(left)?, self.typed(right)?);
                self.add_bare_limits(condition, &[&left, &right]);
                let (left, right) = to_one_unit(left, right)?;
                let exact = left.exact && right.exact;
                let [left, right] = [left, right].map(|side| self.show(side));
                Rule::Compare(left, *relation, right, exact)
            }
            Condition::Within(value, low, high, _) => {
                let (value, low, high) = (self.typed(value)?, self.typed(low)?, self.typed(high)?);
                self.add_bare_limits(condition, &[&value, &low, &high]);
                let sides = within(value, low, high)?;
                let exact = sides.iter().all(|side| side.exact);
                let [value, low, high] = sides.map(|side| self.show(side));
                Rule::Within(value, low, high, exact)
            }
            Condition::And(left, right) => Rule::And(Box::new(self.rule(left)?), Box::new(self.rule(right)?)),
            Condition::Or(left, right) => Rule::Or(Box::new(self.rule(left)?), Box::new(self.rule(right)?)),
            Condition::Not(inner) => Rule::Not(Box::new(self.rule(inner)?)),
        })
    }

    /// Adds the limits without a unit. Intervals and rates have the same unit at every device.
    fn add_bare_limits(&mut self, condition: &Condition, sides: &[&Typed]) {
        let mut functions = Vec::new();
        condition.functions(&mut functions);
        if !functions.iter().any(|function| matches!(function, Function::Rate | Function::Gap)) {
            self.bound.limits_without_unit.extend(limit_without_unit(sides));
        }
    }

    /// Adds a measured quantity to the values that the verdict shows. Returns the formula of the quantity.
    fn show(&mut self, side: Typed) -> Formula {
        let unit = match side.dimension {
            Dimension::In(unit, _) => Some(unit),
            Dimension::Literal | Dimension::None => None,
        };
        let is_shown = |known: &ShownQuantity| known.name == side.name && known.unit == unit;
        if side.formula.constant().is_none() && !self.bound.shown.iter().any(is_shown) {
            self.bound.shown.push(ShownQuantity { name: side.name, formula: side.formula.clone(), unit });
        }
        side.formula
    }

    /// Returns the formula and the unit of a quantity.
    fn typed(&mut self, quantity: &Quantity) -> Result<Typed, LocatedError> {
        let (name, at) = (quantity.to_string(), quantity.at());
        Ok(match quantity {
            Quantity::Number(number, unit, _) => {
                let dimension = unit.map_or(Dimension::Literal, |unit| Dimension::In(unit, Offsets::Literal));
                Typed { formula: Formula::Number(*number), dimension, exact: true, name, at }
            }
            Quantity::Signal(signal) => {
                let input = self.input(signal)?;
                let unit = self.bound.inputs[input].unit;
                let dimension = unit.map_or(Dimension::None, |unit| Dimension::In(unit, Offsets::Known(1.0)));
                Typed { formula: Formula::Input(input), dimension, exact: true, name, at }
            }
            Quantity::Negative(inner, _) => {
                let inner = self.typed(inner)?;
                let formula = Formula::Negative(Box::new(inner.formula));
                Typed { formula, dimension: negative(inner.dimension), exact: inner.exact, name, at }
            }
            Quantity::Absolute(inner, _) => {
                let inner = self.typed(inner)?;
                let formula = Formula::Absolute(Box::new(inner.formula));
                Typed { formula, dimension: absolute(inner.dimension), exact: inner.exact, name, at }
            }
            Quantity::Arithmetic(left, operator, right, sign) => {
                let (left, right) = (self.typed(left)?, self.typed(right)?);
                if matches!(operator, Operator::Add | Operator::Subtract) {
                    self.bound.limits_without_unit.extend(limit_without_unit(&[&left, &right]));
                }
                calculate(left, *operator, right, *sign, name)?
            }
            Quantity::Aggregate(function, inner, _) => {
                let inner = self.typed(inner)?;
                let dimension = aggregate_dimension(*function, inner.dimension);
                let exact = match function {
                    Function::Min | Function::Max => inner.exact,
                    Function::Count | Function::Invalid => true,
                    Function::Mean | Function::Noise | Function::Rate | Function::Gap => false,
                };
                let formula = Formula::Aggregate(self.aggregate(*function, inner.formula, &name));
                Typed { formula, dimension, exact, name, at }
            }
        })
    }

    /// Returns the index of an aggregate, and adds it if it is new.
    fn aggregate(&mut self, function: Function, argument: Formula, name: &str) -> usize {
        let aggregates = &mut self.bound.aggregates;
        if let Some(known) = aggregates.iter().position(|known| known.name == name) {
            return known;
        }
        aggregates.push(Aggregate { function, argument, name: name.to_owned() });
        aggregates.len() - 1
    }

    /// Returns the index of an input, and adds it if it is new.
    fn input(&mut self, signal: &SignalName) -> Result<usize, LocatedError> {
        let no_node = || LocatedError::new(signal.at, format!("no node given for {signal} (example: 5.{signal})"));
        let node = signal.node.or(self.node).ok_or_else(no_node)?;
        let Some(AvailableSignal { name, unit, .. }) = self.available.find(node, signal) else {
            return Err(self.unknown_signal(node, signal));
        };
        let input = Input { node, name, what: signal.what.clone(), unit };
        if let Some(known) = self.bound.inputs.iter().position(|known| *known == input) {
            return Ok(known);
        }
        self.bound.inputs.push(input);
        Ok(self.bound.inputs.len() - 1)
    }

    fn unknown_signal(&self, node: NodeId, signal: &SignalName) -> LocatedError {
        let name = signal.name();
        let mut names = self.available.nearest(node, &name);
        let mut message = format!("node {node}: no signal \"{name}\"");
        if !names.is_empty() {
            if names.len() > MAX_LISTED {
                names.truncate(MAX_LISTED);
                names.push("...");
            }
            message.push_str(&format!(" (it has: {})", names.join(", ")));
        }
        LocatedError::new(signal.at, message)
    }
}

/// Unit codes of second and hertz (CiA 303-2).
const SECOND: Unit = Unit(0x0003_0000);
const HERTZ: Unit = Unit(0x0020_0000);

/// Returns the unit of a function of all samples.
fn aggregate_dimension(function: Function, argument: Dimension) -> Dimension {
    match (function, argument) {
        (Function::Rate, _) => Dimension::In(HERTZ, Offsets::Known(0.0)),
        (Function::Gap, _) => Dimension::In(SECOND, Offsets::Known(0.0)),
        (Function::Count | Function::Invalid, _) => Dimension::None,
        (Function::Noise, Dimension::In(unit, _)) => Dimension::In(unit, Offsets::Known(0.0)),
        (_, argument) => argument,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the numbers of an expression that take the unit of the device.
    fn bare(text: &str, unit: &str) -> Vec<String> {
        let node = NodeId::new(5).expect("a node-ID");
        let available = AvailableSignals::from_sources(&[Source { node, signal: "p".into(), unit: unit.into() }]);
        let expression = Expression::parse(text).expect("an expression");
        let limits = expression.bind(Some(node), &available).expect("fits").limits_without_unit;
        limits.iter().map(|limit| format!("{} {}", limit.limit, limit.unit)).collect()
    }

    #[test]
    fn numbers_without_a_unit_are_found() {
        for (text, found) in [
            ("p > 5", &["5 bar"][..]),
            ("-1.5 <= p and not p == 7", &["-1.5 bar", "7 bar"]),
            ("p in 9..11", &["9..11 bar"]),
            ("|p - 10| < 0.1 bar", &["10 bar"]),
            ("noise(p) < 2 * 0.1 or mean(p) < 3", &["2 * 0.1 bar", "3 bar"]),
        ] {
            assert_eq!(bare(text, "bar"), found, "{text}");
        }
        assert_eq!(bare("p < 60", "degC"), ["60 degC"]);
        for text in ["p > 5 psi", "p in 9..11 bar", "p in 9 psi..11", "count(p) > 5", "gap(p) < 0.5", "2 * p > 5 bar"] {
            assert_eq!(bare(text, "bar"), [""; 0], "{text}");
        }
        assert_eq!(bare("p == 5", ""), [""; 0], "a signal without a unit");
    }
}
