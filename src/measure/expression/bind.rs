//! An expression meets the devices: its signals are found, its units brought together.

use super::dimension::{Dimension, Typed, Zeros, absolute, alike, calculate, negative, within};
use super::evaluate::{Formula, Rule};
use super::tree::{Condition, Function, Quantity, SignalName};
use super::{Expression, ExpressionError, Fault};
use crate::canopen::id::NodeId;
use crate::device::nearest::distance;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;
use crate::measure::layout::Layout;
use crate::measure::sample::Source;

/// A signal that there is.
#[derive(Clone, Debug, PartialEq)]
pub struct Offer {
    /// Of which node.
    pub node: NodeId,
    /// As it stands in a [`Source`].
    pub name: String,
    /// Its unit, where the device tells one.
    pub unit: Option<Unit>,
}

/// What is offered.
#[derive(Clone, Debug, Default)]
pub struct Offers {
    signals: Vec<Offer>,
    /// Nodes that may be asked for any object.
    open: Vec<NodeId>,
}

impl Offers {
    /// Everything that these devices have.
    pub fn of_instruments<'a>(instruments: impl IntoIterator<Item = Layout<'a>>) -> Offers {
        let mut offers = Offers::default();
        for instrument in instruments {
            offers.open.push(instrument.node);
            for signal in instrument.signals {
                let offer = |name: String, unit| Offer { node: instrument.node, name, unit };
                offers.signals.push(offer(signal.name.clone(), signal.unit));
                if signal.status.is_some() {
                    offers.signals.push(offer(format!("{}.status", signal.name), None));
                }
            }
        }
        offers
    }

    /// What is recorded.
    pub fn of_sources(sources: &[Source]) -> Offers {
        let offer =
            |source: &Source| Offer { node: source.node, name: source.signal.to_string(), unit: unit_of(source) };
        Offers { signals: sources.iter().map(offer).collect(), open: Vec::new() }
    }

    /// The nodes that offer something, each once.
    pub fn nodes(&self) -> Vec<NodeId> {
        let mut nodes = self.open.clone();
        nodes.extend(self.signals.iter().map(|offer| offer.node));
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// The unit of a signal of a node, where there is such a signal.
    fn find(&self, node: NodeId, signal: &SignalName) -> Option<Option<Unit>> {
        let name = signal.name();
        let offer = self.signals.iter().find(|offer| offer.node == node && offer.name == name);
        let open = || matches!(signal.what, Wanted::Object(_)) && self.open.contains(&node);
        offer.map(|offer| offer.unit).or_else(|| open().then_some(None))
    }

    /// Whether `node` has everything that an expression names without a node.
    pub fn has_all(&self, node: NodeId, expression: &Expression) -> bool {
        expression.signals().iter().all(|signal| self.find(signal.node.unwrap_or(node), signal).is_some())
    }

    /// The names of a node's signals, those first that are most like `name`.
    fn like(&self, node: NodeId, name: &str) -> Vec<&str> {
        let mut names: Vec<&str> =
            self.signals.iter().filter(|offer| offer.node == node).map(|offer| offer.name.as_str()).collect();
        names.sort_by_key(|known| distance(name, known));
        names
    }
}

/// The unit of what is recorded, where its device tells one.
pub(super) fn unit_of(source: &Source) -> Option<Unit> {
    Unit::from_symbol(&source.unit).filter(|_| !source.unit.is_empty())
}

/// Something measured that an expression needs.
#[derive(Clone, Debug, PartialEq)]
pub struct Slot {
    /// Of which node.
    pub node: NodeId,
    /// As it stands in a [`Source`].
    pub name: String,
    /// What has to be measured.
    pub what: Wanted,
    /// Its unit, where the device tells one.
    pub unit: Option<Unit>,
}

/// A quantity whose value a verdict shows.
#[derive(Clone, Debug)]
pub(super) struct Display {
    pub(super) name: String,
    pub(super) formula: Formula,
    pub(super) unit: Option<Unit>,
}

