//! From tokens to a tree.

use super::Fault;
use super::lex::{Token, tokens};
use super::tree::{At, Comparison, Condition, Function, Operator, Quantity, SignalName};
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;

/// How many operators there may be: each one is a level of the tree.
const MOST: usize = 100;

/// How deep parentheses, signs and `not` may be nested.
const DEEPEST: usize = 50;

const COMPARISONS: [Comparison; 6] = [
    Comparison::Less,
    Comparison::AtMost,
    Comparison::Greater,
    Comparison::AtLeast,
    Comparison::Equal,
    Comparison::Unequal,
];

const KEYWORDS: [&str; 4] = ["in", "and", "or", "not"];

/// What was read: parentheses may hold the one or the other.
enum Parsed {
    Quantity(Quantity),
    Condition(Condition, At),
}

impl Parsed {
    fn quantity(self) -> Result<Quantity, Fault> {
        match self {
            Parsed::Quantity(quantity) => Ok(quantity),
            Parsed::Condition(_, at) => Err(Fault::new(at, "a value is wanted here, and this is a condition")),
        }
    }

    fn condition(self, end: At) -> Result<(Condition, At), Fault> {
        match self {
            Parsed::Condition(condition, at) => Ok((condition, at)),
            Parsed::Quantity(_) => Err(Fault::new(end, "a comparison is missing here: < <= > >= == != or in")
                .hint("a limit: pressure < 10, a range: pressure in 9.95..10.05")),
        }
    }
}

/// Reads a condition.
pub(super) fn parse(text: &str) -> Result<Condition, Fault> {
    let mut parser = Parser { tokens: tokens(text)?, next: 0, end: At(text.len()), depth: 0, operators: 0 };
    let (condition, _) = parser.or()?.condition(parser.at())?;
    match parser.peek() {
        None => Ok(condition),
        Some(token) => {
            let what = spelled(token);
            let fault = Fault::new(parser.at(), format!("{what} is not expected here"));
            Err(match token {
                Token::Sign("<" | "<=" | ">" | ">=" | "==" | "!=") => {
                    fault.hint("a range is written with in: pressure in 9.95..10.05")
                }
                _ => fault,
            })
        }
    }
}

fn spelled(token: &Token) -> String {
    match token {
        Token::Number(number) => number.to_string(),
        Token::Signal(signal) => signal.to_string(),
        Token::Word(word) => format!("\"{word}\""),
        Token::Sign(sign) => format!("\"{sign}\""),
    }
}

struct Parser {
    tokens: Vec<(Token, At)>,
    next: usize,
    end: At,
    depth: usize,
    operators: usize,
}

