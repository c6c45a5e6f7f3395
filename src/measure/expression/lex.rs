//! Splits the text of an expression into tokens.

use super::tree::{Position, SignalName};
use super::{FIGURES, LocatedError};
use crate::canopen::id::NodeId;
use crate::canopen::object::ObjectId;
use crate::canopen::value::DataType;
use crate::measure::decode::Wanted;
use crate::measure::layout::PARTS;

/// A token of an expression.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Token {
    /// `9.95`: finite, not negative.
    Number(f64),
    /// `0x2100`: a number, or the object with this index if the comparison has no other signal.
    Index(u16),
    /// Text that can only be a signal: `5.pressure`, `pressure.status`, `0x6130:1`.
    Signal(SignalName),
    /// A name, a unit, a function or a keyword.
    Word(String),
    /// `<`, `<=`, `..`, `(` …
    Sign(&'static str),
}

/// The signs. Longer ones come first.
const SIGNS: [&str; 16] =
    ["..", "<=", ">=", "==", "!=", "<", ">", "+", "-", "*", "/", "(", ")", "|", "\u{2264}", "\u{2265}"];

/// Signs of programming languages, and what to write instead.
const FOREIGN_SIGNS: [(&str, &str); 3] = [("&&", "and"), ("=", "=="), ("!", "not")];

/// Returns all tokens of a text with their positions.
pub(super) fn tokens(text: &str) -> Result<Vec<(Token, Position)>, LocatedError> {
    let mut tokens = Vec::new();
    let mut at = 0;
    while let Some(rest) = text.get(at..).filter(|rest| !rest.is_empty()) {
        let blank = rest.len() - rest.trim_start().len();
        if blank > 0 {
            at += blank;
            continue;
        }
        let (token, length) = token(rest, Position(at))?;
        tokens.push((token, Position(at)));
        at += length;
    }
    Ok(tokens)
}

/// Returns the first token of a text, and its length in bytes.
fn token(text: &str, at: Position) -> Result<(Token, usize), LocatedError> {
    let first = text.chars().next().unwrap_or_default();
    if first.is_ascii_digit() {
        return number_or_signal(text, at);
    }
    if matches!(first, '"' | '\'') {
        let inner = text[1..].split(first).next().unwrap_or_default();
        let length = inner.len() + 2;
        if inner.trim().is_empty() || length > text.len() {
            return Err(LocatedError::new(at, "the quotes contain no name, or are not closed"));
        }
        let what = Wanted::Signal(inner.trim().to_owned());
        return Ok((Token::Signal(SignalName { node: None, what, at }), length));
    }
    if first == '%' {
        return Ok((Token::Word("%".to_owned()), 1));
    }
    if is_letter(first) {
        let word = name(text);
        if let Some(length) = figure_length(text) {
            let what = Wanted::Signal(text[..length].to_owned());
            return Ok((Token::Signal(SignalName { node: None, what, at }), length));
        }
        if let Some(length) = numbered_name_length(text, word) {
            let what = Wanted::Signal(text[..length].to_owned());
            return Ok((Token::Signal(SignalName { node: None, what, at }), length));
        }
        let part = text[word.len()..].strip_prefix('.').map_or("", name);
        let length = word.len() + 1 + part.len();
        let what = match part {
            "status" => Wanted::Status(word.to_owned()),
            _ if PARTS.iter().any(|(known, _)| *known == part) => Wanted::Signal(text[..length].to_owned()),
            _ => return Ok((Token::Word(word.to_owned()), word.len())),
        };
        return Ok((Token::Signal(SignalName { node: None, what, at }), length));
    }
    if let Some(sign) = SIGNS.into_iter().find(|sign| text.starts_with(sign)) {
        let ascii = match sign {
            "\u{2264}" => "<=",
            "\u{2265}" => ">=",
            sign => sign,
        };
        return Ok((Token::Sign(ascii), sign.len()));
    }
    if let Some((sign, instead)) = FOREIGN_SIGNS.into_iter().find(|(sign, _)| text.starts_with(sign)) {
        return Err(LocatedError::new(at, format!("\"{sign}\" is not supported here; use {instead}")));
    }
    Err(LocatedError::new(at, format!("unexpected character \"{first}\"")))
}

/// Whether a character is a letter of a name or unit. The degree sign and both micro signs are letters.
fn is_letter(character: char) -> bool {
    character.is_ascii_alphabetic() || matches!(character, '\u{b0}' | '\u{b5}' | '\u{3bc}')
}

/// Returns the name at the start of a text. A hyphen between two letters belongs to the name:
/// `oil-pressure` is a name, `a - b` and `a-1` are differences.
fn name(text: &str) -> &str {
    let mut end = 0;
    let mut letters = text.char_indices().peekable();
    let mut previous_joins = false;
    while let Some((at, letter)) = letters.next() {
        let next_is_letter = letters.peek().is_some_and(|&(_, next)| next.is_ascii_alphabetic());
        let is_hyphen = letter == '-' && previous_joins && next_is_letter;
        if !(is_letter(letter) || letter.is_ascii_digit() || letter == '_' || is_hyphen) {
            break;
        }
        previous_joins = letter != '-';
        end = at + letter.len_utf8();
    }
    &text[..end]
}

/// Returns the length of the name of a bus or node figure: `bus.load`, `node.heartbeat.max`.
fn figure_length(text: &str) -> Option<usize> {
    let mut length = FIGURES.into_iter().find(|prefix| text.starts_with(prefix))?.len();
    loop {
        length += name(&text[length..]).len();
        match text[length..].strip_prefix('.').map(name) {
            Some(part) if !part.is_empty() => length += 1,
            _ => return Some(length),
        }
    }
}