/// Samples gathered to one number.
#[derive(Clone, Debug)]
pub(super) struct Gathered {
    pub(super) function: Function,
    pub(super) argument: Formula,
    name: String,
}

/// An expression whose signals are known, for one node where it names none.
#[derive(Clone, Debug)]
pub struct Bound {
    /// The expression as it was written.
    pub text: String,
    /// The node that its signals without a node are of; `None` where every signal names one.
    pub node: Option<NodeId>,
    /// What is measured for it.
    pub slots: Vec<Slot>,
    /// The parts that are judged with every sample, and those that are judged at the end.
    pub(super) by_sample: Vec<Rule>,
    pub(super) at_the_end: Vec<Rule>,
    pub(super) gathered: Vec<Gathered>,
    pub(super) displays: Vec<Display>,
}

impl Expression {
    /// Whether it speaks of every node that is checked.
    pub fn is_of_every_node(&self) -> bool {
        self.signals().iter().any(|signal| signal.node.is_none())
    }

    /// That it names no node but these.
    ///
    /// # Errors
    /// The first other one.
    pub fn names_only(&self, nodes: &[NodeId]) -> Result<(), ExpressionError> {
        for signal in self.signals() {
            if let Some(node) = signal.node.filter(|node| !nodes.contains(node)) {
                return Err(self.fail(signal.at, format!("node {node} is none of those named")));
            }
        }
        Ok(())
    }

    /// That it needs nothing but this.
    ///
    /// # Errors
    /// The first other signal.
    pub fn needs_only(&self, recorded: &[&Wanted]) -> Result<(), ExpressionError> {
        let other = |signal: &&SignalName| !recorded.contains(&&signal.what);
        match self.signals().into_iter().find(other) {
            Some(signal) => Err(self.fail(signal.at, format!("{} is not recorded", signal.name()))),
            None => Ok(()),
        }
    }

    /// Finds its signals among what is offered, those without a node at `node`.
    ///
    /// # Errors
    /// A signal that there is not, with the nearest ones; units that do not go together.
    pub fn bind(&self, node: Option<NodeId>, offers: &Offers) -> Result<Bound, ExpressionError> {
        let node = node.filter(|_| self.is_of_every_node());
        let mut binder = Binder {
            offers,
            node,
            bound: Bound {
                text: self.text.clone(),
                node,
                slots: Vec::new(),
                by_sample: Vec::new(),
                at_the_end: Vec::new(),
                gathered: Vec::new(),
                displays: Vec::new(),
            },
        };
        for part in &self.parts {
            let rule = binder.rule(part).map_err(|fault| fault.of(&self.text))?;
            let mut functions = Vec::new();
            part.functions(&mut functions);
            let parts = if functions.is_empty() { &mut binder.bound.by_sample } else { &mut binder.bound.at_the_end };
            parts.push(rule);
        }
        Ok(binder.bound)
    }
}

struct Binder<'a> {
    offers: &'a Offers,
    node: Option<NodeId>,
    bound: Bound,
}

