//! Parses tokens into a tree.

use super::LocatedError;
use super::lex::{Token, tokens};
use super::tree::{Condition, Function, Operator, Position, Quantity, Relation, SignalName};
use crate::canopen::object::ObjectId;
use crate::device::unit::Unit;
use crate::measure::decode::Wanted;

/// The largest number of operators. Each operator is a level of the tree.
const MAX_OPERATORS: usize = 100;

/// The largest nesting depth of parentheses, signs and `not`.
const MAX_DEPTH: usize = 50;

/// Units in the hint for an unknown unit.
const COMMON_UNITS: &str = "bar, mbar, kPa, MPa, psi, degC, degF, K, mV, mA, Hz, ms";

const RELATIONS: [Relation; 6] =
    [Relation::Less, Relation::AtMost, Relation::Greater, Relation::AtLeast, Relation::Equal, Relation::Unequal];

const KEYWORDS: [&str; 4] = ["in", "and", "or", "not"];

/// The content of parentheses: a value or a condition.
enum Parsed {
    Quantity(Quantity),
    Condition(Condition, Position),
}

impl Parsed {
    fn quantity(self) -> Result<Quantity, LocatedError> {
        match self {
            Parsed::Quantity(quantity) => Ok(quantity),
            Parsed::Condition(_, at) => Err(LocatedError::new(at, "expected a value, found a condition")),
        }
    }

    fn condition(self, end: Position) -> Result<(Condition, Position), LocatedError> {
        match self {
            Parsed::Condition(condition, at) => Ok((condition, at)),
            Parsed::Quantity(quantity) => {
                let hint = match quantity {
                    Quantity::Signal(_) => {
                        "the shell takes an unquoted > or < as a redirection; quote it: 'pressure > 5 bar'"
                    }
                    _ => "examples: pressure < 10 bar, pressure in 9.95..10.05 bar",
                };
                Err(LocatedError::new(end, "expected a comparison: < <= > >= == != or in").hint(hint))
            }
        }
    }
}

/// Parses a condition.
pub(super) fn parse(text: &str) -> Result<Condition, LocatedError> {
    let tokens = tokens(text)?;
    let mut parser = Parser { tokens, next: 0, end: Position(text.len()), depth: 0, operators: 0 };
    let (condition, _) = parser.or()?.condition(parser.at())?;
    match parser.peek() {
        None => Ok(condition),
        Some(token) => {
            let error = LocatedError::new(parser.at(), format!("unexpected {}", spelling(token)));
            Err(match token {
                Token::Sign("<" | "<=" | ">" | ">=" | "==" | "!=") => {
                    error.hint("write a range with \"in\": pressure in 9.95..10.05")
                }
                _ => error,
            })
        }
    }
}

/// Formats a token for an error.
fn spelling(token: &Token) -> String {
    match token {
        Token::Number(number) => number.to_string(),
        Token::Index(index) => format!("0x{index:04X}"),
        Token::Signal(signal) => signal.to_string(),
        Token::Word(word) => format!("\"{word}\""),
        Token::Sign(sign) => format!("\"{sign}\""),
    }
}

struct Parser {
    tokens: Vec<(Token, Position)>,
    next: usize,
    end: Position,
    depth: usize,
    operators: usize,
}

impl Parser {
    fn peek(&self) -> Option<&Token> {
        self.tokens.get(self.next).map(|(token, _)| token)
    }

    fn at(&self) -> Position {
        self.tokens.get(self.next).map_or(self.end, |&(_, at)| at)
    }

    /// Skips the next token if it is `sign`. Returns whether it was skipped.
    fn skip(&mut self, sign: &str) -> bool {
        let is_skipped = match self.peek() {
            Some(Token::Sign(next)) => *next == sign,
            Some(Token::Word(next)) => next == sign,
            _ => false,
        };
        self.next += usize::from(is_skipped);
        is_skipped
    }

    /// Skips the next token, which must be `sign`.
    fn expect(&mut self, sign: &str) -> Result<(), LocatedError> {
        if self.skip(sign) { Ok(()) } else { Err(LocatedError::new(self.at(), format!("expected \"{sign}\""))) }
    }

    /// Counts an operator at the position `at`.
    fn count_operator(&mut self, at: Position) -> Result<(), LocatedError> {
        self.operators += 1;
        if self.operators > MAX_OPERATORS {
            return Err(LocatedError::new(at, format!("too many operators (at most {MAX_OPERATORS})")));
        }
        Ok(())
    }

    /// Parses nested content, one level deeper.
    fn nested<T>(&mut self, parse: impl FnOnce(&mut Parser) -> Result<T, LocatedError>) -> Result<T, LocatedError> {
        if self.depth == MAX_DEPTH {
            return Err(LocatedError::new(self.at(), format!("nested too deeply (at most {MAX_DEPTH} levels)")));
        }
        self.depth += 1;
        let result = parse(self);
        self.depth -= 1;
        result
    }

    fn or(&mut self) -> Result<Parsed, LocatedError> {
        self.joined("or", Parser::and, Condition::Or)
    }

    fn and(&mut self) -> Result<Parsed, LocatedError> {
        self.joined("and", Parser::not, Condition::And)
    }