impl Parser {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.next).map(|(token, _)| token)
    }

    fn at(&self) -> At {
        self.tokens.get(self.next).map_or(self.end, |&(_, at)| at)
    }

    fn takes(&mut self, sign: &str) -> bool {
        let is = match self.peek() {
            Some(Token::Sign(there)) => *there == sign,
            Some(Token::Word(there)) => there == sign,
            _ => false,
        };
        self.next += usize::from(is);
        is
    }

    fn expects(&mut self, sign: &str, why: &str) -> Result<(), Fault> {
        if self.takes(sign) { Ok(()) } else { Err(Fault::new(self.at(), format!("\"{sign}\" {why}"))) }
    }

    /// Counts an operator that stands at `at`.
    fn one_more(&mut self, at: At) -> Result<(), Fault> {
        self.operators += 1;
        if self.operators > MOST {
            return Err(Fault::new(at, format!("an expression has at most {MOST} operators")));
        }
        Ok(())
    }

    /// Goes one level deeper.
    fn deeper<T>(&mut self, work: impl FnOnce(&mut Parser) -> Result<T, Fault>) -> Result<T, Fault> {
        if self.depth == DEEPEST {
            return Err(Fault::new(self.at(), "this is nested too deep"));
        }
        self.depth += 1;
        let result = work(self);
        self.depth -= 1;
        result
    }

    fn or(&mut self) -> Result<Parsed, Fault> {
        self.joined("or", Parser::and, Condition::Or)
    }

    fn and(&mut self) -> Result<Parsed, Fault> {
        self.joined("and", Parser::not, Condition::And)
    }

    fn joined(
        &mut self,
        word: &str,
        side: fn(&mut Parser) -> Result<Parsed, Fault>,
        join: fn(Box<Condition>, Box<Condition>) -> Condition,
    ) -> Result<Parsed, Fault> {
        let mut left = side(self)?;
        loop {
            let here = self.at();
            if !self.takes(word) {
                return Ok(left);
            }
            self.one_more(here)?;
            let (condition, at) = left.condition(here)?;
            let (right, _) = side(self)?.condition(self.at())?;
            left = Parsed::Condition(join(Box::new(condition), Box::new(right)), at);
        }
    }

    fn not(&mut self) -> Result<Parsed, Fault> {
        let at = self.at();
        if !self.takes("not") {
            return self.comparison();
        }
        let inner = self.deeper(Parser::not)?;
        let (inner, _) = inner.condition(self.at())?;
        Ok(Parsed::Condition(Condition::Not(Box::new(inner)), at))
    }

    fn comparison(&mut self) -> Result<Parsed, Fault> {
        let begin = self.at();
        let left = self.sum()?;
        let at = self.at();
        if self.takes("in") {
            let value = left.quantity()?;
            let low = self.sum()?.quantity()?;
            self.expects("..", "is missing here: a range is 9.95..10.05")?;
            let high = self.sum()?.quantity()?;
            let (low, high) = with_the_same_unit(low, high)?;
            return Ok(Parsed::Condition(Condition::Within(value, low, high, at), begin));
        }
        for comparison in COMPARISONS {
            if self.takes(comparison.as_str()) {
                let left = left.quantity()?;
                let right = self.sum()?.quantity()?;
                return Ok(Parsed::Condition(Condition::Compare(left, comparison, right, at), begin));
            }
        }
        Ok(left)
    }

    fn sum(&mut self) -> Result<Parsed, Fault> {
        self.chain(Parser::product, [Operator::Add, Operator::Subtract])
    }

    fn product(&mut self) -> Result<Parsed, Fault> {
        self.chain(Parser::sign, [Operator::Multiply, Operator::Divide])
    }

    fn chain(
        &mut self,
        part: fn(&mut Parser) -> Result<Parsed, Fault>,
        operators: [Operator; 2],
    ) -> Result<Parsed, Fault> {
        let mut left = part(self)?;
        loop {
            let at = self.at();
            let Some(operator) = operators.into_iter().find(|operator| self.takes(operator.as_str())) else {
                return Ok(left);
            };
            self.one_more(at)?;
            let first = left.quantity()?;
            let right = part(self)?.quantity()?;
            left = Parsed::Quantity(Quantity::Arithmetic(Box::new(first), operator, Box::new(right), at));
        }
    }

    fn sign(&mut self) -> Result<Parsed, Fault> {
        let at = self.at();
        if !self.takes("-") {
            return self.alone();
        }
        let inner = self.deeper(Parser::sign)?.quantity()?;
        Ok(Parsed::Quantity(Quantity::Negative(Box::new(inner), at)))
    }

    fn alone(&mut self) -> Result<Parsed, Fault> {
        let at = self.at();
        let Some(token) = self.peek().cloned() else {
            return Err(Fault::new(at, "something is missing at the end"));
        };
        self.next += 1;
        match token {
            Token::Number(number) => Ok(Parsed::Quantity(Quantity::Number(number, self.unit()?, at))),
            Token::Signal(signal) => Ok(Parsed::Quantity(Quantity::Signal(signal))),
            Token::Sign("(") => {
                let inner = self.deeper(Parser::or)?;
                self.expects(")", "is missing here")?;
                Ok(match inner {
                    Parsed::Condition(condition, _) => Parsed::Condition(condition, at),
                    quantity @ Parsed::Quantity(_) => quantity,
                })
            }
            Token::Sign("|") => {
                let inner = self.deeper(Parser::sum)?.quantity()?;
                self.expects("|", "is missing here")?;
                Ok(Parsed::Quantity(Quantity::Absolute(Box::new(inner), at)))
            }
            Token::Word(word) if !KEYWORDS.contains(&word.as_str()) => self.named(&word, at),
            other => Err(Fault::new(at, format!("a value is missing before {}", spelled(&other)))),
        }
    }

    /// A function where a parenthesis follows, else a signal.
    fn named(&mut self, word: &str, at: At) -> Result<Parsed, Fault> {
        if !self.takes("(") {
            if !word.is_ascii() {
                return Err(Fault::new(at, format!("\"{word}\" is no name of a signal")));
            }
            let what = Wanted::Signal(word.to_owned());
            return Ok(Parsed::Quantity(Quantity::Signal(SignalName { node: None, what, at })));
        }
        let Some(function) = Function::ALL.into_iter().find(|function| function.as_str() == word) else {
            let names: Vec<&str> = Function::ALL.into_iter().map(Function::as_str).collect();
            let fault = Fault::new(at, format!("there is no function {word}()"));
            return Err(fault.hint(format!("there are: {}", names.join(", "))));
        };
        let inner = self.deeper(Parser::sum)?.quantity()?;
        self.expects(")", "is missing here")?;
        Ok(Parsed::Quantity(Quantity::Aggregate(function, Box::new(inner), at)))
    }

    /// The unit behind a number, where there is one.
    fn unit(&mut self) -> Result<Option<Unit>, Fault> {
        let Some(Token::Word(word)) = self.peek() else { return Ok(None) };
        if KEYWORDS.contains(&word.as_str()) {
            return Ok(None);
        }
        let unit = Unit::from_symbol(word).ok_or_else(|| {
            Fault::new(self.at(), format!("\"{word}\" is not a known unit"))
                .hint("some that are: bar, mbar, kPa, MPa, psi, degC, degF, K, mV, mA, Hz, ms")
        })?;
        self.next += 1;
        Ok(Some(unit))
    }
}

/// `9.95..10.05 bar`: the unit of one end is that of a bare number at the other. A range of numbers that counts
/// backwards is a mistake.
fn with_the_same_unit(mut low: Quantity, mut high: Quantity) -> Result<(Quantity, Quantity), Fault> {
    let at = high.at();
    if let (Some((first, low)), Some((second, high))) = (literal(&mut low), literal(&mut high)) {
        let unit = (*low).or(*high);
        if low.is_none() || high.is_none() {
            (*low, *high) = (unit, unit);
        }
        if low == high && first > second {
            return Err(Fault::new(at, format!("the range counts backwards: {second} is less than {first}")));
        }
    }
    Ok((low, high))
}

/// The value and the unit of a number with its sign.
fn literal(quantity: &mut Quantity) -> Option<(f64, &mut Option<Unit>)> {
    match quantity {
        Quantity::Number(number, unit, _) => Some((*number, unit)),
        Quantity::Negative(inner, _) => literal(inner).map(|(number, unit)| (-number, unit)),
        _ => None,
    }
}