/// Returns the length of a name with a sub-index: `ai-input-pv:1`.
fn numbered_name_length(text: &str, word: &str) -> Option<usize> {
    let digits = text[word.len()..].strip_prefix(':')?;
    let length = digits.bytes().take_while(u8::is_ascii_digit).count();
    (length > 0).then_some(word.len() + 1 + length)
}

/// Reads a token that starts with a digit: a number, an object, or a node with a signal.
fn number_or_signal(text: &str, at: Position) -> Result<(Token, usize), LocatedError> {
    let word = alphanumeric(text);
    let rest = &text[word.len()..];
    if rest.starts_with(':') {
        let (object, length) = object(text, at)?;
        let (stated, type_length) = stated_type(&text[length..]);
        let what = Wanted::Object(object, stated);
        return Ok((Token::Signal(SignalName { node: None, what, at }), length + type_length));
    }
    if let Some(index) = index(word) {
        let (stated, type_length) = stated_type(rest);
        let what = Wanted::Object(ObjectId::new(index, 0), stated);
        return Ok(match stated {
            Some(_) => (Token::Signal(SignalName { node: None, what, at }), word.len() + type_length),
            None => (Token::Index(index), word.len()),
        });
    }
    if let Some(signal) = rest.strip_prefix('.')
        && is_signal(signal)
    {
        let node: NodeId =
            word.parse().map_err(|_| LocatedError::new(at, format!("{word} is not a valid node-ID (1 to 127)")))?;
        let inner = Position(at.0 + word.len() + 1);
        let (what, length) = match token(signal, inner)? {
            (Token::Signal(named), length) if named.node.is_none() => (named.what, length),
            (Token::Word(name), length) => (Wanted::Signal(name), length),
            (Token::Index(index), length) => (Wanted::Object(ObjectId::new(index, 0), None), length),
            _ => return Err(LocatedError::new(inner, "expected a signal after the node: 5.pressure")),
        };
        return Ok((Token::Signal(SignalName { node: Some(node), what, at }), word.len() + 1 + length));
    }
    if let Some(digits) = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")) {
        let number = Some(digits).filter(|digits| digits.len() <= 8);
        let number = number.and_then(|digits| u32::from_str_radix(digits, 16).ok());
        let number = number.ok_or_else(|| LocatedError::new(at, format!("\"{word}\" is not a number")))?;
        return Ok((Token::Number(f64::from(number)), word.len()));
    }
    let length = decimal_length(text);
    let number = text[..length].parse().ok().filter(|number: &f64| number.is_finite());
    let number = number.ok_or_else(|| LocatedError::new(at, format!("{} is too large", &text[..length])))?;
    Ok((Token::Number(number), length))
}

/// Parses the index of an object without sub-index: `0x2100`. Lower numbers are the indices of data types.
fn index(word: &str) -> Option<u16> {
    let digits = word.strip_prefix("0x").or_else(|| word.strip_prefix("0X")).filter(|digits| digits.len() == 4)?;
    u16::from_str_radix(digits, 16).ok().filter(|index| *index >= 0x1000)
}

/// Parses the type after an object: `/i16`. Also returns its length. Any other text after the slash is a divisor.
fn stated_type(text: &str) -> (Option<DataType>, usize) {
    let Some(word) = text.strip_prefix('/').map(alphanumeric) else { return (None, 0) };
    match word.parse().ok().filter(|data_type: &DataType| data_type.is_number()) {
        Some(data_type) if word.starts_with(|first: char| first.is_ascii_alphabetic()) => {
            (Some(data_type), 1 + word.len())
        }
        _ => (None, 0),
    }
}

/// Returns the letters and digits at the start of a text.
fn alphanumeric(text: &str) -> &str {
    text.find(|character: char| !character.is_ascii_alphanumeric()).map_or(text, |end| &text[..end])
}

/// Whether the text after `5.` is a signal: a name, or an object.
fn is_signal(text: &str) -> bool {
    let word = alphanumeric(text);
    match word.chars().next() {
        Some(first) if first.is_ascii_digit() => text[word.len()..].starts_with(':') || index(word).is_some(),
        Some(first) => first.is_ascii_alphabetic() && !is_exponent(word),
        None => text.starts_with(['"', '\'']),
    }
}

/// Whether a word is an exponent such as `e3`: `5.e3` is not a signal of node 5.
fn is_exponent(word: &str) -> bool {
    let digits = word.trim_start_matches(['e', 'E']);
    word.len() == digits.len() + 1 && !digits.is_empty() && digits.bytes().all(|digit| digit.is_ascii_digit())
}

/// Returns the length of the decimal number at the start of a text: `9`, `9.95`, `1.25e-3`. In `9..10` it is 1.
fn decimal_length(text: &str) -> usize {
    let digits = |from: usize| text[from..].bytes().take_while(u8::is_ascii_digit).count();
    let mut length = digits(0);
    if text[length..].starts_with('.') && digits(length + 1) > 0 {
        length += 1 + digits(length + 1);
    }
    if text[length..].starts_with(['e', 'E']) {
        let sign = usize::from(text[length + 1..].starts_with(['+', '-']));
        let exponent = digits(length + 1 + sign);
        if exponent > 0 {
            length += 1 + sign + exponent;
        }
    }
    length
}

/// Reads an object at the start of a text: `0x6130:1`.
fn object(text: &str, at: Position) -> Result<(ObjectId, usize), LocatedError> {
    let end = text.find(|character: char| !(character.is_ascii_alphanumeric() || character == ':'));
    let word = end.map_or(text, |end| &text[..end]);
    let object = word.parse().map_err(|error| LocatedError::new(at, format!("{error}")))?;
    Ok((object, word.len()))
}