    fn joined(
        &mut self,
        word: &str,
        side: fn(&mut Parser) -> Result<Parsed, LocatedError>,
        join: fn(Box<Condition>, Box<Condition>) -> Condition,
    ) -> Result<Parsed, LocatedError> {
        let mut left = side(self)?;
        loop {
            let here = self.at();
            if !self.skip(word) {
                return Ok(left);
            }
            self.count_operator(here)?;
            let (condition, at) = left.condition(here)?;
            let (right, _) = side(self)?.condition(self.at())?;
            left = Parsed::Condition(join(Box::new(condition), Box::new(right)), at);
        }
    }

    fn not(&mut self) -> Result<Parsed, LocatedError> {
        let at = self.at();
        if !self.skip("not") {
            return self.comparison();
        }
        let inner = self.nested(Parser::not)?;
        let (inner, _) = inner.condition(self.at())?;
        Ok(Parsed::Condition(Condition::Not(Box::new(inner)), at))
    }

    fn comparison(&mut self) -> Result<Parsed, LocatedError> {
        let start = self.at();
        let left = self.sum()?;
        let at = self.at();
        if self.skip("in") {
            let mut value = left.quantity()?;
            let low = self.sum()?.quantity()?;
            self.expect("..").map_err(|error| error.hint("write \"..\" between the ends of the range: 9.95..10.05"))?;
            let high = self.sum()?.quantity()?;
            let (mut low, mut high) = share_unit(low, high)?;
            self.convert_index(&mut [&mut value, &mut low, &mut high]);
            return Ok(Parsed::Condition(Condition::Within(value, low, high, at), start));
        }
        for relation in RELATIONS {
            if self.skip(relation.as_str()) {
                let mut left = left.quantity()?;
                let mut right = self.sum()?.quantity()?;
                self.convert_index(&mut [&mut left, &mut right]);
                return Ok(Parsed::Condition(Condition::Compare(left, relation, right, at), start));
            }
        }
        Ok(left)
    }

    /// Converts the first index to an object with sub-index 0, if these parts of a comparison contain no signal.
    fn convert_index(&self, parts: &mut [&mut Quantity]) {
        if parts.iter().all(|part| part.is_constant()) {
            parts.iter_mut().any(|part| self.convert_first_index(part));
        }
    }

    fn convert_first_index(&self, part: &mut Quantity) -> bool {
        match part {
            Quantity::Number(_, None, at) => {
                let token = self.tokens.iter().find(|(_, position)| position.0 == at.0);
                let Some(&(Token::Index(index), at)) = token else { return false };
                let what = Wanted::Object(ObjectId::new(index, 0), None);
                *part = Quantity::Signal(SignalName { node: None, what, at });
                true
            }
            Quantity::Number(..) | Quantity::Signal(_) => false,
            Quantity::Negative(inner, _) | Quantity::Absolute(inner, _) | Quantity::Aggregate(_, inner, _) => {
                self.convert_first_index(inner)
            }
            Quantity::Arithmetic(left, _, right, _) => {
                self.convert_first_index(left) || self.convert_first_index(right)
            }
        }
    }

    fn sum(&mut self) -> Result<Parsed, LocatedError> {
        self.chain(Parser::product, [Operator::Add, Operator::Subtract])
    }

    fn product(&mut self) -> Result<Parsed, LocatedError> {
        self.chain(Parser::sign, [Operator::Multiply, Operator::Divide])
    }

    fn chain(
        &mut self,
        part: fn(&mut Parser) -> Result<Parsed, LocatedError>,
        operators: [Operator; 2],
    ) -> Result<Parsed, LocatedError> {
        let mut left = part(self)?;
        loop {
            let at = self.at();
            let Some(operator) = operators.into_iter().find(|operator| self.skip(operator.as_str())) else {
                return Ok(left);
            };
            self.count_operator(at)?;
            let first = left.quantity()?;
            let right = part(self)?.quantity()?;
            left = Parsed::Quantity(Quantity::Arithmetic(Box::new(first), operator, Box::new(right), at));
        }
    }

    fn sign(&mut self) -> Result<Parsed, LocatedError> {
        let at = self.at();
        if !self.skip("-") {
            return self.primary();
        }
        let inner = self.nested(Parser::sign)?.quantity()?;
        Ok(Parsed::Quantity(Quantity::Negative(Box::new(inner), at)))
    }

    fn primary(&mut self) -> Result<Parsed, LocatedError> {
        let at = self.at();
        let Some(token) = self.peek().cloned() else {
            return Err(LocatedError::new(at, "the expression is incomplete"));
        };
        self.next += 1;
        match token {
            Token::Number(number) => Ok(Parsed::Quantity(Quantity::Number(number, self.unit()?, at))),
            Token::Index(index) => Ok(Parsed::Quantity(Quantity::Number(index.into(), self.unit()?, at))),
            Token::Signal(signal) => Ok(Parsed::Quantity(Quantity::Signal(signal))),
            Token::Sign("(") => {
                let inner = self.nested(Parser::or)?;
                self.expect(")")?;
                Ok(match inner {
                    Parsed::Condition(condition, _) => Parsed::Condition(condition, at),
                    quantity @ Parsed::Quantity(_) => quantity,
                })
            }
            Token::Sign("|") => {
                let inner = self.nested(Parser::sum)?.quantity()?;
                self.expect("|")?;
                Ok(Parsed::Quantity(Quantity::Absolute(Box::new(inner), at)))
            }
            Token::Word(word) if !KEYWORDS.contains(&word.as_str()) => self.function_or_signal(&word, at),
            other => Err(LocatedError::new(at, format!("expected a value before {}", spelling(&other)))),
        }
    }