impl Binder<'_> {
    fn rule(&mut self, condition: &Condition) -> Result<Rule, Fault> {
        Ok(match condition {
            Condition::Compare(left, comparison, right, _) => {
                let (left, right) = alike(self.typed(left)?, self.typed(right)?)?;
                let exact = left.exact && right.exact;
                let [left, right] = [left, right].map(|side| self.displayed(side));
                Rule::Compare(left, *comparison, right, exact)
            }
            Condition::Within(value, low, high, _) => {
                let sides = within(self.typed(value)?, self.typed(low)?, self.typed(high)?)?;
                let exact = sides.iter().all(|side| side.exact);
                let [value, low, high] = sides.map(|side| self.displayed(side));
                Rule::Within(value, low, high, exact)
            }
            Condition::And(left, right) => Rule::And(Box::new(self.rule(left)?), Box::new(self.rule(right)?)),
            Condition::Or(left, right) => Rule::Or(Box::new(self.rule(left)?), Box::new(self.rule(right)?)),
            Condition::Not(inner) => Rule::Not(Box::new(self.rule(inner)?)),
        })
    }

    /// Remembers what was measured, to be shown with the verdict.
    fn displayed(&mut self, side: Typed) -> Formula {
        let unit = match side.dimension {
            Dimension::In(unit, _) => Some(unit),
            Dimension::Bare | Dimension::Plain => None,
        };
        let shown = |known: &Display| known.name == side.name && known.unit == unit;
        if side.formula.constant().is_none() && !self.bound.displays.iter().any(shown) {
            self.bound.displays.push(Display { name: side.name, formula: side.formula.clone(), unit });
        }
        side.formula
    }

    fn typed(&mut self, quantity: &Quantity) -> Result<Typed, Fault> {
        let (name, at) = (quantity.to_string(), quantity.at());
        Ok(match quantity {
            Quantity::Number(number, unit, _) => {
                let dimension = unit.map_or(Dimension::Bare, |unit| Dimension::In(unit, Zeros::Free));
                Typed { formula: Formula::Number(*number), dimension, exact: true, name, at }
            }
            Quantity::Signal(signal) => {
                let slot = self.slot(signal)?;
                let unit = self.bound.slots[slot].unit;
                let dimension = unit.map_or(Dimension::Plain, |unit| Dimension::In(unit, Zeros::Known(1.0)));
                Typed { formula: Formula::Slot(slot), dimension, exact: true, name, at }
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
                calculate(left, *operator, right, *sign, name)?
            }
            Quantity::Aggregate(function, inner, _) => {
                let inner = self.typed(inner)?;
                let dimension = gathered_dimension(*function, inner.dimension);
                let exact = match function {
                    Function::Min | Function::Max => inner.exact,
                    Function::Count | Function::Invalid => true,
                    Function::Mean | Function::Noise | Function::Rate | Function::Gap => false,
                };
                let formula = Formula::Aggregate(self.gathered(*function, inner.formula, &name));
                Typed { formula, dimension, exact, name, at }
            }
        })
    }

    fn gathered(&mut self, function: Function, argument: Formula, name: &str) -> usize {
        let gathered = &mut self.bound.gathered;
        if let Some(known) = gathered.iter().position(|known| known.name == name) {
            return known;
        }
        gathered.push(Gathered { function, argument, name: name.to_owned() });
        gathered.len() - 1
    }

    fn slot(&mut self, signal: &SignalName) -> Result<usize, Fault> {
        let missing = || Fault::new(signal.at, format!("of which node? 5.{signal}"));
        let node = signal.node.or(self.node).ok_or_else(missing)?;
        let Some(unit) = self.offers.find(node, signal) else {
            return Err(self.unknown(node, signal));
        };
        let slot = Slot { node, name: signal.name(), what: signal.what.clone(), unit };
        if let Some(known) = self.bound.slots.iter().position(|known| *known == slot) {
            return Ok(known);
        }
        self.bound.slots.push(slot);
        Ok(self.bound.slots.len() - 1)
    }

    fn unknown(&self, node: NodeId, signal: &SignalName) -> Fault {
        let name = signal.name();
        let fault = Fault::new(signal.at, format!("node {node} has no signal \"{name}\""));
        match self.offers.like(node, &name).as_slice() {
            [] => fault,
            names => fault.hint(format!("it has: {}", names.join(", "))),
        }
    }
}

/// Code of s and of 1/s (CiA 303-2).
const SECOND: Unit = Unit(0x0003_0000);
const HERTZ: Unit = Unit(0x0020_0000);

/// What is left of a dimension when samples are gathered.
fn gathered_dimension(function: Function, of: Dimension) -> Dimension {
    match (function, of) {
        (Function::Rate, _) => Dimension::In(HERTZ, Zeros::Known(0.0)),
        (Function::Gap, _) => Dimension::In(SECOND, Zeros::Known(0.0)),
        (Function::Count | Function::Invalid, _) => Dimension::Plain,
        (Function::Noise, Dimension::In(unit, _)) => Dimension::In(unit, Zeros::Known(0.0)),
        (_, of) => of,
    }
}