    /// Parses a function if a parenthesis follows, else a signal.
    fn function_or_signal(&mut self, word: &str, at: Position) -> Result<Parsed, LocatedError> {
        if !self.skip("(") {
            if !word.is_ascii() {
                return Err(LocatedError::new(at, format!("\"{word}\" is not a valid signal name")));
            }
            let what = Wanted::Signal(word.to_owned());
            return Ok(Parsed::Quantity(Quantity::Signal(SignalName { node: None, what, at })));
        }
        let Some(function) = Function::ALL.into_iter().find(|function| function.as_str() == word) else {
            let names: Vec<&str> = Function::ALL.into_iter().map(Function::as_str).collect();
            let error = LocatedError::new(at, format!("unknown function {word}()"));
            return Err(error.hint(format!("functions: {}", names.join(", "))));
        };
        let mut inner = self.nested(Parser::sum)?.quantity()?;
        self.expect(")")?;
        self.convert_index(&mut [&mut inner]);
        Ok(Parsed::Quantity(Quantity::Aggregate(function, Box::new(inner), at)))
    }

    /// Parses the unit after a number, if there is one.
    fn unit(&mut self) -> Result<Option<Unit>, LocatedError> {
        let Some(Token::Word(word)) = self.peek().cloned() else { return Ok(None) };
        if KEYWORDS.contains(&word.as_str()) {
            return Ok(None);
        }
        let unit = Unit::from_symbol(&word).ok_or_else(|| {
            let spellings = Unit::spellings(&word);
            if !spellings.is_empty() {
                let message = format!("the unit \"{word}\" is ambiguous: {}", spellings.join(" or "));
                return LocatedError::new(self.at(), message);
            }
            LocatedError::new(self.at(), format!("unknown unit \"{word}\""))
                .hint(format!("common units: {COMMON_UNITS}"))
        })?;
        self.next += 1;
        Ok(Some(self.divided_unit(&word).unwrap_or(unit)))
    }

    /// Parses a denominator after the unit, such as `l/h`, if there is one and the unit exists.
    fn divided_unit(&mut self, numerator: &str) -> Option<Unit> {
        let [Token::Sign("/"), Token::Word(denominator)] = [0, 1]
            .map(|at| self.tokens.get(self.next + at).map(|(token, _)| token.clone()))
            .map(|token| token.unwrap_or(Token::Sign("")))
        else {
            return None;
        };
        let unit = Unit::from_symbol(&format!("{numerator}/{denominator}"))?;
        self.next += 2;
        Some(unit)
    }
}

/// Gives both ends of a range the same unit: in `9.95..10.05 bar` both are in bar. Rejects a reversed range.
fn share_unit(mut low: Quantity, mut high: Quantity) -> Result<(Quantity, Quantity), LocatedError> {
    let at = high.at();
    if let (Some((first, low)), Some((second, high))) = (literal(&mut low), literal(&mut high)) {
        let unit = (*low).or(*high);
        if low.is_none() || high.is_none() {
            (*low, *high) = (unit, unit);
        }
        if low == high && first > second {
            return Err(LocatedError::new(at, format!("the range is reversed: {second} is less than {first}")));
        }
    }
    Ok((low, high))
}

/// Returns the value of a number, with its sign, and its unit.
fn literal(quantity: &mut Quantity) -> Option<(f64, &mut Option<Unit>)> {
    match quantity {
        Quantity::Number(number, unit, _) => Some((*number, unit)),
        Quantity::Negative(inner, _) => literal(inner).map(|(number, unit)| (-number, unit)),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn object_without_sub_index() {
        for (text, meaning) in [
            ("0x2100 > 0", "0x2100:0 > 0"),
            ("0 < 0x2100", "0 < 0x2100:0"),
            ("0x6041 == 0x1237", "0x6041:0 == 4663"),
            ("0x6041 != 0x6042:1", "24641 != 0x6042:1"),
            ("pressure < 0x2100", "pressure < 8448"),
            ("0x2100 in 1..5 and p < 0x2100", "0x2100:0 in 1..5 and p < 8448"),
            ("mean(0x2100) < 0x2000", "mean(0x2100:0) < 8192"),
            ("-|0x2100| < 3", "-|0x2100:0| < 3"),
            ("0x2100/i16 < 0", "0x2100:0/i16 < 0"),
            ("5.0x2100 < 6.0x2100/u8", "5.0x2100:0 < 6.0x2100:0/u8"),
        ] {
            assert_eq!(parse(text).expect("a condition").to_string(), meaning);
        }
    }
}
